//! The command `refine-surface`: divides the triangles of a surface.

use std::path::PathBuf;

use serde_json::json;

use super::args::RefineSurfaceArgs;
use super::console::Console;
use super::failure::Failure;
use super::{input, memory};
use tetdb_engine::api::targets::check_target;
use tetdb_engine::api::{Error, OptionsText, Surface, short};

pub fn run(args: &RefineSurfaceArgs, console: &Console) -> Result<u8, Failure> {
    let sizes = OptionsText {
        hsiz: Some(args.hsiz.clone()),
        hgrad: args.hgrad.clone(),
        ..OptionsText::default()
    };
    let sizes = sizes.sizes().map_err(Error::from)?;
    let Some(h) = sizes.hsiz else {
        unreachable!("it was given");
    };
    Surface::check_format(&args.output)?;
    if !args.force {
        check_target(&args.output, &[PathBuf::from(&args.surface)])
            .map_err(|e| Failure::from(e).or_force(&args.output))?;
    }
    let settings = console.settings(memory::requested(args.memory.as_deref())?, None);
    let settings = input::scratch_beside(settings, &args.output);
    let surface = Surface::load(std::slice::from_ref(&args.surface), &settings)?;
    let (fine, report) = surface.refined_with(h, sizes.hgrad, &settings)?;
    let written = fine.write(&args.output)?;
    input::note_lost(&surface, written, console);
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
