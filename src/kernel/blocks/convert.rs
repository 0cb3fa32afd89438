//! Bricks from the pages of a coarse mesh, and pages from bricks.

use std::sync::Arc;

use tetdb_schema::page::NONE;

use super::brick::{Brick, Bricks, SLOT_BITS, SLOT_MASK, Slot};
use super::field::Field;
use super::flat::{Attribute, RIM, Vertex};
use super::part::Part;
use super::partition::KdPartition;
use crate::mesh::anatomy::mark::EXAMINED;
use crate::mesh::anatomy::{MARK, VERTEX_MASK};
use crate::mesh::{FaceRef, Mesh, Scan, Tet, dense, scan_parts, sparse};
use tetdb_base::geom::mix;
use tetdb_base::storage::{Pages, StorageError, raise, spare_threads};

/// A slot of a brick in one word of the scratch map. Bricks are fewer than the bits left.
fn packed(to: Slot) -> u32 {
    to.brick << SLOT_BITS | to.slot
}

fn unpacked(word: u32) -> Slot {
    Slot { brick: word >> SLOT_BITS, slot: word & SLOT_MASK }
}

/// Gives the next slot of a brick.
fn next_slot(counts: &mut [u32], brick: u32) -> Slot {
    let count = &mut counts[brick as usize];
    let slot = *count;
    if slot == SLOT_MASK || brick >= NONE >> SLOT_BITS {
        raise(StorageError::TooMany { what: "tetrahedra in a part of a block" });
    }
    *count += 1;
    Slot { brick, slot }
}

/// Fills empty bricks with a mesh, or with a part of it. Coarse vertices keep their id in their note. What lies beyond the field's place
/// counts as examined. Effects: the scratch map is used up.
pub(super) fn to_bricks<P: Pages>(
    mesh: &mut Mesh<P>,
    field: &Field,
    partition: &KdPartition,
    part: Option<&Part>,
    bricks: &Bricks,
) {
    let n_vertices = dense(mesh.vertex_ids_end());
    let n_tets = dense(mesh.tet_ids_end());
    mesh.reset_scratch(n_vertices + n_tets, NONE);
    // Ids given back have no tetrahedron.
    for (k, _) in Members::new(part, n_tets) {
        let tet = mesh.tet(sparse(k));
        if tet.is_live() {
            tet.vertices().into_iter().for_each(|v| mesh.set_scratch(dense(v), 0));
        }
    }
    let mut counts = vec![0u32; partition.n_bricks()];
    let ranges: Vec<u32> = (0..n_vertices).step_by(AT_ONCE).collect();
    for ranges in ranges.chunks(parts_at_once()) {
        for mut found in scan_parts(mesh, ranges, &VertexHomes { partition, end: n_vertices }) {
            for (brick, vertex) in &found {
                let to = next_slot(&mut counts, *brick);
                mesh.set_scratch(dense(vertex.note), packed(to));
            }
            found.sort_by_key(|&(brick, _)| brick);
            for some in found.chunk_by(|a, b| a.0 == b.0) {
                let vertices = some.iter().map(|&(_, vertex)| vertex);
                bricks.change(some[0].0, |brick| brick.vertices.extend(vertices));
            }
        }
    }
    counts.fill(0);
    let mut members = Members::new(part, n_tets).peekable();
    while members.peek().is_some() {
        for found in scan_parts(mesh, &some_of(&mut members), &TetHomes) {
            for (k, brick) in found {
                mesh.set_scratch(n_vertices + k, packed(next_slot(&mut counts, brick)));
            }
        }
    }
    fill(mesh, field, part, bricks);
    mesh.clear_scratch();
}

/// Vertices, or tetrahedra, that one thread converts at once.
const AT_ONCE: usize = 2_048;

/// Such parts taken together: some megabytes for all threads.
fn parts_at_once() -> usize {
    2 * spare_threads().min(8)
}

/// Parts of the next members.
fn some_of(members: &mut impl Iterator<Item = (u32, bool)>) -> Vec<Vec<(u32, bool)>> {
    let parts = (0..parts_at_once()).map(|_| members.by_ref().take(AT_ONCE).collect::<Vec<_>>());
    parts.filter(|part| !part.is_empty()).collect()
}

