//! A part of the mesh in memory, where points may be exact; it grows with the tetrahedra requested.
//!
//! The mesh is only read until [`RecoveryPatch::commit`] writes the result as one step.

use super::complex::{TetComplex, edge_key, sorted};
use super::effort::Effort;
use super::exact::{ExactPoint, PlacedPoint, orient_exact, orient_filtered, orient_in_pairs};
use crate::mesh::anatomy::REQUIRED;
use crate::mesh::{FaceRef, Mesh, Tet, VertexTag};
use tetdb_base::geom::{Dyadic, IdMap, IdSet, Point, orient};
use tetdb_base::storage::Pages;
use tetdb_schema::page::NONE;

/// Marks a neighbor that was not brought in yet; the rest is a position in the list of borders.
const BORDER: u32 = 1 << 31;

/// A vertex of the patch.
struct PatchVertex {
    /// Its id in the mesh; [`NONE`] for a new one.
    id: u32,
    steiner: bool,
    point: Point,
    exact: Option<ExactPoint>,
    /// Corners of the segment (one of them twice) or facet it lies on; itself three times if on none.
    on: [u32; 3],
    tet_of: u32,
}

/// A face between the patch and the rest.
#[derive(Clone, Copy)]
struct Border {
    /// In the mesh, not brought in.
    outside: FaceRef,
    /// In the patch.
    inside: FaceRef,
}

/// Tetrahedra copied from `mesh`, with ids and vertex ids of their own.
pub(super) struct RecoveryPatch<'m, P: Pages> {
    mesh: &'m mut Mesh<P>,
    protected: &'m IdSet<u64>,
    tets: Vec<Tet>,
    free: Vec<u32>,
    vertices: Vec<PatchVertex>,
    /// Mesh vertex to patch vertex.
    local: IdMap<u32, u32>,
    borders: Vec<Border>,
    /// Face of a tetrahedron not brought in (as in the mesh) to its border.
    border_of: IdMap<u32, u32>,
    brought_in: Vec<u32>,
    /// Required faces brought in.
    required: IdSet<[u32; 3]>,
    /// Edges of the patch that must stay, besides those of `protected`.
    pub kept: IdSet<u64>,
    /// Limits and order of the attempts.
    pub effort: Effort,
}

const FREE: Tet = Tet { node: [NONE; 4], neighbor: [FaceRef::NONE; 4] };

impl<'m, P: Pages> RecoveryPatch<'m, P> {
    /// An empty patch.
    pub fn new(mesh: &'m mut Mesh<P>, protected: &'m IdSet<u64>, effort: Effort) -> Self {
        Self {
            mesh,
            protected,
            tets: Vec::new(),
            free: Vec::new(),
            vertices: Vec::new(),
            local: IdMap::default(),
            borders: Vec::new(),
            border_of: IdMap::default(),
            brought_in: Vec::new(),
            required: IdSet::default(),
            kept: IdSet::default(),
            effort,
        }
    }

    /// Brings in a tetrahedron of mesh vertex `v` and returns the vertex's id here.
    pub fn vertex(&mut self, v: u32) -> u32 {
        if let Some(&l) = self.local.get(&v) {
            return l;
        }
        let t = self.mesh.tet_of(v);
        self.fault_in(t);
        self.local[&v]
    }

    fn fault_in(&mut self, id: u32) {
        let record = self.mesh.tet(id);
        let t = self.tets.len() as u32;
        let mut tet = record;
        for i in 0..4 {
            let v = record.vertex(i);
            let l = self.local_vertex(v, t);
            tet.node[i] = l | (record.node[i] & REQUIRED);
            let outside = record.neighbor[i];
            if let Some(k) = self.border_of.remove(&FaceRef::new(id, i).0) {
                let inside = self.borders[k as usize].inside;
                tet.neighbor[i] = inside;
                self.tets[inside.tet() as usize].neighbor[inside.face()] = FaceRef::new(t, i);
            } else if outside.exists() {
                let k = self.borders.len() as u32;
                self.borders.push(Border { outside, inside: FaceRef::new(t, i) });
                self.border_of.insert(outside.0, k);
                tet.neighbor[i] = FaceRef(BORDER | k);
            }
        }
        let faces = (0..4).filter(|&i| tet.is_required(i));
        self.required.extend(faces.map(|i| sorted(tet.face(i))));
        self.tets.push(tet);
        self.brought_in.push(id);
    }

