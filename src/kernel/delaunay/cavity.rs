//! The cavity of a point and its replacement by the ball of insertion.
//!
//! Gathering only marks; [`Kernel::discard`] takes the marks back and [`Kernel::fill`] makes the
//! change. Between the two a caller may look at the outer faces and decide.

use super::kernel::{CavityFace, Kernel, PointLocation, Rejected};
use crate::mesh::anatomy::mark::{IN_CAVITY, STAYS};
use crate::mesh::anatomy::{FACES, MARK, REQUIRED, VERTEX_MASK};
use crate::mesh::{FaceRef, Mesh, Tet};
use tetdb_base::geom::{Point, RelativePoint, in_sphere_perturbed, insphere_filtered, orient};
use tetdb_base::storage::{Pages, check_cancelled};

/// A larger cavity is refused: no size field needs one so large.
const CAVITY_MAX: usize = 1 << 20;

impl Kernel {
    /// Inserts `p` as vertex `v` into a mesh without required faces; returns one of its tetrahedra.
    ///
    /// `v` must already hold the position `p`. Errors: see [`Rejected`]; `v` is then in no tetrahedron.
    pub fn insert<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        v: u32,
        p: Point,
        hint: u32,
    ) -> Result<u32, Rejected> {
        let start = self.locate(mesh, p, hint)?;
        self.gather::<P, false>(mesh, p, &start, |_, _| false)?;
        Ok(self.fill(mesh, v))
    }

    /// Marks the cavity of `p` and lists its outer faces; required faces are kept.
    ///
    /// The cavity is made star-shaped around `p` exactly, and refused if a vertex would be left without tetrahedra.
    /// `refuses` is called for vertices met on the way, except those of `start`; the first refusal ends the call. On
    /// errors nothing stays marked. After success either [`Kernel::fill`] or [`Kernel::discard`] must follow.
    pub fn gather_constrained<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        p: Point,
        start: &PointLocation,
        refuses: impl FnMut(&mut Mesh<P>, u32) -> bool,
    ) -> Result<(), Rejected> {
        self.gather::<P, true>(mesh, p, start, refuses)?;
        if let Err(rejected) = self.correct(mesh, p, start) {
            self.discard(mesh);
            return Err(rejected);
        }
        Ok(())
    }

    /// Outer faces of the gathered cavity.
    pub fn faces(&self) -> &[CavityFace] {
        &self.faces
    }

    /// Tetrahedra of the gathered cavity.
    pub fn cavity(&self) -> &[u32] {
        &self.cavity
    }

    /// Tetrahedra created by the last [`Kernel::fill`].
    pub fn new_tets(&self) -> &[u32] {
        &self.new_tets
    }

    fn gather<P: Pages, const CONSTRAINED: bool>(
        &mut self,
        mesh: &mut Mesh<P>,
        p: Point,
        start: &PointLocation,
        mut refuses: impl FnMut(&mut Mesh<P>, u32) -> bool,
    ) -> Result<(), Rejected> {
        if let Some(i) = start.points.iter().position(|&q| q == p) {
            return Err(Rejected::Duplicate(start.record.vertex(i)));
        }
        self.cavity.clear();
        self.entries.clear();
        self.faces.clear();
        self.apexes.clear();
        self.blind.clear();
        self.numbered = false;
        mesh.set_mark(start.tet, IN_CAVITY, true);
        self.cavity.push(start.tet);
        self.entries.push(FaceRef::new(start.tet, 0));
        let mut next = 0;
        while next < self.entries.len() {
            let entry = self.entries[next];
            let t = entry.tet();
            let tet = mesh.tet(t);
            let corners = mesh.points(&tet);
            let [a, b, c, d] = corners;
            let seen = [
                RelativePoint::new(a, p),
                RelativePoint::new(b, p),
                RelativePoint::new(c, p),
                RelativePoint::new(d, p),
            ];
            // The tetrahedron across the face of entry is in the cavity; the first tetrahedron has no face of entry.
            let n = if next == 0 { 4 } else { 3 };
            next += 1;
            for k in 1..=n {
                let i = (entry.face() + k) & 3;
                let [f, g, h] = FACES[i];
                let across = tet.neighbor[i];
                let required = CONSTRAINED && tet.is_required(i);
                if across.exists() && !required {
                    let Some(v) = mesh.apex_if_unmarked(across) else {
                        continue;
                    };
                    self.stats.sphere_tests += 1;
                    // The neighbor shares this face; only its apex is new.
                    let apex = RelativePoint::new(mesh.point(v), p);
                    let det = insphere_filtered(&apex, &seen[f], &seen[h], &seen[g]);
                    if det > 0.0 || (det == 0.0 && in_conflict(mesh, across.tet(), p)) {
                        mesh.set_mark(across.tet(), IN_CAVITY, true);
                        self.cavity.push(across.tet());
                        self.entries.push(across);
                        if CONSTRAINED {
                            if refuses(mesh, v) {
                                self.discard(mesh);
                                return Err(Rejected::Refused);
                            }
                            self.apexes.push(v);
                        }
                        continue;
                    }
                }
                // Without constraints every outer face of a Delaunay cavity is seen.
                if CONSTRAINED && orient(p, corners[f], corners[g], corners[h]) <= 0.0 {
                    self.blind.push(self.faces.len() as u32);
                }
                self.faces.push(CavityFace {
                    vertices: tet.face(i),
                    outside: across,
                    inside: FaceRef::new(t, i),
                    required,
                });
            }
            if CONSTRAINED && self.cavity.len() > CAVITY_MAX {
                self.discard(mesh);
                return Err(Rejected::TooLarge);
            }
        }
        Ok(())
    }

    /// Takes tetrahedra out of the cavity until `p` sees all its faces from inside.
    ///
    /// Tetrahedra with a blind face are removed, and so are those that they alone connect.
    fn correct<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        p: Point,
        start: &PointLocation,
    ) -> Result<(), Rejected> {
        // The remaining part is the largest one without a blind outer face, in any order.
        let mut suspects = std::mem::take(&mut self.suspects);
        suspects.clear();
        for &k in &self.blind {
            let inside = self.faces[k as usize].inside.tet();
            if is_marked(mesh, inside) {
                mesh.set_mark(inside, IN_CAVITY, false);
                suspects.push(inside);
            }
        }
        let shrunk = !suspects.is_empty();
        while let Some(gone) = suspects.pop() {
            let tet = mesh.tet(gone);
            for (i, across) in tet.neighbor.into_iter().enumerate() {
                if !across.exists() || tet.is_required(i) || !is_marked(mesh, across.tet()) {
                    continue;
                }
                let [a, b, c] = tet.face(i);
                let (a, b, c) = (mesh.point(a), mesh.point(b), mesh.point(c));
                // Seen from the other side, where it is an outer face now.
                if orient(p, a, c, b) <= 0.0 {
                    mesh.set_mark(across.tet(), IN_CAVITY, false);
                    suspects.push(across.tet());
                }
            }
        }
        self.suspects = suspects;
        if shrunk {
            self.stats.shrunk += 1;
            if !is_marked(mesh, start.tet) {
                return Err(Rejected::Blocked);
            }
            self.reflood(mesh, start.tet);
        }
        self.list_outer();
        // A ball has 2 n - 4 faces on n vertices; anything else is pinched or has a hole.
        if self.faces.len() + 4 != 2 * self.n_outer() {
            return Err(Rejected::Blocked);
        }
        if self.buries(start.record.vertices()) { Err(Rejected::Buries) } else { Ok(()) }
    }

    /// Returns whether a vertex of the cavity is on none of its outer faces.
    fn buries(&self, first: [u32; 4]) -> bool {
        let numbered = self.numbered;
        let mut vertices = first.iter().chain(&self.apexes);
        vertices.any(|v| {
            if numbered { !self.links.knows(*v) } else { self.outer.binary_search(v).is_err() }
        })
    }

    /// Lists the vertices of the outer faces: numbered in order of appearance, or sorted when there are many.
    fn list_outer(&mut self) {
        self.outer.clear();
        self.numbered = self.number_faces();
        if !self.numbered {
            self.outer.clear();
            self.outer.extend(self.faces.iter().flat_map(|face| face.vertices));
            self.outer.sort_unstable();
            self.outer.dedup();
        }
    }

    /// Gives the vertices of the outer faces local numbers; `false` when they are too many.
    fn number_faces(&mut self) -> bool {
        self.links.begin();
        self.locals.clear();
        for face in &self.faces {
            let [a, b, c] = face.vertices;
            let (Some(a), Some(b), Some(c)) =
                (self.links.local(a), self.links.local(b), self.links.local(c))
            else {
                return false;
            };
            self.locals.push([a, b, c]);
        }
        true
    }

    /// Vertices of the outer faces, once they are listed.
    fn n_outer(&self) -> usize {
        if self.numbered { self.links.n_local() } else { self.outer.len() }
    }

    /// Keeps the tetrahedra still connected to `seed` through marked ones; lists the outer faces again.
    fn reflood<P: Pages>(&mut self, mesh: &mut Mesh<P>, seed: u32) {
        let before = std::mem::take(&mut self.cavity);
        self.faces.clear();
        self.apexes.clear();
        // The mark moves while a tetrahedron is known to stay.
        let settle = |mesh: &mut Mesh<P>, t: u32| {
            mesh.set_mark(t, IN_CAVITY, false);
            mesh.set_mark(t, STAYS, true);
        };
        settle(mesh, seed);
        self.cavity.push(seed);
        let mut next = 0;
        while next < self.cavity.len() {
            let tet = mesh.tet(self.cavity[next]);
            next += 1;
            for i in 0..4 {
                let across = tet.neighbor[i];
                if across.exists()
                    && !tet.is_required(i)
                    && mesh.tet(across.tet()).node[IN_CAVITY] & MARK != 0
                {
                    settle(mesh, across.tet());
                    self.cavity.push(across.tet());
                }
            }
        }
        for &t in &before {
            mesh.set_mark(t, IN_CAVITY, false);
        }
        for &t in &self.cavity {
            let tet = mesh.tet(t);
            self.apexes.extend(tet.vertices());
            for i in 0..4 {
                let across = tet.neighbor[i];
                let required = tet.is_required(i);
                if required || !across.exists() || mesh.tet(across.tet()).node[STAYS] & MARK == 0 {
                    self.faces.push(CavityFace {
                        vertices: tet.face(i),
                        outside: across,
                        inside: FaceRef::new(t, i),
                        required,
                    });
                }
            }
        }
        for &t in &self.cavity {
            mesh.set_mark(t, STAYS, false);
            mesh.set_mark(t, IN_CAVITY, true);
        }
    }

    /// Takes the marks back; the mesh is as before gathering.
    pub fn discard<P: Pages>(&mut self, mesh: &mut Mesh<P>) {
        for &t in &self.cavity {
            mesh.set_mark(t, IN_CAVITY, false);
        }
        self.cavity.clear();
        self.faces.clear();
    }

    /// Replaces the gathered cavity by the tetrahedra that join vertex `v` to its outer faces.
    ///
    /// Returns one of them. Effects: ids of the cavity are used again first; attributes and `tet_of` are not written.
    pub fn fill<P: Pages>(&mut self, mesh: &mut Mesh<P>, v: u32) -> u32 {
        check_cancelled();
        self.stats.inserted += 1;
        self.stats.cavity_tets += self.cavity.len() as u64;
        self.stats.cavity_largest = self.stats.cavity_largest.max(self.cavity.len() as u64);
        let n_new = self.faces.len();
        self.new_tets.clear();
        self.new_tets.extend(self.cavity.iter().copied().take(n_new));
        while self.new_tets.len() < n_new {
            self.new_tets.push(mesh.take_tet());
        }
        if !self.numbered && self.faces.len() <= 2 * CAVITY_SMALL {
            self.numbered = self.number_faces();
        }
        if self.numbered {
            self.link_by_matrix(mesh, v);
        } else {
            self.links.begin();
            self.link_by_sorting(mesh, v);
        }
        for k in n_new..self.cavity.len() {
            mesh.free_tet(self.cavity[k]);
        }
        self.cavity.clear();
        self.new_tets[0]
    }

    /// Writes the new tetrahedra; the outer faces' vertices must be numbered.
    fn link_by_matrix<P: Pages>(&mut self, mesh: &mut Mesh<P>, v: u32) {
        for (&[a, b, c], &t) in self.locals.iter().zip(&self.new_tets) {
            let t = t << 2;
            // Face j of (v, f0, f1, f2) is opposite f_{j-1}; it holds the edge f_j → f_{j+1}.
            self.links.set(b, c, t | 1);
            self.links.set(c, a, t | 2);
            self.links.set(a, b, t | 3);
        }
        for ((face, &t), &[a, b, c]) in self.faces.iter().zip(&self.new_tets).zip(&self.locals) {
            let inner = [self.links.get(c, b), self.links.get(a, c), self.links.get(b, a)];
            write_new(mesh, v, t, face, inner);
        }
    }

    #[cold]
    fn link_by_sorting<P: Pages>(&mut self, mesh: &mut Mesh<P>, v: u32) {
        for (k, face) in self.faces.iter().enumerate() {
            let [a, b, c] = face.vertices;
            let t = self.new_tets[k] << 2;
            self.links.push_sorted(b, c, t | 1);
            self.links.push_sorted(c, a, t | 2);
            self.links.push_sorted(a, b, t | 3);
        }
        self.links.sort();
        for (k, face) in self.faces.iter().enumerate() {
            let [a, b, c] = face.vertices;
            let inner = [(c, b), (a, c), (b, a)].map(|(a, b)| {
                let found = self.links.find_sorted(a, b);
                found
                    .unwrap_or_else(|| panic!("cavity of vertex {v} is not closed at edge {a} {b}"))
            });
            write_new(mesh, v, self.new_tets[k], face, inner);
        }
    }
}

