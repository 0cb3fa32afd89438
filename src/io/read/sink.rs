//! The target of readers of triangles.

use super::volume_cells::VolumeCells;
use tetdb_base::geom::Point;
use tetdb_base::surface::{NoteKind, Seed, SeedKind, SurfaceBuilder, VolumePoints};

/// The surface being built, and the naming of the current file's labels.
pub struct SurfaceSink<'a> {
    pub(super) builder: &'a mut SurfaceBuilder,
    /// The file's name without folder and extension: the label of triangles that have none.
    pub(super) stem: String,
    /// Put before each label when several files make one surface.
    pub(super) prefix: Option<String>,
    /// Volume cells of the file.
    pub(super) cells: VolumeCells,
}

impl SurfaceSink<'_> {
    /// The id of label `name`, or of the file's own label when it is empty.
    pub(super) fn label(&mut self, name: &str) -> u32 {
        match (&self.prefix, name.is_empty()) {
            (None, true) => self.builder.label(&self.stem),
            (None, false) => self.builder.label(name),
            (Some(prefix), true) => self.builder.label(prefix),
            (Some(prefix), false) if prefix == name => self.builder.label(prefix),
            (Some(prefix), false) => self.builder.label(&format!("{prefix}:{name}")),
        }
    }

    /// The label of triangles in all groups of these names, or the file's own label without names.
    pub(super) fn label_of_all<T: AsRef<str>>(&mut self, names: &[T]) -> u32 {
        match names {
            [] => self.label(""),
            [name] => self.label(name.as_ref()),
            names => {
                let labels: Vec<u32> = names.iter().map(|name| self.label(name.as_ref())).collect();
                self.builder.label_of_all(&labels)
            }
        }
    }

    /// Names the region around `point`; returns the name with its prefix.
    pub(super) fn region(&mut self, point: Point, name: &str) -> String {
        let name = match &self.prefix {
            None => name.to_owned(),
            Some(prefix) => format!("{prefix}:{name}"),
        };
        let kind = SeedKind::Region(Some(name.clone()));
        self.builder.seed(Seed { point, kind });
        name
    }

    /// Notes the number of points that mark holes or regions.
    pub(super) fn note_points(&mut self, points: VolumePoints, n: u64) {
        if n > 0 {
            self.builder.note(NoteKind::VolumePoints { points, n });
        }
    }
}
