//! A facet whose segments are chains becomes a set of faces, through points that lie in it exactly.
//!
//! From each directed edge with the facet on its left, the shell shows what lies there: a face in the facet's
//! plane, or a tetrahedron that the plane cuts. The latter has an edge with its ends on both sides, and that edge
//! crosses the facet; a point of the facet near the crossing, joined to the shell of that edge, takes it away and
//! adds no edge with ends on both sides.

use std::collections::HashSet;

use super::chain::Trouble;
use super::exact::ExactPoint;
use super::flips::Flipper;
use super::patch::Patch;
use super::space::{Space, edge_key};
use super::target::Target;
use super::walk::{find_edge, shell};
use crate::store::Pages;

/// Points in one facet.
const POINTS_MAX: usize = 5000;
const FLIP_LEVEL: u32 = 1;
const FLIP_WORK: u32 = 40;

/// What lies on the left of a directed edge.
enum Left {
    /// The face to this vertex.
    Face(u32),
    /// The edge from above to below, of the tetrahedron.
    Crossing(u32, u32, u32),
}

impl<P: Pages> Patch<'_, P> {
    /// Covers the facet `f` by faces; `rim` is its boundary, in the direction of `f`.
    ///
    /// Returns the faces, each in the direction of `f`.
    pub(super) fn cover(&mut self, f: [u32; 3], rim: &[u32]) -> Result<Vec<[u32; 3]>, Trouble> {
        let on_rim: HashSet<(u32, u32)> = (0..rim.len())
            .map(|i| (rim[i], rim[(i + 1) % rim.len()]))
            .collect();
        let mut open: Vec<(u32, u32)> = on_rim.iter().copied().collect();
        open.sort_unstable();
        let mut done: HashSet<(u32, u32)> = HashSet::new();
        let mut faces = Vec::new();
        let mut points = 0;
        while let Some((p, q)) = open.pop() {
            if done.contains(&(p, q)) {
                continue;
            }
            match self.left_of(f, p, q)? {
                Left::Face(r) => {
                    if !rim.contains(&r) && !self.is_steiner(r) {
                        return Err(Trouble::Vertex(r));
                    }
                    faces.push([p, q, r]);
                    done.extend([(p, q), (q, r), (r, p)]);
                    for (x, y) in [(q, r), (r, p)] {
                        self.kept.insert(edge_key(x, y));
                        if !on_rim.contains(&(x, y)) && !done.contains(&(y, x)) {
                            open.push((y, x));
                        }
                    }
                }
                Left::Crossing(t, above, below) => {
                    open.push((p, q));
                    points += 1;
                    if points > POINTS_MAX {
                        return Err(Trouble::TooMuch);
                    }
                    let mut flipper = Flipper::new(self, Target::Face(f));
                    flipper.work = FLIP_WORK;
                    if flipper.remove_edge(t, above, below, FLIP_LEVEL) {
                        flipper.keep();
                        continue;
                    }
                    self.pierce(f, above, below)?;
                }
            }
        }
        Ok(faces)
    }

    fn left_of(&mut self, f: [u32; 3], p: u32, q: u32) -> Result<Left, Trouble> {
        let around = find_edge(self, p, q)
            .and_then(|t| shell(self, t, p, q))
            .ok_or(Trouble::Broken("an edge of a facet is not there"))?;
        let n = around.ring.len();
        let side: Vec<f64> = around
            .ring
            .iter()
            .map(|&r| self.orient([f[0], f[1], f[2], r]))
            .collect();
        for i in 0..n {
            let j = (i + 1) % n;
            let (x, y) = (around.ring[i], around.ring[j]);
            if side[i] == 0.0 {
                // A reference off the plane tells left from right.
                let k = (0..n)
                    .find(|&k| side[k] != 0.0)
                    .ok_or(Trouble::Broken("a shell is flat"))?;
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
        Err(Trouble::Broken(
            "nothing lies on the left of a facet's edge",
        ))
    }

    /// Takes the edge `above below` away by a point of the facet near its crossing.
    fn pierce(&mut self, f: [u32; 3], above: u32, below: u32) -> Result<(), Trouble> {
        let around = find_edge(self, above, below)
            .and_then(|t| shell(self, t, above, below))
            .ok_or(Trouble::Broken("a crossing edge is on the hull"))?;
        if around.required {
            return Err(Trouble::Crossed([above, below, below]));
        }
        let outer = self.outer_faces(&around.tets);
        let (up, down) = (
            self.orient_fine([f[0], f[1], f[2], above]),
            self.orient_fine([f[0], f[1], f[2], below]),
        );
        let [a, b, c] = f.map(|v| self.position(v));
        let (x, y) = (self.position(above), self.position(below));
        let k = x + (y - x) * (up / (up - down)) - a;
        let (u, v) = (b - a, c - a);
        let n = u.cross(v);
        let share =
            |w: crate::geom::Point| (w.cross(v).dot(n) / n.dot(n), u.cross(w).dot(n) / n.dot(n));
        let (s, t) = share(k);
        // Room around the crossing: a fraction of the distance to the ring.
        let room = around
            .ring
            .iter()
            .map(|&r| self.position(r).distance(a + k))
            .fold(f64::INFINITY, f64::min)
            / u.length().max(v.length());
        for slack in [room * 0.02, room * 1e-4, room * 1e-7, 0.0] {
            let (s, t) = (
                super::chain::shortest(s, slack),
                super::chain::shortest(t, slack),
            );
            if s <= 0.0 || t <= 0.0 || s + t >= 1.0 {
                continue;
            }
            let exact = ExactPoint::combination(a, &[(b, s), (c, t)]);
            if self.star(&around.tets, &outer, exact).is_some() {
                return Ok(());
            }
        }
        for slack in [room * 0.1, room * 1e-3, 0.0] {
            let (s, t) = (
                super::chain::shortest(s, slack),
                super::chain::shortest(t, slack),
            );
            if s > 0.0 && t > 0.0 && s + t < 1.0 {
                let exact = ExactPoint::combination(a, &[(b, s), (c, t)]);
                if self.star_grown(&around.tets, exact).is_some() {
                    return Ok(());
                }
            }
        }
        Err(Trouble::Precision("in a facet"))
    }
}
