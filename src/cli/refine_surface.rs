//! `refine-surface`: the same surface in finer triangles.

use std::path::PathBuf;

use serde_json::json;

use super::args::{RefineSurfaceArgs, SheetArgs};
use super::console::Console;
use super::failure::Failure;
use super::input::{self, Space};
use tetdb_base::geom::short;
use tetdb_engine::api::surface::refine;
use tetdb_engine::api::targets::check_target;
use tetdb_io::write;
use tetdb_kernel::sizing::SizeOptions;

pub fn run(args: &RefineSurfaceArgs, console: &Console) -> Result<u8, Failure> {
    let options = SizeOptions::parse(Some(&args.hsiz), None, None, args.hgrad.as_deref())?;
    if !args.force {
        check_target(&args.output, &[PathBuf::from(&args.surface)])?;
    }
    let space = Space::of(args.memory.as_deref(), &args.output)?;
    let input = input::load_valid(
        std::slice::from_ref(&args.surface),
        (&SheetArgs::default(), false),
        space,
        console,
    )?;
    let surface = input.inner;
    let (fine, report) = refine(&surface, &options, &space.scratch(&surface)?)?;
    input::validated(&fine, space)?;
    write::surface(&fine, &args.output)?;
    let (triangles, vertices) = (fine.n_triangles(), fine.n_vertices());
    if console.is_json() {
        console.answer(&json!({
            "schema": 1, "file": args.output.display().to_string(), "triangles": triangles, "vertices": vertices,
            "triangles_before": surface.n_triangles(), "report": report,
        }));
    } else {
        console.note(&format!(
            "wrote {triangles} triangles ({} before) and {vertices} vertices to {}; new vertices are at most {} off the triangles they divide",
            surface.n_triangles(),
            args.output.display(),
            short(report.deviation_max)
        ));
    }
    Ok(0)
}
