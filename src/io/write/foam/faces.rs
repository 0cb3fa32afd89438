//! Faces of one sub-domain after the other: the cells on both sides of each face, and its place in the files.
//!
//! The faces of a sub-domain's tetrahedra are sorted by their vertices, so that the two sides of a face meet. A face with one side lies on the
//! boundary or between sub-domains, and meets its record there, sorted alike. Numbers are those of the sub-domain, but for the cells behind
//! an interface.

use std::collections::BTreeMap;

use super::super::WriteError;
use super::super::error::Result;
use super::super::merged::{Merged, OpenedPart};
use tetdb_base::storage::{Sorted, Sorter, sort_record};
use tetdb_schema::record::{FACES, NO_TET, SealedFacet};
use tetdb_store::sealed::{MergeReader, Subdomain, sorted_face};

sort_record! {
    /// A face of a tetrahedron.
    struct CellFace {
        vertices: [u32; 3],
        /// 2 · tetrahedron + 1 if the ascending vertices are an odd permutation of its face.
        cell_odd: u32,
    }
}

sort_record! {
    /// An input triangle.
    struct FacetFace {
        vertices: [u32; 3],
        label: u32,
        is_odd: bool,
        /// Filled on both sides.
        is_inner: bool,
    }
}

sort_record! {
    /// An interface face seen from one side.
    struct InterfaceCell {
        cut: u32,
        index: u32,
        rank: u32,
        /// Number in the whole.
        cell: u32,
        other: u32,
        vertices: [u32; 3],
    }
}

sort_record! {
    /// An interface face seen from one side, with what is behind it.
    struct CellBehind {
        rank: u32,
        vertices: [u32; 3],
        other: u32,
        cut: u32,
        index: u32,
        /// Number in the whole of the cell behind it; [`NO_TET`] where that cell is not written.
        cell: u32,
    }
}

sort_record! {
    /// A face with cells on both sides.
    pub(super) struct InnerFace {
        pub owner: u32,
        pub neighbor: u32,
        /// Counter-clockwise seen from outside the owner.
        pub vertices: [u32; 3],
        pub zone: u32,
    }
}

sort_record! {
    /// A face on the boundary.
    pub(super) struct PatchFace {
        /// Label of the face; numbers behind all labels stand for sub-domains that are not written.
        pub patch: u32,
        pub owner: u32,
        /// Counter-clockwise seen from outside the owner.
        pub vertices: [u32; 3],
    }
}

sort_record! {
    /// A face between two sub-domains that are written, in the order of both.
    pub(super) struct SharedFace {
        /// The other one.
        pub other: u32,
        pub cut: u32,
        pub index: u32,
        pub owner: u32,
        /// Counter-clockwise seen from outside the owner.
        pub vertices: [u32; 3],
        pub zone: u32,
    }
}

sort_record! {
    /// A face towards a later sub-domain, in the order of the whole.
    pub(super) struct UpperFace {
        pub owner: u32,
        /// Number in the whole of the cell behind it.
        pub cell: u32,
        /// Counter-clockwise seen from outside the owner.
        pub vertices: [u32; 3],
        pub zone: u32,
        pub other: u32,
        pub cut: u32,
        pub index: u32,
    }
}

/// No zone.
pub(super) const NO_ZONE: u32 = 0;

/// The zone of an inner input triangle: its label, and whether the face has the opposite direction.
pub(super) fn zone_of(zone: u32) -> Option<(u32, bool)> {
    Some(((zone >> 1).checked_sub(1)?, zone & 1 == 1))
}

/// Counts of the faces, made before any is written.
#[derive(Default)]
pub(super) struct Census {
    /// For each sub-domain, the number of faces of each patch.
    pub patches: Vec<BTreeMap<u32, u64>>,
    /// For each sub-domain, the number of faces between it and each other one that is written.
    pub between: Vec<BTreeMap<u32, u64>>,
    /// For each label, the number of input triangles with cells on both sides.
    pub zones: BTreeMap<u32, u64>,
}

impl Census {
    /// Faces with both cells in sub-domain `p`, which has `n_tets`.
    pub fn n_inner(&self, p: usize, n_tets: u64) -> u64 {
        let of = |map: &BTreeMap<u32, u64>| map.values().sum::<u64>();
        (4 * n_tets).saturating_sub(of(&self.patches[p]) + of(&self.between[p])) / 2
    }
}

/// The faces of one sub-domain, each list sorted.
pub(super) struct PartFaces {
    pub inner: Sorted<InnerFace>,
    pub outer: Sorted<PatchFace>,
    pub between: Sorted<SharedFace>,
    pub uppers: Sorted<UpperFace>,
}

/// The lists of one sub-domain being gathered.
struct FaceLists {
    inner: Sorter<InnerFace>,
    outer: Sorter<PatchFace>,
    between: Sorter<SharedFace>,
    uppers: Sorter<UpperFace>,
}

