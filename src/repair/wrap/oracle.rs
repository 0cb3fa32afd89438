//! Distances to the input, and what of it meets a tetrahedron or a triangle.

use rayon::prelude::*;

use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::{filled, parallel};
use tetdb_base::surface::nearest_point;

use super::apart::Cell;

/// Triangles of a leaf at most.
const LEAF: usize = 4;
/// Square of the least distance, as a share of the square of what is found far away: a tenth less.
const SLACK: f64 = 0.81;
/// Ranges below this many triangles are sorted by one thread.
const ALONE: usize = 1 << 13;
/// Triangles whose height is below this share of their length are thin: signs of products may be rounding there.
const THIN: f64 = 1e-5;

/// A binary tree of boxes over triangles; edges and points are triangles with equal corners.
///
/// Long triangles are there once for each of their pieces: the box of one that crosses everything would say nothing.
///
/// Node 1 is the root, nodes 2 i and 2 i + 1 are below node i. Each level halves all ranges, so that no node needs to name its range.
pub struct Oracle {
    corners: Vec<[Point; 3]>,
    ids: Vec<u32>,
    is_thin: Vec<bool>,
    boxes: Vec<Aabb>,
    depth: u32,
}

/// The nearest point of the input.
#[derive(Clone, Copy)]
pub struct Nearest {
    /// Where it is.
    pub at: Point,
    /// Its distance.
    pub distance: f64,
    /// No point of the input is nearer than this.
    pub least: f64,
    /// The triangle it is on.
    pub triangle: u32,
}

impl Oracle {
    /// Bytes held for each piece of a triangle, those needed on the way included.
    pub const BYTES_PIECE: u64 = 160;

    /// A tree over triangles, at least one.
    pub fn new(pieces: Pieces, corners_of: impl Fn(u32) -> [Point; 3] + Sync) -> Self {
        let Pieces { owners, boxes: around } = pieces;
        let n = owners.len();
        let depth = n.div_ceil(LEAF).next_power_of_two().trailing_zeros();
        let (order, corners, is_thin) = parallel(|| {
            let middles: Vec<Point> = (0..n as u32)
                .into_par_iter()
                .map(|k| (around[k as usize].low + around[k as usize].high) * 0.5)
                .collect();
            let mut ids: Vec<u32> = (0..n as u32).collect();
            divide(&mut ids, &middles, Range { n, depth, at: 0, level: 0 });
            let corners: Vec<[Point; 3]> =
                ids.par_iter().map(|&k| corners_of(owners[k as usize])).collect();
            let is_thin: Vec<bool> = corners.par_iter().map(is_thin).collect();
            (ids, corners, is_thin)
        });
        let n_leaves = 1usize << depth;
        let mut boxes = filled(2 * n_leaves, Aabb::EMPTY);
        for leaf in 0..n_leaves {
            let members = &order[(leaf * n) >> depth..((leaf + 1) * n) >> depth];
            let of_members = members.iter().map(|&k| around[k as usize]);
            boxes[n_leaves + leaf] = of_members.fold(Aabb::EMPTY, Aabb::union);
        }
        for node in (1..n_leaves).rev() {
            boxes[node] = boxes[2 * node].union(boxes[2 * node + 1]);
        }
        let ids = order.into_iter().map(|k| owners[k as usize]).collect();
        Self { corners, ids, is_thin, boxes, depth }
    }

    fn members(&self, node: usize) -> std::ops::Range<usize> {
        let (leaf, n) = (node - (1 << self.depth), self.ids.len());
        (leaf * n) >> self.depth..((leaf + 1) * n) >> self.depth
    }

    /// The input point nearest to `p`; `within` is a distance at which there surely is one.
    pub fn nearest(&self, p: Point, within: f64) -> Nearest {
        self.about_nearest(p, within, f64::INFINITY)
    }

    /// Like [`Oracle::nearest`], but beyond the distance `exact` any point that is at most a tenth farther than the nearest may be found.
    ///
    /// Far from the input, and at centers of round parts, the nearest is hard to tell from others; there a look at all would be needed.
    pub fn about_nearest(&self, p: Point, within: f64, exact: f64) -> Nearest {
        let exact = exact * exact;
        // Squares of distances from here on.
        let bound = |best: f64| if best > exact { best * SLACK } else { best };
        let mut best = Nearest { at: p, distance: within * within, least: 0.0, triangle: 0 };
        let mut most = bound(best.distance);
        let mut stack = [(0usize, 0.0f64); 64];
        stack[0] = (1, 0.0);
        let mut n = 1;
        while n > 0 {
            n -= 1;
            let (mut node, least) = stack[n];
            if least > most {
                continue;
            }
            while node >> self.depth == 0 {
                let mut near = (2 * node, distance2(&self.boxes[2 * node], p));
                let mut far = (2 * node + 1, distance2(&self.boxes[2 * node + 1], p));
                if far.1 < near.1 {
                    std::mem::swap(&mut near, &mut far);
                }
                if far.1 <= most {
                    stack[n] = far;
                    n += 1;
                }
                node = near.0;
                if near.1 > most {
                    node = 0;
                    break;
                }
            }
            if node == 0 {
                continue;
            }
            for i in self.members(node) {
                let at = match self.is_thin[i] {
                    false => nearest_on(&self.corners[i], p),
                    true => nearest_on_thin(&self.corners[i], p),
                };
                let square = at.distance_squared(p);
                if square <= best.distance {
                    best = Nearest { at, distance: square, least: 0.0, triangle: self.ids[i] };
                    most = bound(square);
                }
            }
        }
        best.least = most.sqrt();
        best.distance = best.distance.sqrt();
        best
    }

