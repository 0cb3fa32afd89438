//! Boundary faces of the written mesh: input triangles in the order of the input, then faces shared with other sub-domains.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use tetdb_schema::record::{InterfaceFace, NO_TET, SealedFacet};

use super::error::Result;
use super::numbering::PartNumbers;
use super::scope::Scope;
use super::stream::{RecordReader, Stream, scratch};
use tetdb_base::storage::{Sorter, sort_record};

/// Bit in the key of an interface face, which sorts it after the input triangles; below it are the numbers of cut and face.
const INTERFACE: u64 = 1 << 63;

sort_record! {
    /// A boundary face in the merged mesh.
    pub(super) struct MergedFace {
        /// Number of the input triangle, or an interface face's cut and number in it.
        key: u64,
        /// True for the side that is left out when both sides are written.
        is_second: bool,
        /// Numbers of its vertices: in the input's order, or counter-clockwise seen from the other sub-domain.
        pub vertices: [u64; 3],
        pub label: u32,
        /// Regions in front of an input triangle, where the normal points to, and behind it; 0 is empty. Both are 0 at an interface.
        pub regions: [u32; 2],
        /// The sub-domain of its tetrahedron.
        pub subdomain: u32,
        /// The sub-domain behind an interface face.
        pub neighbor: u32,
        /// Number of the tetrahedron on its filled side, on the front one when both are written.
        pub tet: u64,
    }
}

impl MergedFace {
    /// Number of the triangle in the input; `None` for an interface face.
    pub fn triangle(&self) -> Option<u64> {
        (self.key < INTERFACE).then_some(self.key)
    }

    /// Cut of an interface face, and its number in the cut; `None` for an input triangle.
    pub fn cut(&self) -> Option<(u32, u32)> {
        let key = self.key.checked_sub(INTERFACE)?;
        Some(((key >> 32) as u32, key as u32))
    }
}

/// The sub-domain whose faces are collected, with its numbers in the merged mesh.
pub(super) struct FaceSource<'a> {
    pub rank: u32,
    pub numbers: &'a PartNumbers,
    pub scope: Scope<'a>,
}

/// Collects faces of one sub-domain after the other.
pub(super) struct FaceSorter {
    sorter: Sorter<MergedFace>,
    path: PathBuf,
}

impl FaceSorter {
    /// A sorter of `memory` bytes with scratch in `dir`.
    pub fn new(dir: &Path, memory: u64) -> Self {
        Self { sorter: Sorter::new(dir, memory), path: dir.join("faces") }
    }

    /// Adds a facet of a sub-domain.
    ///
    /// A triangle between two sub-domains is in both. The sub-domain on its filled side counts, or on its front when both sides are filled,
    /// unless that sub-domain is not written. Errors: the disk.
    pub fn push(&mut self, f: &SealedFacet, part: &FaceSource) -> Result<()> {
        let regions = f.regions.map(|region| part.scope.region(region));
        let preferred = usize::from(regions[0] == 0);
        let tet_of = |side: usize| match (f.tets[side], regions[side]) {
            (NO_TET, _) | (_, 0) => None,
            (tet, _) => part.numbers.tet(tet),
        };
        let sides = [preferred, 1 - preferred].into_iter();
        let Some((side, tet)) = sides.filter_map(|side| Some((side, tet_of(side)?))).next() else {
            return Ok(());
        };
        let face = MergedFace {
            key: f.triangle,
            is_second: side != preferred,
            vertices: part.numbers.vertices(f.vertices)?,
            label: f.label,
            regions,
            tet,
            subdomain: part.rank,
            neighbor: part.rank,
        };
        Ok(self.sorter.push(face)?)
    }

    /// Adds an interface face of a sub-domain, under a label. Errors: the disk.
    pub fn push_interface(
        &mut self,
        f: &InterfaceFace,
        label: u32,
        part: &FaceSource,
    ) -> Result<()> {
        let Some(tet) = part.numbers.tet(f.tet) else {
            return Ok(());
        };
        let face = MergedFace {
            key: INTERFACE | u64::from(f.cut) << 32 | u64::from(f.index),
            is_second: false,
            vertices: part.numbers.vertices(f.vertices)?,
            label,
            regions: [0, 0],
            tet,
            subdomain: part.rank,
            neighbor: f.other,
        };
        Ok(self.sorter.push(face)?)
    }

    /// Ends collecting. Errors: the disk.
    pub fn finish(self) -> Result<MergedFaces> {
        let mut file = FaceFile::create(self.path)?;
        let mut last = None;
        for face in self.sorter.finish()? {
            let face = face?;
            if last.replace(face.key) != Some(face.key) {
                file.put(&face)?;
            }
        }
        file.finish()
    }
}

/// Faces being written to their scratch file.
struct FaceFile {
    faces: MergedFaces,
    stream: Stream,
}

impl FaceFile {
    fn create(path: PathBuf) -> Result<Self> {
        let stream = scratch(&path)?;
        let (n, labels) = (0, BTreeMap::new());
        let faces = MergedFaces { n, labels, path };
        Ok(Self { faces, stream })
    }

    fn put(&mut self, face: &MergedFace) -> Result<()> {
        self.faces.n += 1;
        *self.faces.labels.entry(face.label).or_default() += 1;
        self.stream.record(face)
    }

    fn finish(self) -> Result<MergedFaces> {
        self.stream.finish()?;
        Ok(self.faces)
    }
}

/// All boundary faces, in a scratch file.
pub(super) struct MergedFaces {
    pub n: u64,
    /// Number of faces of each label.
    pub labels: BTreeMap<u32, u64>,
    path: PathBuf,
}

impl MergedFaces {
    /// Every face, input triangles first. Errors: the disk, and those of `each`.
    pub fn each(&self, each: impl FnMut(&MergedFace) -> Result<()>) -> Result<()> {
        RecordReader::open(&self.path, 0)?.each(each)
    }

    /// Replaces the faces by those that `each` puts, saved at `path`. Errors: the disk, those of `each`.
    pub fn rewritten(
        &self,
        path: &Path,
        mut each: impl FnMut(&MergedFace, &mut dyn FnMut(&MergedFace) -> Result<()>) -> Result<()>,
    ) -> Result<Self> {
        let mut file = FaceFile::create(path.to_owned())?;
        self.each(|face| each(face, &mut |face| file.put(face)))?;
        file.finish()
    }
}
