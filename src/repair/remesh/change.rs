//! One change of the surface: triangles that go, triangles that come, and the checks between.

use tetdb_base::geom::{Aabb, Point, orient};
use tetdb_base::surface::contact;

use super::chains::Chain;
use super::envelope::Envelope;
use super::history::History;
use super::mesh::{EdgeKey, Mesh, Span, area_normal, cosine, edge, quality};
use super::octree::Octree;
use super::region::{Region, is_covered};
use super::settings::{RemeshReport, RemeshSettings};
use super::sizes::Sizes;

/// Below this quality a triangle's normal says nothing: about half a degree.
const NEEDLE: f64 = 0.02;
/// A changed triangle of better quality turns by less than this: 45 degrees.
const TURN_COS: f64 = 0.7;

/// The state of a run.
pub struct Remesher<'a> {
    /// The surface as it is now.
    pub mesh: Mesh,
    /// Wanted length at each vertex.
    pub wanted: Vec<f64>,
    /// Boxes of its triangles.
    pub octree: Octree,
    /// The input and the tolerance.
    pub envelope: Envelope<'a>,
    /// Kept curves.
    pub chains: Vec<Chain>,
    /// The wanted lengths.
    pub sizes: Sizes<'a>,
    /// What was asked for.
    pub settings: &'a RemeshSettings,
    /// Counts so far.
    pub report: RemeshReport,
    /// Changes and failures so far.
    pub history: History,
}

/// A replacement of triangles.
#[derive(Default)]
pub struct Change {
    /// Triangles that go.
    pub removed: Vec<u32>,
    /// Triangles that come, with their labels.
    pub added: Vec<([u32; 3], u32)>,
    /// A vertex with a new position, or a new vertex.
    pub moved: Option<(u32, Point)>,
    /// Pairs of a removed triangle and the place of the added one that it becomes.
    pub same: Vec<(u32, usize)>,
    /// Kept edges that go.
    pub features_removed: Vec<EdgeKey>,
    /// Kept edges that come.
    pub features_added: Vec<(EdgeKey, Span)>,
    /// True if the new triangles lie in the old ones.
    pub is_division: bool,
}

