//! `verify`: is it a valid mesh of its surface?

use std::path::Path;

use serde_json::json;

use super::args::VerifyArgs;
use super::console::Console;
use super::failure::Failure;
use super::input::Space;
use super::{memory, store};
use crate::audit::{self, Level, Report, VerifyOptions};
use crate::storage::attempt;
use crate::store::{Catalog, StoreError};
use crate::surface::Surface;

pub fn run(args: &VerifyArgs, console: &Console) -> Result<u8, Failure> {
    let (cap, _) = memory::cap(args.read.memory.as_deref())?;
    let mut open = store::open_finished(&args.store)?;
    // The store may be one that can only be read.
    let scratch = std::env::temp_dir().join("verify");
    let space = Space::Capped(cap, &scratch);
    let surface = match store::surface_of(&mut open, &args.against, space, console) {
        Ok(input) => Some(input.surface),
        Err(failure) if args.against.is_empty() && failure.code == "unreadable-file" => {
            console.note("note: the surface is not where it was; the mesh is verified without it (give it with --against)");
            None
        }
        Err(failure) => return Err(failure),
    };
    let level = if args.full {
        Level::Delaunay
    } else {
        Level::Geometry
    };
    let report = check(&mut open, console, surface.as_ref(), cap, level)?;
    if console.is_json() {
        let mut answer = serde_json::to_value(&report).unwrap_or_default();
        answer["schema"] = json!(1);
        console.answer(&answer);
        return Ok(if report.valid { 0 } else { 7 });
    }
    if !report.valid {
        return Err(invalid(&report, &args.store));
    }
    console.line(&sentence(&report));
    Ok(0)
}

/// Verifies within `cap`, less what the surface holds. What is damaged is listed, all of it.
pub fn check(
    store: &mut Catalog,
    console: &Console,
    surface: Option<&Surface>,
    cap: u64,
    level: Level,
) -> Result<Report, Failure> {
    let held = surface.map_or(0, Surface::bytes) as u64;
    let memory = cap.saturating_sub(held).min(1 << 30) / 2;
    let options = VerifyOptions {
        level,
        memory_bytes: memory as usize,
        temp_dir: std::env::temp_dir(),
    };
    let verified = attempt(|| audit::verify(store, surface, &options));
    let error = match verified.map_err(StoreError::from) {
        Ok(Ok(report)) => return Ok(report),
        Ok(Err(error)) | Err(error) => error,
    };
    if error.is_damage()
        && let Ok(Ok(list)) = attempt(|| audit::damage(store))
    {
        list.iter()
            .for_each(|damage| console.note(&damage.to_string()));
    }
    Err(error.into())
}

/// A valid report in one line.
pub fn sentence(report: &Report) -> String {
    let mut text = format!(
        "verified: {} tetrahedra, all positive by exact signs; {} inner faces paired",
        report.tets, report.inner_faces
    );
    if report.against_input {
        text += &format!(
            "; all {} input triangles present, no vertex added on the surface",
            report.triangles_present + report.triangles_unfilled
        );
    }
    if report.delaunay_tested > 0 {
        text += &format!(
            "; {:.3} % of free faces locally Delaunay",
            100.0 * report.delaunay_share()
        );
    }
    text
}

/// The error for an invalid mesh.
pub fn invalid(report: &Report, path: &Path) -> Failure {
    let findings: Vec<String> = report
        .findings
        .iter()
        .map(|(f, n)| format!("{n} x {f:?}"))
        .collect();
    let first = report.offenders.first();
    Failure::new(
        "invalid-mesh",
        format!(
            "{} is not a valid mesh: {}",
            path.display(),
            findings.join(", ")
        ),
    )
    .at(first.map_or_else(String::new, |o| {
        format!(
            "{} {} {:?}",
            o.tet.as_deref().unwrap_or("-"),
            o.what,
            o.points
        )
    }))
    .help(format!(
        "`tetdb verify {} --full --json` lists examples of each kind",
        path.display()
    ))
}
