//! The circumsphere of one tetrahedron, asked about several points.

use tetdb_base::geom::{Point, insphere, larger};

/// Forward error of the filtered test: 54 monomials of degree 5 bounded by L⁴ E and 18 bounded by L³ E², each
/// rounded at most 17 times, 2⁻⁵³ each; L and E are the largest differences among the corners and to the point asked about.
const BOUND_CORNERS: f64 = 1.1e-13;
const BOUND_POINT: f64 = 3.6e-14;
/// Outside these differences products can underflow or overflow and the bounds stop being bounds.
const DIFFERENCES: std::ops::Range<f64> = 1e-58..1e58;

/// A positive tetrahedron's sphere: seen from its first corner, center = `normal / (2 det)`.
///
/// Small, so that many lie side by side: whoever asks has the corners again where they are needed.
pub(super) struct Sphere {
    first: Point,
    normal: Point,
    det: f64,
    largest: f64,
}

impl Sphere {
    #[inline(always)]
    pub(super) fn new(corners: [Point; 4]) -> Self {
        let [a, b, c, d] = corners;
        let (u, v, w) = (b - a, c - a, d - a);
        let (vw, wu, uv) = (v.cross(w), w.cross(u), u.cross(v));
        Self {
            first: a,
            normal: vw * u.dot(u) + wu * v.dot(v) + uv * w.dot(w),
            det: u.dot(vw),
            largest: larger(larger(greatest(u), greatest(v)), greatest(w)),
        }
    }

    /// Whether `e` is strictly inside; exact. `corners` are those of the tetrahedron.
    #[inline(always)]
    pub(super) fn has_inside(&self, e: Point, corners: impl FnOnce() -> [Point; 4]) -> bool {
        let from = e - self.first;
        let (squares, along) = (from.dot(from) * self.det, from.dot(self.normal));
        let power = squares - along;
        let (l, m) = (self.largest, greatest(from));
        let bound = l * l * l * m * (BOUND_CORNERS * l + BOUND_POINT * m);
        if power.abs() > bound && DIFFERENCES.contains(&l) && DIFFERENCES.contains(&m) {
            return power < 0.0;
        }
        let [a, b, c, d] = corners();
        insphere(a, b, c, d, e) > 0.0
    }
}

/// The greatest of the coordinates without their signs.
#[inline(always)]
fn greatest(p: Point) -> f64 {
    let p = p.abs();
    larger(larger(p.x, p.y), p.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetdb_base::geom::orient;

    #[test]
    fn agrees_with_the_exact_sign() {
        let mut state = 1u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            // Few bits, so that many points lie on one sphere.
            f64::from((state >> 61) as u32)
        };
        let (mut inside, mut on) = (0, 0);
        for k in 0..5000 {
            let scale = if k % 2 == 0 { 1.0 } else { 0.1 };
            let mut p = [0; 5].map(|_| Point::new(next(), next(), next()) * scale);
            let sign = orient(p[0], p[1], p[2], p[3]);
            if sign == 0.0 || p[..4].contains(&p[4]) {
                continue;
            }
            if sign < 0.0 {
                p.swap(0, 1);
            }
            let exact = insphere(p[0], p[1], p[2], p[3], p[4]);
            let corners = [p[0], p[1], p[2], p[3]];
            let told = Sphere::new(corners).has_inside(p[4], || corners);
            assert_eq!(told, exact > 0.0, "{p:?}");
            inside += u32::from(told);
            on += u32::from(exact == 0.0);
        }
        assert!(inside > 100 && on > 4, "{inside} {on}");
    }
}
