//! Sheets as slits: the vertices of a sheet are written once for each side, and its triangles are boundary on both.
//!
//! A sheet is an input triangle with the same region on both sides. The tetrahedra around a vertex of a sheet form
//! classes that are connected through faces that are no sheet's. The first class keeps the vertex, each other one gets a double of it. Around a
//! vertex on a free edge there is one class.

use std::path::Path;

use super::doubles::{Change, Double, Doubles};
use super::error::Result;
use super::faces::MergedFace;
use super::merged::Merged;
use super::output_files::OutputFiles;
use super::stream::{RecordReader, Stream, save, scratch};
use tetdb_base::storage::{Payload, Sorted, Sorter, sort_record};
use tetdb_schema::record::FACES;
use tetdb_store::sealed::{BitSet, MergeReader};

sort_record! {
    /// A tetrahedron at a vertex of a sheet.
    struct TetCorner {
        vertex: u64,
        tet: u64,
        subdomain: u32,
        nodes: [u64; 4],
    }
}

sort_record! {
    /// A boundary face at a vertex of a sheet.
    struct FaceCorner {
        vertex: u64,
        face: u64,
        tet: u64,
        is_sheet: bool,
        /// Ascending.
        vertices: [u64; 3],
    }
}

sort_record! {
    /// The replacements of a face's vertex, on the side of the face's tetrahedron and on the other.
    struct FaceChange {
        face: u64,
        vertex: u64,
        sides: [u64; 2],
        /// The tetrahedron on the other side of a sheet; [`NONE`] where it is not written.
        back_tet: u64,
        back_rank: u32,
    }
}

const NONE: u64 = u64::MAX;

/// Splits the sheets of `mesh`, and lists the pairs in a file beside `out`. Errors: damage, the disk.
pub(super) fn split(mesh: &mut Merged, outputs: &mut OutputFiles, out: &Path) -> Result<()> {
    let (corners, face_corners) = at_sheets(mesh)?;
    let dir = mesh.dir().to_owned();
    let n_vertices = mesh.n_vertices();
    let mut changes = Sorter::new(&dir, mesh.sorter_bytes());
    let mut face_changes = Sorter::new(&dir, mesh.sorter_bytes());
    let originals = dir.join("doubled");
    let mut stream = scratch(&originals)?;
    let mut n = 0;
    let (mut corners, mut face_corners) =
        (MergeReader::new(corners), MergeReader::new(face_corners));
    let mut tets = Vec::new();
    while corners.next_group(&mut tets, |a, b| a.vertex == b.vertex)? {
        let vertex = tets[0].vertex;
        let mut faces = Vec::new();
        while let Some(next) = face_corners.next_if(|f| f.vertex <= vertex)? {
            faces.push(next);
        }
        let numbers = numbers_at(vertex, &tets, &faces, n_vertices + n);
        let doubles = numbers.iter().filter(|&&number| number != vertex);
        let end = doubles.copied().max().map_or(n, |last| last + 1 - n_vertices);
        for _ in n..end {
            stream.record(&vertex.to_le_bytes())?;
        }
        n = end;
        for (tet, &double) in tets.iter().zip(&numbers).filter(|(_, double)| **double != vertex) {
            let tet = tet.tet;
            changes.push(Change { tet, vertex, double })?;
        }
        for face in &faces {
            if let Some(change) = face_change(face, &tets, &numbers) {
                face_changes.push(change)?;
            }
        }
    }
    stream.finish()?;
    let doubles = Doubles { n, changes: dir.join("changes"), vertices: dir.join("doubles") };
    save(changes.finish()?, &doubles.changes, |_| ())?;
    positions(mesh, &originals, &doubles.vertices)?;
    pairs(&doubles, outputs, out, n_vertices)?;
    split_faces(mesh, face_changes.finish()?)?;
    mesh.set_doubles(doubles);
    Ok(())
}

/// Tetrahedra and faces at vertices of sheets, by these. Memory: a bit for each vertex.
fn at_sheets(mesh: &mut Merged) -> Result<(Sorted<TetCorner>, Sorted<FaceCorner>)> {
    let mut on_sheet = BitSet::new(mesh.n_vertices());
    mesh.faces().each(|face| {
        if is_sheet(face) {
            for v in face.vertices {
                on_sheet.insert(v);
            }
        }
        Ok(())
    })?;
    let (dir, bytes) = (mesh.dir().to_owned(), mesh.sorter_bytes());
    let mut face_corners = Sorter::new(&dir, bytes);
    let mut number = 0;
    mesh.faces().each(|face| {
        let mut vertices = face.vertices;
        vertices.sort_unstable();
        for vertex in vertices.into_iter().filter(|&v| on_sheet.contains(v)) {
            face_corners.push(FaceCorner {
                vertex,
                face: number,
                tet: face.tet,
                is_sheet: is_sheet(face),
                vertices,
            })?;
        }
        number += 1;
        Ok(())
    })?;
    let mut corners = Sorter::new(&dir, bytes);
    let mut number = 0;
    mesh.tets(|tet| {
        for vertex in tet.nodes.into_iter().filter(|&v| on_sheet.contains(v)) {
            corners.push(TetCorner {
                vertex,
                tet: number,
                subdomain: tet.subdomain,
                nodes: tet.nodes,
            })?;
        }
        number += 1;
        Ok(())
    })?;
    Ok((corners.finish()?, face_corners.finish()?))
}

