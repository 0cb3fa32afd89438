//! A missing segment becomes a chain of edges through points that lie on it exactly.
//!
//! ```text
//!   a ----- x1 ------ x2 --- b      where the line from the last vertex leaves its ball through a face
//!      face      edge               (or an edge), the two tetrahedra of the face (the shell of the edge)
//!                                   see a whole open piece of the line: a point of it joins their outer
//!                                   faces, and the edge to the last vertex is there.
//! ```
//! Each point takes one crossed part away and adds none, so the number of points is bounded by that of crossings.

use super::exact::ExactPoint;
use super::find::Outcome;
use super::flips::Flipper;
use super::patch::Patch;
use super::space::{Space, edge_key};
use super::target::Target;
use super::walk::{Exit, exit_vertex, shell};
use crate::store::Pages;

/// Points on one segment.
const POINTS_MAX: usize = 2000;
/// Flips are tried before each point, to this depth and effort.
const FLIP_LEVEL: u32 = 1;
const FLIP_WORK: u32 = 60;

/// Why a patch could not be finished.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Trouble {
    /// A vertex of the surface lies on the segment or facet.
    Vertex(u32),
    /// A required face is crossed.
    Crossed([u32; 3]),
    /// No double (or exact combination) lies in the room left.
    Precision(&'static str),
    /// More points or steps than allowed.
    TooMuch,
    /// A case that valid input cannot produce.
    Broken(&'static str),
}

impl<P: Pages> Patch<'_, P> {
    /// Makes the segment `a b` a chain of edges; returns its vertices from `a` to `b`.
    pub(super) fn chain(&mut self, a: u32, b: u32) -> Result<Vec<u32>, Trouble> {
        let mut chain = vec![a];
        while chain.len() < POINTS_MAX {
            let h = *chain.last().expect("starts with a");
            let mut flipper = Flipper::new(self, Target::Edge(h, b));
            flipper.work = FLIP_WORK;
            let flipped = flipper.recover_edge(h, b, FLIP_LEVEL);
            let next = match exit_vertex(self, h, b) {
                Exit::Reached(_) => b,
                Exit::Vertex(v) if self.is_steiner(v) => v,
                Exit::Vertex(v) => return Err(Trouble::Vertex(v)),
                Exit::Lost => return Err(Trouble::Broken("a segment leaves the mesh")),
                Exit::Face(face) => {
                    let tet = self.tet(face.tet());
                    if tet.is_required(face.face()) {
                        return Err(Trouble::Crossed(tet.face(face.face())));
                    }
                    let beyond = self.across(face.tet(), face.face());
                    self.split(a, b, &[face.tet(), beyond.tet()])?
                }
                Exit::Edge { tet, c, d } => {
                    let Some(around) = shell(self, tet, c, d) else {
                        return Err(Trouble::Broken("a crossed edge is on the hull"));
                    };
                    if around.required {
                        return Err(Trouble::Crossed([c, d, d]));
                    }
                    self.split(a, b, &around.tets)?
                }
            };
            debug_assert!(next == b || flipped != Outcome::Recovered);
            self.kept.insert(edge_key(h, next));
            chain.push(next);
            if next == b {
                return Ok(chain);
            }
        }
        Err(Trouble::TooMuch)
    }

    /// Puts a point of the segment `a b` into the cavity, near the middle of the piece that sees all of it.
    fn split(&mut self, a: u32, b: u32, cavity: &[u32]) -> Result<u32, Trouble> {
        let outer = self.outer_faces(cavity);
        let (mut low, mut high) = (0.0f64, 1.0f64);
        for (tet, i) in &outer {
            let mut q = tet.vertices();
            q[*i] = a;
            let at_a = self.orient_fine(q);
            q[*i] = b;
            let at_b = self.orient_fine(q);
            let t = at_a / (at_a - at_b);
            if at_b > at_a {
                low = low.max(t);
            } else if at_b < at_a {
                high = high.min(t);
            }
        }
        let (pa, pb) = (self.position(a), self.position(b));
        let width = high - low;
        for share in [0.5, 0.4, 0.6, 0.25, 0.75, 0.1, 0.9] {
            let t = low + width * share;
            for t in [shortest(t, width * 0.1), t] {
                let exact = ExactPoint::combination(pa, &[(pb, t)]);
                if let Some(x) = self.star(cavity, &outer, exact) {
                    return Ok(x);
                }
            }
        }
        // No room in doubles: a point farther on, in a cavity that grows to be seen.
        let middle = low + width * 0.5;
        for step in [1e-12, 1e-9, 1e-7, 1e-5, 1e-4, 1e-3, 1e-2, 0.1] {
            for t in [middle + step, middle - step] {
                if t <= 0.0 || t >= 1.0 {
                    continue;
                }
                let t = shortest(t, step * 0.1);
                let exact = ExactPoint::combination(pa, &[(pb, t)]);
                if let Some(x) = self.star_grown(cavity, exact) {
                    return Ok(x);
                }
            }
        }
        Err(Trouble::Precision("on a segment"))
    }
}

/// A number with few bits within `slack` of `t`: sums and products of it stay short.
pub(super) fn shortest(t: f64, slack: f64) -> f64 {
    let mut scale = 16.0;
    while scale < 1e15 {
        let rounded = (t * scale).round() / scale;
        if (rounded - t).abs() <= slack {
            return rounded;
        }
        scale *= 16.0;
    }
    t
}
