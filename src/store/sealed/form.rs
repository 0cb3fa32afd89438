//! The two forms of a finished sub-domain: sealed chunks, and working pages.
//!
//! Both hold the same records in the same order under the same numbers, and readers return the same.

use tetdb_schema::chunk::{ChunkAddress, ChunkRecord, Decoder, PackedChunk, Packer};
use tetdb_schema::page::PageError;
use tetdb_schema::unsealed::{PageDecoder, PagePacker, PageRecord, PageSet, WorkingWords};

use super::SealedError;
use tetdb_base::storage::{StorageError, StoreFile, map_long, spare_threads};
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

/// Records after which chunks begin anew, so that what follows can be packed beside what is before. Some eight full chunks: the last is
/// not full, and takes a place of its own size.
pub(super) const fn segment<R: ChunkRecord>() -> usize {
    8 * R::COUNT_MAX
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
    ) -> std::io::Result<Vec<Cut<R>>> {
        let cut = match self {
            Self::Chunks(packer) => {
                let cut = packer.push(record)?.map(Cut::from);
                if packer.count().is_multiple_of(segment::<R>() as u64) {
                    return self.end_segment(cut);
                }
                cut
            }
            Self::Pages(packer) => packer.push(record, working(record)).map(Cut::from),
        };
        Ok(cut.map_or_else(Vec::new, |cut| vec![cut]))
    }

    fn end_segment(&mut self, before: Option<Cut<R>>) -> std::io::Result<Vec<Cut<R>>> {
        let mut cuts = Vec::from_iter(before);
        while let Some(cut) = self.cut()? {
            cuts.push(cut);
        }
        if let Self::Chunks(packer) = self {
            **packer = packer.next()?;
        }
        Ok(cuts)
    }

    /// Takes records, whole segments of them side by side where a thread is to spare. Errors: those of zstd.
    pub fn push_all<T: Sync>(
        &mut self,
        items: &[T],
        record: impl Fn(&T) -> R + Sync,
        working: impl Fn(&T) -> WorkingWords,
    ) -> std::io::Result<Vec<Cut<R>>> {
        let (segment, mut cuts) = (segment::<R>(), Vec::new());
        let to_next = (segment - self.count() as usize % segment) % segment;
        let (mut now, mut later) = items.split_at(items.len().min(to_next));
        loop {
            for item in now {
                cuts.extend(self.push(record(item), |_| working(item))?);
            }
            (now, later) = match self {
                Self::Chunks(packer) if later.len() >= 2 * segment && spare_threads() > 1 => {
                    let whole = later.chunks_exact(segment);
                    let rest = whole.remainder();
                    for chunk in pack_segments(packer, whole, &record)? {
                        cuts.push(packer.adopt(chunk).into());
                    }
                    **packer = packer.next()?;
                    (rest, &[])
                }
                _ if later.is_empty() => return Ok(cuts),
                _ => (later, &[]),
            };
        }
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

/// Packs segments behind what was packed, side by side; the chunks have no numbers yet. Errors: those of zstd.
fn pack_segments<R: ChunkRecord, T: Sync>(
    packer: &Packer<R>,
    segments: std::slice::ChunksExact<T>,
    record: impl Fn(&T) -> R + Sync,
) -> std::io::Result<Vec<PackedChunk<R>>> {
    let segments: Vec<(usize, &[T])> = segments.enumerate().collect();
    let pack = |&(k, items): &(usize, &[T])| {
        let (mut packer, mut chunks) = (packer.beyond(k * segment::<R>())?, Vec::new());
        for item in items {
            chunks.extend(packer.push(record(item))?);
        }
        while let Some(chunk) = packer.cut()? {
            chunks.push(chunk);
        }
        Ok::<_, std::io::Error>(chunks)
    };
    let packed: Result<Vec<_>, _> = map_long(&segments, pack).into_iter().collect();
    Ok(packed?.into_iter().flatten().collect())
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

#[cfg(test)]
mod tests {
    use super::*;
    use tetdb_base::storage::{CancelToken, RunContext};
    use tetdb_schema::page::NONE;
    use tetdb_schema::record::SealedTet;
    use tetdb_schema::unsealed::TetLinks;

    type Values = Vec<(u64, Vec<u8>)>;

    /// Cuts tetrahedra given some at a time.
    fn values(n_tets: u32, at_once: usize, n_threads: usize) -> std::io::Result<Values> {
        let tets: Vec<_> = (0..n_tets)
            .map(|t| SealedTet {
                nodes: [t / 6, t / 6 + t % 5 + 1, t / 5 + 9, t / 4 + 20],
                region: t >> 16,
            })
            .collect();
        let links = TetLinks { neighbors: [NONE; 4], required: 0, flags: 0 };
        let run = RunContext::new(n_threads, CancelToken::new());
        run.enter(|| {
            let (mut cutter, mut cuts) = (Cutter::new(Form::Packed, 3, 1)?, Vec::new());
            for some in tets.chunks(at_once) {
                cuts.extend(cutter.push_all(some, |&tet| tet, |tet| tet.to_working(&links))?);
            }
            while let Some(cut) = cutter.cut()? {
                cuts.push(cut);
            }
            let records: Vec<_> = cuts.iter().flat_map(|cut| cut.records.iter().copied()).collect();
            assert!(records == tets && cutter.count() == u64::from(n_tets));
            assert_eq!(cutter.chunks() as usize, cuts.len());
            Ok(cuts.into_iter().flat_map(|cut| cut.values).collect())
        })
    }

    #[test]
    fn chunks_depend_neither_on_threads_nor_on_what_comes_at_once() -> std::io::Result<()> {
        let n_tets = 2 * segment::<SealedTet>() as u32 + 70_000;
        let expected = values(n_tets, 50_000, 1)?;
        for (at_once, n_threads) in [(n_tets as usize, 4), (n_tets as usize, 1), (300_000, 4)] {
            assert!(
                values(n_tets, at_once, n_threads)? == expected,
                "{at_once}, {n_threads} threads"
            );
        }
        let whole = values(2 * segment::<SealedTet>() as u32, 600_000, 2)?;
        assert!(expected.starts_with(&whole), "a mesh that ends where a segment ends");
        Ok(())
    }
}
