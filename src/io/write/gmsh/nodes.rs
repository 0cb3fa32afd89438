//! Vertices by their entities.

use std::path::{Path, PathBuf};

use super::super::error::Result;
use super::super::merged::{Merged, OpenedPart};
use super::super::midpoints::{MidpointReader, Midpoints};
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
    let claims = claims(mesh, piece, entities)?;
    let mut points = piece.midpoints.map(Midpoints::points).transpose()?;
    let nodes = granted(claims, mesh.n_vertices(), &mut points, Sorter::new(&dir, bytes))?;
    let file = name.file_name().unwrap_or_default().to_string_lossy();
    stored(nodes, entities, dir.join(format!("nodes-{file}")))
}

/// The entities of vertices and midpoints by faces, tetrahedra and ghosts of the piece, sorted by vertex.
fn claims(
    mesh: &mut Merged,
    piece: &GmshPiece,
    entities: &Entities,
) -> Result<Sorted<VertexEntity>> {
    let parts = mesh.parts();
    let n_vertices = mesh.n_vertices();
    let mut claims = Sorter::new(mesh.dir(), mesh.sorter_bytes());
    let mut claim =
        |vertex, entity, point| claims.push(VertexEntity { vertex, entity, point: Payload(point) });
    let mut edges = piece.midpoints.map(Midpoints::faces).transpose()?;
    let mut number = 0;
    mesh.faces().each(|face| {
        if let Some(entity) = entities.surface(face) {
            for vertex in face.vertices {
                claim(vertex, entity, [0.0; 3])?;
            }
            if let Some(edges) = &mut edges {
                for edge in edges.element(number)? {
                    claim(n_vertices + edge, entity, [0.0; 3])?;
                }
            }
        }
        number += 1;
        Ok(())
    })?;
    let mut edges = piece.midpoints.map(Midpoints::tets).transpose()?;
    for &p in piece.which {
        let OpenedPart { mut part, numbers } = mesh.open_part(p)?;
        let rank = parts[p].rank;
        let only = entities.only_volume(rank);
        // All tetrahedra around an inner vertex are of one region, so the first one decides.
        let mut vertices = MetNumbers::new(parts[p].first_vertex, parts[p].n_vertices);
        let of_edges = piece.midpoints.map_or((0, 0), |m| (m.first_of(p), m.counts[p]));
        let mut midpoints = MetNumbers::new(n_vertices + of_edges.0, of_edges.1);
        let needs_tets = only.is_none() || edges.is_some();
        for tet in part.tets().take_while(|_| needs_tets) {
            let (id, tet) = tet?;
            let Some(number) = numbers.tet(id.local()) else {
                continue;
            };
            let entity = entities.volume(tet.region, rank);
            for v in numbers.vertices(tet.nodes)? {
                if vertices.is_new(v) {
                    claim(v, entity, [0.0; 3])?;
                }
            }
            if let Some(edges) = &mut edges {
                for v in edges.element(number)?.map(|edge| n_vertices + edge) {
                    if midpoints.is_new(v) {
                        claim(v, entity, [0.0; 3])?;
                    }
                }
            }
        }
        for (v, vertex) in (0u32..).zip(part.vertices()) {
            let vertex = vertex?;
            let Some(number) = numbers.vertex(v) else {
                continue;
            };
            claim(number, POSITION, vertex.point)?;
            if let Some(entity) = only {
                claim(number, entity, [0.0; 3])?;
            }
        }
        mesh.advance(parts[p].n_vertices as usize);
    }
    piece.each_ghost(|ghost| {
        let entity = entities.volume(ghost.region, ghost.from);
        for (v, point) in ghost.nodes.0.into_iter().zip(ghost.points.0.as_chunks::<3>().0) {
            claim(v, entity, [0.0; 3])?;
            claim(v, POSITION, *point)?;
        }
        if let Some(edges) = &mut edges {
            for edge in edges.element(ghost.number)? {
                claim(n_vertices + edge, entity, [0.0; 3])?;
            }
        }
        Ok(())
    })?;
    Ok(claims.finish()?)
}

/// The first entity of each vertex, with its position, sorted by entity.
fn granted(
    claims: Sorted<VertexEntity>,
    n_vertices: u64,
    points: &mut Option<MidpointReader>,
    mut sorter: Sorter<EntityNode>,
) -> Result<Sorted<EntityNode>> {
    let mut last = None;
    for claim in claims {
        let claim = claim?;
        match last {
            Some((vertex, entity)) if vertex == claim.vertex => {
                if claim.entity == POSITION && entity != POSITION {
                    sorter.push(EntityNode { entity, vertex, point: claim.point })?;
                    last = Some((vertex, POSITION));
                }
            }
            _ => {
                last = Some((claim.vertex, claim.entity));
                // Midpoints have no record of their position: the positions are in the order of their numbers.
                let edge = claim.vertex.checked_sub(n_vertices);
                if let (Some(points), Some(edge)) = (&mut *points, edge) {
                    sorter.push(EntityNode {
                        entity: claim.entity,
                        vertex: claim.vertex,
                        point: Payload(points.at(edge)?),
                    })?;
                }
            }
        }
    }
    Ok(sorter.finish()?)
}

/// Counts the vertices and saves them at `path`.
fn stored(sorted: Sorted<EntityNode>, entities: &Entities, path: PathBuf) -> Result<Nodes> {
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
