//! Input triangles that bound a filled region, from all sub-domains, in the order of the input.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use tetdb_schema::record::{NO_TET, SealedFacet};

use super::Result;
use super::numbering::PartNumbers;
use super::stream::{Records, scratch, word32, word64};
use crate::store::Sorter;

const BYTES: usize = 52;

/// An input triangle in the merged mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Face {
    /// Its number in the input.
    pub triangle: u64,
    /// Numbers of its vertices, in the input's order.
    pub vertices: [u64; 3],
    pub label: u32,
    /// In front (where the normal points to) and behind; 0 is empty.
    pub regions: [u32; 2],
    /// Number of the tetrahedron on its filled side, on the front one when both are.
    pub tet: u64,
}

impl Face {
    fn to_record(self) -> [u8; BYTES] {
        let mut record = [0; BYTES];
        record[..8].copy_from_slice(&self.triangle.to_be_bytes());
        for (i, v) in self.vertices.into_iter().enumerate() {
            record[8 + 8 * i..16 + 8 * i].copy_from_slice(&v.to_be_bytes());
        }
        record[32..36].copy_from_slice(&self.label.to_be_bytes());
        record[36..40].copy_from_slice(&self.regions[0].to_be_bytes());
        record[40..44].copy_from_slice(&self.regions[1].to_be_bytes());
        record[44..].copy_from_slice(&self.tet.to_be_bytes());
        record
    }

    fn from_record(record: &[u8; BYTES]) -> Self {
        Self {
            triangle: word64(record, 0),
            vertices: [8, 16, 24].map(|at| word64(record, at)),
            label: word32(record, 32),
            regions: [36, 40].map(|at| word32(record, at)),
            tet: word64(record, 44),
        }
    }
}

/// Collects faces of one sub-domain after the other.
pub(super) struct FaceSorter {
    sorter: Sorter<BYTES>,
    path: PathBuf,
}

impl FaceSorter {
    /// A sorter of `memory` bytes with scratch in `dir`.
    pub fn new(dir: &Path, memory: u64) -> Self {
        Self {
            sorter: Sorter::new(dir, memory),
            path: dir.join("faces"),
        }
    }

    /// Adds a facet of a sub-domain whose first tetrahedron has number `tet_first`.
    ///
    /// A triangle between two sub-domains is in both: the one with its filled side, or with its front
    /// when both sides are filled, has the word. Errors: the disk.
    pub fn push(&mut self, f: &SealedFacet, numbers: &PartNumbers, tet_first: u64) -> Result<()> {
        let side = usize::from(f.regions[0] == 0);
        if f.tets[side] == NO_TET {
            return Ok(());
        }
        let face = Face {
            triangle: f.triangle,
            vertices: f.vertices.map(|v| numbers.of(v)),
            label: f.label,
            regions: f.regions,
            tet: tet_first + u64::from(f.tets[side]),
        };
        Ok(self.sorter.push(face.to_record())?)
    }

    /// Ends collecting. Errors: the disk.
    pub fn finish(self) -> Result<Faces> {
        let mut faces = Faces {
            n: 0,
            labels: BTreeMap::new(),
            path: self.path,
        };
        let mut stream = scratch(&faces.path)?;
        for record in self.sorter.finish()? {
            let record = record?;
            faces.n += 1;
            *faces.labels.entry(word32(&record, 32)).or_default() += 1;
            stream.bytes(&record);
            stream.end()?;
        }
        stream.finish()?;
        Ok(faces)
    }
}

/// All boundary faces, in a scratch file.
pub(super) struct Faces {
    pub n: u64,
    /// How many faces each label has.
    pub labels: BTreeMap<u32, u64>,
    path: PathBuf,
}

impl Faces {
    /// Every face in the order of the input. Errors: the disk, and those of `each`.
    pub fn each(&self, mut each: impl FnMut(&Face) -> Result<()>) -> Result<()> {
        let mut records = Records::<BYTES>::open(&self.path, 0)?;
        while let Some(record) = records.next()? {
            each(&Face::from_record(&record))?;
        }
        Ok(())
    }
}
