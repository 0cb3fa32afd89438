//! Finds segments and facets in the mesh, and recovers a missing one.

use super::complex::TetComplex;
use super::flips::{CROSSINGS_MAX, Flipper};
use super::target::RecoveryTarget;
use super::walk::{Exit, crossings, edge_at, find_edge, opposite, shell};
use crate::mesh::FaceRef;
use tetdb_base::geom::IdSet;

/// State of facet `a b c` in the mesh.
#[derive(Clone, Debug)]
pub(super) enum SearchResult {
    /// The facet is this face.
    Face(FaceRef),
    /// Edge `a b` is there, the face is not; the tetrahedron whose inside it enters from that edge, if one.
    Edge(Option<u32>),
    Nothing,
}

/// Looks for the face `a b c` around its edge `a b`.
pub(super) fn find_face<S: TetComplex>(s: &mut S, [a, b, c]: [u32; 3]) -> SearchResult {
    let Some(t) = find_edge(s, a, b) else {
        return SearchResult::Nothing;
    };
    let mut at = t;
    loop {
        let tet = s.tet(at);
        let Some((x, y)) = opposite(&tet, a, b) else {
            return SearchResult::Nothing;
        };
        if tet.vertex(x) == c {
            return SearchResult::Face(FaceRef::new(at, y));
        }
        if tet.vertex(y) == c {
            return SearchResult::Face(FaceRef::new(at, x));
        }
        let across = s.across(at, x);
        at = across.tet();
        if at == t || !across.exists() {
            break;
        }
    }
    let Some(around) = shell(s, t, a, b) else {
        return SearchResult::Edge(None);
    };
    let n = around.ring.len();
    let entered = (0..n).find(|&i| {
        let (x, y) = (around.ring[i], around.ring[(i + 1) % n]);
        s.orient([a, b, x, c]) > 0.0 && s.orient([a, b, c, y]) > 0.0
    });
    SearchResult::Edge(entered.map(|i| around.tets[i]))
}

/// The edges that cross facet `f`, whose own edges all exist; starts in `t`, which it cuts.
pub(super) fn crossing_edges<S: TetComplex>(
    s: &mut S,
    f: [u32; 3],
    t: u32,
    n_max: usize,
) -> Option<Vec<(u32, u32, u32)>> {
    let mut seen: IdSet<u32> = IdSet::from_iter([t]);
    let mut cut = vec![t];
    let mut edges: Vec<(u32, u32, u32)> = Vec::new();
    let mut known: IdSet<(u32, u32)> = IdSet::default();
    let mut next = 0;
    while next < cut.len() {
        let at = cut[next];
        next += 1;
        let tet = s.tet(at);
        let v = tet.vertices();
        let side = v.map(|v| if f.contains(&v) { 0.0 } else { s.orient([f[0], f[1], f[2], v]) });
        for i in 0..4 {
            for j in 0..4 {
                if side[i] > 0.0 && side[j] < 0.0 && known.insert((v[i], v[j])) {
                    edges.push((at, v[i], v[j]));
                }
            }
            let others = [1, 2, 3].map(|k| side[(i + k) & 3]);
            if others.iter().any(|&x| x > 0.0) && others.iter().any(|&x| x < 0.0) {
                let across = s.across(at, i);
                if across.exists() && seen.insert(across.tet()) {
                    cut.push(across.tet());
                }
            }
        }
        if edges.len() > n_max {
            return None;
        }
    }
    Some(edges)
}

/// Outcome of an attempt to recover one part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    Recovered,
    Stuck,
    /// A vertex lies on it.
    Touches(u32),
}

/// Additional ring searches that a segment may cost for each edge it crosses.
///
/// With 10 a disc of 200 corners, cut as a fan, is left to 9,800 points; with 40 surfaces with large flat parts spend
/// twice as long on flips.
const WORK_IN_PLANE: u32 = 20;

/// Neutral steps a target may take, beyond this many per part it crosses.
const NEUTRAL_MAX: usize = 3;

