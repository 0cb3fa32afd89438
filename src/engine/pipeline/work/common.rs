//! Parameters common to all orders of a run.

use crate::pipeline::plan::Options;
use tetdb_base::geom::Aabb;
use tetdb_kernel::bisect::PlaneChoice;
use tetdb_kernel::optimize::Mode;
use tetdb_kernel::sizing::SizeField;
use tetdb_store::sealed::Form;

/// Parameters common to all orders of a run.
#[derive(Clone, Copy)]
pub struct Common<'a> {
    pub field: &'a SizeField,
    pub mode: Mode,
    pub plane: PlaneChoice,
    pub bounds: Aabb,
    pub form: Form,
    /// True if coarse snapshots are kept.
    pub keeps_coarse: bool,
    /// True if stages of cuts are kept.
    pub keeps_stages: bool,
}

impl<'a> Common<'a> {
    pub fn new(options: &Options, field: &'a SizeField, bounds: Aabb) -> Self {
        Self {
            field,
            mode: options.mesh.optimize,
            plane: options.run.plane,
            bounds,
            form: options.mesh.seal,
            keeps_coarse: !options.mesh.drop_coarse,
            keeps_stages: options.mesh.keep_stages,
        }
    }
}
