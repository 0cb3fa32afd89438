//! The part of a mesh to export, and its form.

use std::collections::BTreeSet;

use super::format::MeshFormat;

/// The part of a mesh to export, and its form.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ExportSelection {
    /// Ranks of sub-domains; none stands for all. Faces towards other sub-domains are boundary.
    pub subdomains: BTreeSet<u32>,
    /// Numbers of regions; none stands for all. Their outer faces are boundary.
    pub regions: BTreeSet<u32>,
    /// Each sub-domain in a file of its own.
    pub pieces: bool,
    /// The pieces that this process writes; by default all.
    pub share: Option<Share>,
    /// The elements to write.
    pub content: Content,
    /// The format; by default the one of the file's name.
    pub format: Option<MeshFormat>,
    /// Text where the format has both text and binary.
    pub ascii: bool,
    /// List the ghosts of each partition: the tetrahedra of others that touch it (`.msh`).
    pub ghosts: bool,
    /// Write the vertices of sheets once for each side, and their triangles as boundary of both.
    pub split_sheets: bool,
    /// All sub-domains in one partition, whose vertices are written once (`.vtkhdf`).
    pub one_partition: bool,
    /// Nodes of the elements.
    pub order: ElementOrder,
}

/// The pieces of one of several processes, which together write all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Share {
    /// Number of the process, from 1.
    pub number: u32,
    /// Number of all processes.
    pub of: u32,
}

impl ExportSelection {
    /// Returns whether this process writes the piece of a sub-domain.
    pub(super) fn writes_piece(&self, rank: u32) -> bool {
        let is_asked = self.subdomains.is_empty() || self.subdomains.contains(&rank);
        is_asked && (self.share).is_none_or(|share| rank % share.of == share.number - 1)
    }

    /// Returns whether each sub-domain has files of its own.
    pub fn in_pieces(&self, format: MeshFormat) -> bool {
        #[cfg(feature = "parquet")]
        if format == MeshFormat::Parquet {
            return true;
        }
        self.pieces || format == MeshFormat::Pvtu
    }

    /// Returns whether several processes can write the file together: the tetrahedra of `.vtkhdf`, a partition for each sub-domain.
    pub fn is_shared_file(&self, format: MeshFormat) -> bool {
        let is_plain = self.content == Content::Mesh && self.order == ElementOrder::First;
        format == MeshFormat::VtkHdf
            && is_plain
            && !self.pieces
            && !self.split_sheets
            && !self.one_partition
    }

    /// Returns whether the vertices of each sub-domain are written apart.
    pub(super) fn is_apart(&self, format: MeshFormat) -> bool {
        format == MeshFormat::VtkHdf && !self.one_partition
    }

    /// Returns whether the periodic pairs of the store are written: where every vertex has one number.
    pub fn has_periodic(&self, format: MeshFormat) -> bool {
        let is_numbered = !self.in_pieces(format) && !self.is_apart(format) && !self.split_sheets;
        self.content == Content::Mesh && is_numbered
    }

    /// Returns whether this process writes the file that names all pieces.
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

/// The elements to write.
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
