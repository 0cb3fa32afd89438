//! Vertices by their entities.

use std::path::{Path, PathBuf};

use super::super::edge_means::MidpointReader;
use super::super::error::Result;
use super::super::merged::{Merged, OpenedPart};
use super::super::midpoints::{ElementEdges, Midpoints};
use super::super::stream::{RecordReader, save};
use super::entities::Entities;
use super::out::Out;
use super::piece::GmshPiece;
use tetdb_base::storage::{Payload, Sorted, Sorter, sort_record};
use tetdb_store::sealed::BitSet;

sort_record! {
    /// An entity that a vertex is on; the last record of a vertex has its position.
    struct VertexEntity {
        vertex: u64,
        /// [`POSITION`] for a position.
        entity: u32,
        point: Payload<[f64; 3]>,
    }
}

sort_record! {
    /// A vertex by its entity.
    struct EntityNode {
        entity: u32,
        vertex: u64,
        point: Payload<[f64; 3]>,
    }
}

const POSITION: u32 = u32::MAX;

/// The vertices of a file, sorted, in a scratch file.
pub(super) struct Nodes {
    pub n: u64,
    /// Number of vertices of each entity, by its place.
    counts: Vec<u64>,
    span: [u64; 2],
    path: PathBuf,
}

/// Numbers of a range that were met; numbers outside the range are always new.
struct MetNumbers {
    first: u64,
    n: u64,
    met: BitSet,
}

impl MetNumbers {
    fn new(first: u64, n: u64) -> Self {
        Self { first, n, met: BitSet::new(n) }
    }

    fn is_new(&mut self, number: u64) -> bool {
        let place = number.checked_sub(self.first).filter(|&place| place < self.n);
        place.is_none_or(|place| self.met.insert(place))
    }
}

/// Gives an entity to each vertex and each midpoint of a file.
pub(super) fn gather(
    mesh: &mut Merged,
    piece: &GmshPiece,
    entities: &Entities,
    name: &Path,
) -> Result<Nodes> {
    let (dir, bytes) = (mesh.dir().to_owned(), mesh.sorter_bytes());
    let (n_vertices, records) = (mesh.n_vertices(), Sorter::new(&dir, bytes));
    let mut sorter = EntitySorter { piece, entities, n_vertices, records };
    sorter.add_faces(mesh)?;
    let mut edges = piece.midpoints.map(Midpoints::tets).transpose()?;
    for &p in piece.which {
        sorter.add_part(mesh, p, &mut edges)?;
    }
    sorter.add_ghosts(&mut edges)?;
    let mut points = piece.midpoints.map(Midpoints::points).transpose()?;
    let sorted = sorter.records.finish()?;
    let nodes = first_entities(sorted, n_vertices, &mut points, Sorter::new(&dir, bytes))?;
    let file = name.file_name().unwrap_or_default().to_string_lossy();
    save_nodes(nodes, entities, dir.join(format!("nodes-{file}")))
}

/// Entities of vertices and midpoints being gathered.
struct EntitySorter<'a> {
    piece: &'a GmshPiece<'a>,
    entities: &'a Entities,
    n_vertices: u64,
    records: Sorter<VertexEntity>,
}

