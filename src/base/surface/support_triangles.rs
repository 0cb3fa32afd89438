//! Support triangles: sheets of one triangle that keep embedded edges.
//!
//! ```text
//!            c           Every step of the mesher keeps triangles, but no step keeps edges. So an edge a b without a triangle
//!          /   \         gets one, with a vertex c near its middle that nothing else uses: a sheet of one triangle.
//!    a --/-------\-- b   Sheets stay whole, and with them the edge, bit for bit and undivided.
//! ```
//!
//! Support triangles of two edges stay apart by their height alone. It is below half of the distance of edges that
//! share no vertex, and below half the angle of those that do. Their contacts with other triangles are tested, by exact
//! signs, in eight directions around the edge.

use super::contact::contact;
use super::embedded::NEAR_SHARE;
use super::embedded_set::EmbedError;
use super::point_tree::PointTree;
use super::seeker::Seeker;
use super::{BoxTree, Surface};
use crate::geom::{Aabb, Point};
use crate::storage::ScratchSpace;
use std::f64::consts::FRAC_1_SQRT_2;

/// Height of an equilateral triangle.
const EQUILATERAL: f64 = 0.866;
/// Heights are at most this share of the distance to other edges and points: below one half, two support triangles do
/// not meet, and a tetrahedron fits between.
const DISTANCE_SHARE: f64 = 0.4;
/// Heights are at most this share of the tangent of half the angle where two edges meet.
const ANGLE_SHARE: f64 = 0.8;
/// Distance of an apex from other triangles, as a share of its height, at least. Nearer apexes force bad tetrahedra.
const CLEAR_SHARE: f64 = 0.35;
/// Around an edge, as cosine and sine.
const DIRECTIONS: [[f64; 2]; 8] = {
    const D: f64 = FRAC_1_SQRT_2;
    [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [D, D], [-D, D], [-D, -D], [D, -D]]
};

impl Surface {
    /// Adds a support triangle for each edge with `is_free`. Errors: edges too near to something else.
    pub(super) fn push_support_triangles(
        &mut self,
        is_free: &[bool],
        triangles: BoxTree,
        scratch: &ScratchSpace,
    ) -> Result<(), EmbedError> {
        let least = NEAR_SHARE * self.bounds().diagonal();
        let seeker = Seeker::with_tree(self, triangles);
        self.refuse_near_ends(&seeker)?;
        let heights_max = self.heights_max(is_free, scratch);
        let mut apexes = Vec::new();
        let mut near = Vec::new();
        for (e, height) in heights_max.into_iter().enumerate().filter(|(e, _)| is_free[*e]) {
            match self.apex(e as u32, height, least, &seeker) {
                Some(apex) => apexes.push((e, apex)),
                None => near.push(e),
            }
        }
        let distance = near.first().map(|&e| self.clearance(e as u32, &seeker));
        self.refuse_near(&near, distance)?;
        if apexes.is_empty() {
            return Ok(());
        }
        self.embedded.first_support = Some([self.triangles.len() as u32, self.points.len() as u32]);
        self.sheets.resize(self.triangles.len(), false);
        for (e, apex) in apexes {
            let [a, b, label] = self.embedded.edges[e];
            self.triangles.push([a, b, self.points.len() as u32]);
            self.labels.push(label);
            self.sheets.push(true);
            self.points.push(apex);
        }
        Ok(())
    }

    /// Greatest height of the support triangle of each edge, limited by other edges and points.
    fn heights_max(&self, is_free: &[bool], scratch: &ScratchSpace) -> Vec<f64> {
        let edges = self.embedded_edge_tree(scratch, |e| is_free[e as usize]);
        let marks = self.embedded.points.iter().map(|&[v, _]| (v, self.points[v as usize]));
        let marks = PointTree::new(marks.collect());
        let mut heights_max = vec![0.0; is_free.len()];
        for (e, height) in (0u32..).zip(&mut heights_max).filter(|(e, _)| is_free[*e as usize]) {
            let edge = self.embedded_edge(e);
            let [a, b] = edge.ends;
            let length = a.distance(b);
            *height = EQUILATERAL * length;
            // Parts farther away do not limit the height.
            let reach = Point::splat(*height / DISTANCE_SHARE);
            let around = Aabb { low: a.min(b) - reach, high: a.max(b) + reach };
            edges.meeting(&around, |f| {
                let other = self.embedded_edge(f);
                let share = edge.ids.iter().position(|v| other.ids.contains(v));
                let most = match share {
                    _ if f == e => return,
                    None => DISTANCE_SHARE * between_edges(edge.ends, other.ends),
                    Some(i) => {
                        let k = usize::from(other.ids[1] == edge.ids[i]);
                        let [u, v] = [edge.ends[1 - i], other.ends[1 - k]]
                            .map(|x| (x - edge.ends[i]).normalize());
                        ANGLE_SHARE * 0.5 * length * tangent_of_half(u, v)
                    }
                };
                *height = height.min(most);
            });
            marks.within(&around, |v, p| {
                if !edge.ids.contains(&v) {
                    *height = height.min(DISTANCE_SHARE * to_edge(p, edge.ends));
                }
            });
        }
        heights_max
    }

