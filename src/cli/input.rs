//! Surfaces as arguments: files, or samples generated on the spot.

use std::path::Path;

use super::args::SheetArgs;
use super::console::Console;
use super::failure::Failure;
use super::memory;
use super::words::count;
use tetdb_base::storage::{ScratchSpace, attempt};
use tetdb_base::surface;
use tetdb_engine::api::Surface;
use tetdb_engine::api::preflight::scratch_beside;
use tetdb_io::read::WireKind;

/// The memory a command may hold, and where its scratch files go.
#[derive(Clone, Copy)]
pub struct Space<'a> {
    /// Bytes in all.
    pub cap: u64,
    /// Scratch files are created beside this, which need not exist.
    pub beside: &'a Path,
}

impl<'a> Space<'a> {
    /// As the option asks.
    pub fn of(option: Option<&str>, beside: &'a Path) -> Result<Self, Failure> {
        let cap = memory::cap(option)?;
        Ok(Self { cap, beside })
    }

    /// What is left beside a surface.
    pub fn scratch(self, surface: &surface::Surface) -> Result<ScratchSpace, Failure> {
        Ok(scratch_beside(surface, self.cap, self.beside)?)
    }
}

/// Reads files or generates a sample.
pub fn load(arguments: &[String], space: Space, console: &Console) -> Result<Surface, Failure> {
    let surface = Surface::load(arguments, space.cap)?;
    let scratch = space.scratch(&surface.inner)?;
    let surface = surface.oriented(&scratch)?;
    for note in surface.notes() {
        console.note(&format!("note: {note}"));
    }
    Ok(surface)
}

/// [`load`], with the sheets in it, divided where edges and points lie on triangles if it `divides`.
pub fn load_with(
    arguments: &[String],
    (sheets, divides): (&SheetArgs, bool),
    space: Space,
    console: &Console,
) -> Result<Surface, Failure> {
    let mut names: Vec<(&str, &str)> = Vec::new();
    for text in &sheets.name {
        let (file, name) = text.rsplit_once('=').unwrap_or((text, ""));
        if name.is_empty() || !sheets.files().any(|embedded| embedded == file) {
            let message = format!("--name {text} is not an embedded file, `=` and a name");
            return Err(Failure::new("usage", message)
                .help("such as --embed fault.stl --name fault.stl=north"));
        }
        names.push((file, name));
    }
    let mut surface = load(arguments, space, console)?;
    if sheets.allow_open {
        let (with, n) = surface.open_parts_in(&space.scratch(&Default::default())?)?;
        surface = with;
        console.note(&format!("note: sheets: {} of open parts", count(n as u64, "triangle")));
    }
    let name_of = |file: &String| {
        let name = names.iter().find(|(known, _)| known == file);
        name.map(|(_, name)| *name)
    };
    for file in &sheets.embed {
        let sheet = load(std::slice::from_ref(file), space, console)?;
        surface = surface.embedded(sheet, name_of(file))?;
    }
    if divides {
        surface = surface.dividing();
    }
    let edges = sheets.embed_edges.iter().map(|file| (file, WireKind::Edges));
    let points = sheets.embed_points.iter().map(|file| (file, WireKind::Points));
    for (file, kind) in edges.chain(points) {
        let scratch = space.scratch(&surface.inner)?;
        surface = surface.with_wires(Path::new(file), kind, name_of(file), &scratch)?;
    }
    if surface.inner.has_embedded() {
        let wires = &surface.inner.embedded;
        let (edges, points) = (wires.edges.len() as u64, wires.points.len() as u64);
        console.note(&format!(
            "note: inside: {} and {}",
            count(edges, "edge"),
            count(points, "point")
        ));
    }
    Ok(surface)
}

/// [`load_with`], and refuse a surface with defects.
pub fn load_valid(
    arguments: &[String],
    sheets: (&SheetArgs, bool),
    space: Space,
    console: &Console,
) -> Result<Surface, Failure> {
    let surface = load_with(arguments, sheets, space, console)?;
    validated(&surface.inner, space)?;
    Ok(surface)
}

/// Validates completely.
pub fn validated(surface: &surface::Surface, space: Space) -> Result<(), Failure> {
    let scratch = space.scratch(surface)?;
    Ok(attempt(|| surface::validate_with(surface, &scratch))?.accept()?)
}
