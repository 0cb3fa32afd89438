//! Rows of tetrahedra.

use std::sync::Arc;

use arrow_array::{ArrayRef, Float64Array, Int32Array, Int64Array};
use arrow_schema::Schema;
use tetdb::Error;
use tetdb::data::schema::ids::TetId;
use tetdb::data::{DVec3, Hit};

use super::batches::Rows;
use super::{Batches, Chunk};

/// The data of the tetrahedra in a chunk that columns need; the rest is empty.
#[derive(Default)]
struct Tets {
    ids: Vec<TetId>,
    regions: Vec<u32>,
    vertices: Vec<[u64; 4]>,
    centroids: Vec<DVec3>,
    hits: Vec<Hit>,
}

/// Columns that need lasting ids of vertices.
const VERTICES: [&str; 4] = ["v0", "v1", "v2", "v3"];
/// Columns that need centroids.
const PLACES: [&str; 3] = ["x", "y", "z"];
/// Columns that need shapes, which take most of the time.
const SHAPES: [&str; 6] = ["quality", "volume", "edge_min", "edge_max", "angle_min", "angle_max"];

impl Tets {
    fn push(&mut self, hit: Hit, needs_shape: bool) {
        self.ids.push(hit.id);
        self.regions.push(hit.region);
        self.vertices.push(hit.vertices);
        self.centroids.push(hit.centroid());
        if needs_shape {
            self.hits.push(hit);
        }
    }
}

pub(super) fn rows(batches: &mut Batches, at: Chunk) -> Result<Rows, Error> {
    let schema = batches.schema();
    let needs = |columns: &[&str]| needs_one(&schema, columns);
    let (needs_shape, needs_corners) = (needs(&SHAPES), needs(&VERTICES) || needs(&PLACES));
    if let Some(n) = at.whole.filter(|_| schema.fields().is_empty()) {
        return Ok((n as usize, Vec::new()));
    }
    let mut tets = Tets::default();
    if let Some(query) = batches.query.as_mut().filter(|_| at.whole.is_none()) {
        for hit in query.answers(&mut batches.store, at.subdomain, at.chunk)? {
            tets.push(hit, needs_shape);
        }
    } else {
        let part = batches.part(at.subdomain)?;
        let chunk = part.tet_chunk(at.chunk)?;
        for (local, tet) in (chunk.first..).zip(&chunk.records) {
            let id = TetId::new(part.id(), local);
            let id = id.ok_or_else(|| part.damaged(format!("tetrahedron {local} has no id")))?;
            if !needs_shape && !needs_corners {
                tets.ids.push(id);
                tets.regions.push(tet.region);
                continue;
            }
            let corners = part.corners(tet.nodes)?;
            let (vertices, points) = (corners.map(|c| c.id), corners.map(|c| c.point));
            if needs_shape {
                tets.push(Hit::new(id, tet.region, vertices, points), true);
            } else {
                let [a, b, c, d] = points;
                tets.ids.push(id);
                tets.regions.push(tet.region);
                tets.vertices.push(vertices);
                tets.centroids.push((a + b + c + d) * 0.25);
            }
        }
    }
    let mut fields = vec![None; schema.fields().len()];
    if !batches.fields.is_empty() {
        let first = batches.part(at.subdomain)?.tet_summaries()[at.chunk as usize].first;
        let records: Vec<usize> = tets.ids.iter().map(|id| (id.local() - first) as usize).collect();
        fields = batches.fields.read(&batches.store, (at.subdomain, at.chunk), &records)?;
    }
    Ok((tets.ids.len(), tets.columns(at.subdomain, &schema, fields)))
}

fn needs_one(schema: &Schema, columns: &[&str]) -> bool {
    schema.fields().iter().any(|field| columns.contains(&field.name().as_str()))
}

impl Tets {
    fn columns(
        &self,
        subdomain: u32,
        schema: &Schema,
        fields: Vec<Option<ArrayRef>>,
    ) -> Vec<ArrayRef> {
        // Least and greatest come together.
        let pairs = |names: &[&str], pair: fn(&Hit) -> [f64; 2]| -> Vec<[f64; 2]> {
            if needs_one(schema, names) { self.hits.iter().map(pair).collect() } else { Vec::new() }
        };
        let edges = pairs(&["edge_min", "edge_max"], Hit::edges);
        let angles = pairs(&["angle_min", "angle_max"], Hit::angles);
        let one = |pairs: &[[f64; 2]], i: usize| floats(pairs.iter().map(|pair| pair[i]));
        let names = schema.fields().iter().map(|field| field.name().as_str());
        let columns = names.zip(fields).map(|(name, of_field)| {
            of_field.unwrap_or_else(|| match name {
                "id" => integers(self.ids.iter().map(|id| id.number())),
                "subdomain" => {
                    Arc::new(Int32Array::from_value(subdomain.cast_signed(), self.ids.len()))
                }
                "region" => {
                    let regions = self.regions.iter().map(|region| region.cast_signed());
                    Arc::new(Int32Array::from_iter_values(regions))
                }
                "v0" => integers(self.vertices.iter().map(|v| v[0])),
                "v1" => integers(self.vertices.iter().map(|v| v[1])),
                "v2" => integers(self.vertices.iter().map(|v| v[2])),
                "v3" => integers(self.vertices.iter().map(|v| v[3])),
                "x" => floats(self.centroids.iter().map(|p| p.x)),
                "y" => floats(self.centroids.iter().map(|p| p.y)),
                "z" => floats(self.centroids.iter().map(|p| p.z)),
                "quality" => floats(self.hits.iter().map(|hit| hit.shape.quality)),
                "volume" => floats(self.hits.iter().map(|hit| hit.shape.volume)),
                "edge_min" => one(&edges, 0),
                "edge_max" => one(&edges, 1),
                "angle_min" => one(&angles, 0),
                "angle_max" => one(&angles, 1),
                name => unreachable!("{name} is no column of tetrahedra"),
            })
        });
        columns.collect()
    }
}

fn floats(numbers: impl Iterator<Item = f64>) -> ArrayRef {
    Arc::new(Float64Array::from_iter_values(numbers))
}

fn integers(numbers: impl Iterator<Item = u64>) -> ArrayRef {
    Arc::new(Int64Array::from_iter_values(numbers.map(u64::cast_signed)))
}
