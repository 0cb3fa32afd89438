//! Insertion of one point into plain arrays.
//!
//! The cavity is the one that [`delaunay`](crate::delaunay) gathers; what differs is how. Each tetrahedron is turned so that the face
//! through which it was entered comes first; its three other faces share six cross products, and the volumes they make with the
//! point come for nothing.

use super::flat::FlatMesh;
use crate::mesh::anatomy::mark::{IN_CAVITY, STAYS};
use crate::mesh::anatomy::{FACES, MARK, REQUIRED};
use crate::mesh::{FaceRef, Tet};
use tetdb_base::geom::{Point, in_sphere_perturbed, larger, orient};

/// Relative error of a sphere determinant seen from the point, in units of the fifth power of the longest difference.
///
/// Four products of a square and a 3×3 determinant, whose six monomials sum to at most √27 times the cube of the
/// length; at most 20 roundings of 2⁻⁵³ on the way to each: 4.7e-14. Twenty times that.
const SPHERE_BOUND: f64 = 1e-12;
/// The same for a volume: √27 times the cube, at most 8 roundings: 4.7e-15.
const VOLUME_BOUND: f64 = 1e-13;
/// Squares of lengths outside may overflow or underflow on the way to a fifth power: exact signs decide there.
const SQUARES: std::ops::Range<f64> = 1e-110..1e110;

/// A walk longer than this is lost.
const STEPS_MAX: u32 = 100_000;
/// Larger cavities are refused: nothing in a block needs one.
const CAVITY_MAX: usize = 8_000;
/// Bits of a vertex's number in a cavity; see [`Inserter::turn`].
const LOCAL_BITS: u32 = 10;
const LOCALS_MAX: u32 = 1 << LOCAL_BITS;
/// The table of links has this many bits for each end of an edge in most cavities.
const SMALL_BITS: u32 = 7;

/// An outer face of a cavity.
#[derive(Clone, Copy)]
pub(super) struct OuterFace {
    /// Counter-clockwise seen from outside.
    pub vertices: [u32; 3],
    outside: FaceRef,
    inside: FaceRef,
    pub required: bool,
}

/// Reason why a point is not inserted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Refusal {
    /// A vertex is too near.
    Near,
    /// Its place is not to be changed.
    OutOfPlace,
    /// The cavity holds a tetrahedron frozen beside an interface.
    Frozen,
    /// No cavity keeps the required faces, or the walk met one.
    Blocked,
    /// The cavity or the walk leads out of the arrays: a neighbor has to do it.
    PutOff,
}

/// Scratch of insertion.
pub(super) struct Inserter {
    cavity: Vec<u32>,
    entries: Vec<FaceRef>,
    faces: Vec<OuterFace>,
    /// The vertex that each tetrahedron of the cavity brought in.
    apexes: Vec<u32>,
    /// Outer faces that the point does not see from inside.
    blind: Vec<u32>,
    suspects: Vec<u32>,
    locals: Vec<[u16; 3]>,
    n_locals: u32,
    links: Vec<u16>,
    new_tets: Vec<u32>,
    /// Number of the cavity. A vertex's note is this, then its number in the cavity.
    turn: u32,
    random: u32,
}

/// End of a walk.
pub(super) struct WalkEnd {
    pub tet: u32,
    pub record: Tet,
}

impl Inserter {
    pub fn new() -> Self {
        Self {
            cavity: Vec::new(),
            entries: Vec::new(),
            faces: Vec::new(),
            apexes: Vec::new(),
            blind: Vec::new(),
            suspects: Vec::new(),
            locals: Vec::new(),
            n_locals: 0,
            links: vec![0; 1 << (2 * SMALL_BITS)],
            new_tets: Vec::new(),
            turn: 0,
            random: 1,
        }
    }

    /// Makes ready for other arrays: nothing that follows depends on what was before. The notes of all vertices must be 0.
    pub fn restart(&mut self) {
        self.turn = 0;
        self.random = 1;
    }

    /// Tetrahedra made by the last [`Inserter::fill`].
    pub fn new_tets(&self) -> &[u32] {
        &self.new_tets
    }

    /// Outer faces of the gathered cavity.
    pub fn faces(&self) -> &[OuterFace] {
        &self.faces
    }

    /// Tetrahedra of the gathered cavity.
    pub fn cavity(&self) -> &[u32] {
        &self.cavity
    }

