//! What of a mesh is written.

use std::collections::BTreeSet;

use super::format::MeshFormat;

/// What of a mesh is written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// Ranks of sub-domains; none stands for all. What bounds them towards others is boundary.
    pub subdomains: BTreeSet<u32>,
    /// Numbers of regions; none stands for all. What bounds them is boundary.
    pub regions: BTreeSet<u32>,
    /// Each sub-domain in a file of its own.
    pub pieces: bool,
    /// Which elements are written.
    pub content: Content,
    /// The format; by default the one that the file's name tells.
    pub format: Option<MeshFormat>,
    /// Text where the format has both text and binary.
    pub ascii: bool,
    /// Of each part the tetrahedra that touch other parts, listed for those (`.msh`).
    pub ghosts: bool,
    /// The vertices on sheets once for each side, and its triangles boundary of both.
    pub split_sheets: bool,
    /// Nodes of the elements.
    pub order: Order,
}

/// Nodes of the elements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// Corners.
    #[default]
    First,
    /// Corners and the middles of edges.
    Second,
}

/// Which elements are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Content {
    /// Tetrahedra and boundary faces.
    #[default]
    Mesh,
    /// Input triangles and interface faces; only as `.vtu` or `.vtkhdf`.
    Boundary,
    /// Interface faces; only as `.vtu` or `.vtkhdf`.
    Interfaces,
}
