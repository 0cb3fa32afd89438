//! Where points lie in their tetrahedra.

use super::{Error, Store};
use tetdb_base::geom::Point;
use tetdb_store::query::Hit;

/// A tetrahedron, and the shares of its corners in a point.
type Located = (Hit, [f64; 4]);

impl Store {
    /// [`Store::locate`], with the point's barycentric coordinates: of sum 1 but for rounding, and exactly zero on a face.
    ///
    /// Shape: the answer runs parallel to `points`. Errors: damage; too little memory.
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
