//! A block's region in plain arrays: checked out of bricks, worked on, checked in.
//!
//! Checking out reads bricks and changes none; checking in makes new ones. A tetrahedron with a neighbor outside the region is
//! *held*: it keeps brick and slot, so what refers to it from outside stays right. Vertices of bricks outside are copied;
//! they cannot move meanwhile, for one of their tetrahedra is in this region, and none moves unless all are in one.

use std::sync::Arc;

use tetdb_schema::page::NONE;

use super::brick::{Brick, SLOT_BITS, SLOT_MASK, Slot};
use super::flat::{EMPTY, FlatMesh, RIM, Vertex};
use crate::mesh::anatomy::mark::EXAMINED;
use crate::mesh::anatomy::{MARK, VERTEX_MASK};
use crate::mesh::{FaceRef, Tet};
use tetdb_base::geom::{IdMap, Point};
use tetdb_base::storage::{StorageError, raise};

/// The number of a vertex's brick if that lies outside the region.
pub(super) const OUTSIDE: u32 = NONE;

/// A region in arrays.
#[derive(Default)]
pub(super) struct Region {
    pub mesh: FlatMesh,
    /// Numbers of the region's bricks, in ascending order.
    pub bricks: Vec<u32>,
    /// Per vertex: place of its brick in `bricks`, or [`OUTSIDE`].
    pub brick_of: Vec<u32>,
    /// Numbers of bricks outside that are referred to.
    outside: Vec<u32>,
    /// Per vertex, new ones left out: place in `bricks`, or `bricks.len()` more than that in `outside`, and slot.
    slots: Vec<Slot>,
    /// Notes of the vertices, while the arrays use them.
    notes: Vec<u32>,
    /// Per brick: its first vertex and tetrahedron; at the end how many there are.
    first_vertex: Vec<u32>,
    first_tet: Vec<u32>,
    /// Per brick: true if it held a tetrahedron to be mended. Then the tetrahedra to be mended now; `None` if nobody looked for them.
    was_to_mend: Vec<bool>,
    pub to_mend: Option<Vec<u32>>,
    /// Faces that lead out: face, and the reference beyond as place and slot of a face.
    ways_out: Vec<(FaceRef, Slot)>,
    copies: IdMap<u64, u32>,
    scratch: Scratch,
}

/// Scratch of checking in.
#[derive(Default)]
struct Scratch {
    /// Where each tetrahedron goes: place of the brick, and slot.
    to: Vec<u32>,
    /// Tetrahedra by brick and slot.
    order: Vec<u32>,
    /// Per known brick: the brick whose table was made last with it, and its place there.
    near: Vec<(u32, u32)>,
}

impl Region {
    /// Reads bricks into the arrays; `outside` gives a brick that is not among them.
    pub fn check_out(
        &mut self,
        numbers: &[u32],
        bricks: Vec<Arc<Brick>>,
        outside: &mut dyn FnMut(u32) -> Arc<Brick>,
    ) {
        self.begin(numbers, &bricks);
        let mut beyond: Vec<Arc<Brick>> = Vec::new();
        let mut known = IdMap::<u32, u32>::default();
        let mut bases = Vec::new();
        for (k, brick) in bricks.into_iter().enumerate() {
            bases.clear();
            for &number in &brick.near {
                let base = match numbers.binary_search(&number) {
                    Ok(place) => (self.first_vertex[place], self.first_tet[place], place as u32),
                    Err(_) => {
                        let place = *known.entry(number).or_insert_with(|| {
                            beyond.push(outside(number));
                            self.outside.push(number);
                            self.outside.len() as u32 - 1
                        });
                        (NONE, NONE, place + numbers.len() as u32)
                    }
                };
                bases.push(base);
            }
            let tets = self.first_tet[k]..self.first_tet[k + 1];
            for t in tets {
                self.localize(t, &bases, numbers.len() as u32, &beyond);
            }
        }
    }

