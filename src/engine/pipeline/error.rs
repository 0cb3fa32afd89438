//! Errors of a run: those of its steps, and its own.

use thiserror::Error;

use super::import::BadMesh;
use tetdb_base::geom::Point;
use tetdb_base::storage::RemoteFailure;
use tetdb_base::storage::StorageError;
use tetdb_base::surface::SurfaceError;
use tetdb_kernel::boundary::BoundaryError;
use tetdb_kernel::sizing::SizingError;
use tetdb_store::query::QueryError;
use tetdb_store::sealed::SealedError;
use tetdb_store::store::StoreError;

/// Errors of a pipeline run. Everything committed before the error stays in the store.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PipelineError {
    /// The surface is not valid.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// A mesh to import is not valid.
    #[error(transparent)]
    BadMesh(#[from] BadMesh),
    /// The surface could not be turned into the boundary of volumes.
    #[error(transparent)]
    Boundary(#[from] BoundaryError),
    /// The sizes are not usable.
    #[error(transparent)]
    Sizing(#[from] SizingError),
    /// The store could not be read or written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The mesh before could not be read.
    #[error(transparent)]
    Query(#[from] QueryError),
    /// Pages could not be read, written or held.
    #[error(transparent)]
    Storage(#[from] StorageError),
    /// The disk has less room than the mesh is expected to need.
    #[error(
        "about {tets:.0} tetrahedra are expected, which need {needed} bytes of disk on the way; {free} are free"
    )]
    NoRoom {
        /// Predicted tetrahedra.
        tets: f64,
        /// Predicted bytes.
        needed: u64,
        /// Bytes that the system reports as free.
        free: u64,
    },
    /// The value of an option is not recognized.
    #[error("{option} '{value}' is not known")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// The rejected value.
        value: String,
    },
    /// A region seed is not three numbers and a name, or a hole is not three numbers.
    #[error(
        "{option} {found}: expected three numbers{}",
        if *option == "hole" { "" } else { ", and a name behind them" }
    )]
    BadSeed {
        /// Name of the option.
        option: &'static str,
        /// The rejected text.
        found: String,
    },
    /// A sheet lies in a region that is not filled.
    #[error(
        "{n} triangles of sheets lie where nothing is filled, the first is triangle {triangle} of {label:?}"
    )]
    SheetOutside {
        /// Number of the first such triangle.
        triangle: u32,
        /// Label of that triangle.
        label: String,
        /// Centroid of that triangle.
        at: Point,
        /// Number of such triangles.
        n: u64,
    },
    /// An embedded edge or an embedded point lies in a region that is not filled.
    #[error(
        "{n} of the embedded {what} lie where nothing is filled; the first is {name}, {distance:.1e} from the surface"
    )]
    WireOutside {
        /// The text "edges" or "points".
        what: &'static str,
        /// Name of the first: its label, and its number among those of that label.
        name: String,
        /// Distance of the first from the nearest triangle; of an edge, that of its nearer end.
        distance: f64,
        /// Position of the first: the point, or the middle of the edge.
        at: Point,
        /// Number of such edges or points.
        n: u64,
    },
    /// The options name a file of sizes, but its contents were not passed in.
    #[error("the sizes of {file} must be read before the mesh is begun")]
    SizeField {
        /// The file of sizes.
        file: String,
    },
    /// No region is filled under the chosen rule for regions.
    #[error("no region is filled: the surface encloses nothing under the rule {policy}")]
    NothingFilled {
        /// The rule for regions.
        policy: String,
    },
    /// The store has no previous version to restore.
    #[error("{path} keeps no previous version of any sub-domain")]
    NothingToUndo {
        /// Directory of the store.
        path: std::path::PathBuf,
    },
    /// Fields were added after the last change, so the version before it has no values of theirs.
    #[error("the version before has no values of {}, added after it", .names.join(", "))]
    LaterFields {
        /// Names of the fields.
        names: Vec<String>,
    },
    /// The number of lengths differs from the number of tetrahedra or vertices of the sub-domains.
    #[error(
        "{found} lengths for {tets} tetrahedra or {vertices} vertices: expected one for each, in the order of the .npy export"
    )]
    SizeCount {
        /// Number of lengths received.
        found: u64,
        /// Number of tetrahedra of the sub-domains.
        tets: u64,
        /// Number of vertices of the sub-domains.
        vertices: u64,
    },
    /// The store has no tasks, or none that can run now.
    #[error("{path} has no tasks that could be done now: {reason}")]
    NoPlan {
        /// Directory of the store.
        path: std::path::PathBuf,
        /// Reason, in words.
        reason: String,
    },
    /// A remote worker failed to perform its order.
    #[error("{}", .0.message)]
    Helper(RemoteFailure),
    /// A file of the task folder cannot be used.
    #[error("{path} cannot be used: {what}")]
    TaskFile {
        /// The file.
        path: std::path::PathBuf,
        /// Fault of the file, in words.
        what: String,
    },
    /// A cut left all tetrahedra on one side of its plane.
    #[error("cut {cut} leaves no tetrahedron on one side: ask for fewer sub-domains")]
    EmptyPart {
        /// Number of the cut, from 1.
        cut: u32,
    },
}

impl From<SealedError> for PipelineError {
    fn from(error: SealedError) -> Self {
        Self::from(StoreError::from(error))
    }
}

impl PipelineError {
    /// Name of the option that the message begins with, if it begins with one.
    pub fn option(&self) -> Option<&'static str> {
        match self {
            Self::Option { option, .. } | Self::BadSeed { option, .. } => Some(option),
            Self::Sizing(e) => e.option(),
            _ => None,
        }
    }
}

impl From<RemoteFailure> for PipelineError {
    fn from(failure: RemoteFailure) -> Self {
        Self::Helper(failure)
    }
}
