//! Edge lengths at embedded points; refusal of edges and points that are too near to something else.

use std::collections::HashMap;

use super::embedded::NEAR_SHARE;
use super::embedded_set::EmbedError;
use super::point_tree::PointTree;
use super::seeker::Seeker;
use super::{Surface, SurfaceError};
use crate::geom::{Aabb, Point};
use crate::storage::ScratchSpace;

impl Surface {
    /// Sets the sizes at points that no triangle uses: how far the nearest triangle or other point is. Errors: points too near to something else.
    pub(super) fn set_point_sizes(&mut self, scratch: &ScratchSpace) -> Result<(), SurfaceError> {
        let is_used = self.used_vertices(&self.triangles);
        let points = self.embedded.points.iter();
        let points = points.map(|&[v, _]| (v, self.points[v as usize]));
        let alone: Vec<(u32, Point)> = points.filter(|(v, _)| !is_used[*v as usize]).collect();
        let diagonal = self.bounds().diagonal();
        let tree = PointTree::new(alone.clone());
        let seeker = Seeker::with_filter(self, scratch, |_| true);
        let mean = diagonal / (alone.len().max(1) as f64).cbrt();
        let size = |(v, p): (u32, Point)| {
            let to_triangles = seeker.distance(p, f64::INFINITY).min(diagonal);
            let mut best = to_triangles;
            let mut reach = 0.5 * mean;
            loop {
                let half = Point::splat(reach.min(to_triangles));
                let around = Aabb { low: p - half, high: p + half };
                tree.within(&around, |other, q| {
                    if other != v {
                        best = best.min(p.distance(q));
                    }
                });
                if best <= reach || reach >= to_triangles {
                    return best;
                }
                reach *= 2.0;
            }
        };
        let sizes: HashMap<u32, f64> = alone.iter().map(|&(v, p)| (v, size((v, p)))).collect();
        drop((seeker, tree));
        let least = NEAR_SHARE * diagonal;
        let points = self.embedded.points.iter();
        self.embedded.sizes =
            (points.map(|[v, _]| sizes.get(v).copied())).map(Option::unwrap_or_default).collect();
        let is_near = |[v, _]: &[u32; 2]| sizes.get(v).is_some_and(|&size| size < least);
        let points = self.embedded.points.iter().enumerate();
        let near: Vec<usize> = (points.filter(|(_, p)| is_near(p))).map(|(i, _)| i).collect();
        let Some(&first) = near.first() else {
            return Ok(());
        };
        let names: Vec<String> = near.iter().take(10).map(|&p| self.point_name(p)).collect();
        Err(EmbedError::TooNear {
            what: names.join(", "),
            at: self.points[self.embedded.points[first][0] as usize],
            distance: Some(self.embedded.sizes[first]),
            n: near.len(),
        }
        .into())
    }

    /// Refuses edges with an end that no triangle has but that is too near to a triangle. Call without support
    /// triangles.
    pub(super) fn refuse_near_ends(&self, seeker: &Seeker) -> Result<(), EmbedError> {
        let least = NEAR_SHARE * self.bounds().diagonal();
        let is_used = self.used_vertices(&self.triangles);
        let distance = |e: usize| {
            let [a, b, _] = self.embedded.edges[e];
            let ends = [a, b].into_iter().filter(|&v| !is_used[v as usize]);
            let of_end = |v: u32| seeker.distance(self.points[v as usize], least);
            ends.map(of_end).fold(f64::INFINITY, f64::min)
        };
        let edges = (0..self.embedded.edges.len()).map(|e| (e, distance(e)));
        let near: Vec<(usize, f64)> = edges.filter(|(_, d)| *d < least).collect();
        let edges: Vec<usize> = near.iter().map(|&(e, _)| e).collect();
        self.refuse_near(&edges, near.first().map(|&(_, distance)| distance))
    }

    /// The error for edges that are too near to something else, if there are any; `distance` is that of the first one.
    pub(super) fn refuse_near(
        &self,
        edges: &[usize],
        distance: Option<f64>,
    ) -> Result<(), EmbedError> {
        let Some(&first) = edges.first() else {
            return Ok(());
        };
        let names: Vec<String> = edges.iter().take(10).map(|&e| self.edge_name(e)).collect();
        let [a, b] = self.embedded_edge(first as u32).ends;
        Err(EmbedError::TooNear {
            what: names.join(", "),
            at: a.midpoint(b),
            distance,
            n: edges.len(),
        })
    }

    fn used_vertices(&self, triangles: &[[u32; 3]]) -> Vec<bool> {
        let mut is_used = vec![false; self.points.len()];
        for v in triangles.iter().flatten() {
            is_used[*v as usize] = true;
        }
        is_used
    }
}
