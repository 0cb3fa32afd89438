//! Forms of columns: each form writes one field of all records of a chunk, and reads it back.
//!
//! The macro `columns!` takes the fields of a record with their forms, and generates both directions.

use super::columns::{
    ColumnReader, ColumnWriter, Malformed, unzigzag32, unzigzag64, zigzag32, zigzag64,
};
use crate::record::SealedTet;

/// A form of column for a field of type `V`.
pub(super) trait ColumnForm<V> {
    /// Appends the field of all records, the first of which has number `first`.
    fn put<R>(records: &[R], first: u32, field: impl Fn(&R) -> &V, columns: &mut ColumnWriter);
    /// The inverse of [`ColumnForm::put`]. Errors: bytes that no writer writes.
    fn take<R>(
        records: &mut [R],
        first: u32,
        field: impl Fn(&mut R) -> &mut V,
        columns: &mut ColumnReader<'_>,
    ) -> Result<(), Malformed>;
}

/// Generates both directions of a [`ChunkRecord`](super::ChunkRecord) from its fields, or positions in them, with their forms.
macro_rules! columns {
    ($($field:ident $([$place:literal])?: $form:ty,)+) => {
        fn encode(records: &[Self], first: u32, columns: &mut ColumnWriter) {
            $(<$form>::put(records, first, |r| &r.$field$([$place])?, columns);)+
        }

        fn decode(
            columns: &mut ColumnReader<'_>,
            first: u32,
            count: usize,
            records: &mut Vec<Self>,
        ) -> Result<(), Malformed> {
            let start = records.len();
            records.resize(start + count, Self::default());
            let records = &mut records[start..];
            $(<$form>::take(records, first, |r| &mut r.$field$([$place])?, columns)?;)+
            Ok(())
        }
    };
}
pub(super) use columns;

/// An integer of a dictionary.
pub(super) trait DictionaryWord: Copy {
    fn to_u64(self) -> u64;
    /// Drops high bits that the type lacks.
    fn from_u64(word: u64) -> Self;
}

macro_rules! words {
    ($($word:ty)+) => {$(
        impl DictionaryWord for $word {
            #[inline]
            fn to_u64(self) -> u64 {
                u64::from(self)
            }
            #[inline]
            fn from_u64(word: u64) -> Self {
                word as Self
            }
        }
    )+};
}
words!(u8 u32 u64);

/// Mostly few different values: see [`ColumnWriter::dictionary`].
pub(super) struct Dictionary;

impl<V: DictionaryWord> ColumnForm<V> for Dictionary {
    fn put<R>(records: &[R], _first: u32, field: impl Fn(&R) -> &V, columns: &mut ColumnWriter) {
        columns.dictionary(records.iter().map(|r| field(r).to_u64()));
    }

    fn take<R>(
        records: &mut [R],
        _first: u32,
        field: impl Fn(&mut R) -> &mut V,
        columns: &mut ColumnReader<'_>,
    ) -> Result<(), Malformed> {
        columns.dictionary(records.len(), |i, word| {
            *field(&mut records[i]) = DictionaryWord::from_u64(word)
        })
    }
}

/// Differences, each to the number before, zigzag, as varints.
pub(super) struct Differences;

impl ColumnForm<u32> for Differences {
    fn put<R>(records: &[R], _first: u32, field: impl Fn(&R) -> &u32, columns: &mut ColumnWriter) {
        steps32(records.iter().map(|r| *field(r))).for_each(|z| columns.varint(u64::from(z)));
    }

    fn take<R>(
        records: &mut [R],
        _first: u32,
        field: impl Fn(&mut R) -> &mut u32,
        columns: &mut ColumnReader<'_>,
    ) -> Result<(), Malformed> {
        let mut base = 0;
        for r in records {
            base = unzigzag32(columns.varint32()?, base);
            *field(r) = base;
        }
        Ok(())
    }
}

impl ColumnForm<u64> for Differences {
    fn put<R>(records: &[R], _first: u32, field: impl Fn(&R) -> &u64, columns: &mut ColumnWriter) {
        steps64(records.iter().map(|r| *field(r))).for_each(|z| columns.varint(z));
    }

    fn take<R>(
        records: &mut [R],
        _first: u32,
        field: impl Fn(&mut R) -> &mut u64,
        columns: &mut ColumnReader<'_>,
    ) -> Result<(), Malformed> {
        let mut base = 0;
        for r in records {
            base = unzigzag64(columns.varint()?, base);
            *field(r) = base;
        }
        Ok(())
    }
}

