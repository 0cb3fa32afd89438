//! A new vertex in the cavity of a bad tetrahedron.
//!
//! The cavity is the one the Delaunay kernel would open; the vertex then goes to the best place found
//! in it, which need not be Delaunay. Nothing is changed unless the ball of insertion is better than the cavity: its worst
//! tetrahedron, or the sum of what is missing.

use super::deficit::{Deficit, GAIN};
use super::smooth::{ROUNDING, Star, raised};
use crate::delaunay::{Kernel, PointLocation};
use crate::mesh::anatomy::{EDGES, FACES};
use crate::mesh::{Mesh, Tet};
use crate::reconnect::Inherited;
use tetdb_base::geom::orient;
use tetdb_base::shape::{face_bound, inverse_quality};
use tetdb_base::storage::Pages;

/// A cavity that meets more vertices while it grows, the same one more than once, or has more outer faces is left alone.
const VERTICES_MAX: u32 = 64;
const FACES_MAX: usize = 64;

/// A new vertex must leave nothing worse than this: q = 10.
const GOOD_MIN: f64 = 0.1;

/// What must be better afterwards.
#[derive(Clone, Copy, Debug)]
pub(super) enum Better {
    /// The worst goodness; searches stop at `enough`.
    Worst { enough: f64 },
    /// The sum of what is missing.
    Sum,
}

/// Scratch of the insertion.
#[derive(Default)]
pub(super) struct Inserter {
    kernel: Kernel,
    star: Star,
}

impl Inserter {
    /// Tries the centroid, then the middles of the longest edge and of the one opposite it.
    pub(super) fn insert<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        t: u32,
        tet: &Tet,
        better: Better,
    ) -> bool {
        let points = mesh.points(tet);
        // The cavity keeps the required faces of what is in it, and one that allows no less is in every ball.
        let is_needle = |i: usize| {
            tet.is_required(i)
                && face_bound(FACES[i].map(|k| points[k])) * (1.0 + ROUNDING) <= GOOD_MIN
        };
        if (0..4).any(is_needle) {
            return false;
        }
        let middle = |e: usize| (points[EDGES[e][0]] + points[EDGES[e][1]]) * 0.5;
        let length = |e: usize| (points[EDGES[e][0]] - points[EDGES[e][1]]).length_squared();
        let longest = (1..6).fold(0, |best, e| if length(e) > length(best) { e } else { best });
        let centroid = (points[0] + points[1] + points[2] + points[3]) * 0.25;
        let start = PointLocation { tet: t, record: *tet, points };
        for p in [centroid, middle(longest), middle(5 - longest)] {
            // The tetrahedron itself would not be left in the cavity: most of the middles are on the surface.
            let is_blocked = |i: usize| {
                let [f, g, h] = FACES[i].map(|k| points[k]);
                (tet.is_required(i) || !tet.neighbor[i].exists()) && orient(p, f, g, h) <= 0.0
            };
            if (0..4).any(is_blocked) {
                continue;
            }
            let mut room = VERTICES_MAX;
            let gathered = self.kernel.gather_constrained(mesh, p, &start, |_, _| {
                room -= 1;
                room == 0
            });
            if gathered.is_err() {
                continue;
            }
            if self.fill_if_better(mesh, tet, p, better) {
                return true;
            }
            self.kernel.discard(mesh);
        }
        false
    }

    /// Tetrahedra made by the last success.
    pub(super) fn new_tets(&self) -> &[u32] {
        self.kernel.new_tets()
    }

    fn fill_if_better<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        tet: &Tet,
        p: tetdb_base::geom::Point,
        better: Better,
    ) -> bool {
        if self.kernel.faces().len() > FACES_MAX {
            return false;
        }
        let mut deficit = Deficit::default();
        let mut old = Vec::with_capacity(self.kernel.cavity().len());
        for &t in self.kernel.cavity() {
            let record = mesh.tet(t);
            deficit.add(inverse_quality(mesh.points(&record)));
            old.push((t, record.vertices()));
        }
        self.star.at = p;
        self.star.faces.clear();
        for face in self.kernel.faces() {
            self.star.faces.push(face.vertices.map(|v| mesh.point(v)));
        }
        let (floor, enough) = match better {
            Better::Worst { enough } => {
                self.star.bar = None;
                (raised(deficit.worst).max(GOOD_MIN), enough)
            }
            Better::Sum => {
                self.star.bar = Some(deficit.bar().at_least(GOOD_MIN));
                (deficit.sum + GAIN, 0.0)
            }
        };
        if self.star.most() <= floor {
            return false;
        }
        let Some((best, _)) = self.star.search(floor, enough) else {
            return false;
        };
        let h = tet.vertices().map(|v| mesh.size(v));
        let v = mesh.add_vertex(best, (h[0] + h[1] + h[2] + h[3]) * 0.25);
        mesh.set_vertex_attribute(v, crate::mesh::VertexTag::Free, 0);
        let inherited = Inherited::read(mesh, old.into_iter());
        self.kernel.fill(mesh, v);
        for &t in self.kernel.new_tets() {
            let vertices = mesh.tet(t).vertices();
            inherited.write(mesh, t, vertices);
            for w in vertices {
                mesh.set_tet_of(w, t);
            }
        }
        true
    }
}
