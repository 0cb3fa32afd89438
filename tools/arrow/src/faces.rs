//! Rows of faces on the surface, on inner walls and on sheets.

use std::sync::Arc;

use arrow_array::{ArrayRef, Float64Array, Int32Array, Int64Array};
use tetdb::Error;
use tetdb::data::DVec3;
use tetdb::data::schema::ids::TetId;
use tetdb::data::schema::record::{NO_TET, SealedFacet};

use super::batches::Rows;
use super::{Batches, Chunk};

/// A face with the ids and positions of its vertices.
struct Face {
    record: SealedFacet,
    ids: [u64; 3],
    points: [DVec3; 3],
}

impl Face {
    fn area(&self) -> f64 {
        let [a, b, c] = self.points;
        (b - a).cross(c - a).length() * 0.5
    }

    fn center(&self) -> DVec3 {
        let [a, b, c] = self.points;
        (a + b + c) / 3.0
    }
}

pub(super) fn rows(batches: &mut Batches, at: Chunk) -> Result<Rows, Error> {
    let n_input = batches.store.summary().input_triangles.unwrap_or(u64::MAX);
    let part = batches.part(at.subdomain)?;
    let id = part.id();
    let faces = part.facet_chunk(at.chunk)?.records.into_iter().map(|record| {
        let corners = part.corners(record.vertices)?;
        Ok(Face { ids: corners.map(|c| c.id), points: corners.map(|c| c.point), record })
    });
    let faces = faces.collect::<Result<Vec<Face>, Error>>()?;
    let floats = |value: &dyn Fn(&Face) -> f64| -> ArrayRef {
        Arc::new(Float64Array::from_iter_values(faces.iter().map(value)))
    };
    let words = |value: &dyn Fn(&Face) -> u32| -> ArrayRef {
        Arc::new(Int32Array::from_iter_values(faces.iter().map(|face| value(face).cast_signed())))
    };
    let ids = |value: &dyn Fn(&Face) -> Option<u64>| -> ArrayRef {
        let numbers = faces.iter().map(|face| value(face).map(u64::cast_signed));
        Arc::new(Int64Array::from_iter(numbers))
    };
    let tet = |local: u32| {
        let beside = Some(local).filter(|local| *local != NO_TET);
        beside.and_then(|local| TetId::new(id, local)).map(TetId::number)
    };
    let columns = batches.schema.fields().iter().map(|field| match field.name().as_str() {
        "triangle" => ids(&|f| Some(f.record.triangle).filter(|triangle| *triangle < n_input)),
        "subdomain" => words(&|_| at.subdomain),
        "label" => words(&|f| f.record.label),
        "v0" => ids(&|f| Some(f.ids[0])),
        "v1" => ids(&|f| Some(f.ids[1])),
        "v2" => ids(&|f| Some(f.ids[2])),
        "region_front" => words(&|f| f.record.regions[0]),
        "region_behind" => words(&|f| f.record.regions[1]),
        "tet_front" => ids(&|f| tet(f.record.tets[0])),
        "tet_behind" => ids(&|f| tet(f.record.tets[1])),
        "area" => floats(&Face::area),
        "x" => floats(&|f| f.center().x),
        "y" => floats(&|f| f.center().y),
        "z" => floats(&|f| f.center().z),
        name => unreachable!("{name} is no column of faces"),
    });
    Ok((faces.len(), columns.collect()))
}
