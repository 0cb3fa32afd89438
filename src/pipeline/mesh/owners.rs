//! Who owns the faces of a cut and who neighbors whom, as the catalog keeps it.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use crate::pipeline::tree::blob;
use crate::sealed::SealedError;
use crate::store::{Catalog, Step, StoreError};
use crate::topology::{Neighbors, Owners};
use tetdb_schema::catalog::{NeighborRow, TopologyRow};

/// An interface face of an earlier cut that a child took over from its parent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct InheritedFace {
    pub cut: u32,
    /// Number in the cut.
    pub index: u32,
    /// On which side of the cut the child is.
    pub side: u32,
}

/// A cut as far as neighbors are concerned.
pub(crate) struct NewCut<'a> {
    pub cut: u32,
    /// Faces of its interface.
    pub faces: u32,
    /// Names of the children; the low one has that of the parent.
    pub low: u32,
    pub high: u32,
    /// Faces that the high child took over.
    pub inherited: &'a [InheritedFace],
}

/// What a cut changes in the catalog's tables of owners and neighbors.
pub(crate) struct TopologyChange {
    /// By cut.
    owners: BTreeMap<u32, Owners>,
    rows: Vec<TopologyRow>,
}

impl TopologyChange {
    /// Of a new cut. Errors: a damaged catalog.
    pub fn of_cut(catalog: &mut Catalog, new: &NewCut) -> Result<Self, StoreError> {
        let &NewCut {
            cut,
            faces,
            low,
            high,
            ..
        } = new;
        let mut neighbors = neighbors_of(&catalog.topology()?);
        let mut owners = BTreeMap::from([(cut, Owners::new(faces, low, high))]);
        neighbors.set(low, high, u64::from(faces));
        for face in new.inherited {
            let table = match owners.entry(face.cut) {
                Entry::Occupied(entry) => entry.into_mut(),
                Entry::Vacant(entry) => entry.insert(read_owners(catalog, face.cut)?),
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
        // Who was a neighbor of the parent is one of a child: no other row changes.
        let mut names: Vec<u32> = [low, high]
            .into_iter()
            .flat_map(|name| neighbors.of(name))
            .map(|n| n.0)
            .chain([low, high])
            .collect();
        names.sort_unstable();
        names.dedup();
        let rows = names.iter().map(|&name| topology_row(&neighbors, name));
        Ok(Self {
            owners,
            rows: rows.collect(),
        })
    }

    /// Puts it into `step`.
    pub fn commit(&self, step: &mut Step) {
        for (cut, table) in &self.owners {
            step.set_blob(blob::OWNERS + cut, &table.to_bytes());
        }
        for row in &self.rows {
            step.set_topology(row);
        }
    }
}

/// The owners of a cut's faces.
pub(crate) fn read_owners(catalog: &mut Catalog, cut: u32) -> Result<Owners, StoreError> {
    let bytes = catalog.blob(blob::OWNERS + cut)?.unwrap_or_default();
    Owners::from_bytes(&bytes).ok_or_else(|| {
        StoreError::Sealed(SealedError::Content {
            path: catalog.dir().to_owned(),
            subdomain: cut,
            what: format!("the table of owners of cut {cut} is damaged"),
        })
    })
}

fn neighbors_of(rows: &[TopologyRow]) -> Neighbors {
    let mut neighbors = Neighbors::default();
    for row in rows {
        for neighbor in &row.neighbors {
            neighbors.set(row.subdomain, neighbor.subdomain, neighbor.faces);
        }
    }
    neighbors
}

fn topology_row(neighbors: &Neighbors, name: u32) -> TopologyRow {
    let of = neighbors.of(name).into_iter();
    TopologyRow {
        subdomain: name,
        neighbors: of
            .map(|(subdomain, faces)| NeighborRow { subdomain, faces })
            .collect(),
    }
}
