//! The whole mesh as one `polyMesh`.

use std::path::Path;

use super::super::error::Result;
use super::super::merged::Merged;
use super::super::output_files::OutputFiles;
use super::super::report::FileCounts;
use super::faces::{FaceWalk, InnerFace, UpperFace, zone_of};
use super::file::FoamFile;
use super::polymesh::{FaceFiles, FoamPatch, Names, Size, Zones, mesh_dir, write_boundary};
use tetdb_base::storage::{Sorted, Sorter, sort_record};
use tetdb_store::sealed::MergeReader;

sort_record! {
    /// A face on the boundary of the whole.
    struct OrderedPatchFace {
        patch: u32,
        /// Number of outer faces before it, over all sub-domains: the faces of a cell keep their order.
        place: u32,
        owner: u32,
        vertices: [u32; 3],
    }
}

/// A face with two cells in the whole, at least the first of them in the sub-domain at hand.
pub(super) enum WithTwoCells {
    Here(InnerFace),
    Across(UpperFace),
}

/// Faces of a sub-domain in the order of the whole: by owner, those within it first.
pub(super) fn in_order(
    inner: Sorted<InnerFace>,
    uppers: Sorted<UpperFace>,
    mut each: impl FnMut(WithTwoCells) -> Result<()>,
) -> Result<()> {
    let mut uppers = MergeReader::new(uppers);
    for face in inner {
        let face = face?;
        while let Some(upper) = uppers.next_if(|upper| upper.owner < face.owner)? {
            each(WithTwoCells::Across(upper))?;
        }
        each(WithTwoCells::Here(face))?;
    }
    uppers.try_for_each(|upper| each(WithTwoCells::Across(upper?)))
}

pub(super) fn write(
    mesh: &mut Merged,
    outputs: &mut OutputFiles,
    case: &Path,
    (walk, names): (&mut FaceWalk, &Names),
    ascii: bool,
) -> Result<FileCounts> {
    mesh.expect_passes(1, 2);
    let dir = mesh_dir(case);
    let parts = mesh.parts();
    let census = &walk.census;
    let n_inner: u64 =
        (parts.iter().enumerate()).map(|(p, part)| census.n_inner(p, part.n_tets)).sum();
    let n_between: u64 = (census.between.iter().flat_map(|b| b.values())).sum();
    let n_outer: u64 = (census.patches.iter().flat_map(|b| b.values())).sum();
    let inner = n_inner + n_between / 2;
    let size =
        Size { points: mesh.n_vertices(), cells: mesh.n_tets(), inner, faces: inner + n_outer };
    write_points(mesh, outputs, &dir, size, ascii)?;
    let patches = names.patches.iter().map(|(label, name)| FoamPatch {
        name: name.clone(),
        between: None,
        groups: names.groups_of(*label),
        n_faces: (census.patches.iter().filter_map(|p| p.get(label))).sum(),
    });
    write_boundary(outputs, &dir, inner, &patches.collect::<Vec<_>>())?;
    write_faces(mesh, outputs, &dir, size, (walk, names), ascii)?;
    let mut zones = Zones::new(mesh.dir(), false, mesh.sorter_bytes());
    let mut cell = 0;
    mesh.tets(|tet| {
        cell += 1;
        zones.push(tet.region, cell - 1, false)
    })?;
    zones.write(outputs, &dir, &names.cell_zones, ascii)?;
    Ok(FileCounts { vertices: size.points, tets: size.cells, triangles: n_outer })
}

fn write_points(
    mesh: &mut Merged,
    outputs: &mut OutputFiles,
    dir: &Path,
    size: Size,
    ascii: bool,
) -> Result<()> {
    let what = (dir, "points", "vectorField");
    let mut points = FoamFile::create(outputs, what, "", ascii, 24 * size.points)?;
    points.begin_list(size.points);
    mesh.vertices(|_, vertex| points.point(vertex.point))?;
    points.end_list(size.points);
    points.finish()
}

fn write_faces(
    mesh: &mut Merged,
    outputs: &mut OutputFiles,
    dir: &Path,
    size: Size,
    (walk, names): (&mut FaceWalk, &Names),
    ascii: bool,
) -> Result<()> {
    let mut files = FaceFiles::create(outputs, dir, size, ascii)?;
    let bytes = mesh.sorter_bytes() / 4;
    let mut outer = Sorter::new(mesh.dir(), bytes);
    let mut zones = Zones::new(mesh.dir(), true, bytes);
    let mut n_outer = 0;
    for p in 0..mesh.n_parts() {
        let faces = walk.part(mesh, p)?;
        let numbers = mesh.numbers_of(p)?;
        let first = numbers.first_tet as u32;
        let global = |vertices| numbers.vertices(vertices).map(|v| v.map(|v| v as u32));
        in_order(faces.inner, faces.uppers, |face| {
            let (owner, neighbor, vertices, zone) = match face {
                WithTwoCells::Here(f) => (f.owner, first + f.neighbor, f.vertices, f.zone),
                WithTwoCells::Across(f) => (f.owner, f.cell, f.vertices, f.zone),
            };
            if let Some((zone, is_flipped)) = zone_of(zone) {
                zones.push(zone, files.written() as u32, is_flipped)?;
            }
            files.inner(first + owner, neighbor, global(vertices)?)
        })?;
        for face in faces.outer {
            let face = face?;
            outer.push(OrderedPatchFace {
                patch: face.patch,
                place: n_outer,
                owner: first + face.owner,
                vertices: global(face.vertices)?,
            })?;
            n_outer += 1;
        }
    }
    mesh.expect_count("inner faces", size.inner, files.written())?;
    for face in outer.finish()? {
        let face = face?;
        files.outer(face.owner, face.vertices)?;
    }
    mesh.expect_count("faces", size.faces, files.written())?;
    files.finish()?;
    zones.write(outputs, dir, &names.face_zones, ascii)
}