/// Differences, each to the number before, zigzag, as planes: four of an f32, as many as needed of a u32.
pub(super) struct DifferencePlanes;

impl ColumnForm<u32> for DifferencePlanes {
    fn put<R>(records: &[R], _first: u32, field: impl Fn(&R) -> &u32, columns: &mut ColumnWriter) {
        let steps: Vec<u32> = steps32(records.iter().map(|r| *field(r))).collect();
        columns.planes32(&steps);
    }

    fn take<R>(
        records: &mut [R],
        _first: u32,
        field: impl Fn(&mut R) -> &mut u32,
        columns: &mut ColumnReader<'_>,
    ) -> Result<(), Malformed> {
        let mut steps = vec![0; records.len()];
        columns.planes32(&mut steps)?;
        let mut base = 0;
        for (r, z) in records.iter_mut().zip(steps) {
            base = unzigzag32(z, base);
            *field(r) = base;
        }
        Ok(())
    }
}

impl ColumnForm<f32> for DifferencePlanes {
    fn put<R>(records: &[R], _first: u32, field: impl Fn(&R) -> &f32, columns: &mut ColumnWriter) {
        let steps = steps32(records.iter().map(|r| field(r).to_bits()));
        columns.planes(&steps.map(u64::from).collect::<Vec<_>>(), 4);
    }

    fn take<R>(
        records: &mut [R],
        _first: u32,
        field: impl Fn(&mut R) -> &mut f32,
        columns: &mut ColumnReader<'_>,
    ) -> Result<(), Malformed> {
        let mut base = 0;
        let steps = columns.planes(records.len(), 4)?;
        for (r, z) in records.iter_mut().zip(steps) {
            base = unzigzag32(z as u32, base);
            *field(r) = f32::from_bits(base);
        }
        Ok(())
    }
}

/// Coordinates as planes of differences, one axis after the other. The high bytes of neighbors agree; the low ones are noise.
pub(super) struct Points;

impl ColumnForm<[f64; 3]> for Points {
    fn put<R>(
        records: &[R],
        _first: u32,
        field: impl Fn(&R) -> &[f64; 3],
        columns: &mut ColumnWriter,
    ) {
        let mut steps = Vec::new();
        for axis in 0..3 {
            steps.clear();
            steps.extend(steps64(records.iter().map(|r| field(r)[axis].to_bits())));
            columns.planes(&steps, 8);
        }
    }

    fn take<R>(
        records: &mut [R],
        _first: u32,
        field: impl Fn(&mut R) -> &mut [f64; 3],
        columns: &mut ColumnReader<'_>,
    ) -> Result<(), Malformed> {
        for axis in 0..3 {
            let mut base = 0;
            let steps = columns.planes(records.len(), 8)?;
            for (r, z) in records.iter_mut().zip(steps) {
                base = unzigzag64(z, base);
                field(r)[axis] = f64::from_bits(base);
            }
        }
        Ok(())
    }
}

/// Three vertices: the first as a difference to that of the previous face, the others as differences to the first.
pub(super) struct FaceVertices;

impl ColumnForm<[u32; 3]> for FaceVertices {
    fn put<R>(
        records: &[R],
        first: u32,
        field: impl Fn(&R) -> &[u32; 3],
        columns: &mut ColumnWriter,
    ) {
        Differences::put(records, first, |r| &field(r)[0], columns);
        for place in 1..3 {
            for r in records {
                let vertices = field(r);
                columns.varint(u64::from(zigzag32(vertices[place], vertices[0])));
            }
        }
    }

    fn take<R>(
        records: &mut [R],
        first: u32,
        field: impl Fn(&mut R) -> &mut [u32; 3],
        columns: &mut ColumnReader<'_>,
    ) -> Result<(), Malformed> {
        Differences::take(records, first, |r| &mut field(r)[0], columns)?;
        for place in 1..3 {
            for r in records.iter_mut() {
                let vertices = field(r);
                vertices[place] = unzigzag32(columns.varint32()?, vertices[0]);
            }
        }
        Ok(())
    }
}

/// A tetrahedron, or none (all bits set): 0 for none, else 1 + the difference to the last.
pub(super) struct TetOrNone;

impl ColumnForm<u32> for TetOrNone {
    fn put<R>(records: &[R], _first: u32, field: impl Fn(&R) -> &u32, columns: &mut ColumnWriter) {
        let mut base = 0;
        for &tet in records.iter().map(field) {
            if tet == u32::MAX {
                columns.varint(0);
            } else {
                columns.varint(u64::from(zigzag32(tet, base)) + 1);
                base = tet;
            }
        }
    }

