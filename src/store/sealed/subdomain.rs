//! The reader of a finished sub-domain: its vertices, tetrahedra and faces.
//!
//! Reading streams chunk by chunk, so memory stays bounded whatever the size of the sub-domain.

use std::path::Path;

use tetdb_schema::chunk::{ChunkAddress, ChunkRecord, RangeSummary, TetSummary, VertexSummary};
use tetdb_schema::ids::{SubdomainId, TetId};
use tetdb_schema::record::{InterfaceFace, SealedFacet, SealedTet, SealedVertex};
use tetdb_schema::unsealed::PageRecord;

use super::SealedError;
use super::form::Loader;
use super::writer::CHUNK_KINDS;
use super::{Corner, Form, VertexCache};
use tetdb_base::storage::{DiskPath, RunContext, StorageError, StoreFile};
use tetdb_schema::catalog::SubdomainRow;

/// A finished sub-domain open for reading, whatever its form.
pub struct Subdomain {
    id: SubdomainId,
    form: Form,
    row: SubdomainRow,
    file: StoreFile,
    tet_chunks: Vec<TetSummary>,
    vertex_chunks: Vec<VertexSummary>,
    cache: VertexCache,
}

/// Decoded records; the first has number `first`.
pub struct Chunk<R> {
    /// Number of the first record in the sub-domain.
    pub first: u32,
    /// The records, in order.
    pub records: Vec<R>,
}

/// The chunks of one kind, in order; ends after the first error.
pub struct Chunks<'a, R> {
    pub(super) file: &'a mut StoreFile,
    pub(super) loader: Loader<R>,
    pub(super) address: ChunkAddress,
    pub(super) end: u32,
    pub(super) expected: u64,
    pub(super) total: u64,
}

impl Subdomain {
    /// Opens the sub-domain of `row` at `path` with `memory_bytes` for redb's cache and decoded vertices.
    ///
    /// The row may be that of a kept stage. Errors: [`SealedError::NotSealed`]; damage.
    pub fn open(
        path: &DiskPath,
        row: SubdomainRow,
        memory_bytes: usize,
    ) -> Result<Self, SealedError> {
        let rank = row.rank;
        let form = Form::from_state(row.state).ok_or_else(|| SealedError::NotSealed {
            path: path.path().to_owned(),
            subdomain: rank,
        })?;
        let damaged = |what: String| SealedError::content(path.path(), rank, what);
        let id = SubdomainId::new(rank).ok_or_else(|| damaged("its rank is too high".into()))?;
        if !path.is_file() {
            return Err(damaged("its file is missing".into()));
        }
        let mut file = StoreFile::open_repaired(path, memory_bytes / 2, false)?;
        let tet_chunks = summaries::<TetSummary>(&mut file, &row)?;
        let vertex_chunks = summaries::<VertexSummary>(&mut file, &row)?;
        // These are read only because damage in them is damage too.
        let facets = summaries::<RangeSummary<false>>(&mut file, &row)?;
        let faces = summaries::<RangeSummary<true>>(&mut file, &row)?;
        let tets = n_records(tet_chunks.iter().map(|s| [s.first, s.count]));
        let vertices = n_records(vertex_chunks.iter().map(|s| [s.first, s.count]));
        let facets = n_records(facets.iter().map(|s| [s.first, s.count]));
        let faces = n_records(faces.iter().map(|s| [s.first, s.count]));
        let (Some(tets), Some(vertices), Some(facets), Some(faces)) =
            (tets, vertices, facets, faces)
        else {
            return Err(damaged("the summaries of its chunks do not follow each other".to_owned()));
        };
        if facets != row.facets || faces != row.interface_faces {
            return Err(damaged(format!(
                "its chunks hold {facets} facets and {faces} interface faces, the catalog counts {} and {}",
                row.facets, row.interface_faces
            )));
        }
        if tets != row.tets || vertices != row.vertices || vertices > u64::from(u32::MAX) {
            return Err(damaged(format!(
                "its chunks hold {tets} tetrahedra and {vertices} vertices, the catalog counts {} and {}",
                row.tets, row.vertices
            )));
        }
        let cache = VertexCache::new(
            form,
            (rank, row.generation),
            vertex_chunks.iter().map(|s| s.first).collect(),
            vertices as u32,
            memory_bytes / 2,
        );
        Ok(Self {
            id,
            form,
            cache: cache.map_err(|e| SealedError::io(path.path(), e))?,
            row,
            file,
            tet_chunks,
            vertex_chunks,
        })
    }

