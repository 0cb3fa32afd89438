//! Why a file could not be read, and where.

use std::fmt;
use tetdb_schema::code::Code;

use tetdb_base::surface::SurfaceError;

/// A place in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FilePlace {
    /// The file as it was named.
    pub file: String,
    /// The place in it.
    pub spot: Spot,
}

/// Where in a file: lines for text (from 1), bytes for binary (from 0).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spot {
    /// No one place: the file as a whole.
    Totals,
    /// A line, from 1.
    Line(u64),
    /// A byte, from 0.
    Byte(u64),
}

impl FilePlace {
    /// A file as a whole.
    pub(super) fn of_file(path: &std::path::Path) -> Self {
        Self { file: path.to_string_lossy().into_owned(), spot: Spot::Totals }
    }
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
pub enum ReadError {
    /// The file cannot be opened or read.
    #[error("the file cannot be read: {reason}")]
    Unreadable {
        /// Where in the file.
        place: FilePlace,
        /// What the operating system said.
        reason: String,
    },
    /// Neither the name nor the first bytes tell the format.
    #[error("the format of the file is not known")]
    UnknownFormat {
        /// Where in the file.
        place: FilePlace,
        /// What to call it.
        help: &'static str,
    },
    /// The file holds curved faces of a solid model, not triangles.
    #[error("the file is a solid model ({kind}): it has curved faces and no triangles")]
    SolidModel {
        /// Where in the file.
        place: FilePlace,
        /// The kind of model.
        kind: &'static str,
    },
    /// The file ends too early.
    #[error("the file ends too early: expected {expected}, found {found}")]
    Truncated {
        /// Where in the file.
        place: FilePlace,
        /// What should have come.
        expected: String,
        /// What came instead.
        found: String,
    },
    /// Something else stands where the format asks for a word, a number or an end.
    #[error("expected {expected}, found {found}")]
    Unexpected {
        /// Where in the file.
        place: FilePlace,
        /// What should stand there.
        expected: String,
        /// What stands there.
        found: String,
    },
    /// A number is not a number, or not finite.
    #[error("expected a finite number as {what}, found {found}")]
    NotANumber {
        /// Where in the file.
        place: FilePlace,
        /// What the number is for.
        what: &'static str,
        /// What stands there.
        found: String,
    },
    /// A vertex number names no vertex.
    #[error("vertex number {index} is out of range, expected {low} to {high}")]
    IndexOutOfRange {
        /// Where in the file.
        place: FilePlace,
        /// The number found.
        index: i64,
        /// Least number allowed.
        low: i64,
        /// Greatest number allowed.
        high: i64,
    },
    /// A declared number cannot be right.
    #[error("the number of {what} cannot be right: {declared} declared, {found}")]
    CountMismatch {
        /// Where in the file.
        place: FilePlace,
        /// What is counted.
        what: &'static str,
        /// The declared number.
        declared: String,
        /// Why it cannot be right.
        found: String,
    },
    /// A coordinate is too large to compute with exactly.
    #[error("a coordinate is too large to compute with exactly: {found:e}, expected below 1e30")]
    CoordinateRange {
        /// Where in the file.
        place: FilePlace,
        /// The coordinate.
        found: f64,
    },
    /// The file uses a part of its format that is not read.
    #[error("{what} cannot be read")]
    Unsupported {
        /// Where in the file.
        place: FilePlace,
        /// The part.
        what: String,
    },
    /// The file holds no triangles.
    #[error("the file holds no triangles")]
    Empty {
        /// Where in the file.
        place: FilePlace,
    },
    /// What the file holds does not fit into the memory allowed. Units: bytes.
    #[error("{what} would take {needed} bytes of memory, more than the {limit} there are for them")]
    TooLarge {
        /// Where in the file.
        place: FilePlace,
        /// What would take the memory.
        what: &'static str,
        /// Memory it would take.
        needed: u64,
        /// Memory allowed.
        limit: u64,
    },
    /// Sizes without the mesh they belong to, or a mesh without sizes.
    #[error("no file of sizes or no mesh lies beside it: expected {expected}")]
    Alone {
        /// Where in the file.
        place: FilePlace,
        /// The file that was looked for.
        expected: String,
    },
    /// The triangles do not make a surface.
    #[error("{source}")]
    Surface {
        /// Where in the file.
        place: FilePlace,
        /// What is wrong with them.
        source: SurfaceError,
    },
}

impl ReadError {
    /// The word for this error.
    pub fn code(&self) -> Code {
        match self {
            Self::Unreadable { .. } => Code::UnreadableFile,
            Self::UnknownFormat { .. } | Self::SolidModel { .. } => Code::UnknownFormat,
            Self::Truncated { .. } => Code::TruncatedFile,
            Self::Unexpected { .. } => Code::UnexpectedText,
            Self::NotANumber { .. } => Code::NotANumber,
            Self::IndexOutOfRange { .. } => Code::IndexOutOfRange,
            Self::CountMismatch { .. } => Code::CountMismatch,
            Self::CoordinateRange { .. } => Code::CoordinateRange,
            Self::Unsupported { .. } => Code::UnsupportedContent,
            Self::Empty { .. } => Code::EmptySurface,
            Self::TooLarge { .. } => Code::Memory,
            Self::Alone { .. } => Code::UnreadableFile,
            Self::Surface { source, .. } => source.code(),
        }
    }

    /// Where it happened.
    pub fn place(&self) -> &FilePlace {
        match self {
            Self::Unreadable { place, .. }
            | Self::UnknownFormat { place, .. }
            | Self::SolidModel { place, .. }
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
            Self::UnknownFormat { help, .. } => help,
            Self::SolidModel { .. } => {
                "write its surface as triangles first: in a CAD program export STL with a fine tolerance, or with Gmsh `gmsh -2 part.step -o part.stl`"
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
            Self::TooLarge { .. } => {
                "allow more memory, unpack the file to disk, or give a coarser background mesh"
            }
            Self::Alone { .. } => {
                "put the .sol file and its .mesh side by side, under the same name"
            }
            Self::Surface { source, .. } => source.help(),
        }
    }
}
