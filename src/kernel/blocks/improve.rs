//! Rounds of improvement in a region, whose arrays serve as pages.
//!
//! All faces of held tetrahedra are required meanwhile, so no operation touches them or moves their vertices.

use tetdb_schema::page::{NONE, SLOT_BITS, SLOT_MASK, SLOTS, Slot};
use tetdb_schema::tree::{IdCounts, MeshState};

use super::flat::{Attribute, EMPTY, FlatMesh, Vertex};
use super::partition::KdPartition;
use super::region::{OUTSIDE, Region};
use super::spawn::is_in;
use crate::mesh::anatomy::mark::EXAMINED;
use crate::mesh::anatomy::{MARK, REQUIRED};
use crate::mesh::{FaceRef, Mesh, Tet, dense, sparse};
use crate::optimize::{OperationCounts, improve_all_but, is_to_mend};
use tetdb_base::geom::Point;
use tetdb_base::shape::{INVERSE_QUALITY_WANTED, is_below};
use tetdb_base::storage::{FlatPages, Pages, kind};

/// Slots of a page that hold records; what is beyond has no id.
const RECORDS: u32 = tetdb_schema::page::RECORDS as u32;

/// Improves the tetrahedra of the bricks for which `is_due` holds. `own` is the place of the brick for new vertices outside the region.
pub(super) fn improve(
    region: &mut Region,
    partition: &KdPartition,
    is_due: &[bool],
    own: u32,
) -> OperationCounts {
    free_gaps(&mut region.mesh);
    // Nobody would learn that a copy moved or is gone: vertices of other bricks stay, even where all their tetrahedra are here.
    for (vertex, &brick) in region.mesh.vertices.iter_mut().zip(&region.brick_of) {
        if brick == OUTSIDE {
            vertex.fix();
        }
    }
    let others = not_due(region, is_due);
    let n_vertices = region.mesh.vertices.len();
    point_to_tets(&mut region.mesh);
    let kept = require_faces_of_held(&mut region.mesh);
    let common = common_attribute(&region.mesh);
    let (pages, state) = ArrayPages::of(&mut region.mesh, common);
    let mut mesh = Mesh::with_state(pages, state);
    let (counts, bad) = improve_all_but(&mut mesh, &others);
    take_back(&mut region.mesh, &mut mesh, common);
    for face in kept {
        let across = region.mesh.tet(face.tet()).neighbor[face.face()];
        for face in [face, across].into_iter().filter(|f| f.exists()) {
            region.mesh.tets[face.tet() as usize].node[face.face()] &= !REQUIRED;
        }
    }
    region.list_to_mend(&bad);
    let bricks = std::mem::take(&mut region.bricks);
    region.place_new(n_vertices, |point| {
        let brick = bricks.binary_search(&partition.find(point));
        brick.map_or(own, |place| place as u32)
    });
    region.bricks = bricks;
    counts
}

/// Bad tetrahedra of other bricks than those for which `is_due` holds. Effects: all marks are down.
fn not_due(region: &mut Region, is_due: &[bool]) -> Vec<u32> {
    let mut others = Vec::new();
    for t in 0..region.mesh.tets.len() as u32 {
        let tet = *region.mesh.tet(t);
        if !tet.is_live() {
            continue;
        }
        for node in &mut region.mesh.tets[t as usize].node {
            *node &= !MARK;
        }
        if !is_in(region, &tet, is_due)
            && is_below(region.mesh.points(&tet), INVERSE_QUALITY_WANTED)
        {
            others.push(t);
        }
    }
    others
}

/// Moves tetrahedra from places that have no id in pages.
fn free_gaps(mesh: &mut FlatMesh) {
    let n = mesh.tets.len() as u32;
    let has_id = |t: u32| t & SLOT_MASK < RECORDS;
    mesh.free.retain(|&t| has_id(t));
    for from in (0..n).filter(|&t| !has_id(t)) {
        let tet = *mesh.tet(from);
        if !tet.is_live() {
            continue;
        }
        if mesh.is_held(from) {
            // What is outside refers to it; only passes over pages miss it, and nothing is done to it.
            continue;
        }
        let mut to = mesh.take(mesh.attributes[from as usize]);
        while !has_id(to) {
            to = mesh.take(mesh.attributes[from as usize]);
        }
        mesh.tets[to as usize] = tet;
        for (i, across) in tet.neighbor.into_iter().enumerate() {
            mesh.set_neighbor(across, FaceRef::new(to, i));
        }
        mesh.tets[from as usize] = EMPTY;
    }
}