    /// Distance from edge `e` to other edges and points, and of its middle to triangles; from an edge that shares a vertex, that of the
    /// other ends.
    fn clearance(&self, e: u32, seeker: &Seeker) -> f64 {
        let edge = self.embedded_edge(e);
        let [a, b] = edge.ends;
        let mut least = seeker.distance(a.midpoint(b), f64::INFINITY);
        for f in (0..self.embedded.edges.len() as u32).filter(|&f| f != e) {
            let other = self.embedded_edge(f);
            least = least.min(match edge.ids.iter().position(|v| other.ids.contains(v)) {
                None => between_edges(edge.ends, other.ends),
                Some(i) => {
                    let k = usize::from(other.ids[1] == edge.ids[i]);
                    to_edge(edge.ends[1 - i], other.ends).min(to_edge(other.ends[1 - k], edge.ends))
                }
            });
        }
        for &[v, _] in self.embedded.points.iter().filter(|[v, _]| !edge.ids.contains(v)) {
            least = least.min(to_edge(self.points[v as usize], edge.ends));
        }
        least
    }

    /// The apex at edge `e`, at `height` or less, with the largest distance from other triangles; `None` below `least`.
    fn apex(&self, e: u32, mut height: f64, least: f64, seeker: &Seeker) -> Option<Point> {
        let edge = self.embedded_edge(e);
        let [a, b] = edge.ends;
        let along = (b - a).normalize();
        let side = along.any_orthonormal_vector();
        let up = along.cross(side);
        let ids = [edge.ids[0], edge.ids[1], self.points.len() as u32];
        while height >= least {
            let mut best = None;
            for [cos, sin] in DIRECTIONS {
                let apex = a.midpoint(b) + (side * cos + up * sin) * height;
                let clear = seeker.distance(apex, 2.0 * height).min(2.0 * height);
                if clear < CLEAR_SHARE * height || best.is_some_and(|(most, _)| clear <= most) {
                    continue;
                }
                let fin = [a, b, apex];
                let mut is_apart = true;
                seeker.tree().meeting(&Aabb::around(fin), |t| {
                    let (corners, theirs) = (self.corners(t), self.triangles[t as usize]);
                    is_apart = is_apart && contact(fin, ids, corners, theirs).is_none();
                });
                if is_apart {
                    best = Some((clear, apex));
                }
            }
            if let Some((_, apex)) = best {
                return Some(apex);
            }
            height *= 0.5;
        }
        None
    }
}

/// Tangent of half the angle of two directions.
fn tangent_of_half(u: Point, v: Point) -> f64 {
    let (sin, cos) = (u.cross(v).length(), u.dot(v));
    match cos > 0.0 {
        true => sin / (1.0 + cos),
        false => (1.0 - cos) / sin,
    }
}

fn to_edge(p: Point, [a, b]: [Point; 2]) -> f64 {
    let u = b - a;
    let at = ((p - a).dot(u) / u.length_squared()).clamp(0.0, 1.0);
    p.distance(a + u * at)
}

/// Distance of two edges.
fn between_edges([a, b]: [Point; 2], [c, d]: [Point; 2]) -> f64 {
    let ends = [to_edge(a, [c, d]), to_edge(b, [c, d]), to_edge(c, [a, b]), to_edge(d, [a, b])];
    let least = ends.into_iter().fold(f64::INFINITY, f64::min);
    // Or between insides, where the common perpendicular meets both.
    let (u, v, w) = (b - a, d - c, c - a);
    let normal = u.cross(v);
    let squared = normal.length_squared();
    let [s, t] = [w.cross(v), w.cross(u)].map(|x| x.dot(normal) / squared);
    match (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
        true => least.min(w.dot(normal).abs() / squared.sqrt()),
        false => least,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_of_edges_are_those_of_their_points() {
        let at = |k: u32, i: u32| f64::from((k * 7919 + i * 104_729) % 1009) / 100.0;
        let point = |k: u32, i: u32| Point::new(at(k, i), at(k, i + 1), at(k, i + 2));
        for k in 0..500 {
            let [e, f] = [0, 7].map(|i| [point(k, i), point(k, i + 13)]);
            let found = between_edges(e, f);
            let along = |[a, b]: [Point; 2], n: u32| a + (b - a) * (f64::from(n) / 60.0);
            let all = (0..=60).map(|n| to_edge(along(e, n), f));
            let sampled = all.fold(f64::INFINITY, f64::min);
            assert!(found <= sampled + 1e-12 && sampled <= found + e[0].distance(e[1]) / 60.0);
        }
    }
}
