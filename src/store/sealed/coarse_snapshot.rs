//! Coarse snapshots: the working meshes that sub-domains are meshed from, kept so that they can be meshed again.
//!
//! A snapshot has a file of its own, so that damage to a sealed sub-domain does not reach its snapshot.

use std::path::Path;

use tetdb_schema::chunk::{ChunkAddress, ChunkRecord, Packer};
use tetdb_schema::record::{CoarseFace, CoarseTet, CoarseVertex, WorkingFacet};

use super::SealedError;
use super::batch::{Batch, cache_bytes};
use super::form::Loader;
use super::subdomain::Chunks;
use tetdb_base::storage::{DiskPath, StoreFile};
use tetdb_schema::catalog::CoarseRow;

/// Writes a coarse snapshot, once: vertices, tetrahedra, facets and interface faces, each in the working mesh's order.
///
/// The file holds nothing that counts until the catalog lists it. Memory: about the bytes given.
pub struct CoarseWriter {
    path: DiskPath,
    file: StoreFile,
    batch: Batch,
    rank: u32,
    generation: u32,
    vertices: Packer<CoarseVertex>,
    tets: Packer<CoarseTet>,
    facets: Packer<WorkingFacet>,
    faces: Packer<CoarseFace>,
}

impl CoarseWriter {
    /// Starts the file of `rank` in `generation` at `path`, which must not exist.
    ///
    /// Errors: the file cannot be created.
    pub fn create(
        path: &DiskPath,
        rank: u32,
        generation: u32,
        memory_bytes: usize,
    ) -> Result<Self, SealedError> {
        let io = |e| SealedError::io(path.path(), e);
        Ok(Self {
            path: path.clone(),
            file: StoreFile::create_unsynced(path, cache_bytes(memory_bytes))?,
            batch: Batch::new(memory_bytes),
            rank,
            generation,
            vertices: Packer::new(rank, generation).map_err(io)?,
            tets: Packer::new(rank, generation).map_err(io)?,
            facets: Packer::new(rank, generation).map_err(io)?,
            faces: Packer::new(rank, generation).map_err(io)?,
        })
    }

    /// Adds a vertex. Errors: the disk.
    pub fn push_vertex(&mut self, vertex: CoarseVertex) -> Result<(), SealedError> {
        push(&mut self.file, &mut self.batch, &mut self.vertices, vertex)
    }

    /// Adds a tetrahedron. Errors: the disk.
    pub fn push_tet(&mut self, tet: CoarseTet) -> Result<(), SealedError> {
        push(&mut self.file, &mut self.batch, &mut self.tets, tet)
    }

    /// The next facet. Errors: the disk.
    pub fn push_facet(&mut self, facet: WorkingFacet) -> Result<(), SealedError> {
        push(&mut self.file, &mut self.batch, &mut self.facets, facet)
    }

    /// Adds an interface face. Errors: the disk.
    pub fn push_face(&mut self, face: CoarseFace) -> Result<(), SealedError> {
        push(&mut self.file, &mut self.batch, &mut self.faces, face)
    }

    /// Writes the remaining records, shrinks the file and closes it; returns its row. Errors: the disk.
    pub fn finish(mut self) -> Result<CoarseRow, SealedError> {
        let (file, batch) = (&mut self.file, &mut self.batch);
        end(file, batch, &mut self.vertices)?;
        end(file, batch, &mut self.tets)?;
        end(file, batch, &mut self.facets)?;
        end(file, batch, &mut self.faces)?;
        batch.flush(file)?;
        self.file.compact()?;
        let bytes = self.path.bytes()?;
        Ok(CoarseRow {
            rank: self.rank,
            generation: self.generation,
            tets: self.tets.count(),
            vertices: self.vertices.count(),
            facets: self.facets.count(),
            interface_faces: self.faces.count(),
            chunks: [
                self.tets.chunks(),
                self.vertices.chunks(),
                self.facets.chunks(),
                self.faces.chunks(),
            ],
            bytes,
        })
    }
}

fn push<R: ChunkRecord>(
    file: &mut StoreFile,
    batch: &mut Batch,
    packer: &mut Packer<R>,
    record: R,
) -> Result<(), SealedError> {
    let packed = packer.push(record);
    match packed.map_err(|e| SealedError::io(file.path(), e))? {
        Some(chunk) => batch.push(file, chunk.address.key(), chunk.value),
        None => Ok(()),
    }
}

fn end<R: ChunkRecord>(
    file: &mut StoreFile,
    batch: &mut Batch,
    packer: &mut Packer<R>,
) -> Result<(), SealedError> {
    loop {
        let packed = packer.cut();
        match packed.map_err(|e| SealedError::io(file.path(), e))? {
            Some(chunk) => batch.push(file, chunk.address.key(), chunk.value)?,
            None => return Ok(()),
        }
    }
}

/// A coarse snapshot open for reading.
pub struct CoarseSnapshot {
    row: CoarseRow,
    file: StoreFile,
}

impl CoarseSnapshot {
    /// Opens the snapshot of `row` at `path` with `cache_bytes` for redb.
    ///
    /// Errors: damage.
    pub fn open(path: &DiskPath, row: CoarseRow, cache_bytes: usize) -> Result<Self, SealedError> {
        if !path.is_file() {
            let what = "the file of its coarse snapshot is missing";
            return Err(SealedError::content(path.path(), row.rank, what));
        }
        let file = StoreFile::open_repaired(path, cache_bytes, false)?;
        Ok(Self { row, file })
    }

    /// Row of the snapshot in the catalog.
    pub fn row(&self) -> &CoarseRow {
        &self.row
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        self.file.path()
    }

    /// Compares the whole file with redb's checksums. Errors: damage.
    pub fn check(&self) -> Result<(), SealedError> {
        Ok(self.file.check()?)
    }

    /// The vertices a chunk at a time.
    pub fn vertices(&mut self) -> Chunks<'_, CoarseVertex> {
        self.chunks(1, self.row.vertices)
    }

    /// The tetrahedra a chunk at a time.
    pub fn tets(&mut self) -> Chunks<'_, CoarseTet> {
        self.chunks(0, self.row.tets)
    }

    /// The facets a chunk at a time.
    pub fn facets(&mut self) -> Chunks<'_, WorkingFacet> {
        self.chunks(2, self.row.facets)
    }

    /// The interface faces a chunk at a time.
    pub fn faces(&mut self) -> Chunks<'_, CoarseFace> {
        self.chunks(3, self.row.interface_faces)
    }

    fn chunks<R: ChunkRecord>(&mut self, kind: usize, total: u64) -> Chunks<'_, R> {
        Chunks {
            address: ChunkAddress {
                kind: R::KIND,
                subdomain: self.row.rank,
                generation: self.row.generation,
                chunk: 0,
            },
            end: self.row.chunks[kind],
            loader: Loader::chunks().expect("zstd makes a context whenever there is memory"),
            file: &mut self.file,
            expected: 0,
            total,
        }
    }
}
