//! Rows of the tables that the catalog has: few, and without chunks.

use std::sync::Arc;

use arrow_array::{ArrayRef, BooleanArray, Float64Array, Int32Array, Int64Array, StringArray};
use arrow_schema::{DataType, Field, Schema};
use tetdb::{Error, Store};

use super::Table;
use super::batches::Rows;

/// A value of a row.
enum Value {
    Int(i32),
    Long(u64),
    Float(f64),
    Truth(bool),
    Text(Option<String>),
}

use Value::{Float, Int, Long, Text, Truth};

/// A row: values with the names of their columns.
type Row = Vec<(&'static str, Value)>;

pub(super) fn rows(store: &Store, table: Table, schema: &Schema) -> Result<Rows, Error> {
    let rows: Vec<Row> = match table {
        Table::Interfaces => interfaces(store),
        Table::Subdomains => subdomains(store),
        Table::Regions => regions(store),
        Table::Labels => labels(store),
        Table::Versions => versions(store)?,
        Table::Tets | Table::Vertices | Table::Faces => unreachable!("these have chunks"),
    };
    let columns = schema.fields().iter().map(|field| array(&rows, field));
    Ok((rows.len(), columns.collect()))
}

fn word(n: u32) -> Value {
    Int(n.cast_signed())
}

fn digest([a, b]: [u64; 2]) -> Value {
    Text(Some(format!("{a:016x}{b:016x}")))
}

fn interfaces(store: &Store) -> Vec<Row> {
    let rows = store.summary().interfaces.iter();
    rows.map(|row| {
        vec![
            ("cut", word(row.cut)),
            ("low", word(row.low)),
            ("high", word(row.high)),
            ("faces", Long(row.faces)),
            ("digest", digest(row.digest)),
        ]
    })
    .collect()
}

fn subdomains(store: &Store) -> Vec<Row> {
    let rows = store.summary().subdomains.iter();
    rows.map(|row| {
        let [low, high] = row.bounds;
        vec![
            ("subdomain", word(row.rank)),
            ("tets", Long(row.tets)),
            ("vertices", Long(row.vertices)),
            ("facets", Long(row.facets)),
            ("interface_faces", Long(row.interface_faces)),
            ("worst_q", Float(row.quality.worst)),
            ("volume", Float(row.volume)),
            ("x_min", Float(low[0])),
            ("y_min", Float(low[1])),
            ("z_min", Float(low[2])),
            ("x_max", Float(high[0])),
            ("y_max", Float(high[1])),
            ("z_max", Float(high[2])),
            ("bytes", Long(row.bytes)),
            ("digest", digest(row.digest)),
        ]
    })
    .collect()
}

fn regions(store: &Store) -> Vec<Row> {
    let summary = store.summary();
    let name = |region: u32| {
        let place = (region as usize).checked_sub(1)?;
        summary.region_names.get(place).filter(|name| !name.is_empty()).cloned()
    };
    let rows = summary.regions.iter();
    rows.map(|row| {
        vec![
            ("region", word(row.region)),
            ("name", Text(name(row.region))),
            ("tets", Long(row.tets)),
            ("volume", Float(row.volume)),
            ("filled", Truth(row.filled)),
        ]
    })
    .collect()
}

fn labels(store: &Store) -> Vec<Row> {
    let names = (0..).zip(&store.summary().labels);
    names.map(|(i, name)| vec![("label", Int(i)), ("name", Text(Some(name.clone())))]).collect()
}

fn versions(store: &Store) -> Result<Vec<Row>, Error> {
    let rows = store.versions()?.into_iter().map(|version| {
        vec![
            ("name", Text(Some(version.name))),
            ("note", Text(Some(version.note))),
            ("saved", Long(version.saved)),
            ("tets", Long(version.tets)),
            ("vertices", Long(version.vertices)),
            ("subdomains", Long(version.subdomains as u64)),
            ("bytes", Long(version.bytes)),
            ("digest", Text(Some(version.digest))),
        ]
    });
    Ok(rows.collect())
}

/// The values of a column.
fn array(rows: &[Row], column: &Field) -> ArrayRef {
    let values = || {
        let all = rows.iter().flatten();
        all.filter(|(name, _)| *name == column.name()).map(|(_, value)| value)
    };
    macro_rules! collected {
        ($array:ident, $kind:pat => $value:expr) => {
            Arc::new(
                values()
                    .map(|value| match value {
                        $kind => $value,
                        _ => unreachable!("the values of {} have one type", column.name()),
                    })
                    .collect::<$array>(),
            )
        };
    }
    match column.data_type() {
        DataType::Int32 => collected!(Int32Array, Int(n) => Some(*n)),
        DataType::Int64 => collected!(Int64Array, Long(n) => Some(n.cast_signed())),
        DataType::Float64 => collected!(Float64Array, Float(x) => Some(*x)),
        DataType::Boolean => collected!(BooleanArray, Truth(b) => Some(*b)),
        _ => collected!(StringArray, Text(text) => text.as_deref()),
    }
}
