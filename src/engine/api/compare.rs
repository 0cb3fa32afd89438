//! Comparison of two meshes.

use std::path::Path;

use serde::Serialize;

use super::store::open_finished;
use super::{Error, Settings, guarded};
use tetdb_schema::catalog::SubdomainRow;
use tetdb_schema::digest::Digest;
use tetdb_store::audit::{Qualities, qualities};
use tetdb_store::store::Catalog;

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
    /// Reads both meshes, one after the other, and compares them. The first is read at the version that the settings name.
    ///
    /// # Errors
    /// `no-such-store`, `not-a-store`, `store-unfinished`, `no-such-part`, `damaged`.
    pub fn of(
        first: impl AsRef<Path>,
        second: impl AsRef<Path>,
        settings: &Settings,
    ) -> Result<Self, Error> {
        guarded(settings, || {
            let now = settings.at_now();
            let (mut first, mut second) =
                (open_finished(first.as_ref(), settings)?, open_finished(second.as_ref(), &now)?);
            let rows = [first.subdomains()?, second.subdomains()?];
            Self::of_rows([(&first, &rows[0]), (&second, &rows[1])], settings)
        })
    }

    /// Compares some sub-domains of two meshes.
    pub(super) fn of_rows(
        [first, second]: [(&Catalog, &[SubdomainRow]); 2],
        settings: &Settings,
    ) -> Result<Self, Error> {
        let memory = (settings.cap()? / 4).min(MEMORY_MAX) as usize;
        let digests = [first.1, second.1].map(digests);
        Ok(Self {
            same: digests[0] == digests[1],
            first: qualities(first.0, first.1, memory)?,
            second: qualities(second.0, second.1, memory)?,
            digests: digests.map(|[tets, _]| tets.to_string()),
        })
    }
}

/// Digests of the tetrahedra and of the interface faces of sub-domains.
pub(super) fn digests(rows: &[SubdomainRow]) -> [Digest; 2] {
    let mut both = [Digest::default(); 2];
    for row in rows {
        both[0].merge(&Digest { lanes: row.digest });
        both[1].merge(&Digest { lanes: row.interface_digest });
    }
    both
}
