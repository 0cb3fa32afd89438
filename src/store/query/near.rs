//! Bounds of the distance between a point and the vertices of a chunk, from the summary of the chunk.

use crate::sealed::Subdomain;
use tetdb_base::geom::{Aabb, Point};

/// Vertices of a chunk near a point, as bounded by the summary of the chunk.
#[derive(Clone, Copy)]
pub(super) struct NearVertices {
    /// Distance of the nearest cell that has vertices; negative for a point in a cell, lower for a more central one.
    pub nearness: f64,
    /// Box around all places within reach that may have vertices; empty where there are none.
    pub bounds: Aabb,
}

impl NearVertices {
    pub(super) fn new(part: &Subdomain, chunk: usize, p: Point, reach: f64) -> Self {
        let mut near = Self { nearness: f64::INFINITY, bounds: Aabb::EMPTY };
        for cell in part.vertex_summaries()[chunk].cells() {
            let [low, high] = cell.map(Point::from_array);
            let nearness = nearness(&Aabb { low, high }, p);
            near.nearness = near.nearness.min(nearness);
            if nearness <= reach {
                near.bounds =
                    near.bounds.union(Aabb { low: low.max(p - reach), high: high.min(p + reach) });
            }
        }
        near
    }
}

/// Distance of a point from a box; negative for a point in the box, lower for a more central one.
pub(super) fn nearness(bounds: &Aabb, p: Point) -> f64 {
    let outside = (p - p.clamp(bounds.low, bounds.high)).length();
    if outside > 0.0 {
        return outside;
    }
    let (center, extent) = ((bounds.low + bounds.high) * 0.5, bounds.high - bounds.low);
    ((p - center).abs() - extent * 0.5).max_element()
}
