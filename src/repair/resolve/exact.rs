//! Points constructed exactly: quotients of whole numbers, compared without error and rounded once.

use std::cmp::Ordering;

use tetdb_base::geom::{Dyadic, Point};

/// Magnitude below which rounded coordinates are too near zero to be compared for their exact ones.
const COMPARABLE_MIN: f64 = 1e-300;

/// A point `x / w`, and the double nearest to it.
#[derive(Clone, Debug)]
pub struct ExactPoint {
    x: [Dyadic; 3],
    /// Positive.
    w: Dyadic,
    /// The point rounded to the nearest doubles; ties to even.
    pub at: Point,
}

fn negated(x: &Dyadic) -> Dyadic {
    Dyadic::default().minus(x)
}

fn magnitude(x: Dyadic) -> Dyadic {
    if x.sign() < 0 { negated(&x) } else { x }
}

impl From<Point> for ExactPoint {
    fn from(p: Point) -> Self {
        Self { x: p.to_array().map(Dyadic::from), w: Dyadic::from(1.0), at: p }
    }
}

impl ExactPoint {
    /// The point of the line through two points where a linear function is zero. `a_value` and `b_value` are its values there, each
    /// times the denominator of the point.
    pub fn between(a: &Self, b: &Self, a_value: &Dyadic, b_value: &Dyadic) -> Self {
        let mixed = |p: &Dyadic, q: &Dyadic| q.times(a_value).minus(&p.times(b_value));
        let mut x = [0, 1, 2].map(|k| mixed(&a.x[k], &b.x[k]));
        let mut w = mixed(&a.w, &b.w);
        if w.sign() < 0 {
            (x, w) = (x.map(|x| negated(&x)), negated(&w));
        }
        let at = Point::from_array([0, 1, 2].map(|k| nearest(&x[k], &w)));
        Self { x, w, at }
    }

    /// Order by x, then y, then z: on a line, the order along it.
    pub fn compare(&self, other: &Self) -> Ordering {
        (0..3).map(|k| self.compare_on(k, other)).find(|o| o.is_ne()).unwrap_or(Ordering::Equal)
    }

    fn compare_on(&self, k: usize, other: &Self) -> Ordering {
        let (a, b) = (self.at[k], other.at[k]);
        // Rounding keeps the order of what it keeps apart.
        if a != b && a.abs().max(b.abs()) > COMPARABLE_MIN {
            return a.total_cmp(&b);
        }
        self.x[k].times(&other.w).compare(&other.x[k].times(&self.w))
    }

    /// Distance to a position, within the precision of doubles.
    pub fn distance(&self, to: Point) -> f64 {
        let off = |k: usize| {
            let rest = self.x[k].minus(&Dyadic::from(to[k]).times(&self.w));
            match rest.sign() {
                0 => 0.0,
                _ => rest.over(&self.w, 1).map_or(0.0, |q| q.estimate()),
            }
        };
        Point::new(off(0), off(1), off(2)).length()
    }
}

/// The double nearest to `x / w`; of two the even one. Quotients below the least normal double become it or zero.
fn nearest(x: &Dyadic, w: &Dyadic) -> f64 {
    let guess = x.over(w, 2).map_or(0.0, |q| q.estimate());
    let candidates = match guess.abs() <= f64::MIN_POSITIVE {
        true => [0.0, f64::MIN_POSITIVE.copysign(guess), guess.next_up().max(f64::MIN_POSITIVE)],
        false => [guess, guess.next_down(), guess.next_up()],
    };
    let off = |c: f64| magnitude(x.minus(&Dyadic::from(c).times(w)));
    let mut best = (candidates[0], off(candidates[0]));
    for c in &candidates[1..] {
        let other = off(*c);
        let order = other.compare(&best.1);
        if order.is_lt() || order.is_eq() && c.to_bits() & 1 == 0 {
            best = (*c, other);
        }
    }
    best.0
}

/// The plane of a triangle, which must have area.
pub struct Plane {
    normal: [Dyadic; 3],
    offset: Dyadic,
}