    fn take<R>(
        records: &mut [R],
        _first: u32,
        field: impl Fn(&mut R) -> &mut u32,
        columns: &mut ColumnReader<'_>,
    ) -> Result<(), Malformed> {
        let mut base = 0;
        for r in records {
            *field(r) = match columns.varint()?.checked_sub(1) {
                None => u32::MAX,
                Some(z) => {
                    let wide = Malformed("a number has more than 32 bits");
                    base = unzigzag32(u32::try_from(z).map_err(|_| wide)?, base);
                    base
                }
            };
        }
        Ok(())
    }
}

/// Numbers of vertices: the owner as a dictionary, the index as a difference to a guess.
///
/// The guess takes the difference between index and position from the last vertex with the same owner. It is always right for the
/// vertices of the sub-domain itself, whose index is their position.
pub(super) struct VertexNumbers;

/// Index minus position of the last vertex of each owner. Owners share 16 entries.
#[derive(Default)]
struct Offsets([u32; 16]);

impl Offsets {
    fn of(&mut self, number: u64) -> &mut u32 {
        &mut self.0[(number >> 32) as usize % 16]
    }
}

impl ColumnForm<u64> for VertexNumbers {
    fn put<R>(records: &[R], first: u32, field: impl Fn(&R) -> &u64, columns: &mut ColumnWriter) {
        columns.dictionary(records.iter().map(|r| *field(r) >> 32));
        let mut offsets = Offsets::default();
        for (&number, place) in records.iter().map(field).zip(first..) {
            let (offset, index) = (offsets.of(number), number as u32);
            columns.varint(u64::from(zigzag32(index, place.wrapping_add(*offset))));
            *offset = index.wrapping_sub(place);
        }
    }

    fn take<R>(
        records: &mut [R],
        first: u32,
        field: impl Fn(&mut R) -> &mut u64,
        columns: &mut ColumnReader<'_>,
    ) -> Result<(), Malformed> {
        columns.dictionary(records.len(), |i, owner| *field(&mut records[i]) = owner << 32)?;
        let mut offsets = Offsets::default();
        for (r, place) in records.iter_mut().zip(first..) {
            let number = field(r);
            let offset = offsets.of(*number);
            let index = unzigzag32(columns.varint32()?, place.wrapping_add(*offset));
            *offset = index.wrapping_sub(place);
            *number |= u64::from(index);
        }
        Ok(())
    }
}

/// Nodes of rotated tetrahedra, in order of their smallest vertices: four columns of mostly tiny differences.
pub(super) struct RotatedNodes;

/// The number that node `I` of a tetrahedron is compared with: the nearest one already known.
///
/// Tetrahedra that share their first vertex, or their first edge, follow each other. There the difference to the tetrahedron
/// before is smaller than the difference inside the tetrahedron.
#[inline]
fn base<const I: usize>(nodes: &[u32; 4], before: &[u32; 4]) -> u32 {
    let like_before = match I {
        0 => true,
        1 => nodes[0] == before[0],
        2 => nodes[0] == before[0] && nodes[1] == before[1],
        _ => false,
    };
    if like_before { before[I] } else { nodes[I - 1] }
}

fn put_node<const I: usize, R>(
    records: &[R],
    field: impl Fn(&R) -> &[u32; 4],
    steps: &mut [u32],
    columns: &mut ColumnWriter,
) {
    let mut before = [0; 4];
    for (z, &nodes) in steps.iter_mut().zip(records.iter().map(field)) {
        *z = zigzag32(nodes[I], base::<I>(&nodes, &before));
        before = nodes;
    }
    columns.planes32(steps);
}

impl ColumnForm<[u32; 4]> for RotatedNodes {
    fn put<R>(
        records: &[R],
        _first: u32,
        field: impl Fn(&R) -> &[u32; 4],
        columns: &mut ColumnWriter,
    ) {
        let mut steps = vec![0; records.len()];
        put_node::<0, R>(records, &field, &mut steps, columns);
        put_node::<1, R>(records, &field, &mut steps, columns);
        put_node::<2, R>(records, &field, &mut steps, columns);
        put_node::<3, R>(records, &field, &mut steps, columns);
    }

