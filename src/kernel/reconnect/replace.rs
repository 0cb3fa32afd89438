//! Replaces a set of tetrahedra by another that fills the same polyhedron.
//!
//! Slower than the flips with drawings of their own (faces are matched by sorting), and general: collapses
//! and small-cavity searches end here.

use super::attribute::Inherited;
use crate::mesh::anatomy::{FACES, REQUIRED};
use crate::mesh::{FaceRef, Mesh, Tet};
use tetdb_base::storage::Pages;

/// Scratch of a replacement; meant to be used again.
#[derive(Default)]
pub struct Replacement {
    /// Sorted vertices of a face, then which: below `OLD` a new tetrahedron's, else an outer face of the old ones.
    faces: Vec<([u32; 3], u32)>,
    /// Outer faces: the face beyond, and the required bit.
    outer: Vec<(FaceRef, u32)>,
    /// Indices of the tetrahedra created by the last replacement.
    pub new_tets: Vec<u32>,
}

const OLD: u32 = 1 << 31;

impl Replacement {
    /// Replaces the tetrahedra `old` (ids and records as they are in the mesh now) by those with the vertices `new`.
    ///
    /// `false`, with nothing changed, if the outer faces differ or an inner face of `old` is required. The caller
    /// guarantees that `new` are exactly positive. A vertex that only `old` has keeps a dangling `tet_of`; the caller
    /// must free it.
    pub fn apply<P: Pages>(
        &mut self,
        mesh: &mut Mesh<P>,
        old: &[u32],
        records: &[Tet],
        new: &[[u32; 4]],
    ) -> bool {
        if !self.match_faces(old, records, new) {
            return false;
        }
        let inherited =
            Inherited::read(mesh, old.iter().copied().zip(records.iter().map(Tet::vertices)));
        self.new_tets.clear();
        self.new_tets.extend(old.iter().copied().take(new.len()));
        while self.new_tets.len() < new.len() {
            self.new_tets.push(mesh.take_tet());
        }
        for &t in old.iter().skip(new.len()) {
            mesh.free_tet(t);
        }
        for (&t, &node) in self.new_tets.iter().zip(new) {
            let neighbor = [FaceRef::NONE; 4];
            mesh.set_tet(t, Tet { node, neighbor });
            inherited.write(mesh, t, node);
            for v in node {
                mesh.set_tet_of(v, t);
            }
        }
        for pair in self.faces.chunks_exact(2) {
            let here = self.named(pair[0].1);
            if pair[1].1 < OLD {
                let there = self.named(pair[1].1);
                mesh.link(here, there);
            } else {
                let (beyond, required) = self.outer[(pair[1].1 - OLD) as usize];
                mesh.link(here, beyond);
                if required != 0 {
                    let node = mesh.tet(here.tet()).node[here.face()];
                    mesh.set_node(here.tet(), here.face(), node | REQUIRED);
                }
            }
        }
        true
    }

    /// Pairs every face of `new` with another of them or with an outer face of `old`; `false` when that fails.
    fn match_faces(&mut self, old: &[u32], records: &[Tet], new: &[[u32; 4]]) -> bool {
        self.faces.clear();
        self.outer.clear();
        for record in records {
            for i in 0..4 {
                let across = record.neighbor[i];
                let required = record.node[i] & REQUIRED;
                if across.exists() && old.contains(&across.tet()) {
                    if required != 0 {
                        return false;
                    }
                    continue;
                }
                let name = OLD + self.outer.len() as u32;
                self.outer.push((across, required));
                self.faces.push((sorted(record.face(i)), name));
            }
        }
        for (k, node) in new.iter().enumerate() {
            for (i, face) in FACES.iter().enumerate() {
                self.faces.push((sorted(face.map(|f| node[f])), (4 * k + i) as u32));
            }
        }
        self.faces.sort_unstable();
        self.faces.len().is_multiple_of(2)
            && self.faces.chunks_exact(2).all(|pair| pair[0].0 == pair[1].0 && pair[0].1 < OLD)
            && self
                .faces
                .chunks_exact(2)
                .zip(self.faces.chunks_exact(2).skip(1))
                .all(|(one, two)| one[0].0 != two[0].0)
    }

    fn named(&self, name: u32) -> FaceRef {
        FaceRef::new(self.new_tets[(name >> 2) as usize], (name & 3) as usize)
    }
}

fn sorted(mut face: [u32; 3]) -> [u32; 3] {
    face.sort_unstable();
    face
}
