//! Open sub-domains and decoded chunks while questions are answered, within a budget.

use std::collections::HashSet;
use std::sync::Arc;

use lru::LruCache;
use tetdb_schema::ids::TetId;
use tetdb_schema::record::SealedTet;

use super::QueryError;
use super::decoded::{DecodedChunk, Searched};
use super::surface_faces::SurfaceFaces;
use super::tree::OctalBoxTree;
use crate::sealed::{Chunk, FieldFile, Subdomain};
use crate::store::{Catalog, StoreError};
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::{Budget, Lease, check_cancelled};
use tetdb_schema::catalog::{Stage, SubdomainRow, WiresRow};
use tetdb_schema::labels::{self, LabelSet};

/// Memory of one open sub-domain: half for redb, half for decoded vertices.
const PART_BYTES: u64 = 8 << 20;
/// More sub-domains are not held open: their summaries are not counted exactly.
const PARTS_MAX: u64 = 64;
/// Bytes beyond which more frames help no question.
const FRAMES_BYTES_MAX: u64 = 2 << 30;
/// Bytes of a decoded tetrahedron with its share of vertices and of the tree, at most.
const DECODED_BYTES: u64 = 50;
/// Bytes of the summaries of a chunk, twice, for trees.
const SUMMARY_BYTES: u64 = 256;

/// Cost of questions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Measures {
    /// Chunks of tetrahedra read; one read twice counts once.
    pub tet_chunks_read: u64,
    /// Chunks of vertices read; one read twice counts once.
    pub vertex_chunks_read: u64,
    /// Chunks of facets and interface faces read; one read twice counts twice.
    pub face_chunks_read: u64,
    /// Chunks of tetrahedra in the store.
    pub tet_chunks: u64,
    /// Chunks of vertices in the store.
    pub vertex_chunks: u64,
}

/// An open sub-domain.
pub struct OpenSubdomain {
    pub subdomain: Subdomain,
    /// Over the boxes of its chunks of tetrahedra.
    pub(crate) tree: OctalBoxTree,
    _lease: Option<Lease>,
}

/// An open file of a field.
pub(super) struct OpenField {
    pub file: FieldFile,
    _lease: Lease,
}

impl OpenField {
    /// A file whose memory is leased.
    pub fn new(file: FieldFile, lease: Lease) -> Self {
        Self { file, _lease: lease }
    }
}

/// A store open for questions.
///
/// ```
/// use tetdb_base::{expr::Expression, geom::Point, storage::Budget};
/// use tetdb_store::query::{QuerySession, Selection, Solid, VARIABLES};
/// use tetdb_store::store::Catalog;
/// # let dir = tempfile::tempdir()?;
/// # let path = dir.path().join("two.tetdb");
/// # tetdb_store::store::two_subdomains(&path)?;
///
/// let mut session = QuerySession::open(Catalog::open(&path)?, &Budget::new(64 << 20))?;
/// let center = Point::splat(0.2);
/// let located = session.locate(&[center, Point::splat(7.0)])?;
/// assert!(located[0].found.is_some() && located[1].found.is_none());
///
/// let mut selection = Selection::default();
/// selection.solids.push(Solid::Sphere { center, radius: 0.1 });
/// selection.condition = Some(Expression::parse("quality < 3 and x > 0.1", &VARIABLES)?);
/// assert_eq!(session.select(selection)?.count(), 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// Shape: `rows` by rank. Memory: half of the budget for decoded chunks, a quarter for open sub-domains, the rest for
/// answers on their way.
pub struct QuerySession {
    /// The store.
    pub store: Catalog,
    /// Sub-domains by rank.
    pub rows: Vec<SubdomainRow>,
    /// Names of labels of the surface.
    pub labels: Vec<String>,
    /// Labels of triangles in several groups.
    label_sets: Vec<LabelSet>,
    /// Names of regions 1, 2, …; empty for a region without a name.
    pub region_names: Vec<String>,
    /// Embedded edges and points.
    pub wires: WiresRow,
    /// Over the boxes of the sub-domains.
    pub(crate) tree: OctalBoxTree,
    bounds: Aabb,
    pub(super) parts: LruCache<u32, OpenSubdomain>,
    parts_max: usize,
    /// By number of the field and rank.
    pub(super) fields: LruCache<(u32, u32), OpenField>,
    frames: LruCache<(u32, u32), Arc<Searched>>,
    frames_bytes: usize,
    frames_bytes_max: usize,
    /// Memory left for other uses.
    pub budget: Budget,
    /// Faces on the surface of the last sub-domain whose excess was needed.
    pub(super) surface: Option<Arc<SurfaceFaces>>,
    measures: Measures,
    /// Chunks of tetrahedra and of vertices read, by rank and number.
    chunks_read: [HashSet<(u32, u32)>; 2],
    /// The plane of the cut, of a mesh that was kept on its way.
    cutting: Option<[Point; 2]>,
    _lease: Lease,
}