/// Scan that returns the vertices marked in the scratch map, from a dense id on, and their bricks.
struct VertexHomes<'a> {
    partition: &'a KdPartition,
    end: u32,
}

impl Scan for VertexHomes<'_> {
    type Part = u32;
    type Output = Vec<(u32, Vertex)>;

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, &from: &u32) -> Self::Output {
        let mut found = Vec::new();
        for k in (from..self.end).take(AT_ONCE) {
            if mesh.scratch(k) == NONE {
                continue;
            }
            let v = sparse(k);
            let (point, h) = mesh.point_and_size(v);
            let vertex = Vertex::new(point, h, mesh.is_fixed(v), v);
            found.push((self.partition.find(point), vertex));
        }
        found
    }
}

/// Scan that returns the bricks of tetrahedra; those not in use are left out.
struct TetHomes;

impl Scan for TetHomes {
    type Part = Vec<(u32, bool)>;
    type Output = Vec<(u32, u32)>;

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, part: &Self::Part) -> Self::Output {
        let mut found = Vec::with_capacity(part.len());
        for &(k, _) in part {
            let tet = mesh.tet(sparse(k));
            if tet.is_live() {
                let [a, b, c, d] = tet.vertices().map(|v| unpacked(mesh.scratch(dense(v))).brick);
                found.push((k, a.min(b).min(c.min(d))));
            }
        }
        found
    }
}

/// Puts tetrahedra into their bricks, in the order of their slots, which the scratch map has behind those of the vertices.
fn fill<P: Pages>(mesh: &mut Mesh<P>, field: &Field, part: Option<&Part>, bricks: &Bricks) {
    let n_vertices = dense(mesh.vertex_ids_end());
    let mut unmatched = 0;
    let mut members = Members::new(part, dense(mesh.tet_ids_end())).peekable();
    while members.peek().is_some() {
        let found = scan_parts(mesh, &some_of(&mut members), &TetSlots { field, part, n_vertices });
        for (placed, code) in found {
            unmatched ^= code;
            for some in placed.chunk_by(|a, b| a.home.brick == b.home.brick) {
                bricks.change(some[0].home.brick, |brick| some.iter().for_each(|p| p.put(brick)));
            }
        }
    }
    // Pages that were changed together with their checksums: the caller then looks for the place.
    assert_eq!(unmatched, 0, "neighbors of different faces");
}

/// A tetrahedron on its way into a brick.
struct PlacedTet {
    tet: Tet,
    attribute: Attribute,
    home: Slot,
    vertices: [Slot; 4],
    across: [Option<Slot>; 4],
    is_due: bool,
}

impl PlacedTet {
    fn put(&self, brick: &mut Brick) {
        let mut tet = self.tet;
        for (node, &to) in tet.node.iter_mut().zip(&self.vertices) {
            *node = *node & !(VERTEX_MASK | MARK) | brick.refer(to);
        }
        for (face, to) in tet.neighbor.iter_mut().zip(self.across) {
            if let Some(to) = to {
                *face = FaceRef::new(brick.refer(to), face.face());
            }
        }
        debug_assert_eq!(brick.tets.len(), self.home.slot as usize);
        if !self.is_due {
            tet.node[EXAMINED] |= MARK;
        }
        brick.unexamined += u32::from(self.is_due);
        brick.tets.push(tet);
        brick.attributes.push(self.attribute);
    }
}

/// Scan that returns tetrahedra by their bricks, and a sum over their faces.
struct TetSlots<'a, 'b> {
    field: &'a Field<'b>,
    part: Option<&'a Part>,
    n_vertices: u32,
}