    /// The tetrahedron that holds `p`, walking from `hint`.
    pub fn locate(&mut self, mesh: &FlatMesh, p: Point, hint: u32) -> Result<WalkEnd, Refusal> {
        let mut tet = hint;
        let mut record = *mesh.tet(tet);
        if !record.is_live() {
            return Err(Refusal::Blocked);
        }
        let mut points = mesh.points(&record);
        let mut entry = usize::MAX;
        for _ in 0..STEPS_MAX {
            let mut exit = None;
            for k in 0..4 {
                let i = (self.random as usize + k) & 3;
                let [a, b, c] = FACES[i];
                if i != entry && orient(p, points[a], points[b], points[c]) < 0.0 {
                    exit = Some(i);
                    break;
                }
            }
            self.random = self.random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            self.random ^= self.random >> 17;
            let Some(i) = exit else {
                return Ok(WalkEnd { tet, record });
            };
            let across = record.neighbor[i];
            if !across.exists() {
                let out = if record.is_required(i) { Refusal::Blocked } else { Refusal::PutOff };
                return Err(out);
            }
            tet = across.tet();
            record = *mesh.tet(tet);
            points = mesh.points(&record);
            entry = across.face();
        }
        Err(Refusal::Blocked)
    }

    /// Marks the cavity of `p` and lists its outer faces, each seen by `p` from inside. Either [`Inserter::fill`] or
    /// [`Inserter::discard`] must follow.
    ///
    /// `is_near` is asked about the vertices met on the way, with the square of their distance. On errors nothing stays marked.
    pub fn gather(
        &mut self,
        mesh: &mut FlatMesh,
        p: Point,
        start: &WalkEnd,
        is_near: impl Fn(&FlatMesh, u32, f64) -> bool,
    ) -> Result<(), Refusal> {
        self.cavity.clear();
        self.entries.clear();
        self.faces.clear();
        self.apexes.clear();
        self.blind.clear();
        mesh.set_mark(start.tet, IN_CAVITY);
        self.cavity.push(start.tet);
        self.entries.push(FaceRef::new(start.tet, 0));
        let mut next = 0;
        while let Some(&entry) = self.entries.get(next) {
            let found = self.expand(mesh, p, entry, next == 0, &is_near);
            next += 1;
            if let Err(refusal) = found {
                self.discard(mesh);
                return Err(refusal);
            }
        }
        let shrunk = !self.blind.is_empty();
        if shrunk && !self.shrink(mesh, p, start.tet) || !self.number(mesh, start) {
            self.discard(mesh);
            return Err(Refusal::Blocked);
        }
        Ok(())
    }

