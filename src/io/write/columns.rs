//! Columns of a table: a name, the type of the numbers, and the numbers of each row.
//!
//! VTK files and NumPy arrays are written from lists of columns, so that each array is described in one place.

use std::borrow::Cow;

use super::error::Result;
use super::stream::Strip;
use tetdb_schema::field::{FieldNumber, FieldRow};

/// Type of a column's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Number {
    U8,
    I32,
    U32,
    I64,
    F32,
    F64,
}

impl Number {
    /// Bytes, VTK's word, NumPy's word.
    fn row(self) -> (u64, &'static str, &'static str) {
        match self {
            Self::U8 => (1, "UInt8", "|u1"),
            Self::I32 => (4, "Int32", "<i4"),
            Self::U32 => (4, "UInt32", "<u4"),
            Self::I64 => (8, "Int64", "<i8"),
            Self::F32 => (4, "Float32", "<f4"),
            Self::F64 => (8, "Float64", "<f8"),
        }
    }

    /// Bytes of one number.
    pub fn bytes(self) -> u64 {
        self.row().0
    }

    /// VTK's word for the type.
    pub fn vtk(self) -> &'static str {
        self.row().1
    }

    /// NumPy's word for the type.
    pub fn numpy(self) -> &'static str {
        self.row().2
    }
}

/// The entry of a row in a column: one number, or several of one type.
pub(super) trait ColumnValue {
    const NUMBER: Number;
    const COMPONENTS: u64;
    /// Writes the numbers, little end first.
    fn put(&self, strip: &mut Strip) -> Result<()>;
}

macro_rules! cells {
    ($($type:ty => $number:ident),*) => {$(
        impl ColumnValue for $type {
            const NUMBER: Number = Number::$number;
            const COMPONENTS: u64 = 1;

            #[inline]
            fn put(&self, strip: &mut Strip) -> Result<()> {
                strip.put(&self.to_le_bytes())
            }
        }
    )*};
}

cells!(u8 => U8, i32 => I32, u32 => U32, i64 => I64, f64 => F64);

impl<T: ColumnValue, const N: usize> ColumnValue for [T; N] {
    const NUMBER: Number = T::NUMBER;
    const COMPONENTS: u64 = N as u64;

    #[inline]
    fn put(&self, strip: &mut Strip) -> Result<()> {
        self.iter().try_for_each(|number| number.put(strip))
    }
}

/// A column of rows of type `T`.
pub(super) struct TableColumn<T> {
    pub name: Cow<'static, str>,
    pub number: Number,
    /// Numbers in a row.
    pub components: u64,
    put: Box<Put<T>>,
}

/// A column for each of the fields, from the words of their values one after the other.
pub(super) fn field_columns<T: 'static>(
    fields: &[FieldRow],
    words: fn(&T) -> &[u64],
) -> Vec<TableColumn<T>> {
    let mut start = 0;
    let columns = fields.iter().map(|field| {
        let own = start..start + field.components as usize;
        start = own.end;
        let (number, bytes) = match field.number {
            FieldNumber::F32 => (Number::F32, 4),
            FieldNumber::F64 => (Number::F64, 8),
            FieldNumber::I32 => (Number::I32, 4),
            FieldNumber::I64 => (Number::I64, 8),
        };
        TableColumn {
            name: field.name.clone().into(),
            number,
            components: field.components.into(),
            put: Box::new(move |row, strip| {
                let words = &words(row)[own.clone()];
                words.iter().try_for_each(|word| strip.put(&word.to_le_bytes()[..bytes]))
            }),
        }
    });
    columns.collect()
}

type Put<T> = dyn Fn(&T, &mut Strip) -> Result<()>;

/// The column `name` with the `value` of each row.
pub(super) fn column<T, V: ColumnValue>(
    name: impl Into<Cow<'static, str>>,
    value: impl Fn(&T) -> V + 'static,
) -> TableColumn<T> {
    TableColumn {
        name: name.into(),
        number: V::NUMBER,
        components: V::COMPONENTS,
        put: Box::new(move |row, strip| value(row).put(strip)),
    }
}

/// Writes a row into the strips of its columns. Errors: the disk.
pub(super) fn put_row<T>(row: &T, columns: &[TableColumn<T>], strips: &mut [Strip]) -> Result<()> {
    columns.iter().zip(strips).try_for_each(|(column, strip)| (column.put)(row, strip))
}