    fn local_vertex(&mut self, v: u32, t: u32) -> u32 {
        if let Some(&l) = self.local.get(&v) {
            return l;
        }
        let point = self.mesh.point(v);
        let steiner = self.mesh.vertex_attribute(v).0 == VertexTag::Steiner;
        let l = self.push_vertex(v, steiner, point, None, t);
        self.local.insert(v, l);
        l
    }

    /// Adds a vertex that lies on no segment or facet.
    fn push_vertex(
        &mut self,
        id: u32,
        steiner: bool,
        point: Point,
        exact: Option<ExactPoint>,
        tet_of: u32,
    ) -> u32 {
        let l = self.vertices.len() as u32;
        self.vertices.push(PatchVertex { id, steiner, point, exact, on: [l; 3], tet_of });
        l
    }

    /// Adds a vertex in no tetrahedron.
    pub fn add_vertex(&mut self, point: Point, exact: Option<ExactPoint>) -> u32 {
        self.push_vertex(NONE, true, point, exact, NONE)
    }

    /// Adds a vertex in no tetrahedron that is a combination of the vertices `on`, from the input.
    pub fn add_vertex_on(&mut self, on: [u32; 3], exact: ExactPoint) -> u32 {
        let v = self.add_vertex(exact.rounded(), Some(exact));
        self.vertices[v as usize].on = on;
        v
    }

    /// Returns whether it is known, without looking at their exact places, that a plane holds the four.
    ///
    /// While facets are covered nearly all exact signs are zero for this reason, and would take long to compute.
    fn in_one_plane(&self, v: [u32; 4]) -> bool {
        let on = v.map(|v| self.vertices[v as usize].on);
        let known = |v: u32| self.vertices[v as usize].exact.is_none();
        if !on.iter().flatten().all(|&v| known(v)) {
            return false;
        }
        let is_facet = |&[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
        let Some(&f) = on.iter().find(|on| is_facet(on)) else {
            // Up to three corners in all.
            let first = on[0][0];
            let second = on.iter().flatten().copied().find(|&v| v != first);
            let others = |v: &&u32| **v != first && Some(**v) != second;
            let third = on.iter().flatten().find(others);
            return on.iter().flatten().filter(others).all(|v| Some(v) == third);
        };
        let [p, q, r] = f.map(|v| self.vertices[v as usize].point);
        let beside =
            |v: &u32| f.contains(v) || orient(p, q, r, self.vertices[*v as usize].point) == 0.0;
        on.iter().flatten().all(beside)
    }

    /// Takes a vertex back that was added and is in no tetrahedron.
    pub fn drop_vertex(&mut self, v: u32) {
        if v as usize + 1 == self.vertices.len() {
            self.vertices.pop();
        }
    }

    /// Number of vertices ever here.
    pub fn n_vertices(&self) -> u32 {
        self.vertices.len() as u32
    }

    /// Returns whether `v` is not from the input.
    pub fn is_steiner(&self, v: u32) -> bool {
        self.vertices[v as usize].steiner
    }

    /// Returns whether some tetrahedron has `v`.
    pub fn is_in_use(&self, v: u32) -> bool {
        let t = self.vertices[v as usize].tet_of;
        t != NONE && self.tets[t as usize].local(v).is_some()
    }

    /// Returns whether `v` was added here.
    pub fn is_new(&self, v: u32) -> bool {
        self.vertices[v as usize].id == NONE
    }

    /// Id of `v` in the mesh, [`NONE`] if it was added here.
    pub fn mesh_id(&self, v: u32) -> u32 {
        self.vertices[v as usize].id
    }

    /// Returns whether the position of `v` is more than its rounded one.
    pub fn is_exact(&self, v: u32) -> bool {
        self.vertices[v as usize].exact.is_some()
    }

    /// Position of `v`, without rounding.
    pub fn exact_place(&self, v: u32) -> ExactPoint {
        let v = &self.vertices[v as usize];
        let explicit = || ExactPoint::explicit(v.point);
        v.exact.clone().unwrap_or_else(explicit)
    }

    /// Position of `v`, rounded, and the exact one if it differs.
    pub fn placement(&self, v: u32) -> (Point, Option<ExactPoint>) {
        let v = &self.vertices[v as usize];
        (v.point, v.exact.clone())
    }

    /// Moves `v`; the caller answers for the volumes around it.
    pub fn place(&mut self, v: u32, (point, exact): (Point, Option<ExactPoint>)) {
        let v = &mut self.vertices[v as usize];
        (v.point, v.exact) = (point, exact);
    }

    /// From `x` to `v`: the difference of their exact positions.
    pub fn offset(&self, x: u32, v: u32) -> Point {
        let (from, to) = (&self.vertices[x as usize], &self.vertices[v as usize]);
        if from.exact.is_none() && to.exact.is_none() {
            return to.point - from.point;
        }
        self.exact_place(x).offset(&self.exact_place(v))
    }

    /// Position of `v`, rounded.
    pub fn position_of(&self, v: u32) -> Point {
        self.vertices[v as usize].point
    }

    fn placed(&self, v: u32) -> PlacedPoint<'_> {
        let v = &self.vertices[v as usize];
        PlacedPoint { point: v.point, exact: v.exact.as_ref() }
    }

