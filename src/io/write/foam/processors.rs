//! Each sub-domain as the `polyMesh` of a processor, with its numbers in the whole.

use std::collections::BTreeMap;
use std::path::Path;

use super::super::error::Result;
use super::super::merged::{Merged, OpenedPart};
use super::super::output_files::OutputFiles;
use super::super::report::FileCounts;
use super::super::selection::ExportSelection;
use super::super::stream::{RecordReader, scratch};
use super::faces::{FaceWalk, PartFaces, zone_of};
use super::file::FoamFile;
use super::polymesh::{
    FaceFiles, FoamPatch, Names, Size, Zones, mesh_dir, write_boundary, write_labels,
};
use super::serial::{WithTwoCells, in_order};
use tetdb_base::storage::{Sorted, Sorter, sort_record};
use tetdb_store::sealed::MergeReader;

sort_record! {
    /// A face between two sub-domains and its number in the whole.
    struct FaceAddress {
        rank: u32,
        other: u32,
        cut: u32,
        index: u32,
        /// Number of the face in the whole, from 1.
        face: u32,
    }
}

/// Inputs that all processors share, and the state of the walk over them.
struct ProcessorFiles<'j> {
    case: &'j Path,
    names: &'j Names,
    ascii: bool,
    /// Faces of the whole before those of the first patch.
    n_inner: u64,
    /// For each patch, the number of faces of the whole before those of the current sub-domain.
    patch_starts: BTreeMap<u32, u64>,
}

/// Writes the selected processors. All are read, because numbers in the whole depend on the processors before.
pub(super) fn write(
    mesh: &mut Merged,
    outputs: &mut OutputFiles,
    case: &Path,
    (walk, names): (&mut FaceWalk, &Names),
    selection: &ExportSelection,
) -> Result<FileCounts> {
    mesh.expect_passes(0, 2);
    let ascii = selection.ascii;
    let parts = mesh.parts();
    let mut counts = FileCounts::default();
    let n_between: u64 = (walk.census.between.iter().flat_map(|b| b.values())).sum();
    let inner = parts.iter().enumerate().map(|(p, part)| walk.census.n_inner(p, part.n_tets));
    let n_inner = inner.sum::<u64>() + n_between / 2;
    let mut start = n_inner;
    let mut job = ProcessorFiles { case, names, ascii, n_inner, patch_starts: BTreeMap::new() };
    for &label in names.patches.keys() {
        job.patch_starts.insert(label, start);
        start += (walk.census.patches.iter().filter_map(|p| p.get(&label))).sum::<u64>();
    }
    let mut addresses = Sorter::new(mesh.dir(), mesh.sorter_bytes() / 4);
    let mut next = 0;
    for (p, part) in parts.iter().enumerate() {
        let is_written = selection.writes_piece(part.rank);
        let faces = walk.part(mesh, p)?;
        let sizes = sizes(walk, p, part.n_vertices, part.n_tets);
        job.faces(mesh, outputs, walk, (p, faces, sizes), is_written, (&mut next, &mut addresses))?;
        if is_written {
            job.points_and_cells(mesh, outputs, p, sizes)?;
            counts.vertices += sizes.points;
            counts.tets += sizes.cells;
            counts.triangles += sizes.faces - sizes.inner;
        }
    }
    mesh.expect_count("inner faces", job.n_inner, next)?;
    write_face_addresses(mesh, outputs, (walk, &job), selection, addresses.finish()?)?;
    Ok(counts)
}

