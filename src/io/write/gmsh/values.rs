//! Values of fields at nodes and elements: `$NodeData` and `$ElementData`, doubles by their tags.
//!
//! A symmetric tensor has its nine components, since Gmsh has values of 1, 3 and 9 numbers.

use std::path::PathBuf;

use super::super::error::Result;
use super::super::merged::{Merged, OpenedPart};
use super::super::merged_fields::{FieldChunk, open_fields, to_doubles};
use super::super::stream::{RecordReader, scratch};
use super::out::Out;
use super::piece::GmshPiece;
use tetdb_base::storage::{Sorter, sort_record};
use tetdb_schema::field::{FieldPlace, FieldRow};

/// Places of the components of a symmetric tensor in its rows.
const ROWS: [usize; 9] = [0, 3, 5, 3, 1, 4, 5, 4, 2];

/// Writes a section for each field. Ghosts have no values. Errors: damage, the disk.
pub(super) fn write(
    mesh: &mut Merged,
    out: &mut Out,
    piece: &GmshPiece,
    fields: &[FieldRow],
) -> Result<()> {
    let edges = match fields.iter().any(|field| field.place == FieldPlace::Vertices) {
        true => FileEdges::gather(mesh, piece)?,
        false => FileEdges { n: 0, list: None },
    };
    for field in fields {
        let section = match field.place {
            FieldPlace::Vertices => "NodeData",
            FieldPlace::Tets => "ElementData",
        };
        out.section(section, |out| values(mesh, out, (piece, &edges), field))?;
    }
    Ok(())
}

fn values(
    mesh: &mut Merged,
    out: &mut Out,
    (piece, edges): (&GmshPiece, &FileEdges),
    field: &FieldRow,
) -> Result<()> {
    let is_of_vertices = field.place == FieldPlace::Vertices;
    let parts = mesh.parts();
    let is_merged = piece.which.len() == parts.len();
    let here = piece.which.iter().map(|&p| parts[p]);
    // Vertices that several partitions have are there once in a file of all of them.
    let n = match is_of_vertices {
        true if is_merged => mesh.n_vertices() + edges.n,
        true => here.map(|part| part.n_vertices).sum::<u64>() + edges.n,
        false => here.map(|part| part.n_tets).sum(),
    };
    let n_components = if field.components == 6 { 9 } else { field.components };
    // A text, the time, then step, components and values.
    out.text(&format!("1\n\"{}\"\n1\n0\n3\n0\n{n_components}\n{n}\n", field.name));
    let first = if is_of_vertices { 1 } else { mesh.n_faces() + 1 };
    let row = std::slice::from_ref(field);
    let mut found = 0;
    let mut put = |out: &mut Out, number: u64, words: &[u64]| {
        found += 1;
        out.int((first + number) as u32);
        let numbers: Vec<f64> = to_doubles(row, words).collect();
        match numbers[..] {
            [_, _, _, _, _, _] => ROWS.iter().for_each(|&i| out.double(numbers[i])),
            _ => numbers.into_iter().for_each(|x| out.double(x)),
        }
        out.end()
    };
    for &p in piece.which {
        let OpenedPart { part, numbers } = mesh.open_part(p)?;
        let mut files = open_fields(mesh.store, row, &part)?;
        let counts: Vec<u32> = match is_of_vertices {
            true => part.vertex_summaries().iter().map(|summary| summary.count).collect(),
            false => part.tet_summaries().iter().map(|summary| summary.count).collect(),
        };
        let mut local = 0;
        for (chunk, n) in (0..).zip(counts) {
            let words = FieldChunk::read(&mut files, chunk)?;
            for i in 0..n as usize {
                let number = match is_of_vertices {
                    true if is_merged => numbers.own(local),
                    true => numbers.vertex(local),
                    false => numbers.tet(local),
                };
                local += 1;
                if let Some(number) = number {
                    put(out, number, &words.row(i))?;
                }
            }
        }
    }
    if let Some(midpoints) = piece.midpoints.filter(|_| is_of_vertices) {
        let (mut values, n_vertices) = (midpoints.values(row)?, mesh.n_vertices());
        edges.each(|edge| put(out, n_vertices + edge, &values.at(edge)?))?;
    }
    mesh.expect_count("values", n, found)
}

sort_record! {
    /// An edge of a tetrahedron of a piece.
    struct PieceEdge {
        edge: u64,
    }
}

/// The edges whose midpoints a file has: their number, and a list of them unless it has all.
struct FileEdges {
    n: u64,
    list: Option<PathBuf>,
}

impl FileEdges {
    fn gather(mesh: &mut Merged, piece: &GmshPiece) -> Result<Self> {
        let Some(midpoints) = piece.midpoints else { return Ok(Self { n: 0, list: None }) };
        let parts = mesh.parts();
        if piece.which.len() == parts.len() {
            return Ok(Self { n: midpoints.n(), list: None });
        }
        let mut sorter = Sorter::new(mesh.dir(), mesh.sorter_bytes());
        let mut edges = midpoints.tets()?;
        for &p in piece.which {
            let OpenedPart { part, numbers } = mesh.open_part(p)?;
            for number in (0..part.row().tets as u32).filter_map(|local| numbers.tet(local)) {
                for edge in edges.element(number)? {
                    sorter.push(PieceEdge { edge })?;
                }
            }
        }
        let ranks: Vec<String> = piece.which.iter().map(|&p| parts[p].rank.to_string()).collect();
        let path = mesh.dir().join(format!("piece-edges-{}", ranks.join("-")));
        let mut stream = scratch(&path)?;
        let (mut n, mut last) = (0, None);
        for edge in sorter.finish()? {
            let edge: PieceEdge = edge?;
            if last.replace(edge.edge) != Some(edge.edge) {
                n += 1;
                stream.record(&edge)?;
            }
        }
        stream.finish()?;
        Ok(Self { n, list: Some(path) })
    }

    /// Every edge, ascending. Errors: the disk, those of `each`.
    fn each(&self, mut each: impl FnMut(u64) -> Result<()>) -> Result<()> {
        match &self.list {
            None => (0..self.n).try_for_each(each),
            Some(path) => RecordReader::open(path, 0)?.each(|record: &PieceEdge| each(record.edge)),
        }
    }
}
