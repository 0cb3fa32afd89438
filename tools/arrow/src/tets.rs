//! Rows of tetrahedra.

use std::sync::Arc;

use arrow_array::{ArrayRef, Float64Array, Int32Array, Int64Array};
use arrow_schema::Schema;
use tetdb::data::Hit;
use tetdb::data::schema::ids::TetId;
use tetdb::{Error, VARIABLES};

use super::batches::Rows;
use super::{Batches, Chunk};

/// Columns that follow from the records of tetrahedra alone.
const OF_RECORDS: [&str; 3] = ["id", "subdomain", "region"];

/// Returns whether the corners of the tetrahedra are needed.
pub(super) fn needs_shape(schema: &Schema) -> bool {
    let mut names = schema.fields().iter().map(|field| field.name().as_str());
    names.any(|name| VARIABLES.contains(&name) && !OF_RECORDS.contains(&name) || corner(name).is_some())
}

/// The corner that a column names the vertex of.
fn corner(name: &str) -> Option<usize> {
    ["v0", "v1", "v2", "v3"].iter().position(|v| *v == name)
}

pub(super) fn rows(batches: &mut Batches, at: Chunk) -> Result<Rows, Error> {
    let (mut ids, mut regions) = (Vec::new(), Vec::new());
    let mut hits = Vec::new();
    if let Some(query) = &mut batches.query {
        hits = query.answers(&mut batches.store, at.subdomain, at.chunk)?;
        ids.extend(hits.iter().map(|hit| hit.id));
        regions.extend(hits.iter().map(|hit| hit.region.cast_signed()));
    } else {
        let part = batches.part(at.subdomain)?;
        let chunk = part.tet_chunk(at.chunk)?;
        for (local, tet) in (chunk.first..).zip(&chunk.records) {
            let id = TetId::new(part.id(), local);
            ids.push(id.ok_or_else(|| part.damaged(format!("tetrahedron {local} has no id")))?);
            regions.push(tet.region.cast_signed());
        }
    }
    let mut columns = vec![None; batches.schema.fields().len()];
    if !batches.fields.is_empty() {
        let first = batches.part(at.subdomain)?.tet_summaries()[at.chunk as usize].first;
        let records: Vec<usize> = ids.iter().map(|id| (id.local() - first) as usize).collect();
        columns = batches.fields.read(&batches.store, (at.subdomain, at.chunk), &records)?;
    }
    let n = ids.len();
    let own = batches.schema.fields().iter().zip(columns).map(|(field, of_field)| {
        of_field.unwrap_or_else(|| match field.name().as_str() {
            "id" => {
                let numbers = ids.iter().map(|id| id.number().cast_signed());
                Arc::new(Int64Array::from_iter_values(numbers))
            }
            "subdomain" => {
                Arc::new(Int32Array::from_value(at.subdomain.cast_signed(), n)) as ArrayRef
            }
            "region" => Arc::new(Int32Array::from(regions.clone())),
            name => measured(name, &hits),
        })
    });
    Ok((n, own.collect()))
}

/// A column that needs the corners.
fn measured(name: &str, hits: &[Hit]) -> ArrayRef {
    if let Some(i) = corner(name) {
        let ids = hits.iter().map(|hit| hit.vertices[i].cast_signed());
        return Arc::new(Int64Array::from_iter_values(ids));
    }
    let numbers = |value: fn(&Hit) -> f64| -> ArrayRef {
        Arc::new(Float64Array::from_iter_values(hits.iter().map(value)))
    };
    match name {
        "quality" => numbers(|hit| hit.shape.quality),
        "volume" => numbers(|hit| hit.shape.volume),
        "x" => numbers(|hit| hit.centroid().x),
        "y" => numbers(|hit| hit.centroid().y),
        "z" => numbers(|hit| hit.centroid().z),
        "edge_min" => numbers(|hit| hit.edges()[0]),
        "edge_max" => numbers(|hit| hit.edges()[1]),
        "angle_min" => numbers(|hit| hit.angles()[0]),
        "angle_max" => numbers(|hit| hit.angles()[1]),
        name => unreachable!("{name} is no column of tetrahedra"),
    }
}
