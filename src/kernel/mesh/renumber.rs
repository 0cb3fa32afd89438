//! Renumber along the Hilbert curve, so that what is near in space is near in pages.
//!
//! Insertion numbers tetrahedra as they come: after a mesh has grown by half, neighbors lie in pages far apart, and a
//! sweep in id order touches every page again and again. New records are written behind the old ones in sorted order, then
//! the old pages are dropped from the front.

use std::ops::Range;
use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::Relaxed;

use super::anatomy::{Tet, VERTEX_MASK};
use super::cursor::Mesh;
use super::scan::{Scan, scan_parts, tets_of_page};
use super::vertices::VertexTag;
use super::{FaceRef, MeshState};
use super::{dense, sparse};
use tetdb_base::geom::HilbertFrame;
use tetdb_base::storage::{DiskPath, KeyedId, Pages, Sorter, StorageError, kind};
use tetdb_schema::page::{NONE, RECORDS, SLOT_BITS};

/// Where sorting may put its runs, and how many bytes it may hold.
#[derive(Clone, Copy, Debug)]
pub struct Workspace<'a> {
    /// Directory for the runs.
    pub dir: &'a DiskPath,
    /// Most bytes to hold.
    pub memory: u64,
}

/// Renumbers vertices, tetrahedra and the facets' references to them; frees every unused id.
///
/// Vertices are in the order of their positions alone, tetrahedra in that of their first vertex, then of their ids before. Effects: all ids change, the scratch map is used up, and `tet_of` is no longer
/// right. Errors: the disk, while sorting.
pub fn renumber<P: Pages>(
    mesh: &mut Mesh<P>,
    order: &HilbertFrame,
    space: &Workspace,
) -> Result<(), StorageError> {
    mesh.clear_scratch();
    let n_vertices = renumber_vertices(mesh, order, space)?;
    let n_tets = renumber_tets(mesh, n_vertices);
    for n in 0..mesh.n_facets() {
        let mut facet = mesh.facet(n);
        for v in &mut facet.vertices {
            *v = mesh.scratch(dense(*v));
        }
        mesh.set_facet(n, facet);
    }
    for n in 0..mesh.n_interface_faces() {
        let mut face = mesh.interface_face(n);
        face.vertices = face.vertices.map(|v| mesh.scratch(dense(v)));
        mesh.set_interface_face(n, face);
    }
    mesh.clear_scratch();
    let (facets, interface_faces) = (mesh.n_facets(), mesh.n_interface_faces());
    mesh.set_state(MeshState::without_gaps(n_tets, n_vertices, facets, interface_faces));
    Ok(())
}

/// Leaves the new number of each vertex in the scratch map, at its old dense number.
fn renumber_vertices<P: Pages>(
    mesh: &mut Mesh<P>,
    order: &HilbertFrame,
    space: &Workspace,
) -> Result<u32, StorageError> {
    let end = dense(mesh.vertex_ids_end());
    let in_use = InUse::new(end);
    let pages: Vec<u32> = (0..mesh.pages().n_pages::<{ kind::TETS }>()).collect();
    scan_parts(mesh, &pages, &in_use);
    let keys = Keys { in_use, order };
    let mut sorter = Sorter::new(space.dir, space.memory);
    for batch in parts(end).chunks(BATCH) {
        for key in scan_parts(mesh, batch, &keys).into_iter().flatten() {
            sorter.push(key)?;
        }
    }
    let old_pages = mesh.pages().n_pages::<{ kind::VERTICES }>();
    let old_attributes = mesh.pages().n_pages::<{ kind::VERTEX_ATTRIBUTES }>();
    for n in 0..end {
        mesh.set_scratch(n, NONE);
    }
    let (mut n_new, mut sorted) = (0, sorter.finish()?);
    let (mut run, mut found) = (Vec::with_capacity(RUN), Vec::with_capacity(RUN));
    loop {
        run.clear();
        for keyed in sorted.by_ref().take(RUN) {
            run.push(keyed?.id);
        }
        if run.is_empty() {
            break;
        }
        found.clear();
        found.extend(run.iter().map(|&v| (mesh.record::<{ kind::VERTICES }>(v), (0, 0))));
        for (&v, (_, attribute)) in run.iter().zip(&mut found) {
            *attribute = mesh.attribute_before::<{ kind::VERTEX_ATTRIBUTES }>(v, old_attributes);
        }
        for (&v, &(record, attribute)) in run.iter().zip(&found) {
            let to = sparse(n_new);
            mesh.place_record::<{ kind::VERTICES }>((old_pages << SLOT_BITS) + to, record);
            mesh.place_attribute::<{ kind::VERTEX_ATTRIBUTES }>(to, old_attributes, attribute);
            mesh.set_scratch(dense(v), to);
            n_new += 1;
        }
    }
    mesh.pages_mut().drop_front::<{ kind::VERTICES }>(old_pages);
    mesh.pages_mut().drop_front::<{ kind::VERTEX_ATTRIBUTES }>(old_attributes);
    Ok(n_new)
}

