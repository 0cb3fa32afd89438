//! A saturated mesh in bricks, in the order in which it is sealed: it never becomes pages again.
//!
//! Vertices are numbered brick by brick, in each along the curve. Tetrahedra belong to the brick of their least vertex, and are sorted there
//! by their vertices; so all of them are sorted, and each brick is done for itself, on all threads.

use std::sync::Arc;

use tetdb_schema::page::NONE;
use tetdb_schema::record::SealedTet;

use super::brick::{Brick, Bricks, SLOT_BITS, SLOT_MASK, Slot};
use crate::mesh::{Mesh, Scan, Tet, VertexTag, dense, scan_parts};
use tetdb_base::geom::{HilbertFrame, Point};
use tetdb_base::storage::{Pages, check_cancelled, map_long};

/// Bricks looked at before what was found goes on: some megabytes.
const BATCH: u32 = 256;

/// A vertex of a finished mesh.
#[derive(Clone, Copy, Debug)]
pub struct FinishedVertex {
    /// Its place.
    pub point: Point,
    /// Wanted edge length.
    pub h: f32,
    /// Where it comes from.
    pub tag: VertexTag,
    /// Cut of an interface vertex, and index among the owner's.
    pub owner: (u32, u32),
}

impl FinishedVertex {
    /// A vertex of a mesh in pages.
    pub fn of<P: Pages>(mesh: &mut Mesh<P>, v: u32) -> Self {
        let (point, h) = mesh.point_and_size(v);
        let (tag, index) = mesh.vertex_attribute(v);
        let owner = match tag {
            VertexTag::Interface => mesh.interface_vertex(v),
            _ => (0, index),
        };
        Self { point, h, tag, owner }
    }
}

/// A tetrahedron of a finished mesh, under the numbers of its vertices.
#[derive(Clone, Copy, Debug)]
pub struct FinishedTet {
    /// Rotated so that the least vertex comes first.
    pub tet: SealedTet,
    /// Those of its attribute.
    pub flags: u32,
    /// Bit i: face i is required.
    pub required: u8,
}

impl FinishedTet {
    /// A tetrahedron whose vertices have these numbers, with its region and flags.
    pub fn new(tet: &Tet, nodes: [u32; 4], (region, flags): (u32, u32)) -> Self {
        let rotated = SealedTet { nodes, region }.rotated();
        let mut required = 0;
        if tet.required_faces() != 0 {
            for (i, node) in rotated.nodes.into_iter().enumerate() {
                let old = nodes.iter().position(|&n| n == node).unwrap_or(0);
                required |= u8::from(tet.is_required(old)) << i;
            }
        }
        Self { tet: rotated, flags, required }
    }
}

/// A finished mesh in bricks.
pub struct Finished {
    bricks: Bricks,
    n_bricks: u32,
    n_vertices: u64,
    n_tets: u64,
    /// Tetrahedra that are not in the brick of their least vertex, each with the number of that one; ascending.
    strays: Vec<(u32, Slot)>,
}

/// Counts of one brick, or of all.
#[derive(Default)]
pub(super) struct BrickLook {
    to_mend: bool,
    n_vertices: u64,
    n_tets: u64,
    /// Tetrahedra with several required faces.
    pub over_constrained: u64,
    strays: Vec<(u32, Slot)>,
}

impl Finished {
    /// The mesh of bricks that were looked at.
    pub(super) fn new(bricks: Bricks, n_bricks: u32, look: BrickLook) -> Self {
        let BrickLook { n_vertices, n_tets, mut strays, .. } = look;
        strays.sort_unstable_by_key(|&(home, at)| (home, at.brick, at.slot));
        Self { bricks, n_bricks, n_vertices, n_tets, strays }
    }

    /// Number of vertices of the bricks, those included that are gone.
    pub fn n_vertices(&self) -> u64 {
        self.n_vertices
    }

    /// Number of tetrahedra.
    pub fn n_tets(&self) -> u64 {
        self.n_tets
    }

    /// Leaves so many bytes of memory to others.
    pub fn make_room(&self, bytes: u64) {
        self.bricks.make_room(bytes as usize);
    }

    /// Numbers all vertices from 0 and hands them to `write` in that order, about so many at once. `mesh` has those of the coarse mesh.
    ///
    /// Effects: the scratch map has the numbers of the coarse mesh's vertices, [`NONE`] for those that are gone. Errors: those of `write`.
    pub fn number<P: Pages, E>(
        &self,
        mesh: &mut Mesh<P>,
        frame: &HilbertFrame,
        at_once: usize,
        write: &mut dyn FnMut(&[FinishedVertex]) -> Result<(), E>,
    ) -> Result<(), E> {
        mesh.reset_scratch(dense(mesh.vertex_ids_end()), NONE);
        let mut number = 0;
        let n = at_once as u64 * u64::from(self.n_bricks) / self.n_vertices.max(1);
        for batch in batches(self.n_bricks, n.max(1) as u32) {
            let scan = BrickVertices { bricks: &self.bricks, frame };
            let found = scan_parts(mesh, &batch, &scan);
            let (orders, vertices): (Vec<_>, Vec<_>) = found.into_iter().unzip();
            write(&vertices.concat())?;
            for (&brick, order) in batch.iter().zip(orders) {
                self.bricks.change(brick, |brick| {
                    let mut notes = vec![NONE; brick.vertices.len()];
                    for slot in order {
                        notes[slot as usize] = number;
                        number += 1;
                    }
                    for (vertex, note) in brick.vertices.iter_mut().zip(notes) {
                        if vertex.note != NONE {
                            mesh.set_scratch(dense(vertex.note), note);
                        }
                        vertex.note = note;
                    }
                });
            }
        }
        // One between two empty regions has no tetrahedron, but its facets are still there.
        let mut alone = Vec::new();
        for v in mesh.vertex_ids() {
            if mesh.scratch(dense(v)) == NONE && mesh.vertex_attribute(v).0 == VertexTag::Surface {
                mesh.set_scratch(dense(v), number);
                number += 1;
                alone.push(FinishedVertex::of(mesh, v));
            }
        }
        write(&alone)
    }

