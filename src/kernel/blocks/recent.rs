//! The points inserted last, as the first that the next one is compared with.

use tetdb_base::geom::Point;

/// Points inserted that are compared with the next one before anything else is done about it. They refuse three in five of what is too near
/// in the end, with 64 a little more.
const RECENT: usize = 32;

/// The last points inserted. Candidates come along the curve, so what refuses one is often among them, and else the nearest of
/// them is a good place to start the walk: comparing costs a fiftieth of walking from the tetrahedron that wanted it, which is long gone.
pub(super) struct Recent {
    points: [(Point, f32); RECENT],
    /// A tetrahedron of each.
    tets: [u32; RECENT],
    n: usize,
}

impl Recent {
    pub fn new() -> Self {
        Self { points: [(Point::ZERO, 0.0); RECENT], tets: [0; RECENT], n: 0 }
    }

    pub fn clear(&mut self) {
        self.n = 0;
    }

    /// Adds a point that was inserted, its wanted length and a tetrahedron of it.
    pub fn push(&mut self, point: Point, h: f32, tet: u32) {
        self.points[self.n % RECENT] = (point, h);
        self.tets[self.n % RECENT] = tet;
        self.n += 1;
    }

    /// A tetrahedron of the last one.
    pub fn last(&self) -> Option<u32> {
        Some(self.tets[self.n.checked_sub(1)? % RECENT])
    }

    /// Where to start the walk to a point of wanted length `h`: at `tet` or at one of the last. None when `refuses` says of one of these, given the
    /// square of its distance and its length, that it is too near.
    pub fn hint(
        &self,
        point: Point,
        h: f32,
        tet: u32,
        refuses: impl Fn(f64, f32) -> bool,
    ) -> Option<u32> {
        let (mut nearest, mut at) = (NEAR_START * f64::from(h) * f64::from(h), usize::MAX);
        for (k, &(q, h)) in self.points[..self.n.min(RECENT)].iter().enumerate() {
            let squared = (q - point).length_squared();
            if squared < nearest {
                if refuses(squared, h) {
                    return None;
                }
                (nearest, at) = (squared, k);
            }
        }
        Some(self.tets.get(at).copied().unwrap_or(tet))
    }
}

/// Square of the distance, in units of h, below which a point just inserted is a better place to start than where it is wanted.
const NEAR_START: f64 = 4.0;
