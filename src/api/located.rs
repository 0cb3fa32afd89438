//! Where points lie in their tetrahedra.

use super::{Error, Store};
use crate::geom::Point;
use crate::query::Hit;

impl Store {
    /// [`Store::locate`], with the point's barycentric coordinates: of sum 1 but for rounding, and exactly zero on a face.
    ///
    /// Shape: the answer runs parallel to `points`. Errors: damage; too little memory.
    pub fn locate_barycentric(
        &mut self,
        points: &[[f64; 3]],
    ) -> Result<Vec<Option<(Hit, [f64; 4])>>, Error> {
        self.with_session(|session| {
            let points: Vec<_> = points.iter().map(|p| Point::from_array(*p)).collect();
            let located = session.locate(&points)?.into_iter();
            let answer = located.map(|l| l.found.map(|hit| (hit, l.barycentric)));
            Ok(answer.collect())
        })
    }
}
