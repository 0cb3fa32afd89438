//! Errors of wanted sizes.

impl SizingError {
    /// The option that the message begins with.
    pub fn option(&self) -> Option<&'static str> {
        match self {
            Self::BadValue { option, .. } => Some(option),
            Self::Crossed { .. } => Some("hmin"),
            Self::BadFormula { .. } | Self::NoSize { .. } => Some("size_expr"),
            Self::BadRegion { .. } => Some("size_region"),
            Self::BadLabel { .. } => Some("size_label"),
            Self::SizeCount { .. } => Some("size_field"),
            Self::NoEdges | Self::TooLarge { .. } | Self::Damaged { .. } => None,
        }
    }
}

/// Why there is no size field.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SizingError {
    /// A value of an option is not usable. Messages name options by their keys in a file of options.
    #[error("{option} {found}: expected {expected}")]
    BadValue {
        /// The option.
        option: &'static str,
        /// The value found.
        found: String,
        /// The values allowed, in words.
        expected: &'static str,
    },
    /// The smallest size is above the largest.
    #[error("hmin {hmin} is above hmax {hmax}")]
    Crossed {
        /// Smallest size.
        hmin: f64,
        /// Largest size.
        hmax: f64,
    },
    /// An expression cannot be read.
    #[error("size_expr {text}: {message} (at character {})", at + 1)]
    BadFormula {
        /// The expression.
        text: String,
        /// Byte of the text.
        at: usize,
        /// The error.
        message: String,
    },
    /// An expression gives no length at some point.
    #[error(
        "size_expr {text} is {found} at ({}, {}, {}): expected a length above zero everywhere in the surface's box",
        at[0], at[1], at[2]
    )]
    NoSize {
        /// The expression.
        text: String,
        /// The point.
        at: [f64; 3],
        /// Its value there.
        found: f64,
    },
    /// A size for a region is not usable.
    #[error("size_region {found}: {expected}")]
    BadRegion {
        /// The region and size found.
        found: String,
        /// The expected value, as a sentence.
        expected: String,
    },
    /// A size is for a label that no triangle has.
    #[error("size_label {found}: no triangle has this label; there are labels {expected}")]
    BadLabel {
        /// The label.
        found: String,
        /// The labels there are.
        expected: String,
    },
    /// A file of sizes has another number of them than the surface has vertices.
    #[error(
        "size_field has {found} sizes for the {expected} vertices of the surface; without a mesh of tetrahedra beside it the file must have one for each"
    )]
    SizeCount {
        /// Number of sizes found.
        found: usize,
        /// Vertices of the surface.
        expected: usize,
    },
    /// The surface has no edge of positive length.
    #[error("the surface has no edge of positive length, so it gives no size")]
    NoEdges,
    /// The size field would take too many octree leaves.
    #[error(
        "the size field would need {found} leaves, more than {expected}; the surface's edge lengths differ too much"
    )]
    TooLarge {
        /// Leaves it would take.
        found: usize,
        /// The most allowed.
        expected: usize,
    },
    /// The size field in the store is damaged.
    #[error("the stored size field is damaged: {what} is {found}, expected {expected}")]
    Damaged {
        /// The part that is damaged.
        what: &'static str,
        /// The value found.
        found: String,
        /// The value expected.
        expected: String,
    },
}
