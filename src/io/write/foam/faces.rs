//! Faces of one sub-domain after the other: who is on both sides, and what each face is.
//!
//! The faces of a sub-domain's tetrahedra are sorted by their vertices, so that the two sides of one meet; what has one side lies on the
//! boundary or between sub-domains, and meets its record there, sorted alike. Numbers are those of the sub-domain, but for the cells behind
//! an interface.

use std::collections::BTreeMap;
use std::iter::Peekable;

use super::super::WriteError;
use super::super::error::Result;
use super::super::merged::{Merged, Opened};
use tetdb_base::storage::{Sorted, Sorter, StorageError, sort_record};
use tetdb_schema::record::{FACES, NO_TET, SealedFacet};
use tetdb_store::sealed::{SealedError, Subdomain, sorted_face};
use tetdb_store::store::StoreError;

sort_record! {
    /// A face of a tetrahedron.
    struct CellFace {
        vertices: [u32; 3],
        /// 2 · tetrahedron + whether its view of the ascending vertices is odd.
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
    struct Side {
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
    struct Behind {
        rank: u32,
        vertices: [u32; 3],
        other: u32,
        cut: u32,
        index: u32,
        /// Number in the whole of the cell behind it, [`NO_TET`] where that is not written.
        cell: u32,
    }
}

sort_record! {
    /// A face with cells on both sides.
    pub(super) struct Inner {
        pub owner: u32,
        pub neighbor: u32,
        /// Counter-clockwise seen from outside the owner.
        pub vertices: [u32; 3],
        pub zone: u32,
    }
}

sort_record! {
    /// A face on the boundary.
    pub(super) struct Outer {
        /// Its label, or behind all labels the sub-domain behind it, which is not written.
        pub patch: u32,
        pub owner: u32,
        /// Counter-clockwise seen from outside the owner.
        pub vertices: [u32; 3],
    }
}

sort_record! {
    /// A face between two sub-domains that are written, in the order of both.
    pub(super) struct Between {
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
    pub(super) struct Upper {
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

/// The zone of an inner input triangle: its label and whether the face looks against it.
pub(super) fn zone_of(zone: u32) -> Option<(u32, bool)> {
    Some(((zone >> 1).checked_sub(1)?, zone & 1 == 1))
}

/// What is known of the faces before any is written.
#[derive(Default)]
pub(super) struct Census {
    /// Of each sub-domain, faces of each patch.
    pub patches: Vec<BTreeMap<u32, u64>>,
    /// Of each sub-domain, faces between it and each other one that is written.
    pub between: Vec<BTreeMap<u32, u64>>,
    /// Labels of input triangles with cells on both sides.
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
    pub inner: Sorted<Inner>,
    pub outer: Sorted<Outer>,
    pub between: Sorted<Between>,
    pub uppers: Sorted<Upper>,
}

/// All faces, sub-domain by sub-domain.
pub(super) struct FaceWalk {
    behind: Peekable<Sorted<Behind>>,
    pub census: Census,
    /// Patches from this one on stand for sub-domains that are not written.
    first_interface: u32,
}

impl FaceWalk {
    /// Reads input triangles and interfaces, and counts them. Errors: damage, the disk.
    pub fn new(mesh: &mut Merged) -> Result<Self> {
        let parts = mesh.parts();
        let first_interface = mesh.n_labels();
        let places: BTreeMap<u32, usize> =
            (parts.iter().enumerate()).map(|(p, part)| (part.rank, p)).collect();
        let mut census = Census::default();
        let (dir, bytes) = (mesh.dir().to_owned(), mesh.sorter_bytes());
        let mut sides = Sorter::new(&dir, bytes);
        for (p, row) in parts.iter().enumerate() {
            let Opened { mut part, numbers } = mesh.open_part(p)?;
            let mut patches = BTreeMap::new();
            for facet in part.facets() {
                let facet = facet?;
                if facet.triangle >= mesh.fin_first() {
                    continue;
                }
                let is_cell = |&tet: &u32| tet != NO_TET && numbers.tet(tet).is_some();
                if is_inner(mesh, &facet) {
                    *census.zones.entry(facet.label).or_default() += 1;
                } else if facet.tets.iter().any(is_cell) {
                    *patches.entry(facet.label).or_default() += 1;
                }
            }
            for face in part.interfaces() {
                let face = face?;
                let Some(cell) = numbers.tet(face.tet) else {
                    continue;
                };
                if !places.contains_key(&face.other) && !mesh.is_of_regions() {
                    *patches.entry(first_interface + face.other).or_default() += 1;
                }
                sides.push(Side {
                    cut: face.cut,
                    index: face.index,
                    rank: row.rank,
                    cell: cell as u32,
                    other: face.other,
                    vertices: sorted_face(face.vertices).0,
                })?;
            }
            census.patches.push(patches);
            census.between.push(BTreeMap::new());
        }
        let mut behind = Sorter::new(&dir, bytes);
        let mut sides = sides.finish()?.peekable();
        while let Some(side) = sides.next() {
            let side = side?;
            let same = |s: &std::result::Result<Side, StorageError>| matches!(s, Ok(s) if (s.cut, s.index) == (side.cut, side.index));
            let back = sides.next_if(same).transpose()?;
            // Where only some regions are written, what bounds them is of the input.
            if back.is_none() && mesh.is_of_regions() {
                continue;
            }
            let mut push = |s: &Side, cell| {
                behind.push(Behind {
                    rank: s.rank,
                    vertices: s.vertices,
                    other: s.other,
                    cut: s.cut,
                    index: s.index,
                    cell,
                })
            };
            push(&side, back.as_ref().map_or(NO_TET, |back| back.cell))?;
            if let Some(back) = back {
                push(&back, side.cell)?;
                for side in [&side, &back] {
                    let between = &mut census.between[places[&side.rank]];
                    *between.entry(side.other).or_default() += 1;
                }
            }
        }
        Ok(Self { behind: behind.finish()?.peekable(), census, first_interface })
    }

    /// The faces of the next sub-domain, number `p`. Errors: damage, the disk.
    pub fn part(&mut self, mesh: &mut Merged, p: usize) -> Result<PartFaces> {
        let (dir, bytes) = (mesh.dir().to_owned(), mesh.sorter_bytes());
        let Opened { mut part, numbers } = mesh.open_part(p)?;
        let first_tet = numbers.first_tet;
        let rank = part.id().rank();
        let mut cells = Sorter::new(&dir, bytes);
        let n_tets = mesh.parts()[p].n_tets;
        for chunk in 0..part.tet_summaries().len() {
            let chunk = part.tet_chunk(chunk as u32)?;
            for (tet, record) in (chunk.first..).zip(&chunk.records) {
                let Some(number) = numbers.tet(tet) else {
                    continue;
                };
                let cell = (number - first_tet) as u32;
                for face in FACES {
                    let (vertices, odd) = sorted_face(face.map(|v| record.nodes[v]));
                    let cell_odd = cell << 1 | u32::from(odd);
                    cells.push(CellFace { vertices, cell_odd })?;
                }
            }
            mesh.advance(chunk.records.len());
        }
        let mut facets = Sorter::new(&dir, bytes / 4);
        for facet in part.facets() {
            let facet = facet?;
            if facet.triangle >= mesh.fin_first() {
                continue;
            }
            let (vertices, is_odd) = sorted_face(facet.vertices);
            facets.push(FacetFace {
                vertices,
                label: facet.label,
                is_odd,
                is_inner: is_inner(mesh, &facet),
            })?;
        }
        let mut facets = facets.finish()?.peekable();
        let mut inner = Sorter::new(&dir, bytes);
        let mut outer = Sorter::new(&dir, bytes / 4);
        let mut between = Sorter::new(&dir, bytes / 4);
        let mut uppers = Sorter::new(&dir, bytes / 4);
        let mut cells = cells.finish()?.peekable();
        while let Some(face) = cells.next() {
            let face = face?;
            let (sorted, owner, odd) = (face.vertices, face.cell_odd >> 1, face.cell_odd & 1 == 1);
            let vertices = turned(sorted, odd);
            let same = |f: &std::result::Result<CellFace, StorageError>| matches!(f, Ok(f) if f.vertices == sorted);
            let back = cells.next_if(same).transpose()?;
            let facet = at(&mut facets, |f| f.vertices.cmp(&sorted))?;
            let zone = facet
                .filter(|f| f.is_inner)
                .map_or(NO_ZONE, |f| (f.label + 1) << 1 | u32::from(f.is_odd != odd));
            if let Some(back) = back {
                let neighbor = back.cell_odd >> 1;
                if owner == neighbor || u64::from(neighbor) >= n_tets {
                    return Err(broken(&part, owner, "has a face twice"));
                }
                inner.push(Inner { owner, neighbor, vertices, zone })?;
                continue;
            }
            let behind = at(&mut self.behind, |b| (b.rank, b.vertices).cmp(&(rank, sorted)))?;
            match (behind, facet) {
                (Some(b), _) if b.cell != NO_TET => {
                    between.push(Between {
                        other: b.other,
                        cut: b.cut,
                        index: b.index,
                        owner,
                        vertices,
                        zone,
                    })?;
                    if u64::from(b.cell) > first_tet {
                        uppers.push(Upper {
                            owner,
                            cell: b.cell,
                            vertices,
                            zone,
                            other: b.other,
                            cut: b.cut,
                            index: b.index,
                        })?;
                    }
                }
                (Some(b), _) => {
                    outer.push(Outer { patch: self.first_interface + b.other, owner, vertices })?
                }
                (None, Some(facet)) => outer.push(Outer { patch: facet.label, owner, vertices })?,
                (None, None) => {
                    let what = "has a face with nothing behind it that is not of the surface";
                    return Err(broken(&part, owner, what));
                }
            }
        }
        Ok(PartFaces {
            inner: inner.finish()?,
            outer: outer.finish()?,
            between: between.finish()?,
            uppers: uppers.finish()?,
        })
    }
}

/// Ascending vertices, or with the last two exchanged.
fn turned([a, b, c]: [u32; 3], odd: bool) -> [u32; 3] {
    if odd { [a, c, b] } else { [a, b, c] }
}

/// Whether cells are written on both sides.
fn is_inner(mesh: &Merged, facet: &SealedFacet) -> bool {
    let is_written = |&region: &u32| region != 0 && mesh.writes(region);
    facet.regions.iter().all(is_written)
}

/// The record at this place of a sorted list, whose earlier records are passed over.
fn at<R: tetdb_base::storage::SortRecord>(
    list: &mut Peekable<Sorted<R>>,
    order: impl Fn(&R) -> std::cmp::Ordering,
) -> Result<Option<R>> {
    while let Some(record) = list.next_if(|r| r.as_ref().map_or(true, |r| order(r).is_le())) {
        let record = record?;
        if order(&record).is_eq() {
            return Ok(Some(record));
        }
    }
    Ok(None)
}

pub(super) fn broken(part: &Subdomain, tet: u32, what: &str) -> WriteError {
    StoreError::Sealed(SealedError::Content {
        path: part.path().to_owned(),
        subdomain: part.id().rank(),
        what: format!("tetrahedron {tet} {what}"),
    })
    .into()
}