/// All faces, sub-domain by sub-domain.
pub(super) struct FaceWalk {
    behind: MergeReader<CellBehind>,
    pub census: Census,
    /// Patches from this one on stand for sub-domains that are not written.
    first_interface: u32,
}

impl FaceWalk {
    /// Reads input triangles and interfaces, and counts them. Errors: damage, the disk.
    pub fn new(mesh: &mut Merged) -> Result<Self> {
        let mut walk = Self {
            behind: MergeReader::new(Sorter::new(mesh.dir(), 0).finish()?),
            census: Census::default(),
            first_interface: mesh.n_labels(),
        };
        let sides = walk.count_patches(mesh)?;
        walk.behind = MergeReader::new(walk.pair(mesh, sides)?);
        Ok(walk)
    }

    /// Counts the faces of patches and zones; returns the interface faces.
    fn count_patches(&mut self, mesh: &mut Merged) -> Result<Sorted<InterfaceCell>> {
        let parts = mesh.parts();
        let mut sides = Sorter::new(mesh.dir(), mesh.sorter_bytes());
        for (p, row) in parts.iter().enumerate() {
            let OpenedPart { mut part, numbers } = mesh.open_part(p)?;
            let mut patches = BTreeMap::new();
            for facet in part.facets() {
                let facet = facet?;
                if facet.triangle >= mesh.support_first() {
                    continue;
                }
                let is_cell = |&tet: &u32| tet != NO_TET && numbers.tet(tet).is_some();
                if is_inner(mesh, &facet) {
                    *self.census.zones.entry(facet.label).or_default() += 1;
                } else if facet.tets.iter().any(is_cell) {
                    *patches.entry(facet.label).or_default() += 1;
                }
            }
            for face in part.interfaces() {
                let face = face?;
                let Some(cell) = numbers.tet(face.tet) else {
                    continue;
                };
                let is_written = parts.iter().any(|part| part.rank == face.other);
                if !is_written && !mesh.is_of_regions() {
                    *patches.entry(self.first_interface + face.other).or_default() += 1;
                }
                sides.push(InterfaceCell {
                    cut: face.cut,
                    index: face.index,
                    rank: row.rank,
                    cell: cell as u32,
                    other: face.other,
                    vertices: sorted_face(face.vertices).0,
                })?;
            }
            self.census.patches.push(patches);
        }
        Ok(sides.finish()?)
    }

    /// Finds the cell behind each interface face; counts the faces between sub-domains that are written.
    fn pair(&mut self, mesh: &Merged, sides: Sorted<InterfaceCell>) -> Result<Sorted<CellBehind>> {
        let parts = mesh.parts();
        let mut between = vec![BTreeMap::new(); parts.len()];
        let mut behind = Sorter::new(mesh.dir(), mesh.sorter_bytes());
        let (mut sides, mut both) = (MergeReader::new(sides), Vec::new());
        while sides.next_group(&mut both, |a, b| (a.cut, a.index) == (b.cut, b.index))? {
            // Where only some regions are written, input triangles alone bound them.
            if both.len() == 1 && mesh.is_of_regions() {
                continue;
            }
            for (side, back) in both.iter().zip([both.get(1), both.first()]) {
                let &InterfaceCell { cut, index, rank, other, vertices, .. } = side;
                let back = back.filter(|_| both.len() == 2);
                let cell = back.map_or(NO_TET, |back| back.cell);
                behind.push(CellBehind { rank, vertices, other, cut, index, cell })?;
                let place = parts.iter().position(|part| part.rank == rank);
                if let (Some(_), Some(p)) = (back, place) {
                    *between[p].entry(other).or_default() += 1;
                }
            }
        }
        self.census.between = between;
        Ok(behind.finish()?)
    }

