//! TetGen: `NAME.node`, `NAME.ele`, `NAME.face` and, of embedded edges, `NAME.edge`, text, numbered from 0; the region of a tetrahedron is its attribute, label + 1 a face's marker.
//!
//! A vertex's marker is 1 where it was given or fixed: on the input's surface or an interface. Source: the TetGen user's manual, "File formats".

use std::path::Path;

use super::error::Result;
use super::merged::Merged;
use super::output_files::OutputFiles;
use super::stream::Stream;
use tetdb_schema::record::tag;

pub(super) fn write(mesh: &mut Merged, outputs: &mut OutputFiles, out: &Path) -> Result<()> {
    mesh.expect_passes(1, 1);
    let (n_vertices, n_tets, n_faces) = (mesh.n_vertices(), mesh.n_tets(), mesh.n_faces());
    // An estimate with numbers of seven digits, as in large meshes.
    let bytes = 60 * n_vertices + 40 * n_tets + 35 * n_faces;
    let mut begin = |ending: &str, bytes: u64, head: String| -> Result<Stream> {
        let path = outputs.create(&out.with_extension(ending), bytes)?;
        let mut stream = Stream::open(&path)?;
        stream.text(&head);
        Ok(stream)
    };
    let mut nodes = begin("node", bytes, format!("{n_vertices} 3 0 1\n"))?;
    mesh.vertices(|number, vertex| {
        nodes.integer(number, b' ');
        vertex.point.iter().for_each(|&x| nodes.double(x, b' '));
        let is_fixed = matches!(vertex.tag, tag::SURFACE | tag::INTERFACE);
        nodes.integer(is_fixed.into(), b'\n');
        nodes.end()
    })?;
    nodes.finish()?;
    let mut tets = begin("ele", 0, format!("{n_tets} 4 1\n"))?;
    let mut number = 0;
    mesh.tets(|tet| {
        tets.integer(number, b' ');
        tet.nodes.iter().for_each(|&v| tets.integer(v, b' '));
        tets.integer(tet.region.into(), b'\n');
        number += 1;
        tets.end()
    })?;
    tets.finish()?;
    let mut faces = begin("face", 0, format!("{n_faces} 1\n"))?;
    let mut number = 0;
    mesh.faces().each(|face| {
        faces.integer(number, b' ');
        face.vertices.iter().for_each(|&v| faces.integer(v, b' '));
        faces.integer(u64::from(face.label) + 1, b'\n');
        number += 1;
        faces.end()
    })?;
    faces.finish()?;
    let embedded = mesh.embedded();
    if embedded.edges.is_empty() {
        return Ok(());
    }
    let mut edges = begin("edge", 0, format!("{} 1\n", embedded.edges.len()))?;
    for (number, (ends, label)) in (0u64..).zip(&embedded.edges) {
        edges.integer(number, b' ');
        ends.iter().for_each(|&v| edges.integer(v, b' '));
        edges.integer(u64::from(*label) + 1, b'\n');
        edges.end()?;
    }
    edges.finish()
}
