//! The first tetrahedron on a ray.
//!
//! A tetrahedron that meets the ray meets two planes through it, so a question reads only the chunks along the ray. Distances are
//! rounded, because they only serve pointing.

use std::ops::RangeInclusive;

use tetdb_base::geom::Point;
use tetdb_schema::record::FACES;
use tetdb_store::query::{Hit, QueryError, QuerySession, Selection, Solid};

/// A half line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Its end.
    pub origin: Point,
    /// Its direction; any length but zero.
    pub direction: Point,
}

impl Ray {
    /// Cuts a range of distances to the half space behind a plane, whose normal points out of it.
    fn behind(
        &self,
        range: RangeInclusive<f64>,
        [point, normal]: [Point; 2],
    ) -> RangeInclusive<f64> {
        let (from, to) = range.into_inner();
        let (speed, height) = (self.direction.dot(normal), (point - self.origin).dot(normal));
        match speed {
            _ if speed > 0.0 => from..=to.min(height / speed),
            _ if speed < 0.0 => from.max(height / speed)..=to,
            _ if height >= 0.0 => from..=to,
            // A ray beside the half space has no point in it.
            _ => f64::INFINITY..=f64::NEG_INFINITY,
        }
    }
}

/// Returns the first of the selected tetrahedra that the ray meets behind the plane `clip`, and the distance in lengths of its direction.
///
/// Errors: damage.
pub fn pick(
    session: &mut QuerySession,
    ray: &Ray,
    clip: Option<[Point; 2]>,
    mut selection: Selection,
) -> Result<Option<(f64, Hit)>, QueryError> {
    let (across, up) = ray.direction.normalize().any_orthonormal_pair();
    for normal in [across, up] {
        selection.solids.push(Solid::Plane { point: ray.origin, normal });
    }
    let whole = match clip {
        Some(plane) => ray.behind(0.0..=f64::INFINITY, plane),
        None => 0.0..=f64::INFINITY,
    };
    let mut first: Option<(f64, Hit)> = None;
    for tet in session.select(selection)? {
        let tet = tet?;
        let range = FACES.iter().fold(whole.clone(), |range, face| {
            let [a, b, c] = face.map(|i| tet.corners[i]);
            ray.behind(range, [a, (b - a).cross(c - a)])
        });
        if !range.is_empty() && first.is_none_or(|(nearest, _)| *range.start() < nearest) {
            first = Some((*range.start(), tet));
        }
    }
    Ok(first)
}