impl QuerySession {
    /// Opens questions to a finished store.
    ///
    /// Errors: damage; sub-domains that are not sealed; a budget below some ten MiB.
    pub fn open(mut store: Catalog, budget: &Budget) -> Result<Self, QueryError> {
        let rows = store.subdomains()?;
        Self::open_rows(store, rows, budget)
    }

    /// Opens questions to a mesh that was kept on its way.
    ///
    /// Errors: [`QueryError::NoStage`]; as [`QuerySession::open`].
    pub fn open_stage(
        mut store: Catalog,
        cut: u32,
        stage: Stage,
        budget: &Budget,
    ) -> Result<Self, QueryError> {
        let kept = store.stages()?;
        let Some(row) = kept.iter().find(|s| (s.cut, s.stage) == (cut, stage)) else {
            let kept = kept.iter().map(|s| s.cut).collect();
            return Err(QueryError::NoStage { cut, kept });
        };
        let normal = Point::from_array(row.normal);
        let mut session = Self::open_rows(store, vec![row.row.clone()], budget)?;
        session.cutting = Some([normal * row.offset, normal]);
        Ok(session)
    }

    /// Opens questions to these sub-domains. Errors: as [`QuerySession::open`].
    pub fn open_rows(
        mut store: Catalog,
        rows: Vec<SubdomainRow>,
        budget: &Budget,
    ) -> Result<Self, QueryError> {
        let (labels, region_names) = (store.labels()?, store.region_names()?);
        let (label_sets, wires) = (store.label_sets()?, store.wires()?);
        let cap = budget.cap();
        let frames_bytes_max = (cap / 2).min(FRAMES_BYTES_MAX);
        let parts_max = (cap / 4 / PART_BYTES).clamp(1, PARTS_MAX);
        let n_wires = (wires.edges.len() + wires.points.len()) as u64;
        let lease = budget.lease(
            frames_bytes_max + parts_max * PART_BYTES + n_wires * size_of::<[u32; 3]>() as u64,
            "decoded chunks, open sub-domains and embedded edges",
        )?;
        let measures = Measures {
            tet_chunks: rows.iter().map(|r| u64::from(r.chunks[0])).sum(),
            vertex_chunks: rows.iter().map(|r| u64::from(r.chunks[1])).sum(),
            ..Measures::default()
        };
        let bounds = (rows.iter().map(bounds_of)).fold(Aabb::EMPTY, Aabb::union);
        Ok(Self {
            store,
            tree: OctalBoxTree::new(rows.len(), |i| bounds_of(&rows[i])),
            rows,
            labels,
            label_sets,
            region_names,
            wires,
            bounds,
            parts: LruCache::unbounded(),
            parts_max: parts_max as usize,
            fields: LruCache::unbounded(),
            frames: LruCache::unbounded(),
            frames_bytes: 0,
            frames_bytes_max: frames_bytes_max as usize,
            budget: budget.clone(),
            surface: None,
            measures,
            chunks_read: Default::default(),
            cutting: None,
            _lease: lease,
        })
    }

    /// A point and the normal of the plane that was to cut it, of a mesh that was kept on its way.
    pub fn cutting(&self) -> Option<[Point; 2]> {
        self.cutting
    }

    /// Cost of all questions so far.
    pub fn measures(&self) -> Measures {
        let [tets, vertices] = &self.chunks_read;
        let mut vertices = vertices.clone();
        for (&rank, part) in &self.parts {
            vertices.extend(part.subdomain.vertex_chunks_read().map(|chunk| (rank, chunk)));
        }
        Measures {
            tet_chunks_read: tets.len() as u64,
            vertex_chunks_read: vertices.len() as u64,
            ..self.measures
        }
    }