    /// Whether some triangle may meet a closed tetrahedron. If the answer is no, none does.
    pub fn may_meet(&self, cell: &Cell) -> bool {
        let is_near = |b: &Aabb| !cell.is_apart_from_box(b);
        self.search(is_near, |corners| !cell.is_apart_from(corners))
    }

    /// Whether `test` accepts a triangle in a leaf whose box meets `around`.
    pub fn any_meeting(&self, around: &Aabb, test: impl FnMut(&[Point; 3]) -> bool) -> bool {
        self.search(|b| b.meets(around), test)
    }

    fn search(
        &self,
        is_near: impl Fn(&Aabb) -> bool,
        mut test: impl FnMut(&[Point; 3]) -> bool,
    ) -> bool {
        let mut stack = [0usize; 64];
        stack[0] = 1;
        let mut n = 1;
        while n > 0 {
            n -= 1;
            let node = stack[n];
            if !is_near(&self.boxes[node]) {
                continue;
            }
            if node >> self.depth == 0 {
                stack[n] = 2 * node;
                stack[n + 1] = 2 * node + 1;
                n += 2;
            } else if self.corners[self.members(node)].iter().any(&mut test) {
                return true;
            }
        }
        false
    }
}

/// Triangles longer than this share of the box diagonal are divided into pieces that are shorter, or twice that and so on if that gives too many.
const PIECE: f64 = 1.0 / 64.0;
/// Halvings of one triangle at most.
const HALVINGS: u32 = 12;
/// Boxes of pieces grow by this share of the largest coordinate: the rounding of twelve middles is far less.
const ROUNDING: f64 = 1e-14;

/// The pieces of all triangles: the triangle of each, and its box.
pub struct Pieces {
    owners: Vec<u32>,
    boxes: Vec<Aabb>,
}

impl Pieces {
    /// The pieces of `n` triangles, about `n_max` of them at most.
    pub fn new(n: usize, n_max: usize, corners_of: impl Fn(u32) -> [Point; 3] + Sync) -> Self {
        let around = |t: u32| Aabb::around(corners_of(t));
        let is_long = |t: u32, length: f64| (around(t).high - around(t).low).length() > length;
        let count = |t: u32, length: f64| -> usize {
            let mut count = 0;
            halve(corners_of(t), length, HALVINGS, &mut |_| count += 1);
            count
        };
        let all = || (0..n as u32).into_par_iter();
        let bounds = parallel(|| all().map(around).reduce(|| Aabb::EMPTY, Aabb::union));
        let mut length = PIECE * bounds.diagonal();
        while length < bounds.diagonal()
            && parallel(|| all().map(|t| count(t, length)).sum::<usize>()) > n_max
        {
            length *= 2.0;
        }
        let by = Point::splat(ROUNDING * bounds.low.abs().max(bounds.high.abs()).max_element());
        let of = |t: u32| {
            let (whole, mut boxes) = (around(t), Vec::new());
            match is_long(t, length) {
                false => boxes.push((t, whole)),
                true => halve(corners_of(t), length, HALVINGS, &mut |piece| {
                    let Aabb { low, high } = Aabb::around(piece);
                    let (low, high) = ((low - by).max(whole.low), (high + by).min(whole.high));
                    boxes.push((t, Aabb { low, high }));
                }),
            }
            boxes
        };
        let (owners, boxes) = parallel(|| all().flat_map_iter(of).unzip());
        Self { owners, boxes }
    }

    /// Their number.
    pub fn len(&self) -> usize {
        self.owners.len()
    }
}

/// Halves the longest edge of a triangle until none is longer than `length`.
fn halve([a, b, c]: [Point; 3], length: f64, halvings: u32, visit: &mut impl FnMut([Point; 3])) {
    let edges = [a.distance_squared(b), b.distance_squared(c), c.distance_squared(a)];
    let longest = edges[0].max(edges[1]).max(edges[2]);
    if halvings == 0 || longest <= length * length {
        return visit([a, b, c]);
    }
    let [a, b, c] = match edges {
        [x, ..] if x == longest => [a, b, c],
        [_, y, _] if y == longest => [b, c, a],
        _ => [c, a, b],
    };
    let middle = (a + b) * 0.5;
    halve([a, middle, c], length, halvings - 1, visit);
    halve([middle, b, c], length, halvings - 1, visit);
}

