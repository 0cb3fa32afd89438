//! Flips towards a target: 2-3 flips and edge removal, one inside the other.
//!
//! ```text
//!         d                   Edge removal: the tetrahedra around c d are replaced by the triangles of
//!        /|\                  a triangulation of the ring r0 r1 ... joined to c and to d. All
//!     r0--+--r2   ring        triangulations are searched by dynamic programming (G. T. Klincsek,
//!        \|/                  "Minimal triangulations of polygonal domains", 1980) over the exact
//!         c                   condition that every new tetrahedron is positive.
//! ```
//! If no triangulation of a ring is valid, an edge that joins it to `c` or `d` and stands in the way is removed first,
//! down to a given level. Steps without success are undone.

use super::complex::TetComplex;
use super::polygon::triangulate;
use super::target::RecoveryTarget;
use super::walk::{EdgeRing, edge_at, find_edge, shell};
use crate::mesh::FaceRef;
use crate::mesh::anatomy::EDGES;

/// Larger rings are left alone: the search is cubic.
const RING_MAX: usize = 20;

/// A line that crosses more than this is not worth flipping for.
pub(super) const CROSSINGS_MAX: usize = 400;

/// One replacement, with the data to undo it.
struct Done {
    old: Vec<u32>,
    quads: Vec<[u32; 4]>,
    shapes: Vec<u32>,
}

/// A surgeon for one target after another.
pub(super) struct Flipper<'a, S: TetComplex> {
    pub s: &'a mut S,
    pub target: RecoveryTarget,
    log: Vec<Done>,
    /// Ring searches left for this target.
    pub work: u32,
    /// A segment that crosses more is left alone.
    pub crossings_max: usize,
    /// Replacements that lasted.
    pub flips: u64,
}

impl<'a, S: TetComplex> Flipper<'a, S> {
    pub fn new(s: &'a mut S, target: RecoveryTarget) -> Self {
        Self { s, target, log: Vec::new(), work: 0, crossings_max: CROSSINGS_MAX, flips: 0 }
    }

    /// Makes everything done so far final.
    pub fn keep(&mut self) {
        self.flips += self.log.len() as u64;
        self.log.clear();
    }

    /// A mark for [`Flipper::undo`].
    pub fn mark(&self) -> usize {
        self.log.len()
    }

    fn apply(&mut self, old: Vec<u32>, new: &[[u32; 4]]) {
        let quads = old.iter().map(|&t| self.s.tet(t).vertices()).collect();
        let shapes = self.s.replace(&old, new);
        self.log.push(Done { old, quads, shapes });
    }

    /// Undoes the replacements after `mark`, ids included.
    pub fn undo(&mut self, mark: usize) {
        while self.log.len() > mark {
            let done = self.log.pop().expect("longer than the mark");
            let back = self.s.replace(&done.shapes, &done.quads);
            assert_eq!(back, done.old, "ids are reused last freed first");
        }
    }

    /// Replaces a face by the edge between its two apexes, where that is valid and allowed.
    pub fn flip_face(&mut self, face: FaceRef) -> bool {
        let (t, across) = (face.tet(), self.s.across(face.tet(), face.face()));
        let tet = self.s.tet(t);
        if !across.exists() || tet.is_required(face.face()) {
            return false;
        }
        let [p, q, r] = tet.face(face.face());
        let h = tet.vertex(face.face());
        let e = self.s.tet(across.tet()).vertex(across.face());
        let new = [[p, q, e, h], [q, r, e, h], [r, p, e, h]];
        if new.iter().any(|&n| self.s.orient(n) <= 0.0) {
            return false;
        }
        let target = self.target;
        let clear = [p, q, r].into_iter().all(|x| target.allows_edge(self.s, h, e, [x, x]));
        if clear {
            self.apply(vec![t, across.tet()], &new);
        }
        clear
    }

