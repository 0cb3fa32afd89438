//! The place that is farthest in front of planes: a linear program of four variables.
//!
//! Source: R. Seidel, "Small-dimensional linear programming and convex hulls made easy" (1991).

use tetdb_base::geom::Point;

/// A constraint a · x ≤ b.
type Row = ([f64; 4], f64);

/// How far an answer may be behind a constraint that counts as kept, in lengths of the box: rounding of sums of some products.
const SLACK: f64 = 1e-13;

/// Scratch of programs of two to four variables.
#[derive(Default)]
pub(super) struct Scratch {
    rows: Vec<Row>,
    fewer: [Vec<Row>; 3],
}

/// The point p at most `reach` from `center` along each axis, for which the least of (bᵢ − nᵢ · (p − center)) / sᵢ over `planes` (nᵢ, bᵢ, sᵢ) is
/// largest, or one where all of these are 1 at least, and that least number, at most 1. `None` where rounding leaves no answer.
///
/// nᵢ: unit vectors; sᵢ: how far in front of the plane is far enough.
pub(super) fn farthest_inside(
    center: Point,
    reach: f64,
    planes: impl Iterator<Item = (Point, f64, f64)>,
    scratch: &mut Scratch,
) -> Option<(Point, f64)> {
    let Scratch { rows, fewer } = scratch;
    rows.clear();
    rows.extend(planes.map(|(n, b, s)| ([n.x, n.y, n.z, s / reach], b / reach)));
    // Any order will do; those that the center is farthest behind are likely to decide, and the rest is soon looked through.
    rows.sort_by(|one, two| (one.1 / one.0[3]).total_cmp(&(two.1 / two.0[3])));
    // The last variable is the least of the quotients; a scale of 1e9 has room for planes that leave nothing between them.
    let low = [-1.0, -1.0, -1.0, -1e9];
    let x = solve::<4>(rows, [0.0, 0.0, 0.0, 1.0], low, [1.0; 4], fewer)?;
    let shift = Point::new(x[0], x[1], x[2]) * reach;
    shift.is_finite().then_some((center + shift, x[3]))
}

/// The x between `low` and `high` with the largest c · x that keeps all rows; of the arrays the first `D` numbers count.
fn solve<const D: usize>(
    rows: &[Row],
    c: [f64; 4],
    low: [f64; 4],
    high: [f64; 4],
    scratch: &mut [Vec<Row>],
) -> Option<[f64; 4]> {
    let mut x = [0.0; 4];
    for k in 0..D {
        x[k] = if c[k] < 0.0 { low[k] } else { high[k] };
    }
    for (i, &(a, b)) in rows.iter().enumerate() {
        let reached: f64 = (0..D).map(|k| a[k] * x[k]).sum();
        if reached <= b {
            continue;
        }
        let size: f64 = (0..D).map(|k| (a[k] * x[k]).abs()).sum();
        if reached <= b + SLACK * (size + b.abs()) {
            continue;
        }
        // The answer for these rows is on the plane of this one: one variable less.
        let k = (0..D).max_by(|&k, &l| a[k].abs().total_cmp(&a[l].abs()))?;
        if a[k] == 0.0 {
            return None;
        }
        // x of k is q - r · the others.
        let (q, r) = (b / a[k], without::<D>(a.map(|a_j| a_j / a[k]), k));
        let minus = |a: [f64; 4]| {
            let (f, mut rest) = (a[k], without::<D>(a, k));
            (0..D - 1).for_each(|j| rest[j] -= f * r[j]);
            rest
        };
        let (fewer, scratch) = scratch.split_first_mut()?;
        fewer.clear();
        fewer.extend((rows[..i].iter()).map(|&(other, b)| (minus(other), b - other[k] * q)));
        fewer.push((r.map(|r| -r), high[k] - q));
        fewer.push((r, q - low[k]));
        let (c, low, high) = (minus(c), without::<D>(low, k), without::<D>(high, k));
        let found = match D {
            4 => solve::<3>(fewer, c, low, high, scratch)?,
            3 => solve::<2>(fewer, c, low, high, scratch)?,
            _ => solve_line(fewer, c, low, high)?,
        };
        x[k] = q - (0..D - 1).map(|j| r[j] * found[j]).sum::<f64>();
        (0..D).filter(|&j| j != k).enumerate().for_each(|(from, j)| x[j] = found[from]);
    }
    Some(x)
}

