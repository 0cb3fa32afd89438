//! Embedded edges and points in the merged mesh.

use std::collections::{BTreeMap, HashMap, HashSet};

use tetdb_schema::catalog::WiresRow;

use super::error::Result;
use super::numbering::{Numbering, Source};
use tetdb_base::storage::StorageError;
use tetdb_store::sealed::input_index;
use tetdb_store::store::Catalog;

/// A point of the merged mesh.
#[derive(Clone, Copy)]
pub(super) struct EmbeddedPoint {
    /// Number of its vertex.
    pub vertex: u64,
    pub label: u32,
    pub point: [f64; 3],
}

/// Bytes for each edge or point while it is gathered: two vertices in two tables, and the edge itself.
const BYTES_EACH: u64 = 256;

/// Returns the bytes of `memory` beside the embedded edges and points of a store. Errors: these do not fit.
pub(super) fn memory_left(row: &WiresRow, memory: usize) -> Result<usize> {
    let needed = BYTES_EACH * (row.edges.len() + row.points.len()) as u64;
    let left = (memory as u64).checked_sub(needed);
    let left = left.ok_or(StorageError::Budget {
        what: "embedded edges and points",
        needed,
        available: memory as u64,
    })?;
    Ok(left as usize)
}

/// Embedded edges and points that are written.
#[derive(Clone, Default)]
pub(super) struct WrittenEmbedded {
    /// Numbers of the vertices of each edge, and its label; sorted by label.
    pub edges: Vec<([u64; 2], u32)>,
    /// Sorted by label.
    pub points: Vec<EmbeddedPoint>,
}

impl WrittenEmbedded {
    /// Gathers the edges and points whose vertices are written. Errors: damage, the disk.
    pub fn gather(
        store: &mut Catalog,
        row: &WiresRow,
        (parts, numbering): (&[Source], &Numbering),
        memory: usize,
    ) -> Result<Self> {
        let ends = row.edges.iter().flat_map(|&[a, b, _]| [a, b]);
        let all = ends.chain(row.points.iter().map(|&[v, _]| v));
        let wanted: HashSet<u32> = all.collect();
        let mut known = HashMap::new();
        for (p, source) in parts.iter().enumerate().filter(|_| !wanted.is_empty()) {
            let numbers = numbering.part(store, parts, p)?;
            let mut part = store.open_subdomain(source.row.rank, memory / 4)?;
            for (local, vertex) in (0u32..).zip(part.vertices()) {
                let vertex = vertex?;
                let index = input_index(vertex.id).filter(|index| wanted.contains(index));
                if let (Some(index), Some(number)) = (index, numbers.vertex(local)) {
                    known.insert(index, (number, vertex.point));
                }
            }
        }
        let number = |v: u32| known.get(&v).map(|(number, _)| *number);
        let mut edges: Vec<_> = (row.edges.iter())
            .filter_map(|&[a, b, label]| Some(([number(a)?, number(b)?], label)))
            .collect();
        edges.sort_by_key(|(_, label)| *label);
        let mut points: Vec<_> = (row.points.iter())
            .filter_map(|&[v, label]| {
                let &(vertex, point) = known.get(&v)?;
                Some(EmbeddedPoint { vertex, label, point })
            })
            .collect();
        points.sort_by_key(|point| point.label);
        Ok(Self { edges, points })
    }

    pub fn is_empty(&self) -> bool {
        self.edges.is_empty() && self.points.is_empty()
    }

    /// Every edge, none found in a tetrahedron yet.
    pub fn edges_to_find(&self) -> EdgesToFind {
        EdgesToFind(self.edges.iter().map(|(ends, _)| (ascending(*ends), false)).collect())
    }

    /// Keeps the edges that were found. Where only a part is written, an edge may be missing and both its ends not.
    pub fn keep_found(&mut self, edges: &EdgesToFind) {
        self.edges.retain(|(ends, _)| edges.0[&ascending(*ends)]);
    }

    /// Number of edges of each label.
    pub fn edge_labels(&self) -> BTreeMap<u32, u64> {
        let mut labels = BTreeMap::new();
        for (_, label) in &self.edges {
            *labels.entry(*label).or_default() += 1;
        }
        labels
    }

    /// Number of points of each label.
    pub fn point_labels(&self) -> BTreeMap<u32, u64> {
        let mut labels = BTreeMap::new();
        for point in &self.points {
            *labels.entry(point.label).or_default() += 1;
        }
        labels
    }
}

/// Embedded edges by their vertices in ascending order; true for those that a tetrahedron has.
pub(super) struct EdgesToFind(HashMap<[u64; 2], bool>);

impl EdgesToFind {
    /// Marks the edges of a tetrahedron as found.
    pub fn find(&mut self, nodes: [u64; 4]) {
        for (i, &a) in nodes.iter().enumerate() {
            for &b in &nodes[i + 1..] {
                if let Some(is_found) = self.0.get_mut(&ascending([a, b])) {
                    *is_found = true;
                }
            }
        }
    }
}

fn ascending([a, b]: [u64; 2]) -> [u64; 2] {
    [a.min(b), a.max(b)]
}
