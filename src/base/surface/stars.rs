//! Triangles at one vertex or one edge, if they are too many to test in pairs.
//!
//! ```text
//!        \ | /         All boxes around the middle of a fan overlap, but seen from the middle each triangle takes up a
//!      ---\|/---       direction of its own, and what can touch it lies in the same direction. So such triangles are
//!      ---/|\---       sorted by direction: seen from the vertex they share, or across the edge they share.
//!        / | \
//! ```
//!
//! Why: a flat polygon of 50,000 corners with a fan in it has 1.25 billion pairs of overlapping boxes and not one of triangles that touch.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use rayon::prelude::*;

use super::box_pairs::{FOUND_MAX, tree_of};
use super::{BoxTree, Surface};
use crate::geom::{Aabb, Point};
use crate::storage::ScratchSpace;

/// Triangles at a vertex or an edge that make a star. Below it some ten thousand pairs are tested one by one. Not
/// tuned.
const STAR_MIN: u32 = 256;
/// Beyond the error of a direction's three roundings.
const PAD: f64 = 1e-14;
/// Lengths across an axis below this share of the distance are rounding.
const ROUNDED: f64 = 1e-10;
/// Angles within this of a half turn, or of a full one for three together, are taken for one: the center may be between the corners.
const NEAR_TURN: f64 = 0.05;
/// A direction this near to the end of an arc counts as on it.
const NEAR_END: f64 = 1e-9;
/// Triangles near a star that are tested between two checks of the number found.
const AT_ONCE: usize = 1 << 14;

/// The common vertex or edge of a star.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Center {
    Vertex(u32),
    Edge([u32; 2]),
}

/// Triangles with a center in common.
struct TriangleStar {
    /// Ends of the common edge, or the common vertex twice.
    ends: [Point; 2],
    /// Direction of the edge, if it is one.
    axis: Option<Point>,
    members: Vec<u32>,
    /// Around its triangles.
    bounds: Aabb,
    /// Tree over their directions, numbered as `members`.
    tree: BoxTree,
}

/// Calls `test` on each pair of triangles that may touch, the lower number first, and collects its results.
///
/// `is_left_out`: triangles that do not count; those of stars are added. As [`BoxTree::pairs`] else. Memory: 4 bytes a vertex, and 60 bytes for
/// each triangle of a star.
pub(super) fn touching<T: Send>(
    surface: &Surface,
    is_left_out: &mut [bool],
    scratch: &ScratchSpace,
    listed_max: usize,
    test: impl Fn(u32, u32) -> Option<T> + Sync,
) -> (Vec<T>, u64) {
    let stars = stars(surface, is_left_out);
    let tree = tree_of(surface, scratch, |t| !is_left_out[t as usize]);
    let (mut listed, mut n_found) = tree.pairs(listed_max, &test);
    let mut add = |(found, n): (Vec<T>, u64)| {
        let free = listed_max - listed.len();
        listed.extend(found.into_iter().take(free));
        n_found += n;
        n_found > FOUND_MAX
    };
    for (k, star) in stars.iter().enumerate() {
        let own = |i: u32, j: u32| test(star.members[i as usize], star.members[j as usize]);
        if add(star.tree.pairs(listed_max, own)) {
            break;
        }
        let mut adjacent = Vec::new();
        tree.meeting(&star.bounds, |t| adjacent.push(t));
        for other in &stars[k + 1..] {
            if other.bounds.meets(&star.bounds) {
                adjacent.extend(&other.members);
            }
        }
        let is_over_limit =
            adjacent.chunks(AT_ONCE).any(|some| add(star.with(surface, some, listed_max, &test)));
        if is_over_limit {
            break;
        }
    }
    (listed, n_found)
}

