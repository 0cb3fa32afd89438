//! How two triangles touch, by exact signs.

use std::fmt;

/// What kind of contact two triangles have where they should have none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum ContactKind {
    /// An edge of one goes through the inside of the other.
    Crossing,
    /// They lie in one plane and share an area.
    CoplanarOverlap,
    /// Two edges cross, or lie along each other.
    EdgeOnEdge,
    /// A vertex of one lies inside the other.
    VertexOnFace,
    /// A vertex of one lies on an edge of the other: a T-junction.
    VertexOnEdge,
}

impl ContactKind {
    /// The word for this kind.
    pub fn word(self) -> &'static str {
        match self {
            Self::Crossing => "crossing",
            Self::CoplanarOverlap => "coplanar-overlap",
            Self::EdgeOnEdge => "edge-on-edge",
            Self::VertexOnFace => "vertex-on-face",
            Self::VertexOnEdge => "vertex-on-edge",
        }
    }
}

impl fmt::Display for ContactKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Crossing => "they cross",
            Self::CoplanarOverlap => "they overlap in one plane",
            Self::EdgeOnEdge => "an edge of one touches an edge of the other",
            Self::VertexOnFace => "a vertex of one lies on the other (T-junction)",
            Self::VertexOnEdge => "a vertex of one lies on an edge of the other (T-junction)",
        })
    }
}
