//! Writes the file of a finished sub-domain: vertices, then tetrahedra, then faces, each a stream.

use std::collections::BTreeMap;

use rayon::prelude::*;

use tetdb_schema::chunk::{
    ChunkKind, ChunkRecord, Packer, RangeSummary, TetSummary, VertexSummary,
};
use tetdb_schema::digest::Digest;
use tetdb_schema::ids::{SubdomainId, TetId};
use tetdb_schema::record::{InterfaceFace, SealedFacet, SealedTet, SealedVertex};
use tetdb_schema::unsealed::TetLinks;

use super::SealedError;
use super::batch::{Batch, cache_bytes};
use super::form::{Cut, Cutter, segment};
use super::totals::{ChunkSums, SubdomainTotals, SumScratch, array, count_open};
use super::{FacePairs, Form, VertexCache};
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::{DiskPath, StoreFile, join, map_long, parallel, spare_threads};
use tetdb_schema::catalog::SubdomainRow;
use tetdb_schema::totals::{InterfaceSide, RegionTotals};

/// The result of sealing a sub-domain.
#[derive(Clone, Debug)]
pub struct Sealed {
    /// The row to put into the catalog.
    pub row: SubdomainRow,
    /// Sums of each region with tetrahedra in the sub-domain, by number.
    pub regions: BTreeMap<u32, RegionTotals>,
    /// By cut, then by the other sub-domain.
    pub interfaces: Vec<InterfaceSide>,
}

/// Tetrahedra taken at once by one thread, at most: some chunks, 6 MB.
const TETS_AT_ONCE: usize = 4 * SealedTet::COUNT_MAX;
/// Least memory with which chunks are summed up side by side: each has a table of 4 MB.
const PARALLEL_BYTES: usize = 64 << 20;
/// Bytes of a tetrahedron that is taken, and of its place in the table of faces.
const TET_BYTES: usize = 128;

/// Writes one sub-domain, once.
///
/// Order of calls: all vertices, all tetrahedra, then facets and interface faces. The file holds
/// nothing that counts until [`SealedWriter::finish`] returns and the catalog lists it.
/// Memory: about the bytes given, for redb's cache, the batch, tetrahedra in work and decoded vertices.
pub struct SealedWriter {
    path: DiskPath,
    file: StoreFile,
    subdomain: SubdomainId,
    generation: u32,
    memory_bytes: usize,
    batch: Batch,
    form: Form,
    vertices: Cutter<SealedVertex>,
    vertex_chunks: Vec<VertexSummary>,
    cache: Option<VertexCache>,
    tets: Cutter<SealedTet>,
    /// Tetrahedra that are taken and not yet packed.
    taken: Vec<(SealedTet, TetLinks)>,
    /// Tetrahedra that are packed and not yet summed up and stored.
    packed: Vec<Cut<SealedTet>>,
    tet_chunks: Vec<TetSummary>,
    facets: Cutter<SealedFacet>,
    facet_chunks: Vec<RangeSummary<false>>,
    faces: Cutter<InterfaceFace>,
    face_chunks: Vec<RangeSummary<true>>,
    pairs: FacePairs,
    totals: SubdomainTotals,
    scratch: SumScratch,
    interfaces: BTreeMap<(u32, u32), (u64, Digest)>,
}

impl SealedWriter {
    /// Starts the file of `subdomain` in `generation` at `path`, which must not exist.
    ///
    /// Errors: the file cannot be created.
    pub fn create(
        path: impl Into<DiskPath>,
        subdomain: SubdomainId,
        generation: u32,
        memory_bytes: usize,
    ) -> Result<Self, SealedError> {
        Self::create_as(Form::Packed, path, subdomain, generation, memory_bytes)
    }