    /// Looks across the faces of the tetrahedron entered at `entry`.
    #[inline(always)]
    fn expand(
        &mut self,
        mesh: &mut FlatMesh,
        p: Point,
        entry: FaceRef,
        is_first: bool,
        is_near: &impl Fn(&FlatMesh, u32, f64) -> bool,
    ) -> Result<(), Refusal> {
        let (t, e) = (entry.tet(), entry.face());
        if mesh.is_held(t) {
            return Err(Refusal::PutOff);
        }
        let tet = *mesh.tet(t);
        // An even permutation that brings the face of entry to 0.
        let node = [tet.node[e], tet.node[1 ^ e], tet.node[2 ^ e], tet.node[3 ^ e]];
        let across =
            [tet.neighbor[e], tet.neighbor[1 ^ e], tet.neighbor[2 ^ e], tet.neighbor[3 ^ e]];
        let turned = Tet { node, neighbor: across };
        // What lies across comes from afar: all of it is asked for before any is needed.
        let (mut apex, mut pending, mut inner) = ([0u32; 4], 0u32, 0u32);
        for i in 0..4 {
            let is_open = node[i] & REQUIRED == 0 && across[i].exists();
            let face = if is_open { across[i] } else { FaceRef::new(t, 0) };
            let other = mesh.tet(face.tet());
            apex[i] = other.vertex(face.face());
            let is_marked = other.node[IN_CAVITY] & MARK != 0;
            inner |= u32::from(is_open & is_marked) << i;
            pending |= u32::from(is_open & !is_marked) << i;
        }
        let [a, b, c, d] = mesh.points(&turned);
        let q = [a - p, b - p, c - p, d - p];
        let squares = [q[0].dot(q[0]), q[1].dot(q[1]), q[2].dot(q[2]), q[3].dot(q[3])];
        let longest = larger(larger(squares[0], squares[1]), larger(squares[2], squares[3]));
        let (c01, c02, c03) = (q[0].cross(q[1]), q[0].cross(q[2]), q[0].cross(q[3]));
        let (c12, c13, c23) = (q[1].cross(q[2]), q[1].cross(q[3]), q[2].cross(q[3]));
        // Of face (f, g, h): f, and the products g×h, h×f, f×g.
        let products = [
            ([1, 2, 3], c23, -c13, c12),
            ([0, 3, 2], -c23, -c02, c03),
            ([0, 1, 3], c13, -c03, c01),
            ([0, 2, 1], -c12, -c01, c02),
        ];
        for (i, ([f, g, h], gh, hf, fg)) in
            products.into_iter().enumerate().skip(usize::from(!is_first))
        {
            if inner >> i & 1 != 0 {
                continue;
            }
            let volume = q[f].dot(gh);
            if pending >> i & 1 != 0 {
                let beyond = mesh.point(apex[i]) - p;
                let square = beyond.dot(beyond);
                let normal = gh * squares[f] + hf * squares[g] + fg * squares[h];
                let det = square * volume - beyond.dot(normal);
                let l = larger(longest, square);
                let is_sure = det.abs() > SPHERE_BOUND * (l * l * l.sqrt()) && SQUARES.contains(&l);
                let is_inside =
                    if is_sure { det < 0.0 } else { is_in_conflict(mesh, across[i].tet(), p) };
                if is_inside {
                    let other = across[i].tet();
                    mesh.set_mark(other, IN_CAVITY);
                    self.cavity.push(other);
                    self.entries.push(across[i]);
                    if is_near(mesh, apex[i], square) {
                        return Err(Refusal::Near);
                    }
                    self.apexes.push(apex[i]);
                    continue;
                }
            }
            let bound = VOLUME_BOUND * (longest * longest.sqrt());
            let is_sure = volume > bound && SQUARES.contains(&longest);
            let corners = [a, b, c, d];
            if !is_sure && orient(p, corners[f], corners[g], corners[h]) <= 0.0 {
                self.blind.push(self.faces.len() as u32);
            }
            self.faces.push(OuterFace {
                vertices: [turned.vertex(f), turned.vertex(g), turned.vertex(h)],
                outside: across[i],
                inside: FaceRef::new(t, i ^ e),
                required: node[i] & REQUIRED != 0,
            });
        }
        if self.cavity.len() > CAVITY_MAX { Err(Refusal::Blocked) } else { Ok(()) }
    }

    /// Takes tetrahedra out of the cavity until `p` sees all its faces from inside; `false` when `first` goes too.
    #[cold]
    fn shrink(&mut self, mesh: &mut FlatMesh, p: Point, first: u32) -> bool {
        self.suspects.clear();
        for &k in &self.blind {
            let inside = self.faces[k as usize].inside.tet();
            if mesh.is_marked(inside, IN_CAVITY) {
                mesh.clear_mark(inside, IN_CAVITY);
                self.suspects.push(inside);
            }
        }
        while let Some(gone) = self.suspects.pop() {
            let tet = *mesh.tet(gone);
            for (i, across) in tet.neighbor.into_iter().enumerate() {
                if !across.exists()
                    || tet.is_required(i)
                    || !mesh.is_marked(across.tet(), IN_CAVITY)
                {
                    continue;
                }
                // Seen from the other side, where it is an outer face now.
                let [a, b, c] = tet.face(i).map(|v| mesh.point(v));
                if orient(p, a, c, b) <= 0.0 {
                    mesh.clear_mark(across.tet(), IN_CAVITY);
                    self.suspects.push(across.tet());
                }
            }
        }
        if !mesh.is_marked(first, IN_CAVITY) {
            return false;
        }
        self.flood_again(mesh, first);
        true
    }

    /// Keeps the tetrahedra still connected to `first`; lists the outer faces again.
    fn flood_again(&mut self, mesh: &mut FlatMesh, first: u32) {
        let before = std::mem::take(&mut self.cavity);
        self.faces.clear();
        self.apexes.clear();
        mesh.clear_mark(first, IN_CAVITY);
        mesh.set_mark(first, STAYS);
        self.cavity.push(first);
        let mut next = 0;
        while next < self.cavity.len() {
            let tet = *mesh.tet(self.cavity[next]);
            next += 1;
            for (i, across) in tet.neighbor.into_iter().enumerate() {
                if across.exists() && !tet.is_required(i) && mesh.is_marked(across.tet(), IN_CAVITY)
                {
                    mesh.clear_mark(across.tet(), IN_CAVITY);
                    mesh.set_mark(across.tet(), STAYS);
                    self.cavity.push(across.tet());
                }
            }
        }
        for &t in &before {
            mesh.clear_mark(t, IN_CAVITY);
        }
        for &t in &self.cavity {
            let tet = *mesh.tet(t);
            self.apexes.extend(tet.vertices());
            for (i, outside) in tet.neighbor.into_iter().enumerate() {
                let required = tet.is_required(i);
                if required || !mesh.is_marked(outside.tet(), STAYS) {
                    let inside = FaceRef::new(t, i);
                    self.faces.push(OuterFace { vertices: tet.face(i), outside, inside, required });
                }
            }
        }
        for &t in &self.cavity {
            mesh.clear_mark(t, STAYS);
            mesh.set_mark(t, IN_CAVITY);
        }
    }