/// Writes the number in the whole of each face of the selected processors, from 1 and negative where the whole has the opposite direction.
fn write_face_addresses(
    mesh: &Merged,
    outputs: &mut OutputFiles,
    (walk, job): (&FaceWalk, &ProcessorFiles),
    selection: &ExportSelection,
    addresses: Sorted<FaceAddress>,
) -> Result<()> {
    let (ascii, mut addresses) = (job.ascii, MergeReader::new(addresses));
    for (p, part) in mesh.parts().iter().enumerate() {
        let is_written = selection.writes_piece(part.rank);
        let of_part = std::iter::from_fn(|| addresses.next_if(|a| a.rank == part.rank).transpose());
        if !is_written {
            of_part.for_each(drop);
            continue;
        }
        let sizes = sizes(walk, p, part.n_vertices, part.n_tets);
        let dir = job.dir(part.rank);
        write_labels(outputs, (&dir, "faceProcAddressing"), sizes.faces, ascii, |file| {
            RecordReader::open(&scratch_path(mesh.dir(), part.rank), 0)?
                .each(|label| file.label(i32::from_le_bytes(*label)))?;
            of_part.into_iter().try_for_each(|address| {
                let FaceAddress { rank, other, face, .. } = address?;
                // The whole has the face as the lower one sees it.
                file.label(if rank < other { face as i32 } else { -(face as i32) })
            })
        })?;
    }
    Ok(())
}

fn scratch_path(dir: &Path, rank: u32) -> std::path::PathBuf {
    dir.join(format!("addressing-{rank}"))
}

fn sizes(walk: &FaceWalk, p: usize, points: u64, cells: u64) -> Size {
    let of = |map: &BTreeMap<u32, u64>| map.values().sum::<u64>();
    let inner = walk.census.n_inner(p, cells);
    Size {
        points,
        cells,
        inner,
        faces: inner + of(&walk.census.patches[p]) + of(&walk.census.between[p]),
    }
}