#[inline]
fn is_marked<P: Pages>(mesh: &mut Mesh<P>, t: u32) -> bool {
    mesh.tet(t).node[IN_CAVITY] & MARK != 0
}

/// The sphere test of one tetrahedron where doubles did not decide.
#[cold]
#[inline(never)]
fn in_conflict<P: Pages>(mesh: &mut Mesh<P>, t: u32, p: Point) -> bool {
    let tet = mesh.tet(t);
    let [a, b, c, d] = mesh.points(&tet);
    in_sphere_perturbed(a, b, c, d, p)
}

/// Vertices of a cavity the matrix of links can number.
const CAVITY_SMALL: usize = 64;

/// Writes the tetrahedron of `v` and an outer face, and links the tetrahedron beyond.
#[inline]
fn write_new<P: Pages>(mesh: &mut Mesh<P>, v: u32, t: u32, face: &CavityFace, inner: [u32; 3]) {
    let [a, b, c] = face.vertices;
    debug_assert!([a, b, c, v].iter().all(|&w| w <= VERTEX_MASK));
    let required = if face.required { REQUIRED } else { 0 };
    let tet = Tet {
        node: [v | required, a, b, c],
        neighbor: [face.outside, FaceRef(inner[0]), FaceRef(inner[1]), FaceRef(inner[2])],
    };
    mesh.set_tet(t, tet);
    if face.outside.exists() {
        mesh.set_neighbor(face.outside, FaceRef::new(t, 0));
    }
}

const _: () = assert!(FACES[0][0] == 1 && FACES[0][1] == 2 && FACES[0][2] == 3);
