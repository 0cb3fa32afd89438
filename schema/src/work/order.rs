//! Orders: one unit of work each, with everything that a worker needs in addition to the store's files and the size field.

use std::collections::BTreeMap;

use rkyv::{Archive, Deserialize, Serialize};

use crate::catalog::FileRow;
use crate::topology::FacesAcross;
use crate::tree::{CutPlane, SubtreeMesh};

/// One unit of work.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq)]
pub enum WorkOrder {
    /// Bisect a subtree.
    Cut(CutOrder),
    /// Mesh a sub-domain to its final density.
    Subdomain(SubdomainOrder),
}

impl WorkOrder {
    /// Name of the file that the work starts from.
    pub fn input(&self) -> String {
        let mesh = match self {
            Self::Cut(order) => &order.parent,
            Self::Subdomain(order) => &order.mesh,
        };
        mesh.file().subdomain_name()
    }
}

/// A subtree to be bisected.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq)]
pub struct CutOrder {
    /// Its mesh.
    pub parent: SubtreeMesh,
    /// Planes of the cuts above it, from the top.
    pub zones: Vec<CutPlane>,
}

/// A sub-domain to be saturated, optimized and sealed.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq)]
pub struct SubdomainOrder {
    /// Its coarse mesh.
    pub mesh: SubtreeMesh,
    /// Planes of the cuts above it, from the top.
    pub zones: Vec<CutPlane>,
    /// Owners of the other side of its interface faces, by cut.
    pub owners: BTreeMap<u32, FacesAcross>,
}

impl SubtreeMesh {
    /// Its file.
    pub const fn file(&self) -> FileRow {
        FileRow { subdomain: self.ranks.first, generation: self.generation }
    }
}
