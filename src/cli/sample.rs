//! `sample`: made surfaces as files.

use serde_json::json;

use super::args::SampleArgs;
use super::failure::Failure;
use super::input::{self, Space};
use super::talk::Talk;
use crate::io::write;
use crate::samples::PREFIX;

pub fn run(args: &SampleArgs, talk: &Talk) -> Result<u8, Failure> {
    let word = if args.sample.starts_with(PREFIX) {
        args.sample.clone()
    } else {
        format!("{PREFIX}{}", args.sample)
    };
    let surface = input::load(&[word], Space::Boundless, talk)?.surface;
    write::surface(&surface, &args.output)?;
    let (triangles, vertices) = (surface.n_triangles(), surface.n_vertices());
    if talk.is_json() {
        let file = args.output.display().to_string();
        talk.answer(
            &json!({ "schema": 1, "file": file, "triangles": triangles, "vertices": vertices }),
        );
    } else {
        talk.note(&format!(
            "wrote {triangles} triangles and {vertices} vertices to {}",
            args.output.display()
        ));
    }
    Ok(0)
}
