//! MFEM 1.3: the whole as one file, or `NAME.000000` and so on, one for each process of MPI.
//!
//! Attributes are regions, boundary attributes label + 1; both have their names as sets. Faces between two filled regions are boundary elements
//! too, as MFEM allows. A part is a mesh of its own with the numbers of the store, followed by the entities it shares with others (`shared`).
//! Source: MFEM's documentation, "Mesh formats"; the sections of parallel meshes as `ParMesh` prints and reads them.

mod lines;
mod shared;

use std::collections::BTreeMap;
use std::path::Path;

use super::error::Result;
use super::merged::{Merged, OpenedPart};
use super::names::quotable;
use super::output_files::OutputFiles;
use super::report::FileCounts;
use super::selection::ExportSelection;
use super::stream::Stream;
use lines::{TETRAHEDRON, TRIANGLE, element, point};
use shared::Shared;
use tetdb_schema::record::{NO_TET, SealedFacet};
use tetdb_store::sealed::Subdomain;

/// Writes one file of the whole mesh, or one of each sub-domain.
pub(super) fn write(
    mesh: &mut Merged,
    outputs: &mut OutputFiles,
    out: &Path,
    selection: &ExportSelection,
) -> Result<FileCounts> {
    mesh.check_limits(out, i32::MAX as u64, 0)?;
    mesh.expect_passes(1, 1);
    let sets = [region_sets(mesh)?, label_sets(mesh)];
    if !selection.pieces {
        return write_serial(mesh, outputs, out, &sets);
    }
    let mut shared = Shared::gather(mesh)?;
    let mut counts = FileCounts::default();
    for (p, row) in mesh.parts().into_iter().enumerate() {
        if !selection.writes_piece(row.rank) {
            continue;
        }
        let mut opened = mesh.open_part(p)?;
        let stem = out.file_stem().unwrap_or_default().to_string_lossy();
        let path = out.with_file_name(format!("{stem}.{:06}", row.rank));
        let support_first = mesh.support_first();
        let written = write_part((&mut opened, support_first), outputs, &path, &sets, |stream| {
            shared.write(p as u32, stream)
        })?;
        mesh.advance((written.vertices + written.tets) as usize);
        counts += written;
    }
    Ok(counts)
}

fn write_serial(
    mesh: &mut Merged,
    outputs: &mut OutputFiles,
    out: &Path,
    sets: &[String; 2],
) -> Result<FileCounts> {
    let counts =
        FileCounts { vertices: mesh.n_vertices(), tets: mesh.n_tets(), triangles: mesh.n_faces() };
    let mut stream = begin(outputs, out, counts)?;
    mesh.tets(|tet| element(&mut stream, tet.region.into(), TETRAHEDRON, &tet.nodes))?;
    boundary(&mut stream, counts.triangles, sets);
    mesh.faces().each(|face| {
        let label = u64::from(face.label) + 1;
        element(&mut stream, label, TRIANGLE, &outward(face.vertices, face.regions))
    })?;
    vertices(&mut stream, counts.vertices, sets);
    mesh.vertices(|_, vertex| point(&mut stream, vertex.point))?;
    stream.text("\nmfem_mesh_end\n");
    stream.finish()?;
    Ok(counts)
}

