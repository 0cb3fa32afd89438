//! Rows of vertices.

use std::sync::Arc;

use arrow_array::{ArrayRef, Float32Array, Float64Array, Int32Array, Int64Array};
use tetdb::Error;

use super::batches::Rows;
use super::{Batches, Chunk};

pub(super) fn rows(batches: &mut Batches, at: Chunk) -> Result<Rows, Error> {
    let records = batches.part(at.subdomain)?.vertex_chunk(at.chunk)?.records;
    let n = records.len();
    let all: Vec<usize> = (0..n).collect();
    let fields = batches.fields.read(&batches.store, (at.subdomain, at.chunk), &all)?;
    let axis = |i: usize| -> ArrayRef {
        Arc::new(Float64Array::from_iter_values(records.iter().map(|vertex| vertex.point[i])))
    };
    let columns = batches.schema.fields().iter().zip(fields).map(|(field, of_field)| {
        of_field.unwrap_or_else(|| match field.name().as_str() {
            "id" => {
                let ids = records.iter().map(|vertex| vertex.id.cast_signed());
                Arc::new(Int64Array::from_iter_values(ids))
            }
            "x" => axis(0),
            "y" => axis(1),
            "z" => axis(2),
            "h" => Arc::new(Float32Array::from_iter_values(records.iter().map(|v| v.h))),
            "tag" => {
                let tags = records.iter().map(|vertex| vertex.tag.cast_signed());
                Arc::new(Int32Array::from_iter_values(tags))
            }
            "subdomain" => Arc::new(Int32Array::from_value(at.subdomain.cast_signed(), n)),
            name => unreachable!("{name} is no column of vertices"),
        })
    });
    Ok((n, columns.collect()))
}
