//! What of a mesh is written.

use std::collections::BTreeSet;

use super::format::MeshFormat;

/// What of a mesh is written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ExportSelection {
    /// Ranks of sub-domains; none stands for all. What bounds them towards others is boundary.
    pub subdomains: BTreeSet<u32>,
    /// Numbers of regions; none stands for all. What bounds them is boundary.
    pub regions: BTreeSet<u32>,
    /// Each sub-domain in a file of its own.
    pub pieces: bool,
    /// Of the pieces those that this process writes; by default all.
    pub share: Option<Share>,
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
    pub order: ElementOrder,
}

/// The pieces of one of several processes, which together write all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Share {
    /// Which of them, from 1.
    pub number: u32,
    /// How many there are.
    pub of: u32,
}

impl ExportSelection {
    /// Whether this process writes the piece of a sub-domain.
    pub(super) fn writes_piece(&self, rank: u32) -> bool {
        let is_asked = self.subdomains.is_empty() || self.subdomains.contains(&rank);
        is_asked && (self.share).is_none_or(|share| rank % share.of == share.number - 1)
    }

    /// Whether each sub-domain has files of its own.
    pub fn in_pieces(&self, format: MeshFormat) -> bool {
        #[cfg(feature = "parquet")]
        if format == MeshFormat::Parquet {
            return true;
        }
        self.pieces || format == MeshFormat::Pvtu
    }

    /// Whether several processes can write the one file together: the tetrahedra of `.vtkhdf`, a partition for each sub-domain.
    pub fn is_shared_file(&self, format: MeshFormat) -> bool {
        let is_plain = self.content == Content::Mesh && self.order == ElementOrder::First;
        format == MeshFormat::VtkHdf && is_plain && !self.pieces && !self.split_sheets
    }

    /// Whether this process writes what names the pieces of all.
    pub(super) fn writes_head(&self) -> bool {
        self.share.is_none_or(|share| share.number == 1)
    }
}

/// Nodes of the elements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ElementOrder {
    /// Corners.
    #[default]
    First,
    /// Corners and the midpoints of edges.
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
