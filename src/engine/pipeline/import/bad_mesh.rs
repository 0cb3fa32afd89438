//! Why a mesh cannot be imported.

use std::fmt;

use tetdb_base::geom::count;
use tetdb_base::surface::show;

use tetdb_base::geom::Point;

/// Places of a fault that are listed.
const PLACES_MAX: usize = 5;

/// A fault of a mesh with the places of the first elements that have it.
#[derive(Debug, Default)]
pub struct BadMesh {
    /// The fault, in words.
    pub what: String,
    /// A way out.
    pub help: &'static str,
    /// Number of elements that have it.
    pub n: u64,
    /// The first of them.
    pub places: Vec<String>,
}

impl std::error::Error for BadMesh {}

impl fmt::Display for BadMesh {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.what)?;
        match self.n {
            0 | 1 => Ok(()),
            n => write!(f, " ({} in all)", count(n, "place")),
        }
    }
}

impl BadMesh {
    /// A fault without a place yet.
    pub fn new(what: impl Into<String>, help: &'static str) -> Self {
        Self { what: what.into(), help, ..Self::default() }
    }

    /// Adds an element with its corners; `number` counts from 0.
    pub fn add(&mut self, kind: &str, number: u64, corners: &[Point]) {
        self.add_place(|| {
            let corners: Vec<String> = corners.iter().map(|&p| show(p)).collect();
            format!("{kind} {}: {}", number + 1, corners.join(" "))
        });
    }

    /// Adds an element described by its place.
    pub fn add_place(&mut self, place: impl FnOnce() -> String) {
        self.n += 1;
        if self.places.len() < PLACES_MAX {
            let place = place();
            // Two tetrahedra may have several faces that meet at one place.
            if !self.places.contains(&place) {
                self.places.push(place);
            }
        }
    }

    /// The fault with one element that has it.
    pub fn at(mut self, kind: &str, number: u64, corners: &[Point]) -> Self {
        self.add(kind, number, corners);
        self
    }
}
