//! Finds the tetrahedron of a point by walking through faces.

use super::kernel::{Kernel, PointLocation, Rejected};
use crate::mesh::Mesh;
use crate::mesh::anatomy::FACES;
use tetdb_base::geom::{Point, orient};
use tetdb_base::storage::Pages;

/// A walk longer than this is lost: a mesh of 2^30 tetrahedra has about 1000 along an axis.
const STEPS_MAX: u32 = 100_000;

impl Kernel {
    /// The tetrahedron that holds `p` (in its interior or on its boundary), walking from `hint`.
    ///
    /// Each step leaves through a face that strictly separates the tetrahedron from `p`. The order in which faces are
    /// tested changes from step to step, so that no cycle is walked for ever.
    ///
    /// Errors: [`Rejected::Outside`] when the walk leaves the mesh, or `hint` is not in use.
    pub fn locate<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        p: Point,
        hint: u32,
    ) -> Result<PointLocation, Rejected> {
        let mut tet = hint;
        let mut record = mesh.tet(tet);
        if !record.is_live() {
            return Err(Rejected::Outside);
        }
        let mut points = mesh.points(&record);
        // The face through which the walk came: `p` is not beyond it.
        let mut entry = usize::MAX;
        for step in 0..STEPS_MAX {
            self.stats.walk_steps += 1;
            let mut exit = None;
            for k in 0..4 {
                let i = ((self.turn as usize) + k) & 3;
                if i == entry {
                    continue;
                }
                let [a, b, c] = FACES[i];
                if orient(p, points[a], points[b], points[c]) < 0.0 {
                    exit = Some(i);
                    break;
                }
            }
            self.turn = self.turn.wrapping_mul(1_664_525).wrapping_add(1_013_904_223) ^ (step >> 3);
            let Some(i) = exit else {
                return Ok(PointLocation { tet, record, points });
            };
            let across = record.neighbor[i];
            if !across.exists() {
                return Err(Rejected::Outside);
            }
            tet = across.tet();
            record = mesh.tet(tet);
            points = mesh.points(&record);
            entry = across.face();
        }
        Err(Rejected::Outside)
    }
}
