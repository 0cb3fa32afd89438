//! Places of the defects of a surface.

use tetdb_base::surface::{Defect, Validation};
use tetdb_schema::code::Code;

/// Place of one defect.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct DefectPlace {
    /// Code of the defect.
    pub code: Code,
    /// The triangle with the defect, and a second one if two are involved; `None` if the defect has no such triangle.
    pub triangles: [Option<u32>; 2],
    /// A position where the defect is visible.
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