    /// The box of the mesh.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// The sub-domains by rank.
    pub fn subdomains(&self) -> &[SubdomainRow] {
        &self.rows
    }

    /// Names of the labels; their place is their number.
    pub fn labels(&self) -> &[String] {
        &self.labels
    }

    /// These labels, and those of triangles that are in all their groups and in others.
    pub(super) fn labels_within(&self, labels: &[u32]) -> Vec<u32> {
        labels.iter().flat_map(|&label| labels::labels_within(&self.label_sets, label)).collect()
    }

    /// The open sub-domain of this rank.
    pub fn part(&mut self, rank: u32) -> Result<&mut OpenSubdomain, QueryError> {
        if !self.parts.contains(&rank) {
            while self.parts.len() >= self.parts_max {
                let Some((old, part)) = self.parts.pop_lru() else {
                    break;
                };
                let read = part.subdomain.vertex_chunks_read();
                self.chunks_read[1].extend(read.map(|chunk| (old, chunk)));
            }
            let row = self.rows.iter().find(|row| row.rank == rank);
            let row = match row {
                Some(row) => row.clone(),
                // Returns the error.
                None => self.store.subdomain(rank)?,
            };
            let subdomain = self.store.open_row(row, PART_BYTES as usize)?;
            let chunks = subdomain.tet_summaries().len() + subdomain.vertex_summaries().len();
            let bytes = chunks as u64 * SUMMARY_BYTES;
            // The part that the share of a sub-domain does not cover.
            let more = bytes.saturating_sub(PART_BYTES / 8);
            let lease = match more {
                0 => None,
                more => Some(self.lease(more, "summaries of a sub-domain")?),
            };
            let tree =
                OctalBoxTree::new(subdomain.tet_summaries().len(), |i| chunk_bounds(&subdomain, i));
            let part = OpenSubdomain { subdomain, tree, _lease: lease };
            self.parts.put(rank, part);
        }
        Ok(self.parts.get_mut(&rank).expect("it was just put there"))
    }

    /// Leases memory; open fields go where it is short.
    pub(super) fn lease(&mut self, bytes: u64, what: &'static str) -> Result<Lease, QueryError> {
        while self.budget.available() < bytes && self.fields.pop_lru().is_some() {}
        Ok(self.budget.lease(bytes, what)?)
    }

    /// Returns whether a chunk is decoded in memory.
    pub fn is_resident(&self, rank: u32, chunk: u32) -> bool {
        self.frames.contains(&(rank, chunk))
    }

    /// Returns whether the chunks that a plane meets can stay decoded, of the share of a session among `of`: a third of all.
    pub(super) fn has_space_for_plane(&self, of: usize) -> bool {
        let n: u64 = self.rows.iter().map(|row| row.tets).sum();
        n / 3 * DECODED_BYTES / of as u64 <= self.frames_bytes_max as u64
    }

    /// A whole chunk, decoded.
    pub(crate) fn searched(&mut self, rank: u32, chunk: u32) -> Result<Arc<Searched>, QueryError> {
        if let Some(frame) = self.frames.get(&(rank, chunk)) {
            return Ok(Arc::clone(frame));
        }
        let searched = Arc::new(Searched::new(self.frame(rank, chunk, |_, _, _| true)?));
        self.frames_bytes += searched.bytes();
        self.frames.put((rank, chunk), Arc::clone(&searched));
        while self.frames_bytes > self.frames_bytes_max && self.frames.len() > 1 {
            if let Some((_, old)) = self.frames.pop_lru() {
                self.frames_bytes -= old.bytes();
            }
        }
        Ok(searched)
    }

    /// Decodes the tetrahedra of a chunk that `keep` accepts.
    pub(super) fn frame(
        &mut self,
        rank: u32,
        chunk: u32,
        keep: impl FnMut(&Subdomain, u32, &SealedTet) -> bool,
    ) -> Result<DecodedChunk, QueryError> {
        check_cancelled();
        self.count_tets(rank, chunk);
        let part = &mut self.part(rank)?.subdomain;
        let records = checked_chunk(part, chunk)?;
        Ok(DecodedChunk::new(part, &records, keep)?)
    }