    /// Compares the whole file with redb's checksums; chunks have their own checksums, which are compared at every read.
    ///
    /// Errors: damage.
    pub fn check(&self) -> Result<(), SealedError> {
        Ok(self.file.check()?)
    }

    /// Rank of the sub-domain.
    pub fn id(&self) -> SubdomainId {
        self.id
    }

    /// Row of the sub-domain in the catalog.
    pub fn row(&self) -> &SubdomainRow {
        &self.row
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        self.file.path()
    }

    /// Damage in the file of the sub-domain.
    pub fn damaged(&self, what: impl Into<String>) -> SealedError {
        SealedError::content(self.path(), self.id.rank(), what)
    }

    /// Summaries of the chunks of tetrahedra.
    pub fn tet_summaries(&self) -> &[TetSummary] {
        &self.tet_chunks
    }

    /// Summaries of the chunks of vertices.
    pub fn vertex_summaries(&self) -> &[VertexSummary] {
        &self.vertex_chunks
    }

    /// Chunks of vertices read so far.
    pub fn vertex_chunks_read(&self) -> impl Iterator<Item = u32> {
        self.cache.chunks_read()
    }

    /// The chunk a vertex is in.
    pub fn vertex_chunk_of(&self, v: u32) -> usize {
        self.cache.chunk_of(v)
    }

    /// Vertex `v` of the sub-domain, from the cache of decoded chunks.
    ///
    /// Errors: damage; a number no vertex has.
    #[inline]
    pub fn corner(&mut self, v: u32) -> Result<Corner, SealedError> {
        self.cache.corner(&mut self.file, v)
    }

    /// The corners of a tetrahedron or face.
    ///
    /// Errors: damage; a number no vertex has.
    #[inline]
    pub fn corners<const N: usize>(
        &mut self,
        vertices: [u32; N],
    ) -> Result<[Corner; N], SealedError> {
        self.cache.corners(&mut self.file, vertices)
    }

    /// All tetrahedra with their ids, in order.
    pub fn tets(&mut self) -> impl Iterator<Item = Result<(TetId, SealedTet), SealedError>> + '_ {
        let id = self.id;
        let path = self.file.path().to_owned();
        flatten(self.tet_chunks()).map(move |item| {
            let (place, tet) = item?;
            let id = TetId::new(id, place).ok_or_else(|| {
                SealedError::content(&path, id.rank(), format!("tetrahedron {place} has no id"))
            })?;
            Ok((id, tet))
        })
    }

    /// All vertices in order.
    pub fn vertices(&mut self) -> impl Iterator<Item = Result<SealedVertex, SealedError>> + '_ {
        flatten(self.vertex_chunks()).map(|item| item.map(|(_, v)| v))
    }

    /// All facets in order.
    pub fn facets(&mut self) -> impl Iterator<Item = Result<SealedFacet, SealedError>> + '_ {
        flatten(self.facet_chunks()).map(|item| item.map(|(_, f)| f))
    }

    /// All faces shared with other sub-domains; reads no file of theirs.
    pub fn interfaces(&mut self) -> impl Iterator<Item = Result<InterfaceFace, SealedError>> + '_ {
        flatten(self.interface_chunks()).map(|item| item.map(|(_, f)| f))
    }

    /// The tetrahedra a chunk at a time.
    pub fn tet_chunks(&mut self) -> Chunks<'_, SealedTet> {
        let total = self.row.tets;
        self.chunks(total)
    }

    /// The vertices a chunk at a time.
    pub fn vertex_chunks(&mut self) -> Chunks<'_, SealedVertex> {
        let total = self.row.vertices;
        self.chunks(total)
    }

    /// The facets a chunk at a time.
    pub fn facet_chunks(&mut self) -> Chunks<'_, SealedFacet> {
        let total = self.row.facets;
        self.chunks(total)
    }

    /// The interface faces a chunk at a time.
    pub fn interface_chunks(&mut self) -> Chunks<'_, InterfaceFace> {
        let total = self.row.interface_faces;
        self.chunks(total)
    }

    /// Reads and checks one chunk of tetrahedra.
    ///
    /// Errors: damage.
    pub fn tet_chunk(&mut self, chunk: u32) -> Result<Chunk<SealedTet>, SealedError> {
        self.tet_chunks().at(chunk)
    }

    /// Reads and checks one chunk of vertices.
    ///
    /// Errors: damage.
    pub fn vertex_chunk(&mut self, chunk: u32) -> Result<Chunk<SealedVertex>, SealedError> {
        self.vertex_chunks().at(chunk)
    }

    /// Reads and checks one chunk of facets.
    ///
    /// Errors: damage.
    pub fn facet_chunk(&mut self, chunk: u32) -> Result<Chunk<SealedFacet>, SealedError> {
        self.facet_chunks().at(chunk)
    }

    /// Reads and checks one chunk of interface faces.
    ///
    /// Errors: damage.
    pub fn interface_chunk(&mut self, chunk: u32) -> Result<Chunk<InterfaceFace>, SealedError> {
        self.interface_chunks().at(chunk)
    }

    fn chunks<R: PageRecord>(&mut self, total: u64) -> Chunks<'_, R> {
        Chunks {
            address: address::<R>(&self.row),
            end: n_chunks::<R>(&self.row),
            loader: Loader::new(self.form, (self.row.rank, self.row.generation))
                .expect("zstd makes a context whenever there is memory"),
            file: &mut self.file,
            expected: 0,
            total,
        }
    }
}