/// The stars of a surface, by vertex and edge; their triangles are left out from now on.
fn stars(surface: &Surface, is_left_out: &mut [bool]) -> Vec<TriangleStar> {
    let mut degrees = vec![0u32; surface.n_vertices()];
    let counts = |t: &usize| !is_left_out[*t];
    for t in (0..surface.n_triangles()).filter(counts) {
        for v in surface.triangles[t] {
            degrees[v as usize] += 1;
        }
    }
    if degrees.iter().all(|&n| n < STAR_MIN) {
        return Vec::new();
    }
    // Both ends of an edge of many triangles have as many.
    let is_middle = |v: u32| degrees[v as usize] >= STAR_MIN;
    let edges_of = |t: usize| {
        let [a, b, c] = surface.triangles[t];
        [[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)])
    };
    let mut at_edges: HashMap<[u32; 2], u32> = HashMap::new();
    for t in (0..surface.n_triangles()).filter(counts) {
        for edge in edges_of(t).into_iter().filter(|e| e.iter().all(|&v| is_middle(v))) {
            *at_edges.entry(edge).or_default() += 1;
        }
    }
    let mut number = HashMap::new();
    let mut centers: Vec<(Center, Vec<u32>)> = Vec::new();
    for (t, is_out) in is_left_out.iter_mut().enumerate().filter(|(_, out)| !**out) {
        let edges = edges_of(t).into_iter().map(|edge| {
            let n = at_edges.get(&edge).copied().unwrap_or(0);
            (n, Center::Edge(edge))
        });
        let vertices = surface.triangles[t].map(|v| (degrees[v as usize], Center::Vertex(v)));
        // An edge first: seen from one of its ends its triangles have a direction in common.
        let best = (edges.filter(|(n, _)| *n >= STAR_MIN).max_by_key(|(n, _)| *n))
            .or_else(|| vertices.into_iter().max_by_key(|(n, _)| *n))
            .filter(|(n, _)| *n >= STAR_MIN);
        if let Some((_, center)) = best {
            *is_out = true;
            let next = centers.len();
            let k = *number.entry(center).or_insert(next);
            if k == next {
                centers.push((center, Vec::new()));
            }
            centers[k].1.push(t as u32);
        }
    }
    let star = |(center, members)| TriangleStar::new(surface, center, members);
    centers.into_iter().map(star).collect()
}

impl TriangleStar {
    fn new(surface: &Surface, center: Center, members: Vec<u32>) -> Self {
        let at = |v: u32| surface.points[v as usize];
        let ends = match center {
            Center::Vertex(v) => [at(v); 2],
            Center::Edge([v, w]) => [at(v), at(w)],
        };
        let corners = members.iter().flat_map(|&t| surface.corners(t));
        let mut star = Self {
            ends,
            axis: (ends[1] - ends[0]).try_normalize(),
            bounds: Aabb::around(corners),
            tree: tree_of_directions(0, |_| EVERYWHERE),
            members: Vec::new(),
        };
        let directions = |i: u32| star.directions(surface.corners(members[i as usize]));
        star.tree = tree_of_directions(members.len() as u32, directions);
        star.members = members;
        star
    }

    /// In which directions a triangle is seen.
    ///
    /// A corner in the center has no direction and needs none: points between it and the other corners have their
    /// directions.
    fn directions(&self, corners: [Point; 3]) -> Aabb {
        let (mut seen, mut n, mut pad) = ([Point::ZERO; 3], 0, PAD);
        for p in corners.into_iter().filter(|p| !self.ends.contains(p)) {
            let away = p - self.ends[0];
            let across = match self.axis {
                Some(axis) => away - axis * away.dot(axis),
                None => away,
            };
            let length = across.length();
            // A point on the axis has no direction beyond rounding.
            if length <= ROUNDED * away.length() {
                return EVERYWHERE;
            }
            pad += PAD * away.length() / length;
            seen[n] = across / length;
            n += 1;
        }
        let mut bounds = match seen[..n] {
            [u] => Aabb::around([u]),
            [u, v] if is_short(u, v) => around_arc(u, v),
            [u, v, w] if is_in_sight([u, v, w]) => around_triangle([u, v, w]),
            _ => return EVERYWHERE,
        };
        bounds.low -= Point::splat(pad);
        bounds.high += Point::splat(pad);
        bounds
    }

    /// Pairs of this star's triangles with some others.
    fn with<T: Send>(
        &self,
        surface: &Surface,
        others: &[u32],
        listed_max: usize,
        test: &(impl Fn(u32, u32) -> Option<T> + Sync),
    ) -> (Vec<T>, u64) {
        let found: Vec<Vec<T>> = (others.par_iter())
            .map(|&t| {
                let corners = surface.corners(t);
                let bounds = Aabb::around(corners);
                let mut found = Vec::new();
                if !bounds.meets(&self.bounds) {
                    return found;
                }
                self.tree.meeting(&self.directions(corners), |i| {
                    let own = self.members[i as usize];
                    if bounds.meets(&Aabb::around(surface.corners(own))) {
                        found.extend(test(own.min(t), own.max(t)));
                    }
                });
                found
            })
            .collect();
        let n = found.iter().map(|f| f.len() as u64).sum();
        (found.into_iter().flatten().take(listed_max).collect(), n)
    }
}

