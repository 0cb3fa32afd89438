//! Midpoints of edges, for elements of second order: each edge has one, and the ends of the edges number them.
//!
//! Positions, and values of fields, are the means of both ends.

use std::path::{Path, PathBuf};

use super::edge_means::{
    EdgeEnds, HalfEdge, MidpointReader, MidpointValues, ValueGroup, save_means,
};
use super::error::Result;
use super::merged::Merged;
use super::stream::{RecordReader, Stream, scratch};
use tetdb_base::storage::{Payload, Sorted, Sorter, sort_record};
use tetdb_schema::field::FieldRow;
use tetdb_store::sealed::MergeReader;

/// The edges of a tetrahedron in VTK's and Abaqus's order of midpoints.
pub(super) const TET_EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];
/// The edges of a triangle in the same order.
pub(super) const FACE_EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [0, 2]];
/// First place of the edges of boundary faces; those of tetrahedra come before.
const FACE: u64 = 1 << 63;
/// First place of the embedded edges.
const LINE: u64 = FACE | 1 << 62;

sort_record! {
    /// An edge of an element.
    struct ElementEdge {
        low: u64,
        high: u64,
        /// 6 · tetrahedron + edge, or [`FACE`] and 3 · face + edge, or [`LINE`] and the edge.
        place: u64,
    }
}

sort_record! {
    /// The number of an element's edge.
    struct EdgeNumber {
        place: u64,
        edge: u64,
    }
}

/// The midpoints of the edges of a mesh.
pub(super) struct Midpoints {
    /// For each sub-domain, the number of edges whose first end it numbers.
    pub counts: Vec<u64>,
    n_tets: u64,
    n_faces: u64,
    /// Edges of the tetrahedra, six each, then of the boundary faces, three each, then embedded ones; 8 bytes for each number.
    elements: PathBuf,
    points: PathBuf,
    values: Vec<ValueGroup>,
}

impl Midpoints {
    /// Numbers the midpoints, in two passes over vertices and one over tetrahedra; with `has_lines` also those of embedded edges. Each three
    /// numbers of `fields` at vertices take two passes more. Errors: damage, the disk.
    pub fn gather(mesh: &mut Merged, has_lines: bool, fields: &[FieldRow]) -> Result<Self> {
        let [points, elements] = ["midpoints", "edges"].map(|name| mesh.dir().join(name));
        let edges = element_edges(mesh, has_lines)?;
        let ends = (!fields.is_empty()).then(|| mesh.dir().join("edge-ends"));
        let (counts, halves, numbers) = numbered(mesh, edges, ends.as_deref())?;
        save_means(mesh, halves, &points, &[], |vertex, _| vertex.point)?;
        let mut stream = scratch(&elements)?;
        for number in numbers {
            stream.record(&number?.edge.to_le_bytes())?;
        }
        stream.finish()?;
        let values = match ends {
            Some(ends) => ValueGroup::gather(mesh, fields, &ends)?,
            None => Vec::new(),
        };
        let (n_tets, n_faces) = (mesh.n_tets(), mesh.n_faces());
        Ok(Self { counts, n_tets, n_faces, elements, points, values })
    }

