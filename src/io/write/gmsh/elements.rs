//! Triangles and tetrahedra, entity by entity.

use super::super::embedded::WrittenEmbedded;
use super::super::error::Result;
use super::super::merged::{Merged, OpenedPart};
use super::super::midpoints::{ElementEdges, Midpoints};
use super::entities::Entities;
use super::out::Out;
use super::piece::GmshPiece;
use tetdb_base::storage::{Sorter, sort_record};

/// Gmsh's numbers of the types of elements, of first and of second order.
const POINT: u32 = 15;
const LINES: [u32; 2] = [1, 8];
const TRIANGLES: [u32; 2] = [2, 9];
const TETRAHEDRA: [u32; 2] = [4, 11];
/// Order of the midpoints of a tetrahedron: Gmsh exchanges the last two.
const MIDDLES: [usize; 6] = [0, 1, 2, 3, 5, 4];

sort_record! {
    /// A triangle by its entity.
    struct Triangle {
        entity: u32,
        number: u64,
        vertices: [u64; 3],
    }
}

sort_record! {
    /// A tetrahedron of a sub-domain by its entity.
    struct Tetrahedron {
        entity: u32,
        number: u64,
        nodes: [u32; 4],
    }
}

/// The elements of a file being written.
struct Elements<'a> {
    out: &'a mut Out,
    /// Dimension, tag and number of elements of each entity.
    tags: Vec<(u32, u32, u64)>,
    order: usize,
    /// Elements before the first tetrahedron.
    n_faces: u64,
    /// Vertices before the first midpoint.
    n_vertices: u64,
    edges: Option<ElementEdges<6>>,
    /// The entity whose elements are being written.
    entity: Option<u32>,
}

pub(super) fn write(
    mesh: &mut Merged,
    out: &mut Out,
    piece: &GmshPiece,
    entities: &Entities,
) -> Result<()> {
    let n_faces = mesh.n_faces();
    let tags = entities.tags();
    let embedded = &entities.embedded;
    let n_embedded = (embedded.edges.len() + embedded.points.len()) as u64;
    let curves = embedded.edge_labels();
    let blocks = tags.len() + curves.len() + embedded.points.len();
    let total = entities.n_faces() + entities.n_tets() + n_embedded;
    for n in [blocks as u64, total, 1, n_faces + mesh.n_tets() + n_embedded] {
        out.size(n);
    }
    out.end()?;
    let mut elements = Elements {
        out,
        tags,
        order: usize::from(piece.midpoints.is_some()),
        n_faces,
        n_vertices: mesh.n_vertices(),
        edges: piece.midpoints.map(Midpoints::tets).transpose()?,
        entity: None,
    };
    triangles(mesh, &mut elements, piece, entities)?;
    for &p in piece.which {
        let OpenedPart { mut part, numbers } = mesh.open_part(p)?;
        let rank = part.id().rank();
        if let Some(entity) = entities.only_volume(rank) {
            for tet in part.tets() {
                let (id, tet) = tet?;
                if let Some(number) = numbers.tet(id.local()) {
                    elements.tet(entity, number, numbers.vertices(tet.nodes)?)?;
                }
            }
        } else {
            let mut sorter = Sorter::new(mesh.dir(), mesh.sorter_bytes());
            for tet in part.tets() {
                let (id, tet) = tet?;
                if let Some(number) = numbers.tet(id.local()) {
                    sorter.push(Tetrahedron {
                        entity: entities.volume(tet.region, rank),
                        number,
                        nodes: tet.nodes,
                    })?;
                }
            }
            for tet in sorter.finish()? {
                let tet = tet?;
                elements.tet(tet.entity, tet.number, numbers.vertices(tet.nodes)?)?;
            }
        }
        mesh.advance(part.row().tets as usize);
    }
    piece.each_ghost(|ghost| {
        let entity = entities.volume(ghost.region, ghost.from);
        elements.tet(entity, ghost.number, ghost.nodes.0)
    })?;
    let n_before = n_faces + mesh.n_tets();
    lines(mesh, out, piece, (embedded, n_before))?;
    let mut number = n_before + embedded.edges.len() as u64;
    for (tag, point) in (1u32..).zip(&embedded.points) {
        for word in [0, tag, POINT] {
            out.int(word);
        }
        number += 1;
        [1, number, point.vertex + 1].into_iter().for_each(|n| out.size(n));
        out.end()?;
    }
    Ok(())
}

/// Writes embedded edges, those of each label as a curve, numbered after `n_before` other elements.
fn lines(
    mesh: &Merged,
    out: &mut Out,
    piece: &GmshPiece,
    (embedded, n_before): (&WrittenEmbedded, u64),
) -> Result<()> {
    let mut midpoints = piece.midpoints.map(Midpoints::lines).transpose()?;
    let mut edges = (n_before + 1..).zip(&embedded.edges);
    for (label, n) in embedded.edge_labels() {
        for word in [1, label + 1, LINES[usize::from(midpoints.is_some())]] {
            out.int(word);
        }
        out.size(n);
        out.end()?;
        for (number, ([a, b], _)) in edges.by_ref().take(n as usize) {
            [number, a + 1, b + 1].into_iter().for_each(|n| out.size(n));
            if let Some(midpoints) = &mut midpoints {
                out.size(mesh.n_vertices() + midpoints.next()?[0] + 1);
            }
            out.end()?;
        }
    }
    Ok(())
}

impl Elements<'_> {
    /// Begins the elements of an entity, unless it is the current one.
    fn begin(&mut self, entity: u32, types: [u32; 2]) -> Result<()> {
        if self.entity.replace(entity) == Some(entity) {
            return Ok(());
        }
        let (dim, tag, n) = self.tags[entity as usize];
        for word in [dim, tag, types[self.order]] {
            self.out.int(word);
        }
        self.out.size(n);
        self.out.end()
    }

    fn tet(&mut self, entity: u32, number: u64, nodes: [u64; 4]) -> Result<()> {
        self.begin(entity, TETRAHEDRA)?;
        self.out.size(self.n_faces + number + 1);
        nodes.iter().for_each(|v| self.out.size(v + 1));
        if let Some(edges) = &mut self.edges {
            let edges = edges.element(number)?;
            MIDDLES.iter().for_each(|&i| self.out.size(self.n_vertices + edges[i] + 1));
        }
        self.out.end()
    }
}

fn triangles(
    mesh: &Merged,
    elements: &mut Elements,
    piece: &GmshPiece,
    entities: &Entities,
) -> Result<()> {
    let mut sorter = Sorter::new(mesh.dir(), mesh.sorter_bytes());
    let mut number = 0;
    mesh.faces().each(|face| {
        if let Some(entity) = entities.surface(face) {
            sorter.push(Triangle { entity, number, vertices: face.vertices })?;
        }
        number += 1;
        Ok(())
    })?;
    let mut edges = piece.midpoints.map(Midpoints::faces).transpose()?;
    for face in sorter.finish()? {
        let face = face?;
        elements.begin(face.entity, TRIANGLES)?;
        elements.out.size(face.number + 1);
        face.vertices.iter().for_each(|v| elements.out.size(v + 1));
        if let Some(edges) = &mut edges {
            for edge in edges.element(face.number)? {
                elements.out.size(elements.n_vertices + edge + 1);
            }
        }
        elements.out.end()?;
    }
    Ok(())
}
