//! The command `wrap`: a closed surface around anything.

use std::path::PathBuf;

use serde_json::json;

use super::args::{WrapArgs, WrapLengths};
use super::console::Console;
use super::failure::Failure;
use super::{input, memory, threads};
use tetdb_engine::api::targets::check_target;
use tetdb_engine::api::{Error, Length, Surface, SurfaceWrap};

/// The lengths of a wrap, by the names of their options; those not given are the usual ones.
pub fn lengths(args: &WrapLengths, names: [&'static str; 2]) -> Result<SurfaceWrap, Failure> {
    let mut options = SurfaceWrap::default();
    let both = [(&args.gap, &mut options.gap), (&args.offset, &mut options.offset)];
    for (name, (text, length)) in names.into_iter().zip(both) {
        if let Some(text) = text {
            *length = Length::parse(name, text).map_err(Error::from)?;
        }
    }
    Ok(options)
}

pub fn run(args: &WrapArgs, console: &Console) -> Result<u8, Failure> {
    let options = lengths(&args.lengths, ["gap", "offset"])?;
    Surface::check_format(&args.output)?;
    let inputs: Vec<PathBuf> = args.surfaces.iter().map(PathBuf::from).collect();
    if !args.force {
        check_target(&args.output, &inputs).map_err(|e| Failure::from(e).or_force(&args.output))?;
    }
    let cap = memory::requested(args.memory.as_deref())?;
    let settings = console.settings(cap, threads::requested(args.threads)?);
    let settings = input::scratch_beside(settings, &args.output);
    let surface = Surface::load(&args.surfaces, &settings)?.own_edges_with(&settings)?;
    let (wrap, report) = surface.wrapped_with(&options, &settings)?;
    let written = wrap.write(&args.output)?;
    console.done();
    input::note_lost(&surface, written, console);
    if console.is_json() {
        console.answer(&json!({
            "schema": 1, "file": args.output.display().to_string(), "triangles": wrap.n_triangles(),
            "vertices": wrap.n_vertices(), "report": report, "peak_bytes": memory::peak(),
        }));
        return Ok(0);
    }
    console.note(&format!("wrote {}: {}", args.output.display(), report.in_words()));
    Ok(0)
}
