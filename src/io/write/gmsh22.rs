//! Gmsh 2.2, binary: physical surfaces are labels, physical volumes regions.
//!
//! Physical and elementary tags are the same: label + 1 on triangles, the region on tetrahedra.
//! Elements are numbered from 1, triangles first. Where there are several sub-domains, each is a partition, numbered from 1.
//! Source: the Gmsh reference manual, "MSH file format version 2".

use std::path::Path;

use super::error::Result;
use super::gmsh;
use super::merged::Merged;
use super::output_files::OutputFiles;
use super::stream::Stream;

/// Gmsh's numbers of the types of elements.
const LINE: u32 = 1;
const POINT: u32 = 15;
const TRIANGLE: u32 = 2;
const TETRAHEDRON: u32 = 4;
/// Tags of an element: physical and elementary; in a mesh of several sub-domains also the number of its partitions, 1, and the partition.
const N_TAGS: u32 = 2;
const N_TAGS_PARTITIONED: u32 = 4;

pub(super) fn write(mesh: &mut Merged, outputs: &mut OutputFiles, out: &Path) -> Result<()> {
    mesh.check_limits(out, i32::MAX as u64, 0)?;
    mesh.expect_passes(1, 1);
    let elements_bytes = 24 * mesh.n_faces() + 28 * mesh.n_tets();
    let partition_bytes = 8 * (mesh.n_faces() + mesh.n_tets());
    let partitioned = if mesh.n_parts() > 1 { partition_bytes } else { 0 };
    let bytes = 200 + 28 * mesh.n_vertices() + elements_bytes + partitioned;
    let names = physical_names(mesh)?;
    let path = outputs.create(out, bytes + names.len() as u64)?;
    let mut stream = Stream::open(&path)?;
    stream.text("$MeshFormat\n2.2 1 8\n");
    put(&mut stream, &[1]);
    stream.text("\n$EndMeshFormat\n");
    stream.text(&names);
    stream.text(&format!("$Nodes\n{}\n", mesh.n_vertices()));
    mesh.vertices(|number, vertex| {
        put(&mut stream, &[number as u32 + 1]);
        for x in vertex.point {
            stream.bytes(&x.to_le_bytes());
        }
        stream.end()
    })?;
    let (n_faces, n_tets) = (mesh.n_faces(), mesh.n_tets());
    let embedded = mesh.embedded();
    let n_embedded = (embedded.edges.len() + embedded.points.len()) as u64;
    let n = n_faces + n_tets + n_embedded;
    stream.text(&format!("\n$EndNodes\n$Elements\n{n}\n"));
    elements(mesh, &mut stream)?;
    stream.text("\n$EndElements\n");
    stream.finish()
}

fn put(stream: &mut Stream, words: &[u32]) {
    for word in words {
        stream.bytes(&word.to_le_bytes());
    }
}

fn elements(mesh: &mut Merged, stream: &mut Stream) -> Result<()> {
    let mut number = 0;
    let partitioned = mesh.n_parts() > 1;
    let n_tags = if partitioned { N_TAGS_PARTITIONED } else { N_TAGS };
    let put_head = |stream: &mut Stream, number: u32, tag: u32, subdomain: u32| {
        put(stream, &[number, tag, tag]);
        if partitioned {
            put(stream, &[1, subdomain + 1]);
        }
    };
    if mesh.n_faces() > 0 {
        put(stream, &[TRIANGLE, mesh.n_faces() as u32, n_tags]);
        mesh.faces().each(|face| {
            number += 1;
            put_head(stream, number, face.label + 1, face.subdomain);
            put(stream, &face.vertices.map(|v| v as u32 + 1));
            stream.end()
        })?;
    }
    if mesh.n_tets() > 0 {
        put(stream, &[TETRAHEDRON, mesh.n_tets() as u32, n_tags]);
        mesh.tets(|tet| {
            number += 1;
            put_head(stream, number, tet.region, tet.subdomain);
            put(stream, &tet.nodes.map(|v| v as u32 + 1));
            stream.end()
        })?;
    }
    // Edges and points are put into the first partition, because the format needs one.
    let embedded = mesh.embedded();
    if !embedded.edges.is_empty() {
        put(stream, &[LINE, embedded.edges.len() as u32, n_tags]);
        for (ends, label) in &embedded.edges {
            number += 1;
            put_head(stream, number, label + 1, 0);
            put(stream, &ends.map(|v| v as u32 + 1));
            stream.end()?;
        }
    }
    if !embedded.points.is_empty() {
        put(stream, &[POINT, embedded.points.len() as u32, n_tags]);
        for (place, point) in (1u32..).zip(&embedded.points) {
            number += 1;
            put(stream, &[number, point.label + 1, place]);
            if partitioned {
                put(stream, &[1, 1]);
            }
            put(stream, &[point.vertex as u32 + 1]);
            stream.end()?;
        }
    }
    Ok(())
}

/// The section that names labels (dimension 2) and regions (dimension 3).
fn physical_names(mesh: &mut Merged) -> Result<String> {
    let regions = mesh.regions()?;
    let labels = mesh.labels().into_keys();
    let names = gmsh::physical_names(mesh, mesh.embedded(), labels, regions);
    Ok(format!("$PhysicalNames\n{names}$EndPhysicalNames\n"))
}