impl Scan for TetSlots<'_, '_> {
    type Part = Vec<(u32, bool)>;
    type Output = (Vec<PlacedTet>, u64);

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, members: &Self::Part) -> Self::Output {
        let (mut found, mut unmatched) = (Vec::with_capacity(members.len()), 0);
        for &(k, at_rim) in members {
            let mut tet = mesh.tet(sparse(k));
            if !tet.is_live() {
                continue;
            }
            if at_rim && let Some(Part { inside, .. }) = self.part {
                let leads_in = |face: FaceRef| inside.binary_search(&dense(face.tet())).is_ok();
                for face in
                    tet.neighbor.iter_mut().filter(|face| face.exists() && !leads_in(**face))
                {
                    *face = FaceRef::NONE;
                }
            }
            for face in (0..4).map(|i| FaceRef::new(sparse(k), i)) {
                unmatched ^= pair_code(&tet, face);
            }
            let mut slot = |at: u32| unpacked(mesh.scratch(at));
            let vertices = tet.vertices().map(|v| slot(dense(v)));
            let slot_across =
                |face: FaceRef| face.exists().then(|| slot(self.n_vertices + dense(face.tet())));
            let across = tet.neighbor.map(slot_across);
            let home = unpacked(mesh.scratch(self.n_vertices + k));
            let attribute = if at_rim { (k, RIM) } else { mesh.tet_attribute(sparse(k)) };
            let is_due = !at_rim && (self.part.is_none() || self.field.reaches(&mesh.ends(&tet)));
            found.push(PlacedTet { tet, attribute, home, vertices, across, is_due });
        }
        found.sort_unstable_by_key(|placed| (placed.home.brick, placed.home.slot));
        (found, unmatched)
    }
}

/// Dense ids of the tetrahedra that become bricks, ascending, and whether each is at the rim.
enum Members<'a> {
    All(std::ops::Range<u32>),
    Part(std::slice::Iter<'a, u32>, std::slice::Iter<'a, u32>),
}

impl<'a> Members<'a> {
    fn new(part: Option<&'a Part>, n_tets: u32) -> Self {
        match part {
            None => Self::All(0..n_tets),
            Some(Part { inside, rim }) => Self::Part(inside.iter(), rim.iter()),
        }
    }
}

impl Iterator for Members<'_> {
    type Item = (u32, bool);

    fn next(&mut self) -> Option<(u32, bool)> {
        match self {
            Self::All(ids) => ids.next().map(|k| (k, false)),
            Self::Part(inside, rim) => match (inside.as_slice().first(), rim.as_slice().first()) {
                (Some(a), Some(b)) if b < a => rim.next().map(|&k| (k, true)),
                (Some(_), _) => inside.next().map(|&k| (k, false)),
                (None, _) => rim.next().map(|&k| (k, true)),
            },
        }
    }
}

/// A number that a face has on both of its sides if their vertices and references fit, and hardly ever otherwise; 0 on the boundary.
fn pair_code(tet: &Tet, face: FaceRef) -> u64 {
    let across = tet.neighbor[face.face()];
    if !across.exists() {
        return 0;
    }
    let word = |f: FaceRef| u64::from(f.tet()) << 2 | f.face() as u64;
    let (here, there) = (word(face), word(across));
    let vertices = tet.face(face.face()).map(|v| mix(u64::from(v)));
    let of_vertices = vertices[0].wrapping_add(vertices[1]).wrapping_add(vertices[2]);
    mix(of_vertices ^ mix(here.min(there) ^ mix(here.max(there))))
}

/// Where the vertices and tetrahedra of a brick are in pages.
struct Numbers {
    /// Vertices of the coarse mesh, which come first; their ids are in the scratch map from here on.
    n_coarse: u32,
    coarse: u32,
    /// Dense ids of the first new vertex and of the first tetrahedron.
    vertex: u32,
    tet: u32,
}

/// Ids for the tetrahedra of all bricks: those that the part had, then such behind all others.
struct TetIds {
    reused: Vec<u32>,
    behind: u32,
}

impl TetIds {
    #[inline(always)]
    fn id(&self, k: u32) -> u32 {
        sparse(match self.reused.get(k as usize) {
            Some(&id) => id,
            None => self.behind + k - self.reused.len() as u32,
        })
    }
}

