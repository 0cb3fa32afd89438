//! Flips until no face is left that is not locally Delaunay and can be flipped.
//!
//! Each flip strictly lowers the mesh lifted to the paraboloid, so the work ends. It may end at a face whose
//! union of two tetrahedra is not convex in a way no 3-2 or 4-4 flip resolves; those stay and are counted.
//! Required faces are neither tested nor changed.
//!
//! Source: C. L. Lawson, "Properties of n-dimensional triangulations" (1986); B. Joe, "Construction of
//! three-dimensional Delaunay triangulations using local transformations" (1991).

use super::pages::Way;
use super::sphere::Sphere;
use crate::mesh::anatomy::{EDGE_OF, FACES};
use crate::mesh::{FaceRef, Mesh, Scan, Tet, scan_parts, tets_of_page};
use crate::reconnect::{FaceSwap, Forced, RingTriangulation, Shell, remove_edge};
use tetdb_base::geom::{Point, orient};
use tetdb_base::storage::{Pages, check_cancelled};

/// Flips done and faces met that could not be flipped (some of them later could).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LawsonStats {
    /// Faces replaced by an edge: two tetrahedra became three.
    pub flips_23: u64,
    /// Edges replaced by a face: three tetrahedra became two.
    pub flips_32: u64,
    /// Edges with four tetrahedra replaced by another edge with four.
    pub flips_44: u64,
    /// Faces that could not be flipped.
    pub stuck: u64,
}

/// Pages looked at before the first of their flips. The mesh depends on it.
const BATCH_PAGES: usize = 32;

/// Lists the tetrahedra of a page with a face to a larger id that is not locally Delaunay.
struct Suspicious;

impl Scan for Suspicious {
    type Part = u32;
    type Output = Vec<u32>;

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, &page: &u32) -> Vec<u32> {
        let mut block = Block::default();
        tets_of_page(mesh, page, |mesh, t, tet| {
            block.add(mesh, t, &tet);
            if block.tets.len() == BLOCK {
                block.test(mesh);
            }
        });
        block.test(mesh);
        block.found
    }
}

/// Tetrahedra whose faces are listed before any is tested: what lies across is far apart in memory, and tests that follow each other
/// without a branch between them wait for it together.
const BLOCK: usize = 64;

/// Some tetrahedra of a page, and their faces to be tested.
struct Block {
    tets: Vec<(u32, Sphere)>,
    /// Places in `tets` and what lies across.
    faces: [(u32, FaceRef); 4 * BLOCK + 1],
    n_faces: usize,
    found: Vec<u32>,
}

impl Default for Block {
    fn default() -> Self {
        Self {
            tets: Vec::with_capacity(BLOCK),
            faces: [(0, FaceRef::NONE); 4 * BLOCK + 1],
            n_faces: 0,
            found: Vec::new(),
        }
    }
}

impl Block {
    #[inline(always)]
    fn add<P: Pages>(&mut self, mesh: &mut Mesh<P>, t: u32, tet: &Tet) {
        for i in 0..4 {
            let across = tet.neighbor[i];
            let tested = across.exists() && !tet.is_required(i) && across.tet() >= t;
            self.faces[self.n_faces] = (self.tets.len() as u32, across);
            self.n_faces += usize::from(tested);
        }
        self.tets.push((t, Sphere::new(mesh.points(tet))));
    }

    #[inline(always)]
    fn test<P: Pages>(&mut self, mesh: &mut Mesh<P>) {
        for &(at, across) in &self.faces[..self.n_faces] {
            let (t, sphere) = &self.tets[at as usize];
            let q = mesh.apex(across);
            let q = mesh.point(q);
            let corners = || {
                let tet = mesh.tet(*t);
                mesh.points(&tet)
            };
            if sphere.has_inside(q, corners) && self.found.last() != Some(t) {
                self.found.push(*t);
            }
        }
        self.tets.clear();
        self.n_faces = 0;
    }
}

/// Scratch of the restoration.
#[derive(Default)]
pub(super) struct Lawson {
    /// Tetrahedra whose faces are suspicious.
    stack: Vec<u32>,
    shell: Shell,
    triangulation: RingTriangulation,
    new: Vec<u32>,
    pub(super) stats: LawsonStats,
}

