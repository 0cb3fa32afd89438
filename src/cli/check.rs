//! `check`: can a surface be meshed?

use serde_json::json;

use super::args::CheckArgs;
use super::failure::Failure;
use super::input;
use super::talk::Talk;
use crate::surface::validate;

/// Defects listed in full.
const LISTED: usize = 20;

pub fn run(args: &CheckArgs, talk: &Talk) -> Result<u8, Failure> {
    let input = input::load(&args.surfaces, talk)?;
    let (surface, validation) = (&input.surface, validate(&input.surface));
    if talk.is_json() {
        let defects: Vec<_> = validation
            .defects
            .iter()
            .map(|d| {
                json!({ "code": d.code(), "triangles": d.triangles(), "at": d.at().map(|p| p.to_array()),
                    "message": d.to_string(), "help": d.help() })
            })
            .collect();
        talk.answer(&json!({
            "schema": 1, "triangles": surface.n_triangles(), "vertices": surface.n_vertices(),
            "labels": surface.label_names, "turned_triangles": input.turned, "valid": validation.is_valid(),
            "n_defects": validation.n_defects, "defects": defects,
        }));
    } else {
        talk.line(&format!(
            "{} triangles, {} vertices",
            surface.n_triangles(),
            surface.n_vertices()
        ));
        for defect in validation.defects.iter().take(LISTED) {
            talk.line(&format!("{}: {defect} ({})", defect.code(), defect.place()));
        }
        if validation.n_defects as usize > LISTED {
            talk.line(&format!(
                "... {} defects in all; --json lists them",
                validation.n_defects
            ));
        }
        if validation.is_valid() {
            talk.line("closed and free of defects: it can be meshed");
        } else if let Some(first) = validation.defects.first() {
            talk.line(&format!("help: {}", first.help()));
        }
    }
    Ok(if validation.is_valid() { 0 } else { 3 })
}
