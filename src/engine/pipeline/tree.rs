//! The bisection tree: which parts there are, and what is known of each.
//!
//! A part is a run of ranks, named by its first. A cut is named by the first rank of its high side: so cuts are numbered from left to
//! right, and the tree follows from the number of sub-domains alone.

use rkyv::{Archive, Deserialize, Serialize};

use crate::pipeline::error::PipelineError;
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::{Backing, DiskPath, Pager, StoreFile, kind};
use tetdb_kernel::bisect::{Plane, Zone};
use tetdb_kernel::mesh::{MESH_STATE_WORDS, Mesh, MeshState};
use tetdb_schema::page::STORED_BYTES;
use tetdb_store::sealed::SealedError;
use tetdb_store::store::{Catalog, StoreError};

/// Numbers of the catalog's blobs.
pub mod blob {
    pub const SIZE_FIELD: u32 = 1;
    /// The version of the recipe the store was begun with.
    pub const RECIPE: u32 = 2;
    /// How many sub-domains there will be.
    pub const SUBDOMAINS: u32 = 3;
    /// The box of the surface: six numbers.
    pub const BOUNDS: u32 = 4;
    /// Of each part: its mesh.
    pub const PART: u32 = 1 << 20;
    /// Of each cut: its plane.
    pub const CUT: u32 = 2 << 20;
    /// Of each cut: who owns its faces.
    pub const OWNERS: u32 = 3 << 20;
    /// Of each sealed sub-domain: regions and interfaces.
    pub const SEALED: u32 = 4 << 20;
    /// Of each sub-domain meshed again with other sizes: its size field, and in words what was asked for.
    pub const FIELD: u32 = 5 << 20;
    pub const ASKED: u32 = 6 << 20;
    /// The last three as they were before the last change.
    pub const SEALED_BEFORE: u32 = 7 << 20;
    pub const FIELD_BEFORE: u32 = 8 << 20;
    pub const ASKED_BEFORE: u32 = 9 << 20;
    /// Of each cut whose stages are kept: faces of its interface, before and after the choice.
    pub const FACES: u32 = 10 << 20;
}

/// Ranks `first..first + count`.
#[derive(Archive, Serialize, Deserialize, Clone, Copy, Debug, PartialEq, Eq)]
pub struct TreePart {
    pub first: u32,
    pub count: u32,
}

impl TreePart {
    /// The cut that divides it: the first rank of its high child.
    pub fn cut(self) -> u32 {
        self.first + self.count / 2
    }

    pub fn children(self) -> [Self; 2] {
        let low = self.count / 2;
        [
            Self { first: self.first, count: low },
            Self { first: self.first + low, count: self.count - low },
        ]
    }

    /// Share of the load that belongs to the low child.
    pub fn low_share(self) -> f64 {
        f64::from(self.count / 2) / f64::from(self.count)
    }

    /// Whether a tree of `n` sub-domains has it.
    fn is_of(self, n: u32) -> bool {
        let mut at = Self { first: 0, count: n };
        while at != self && at.count > 1 {
            let [low, high] = at.children();
            at = if self.first < high.first { low } else { high };
        }
        at == self
    }

    /// The cuts above it, from the top, in a tree of `n` sub-domains that has it.
    pub fn cuts_above(self, n: u32) -> Vec<u32> {
        let mut cuts = Vec::new();
        let mut at = Self { first: 0, count: n };
        while at != self {
            cuts.push(at.cut());
            let [low, high] = at.children();
            at = if self.first < high.first { low } else { high };
        }
        cuts
    }
}

/// A part's working mesh, as its file holds it.
#[derive(Archive, Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
pub struct PartMesh {
    pub part: TreePart,
    pub generation: u32,
    pub state: MeshState,
    pub extents: [[u32; 2]; kind::ALL.len()],
    /// Predicted load of the part.
    pub load: f64,
}

const PART_WORDS: usize = 4 + MESH_STATE_WORDS + 2 * kind::ALL.len();

impl PartMesh {
    pub fn to_bytes(self) -> Vec<u8> {
        let load = self.load.to_bits();
        let head = [self.part.count, self.generation, load as u32, (load >> 32) as u32];
        let words = (head.into_iter())
            .chain(self.state.to_words())
            .chain(self.extents.into_iter().flatten());
        words.flat_map(u32::to_le_bytes).collect()
    }