    fn begin(&mut self, numbers: &[u32], bricks: &[Arc<Brick>]) {
        let mesh = &mut self.mesh;
        mesh.clear();
        self.bricks.clear();
        self.bricks.extend_from_slice(numbers);
        self.brick_of.clear();
        self.outside.clear();
        self.slots.clear();
        self.notes.clear();
        self.ways_out.clear();
        self.copies.clear();
        self.first_vertex.clear();
        self.first_tet.clear();
        self.was_to_mend.clear();
        self.to_mend = None;
        for (place, brick) in (0u32..).zip(bricks) {
            self.first_vertex.push(mesh.vertices.len() as u32);
            self.first_tet.push(mesh.tets.len() as u32);
            self.was_to_mend.push(brick.to_mend);
            mesh.tets.extend_from_slice(&brick.tets);
            mesh.attributes.extend_from_slice(&brick.attributes);
            for (slot, vertex) in (0u32..).zip(&brick.vertices) {
                mesh.vertices.push(vertex.with_note(0));
                self.notes.push(vertex.note);
                self.brick_of.push(place);
                self.slots.push(Slot { brick: place, slot });
            }
        }
        self.first_vertex.push(mesh.vertices.len() as u32);
        self.first_tet.push(mesh.tets.len() as u32);
        mesh.held.extend(mesh.attributes.iter().map(|&(_, flags)| flags & RIM != 0));
    }

    /// Turns the references of a tetrahedron into places in the arrays.
    #[inline(always)]
    fn localize(
        &mut self,
        t: u32,
        bases: &[(u32, u32, u32)],
        n_inside: u32,
        beyond: &[Arc<Brick>],
    ) {
        let mut tet = self.mesh.tets[t as usize];
        if !tet.is_live() {
            self.mesh.free.push(t);
            return;
        }
        for node in &mut tet.node {
            let reference = *node & VERTEX_MASK;
            let (first, _, place) = bases[(reference >> SLOT_BITS) as usize];
            let slot = reference & SLOT_MASK;
            let v = if first == NONE {
                let brick = &beyond[(place - n_inside) as usize];
                self.copy(place, slot, || brick.vertices[slot as usize])
            } else {
                first + slot
            };
            *node = *node & !VERTEX_MASK | v;
        }
        for i in 0..4 {
            let face = tet.neighbor[i];
            if !face.exists() {
                continue;
            }
            let (_, first, place) = bases[(face.tet() >> SLOT_BITS) as usize];
            let slot = face.tet() & SLOT_MASK;
            tet.neighbor[i] = if first == NONE {
                let beyond = Slot { brick: place, slot: slot << 2 | face.face() as u32 };
                self.ways_out.push((FaceRef::new(t, i), beyond));
                self.mesh.held[t as usize] = true;
                FaceRef::NONE
            } else {
                FaceRef::new(first + slot, face.face())
            };
        }
        self.mesh.tets[t as usize] = tet;
    }

    /// The copy of a vertex outside.
    fn copy(&mut self, place: u32, slot: u32, vertex: impl FnOnce() -> Vertex) -> u32 {
        let key = u64::from(place) << 32 | u64::from(slot);
        *self.copies.entry(key).or_insert_with(|| {
            let vertex = vertex();
            self.mesh.vertices.push(vertex.with_note(0));
            self.notes.push(vertex.note);
            self.brick_of.push(OUTSIDE);
            self.slots.push(Slot { brick: place, slot });
            self.mesh.vertices.len() as u32 - 1
        })
    }

    /// Adds a vertex to the brick at a place of [`Region::bricks`].
    pub fn add_vertex(&mut self, point: Point, h: f32, brick: u32) -> u32 {
        self.mesh.vertices.push(Vertex::new(point, h, false, 0));
        self.brick_of.push(brick);
        self.mesh.vertices.len() as u32 - 1
    }

    /// Numbers of the bricks of all tetrahedra around vertices from `first` on, those outside left out, some several times.
    pub fn bricks_around(&self, first: u32) -> impl Iterator<Item = u32> {
        let tets = self.mesh.tets.iter().filter(|tet| tet.is_live()).map(Tet::vertices);
        let near = tets.filter(move |tet| tet.iter().any(|&v| v >= first)).flatten();
        let places = near.map(|v| self.brick_of[v as usize]).filter(|&place| place != OUTSIDE);
        places.map(|place| self.bricks[place as usize])
    }