impl Remesher<'_> {
    fn at(&self, change: &Change, v: u32) -> Point {
        match change.moved {
            Some((u, p)) if u == v => p,
            _ => self.mesh.points[v as usize],
        }
    }

    /// Corners of the triangles that come.
    fn corners_added(&self, change: &Change) -> Vec<[Point; 3]> {
        change.added.iter().map(|(t, _)| t.map(|v| self.at(change, v))).collect()
    }

    /// Least quality of the triangles that go and of those that come.
    pub fn qualities(&self, change: &Change) -> [f64; 2] {
        let least =
            |all: &mut dyn Iterator<Item = [Point; 3]>| all.map(quality).fold(1.0, f64::min);
        [
            least(&mut change.removed.iter().map(|&t| self.mesh.corners(t))),
            least(&mut self.corners_added(change).into_iter()),
        ]
    }

    /// Applies a change if every check allows it.
    pub fn apply(&mut self, change: &Change) -> bool {
        let is_allowed = self.is_allowed(change);
        if is_allowed {
            self.commit(change);
        }
        is_allowed
    }

    /// Everything that the checks of a change depend on lies in this box, or has a corner in it.
    pub fn reach(&self, change: &Change) -> Aabb {
        let old = change.removed.iter().flat_map(|&t| self.mesh.corners(t));
        let Aabb { low, high } =
            Aabb::around(old.chain(self.corners_added(change).into_iter().flatten()));
        let by = Point::splat(2.0 * self.envelope.tolerance);
        Aabb { low: low - by, high: high + by }
    }

    /// Applies a change that is allowed.
    pub fn commit(&mut self, change: &Change) {
        let old = change.removed.iter().flat_map(|&t| self.mesh.triangles[t as usize]);
        self.history.change(old.chain(change.added.iter().flat_map(|(t, _)| *t)));
        let mesh = &mut self.mesh;
        for &t in &change.removed {
            self.octree.remove(t);
            mesh.remove(t);
        }
        if let Some((v, p)) = change.moved {
            mesh.points[v as usize] = p;
            self.wanted.resize(mesh.points.len(), 0.0);
            let others = change.added.iter().flat_map(|(t, _)| *t).filter(|&u| u != v);
            let known = others.map(|u| (mesh.points[u as usize], self.wanted[u as usize]));
            let h = self.sizes.near(p, known);
            self.wanted[v as usize] = h;
        }
        for key in &change.features_removed {
            mesh.features.remove(key);
        }
        mesh.features.extend(change.features_added.iter().copied());
        for &(t, label) in &change.added {
            let t = mesh.add(t, label);
            self.octree.insert(t, Aabb::around(mesh.corners(t)));
        }
    }

    /// Returns whether every check allows a change.
    pub fn is_allowed(&self, change: &Change) -> bool {
        let corners = self.corners_added(change);
        if !corners.iter().all(|t| quality(*t) > 1e-9) || !self.keeps_labels(change) {
            return false;
        }
        if change.is_division {
            return self.is_free_of_contacts(change, &corners);
        }
        self.keeps_normals(change, &corners)
            && (self.is_same_plane_figure(change, &corners)
                || self.is_free_of_contacts(change, &corners)
                    && self.is_within_tolerance(change, &corners))
    }

    /// Returns whether old and new triangles fill the same figure of one plane, by exact signs: then no distance changes, and nothing is
    /// touched that was not.
    fn is_same_plane_figure(&self, change: &Change, corners: &[[Point; 3]]) -> bool {
        let mut old = change.removed.iter().map(|&t| self.mesh.corners(t));
        let Some(first) = old.next() else { return false };
        if !change.features_removed.is_empty() || quality(first) < NEEDLE {
            return false;
        }
        let normal = area_normal(first);
        let [a, b, c] = first;
        let is_in_plane = |p: Point| {
            (0..3).any(|k| a[k] == b[k] && b[k] == c[k] && c[k] == p[k])
                || orient(a, b, c, p) == 0.0
        };
        old.chain(corners.iter().copied())
            .all(|t| t.into_iter().all(is_in_plane) && area_normal(t).dot(normal) > 0.0)
    }

    /// Returns whether each label keeps a triangle.
    pub fn keeps_labels(&self, change: &Change) -> bool {
        change.removed.iter().all(|&t| {
            let label = self.mesh.labels[t as usize];
            let n = |all: usize| all as u32;
            let gone =
                change.removed.iter().filter(|&&s| self.mesh.labels[s as usize] == label).count();
            let new = change.added.iter().filter(|(_, l)| *l == label).count();
            self.mesh.n_of_label[label as usize] + n(new) > n(gone)
        })
    }

    /// No triangle turns far, and no edge that is not kept becomes a fold.
    fn keeps_normals(&self, change: &Change, corners: &[[Point; 3]]) -> bool {
        let turns = change.same.iter().any(|&(old, new)| {
            let old = self.mesh.corners(old);
            quality(old) > NEEDLE && cosine(area_normal(old), area_normal(corners[new])) < TURN_COS
        });
        if turns {
            return false;
        }
        let old: Vec<([u32; 3], Point)> = change
            .removed
            .iter()
            .map(|&t| (self.mesh.triangles[t as usize], area_normal(self.mesh.corners(t))))
            .collect();
        let new: Vec<([u32; 3], Point)> =
            change.added.iter().zip(corners).map(|((t, _), c)| (*t, area_normal(*c))).collect();
        let is_kept = |key: &EdgeKey| {
            !change.features_removed.contains(key) && self.mesh.features.contains_key(key)
                || change.features_added.iter().any(|(k, _)| k == key)
        };
        let least = self.sharpest(change, &new, &is_kept);
        least.is_some_and(|least| {
            least >= self.settings.feature_cos
                || self.sharpest(change, &old, &is_kept).is_some_and(|before| least >= before)
        })
    }

    /// Least cosine over the edges of some triangles that are not kept, among themselves and with the rest; `None` where such an edge has
    /// not two triangles.
    fn sharpest(
        &self,
        change: &Change,
        triangles: &[([u32; 3], Point)],
        is_kept: &dyn Fn(&EdgeKey) -> bool,
    ) -> Option<f64> {
        let mut least = 1.0f64;
        for (i, (t, normal)) in triangles.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                if is_kept(&edge(a, b)) {
                    continue;
                }
                let among = triangles.iter().enumerate();
                let among = among.filter(|(j, (s, _))| *j != i && s.contains(&a) && s.contains(&b));
                let mut others: Vec<Point> = among.map(|(_, (_, n))| *n).collect();
                if (a as usize) < self.mesh.around.len() {
                    let rest = self.mesh.at_edge(a, b).into_iter();
                    let rest = rest.filter(|s| !change.removed.contains(s));
                    others.extend(rest.map(|s| area_normal(self.mesh.corners(s))));
                }
                let [other] = others[..] else { return None };
                least = least.min(cosine(*normal, other));
            }
        }
        Some(least)
    }

    /// No new triangle touches another but in vertices and edges they share, and none is there twice.
    fn is_free_of_contacts(&self, change: &Change, corners: &[[Point; 3]]) -> bool {
        let is_same = |a: &[u32; 3], b: &[u32; 3]| a.iter().all(|v| b.contains(v));
        for (i, p) in corners.iter().enumerate() {
            let ids = change.added[i].0;
            for (q, (other, _)) in corners[..i].iter().zip(&change.added) {
                if is_same(&ids, other)
                    || !is_apart(p, ids, q, *other) && contact(*p, ids, *q, *other).is_some()
                {
                    return false;
                }
            }
            let touch = |q: &[Point; 3], other: [u32; 3]| {
                !is_apart(p, ids, q, other) && contact(*p, ids, *q, other).is_some()
            };
            let touches = self.octree.meeting(&Aabb::around(*p), |t| {
                let other = self.mesh.triangles[t as usize];
                !change.removed.contains(&t)
                    && (is_same(&ids, &other) || touch(&self.mesh.corners(t), other))
            });
            if touches {
                return false;
            }
        }
        true
    }

    fn is_within_tolerance(&self, change: &Change, corners: &[[Point; 3]]) -> bool {
        if !corners.iter().all(|t| self.envelope.holds(t)) {
            return false;
        }
        let tolerance = self.envelope.tolerance;
        let regions: Vec<Region> =
            corners.iter().filter_map(|t| Region::inner(*t, tolerance)).collect();
        let mut open = Vec::new();
        for &t in &change.removed {
            let relying = self.envelope.relying(&self.mesh.corners(t));
            open.extend(relying.into_iter().filter(|part| !is_covered(part, &regions)));
        }
        if open.is_empty() {
            return true;
        }
        let mut all = regions;
        let old = change.removed.iter().flat_map(|&t| self.mesh.corners(t));
        let reach = Point::splat(2.0 * tolerance);
        let Aabb { low, high } = Aabb::around(old);
        self.octree.meeting(&Aabb { low: low - reach, high: high + reach }, |s| {
            if !change.removed.contains(&s) {
                all.extend(Region::inner(self.mesh.corners(s), tolerance));
            }
            false
        });
        open.iter().all(|part| is_covered(part, &all))
    }
}

