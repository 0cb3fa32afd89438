//! The middles of edges, for elements of second order: straight edges, each middle once, numbered by the numbers of its edge's ends.
//!
//! A middle is half of one end and half of the other, so that all files that have an edge have the same bits for it.

use std::path::PathBuf;

use super::error::Result;
use super::merged::Merged;
use super::stream::{Records, scratch};
use tetdb_base::storage::{Payload, Sorter, StorageError, sort_record};

/// The edges of a tetrahedron in the order in which VTK and Abaqus have their middles, behind its corners.
pub(super) const TET_EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];
/// The same of a triangle.
const FACE_EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [0, 2]];
/// Begins the places of boundary faces, behind those of all tetrahedra.
const FACE: u64 = 1 << 63;
/// Begins the places of embedded edges, behind those.
const LINE: u64 = FACE | 1 << 62;
const POINT_BYTES: usize = 24;

sort_record! {
    /// An edge of an element.
    struct EdgeUse {
        low: u64,
        high: u64,
        /// 6 · tetrahedron + edge, or [`FACE`] and 3 · face + edge, or [`LINE`] and the edge.
        place: u64,
    }
}

sort_record! {
    /// An edge by its second end, with where its first one is.
    struct HalfEdge {
        high: u64,
        edge: u64,
        low_point: Payload<[f64; 3]>,
    }
}

sort_record! {
    struct Middle {
        edge: u64,
        point: Payload<[f64; 3]>,
    }
}

sort_record! {
    struct Place {
        place: u64,
        edge: u64,
    }
}

/// The middles of the edges of a mesh.
pub(super) struct Midpoints {
    /// How many edges there are whose first end each sub-domain numbers.
    pub counts: Vec<u64>,
    n_tets: u64,
    n_faces: u64,
    /// Edges of the tetrahedra, six each, then of the boundary faces, three each, then embedded ones; 8 bytes for each number.
    elements: PathBuf,
    points: PathBuf,
}

impl Midpoints {
    /// Numbers them, in two passes over vertices and one over tetrahedra, those of embedded edges too if `has_lines`. Errors: damage, the disk.
    pub fn gather(mesh: &mut Merged, has_lines: bool) -> Result<Self> {
        let dir = mesh.dir().to_owned();
        let bytes = mesh.sorter_bytes();
        let mut uses = Sorter::new(&dir, bytes);
        let mut push = |nodes: [u64; 2], place| {
            let [low, high] = [nodes[0].min(nodes[1]), nodes[0].max(nodes[1])];
            uses.push(EdgeUse { low, high, place })
        };
        let lines = mesh.wires().edges.iter().filter(|_| has_lines);
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
        let mut uses = uses.finish()?.peekable();
        let mut places = Sorter::new(&dir, bytes);
        let mut halves = Sorter::new(&dir, bytes);
        let firsts: Vec<u64> = mesh.parts().iter().map(|part| part.first_vertex).collect();
        let mut counts = vec![0; firsts.len()];
        let (mut n, mut last) = (0u64, None);
        mesh.vertices(|number, vertex| {
            let here = |u: &std::result::Result<EdgeUse, StorageError>| {
                u.as_ref().map_or(true, |u| u.low == number)
            };
            while let Some(edge_use) = uses.next_if(here) {
                let EdgeUse { low, high, place } = edge_use?;
                if last.replace([low, high]) != Some([low, high]) {
                    n += 1;
                    counts[firsts.partition_point(|&first| first <= number) - 1] += 1;
                    halves.push(HalfEdge {
                        high,
                        edge: n - 1,
                        low_point: Payload(vertex.point),
                    })?;
                }
                places.push(Place { place, edge: n - 1 })?;
            }
            Ok(())
        })?;
        let mut halves = halves.finish()?.peekable();
        let mut middles = Sorter::new(&dir, bytes);
        mesh.vertices(|number, vertex| {
            let here = |h: &std::result::Result<HalfEdge, StorageError>| {
                h.as_ref().map_or(true, |h| h.high == number)
            };
            while let Some(half) = halves.next_if(here) {
                let half = half?;
                let (a, b) = (half.low_point.0, vertex.point);
                middles.push(Middle {
                    edge: half.edge,
                    point: Payload([0, 1, 2].map(|i| 0.5 * a[i] + 0.5 * b[i])),
                })?;
            }
            Ok(())
        })?;
        let [points, elements] = ["middles", "edges"].map(|name| dir.join(name));
        let mut stream = scratch(&points)?;
        for middle in middles.finish()? {
            for x in middle?.point.0 {
                stream.bytes(&x.to_le_bytes());
            }
            stream.end()?;
        }
        stream.finish()?;
        let mut stream = scratch(&elements)?;
        for place in places.finish()? {
            stream.bytes(&place?.edge.to_le_bytes());
            stream.end()?;
        }
        stream.finish()?;
        Ok(Self { counts, n_tets: mesh.n_tets(), n_faces: mesh.n_faces(), elements, points })
    }