    /// Starts the file in either form. Errors: as [`SealedWriter::create`].
    pub fn create_as(
        form: Form,
        path: impl Into<DiskPath>,
        subdomain: SubdomainId,
        generation: u32,
        memory_bytes: usize,
    ) -> Result<Self, SealedError> {
        let path = path.into();
        let file = StoreFile::create_unsynced(&path, cache_bytes(memory_bytes))?;
        let name = path.path().to_owned();
        let io = |e| SealedError::io(&name, e);
        let rank = subdomain.rank();
        Ok(Self {
            path,
            file,
            subdomain,
            generation,
            memory_bytes,
            batch: Batch::new(memory_bytes),
            form,
            vertices: Cutter::new(form, rank, generation).map_err(io)?,
            vertex_chunks: Vec::new(),
            cache: None,
            tets: Cutter::new(form, rank, generation).map_err(io)?,
            taken: Vec::new(),
            packed: Vec::new(),
            tet_chunks: Vec::new(),
            facets: Cutter::new(form, rank, generation).map_err(io)?,
            facet_chunks: Vec::new(),
            faces: Cutter::new(form, rank, generation).map_err(io)?,
            face_chunks: Vec::new(),
            pairs: FacePairs::new(SealedTet::COUNT_MAX),
            totals: SubdomainTotals::default(),
            scratch: SumScratch::default(),
            interfaces: BTreeMap::new(),
        })
    }

    /// Adds a vertex, whose number is its place in the stream.
    ///
    /// Errors: the disk.
    pub fn push_vertex(&mut self, vertex: SealedVertex) -> Result<(), SealedError> {
        self.push_vertices(&[vertex])
    }

    /// Adds vertices; many at once are packed on all free threads.
    ///
    /// Errors: the disk.
    pub fn push_vertices(&mut self, vertices: &[SealedVertex]) -> Result<(), SealedError> {
        assert!(self.cache.is_none(), "vertices come before tetrahedra");
        let rank = self.subdomain.rank();
        let cuts = self.vertices.push_all(vertices, |&v| v, |v| v.to_working(rank));
        self.put_vertices(cuts.map_err(self.io())?)
    }

    fn io(&self) -> impl Fn(std::io::Error) -> SealedError + use<> {
        let path = self.path.path().to_owned();
        move |e| SealedError::io(&path, e)
    }

    fn put_vertices(&mut self, cuts: Vec<Cut<SealedVertex>>) -> Result<(), SealedError> {
        let summary = |cut: &Cut<SealedVertex>| {
            let bounds =
                array(&Aabb::around(cut.records.iter().map(|v| Point::from_array(v.point))));
            VertexSummary {
                cells: VertexSummary::cells_of(&bounds, cut.records.iter().map(|v| v.point)),
                bounds,
                first: cut.first,
                count: cut.records.len() as u32,
            }
        };
        let summaries = map_long(&cuts, summary);
        for (cut, summary) in cuts.into_iter().zip(summaries) {
            let [low, high] = summary.bounds.map(Point::from_array);
            self.totals.bounds = self.totals.bounds.with(low).with(high);
            self.vertex_chunks.push(summary);
            self.put(cut.values)?;
        }
        Ok(())
    }

    /// Ends the stream of vertices, so that they can be read.
    fn end_vertices(&mut self) -> Result<(), SealedError> {
        if self.cache.is_some() {
            return Ok(());
        }
        while let Some(cut) = self.vertices.cut().map_err(self.io())? {
            self.put_vertices(vec![cut])?;
        }
        self.batch.flush(&mut self.file)?;
        let firsts = self.vertex_chunks.iter().map(|s| s.first).collect();
        let cache = VertexCache::new(
            self.form,
            (self.subdomain.rank(), self.generation),
            firsts,
            self.vertices.count() as u32,
            self.memory_bytes / 4,
        );
        self.cache = Some(cache.map_err(self.io())?);
        Ok(())
    }

    /// Adds all tetrahedra by nodes and region: positive, in the order of their numbers.
    ///
    /// Errors: as [`SealedWriter::push_tets`].
    pub fn push_all_tets(
        &mut self,
        tets: impl Iterator<Item = ([u32; 4], u32)> + Send,
    ) -> Result<(), SealedError> {
        let place = TetLinks { neighbors: [tetdb_schema::page::NONE; 4], required: 0, flags: 0 };
        let placed = tets.map(|(nodes, region)| Ok((SealedTet { nodes, region }.rotated(), place)));
        let mut placed = placed.peekable();
        while placed.peek().is_some() {
            self.push_tets::<SealedError>(&mut placed)?;
        }
        Ok(())
    }