/// Writes a sub-domain; `end` writes the sections after the mesh.
fn write_part(
    (opened, support_first): (&mut OpenedPart, u64),
    outputs: &mut OutputFiles,
    out: &Path,
    sets: &[String; 2],
    end: impl FnOnce(&mut Stream) -> Result<()>,
) -> Result<FileCounts> {
    let OpenedPart { part, numbers } = opened;
    let counts = FileCounts {
        vertices: numbers.n_in_part(),
        tets: part.row().tets,
        triangles: each_facet(part, support_first, |_| Ok(()))?,
    };
    let mut stream = begin(outputs, out, counts)?;
    for tet in part.tets() {
        let tet = tet?.1;
        let nodes = numbers.all_in_part(tet.nodes)?.map(u64::from);
        element(&mut stream, tet.region.into(), TETRAHEDRON, &nodes)?;
    }
    boundary(&mut stream, counts.triangles, sets);
    each_facet(part, support_first, |facet| {
        let nodes = numbers.all_in_part(facet.vertices)?.map(u64::from);
        let nodes = outward(nodes, facet.regions);
        element(&mut stream, u64::from(facet.label) + 1, TRIANGLE, &nodes)
    })?;
    vertices(&mut stream, counts.vertices, sets);
    for (local, vertex) in (0..).zip(part.vertices()) {
        let vertex = vertex?;
        if numbers.in_part(local).is_some() {
            point(&mut stream, vertex.point)?;
        }
    }
    stream.text("\nmfem_serial_mesh_end\n");
    end(&mut stream)?;
    stream.text("\nmfem_mesh_end\n");
    stream.finish()?;
    Ok(counts)
}

/// Calls `each` with the input triangles whose filled side, or front where both are filled, is in this sub-domain. Returns their number.
fn each_facet(
    part: &mut Subdomain,
    support_first: u64,
    mut each: impl FnMut(&SealedFacet) -> Result<()>,
) -> Result<u64> {
    let mut n = 0;
    for facet in part.facets() {
        let facet = facet?;
        let is_here = facet.tets[usize::from(facet.regions[0] == 0)] != NO_TET;
        if is_here && facet.triangle < support_first {
            each(&facet)?;
            n += 1;
        }
    }
    Ok(n)
}

/// The vertices counter-clockwise seen from outside the tetrahedron in front, or behind where the front is empty.
fn outward([a, b, c]: [u64; 3], regions: [u32; 2]) -> [u64; 3] {
    if regions[0] == 0 { [a, b, c] } else { [a, c, b] }
}

fn begin(outputs: &mut OutputFiles, out: &Path, counts: FileCounts) -> Result<Stream> {
    let digits = u64::from(counts.vertices.max(1).ilog10());
    let elements = (4 * digits + 9) * counts.tets + (3 * digits + 8) * counts.triangles;
    let path = outputs.create(out, 48 * counts.vertices + elements)?;
    let mut stream = Stream::open(&path)?;
    let n = counts.tets;
    stream.text(&format!("MFEM mesh v1.3\n\ndimension\n3\n\nelements\n{n}\n"));
    Ok(stream)
}

fn boundary(stream: &mut Stream, n: u64, [regions, _]: &[String; 2]) {
    stream.text(&format!("\nattribute_sets\n{regions}\nboundary\n{n}\n"));
}

fn vertices(stream: &mut Stream, n: u64, [_, labels]: &[String; 2]) {
    stream.text(&format!("\nbdr_attribute_sets\n{labels}\nvertices\n{n}\n3\n"));
}

fn region_sets(mesh: &mut Merged) -> Result<String> {
    let regions = mesh.regions()?;
    Ok(sets(regions.iter().map(|&r| (r, mesh.region_name(r)))))
}

fn label_sets(mesh: &Merged) -> String {
    let labels = mesh.labels().into_keys();
    let groups = labels.flat_map(|label| {
        mesh.label_members(label).into_iter().map(move |member| (label + 1, member))
    });
    sets(groups.map(|(attribute, member)| (attribute, mesh.label_name(member))))
}

/// Named sets of attributes; attributes of one name are one set.
fn sets(named: impl Iterator<Item = (u32, String)>) -> String {
    let mut by_name = BTreeMap::<String, Vec<String>>::new();
    for (attribute, name) in named {
        let members = by_name.entry(quotable(&name)).or_default();
        members.push(attribute.to_string());
    }
    let set = |(name, members): (&String, &Vec<String>)| {
        format!("\"{name}\"\n{}\n{}\n", members.len(), members.join(" "))
    };
    format!("{}\n{}", by_name.len(), by_name.iter().map(set).collect::<String>())
}
