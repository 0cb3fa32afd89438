//! A piece set into the mesh: its outer places are inserted one after another, then what fills the space between them is replaced.

use tetdb_schema::page::NONE;

use super::super::candidate::Candidate;
use super::super::field::Field;
use super::super::report::RefineReport;
use super::super::worker::Worker;
use super::claims::Claim;
use super::piece::{OPEN, OuterFace, Piece, Place, Use};
use crate::delaunay::{PointLocation, insertion_key};
use crate::mesh::anatomy::mark::{EXAMINED, IN_CAVITY};
use crate::mesh::anatomy::{FACES, MARK};
use crate::mesh::{FaceRef, Mesh, Tet};
use tetdb_base::geom::{IdMap, Point};
use tetdb_base::storage::{Pages, check_cancelled};

/// No vertex is nearer to an outer place than this, in units of the grain's h: less than the pattern's own are.
const NEAR: f64 = 0.7;
/// A piece that loses places is chosen anew so often.
const TRIES: usize = 4;
/// A piece that loses a greater share of its outer places is given up.
const LOST_MAX: f64 = 0.25;
/// A mesh where so many more pieces did not fit than did is left alone: after recovery it may be far from Delaunay.
const MISFITS_MAX: i32 = 2;
/// A walk begins where the last one ended when that is nearer than this, in units of h.
const NEAR_START: f64 = 4.0;

/// Sets one piece into a mesh after the other.
#[derive(Default)]
pub(super) struct Setter {
    /// Of each place its vertex.
    vertices: Vec<u32>,
    /// The place of each vertex at an outer one.
    placed: IdMap<u32, u32>,
    /// Outer faces of a part by their places in ascending order, and what was found beyond each.
    faces: IdMap<[u32; 3], (OuterFace, FaceRef)>,
    visited: Vec<u32>,
    /// Of each tetrahedron of the piece its id in the mesh.
    ids: Vec<u32>,
    /// How many more pieces did not fit than did.
    misfits: i32,
}

impl Setter {
    /// Inserts the outer places and puts in every part whose outer faces have come to be.
    pub fn set_in<P: Pages>(
        &mut self,
        worker: &mut Worker,
        mesh: &mut Mesh<P>,
        piece: &mut Piece,
        claims: &[Claim],
        report: &mut RefineReport,
    ) {
        self.vertices.clear();
        self.vertices.resize(piece.places.len(), NONE);
        self.placed.clear();
        let mut lost = f64::INFINITY;
        for _ in 0..TRIES {
            lost = self.insert_outer(worker, mesh, piece, claims);
            if lost == 0.0 || lost > LOST_MAX {
                break;
            }
            piece.choose();
        }
        report.inserted += self.placed.len() as u64;
        if lost > 0.0 {
            self.misfits += 1;
            return;
        }
        for (tets, outer) in piece.tets_by_part().iter().zip(piece.outer_by_part()) {
            check_cancelled();
            self.list_faces(piece, outer);
            let start = self.inside(worker, mesh, piece, claims, tets);
            if start.is_some_and(|start| self.flood(mesh, piece, start)) {
                let added = self.fill(worker, mesh, piece, tets);
                report.inserted += added;
                report.set_in += added;
                self.misfits -= 1;
            } else {
                self.misfits += 1;
            }
        }
    }

    /// Whether pieces do not fit this mesh.
    pub fn gives_up(&self) -> bool {
        self.misfits > MISFITS_MAX
    }

    /// Inserts the other places where vertices may be, as points that divide edges are.
    pub fn insert_rest<P: Pages>(
        &mut self,
        worker: &mut Worker,
        mesh: &mut Mesh<P>,
        field: &Field,
        piece: &Piece,
        claims: &[Claim],
        report: &mut RefineReport,
    ) {
        let rest =
            (0..piece.places.len()).filter(|&k| piece.places[k].fits && self.vertices[k] == NONE);
        let key = |k: usize| worker.order.index(piece.places[k].point);
        let mut order: Vec<(u64, usize)> = rest.map(|k| (key(k), k)).collect();
        order.sort_unstable();
        worker.recent.clear();
        let mut before = Point::INFINITY;
        for (_, k) in order {
            let Place { point, h, .. } = piece.places[k];
            let mut tet = worker.last;
            if (point - before).length() > NEAR_START * f64::from(h) {
                tet = nearest_room(point, claims).unwrap_or(tet);
            }
            before = point;
            let candidate = Candidate { point, h, tet };
            report.candidates += 1;
            worker.try_insert(mesh, field, &candidate, report);
        }
    }

