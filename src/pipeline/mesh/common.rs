//! What is the same for all sub-domains of a run.

use crate::bisect::Method;
use crate::geom::Aabb;
use crate::optimize::Mode;
use crate::sizing::SizeField;

/// What is the same for all sub-domains.
#[derive(Clone, Copy)]
pub(crate) struct Common<'a> {
    pub field: &'a SizeField,
    pub mode: Mode,
    pub method: Method,
    pub bounds: Aabb,
}
