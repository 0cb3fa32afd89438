//! Points and their barycentric coordinates in the tetrahedra of a mesh.

use super::{Error, Store};
use tetdb_base::geom::Point;
use tetdb_store::query::Hit;

/// A tetrahedron, and the barycentric coordinates of a point in it.
type Located = (Hit, [f64; 4]);

impl Store {
    /// Like [`Store::locate`], with the barycentric coordinates of each point. Their sum is 1 up to rounding, and a coordinate is
    /// exactly zero on a face.
    ///
    /// Shape: the result runs parallel to `points`. Errors: damage; too little memory.
    pub fn locate_barycentric(
        &mut self,
        points: &[[f64; 3]],
    ) -> Result<Vec<Option<Located>>, Error> {
        self.with_session(|session| {
            let points: Vec<_> = points.iter().map(|p| Point::from_array(*p)).collect();
            let located = session.locate(&points)?.into_iter();
            let answer = located.map(|l| l.found.map(|hit| (hit, l.barycentric)));
            Ok(answer.collect())
        })
    }
}
