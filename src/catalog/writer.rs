//! Makes the file of a sealed sub-domain: vertices, then tetrahedra, then faces, each a stream.

use std::collections::BTreeMap;

use rayon::prelude::*;
use tetdb_schema::chunk::{
    ChunkKind, ChunkRecord, Packed, Packer, RangeSummary, TetSummary, VertexSummary,
};
use tetdb_schema::digest::Digest;
use tetdb_schema::ids::{SubdomainId, TetId};
use tetdb_schema::record::{FACES, InterfaceFace, SealedFacet, SealedTet, SealedVertex};

use super::records::{QualityRow, SubdomainRow, SubdomainState};
use super::{
    CatalogError, Corner, FacePairs, Paired, QUALITY_BINS, Shape, VertexCache, quality_bin,
    sorted_face,
};
use crate::geom::{Aabb, Point};
use crate::store::{DiskPath, StoreFile};

/// Most bytes of one commit; redb's cache is three times a batch, or every page is written twice.
const BATCH_BYTES_MAX: usize = 16 << 20;

/// One side of an interface as this sub-domain has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InterfaceSide {
    pub cut: u32,
    /// The sub-domain on the other side.
    pub other: u32,
    pub faces: u64,
    pub digest: Digest,
}

/// What a region has in this sub-domain.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct RegionTotals {
    pub tets: u64,
    /// Summed in the sealed order.
    pub volume: f64,
}

/// What was sealed.
#[derive(Clone, Debug)]
pub struct Sealed {
    /// The row to put into the catalog.
    pub row: SubdomainRow,
    pub regions: BTreeMap<u32, RegionTotals>,
    /// By cut, then by the other sub-domain.
    pub interfaces: Vec<InterfaceSide>,
}

/// Values waiting for a commit.
pub(super) struct Batch {
    values: Vec<(u64, Vec<u8>)>,
    bytes: usize,
    bytes_max: usize,
}

impl Batch {
    /// A batch that fits redb's cache, half of `memory_bytes`.
    pub(super) fn of(memory_bytes: usize) -> Self {
        Self {
            values: Vec::new(),
            bytes: 0,
            bytes_max: (memory_bytes / 6).min(BATCH_BYTES_MAX),
        }
    }

    pub(super) fn push(
        &mut self,
        file: &mut StoreFile,
        key: u64,
        value: Vec<u8>,
    ) -> Result<(), CatalogError> {
        self.bytes += value.len();
        self.values.push((key, value));
        if self.bytes >= self.bytes_max {
            self.flush(file)?;
        }
        Ok(())
    }

    pub(super) fn flush(&mut self, file: &mut StoreFile) -> Result<(), CatalogError> {
        file.write(self.values.iter().map(|(key, value)| (*key, &value[..])))?;
        self.values.clear();
        self.bytes = 0;
        Ok(())
    }
}

/// Writes one sub-domain, once.
///
/// Order of calls: all vertices, all tetrahedra, then facets and interface faces. The file holds
/// nothing that counts until [`SealedWriter::finish`] returns and the catalog lists it.
/// Memory: about the bytes given, for redb's cache, the batch and decoded vertices.
pub struct SealedWriter {
    path: DiskPath,
    file: StoreFile,
    subdomain: SubdomainId,
    generation: u32,
    memory_bytes: usize,
    batch: Batch,
    vertices: Packer<SealedVertex>,
    vertex_chunks: Vec<VertexSummary>,
    cache: Option<VertexCache>,
    tets: Packer<SealedTet>,
    tet_chunks: Vec<TetSummary>,
    facets: Packer<SealedFacet>,
    facet_chunks: Vec<RangeSummary<false>>,
    faces: Packer<InterfaceFace>,
    face_chunks: Vec<RangeSummary<true>>,
    pairs: FacePairs,
    totals: Totals,
    interfaces: BTreeMap<(u32, u32), (u64, Digest)>,
}

/// What is summed over tetrahedra, in their order.
struct Totals {
    digest: Digest,
    bounds: Aabb,
    bins: [u64; QUALITY_BINS],
    worst: f64,
    worst_tet: u32,
    cosines: [f64; 2],
    volume: f64,
    regions: BTreeMap<u32, RegionTotals>,
}

fn array(bounds: &Aabb) -> [[f64; 3]; 2] {
    [bounds.low.to_array(), bounds.high.to_array()]
}

