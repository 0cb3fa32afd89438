use thiserror::Error;

use tetdb_base::geom::Point;
use tetdb_base::storage::RemoteFailure;
use tetdb_base::storage::StorageError;
use tetdb_base::surface::SurfaceError;
use tetdb_kernel::boundary::BoundaryError;
use tetdb_kernel::sizing::SizingError;
use tetdb_store::sealed::SealedError;
use tetdb_store::store::StoreError;

/// Why a run ended without a mesh. What the store held before is still there.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PipelineError {
    /// The surface is not valid.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// The surface did not become the boundary of volumes.
    #[error(transparent)]
    Boundary(#[from] BoundaryError),
    /// The sizes are not usable.
    #[error(transparent)]
    Sizing(#[from] SizingError),
    /// The store could not be read or written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Pages could not be read, written or held.
    #[error(transparent)]
    Storage(#[from] StorageError),
    /// An option that was checked before has no meaning any more.
    #[error("{option} '{value}' is not known")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// The value it was given.
        value: String,
    },
    /// A region seed or a hole is not three numbers, and a name.
    #[error(
        "{option} {found}: expected three numbers{}",
        if *option == "hole" { "" } else { ", and a name behind them" }
    )]
    BadSeed {
        /// Name of the option.
        option: &'static str,
        /// The text it was given.
        found: String,
    },
    /// A sheet lies where there will be no tetrahedra.
    #[error(
        "{n} triangles of sheets lie where nothing is filled, the first is triangle {triangle} of {label:?}"
    )]
    SheetOutside {
        /// The first such triangle.
        triangle: u32,
        /// Its label.
        label: String,
        /// Its middle.
        at: Point,
        /// How many there are.
        n: u64,
    },
    /// An edge or a point lies where there will be no tetrahedra.
    #[error("{n} of the embedded {what} lie where nothing is filled, the first of {label:?}")]
    WireOutside {
        /// Edges or points.
        what: &'static str,
        /// Label of the first.
        label: String,
        /// Where it is.
        at: Point,
        /// How many there are.
        n: u64,
    },
    /// The sizes of a file were not handed in.
    #[error("the sizes of {file} must be read before the mesh is begun")]
    SizeField {
        /// The file of sizes.
        file: String,
    },
    /// Nothing is enclosed by the surface under the chosen rule for regions.
    #[error("no region is filled: the surface encloses nothing under the rule {policy}")]
    NothingFilled {
        /// The rule for regions.
        policy: String,
    },
    /// There is no version of before to go back to.
    #[error("{path} keeps no previous version of any sub-domain")]
    NothingToUndo {
        /// Directory of the store.
        path: std::path::PathBuf,
    },
    /// Sizes for the tetrahedra or vertices of sub-domains that have another number of them.
    #[error(
        "{found} lengths for {tets} tetrahedra or {vertices} vertices: expected one for each, in the order of the .npy export"
    )]
    SizeCount {
        /// Number of lengths given.
        found: u64,
        /// Tetrahedra of the sub-domains.
        tets: u64,
        /// Vertices of the sub-domains.
        vertices: u64,
    },
    /// There are no tasks to do, or not yet.
    #[error("{path} has no tasks that could be done now: {reason}")]
    NoPlan {
        /// Directory of the store.
        path: std::path::PathBuf,
        /// Why.
        reason: String,
    },
    /// A process that helped could not do its part.
    #[error("{}", .0.message)]
    Helper(RemoteFailure),
    /// A file that tasks exchange cannot be used.
    #[error("{path} cannot be used: {what}")]
    TaskFile {
        /// The file.
        path: std::path::PathBuf,
        /// What is wrong with it.
        what: String,
    },
    /// All tetrahedra came to lie on one side of a cut.
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
    /// The option that the message begins with.
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
