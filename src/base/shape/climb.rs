//! Random search for the highest place of a function of a point: for maxima of minima, which have ridges and no gradient.
//!
//! Steps go in random directions and in the opposite ones, bent towards where the last ones have led; a success makes them longer,
//! a failure shorter. Along axes alone a search gets stuck on the first ridge that is oblique. The random numbers
//! begin with the same seed in every search, so the result depends on the function and the start alone.
//!
//! Source: F. J. Solis and R. J.-B. Wets, "Minimization by random search techniques" (1981).

use crate::geom::Point;

/// Steps grow by this after a success and shrink by the other after two failures (there and back). On a smooth slope one step in three
/// succeeds; then they keep their length.
const LONGER: f64 = 1.6;
const SHORTER: f64 = 0.8;
/// Share of a successful step that is added to later steps, and the share of it that remains after each step.
const BEND: f64 = 0.4;
const BEND_LEFT: f64 = 0.5;

/// Begin and end of a search.
#[derive(Clone, Copy, Debug)]
pub struct Climb {
    /// The first place.
    pub start: Point,
    /// Length of the first step.
    pub step: f64,
    /// Steps tried, each there and back.
    pub steps: u32,
    /// Ends at this value.
    pub enough: f64,
}

impl Climb {
    /// The highest place found and its value, where that is above `floor`, which is the value at the start or more.
    ///
    /// `value` is given a point and the best value so far, and may return anything of at most that when it is not above it.
    pub fn run(
        &self,
        floor: f64,
        mut value: impl FnMut(Point, f64) -> f64,
    ) -> Option<(Point, f64)> {
        let (mut at, mut best, mut step) = (self.start, floor, self.step);
        let (mut bend, mut random) = (Point::ZERO, Directions(1));
        let mut found = false;
        for _ in 0..self.steps {
            if best >= self.enough {
                break;
            }
            let shift = random.next() * step + bend;
            let there = value(at + shift, best);
            let shift = if there > best {
                best = there;
                shift
            } else {
                let back = value(at - shift, best);
                if back <= best || back.is_nan() {
                    bend *= BEND_LEFT;
                    step *= SHORTER;
                    continue;
                }
                best = back;
                -shift
            };
            at += shift;
            bend = bend * BEND_LEFT + shift * BEND;
            step *= LONGER;
            found = true;
        }
        found.then_some((at, best))
    }
}

/// Random unit vectors.
struct Directions(u64);

impl Directions {
    fn next(&mut self) -> Point {
        loop {
            let p = Point::new(self.number(), self.number(), self.number());
            let square = p.dot(p);
            if square > 0.01 && square <= 1.0 {
                return p / square.sqrt();
            }
        }
    }

    /// In [-1, 1).
    fn number(&mut self) -> f64 {
        self.0 = (self.0)
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_oblique_ridge_is_followed_to_its_top() {
        // The least of three planes and a distance: a ridge on which every step along an axis goes down.
        let top = Point::new(0.3, -0.2, 0.5);
        let value = |p: Point, _: f64| {
            let d = p - top;
            let (s, t) = (d.x + d.y + d.z, d.x - d.y);
            (-10.0 * s.abs() - 0.5 * d.length()).min(-8.0 * t.abs() - 0.5 * d.length())
        };
        for scale in [1e-9, 1.0, 1e9] {
            let climb =
                Climb { start: Point::ZERO, step: 0.3 * scale, steps: 1000, enough: f64::INFINITY };
            let scaled = |p: Point, best: f64| value(p / scale, best);
            let start = scaled(Point::ZERO, 0.0);
            let (at, best) = climb.run(start, scaled).expect("it goes up");
            assert!((at / scale - top).length() < 0.05 * top.length(), "{at} {best}");
        }
        let flat = Climb { start: Point::ZERO, step: 1.0, steps: 50, enough: 1.0 };
        assert!(flat.run(0.0, |_, _| 0.0).is_none());
        assert!(flat.run(0.0, |_, _| f64::NAN).is_none());
    }
}
