//! The files of one `polyMesh` folder.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::super::error::Result;
use super::super::output_files::OutputFiles;
use super::file::FoamFile;
use tetdb_base::storage::{Sorter, sort_record};

/// `constant/polyMesh` below `root`.
pub(super) fn mesh_dir(root: &Path) -> PathBuf {
    root.join("constant").join("polyMesh")
}

/// Names of patches and zones by label and region, in the order in which they are written.
pub(super) struct Names {
    pub patches: BTreeMap<u32, String>,
    /// Groups of patches, where faces are in several.
    pub groups: Vec<(String, BTreeSet<u32>)>,
    pub face_zones: BTreeMap<u32, String>,
    pub cell_zones: BTreeMap<u32, String>,
}

impl Names {
    /// Groups of the patch of a label.
    pub fn groups_of(&self, label: u32) -> Vec<String> {
        let own = self.groups.iter().filter(|(_, labels)| labels.contains(&label));
        own.map(|(name, _)| name.clone()).collect()
    }
}

/// Counts of a mesh.
#[derive(Clone, Copy)]
pub(super) struct Size {
    pub points: u64,
    pub cells: u64,
    pub inner: u64,
    pub faces: u64,
}

impl Size {
    /// Approximate bytes of the files.
    pub fn bytes(&self, ascii: bool) -> u64 {
        let (number, point) = if ascii { (8, 50) } else { (4, 24) };
        point * self.points + number * (5 * self.faces + self.inner + self.cells)
    }

    fn note(&self) -> String {
        format!(
            "nPoints: {} nCells: {} nFaces: {} nInternalFaces: {}",
            self.points, self.cells, self.faces, self.inner
        )
    }
}

/// `faces`, `owner` and `neighbour` being written.
pub(super) struct FaceFiles {
    faces: FoamFile,
    owner: FoamFile,
    neighbour: FoamFile,
    size: Size,
    written: u64,
}

impl FaceFiles {
    pub fn create(outputs: &mut OutputFiles, dir: &Path, size: Size, ascii: bool) -> Result<Self> {
        let class = if ascii { "faceList" } else { "faceCompactList" };
        let note = size.note();
        let labels = if ascii { 8 } else { 4 };
        let mut open = |object, class, bytes| {
            FoamFile::create(outputs, (dir, object, class), &note, ascii, bytes)
        };
        let mut faces = open("faces", class, 4 * labels * size.faces)?;
        let mut owner = open("owner", "labelList", labels * size.faces)?;
        let mut neighbour = open("neighbour", "labelList", labels * size.inner)?;
        if !ascii {
            // Where each face begins among the vertices of all.
            faces.list(size.faces + 1, |f| {
                (0..=size.faces).try_for_each(|face| f.label(3 * face as i32))
            })?;
        }
        faces.begin_list(if ascii { size.faces } else { 3 * size.faces });
        owner.begin_list(size.faces);
        neighbour.begin_list(size.inner);
        Ok(Self { faces, owner, neighbour, size, written: 0 })
    }

    /// A face with cells on both sides.
    #[inline]
    pub fn inner(&mut self, owner: u32, neighbor: u32, vertices: [u32; 3]) -> Result<()> {
        self.neighbour.label(neighbor as i32)?;
        self.outer(owner, vertices)
    }

    /// A face of a patch.
    #[inline]
    pub fn outer(&mut self, owner: u32, vertices: [u32; 3]) -> Result<()> {
        self.written += 1;
        self.owner.label(owner as i32)?;
        self.faces.face(vertices)
    }

    /// Number of faces written so far.
    pub fn written(&self) -> u64 {
        self.written
    }

    pub fn finish(mut self) -> Result<()> {
        let faces = if self.faces.ascii { 1 } else { 3 };
        self.faces.end_list(faces * self.size.faces);
        self.owner.end_list(self.size.faces);
        self.neighbour.end_list(self.size.inner);
        for file in [self.faces, self.owner, self.neighbour] {
            file.finish()?;
        }
        Ok(())
    }
}

/// A patch of the file `boundary`.
pub(super) struct FoamPatch {
    pub name: String,
    /// This processor and the one behind the patch.
    pub between: Option<[usize; 2]>,
    /// Groups of the patch; none where there are no faces in several.
    pub groups: Vec<String>,
    pub n_faces: u64,
}