    /// Adds some thousands of tetrahedra, rotated ([`SealedTet::rotated`]), each with the data that only a working page keeps. The number of
    /// each is its place in the stream.
    ///
    /// One thread takes tetrahedra, another packs those taken before, and others sum up what was packed before. The file is smallest when they come sorted by their nodes.
    /// Errors: those of `tets`; the disk; a vertex that was not pushed.
    pub fn push_tets<E: From<SealedError> + Send>(
        &mut self,
        tets: &mut (impl Iterator<Item = Result<(SealedTet, TetLinks), E>> + Send),
    ) -> Result<(), E> {
        self.end_vertices()?;
        let (io, rank) = (self.io(), self.subdomain.rank());
        let (taken, before) = (std::mem::take(&mut self.taken), std::mem::take(&mut self.packed));
        let at_once = self.tets_at_once(taken.len());
        let (cutter, pairs) = (&mut self.tets, &mut self.pairs);
        let take = || {
            let mut taken = Vec::with_capacity(at_once);
            for tet in tets.take(at_once) {
                taken.push(tet?);
            }
            Ok::<_, E>(taken)
        };
        let pack =
            || cutter.push_all(&taken, |&(tet, _)| tet, |(tet, place)| tet.to_working(place));
        let cache = self.cache.as_mut().expect("vertices have ended");
        let has_room = self.memory_bytes >= PARALLEL_BYTES;
        let (file, scratch, known) = (&mut self.file, &mut self.scratch, self.totals.cosines);
        let sum_up = || {
            if has_room && let Some(sums) = sum_in_parallel(&before, rank, known, cache, file)? {
                return Ok(sums);
            }
            let sums = before.iter().map(|cut| {
                let corners_of = |tet: &SealedTet| cache.corners(file, tet.nodes);
                let tets = (cut.first, &cut.records[..]);
                let sums = ChunkSums::of(tets, rank, known, scratch, corners_of)?;
                Ok((sums, count_open(pairs, &cut.records)))
            });
            sums.collect::<Result<Vec<_>, SealedError>>()
        };
        let (taken, (packed, sums)) = join(take, || join(pack, sum_up));
        (self.taken, self.packed) = (taken?, packed.map_err(io)?);
        for (cut, (mut sums, open)) in before.into_iter().zip(sums?) {
            self.totals.add_sums(&cut.records, &sums);
            (sums.summary.open_faces, sums.summary.bytes) = (open, cut.bytes());
            self.tet_chunks.push(sums.summary);
            self.put(cut.values)?;
        }
        assert!(
            self.tets.count() <= u64::from(TetId::LOCAL_MAX),
            "sub-domain {} has more tetrahedra than ids",
            self.subdomain
        );
        Ok(())
    }

    /// Tetrahedra to take while so many are packed: with memory and threads some segments, up to the end of one.
    fn tets_at_once(&self, n_packing: usize) -> usize {
        let (room, segment) = (self.memory_bytes / 8 / TET_BYTES, segment::<SealedTet>());
        match (room / segment).min(spare_threads()) {
            0 | 1 => room.clamp(1 << 12, TETS_AT_ONCE),
            n => n * segment - (self.tets.count() as usize + n_packing) % segment,
        }
    }

    fn put(&mut self, values: Vec<(u64, Vec<u8>)>) -> Result<(), SealedError> {
        for (key, value) in values {
            self.batch.push(&mut self.file, key, value)?;
        }
        Ok(())
    }

    /// Adds a facet.
    ///
    /// Errors: the disk.
    pub fn push_facet(&mut self, facet: SealedFacet) -> Result<(), SealedError> {
        let cuts = self.facets.push(facet, SealedFacet::to_working);
        for chunk in cuts.map_err(self.io())? {
            self.facet_chunks.push(summary(&chunk));
            self.put(chunk.values)?;
        }
        Ok(())
    }