impl Plane {
    /// The plane of three points.
    pub fn new(t: [Point; 3]) -> Self {
        let [a, b, c] = t.map(|p| p.to_array().map(Dyadic::from));
        let less = |p: &[Dyadic; 3]| [0, 1, 2].map(|k| p[k].minus(&a[k]));
        let (u, v) = (less(&b), less(&c));
        let normal =
            [(1, 2), (2, 0), (0, 1)].map(|(i, j)| u[i].times(&v[j]).minus(&u[j].times(&v[i])));
        let offset = dot(&normal, &a);
        Self { normal, offset }
    }

    /// A value that is zero in the plane and linear in space.
    pub fn value(&self, p: Point) -> Dyadic {
        dot(&self.normal, &p.to_array().map(Dyadic::from)).minus(&self.offset)
    }
}

fn dot(a: &[Dyadic; 3], b: &[Dyadic; 3]) -> Dyadic {
    a[0].times(&b[0]).plus(&a[1].times(&b[1])).plus(&a[2].times(&b[2]))
}

/// Points of a triangle's plane as points of two coordinates, so that the triangle runs counter-clockwise.
#[derive(Clone, Copy)]
pub struct Projection {
    axes: [usize; 2],
    hand: i32,
}

impl Projection {
    /// A projection for the plane of `t`, which must have area.
    pub fn new(t: [Point; 3]) -> Self {
        let normal = (t[1] - t[0]).cross(t[2] - t[0]).abs().to_array();
        let mut order = [0, 1, 2];
        order.sort_by(|&i: &usize, &j| normal[j].total_cmp(&normal[i]));
        let [a, b, c] = t.map(ExactPoint::from);
        let along = order.map(|k| Self { axes: [(k + 1) % 3, (k + 2) % 3], hand: 1 });
        let turns = along.map(|p| p.turn(&a, &b, &c));
        let best = turns.iter().position(|&turn| turn != 0).unwrap_or(0);
        Self { hand: turns[best], ..along[best] }
    }

    /// 1 when `a b c` turn to the left, exactly.
    pub fn turn(&self, a: &ExactPoint, b: &ExactPoint, c: &ExactPoint) -> i32 {
        let [i, j] = self.axes;
        let ([ax, ay], [bx, by], [cx, cy]) =
            ([a.at[i], a.at[j]], [b.at[i], b.at[j]], [c.at[i], c.at[j]]);
        let (ux, uy, vx, vy) = (bx - ax, by - ay, cx - ax, cy - ay);
        let det = ux * vy - uy * vx;
        let largest = [ax, ay, bx, by, cx, cy].into_iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        // Each difference is off by three halves of the unit of the largest coordinate at most.
        let bound = 8.0 * f64::EPSILON * largest * (ux.abs() + uy.abs() + vx.abs() + vy.abs());
        if det.abs() > bound && bound > COMPARABLE_MIN {
            return if det > 0.0 { self.hand } else { -self.hand };
        }
        self.hand * area(self.axes, a, b, c).sign()
    }

    /// Twice the area of `a b c` times the denominators; positive when they turn to the left.
    pub fn area(&self, a: &ExactPoint, b: &ExactPoint, c: &ExactPoint) -> Dyadic {
        let area = area(self.axes, a, b, c);
        if self.hand < 0 { negated(&area) } else { area }
    }
}

fn area([i, j]: [usize; 2], a: &ExactPoint, b: &ExactPoint, c: &ExactPoint) -> Dyadic {
    let minor = |p: &Dyadic, q: &Dyadic, r: &Dyadic, s: &Dyadic| p.times(s).minus(&q.times(r));
    (a.x[i].times(&minor(&b.x[j], &b.w, &c.x[j], &c.w)))
        .minus(&a.x[j].times(&minor(&b.x[i], &b.w, &c.x[i], &c.w)))
        .plus(&a.w.times(&minor(&b.x[i], &b.x[j], &c.x[i], &c.x[j])))
}