    /// Place in the region of the brick that a tetrahedron belongs to; [`OUTSIDE`] if none of its vertices is in the region.
    #[inline(always)]
    pub fn home(&self, tet: &Tet) -> u32 {
        let [a, b, c, d] = tet.vertices().map(|v| self.brick_of[v as usize]);
        a.min(b).min(c.min(d))
    }

    /// Whether a vertex has a tetrahedron outside, or its brick is; whoever moves it must have all.
    pub fn held_vertices(&self, held: &mut Vec<bool>) {
        held.clear();
        held.extend(self.brick_of.iter().map(|&b| b == OUTSIDE));
        for &(face, _) in &self.ways_out {
            for v in self.mesh.tet(face.tet()).vertices() {
                held[v as usize] = true;
            }
        }
    }

    /// Makes bricks of the arrays, in the order of the region's. The one at place `own` gets tetrahedra whose vertices are all outside, which
    /// flips may make.
    pub fn check_in(&mut self, own: u32) -> Vec<Arc<Brick>> {
        let mut scratch = std::mem::take(&mut self.scratch);
        let counts = self.distribute(own, &mut scratch);
        let vertices = self.vertices_of_bricks();
        let n_known = self.bricks.len() + self.outside.len();
        scratch.near.clear();
        scratch.near.resize(n_known, (NONE, 0));
        let mut made = Vec::with_capacity(self.bricks.len());
        let mut from = 0;
        for (place, (vertices, n)) in (0u32..).zip(vertices.into_iter().zip(counts)) {
            let order = &scratch.order[from..from + n as usize];
            from += n as usize;
            let mut brick = Brick { vertices, ..Brick::default() };
            brick.tets.reserve_exact(order.len());
            brick.attributes.reserve_exact(order.len());
            for &t in order {
                self.globalize(t, place, &scratch.to, &mut scratch.near, &mut brick);
            }
            made.push(brick);
        }
        self.restore_ways_out(&scratch.to, &mut made);
        match &self.to_mend {
            Some(tets) => tets.iter().for_each(|&t| {
                made[(scratch.to[t as usize] >> SLOT_BITS) as usize].to_mend = true;
            }),
            None => (made.iter_mut().zip(&self.was_to_mend)).for_each(|(b, &was)| b.to_mend = was),
        }
        self.scratch = scratch;
        made.into_iter().map(Arc::new).collect()
    }

    /// Gives each tetrahedron in use a slot; returns how many slots each brick has.
    fn distribute(&self, own: u32, scratch: &mut Scratch) -> Vec<u32> {
        let n = self.bricks.len();
        scratch.to.clear();
        scratch.to.resize(self.mesh.tets.len(), NONE);
        // Held ones stay where they were.
        let mut held_end = vec![0u32; n];
        let mut is_taken = vec![Vec::new(); n];
        for &(face, _) in &self.ways_out {
            let t = face.tet();
            if scratch.to[t as usize] == NONE {
                let place = self.first_tet.partition_point(|&first| first <= t) - 1;
                let slot = t - self.first_tet[place];
                scratch.to[t as usize] = (place as u32) << SLOT_BITS | slot;
                held_end[place] = held_end[place].max(slot + 1);
                is_taken[place].push(slot);
            }
        }
        for taken in &mut is_taken {
            taken.sort_unstable_by(|a, b| b.cmp(a));
        }
        let mut next = vec![0u32; n];
        for (t, tet) in self.mesh.tets.iter().enumerate() {
            if !tet.is_live() || scratch.to[t] != NONE {
                continue;
            }
            let home = self.home(tet);
            let place = if home == OUTSIDE { own } else { home } as usize;
            while is_taken[place].last() == Some(&next[place]) {
                is_taken[place].pop();
                next[place] += 1;
            }
            scratch.to[t] = (place as u32) << SLOT_BITS | next[place];
            next[place] += 1;
        }
        let counts: Vec<u32> = next.iter().zip(&held_end).map(|(&a, &b)| a.max(b)).collect();
        if counts.iter().any(|&n| n > SLOT_MASK) {
            raise(StorageError::TooMany { what: "tetrahedra in a part of a block" });
        }
        let mut firsts = Vec::with_capacity(n);
        let mut sum = 0;
        for &count in &counts {
            firsts.push(sum);
            sum += count;
        }
        scratch.order.clear();
        scratch.order.resize(sum as usize, NONE);
        for (t, &to) in (0u32..).zip(&scratch.to) {
            if to != NONE {
                let at = firsts[(to >> SLOT_BITS) as usize] + (to & SLOT_MASK);
                scratch.order[at as usize] = t;
            }
        }
        counts
    }

