//! The certificate of a finished store, from the files on disk alone.
//!
//! # Proof
//! Let every tetrahedron have an exactly positive orientation. Let the faces cancel in pairs of opposite orientation, except for input triangles,
//! which have the orientation of their filled side. Then the sum of the tetrahedra, as a chain, has the filled sides of the input as its boundary.
//! The number of tetrahedra over a generic point is the winding number of that boundary there: one inside, zero outside. So local tests show that
//! there is no overlap, no gap and no inverted tetrahedron. Equal faces may cancel in any pairing. Therefore faces are first matched inside each
//! chunk, and only the open ones are sorted externally.
//!
//! Sub-domains are verified one by one, by any process; their findings are added up in order.
//!
//! Reading order: [`Report`] (the findings), `pass` (once through a sub-domain), `mesh_sums` (sums over all), `part_report` (the findings of a sub-domain), `pairing` (faces
//! across chunks), `interface` (faces across sub-domains), `against` and `embedded` (the input), `rows` (summaries and the catalog). `damage` lists
//! everything that cannot be read.

mod against;
mod compare;
mod damage;
mod embedded;
mod interface;
mod mesh_sums;
mod options;
mod pairing;
mod part_report;
mod pass;
mod report;
mod rows;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

pub use compare::{Population, Qualities, qualities};
pub use damage::{damage, damage_of_version};
pub use embedded::wire_bytes;
pub use options::VerifyOptions;
pub use part_report::PartReport;
pub use report::{Finding, Level, Offender, Report};

use tetdb_schema::catalog::SubdomainRow;
use tetdb_schema::digest::Digest;

use crate::sealed::Subdomain;
use crate::store::{Catalog, StoreError};
use tetdb_base::geom::Point;
use tetdb_base::storage::StorageError;
use tetdb_base::surface::Surface;

/// Checks a sealed store, against its input when that is given.
///
/// Errors: damage, and failures of the disk; an invalid mesh is a [`Report`] that says so.
pub fn verify(
    store: &mut Catalog,
    surface: Option<&Surface>,
    options: &VerifyOptions,
) -> Result<Report, StoreError> {
    let scratch = VerifyScratch::new(&options.temp_dir)?;
    let mut audit = pass::Audit::new(surface, options, &scratch.path, None);
    for row in store.subdomains()? {
        audit.subdomain(&mut store.open_row(row, options.memory_bytes / 4)?)?;
    }
    end(store, audit)
}

/// Verifies the sub-domains: gets their rows, the apex for [`verify_part`], and a function that takes the findings of each, in the
/// order of the rows.
pub type EachPart<'a> = &'a mut dyn FnMut(
    &[SubdomainRow],
    Option<Point>,
    &mut dyn FnMut(PartReport) -> Result<(), StoreError>,
) -> Result<(), StoreError>;

/// Like [`verify`], but `each` verifies the sub-domains. Errors: also those of `each`.
pub fn verify_shared(
    store: &mut Catalog,
    surface: Option<&Surface>,
    options: &VerifyOptions,
    each: EachPart,
) -> Result<Report, StoreError> {
    let scratch = VerifyScratch::new(&options.temp_dir)?;
    let rows = store.subdomains()?;
    let apex = apex(store, &rows, options);
    let mut audit = pass::Audit::new(surface, options, &scratch.path, apex);
    each(&rows, apex, &mut |part| audit.add(part))?;
    end(store, audit)
}

/// The first corner of the boundary; `None` where there is none, or damage, which is found later.
fn apex(store: &mut Catalog, rows: &[SubdomainRow], options: &VerifyOptions) -> Option<Point> {
    let first = rows.iter().find(|row| row.facets > 0)?;
    let mut part = store.open_row(first.clone(), options.memory_bytes / 4).ok()?;
    let facet = *part.facet_chunk(0).ok()?.records.first()?;
    Some(part.corners(facet.vertices).ok()?[0].point)
}

/// Verifies one sub-domain. Errors: as [`verify`].
pub fn verify_part(
    part: &mut Subdomain,
    apex: Option<Point>,
    surface: Option<&Surface>,
    options: &VerifyOptions,
) -> Result<PartReport, StoreError> {
    let scratch = VerifyScratch::new(&options.temp_dir)?;
    let mut audit = pass::Audit::new(surface, options, &scratch.path, apex);
    audit.subdomain(part)?;
    audit.into_part()
}

/// Ends a verification with the checks of the whole mesh.
fn end(store: &mut Catalog, audit: pass::Audit) -> Result<Report, StoreError> {
    // Kept snapshots and stages are no part of the mesh, but their damage must be found before they are needed.
    if let Some(first) = damage::snapshot_damage(store)?.into_iter().next() {
        return Err(first);
    }
    let interfaces = store.interfaces()?;
    let regions = store.regions()?;
    let mut report = audit.finish(&interfaces, &regions)?;
    rows::check_catalog(store, &mut report)?;
    Ok(report)
}

/// The digests of all tetrahedra and of all interface faces, recomputed from the chunks.
///
/// Errors: damage, and failures of the disk.
pub fn digest(store: &mut Catalog, memory_bytes: usize) -> Result<[Digest; 2], StoreError> {
    let mut both = [Digest::default(); 2];
    for row in store.subdomains()? {
        let mut part = store.open_subdomain(row.rank, memory_bytes)?;
        for chunk in 0..part.tet_summaries().len() {
            for tet in part.tet_chunk(chunk as u32)?.records {
                let corners = part.corners(tet.nodes)?;
                both[0].add_tet(corners.map(|c| c.mix), tet.region, row.rank);
            }
        }
        let faces = part.interfaces().collect::<Result<Vec<_>, _>>()?;
        for face in faces {
            let corners = part.corners(face.vertices)?;
            both[1].add_face(corners.map(|c| c.mix), face.cut);
        }
    }
    Ok(both)
}

/// A folder that is removed when it is dropped.
struct VerifyScratch {
    path: PathBuf,
}

impl VerifyScratch {
    fn new(parent: &Path) -> Result<Self, StoreError> {
        use std::sync::atomic::{AtomicU32, Ordering};
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let path = parent.join(format!("verify-{}-{number}", std::process::id()));
        std::fs::create_dir_all(&path).map_err(|e| StorageError::io(&path, e))?;
        Ok(Self { path })
    }
}

impl Drop for VerifyScratch {
    fn drop(&mut self) {
        // A folder that cannot be removed is only untidy.
        let _ = std::fs::remove_dir_all(&self.path);
    }
}
