//! Flips in a region until no face is left that is not locally Delaunay and can be flipped.
//!
//! As [`optimize`](crate::optimize) does it, but spheres of many tetrahedra are found side by side, in loops that compilers turn into
//! vector instructions.

use tetdb_schema::page::NONE;

use super::flat::{EMPTY, FlatMesh};
use super::side_by_side::{Corners, N, reach, reach_of, volume_and_center};
use crate::mesh::anatomy::mark::{EXAMINED, STAYS};
use crate::mesh::anatomy::{FACES, MARK, REQUIRED};
use crate::mesh::{FaceRef, Tet};
use tetdb_base::geom::{Point, insphere, orient};

/// Tetrahedra tested before the first of their flips. The mesh depends on it.
const BATCH: usize = 16_384;
/// Error of the test in units of L⁴ E and of L³ E², with sums of coordinates for L and E: see `optimize/sphere.rs`, whose largest
/// coordinates are no greater.
const BOUND_CORNERS: f64 = 1.1e-13;
const BOUND_POINT: f64 = 3.6e-14;
/// Outside these differences products can underflow or overflow.
const DIFFERENCES: std::ops::Range<f64> = 1e-58..1e58;

/// Mark of tetrahedra whose faces are tested.
pub(super) const ACTIVE: usize = STAYS;

/// Spheres side by side.
struct Spheres {
    corners: Corners,
    normal: [[f64; N]; 3],
    det: [f64; N],
    reach: [f64; N],
    tets: [u32; N],
    n: usize,
    /// Faces to be tested: place of the tetrahedron, and the face beyond.
    faces: [(u32, FaceRef); 4 * N + 1],
    n_faces: usize,
}

/// Scratch of the restoration.
pub(super) struct Lawson {
    spheres: Box<Spheres>,
    found: Vec<u32>,
    stack: Vec<u32>,
    /// Flips done.
    pub flips: u64,
}

impl Lawson {
    pub fn new() -> Self {
        let spheres = Spheres {
            corners: Corners::new(),
            normal: [[0.0; N]; 3],
            det: [0.0; N],
            reach: [0.0; N],
            tets: [0; N],
            n: 0,
            faces: [(0, FaceRef::NONE); 4 * N + 1],
            n_faces: 0,
        };
        Self { spheres: Box::new(spheres), found: Vec::new(), stack: Vec::new(), flips: 0 }
    }

    /// Tests the faces of the listed tetrahedra, which bear the mark [`ACTIVE`], and flips.
    pub fn sweep(&mut self, mesh: &mut FlatMesh, active: &[u32]) {
        for batch in active.chunks(BATCH) {
            let mut found = std::mem::take(&mut self.found);
            found.clear();
            for tets in batch.chunks(N) {
                self.spheres.load(mesh, tets);
                self.spheres.compute();
                self.spheres.test(mesh, &mut found);
            }
            for &t in &found {
                self.stack.push(t);
                while let Some(t) = self.stack.pop() {
                    let tet = *mesh.tet(t);
                    if tet.is_live() && !mesh.is_held(t) {
                        self.check(mesh, t, &tet);
                    }
                }
            }
            self.found = found;
        }
    }

    /// Tests the faces of `t` and flips at the first that can be.
    fn check(&mut self, mesh: &mut FlatMesh, t: u32, tet: &Tet) {
        let [a, b, c, d] = mesh.points(tet);
        for (i, across) in tet.neighbor.into_iter().enumerate() {
            if tet.is_required(i) || !across.exists() {
                continue;
            }
            let q = mesh.apex(across);
            if insphere(a, b, c, d, mesh.point(q)) > 0.0 && self.flip(mesh, t, tet, i, q) {
                self.flips += 1;
                return;
            }
        }
    }