/// Numbers looked at as one part: a page of records.
const PART: usize = RECORDS;
/// Records read one kind after the other: the processor waits for many of a kind at once, and for few where kinds take turns.
const RUN: usize = 64;
/// Parts looked at before what was found is written: 5 MB of tetrahedra.
const BATCH: usize = 64;

fn parts(end: u32) -> Vec<Range<u32>> {
    let starts = (0..end).step_by(PART);
    starts.map(|n| n..end.min(n + PART as u32)).collect()
}

/// One bit for each vertex that a tetrahedron has, set while pages are looked at.
struct InUse(Vec<AtomicU64>);

impl InUse {
    fn new(end: u32) -> Self {
        Self((0..end.div_ceil(64)).map(|_| AtomicU64::new(0)).collect())
    }

    #[inline(always)]
    fn word(&self, n: u32) -> (&AtomicU64, u64) {
        (&self.0[n as usize / 64], 1 << (n % 64))
    }

    fn has(&self, n: u32) -> bool {
        let (word, bit) = self.word(n);
        word.load(Relaxed) & bit != 0
    }
}

impl Scan for InUse {
    type Part = u32;
    type Output = ();

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, &page: &u32) {
        tets_of_page(mesh, page, |_, _, tet| {
            for i in 0..4 {
                let (word, bit) = self.word(dense(tet.vertex(i)));
                // Most are set by another tetrahedron already, and a look costs less.
                if word.load(Relaxed) & bit == 0 {
                    word.fetch_or(bit, Relaxed);
                }
            }
        });
    }
}

/// Lists vertices with their places along the curve.
struct Keys<'a> {
    in_use: InUse,
    order: &'a HilbertFrame,
}

impl Scan for Keys<'_> {
    type Part = Range<u32>;
    type Output = Vec<KeyedId>;

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, part: &Range<u32>) -> Vec<KeyedId> {
        let mut keys = Vec::with_capacity(part.len());
        for n in part.clone() {
            let id = sparse(n);
            // A surface vertex may have no tetrahedron, when its facets lie between empty regions.
            if self.in_use.has(n) || mesh.vertex_attribute(id).0 == VertexTag::Surface {
                let key = self.order.index(mesh.point(id));
                keys.push(KeyedId { key, id });
            }
        }
        keys
    }
}

/// Sorts by counting: the vertices' new numbers follow the curve already, and the smallest one of a tetrahedron is its place.
fn renumber_tets<P: Pages>(mesh: &mut Mesh<P>, n_vertices: u32) -> u32 {
    // In the scratch map behind that of vertices: of each tetrahedron its first vertex, then its new number; of each vertex how many
    // tetrahedra come before those it is the first of; of each new number the tetrahedron.
    let numbers = dense(mesh.vertex_ids_end());
    let n_ids = dense(mesh.tet_ids_end());
    let before = numbers + n_ids;
    let old = before + n_vertices;
    for n in before..old {
        mesh.set_scratch(n, 0);
    }
    for batch in parts(n_ids).chunks(BATCH) {
        let found = scan_parts(mesh, batch, &FirstVertices);
        for (n, least) in (batch[0].start..).zip(found.into_iter().flatten()) {
            if least != NONE {
                let count = mesh.scratch(before + dense(least));
                mesh.set_scratch(before + dense(least), count + 1);
            }
            mesh.set_scratch(numbers + n, least);
        }
    }
    let mut n_new = 0;
    for n in before..old {
        let count = mesh.scratch(n);
        mesh.set_scratch(n, n_new);
        n_new += count;
    }
    for n in 0..n_ids {
        let least = mesh.scratch(numbers + n);
        if least != NONE {
            let to = mesh.scratch(before + dense(least));
            mesh.set_scratch(before + dense(least), to + 1);
            mesh.set_scratch(numbers + n, sparse(to));
            mesh.set_scratch(old + to, sparse(n));
        }
    }
    let old_pages = mesh.pages().n_pages::<{ kind::TETS }>();
    let old_attributes = mesh.pages().n_pages::<{ kind::TET_ATTRIBUTES }>();
    let moved = Moved { numbers, old, old_attributes };
    for batch in parts(n_new).chunks(BATCH) {
        let found = scan_parts(mesh, batch, &moved);
        for (n, (tet, attribute)) in (batch[0].start..).zip(found.into_iter().flatten()) {
            mesh.place_tet((old_pages << SLOT_BITS) + sparse(n), tet);
            mesh.place_attribute::<{ kind::TET_ATTRIBUTES }>(sparse(n), old_attributes, attribute);
        }
    }
    mesh.pages_mut().drop_front::<{ kind::TETS }>(old_pages);
    mesh.pages_mut().drop_front::<{ kind::TET_ATTRIBUTES }>(old_attributes);
    n_new
}

/// Finds the least new number among a tetrahedron's vertices; [`NONE`] for an id not in use.
struct FirstVertices;