fn address<R: ChunkRecord>(row: &SubdomainRow) -> ChunkAddress {
    ChunkAddress { kind: R::KIND, subdomain: row.rank, generation: row.generation, chunk: 0 }
}

fn n_chunks<R: ChunkRecord>(row: &SubdomainRow) -> u32 {
    let place = CHUNK_KINDS.iter().position(|&k| k == R::KIND);
    row.chunks[place.expect("every kind is listed")]
}

/// Number of records in chunks of these first records and counts; `None` if a chunk does not begin at the end of the one before.
fn n_records(mut chunks: impl Iterator<Item = [u32; 2]>) -> Option<u64> {
    chunks.try_fold(0, |n, [first, count]| (u64::from(first) == n).then_some(n + u64::from(count)))
}

/// All summaries of one kind: some ten bytes per thousand tetrahedra.
fn summaries<R: ChunkRecord>(
    file: &mut StoreFile,
    row: &SubdomainRow,
) -> Result<Vec<R>, SealedError> {
    let mut loader = Loader::chunks().map_err(|e| SealedError::io(file.path(), e))?;
    let (mut all, mut block) = (Vec::new(), Vec::new());
    for chunk in 0..n_chunks::<R>(row) {
        let address = ChunkAddress { chunk, ..address::<R>(row) };
        loader.load(file, address, &mut block)?;
        all.append(&mut block);
    }
    Ok(all)
}

/// Records one by one with their numbers.
fn flatten<'a, R: ChunkRecord + 'a>(
    chunks: Chunks<'a, R>,
) -> impl Iterator<Item = Result<(u32, R), SealedError>> + 'a {
    chunks.flat_map(|chunk| {
        let (chunk, error) = match chunk {
            Ok(chunk) => (Some(chunk), None),
            Err(error) => (None, Some(Err(error))),
        };
        let records = chunk.into_iter();
        let records = records.flat_map(|c| (c.first..).zip(c.records).map(Ok));
        records.chain(error)
    })
}

impl<R: ChunkRecord> Chunks<'_, R> {
    fn at(&mut self, chunk: u32) -> Result<Chunk<R>, SealedError> {
        self.address.chunk = chunk;
        self.load()
    }

    fn load(&mut self) -> Result<Chunk<R>, SealedError> {
        if RunContext::is_current_cancelled() {
            return Err(StorageError::Cancelled.into());
        }
        let mut records = Vec::new();
        let first = self.loader.load(self.file, self.address, &mut records)?;
        Ok(Chunk { first, records })
    }

    fn contradiction(&self, what: String) -> SealedError {
        SealedError::content(self.file.path(), self.address.subdomain, what)
    }
}

impl<R: ChunkRecord> Iterator for Chunks<'_, R> {
    type Item = Result<Chunk<R>, SealedError>;

    fn next(&mut self) -> Option<Self::Item> {
        let (kind, chunk) = (self.address.kind, self.address.chunk);
        if chunk >= self.end {
            let (found, total) = (self.expected, self.total);
            self.expected = total;
            return (found != total).then(|| {
                Err(self.contradiction(format!(
                    "its {kind:?} chunks hold {found}, the catalog counts {total}"
                )))
            });
        }
        let loaded = self.load().and_then(|c| {
            if u64::from(c.first) == self.expected {
                return Ok(c);
            }
            Err(self.contradiction(format!(
                "{kind:?} chunk {chunk} starts at {}, expected {}",
                c.first, self.expected
            )))
        });
        match &loaded {
            Ok(c) => {
                self.expected += c.records.len() as u64;
                self.address.chunk += 1;
            }
            Err(_) => {
                self.address.chunk = self.end;
                self.expected = self.total;
            }
        }
        Some(loaded)
    }
}