    /// Inserts the outer places that are not in the mesh yet; returns the share that could not be.
    fn insert_outer<P: Pages>(
        &mut self,
        worker: &mut Worker,
        mesh: &mut Mesh<P>,
        piece: &mut Piece,
        claims: &[Claim],
    ) -> f64 {
        let wanted = (0..piece.places.len() as u32)
            .filter(|&k| piece.used[k as usize] == Use::Outer && self.vertices[k as usize] == NONE);
        let key = |k: u32| insertion_key(&worker.order, piece.places[k as usize].point);
        let mut order: Vec<(u64, u32)> = wanted.map(|k| (key(k), k)).collect();
        order.sort_unstable();
        let (mut lost, wanted) = (0, order.len().max(1));
        let near = (NEAR * piece.h()).powi(2);
        for (_, k) in order {
            let place = piece.places[k as usize];
            let Some(v) = insert(worker, mesh, place.point, place.h, near, claims) else {
                piece.allowed[k as usize] = false;
                lost += 1;
                continue;
            };
            self.vertices[k as usize] = v;
            self.placed.insert(v, k);
        }
        f64::from(lost) / wanted as f64
    }

    /// Lists the outer faces of a part by their places.
    fn list_faces(&mut self, piece: &Piece, outer: &[OuterFace]) {
        self.faces.clear();
        for &face in outer {
            let corners = piece.corners(face.tet).expect(OPEN);
            let key = ascending(FACES[face.face].map(|k| corners[k]));
            self.faces.insert(key, (face, FaceRef::NONE));
        }
    }

    /// Visits the tetrahedra of the mesh within a part; whether all its outer faces are there, and nothing else is between them.
    fn flood<P: Pages>(&mut self, mesh: &mut Mesh<P>, piece: &Piece, start: u32) -> bool {
        self.visited.clear();
        self.visit(mesh, start);
        let (mut n_found, mut next, mut leaks) = (0, 0, false);
        while next < self.visited.len() && !leaks {
            let tet = mesh.tet(self.visited[next]);
            next += 1;
            let Some(corners) = self.places_of(&tet) else {
                leaks = true;
                break;
            };
            for (i, face) in FACES.into_iter().enumerate() {
                let across = tet.neighbor[i];
                let face = face.map(|k| corners[k]);
                if !across.exists() || tet.is_required(i) {
                    leaks = true;
                } else if let Some((outer, beyond)) = self.faces.get_mut(&ascending(face)) {
                    let seen = piece.corners(outer.tet).expect(OPEN);
                    let seen = FACES[outer.face].map(|k| seen[k]);
                    leaks |= beyond.exists() || !same_side(face, seen);
                    *beyond = across;
                    n_found += 1;
                } else if mesh.tet(across.tet()).node[IN_CAVITY] & MARK == 0 {
                    self.visit(mesh, across.tet());
                }
            }
        }
        for &t in &self.visited {
            mesh.set_mark(t, IN_CAVITY, false);
        }
        !leaks && n_found == self.faces.len()
    }

    fn visit<P: Pages>(&mut self, mesh: &mut Mesh<P>, t: u32) {
        mesh.set_mark(t, IN_CAVITY, true);
        self.visited.push(t);
    }

    /// The places of a tetrahedron's vertices, if all are outer ones of the piece.
    fn places_of(&self, tet: &Tet) -> Option<[u32; 4]> {
        let place = |v: u32| self.placed.get(&v).copied();
        let [a, b, c, d] = tet.vertices().map(place);
        Some([a?, b?, c?, d?])
    }

    /// A tetrahedron of the mesh within a part.
    fn inside<P: Pages>(
        &self,
        worker: &mut Worker,
        mesh: &mut Mesh<P>,
        piece: &Piece,
        claims: &[Claim],
        tets: &[u32],
    ) -> Option<u32> {
        // One with a vertex in the mesh, where the walk begins.
        let outer = |p: u32| self.vertices[p as usize] != NONE;
        let t = tets.iter().find(|&&t| {
            let corners = piece.corners(t).expect(OPEN);
            corners.into_iter().any(outer)
        });
        let corners = piece.corners(*t?)?;
        let middle = corners.iter().map(|&p| piece.places[p as usize].point).sum::<Point>() * 0.25;
        find(worker, mesh, middle, claims).map(|located| located.tet)
    }