impl EntitySorter<'_> {
    fn push(&mut self, vertex: u64, entity: u32) -> Result<()> {
        Ok(self.records.push(VertexEntity { vertex, entity, point: Payload([0.0; 3]) })?)
    }

    fn push_all(&mut self, vertices: impl IntoIterator<Item = u64>, entity: u32) -> Result<()> {
        vertices.into_iter().try_for_each(|vertex| self.push(vertex, entity))
    }

    fn push_position(&mut self, vertex: u64, point: [f64; 3]) -> Result<()> {
        let record = VertexEntity { vertex, entity: POSITION, point: Payload(point) };
        Ok(self.records.push(record)?)
    }

    /// Adds the vertices and midpoints of the boundary faces.
    fn add_faces(&mut self, mesh: &Merged) -> Result<()> {
        let mut edges = self.piece.midpoints.map(Midpoints::faces).transpose()?;
        let mut number = 0;
        mesh.faces().each(|face| {
            if let Some(entity) = self.entities.surface(face) {
                self.push_all(face.vertices, entity)?;
                if let Some(edges) = &mut edges {
                    let edges = edges.element(number)?;
                    self.push_all(edges.map(|edge| self.n_vertices + edge), entity)?;
                }
            }
            number += 1;
            Ok(())
        })
    }

    /// Adds the vertices of the partition at place `p`, and the midpoints of its tetrahedra.
    fn add_part(
        &mut self,
        mesh: &mut Merged,
        p: usize,
        edges: &mut Option<ElementEdges<6>>,
    ) -> Result<()> {
        let parts = mesh.parts();
        let OpenedPart { mut part, numbers } = mesh.open_part(p)?;
        let only = self.entities.only_volume(parts[p].rank);
        // All tetrahedra around an inner vertex are of one region, so the first one decides.
        let mut vertices = MetNumbers::new(parts[p].first_vertex, parts[p].n_vertices);
        let (first, n) = self.piece.midpoints.map_or((0, 0), |m| (m.first_of(p), m.counts[p]));
        let mut midpoints = MetNumbers::new(self.n_vertices + first, n);
        let needs_tets = only.is_none() || edges.is_some();
        for tet in part.tets().take_while(|_| needs_tets) {
            let (id, tet) = tet?;
            let Some(number) = numbers.tet(id.local()) else {
                continue;
            };
            let entity = self.entities.volume(tet.region, parts[p].rank);
            let corners = numbers.vertices(tet.nodes)?;
            self.push_all(corners.into_iter().filter(|&v| vertices.is_new(v)), entity)?;
            if let Some(edges) = edges {
                let middles = edges.element(number)?.map(|edge| self.n_vertices + edge);
                self.push_all(middles.into_iter().filter(|&v| midpoints.is_new(v)), entity)?;
            }
        }
        for (v, vertex) in (0u32..).zip(part.vertices()) {
            let vertex = vertex?;
            if let Some(number) = numbers.vertex(v) {
                self.push_position(number, vertex.point)?;
                if let Some(entity) = only {
                    self.push(number, entity)?;
                }
            }
        }
        mesh.advance(parts[p].n_vertices as usize);
        Ok(())
    }

    /// Adds the vertices and midpoints of the ghosts.
    fn add_ghosts(&mut self, edges: &mut Option<ElementEdges<6>>) -> Result<()> {
        let piece = self.piece;
        piece.each_ghost(|ghost| {
            let entity = self.entities.volume(ghost.region, ghost.from);
            self.push_all(ghost.nodes.0, entity)?;
            for (v, point) in ghost.nodes.0.into_iter().zip(ghost.points.0.as_chunks::<3>().0) {
                self.push_position(v, *point)?;
            }
            if let Some(edges) = edges {
                let edges = edges.element(ghost.number)?;
                self.push_all(edges.map(|edge| self.n_vertices + edge), entity)?;
            }
            Ok(())
        })
    }
}

/// The first entity of each vertex, with its position, sorted by entity.
fn first_entities(
    records: Sorted<VertexEntity>,
    n_vertices: u64,
    points: &mut Option<MidpointReader>,
    mut sorter: Sorter<EntityNode>,
) -> Result<Sorted<EntityNode>> {
    let mut last = None;
    for record in records {
        let record = record?;
        match last {
            Some((vertex, entity)) if vertex == record.vertex => {
                if record.entity == POSITION && entity != POSITION {
                    sorter.push(EntityNode { entity, vertex, point: record.point })?;
                    last = Some((vertex, POSITION));
                }
            }
            _ => {
                last = Some((record.vertex, record.entity));
                // Midpoints have no record of their position: the positions are in the order of their numbers.
                let edge = record.vertex.checked_sub(n_vertices);
                if let (Some(points), Some(edge)) = (&mut *points, edge) {
                    sorter.push(EntityNode {
                        entity: record.entity,
                        vertex: record.vertex,
                        point: Payload(points.at(edge)?),
                    })?;
                }
            }
        }
    }
    Ok(sorter.finish()?)
}

/// Counts the vertices and saves them at `path`.
fn save_nodes(sorted: Sorted<EntityNode>, entities: &Entities, path: PathBuf) -> Result<Nodes> {
    let mut nodes =
        Nodes { n: 0, counts: vec![0; entities.tags().len()], span: [u64::MAX, 0], path };
    let Nodes { n, counts, span: [least, greatest], path } = &mut nodes;
    save(sorted, path, |node: &EntityNode| {
        *n += 1;
        counts[node.entity as usize] += 1;
        *least = (*least).min(node.vertex + 1);
        *greatest = (*greatest).max(node.vertex + 1);
    })?;
    Ok(nodes)
}

impl Nodes {
    /// Writes the vertices entity by entity: first their tags, then their positions.
    pub fn write(&self, out: &mut Out, entities: &Entities) -> Result<()> {
        let blocks = self.counts.iter().filter(|&&n| n > 0).count() as u64;
        for n in [blocks, self.n, self.span[0], self.span[1]] {
            out.size(n);
        }
        out.end()?;
        let mut first = 0;
        for (&n, (dim, tag, _)) in self.counts.iter().zip(entities.tags()) {
            if n == 0 {
                continue;
            }
            for word in [dim, tag, 0] {
                out.int(word);
            }
            out.size(n);
            out.end()?;
            RecordReader::open(&self.path, first)?.each_of(n, |node: &EntityNode| {
                out.size(node.vertex + 1);
                out.end()
            })?;
            RecordReader::open(&self.path, first)?.each_of(n, |node: &EntityNode| {
                node.point.0.into_iter().for_each(|x| out.double(x));
                out.end()
            })?;
            first += n;
        }
        Ok(())
    }
}