    fn take<R>(
        records: &mut [R],
        _first: u32,
        field: impl Fn(&mut R) -> &mut [u32; 4],
        columns: &mut ColumnReader<'_>,
    ) -> Result<(), Malformed> {
        let mut steps = [const { Vec::new() }; 4];
        for column in &mut steps {
            column.resize(records.len(), 0);
            columns.planes32(column)?;
        }
        let [first, second, third, fourth] = &steps;
        let rest = second.iter().zip(third).zip(fourth);
        let mut before = [0; 4];
        // All nodes in one pass, because the base of each node is among those just read.
        for (r, (&a, ((&b, &c), &d))) in records.iter_mut().zip(first.iter().zip(rest)) {
            let mut nodes = [0; 4];
            nodes[0] = unzigzag32(a, base::<0>(&nodes, &before));
            nodes[1] = unzigzag32(b, base::<1>(&nodes, &before));
            nodes[2] = unzigzag32(c, base::<2>(&nodes, &before));
            nodes[3] = unzigzag32(d, base::<3>(&nodes, &before));
            *field(r) = nodes;
            before = nodes;
        }
        Ok(())
    }
}

/// Nodes in any even order: those of the rotated tetrahedra, and the position in [`TURNS`] of the order that turns each back.
pub(super) struct TurnedNodes;

/// The even orders of four nodes.
const TURNS: [[usize; 4]; 12] = [
    [0, 1, 2, 3],
    [0, 2, 3, 1],
    [0, 3, 1, 2],
    [1, 0, 3, 2],
    [1, 3, 2, 0],
    [1, 2, 0, 3],
    [2, 0, 1, 3],
    [2, 1, 3, 0],
    [2, 3, 0, 1],
    [3, 0, 2, 1],
    [3, 2, 1, 0],
    [3, 1, 0, 2],
];

/// Shape: `TURN_OF[i][j]` = the position in [`TURNS`] of the order whose first node is number `i` and whose second is number `j`.
const TURN_OF: [[u8; 4]; 4] = {
    let (mut table, mut n) = ([[NO_TURN; 4]; 4], 0);
    while n < TURNS.len() {
        let [i, j, ..] = TURNS[n];
        table[i][j] = n as u8;
        n += 1;
    }
    table
};
/// Entry for two equal nodes, which no order has.
const NO_TURN: u8 = u8::MAX;

/// The rotated nodes, and the position in [`TURNS`] that turns them back.
fn turned(nodes: [u32; 4]) -> ([u32; 4], u8) {
    let rotated = SealedTet { nodes, region: 0 }.rotated().nodes;
    let [a, b, c, _] = rotated;
    let place = |node: u32| match node {
        _ if node == a => 0,
        _ if node == b => 1,
        _ if node == c => 2,
        _ => 3,
    };
    let back = TURN_OF[place(nodes[0])][place(nodes[1])];
    assert!(back != NO_TURN, "a tetrahedron has four nodes");
    (rotated, back)
}

impl ColumnForm<[u32; 4]> for TurnedNodes {
    fn put<R>(
        records: &[R],
        first: u32,
        field: impl Fn(&R) -> &[u32; 4],
        columns: &mut ColumnWriter,
    ) {
        let (rotated, turns): (Vec<[u32; 4]>, Vec<u8>) =
            records.iter().map(|r| turned(*field(r))).unzip();
        RotatedNodes::put(&rotated, first, |nodes| nodes, columns);
        columns.raw(&turns);
    }

    fn take<R>(
        records: &mut [R],
        first: u32,
        field: impl Fn(&mut R) -> &mut [u32; 4],
        columns: &mut ColumnReader<'_>,
    ) -> Result<(), Malformed> {
        RotatedNodes::take(records, first, &field, columns)?;
        let turns = columns.raw(records.len())?;
        for (r, &turn) in records.iter_mut().zip(turns) {
            let turn = TURNS.get(usize::from(turn)).ok_or(Malformed("an unknown turn"))?;
            let nodes = field(r);
            *nodes = turn.map(|i| nodes[i]);
        }
        Ok(())
    }
}

/// Differences of 32-bit numbers, zigzag.
fn steps32(values: impl Iterator<Item = u32>) -> impl Iterator<Item = u32> {
    let mut base = 0;
    values.map(move |value| zigzag32(value, std::mem::replace(&mut base, value)))
}

/// Differences of 64-bit numbers, zigzag.
fn steps64(values: impl Iterator<Item = u64>) -> impl Iterator<Item = u64> {
    let mut base = 0;
    values.map(move |value| zigzag64(value, std::mem::replace(&mut base, value)))
}
