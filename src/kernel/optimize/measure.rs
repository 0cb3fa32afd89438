//! The quality table of a mesh: bins of q, extremes, and how Delaunay it is.

use super::sphere::Sphere;
use crate::mesh::anatomy::EDGES;
use crate::mesh::{Mesh, Tet};
use tetdb_base::geom::Point;
use tetdb_base::storage::{Pages, check_cancelled};

use tetdb_base::shape::quality;

/// Tetrahedra per bin: `[1,2[`, `[2,3[`, … `[9,10[`, `[10,∞[`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Histogram {
    /// Tetrahedra in each bin.
    pub bins: [u64; 10],
}

impl Histogram {
    /// Counts a tetrahedron of quality `q`.
    pub fn add(&mut self, q: f64) {
        // A cast saturates, so infinity lands in the last bin.
        self.bins[(q as usize).clamp(1, 10) - 1] += 1;
    }
    /// Tetrahedra counted.
    pub fn total(&self) -> u64 {
        self.bins.iter().sum()
    }
    /// Share of `[1,2[` among all; 1 for none at all.
    pub fn share_below_2(&self) -> f64 {
        let total = self.total();
        if total == 0 { 1.0 } else { self.bins[0] as f64 / total as f64 }
    }
}

/// What there is to say about the quality of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QualityTable {
    /// All tetrahedra by quality.
    pub histogram: Histogram,
    /// Largest q, and the tetrahedron that has it.
    pub worst: f64,
    /// Index of the tetrahedron of largest q.
    pub worst_tet: u32,
    /// Radians.
    pub dihedral_min: f64,
    /// Largest dihedral angle, in radians.
    pub dihedral_max: f64,
    /// Inner faces that are not required, and those of them whose opposite vertices are not inside the sphere (exact).
    pub faces: u64,
    /// Those that are locally Delaunay.
    pub faces_delaunay: u64,
}

impl QualityTable {
    /// Share of the inner, not required faces that are locally Delaunay.
    pub fn share_delaunay(&self) -> f64 {
        if self.faces == 0 { 1.0 } else { self.faces_delaunay as f64 / self.faces as f64 }
    }
}

/// Measures all tetrahedra in id order.
pub fn measure<P: Pages>(mesh: &mut Mesh<P>) -> QualityTable {
    let mut table = QualityTable {
        histogram: Histogram::default(),
        worst: 0.0,
        worst_tet: u32::MAX,
        dihedral_min: f64::INFINITY,
        dihedral_max: 0.0,
        faces: 0,
        faces_delaunay: 0,
    };
    // Cosines of the extreme dihedral angles.
    let (mut least, mut most) = (1.0f64, -1.0f64);
    let mut from = 0;
    while let Some((t, tet)) = mesh.next_tet(from) {
        from = t + 1;
        if t & 1023 == 0 {
            check_cancelled();
        }
        let p = mesh.points(&tet);
        let q = quality(p);
        table.histogram.add(q);
        if q > table.worst {
            (table.worst, table.worst_tet) = (q, t);
        }
        for cosine in dihedral_cosines(p) {
            least = least.min(cosine);
            most = most.max(cosine);
        }
        count_faces(mesh, t, &tet, p, &mut table);
    }
    if table.worst_tet != u32::MAX {
        table.dihedral_min = most.clamp(-1.0, 1.0).acos();
        table.dihedral_max = least.clamp(-1.0, 1.0).acos();
    }
    table
}

fn count_faces<P: Pages>(
    mesh: &mut Mesh<P>,
    t: u32,
    tet: &Tet,
    p: [Point; 4],
    table: &mut QualityTable,
) {
    let sphere = Sphere::new(p);
    for i in 0..4 {
        let across = tet.neighbor[i];
        if !across.exists() || across.tet() < t || tet.is_required(i) {
            continue;
        }
        let apex = mesh.apex(across);
        let apex = mesh.point(apex);
        table.faces += 1;
        table.faces_delaunay += u64::from(!sphere.has_inside(apex, || p));
    }
}

/// Cosines of the six dihedral angles, by edge.
pub(super) fn dihedral_cosines(p: [Point; 4]) -> [f64; 6] {
    // Outward normals of the four faces.
    let normal = crate::mesh::anatomy::FACES
        .map(|[a, b, c]| (p[b] - p[a]).cross(p[c] - p[a]).normalize_or_zero());
    // The faces at edge i j are those opposite the other two vertices.
    [0, 1, 2, 3, 4, 5].map(|e: usize| {
        let [k, l] = EDGES[5 - e];
        -normal[k].dot(normal[l])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_and_angles_are_as_told() {
        let mut h = Histogram::default();
        for q in [1.0, 1.999, 2.0, 9.5, 10.0, 1e300, f64::INFINITY, 0.999_999] {
            h.add(q);
        }
        assert_eq!(h.bins, [3, 1, 0, 0, 0, 0, 0, 0, 1, 3]);
        let corner = [Point::ZERO, Point::X, Point::Y, Point::Z];
        let angles = dihedral_cosines(corner).map(|c| c.acos().to_degrees());
        for (e, angle) in angles.into_iter().enumerate() {
            let wanted = if e < 3 { 90.0 } else { 54.735_610_317 };
            assert!((angle - wanted).abs() < 1e-6, "edge {e}: {angle}");
        }
    }
}
