//! Collecting points and triangles, welding the points that two patches share.

use super::Sample;
use crate::geom::Point;
use std::collections::HashMap;

/// A surface being made.
#[derive(Default)]
pub(super) struct Builder {
    sample: Sample,
    /// Ids of the points on seams, by coordinate bits. Only looked up, never walked.
    seam: HashMap<[u64; 3], u32>,
}

impl Builder {
    /// A new label; returns its number.
    pub(super) fn label(&mut self, name: impl Into<String>) -> u32 {
        self.sample.label_names.push(name.into());
        (self.sample.label_names.len() - 1) as u32
    }

    /// A new point; the caller knows that it is not there yet.
    pub(super) fn point(&mut self, p: Point) -> u32 {
        self.sample.points.push(p);
        // Makers refuse surfaces of more triangles than u32 can number before they begin.
        (self.sample.points.len() - 1) as u32
    }

    /// The point on a seam with these very coordinates, made when it is not there yet.
    pub(super) fn seam_point(&mut self, p: Point) -> u32 {
        // Adding zero makes -0.0 and 0.0 one key.
        let key = (p + Point::ZERO).to_array().map(f64::to_bits);
        if let Some(&id) = self.seam.get(&key) {
            return id;
        }
        let id = self.point(p + Point::ZERO);
        self.seam.insert(key, id);
        id
    }

    /// A triangle, turned over when `inward`.
    pub(super) fn triangle(&mut self, [a, b, c]: [u32; 3], inward: bool, label: u32) {
        let corners = if inward { [a, c, b] } else { [a, b, c] };
        self.sample.triangles.push(corners);
        self.sample.labels.push(label);
    }

    /// Ends a patch: later patches share no point with it.
    pub(super) fn close_seams(&mut self) {
        self.seam.clear();
    }

    pub(super) fn finish(self) -> Sample {
        self.sample
    }
}