/// Writes the bricks back and empties them: coarse vertices under their ids, others behind; tetrahedra in the order of the bricks.
///
/// The mesh must have no tetrahedra but those beyond the part. Returns how many have several required faces. Effects: the scratch map is
/// used up.
pub(super) fn to_pages<P: Pages>(
    bricks: &Bricks,
    n_bricks: u32,
    mesh: &mut Mesh<P>,
    part: Option<Part>,
) -> u64 {
    let mut over_constrained = 0;
    let mut numbers: Vec<Numbers> = Vec::with_capacity(n_bricks as usize);
    let (mut n_coarse, mut n_tets) = (0, 0);
    let mut gone = Vec::new();
    mesh.clear_scratch();
    for number in 0..n_bricks {
        let brick = bricks.get(number);
        let coarse = brick.vertices.iter().take_while(|v| v.note != NONE).count();
        let vertex = dense(mesh.vertex_ids_end());
        numbers.push(Numbers { n_coarse: coarse as u32, coarse: n_coarse, vertex, tet: n_tets });
        n_tets += brick.tets.len() as u32;
        for (k, vertex) in brick.vertices.iter().enumerate() {
            if k < coarse {
                mesh.set_scratch(n_coarse, vertex.note);
                n_coarse += 1;
                if !vertex.is_fixed() {
                    mesh.set_point(vertex.note, vertex.point);
                    mesh.set_size(vertex.note, vertex.h());
                }
                gone.extend((!vertex.point.is_finite()).then_some(vertex.note));
            } else {
                let v = mesh.add_vertex_behind(vertex.point, vertex.h());
                gone.extend((!vertex.point.is_finite()).then_some(v));
            }
        }
    }
    let reused = part.map_or_else(Vec::new, |part| part.inside);
    let behind = mesh.take_tets(n_tets.saturating_sub(reused.len() as u32));
    let ids = TetIds { reused, behind };
    let mut unused: Vec<u32> =
        ids.reused.iter().skip(n_tets as usize).map(|&id| sparse(id)).collect();
    let mut at_rim = Vec::new();
    let (mut k, mut first) = (0, 0);
    while first < n_bricks {
        let batch: Vec<_> =
            (first..n_bricks).take(BRICKS).map(|number| bricks.take(number)).collect();
        first += batch.len() as u32;
        let parts: Vec<u32> = (0..batch.len() as u32).collect();
        let scan = Renumbered { batch: &batch, numbers: &numbers, ids: &ids };
        let tets = scan_parts(mesh, &parts, &scan);
        for (brick, (tets, n)) in batch.iter().zip(tets) {
            over_constrained += n;
            for (tet, &attribute) in tets.into_iter().zip(&brick.attributes) {
                let t = ids.id(k);
                k += 1;
                mesh.place_tet(t, tet);
                if attribute.1 & RIM != 0 {
                    let kept =
                        (0..4).map(|i| (FaceRef::new(sparse(attribute.0), i), tet.neighbor[i]));
                    at_rim.extend(kept.filter(|(_, inside)| inside.exists()));
                    unused.push(t);
                } else if !tet.is_live() {
                    unused.push(t);
                } else if attribute != (0, 0) || !ids.reused.is_empty() {
                    mesh.set_tet_attribute(t, attribute.0, attribute.1);
                }
            }
        }
    }
    at_rim.into_iter().for_each(|(kept, inside)| mesh.link(kept, inside));
    unused.into_iter().rev().for_each(|t| mesh.free_tet(t));
    gone.into_iter().rev().for_each(|v| mesh.free_vertex(v));
    mesh.clear_scratch();
    over_constrained
}

/// Bricks renumbered at once: some megabytes.
const BRICKS: usize = 128;

/// Scan that returns the tetrahedra of a brick under their ids, and how many have several required faces.
struct Renumbered<'a> {
    batch: &'a [Arc<Brick>],
    numbers: &'a [Numbers],
    ids: &'a TetIds,
}

impl Scan for Renumbered<'_> {
    type Part = u32;
    type Output = (Vec<Tet>, u64);

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, &part: &u32) -> Self::Output {
        let brick = &self.batch[part as usize];
        let mut over_constrained = 0;
        let mut tets = brick.tets.clone();
        for out in tets.iter_mut().filter(|tet| tet.is_live()) {
            over_constrained += u64::from((0..4).filter(|&i| out.is_required(i)).count() > 1);
            for node in &mut out.node {
                let at = brick.resolve(*node & VERTEX_MASK);
                let there = &self.numbers[at.brick as usize];
                let v = match at.slot.checked_sub(there.n_coarse) {
                    Some(new) => sparse(there.vertex + new),
                    None => mesh.scratch(there.coarse + at.slot),
                };
                *node = *node & !(VERTEX_MASK | MARK) | v;
            }
            for face in &mut out.neighbor {
                if let Some(at) = brick.across(*face) {
                    let t = self.ids.id(self.numbers[at.brick as usize].tet + at.slot);
                    *face = FaceRef::new(t, face.face());
                }
            }
        }
        (tets, over_constrained)
    }
}