    /// The faces of a sub-domain that are input triangles, kept until another's are wanted.
    ///
    /// Errors: damage; a budget without 16 bytes for each of their sides.
    pub fn surface_of(&mut self, rank: u32) -> Result<Arc<SurfaceFaces>, QueryError> {
        if let Some(known) = self.surface.as_ref().filter(|s| s.rank == rank) {
            return Ok(known.clone());
        }
        self.surface = None;
        let part = &self.part(rank)?.subdomain;
        let (bytes, chunks) = (SurfaceFaces::bytes(part), part.row().chunks[2]);
        self.measures.face_chunks_read += u64::from(chunks);
        let lease = self.lease(bytes, "the sides of the input triangles")?;
        let read = SurfaceFaces::read(&mut self.part(rank)?.subdomain, lease)?;
        Ok(self.surface.insert(Arc::new(read)).clone())
    }

    /// Counts a chunk of tetrahedra read elsewhere.
    pub fn count_tets(&mut self, rank: u32, chunk: u32) {
        self.chunks_read[0].insert((rank, chunk));
    }

    /// Counts the first chunks of vertices of a sub-domain, read elsewhere.
    pub fn count_vertices(&mut self, rank: u32, chunks: u32) {
        self.chunks_read[1].extend((0..chunks).map(|chunk| (rank, chunk)));
    }

    /// Counts a chunk of faces read elsewhere.
    pub fn count_faces(&mut self) {
        self.measures.face_chunks_read += 1;
    }
}

/// Reads a chunk of tetrahedra and compares it with its summary.
pub fn checked_chunk(part: &mut Subdomain, chunk: u32) -> Result<Chunk<SealedTet>, StoreError> {
    let records = part.tet_chunk(chunk)?;
    let summary = &part.tet_summaries()[chunk as usize];
    let end = u64::from(summary.first) + u64::from(summary.count);
    if (records.first, records.records.len()) == (summary.first, summary.count as usize)
        && end <= u64::from(TetId::LOCAL_MAX)
        && end <= part.row().tets
    {
        return Ok(records);
    }
    let what = format!("chunk {chunk} of tetrahedra is not the one its summary tells of");
    Err(part.damaged(what).into())
}

/// The box of a sub-domain.
pub fn bounds_of(row: &SubdomainRow) -> Aabb {
    let [low, high] = row.bounds.map(Point::from_array);
    Aabb { low, high }
}

/// The box of a chunk of tetrahedra.
pub fn chunk_bounds(part: &Subdomain, chunk: usize) -> Aabb {
    let [low, high] = part.tet_summaries()[chunk].bounds.map(Point::from_array);
    Aabb { low, high }
}

/// Greatest distance between a point and the vertices of a chunk's tetrahedra that hold it: the longest edge of the chunk.
pub fn reach(part: &Subdomain, chunk: usize) -> f64 {
    /// Covers the rounding of lengths.
    const SLACK: f64 = 1.0 + 1e-6;
    match part.tet_summaries()[chunk].edge_max {
        edge_max if edge_max > 0.0 => f64::from(edge_max) * SLACK,
        _ => f64::INFINITY,
    }
}

/// The chunk of vertices that holds vertex `v`, `place` being the one found last.
#[inline]
pub fn vertex_chunk(part: &Subdomain, v: u32, place: &mut usize) -> usize {
    let last = &part.vertex_summaries()[*place];
    if v < last.first || v - last.first >= last.count {
        *place = part.vertex_chunk_of(v);
    }
    *place
}

/// The numbers of all regions called `name`, of the names from region 1 on. Errors: there is none.
pub fn regions_called(names: &[String], name: &str) -> Result<Vec<u32>, QueryError> {
    let all = (1..).zip(names).filter(|(_, known)| *known == name);
    let found: Vec<u32> = all.map(|(region, _)| region).collect();
    match found.is_empty() || name.is_empty() {
        false => Ok(found),
        true => Err(QueryError::NoRegion {
            name: name.to_owned(),
            known: names.iter().filter(|n| !n.is_empty()).cloned().collect(),
        }),
    }
}
