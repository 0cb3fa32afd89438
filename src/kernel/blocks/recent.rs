//! The points inserted last, as the first that the next one is compared with.

use super::spawn::Candidate;
use tetdb_base::geom::Point;

/// Points compared.
const RECENT: usize = 32;
/// Square of the distance, in units of h, below which a point just inserted is a better place to start than the candidate's tetrahedron.
const NEAR_START: f64 = 4.0;

/// The last points inserted. Candidates come along the curve: what refuses one is often among them, and else the nearest of them
/// is a good place to start the walk.
#[derive(Default)]
pub(super) struct Recent {
    points: [(Point, f32, u32); RECENT],
    n: usize,
}

impl Recent {
    pub fn clear(&mut self) {
        self.n = 0;
    }

    pub fn push(&mut self, c: &Candidate, tet: u32) {
        self.points[self.n % RECENT] = (c.point, c.h, tet);
        self.n += 1;
    }

    /// A tetrahedron of the last one.
    pub fn last(&self) -> Option<u32> {
        let last = self.n.checked_sub(1)?;
        Some(self.points[last % RECENT].2)
    }

    /// Where to start the walk to `c`; none when one of the points is nearer than wanted.
    pub fn hint(&self, c: &Candidate) -> Option<u32> {
        let mut nearest = NEAR_START * f64::from(c.h) * f64::from(c.h);
        let mut hint = c.tet;
        for &(q, h, tet) in &self.points[..self.n.min(RECENT)] {
            let square = (q - c.point).length_squared();
            if square < nearest {
                if c.refuses(square, h) {
                    return None;
                }
                (nearest, hint) = (square, tet);
            }
        }
        Some(hint)
    }
}
