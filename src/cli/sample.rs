//! `sample`: made surfaces as files.

use serde_json::json;

use super::args::SampleArgs;
use super::console::Console;
use super::failure::Failure;
use super::input::{self, Space};
use crate::api::targets::check_target;
use crate::io::write;
use crate::samples::PREFIX;

pub fn run(args: &SampleArgs, console: &Console) -> Result<u8, Failure> {
    let word = if args.sample.starts_with(PREFIX) {
        args.sample.clone()
    } else {
        format!("{PREFIX}{}", args.sample)
    };
    check_target(&args.output, &[])?;
    let surface = input::load(&[word], Space::Boundless, console)?.inner;
    write::surface(&surface, &args.output)?;
    let (triangles, vertices) = (surface.n_triangles(), surface.n_vertices());
    if console.is_json() {
        let file = args.output.display().to_string();
        console.answer(
            &json!({ "schema": 1, "file": file, "triangles": triangles, "vertices": vertices }),
        );
    } else {
        console.note(&format!(
            "wrote {triangles} triangles and {vertices} vertices to {}",
            args.output.display()
        ));
    }
    Ok(0)
}
