use thiserror::Error;

use crate::boundary::BoundaryError;
use crate::sealed::SealedError;
use crate::sizing::SizingError;
use crate::storage::StorageError;
use crate::store::StoreError;
use crate::surface::SurfaceError;

/// Why a run ended without a mesh. What the store held before is still there.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PipelineError {
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    #[error(transparent)]
    Boundary(#[from] BoundaryError),
    #[error(transparent)]
    Sizing(#[from] SizingError),
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error(transparent)]
    Storage(#[from] StorageError),
    /// An option that was checked before has no meaning any more.
    #[error("option {option}: '{value}' is not known")]
    Option { option: &'static str, value: String },
    /// The sizes of a file were not handed in.
    #[error("the sizes of {file} must be read before the mesh is begun")]
    SizeField { file: String },
    /// Nothing is enclosed by the surface under the chosen rule for regions.
    #[error("no region is filled: the surface encloses nothing under the rule {policy}")]
    NothingFilled { policy: String },
    /// There is no version of before to go back to.
    #[error("{path} keeps no previous version of any sub-domain")]
    NothingToUndo { path: std::path::PathBuf },
    /// Sizes for the tetrahedra or vertices of sub-domains that have another number of them.
    #[error(
        "{found} lengths for {tets} tetrahedra or {vertices} vertices: expected one for each, in the order of the .npy export"
    )]
    SizeCount {
        found: u64,
        tets: u64,
        vertices: u64,
    },
    /// All tetrahedra came to lie on one side of a cut.
    #[error("cut {cut} leaves no tetrahedron on one side: ask for fewer sub-domains")]
    EmptyPart { cut: u32 },
}

impl From<SealedError> for PipelineError {
    fn from(error: SealedError) -> Self {
        Self::from(StoreError::from(error))
    }
}
