//! Comparison of two meshes.

use std::path::Path;

use serde::Serialize;

use super::store::open_finished;
use super::{Error, Settings, guarded};
use tetdb_store::audit::{Qualities, qualities};

/// Largest memory for reading one of the two meshes, in bytes.
const MEMORY_MAX: u64 = 256 << 20;

/// Qualities of two meshes, and whether the meshes are equal.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct Comparison {
    /// True if the meshes are equal down to the last bit of each coordinate.
    pub same: bool,
    /// Qualities of the first mesh.
    pub first: Qualities,
    /// Qualities of the second mesh.
    pub second: Qualities,
    /// Digests of the tetrahedra of both meshes.
    pub digests: [String; 2],
}

impl Comparison {
    /// Reads both meshes, one after the other, and compares them.
    ///
    /// # Errors
    /// `no-such-store`, `not-a-store`, `store-unfinished`, `damaged`.
    pub fn of(
        first: impl AsRef<Path>,
        second: impl AsRef<Path>,
        settings: &Settings,
    ) -> Result<Self, Error> {
        guarded(settings, || {
            let memory = (settings.cap()? / 4).min(MEMORY_MAX) as usize;
            let read = |path: &Path| {
                let mut open = open_finished(path)?;
                let digest = open.digest()?;
                Ok::<_, Error>((digest, qualities(&mut open, memory)?))
            };
            let (digest_a, first) = read(first.as_ref())?;
            let (digest_b, second) = read(second.as_ref())?;
            let digests = [&digest_a, &digest_b].map(|[tets, _]| tets.to_string());
            Ok(Self { same: digest_a == digest_b, first, second, digests })
        })
    }
}
