//! What a worker is to do.

use std::collections::BTreeMap;

use rkyv::{Archive, Deserialize, Serialize};

use crate::pipeline::tree::{PartMesh, ZoneRow};
use tetdb_kernel::topology::OppositeOwners;
use tetdb_store::store::Catalog;

/// One unit of work.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq)]
pub enum Order {
    /// Bisect a part.
    Cut(CutOrder),
    /// Mesh a sub-domain to its final density.
    Subdomain(SubdomainOrder),
}

impl Order {
    /// The name of the file it begins with.
    pub fn input(&self) -> String {
        let part = match self {
            Self::Cut(order) => &order.parent,
            Self::Subdomain(order) => &order.part,
        };
        Catalog::file_name(part.part.first, part.generation)
    }
}

/// A part to be bisected.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq)]
pub struct CutOrder {
    pub parent: PartMesh,
    /// Of the cuts above it, from the top.
    pub zones: Vec<ZoneRow>,
}

/// A sub-domain to be saturated, optimized and sealed.
#[derive(Archive, Serialize, Deserialize, Clone, Debug, PartialEq)]
pub struct SubdomainOrder {
    pub part: PartMesh,
    /// Of the cuts above it, from the top.
    pub zones: Vec<ZoneRow>,
    /// Who has the other side of its interface faces, by cut.
    pub owners: BTreeMap<u32, OppositeOwners>,
}