/// Notes a tetrahedron of each vertex; 0 for vertices without.
fn point_to_tets(mesh: &mut FlatMesh) {
    for vertex in &mut mesh.vertices {
        vertex.note = 0;
    }
    for (t, tet) in (0u32..).zip(&mesh.tets) {
        if tet.is_live() {
            for v in tet.vertices() {
                mesh.vertices[v as usize].note = t;
            }
        }
    }
}

/// Makes all faces of held tetrahedra required. Returns those that were not.
fn require_faces_of_held(mesh: &mut FlatMesh) -> Vec<FaceRef> {
    let mut made = Vec::new();
    for t in 0..mesh.tets.len() as u32 {
        let tet = *mesh.tet(t);
        if tet.is_live() && mesh.is_held(t) {
            made.extend((0..4).filter(|&i| !tet.is_required(i)).map(|i| FaceRef::new(t, i)));
        }
    }
    for &face in &made {
        let across = mesh.tet(face.tet()).neighbor[face.face()];
        for face in [face, across].into_iter().filter(|f| f.exists()) {
            mesh.tets[face.tet() as usize].node[face.face()] |= REQUIRED;
        }
    }
    made
}

/// Region and flags of all tetrahedra if they are the same.
fn common_attribute(mesh: &FlatMesh) -> Option<Attribute> {
    let mut live = mesh.tets.iter().zip(&mesh.attributes).filter(|(tet, _)| tet.is_live());
    let (_, &first) = live.next()?;
    live.all(|(_, &attribute)| attribute == first).then_some(first)
}

/// The arrays of a region as pages: tetrahedra and vertices are records as they are.
struct ArrayPages {
    tets: Vec<Tet>,
    vertices: Vec<Vertex>,
    /// The attributes of tetrahedra, unless all are the same.
    rest: FlatPages,
}

impl ArrayPages {
    fn of(mesh: &mut FlatMesh, common: Option<Attribute>) -> (Self, MeshState) {
        let (mut tets, mut vertices) =
            (std::mem::take(&mut mesh.tets), std::mem::take(&mut mesh.vertices));
        let n_live = tets.iter().filter(|tet| tet.is_live()).count() as u32;
        let n_vertices = vertices.len() as u32;
        let unused = Vertex::new(Point::INFINITY, 0.0, false, NONE);
        tets.resize(tets.len().next_multiple_of(SLOTS), EMPTY);
        vertices.resize(vertices.len().next_multiple_of(SLOTS), unused);
        let behind = |n: usize, n_live: u32| IdCounts { fresh: n as u32, free_head: NONE, n_live };
        let state = MeshState {
            tets: behind(tets.len(), n_live),
            vertices: behind(vertices.len(), n_vertices),
            ..MeshState::default()
        };
        let mut pages = Self { tets, vertices, rest: FlatPages::default() };
        if common.is_none() {
            let mut with_attributes = Mesh::with_state(pages, state);
            for (t, &(region, flags)) in (0u32..).zip(&mesh.attributes) {
                if t & SLOT_MASK < RECORDS {
                    with_attributes.set_tet_attribute(t, region, flags);
                }
            }
            pages = with_attributes.into_pages();
        }
        (pages, state)
    }
}

impl Pages for ArrayPages {
    #[inline(always)]
    fn read<const K: usize>(&mut self, id: u32) -> &Slot {
        match K {
            kind::TETS => bytemuck::cast_ref(&self.tets[id as usize]),
            kind::VERTICES => bytemuck::cast_ref(&self.vertices[id as usize]),
            _ => self.rest.read::<K>(id),
        }
    }

