//! Facts of the mesh that files begin with: the tetrahedra of each region, and where the mesh comes from.

use std::collections::{BTreeMap, BTreeSet};

use super::error::Result;
use super::merged::Merged;
use tetdb_schema::blob::Blob;

impl Merged<'_> {
    /// Number of tetrahedra of each region that is written; decodes only chunks of several regions. Errors: damage.
    pub fn region_counts(&mut self) -> Result<BTreeMap<u32, u64>> {
        let mut counts = BTreeMap::new();
        for part in self.parts() {
            let mut part = self.store.open_subdomain(part.rank, self.memory / 4)?;
            for chunk in 0..part.tet_summaries().len() {
                let summary = part.tet_summaries()[chunk];
                let [least, greatest] = summary.regions;
                if least == greatest {
                    *counts.entry(least).or_default() += u64::from(summary.count);
                    continue;
                }
                for tet in part.tet_chunk(chunk as u32)?.records.iter() {
                    *counts.entry(tet.region).or_default() += 1;
                }
            }
        }
        counts.retain(|region, _| self.writes(*region));
        Ok(counts)
    }

    /// The regions that have tetrahedra. Errors: damage.
    pub fn regions(&mut self) -> Result<BTreeSet<u32>> {
        Ok(self.region_counts()?.into_keys().collect())
    }

    /// Lines that name the program, the digest of the whole mesh and, where it is on record, the recipe. Errors: damage.
    pub fn origin(&mut self) -> Result<Vec<String>> {
        let [digest, _] = self.store.digest()?;
        let mut lines = vec![
            concat!("exported by tetdb ", env!("CARGO_PKG_VERSION")).to_owned(),
            format!("digest {digest}"),
        ];
        let recipe = self.store.blob(Blob::Recipe)?;
        if let Some(recipe) = recipe.and_then(|bytes| bytes.try_into().ok()) {
            lines.push(format!("recipe {}", u32::from_le_bytes(recipe)));
        }
        Ok(lines)
    }
}
