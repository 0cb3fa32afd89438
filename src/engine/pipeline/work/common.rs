//! Parameters common to all orders of a run.

use crate::pipeline::error::PipelineError;
use crate::pipeline::plan::Options;
use tetdb_base::geom::Aabb;
use tetdb_kernel::bisect::Method;
use tetdb_kernel::optimize::Mode;
use tetdb_kernel::sizing::SizeField;
use tetdb_store::sealed::Form;

/// Parameters common to all orders of a run.
#[derive(Clone, Copy)]
pub struct Common<'a> {
    pub field: &'a SizeField,
    pub mode: Mode,
    pub method: Method,
    pub bounds: Aabb,
    pub form: Form,
    /// True if coarse snapshots are kept.
    pub keeps_coarse: bool,
    /// True if stages of cuts are kept.
    pub keeps_stages: bool,
}

impl<'a> Common<'a> {
    /// Errors: a word of the options that is not known.
    pub fn of(
        options: &Options,
        field: &'a SizeField,
        bounds: Aabb,
    ) -> Result<Self, PipelineError> {
        Ok(Self {
            field,
            mode: options.mode()?,
            method: options.method,
            bounds,
            form: options.form()?,
            keeps_coarse: !options.drop_coarse,
            keeps_stages: options.keep_stages,
        })
    }
}
