//! Where the defects of a surface are.

use tetdb_base::surface::{Defect, Validation};
use tetdb_schema::code::Code;

/// Where a defect is.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct DefectPlace {
    /// The word for it, one of [`Code`].
    pub code: Code,
    /// The triangle it is about, and the second one where there are two. `None`: the surface has none.
    pub triangles: [Option<u32>; 2],
    /// A position where it can be seen.
    pub at: Option<[f64; 3]>,
}

impl DefectPlace {
    pub(super) fn all_of(validation: &Validation) -> Vec<Self> {
        let defects = validation.defects.iter();
        let place = |d: &Defect| Self {
            code: d.code(),
            triangles: [0, 1].map(|i| d.triangles().get(i).copied()),
            at: d.at().map(|p| p.to_array()),
        };
        defects.map(place).collect()
    }
}