impl SealedWriter {
    /// Starts the file of `subdomain` in `generation` at `path`, which must not exist.
    ///
    /// Errors: the file cannot be made.
    pub fn create(
        path: impl Into<DiskPath>,
        subdomain: SubdomainId,
        generation: u32,
        memory_bytes: usize,
    ) -> Result<Self, CatalogError> {
        let path = path.into();
        let file = StoreFile::create_unsynced(&path, memory_bytes / 2)?;
        let name = path.path().to_owned();
        let io = |e| CatalogError::io(&name, e);
        let rank = subdomain.rank();
        Ok(Self {
            path,
            file,
            subdomain,
            generation,
            memory_bytes,
            batch: Batch::of(memory_bytes),
            vertices: Packer::new(rank, generation).map_err(io)?,
            vertex_chunks: Vec::new(),
            cache: None,
            tets: Packer::new(rank, generation).map_err(io)?,
            tet_chunks: Vec::new(),
            facets: Packer::new(rank, generation).map_err(io)?,
            facet_chunks: Vec::new(),
            faces: Packer::new(rank, generation).map_err(io)?,
            face_chunks: Vec::new(),
            pairs: FacePairs::new(SealedTet::COUNT_MAX),
            totals: Totals {
                digest: Digest::default(),
                bounds: Aabb::EMPTY,
                bins: [0; QUALITY_BINS],
                worst: 0.0,
                worst_tet: 0,
                cosines: [1.0, -1.0],
                volume: 0.0,
                regions: BTreeMap::new(),
            },
            interfaces: BTreeMap::new(),
        })
    }

    /// The next vertex; its number is its place in the stream.
    ///
    /// Errors: the disk.
    pub fn push_vertex(&mut self, vertex: SealedVertex) -> Result<(), CatalogError> {
        assert!(self.cache.is_none(), "vertices come before tetrahedra");
        if let Some(chunk) = self.vertices.push(vertex).map_err(self.io())? {
            self.put_vertices(chunk)?;
        }
        Ok(())
    }

    fn io(&self) -> impl Fn(std::io::Error) -> CatalogError + use<> {
        let path = self.path.path().to_owned();
        move |e| CatalogError::io(&path, e)
    }

    fn put_vertices(&mut self, chunk: Packed<SealedVertex>) -> Result<(), CatalogError> {
        let points = chunk.records.iter().map(|v| Point::from_array(v.point));
        let bounds = Aabb::around(points);
        self.totals.bounds = self.totals.bounds.with(bounds.low).with(bounds.high);
        self.vertex_chunks.push(VertexSummary {
            bounds: array(&bounds),
            first: chunk.first,
            count: chunk.records.len() as u32,
        });
        self.batch
            .push(&mut self.file, chunk.address.key(), chunk.value)
    }

    /// Ends the stream of vertices: from now on they can be read.
    fn end_vertices(&mut self) -> Result<(), CatalogError> {
        if self.cache.is_some() {
            return Ok(());
        }
        while let Some(chunk) = self.vertices.cut().map_err(self.io())? {
            self.put_vertices(chunk)?;
        }
        self.batch.flush(&mut self.file)?;
        let firsts = self.vertex_chunks.iter().map(|s| s.first).collect();
        let cache = VertexCache::new(
            (self.subdomain.rank(), self.generation),
            firsts,
            self.vertices.count() as u32,
            self.memory_bytes / 4,
        );
        self.cache = Some(cache.map_err(self.io())?);
        Ok(())
    }

    /// The next tetrahedron; its number is its place in the stream. Positive, and stored rotated.
    ///
    /// Smallest when they come sorted by their rotated nodes ([`SealedTet::rotated`]).
    /// Errors: the disk; a vertex that was not pushed.
    pub fn push_tet(&mut self, nodes: [u32; 4], region: u32) -> Result<(), CatalogError> {
        self.end_vertices()?;
        let tet = SealedTet { nodes, region }.rotated();
        assert!(
            self.tets.count() < u64::from(TetId::LOCAL_MAX),
            "sub-domain {} has more tetrahedra than ids",
            self.subdomain
        );
        if let Some(chunk) = self.tets.push(tet).map_err(self.io())? {
            self.put_tets(chunk)?;
        }
        Ok(())
    }

