//! Qualities of a mesh by kind of tetrahedron, to be compared with another mesh's.
//!
//! Some tetrahedra are bad in every mesh of an input: those on an input triangle that allows none better than q = 2, and those
//! with four vertices on the surface. These forced ones are counted apart. Tetrahedra with a vertex on an interface are counted apart too: they
//! show the cost of interfaces.

use tetdb_schema::record::NO_TET;

use crate::sealed::{BitSet, Shape, Subdomain, quality_bin};
use crate::store::{Catalog, StoreError};
use tetdb_base::shape::is_forcing;
use tetdb_schema::catalog::{QUALITY_BINS, SubdomainRow};

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
    /// Tetrahedra that the input does not force to be bad.
    pub unforced: Population,
    /// Tetrahedra that the input forces: all vertices are on the surface, or a facet is too badly shaped for a good tetrahedron.
    pub forced: Population,
    /// Tetrahedra with a vertex on an interface.
    pub at_interface: Population,
}

/// Measures sub-domains of a sealed store, one by one. Memory: the bytes given and two bits per tetrahedron and vertex of the
/// largest.
///
/// Errors: damage, and failures of the disk.
pub fn qualities(
    store: &Catalog,
    rows: &[SubdomainRow],
    memory_bytes: usize,
) -> Result<Qualities, StoreError> {
    let mut found = Qualities::default();
    for row in rows {
        let mut part = store.open_row(row.clone(), memory_bytes)?;
        found.subdomains += 1;
        found.interface_faces += row.interface_faces;
        let forced = forced_by_face(&mut part)?;
        let at_interface = interface_vertices(&mut part)?;
        for chunk in 0..part.tet_summaries().len() {
            let chunk = part.tet_chunk(chunk as u32)?;
            for (t, tet) in (chunk.first..).zip(&chunk.records) {
                let corners = part.corners(tet.nodes)?;
                let quality = Shape::new(corners.map(|c| c.point)).quality;
                found.all.add(quality);
                if forced.contains(t.into()) || corners.iter().all(|c| c.input_index().is_some()) {
                    found.forced.add(quality);
                } else {
                    found.unforced.add(quality);
                }
                if tet.nodes.into_iter().any(|v| at_interface.contains(v.into())) {
                    found.at_interface.add(quality);
                }
            }
        }
    }
    // A sub-domain's interface faces are those of its neighbors too.
    found.interface_faces /= 2;
    Ok(found)
}

fn forced_by_face(part: &mut Subdomain) -> Result<BitSet, StoreError> {
    let mut forced = BitSet::new(part.row().tets);
    for chunk in 0..part.row().chunks[2] {
        for facet in part.facet_chunk(chunk)?.records {
            let corners = part.corners(facet.vertices)?;
            if is_forcing(corners.map(|c| c.point)) {
                forced.insert_all(facet.tets.into_iter().filter(|&tet| tet != NO_TET));
            }
        }
    }
    Ok(forced)
}

fn interface_vertices(part: &mut Subdomain) -> Result<BitSet, StoreError> {
    let mut vertices = BitSet::new(part.row().vertices);
    for chunk in 0..part.row().chunks[3] {
        for face in part.interface_chunk(chunk)?.records {
            vertices.insert_all(face.vertices);
        }
    }
    Ok(vertices)
}
