//! Why a file could not be read, and where.

use std::fmt;

use crate::surface::SurfaceError;

/// A place in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FilePlace {
    /// The file as it was named.
    pub file: String,
    pub spot: Spot,
}

/// Where in a file: lines for text (from 1), bytes for binary (from 0).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spot {
    Totals,
    Line(u64),
    Byte(u64),
}

impl fmt::Display for FilePlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.spot {
            Spot::Totals => write!(f, "{}", self.file),
            Spot::Line(n) => write!(f, "{}, line {n}", self.file),
            Spot::Byte(n) => write!(f, "{}, byte {n}", self.file),
        }
    }
}

/// Why a surface file was refused. Each value carries its place.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    #[error("the file cannot be read: {reason}")]
    Unreadable { place: FilePlace, reason: String },
    #[error("the format of the file is not known")]
    UnknownFormat { place: FilePlace },
    #[error("the file ends too early: expected {expected}, found {found}")]
    Truncated {
        place: FilePlace,
        expected: String,
        found: String,
    },
    #[error("expected {expected}, found {found}")]
    Unexpected {
        place: FilePlace,
        expected: String,
        found: String,
    },
    #[error("expected a finite number as {what}, found {found}")]
    NotANumber {
        place: FilePlace,
        what: &'static str,
        found: String,
    },
    #[error("vertex number {index} is out of range, expected {low} to {high}")]
    IndexOutOfRange {
        place: FilePlace,
        index: i64,
        low: i64,
        high: i64,
    },
    #[error("the number of {what} cannot be right: {declared} declared, {found}")]
    CountMismatch {
        place: FilePlace,
        what: &'static str,
        declared: String,
        found: String,
    },
    #[error("a coordinate is too large to compute with exactly: {found:e}, expected below 1e30")]
    CoordinateRange { place: FilePlace, found: f64 },
    #[error("{what} cannot be read")]
    Unsupported { place: FilePlace, what: String },
    #[error("the file holds no triangles")]
    Empty { place: FilePlace },
    #[error("{what} would take {needed} bytes of memory, more than the {limit} there are for them")]
    TooLarge {
        place: FilePlace,
        what: &'static str,
        needed: u64,
        limit: u64,
    },
    #[error("no file of sizes or no mesh lies beside it: expected {expected}")]
    Alone { place: FilePlace, expected: String },
    #[error("{source}")]
    Surface {
        place: FilePlace,
        source: SurfaceError,
    },
}

impl ReadError {
    /// The word for this error.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Unreadable { .. } => "unreadable-file",
            Self::UnknownFormat { .. } => "unknown-format",
            Self::Truncated { .. } => "truncated-file",
            Self::Unexpected { .. } => "unexpected-text",
            Self::NotANumber { .. } => "not-a-number",
            Self::IndexOutOfRange { .. } => "index-out-of-range",
            Self::CountMismatch { .. } => "count-mismatch",
            Self::CoordinateRange { .. } => "coordinate-range",
            Self::Unsupported { .. } => "unsupported-content",
            Self::Empty { .. } => "empty-surface",
            Self::TooLarge { .. } => "memory",
            Self::Alone { .. } => "unreadable-file",
            Self::Surface { source, .. } => source.code(),
        }
    }

    /// Where it happened.
    pub fn place(&self) -> &FilePlace {
        match self {
            Self::Unreadable { place, .. }
            | Self::UnknownFormat { place }
            | Self::Truncated { place, .. }
            | Self::Unexpected { place, .. }
            | Self::NotANumber { place, .. }
            | Self::IndexOutOfRange { place, .. }
            | Self::CountMismatch { place, .. }
            | Self::CoordinateRange { place, .. }
            | Self::Unsupported { place, .. }
            | Self::Empty { place }
            | Self::TooLarge { place, .. }
            | Self::Alone { place, .. }
            | Self::Surface { place, .. } => place,
        }
    }

    /// What to do about it.
    pub fn help(&self) -> &'static str {
        match self {
            Self::Unreadable { .. } => "check the path and that the file may be read: `ls -l FILE`",
            Self::UnknownFormat { .. } => {
                "name the file .stl, .off, .obj, .ply, .mesh, .meshb, .msh, .smesh or .poly after what it holds"
            }
            Self::Truncated { .. } => {
                "copy or download the file again; compare its length with the original's"
            }
            Self::Unexpected { .. } | Self::NotANumber { .. } => {
                "look at that place; write the file again from the program it comes from"
            }
            Self::IndexOutOfRange { .. } => {
                "write the file again from the program it comes from; vertex numbers must name vertices of the file"
            }
            Self::CountMismatch { .. } => {
                "write the file again from the program it comes from; the counts must match what follows"
            }
            Self::CoordinateRange { .. } => {
                "scale the surface to ordinary units, for example metres"
            }
            Self::Unsupported { .. } => {
                "write the surface with flat triangles, for example as binary STL or ASCII OFF"
            }
            Self::Empty { .. } => {
                "choose a file that holds a surface; lines, points and tetrahedra alone bound nothing"
            }
            Self::TooLarge { .. } => "allow more memory, or give a coarser background mesh",
            Self::Alone { .. } => {
                "put the .sol file and its .mesh side by side, under the same name"
            }
            Self::Surface { source, .. } => source.help(),
        }
    }
}