/// A range of all triangles: the `at`-th of its level.
#[derive(Clone, Copy)]
struct Range {
    n: usize,
    depth: u32,
    at: usize,
    level: u32,
}

/// Sorts the triangles of a range into its two halves, and so on.
fn divide(ids: &mut [u32], middles: &[Point], range: Range) {
    let Range { n, depth, at, level } = range;
    if level == depth {
        return;
    }
    let bounds = Aabb::around(ids.iter().map(|&t| middles[t as usize]));
    let extent = (bounds.high - bounds.low).to_array();
    let axis = (0..3).max_by(|&i, &j| extent[i].total_cmp(&extent[j])).unwrap_or(0);
    let half = (((2 * at + 1) * n) >> (level + 1)) - ((at * n) >> level);
    if half < ids.len() {
        let key = |t: u32| middles[t as usize][axis];
        ids.select_nth_unstable_by(half, |&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
    }
    let (low, high) = ids.split_at_mut(half);
    let below = |at: usize| Range { at, level: level + 1, ..range };
    let (first, second) = (below(2 * at), below(2 * at + 1));
    if low.len() < ALONE {
        divide(low, middles, first);
        divide(high, middles, second);
    } else {
        rayon::join(|| divide(low, middles, first), || divide(high, middles, second));
    }
}

#[inline(always)]
fn distance2(b: &Aabb, p: Point) -> f64 {
    (b.low - p).max(p - b.high).max(Point::ZERO).length_squared()
}

fn is_thin([a, b, c]: &[Point; 3]) -> bool {
    let (u, v, w) = (*b - *a, *c - *a, *c - *b);
    let longest = u.length_squared().max(v.length_squared()).max(w.length_squared());
    u.cross(v).length() <= THIN * longest
}

/// The nearest point of a triangle that is not thin.
///
/// Source: C. Ericson, "Real-Time Collision Detection" (2005), section 5.1.5: regions of corners and edges by their products.
#[inline]
fn nearest_on(t: &[Point; 3], p: Point) -> Point {
    let [a, b, c] = *t;
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let sum = va + vb + vc;
    if sum > 0.0 { a + ab * (vb / sum) + ac * (vc / sum) } else { nearest_point(*t, p) }
}

/// The same for thin ones: of the points on the face and on the edges the nearest.
#[inline]
fn nearest_on_thin(t: &[Point; 3], p: Point) -> Point {
    let [a, b, c] = *t;
    let mut best = (a.distance_squared(p), a);
    for (from, to) in [(a, b), (b, c), (c, a)] {
        let along = to - from;
        let share = (p - from).dot(along) / along.length_squared();
        // Not a number where the edge has no length.
        if share > 0.0 {
            let at = if share < 1.0 { from + along * share } else { to };
            let square = at.distance_squared(p);
            if square < best.0 {
                best = (square, at);
            }
        }
    }
    let n = (b - a).cross(c - a);
    let height = n.dot(p - a) / n.length();
    // Only above the face, and nearer to its plane than to the edges, is there more to gain.
    if height * height < best.0 {
        let at = nearest_point(*t, p);
        if at.distance_squared(p) < best.0 {
            return at;
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetdb_base::geom::mix;

    #[test]
    fn the_nearest_is_the_nearest_of_all() {
        let at = |k: u64| (mix(k) >> 11) as f64 / (1u64 << 53) as f64;
        let point = |k: u64| Point::new(at(3 * k), at(3 * k + 1), at(3 * k + 2));
        for n in [1usize, 2, 5, 17, 300] {
            let corners = |t: u32| {
                let k = 9 * u64::from(t);
                let a = point(k);
                match t % 4 {
                    0 => [a, a, a],
                    1 => [a, a + point(k + 1) * 0.2, a],
                    2 => [a, a + point(k + 1), a + point(k + 1) * (1.0 + 1e-9)],
                    _ => [a, a + point(k + 1) * 0.3, a + point(k + 2) * 0.1],
                }
            };
            let oracle = Oracle::new(Pieces::new(n, 20 * n, corners), corners);
            for k in 5000..5200 {
                let p = point(k) * 2.0 - Point::splat(0.5);
                let found = oracle.nearest(p, f64::INFINITY);
                let all = (0..n as u32).map(|t| nearest_on_thin(&corners(t), p).distance(p));
                let least = all.fold(f64::INFINITY, f64::min);
                assert!((found.distance - least).abs() < 1e-12, "{} {least}", found.distance);
                assert!((found.at.distance(p) - least).abs() < 1e-12);
                let about = oracle.about_nearest(p, f64::INFINITY, 0.1);
                assert!(about.least <= least + 1e-12 && least <= about.distance + 1e-12);
                assert!(about.distance < 1.12 * about.least || about.distance <= 0.1);
            }
        }
    }
}
