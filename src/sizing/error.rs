//! What can be wrong with wanted sizes.

/// Why there is no size field.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SizingError {
    #[error("{option} {found}: expected {expected}")]
    BadValue {
        option: &'static str,
        found: String,
        expected: &'static str,
    },
    #[error("the smallest size {hmin} is above the largest size {hmax}; change --hmin or --hmax")]
    Crossed { hmin: f64, hmax: f64 },
    #[error("--size-expr {text}: {message} (at character {})", at + 1)]
    BadFormula {
        text: String,
        /// Byte of the text.
        at: usize,
        message: String,
    },
    #[error(
        "--size-expr {text} is {found} at ({}, {}, {}): expected a length above zero everywhere in the surface's box",
        at[0], at[1], at[2]
    )]
    NoSize {
        text: String,
        at: [f64; 3],
        found: f64,
    },
    #[error("--size-region {found}: {expected}")]
    BadRegion { found: String, expected: String },
    #[error(
        "--size-field: {found} sizes for the {expected} vertices of the surface; without a mesh of tetrahedra beside it the file must have one for each"
    )]
    SizeCount { found: usize, expected: usize },
    #[error("the surface has no edge of positive length, so it gives no size")]
    NoEdges,
    #[error(
        "the size field would need {found} leaves, more than {expected}; the surface's edge lengths differ too much"
    )]
    TooLarge { found: usize, expected: usize },
    #[error("the stored size field is damaged: {what} is {found}, expected {expected}")]
    Damaged {
        what: &'static str,
        found: String,
        expected: String,
    },
}