/// Writes `boundary`.
pub(super) fn write_boundary(
    outputs: &mut OutputFiles,
    dir: &Path,
    mut start: u64,
    patches: &[FoamPatch],
) -> Result<()> {
    let what = (dir, "boundary", "polyBoundaryMesh");
    let mut file = FoamFile::create(outputs, what, "", true, 0)?;
    file.text(&format!("{}\n(\n", patches.len()));
    for patch in patches {
        let kind = match patch.between {
            None if patch.groups.is_empty() => "        type            patch;\n".to_owned(),
            None => format!(
                "        type            patch;\n        inGroups        {}({});\n",
                patch.groups.len(),
                patch.groups.join(" ")
            ),
            Some([here, there]) => format!(
                "        type            processor;\n        inGroups        1(processor);\n        matchTolerance  0.0001;\n        \
                 transform       unknown;\n        myProcNo        {here};\n        neighbProcNo    {there};\n"
            ),
        };
        file.text(&format!(
            "    {}\n    {{\n{kind}        nFaces          {};\n        startFace       {start};\n    }}\n",
            patch.name, patch.n_faces
        ));
        start += patch.n_faces;
    }
    file.text(")\n");
    file.finish()
}

/// Writes a list of labels as a file of its own.
pub(super) fn write_labels(
    outputs: &mut OutputFiles,
    (dir, object): (&Path, &str),
    n: u64,
    ascii: bool,
    fill: impl FnOnce(&mut FoamFile) -> Result<()>,
) -> Result<()> {
    let bytes = n * if ascii { 8 } else { 4 };
    let mut file = FoamFile::create(outputs, (dir, object, "labelList"), "", ascii, bytes)?;
    file.list(n, fill)?;
    file.finish()
}

sort_record! {
    struct Member {
        zone: u32,
        item: u32,
        is_flipped: bool,
    }
}

/// Zones being gathered: lists of cells, or of faces with the side they look to.
pub(super) struct Zones {
    items: Sorter<Member>,
    /// The same members again, for the second list of a zone of faces.
    flips: Option<Sorter<Member>>,
    counts: BTreeMap<u32, u64>,
}

impl Zones {
    pub fn new(dir: &Path, of_faces: bool, bytes: u64) -> Self {
        Self {
            items: Sorter::new(dir, bytes),
            flips: of_faces.then(|| Sorter::new(dir, bytes)),
            counts: BTreeMap::new(),
        }
    }

    pub fn push(&mut self, zone: u32, item: u32, is_flipped: bool) -> Result<()> {
        let member = Member { zone, item, is_flipped };
        *self.counts.entry(zone).or_default() += 1;
        self.items.push(member)?;
        if let Some(flips) = &mut self.flips {
            flips.push(member)?;
        }
        Ok(())
    }

    /// Writes `cellZones` or `faceZones` with all of `names`; a zone may be empty.
    pub fn write(
        self,
        outputs: &mut OutputFiles,
        dir: &Path,
        names: &BTreeMap<u32, String>,
        ascii: bool,
    ) -> Result<()> {
        let (object, kind, list) = match self.flips {
            None => ("cellZones", "cellZone", "cellLabels"),
            Some(_) => ("faceZones", "faceZone", "faceLabels"),
        };
        let n: u64 = self.counts.values().sum();
        let bytes = 5 * n;
        let mut file = FoamFile::create(outputs, (dir, object, "regIOobject"), "", ascii, bytes)?;
        let mut items = self.items.finish()?;
        let mut flips = self.flips.map(Sorter::finish).transpose()?;
        file.text(&format!("{}\n(\n", names.len()));
        for (zone, name) in names {
            let n = self.counts.get(zone).copied().unwrap_or_default();
            file.text(&format!("{name}\n{{\n    type {kind};\n    {list} List<label> "));
            file.list(n, |file| {
                let members = items.by_ref().take(n as usize);
                members.into_iter().try_for_each(|m| file.label(m?.item as i32))
            })?;
            file.text(";\n");
            if let Some(flips) = &mut flips {
                file.text("    flipMap List<bool> ");
                file.list(n, |file| {
                    let members = flips.by_ref().take(n as usize);
                    members.into_iter().try_for_each(|m| file.bool(m?.is_flipped))
                })?;
                file.text(";\n");
            }
            file.text("}\n");
        }
        file.text(")\n");
        file.finish()
    }
}