fn is_sheet(face: &MergedFace) -> bool {
    face.regions[0] != 0 && face.regions[0] == face.regions[1]
}

/// The replacement of `vertex` in each of its tetrahedra: the vertex itself, or doubles numbered from `first` on.
fn numbers_at(vertex: u64, tets: &[TetCorner], faces: &[FaceCorner], first: u64) -> Vec<u64> {
    let mut sides: Vec<([u64; 3], usize)> = Vec::with_capacity(3 * tets.len());
    for (i, tet) in tets.iter().enumerate() {
        for face in FACES {
            let mut face = face.map(|k| tet.nodes[k]);
            if face.contains(&vertex) {
                face.sort_unstable();
                sides.push((face, i));
            }
        }
    }
    sides.sort_unstable();
    let is_wall = |side: &[u64; 3]| faces.iter().any(|f| f.is_sheet && f.vertices == *side);
    let mut apart: Vec<usize> = (0..tets.len()).collect();
    // Bodies that touch at a vertex without a sheet stay joined.
    let mut whole = apart.clone();
    for pair in sides.windows(2) {
        let [(a, i), (b, j)] = [pair[0], pair[1]];
        if a == b {
            join(&mut whole, i, j);
            if !is_wall(&a) {
                join(&mut apart, i, j);
            }
        }
    }
    let mut next = first;
    let mut numbers = vec![vertex; tets.len()];
    for i in 0..tets.len() {
        // Each class is named by its first member.
        numbers[i] = match apart[i] {
            class if class < i => numbers[class],
            _ if whole[i] == i => vertex,
            _ => {
                next += 1;
                next - 1
            }
        };
    }
    numbers
}

/// Joins two classes, each named by its least member.
fn join(classes: &mut [usize], i: usize, j: usize) {
    let (low, high) = (classes[i].min(classes[j]), classes[i].max(classes[j]));
    if low != high {
        classes.iter_mut().filter(|c| **c == high).for_each(|c| *c = low);
    }
}

fn face_change(face: &FaceCorner, tets: &[TetCorner], numbers: &[u64]) -> Option<FaceChange> {
    let front = tets.binary_search_by_key(&face.tet, |tet| tet.tet).ok()?;
    let has = |tet: &TetCorner| face.vertices.iter().all(|v| tet.nodes.contains(v));
    let mut others = tets.iter().enumerate().filter(|(i, tet)| *i != front && has(tet));
    let back = others.next().filter(|_| face.is_sheet);
    Some(FaceChange {
        face: face.face,
        vertex: face.vertex,
        sides: [numbers[front], back.map_or(NONE, |(i, _)| numbers[i])],
        back_tet: back.map_or(NONE, |(_, tet)| tet.tet),
        back_rank: back.map_or(0, |(_, tet)| tet.subdomain),
    })
}

/// Saves the doubles with the data of their vertices.
fn positions(mesh: &mut Merged, originals: &Path, to: &Path) -> Result<()> {
    let mut originals = RecordReader::open(originals, 0)?;
    let mut next = originals.next()?;
    let mut stream = scratch(to)?;
    mesh.vertices(|number, vertex| {
        while next == Some(number.to_le_bytes()) {
            let double = Double {
                vertex: number,
                id: vertex.id,
                tag: vertex.tag,
                h: vertex.h.into(),
                point: Payload(vertex.point),
            };
            stream.record(&double)?;
            next = originals.next()?;
        }
        Ok(())
    })?;
    stream.finish()
}

/// `NAME_pairs.csv`: each double and the vertex it is of, counted from 0 in the order of the file.
fn pairs(doubles: &Doubles, outputs: &mut OutputFiles, out: &Path, n_vertices: u64) -> Result<()> {
    let stem = out.file_stem().unwrap_or_default().to_string_lossy();
    let path = out.with_file_name(format!("{stem}_pairs.csv"));
    let mut stream = Stream::open(&outputs.create(&path, 20 * doubles.n)?)?;
    stream.text("vertex,double\n");
    doubles.each(|place, double| {
        stream.integer(double.vertex, b',');
        stream.integer(n_vertices + place, b'\n');
        stream.end()
    })?;
    stream.finish()
}

/// Replaces the vertices of the boundary faces; those of sheets are written twice, the second time as their backs.
fn split_faces(mesh: &mut Merged, changes: Sorted<FaceChange>) -> Result<()> {
    let mut changes = MergeReader::new(changes);
    let mut number = 0;
    mesh.rewrite_faces(|face, put| {
        let mut back = *face;
        let mut face = *face;
        let mut back_tet = NONE;
        while let Some(change) = changes.next_if(|c| c.face == number)? {
            for i in 0..3 {
                if back.vertices[i] == change.vertex && face.vertices[i] == change.vertex {
                    [face.vertices[i], back.vertices[i]] = change.sides;
                }
            }
            (back_tet, back.subdomain) = (change.back_tet, change.back_rank);
        }
        number += 1;
        if back_tet == NONE {
            return put(&face);
        }
        face.regions[1] = 0;
        put(&face)?;
        back.regions[0] = 0;
        (back.tet, back.neighbor) = (back_tet, back.subdomain);
        put(&back)
    })
}