fn angle(u: Point, v: Point) -> f64 {
    u.dot(v).clamp(-1.0, 1.0).acos()
}

/// Returns whether the arc between two directions is well below half a turn.
fn is_short(u: Point, v: Point) -> bool {
    angle(u, v) < PI - NEAR_TURN
}

/// Returns whether three directions do not surround the center.
fn is_in_sight([u, v, w]: [Point; 3]) -> bool {
    let angles = [angle(u, v), angle(v, w), angle(w, u)];
    angles.iter().all(|a| *a < PI - NEAR_TURN) && angles.iter().sum::<f64>() < TAU - NEAR_TURN
}

/// The box around the shorter arc between two directions.
fn around_arc(u: Point, v: Point) -> Aabb {
    let mut bounds = Aabb::around([u, v]);
    let Some(normal) = u.cross(v).try_normalize() else {
        return bounds;
    };
    for axis in [Point::X, Point::Y, Point::Z] {
        // Point of the whole circle that is farthest along the axis; it may lie between the two.
        let top = axis - normal * axis.dot(normal);
        let Some(top) = top.try_normalize().filter(|_| top.length() > NEAR_END) else {
            // Nowhere is it off zero by more; the direction would be rounding.
            bounds.low -= axis * NEAR_END;
            bounds.high += axis * NEAR_END;
            continue;
        };
        for end in [top, -top] {
            if u.cross(end).dot(normal) > -NEAR_END && end.cross(v).dot(normal) > -NEAR_END {
                bounds = bounds.union(Aabb::around([end]));
            }
        }
    }
    bounds
}

/// The box around the region between three directions.
fn around_triangle([u, v, w]: [Point; 3]) -> Aabb {
    let arcs = [around_arc(u, v), around_arc(v, w), around_arc(w, u)];
    let mut bounds = arcs.into_iter().fold(Aabb::EMPTY, |a, b| a.union(b));
    for axis in [Point::X, Point::Y, Point::Z] {
        let sides = [u.cross(v), v.cross(w), w.cross(u)].map(|normal| normal.dot(axis));
        // The axis itself, or its reverse, is inside.
        if sides.iter().all(|s| *s > -NEAR_END) || sides.iter().all(|s| *s < NEAR_END) {
            bounds.low = bounds.low.min(-axis);
            bounds.high = bounds.high.max(axis);
        }
    }
    bounds
}

/// Around all directions.
const EVERYWHERE: Aabb = Aabb { low: Point::splat(-4.0), high: Point::splat(4.0) };