impl<S: TetComplex> Flipper<'_, S> {
    /// Flips until the edge `a b` exists.
    ///
    /// The number of parts it crosses falls with each step kept, except for a bounded number of neutral ones: in the
    /// plane of a facet, where the edge crosses a fan of others, each of those has to turn a few times.
    /// (S. W. Sloan, "A fast algorithm for generating constrained Delaunay triangulations", 1993.)
    pub(super) fn recover_edge(&mut self, a: u32, b: u32, level: u32) -> Outcome {
        let mut neutral = 0;
        let mut is_paid = false;
        loop {
            self.keep();
            let met = match crossings(self.s, a, b, self.crossings_max) {
                Ok(met) if met.is_empty() => return Outcome::Recovered,
                Ok(met) => met,
                Err(Exit::Vertex(v)) => return Outcome::Touches(v),
                Err(_) => return Outcome::Stuck,
            };
            if !is_paid {
                // In the plane of a facet each edge that is crossed turns a few times, and each time all are tried.
                let in_plane = met.iter().filter(|e| matches!(e, Exit::Edge { .. }));
                self.work += WORK_IN_PLANE * in_plane.count() as u32;
                is_paid = true;
            }
            // Attempts that are undone leave everything as it was, ids included.
            let mut edges: Vec<(u32, u32, u32)> = Vec::new();
            let mut turning: Vec<(u32, u32, u32)> = Vec::new();
            let mut flipped = false;
            for &exit in &met {
                match exit {
                    Exit::Face(face) => {
                        let tet = self.s.tet(face.tet());
                        if tet.is_required(face.face()) {
                            return Outcome::Stuck;
                        }
                        let [p, q, r] = tet.face(face.face());
                        let sides = [(p, q), (q, r), (r, p)];
                        edges.extend(sides.map(|(p, q)| (face.tet(), p.min(q), p.max(q))));
                        if self.flip_face(face) {
                            flipped = true;
                            break;
                        }
                    }
                    Exit::Edge { tet, c, d } => {
                        edges.push((tet, c.min(d), c.max(d)));
                        turning.push((tet, c, d));
                    }
                    _ => {}
                }
            }
            let mut tried: IdSet<(u32, u32)> = IdSet::default();
            for &(t, c, d) in &edges {
                if flipped || self.work == 0 {
                    break;
                }
                if tried.insert((c, d)) {
                    flipped =
                        edge_at(self.s, t, c, d).is_some_and(|t| self.remove_edge(t, c, d, level));
                }
            }
            if flipped {
                continue;
            }
            if self.work == 0 {
                return Outcome::Stuck;
            }
            let n = turning.len();
            let crossings_max = self.crossings_max;
            let steps_max = NEUTRAL_MAX * n;
            let before = met.len();
            let turned = (0..n).any(|k| {
                let (t, c, d) = turning[(neutral + k) % n];
                neutral < steps_max
                    && self.work > 0
                    && self.try_neutral(t, c, d, |s| {
                        crossings(s, a, b, crossings_max).is_ok_and(|met| met.len() <= before)
                    })
            });
            if !turned {
                return Outcome::Stuck;
            }
            neutral += 1;
        }
    }

    /// Flips until the face `f`, whose edges exist, is there.
    pub(super) fn recover_face(&mut self, f: [u32; 3], level: u32) -> Outcome {
        let mut neutral = 0;
        loop {
            self.keep();
            let t = match find_face(self.s, f) {
                SearchResult::Face(_) => return Outcome::Recovered,
                SearchResult::Edge(Some(t)) => t,
                _ => return Outcome::Stuck,
            };
            let Some(edges) = crossing_edges(self.s, f, t, CROSSINGS_MAX) else {
                return Outcome::Stuck;
            };
            let flipped = edges.iter().any(|&(t, c, d)| {
                self.work > 0
                    && edge_at(self.s, t, c, d).is_some_and(|t| self.remove_edge(t, c, d, level))
            });
            if flipped {
                continue;
            }
            if self.work == 0 {
                return Outcome::Stuck;
            }
            let n = edges.len();
            let turned = (0..n).any(|k| {
                let (t, c, d) = edges[(neutral + k) % n];
                neutral < NEUTRAL_MAX * n
                    && self.work > 0
                    && self.try_neutral(t, c, d, |s| match find_face(s, f) {
                        SearchResult::Face(_) => true,
                        SearchResult::Edge(Some(t)) => {
                            crossing_edges(s, f, t, n).is_some_and(|now| now.len() <= n)
                        }
                        _ => false,
                    })
            });
            if !turned {
                return Outcome::Stuck;
            }
            neutral += 1;
        }
    }

    /// Removes the edge `c d` without regard to crossings, if `good` accepts the result.
    fn try_neutral(&mut self, t: u32, c: u32, d: u32, good: impl Fn(&mut S) -> bool) -> bool {
        let Some(t) = edge_at(self.s, t, c, d) else {
            return false;
        };
        let mark = self.mark();
        let target = std::mem::replace(&mut self.target, RecoveryTarget::Free);
        let removed = self.remove_edge(t, c, d, 0);
        self.target = target;
        if removed && !good(self.s) {
            self.undo(mark);
            return false;
        }
        removed
    }
}
