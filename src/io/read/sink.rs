//! Where readers put triangles.

use crate::surface::SurfaceBuilder;

/// What the readers share: the surface being built and how this file's labels are called.
pub(crate) struct SurfaceSink<'a> {
    pub(super) builder: &'a mut SurfaceBuilder,
    /// The file's name without folder and extension: the label of triangles that have none.
    pub(super) stem: String,
    /// Put before each label when several files make one surface.
    pub(super) prefix: Option<String>,
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
}