    /// How many there are.
    pub fn n(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Number of the first edge whose first end sub-domain `p` numbers.
    pub fn first_of(&self, p: usize) -> u64 {
        self.counts[..p].iter().sum()
    }

    /// Of each tetrahedron the numbers of its edges. Errors: the disk.
    pub fn tets(&self) -> Result<ElementEdges<6>> {
        let records = Records::open(&self.elements, 0)?;
        Ok(ElementEdges { records, first: 0 })
    }

    /// Of each boundary face the numbers of its edges. Errors: the disk.
    pub fn faces(&self) -> Result<ElementEdges<3>> {
        let first = 6 * self.n_tets;
        let records = Records::open(&self.elements, first)?;
        Ok(ElementEdges { records, first })
    }

    /// Of each embedded edge its number. Errors: the disk.
    pub fn lines(&self) -> Result<ElementEdges<1>> {
        let first = 6 * self.n_tets + 3 * self.n_faces;
        let records = Records::open(&self.elements, first)?;
        Ok(ElementEdges { records, first })
    }

    /// Where the middles are, in the order of their numbers. Errors: the disk.
    pub fn points(&self) -> Result<MiddlePoints> {
        Ok(MiddlePoints(Records::open(&self.points, 0)?))
    }
}

/// Numbers of the edges of elements that have `N`, read one element after the other.
pub(super) struct ElementEdges<const N: usize> {
    records: Records<8>,
    first: u64,
}

impl<const N: usize> ElementEdges<N> {
    /// Those of the next element. Errors: the disk.
    pub fn next(&mut self) -> Result<[u64; N]> {
        let mut edges = [0; N];
        for edge in &mut edges {
            let number = self.records.next()?;
            *edge = u64::from_le_bytes(number.expect("elements are read as they were"));
        }
        Ok(edges)
    }

    /// Those of the element with this number. Errors: the disk.
    pub fn of(&mut self, element: u64) -> Result<[u64; N]> {
        self.records.seek(self.first + N as u64 * element)?;
        self.next()
    }
}

/// Positions of middles, read one after the other.
pub(super) struct MiddlePoints(Records<POINT_BYTES>);

impl MiddlePoints {
    /// The next one. Errors: the disk.
    pub fn next(&mut self) -> Result<Option<[f64; 3]>> {
        let Some(bytes) = self.0.next()? else {
            return Ok(None);
        };
        let (numbers, _) = bytes.as_chunks::<8>();
        Ok(Some([0, 1, 2].map(|i| f64::from_le_bytes(numbers[i]))))
    }

    /// That of the edge with this number. Errors: the disk.
    pub fn of(&mut self, edge: u64) -> Result<[f64; 3]> {
        self.0.seek(edge)?;
        Ok(self.next()?.expect("every edge has its middle"))
    }
}
