//! Quality of one tetrahedron: q = α · longest edge / inradius, α = √6/12, 1 for the regular one.
//!
//! Decisions use its inverse, the *goodness*: 1 for the regular tetrahedron, 0 for a flat one, larger is better.

use crate::geom::{Point, orient};

/// α = √6 / 12.
pub const ALPHA: f64 = 0.204_124_145_231_931_5;

/// Goodness of a tetrahedron that is left alone: q = 2, the first bin of the table.
pub const INVERSE_QUALITY_WANTED: f64 = 0.5;

/// Common parts of both measures.
struct Parts {
    /// Six times the volume, rounded.
    det: f64,
    /// Twice the sum of the face areas squared.
    areas: [f64; 4],
    longest_squared: f64,
}

#[inline(always)]
fn parts([a, b, c, d]: [Point; 4]) -> Parts {
    let (u, v, w) = (b - a, c - a, d - a);
    let (vw, wu, uv) = (v.cross(w), w.cross(u), u.cross(v));
    let across = vw + wu + uv;
    let squared = |p: Point| p.dot(p);
    let longest = |x: f64, y: f64| if x > y { x } else { y };
    let here = longest(longest(squared(u), squared(v)), squared(w));
    let there = longest(longest(squared(v - u), squared(w - u)), squared(w - v));
    Parts {
        det: u.dot(vw),
        areas: [squared(vw), squared(wu), squared(uv), squared(across)],
        longest_squared: longest(here, there),
    }
}

/// 1/q of an exactly positive tetrahedron, `f64::NEG_INFINITY` of any other.
#[inline(always)]
pub fn inverse_quality(points: [Point; 4]) -> f64 {
    let p = parts(points);
    // The rounding error of `det` is below 1e-14 of the cube of the longest edge.
    let is_sure =
        p.det * p.det > 1e-24 * (p.longest_squared * p.longest_squared * p.longest_squared);
    let is_positive = if is_sure {
        p.det > 0.0
    } else {
        let [a, b, c, d] = points;
        orient(a, b, c, d) > 0.0
    };
    if is_positive { ratio(&p).max(0.0) } else { f64::NEG_INFINITY }
}

/// det / (α · longest edge · 2 · sum of areas), without asking for the sign.
#[inline(always)]
fn ratio(p: &Parts) -> f64 {
    let [a, b, c, d] = p.areas;
    let sum = (a.sqrt() + b.sqrt()) + (c.sqrt() + d.sqrt());
    // Inradius = 3 V / S = (det / 2) / (sum / 2).
    p.det / (ALPHA * p.longest_squared.sqrt() * sum)
}

/// Share of [`face_bound`] that is taken for the best a face allows: an equilateral one allows 0.71 of it.
pub const CONTENT: f64 = 0.62;

/// A goodness that no tetrahedron on this face can exceed: its inscribed sphere is smaller than the circle
/// inscribed in any of its faces, and its longest edge is no shorter than the face's.
pub fn face_bound([a, b, c]: [Point; 3]) -> f64 {
    let (u, v) = (b - a, c - a);
    let (lu, lv, lw) = (u.length(), v.length(), (c - b).length());
    let longest = lu.max(lv).max(lw);
    // Radius of the inscribed circle: twice the area over the perimeter.
    let radius = u.cross(v).length() / (lu + lv + lw);
    radius / (ALPHA * longest)
}

/// Returns whether every tetrahedron on a face has q of 2 or more, for any fourth vertex.
pub fn is_forcing(corners: [Point; 3]) -> bool {
    face_bound(corners) <= INVERSE_QUALITY_WANTED
}

/// Returns whether the goodness is below `wanted` (at most); decides most good ones without a root or a division.
#[inline(always)]
pub fn is_below(points: [Point; 4], wanted: f64) -> bool {
    let p = parts(points);
    let [a, b, c, d] = p.areas;
    // The sum of four roots is at most twice the root of the sum.
    let most = 4.0 * ((a + b) + (c + d)) * p.longest_squared * (ALPHA * ALPHA * wanted * wanted);
    if p.det > 0.0 && p.det * p.det > most {
        return false;
    }
    // A ratio that is not a number counts as bad.
    let ratio = ratio(&p);
    ratio < wanted || ratio.is_nan()
}

/// Quality q of a tetrahedron: at least 1, infinite when it is not positive.
pub fn quality(points: [Point; 4]) -> f64 {
    let good = inverse_quality(points);
    if good > 0.0 { 1.0 / good } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_regular_tetrahedron_has_quality_one_at_any_scale() {
        for scale in [1e-9, 1.0, 1e9] {
            let corners = [[1., 1., 1.], [-1., 1., -1.], [1., -1., -1.], [-1., -1., 1.]];
            let p = corners.map(|c| Point::from_array(c) * scale);
            assert!((quality(p) - 1.0).abs() < 1e-12, "{}", quality(p));
            let [a, b, c, d] = p;
            assert_eq!(quality([b, a, c, d]), f64::INFINITY);
        }
    }

    #[test]
    fn the_cheap_test_agrees() {
        let mut state = 1u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        for _ in 0..2000 {
            let p = [0; 4].map(|_| Point::new(next(), next(), next()));
            let good = inverse_quality(p);
            if (good - 0.5).abs() > 1e-9 {
                assert_eq!(is_below(p, 0.5), good < 0.5);
            }
        }
    }
}