impl Lawson {
    /// One pass over all faces, batch by batch of pages: what is suspicious before any flip of the batch is looked at
    /// again in order, and each flip is followed up at once.
    pub(super) fn sweep<P: Pages>(&mut self, mesh: &mut Mesh<P>, way: Way) {
        let pages: Vec<u32> = way.tet_pages(mesh).collect();
        for batch in pages.chunks(BATCH_PAGES) {
            check_cancelled();
            for t in scan_parts(mesh, batch, &Suspicious).into_iter().flatten() {
                self.stack.push(t);
                while let Some(t) = self.stack.pop() {
                    let tet = mesh.tet(t);
                    if tet.is_live() {
                        self.check(mesh, t, &tet);
                    }
                }
            }
        }
    }

    /// Tests the faces of `t` and flips at the first that can be.
    fn check<P: Pages>(&mut self, mesh: &mut Mesh<P>, t: u32, tet: &Tet) {
        let p = mesh.points(tet);
        let sphere = Sphere::new(p);
        for i in 0..4 {
            if !tet.neighbor[i].exists() || tet.is_required(i) {
                continue;
            }
            let q = mesh.apex(tet.neighbor[i]);
            let q = mesh.point(q);
            if sphere.has_inside(q, || p) && self.flip(mesh, t, tet, p, i, q) {
                return;
            }
        }
    }

    /// Flips face `i` of `t`, whose other side's vertex is at `q`; `false` when it cannot be.
    fn flip<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        t: u32,
        tet: &Tet,
        points: [Point; 4],
        i: usize,
        q: Point,
    ) -> bool {
        let face = FACES[i];
        let p = points[i];
        // Volume signs of (p, q, edge) per edge of the face: the face sees p q pass on its inner side.
        let side = |k: usize| {
            let (x, y) = (points[face[k]], points[face[(k + 1) % 3]]);
            orient(p, q, x, y)
        };
        let sides = [side(0), side(1), side(2)];
        if sides.iter().all(|&s| s > 0.0) {
            let Some(swap) = FaceSwap::gather_from(mesh, FaceRef::new(t, i), tet) else {
                return false;
            };
            let new = swap.apply(mesh);
            self.stack.extend(new);
            self.stats.flips_23 += 1;
            return true;
        }
        let mut outer = (0..3).filter(|&k| sides[k] <= 0.0);
        let (Some(k), None) = (outer.next(), outer.next()) else {
            self.stats.stuck += 1;
            return false;
        };
        let edge = EDGE_OF[face[k]][face[(k + 1) % 3]];
        let n = if sides[k] < 0.0 { 3 } else { 4 };
        if self.remove(mesh, t, tet, edge, n, tet.vertex(i)) {
            return true;
        }
        self.stats.stuck += 1;
        false
    }

    /// Removes an edge whose ring has exactly `n` vertices: 3-2, or 4-4 with the diagonal from p to q.
    fn remove<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        t: u32,
        tet: &Tet,
        edge: usize,
        n: usize,
        apex: u32,
    ) -> bool {
        let shell = &mut self.shell;
        if !shell.gather_from(mesh, t, tet, edge, n)
            || !shell.closed
            || shell.required
            || shell.n_ring() != n
        {
            return false;
        }
        let mut ring = [Point::ZERO; 4];
        for (point, &v) in ring.iter_mut().zip(&shell.ring) {
            *point = mesh.point(v);
        }
        let (a, b) = (mesh.point(shell.a), mesh.point(shell.b));
        let cone = |i: usize, j: usize, k: usize| {
            let above = orient(ring[i], ring[j], ring[k], b);
            let below = orient(a, ring[i], ring[j], ring[k]);
            if above > 0.0 && below > 0.0 { 1.0 } else { f64::NEG_INFINITY }
        };
        let forced = if n == 3 {
            Forced::Nothing
        } else {
            // `apex` is p, the vertex of `t` off the face; q is two steps from it in the ring.
            if shell.ring[0] == apex { Forced::Diagonal(0, 2) } else { Forced::Diagonal(1, 3) }
        };
        if !self.triangulation.solve(n, 0.0, forced, cone) {
            return false;
        }
        remove_edge(mesh, &self.shell, &self.triangulation, &mut self.new);
        self.stack.extend_from_slice(&self.new);
        if n == 3 {
            self.stats.flips_32 += 1;
        } else {
            self.stats.flips_44 += 1;
        }
        true
    }
}