    fn put_tets(&mut self, chunk: Packed<SealedTet>) -> Result<(), CatalogError> {
        let cache = self.cache.as_mut().expect("vertices have ended");
        let mut corners = Vec::with_capacity(chunk.records.len());
        for tet in &chunk.records {
            corners.push(cache.corners(&mut self.file, tet.nodes)?);
        }
        let rank = self.subdomain.rank();
        let mut summary = self.totals.add(chunk.first, &chunk.records, &corners, rank);
        summary.open_faces = count_open(&mut self.pairs, &chunk.records);
        summary.bytes = chunk.value.len() as u32;
        self.tet_chunks.push(summary);
        self.batch
            .push(&mut self.file, chunk.address.key(), chunk.value)
    }

    /// The next facet.
    ///
    /// Errors: the disk.
    pub fn push_facet(&mut self, facet: SealedFacet) -> Result<(), CatalogError> {
        if let Some(chunk) = self.facets.push(facet).map_err(self.io())? {
            self.put_facets(chunk)?;
        }
        Ok(())
    }

    fn put_facets(&mut self, chunk: Packed<SealedFacet>) -> Result<(), CatalogError> {
        self.facet_chunks.push(RangeSummary {
            first: chunk.first,
            count: chunk.records.len() as u32,
        });
        self.batch
            .push(&mut self.file, chunk.address.key(), chunk.value)
    }

    /// The next interface face.
    ///
    /// Errors: the disk; a vertex that was not pushed.
    pub fn push_interface_face(&mut self, face: InterfaceFace) -> Result<(), CatalogError> {
        self.end_vertices()?;
        let cache = self.cache.as_mut().expect("vertices have ended");
        let corners = cache.corners(&mut self.file, face.vertices)?;
        let side = self.interfaces.entry((face.cut, face.other)).or_default();
        side.0 += 1;
        side.1.add_face(corners.map(|c| c.mix), face.cut);
        if let Some(chunk) = self.faces.push(face).map_err(self.io())? {
            self.put_faces(chunk)?;
        }
        Ok(())
    }

    fn put_faces(&mut self, chunk: Packed<InterfaceFace>) -> Result<(), CatalogError> {
        self.face_chunks.push(RangeSummary {
            first: chunk.first,
            count: chunk.records.len() as u32,
        });
        self.batch
            .push(&mut self.file, chunk.address.key(), chunk.value)
    }

    fn put_summaries<R: ChunkRecord>(&mut self, summaries: &[R]) -> Result<u32, CatalogError> {
        let io = self.io();
        let mut packer = Packer::new(self.subdomain.rank(), self.generation).map_err(&io)?;
        let mut blocks = Vec::new();
        for &summary in summaries {
            blocks.extend(packer.push(summary).map_err(&io)?);
        }
        while let Some(block) = packer.cut().map_err(&io)? {
            blocks.push(block);
        }
        for block in blocks {
            self.batch
                .push(&mut self.file, block.address.key(), block.value)?;
        }
        Ok(packer.chunks())
    }

    /// Writes what is left, shrinks the file and closes it.
    ///
    /// Errors: the disk.
    pub fn finish(mut self) -> Result<Sealed, CatalogError> {
        let io = self.io();
        self.end_vertices()?;
        while let Some(chunk) = self.tets.cut().map_err(&io)? {
            self.put_tets(chunk)?;
        }
        while let Some(chunk) = self.facets.cut().map_err(&io)? {
            self.put_facets(chunk)?;
        }
        while let Some(chunk) = self.faces.cut().map_err(&io)? {
            self.put_faces(chunk)?;
        }
        let tets = std::mem::take(&mut self.tet_chunks);
        let vertices = std::mem::take(&mut self.vertex_chunks);
        let facets = std::mem::take(&mut self.facet_chunks);
        let faces = std::mem::take(&mut self.face_chunks);
        let blocks = [
            self.put_summaries(&tets)?,
            self.put_summaries(&vertices)?,
            self.put_summaries(&facets)?,
            self.put_summaries(&faces)?,
        ];
        self.batch.flush(&mut self.file)?;
        self.file.compact()?;
        let bytes = self.path.bytes()?;
        let mut interface_digest = Digest::default();
        let mut interfaces = Vec::with_capacity(self.interfaces.len());
        for ((cut, other), (faces, digest)) in self.interfaces {
            interface_digest.merge(&digest);
            interfaces.push(InterfaceSide {
                cut,
                other,
                faces,
                digest,
            });
        }
        let totals = self.totals;
        let chunks = [
            self.tets.chunks(),
            self.vertices.chunks(),
            self.facets.chunks(),
            self.faces.chunks(),
        ];
        let mut both = [0; 8];
        both[..4].copy_from_slice(&chunks);
        both[4..].copy_from_slice(&blocks);
        let row = SubdomainRow {
            rank: self.subdomain.rank(),
            generation: self.generation,
            state: SubdomainState::Sealed,
            tets: self.tets.count(),
            vertices: self.vertices.count(),
            facets: self.facets.count(),
            interface_faces: self.faces.count(),
            chunks: both,
            digest: totals.digest.lanes,
            interface_digest: interface_digest.lanes,
            quality: totals.quality(),
            volume: totals.volume,
            bounds: array(&totals.bounds),
            bytes,
        };
        Ok(Sealed {
            row,
            regions: totals.regions,
            interfaces,
        })
    }
}

