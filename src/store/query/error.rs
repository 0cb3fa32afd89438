//! Errors of questions.

use tetdb_schema::ids::{TetId, VertexId};

use crate::sealed::SealedError;
use crate::store::StoreError;
use tetdb_base::storage::StorageError;

/// Errors of questions.
#[derive(Debug, thiserror::Error)]
pub enum QueryError {
    /// The store could not be read.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The store has no such tetrahedron.
    #[error("there is no tetrahedron {id}")]
    NoTet {
        /// The requested id.
        id: TetId,
    },
    /// The sub-domain has no such chunk.
    #[error("sub-domain {subdomain} has no chunk {chunk} of tetrahedra")]
    NoChunk {
        /// Its rank.
        subdomain: u32,
        /// Number of the chunk.
        chunk: u32,
    },
    /// The store has no such vertex.
    #[error("there is no vertex {id}")]
    NoVertex {
        /// The requested id.
        id: VertexId,
    },
    /// No edge of the mesh joins the two vertices.
    #[error("no edge of the mesh joins {0} and {1}")]
    NoEdge(VertexId, VertexId),
    /// The store has no such label.
    #[error("there is no label {name:?}; the labels are {}", known.join(", "))]
    NoLabel {
        /// The requested label.
        name: String,
        /// The labels of the store.
        known: Vec<String>,
    },
    /// The store has no such region.
    #[error("there is no region {name}; the regions are {}", known.join(", "))]
    NoRegion {
        /// The requested region.
        name: String,
        /// Names or numbers of the regions.
        known: Vec<String>,
    },
    /// No stage of the cut was kept.
    #[error("no stage of cut {cut} is in the store; {}", cuts(kept))]
    NoStage {
        /// Number of the cut, from 1.
        cut: u32,
        /// Cuts of which stages were kept.
        kept: Vec<u32>,
    },
    /// The two sub-domains share no face.
    #[error("sub-domains {0} and {1} have no interface")]
    NoInterface(u32, u32),
}

impl From<SealedError> for QueryError {
    fn from(error: SealedError) -> Self {
        Self::from(StoreError::from(error))
    }
}
impl From<StorageError> for QueryError {
    fn from(error: StorageError) -> Self {
        Self::from(StoreError::from(error))
    }
}

fn cuts(kept: &[u32]) -> String {
    if kept.is_empty() {
        return "none was kept".to_owned();
    }
    let mut cuts: Vec<u32> = kept.to_vec();
    cuts.sort_unstable();
    cuts.dedup();
    let cuts: Vec<String> = cuts.iter().map(u32::to_string).collect();
    format!("there are {}", cuts.join(", "))
}