    /// All tetrahedra, sorted by their vertices, whose numbers they must have.
    pub fn tets(&self) -> impl Iterator<Item = FinishedTet> + Send + '_ {
        batches(self.n_bricks, BATCH).flat_map(|batch| {
            check_cancelled();
            map_long(&batch, |&number| self.tets_of(number)).into_iter().flatten()
        })
    }

    /// The tetrahedra whose least vertex is in a brick.
    fn tets_of(&self, number: u32) -> Vec<FinishedTet> {
        let from = self.strays.partition_point(|&(home, _)| home < number);
        let strays = self.strays[from..].iter().take_while(|&&(home, _)| home == number);
        let around = Around::of(&self.bricks, number);
        let mut found = Vec::with_capacity(around.brick.tets.len());
        let mut add = |around: &Around, slot: usize| {
            let tet = &around.brick.tets[slot];
            let attribute = around.brick.attributes[slot];
            found.push(FinishedTet::new(tet, around.nodes(tet), attribute));
        };
        for (slot, tet) in around.brick.tets.iter().enumerate() {
            if tet.is_live() && around.brick.home(tet) == number {
                add(&around, slot);
            }
        }
        for &(_, at) in strays {
            add(&Around::of(&self.bricks, at.brick), at.slot as usize);
        }
        found.sort_by_cached_key(|found| {
            found.tet.nodes.into_iter().fold(0, |key, node| key << 32 | u128::from(node))
        });
        found
    }
}

/// Numbers of all bricks, `n` at a time.
fn batches(n_bricks: u32, n: u32) -> impl Iterator<Item = Vec<u32>> + Send {
    (0..n_bricks).step_by(n as usize).map(move |from| (from..n_bricks.min(from + n)).collect())
}

/// A brick and those that it refers to.
struct Around {
    brick: Arc<Brick>,
    near: Vec<Arc<Brick>>,
}

impl Around {
    fn of(bricks: &Bricks, number: u32) -> Self {
        let brick = bricks.get(number);
        let near = bricks.get_all(&brick.near);
        Self { brick, near }
    }

    /// The numbers of a tetrahedron's vertices.
    fn nodes(&self, tet: &Tet) -> [u32; 4] {
        tet.vertices().map(|v| {
            let brick = &self.near[(v >> SLOT_BITS) as usize];
            brick.vertices[(v & SLOT_MASK) as usize].note
        })
    }
}

/// Looks at all bricks; `None` if something of them is to be mended.
pub(super) fn look(bricks: &Bricks, n_bricks: u32) -> Option<BrickLook> {
    let mut all = BrickLook::default();
    for batch in batches(n_bricks, BATCH) {
        check_cancelled();
        for look in map_long(&batch, |&number| look_at(bricks, number)) {
            all.to_mend |= look.to_mend;
            all.n_vertices += look.n_vertices;
            all.n_tets += look.n_tets;
            all.over_constrained += look.over_constrained;
            all.strays.extend(look.strays);
        }
        if all.to_mend {
            return None;
        }
    }
    Some(all)
}

fn look_at(bricks: &Bricks, number: u32) -> BrickLook {
    let brick = bricks.get(number);
    let n_vertices = brick.vertices.len() as u64;
    let mut look = BrickLook { to_mend: brick.to_mend, n_vertices, ..BrickLook::default() };
    for (slot, tet) in (0u32..).zip(&brick.tets).filter(|(_, tet)| tet.is_live()) {
        look.n_tets += 1;
        look.over_constrained += u64::from(tet.required_faces().count_ones() > 1);
        let home = brick.home(tet);
        if home != number {
            look.strays.push((home, Slot { brick: number, slot }));
        }
    }
    look
}

/// Scan that returns the vertices of a brick in the order of their numbers, and their slots.
struct BrickVertices<'a> {
    bricks: &'a Bricks,
    frame: &'a HilbertFrame,
}

impl Scan for BrickVertices<'_> {
    type Part = u32;
    type Output = (Vec<u32>, Vec<FinishedVertex>);

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, &number: &u32) -> Self::Output {
        let brick = self.bricks.get(number);
        let there = (0u32..).zip(&brick.vertices).filter(|(_, v)| v.point.is_finite());
        let mut order: Vec<(u64, u32)> =
            there.map(|(slot, v)| (self.frame.index(v.point), slot)).collect();
        order.sort_unstable();
        let vertex = |&(_, slot): &(u64, u32)| {
            let vertex = &brick.vertices[slot as usize];
            let free = FinishedVertex {
                point: vertex.point,
                h: vertex.h(),
                tag: VertexTag::Free,
                owner: (0, 0),
            };
            match vertex.note {
                NONE => free,
                id => {
                    FinishedVertex { point: free.point, h: free.h, ..FinishedVertex::of(mesh, id) }
                }
            }
        };
        let vertices = order.iter().map(vertex).collect();
        (order.into_iter().map(|(_, slot)| slot).collect(), vertices)
    }
}