/// [`solve`] of one variable.
fn solve_line(rows: &[Row], c: [f64; 4], low: [f64; 4], high: [f64; 4]) -> Option<[f64; 4]> {
    let (mut from, mut to) = (low[0], high[0]);
    for &([a, ..], b) in rows {
        if a > 0.0 {
            to = to.min(b / a);
        } else if a < 0.0 {
            from = from.max(b / a);
        }
    }
    let x = if c[0] < 0.0 { from } else { to };
    (from <= to + SLACK * (1.0 + to.abs())).then_some([x, 0.0, 0.0, 0.0])
}

/// The first `D` numbers but that at `k`.
fn without<const D: usize>(x: [f64; 4], k: usize) -> [f64; 4] {
    let mut rest = [0.0; 4];
    (0..D).filter(|&j| j != k).enumerate().for_each(|(to, j)| rest[to] = x[j]);
    rest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Planes of a box from `low` to `high` as seen from the origin, all as far as they like.
    fn planes(low: Point, high: Point, far: f64) -> Vec<(Point, f64, f64)> {
        let axes = [Point::X, Point::Y, Point::Z];
        let of_axis = |n: Point| [(n, high.dot(n), far), (-n, -low.dot(n), far)];
        axes.into_iter().flat_map(of_axis).collect()
    }

    #[test]
    fn the_middle_of_a_box_is_farthest_from_its_sides_however_thin_it_is() {
        for thickness in [1.0, 1e-4, 1e-9] {
            let (low, high) = (Point::new(0.1, 0.2, 0.3), Point::new(0.9, 0.6, 0.3 + thickness));
            let found = farthest_inside(
                Point::ZERO,
                2.0,
                planes(low, high, 1.0).into_iter(),
                &mut Scratch::default(),
            );
            let (p, _) = found.expect("it has an inside");
            let inscribed = 0.5 * (high - low).min_element();
            let least = (p - low).min(high - p).min_element();
            assert!(least > 0.4 * inscribed, "{p} {thickness}");
        }
    }

    #[test]
    fn planes_that_the_center_is_equally_far_behind_are_put_in_order() {
        let mut seed = 5u64;
        let mut next = || {
            seed = tetdb_base::geom::mix(seed);
            (seed >> 11) as f64 / (1u64 << 53) as f64
        };
        for _ in 0..500 {
            // Quotients that are equal but for rounding, of numbers of all sizes.
            let mut plane = || {
                let n = Point::new(next() - 0.5, next() - 0.5, next() - 0.5).normalize();
                let far = 10f64.powf(-9.0 * next());
                (n, -0.1 * far, far)
            };
            let planes: Vec<_> = (0..100).map(|_| plane()).collect();
            let found =
                farthest_inside(Point::ZERO, 1.0, planes.into_iter(), &mut Scratch::default());
            assert!(found.is_none_or(|(p, _)| p.is_finite()));
        }
    }

    #[test]
    fn where_nothing_is_inside_the_least_behind_is_found() {
        // Two planes that face away from each other, 0.2 apart.
        let planes = [(Point::X, -0.1, 0.5), (-Point::X, -0.1, 0.5)];
        let (p, least) =
            farthest_inside(Point::ZERO, 1.0, planes.into_iter(), &mut Scratch::default())
                .expect("an answer");
        assert!(p.x.abs() < 1e-9 && (least + 0.2).abs() < 1e-9, "{p} {least}");
    }
}