    fn from_bytes(first: u32, bytes: &[u8]) -> Option<Self> {
        let words: Vec<u32> =
            bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        if words.len() != PART_WORDS {
            return None;
        }
        let (state, extents) = words[4..].split_at(MESH_STATE_WORDS);
        Some(Self {
            part: TreePart { first, count: words[0] },
            generation: words[1],
            load: f64::from_bits(u64::from(words[2]) | u64::from(words[3]) << 32),
            state: MeshState::from_words(std::array::from_fn(|i| state[i])),
            extents: std::array::from_fn(|k| [extents[2 * k], extents[2 * k + 1]]),
        })
    }
}

/// How many sub-domains there will be, once that is decided.
pub fn n_subdomains(catalog: &mut Catalog) -> Result<u32, StoreError> {
    let bytes = catalog.blob(blob::SUBDOMAINS)?.unwrap_or_default();
    let word = bytes.first_chunk().map(|&b| u32::from_le_bytes(b));
    Ok(word.unwrap_or(1))
}

/// All parts, in order of rank.
pub fn parts(catalog: &mut Catalog, n: u32) -> Result<Vec<PartMesh>, StoreError> {
    let mut parts = Vec::new();
    let mut first = 0;
    while first < n {
        let bytes = catalog.blob(blob::PART + first)?.unwrap_or_default();
        let part = PartMesh::from_bytes(first, &bytes).filter(|part| part.part.is_of(n));
        let part = part.ok_or_else(|| damaged(catalog, first))?;
        first += part.part.count;
        parts.push(part);
    }
    Ok(parts)
}

pub fn bounds_bytes(bounds: &Aabb) -> Vec<u8> {
    let corners = [bounds.low, bounds.high].map(|p| p.to_array());
    let numbers = corners.into_iter().flatten();
    numbers.flat_map(f64::to_le_bytes).collect()
}

/// The box of the surface.
pub fn bounds(catalog: &mut Catalog) -> Result<Aabb, StoreError> {
    let bytes = catalog.blob(blob::BOUNDS)?.unwrap_or_default();
    let mut numbers =
        bytes.chunks_exact(8).map(|b| f64::from_le_bytes(std::array::from_fn(|i| b[i])));
    let mut corner = || {
        let [x, y, z] = [numbers.next()?, numbers.next()?, numbers.next()?];
        Some(Point::new(x, y, z))
    };
    match (corner(), corner()) {
        (Some(low), Some(high)) => Ok(Aabb { low, high }),
        _ => Err(damaged(catalog, 0)),
    }
}

fn damaged(catalog: &Catalog, first: u32) -> StoreError {
    StoreError::Sealed(SealedError::Content {
        path: catalog.dir().to_owned(),
        subdomain: first,
        what: "its row in the bisection tree is missing or damaged".to_owned(),
    })
}

/// The zone of a cut as it is kept.
#[derive(Archive, Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
pub struct ZoneRow {
    pub cut: u32,
    /// Normal and offset of the plane.
    pub plane: [f64; 4],
}

impl From<Zone> for ZoneRow {
    fn from(zone: Zone) -> Self {
        let [x, y, z] = zone.surface.normal.to_array();
        let plane = [x, y, z, zone.surface.offset];
        Self { cut: zone.cut, plane }
    }
}

impl From<ZoneRow> for Zone {
    fn from(ZoneRow { cut, plane }: ZoneRow) -> Self {
        let [x, y, z, offset] = plane;
        let normal = Point::new(x, y, z);
        let surface = Plane { normal, offset };
        Self { cut, surface }
    }
}

pub fn plane_bytes(zone: ZoneRow) -> Vec<u8> {
    let numbers = zone.plane.into_iter();
    numbers.flat_map(f64::to_le_bytes).collect()
}

/// The zones of the cuts above `part`.
pub fn zones_above(
    catalog: &mut Catalog,
    part: TreePart,
    n: u32,
) -> Result<Vec<ZoneRow>, StoreError> {
    let mut zones = Vec::new();
    for cut in part.cuts_above(n) {
        let bytes = catalog.blob(blob::CUT + cut)?.unwrap_or_default();
        let numbers: Vec<f64> = bytes
            .chunks_exact(8)
            .map(|b| f64::from_le_bytes(std::array::from_fn(|i| b[i])))
            .collect();
        let Ok(plane) = numbers.try_into() else {
            return Err(damaged(catalog, cut));
        };
        zones.push(ZoneRow { cut, plane });
    }
    Ok(zones)
}

/// Generations from a part to what is made of it.
pub const DONE: u32 = 2;