    /// Six times the signed volume, without rounding.
    pub fn orient_exact(&self, v: [u32; 4]) -> Dyadic {
        orient_exact(v.map(|v| self.placed(v)))
    }

    /// Tetrahedron `t` as it is.
    pub fn tet_now(&self, t: u32) -> Tet {
        self.tets[t as usize]
    }

    /// Live tetrahedra.
    fn live(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.tets.len() as u32).filter(|&t| self.tets[t as usize].is_live())
    }

    /// Returns whether the patch may be written: no exact point is in use, and all volumes are positive as rounded.
    pub fn is_sound(&self) -> bool {
        self.live().all(|t| {
            let v = self.tets[t as usize].vertices().map(|v| &self.vertices[v as usize]);
            v.iter().all(|v| v.exact.is_none())
                && orient(v[0].point, v[1].point, v[2].point, v[3].point) > 0.0
        })
    }

    /// Returns whether every required face brought in is still there and required.
    pub fn keeps_required(&self) -> bool {
        let mut now: IdSet<[u32; 3]> = IdSet::default();
        for t in self.live() {
            let tet = &self.tets[t as usize];
            let faces = (0..4).filter(|&i| tet.is_required(i));
            now.extend(faces.map(|i| sorted(tet.face(i))));
        }
        self.required.is_subset(&now)
    }

    /// Writes the patch in place of the loaded tetrahedra; returns the number of vertices added less those removed.
    ///
    /// Must be [`RecoveryPatch::is_sound`]. Effects: new vertices are tagged as Steiner points.
    pub fn commit(self) -> i64 {
        let live: Vec<u32> = self.live().collect();
        let mut used = vec![false; self.vertices.len()];
        for &t in &live {
            for v in self.tets[t as usize].vertices() {
                used[v as usize] = true;
            }
        }
        let mesh = self.mesh;
        let mut balance = 0;
        let mut vertex_id: Vec<u32> = self.vertices.iter().map(|v| v.id).collect();
        for (l, v) in self.vertices.iter().enumerate() {
            if used[l] && v.id == NONE {
                let id = mesh.add_vertex(v.point, 0.0);
                mesh.set_vertex_attribute(id, VertexTag::Steiner, 0);
                vertex_id[l] = id;
                balance += 1;
            }
        }
        let mut tet_id = vec![NONE; self.tets.len()];
        let mut reused = self.brought_in.iter().copied();
        for &t in &live {
            tet_id[t as usize] = reused.next().unwrap_or_else(|| mesh.take_tet());
        }
        for id in reused {
            mesh.free_tet(id);
        }
        for &t in &live {
            let mut tet = self.tets[t as usize];
            let id = tet_id[t as usize];
            for i in 0..4 {
                let v = vertex_id[tet.vertex(i) as usize];
                tet.node[i] = v | (tet.node[i] & REQUIRED);
                let n = tet.neighbor[i];
                if n.exists() && n.0 & BORDER != 0 {
                    let outside = self.borders[(n.0 & !BORDER) as usize].outside;
                    tet.neighbor[i] = outside;
                    mesh.set_neighbor(outside, FaceRef::new(id, i));
                } else if n.exists() {
                    tet.neighbor[i] = FaceRef::new(tet_id[n.tet() as usize], n.face());
                }
                mesh.set_tet_of(v, id);
            }
            mesh.set_tet(id, tet);
        }
        for (l, v) in self.vertices.iter().enumerate() {
            if !used[l] && v.id != NONE {
                mesh.free_vertex(v.id);
                mesh.set_vertex_attribute(v.id, VertexTag::Free, 0);
                balance -= 1;
            }
        }
        balance
    }
}

