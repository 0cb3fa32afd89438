//! The mesh of a store and a field on it as arrays, so that passes over it decode nothing.
//!
//! A vertex that several sub-domains share is one node, which has its number in the first of them; its other numbers are no nodes.
//! Arrays that are too large for their share of the memory lie in scratch files;
//! nodes are near each other in them as the vertices are in space.

use crate::pipeline::error::PipelineError;
use crate::pipeline::plan::Options;
use crate::pipeline::remesh::{Recorded, recorded_field};
use tetdb_base::geom::Point;
use tetdb_base::storage::{ScratchSpace, SpillVec, StorageError, check_cancelled, sort_record};
use tetdb_schema::catalog::SubdomainRow;
use tetdb_schema::field::FieldRow;
use tetdb_schema::ids::{Owner, VertexId};
use tetdb_store::store::{Catalog, StoreError};

/// A node on the surface.
pub const ON_SURFACE: u8 = 1;
/// A node on an interface.
pub const ON_INTERFACE: u8 = 2;

sort_record! {
    /// A vertex that several sub-domains may have.
    struct VertexPlace {
        id: u64,
        place: u32,
    }
}

/// A sub-domain in the arrays.
pub struct MeshPart {
    pub row: SubdomainRow,
    /// Tetrahedra of its coarse mesh: meshed again, it has no fewer.
    pub least_tets: u64,
    pub first_tet: usize,
    /// Its first place in [`MeshArrays::nodes`].
    pub first_vertex: usize,
}

/// The mesh of a store and a field on it.
pub struct MeshArrays {
    /// The sub-domains, by rank.
    pub parts: Vec<MeshPart>,
    /// The node of each vertex of each sub-domain.
    pub nodes: SpillVec<u32>,
    /// The nodes of each tetrahedron.
    pub tets: SpillVec<[u32; 4]>,
    pub points: SpillVec<[f64; 3]>,
    /// The field at each node.
    pub values: SpillVec<f64>,
    /// The length with which the mesh around each node was made; zero for numbers that are no nodes.
    pub present: SpillVec<f64>,
    /// Bits of [`ON_SURFACE`] and [`ON_INTERFACE`] for each node.
    pub skin: SpillVec<u8>,
}

impl MeshArrays {
    /// Reads a finished mesh and a component of a field at its vertices with arrays in `scratch`, and `memory` bytes for what is decoded.
    ///
    /// Errors: damage; the disk; more vertices than 32 bits can number.
    pub fn read(
        catalog: &mut Catalog,
        options: &Options,
        (field, component): (&FieldRow, u32),
        scratch: &ScratchSpace,
        memory: u64,
    ) -> Result<Self, PipelineError> {
        let whole = recorded_field(catalog, options, scratch)?;
        let recorded = Recorded { whole: &whole, room: scratch };
        let (mut parts, mut n_tets, mut n_vertices) = (Vec::new(), 0, 0);
        let is_imported = catalog.job()?.is_imported();
        for row in catalog.subdomains()? {
            let (tets, vertices) = (row.tets as usize, row.vertices as usize);
            let coarse = catalog.coarse_snapshot(row.rank)?;
            let least_tets = match coarse {
                Some(coarse) => coarse.tets,
                // It is made when the sub-domain is first meshed again.
                None if is_imported => 0,
                None => {
                    let (path, subdomain) = (catalog.dir().to_owned(), row.rank);
                    return Err(StoreError::NoCoarseSnapshot { path, subdomain }.into());
                }
            };
            let (first_tet, first_vertex) = (n_tets, n_vertices);
            parts.push(MeshPart { row, least_tets, first_tet, first_vertex });
            (n_tets, n_vertices) = (n_tets + tets, n_vertices + vertices);
        }
        let nodes = numbered(catalog, &parts, n_vertices, (scratch, memory))?;
        let n = n_vertices;
        let mut mesh = Self {
            parts,
            nodes,
            tets: scratch.vec(n_tets, [0; 4]),
            points: scratch.vec(n, [0.0; 3]),
            values: scratch.vec(n, 0.0),
            present: scratch.vec(n, 0.0),
            skin: scratch.vec(n, 0),
        };
        for part in 0..mesh.parts.len() {
            let rank = mesh.parts[part].row.rank;
            let own = recorded.own(catalog, rank)?;
            let size = own.as_ref().unwrap_or(&whole);
            mesh.read_part(catalog, part, (field, component), &|p| size.h(p), memory)?;
        }
        Ok(mesh)
    }

