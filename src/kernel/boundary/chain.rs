//! A missing segment becomes a chain of edges through points that lie on it exactly.
//!
//! ```text
//!   a ----- x1 ------ x2 --- b      where the line from the last vertex leaves its ball through a face
//!      face      edge               (or an edge), the two tetrahedra of the face (the shell of the edge)
//!                                   see a whole open piece of the line: a point of it joins their outer
//!                                   faces, and the edge to the last vertex is there.
//! ```
//! Each point takes one crossed part away and adds none, so the number of points is bounded by that of crossings.

use super::complex::{TetComplex, edge_key};
use super::exact::ExactPoint;
use super::find::Outcome;
use super::flips::Flipper;
use super::patch::RecoveryPatch;
use super::target::RecoveryTarget;
use super::walk::{Exit, exit_vertex, shell};
use tetdb_base::geom::Dyadic;
use tetdb_base::storage::Pages;

/// Points on one segment.
const POINTS_MAX: usize = 2000;
/// Fineness of places, in terms of some 50 bits: coordinates of doubles, divided, can differ by less than one term shows.
pub(super) const TERMS: [u32; 4] = [2, 4, 8, 16];

/// Reasons why a patch could not be finished.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PatchFailure {
    /// A vertex of the surface lies on the segment or facet.
    Vertex(u32),
    /// A required face is crossed.
    Crossed([u32; 3]),
    /// No double (or exact combination) lies in the open region left.
    Precision(&'static str),
    /// More points or steps than allowed.
    TooMuch,
    /// A case that valid input cannot produce.
    Broken(&'static str),
}

impl<P: Pages> RecoveryPatch<'_, P> {
    /// Makes the segment `a b` a chain of edges; returns its vertices from `a` to `b`.
    pub(super) fn chain(&mut self, a: u32, b: u32) -> Result<Vec<u32>, PatchFailure> {
        let mut chain = vec![a];
        while chain.len() < POINTS_MAX {
            let h = *chain.last().expect("starts with a");
            // Flips are tried before each point.
            let effort = self.effort;
            let mut flipper = Flipper::new(self, RecoveryTarget::Edge(h, b));
            flipper.work = effort.flip_work;
            let flipped = flipper.recover_edge(h, b, effort.flip_level);
            let next = match exit_vertex(self, h, b) {
                Exit::Reached(_) => b,
                Exit::Vertex(v) if self.is_steiner(v) => v,
                Exit::Vertex(v) => return Err(PatchFailure::Vertex(v)),
                Exit::Lost => return Err(PatchFailure::Broken("a segment leaves the mesh")),
                Exit::Face(face) => {
                    let tet = self.tet(face.tet());
                    if tet.is_required(face.face()) {
                        return Err(PatchFailure::Crossed(tet.face(face.face())));
                    }
                    let beyond = self.across(face.tet(), face.face());
                    self.split(a, b, &[face.tet(), beyond.tet()])?
                }
                Exit::Edge { tet, c, d } => {
                    let Some(around) = shell(self, tet, c, d) else {
                        return Err(PatchFailure::Broken("a crossed edge is on the hull"));
                    };
                    if around.required {
                        return Err(PatchFailure::Crossed([c, d, d]));
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
        Err(PatchFailure::TooMuch)
    }

    /// Puts a point of the segment `a b` into the cavity, near the middle of the piece that sees all of it.
    ///
    /// If that piece is shorter than the effort's limit, a point farther on is tried first, in a cavity that grows
    /// until the point sees all of it: a point with too little clearance here would have none either when it leaves the
    /// surface.
    fn split(&mut self, a: u32, b: u32, cavity: &[u32]) -> Result<u32, PatchFailure> {
        let outer = self.outer_faces(cavity);
        let at: Vec<[Dyadic; 2]> = outer
            .iter()
            .map(|(tet, i)| {
                [a, b].map(|end| {
                    let mut q = tet.vertices();
                    q[*i] = end;
                    self.orient_exact(q)
                })
            })
            .collect();
        let (pa, pb) = (self.position(a), self.position(b));
        let mut grown = false;
        for terms in TERMS {
            let Some((low, width)) = seen_piece(&at, terms) else {
                continue;
            };
            if !grown && width.estimate() < self.effort.piece_min {
                grown = true;
                let middle = low.estimate();
                for step in [1e-12, 1e-9, 1e-7, 1e-5, 1e-4, 1e-3, 1e-2, 0.1] {
                    for t in [middle + step, middle - step] {
                        if t <= 0.0 || t >= 1.0 {
                            continue;
                        }
                        let t = Dyadic::from(t).shortened(&Dyadic::from(step * 0.1));
                        let exact = ExactPoint::combination(pa, &[(pb, &t)]);
                        if let Some(x) = self.star_grown(cavity, [a, b, b], exact) {
                            return Ok(x);
                        }
                    }
                }
            }
            let slack = width.times(&Dyadic::from(0.03125));
            for share in [self.effort.lean, 0.5, 0.375, 0.625, 0.25, 0.75, 0.125, 0.875] {
                let t = low.plus(&width.times(&Dyadic::from(share)));
                let exact = ExactPoint::combination(pa, &[(pb, &t.shortened(&slack))]);
                if let Some(x) = self.star(cavity, &outer, [a, b, b], exact) {
                    return Ok(x);
                }
            }
        }
        Err(PatchFailure::Precision("doubles leave no place on its edges"))
    }
}

/// The part of the segment that sees all faces from inside, as start and length in shares of the segment.
///
/// `at` has the volumes of each face with both ends; `terms` is the precision of divisions.
fn seen_piece(at: &[[Dyadic; 2]], terms: u32) -> Option<(Dyadic, Dyadic)> {
    let (mut low, mut high) = (Dyadic::from(0.0), Dyadic::from(1.0));
    for [at_a, at_b] in at {
        let fall = at_a.minus(at_b);
        let Some(t) = at_a.over(&fall, terms) else {
            continue;
        };
        if fall.sign() < 0 && t.compare(&low).is_gt() {
            low = t;
        } else if fall.sign() > 0 && t.compare(&high).is_lt() {
            high = t;
        }
    }
    let width = high.minus(&low);
    (width.sign() > 0).then_some((low, width))
}
