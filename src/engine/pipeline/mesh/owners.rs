//! Changes of the catalog's tables: owners of interface faces, and neighbors of subtrees.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};

use crate::pipeline::tree::read_blob;
use tetdb_kernel::topology::NeighborCounts;
use tetdb_schema::blob::{Blob, BlobContent};
use tetdb_schema::catalog::{NeighborRow, TopologyRow};
use tetdb_schema::topology::FaceOwners;
use tetdb_schema::work::InheritedFace;
use tetdb_store::sealed::SealedError;
use tetdb_store::store::{Catalog, Step, StoreError};

/// The data of a cut that determine neighbors.
pub struct NewCut<'a> {
    pub cut: u32,
    /// Number of faces of its interface.
    pub faces: u32,
    /// Ranks that name the two children; the low child has the name of the parent.
    pub low: u32,
    pub high: u32,
    /// Older interface faces that the high child inherits from the parent.
    pub inherited: &'a [InheritedFace],
}

/// Pending changes of the catalog's tables of face owners and neighbors.
pub struct TopologyChange {
    /// Face owners by cut.
    owners: BTreeMap<u32, FaceOwners>,
    neighbors: NeighborCounts,
    /// Subtrees whose rows change.
    names: BTreeSet<u32>,
}

impl TopologyChange {
    /// An empty change. Errors: a damaged catalog.
    pub fn none(catalog: &mut Catalog) -> Result<Self, StoreError> {
        Ok(Self {
            owners: BTreeMap::new(),
            neighbors: neighbors_of(&catalog.topology()?),
            names: BTreeSet::new(),
        })
    }

    /// Adds a cut. Errors: a damaged catalog.
    pub fn add(&mut self, catalog: &mut Catalog, new: &NewCut) -> Result<(), StoreError> {
        let &NewCut { cut, faces, low, high, .. } = new;
        let (owners, neighbors) = (&mut self.owners, &mut self.neighbors);
        owners.insert(cut, FaceOwners::new(faces, low, high));
        neighbors.set(low, high, u64::from(faces));
        for face in new.inherited {
            let table = match owners.entry(face.cut) {
                Entry::Occupied(entry) => entry.into_mut(),
                Entry::Vacant(entry) => {
                    entry.insert(read_blob(catalog, Blob::FaceOwners(face.cut))?)
                }
            };
            let other = table.other(face.index, face.side).ok_or_else(|| {
                StoreError::Sealed(SealedError::Content {
                    path: catalog.dir().to_owned(),
                    subdomain: low,
                    what: format!("face {} of cut {} has no owner", face.index, face.cut),
                })
            })?;
            table.faces[face.index as usize][face.side as usize] = high;
            neighbors.remove(low, other);
            neighbors.add(high, other);
        }
        // Each former neighbor of the parent is now a neighbor of a child; no other row changes.
        let beside = [low, high].into_iter().flat_map(|name| neighbors.list(name));
        self.names.extend(beside.map(|n| n.0).chain([low, high]));
        Ok(())
    }

    /// Writes the changes into `step`.
    pub fn commit(&self, step: &mut Step) {
        for (cut, table) in &self.owners {
            step.set_blob(Blob::FaceOwners(*cut), &table.to_bytes());
        }
        for &name in &self.names {
            step.set_topology(&topology_row(&self.neighbors, name));
        }
    }
}

fn neighbors_of(rows: &[TopologyRow]) -> NeighborCounts {
    let mut neighbors = NeighborCounts::default();
    for row in rows {
        for neighbor in &row.neighbors {
            neighbors.set(row.subdomain, neighbor.subdomain, neighbor.faces);
        }
    }
    neighbors
}

/// The row of a subtree.
pub fn topology_row(neighbors: &NeighborCounts, name: u32) -> TopologyRow {
    let of = neighbors.list(name).into_iter();
    TopologyRow {
        subdomain: name,
        neighbors: of.map(|(subdomain, faces)| NeighborRow { subdomain, faces }).collect(),
    }
}