    /// Removes the edge `c d` of `t`, with help from edges around it down to `level`.
    pub fn remove_edge(&mut self, t: u32, c: u32, d: u32, level: u32) -> bool {
        if self.work == 0 || self.s.protects(c, d) {
            return false;
        }
        self.work -= 1;
        let Some(mut around) = shell(self.s, t, c, d) else {
            return false;
        };
        if around.required {
            return false;
        }
        if self.triangulate_ring(&around, c, d) {
            return true;
        }
        if level == 0 {
            return false;
        }
        let mark = self.log.len();
        'smaller: loop {
            for (t, u, r) in self.in_the_way(&around, c, d) {
                if self.work == 0 {
                    break;
                }
                let before = self.log.len();
                let Some(t) = edge_at(self.s, t, u, r) else {
                    continue;
                };
                if !self.remove_edge(t, u, r, level - 1) {
                    continue;
                }
                let Some(t) = find_edge(self.s, c, d) else {
                    return true;
                };
                match shell(self.s, t, c, d) {
                    Some(now) if self.triangulate_ring(&now, c, d) => return true,
                    Some(now) if now.ring.len() < around.ring.len() => {
                        around = now;
                        continue 'smaller;
                    }
                    _ => self.undo(before),
                }
                let Some(now) = find_edge(self.s, c, d).and_then(|t| shell(self.s, t, c, d)) else {
                    return false;
                };
                around = now;
            }
            break;
        }
        self.undo(mark);
        false
    }

    /// Edges from `c` or `d` to the ring beyond which the neighbors on the ring see each other.
    fn in_the_way(&mut self, around: &EdgeRing, c: u32, d: u32) -> Vec<(u32, u32, u32)> {
        let n = around.ring.len();
        let mut found = Vec::new();
        for i in 0..n {
            let (x, r, y) =
                (around.ring[(i + n - 1) % n], around.ring[i], around.ring[(i + 1) % n]);
            if x == y {
                continue;
            }
            // Positive on all three means that x y crosses the face c d r.
            if self.s.orient([r, d, y, x]) <= 0.0 {
                found.push((around.tets[i], d, r));
            }
            if self.s.orient([c, r, y, x]) <= 0.0 {
                found.push((around.tets[i], c, r));
            }
        }
        found
    }

    /// Returns whether two corners of the ring, not side by side, can be cut off, as every triangulation of four or more does.
    ///
    /// Most rings have none: looking at `n` triangles saves the search over `n` cubed.
    fn has_two_ears(&mut self, ring: &[u32], c: u32, d: u32) -> bool {
        let n = ring.len();
        let mut ears: Vec<usize> = Vec::new();
        for i in 0..n {
            let [x, y, z] = [n - 1, 0, 1].map(|k| ring[(i + k) % n]);
            if self.s.orient([x, y, z, d]) > 0.0 && self.s.orient([y, x, z, c]) > 0.0 {
                ears.push(i);
            }
            // Among three ears in a ring of four or more, two are not adjacent.
            if n == 3 || ears.len() == 3 {
                break;
            }
        }
        match ears[..] {
            [] => false,
            [_] => n == 3,
            [i, j] => j - i > 1 && j - i < n - 1,
            _ => true,
        }
    }

    /// Replaces the shell by the best valid, allowed triangulation of its ring.
    fn triangulate_ring(&mut self, around: &EdgeRing, c: u32, d: u32) -> bool {
        let ring = &around.ring;
        let n = ring.len();
        if !(3..=RING_MAX).contains(&n) {
            return false;
        }
        if !self.has_two_ears(ring, c, d) {
            return false;
        }
        let target = self.target;
        let s = std::cell::RefCell::new(&mut *self.s);
        let found = triangulate(
            n,
            |i, j| target.allows_edge(*s.borrow_mut(), ring[i], ring[j], [c, d]),
            |i, k, j| shape(*s.borrow_mut(), target, [ring[i], ring[k], ring[j]], c, d),
        );
        let Some(triangles) = found else {
            return false;
        };
        let new: Vec<[u32; 4]> = triangles
            .into_iter()
            .map(|t| t.map(|i| ring[i]))
            .flat_map(|[x, y, z]| [[x, y, z, d], [y, x, z, c]])
            .collect();
        self.apply(around.tets.clone(), &new);
        true
    }
}

/// The worse of the two tetrahedra over a ring triangle: volume over cubed edge; 0 when it may not be.
fn shape<S: TetComplex>(
    s: &mut S,
    target: RecoveryTarget,
    [x, y, z]: [u32; 3],
    c: u32,
    d: u32,
) -> f64 {
    let up = s.orient([x, y, z, d]);
    if up <= 0.0 {
        return 0.0;
    }
    let down = s.orient([y, x, z, c]);
    if down <= 0.0 || !target.allows_face(s, [x, y, z]) {
        return 0.0;
    }
    let p = [x, y, z, c, d].map(|v| s.position(v));
    let longest = EDGES
        .iter()
        .map(|&[i, j]| p[i].distance_squared(p[j]))
        .fold(p[4].distance_squared(p[0]), f64::max);
    let scale = longest * longest.sqrt();
    // A positive volume counts however small it is.
    (up.min(down) / scale).max(f64::MIN_POSITIVE)
}
