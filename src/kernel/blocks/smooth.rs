//! Smoothing of a region towards an optimal Delaunay triangulation, and the flips that follow.
//!
//! As [`optimize`](crate::optimize) does it, on arrays. The vertices of the block's own bricks move; those of the margin do when their
//! own block is smoothed.

use super::flat::FlatMesh;
use super::lawson::{ACTIVE, Lawson};
use super::region::Region;
use super::side_by_side::{Corners, N, reach, volume_and_center};
use crate::mesh::anatomy::FACES;
use tetdb_base::geom::{Point, orient};

/// Sweeps at least. Three do for the quality in the end, but leave vertices so restless that interfaces, which are smoothed once more,
/// show: Kolmogorov distance of qualities 0.026 instead of 0.008. They cost a hundredth of a run.
const SWEEPS: u32 = 5;
/// Sweeps at most.
const SWEEPS_MAX: u32 = 7;
/// Where the last sweep made more flips than this share of the tetrahedra, another follows.
const RESTLESS: f64 = 0.02;
/// Longest move in units of h.
const MOVE_MAX: f64 = 0.3;
/// Error of a volume in units of the product of three sums of coordinates: 8 roundings of 2⁻⁵³, ten times.
const VOLUME_BOUND: f64 = 1e-14;
/// Volumes below may have underflowed on the way.
const VOLUME_MIN: f64 = 1e-250;

/// Scratch of smoothing.
pub(super) struct Smoother {
    lawson: Lawson,
    terms: Box<Terms>,
    /// Vertices that move.
    moves: Vec<bool>,
    active: Vec<u32>,
    /// Per vertex: weighted sum of the centers around it, seen from it, and the weight.
    sums: Vec<[f64; 4]>,
    /// Where each vertex was, and how often it may still be taken back.
    old: Vec<(Point, u8)>,
    list: Vec<u32>,
}

struct Terms {
    corners: Corners,
    sizes: [f64; N],
    centers: [[f64; N]; 12],
    weights: [f64; N],
    vertices: [[u32; 4]; N],
}

impl Smoother {
    pub fn new() -> Self {
        let terms = Terms {
            corners: Corners::new(),
            sizes: [1.0; N],
            centers: [[0.0; N]; 12],
            weights: [0.0; N],
            vertices: [[0; 4]; N],
        };
        Self {
            lawson: Lawson::new(),
            terms: Box::new(terms),
            moves: Vec::new(),
            active: Vec::new(),
            sums: Vec::new(),
            old: Vec::new(),
            list: Vec::new(),
        }
    }

    /// Smooths the vertices of the bricks for which `is_own` holds. Returns flips done.
    pub fn smooth(&mut self, region: &mut Region, is_own: &[bool]) -> u64 {
        self.find_moving(region, is_own);
        let mesh = &mut region.mesh;
        self.lawson.flips = 0;
        for sweep in 1..=SWEEPS_MAX {
            self.find_active(mesh);
            self.add_up(mesh);
            self.displace(mesh);
            self.restore(mesh);
            let before = self.lawson.flips;
            self.lawson.sweep(mesh, &self.active);
            let flips = self.lawson.flips - before;
            if sweep >= SWEEPS && flips as f64 <= RESTLESS * self.active.len() as f64 {
                break;
            }
        }
        for t in 0..mesh.tets.len() as u32 {
            if mesh.tet(t).is_live() {
                mesh.clear_mark(t, ACTIVE);
            }
        }
        self.lawson.flips
    }

    fn find_moving(&mut self, region: &Region, is_own: &[bool]) {
        region.held_vertices(&mut self.moves);
        let mesh = &region.mesh;
        for ((moves, vertex), &brick) in
            self.moves.iter_mut().zip(&mesh.vertices).zip(&region.brick_of)
        {
            let is_held = *moves;
            *moves = !is_held && !vertex.is_fixed() && is_own[brick as usize];
        }
        for tet in mesh.tets.iter().filter(|tet| tet.is_live()) {
            for (i, face) in FACES.into_iter().enumerate() {
                if tet.is_required(i) {
                    for k in face {
                        self.moves[tet.vertex(k) as usize] = false;
                    }
                }
            }
        }
    }

    /// Lists and marks the tetrahedra with a vertex that moves.
    fn find_active(&mut self, mesh: &mut FlatMesh) {
        self.active.clear();
        for t in 0..mesh.tets.len() as u32 {
            let tet = *mesh.tet(t);
            if !tet.is_live() {
                continue;
            }
            if tet.vertices().iter().any(|&v| self.moves[v as usize]) {
                mesh.set_mark(t, ACTIVE);
                self.active.push(t);
            } else {
                mesh.clear_mark(t, ACTIVE);
            }
        }
    }

