//! Fields of one mesh evaluated on another, sub-domain by sub-domain and chunk by chunk of the new one.
//!
//! Each value depends on its place and the old mesh alone, and sums run in the order of the old mesh: the values are the same for any number
//! of threads and any memory. Each thread has the old mesh open for itself, with the chunks that it decoded last.
//!
//! Reading order: `overlap` (the volume that two tetrahedra share), `old_mesh`, `place` (points in it), `run` (the new files).

mod old_mesh;
mod overlap;
mod place;
mod run;

pub use run::{Transferred, transfer};

use tetdb_schema::field::{FieldPlace, FieldRow};
use tetdb_schema::word::Word;

/// How values are evaluated on another mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum TransferMethod {
    /// At vertices: linear in the old tetrahedron that holds the vertex. Integers take the value of its nearest corner.
    Linear,
    /// At tetrahedra: the mean of the old values by the volumes of what they share. Integers take the value with the most volume.
    Overlap,
    /// The value of the nearest corner of the old tetrahedron that holds the vertex, or of the one that holds the centroid.
    Nearest,
}

impl Word for TransferMethod {
    const WORDS: &'static [(Self, &'static str)] =
        &[(Self::Linear, "linear"), (Self::Overlap, "overlap"), (Self::Nearest, "nearest")];
}

impl TransferMethod {
    /// The method for values at a place, where none is asked for.
    pub fn default_at(place: FieldPlace) -> Self {
        match place {
            FieldPlace::Vertices => Self::Linear,
            FieldPlace::Tets => Self::Overlap,
        }
    }

    /// Returns whether the method evaluates values at a place.
    pub fn is_for(self, place: FieldPlace) -> bool {
        self == Self::Nearest || self == Self::default_at(place)
    }
}

/// A field that is evaluated on another mesh.
#[derive(Clone, Debug)]
pub struct FieldTransfer {
    /// Its row in the old mesh's store.
    pub old: FieldRow,
    /// Its row in the new mesh's store; place, type and components are the same.
    pub new: FieldRow,
    /// One for all fields at a place.
    pub method: TransferMethod,
    /// Number in the names of the new files.
    pub serial: u32,
}