/// Faces of a chunk that have no partner in it.
fn count_open(pairs: &mut FacePairs, tets: &[SealedTet]) -> u32 {
    pairs.clear();
    let mut open = 0u32;
    for tet in tets {
        for corners in FACES {
            let (face, odd) = sorted_face(corners.map(|i| tet.nodes[i]));
            match pairs.add(face, odd, 0) {
                Paired::With(_) => open -= 1,
                Paired::Open => open += 1,
                Paired::Same(_) | Paired::Third => {}
            }
        }
    }
    open
}

impl Totals {
    /// Adds a chunk and returns its summary, but for what only its bytes and faces tell.
    fn add(
        &mut self,
        first: u32,
        tets: &[SealedTet],
        corners: &[[Corner; 4]],
        rank: u32,
    ) -> TetSummary {
        // Shapes in parallel, sums in order: the same for any number of threads.
        let shapes: Vec<Shape> = corners
            .par_iter()
            .with_min_len(1024)
            .map(|c| Shape::of(c.map(|c| c.point)))
            .collect();
        let mut bounds = Aabb::EMPTY;
        let mut summary = TetSummary {
            bounds: [[0.0; 3]; 2],
            volume: 0.0,
            quality: [f32::INFINITY, 0.0],
            regions: [u32::MAX, 0],
            vertices: [u32::MAX, 0],
            first,
            count: tets.len() as u32,
            open_faces: 0,
            bytes: 0,
        };
        for (place, ((tet, corners), shape)) in (first..).zip(tets.iter().zip(corners).zip(&shapes))
        {
            self.digest
                .add_tet(corners.map(|c| c.mix), tet.region, rank);
            bounds = corners.iter().fold(bounds, |b, c| b.with(c.point));
            self.add_shape(place, shape);
            let region = self.regions.entry(tet.region).or_default();
            region.tets += 1;
            region.volume += shape.volume;
            summary.volume += shape.volume;
            let q = shape.quality as f32;
            summary.quality = [summary.quality[0].min(q), summary.quality[1].max(q)];
            let [least, most] = summary.regions;
            summary.regions = [least.min(tet.region), most.max(tet.region)];
            for v in tet.nodes {
                let [least, most] = summary.vertices;
                summary.vertices = [least.min(v), most.max(v)];
            }
        }
        summary.bounds = array(&bounds);
        summary
    }

    fn add_shape(&mut self, place: u32, shape: &Shape) {
        self.bins[quality_bin(shape.quality)] += 1;
        if shape.quality > self.worst {
            self.worst = shape.quality;
            self.worst_tet = place;
        }
        let [least, most] = self.cosines;
        self.cosines = [least.min(shape.cosines[0]), most.max(shape.cosines[1])];
        self.volume += shape.volume;
    }

    fn quality(&self) -> QualityRow {
        let angle = |cosine: f64| cosine.clamp(-1.0, 1.0).acos();
        QualityRow {
            bins: self.bins,
            worst: self.worst,
            worst_tet: self.worst_tet,
            dihedral: [angle(self.cosines[1]), angle(self.cosines[0])],
        }
    }
}

/// The kinds of chunks in the order of [`SubdomainRow::chunks`].
pub(super) const CHUNK_KINDS: [ChunkKind; 8] = [
    ChunkKind::Tets,
    ChunkKind::Vertices,
    ChunkKind::Facets,
    ChunkKind::InterfaceFaces,
    ChunkKind::TetSummaries,
    ChunkKind::VertexSummaries,
    ChunkKind::FacetSummaries,
    ChunkKind::InterfaceSummaries,
];
