//! Tetrahedra of a sub-domain with a face on input triangles or on an interface: a bit for each.

use super::selection::Selection;
use super::{QueryError, QuerySession};
use crate::sealed::{BitSet, Subdomain, input_index};
use crate::store::StoreError;
use std::collections::{HashMap, HashSet};
use tetdb_base::storage::{Lease, check_cancelled};
use tetdb_schema::record::{NO_TET, SealedFacet};

/// Bytes of tables for an embedded edge: itself, its ends and their numbers in a sub-domain.
const WIRE_BYTES: u64 = 128;

/// A bit for each tetrahedron of a sub-domain.
pub struct Marks {
    bits: BitSet,
    _lease: Lease,
}

impl Marks {
    pub fn has(&self, local: u32) -> bool {
        self.bits.contains(local.into())
    }

    /// Returns whether any of `count` tetrahedra from `first` on is marked.
    pub fn any(&self, first: u32, count: u32) -> bool {
        let (mut at, end) = (first, first + count);
        while at < end {
            if at % 64 == 0 && end - at >= 64 {
                if self.bits.words()[at as usize / 64] != 0 {
                    return true;
                }
                at += 64;
            } else if self.has(at) {
                return true;
            } else {
                at += 1;
            }
        }
        false
    }

    /// Keeps the tetrahedra that are also in the other set.
    fn and(&mut self, other: &Self) {
        let words = self.bits.words_mut().iter_mut().zip(other.bits.words());
        words.for_each(|(own, other)| *own &= other);
    }
}

impl QuerySession {
    /// The tetrahedra of a sub-domain that satisfy the conditions on labels, sheets and interface; `None` without such conditions.
    ///
    /// Errors: damage; a budget that has not a bit for each.
    pub fn marks(&mut self, rank: u32, selection: &Selection) -> Result<Option<Marks>, QueryError> {
        let mut marks = None;
        if let Some(labels) = &selection.labels {
            let (fin_first, labels) = (self.wires.fin_first, self.labels_within(labels));
            let is_meant =
                |facet: &SealedFacet| facet.triangle < fin_first && labels.contains(&facet.label);
            let mut found = self.on_facets(rank, is_meant)?;
            self.add_on_wires(rank, &labels, &mut found)?;
            marks = Some(found);
        }
        let only = |marks: &mut Option<Marks>, found: Marks| match marks {
            Some(marks) => marks.and(&found),
            None => *marks = Some(found),
        };
        if selection.touching_sheet {
            // A triangle with one filled region on both sides parts nothing.
            let fin_first = self.wires.fin_first;
            let is_sheet = |facet: &SealedFacet| {
                facet.triangle < fin_first && facet.regions[0] == facet.regions[1]
            };
            let found = self.on_facets(rank, is_sheet)?;
            only(&mut marks, found);
        }
        if let Some(pair) = selection.interface {
            let other = if pair[0] == rank { pair[1] } else { pair[0] };
            let faces = self.on_interface(rank, other)?;
            only(&mut marks, faces);
        }
        Ok(marks)
    }

    fn blank(&mut self, rank: u32) -> Result<Marks, QueryError> {
        let n_tets = self.part(rank)?.subdomain.row().tets;
        let lease = self.lease(n_tets.div_ceil(64) * 8, "a bit for each tetrahedron")?;
        Ok(Marks { bits: BitSet::new(n_tets), _lease: lease })
    }

    fn on_facets(
        &mut self,
        rank: u32,
        is_meant: impl Fn(&SealedFacet) -> bool,
    ) -> Result<Marks, QueryError> {
        let mut marks = self.blank(rank)?;
        for chunk in 0..self.part(rank)?.subdomain.row().chunks[2] {
            check_cancelled();
            self.count_faces();
            let part = &mut self.part(rank)?.subdomain;
            for facet in part.facet_chunk(chunk)?.records {
                if !is_meant(&facet) {
                    continue;
                }
                for tet in facet.tets.into_iter().filter(|&t| t != NO_TET) {
                    set(&mut marks, tet, part)?;
                }
            }
        }
        Ok(marks)
    }

    /// Marks tetrahedra with an edge or a point of the labels.
    fn add_on_wires(
        &mut self,
        rank: u32,
        labels: &[u32],
        marks: &mut Marks,
    ) -> Result<(), QueryError> {
        let edges = self.wires.edges.iter().filter(|edge| labels.contains(&edge[2]));
        let edges: HashSet<[u32; 2]> = edges.map(|&[a, b, _]| [a.min(b), a.max(b)]).collect();
        let points = self.wires.points.iter().filter(|p| labels.contains(&p[1]));
        let points: HashSet<u32> = points.map(|&[v, _]| v).collect();
        if edges.is_empty() && points.is_empty() {
            return Ok(());
        }
        let n_wires = (edges.len() + points.len()) as u64;
        let what = "embedded edges and points";
        let _lease = self.lease(n_wires * WIRE_BYTES, what)?;
        let on_wires: HashSet<u32> = (edges.iter().flatten()).chain(&points).copied().collect();
        let part = &mut self.part(rank)?.subdomain;
        let mut inputs = HashMap::new();
        for (local, vertex) in (0u32..).zip(part.vertices()) {
            if let Some(index) = input_index(vertex?.id).filter(|v| on_wires.contains(v)) {
                inputs.insert(local, index);
            }
        }
        for chunk in 0..part.tet_summaries().len() {
            check_cancelled();
            let chunk = part.tet_chunk(chunk as u32)?;
            for (local, tet) in (chunk.first..).zip(&chunk.records) {
                let found = tet.nodes.map(|v| inputs.get(&v).copied());
                let is_edge = |i: usize, j: usize| match (found[i], found[j]) {
                    (Some(a), Some(b)) => edges.contains(&[a.min(b), a.max(b)]),
                    _ => false,
                };
                let has_point = found.iter().flatten().any(|v| points.contains(v));
                if has_point || (0..4).any(|j| (0..j).any(|i| is_edge(i, j))) {
                    set(marks, local, part)?;
                }
            }
        }
        Ok(())
    }

    fn on_interface(&mut self, rank: u32, other: u32) -> Result<Marks, QueryError> {
        let mut marks = self.blank(rank)?;
        for chunk in 0..self.part(rank)?.subdomain.row().chunks[3] {
            check_cancelled();
            self.count_faces();
            let part = &mut self.part(rank)?.subdomain;
            for face in part.interface_chunk(chunk)?.records {
                if face.other == other {
                    set(&mut marks, face.tet, part)?;
                }
            }
        }
        Ok(marks)
    }
}

fn set(marks: &mut Marks, tet: u32, part: &Subdomain) -> Result<(), StoreError> {
    if u64::from(tet) >= part.row().tets {
        let what = format!("a face names tetrahedron {tet}, there are {}", part.row().tets);
        return Err(part.damaged(what).into());
    }
    marks.bits.insert(tet.into());
    Ok(())
}