    #[inline(always)]
    fn read_four<const K: usize>(&mut self, [a, b, c, d]: [u32; 4]) -> [&Slot; 4] {
        match K {
            kind::VERTICES => {
                let at = |v: u32| bytemuck::cast_ref(&self.vertices[v as usize]);
                [at(a), at(b), at(c), at(d)]
            }
            kind::TETS => {
                let at = |t: u32| bytemuck::cast_ref(&self.tets[t as usize]);
                [at(a), at(b), at(c), at(d)]
            }
            _ => self.rest.read_four::<K>([a, b, c, d]),
        }
    }

    #[inline(always)]
    fn write<const K: usize>(&mut self, id: u32) -> &mut Slot {
        match K {
            kind::TETS => bytemuck::cast_mut(&mut self.tets[id as usize]),
            kind::VERTICES => bytemuck::cast_mut(&mut self.vertices[id as usize]),
            _ => self.rest.write::<K>(id),
        }
    }

    fn n_pages<const K: usize>(&self) -> u32 {
        match K {
            kind::TETS => (self.tets.len() >> SLOT_BITS) as u32,
            kind::VERTICES => (self.vertices.len() >> SLOT_BITS) as u32,
            _ => self.rest.n_pages::<K>(),
        }
    }

    fn append_page<const K: usize>(&mut self) -> u32 {
        let page = self.n_pages::<K>();
        match K {
            kind::TETS => self.tets.resize(self.tets.len() + SLOTS, EMPTY),
            kind::VERTICES => {
                let unused = Vertex::new(Point::INFINITY, 0.0, false, NONE);
                self.vertices.resize(self.vertices.len() + SLOTS, unused);
            }
            _ => return self.rest.append_page::<K>(),
        }
        page
    }

    fn drop_front<const K: usize>(&mut self, n: u32) {
        self.rest.drop_front::<K>(n);
    }

    fn clear<const K: usize>(&mut self) {
        self.rest.clear::<K>();
    }
}

/// Brings tetrahedra and vertices back. A vertex that is gone lies at infinity.
fn take_back(to: &mut FlatMesh, mesh: &mut Mesh<ArrayPages>, common: Option<Attribute>) {
    let n = mesh.pages().tets.len();
    to.held.resize(n, false);
    match common {
        Some(common) => to.attributes.resize(n, common),
        None => {
            to.attributes.resize(n, (0, 0));
            for k in 0..dense(n as u32) {
                to.attributes[sparse(k) as usize] = mesh.tet_attribute(sparse(k));
            }
        }
    }
    let pages = mesh.pages_mut();
    to.tets = std::mem::take(&mut pages.tets);
    to.vertices = std::mem::take(&mut pages.vertices);
    to.free.clear();
    for (t, tet) in (0u32..).zip(&mut to.tets) {
        if tet.is_live() {
            tet.node[EXAMINED] |= MARK;
        } else {
            *tet = EMPTY;
            to.free.push(t);
        }
    }
    for vertex in to.vertices.iter_mut().filter(|v| v.note == NONE) {
        vertex.set(Point::INFINITY, 0.0);
    }
}

impl Region {
    /// Lists what is left to mend: it lies in these pages, or where no page has an id.
    fn list_to_mend(&mut self, pages: &[u32]) {
        let tets = (0u32..).zip(&self.mesh.tets).filter(|&(t, tet)| {
            let may_be = t & SLOT_MASK >= RECORDS || pages.binary_search(&(t >> SLOT_BITS)).is_ok();
            may_be && tet.is_live() && is_to_mend(self.mesh.points(tet), tet.required_faces())
        });
        self.to_mend = Some(tets.map(|(t, _)| t).collect());
    }

    /// Gives the vertices from `first` on that are in use a brick, told by the place of each; forgets others at the end.
    fn place_new(&mut self, first: usize, brick: impl Fn(Point) -> u32) {
        let is_used = |v: &Vertex| v.point.is_finite();
        let n = self.mesh.vertices.iter().rposition(is_used).map_or(0, |last| last + 1);
        self.mesh.vertices.truncate(n.max(first));
        for vertex in &self.mesh.vertices[first..] {
            self.brick_of.push(if is_used(vertex) { brick(vertex.point) } else { OUTSIDE });
        }
    }
}
