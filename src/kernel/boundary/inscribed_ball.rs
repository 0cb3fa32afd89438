//! The center of the largest ball inside half-spaces: the place of a vertex with the largest clearance.
//!
//! Source: R. Seidel, "Small-dimensional linear programming and convex hulls made easy" (1991), on four unknowns: the
//! center and the radius. Doubles suffice: the result is a proposal that exact signs accept or reject.

use tetdb_base::geom::Point;

/// `normal · x + radius <= offset`, `normal` of length one pointing out.
#[derive(Clone, Copy, Debug)]
pub(super) struct HalfSpace {
    pub normal: Point,
    pub offset: f64,
}

/// The center of the largest ball inside all half-spaces and the cube of half side `reach` around the origin.
pub(super) fn ball_center(half_spaces: &[HalfSpace], reach: f64) -> Option<Point> {
    let mut rows: Vec<Row> = half_spaces
        .iter()
        .filter(|h| h.normal.is_finite() && h.offset.is_finite())
        .map(|h| {
            let n = h.normal;
            [n.x, n.y, n.z, 1.0, h.offset / reach]
        })
        .collect();
    // A fixed shuffle: neighbors in the list are neighbors in space, the worst order.
    let n = rows.len();
    for i in (1..n).rev() {
        let h = (i as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 33;
        rows.swap(i, (h % (i as u64 + 1)) as usize);
    }
    // Rows with three unknowns, two and one, filled again and again: new lists would take as long as the numbers in them.
    let mut deeper: [Vec<Row>; 3] = Default::default();
    let x = solve(&rows, &[0.0, 0.0, 0.0, 1.0], &mut deeper)?;
    Some(Point::new(x[0], x[1], x[2]) * reach)
}

/// Distance of `at` from the nearest plane; negative outside.
pub(super) fn clearance(half_spaces: &[HalfSpace], at: Point) -> f64 {
    let rooms = half_spaces.iter().map(|h| h.offset - h.normal.dot(at));
    rooms.fold(f64::INFINITY, f64::min)
}

/// Factors of the unknowns, followed by their bound; the rest is unused.
type Row = [f64; 5];

/// Maximizes `goal · x` under `row · x <= bound` and `-1 <= x <= 1`. Of the answer as many numbers count as `goal` has; `deeper` is space for
/// the rows of problems with fewer unknowns.
fn solve(rows: &[Row], goal: &[f64], deeper: &mut [Vec<Row>]) -> Option<[f64; 4]> {
    let d = goal.len();
    if d == 1 {
        let (mut low, mut high) = (-1.0f64, 1.0f64);
        for row in rows {
            if row[0] > 1e-14 {
                high = high.min(row[1] / row[0]);
            } else if row[0] < -1e-14 {
                low = low.max(row[1] / row[0]);
            } else if row[1] < -1e-12 {
                return None;
            }
        }
        let best = if goal[0] >= 0.0 { high } else { low };
        return (low <= high + 1e-13).then_some([best, 0.0, 0.0, 0.0]);
    }
    let (below, deeper) = deeper.split_first_mut()?;
    let mut x = [0.0; 4];
    for (x, &g) in x.iter_mut().zip(goal) {
        *x = if g >= 0.0 { 1.0 } else { -1.0 };
    }
    for (m, row) in rows.iter().enumerate() {
        let value: f64 = (0..d).map(|i| row[i] * x[i]).sum();
        if value <= row[d] + 1e-13 {
            continue;
        }
        // The optimum lies on this row: put x[k] out by it.
        let k = (0..d).max_by(|&i, &j| row[i].abs().total_cmp(&row[j].abs()))?;
        if row[k].abs() < 1e-14 {
            return None;
        }
        let others = |n: usize| (0..n).filter(move |&i| i != k);
        let drop = |r: &Row| -> Row {
            let share = r[k] / row[k];
            let mut dropped = [0.0; 5];
            for (to, i) in dropped.iter_mut().zip(others(d + 1)) {
                *to = r[i] - share * row[i];
            }
            dropped
        };
        below.clear();
        below.extend(rows[..m].iter().map(drop));
        for sign in [1.0, -1.0] {
            let mut bound = [0.0; 5];
            bound[k] = sign;
            bound[d] = 1.0;
            below.push(drop(&bound));
        }
        let share = goal[k] / row[k];
        let mut goal_below = [0.0; 3];
        for (to, i) in goal_below.iter_mut().zip(others(d)) {
            *to = goal[i] - share * row[i];
        }
        let y = solve(below, &goal_below[..d - 1], deeper)?;
        for (i, y) in others(d).zip(y) {
            x[i] = y;
        }
        let known: f64 = others(d).map(|i| row[i] * x[i]).sum();
        x[k] = (row[d] - known) / row[k];
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_center_of_a_corner_is_as_far_as_the_cube_allows() {
        let walls = [Point::X, Point::Y, Point::Z].map(|n| HalfSpace { normal: -n, offset: 0.0 });
        let p = ball_center(&walls, 2.0).expect("a corner has room");
        assert!(p.min_element() > 0.5, "{p}");
        let slab = [
            HalfSpace { normal: Point::X, offset: 1e-6 },
            HalfSpace { normal: -Point::X, offset: 0.0 },
        ];
        let p = ball_center(&slab, 1.0).expect("a slab has room");
        assert!((p.x - 5e-7).abs() < 1e-12, "{p}");
    }
}