    /// Number of midpoints.
    pub fn n(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Number of the first edge whose first end sub-domain `p` numbers.
    pub fn first_of(&self, p: usize) -> u64 {
        self.counts[..p].iter().sum()
    }

    /// The edge numbers of each tetrahedron. Errors: the disk.
    pub fn tets(&self) -> Result<ElementEdges<6>> {
        self.elements_from(0)
    }

    /// The edge numbers of each boundary face. Errors: the disk.
    pub fn faces(&self) -> Result<ElementEdges<3>> {
        self.elements_from(6 * self.n_tets)
    }

    /// The number of each embedded edge. Errors: the disk.
    pub fn lines(&self) -> Result<ElementEdges<1>> {
        self.elements_from(6 * self.n_tets + 3 * self.n_faces)
    }

    fn elements_from<const N: usize>(&self, first: u64) -> Result<ElementEdges<N>> {
        Ok(ElementEdges { records: RecordReader::open(&self.elements, first)?, first })
    }

    /// Positions of the midpoints, in the order of their numbers. Errors: the disk.
    pub fn points(&self) -> Result<MidpointReader> {
        MidpointReader::open(&self.points)
    }

    /// Opens the values of some of the gathered fields. Errors: the disk.
    pub fn values(&self, fields: &[FieldRow]) -> Result<MidpointValues> {
        MidpointValues::open(&self.values, fields)
    }

    /// Position and words of the values of some fields at each midpoint, in the order of their numbers. Errors: the disk.
    pub fn rows(
        &self,
        fields: &[FieldRow],
    ) -> Result<impl Iterator<Item = Result<([f64; 3], Vec<u64>)>> + use<>> {
        let (points, mut values) = (self.points()?, self.values(fields)?);
        Ok((0..).zip(points).map(move |(edge, point)| Ok((point?, values.at(edge)?))))
    }
}

/// Numbers of the edges of elements that have `N`, read one element after the other.
pub(super) struct ElementEdges<const N: usize> {
    records: RecordReader<[u8; 8]>,
    first: u64,
}

impl<const N: usize> ElementEdges<N> {
    /// The edge numbers of the next element. Errors: the disk.
    pub fn next(&mut self) -> Result<[u64; N]> {
        let mut edges = [0; N];
        for edge in &mut edges {
            let number = self.records.next()?;
            *edge = u64::from_le_bytes(number.expect("elements are read as they were"));
        }
        Ok(edges)
    }

    /// The edge numbers of the element with this number. Errors: the disk.
    pub fn element(&mut self, element: u64) -> Result<[u64; N]> {
        self.records.seek(self.first + N as u64 * element)?;
        self.next()
    }
}

/// Edges of tetrahedra, boundary faces and, with `has_lines`, embedded edges, by their ends.
fn element_edges(mesh: &mut Merged, has_lines: bool) -> Result<Sorted<ElementEdge>> {
    let mut edges = Sorter::new(mesh.dir(), mesh.sorter_bytes());
    let mut push =
        |[a, b]: [u64; 2], place| edges.push(ElementEdge { low: a.min(b), high: a.max(b), place });
    let lines = mesh.embedded().edges.iter().filter(|_| has_lines);
    for (place, (ends, _)) in (LINE..).zip(lines) {
        push(*ends, place)?;
    }
    let mut place = 0;
    mesh.tets(|tet| {
        for edge in TET_EDGES {
            push(edge.map(|i| tet.nodes[i]), place)?;
            place += 1;
        }
        Ok(())
    })?;
    let mut place = FACE;
    mesh.faces().each(|face| {
        for edge in FACE_EDGES {
            push(edge.map(|i| face.vertices[i]), place)?;
            place += 1;
        }
        Ok(())
    })?;
    Ok(edges.finish()?)
}

/// Number of edges of each sub-domain, the edges with the positions of their first ends, and the number of each element's edge.
type NumberedEdges = (Vec<u64>, Sorted<HalfEdge>, Sorted<EdgeNumber>);

/// Numbers the edges by their ends, and writes these to the file `ends` if there is one.
fn numbered(
    mesh: &mut Merged,
    edges: Sorted<ElementEdge>,
    ends: Option<&Path>,
) -> Result<NumberedEdges> {
    let mut ends = ends.map(scratch).transpose()?;
    let mut edges = MergeReader::new(edges);
    let mut numbers = Sorter::new(mesh.dir(), mesh.sorter_bytes());
    let mut halves = Sorter::new(mesh.dir(), mesh.sorter_bytes());
    let firsts: Vec<u64> = mesh.parts().iter().map(|part| part.first_vertex).collect();
    let mut counts = vec![0; firsts.len()];
    let (mut n, mut last) = (0u64, None);
    mesh.vertices(|number, vertex| {
        while let Some(ElementEdge { low, high, place }) = edges.next_if(|e| e.low == number)? {
            if last.replace([low, high]) != Some([low, high]) {
                n += 1;
                counts[firsts.partition_point(|&first| first <= number) - 1] += 1;
                halves.push(HalfEdge { high, edge: n - 1, low_point: Payload(vertex.point) })?;
                if let Some(ends) = &mut ends {
                    ends.record(&EdgeEnds { low, high })?;
                }
            }
            numbers.push(EdgeNumber { place, edge: n - 1 })?;
        }
        Ok(())
    })?;
    ends.map(Stream::finish).transpose()?;
    Ok((counts, halves.finish()?, numbers.finish()?))
}