impl ProcessorFiles<'_> {
    fn dir(&self, rank: u32) -> std::path::PathBuf {
        mesh_dir(&self.case.join(format!("processor{rank}")))
    }

    /// Writes faces, boundary and face zones of a sub-domain, and the addresses of its faces; `addresses` gets those of faces between sub-domains.
    fn faces(
        &mut self,
        mesh: &mut Merged,
        outputs: &mut OutputFiles,
        walk: &FaceWalk,
        (p, faces, size): (usize, PartFaces, Size),
        is_written: bool,
        (next, addresses): (&mut u64, &mut Sorter<FaceAddress>),
    ) -> Result<()> {
        let rank = mesh.parts()[p].rank;
        let dir = self.dir(rank);
        let numbers = mesh.numbers_of(p)?;
        let mut files = match is_written {
            true => Some(FaceFiles::create(outputs, &dir, size, self.ascii)?),
            false => None,
        };
        let mut known = scratch(&scratch_path(mesh.dir(), rank))?;
        let mut zones = Zones::new(mesh.dir(), true, mesh.sorter_bytes() / 4);
        in_order(faces.inner, faces.uppers, |face| {
            *next += 1;
            match face {
                WithTwoCells::Here(face) => {
                    let Some(files) = &mut files else {
                        return Ok(());
                    };
                    if let Some((zone, is_flipped)) = zone_of(face.zone) {
                        zones.push(zone, files.written() as u32, is_flipped)?;
                    }
                    known.record(&(*next as u32).to_le_bytes())?;
                    let vertices = numbers.all_in_part(face.vertices)?;
                    files.inner(face.owner, face.neighbor, vertices)
                }
                WithTwoCells::Across(upper) => {
                    for (rank, other) in [(rank, upper.other), (upper.other, rank)] {
                        addresses.push(FaceAddress {
                            rank,
                            other,
                            cut: upper.cut,
                            index: upper.index,
                            face: *next as u32,
                        })?;
                    }
                    Ok(())
                }
            }
        })?;
        for face in faces.outer {
            let face = face?;
            let start = self.patch_starts.get_mut(&face.patch);
            let start = start.expect("patches were counted from the same faces");
            *start += 1;
            if let Some(files) = &mut files {
                known.record(&(*start as u32).to_le_bytes())?;
                files.outer(face.owner, numbers.all_in_part(face.vertices)?)?;
            }
        }
        known.finish()?;
        let Some(mut files) = files else {
            return Ok(());
        };
        for face in faces.between {
            let face = face?;
            if let Some((zone, is_flipped)) = zone_of(face.zone) {
                zones.push(zone, files.written() as u32, is_flipped)?;
            }
            // Both sides begin with the vertex that has the least number in the whole, and go round in opposite directions.
            let in_whole = numbers.vertices(face.vertices)?;
            let mut vertices = numbers.all_in_part(face.vertices)?;
            vertices.rotate_left((0..3).min_by_key(|&i| in_whole[i]).unwrap_or(0));
            files.outer(face.owner, vertices)?;
        }
        mesh.expect_count("faces", size.faces, files.written())?;
        files.finish()?;
        zones.write(outputs, &dir, &self.names.face_zones, self.ascii)?;
        self.boundary(mesh, outputs, walk, p, size)
    }

    fn boundary(
        &self,
        mesh: &Merged,
        outputs: &mut OutputFiles,
        walk: &FaceWalk,
        p: usize,
        size: Size,
    ) -> Result<()> {
        let here = mesh.parts()[p].rank;
        let dir = self.dir(here);
        let counts = &walk.census.patches[p];
        let plain = self.names.patches.iter().map(|(label, name)| FoamPatch {
            name: name.clone(),
            between: None,
            groups: self.names.groups_of(*label),
            n_faces: counts.get(label).copied().unwrap_or_default(),
        });
        let shared = walk.census.between[p].iter().map(|(&there, &n_faces)| FoamPatch {
            name: format!("procBoundary{here}to{there}"),
            between: Some([here as usize, there as usize]),
            groups: Vec::new(),
            n_faces,
        });
        let patches: Vec<_> = plain.chain(shared).collect();
        write_boundary(outputs, &dir, size.inner, &patches)?;
        let what = (dir.as_path(), "boundaryProcAddressing");
        write_labels(outputs, what, patches.len() as u64, self.ascii, |file| {
            (0..).zip(&patches).try_for_each(|(number, patch)| {
                file.label(if patch.between.is_some() { -1 } else { number })
            })
        })
    }

    /// Points and cell zones of a sub-domain, and the numbers of its points and cells in the whole.
    fn points_and_cells(
        &self,
        mesh: &mut Merged,
        outputs: &mut OutputFiles,
        p: usize,
        size: Size,
    ) -> Result<()> {
        let (scratch, bytes) = (mesh.dir().to_owned(), mesh.sorter_bytes());
        let OpenedPart { mut part, numbers } = mesh.open_part(p)?;
        let first_tet = numbers.first_tet as u32;
        let (dir, ascii) = (self.dir(part.id().rank()), self.ascii);
        let what = (dir.as_path(), "points", "vectorField");
        let mut points = FoamFile::create(outputs, what, "", ascii, 24 * size.points)?;
        points.list(size.points, |file| {
            for (local, vertex) in (0..).zip(part.vertices()) {
                let vertex = vertex?;
                if numbers.in_part(local).is_some() {
                    file.point(vertex.point)?;
                }
            }
            Ok(())
        })?;
        points.finish()?;
        write_labels(outputs, (&dir, "pointProcAddressing"), size.points, ascii, |file| {
            (0..size.points as u32).try_for_each(|v| file.label(numbers.dense_vertex(v) as i32))
        })?;
        write_labels(outputs, (&dir, "cellProcAddressing"), size.cells, ascii, |file| {
            (0..size.cells as u32).try_for_each(|cell| file.label((first_tet + cell) as i32))
        })?;
        let mut zones = Zones::new(&scratch, false, bytes);
        for tet in part.tets() {
            let (id, tet) = tet?;
            zones.push(tet.region, id.local(), false)?;
        }
        mesh.advance(size.cells as usize);
        zones.write(outputs, &dir, &self.names.cell_zones, ascii)
    }
}
