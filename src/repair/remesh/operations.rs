//! Split, collapse, flip and move: which triangles each replaces by which.

use tetdb_base::geom::Point;

use super::change::{Change, Remesher};
use super::history::Operation;
use super::mesh::{EdgeKey, Span, VertexKind, area_normal, cosine, edge};

/// Triangles of this quality are good enough: a collapse that makes lengths right may lower better ones to it.
const GOOD: f64 = 0.35;
/// A flip or a collapse for quality gains at least this much.
const GAIN: f64 = 1e-3;
/// A move gains at least this much: with a tenth of it, twice as many moves hardly change the result.
const GAIN_MOVE: f64 = 0.01;

impl Remesher<'_> {
    /// Length of an edge in units of the wanted one.
    pub fn relative_length(&self, (a, b): EdgeKey) -> f64 {
        let h = 0.5 * (self.wanted[a as usize] + self.wanted[b as usize]);
        self.mesh.points[a as usize].distance(self.mesh.points[b as usize]) / h
    }

    /// Divides an edge in its middle, moved onto the surface if that is allowed; returns the new vertex.
    pub fn split(&mut self, (a, b): EdgeKey) -> Option<u32> {
        let triangles = self.mesh.at_edge(a, b);
        let m = self.mesh.points.len() as u32;
        let ends = [a, b].map(|v| self.mesh.points[v as usize]);
        let middle = (ends[0] + ends[1]) * 0.5;
        let mut change = Change { removed: triangles.clone(), ..Change::default() };
        for &t in &triangles {
            let corners = self.mesh.triangles[t as usize];
            for (from, label) in
                [(a, self.mesh.labels[t as usize]), (b, self.mesh.labels[t as usize])]
            {
                change.added.push((corners.map(|v| if v == from { m } else { v }), label));
            }
        }
        let mut places = vec![(middle, true)];
        let mut kind = VertexKind::Free;
        if let Some(&span) = self.mesh.features.get(&edge(a, b)) {
            let at = 0.5 * (span.at[0] + span.at[1]);
            let key = edge(a, b);
            change.features_removed.push(key);
            for v in [a, b] {
                let ends = ((v, span.at_vertex(key, v)), (m, at));
                change.features_added.push((edge(v, m), Span::new(span.chain, ends.0, ends.1)));
            }
            let chain = &self.chains[span.chain as usize];
            let on_curve = chain.point(at);
            let deviates = (0..2).any(|k| {
                chain.deviation(span.at[k], at, ends[k], on_curve) > self.envelope.tolerance
            });
            kind = VertexKind::Curve;
            places.insert(0, (on_curve, false));
            // The middle of a chord lies beside its curve, and would leave it for good.
            places.truncate(if deviates { 0 } else { 1 });
            if on_curve == middle {
                places = vec![(middle, true)];
            }
        } else if let Some((on_surface, _)) = self.envelope.nearest(middle, self.envelope.tolerance)
            && on_surface.distance(middle) > 1e-3 * self.envelope.tolerance
        {
            places.insert(0, (on_surface, false));
        }
        self.mesh.add_vertex(middle, kind);
        for (p, is_division) in places {
            change.moved = Some((m, p));
            change.is_division = is_division && p.distance(ends[0]).min(p.distance(ends[1])) > 0.0;
            let [before, after] = self.qualities(&change);
            if !is_division && after < 0.5 * before.min(GOOD) {
                continue;
            }
            if self.apply(&change) {
                self.report.splits += 1;
                return Some(m);
            }
        }
        self.mesh.points.pop();
        self.mesh.kinds.pop();
        self.mesh.around.pop();
        None
    }

    /// The change of an operation; `None` if it gains nothing or a check forbids it.
    pub fn change_of(&self, operation: Operation) -> Option<Change> {
        match operation {
            Operation::Flip(e) => self.flip_of(e),
            Operation::Collapse(e) => self.collapse_of(e, false),
            Operation::CollapsePoor(e) => self.collapse_of(e, true),
            Operation::Move(v) => self.relocation_of(v),
        }
    }

    /// Does an operation if it is allowed and gains something.
    pub fn attempt(&mut self, operation: Operation) -> bool {
        if self.history.is_vain(operation) {
            return false;
        }
        let change = self.change_of(operation);
        self.settle(operation, change.as_ref(), self.history.n_changes)
    }

    /// Applies what came of an operation, evaluated after `n_changes` changes; returns whether there was a change.
    pub fn settle(
        &mut self,
        operation: Operation,
        change: Option<&Change>,
        n_changes: u64,
    ) -> bool {
        let Some(change) = change else {
            self.history.fail(operation, n_changes);
            return false;
        };
        self.commit(change);
        *match operation {
            Operation::Flip(_) => &mut self.report.flips,
            Operation::Collapse(_) | Operation::CollapsePoor(_) => &mut self.report.collapses,
            Operation::Move(_) => &mut self.report.moves,
        } += 1;
        true
    }

    /// Collapses an edge if that makes no triangle poor and no edge too long; `for_quality`, if it raises the least quality.
    fn collapse_of(&self, (a, b): EdgeKey, for_quality: bool) -> Option<Change> {
        use VertexKind::{Corner, Curve, Free};
        let kinds = [a, b].map(|v| self.mesh.kinds[v as usize]);
        let is_kept = self.mesh.features.contains_key(&(a, b));
        let points = [a, b].map(|v| self.mesh.points[v as usize]);
        // Removed vertex, the one that stays, and where.
        let mut tries: Vec<(u32, u32, Point)> = Vec::new();
        match (kinds, is_kept) {
            ([Free, Free], false) => {
                let middle = (points[0] + points[1]) * 0.5;
                if let Some((p, _)) = self.envelope.nearest(middle, self.envelope.tolerance) {
                    tries.push((a, b, p));
                }
                tries.extend([(a, b, points[1]), (b, a, points[0])]);
            }
            ([Free, _], false) => tries.push((a, b, points[1])),
            ([_, Free], false) => tries.push((b, a, points[0])),
            ([Curve, Curve], true) => tries.extend([(a, b, points[1]), (b, a, points[0])]),
            ([Curve, Corner], true) => tries.push((a, b, points[1])),
            ([Corner, Curve], true) => tries.push((b, a, points[0])),
            _ => {}
        }
        let mut tries = tries.into_iter();
        tries.find_map(|(gone, stays, p)| self.collapse_to(gone, stays, p, for_quality))
    }

    fn collapse_to(&self, gone: u32, stays: u32, p: Point, for_quality: bool) -> Option<Change> {
        let at_edge = self.mesh.at_edge(gone, stays);
        let mut apexes: Vec<u32> =
            at_edge.iter().map(|&t| self.mesh.apex(t, gone, stays)).collect();
        apexes.sort_unstable();
        let near = self.mesh.neighbors(stays);
        let mut common = self.mesh.neighbors(gone);
        common.retain(|v| near.binary_search(v).is_ok());
        if common != apexes {
            return None;
        }
        let mut change = Change { moved: Some((stays, p)), ..Change::default() };
        let stays_put = p == self.mesh.points[stays as usize];
        let star = self.mesh.around[gone as usize].iter();
        let other = self.mesh.around[stays as usize].iter().filter(|_| !stays_put);
        let mut removed: Vec<u32> = star.chain(other).copied().collect();
        removed.sort_unstable();
        removed.dedup();
        for &t in &removed {
            if at_edge.contains(&t) {
                continue;
            }
            let corners = self.mesh.triangles[t as usize];
            change.same.push((t, change.added.len()));
            let corners = corners.map(|v| if v == gone { stays } else { v });
            change.added.push((corners, self.mesh.labels[t as usize]));
        }
        change.removed = removed;
        if change.added.is_empty() || !self.collapse_curve(gone, stays, &mut change) {
            return None;
        }
        let [before, after] = self.qualities(&change);
        let is_good = match for_quality {
            true => after > before + GAIN,
            false => after >= before.min(GOOD) && !self.makes_long(gone, stays, p, before),
        };
        (is_good && self.is_allowed(&change)).then_some(change)
    }

    /// Returns whether a collapse makes an edge that would be divided again; not where it removes a needle.
    fn makes_long(&self, gone: u32, stays: u32, p: Point, before: f64) -> bool {
        let longest = if before < 0.1 { 2.0 } else { 4.0 / 3.0 };
        let known = [gone, stays].map(|v| (self.mesh.points[v as usize], self.wanted[v as usize]));
        let h = self.sizes.near(p, known.into_iter());
        let neighbors = self.mesh.neighbors(gone).into_iter().filter(|&v| v != stays);
        neighbors.into_iter().any(|v| {
            let mean = 0.5 * (h + self.wanted[v as usize]);
            let at = self.mesh.points[v as usize];
            let was = at.distance(self.mesh.points[gone as usize]);
            at.distance(p) > (longest * mean).max(was)
        })
    }

    /// Joins the kept edges at a vertex that goes; false where its curve forbids that.
    fn collapse_curve(&self, gone: u32, stays: u32, change: &mut Change) -> bool {
        if self.mesh.kinds[gone as usize] == VertexKind::Free {
            return true;
        }
        let (kept, key) = (self.mesh.kept_at(gone), edge(gone, stays));
        let Some(&far) = kept.iter().find(|&&v| v != stays) else { return false };
        let (joined, other) = (edge(far, stays), edge(gone, far));
        if kept.len() != 2 || self.mesh.features.contains_key(&joined) {
            return false;
        }
        let (near_span, far_span) = (self.mesh.features[&key], self.mesh.features[&other]);
        let (x, y) = (near_span.at_vertex(key, stays), far_span.at_vertex(other, far));
        let chain = &self.chains[near_span.chain as usize];
        let ends = [stays, far].map(|v| self.mesh.points[v as usize]);
        if near_span.chain != far_span.chain
            || chain.deviation(x, y, ends[0], ends[1]) > self.envelope.tolerance
        {
            return false;
        }
        change.features_removed.extend([key, other]);
        change.features_added.push((joined, Span::new(near_span.chain, (stays, x), (far, y))));
        true
    }

    /// Swaps the edge between two triangles if that raises their least quality; returns the new edge.
    pub fn flip(&mut self, (a, b): EdgeKey) -> Option<EdgeKey> {
        let apexes = self.mesh.at_edge(a, b).into_iter().map(|t| self.mesh.apex(t, a, b));
        let [c, d] = apexes.collect::<Vec<_>>()[..] else { return None };
        self.attempt(Operation::Flip((a, b))).then(|| edge(c, d))
    }

    fn flip_of(&self, (a, b): EdgeKey) -> Option<Change> {
        if self.mesh.features.contains_key(&(a, b)) {
            return None;
        }
        let [s, t] = self.mesh.at_edge(a, b)[..] else { return None };
        let [c, d] = [s, t].map(|t| self.mesh.apex(t, a, b));
        if self.mesh.around[c as usize]
            .iter()
            .any(|&t| self.mesh.triangles[t as usize].contains(&d))
        {
            return None;
        }
        let label = self.mesh.labels[s as usize];
        // The triangle at c without b, with d in its place; and the one without a.
        let corners = self.mesh.triangles[s as usize];
        let added = [b, a].map(|v| (corners.map(|u| if u == v { d } else { u }), label));
        let change = Change { removed: vec![s, t], added: added.to_vec(), ..Change::default() };
        let [before, after] = self.qualities(&change);
        let point = |v: u32| self.mesh.points[v as usize];
        let normals = added.map(|(t, _)| area_normal(t.map(point)));
        if after < before + GAIN.min(0.1 * before)
            || cosine(normals[0], normals[1]) < self.settings.feature_cos
            || !self.is_allowed(&change)
        {
            return None;
        }
        Some(change)
    }

    /// Moves a vertex to the middle of its neighbors, on the surface or along its curve, if that raises the least quality around it.
    fn relocation_of(&self, v: u32) -> Option<Change> {
        let place = match self.mesh.kinds[v as usize] {
            VertexKind::Corner => return None,
            VertexKind::Free => self.middle_of_star(v),
            VertexKind::Curve => None,
        };
        let mut change = Change::default();
        let place = match place {
            Some(p) => Some(p),
            None if self.mesh.kinds[v as usize] == VertexKind::Curve => {
                self.middle_of_curve(v, &mut change)
            }
            None => None,
        };
        let p = place?;
        change.moved = Some((v, p));
        change.removed.clone_from(&self.mesh.around[v as usize]);
        for (k, &t) in change.removed.iter().enumerate() {
            change.added.push((self.mesh.triangles[t as usize], self.mesh.labels[t as usize]));
            change.same.push((t, k));
        }
        let [before, after] = self.qualities(&change);
        (after > before + GAIN_MOVE && self.is_allowed(&change)).then_some(change)
    }

    fn middle_of_star(&self, v: u32) -> Option<Point> {
        let (mut sum, mut weight, mut normal) = (Point::ZERO, 0.0, Point::ZERO);
        for &t in &self.mesh.around[v as usize] {
            let corners = self.mesh.corners(t);
            let n = area_normal(corners);
            normal += n;
            sum += n.length() * (corners[0] + corners[1] + corners[2]) / 3.0;
            weight += n.length();
        }
        let from = self.mesh.points[v as usize];
        let (to, unit) = (sum / weight - from, normal / normal.length());
        let to = from + to - unit * to.dot(unit);
        let reach = to.distance(from).max(self.envelope.tolerance);
        let (at, s) = self.envelope.nearest(to, reach)?;
        // The nearest triangle of a thin wall may be on its other side.
        (self.envelope.normal(s).dot(unit).abs() > 0.3).then_some(at)
    }

    fn middle_of_curve(&self, v: u32, change: &mut Change) -> Option<Point> {
        let [a, b] = self.mesh.kept_at(v)[..] else { return None };
        let keys = [edge(a, v), edge(b, v)];
        let spans = keys.map(|key| self.mesh.features[&key]);
        let ends = [spans[0].at_vertex(keys[0], a), spans[1].at_vertex(keys[1], b)];
        // Weighted by the wanted lengths: the denser side gets the shorter part.
        let (x, y) = (self.wanted[a as usize], self.wanted[b as usize]);
        let at = ends[0] + (ends[1] - ends[0]) * (x / (x + y));
        let chain = &self.chains[spans[0].chain as usize];
        let p = chain.point(at);
        for (end, (key, u)) in ends.into_iter().zip(keys.into_iter().zip([a, b])) {
            if chain.deviation(end, at, self.mesh.points[u as usize], p) > self.envelope.tolerance {
                return None;
            }
            change.features_removed.push(key);
            change.features_added.push((key, Span::new(spans[0].chain, (u, end), (v, at))));
        }
        Some(p)
    }
}
