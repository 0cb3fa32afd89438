//! One vertex in a cavity that grows from a bad tetrahedron.
//!
//! ```text
//!    size 1: the bad one         grown across the worst face      the vertex joined to
//!    and the place in it         that may be crossed, and the     all faces of the best size
//!         ____                   place moved, again and again
//!        /·__/\                       ________                       ________
//!       /_/____\                     /\      /\                     /\ \  / /\
//!                                   /  \ ·  /  \                   /__\_\/_/__\
//! ```
//! The worst face is the one whose tetrahedron with the vertex would be worst, or most negative: so the cavity grows
//! towards what stands in the vertex's way, until it has room. Neither the bad tetrahedron alone nor all its neighbors at once
//! are a cavity of any use. All tetrahedra on the faces of a cavity exactly positive: then they fill it, and once only, because each
//! ray from the vertex leaves the cavity as often as it enters, plus once.
//!
//! One of the cavity's own vertices can take the part of the new one, joined to the faces that do not have it. Vertices whose whole ball
//! is inside disappear.

use super::super::smooth::is_free;
use super::face_bounds::{Weights, value_of};
use super::star::{Aim, Cost, Goal, Side, Star};
use crate::mesh::{Mesh, Tet, VertexTag};
use crate::reconnect::{Replacement, Shell};
use tetdb_base::geom::Point;
use tetdb_base::storage::Pages;

/// Steps of the search after each growth, and after the last.
const STEPS_GROWING: u32 = 20;
const STEPS: u32 = 80;
/// Growth without any place that sees all faces from far enough ends after so many tetrahedra, but for flat ones: of those the one beside a polygon of
/// nearly coplanar triangles needs 17.
const HIDDEN_MAX: u32 = 12;
/// Flat ones have a value below this.
const FLAT: f64 = 1e-6;
/// Growth past the best size so far ends after so many, but where the number of bad ones is to go down: there larger cavities do what others cannot
/// (3 to 5 % of those of q ≥ 10 on four parts of 26).
const IDLE_MAX: u32 = 8;
/// Longest ring of an edge that gets a vertex.
const RING_MAX: usize = 24;

/// A vertex to which all faces of the cavity's first tetrahedra are to be joined.
#[derive(Clone, Copy, Debug)]
pub(super) struct Proposal {
    /// How many of the tetrahedra.
    n: usize,
    at: Point,
    /// The vertex, where it is one of the cavity's own.
    corner: Option<u32>,
    /// The least value of the new tetrahedra.
    pub(super) value: f64,
}

/// Scratch of a cavity.
#[derive(Default)]
pub(super) struct Cavity {
    /// In the order in which they were added.
    tets: Vec<u32>,
    records: Vec<Tet>,
    star: Star,
    shell: Shell,
    /// Goodness and value of each.
    old: Vec<[f64; 2]>,
    replacement: Replacement,
}