    fn add_up(&mut self, mesh: &FlatMesh) {
        self.sums.clear();
        self.sums.resize(mesh.vertices.len(), [0.0; 4]);
        for tets in self.active.chunks(N) {
            self.terms.load(mesh, tets);
            self.terms.compute();
            for k in 0..tets.len() {
                for (i, &v) in self.terms.vertices[k].iter().enumerate() {
                    let sum = &mut self.sums[v as usize];
                    sum[0] += self.terms.centers[3 * i][k];
                    sum[1] += self.terms.centers[3 * i + 1][k];
                    sum[2] += self.terms.centers[3 * i + 2][k];
                    sum[3] += self.terms.weights[k];
                }
            }
        }
    }

    fn displace(&mut self, mesh: &mut FlatMesh) {
        self.old.clear();
        self.old.resize(mesh.vertices.len(), (Point::ZERO, 0));
        for (v, &moves) in self.moves.iter().enumerate() {
            let [x, y, z, weight] = self.sums[v];
            let mut shift = Point::new(x, y, z) / (2.0 * weight);
            if !moves || weight <= 0.0 || !shift.is_finite() {
                continue;
            }
            let vertex = &mut mesh.vertices[v];
            let (h, length) = (f64::from(vertex.h()), shift.length());
            if h > 0.0 && length > MOVE_MAX * h {
                shift *= MOVE_MAX * h / length;
            }
            self.old[v] = (vertex.point, 2);
            vertex.point += shift;
        }
    }

    /// Takes vertices back until every tetrahedron is exactly positive; where all were taken back it is, as before.
    fn restore(&mut self, mesh: &mut FlatMesh) {
        let active = std::mem::take(&mut self.active);
        for tets in active.chunks(N) {
            self.terms.load(mesh, tets);
            let doubtful = self.terms.volumes();
            for (&t, _) in tets.iter().zip(&doubtful).filter(|(_, is_doubtful)| **is_doubtful) {
                self.list.push(t);
                self.take_back(mesh);
            }
        }
        self.active = active;
    }

    fn take_back(&mut self, mesh: &mut FlatMesh) {
        while let Some(t) = self.list.pop() {
            let tet = *mesh.tet(t);
            let [a, b, c, d] = mesh.points(&tet);
            if orient(a, b, c, d) > 0.0 {
                continue;
            }
            for v in tet.vertices() {
                let (old, left) = self.old[v as usize];
                if left == 0 {
                    continue;
                }
                let point = &mut mesh.vertices[v as usize].point;
                *point = if left == 2 { (*point + old) * 0.5 } else { old };
                self.old[v as usize].1 = left - 1;
                ball(mesh, v, t, &mut self.list);
            }
        }
    }
}

/// Appends the tetrahedra around `v`, one of which is `t`.
fn ball(mesh: &FlatMesh, v: u32, t: u32, list: &mut Vec<u32>) {
    let from = list.len();
    list.push(t);
    let mut next = from;
    while let Some(&t) = list.get(next) {
        next += 1;
        let tet = mesh.tet(t);
        for (i, across) in tet.neighbor.into_iter().enumerate() {
            if tet.vertex(i) != v && across.exists() && !list[from..].contains(&across.tet()) {
                list.push(across.tet());
            }
        }
    }
}

impl Terms {
    #[inline(always)]
    fn load(&mut self, mesh: &FlatMesh, tets: &[u32]) {
        for (k, &t) in tets.iter().enumerate() {
            let tet = mesh.tet(t);
            let mut sizes = 0.0;
            for (i, vertex) in mesh.corners(tet).into_iter().enumerate() {
                self.corners.set(k, i, vertex.point);
                sizes += f64::from(vertex.h());
            }
            self.sizes[k] = sizes;
            self.vertices[k] = tet.vertices();
        }
    }

    /// Volume times center, seen from each corner, over the cube of the size.
    #[inline(never)]
    fn compute(&mut self) {
        for k in 0..N {
            let size = self.sizes[k];
            let weight = if size > 0.0 { 64.0 / (size * size * size) } else { 1.0 };
            let edges = self.corners.edges(k);
            let (det, center) = volume_and_center(edges);
            let (det, center) = (det * weight, center * weight);
            self.weights[k] = det;
            // Seen from another corner, the center is nearer by that corner's position.
            let [u, v, w] = edges.map(|edge| center - edge * (2.0 * det));
            for (i, own) in [center, u, v, w].into_iter().enumerate() {
                self.centers[3 * i][k] = own.x;
                self.centers[3 * i + 1][k] = own.y;
                self.centers[3 * i + 2][k] = own.z;
            }
        }
    }

    /// Whether doubles leave it open that a tetrahedron is positive.
    #[inline(never)]
    fn volumes(&self) -> [bool; N] {
        let mut doubtful = [false; N];
        for (k, doubtful) in doubtful.iter_mut().enumerate() {
            let [u, v, w] = self.corners.edges(k);
            let det = u.dot(v.cross(w));
            let bound = VOLUME_BOUND * reach(u) * reach(v) * reach(w) + VOLUME_MIN;
            *doubtful = det.is_nan() | (det <= bound);
        }
        doubtful
    }
}
