//! The two forms of a finished sub-domain: sealed chunks, and working pages.
//!
//! Both hold the same records in the same order under the same numbers, and readers return the same.

use tetdb_schema::chunk::{ChunkAddress, ChunkRecord, Decoder, PackedChunk, Packer};
use tetdb_schema::page::PageError;
use tetdb_schema::unsealed::{PageDecoder, PagePacker, PageRecord, PageSet, WorkingWords};

use super::SealedError;
use tetdb_base::storage::{StorageError, StoreFile};
use tetdb_schema::catalog::SubdomainState;
use tetdb_schema::word::Word;

/// How the records of a finished sub-domain are stored. The form does not shape the mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Form {
    /// Sorted and packed into chunks.
    #[default]
    Packed,
    /// As working pages: six times the bytes, nothing to unpack, neighbors at hand.
    Pages,
}

impl Word for Form {
    const WORDS: &'static [(Self, &'static str)] =
        &[(Self::Packed, "packed"), (Self::Pages, "none")];
}

impl Form {
    /// The form of a finished sub-domain; `None` for one that is not finished.
    pub fn from_state(state: SubdomainState) -> Option<Self> {
        match state {
            SubdomainState::Sealed => Some(Self::Packed),
            SubdomainState::Optimized => Some(Self::Pages),
            SubdomainState::Coarse | SubdomainState::Saturated => None,
        }
    }

    /// The state of a sub-domain finished in this form.
    pub fn state(self) -> SubdomainState {
        match self {
            Self::Packed => SubdomainState::Sealed,
            Self::Pages => SubdomainState::Optimized,
        }
    }
}

/// Records that belong together, and the values to store for them.
pub(super) struct Cut<R> {
    pub first: u32,
    pub records: Vec<R>,
    pub values: Vec<(u64, Vec<u8>)>,
}

impl<R> Cut<R> {
    /// Bytes to store.
    pub fn bytes(&self) -> u32 {
        self.values.iter().map(|(_, value)| value.len() as u32).sum()
    }
}

impl<R> From<PackedChunk<R>> for Cut<R> {
    fn from(chunk: PackedChunk<R>) -> Self {
        Self {
            first: chunk.first,
            records: chunk.records,
            values: vec![(chunk.address.key(), chunk.value)],
        }
    }
}

impl<R> From<PageSet<R>> for Cut<R> {
    fn from(page: PageSet<R>) -> Self {
        Self { first: page.first, records: page.records, values: page.values }
    }
}

/// Cuts a stream of records.
pub(super) enum Cutter<R> {
    Chunks(Box<Packer<R>>),
    Pages(PagePacker<R>),
}

impl<R: PageRecord> Cutter<R> {
    /// Errors: those of zstd.
    pub fn new(form: Form, subdomain: u32, generation: u32) -> std::io::Result<Self> {
        Ok(match form {
            Form::Packed => Self::Chunks(Box::new(Packer::new(subdomain, generation)?)),
            Form::Pages => Self::Pages(PagePacker::new(subdomain, generation)),
        })
    }

    /// Takes a record; `working` converts it for a page. Errors: those of zstd.
    #[inline]
    pub fn push(
        &mut self,
        record: R,
        working: impl FnOnce(R) -> WorkingWords,
    ) -> std::io::Result<Option<Cut<R>>> {
        Ok(match self {
            Self::Chunks(packer) => packer.push(record)?.map(Cut::from),
            Self::Pages(packer) => packer.push(record, working(record)).map(Cut::from),
        })
    }

    /// Cuts the remaining records, one chunk or page at a time. Errors: those of zstd.
    pub fn cut(&mut self) -> std::io::Result<Option<Cut<R>>> {
        Ok(match self {
            Self::Chunks(packer) => packer.cut()?.map(Cut::from),
            Self::Pages(packer) => packer.cut().map(Cut::from),
        })
    }

    /// Records taken so far.
    pub fn count(&self) -> u64 {
        match self {
            Self::Chunks(packer) => packer.count(),
            Self::Pages(packer) => packer.count(),
        }
    }

    /// Chunks, or pages, so far.
    pub fn chunks(&self) -> u32 {
        match self {
            Self::Chunks(packer) => packer.chunks(),
            Self::Pages(packer) => packer.pages(),
        }
    }
}

/// Reads page number `address.chunk`.
type ReadPage<R> =
    fn(&mut StoreFile, &mut PageDecoder, ChunkAddress, &mut Vec<R>) -> Result<u32, SealedError>;

/// Reads the chunks or pages of a [`Cutter`].
pub(super) enum Loader<R> {
    Chunks(Decoder<R>),
    Pages { frames: PageDecoder, read: ReadPage<R> },
}

impl<R: ChunkRecord> Loader<R> {
    /// A loader of chunks. Errors: those of zstd.
    pub fn chunks() -> std::io::Result<Self> {
        Ok(Self::Chunks(Decoder::new()?))
    }

    /// Replaces `records` by those of a chunk or page; returns the number of the first. Errors: damage.
    pub fn load(
        &mut self,
        file: &mut StoreFile,
        address: ChunkAddress,
        records: &mut Vec<R>,
    ) -> Result<u32, SealedError> {
        let decoder = match self {
            Self::Chunks(decoder) => decoder,
            Self::Pages { frames, read } => return read(file, frames, address, records),
        };
        let read = file.read(address.key(), |value| decoder.decode(value, address, records))?;
        match read {
            Some(Ok(first)) => Ok(first),
            Some(Err(source)) => Err(SealedError::Chunk { path: file.path().to_owned(), source }),
            None => Err(missing(file, address, "chunk")),
        }
    }
}

impl<R: PageRecord> Loader<R> {
    /// A loader of a sub-domain's records in either form. Errors: those of zstd.
    pub fn new(form: Form, (subdomain, generation): (u32, u32)) -> std::io::Result<Self> {
        Ok(match form {
            Form::Packed => Self::chunks()?,
            Form::Pages => Self::Pages {
                frames: PageDecoder::new(subdomain, generation),
                read: read_page::<R>,
            },
        })
    }
}

fn missing(file: &StoreFile, address: ChunkAddress, what: &str) -> SealedError {
    let what = format!("{:?} {what} {} is missing", address.kind, address.chunk);
    SealedError::content(file.path(), address.subdomain, what)
}

fn read_page<R: PageRecord>(
    file: &mut StoreFile,
    frames: &mut PageDecoder,
    address: ChunkAddress,
    records: &mut Vec<R>,
) -> Result<u32, SealedError> {
    let page = address.chunk;
    let damaged = |file: &StoreFile, source: PageError| {
        SealedError::Storage(StorageError::Page { path: file.path().to_owned(), source })
    };
    let (main, extra) = PageDecoder::keys::<R>(page);
    match file.read(main, |value| frames.open::<R>(page, value))? {
        Some(opened) => opened.map_err(|e| damaged(file, e))?,
        None => return Err(missing(file, address, "page")),
    }
    if let Some(extra) = extra {
        match file.read(extra, |value| frames.open_extra::<R>(page, value))? {
            Some(opened) => opened.map_err(|e| damaged(file, e))?,
            None => return Err(missing(file, address, "attribute page")),
        }
    }
    frames.records(page, records).map_err(|e| damaged(file, e))
}
