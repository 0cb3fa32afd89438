//! Triangles and tetrahedra, entity by entity.

use super::super::error::Result;
use super::super::merged::{Merged, Opened};
use super::entities::Entities;
use super::out::Out;
use crate::storage::{Sorter, sort_record};

/// Gmsh's numbers of the two types of elements.
const TRIANGLE: u32 = 2;
const TETRAHEDRON: u32 = 4;

sort_record! {
    /// A triangle by its entity.
    struct Triangle {
        entity: u32,
        number: u64,
        vertices: [u64; 3],
    }
}

sort_record! {
    /// A tetrahedron of a sub-domain by its entity.
    struct Tetrahedron {
        entity: u32,
        number: u32,
        nodes: [u32; 4],
    }
}

pub(super) fn write(
    mesh: &mut Merged,
    out: &mut Out,
    which: &[usize],
    entities: &Entities,
) -> Result<()> {
    let (tags, n_faces) = (entities.tags(), mesh.n_faces());
    let total = entities.n_faces() + entities.n_tets();
    for n in [tags.len() as u64, total, 1, n_faces + mesh.n_tets()] {
        out.size(n);
    }
    out.end()?;
    let begin = |out: &mut Out, entity: u32, kind: u32| {
        let (dim, tag, n) = tags[entity as usize];
        for word in [dim, tag, kind] {
            out.int(word);
        }
        out.size(n);
        out.end()
    };
    triangles(mesh, out, entities, begin)?;
    for &p in which {
        let Opened {
            mut part,
            numbers,
            first_tet,
        } = mesh.open_part(p)?;
        let first = n_faces + first_tet + 1;
        let put = |out: &mut Out, number: u32, nodes: [u32; 4]| {
            out.size(first + u64::from(number));
            nodes.iter().for_each(|&v| out.size(numbers.of(v) + 1));
            out.end()
        };
        let rank = part.id().rank();
        let volumes = entities.volumes_of(rank);
        if let (1, Some(&entity)) = (volumes.len(), volumes.values().next()) {
            begin(out, entity, TETRAHEDRON)?;
            for tet in part.tets() {
                let (id, tet) = tet?;
                put(out, id.local(), tet.nodes)?;
            }
        } else {
            let mut sorter = Sorter::new(mesh.dir(), mesh.sorter_bytes());
            for tet in part.tets() {
                let (id, tet) = tet?;
                sorter.push(Tetrahedron {
                    entity: volumes[&tet.region],
                    number: id.local(),
                    nodes: tet.nodes,
                })?;
            }
            let mut last = None;
            for tet in sorter.finish()? {
                let tet = tet?;
                if last.replace(tet.entity) != Some(tet.entity) {
                    begin(out, tet.entity, TETRAHEDRON)?;
                }
                put(out, tet.number, tet.nodes)?;
            }
        }
        mesh.advance(part.row().tets as usize);
    }
    Ok(())
}

fn triangles(
    mesh: &Merged,
    out: &mut Out,
    entities: &Entities,
    begin: impl Fn(&mut Out, u32, u32) -> Result<()>,
) -> Result<()> {
    let mut sorter = Sorter::new(mesh.dir(), mesh.sorter_bytes());
    let mut number = 0;
    mesh.faces().each(|face| {
        number += 1;
        if let Some(entity) = entities.surface(face.label, face.subdomain) {
            sorter.push(Triangle {
                entity,
                number,
                vertices: face.vertices,
            })?;
        }
        Ok(())
    })?;
    let mut last = None;
    for face in sorter.finish()? {
        let face = face?;
        if last.replace(face.entity) != Some(face.entity) {
            begin(out, face.entity, TRIANGLE)?;
        }
        out.size(face.number);
        face.vertices.iter().for_each(|&v| out.size(v + 1));
        out.end()?;
    }
    Ok(())
}
