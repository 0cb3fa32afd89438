//! Errors of reading: the fault, and its place in the file.

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

/// A position in a file: lines for text (from 1), bytes for binary (from 0).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spot {
    /// The file as a whole.
    File,
    /// A line, from 1.
    Line(u64),
    /// A byte, from 0.
    Byte(u64),
}

impl FilePlace {
    /// A file as a whole.
    pub(super) fn new(path: &std::path::Path) -> Self {
        Self { file: path.to_string_lossy().into_owned(), spot: Spot::File }
    }

    /// The error of a fault here.
    pub(super) fn refuse(&self, fault: ReadFault) -> ReadError {
        ReadError { place: self.clone(), fault }
    }
}

impl fmt::Display for FilePlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.spot {
            Spot::File => write!(f, "{}", self.file),
            Spot::Line(n) => write!(f, "{}, line {n}", self.file),
            Spot::Byte(n) => write!(f, "{}, byte {n}", self.file),
        }
    }
}

/// Why a file was refused, and where.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{fault}")]
pub struct ReadError {
    place: FilePlace,
    fault: ReadFault,
}

/// Why a file was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ReadFault {
    /// The file cannot be opened or read.
    #[error("the file cannot be read: {0}")]
    Unreadable(String),
    /// Neither the name nor the first bytes tell the format; holds the advice.
    #[error("the format of the file is not known")]
    UnknownFormat(&'static str),
    /// The file holds curved faces of a solid model, not triangles.
    #[error("the file is a solid model ({0}): it has curved faces and no triangles")]
    SolidModel(&'static str),
    /// The file ends too early.
    #[error("the file ends too early: expected {expected}, found {found}")]
    Truncated {
        /// The expected content.
        expected: String,
        /// The content found.
        found: String,
    },
    /// The file has other content where the format requires a word, a number or an end.
    #[error("expected {expected}, found {found}")]
    Unexpected {
        /// The expected content.
        expected: String,
        /// The content found.
        found: String,
    },
    /// A line of a file of points can be read in two ways.
    #[error("{line} can be read in two ways: as `{}` or `{}`", readings[0], readings[1])]
    TwoReadings {
        /// The line.
        line: String,
        /// The values in either reading.
        readings: [String; 2],
    },
    /// A number is not a number, or not finite.
    #[error("expected a finite number as {what}, found {found}")]
    NotANumber {
        /// The meaning of the number.
        what: &'static str,
        /// The content found.
        found: String,
    },
    /// A vertex number names no vertex.
    #[error("vertex number {index} is out of range, expected {low} to {high}")]
    IndexOutOfRange {
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
        /// Name of the counted things.
        what: &'static str,
        /// The declared number.
        declared: String,
        /// Why it cannot be right.
        found: String,
    },
    /// A field cannot hold a value of an array.
    #[error("value {row} of the array {array:?} has a number that the type {number} does not hold")]
    FieldValue {
        /// Name of the array.
        array: String,
        /// Place of the value in the array, from 0.
        row: u64,
        /// Type of the field.
        number: &'static str,
    },
    /// A coordinate is too large to compute with exactly.
    #[error("a coordinate is too large to compute with exactly: {0:e}, expected below 1e30")]
    CoordinateRange(f64),
    /// The file uses a part of its format that is not read.
    #[error("{0} cannot be read")]
    Unsupported(String),
    /// The file holds no triangles.
    #[error("the file holds no triangles")]
    Empty,
    /// The content of the file does not fit into the memory allowed. Units: bytes.
    #[error("{what} would take {needed} bytes of memory, more than the {limit} there are for them")]
    TooLarge {
        /// Name of the content.
        what: &'static str,
        /// Memory it would take.
        needed: u64,
        /// Memory allowed.
        limit: u64,
    },
    /// Sizes without the mesh they belong to, or a mesh without sizes.
    #[error("no file of sizes or no mesh lies beside it: expected {0}")]
    Alone(String),
    /// The triangles do not make a surface.
    #[error("{0}")]
    Surface(SurfaceError),
}

impl ReadError {
    /// The same fault at another spot of the file.
    pub(super) fn at_spot(mut self, spot: Spot) -> Self {
        self.place.spot = spot;
        self
    }

    /// The word for this error.
    pub fn code(&self) -> Code {
        match &self.fault {
            ReadFault::Unreadable(_) => Code::UnreadableFile,
            ReadFault::UnknownFormat(_) | ReadFault::SolidModel(_) => Code::UnknownFormat,
            ReadFault::Truncated { .. } => Code::TruncatedFile,
            ReadFault::Unexpected { .. } | ReadFault::TwoReadings { .. } => Code::UnexpectedText,
            ReadFault::NotANumber { .. } => Code::NotANumber,
            ReadFault::IndexOutOfRange { .. } => Code::IndexOutOfRange,
            ReadFault::CountMismatch { .. } => Code::CountMismatch,
            ReadFault::FieldValue { .. } => Code::BadField,
            ReadFault::CoordinateRange(_) => Code::CoordinateRange,
            ReadFault::Unsupported(_) => Code::UnsupportedContent,
            ReadFault::Empty => Code::EmptySurface,
            ReadFault::TooLarge { .. } => Code::Memory,
            ReadFault::Alone(_) => Code::UnreadableFile,
            ReadFault::Surface(source) => source.code(),
        }
    }

    /// Place of the fault.
    pub fn place(&self) -> &FilePlace {
        &self.place
    }

    /// Advice for the user.
    pub fn help(&self) -> &'static str {
        match &self.fault {
            ReadFault::Unreadable(_) => {
                "check the path and that the file may be read: `ls -l FILE`"
            }
            ReadFault::UnknownFormat(help) => help,
            ReadFault::SolidModel(_) => {
                "write its surface as triangles first: in a CAD program export STL with a fine tolerance, or with Gmsh `gmsh -2 part.step -o part.stl`"
            }
            ReadFault::Truncated { .. } => {
                "copy or download the file again; compare its length with the original's"
            }
            ReadFault::TwoReadings { .. } => {
                "name the columns in a first line, such as `id x y z` or `x y z name`, with the separator of the lines below"
            }
            ReadFault::Unexpected { .. } | ReadFault::NotANumber { .. } => {
                "look at that place; write the file again from the program it comes from"
            }
            ReadFault::IndexOutOfRange { .. } => {
                "write the file again from the program it comes from; vertex numbers must name vertices of the file"
            }
            ReadFault::CountMismatch { .. } => {
                "write the file again from the program it comes from; the counts must match what follows"
            }
            ReadFault::FieldValue { .. } => {
                "leave the arrays of values out, or write this one with numbers of type float64"
            }
            ReadFault::CoordinateRange(_) => {
                "scale the surface to ordinary units, for example metres"
            }
            ReadFault::Unsupported(_) => {
                "write the surface with flat triangles, for example as binary STL or ASCII OFF"
            }
            ReadFault::Empty => {
                "choose a file that holds a surface; lines, points and tetrahedra alone bound nothing"
            }
            ReadFault::TooLarge { .. } => {
                "allow more memory, unpack the file to disk, or give a coarser background mesh"
            }
            ReadFault::Alone(_) => {
                "put the .sol file and its .mesh side by side, under the same name"
            }
            ReadFault::Surface(source) => source.help(),
        }
    }
}