impl Cavity {
    /// The best vertex in the cavities that grow from `t`, if its value is to be above `floor`.
    pub(super) fn grow<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        t: u32,
        aim: Aim,
        floor: f64,
        weights: &mut Weights,
    ) -> Option<Proposal> {
        self.begin(mesh, t, weights);
        let points = mesh.points(&self.records[0]);
        let mut at = (points[0] + points[1] + points[2] + points[3]) * 0.25;
        let mut best: Option<Proposal> = None;
        let (mut n_hidden, mut n_idle) = (0, 0);
        loop {
            let wanted = best.map_or(floor, |b| b.value.max(floor));
            // Required faces stay the cavity's, however it grows.
            if self.star.most_required() <= wanted {
                break;
            }
            let (mut value, mut most) = (self.star.least(at, 0.0), f64::INFINITY);
            n_hidden += 1;
            n_idle += 1;
            if value <= 0.0 {
                (at, most) = self.star.moved_into_kernel(at);
                value = self.star.least(at, 0.0);
            }
            if value > 0.0 && most > wanted {
                n_hidden = 0;
                (at, value) = (self.star).raise_least(at, value, STEPS_GROWING, aim.enough);
            }
            let n = self.tets.len();
            if value > best.map_or(0.0, |b| b.value) && self.is_better(at, value, aim) {
                n_idle = 0;
                best = Some(Proposal { n, at, corner: None, value });
            }
            // Joined to a vertex that all of them have they would be the same ones again.
            let records = &self.records;
            let is_of_all = |v: u32| records.iter().all(|record| record.local(v).is_some());
            let corner = (self.star).best_corner(best.map_or(aim.own, |b| b.value), is_of_all);
            if let Some((v, at, value)) = corner
                && self.is_better(at, value, aim)
            {
                let corner = Some(v);
                n_idle = 0;
                best = Some(Proposal { n, at, corner, value });
            }
            if best.is_some_and(|b| b.value >= aim.enough)
                || n >= aim.tets_max
                || aim.own > FLAT && n_hidden > HIDDEN_MAX
                || best.is_some() && n_idle > IDLE_MAX && aim.goal != Goal::Count
                || !self.add_worst(mesh, at, weights)
            {
                break;
            }
        }
        let best = best?;
        self.shrink(mesh, best.n, weights);
        if best.corner.is_some() {
            return Some(best);
        }
        let value = self.star.least(best.at, f64::NEG_INFINITY);
        let (at, value) = (self.star).raise_least(best.at, value, STEPS, aim.enough);
        Some(if self.is_better(at, value, aim) { Proposal { at, value, ..best } } else { best })
    }

    /// The best vertex in the shell of edge `e` of `t`, an inner edge, if its value is to be above `floor`.
    pub(super) fn split<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        t: u32,
        e: usize,
        aim: Aim,
        floor: f64,
        weights: &mut Weights,
    ) -> Option<Proposal> {
        if !self.shell.gather(mesh, t, e, RING_MAX) || !self.shell.closed || self.shell.required {
            return None;
        }
        self.clear();
        for k in 0..self.shell.tets.len() {
            let t = self.shell.tets[k];
            self.add(mesh, t, weights);
        }
        if self.star.most() <= floor {
            return None;
        }
        let middle = (mesh.point(self.shell.a) + mesh.point(self.shell.b)) * 0.5;
        let value = self.star.least(middle, f64::NEG_INFINITY);
        let (at, value) = (self.star).raise_least(middle, value, STEPS, aim.enough);
        let n = self.tets.len();
        let proposal = Proposal { n, at, corner: None, value };
        (value > 0.0 && self.is_better(at, value, aim)).then_some(proposal)
    }

    /// Its tetrahedra and outer faces, to make the proposal returned last with.
    pub(super) fn outline(&self) -> (Vec<u32>, Vec<[u32; 3]>) {
        let faces = self.star.sides.iter().map(|side| side.vertices);
        (self.tets.clone(), faces.collect())
    }

    /// Makes a proposal in the cavity of this outline; `false`, with nothing changed, when a vertex that must stay would go.
    pub(super) fn insert<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        tets: &[u32],
        faces: &[[u32; 3]],
        proposal: Proposal,
    ) -> bool {
        assert_eq!(tets.len(), proposal.n, "the cavity of the proposal");
        let v = proposal.corner.unwrap_or_else(|| {
            let h = mesh.tet(tets[0]).vertices().map(|v| mesh.size(v));
            let v = mesh.add_vertex(proposal.at, (h[0] + h[1] + h[2] + h[3]) * 0.25);
            mesh.set_vertex_attribute(v, VertexTag::Free, 0);
            v
        });
        let new: Vec<[u32; 4]> = (faces.iter())
            .filter(|face| !face.contains(&v))
            .map(|&[a, b, c]| [v, a, b, c])
            .collect();
        let done = self.exchange(mesh, tets, &new);
        if !done && proposal.corner.is_none() {
            mesh.free_vertex(v);
        }
        done
    }

    /// Replaces tetrahedra by `new`, all exactly positive; `false`, with nothing changed, when a vertex that must stay would go.
    pub(super) fn exchange<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        tets: &[u32],
        new: &[[u32; 4]],
    ) -> bool {
        let records: Vec<Tet> = tets.iter().map(|&t| mesh.tet(t)).collect();
        let mut gone = corners_of(&records);
        gone.retain(|v| !new.iter().any(|tet| tet.contains(v)));
        let done = gone.iter().all(|&v| is_free(mesh, v))
            && (self.replacement).apply(mesh, tets, &records, new);
        if done {
            gone.into_iter().for_each(|v| mesh.free_vertex(v));
        }
        done
    }

    /// Tetrahedra made by the last success.
    pub(super) fn new_tets(&self) -> &[u32] {
        &self.replacement.new_tets
    }

    fn clear(&mut self) {
        self.tets.clear();
        self.records.clear();
        self.old.clear();
        self.star.sides.clear();
    }

    /// Whether the vertex at `at`, where the least value is `value`, makes the cavity better.
    fn is_better(&self, at: Point, value: f64, aim: Aim) -> bool {
        self.star.cost(at).is_better(&self.cost(), value, aim)
    }

    /// What its tetrahedra cost.
    pub(super) fn cost(&self) -> Cost {
        let mut cost = Cost::default();
        for &[good, value] in &self.old {
            cost.add(good, value);
        }
        cost
    }

    pub(super) fn n_tets(&self) -> usize {
        self.tets.len()
    }

    pub(super) fn records(&self) -> &[Tet] {
        &self.records
    }

    pub(super) fn sides(&self) -> &[Side] {
        &self.star.sides
    }

    /// Begins with one tetrahedron.
    pub(super) fn begin<P: Pages>(&mut self, mesh: &mut Mesh<P>, t: u32, weights: &mut Weights) {
        self.clear();
        self.add(mesh, t, weights);
    }

    /// Adds the worst tetrahedron beyond a face, and then all that have no vertex more; `false` when none may be added or there are too many.
    pub(super) fn grow_by_vertex<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        tets_max: usize,
        corners_max: usize,
        weights: &mut Weights,
    ) -> bool {
        let mut order: Vec<(f64, u32)> = Vec::new();
        for t in self.beyond() {
            let record = mesh.tet(t);
            order.push((value_of(mesh, &record, weights)[1], t));
        }
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        if !order.into_iter().any(|(_, t)| self.add(mesh, t, weights)) {
            return false;
        }
        let corners = self.corners();
        let mut has_grown = true;
        while has_grown && self.tets.len() <= tets_max {
            has_grown = false;
            for t in self.beyond() {
                let has_all = mesh.tet(t).vertices().iter().all(|v| corners.contains(v));
                has_grown |= has_all && self.add(mesh, t, weights);
            }
        }
        self.tets.len() <= tets_max && corners.len() <= corners_max
    }

    /// Tetrahedra beyond faces that may be crossed, each once.
    fn beyond(&self) -> Vec<u32> {
        let open = (self.star.sides.iter()).filter(|side| !side.required && side.across.exists());
        let mut tets: Vec<u32> = open.map(|side| side.across.tet()).collect();
        tets.sort_unstable();
        tets.dedup();
        tets
    }

    /// Adds a tetrahedron; `false`, with nothing changed, when a required face would be inside.
    fn add<P: Pages>(&mut self, mesh: &mut Mesh<P>, t: u32, weights: &mut Weights) -> bool {
        let is_shared = |side: &Side| side.across.exists() && side.across.tet() == t;
        let sides = &mut self.star.sides;
        if sides.iter().any(|side| is_shared(side) && side.required) {
            return false;
        }
        sides.retain(|side| !is_shared(side));
        let record = mesh.tet(t);
        for i in 0..4 {
            let across = record.neighbor[i];
            if !across.exists() || !self.tets.contains(&across.tet()) {
                self.star.sides.push(Side::new(mesh, &record, i, weights));
            }
        }
        self.old.push(value_of(mesh, &record, weights));
        self.tets.push(t);
        self.records.push(record);
        true
    }

    /// Adds the tetrahedron beyond the worst face that may be crossed, the vertex being at `at`.
    fn add_worst<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        at: Point,
        weights: &mut Weights,
    ) -> bool {
        let mut order: Vec<(f64, u32)> = (self.star.sides.iter())
            .filter(|side| !side.required && side.across.exists())
            .map(|side| (side.value(at), side.across.tet()))
            .collect();
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        order.into_iter().any(|(_, t)| self.add(mesh, t, weights))
    }

    /// Leaves the first `n` tetrahedra.
    fn shrink<P: Pages>(&mut self, mesh: &mut Mesh<P>, n: usize, weights: &mut Weights) {
        if n < self.tets.len() {
            let tets = std::mem::take(&mut self.tets);
            self.clear();
            for &t in &tets[..n] {
                self.add(mesh, t, weights);
            }
        }
    }

    /// All vertices, in ascending order.
    pub(super) fn corners(&self) -> Vec<u32> {
        corners_of(&self.records)
    }
}

