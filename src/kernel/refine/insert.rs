//! Insert one candidate, or leave the mesh as it is.

use super::candidate::Candidate;
use super::field::Field;
use super::recent::refuses;
use super::report::RefineReport;
use super::worker::Worker;
use crate::delaunay::{PointLocation, Rejected};
use crate::mesh::Mesh;
use crate::mesh::anatomy::FROZEN;
use tetdb_base::geom::Point;
use tetdb_base::storage::Pages;

/// Least height above a required face of the cavity, in units of h: a flatter tetrahedron on it could not be mended,
/// because neither the face nor its vertices move.
const HEIGHT: f64 = 0.25;

impl Worker {
    /// Inserts `c` unless something forbids.
    pub(super) fn try_insert<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        field: &Field,
        c: &Candidate,
        report: &mut RefineReport,
    ) {
        let Some(hint) = self.recent.hint(c.point, c.h, c.tet, |d, h| refuses(d, h, c)) else {
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
        let gathered =
            self.kernel.gather_constrained(mesh, c.point, &start, |mesh, v| is_near(mesh, v, c));
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
        self.put_in(mesh, c.point, c.h, region);
        report.inserted += 1;
        self.recent.push(c.point, c.h, self.last);
    }

    /// Replaces the gathered cavity, which lies in `region`, by the ball of a new vertex; returns that.
    pub(super) fn put_in<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        point: Point,
        h: f32,
        region: u32,
    ) -> u32 {
        let v = mesh.add_vertex(point, h);
        let recycled = self.kernel.cavity().len();
        self.last = self.kernel.fill(mesh, v);
        for (k, &t) in self.kernel.new_tets().iter().enumerate() {
            self.active.touch(t);
            // Recycled ids lie in the same region and carry its attribute already.
            if k >= recycled {
                mesh.set_tet_attribute(t, region, 0);
            }
        }
        v
    }

    fn find<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        c: &Candidate,
        hint: u32,
    ) -> Result<PointLocation, Rejected> {
        self.kernel
            .locate(mesh, c.point, hint)
            .or_else(|_| self.kernel.locate(mesh, c.point, c.tet))
            .or_else(|_| self.kernel.locate(mesh, c.point, self.last))
    }

    /// Whether the gathered cavity holds a tetrahedron frozen beside an interface: its face there is an outer one.
    pub(super) fn wants_frozen<P: Pages>(&mut self, mesh: &mut Mesh<P>) -> bool {
        (self.kernel.faces().iter())
            .filter(|f| f.required)
            .any(|f| mesh.tet_attribute(f.inside.tet()).1 & FROZEN != 0)
    }

    /// Whether the gathered cavity has a required face too near.
    fn is_flat<P: Pages>(&mut self, mesh: &mut Mesh<P>, c: &Candidate) -> bool {
        self.kernel.faces().iter().filter(|f| f.required).any(|f| {
            let [p, q, r] =
                [mesh.point(f.vertices[0]), mesh.point(f.vertices[1]), mesh.point(f.vertices[2])];
            height(c.point, p, q, r) < HEIGHT * f64::from(c.h)
        })
    }
}

#[inline]
fn is_near<P: Pages>(mesh: &mut Mesh<P>, v: u32, c: &Candidate) -> bool {
    let (q, h) = mesh.point_and_size(v);
    refuses((q - c.point).length_squared(), h, c)
}

fn height(p: Point, a: Point, b: Point, c: Point) -> f64 {
    let normal = (b - a).cross(c - a);
    (p - a).dot(normal).abs() / normal.length()
}
