//! The command `remesh-surface`: even triangles within a tolerance.

use std::path::PathBuf;

use serde_json::json;

use super::args::RemeshSurfaceArgs;
use super::console::Console;
use super::failure::Failure;
use super::{input, memory};
use tetdb_engine::api::targets::check_target;
use tetdb_engine::api::{Error, Length, OptionsText, Surface, SurfaceRemesh, short};

pub fn run(args: &RemeshSurfaceArgs, console: &Console) -> Result<u8, Failure> {
    let sizes = OptionsText {
        hsiz: args.hsiz.clone(),
        hmin: args.hmin.clone(),
        hmax: args.hmax.clone(),
        hgrad: args.hgrad.clone(),
        ..OptionsText::default()
    };
    let sizes = sizes.sizes().map_err(Error::from)?;
    let mut options = SurfaceRemesh::default().sized(&sizes);
    options.tolerance = Length::parse("tolerance", &args.tolerance).map_err(Error::from)?;
    options.feature_angle = args.feature_angle;
    Surface::check_format(&args.output)?;
    if !args.force {
        check_target(&args.output, &[PathBuf::from(&args.surface)])
            .map_err(|e| Failure::from(e).or_force(&args.output))?;
    }
    let settings = console.settings(memory::requested(args.memory.as_deref())?, None);
    let settings = input::scratch_beside(settings, &args.output);
    let surface = Surface::load(std::slice::from_ref(&args.surface), &settings)?;
    let (even, report) = surface.remeshed_with(&options, &settings)?;
    let written = even.write(&args.output)?;
    input::note_lost(&surface, written, console);
    let vertices = even.n_vertices();
    if console.is_json() {
        console.answer(&json!({
            "schema": 1, "file": args.output.display().to_string(), "triangles": even.n_triangles(), "vertices": vertices,
            "report": report,
        }));
        return Ok(0);
    }
    console.note(&format!(
        "wrote {} triangles ({} before) and {} vertices to {}; no point of either surface is farther than {} from the other",
        report.triangles,
        report.triangles_before,
        vertices,
        args.output.display(),
        short(report.distance_bound)
    ));
    console.note(&format!(
        "smallest angle {} degrees ({} before); {} edges divided, {} collapsed, {} flipped, {} moves of vertices; {} curves and {} corners kept",
        short(report.angle),
        short(report.angle_before),
        report.splits,
        report.collapses,
        report.flips,
        report.moves,
        report.curves,
        report.corners,
    ));
    Ok(0)
}