    /// The faces of the next sub-domain, number `p`. Errors: damage, the disk.
    pub fn part(&mut self, mesh: &mut Merged, p: usize) -> Result<PartFaces> {
        let mut opened = mesh.open_part(p)?;
        let cells = cell_faces(mesh, &mut opened)?;
        let OpenedPart { mut part, numbers } = opened;
        let (dir, bytes) = (mesh.dir(), mesh.sorter_bytes());
        let mut facets = MergeReader::new(facet_faces(mesh, &mut part)?);
        let mut lists = FaceLists {
            inner: Sorter::new(dir, bytes),
            outer: Sorter::new(dir, bytes / 4),
            between: Sorter::new(dir, bytes / 4),
            uppers: Sorter::new(dir, bytes / 4),
        };
        let n_tets = mesh.parts()[p].n_tets;
        let (mut cells, mut sides) = (MergeReader::new(cells), Vec::new());
        while cells.next_group(&mut sides, |a, b| a.vertices == b.vertices)? {
            let sorted = sides[0].vertices;
            let (owner, is_odd) = (sides[0].cell_odd >> 1, sides[0].cell_odd & 1 == 1);
            let vertices = turned(sorted, is_odd);
            let facet = facets.find(|f| f.vertices.cmp(&sorted))?;
            let zone = (facet.filter(|f| f.is_inner))
                .map_or(NO_ZONE, |f| (f.label + 1) << 1 | u32::from(f.is_odd != is_odd));
            match sides[..] {
                [_] => {
                    let outside = (sorted, facet.map(|f| f.label));
                    let face = InnerFace { owner, neighbor: NO_TET, vertices, zone };
                    self.push_outside(&part, numbers.first_tet, face, outside, &mut lists)?;
                }
                [_, back]
                    if back.cell_odd >> 1 != owner && u64::from(back.cell_odd >> 1) < n_tets =>
                {
                    let neighbor = back.cell_odd >> 1;
                    lists.inner.push(InnerFace { owner, neighbor, vertices, zone })?;
                }
                _ => return Err(broken(&part, owner, "has a face twice")),
            }
        }
        Ok(PartFaces {
            inner: lists.inner.finish()?,
            outer: lists.outer.finish()?,
            between: lists.between.finish()?,
            uppers: lists.uppers.finish()?,
        })
    }

    /// Adds a face with one cell in the sub-domain: between sub-domains, or on the boundary.
    fn push_outside(
        &mut self,
        part: &Subdomain,
        first_tet: u64,
        face: InnerFace,
        (sorted, label): ([u32; 3], Option<u32>),
        lists: &mut FaceLists,
    ) -> Result<()> {
        let InnerFace { owner, vertices, zone, .. } = face;
        let place = (part.id().rank(), sorted);
        let behind = self.behind.find(|b| (b.rank, b.vertices).cmp(&place))?;
        let patch = match (behind, label) {
            (Some(CellBehind { other, cut, index, cell, .. }), _) if cell != NO_TET => {
                lists.between.push(SharedFace { other, cut, index, owner, vertices, zone })?;
                if u64::from(cell) > first_tet {
                    let upper = UpperFace { owner, cell, vertices, zone, other, cut, index };
                    lists.uppers.push(upper)?;
                }
                return Ok(());
            }
            (Some(behind), _) => self.first_interface + behind.other,
            (None, Some(label)) => label,
            (None, None) => {
                let what = "has a face with nothing behind it that is not of the surface";
                return Err(broken(part, owner, what));
            }
        };
        Ok(lists.outer.push(PatchFace { patch, owner, vertices })?)
    }
}

/// The faces of all tetrahedra that are written.
fn cell_faces(
    mesh: &Merged,
    OpenedPart { part, numbers }: &mut OpenedPart,
) -> Result<Sorted<CellFace>> {
    let mut cells = Sorter::new(mesh.dir(), mesh.sorter_bytes());
    for chunk in 0..part.tet_summaries().len() {
        let chunk = part.tet_chunk(chunk as u32)?;
        for (tet, record) in (chunk.first..).zip(&chunk.records) {
            let Some(number) = numbers.tet(tet) else {
                continue;
            };
            let cell = (number - numbers.first_tet) as u32;
            for face in FACES {
                let (vertices, odd) = sorted_face(face.map(|v| record.nodes[v]));
                let cell_odd = cell << 1 | u32::from(odd);
                cells.push(CellFace { vertices, cell_odd })?;
            }
        }
        mesh.advance(chunk.records.len());
    }
    Ok(cells.finish()?)
}

/// The input triangles.
fn facet_faces(mesh: &Merged, part: &mut Subdomain) -> Result<Sorted<FacetFace>> {
    let mut facets = Sorter::new(mesh.dir(), mesh.sorter_bytes() / 4);
    for facet in part.facets() {
        let facet = facet?;
        if facet.triangle < mesh.support_first() {
            let (vertices, is_odd) = sorted_face(facet.vertices);
            let (label, is_inner) = (facet.label, is_inner(mesh, &facet));
            facets.push(FacetFace { vertices, label, is_odd, is_inner })?;
        }
    }
    Ok(facets.finish()?)
}

/// Ascending vertices, or with the last two exchanged.
fn turned([a, b, c]: [u32; 3], odd: bool) -> [u32; 3] {
    if odd { [a, c, b] } else { [a, b, c] }
}

/// Returns whether cells are written on both sides.
fn is_inner(mesh: &Merged, facet: &SealedFacet) -> bool {
    let is_written = |&region: &u32| region != 0 && mesh.writes(region);
    facet.regions.iter().all(is_written)
}

pub(super) fn broken(part: &Subdomain, tet: u32, what: &str) -> WriteError {
    part.damaged(format!("tetrahedron {tet} {what}")).into()
}