    /// Replaces the visited tetrahedra by those of the part; returns how many vertices that has added.
    fn fill<P: Pages>(
        &mut self,
        worker: &mut Worker,
        mesh: &mut Mesh<P>,
        piece: &Piece,
        tets: &[u32],
    ) -> u64 {
        let (region, _) = mesh.tet_attribute(self.visited[0]);
        let recycled = self.visited.len();
        self.ids.resize(piece.n_tets(), NONE);
        for (k, &t) in tets.iter().enumerate() {
            self.ids[t as usize] = match self.visited.get(k) {
                Some(&id) => id,
                None => mesh.take_tet(),
            };
        }
        for &t in self.visited.iter().skip(tets.len()) {
            mesh.free_tet(t);
        }
        let mut added = 0;
        for (k, &t) in tets.iter().enumerate() {
            let (tet, place) = piece.tet(t);
            let corners = piece.corners_of(tet, place).expect(OPEN);
            let mut node = corners.map(|p| {
                if self.vertices[p as usize] == NONE {
                    let place = &piece.places[p as usize];
                    self.vertices[p as usize] = mesh.add_vertex(place.point, place.h);
                    added += 1;
                }
                self.vertices[p as usize]
            });
            let id = self.ids[t as usize];
            let neighbor = std::array::from_fn(|i| {
                if let Some(face) = piece.across_of(tet, place, i) {
                    return FaceRef::new(self.ids[face.tet as usize], face.face);
                }
                self.faces[&ascending(FACES[i].map(|k| corners[k]))].1
            });
            // None of its edges is long.
            node[EXAMINED] |= MARK;
            mesh.set_tet(id, Tet { node, neighbor });
            worker.active.touch(id);
            if k >= recycled {
                mesh.set_tet_attribute(id, region, 0);
            }
        }
        for (outer, beyond) in self.faces.values() {
            let face = FaceRef::new(self.ids[outer.tet as usize], outer.face);
            mesh.set_neighbor(*beyond, face);
        }
        worker.last = self.ids[tets[0] as usize];
        added
    }
}

fn ascending(mut face: [u32; 3]) -> [u32; 3] {
    face.sort_unstable();
    face
}

/// Whether two faces with the same vertices are seen from the same side.
fn same_side(face: [u32; 3], other: [u32; 3]) -> bool {
    let [a, b, c] = face;
    other == [a, b, c] || other == [b, c, a] || other == [c, a, b]
}

/// Inserts a vertex, unless another one is near or a required face or a frozen tetrahedron would have to go.
fn insert<P: Pages>(
    worker: &mut Worker,
    mesh: &mut Mesh<P>,
    p: Point,
    h: f32,
    near: f64,
    claims: &[Claim],
) -> Option<u32> {
    let start = find(worker, mesh, p, claims)?;
    let is_near = |mesh: &mut Mesh<P>, v: u32| (mesh.point(v) - p).length_squared() < near;
    let corners = start.record.vertices();
    if corners.into_iter().any(|v| is_near(mesh, v)) {
        return None;
    }
    let gathered = worker.kernel.gather_constrained(mesh, p, &start, is_near);
    gathered.ok()?;
    if worker.wants_frozen(mesh) {
        worker.kernel.discard(mesh);
        return None;
    }
    let (region, _) = mesh.tet_attribute(start.tet);
    Some(worker.put_in(mesh, p, h, region))
}

/// The tetrahedron that holds `p`: from where the last one was, or from where there was room.
fn find<P: Pages>(
    worker: &mut Worker,
    mesh: &mut Mesh<P>,
    p: Point,
    claims: &[Claim],
) -> Option<PointLocation> {
    if let Ok(located) = worker.kernel.locate(mesh, p, worker.last) {
        return Some(located);
    }
    let start = nearest_room(p, claims)?;
    worker.kernel.locate(mesh, p, start).ok()
}

/// The nearest tetrahedron that had room.
fn nearest_room(p: Point, claims: &[Claim]) -> Option<u32> {
    let rooms = claims.iter().take_while(|claim| claim.tet != NONE);
    let squared = |claim: &Claim| (claim.point() - p).length_squared();
    let nearest = rooms.min_by(|a, b| squared(a).total_cmp(&squared(b)));
    nearest.map(|claim| claim.tet)
}