    /// Flips face `i` of `t`, beyond which is vertex `q`; `false` when it cannot be.
    fn flip(&mut self, mesh: &mut FlatMesh, t: u32, tet: &Tet, i: usize, q: u32) -> bool {
        let other = tet.neighbor[i].tet();
        if mesh.is_held(other) {
            return false;
        }
        let face = tet.face(i);
        let p = tet.vertex(i);
        let at = |v: u32| mesh.point(v);
        // Volume signs of (p, q, edge) per edge of the face: the face sees p q pass on its inner side.
        let side = |k: usize| orient(at(p), at(q), at(face[k]), at(face[(k + 1) % 3]));
        let sides = [side(0), side(1), side(2)];
        if sides.iter().all(|&s| s > 0.0) {
            let [a, b, c] = face;
            self.replace(mesh, &[t, other], &[[p, q, a, b], [p, q, b, c], [p, q, c, a]]);
            return true;
        }
        let mut outer = (0..3).filter(|&k| sides[k] <= 0.0);
        let (Some(k), None) = (outer.next(), outer.next()) else {
            return false;
        };
        let (x, y, z) = (face[k], face[(k + 1) % 3], face[(k + 2) % 3]);
        let n = if sides[k] < 0.0 { 3 } else { 4 };
        let Some((tets, r)) = ring(mesh, t, [x, y], [p, z, q], n) else {
            return false;
        };
        if n == 3 {
            let (above, below) =
                (orient(at(p), at(z), at(q), at(x)), orient(at(p), at(z), at(q), at(y)));
            let new = match () {
                () if above > 0.0 && below < 0.0 => [[p, z, q, x], [z, p, q, y]],
                () if above < 0.0 && below > 0.0 => [[z, p, q, x], [p, z, q, y]],
                () => return false,
            };
            self.replace(mesh, &tets[..3], &new);
            return true;
        }
        // The ring is p z q r; the new diagonal joins p and q.
        let quarters = [[p, z, q, x], [p, z, q, y], [q, r, p, x], [q, r, p, y]];
        let signs = quarters.map(|[a, b, c, d]| orient(at(a), at(b), at(c), at(d)));
        let first = signs[0].signum();
        let is_good = |s: f64, wanted: f64| s * wanted > 0.0;
        if signs[0] == 0.0
            || !is_good(signs[1], -first)
            || !is_good(signs[2], first)
            || !is_good(signs[3], -first)
        {
            return false;
        }
        let turned = |k: usize| {
            let [a, b, c, d] = quarters[k];
            if signs[k] > 0.0 { [a, b, c, d] } else { [b, a, c, d] }
        };
        self.replace(mesh, &tets, &[turned(0), turned(1), turned(2), turned(3)]);
        true
    }

    /// Replaces tetrahedra by others that fill the same space.
    fn replace(&mut self, mesh: &mut FlatMesh, old: &[u32], new: &[[u32; 4]]) {
        let mut outer = [([NONE; 3], FaceRef::NONE, 0u32); 12];
        let mut n_outer = 0;
        for &t in old {
            let tet = mesh.tet(t);
            for (i, across) in tet.neighbor.into_iter().enumerate() {
                if !across.exists() || !old.contains(&across.tet()) {
                    outer[n_outer] = (sorted(tet.face(i)), across, tet.node[i] & REQUIRED);
                    n_outer += 1;
                }
            }
        }
        let like = mesh.attributes[old[0] as usize];
        let mut ids = [NONE; 4];
        for (k, id) in ids.iter_mut().enumerate().take(new.len()) {
            *id = if k < old.len() { old[k] } else { mesh.take(like) };
        }
        for &t in old.iter().skip(new.len()) {
            mesh.give_back(t);
        }
        let mut inner = [([NONE; 3], FaceRef::NONE); 12];
        let mut n_inner = 0;
        for (&node, &t) in new.iter().zip(&ids) {
            mesh.tets[t as usize] = Tet { node, ..EMPTY };
            mesh.set_mark(t, EXAMINED);
        }
        for (&node, &t) in new.iter().zip(&ids) {
            for (i, corners) in FACES.into_iter().enumerate() {
                let key = sorted(corners.map(|k| node[k]));
                let this = FaceRef::new(t, i);
                if let Some(&(_, across, required)) = outer[..n_outer].iter().find(|f| f.0 == key) {
                    let tet = &mut mesh.tets[t as usize];
                    tet.neighbor[i] = across;
                    tet.node[i] |= required;
                    mesh.set_neighbor(across, this);
                } else if let Some(&(_, across)) = inner[..n_inner].iter().find(|f| f.0 == key) {
                    mesh.tets[t as usize].neighbor[i] = across;
                    mesh.set_neighbor(across, this);
                } else {
                    inner[n_inner] = (key, this);
                    n_inner += 1;
                }
            }
            self.stack.push(t);
        }
    }
}

