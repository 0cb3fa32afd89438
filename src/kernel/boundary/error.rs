//! Errors of boundary recovery, with the places a user can look at.

use std::fmt;

use thiserror::Error;

use super::nearness::Nearness;
use tetdb_base::geom::Point;

/// A facet, as a user can find it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FacetPlace {
    /// Number of the triangle in the input.
    pub input: u64,
    /// Its corners, in input units.
    pub corners: [Point; 3],
}

impl fmt::Display for FacetPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b, c] = self.corners.map(|p| p.to_array());
        write!(f, "triangle {} {a:?} {b:?} {c:?}", self.input)
    }
}

/// Reasons why a surface did not become the boundary of volumes.
#[derive(Debug, Error)]
pub enum BoundaryError {
    /// Triangles that could not be made faces of the mesh.
    #[error("{} triangles could not be recovered, the first is {}: {reason}{}", facets.len(), facets[0], nearness.map_or(String::new(), |s| format!("; {s}")))]
    NotRecovered {
        /// Never empty.
        facets: Vec<FacetPlace>,
        /// The reason, in a few words.
        reason: &'static str,
        /// The narrowest place around them.
        nearness: Option<Nearness>,
    },
    /// A vertex of the surface lies on an edge or a triangle it does not belong to.
    #[error("vertex {owner} at {point:?} lies on {facet}; check the surface for contacts")]
    VertexOnFacet {
        /// Index of the vertex in the surface.
        owner: u32,
        /// Position of the vertex.
        point: Point,
        /// The triangle it lies on.
        facet: Box<FacetPlace>,
    },
    /// A seed with an impossible meaning.
    #[error("{message}")]
    Seed {
        /// The seed, and its contradiction.
        message: String,
        /// Position of the seed.
        point: Point,
    },
    /// Regions are to be filled by seeds, but there is no seed.
    #[error("neither a region seed nor a hole is given, and regions are filled by seeds")]
    NoSeed,
    /// The outside of the triangles cannot be decided.
    #[error("the triangles do not point out of the same volumes: {what}")]
    Orientation {
        /// The contradictory triangles.
        what: String,
    },
}
