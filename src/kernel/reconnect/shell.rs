//! All tetrahedra around an edge.

use crate::mesh::anatomy::EDGES;
use crate::mesh::{Mesh, Tet};
use tetdb_base::geom::Point;
use tetdb_base::storage::Pages;

/// `COMPLETE[i][j] = [k, l]` such that `i j k l` is an even permutation of `0 1 2 3`.
const COMPLETE: [[[u8; 2]; 4]; 4] = [
    [[0, 0], [2, 3], [3, 1], [1, 2]],
    [[3, 2], [0, 0], [0, 3], [2, 0]],
    [[1, 3], [3, 0], [0, 0], [0, 1]],
    [[2, 1], [0, 2], [1, 0], [0, 0]],
];

/// The shell of edge a b, copied out of the mesh; its buffers are meant to be used again.
///
/// ```text
///        b
///       /|\          tets[i] = (a, b, ring[i], ring[i + 1]), positive:
///      / | \         seen from b the ring turns counter-clockwise
///  r_i --+-- r_i+1
///      \ | /         closed: n tetrahedra, n ring vertices, the last meets the first
///       \|/          open:   n tetrahedra, n + 1 ring vertices, hull faces at both ends
///        a
/// ```
#[derive(Clone, Debug, Default)]
pub struct Shell {
    /// Id of one end of the edge.
    pub a: u32,
    /// Id of the other end.
    pub b: u32,
    /// Indices of the tetrahedra around the edge, in order.
    pub tets: Vec<u32>,
    /// Parallel to `tets`.
    pub records: Vec<Tet>,
    /// Parallel to `tets`: local numbers of a, b, `ring[i]`, `ring[i + 1]`.
    pub locals: Vec<[u8; 4]>,
    /// Ids of the vertices around the edge, in order.
    pub ring: Vec<u32>,
    /// True if the tetrahedra go all the way around.
    pub closed: bool,
    /// True if some face a b `ring[i]` is required.
    pub required: bool,
}

impl Shell {
    /// Gathers the tetrahedra around edge `e` of `t`; `false` when there are more than `tets_max` (nothing usable is left then).
    ///
    /// The first tetrahedron of a closed shell is `t`. An open one starts at its hull face.
    #[inline]
    pub fn gather<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        t: u32,
        e: usize,
        tets_max: usize,
    ) -> bool {
        let record = mesh.tet(t);
        self.gather_from(mesh, t, &record, e, tets_max)
    }

    /// [`Shell::gather`] for a caller with the record of `t`.
    pub fn gather_from<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        t: u32,
        record: &Tet,
        e: usize,
        tets_max: usize,
    ) -> bool {
        self.tets.clear();
        self.records.clear();
        self.locals.clear();
        self.ring.clear();
        let [i, j] = EDGES[e];
        let [k, l] = COMPLETE[i][j];
        (self.a, self.b) = (record.vertex(i), record.vertex(j));
        self.push(t, record, [i as u8, j as u8, k, l]);
        self.closed = false;
        self.required = record.is_required(k as usize) || record.is_required(l as usize);
        // Onward through the face opposite ring[i].
        let (mut at, mut leave) = (*record, usize::from(k));
        loop {
            let across = at.neighbor[leave];
            if !across.exists() {
                break;
            }
            if across.tet() == t {
                self.closed = true;
                break;
            }
            if self.tets.len() == tets_max {
                return false;
            }
            at = mesh.tet(across.tet());
            let last = across.face();
            let (a, b) = self.ends(&at, across.tet());
            let [x, y] = COMPLETE[a][b];
            // The vertex opposite the entered face comes last; the other is shared with the tetrahedron before.
            let first = if usize::from(x) == last { y } else { x };
            leave = usize::from(first);
            self.required |= at.is_required(leave);
            let locals = [a as u8, b as u8, first, last as u8];
            self.push(across.tet(), &at, locals);
        }
        self.ring
            .extend((self.records.iter().zip(&self.locals)).map(|(r, l)| r.vertex(l[2].into())));
        self.closed || self.gather_backward(mesh, tets_max)
    }

    /// The other half of an open shell: backward from the first tetrahedron, put in front.
    #[cold]
    fn gather_backward<P: Pages>(&mut self, mesh: &mut Mesh<P>, tets_max: usize) -> bool {
        let end = self.records.len() - 1;
        let last = self.records[end].vertex(self.locals[end][3].into());
        self.ring.push(last);
        let (mut at, mut leave) = (self.records[0], usize::from(self.locals[0][3]));
        let n_before = self.tets.len();
        loop {
            let across = at.neighbor[leave];
            if !across.exists() {
                break;
            }
            if self.tets.len() == tets_max {
                return false;
            }
            at = mesh.tet(across.tet());
            let first = across.face();
            let (a, b) = self.ends(&at, across.tet());
            let [x, y] = COMPLETE[a][b];
            let shared = if usize::from(x) == first { y } else { x };
            leave = usize::from(shared);
            self.required |= at.is_required(leave);
            let locals = [a as u8, b as u8, first as u8, shared];
            self.push(across.tet(), &at, locals);
            self.ring.push(at.vertex(first));
        }
        let n_added = self.tets.len() - n_before;
        self.tets[n_before..].reverse();
        self.records[n_before..].reverse();
        self.locals[n_before..].reverse();
        self.tets.rotate_right(n_added);
        self.records.rotate_right(n_added);
        self.locals.rotate_right(n_added);
        let n_ring = self.ring.len();
        self.ring[n_ring - n_added..].reverse();
        self.ring.rotate_right(n_added);
        true
    }

    /// Ring vertices.
    #[inline]
    pub fn n_ring(&self) -> usize {
        self.ring.len()
    }

    /// Positions of a, b and of the ring's vertices (in `ring_points`).
    pub fn points<P: Pages>(
        &self,
        mesh: &mut Mesh<P>,
        ring_points: &mut Vec<Point>,
    ) -> (Point, Point) {
        ring_points.clear();
        for &v in &self.ring {
            ring_points.push(mesh.point(v));
        }
        (mesh.point(self.a), mesh.point(self.b))
    }

    #[inline]
    fn push(&mut self, t: u32, record: &Tet, locals: [u8; 4]) {
        self.tets.push(t);
        self.records.push(*record);
        self.locals.push(locals);
    }

    #[inline]
    fn ends(&self, at: &Tet, t: u32) -> (usize, usize) {
        match (at.local(self.a), at.local(self.b)) {
            (Some(a), Some(b)) => (a, b),
            _ => panic!(
                "tetrahedron {t} {:?} is a neighbor around edge {} {} but does not have it",
                at.vertices(),
                self.a,
                self.b
            ),
        }
    }
}
