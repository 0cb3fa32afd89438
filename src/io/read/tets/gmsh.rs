//! Meshes in Gmsh files, `.msh` of versions 1, 2, 4.0 and 4.1. The sections are those that surfaces are read from.

use std::io::BufRead;

use super::gmsh_sink::TetSink;
use super::raw::{Groups, MeshFields, NodeNumbers, RawMesh};
use super::{Feed, Result};
use crate::read::SurfaceSink;
use crate::read::gmsh::GmshReader;
use crate::read::volume_cells::VolumeCells;
use tetdb_base::geom::counted;
use tetdb_base::surface::SurfaceBuilder;

/// Reads a file. Partitions are parts if parts are asked for.
pub fn read<R: BufRead>(feed: Feed<R>, fields: MeshFields, mesh: &mut RawMesh) -> Result<()> {
    let has_parts = fields.part.is_some();
    let mut builder = SurfaceBuilder::new();
    let (stem, cells) = (mesh.stem.clone(), VolumeCells::default());
    let mut none = SurfaceSink { builder: &mut builder, stem, prefix: None, cells };
    let mut reader = GmshReader::open(feed, &mut none)?;
    reader.tets = Some(TetSink {
        mesh,
        nodes: NodeNumbers::of("node"),
        elements: NodeNumbers::of("element"),
        takes: fields.values,
        has_parts,
        last: None,
        n_repeated: 0,
    });
    reader.read_sections()?;
    let Some(TetSink { mesh, n_repeated, .. }) = reader.tets else { return Ok(()) };
    if n_repeated > 0 {
        let text = "[tetrahedron is listed for several groups and belongs|tetrahedra are listed for several groups and belong] to the first";
        mesh.notes.push(counted(n_repeated, text));
    }
    if has_parts && mesh.parts.list.iter().all(|part| part.0 == 0) {
        mesh.parts = Groups::default();
        mesh.notes.push("the file has no partitions; planes divide the mesh".to_owned());
    }
    Ok(())
}