    /// Numbers the vertices of the outer faces; `false` when these make no sphere, or a vertex would lose its last tetrahedron.
    fn number(&mut self, mesh: &mut FlatMesh, start: &WalkEnd) -> bool {
        self.turn += 1;
        assert!(self.turn < 1 << (32 - LOCAL_BITS), "a block has fewer candidates");
        let tag = self.turn << LOCAL_BITS;
        let mask = LOCALS_MAX - 1;
        let mut n = 0;
        self.locals.clear();
        for face in &self.faces {
            let mut local = [0u16; 3];
            for (local, v) in local.iter_mut().zip(face.vertices) {
                let note = &mut mesh.vertices[v as usize].note;
                if *note & !mask != tag {
                    if n == mask {
                        return false;
                    }
                    *note = tag | n;
                    n += 1;
                }
                *local = (*note & mask) as u16;
            }
            self.locals.push(local);
        }
        self.n_locals = n;
        let is_outer = |v: &u32| mesh.vertices[*v as usize].note & !mask == tag;
        // A ball has 2 n - 4 faces on n vertices; anything else is pinched or has a hole.
        self.faces.len() + 4 == 2 * n as usize
            && start.record.vertices().iter().all(is_outer)
            && self.apexes.iter().all(is_outer)
    }

    /// Takes the marks back; the mesh is as before gathering.
    pub fn discard(&mut self, mesh: &mut FlatMesh) {
        for &t in &self.cavity {
            mesh.clear_mark(t, IN_CAVITY);
        }
        self.cavity.clear();
        self.faces.clear();
    }

    /// Replaces the gathered cavity by the tetrahedra that join vertex `v` to its outer faces.
    pub fn fill(&mut self, mesh: &mut FlatMesh, v: u32) {
        let like = mesh.attributes[self.cavity[0] as usize];
        let n = self.faces.len();
        self.new_tets.clear();
        self.new_tets.extend(self.cavity.iter().copied().take(n));
        while self.new_tets.len() < n {
            self.new_tets.push(mesh.take(like));
        }
        for &t in self.cavity.iter().skip(n) {
            mesh.give_back(t);
        }
        let bits = if self.n_locals <= 1 << SMALL_BITS { SMALL_BITS } else { LOCAL_BITS };
        if self.links.len() < 1 << (2 * bits) {
            self.links.resize(1 << (2 * bits), 0);
        }
        let place = |a: u16, b: u16| usize::from(a) << bits | usize::from(b);
        for (k, &[a, b, c]) in (0u16..).zip(&self.locals) {
            // Face j of (v, f0, f1, f2) is opposite f_{j-1}; it holds the edge f_j → f_{j+1}.
            self.links[place(b, c)] = k << 2 | 1;
            self.links[place(c, a)] = k << 2 | 2;
            self.links[place(a, b)] = k << 2 | 3;
        }
        for ((face, &[a, b, c]), &t) in self.faces.iter().zip(&self.locals).zip(&self.new_tets) {
            let inner = |x: u16, y: u16| {
                let link = self.links[place(x, y)];
                FaceRef::new(self.new_tets[usize::from(link >> 2)], usize::from(link & 3))
            };
            let required = if face.required { REQUIRED } else { 0 };
            let [x, y, z] = face.vertices;
            mesh.tets[t as usize] = Tet {
                node: [v | required, x, y, z],
                neighbor: [face.outside, inner(c, b), inner(a, c), inner(b, a)],
            };
            mesh.set_neighbor(face.outside, FaceRef::new(t, 0));
        }
        self.cavity.clear();
    }
}

/// The sphere test where doubles did not decide.
#[cold]
#[inline(never)]
fn is_in_conflict(mesh: &FlatMesh, t: u32, p: Point) -> bool {
    let [a, b, c, d] = mesh.points(mesh.tet(t));
    in_sphere_perturbed(a, b, c, d, p)
}

const _: () = assert!(2 * LOCALS_MAX < 1 << 14, "a link has 14 bits for its tetrahedron");