impl Scan for FirstVertices {
    type Part = Range<u32>;
    type Output = Vec<u32>;

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, part: &Range<u32>) -> Vec<u32> {
        let least = |n| {
            let tet = mesh.tet(sparse(n));
            if !tet.is_live() {
                return NONE;
            }
            (0..4).fold(NONE, |least, i| least.min(mesh.scratch(dense(tet.vertex(i)))))
        };
        part.clone().map(least).collect()
    }
}

/// Tetrahedra in their new order and under new numbers, each with its attribute.
struct Moved {
    numbers: u32,
    old: u32,
    old_attributes: u32,
}

impl Scan for Moved {
    type Part = Range<u32>;
    type Output = Vec<(Tet, (u32, u32))>;

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, part: &Range<u32>) -> Self::Output {
        let mut moved = Vec::with_capacity(part.len());
        for from in part.clone().step_by(RUN) {
            let run = from..part.end.min(from + RUN as u32);
            self.append(mesh, run, &mut moved);
        }
        moved
    }
}

impl Moved {
    /// Appends the tetrahedra of a run of new numbers.
    fn append<P: Pages>(
        &self,
        mesh: &mut Mesh<P>,
        run: Range<u32>,
        moved: &mut Vec<(Tet, (u32, u32))>,
    ) {
        let mut old = [0; RUN];
        let old = &mut old[..run.len()];
        for (t, n) in old.iter_mut().zip(run) {
            *t = mesh.scratch(self.old + n);
        }
        let from = moved.len();
        moved.extend(old.iter().map(|&t| (mesh.tet(t), (0, 0))));
        let moved = &mut moved[from..];
        for (tet, _) in &mut *moved {
            for node in &mut tet.node {
                let v = *node & VERTEX_MASK;
                *node = *node - v + mesh.scratch(dense(v));
            }
        }
        for (tet, _) in &mut *moved {
            for face in &mut tet.neighbor {
                if face.exists() {
                    let to = mesh.scratch(self.numbers + dense(face.tet()));
                    *face = FaceRef::new(to, face.face());
                }
            }
        }
        for (&t, (_, attribute)) in old.iter().zip(moved) {
            *attribute = mesh.attribute_before::<{ kind::TET_ATTRIBUTES }>(t, self.old_attributes);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::delaunay::{Kernel, enclose};
    use tetdb_base::geom::{Aabb, Point};
    use tetdb_base::storage::{FlatPages, Pager};

    /// The mesh as a set: sorted coordinates, neighbors' apexes, attribute.
    fn shape<P: Pages>(mesh: &mut Mesh<P>) -> Vec<String> {
        let mut all = Vec::new();
        let mut from = 0;
        while let Some((t, tet)) = mesh.next_tet(from) {
            from = t + 1;
            let mut corners: Vec<String> = (0..4)
                .map(|i| {
                    let v = tet.vertex(i);
                    let apex = tet.neighbor[i];
                    let apex = apex.exists().then(|| {
                        let other = mesh.tet(apex.tet());
                        assert_eq!(other.neighbor[apex.face()], FaceRef::new(t, i));
                        mesh.point(other.vertex(apex.face()))
                    });
                    format!(
                        "{} {:?} {apex:?} {}",
                        mesh.point(v),
                        mesh.vertex_attribute(v),
                        tet.is_required(i)
                    )
                })
                .collect();
            corners.sort_unstable();
            all.push(format!("{corners:?} {:?}", mesh.tet_attribute(t)));
        }
        all.sort_unstable();
        all
    }

    fn check<P: Pages>(pages: P) {
        let mut mesh = Mesh::new(pages);
        let bounds = Aabb::around([Point::ZERO, Point::ONE]);
        let mut hint = enclose(&mut mesh, &bounds);
        let mut kernel = Kernel::default();
        for i in 0..12_000u32 {
            let f = |k: u32| {
                f64::from(i.wrapping_mul(2_654_435_761).wrapping_mul(k) >> 8) / f64::from(1 << 24)
            };
            let p = Point::new(f(1), f(3), f(7));
            let v = mesh.add_vertex(p, 1.0);
            // The others have no attribute page at all: none may come to them from the new pages.
            if i < 3000 {
                mesh.set_vertex_attribute(v, VertexTag::Surface, i);
            }
            hint = kernel.insert(&mut mesh, v, p, hint).unwrap_or(hint);
            mesh.set_tet_attribute(hint, i % 5, 0);
        }
        mesh.set_required(FaceRef::new(hint, 2), true);
        let before = shape(&mut mesh);
        let dir = tempfile::tempdir().expect("a temporary directory");
        let space = Workspace { dir: &dir.path().into(), memory: 1 << 20 };
        for _ in 0..2 {
            renumber(&mut mesh, &HilbertFrame::new(&bounds), &space).expect("room for runs");
            assert_eq!(shape(&mut mesh), before);
        }
    }

    #[test]
    fn the_mesh_stays_the_same_under_other_numbers() {
        check(FlatPages::default());
        check(Pager::new(1 << 24, None));
    }
}
