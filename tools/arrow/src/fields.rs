//! Columns of fields: the values of a chunk, taken apart by component.

use std::sync::Arc;

use arrow_array::{ArrayRef, Float32Array, Float64Array, Int32Array, Int64Array};
use arrow_schema::Schema;
use tetdb::{Error, FieldReader, FieldValues, Store};

use super::Table;

/// The fields that a scan reads.
pub(super) struct FieldColumns {
    /// Names, and numbers of components.
    fields: Vec<(String, usize)>,
    /// For each column of the schema, the field and the component.
    columns: Vec<Option<(usize, usize)>>,
    /// Readers in one sub-domain, parallel to `fields`.
    open: Option<(u32, Vec<FieldReader>)>,
}

impl FieldColumns {
    /// Finds the fields whose columns are in the schema. Errors: damage.
    pub fn new(store: &Store, table: Table, schema: &Schema) -> Result<Self, Error> {
        let mut own = Self { fields: Vec::new(), columns: Vec::new(), open: None };
        let mut all = store.fields()?;
        all.retain(|field| Some(field.at) == table.place());
        for column in schema.fields() {
            let found = all.iter().find_map(|field| {
                let component = field.columns.iter().position(|name| name == column.name())?;
                Some((field, component))
            });
            own.columns.push(found.map(|(field, component)| {
                let known = own.fields.iter().position(|(name, _)| *name == field.name);
                let place = known.unwrap_or_else(|| {
                    own.fields.push((field.name.clone(), field.components as usize));
                    own.fields.len() - 1
                });
                (place, component)
            }));
        }
        Ok(own)
    }

    /// Returns whether no field is read.
    pub fn is_empty(&self) -> bool {
        self.fields.is_empty()
    }

    /// The columns of fields at some records of a chunk, given by their places in it; `None` for the other columns of the schema.
    ///
    /// Errors: damage.
    pub fn read(
        &mut self,
        store: &Store,
        (rank, chunk): (u32, u32),
        records: &[usize],
    ) -> Result<Vec<Option<ArrayRef>>, Error> {
        if self.is_empty() {
            return Ok(vec![None; self.columns.len()]);
        }
        if self.open.as_ref().is_none_or(|(of, _)| *of != rank) {
            self.open = None;
            let open = self.fields.iter().map(|(name, _)| store.field(name, rank));
            self.open = Some((rank, open.collect::<Result<_, _>>()?));
        }
        let open = self.open.iter_mut().flat_map(|(_, readers)| readers);
        let values = open.map(|reader| reader.chunk(chunk)).collect::<Result<Vec<_>, _>>()?;
        let column = |place: &Option<(usize, usize)>| {
            let (field, component) = (*place)?;
            let width = self.fields[field].1;
            Some(picked(&values[field], records.iter().map(|i| i * width + component)))
        };
        Ok(self.columns.iter().map(column).collect())
    }
}

fn picked(values: &FieldValues, places: impl Iterator<Item = usize>) -> ArrayRef {
    match values {
        FieldValues::F32(v) => Arc::new(Float32Array::from_iter_values(places.map(|i| v[i]))),
        FieldValues::F64(v) => Arc::new(Float64Array::from_iter_values(places.map(|i| v[i]))),
        FieldValues::I32(v) => Arc::new(Int32Array::from_iter_values(places.map(|i| v[i]))),
        FieldValues::I64(v) => Arc::new(Int64Array::from_iter_values(places.map(|i| v[i]))),
    }
}
