//! Covers a flat part whose outline consists of chains by faces, through points that lie exactly in it.
//!
//! From each directed edge with the facet on its left, the shell shows the next part: a face in the facet's plane, or a
//! tetrahedron that the plane cuts. The latter has an edge with its ends on both sides, and that edge crosses the
//! facet. A point of the facet near the crossing, joined to the shell of that edge, removes the edge and adds no edge
//! with ends on both sides.

use super::chain::{PatchFailure, TERMS};
use super::complex::{TetComplex, edge_key};
use super::exact::ExactPoint;
use super::flat_parts::FlatPart;
use super::flips::Flipper;
use super::patch::RecoveryPatch;
use super::target::RecoveryTarget;
use super::walk::{find_edge, shell};
use tetdb_base::geom::{Dyadic, IdSet};
use tetdb_base::storage::Pages;

/// Points in one facet.
const POINTS_MAX: usize = 5000;

/// The face or crossing on the left of a directed edge.
enum Left {
    /// The face to this vertex.
    Face(u32),
    /// The edge from above to below, of the tetrahedron.
    Crossing(u32, u32, u32),
}

impl<P: Pages> RecoveryPatch<'_, P> {
    /// Covers a flat part by faces; `outline` are the edges of its boundary, in its direction.
    ///
    /// Returns the faces, each in the direction of the part.
    pub(super) fn cover(
        &mut self,
        part: &FlatPart,
        outline: &[(u32, u32)],
    ) -> Result<Vec<[u32; 3]>, PatchFailure> {
        let f = part.facets[0];
        let on_outline: IdSet<(u32, u32)> = outline.iter().copied().collect();
        let known: IdSet<u32> = part.facets.iter().flatten().copied().collect();
        let mut open: Vec<(u32, u32)> = on_outline.iter().copied().collect();
        open.sort_unstable();
        let mut done: IdSet<(u32, u32)> = IdSet::default();
        let mut faces = Vec::new();
        let mut points = 0;
        while let Some((p, q)) = open.pop() {
            if done.contains(&(p, q)) {
                continue;
            }
            match self.left_of(f, p, q)? {
                Left::Face(r) => {
                    if !known.contains(&r) && !self.is_steiner(r) {
                        return Err(PatchFailure::Vertex(r));
                    }
                    faces.push([p, q, r]);
                    done.extend([(p, q), (q, r), (r, p)]);
                    for (x, y) in [(q, r), (r, p)] {
                        self.kept.insert(edge_key(x, y));
                        if !on_outline.contains(&(x, y)) && !done.contains(&(y, x)) {
                            open.push((y, x));
                        }
                    }
                }
                Left::Crossing(t, above, below) => {
                    open.push((p, q));
                    points += 1;
                    if points > POINTS_MAX * part.facets.len() {
                        return Err(PatchFailure::TooMuch);
                    }
                    let effort = self.effort;
                    let target = match part.facets.len() {
                        1 => RecoveryTarget::Face(f),
                        _ => RecoveryTarget::Plane(f),
                    };
                    let mut flipper = Flipper::new(self, target);
                    flipper.work = effort.flip_work;
                    if flipper.remove_edge(t, above, below, effort.flip_level) {
                        flipper.keep();
                        continue;
                    }
                    self.pierce(part, above, below)?;
                }
            }
        }
        Ok(faces)
    }

    fn left_of(&mut self, f: [u32; 3], p: u32, q: u32) -> Result<Left, PatchFailure> {
        let around = find_edge(self, p, q)
            .and_then(|t| shell(self, t, p, q))
            .ok_or(PatchFailure::Broken("an edge of a facet is not there"))?;
        let n = around.ring.len();
        let side: Vec<f64> =
            around.ring.iter().map(|&r| self.orient([f[0], f[1], f[2], r])).collect();
        for i in 0..n {
            let j = (i + 1) % n;
            let (x, y) = (around.ring[i], around.ring[j]);
            if side[i] == 0.0 {
                // A reference off the plane distinguishes left from right.
                let k = (0..n)
                    .find(|&k| side[k] != 0.0)
                    .ok_or(PatchFailure::Broken("a shell is flat"))?;
                let turn = self.orient([p, q, x, around.ring[k]]);
                if (turn > 0.0) == (side[k] > 0.0) && turn != 0.0 {
                    return Ok(Left::Face(x));
                }
            }
            if side[i] * side[j] < 0.0
                || (side[i] > 0.0) != (side[j] > 0.0) && side[i] != 0.0 && side[j] != 0.0
            {
                let (above, below) = if side[i] > 0.0 { (x, y) } else { (y, x) };
                if self.orient([p, q, below, above]) > 0.0 {
                    return Ok(Left::Crossing(around.tets[i], above, below));
                }
            }
        }
        Err(PatchFailure::Broken("nothing lies on the left of a facet's edge"))
    }

    /// The facet of `part` that the edge passes through, and where: volumes of the edge with the sides opposite the corners, as
    /// parts of their sum.
    fn facet_at(&self, part: &FlatPart, above: u32, below: u32) -> Option<([u32; 3], [Dyadic; 3])> {
        let [p, q] = [above, below].map(|v| self.position_of(v));
        // The one that doubles see first; where they err another one has it.
        let depth = |f: &[u32; 3]| {
            let c = f.map(|v| self.position_of(v));
            let over = [(1, 2), (2, 0), (0, 1)].map(|(i, j)| (c[i] - p).cross(c[j] - p).dot(q - p));
            let sum: f64 = over.iter().sum();
            over.map(|o| o / sum).into_iter().fold(f64::INFINITY, f64::min)
        };
        let guess = part.facets.iter().max_by(|f, g| depth(f).total_cmp(&depth(g)));
        guess.into_iter().chain(&part.facets).find_map(|&f| {
            let over = [(1, 2), (2, 0), (0, 1)]
                .map(|(i, j)| self.orient_exact([above, below, f[i], f[j]]));
            let is_in = over.iter().all(|o| o.sign() >= 0) || over.iter().all(|o| o.sign() <= 0);
            is_in.then_some((f, over))
        })
    }

    /// Takes the edge `above below` away by a point of the part near its crossing.
    fn pierce(&mut self, part: &FlatPart, above: u32, below: u32) -> Result<(), PatchFailure> {
        let around = find_edge(self, above, below)
            .and_then(|t| shell(self, t, above, below))
            .ok_or(PatchFailure::Broken("a crossing edge is on the hull"))?;
        if around.required {
            return Err(PatchFailure::Crossed([above, below, below]));
        }
        let outer = self.outer_faces(&around.tets);
        let (f, [over_a, over_b, over_c]) = self
            .facet_at(part, above, below)
            .ok_or(PatchFailure::Broken("an edge crosses no facet"))?;
        let [a, b, c] = f.map(|v| self.position(v));
        let sum = over_a.plus(&over_b).plus(&over_c);
        let share = |terms| Some((over_b.over(&sum, terms)?, over_c.over(&sum, terms)?));
        let (s, t) = share(TERMS[0]).ok_or(PatchFailure::Broken("an edge crosses no facet"))?;
        // Clearance around the crossing: a fraction of the distance to the ring.
        let (u, v) = (b - a, c - a);
        let crossing = a + u * s.estimate() + v * t.estimate();
        let room = around
            .ring
            .iter()
            .map(|&r| self.position(r).distance(crossing))
            .fold(f64::INFINITY, f64::min)
            / u.length().max(v.length());
        let near = |slack: f64, s: &Dyadic, t: &Dyadic| {
            let slack = Dyadic::from(slack);
            let short =
                [s, t].map(|x| if slack.sign() > 0 { x.shortened(&slack) } else { x.clone() });
            let rest = Dyadic::from(1.0).minus(&short[0]).minus(&short[1]);
            // On a side of the facet only where the part goes on beyond it.
            let least = if part.facets.len() > 1 { 0 } else { 1 };
            let inside = [&short[0], &short[1], &rest].iter().all(|s| s.sign() >= least);
            inside.then(|| ExactPoint::combination(a, &[(b, &short[0]), (c, &short[1])]))
        };
        for slack in [0.02, 1e-4, 1e-7] {
            if let Some(exact) = near(room * slack, &s, &t)
                && self.star(&around.tets, &outer, f, exact).is_some()
            {
                return Ok(());
            }
        }
        for slack in [0.1, 1e-3, 0.0] {
            if let Some(exact) = near(room * slack, &s, &t)
                && self.star_grown(&around.tets, f, exact).is_some()
            {
                return Ok(());
            }
        }
        for terms in TERMS {
            if let Some((s, t)) = share(terms)
                && let Some(exact) = near(0.0, &s, &t)
                && self.star(&around.tets, &outer, f, exact).is_some()
            {
                return Ok(());
            }
        }
        Err(PatchFailure::Precision("doubles leave no place on it"))
    }
}