/// Vertices of tetrahedra, in ascending order.
fn corners_of(records: &[Tet]) -> Vec<u32> {
    let mut all: Vec<u32> = records.iter().flat_map(Tet::vertices).collect();
    all.sort_unstable();
    all.dedup();
    all
}

#[cfg(test)]
mod tests {
    use super::super::face_bounds::FaceBounds;
    use super::super::operator::NO_VOLUME;
    use super::super::star::Goal;
    use super::*;
    use crate::optimize::tests::{checked, delaunay, live, random};
    use tetdb_base::shape::inverse_quality;
    use tetdb_base::storage::FlatPages;

    /// Vertices of all tetrahedra, each in ascending order.
    fn content(mesh: &mut Mesh<FlatPages>) -> Vec<[u32; 4]> {
        let mut all: Vec<[u32; 4]> = (live(mesh).into_iter())
            .map(|(_, tet)| {
                let mut vertices = tet.vertices();
                vertices.sort_unstable();
                vertices
            })
            .collect();
        all.sort_unstable();
        all
    }

    /// Joined to a vertex that all tetrahedra of a cavity have, they are the same ones again, and other formulas give them other roundings of no volume.
    #[test]
    fn flat_tetrahedra_are_never_replaced_by_themselves() {
        let (mut n_flat, mut n_mended) = (0, 0);
        for seed in 0..60 {
            let mut next = random(seed);
            // A polygon whose corners are in one plane but for rounding, and points below it.
            let u = Point::new(next() - 0.5, next() - 0.5, next() - 0.5).normalize();
            let v = u.cross(Point::new(next(), next() - 0.5, 0.3)).normalize();
            let w = u.cross(v);
            let mut points: Vec<Point> = (0..12)
                .map(|i| (f64::from(i) + 0.8 * next()) * std::f64::consts::TAU / 12.0)
                .map(|angle| u * angle.cos() + v * angle.sin())
                .collect();
            points.extend((0..8).map(|_| {
                let (x, y) = (next() - 0.5, next() - 0.5);
                u * x + v * y - w * (0.3 + next())
            }));
            let mut mesh = delaunay(Mesh::new(FlatPages::default()), &points, points.len(), 1.0);
            let (hull, volume) = checked(&mut mesh);
            let flat = live(&mut mesh).into_iter().find(|(_, tet)| {
                let points = mesh.points(tet);
                inverse_quality(points) <= NO_VOLUME
            });
            let Some((t, _)) = flat else {
                continue;
            };
            n_flat += 1;
            let aim = Aim { own: 0.0, enough: 0.5, goal: Goal::Quality, more: 3, tets_max: 40 };
            let mut bounds = FaceBounds::default();
            let mut weights = bounds.by(aim.goal.measure(f64::INFINITY));
            let mut cavity = Cavity::default();
            let before = content(&mut mesh);
            let Some(proposal) = cavity.grow(&mut mesh, t, aim, 0.0, &mut weights) else {
                continue;
            };
            assert!(proposal.value > 0.0);
            let (tets, faces) = cavity.outline();
            if cavity.insert(&mut mesh, &tets, &faces, proposal) {
                assert_ne!(content(&mut mesh), before, "seed {seed}");
                let after = checked(&mut mesh);
                assert!(after.0 == hull && (after.1 - volume).abs() < 1e-12);
                n_mended += 1;
            }
        }
        assert!(n_flat >= 20 && n_mended >= 15, "{n_flat}, {n_mended} mended");
    }
}