/// Refuses a part of more pages than the file has bytes for, before there is a table of them, and of more records than pages have room for.
fn check_extents(part: &PartMesh, base: &DiskPath) -> Result<(), StoreError> {
    let pages: u64 = part.extents.iter().map(|&[_, n]| u64::from(n)).sum();
    let fits = (part.extents.iter()).all(|[first, n]| first.checked_add(*n).is_some());
    let of = |kind: usize| part.extents[kind][1];
    let has_room = part.state.fits([
        of(kind::TETS),
        of(kind::VERTICES),
        of(kind::FACETS),
        of(kind::INTERFACE_FACES),
    ]);
    if fits && pages * STORED_BYTES as u64 <= base.bytes()? && has_room {
        return Ok(());
    }
    Err(StoreError::Sealed(SealedError::Content {
        path: base.path().to_owned(),
        subdomain: part.part.first,
        what: "its row in the bisection tree says of more pages or records than there are"
            .to_owned(),
    }))
}

/// Opens a part's mesh from the file `base`.
pub fn open_part(
    part: PartMesh,
    base: DiskPath,
    mut backing: Backing,
    frames: u64,
) -> Result<Mesh, PipelineError> {
    check_extents(&part, &base)?;
    backing.base = Some(StoreFile::open_repaired(&base, backing.cache_bytes / 2, false)?);
    let mut pager = Pager::new(frames, Some(backing));
    pager.adopt(part.extents);
    Ok(Mesh::with_state(pager, part.state))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_has_no_more_pages_than_its_file_has_bytes_for() {
        let dir = tempfile::tempdir().expect("a folder");
        let path = dir.path().join("base.redb");
        std::fs::write(&path, vec![0; 5 * STORED_BYTES]).expect("room");
        let base = DiskPath::from(path.as_path());
        let mut part = PartMesh {
            part: TreePart { first: 0, count: 1 },
            generation: 1,
            state: MeshState::default(),
            extents: [[0; 2]; kind::ALL.len()],
            load: 1.0,
        };
        part.extents[1] = [7, 2];
        part.extents[2] = [0, 3];
        assert!(check_extents(&part, &base).is_ok());
        for extent in [[0, 4], [0, u32::MAX], [u32::MAX, 3]] {
            part.extents[2] = extent;
            let refused = check_extents(&part, &base);
            assert!(refused.is_err_and(|e| e.is_damage()), "{extent:?}");
        }
        part.extents[2] = [0, 3];
        for (word, number) in [(0, 1), (3, 3 << 11 | 1), (2, 7), (4, 5)] {
            let mut words = [0; MESH_STATE_WORDS];
            for free_head in [1, 4, 7, 10] {
                words[free_head] = u32::MAX;
            }
            part.state = MeshState::from_words(words);
            assert!(check_extents(&part, &base).is_ok());
            words[word] = number;
            part.state = MeshState::from_words(words);
            let refused = check_extents(&part, &base);
            assert!(refused.is_err_and(|e| e.is_damage()), "{word} {number}");
        }
    }

    #[test]
    fn every_number_of_sub_domains_has_a_tree() {
        for n in [1, 2, 3, 5, 7, 100, 4096] {
            let mut leaves = 0;
            let mut cuts = Vec::new();
            let mut stack = vec![TreePart { first: 0, count: n }];
            while let Some(part) = stack.pop() {
                if part.count == 1 {
                    assert_eq!(part.first, leaves);
                    leaves += 1;
                    continue;
                }
                assert!(part.is_of(n));
                let above = part.cuts_above(n);
                assert!(above.len() <= 12);
                cuts.push(part.cut());
                let [low, high] = part.children();
                assert_eq!(high.first, part.cut());
                assert_eq!(high.cuts_above(n), [above, vec![part.cut()]].concat());
                stack.extend([high, low]);
            }
            cuts.sort_unstable();
            assert_eq!(leaves, n);
            assert_eq!(cuts, (1..n).collect::<Vec<_>>());
        }
    }

    #[test]
    fn only_parts_of_the_tree_are_parts() {
        let part = |first, count| TreePart { first, count };
        assert!(part(0, 1).is_of(1) && part(2, 1).is_of(5) && part(2, 3).is_of(5));
        for (first, count, n) in [(0, 0x99_0001, 1), (0, 0, 1), (1, 1, 1), (0, 3, 5), (1, 2, 4)] {
            assert!(!part(first, count).is_of(n), "{first} {count} of {n}");
        }
    }
}
