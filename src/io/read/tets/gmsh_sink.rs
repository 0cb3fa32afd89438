//! The mesh that is filled while a Gmsh file is read.

use std::collections::HashMap;
use std::io::BufRead;

use super::raw::{NodeNumbers, RawMesh};
use super::{Feed, Result};
use crate::read::gmsh_numbers::{ElementType, Role};
use tetdb_base::geom::Point;

/// The mesh that a reader of Gmsh files fills.
pub struct TetSink<'a> {
    pub(in crate::read) mesh: &'a mut RawMesh,
    pub(super) nodes: NodeNumbers,
    /// Numbers of the elements that are tetrahedra.
    pub(super) elements: NodeNumbers,
    /// Chooses the values that are taken, by name.
    pub(super) takes: Option<fn(&str) -> bool>,
    pub(super) has_parts: bool,
    /// The last tetrahedron: versions 1 and 2 repeat it for each of its groups.
    pub(super) last: Option<([i64; 4], i64)>,
    /// Tetrahedra of several groups.
    pub(super) n_repeated: u64,
}

impl TetSink<'_> {
    /// Notes a section that is passed over.
    pub fn skip(&mut self, section: &[u8]) {
        let known: [&[u8]; 2] = [b"$Comments", b"$Periodic"];
        if !known.contains(&section) {
            let section = String::from_utf8_lossy(section);
            self.mesh.notes.push(format!("the section {section} was left out"));
        }
    }

    pub fn node(&mut self, tag: i64, p: Point) {
        self.nodes.push(tag, &self.mesh.space);
        self.mesh.point(p);
    }

    /// Takes an element by its nodes, its groups and the names of groups of faces and volumes.
    pub fn element<R: BufRead>(
        &mut self,
        ElementType { n_nodes, n_corners, role }: ElementType,
        tags: &[i64; 8],
        (groups, names): (&[i64], [&HashMap<i64, String>; 2]),
        [number, partition]: [i64; 2],
        feed: &Feed<R>,
    ) -> Result<()> {
        let mesh = &mut *self.mesh;
        let name = |group: i64, dimension: usize| {
            names[dimension - 2].get(&group).cloned().unwrap_or_default()
        };
        mesh.n_curved += u64::from(n_nodes > n_corners && role != Role::Thin);
        let mut find = |k: usize| self.nodes.find(tags[k], &mesh.space, feed);
        match (role, n_corners) {
            (Role::Thin, _) => mesh.n_thin += 1,
            (Role::Face, 3) => {
                let corners = [find(0)?, find(1)?, find(2)?];
                let none = [0];
                for &group in if groups.is_empty() { &none } else { groups } {
                    let label = mesh.labels.with_name(group, || name(group, 2));
                    mesh.triangle(corners, label);
                }
            }
            (Role::Solid, 4) => {
                let corners = [find(0)?, find(1)?, find(2)?, find(3)?];
                let group = groups.first().copied().unwrap_or(0);
                self.n_repeated += u64::from(groups.len() > 1);
                let now = std::array::from_fn(|k| tags[k]);
                match self.last.replace((now, group)) {
                    Some((last, before)) if last == now && before != group => {
                        self.n_repeated += 1;
                        return Ok(());
                    }
                    _ => {}
                }
                let region = mesh.regions.with_name(group, || name(group, 3));
                let part = if self.has_parts { mesh.parts.number(partition) } else { 0 };
                mesh.tet(corners, region, part).map_err(|fault| feed.refuse(fault))?;
                if self.takes.is_some() {
                    self.elements.push(number, &mesh.space);
                }
            }
            _ => {
                let what = format!("a mesh with elements of {n_corners} corners");
                return Err(feed.unsupported(what));
            }
        }
        Ok(())
    }
}
