//! From a mesh as its file has it to one that can be written.

use super::BadMesh;
use super::faces::match_faces;
use super::overlap;
use super::place::{FileTriangles, Parts, Placed, Placing, region_numbers, renumber};
use crate::pipeline::error::PipelineError;
use crate::pipeline::progress::Watcher;
use tetdb_base::storage::ScratchSpace;
use tetdb_io::read::RawMesh;

/// Checks a mesh and places its tetrahedra in `parts` sub-domains: those of the file if it has any, else so many or as fits its size.
///
/// Errors: a mesh without tetrahedra, with a repeated, flat or turned tetrahedron, or one that does not conform. Unwinds where the disk
/// fails.
pub fn place(
    mesh: RawMesh,
    parts: Option<u32>,
    space: &ScratchSpace,
    watch: &Watcher,
) -> Result<Placed, PipelineError> {
    let RawMesh {
        stem,
        points,
        tets,
        triangles,
        regions,
        labels,
        parts: groups,
        notes,
        fields,
        ..
    } = mesh;
    let (mut raw_points, mut raw_tets) = (points.finish(), tets.finish());
    if raw_tets.is_empty() {
        let what = "the file holds no tetrahedra";
        let help = "give a file with a volume mesh; a surface has to be meshed";
        return Err(BadMesh::new(what, help).into());
    }
    let mut notes = notes;
    let (vertices, used, values) =
        renumber(&mut raw_points, &mut raw_tets, fields, space, &mut notes)?;
    drop(raw_points);
    let (region_rank, regions) = region_numbers(&regions, &used);
    let mut placing =
        Placing { vertices, parts_of: Parts::new(parts, &groups, &raw_tets)?, region_rank };
    let tets = placing.check(&mut raw_tets, space, watch, &mut notes)?;
    drop(raw_tets);
    let Placing { vertices, parts_of, .. } = placing;
    let triangles = triangles.finish();
    let file = FileTriangles { triangles, labels, stem, regions, notes, values };
    let mut placed = match_faces(vertices, tets, parts_of, file, space, watch)?;
    overlap::check(&mut placed, space)?;
    Ok(placed)
}
