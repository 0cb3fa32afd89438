//! Verification of a mesh with exact signs.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use serde::Serialize;
use tetdb_schema::code::Code;

use super::error::{Error, Remedy};
use super::{Settings, verify_shared};
use tetdb_base::geom::{Point, short};
use tetdb_base::storage::attempt;
use tetdb_base::surface::{Surface, show};
use tetdb_schema::catalog::StoreState;
use tetdb_store::audit::{self, Finding, Level, Report};
use tetdb_store::store::{Catalog, StoreError, WriterLock};

/// Extent of a verification. Each level includes the levels before it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum VerifyLevel {
    /// Positive volumes, paired faces, all input triangles present, interfaces equal on both sides.
    #[default]
    Geometry,
    /// Also counts the free faces that are locally Delaunay.
    Delaunay,
}

/// Result of a verification.
///
/// Serialized, it is the answer of `tetdb verify --json`; the guide lists the keys.
#[derive(Clone, Debug, Serialize)]
#[serde(transparent)]
pub struct Verification {
    pub(super) report: Report,
    /// True if the mesh was compared with a given surface, while its own was refined before it was meshed.
    #[serde(skip)]
    pub(super) is_refined: bool,
}

impl Verification {
    /// Returns whether the mesh is valid.
    pub fn is_valid(&self) -> bool {
        self.report.valid
    }

    /// Number of checked tetrahedra.
    pub fn n_tets(&self) -> u64 {
        self.report.tets
    }

    /// Summary of the checks of a valid mesh, in one line.
    pub fn sentence(&self) -> String {
        sentence(&self.report)
    }

    /// Returns an error if the mesh at `store` is invalid.
    ///
    /// # Errors
    /// `invalid-mesh`, with the first offending tetrahedron.
    pub fn accept(&self, store: &Path) -> Result<(), Error> {
        if self.report.valid {
            return Ok(());
        }
        let error = invalid(&self.report, store);
        match self.is_refined && self.report.count(Finding::NotAnInputTriangle) > 0 {
            true => Err(error.with_help(
                "the store's surface was refined before it was meshed: it is the copy in the store, surface.obj, not the surface that was given",
            ).with_remedy(Remedy::AsSaid)),
            false => Err(error),
        }
    }

    /// Kinds of defects in words, with the number of each.
    pub fn findings(&self) -> Vec<(String, u64)> {
        let findings = self.report.findings.iter();
        findings.map(|(f, &n)| (format!("{f:?}"), n)).collect()
    }
}

/// Verifies a mesh within `cap`, less the memory of the surface. If the store is damaged, all damage is reported as notes.
pub(super) fn check(
    store: &mut Catalog,
    settings: &Settings,
    surface: Option<&Surface>,
    cap: u64,
    level: Level,
) -> Result<Report, Error> {
    let mut options = verify_shared::options((cap, settings.scratch_dir()), surface, level);
    // Damage is found by the verification itself.
    let total = store.subdomains().map_or(0, |rows| rows.iter().map(|row| row.tets).sum());
    let (listener, seen) = (settings.clone(), AtomicU64::new(0));
    options.progress = Some(Arc::new(move |n| {
        let done = seen.fetch_add(n, Ordering::Relaxed) + n;
        listener.count("verify", done, total, "tetrahedra");
    }));
    let verified = attempt(|| verify_shared::verify(store, settings, surface, &options));
    let error = match verified.map_err(StoreError::from) {
        Ok(Ok(report)) => return Ok(report),
        Ok(Err(error)) | Err(error) => error,
    };
    if error.is_damage()
        && let Ok(Ok(list)) = attempt(|| audit::damage(store))
    {
        list.iter().for_each(|damage| settings.note(damage.to_string()));
    }
    Err(error.into())
}

/// Summary of a valid report, in one line.
pub(super) fn sentence(report: &Report) -> String {
    let mut text = format!(
        "verified: {} {}, all positive by exact signs; {} inner faces paired",
        report.tets,
        if report.tets == 1 { "tetrahedron" } else { "tetrahedra" },
        report.inner_faces
    );
    if report.against_input {
        text += &match report.triangles_unfilled {
            0 => format!("; all {} input triangles present", report.triangles_present),
            n => format!(
                "; {} input triangles present, {n} others touch no filled region",
                report.triangles_present
            ),
        };
        text += ", no vertex added on the surface";
    }
    if report.edges_present + report.points_present > 0 {
        text += &format!(
            "; all {} embedded edges and {} points present",
            report.edges_present, report.points_present
        );
    }
    if report.delaunay_tested > 0 {
        text += &format!(
            "; {} % of free faces locally Delaunay",
            // Rounded down, so that only a share of 1 reads as 100 %.
            short((1e4 * report.delaunay_share()).floor() / 100.0)
        );
    }
    text
}

/// Splits a name into words: `NotAnInputTriangle` becomes `not an input triangle`.
fn words_of(name: &str) -> String {
    let mut words = String::new();
    for c in name.chars() {
        if c.is_uppercase() && !words.is_empty() {
            words.push(' ');
        }
        words.extend(c.to_lowercase());
    }
    words
}

/// The error for an invalid mesh.
pub(super) fn invalid(report: &Report, path: &Path) -> Error {
    let findings: Vec<String> = report
        .findings
        .iter()
        .map(|(f, n)| format!("{n} x {}", words_of(&format!("{f:?}"))))
        .collect();
    let first = report.offenders.first();
    Error::new(
        Code::InvalidMesh,
        format!("{} is not a valid mesh: {}", path.display(), findings.join(", ")),
    )
    .at(first.map_or_else(String::new, |o| {
        let tet = (o.tet.as_ref()).map_or(String::new(), |id| format!("tetrahedron {id}: "));
        let corners: Vec<String> = (o.points.iter()).map(|&p| show(Point::from_array(p))).collect();
        format!("{tet}{} {}", o.what, corners.join(" "))
    }))
    .with_help("a full verification lists examples of each kind")
    .with_remedy(Remedy::General)
}

/// Records that a finished store was verified. `lock` was held throughout, so nobody else has changed the store.
pub(super) fn record(path: &Path, lock: Arc<WriterLock>) -> Result<(), Error> {
    let mut catalog = Catalog::open_locked(path, lock)?;
    if catalog.state()? < StoreState::Verified {
        catalog.commit(|step| {
            step.set_state(StoreState::Verified);
            Ok(())
        })?;
    }
    Ok(catalog.close()?)
}
