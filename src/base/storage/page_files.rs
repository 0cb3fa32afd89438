//! The files of a pool: the base that pages are read from, the output, and the scratch file for evicted pages.

use tetdb_schema::page::{
    PageAddress, Slot, check_page, open_page, page_key, seal_page, stored_bytes,
};

use super::page_table::{IN_BASE, IN_SPILL};
use super::spill::Spill;
use super::{DiskPath, StorageError, StoreFile, kind};

/// The files a pool starts from and the file it writes.
pub struct Backing {
    /// Rank of the sub-domain whose pages these are.
    pub subdomain: u32,
    /// Generation being written.
    pub generation: u32,
    /// Folder of the scratch file for pages that leave memory; it must exist by then.
    pub spill: DiskPath,
    /// The file to make of this generation, where each page is written once: all but those of the scratch map go there instead.
    pub output: Option<DiskPath>,
    /// The generation this step started from.
    pub base: Option<StoreFile>,
    /// Bytes redb may cache for a file that is written; half as many for one that is read.
    pub cache_bytes: usize,
}

/// Files as they are opened: a place is one of the page table's, `IN_BASE`, `IN_OUTPUT` or one in the spill.
#[derive(Default)]
pub(super) struct PageFiles {
    backing: Option<Backing>,
    output: Option<StoreFile>,
    spill: Option<Spill>,
}

impl PageFiles {
    pub fn new(backing: Option<Backing>) -> Self {
        Self { backing, ..Self::default() }
    }

    /// Returns whether the pool has files.
    pub fn exist(&self) -> bool {
        self.backing.is_some()
    }

    pub fn subdomain(&self) -> u32 {
        self.backing.as_ref().map_or(0, |b| b.subdomain)
    }

    /// Returns whether pages of this kind go to the output file.
    pub fn goes_to_output(&self, kind: usize) -> bool {
        kind != kind::SCRATCH && self.backing.as_ref().is_some_and(|b| b.output.is_some())
    }

    fn backing(&self) -> &Backing {
        self.backing.as_ref().expect("a pool with a store")
    }

    /// Reads a page that is at `place` into a frame. Errors: the disk, damage.
    pub fn read(
        &mut self,
        place: u32,
        address: PageAddress,
        frame: &mut [Slot],
    ) -> Result<(), StorageError> {
        let damaged =
            |path: &std::path::Path, source| StorageError::Page { path: path.to_owned(), source };
        if place >= IN_SPILL {
            let spill = self.spill.as_ref().expect("a page is in it");
            spill.read(place - IN_SPILL, frame)?;
            let checked = check_page(frame, address);
            return match checked {
                Ok(_) => Ok(()),
                Err(source) => Err(damaged(spill.path().path(), source)),
            };
        }
        let file = match place {
            IN_BASE => self.backing.as_mut().and_then(|b| b.base.as_mut()),
            _ => self.output.as_mut(),
        };
        let file = file.expect("a page that is not resident is in a file");
        let key = page_key(address.kind, address.page);
        let opened = file.read(key, |bytes| open_page(bytes, address, frame))?;
        match opened {
            Some(Ok(_)) => Ok(()),
            Some(Err(source)) => Err(damaged(file.path(), source)),
            None => Err(StorageError::Missing {
                path: file.path().to_owned(),
                what: format!("page {address:?}"),
            }),
        }
    }

    /// Writes a page that was at `place` to the spill; returns where it is then. Errors: the disk.
    pub fn spill(
        &mut self,
        place: u32,
        address: PageAddress,
        frame: &mut [Slot],
    ) -> Result<u32, StorageError> {
        seal_page(frame, address, self.backing().generation);
        if self.spill.is_none() {
            self.spill = Some(Spill::create(&self.backing().spill)?);
        }
        let spill = self.spill.as_mut().expect("just created");
        let at = match place {
            IN_SPILL.. => place - IN_SPILL,
            _ => spill.take(),
        };
        spill.write(at, frame)?;
        Ok(IN_SPILL + at)
    }

    /// Leaves the place of a page to others, if it is in the spill.
    pub fn forget(&mut self, place: u32) {
        if let (IN_SPILL.., Some(spill)) = (place, &mut self.spill) {
            spill.forget(place - IN_SPILL);
        }
    }

    /// Places the spill has, used or not.
    #[cfg(test)]
    pub fn spilled(&self) -> u32 {
        self.spill.as_ref().map_or(0, |spill| spill.end)
    }

    /// Prepares a frame for writing.
    pub fn seal(&self, address: PageAddress, frame: &mut [Slot]) {
        seal_page(frame, address, self.backing().generation);
    }

    /// Writes sealed pages to the output file, in one commit. Errors: the disk.
    pub fn write<'a>(
        &mut self,
        pages: impl Iterator<Item = (PageAddress, &'a [Slot])>,
    ) -> Result<(), StorageError> {
        if self.output.is_none() {
            let backing = self.backing();
            let path = backing.output.as_ref().expect("it makes a file");
            self.output = Some(StoreFile::create_unsynced(path, backing.cache_bytes)?);
        }
        let output = self.output.as_mut().expect("just created");
        output.write(pages.map(|(address, frame)| {
            let key = page_key(address.kind, address.page);
            (key, stored_bytes(frame))
        }))
    }

    /// Begins a file at `path` for all pages there are.
    pub fn begin_file(&mut self, path: DiskPath) {
        let backing = self.backing.as_mut().expect("a pool with a store");
        let before = backing.output.replace(path);
        assert!(before.is_none(), "its pages are in the file it makes");
    }

    /// Closes the output file, with all pages in it, and goes on from it as `generation`. Errors: the disk.
    pub fn end_file(&mut self, generation: u32) -> Result<(), StorageError> {
        self.spill = None;
        if let Some(output) = self.output.take() {
            output.compact()?;
        }
        let backing = self.backing.as_mut().expect("a pool with a store");
        let path = backing.output.take().expect("begun");
        backing.generation = generation;
        let base = StoreFile::open_repaired(path, backing.cache_bytes / 2, false)?;
        backing.base = Some(base);
        Ok(())
    }
}
