//! A part of the mesh in plain arrays, with ids that count from 0.

use tetdb_schema::page::NONE;

use crate::mesh::anatomy::MARK;
use crate::mesh::anatomy::mark::EXAMINED;
use crate::mesh::{FaceRef, Tet};
use tetdb_base::geom::{Point, orient};

/// A vertex in an array or in a brick.
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct Vertex {
    pub point: Point,
    /// Wanted edge length; negative if the vertex never moves.
    h: f32,
    /// In a brick: the number that the vertex had in the coarse mesh, or [`NONE`]. In an array: scratch of the kernel.
    pub note: u32,
}

impl Vertex {
    pub fn new(point: Point, h: f32, fixed: bool, note: u32) -> Self {
        Self { point, h: if fixed { -h } else { h }, note }
    }

    /// Wanted edge length.
    #[inline(always)]
    pub fn h(&self) -> f32 {
        self.h.abs()
    }

    /// Moves a vertex that is not fixed, and changes the length wanted there. A vertex at infinity is gone.
    pub fn set(&mut self, point: Point, h: f32) {
        (self.point, self.h) = (point, h);
    }

    /// Fixes a vertex.
    pub fn fix(&mut self) {
        self.h = -self.h.abs();
    }

    /// The same with another note.
    pub fn with_note(self, note: u32) -> Self {
        Self { note, ..self }
    }

    /// Returns true if the vertex never moves.
    #[inline(always)]
    pub fn is_fixed(&self) -> bool {
        self.h.is_sign_negative()
    }
}

/// A tetrahedron without content.
pub(super) const EMPTY: Tet = Tet { node: [NONE; 4], neighbor: [FaceRef::NONE; 4] };

/// Region and flags of a tetrahedron, as [`Mesh::tet_attribute`](crate::mesh::Mesh::tet_attribute) tells them.
pub(super) type Attribute = (u32, u32);

/// Flag of a tetrahedron at the rim of a part of a mesh, which is held. Its region is its dense id in the mesh.
pub(super) const RIM: u32 = 1 << 31;

/// Vertices and tetrahedra of a block and its margin.
///
/// A tetrahedron with a neighbor outside the arrays is *held*: nothing may replace it, because that one refers to it. It has no neighbor
/// there, as at a face of the surface.
#[derive(Default)]
pub(super) struct FlatMesh {
    pub vertices: Vec<Vertex>,
    pub tets: Vec<Tet>,
    pub attributes: Vec<Attribute>,
    /// Per tetrahedron whether it is held.
    pub held: Vec<bool>,
    /// Unused places of `tets`.
    pub free: Vec<u32>,
}

impl FlatMesh {
    /// Forgets all, keeps the memory.
    pub fn clear(&mut self) {
        self.vertices.clear();
        self.tets.clear();
        self.attributes.clear();
        self.held.clear();
        self.free.clear();
    }

    #[inline(always)]
    pub fn point(&self, v: u32) -> Point {
        self.vertices[v as usize].point
    }

    #[inline(always)]
    pub fn tet(&self, t: u32) -> &Tet {
        &self.tets[t as usize]
    }

    #[inline(always)]
    pub fn corners(&self, tet: &Tet) -> [&Vertex; 4] {
        let v = &self.vertices;
        [
            &v[tet.vertex(0) as usize],
            &v[tet.vertex(1) as usize],
            &v[tet.vertex(2) as usize],
            &v[tet.vertex(3) as usize],
        ]
    }

    #[inline(always)]
    pub fn points(&self, tet: &Tet) -> [Point; 4] {
        let [a, b, c, d] = self.corners(tet);
        [a.point, b.point, c.point, d.point]
    }

    /// The vertex opposite `face`.
    #[inline(always)]
    pub fn apex(&self, face: FaceRef) -> u32 {
        self.tet(face.tet()).vertex(face.face())
    }

    /// Returns true if the tetrahedron is held.
    #[inline(always)]
    pub fn is_held(&self, t: u32) -> bool {
        self.held[t as usize]
    }

    /// Whether there are tetrahedra that division has not examined.
    pub fn has_unexamined(&self) -> bool {
        self.tets.iter().any(|tet| tet.is_live() && tet.node[EXAMINED] & MARK == 0)
    }

    /// Whether all tetrahedra are positive and neighbors agree: for assertions.
    pub fn is_sound(&self) -> bool {
        let sorted = |mut face: [u32; 3]| {
            face.sort_unstable();
            face
        };
        let agrees = |t: u32, tet: &Tet, i: usize| {
            let across = tet.neighbor[i];
            !across.exists() || {
                let other = self.tet(across.tet());
                other.is_live()
                    && other.neighbor[across.face()] == FaceRef::new(t, i)
                    && sorted(other.face(across.face())) == sorted(tet.face(i))
                    && other.is_required(across.face()) == tet.is_required(i)
            }
        };
        let mut live = (0u32..).zip(&self.tets).filter(|(_, tet)| tet.is_live());
        live.all(|(t, tet)| {
            let [a, b, c, d] = self.points(tet);
            orient(a, b, c, d) > 0.0 && (0..4).all(|i| agrees(t, tet, i))
        })
    }

    /// A place for a tetrahedron of the same region as `like`.
    pub fn take(&mut self, like: Attribute) -> u32 {
        if let Some(t) = self.free.pop() {
            self.attributes[t as usize] = like;
            return t;
        }
        self.tets.push(EMPTY);
        self.attributes.push(like);
        self.held.push(false);
        self.tets.len() as u32 - 1
    }

    /// Gives a place back.
    pub fn give_back(&mut self, t: u32) {
        self.tets[t as usize] = EMPTY;
        self.free.push(t);
    }

    /// Makes `to` the neighbor across `face`, if there is a tetrahedron.
    #[inline(always)]
    pub fn set_neighbor(&mut self, face: FaceRef, to: FaceRef) {
        if face.exists() {
            self.tets[face.tet() as usize].neighbor[face.face()] = to;
        }
    }

    #[inline(always)]
    pub fn is_marked(&self, t: u32, mark: usize) -> bool {
        self.tets[t as usize].node[mark] & crate::mesh::anatomy::MARK != 0
    }

    #[inline(always)]
    pub fn set_mark(&mut self, t: u32, mark: usize) {
        self.tets[t as usize].node[mark] |= crate::mesh::anatomy::MARK;
    }

    #[inline(always)]
    pub fn clear_mark(&mut self, t: u32, mark: usize) {
        self.tets[t as usize].node[mark] &= !crate::mesh::anatomy::MARK;
    }
}

const _: () = assert!(size_of::<Vertex>() == 32 && size_of::<Tet>() == 32);