impl<P: Pages> TetComplex for RecoveryPatch<'_, P> {
    fn tet(&mut self, t: u32) -> Tet {
        self.tets[t as usize]
    }

    fn across(&mut self, t: u32, i: usize) -> FaceRef {
        let n = self.tets[t as usize].neighbor[i];
        if n.exists() && n.0 & BORDER != 0 {
            let outside = self.borders[(n.0 & !BORDER) as usize].outside;
            self.fault_in(outside.tet());
        }
        self.tets[t as usize].neighbor[i]
    }

    fn tet_of(&mut self, v: u32) -> u32 {
        self.vertices[v as usize].tet_of
    }

    fn orient(&mut self, v: [u32; 4]) -> f64 {
        let placed = v.map(|v| self.placed(v));
        orient_filtered(placed).unwrap_or_else(|| match self.in_one_plane(v) {
            true => 0.0,
            false => orient_in_pairs(placed).unwrap_or_else(|| orient_exact(placed).estimate()),
        })
    }

    fn position(&mut self, v: u32) -> Point {
        self.position_of(v)
    }

    fn take_tet(&mut self) -> u32 {
        self.free.pop().unwrap_or_else(|| {
            self.tets.push(FREE);
            self.tets.len() as u32 - 1
        })
    }

    fn free_tet(&mut self, t: u32) {
        self.tets[t as usize] = FREE;
        self.free.push(t);
    }

    fn set_tet(&mut self, t: u32, tet: Tet) {
        self.tets[t as usize] = tet;
    }

    fn set_across(&mut self, face: FaceRef, to: FaceRef) {
        if face.0 & BORDER != 0 {
            self.borders[(face.0 & !BORDER) as usize].inside = to;
        } else {
            self.tets[face.tet() as usize].neighbor[face.face()] = to;
        }
    }

    fn set_tet_of(&mut self, v: u32, t: u32) {
        self.vertices[v as usize].tet_of = t;
    }

    fn protects(&self, a: u32, b: u32) -> bool {
        let (x, y) = (self.mesh_id(a), self.mesh_id(b));
        self.kept.contains(&edge_key(a, b))
            || (x != NONE && y != NONE && self.protected.contains(&edge_key(x, y)))
    }
}
