//! SU2: tetrahedra, points, and a marker for each label that has faces on the boundary; numbered from 0.
//!
//! SU2 has no regions, and no faces between two filled ones: neither is written. A face of several groups is in the marker of its combination,
//! for every face has one marker. Source: SU2's documentation, "Mesh File"; elements have VTK's numbers.

use std::collections::BTreeMap;
use std::path::Path;

use super::error::Result;
use super::faces::MergedFace;
use super::merged::Merged;
use super::names::set_names;
use super::output_files::OutputFiles;
use super::stream::Stream;
use tetdb_base::storage::{Sorter, sort_record};

/// VTK's numbers of elements.
const TRIANGLE: u64 = 5;
const TETRAHEDRON: u64 = 10;

sort_record! {
    /// A face of the boundary, counter-clockwise seen from outside.
    struct MarkerFace {
        label: u32,
        number: u64,
        vertices: [u64; 3],
    }
}

/// Writes the file; returns the number of faces in it.
pub(super) fn write(mesh: &mut Merged, outputs: &mut OutputFiles, out: &Path) -> Result<u64> {
    mesh.check_limits(out, i32::MAX as u64, 0)?;
    mesh.expect_passes(1, 1);
    let digits = u64::from(mesh.n_vertices().max(1).ilog10()) + 2;
    let bytes = (60 + digits) * mesh.n_vertices() + 5 * digits * mesh.n_tets();
    let path = outputs.create(out, bytes + 4 * digits * mesh.n_faces())?;
    let mut stream = Stream::open(&path)?;
    stream.text(&format!("NDIME= 3\nNELEM= {}\n", mesh.n_tets()));
    let mut number = 0u64;
    mesh.tets(|tet| {
        stream.integer(TETRAHEDRON, b' ');
        stream.integers(tet.nodes.into_iter().chain([number]), b' ', b'\n');
        number += 1;
        stream.end()
    })?;
    stream.text(&format!("NPOIN= {}\n", mesh.n_vertices()));
    mesh.vertices(|number, vertex| {
        vertex.point.into_iter().for_each(|x| stream.double(x, b' '));
        stream.integer(number, b'\n');
        stream.end()
    })?;
    let n_faces = markers(mesh, &mut stream)?;
    stream.finish()?;
    Ok(n_faces)
}

fn markers(mesh: &mut Merged, stream: &mut Stream) -> Result<u64> {
    let mut counts: BTreeMap<u32, u64> = BTreeMap::new();
    let mut sorter = Sorter::new(mesh.dir(), mesh.sorter_bytes());
    let mut number = 0;
    mesh.faces().each(|face| {
        number += 1;
        if is_boundary(face) {
            let [a, b, c] = face.vertices;
            let vertices = if face.regions[0] == 0 { [a, b, c] } else { [a, c, b] };
            *counts.entry(face.label).or_default() += 1;
            sorter.push(MarkerFace { label: face.label, number, vertices })?;
        }
        Ok(())
    })?;
    let labels = counts.keys().map(|&label| (label, mesh.label_name(label)));
    let names = set_names(&labels.collect());
    stream.text(&format!("NMARK= {}\n", counts.len()));
    let mut last = None;
    for face in sorter.finish()? {
        let MarkerFace { label, vertices, .. } = face?;
        if last.replace(label) != Some(label) {
            let (name, n) = (&names[&label], counts[&label]);
            stream.text(&format!("MARKER_TAG= {name}\nMARKER_ELEMS= {n}\n"));
        }
        stream.integer(TRIANGLE, b' ');
        stream.integers(vertices, b' ', b'\n');
        stream.end()?;
    }
    Ok(counts.into_values().sum())
}

/// Whether a face has tetrahedra on one side only.
fn is_boundary(face: &MergedFace) -> bool {
    face.regions.contains(&0)
}