/// Separations below this share of the longest difference are left to exact signs.
const CLEARLY: f64 = 1e-9;

/// Returns whether a plane through an edge of either triangle clearly separates them but for the vertices they share. Quick, and enough for
/// most triangles of one plane, where exact signs are slow.
fn is_apart(p: &[Point; 3], p_ids: [u32; 3], q: &[Point; 3], q_ids: [u32; 3]) -> bool {
    let by_edge = |p: &[Point; 3], p_ids: [u32; 3], q: &[Point; 3], q_ids: [u32; 3]| {
        let normal = area_normal(*p);
        (0..3).any(|k| {
            let (a, b, c) = (k, (k + 1) % 3, (k + 2) % 3);
            let side = (p[b] - p[a]).cross(normal);
            let least = CLEARLY * side.length();
            side.dot(p[c] - p[a]) < 0.0
                && (0..3).all(|j| {
                    let x = q[j] - p[a];
                    let is_end = q_ids[j] == p_ids[a] || q_ids[j] == p_ids[b];
                    is_end || side.dot(x) > least * x.length().max((p[b] - p[a]).length())
                })
        })
    };
    // The corners of the one that are not the other's lie clearly on one side of the other's plane.
    let by_plane = |p: &[Point; 3], p_ids: [u32; 3], q: &[Point; 3], q_ids: [u32; 3]| {
        let normal = area_normal(*p);
        let length = normal.length();
        let side = |j: usize| {
            let x = q[j] - p[0];
            let d = normal.dot(x);
            if d.abs() > CLEARLY * length * x.length() { d.signum() } else { 0.0 }
        };
        let mut sides = (0..3).filter(|&j| !p_ids.contains(&q_ids[j])).map(side);
        let first = sides.next().unwrap_or(0.0);
        first != 0.0 && sides.all(|s| s == first) && quality(*p) > NEEDLE
    };
    by_plane(p, p_ids, q, q_ids)
        || by_plane(q, q_ids, p, p_ids)
        || by_edge(p, p_ids, q, q_ids)
        || by_edge(q, q_ids, p, p_ids)
}