    fn read_part(
        &mut self,
        catalog: &mut Catalog,
        part: usize,
        (field, component): (&FieldRow, u32),
        size: &dyn Fn(Point) -> f64,
        memory: u64,
    ) -> Result<(), PipelineError> {
        let MeshPart { ref row, first_tet, first_vertex, .. } = self.parts[part];
        let mut open = catalog.open_subdomain(row.rank, (memory / 2) as usize)?;
        let mut values = catalog.open_field(field, &open, (memory / 4) as usize)?;
        for chunk in 0..open.vertex_summaries().len() as u32 {
            let vertices = open.vertex_chunk(chunk)?;
            let words = values.column(chunk, component)?;
            for (i, (vertex, &word)) in (vertices.first..).zip(vertices.records.iter().zip(&*words))
            {
                let node = self.nodes.get(first_vertex + i as usize) as usize;
                // Two sub-domains have nearly equal sizes at an interface: those of the first count.
                if self.present.get(node) == 0.0 {
                    self.points.set(node, vertex.point);
                    self.values.set(node, field.number.unpack(word).to_f64());
                    self.present.set(node, size(Point::from_array(vertex.point)));
                }
            }
        }
        let nodes = &mut self.nodes;
        let mut node = |v: u32| nodes.get(first_vertex + v as usize);
        for chunk in open.tet_chunks() {
            let chunk = chunk?;
            for (i, tet) in (chunk.first as usize..).zip(&chunk.records) {
                self.tets.set(first_tet + i, tet.nodes.map(&mut node));
            }
        }
        for facet in open.facets() {
            let nodes = facet?.vertices.map(&mut node);
            nodes.iter().for_each(|&n| self.skin.change(n as usize, |bits| *bits |= ON_SURFACE));
        }
        for face in open.interfaces() {
            let nodes = face?.vertices.map(&mut node);
            nodes.iter().for_each(|&n| self.skin.change(n as usize, |bits| *bits |= ON_INTERFACE));
        }
        Ok(())
    }

    /// Number of nodes, and of what is none.
    pub fn n_nodes(&self) -> usize {
        self.points.len()
    }

    /// The corners of a tetrahedron or a face.
    pub fn corners<const N: usize>(&mut self, nodes: [u32; N]) -> [Point; N] {
        nodes.map(|node| Point::from_array(self.points.get(node as usize)))
    }

    /// The nodes of a tetrahedron; a run can be stopped here.
    pub fn tet(&mut self, t: usize) -> [u32; 4] {
        if t.is_multiple_of(1 << 16) {
            check_cancelled();
        }
        self.tets.get(t)
    }
}

/// The node of each vertex of each sub-domain: the first place in the store of a vertex with its id. Errors: damage; the disk.
fn numbered(
    catalog: &mut Catalog,
    parts: &[MeshPart],
    n_vertices: usize,
    (scratch, memory): (&ScratchSpace, u64),
) -> Result<SpillVec<u32>, PipelineError> {
    let n = u32::try_from(n_vertices).map_err(|_| StorageError::TooMany { what: "vertices" })?;
    let mut nodes = scratch.vec(n_vertices, 0u32);
    (0..n).for_each(|v| nodes.set(v as usize, v));
    if let [_] = parts {
        return Ok(nodes);
    }
    let mut by_id = scratch.sorter::<VertexPlace>();
    for part in parts {
        let mut open = catalog.open_subdomain(part.row.rank, memory as usize)?;
        let own = Some(Owner::Subdomain(open.id()));
        for (place, vertex) in (part.first_vertex as u32..).zip(open.vertices()) {
            let id = vertex?.id;
            // Those that a sub-domain made itself are in no other.
            if VertexId::from_number(id).map(|id| id.owner) != own {
                by_id.push(VertexPlace { id, place })?;
            }
        }
    }
    let mut first: Option<VertexPlace> = None;
    for vertex in by_id.finish()? {
        let vertex = vertex?;
        match first {
            Some(first) if first.id == vertex.id => nodes.set(vertex.place as usize, first.place),
            _ => first = Some(vertex),
        }
    }
    Ok(nodes)
}
