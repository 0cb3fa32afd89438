//! Means of numbers at both ends of edges, three at a time: positions of midpoints, and values of fields there.
//!
//! A mean is half of the one plus half of the other, so that it has the same bits in every file.

use std::path::{Path, PathBuf};

use super::error::Result;
use super::merged::Merged;
use super::stream::{RecordReader, scratch};
use tetdb_base::storage::{Payload, Sorted, Sorter, sort_record};
use tetdb_schema::field::{FieldNumber, FieldRow, Scalar};
use tetdb_schema::record::SealedVertex;
use tetdb_store::sealed::MergeReader;

/// Numbers of a field that are gathered at once, as many as a position has.
const AT_ONCE: usize = 3;

sort_record! {
    /// An edge by its second end, with the position of its first end, or numbers of a field there.
    pub(super) struct HalfEdge {
        pub high: u64,
        pub edge: u64,
        pub low_point: Payload<[f64; 3]>,
    }
}

sort_record! {
    /// The midpoint of an edge, or numbers of a field there.
    struct Midpoint {
        edge: u64,
        position: Payload<[f64; 3]>,
    }
}

sort_record! {
    /// A midpoint in the scratch file, where its place is its number.
    struct Position {
        position: Payload<[f64; 3]>,
    }
}

sort_record! {
    /// The ends of an edge in a scratch file, where its place is its number.
    pub(super) struct EdgeEnds {
        pub low: u64,
        pub high: u64,
    }
}

/// Positions of midpoints in the order of their numbers.
pub(super) struct MidpointReader(RecordReader<Position>);

impl MidpointReader {
    pub fn open(path: &Path) -> Result<Self> {
        Ok(Self(RecordReader::open(path, 0)?))
    }

    /// The midpoint of the edge with this number. Errors: the disk.
    pub fn at(&mut self, edge: u64) -> Result<[f64; 3]> {
        self.0.seek(edge)?;
        self.next().expect("every edge has its midpoint")
    }
}

impl Iterator for MidpointReader {
    type Item = Result<[f64; 3]>;

    fn next(&mut self) -> Option<Self::Item> {
        let midpoint = self.0.next().transpose()?;
        Some(midpoint.map(|midpoint| midpoint.position.0))
    }
}

/// Saves the means of three numbers at both ends of the edges, by number; `at_vertex` takes them from a vertex and the words of `fields`.
pub(super) fn save_means(
    mesh: &mut Merged,
    halves: Sorted<HalfEdge>,
    path: &Path,
    fields: &[FieldRow],
    at_vertex: impl Fn(&SealedVertex, &[u64]) -> [f64; 3],
) -> Result<()> {
    let mut halves = MergeReader::new(halves);
    let mut midpoints = Sorter::new(mesh.dir(), mesh.sorter_bytes());
    mesh.vertices_with(fields, |number, vertex, words| {
        while let Some(half) = halves.next_if(|half| half.high == number)? {
            let (a, b) = (half.low_point.0, at_vertex(vertex, words));
            let position = Payload([0, 1, 2].map(|i| 0.5 * a[i] + 0.5 * b[i]));
            midpoints.push(Midpoint { edge: half.edge, position })?;
        }
        Ok(())
    })?;
    let mut stream = scratch(path)?;
    for midpoint in midpoints.finish()? {
        stream.record(&Position { position: midpoint?.position })?;
    }
    stream.finish()
}

/// Up to three numbers of the values of a field at all midpoints, in a scratch file.
pub(super) struct ValueGroup {
    field: u32,
    number: FieldNumber,
    n: usize,
    path: PathBuf,
}

impl ValueGroup {
    /// Gathers the values of fields at vertices, none of integers; `ends` has the ends of all edges. Errors: damage, the disk.
    pub fn gather(mesh: &mut Merged, fields: &[FieldRow], ends: &Path) -> Result<Vec<Self>> {
        let mut groups = Vec::new();
        for field in fields {
            for first in (0..field.components as usize).step_by(AT_ONCE) {
                let path = mesh.dir().join(format!("midpoint-values-{}", groups.len()));
                let n = AT_ONCE.min(field.components as usize - first);
                save_group(mesh, field, first..first + n, (ends, &path))?;
                groups.push(Self { field: field.id, number: field.number, n, path });
            }
        }
        Ok(groups)
    }
}

/// Saves some numbers of a field at the midpoints.
fn save_group(
    mesh: &mut Merged,
    field: &FieldRow,
    own: std::ops::Range<usize>,
    (ends, path): (&Path, &Path),
) -> Result<()> {
    let three = |words: &[u64]| {
        let mut numbers = [0.0; AT_ONCE];
        for (number, &word) in numbers.iter_mut().zip(&words[own.clone()]) {
            *number = field.number.unpack(word).to_f64();
        }
        numbers
    };
    let field = std::slice::from_ref(field);
    let mut halves = Sorter::new(mesh.dir(), mesh.sorter_bytes());
    let mut ends = RecordReader::<EdgeEnds>::open(ends, 0)?;
    let (mut next, mut edge) = (ends.next()?, 0);
    mesh.vertices_with(field, |number, _, words| {
        while let Some(EdgeEnds { high, .. }) = next.filter(|ends| ends.low == number) {
            halves.push(HalfEdge { high, edge, low_point: Payload(three(words)) })?;
            (next, edge) = (ends.next()?, edge + 1);
        }
        Ok(())
    })?;
    save_means(mesh, halves.finish()?, path, field, |_, words| three(words))
}

/// The values of some fields at midpoints.
pub(super) struct MidpointValues(Vec<(FieldNumber, usize, MidpointReader)>);

impl MidpointValues {
    /// Opens the numbers of some fields, in the order of these. Errors: the disk.
    pub fn open(groups: &[ValueGroup], fields: &[FieldRow]) -> Result<Self> {
        let of = |id| groups.iter().filter(move |group| group.field == id);
        let open =
            |group: &ValueGroup| Ok((group.number, group.n, MidpointReader::open(&group.path)?));
        let groups = fields.iter().flat_map(|field| of(field.id)).map(open);
        Ok(Self(groups.collect::<Result<_>>()?))
    }

    /// The words of all numbers at the midpoint of this edge; fast where edges ascend. Errors: the disk.
    pub fn at(&mut self, edge: u64) -> Result<Vec<u64>> {
        let mut words = Vec::new();
        for (number, n, values) in &mut self.0 {
            let three = values.at(edge)?;
            let word = |&x: &f64| number.pack(Scalar::Float(x)).expect("a mean is in the range");
            words.extend(three[..*n].iter().map(word));
        }
        Ok(words)
    }
}