    /// The vertices of each brick, new ones behind.
    fn vertices_of_bricks(&mut self) -> Vec<Vec<Vertex>> {
        let mut all = Vec::with_capacity(self.bricks.len());
        for place in 0..self.bricks.len() {
            let range = self.first_vertex[place] as usize..self.first_vertex[place + 1] as usize;
            let own = self.mesh.vertices[range.clone()].iter().zip(&self.notes[range]);
            all.push(own.map(|(v, &note)| v.with_note(note)).collect::<Vec<_>>());
        }
        for v in self.slots.len()..self.mesh.vertices.len() {
            let place = self.brick_of[v];
            if place == OUTSIDE {
                // It was given back.
                self.slots.push(Slot { brick: NONE, slot: NONE });
                continue;
            }
            let brick = &mut all[place as usize];
            self.slots.push(Slot { brick: place, slot: brick.len() as u32 });
            brick.push(self.mesh.vertices[v].with_note(NONE));
        }
        if all.iter().any(|vertices| vertices.len() > SLOT_MASK as usize) {
            raise(StorageError::TooMany { what: "vertices in a part of a block" });
        }
        all
    }

    /// Adds a tetrahedron to a brick, with references instead of places.
    #[inline(always)]
    fn globalize(
        &self,
        t: u32,
        place: u32,
        to: &[u32],
        near: &mut [(u32, u32)],
        brick: &mut Brick,
    ) {
        if t == NONE {
            brick.tets.push(EMPTY);
            brick.attributes.push((0, 0));
            return;
        }
        let mut tet = *self.mesh.tet(t);
        brick.unexamined += u32::from(tet.node[EXAMINED] & MARK == 0);
        for node in &mut tet.node {
            let slot = self.slots[(*node & VERTEX_MASK) as usize];
            let at = self.near(slot.brick, place, near, brick);
            *node = *node & !VERTEX_MASK | at << SLOT_BITS | slot.slot;
        }
        for face in &mut tet.neighbor {
            if face.exists() {
                let target = to[face.tet() as usize];
                let at = self.near(target >> SLOT_BITS, place, near, brick);
                *face = FaceRef::new(at << SLOT_BITS | target & SLOT_MASK, face.face());
            }
        }
        brick.tets.push(tet);
        brick.attributes.push(self.mesh.attributes[t as usize]);
    }

    /// Place of a known brick in the table of the brick at `place`.
    #[inline(always)]
    fn near(&self, known: u32, place: u32, near: &mut [(u32, u32)], brick: &mut Brick) -> u32 {
        let entry = &mut near[known as usize];
        if entry.0 != place {
            *entry = (place, brick.near.len() as u32);
            brick.near.push(self.number(known));
        }
        entry.1
    }

    fn number(&self, known: u32) -> u32 {
        let n = self.bricks.len();
        let known = known as usize;
        if known < n { self.bricks[known] } else { self.outside[known - n] }
    }

    /// Links held tetrahedra to those outside again.
    fn restore_ways_out(&self, to: &[u32], made: &mut [Brick]) {
        let mut tables: Vec<IdMap<u32, u32>> = Vec::new();
        tables.resize_with(made.len(), IdMap::default);
        for &(face, beyond) in &self.ways_out {
            let target = to[face.tet() as usize];
            let place = (target >> SLOT_BITS) as usize;
            let brick = &mut made[place];
            let number = self.number(beyond.brick);
            let table = &mut tables[place];
            if table.is_empty() {
                table.extend(brick.near.iter().copied().zip(0..));
            }
            let at = *table.entry(number).or_insert_with(|| {
                brick.near.push(number);
                brick.near.len() as u32 - 1
            });
            let slot = at << SLOT_BITS | beyond.slot >> 2;
            let reference = FaceRef::new(slot, (beyond.slot & 3) as usize);
            brick.tets[(target & SLOT_MASK) as usize].neighbor[face.face()] = reference;
        }
    }
}