fn tree_of_directions(n: u32, of: impl Fn(u32) -> Aabb + Sync) -> BoxTree {
    BoxTree::new(&EVERYWHERE, n, &ScratchSpace::boundless(), |_| true, of)
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU64, Ordering};

    use super::*;
    use crate::surface::SurfaceBuilder;
    use crate::surface::contact::contact;

    fn surface(triangles: &[[Point; 3]]) -> Surface {
        let mut builder = SurfaceBuilder::new();
        builder.begin_file("made");
        let label = builder.label("made");
        for corners in triangles {
            builder.triangle_at(*corners, label).expect("finite corners");
        }
        builder.end_file().expect("triangles");
        builder.finish()
    }

    /// Pairs that touch and are listed, their total, and the number of pairs tested.
    fn found(surface: &Surface) -> (Vec<[u32; 2]>, u64, u64) {
        let looked = AtomicU64::new(0);
        let mut is_left_out = vec![false; surface.n_triangles()];
        let scratch = ScratchSpace::boundless();
        let (mut pairs, n) = touching(surface, &mut is_left_out, &scratch, usize::MAX, |a, b| {
            looked.fetch_add(1, Ordering::Relaxed);
            contact_of(surface, a, b).then_some([a, b])
        });
        pairs.sort_unstable();
        (pairs, n, looked.into_inner())
    }

    fn contact_of(surface: &Surface, a: u32, b: u32) -> bool {
        let ids = [a, b].map(|t| surface.triangles[t as usize]);
        contact(surface.corners(a), ids[0], surface.corners(b), ids[1]).is_some()
    }

    fn brute_force(surface: &Surface) -> Vec<[u32; 2]> {
        let n = surface.n_triangles() as u32;
        let all = (0..n).flat_map(|a| (a + 1..n).map(move |b| [a, b]));
        all.filter(|&[a, b]| contact_of(surface, a, b)).collect()
    }

    fn on_circle(i: usize, n: usize, z: f64) -> Point {
        let (sin, cos) = (TAU * i as f64 / n as f64).sin_cos();
        Point::new(cos, sin, z)
    }

    /// A flat column whose ends are fans around a corner.
    fn column(n: usize) -> Vec<[Point; 3]> {
        let mut triangles = Vec::new();
        for z in [0.0, 1.0] {
            let corner = |i: usize| on_circle(i % n, n, z);
            triangles.extend((1..n - 1).map(|i| [corner(0), corner(i), corner(i + 1)]));
        }
        for i in 0..n {
            let [a, b] = [0.0, 1.0].map(|z| [on_circle(i, n, z), on_circle((i + 1) % n, n, z)]);
            triangles.extend([[a[0], a[1], b[1]], [a[0], b[1], b[0]]]);
        }
        triangles
    }

    /// A column's end alone.
    fn polygon(n: usize) -> Vec<[Point; 3]> {
        column(n).into_iter().take(n - 2).collect()
    }

    /// Pages around an edge.
    fn book(n: usize) -> Vec<[Point; 3]> {
        let [a, b] = [Point::ZERO, Point::Z];
        (0..n).map(|i| [a, b, on_circle(i, n, 0.5)]).collect()
    }

    /// Two cones with a common base circle, each a star around its tip.
    fn cones(n: usize) -> Vec<[Point; 3]> {
        let tips = [Point::Z, Point::Z * -0.5];
        let rim = |i: usize| on_circle(i % n, n, 0.0);
        let sides = (0..n).flat_map(|i| tips.map(|tip| [tip, rim(i), rim(i + 1)]));
        sides.collect()
    }

    #[test]
    fn twice_the_triangles_around_one_place_are_twice_the_pairs() {
        for make in [polygon, book, column, cones] {
            let looked = [2000, 4000].map(|n| {
                let (_, n_touching, looked) = found(&surface(&make(n)));
                assert_eq!(n_touching, 0);
                looked as f64
            });
            assert!(looked[1] <= 2.5 * looked[0], "{looked:?}");
        }
    }

    #[test]
    fn what_touches_a_star_is_found_as_by_looking_at_all_pairs() {
        // Triangles through a column's end, a book and two cones: across the middle, along a page, in a corner.
        let stray = |k: usize| {
            let at = |step: usize| (k * step % 17) as f64 / 8.0 - 1.0;
            let p = Point::new(at(3), at(5), at(7));
            [p, p * 0.3 + Point::new(0.1, 0.0, 0.4), Point::new(at(11), 0.0, at(2))]
        };
        for make in [column, book, cones] {
            let mut triangles = make(300);
            triangles.extend((1..40).map(stray));
            // One page again, a little shorter, and a triangle through the middle of all.
            let [a, b, c] = triangles[40];
            triangles.push([a, b, c * 0.75]);
            triangles.push([Point::splat(-0.2), Point::splat(0.3), Point::new(0.2, -0.1, 0.0)]);
            let surface = surface(&triangles);
            let (touching, _, _) = found(&surface);
            assert!(touching.len() > 100);
            assert_eq!(touching, brute_force(&surface));
        }
    }

    #[test]
    fn a_hopeless_heap_is_given_up_with_a_count() {
        let looked = [2000, 4000].map(|n| {
            let through = (0..n).map(|i| {
                let p = on_circle(i, n, (i * 7 % 11) as f64 / 11.0 - 0.5);
                let q = on_circle(i * 13 % n, n, (i * 5 % 13) as f64 / 13.0 - 0.5) * 0.9;
                [p, q, (p + q) * -1.0]
            });
            let (_, n_touching, looked) = found(&surface(&through.collect::<Vec<_>>()));
            assert!(n_touching > 200_000, "{n_touching}");
            looked as f64
        });
        assert!(looked[1] < 3.0 * looked[0], "{looked:?}");
    }
}
