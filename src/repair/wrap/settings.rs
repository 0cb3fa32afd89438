//! What is asked for, what was done, and why not.

use tetdb_base::geom::{Point, short};

/// What to do. Lengths are in input units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WrapSettings {
    /// Openings narrower than about twice this are closed; also the size of triangles.
    pub gap: f64,
    /// Distance of the vertices from the input.
    pub offset: f64,
}

/// What was done. Lengths are in input units.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct WrapReport {
    /// Radius of the spheres that could not enter.
    pub gap: f64,
    /// Greatest distance of the vertices from the input.
    pub offset: f64,
    /// Triangles, edges and points of the input.
    pub parts_before: u64,
    /// Triangles of the wrap.
    pub triangles: u64,
    /// Vertices of the wrap.
    pub vertices: u64,
    /// Closed shells of the wrap.
    pub shells: u64,
    /// Vertices inserted on the way, those inside the wrap included.
    pub steiner_points: u64,
    /// Cells filled so that the wrap is a manifold without pockets.
    pub filled: u64,
    /// Largest distance of sampled points of the wrap from the input.
    pub distance_to_input_max: f64,
    /// Mean distance of sampled points of the wrap from the input.
    pub distance_to_input_mean: f64,
    /// Largest distance of sampled points of the input from the wrap.
    pub distance_from_input_max: f64,
    /// Mean distance of sampled points of the input from the wrap.
    pub distance_from_input_mean: f64,
    /// Number of samples, both ways.
    pub samples: u64,
}

impl WrapReport {
    /// The counts in words.
    pub fn in_words(&self) -> String {
        format!(
            "a closed surface of {} triangles encloses all {} triangles; its vertices are at most {} away, its points up to {}, and points of the surface up to {} below it",
            self.triangles,
            self.parts_before,
            short(self.offset),
            short(self.distance_to_input_max),
            short(self.distance_from_input_max),
        )
    }
}

/// Reasons why there is no wrap.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum WrapError {
    /// Nothing to wrap.
    #[error("the surface has no triangles, edges or points to wrap")]
    Empty,
    /// Coordinates leave the range in which lengths can be computed.
    #[error(
        "coordinates as large as {largest:e}, or extents as small as {extent:e}, cannot be wrapped"
    )]
    Range {
        /// The largest coordinate.
        largest: f64,
        /// The box diagonal.
        extent: f64,
    },
    /// Gap or offset are no lengths.
    #[error("the {what} of a wrap is {value}, expected a length above 0")]
    Length {
        /// Which.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// The offset is lost in the rounding of coordinates.
    #[error(
        "the offset {offset:e} is below the rounding of coordinates as large as {largest:e}, expected {least:e} at least"
    )]
    Rounding {
        /// The offset.
        offset: f64,
        /// The largest coordinate.
        largest: f64,
        /// The least offset.
        least: f64,
    },
    /// More memory is needed.
    #[error("the wrap takes more than {} MiB of memory, and may take {} MiB", bytes >> 20, bytes_max >> 20)]
    Memory {
        /// Bytes allowed.
        bytes_max: u64,
        /// Bytes needed so far.
        bytes: u64,
    },
    /// A check of the result failed.
    #[error("the wrap could not be completed near ({}, {}, {}): {reason}", at.x, at.y, at.z)]
    Incomplete {
        /// The reason.
        reason: &'static str,
        /// A place.
        at: Point,
    },
}
