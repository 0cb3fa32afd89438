//! How near a chunk of vertices comes to a point, as far as its summary tells.

use crate::sealed::Subdomain;
use tetdb_base::geom::{Aabb, Point};

/// What a chunk of vertices has near a point, as far as its summary tells.
#[derive(Clone, Copy)]
pub(super) struct Near {
    /// The distance of the nearest cell that has vertices; where the point is in one, a negative number, the less the more central.
    pub nearness: f64,
    /// Around all places within reach where there may be vertices; empty where there are none.
    pub bounds: Aabb,
}

impl Near {
    pub(super) fn of(part: &Subdomain, chunk: usize, p: Point, reach: f64) -> Self {
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

/// The distance of a point from a box; within it, a negative number, the less the more central it is.
pub(super) fn nearness(bounds: &Aabb, p: Point) -> f64 {
    let outside = (p - p.clamp(bounds.low, bounds.high)).length();
    if outside > 0.0 {
        return outside;
    }
    let (center, extent) = ((bounds.low + bounds.high) * 0.5, bounds.high - bounds.low);
    ((p - center).abs() - extent * 0.5).max_element()
}
