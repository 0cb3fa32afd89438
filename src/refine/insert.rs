//! Insert one candidate, or leave the mesh as it is.

use super::candidates::Candidate;
use super::{Field, RefineReport, Worker};
use crate::delaunay::{Located, Rejected};
use crate::geom::Point;
use crate::mesh::Mesh;
use crate::mesh::anatomy::FROZEN;
use crate::storage::Pages;

/// Least distance to a vertex, in units of the mean of both wanted lengths.
const FILTER: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Least height above a required face of the cavity, in units of h: a flatter tetrahedron on it could not be mended,
/// because neither the face nor its vertices move.
const HEIGHT: f64 = 0.25;

/// Points inserted that are compared with the next one before anything else is done about it. With 16 they refuse half of what is too
/// near in the end, with 64 a little more.
const RECENT: usize = 32;

/// The last points inserted. Candidates come along the curve, so what refuses one is often among them, and else the nearest of
/// them is a good place to start the walk: comparing costs a fiftieth of walking from the divided edge, which is long gone.
pub(super) struct Recent {
    points: [(Point, f32); RECENT],
    /// A tetrahedron of each.
    tets: [u32; RECENT],
    n: usize,
}

impl Recent {
    pub(super) fn new() -> Self {
        Self {
            points: [(Point::ZERO, 0.0); RECENT],
            tets: [0; RECENT],
            n: 0,
        }
    }

    pub(super) fn clear(&mut self) {
        self.n = 0;
    }

    fn push(&mut self, c: &Candidate, tet: u32) {
        self.points[self.n % RECENT] = (c.point, c.h);
        self.tets[self.n % RECENT] = tet;
        self.n += 1;
    }

    /// Where to start the walk to `c`; none when one of the points is nearer than wanted.
    fn hint(&self, c: &Candidate) -> Option<u32> {
        let (mut nearest, mut at) = (NEAR_START * f64::from(c.h) * f64::from(c.h), usize::MAX);
        for (k, &(q, h)) in self.points[..self.n.min(RECENT)].iter().enumerate() {
            let squared = (q - c.point).length_squared();
            if squared < nearest {
                if refuses(squared, h, c) {
                    return None;
                }
                (nearest, at) = (squared, k);
            }
        }
        Some(self.tets.get(at).copied().unwrap_or(c.tet))
    }
}

/// Square of the distance, in units of h, below which a point just inserted is a better place to start than the divided edge.
const NEAR_START: f64 = 4.0;

impl Worker {
    /// Inserts `c` unless something forbids.
    pub(super) fn try_insert<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        field: &Field,
        c: &Candidate,
        report: &mut RefineReport,
    ) {
        let Some(hint) = self.recent.hint(c) else {
            report.near += 1;
            return;
        };
        let start = match self.find(mesh, c, hint) {
            Ok(start) => start,
            Err(_) => {
                report.blocked += 1;
                return;
            }
        };
        let too_near = (start.record.vertices().into_iter()).any(|v| is_near(mesh, v, c));
        if too_near {
            report.near += 1;
            return;
        }
        let (region, _) = mesh.tet_attribute(start.tet);
        let gathered = self
            .kernel
            .gather_constrained(mesh, c.point, &start, |mesh, v| is_near(mesh, v, c));
        match gathered {
            Ok(()) => {}
            Err(Rejected::Refused) => {
                report.near += 1;
                return;
            }
            Err(_) => {
                report.blocked += 1;
                return;
            }
        }
        if self.is_flat(mesh, c) {
            self.kernel.discard(mesh);
            report.near += 1;
            return;
        }
        if field.place.forbids(c.point, f64::from(c.h)) {
            self.kernel.discard(mesh);
            report.out_of_place += 1;
            return;
        }
        if self.wants_frozen(mesh) {
            self.kernel.discard(mesh);
            report.frozen_hits += 1;
            return;
        }
        let v = mesh.add_vertex(c.point, c.h);
        let recycled = self.kernel.cavity().len();
        self.last = self.kernel.fill(mesh, v);
        for (k, &t) in self.kernel.new_tets().iter().enumerate() {
            self.active.touch(t);
            // Recycled ids lie in the same region and carry its attribute already.
            if k >= recycled {
                mesh.set_tet_attribute(t, region, 0);
            }
        }
        report.inserted += 1;
        self.recent.push(c, self.last);
    }

    fn find<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        c: &Candidate,
        hint: u32,
    ) -> Result<Located, Rejected> {
        self.kernel
            .locate(mesh, c.point, hint)
            .or_else(|_| self.kernel.locate(mesh, c.point, c.tet))
            .or_else(|_| self.kernel.locate(mesh, c.point, self.last))
    }

    /// Whether the gathered cavity holds a tetrahedron frozen beside an interface: its face there is an outer one.
    fn wants_frozen<P: Pages>(&mut self, mesh: &mut Mesh<P>) -> bool {
        (self.kernel.faces().iter())
            .filter(|f| f.required)
            .any(|f| mesh.tet_attribute(f.inside.tet()).1 & FROZEN != 0)
    }

    /// Whether the gathered cavity has a required face too near.
    fn is_flat<P: Pages>(&mut self, mesh: &mut Mesh<P>, c: &Candidate) -> bool {
        self.kernel.faces().iter().filter(|f| f.required).any(|f| {
            let [p, q, r] = [
                mesh.point(f.vertices[0]),
                mesh.point(f.vertices[1]),
                mesh.point(f.vertices[2]),
            ];
            height(c.point, p, q, r) < HEIGHT * f64::from(c.h)
        })
    }
}

#[inline]
fn is_near<P: Pages>(mesh: &mut Mesh<P>, v: u32, c: &Candidate) -> bool {
    let (q, h) = mesh.point_and_size(v);
    refuses((q - c.point).length_squared(), h, c)
}

/// Whether a vertex of size `h` at the square root of a distance is too near to the candidate.
#[inline(always)]
fn refuses(squared: f64, h: f32, c: &Candidate) -> bool {
    let least = FILTER * 0.5 * (f64::from(h) + f64::from(c.h));
    squared < least * least
}

fn height(p: Point, a: Point, b: Point, c: Point) -> f64 {
    let normal = (b - a).cross(c - a);
    (p - a).dot(normal).abs() / normal.length()
}