    /// Adds an interface face.
    ///
    /// Errors: the disk; a vertex that was not pushed.
    pub fn push_interface_face(&mut self, face: InterfaceFace) -> Result<(), SealedError> {
        self.end_vertices()?;
        let cache = self.cache.as_mut().expect("vertices have ended");
        let corners = cache.corners(&mut self.file, face.vertices)?;
        let side = self.interfaces.entry((face.cut, face.other)).or_default();
        side.0 += 1;
        side.1.add_face(corners.map(|c| c.mix), face.cut);
        let rank = self.subdomain.rank();
        let cuts = self.faces.push(face, |face| face.to_working(rank));
        for chunk in cuts.map_err(self.io())? {
            self.face_chunks.push(summary(&chunk));
            self.put(chunk.values)?;
        }
        Ok(())
    }

    fn put_summaries<R: ChunkRecord>(&mut self, summaries: &[R]) -> Result<u32, SealedError> {
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
            self.batch.push(&mut self.file, block.address.key(), block.value)?;
        }
        Ok(packer.chunks())
    }

    /// Writes the remaining records, shrinks the file and closes it.
    ///
    /// Errors: the disk.
    pub fn finish(mut self) -> Result<Sealed, SealedError> {
        let io = self.io();
        // What was taken is packed, and what was packed is summed up.
        for _ in 0..2 {
            self.push_tets::<SealedError>(&mut std::iter::empty())?;
        }
        while let Some(chunk) = self.tets.cut().map_err(&io)? {
            self.packed.push(chunk);
        }
        self.push_tets::<SealedError>(&mut std::iter::empty())?;
        while let Some(chunk) = self.facets.cut().map_err(&io)? {
            self.facet_chunks.push(summary(&chunk));
            self.put(chunk.values)?;
        }
        while let Some(chunk) = self.faces.cut().map_err(&io)? {
            self.face_chunks.push(summary(&chunk));
            self.put(chunk.values)?;
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
            interfaces.push(InterfaceSide { cut, other, faces, digest });
        }
        let totals = self.totals;
        let chunks =
            [self.tets.chunks(), self.vertices.chunks(), self.facets.chunks(), self.faces.chunks()];
        let mut both = [0; 8];
        both[..4].copy_from_slice(&chunks);
        both[4..].copy_from_slice(&blocks);
        let row = SubdomainRow {
            rank: self.subdomain.rank(),
            generation: self.generation,
            state: self.form.state(),
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
        Ok(Sealed { row, regions: totals.regions, interfaces })
    }
}

/// Sums and open faces of chunks, side by side; `None` if no thread is to spare, if not all vertices fit the cache, or if one does not exist.
///
/// Errors: those of reading vertices.
fn sum_in_parallel(
    cuts: &[Cut<SealedTet>],
    rank: u32,
    known: [f64; 2],
    cache: &mut VertexCache,
    file: &mut StoreFile,
) -> Result<Option<Vec<(ChunkSums, u32)>>, SealedError> {
    if cuts.len() < 2 || spare_threads() < 2 {
        return Ok(None);
    }
    let Some(vertices) = cache.all(file)? else {
        return Ok(None);
    };
    let sum = |scratch: &mut SumScratch, cut: &Cut<SealedTet>| {
        let mut reader = vertices.reader();
        let corners_of = |tet: &SealedTet| reader.corners(tet.nodes).ok_or(());
        let tets = (cut.first, &cut.records[..]);
        let sums = ChunkSums::of(tets, rank, known, scratch, corners_of).ok()?;
        Some((sums, count_open(&mut FacePairs::new(cut.records.len()), &cut.records)))
    };
    Ok(parallel(|| cuts.par_iter().map_init(SumScratch::default, sum).collect()))
}

fn summary<R, const IS_FACE: bool>(chunk: &Cut<R>) -> RangeSummary<IS_FACE> {
    RangeSummary { first: chunk.first, count: chunk.records.len() as u32 }
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