/// The `n` tetrahedra around an edge, the first two of which are `t`, with `p` and `z`, and its neighbor, with `z` and `q`; and the fourth
/// vertex around it, if there is one. `None` unless there are exactly `n`, no face between them is required and none is held.
fn ring(
    mesh: &FlatMesh,
    t: u32,
    [x, y]: [u32; 2],
    [p, z, q]: [u32; 3],
    n: usize,
) -> Option<([u32; 4], u32)> {
    let tet = mesh.tet(t);
    if tet.is_required(tet.local(z)?) {
        return None;
    }
    let mut tets = [t, NONE, NONE, NONE];
    let (mut current, mut from, mut to) = (tet.neighbor[tet.local(p)?].tet(), z, q);
    let mut fourth = NONE;
    for k in 1.. {
        let tet = mesh.tet(current);
        if mesh.is_held(current) {
            return None;
        }
        tets[k] = current;
        debug_assert!([x, y, from, to].iter().all(|&v| tet.local(v).is_some()));
        let i = tet.local(from)?;
        if tet.is_required(i) {
            return None;
        }
        let across = tet.neighbor[i];
        if across.tet() == t {
            return (k + 1 == n).then_some((tets, fourth));
        }
        if k + 1 >= n {
            return None;
        }
        let next = mesh.apex(across);
        if next != p {
            if fourth != NONE {
                return None;
            }
            fourth = next;
        }
        (current, from, to) = (across.tet(), to, next);
    }
    None
}

#[inline(always)]
fn sorted([a, b, c]: [u32; 3]) -> [u32; 3] {
    let (low, high) = (a.min(b), a.max(b));
    [low.min(c), low.max(c.min(high)), high.max(c)]
}

impl Spheres {
    #[inline(always)]
    fn load(&mut self, mesh: &FlatMesh, tets: &[u32]) {
        (self.n, self.n_faces) = (0, 0);
        for &t in tets {
            let tet = mesh.tet(t);
            if !tet.is_live() {
                continue;
            }
            let at = self.n;
            for (i, vertex) in mesh.corners(tet).into_iter().enumerate() {
                self.corners.set(at, i, vertex.point);
                let across = tet.neighbor[i];
                self.faces[self.n_faces] = (at as u32, across);
                self.n_faces += usize::from(!tet.is_required(i) & across.exists());
            }
            self.tets[at] = t;
            self.n += 1;
        }
    }

    #[inline(never)]
    fn compute(&mut self) {
        for k in 0..N {
            let edges = self.corners.edges(k);
            let (det, normal) = volume_and_center(edges);
            self.det[k] = det;
            self.normal[0][k] = normal.x;
            self.normal[1][k] = normal.y;
            self.normal[2][k] = normal.z;
            self.reach[k] = reach_of(edges);
        }
    }

    /// Lists the tetrahedra with a face to test that is not locally Delaunay.
    #[inline(always)]
    fn test(&mut self, mesh: &FlatMesh, found: &mut Vec<u32>) {
        for &(at, across) in &self.faces[..self.n_faces] {
            let k = at as usize;
            let other = mesh.tet(across.tet());
            // Of two active ones the first looks.
            if across.tet() < self.tets[k] && other.node[ACTIVE] & MARK != 0 {
                continue;
            }
            let q = mesh.point(other.vertex(across.face()));
            let from = q - self.corners.corner(k, 0);
            let normal = Point::new(self.normal[0][k], self.normal[1][k], self.normal[2][k]);
            let power = from.dot(from) * self.det[k] - from.dot(normal);
            let (l, m) = (self.reach[k], reach(from));
            let bound = l * l * l * m * (BOUND_CORNERS * l + BOUND_POINT * m);
            let is_sure =
                power.abs() > bound && DIFFERENCES.contains(&l) && DIFFERENCES.contains(&m);
            if is_sure && power > 0.0 {
                continue;
            }
            let t = self.tets[k];
            let is_inside = is_sure || {
                let [a, b, c, d]: [Point; 4] = mesh.points(mesh.tet(t));
                insphere(a, b, c, d, q) > 0.0
            };
            if is_inside && found.last() != Some(&t) {
                found.push(t);
            }
        }
    }
}
