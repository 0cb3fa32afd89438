//! Surfaces as arguments: files, or samples generated on the spot.

use std::path::Path;

use super::console::Console;
use super::failure::Failure;
use super::memory;
use crate::api::Surface;
use crate::api::preflight::scratch_beside;
use crate::storage::{ScratchSpace, attempt};
use crate::surface;

/// The memory a command may hold, and where its scratch files go.
#[derive(Clone, Copy)]
pub enum Space<'a> {
    /// All in memory.
    Boundless,
    /// Bytes in all, and the place of a store: scratch files are created beside it.
    Capped(u64, &'a Path),
}

impl Space<'_> {
    /// What is left beside a surface.
    pub fn scratch(self, surface: &surface::Surface) -> Result<ScratchSpace, Failure> {
        match self {
            Self::Boundless => Ok(ScratchSpace::boundless()),
            Self::Capped(cap, store) => Ok(scratch_beside(surface, cap, store)?),
        }
    }
}

/// Reads files or generates a sample.
pub fn load(arguments: &[String], space: Space, console: &Console) -> Result<Surface, Failure> {
    let cap = match space {
        Space::Boundless => memory::cap(None)?,
        Space::Capped(cap, _) => cap,
    };
    let surface = Surface::load(arguments, cap)?;
    let scratch = space.scratch(&surface.inner)?;
    let surface = surface.oriented(&scratch)?;
    for note in surface.notes() {
        console.note(&format!("note: {note}"));
    }
    Ok(surface)
}

/// [`load`], and refuse a surface with defects.
pub fn load_valid(
    arguments: &[String],
    space: Space,
    console: &Console,
) -> Result<Surface, Failure> {
    let surface = load(arguments, space, console)?;
    validated(&surface.inner, space)?;
    Ok(surface)
}

/// Validates completely.
pub fn validated(surface: &surface::Surface, space: Space) -> Result<(), Failure> {
    let scratch = space.scratch(surface)?;
    Ok(attempt(|| surface::validate_in(surface, &scratch))?.accept()?)
}
