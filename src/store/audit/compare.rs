//! The qualities of a mesh by kind of tetrahedron, to be set beside another mesh's.
//!
//! Some tetrahedra are bad whoever made the mesh: those on an input triangle that lets none be better than q = 2, and those
//! with four vertices on the surface. They are forced, and counted apart. Those with a vertex on an interface are counted apart too: they tell
//! what the interfaces cost.

use tetdb_schema::ids::{Owner, VertexId};
use tetdb_schema::record::NO_TET;

use crate::sealed::{Corner, Shape, Subdomain, quality_bin};
use crate::store::{Catalog, StoreError};
use tetdb_base::shape::is_forcing;
use tetdb_schema::catalog::QUALITY_BINS;

/// Tetrahedra by quality.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Population {
    /// Number of tetrahedra.
    pub tets: u64,
    /// Tetrahedra with q in [1,2[, [2,3[ .. [9,10[, [10,inf[.
    pub bins: [u64; QUALITY_BINS],
    /// Largest quality q; 0 without tetrahedra.
    pub worst: f64,
}

impl Population {
    fn add(&mut self, quality: f64) {
        self.tets += 1;
        self.bins[quality_bin(quality)] += 1;
        self.worst = self.worst.max(quality);
    }

    /// Share of a bin, 0 to 1.
    pub fn share(&self, bin: usize) -> f64 {
        self.bins[bin] as f64 / self.tets.max(1) as f64
    }
}

/// The populations of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Qualities {
    /// Number of sub-domains.
    pub subdomains: u64,
    /// Number of interface faces, each counted once.
    pub interface_faces: u64,
    /// All tetrahedra.
    pub all: Population,
    /// Those the input does not force.
    pub unforced: Population,
    /// Those the input forces: all vertices are on the surface, or a facet is too badly shaped for a good tetrahedron.
    pub forced: Population,
    /// With a vertex on an interface.
    pub at_interface: Population,
}

/// Measures a sealed store, sub-domain by sub-domain. Memory: the bytes given and two bits per tetrahedron and vertex of the
/// largest.
///
/// Errors: damage, and failures of the disk.
pub fn qualities(store: &mut Catalog, memory_bytes: usize) -> Result<Qualities, StoreError> {
    let mut found = Qualities::default();
    for row in store.subdomains()? {
        let mut part = store.open_subdomain(row.rank, memory_bytes)?;
        found.subdomains += 1;
        found.interface_faces += row.interface_faces;
        let forced = forced_by_face(&mut part)?;
        let at_interface = interface_vertices(&mut part)?;
        for chunk in 0..part.tet_summaries().len() {
            let chunk = part.tet_chunk(chunk as u32)?;
            for (t, tet) in (chunk.first..).zip(&chunk.records) {
                let corners = part.corners(tet.nodes)?;
                let quality = Shape::of(corners.map(|c| c.point)).quality;
                found.all.add(quality);
                if forced.has(t) || corners.iter().all(is_on_surface) {
                    found.forced.add(quality);
                } else {
                    found.unforced.add(quality);
                }
                if tet.nodes.into_iter().any(|v| at_interface.has(v)) {
                    found.at_interface.add(quality);
                }
            }
        }
    }
    // A sub-domain's interface faces are those of its neighbors too.
    found.interface_faces /= 2;
    Ok(found)
}

fn is_on_surface(corner: &Corner) -> bool {
    VertexId::from_number(corner.id).is_some_and(|id| id.owner == Owner::Surface)
}

/// A set of numbers, one bit each.
struct Bits(Vec<u64>);

impl Bits {
    fn new(n: u64) -> Self {
        Self(vec![0; n.div_ceil(64) as usize])
    }
    fn add(&mut self, n: u32) {
        self.0[n as usize / 64] |= 1 << (n % 64);
    }
    fn has(&self, n: u32) -> bool {
        self.0[n as usize / 64] >> (n % 64) & 1 != 0
    }
}

fn forced_by_face(part: &mut Subdomain) -> Result<Bits, StoreError> {
    let mut forced = Bits::new(part.row().tets);
    for chunk in 0..part.row().chunks[2] {
        for facet in part.facet_chunk(chunk)?.records {
            let corners = part.corners(facet.vertices)?;
            if is_forcing(corners.map(|c| c.point)) {
                for tet in facet.tets.into_iter().filter(|&t| t != NO_TET) {
                    forced.add(tet);
                }
            }
        }
    }
    Ok(forced)
}

fn interface_vertices(part: &mut Subdomain) -> Result<Bits, StoreError> {
    let mut vertices = Bits::new(part.row().vertices);
    for chunk in 0..part.row().chunks[3] {
        for face in part.interface_chunk(chunk)?.records {
            face.vertices.into_iter().for_each(|v| vertices.add(v));
        }
    }
    Ok(vertices)
}
