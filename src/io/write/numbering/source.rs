//! The sub-domains that are written, and what of each.

use std::fs;
use std::path::{Path, PathBuf};

use super::subset::Subset;
use crate::write::error::{Result, WriteError};
use crate::write::scope::Scope;
use tetdb_schema::catalog::SubdomainRow;
use tetdb_schema::record::NO_TET;
use tetdb_store::sealed::Subdomain;
use tetdb_store::store::Catalog;

/// A sub-domain of which all or some is written.
#[derive(Clone)]
pub(in crate::write) struct Source {
    pub row: SubdomainRow,
    /// Tetrahedra and vertices that are written.
    pub n_tets: u64,
    pub n_vertices: u64,
    /// Scratch file of the subset, unless all is written.
    subset: Option<PathBuf>,
}

impl Source {
    /// The tetrahedra of a sub-domain that `scope` writes, and their vertices.
    fn gather(
        store: &mut Catalog,
        row: SubdomainRow,
        scope: Scope,
        dir: &Path,
        memory: usize,
    ) -> Result<Self> {
        let mut source = Self { n_tets: row.tets, n_vertices: row.vertices, row, subset: None };
        let mut part = store.open_subdomain(source.row.rank, memory / 4)?;
        if !scope.regions.is_empty() || has_free_facet(&mut part)? {
            let path = dir.join(format!("subset-{}", source.row.rank));
            let all = [source.n_tets, source.n_vertices];
            [source.n_tets, source.n_vertices] = Subset::gather(&mut part, scope.regions, &path)?;
            source.subset = (all != [source.n_tets, source.n_vertices]).then_some(path);
        }
        Ok(source)
    }

    /// Returns whether some tetrahedra or vertices are not written.
    pub fn is_partial(&self) -> bool {
        self.subset.is_some()
    }

    /// Removes the scratch file of the subset, so that it can be found once more. Errors: the disk.
    pub fn discard(self) -> Result<()> {
        let remove = |path: PathBuf| fs::remove_file(&path).map_err(|e| WriteError::io(&path, e));
        self.subset.map_or(Ok(()), remove)
    }

    /// The written subset; `None` stands for all. Errors: the disk.
    pub fn subset(&self) -> Result<Option<Subset>> {
        let load = |path| Subset::load(path, self.row.tets);
        self.subset.as_deref().map(load).transpose()
    }
}

/// The sub-domains in `scope` and their written subsets; a sub-domain without written tetrahedra is left out. Errors: damage, the disk.
pub(in crate::write) fn sources(
    store: &mut Catalog,
    scope: Scope,
    dir: &Path,
    memory: usize,
) -> Result<Vec<Source>> {
    let mut sources = Vec::new();
    for row in store.subdomains()?.into_iter().filter(|row| scope.holds(row.rank)) {
        let source = Source::gather(store, row, scope, dir, memory)?;
        if source.n_tets > 0 || scope.regions.is_empty() {
            sources.push(source);
        }
    }
    Ok(sources)
}

/// Returns whether a facet lies between two empty regions. Every vertex has a tetrahedron or a facet, so without such a facet all have a tetrahedron.
fn has_free_facet(part: &mut Subdomain) -> Result<bool> {
    for facet in part.facets() {
        if facet?.tets == [NO_TET; 2] {
            return Ok(true);
        }
    }
    Ok(false)
}
