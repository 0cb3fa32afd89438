//! Collects points and triangles, and welds the points that two patches share.

use super::{Sample, SampleError};
use std::collections::HashMap;
use tetdb_base::geom::Point;
use tetdb_base::storage::{filled, push, reserve};

/// A surface under construction.
#[derive(Default)]
pub(super) struct Builder {
    sample: Sample,
    /// Ids of the points on seams, by coordinate bits. Only looked up, never walked.
    seam: HashMap<[u64; 3], u32>,
}

impl Builder {
    /// A new label; returns its number.
    pub fn label(&mut self, name: impl Into<String>) -> u32 {
        self.sample.label_names.push(name.into());
        (self.sample.label_names.len() - 1) as u32
    }

    /// A new point, which must not exist yet.
    pub fn point(&mut self, p: Point) -> u32 {
        // Adding zero turns -0.0 into 0.0.
        push(&mut self.sample.points, p + Point::ZERO);
        // Generators refuse surfaces of more triangles than u32 can number before they begin.
        (self.sample.points.len() - 1) as u32
    }

    /// The point on a seam with exactly these coordinates, added if new.
    pub fn seam_point(&mut self, p: Point) -> u32 {
        let key = (p + Point::ZERO).to_array().map(f64::to_bits);
        if let Some(&id) = self.seam.get(&key) {
            return id;
        }
        let id = self.point(p);
        self.seam.insert(key, id);
        id
    }

    /// A triangle, turned over when `inward`.
    pub fn triangle(&mut self, [a, b, c]: [u32; 3], inward: bool, label: u32) {
        let corners = if inward { [a, c, b] } else { [a, b, c] };
        push(&mut self.sample.triangles, corners);
        push(&mut self.sample.labels, label);
    }

    /// An edge inside.
    pub fn edge(&mut self, [a, b]: [u32; 2], label: u32) {
        push(&mut self.sample.edges, [a, b, label]);
    }

    /// A vertex that is a point inside.
    pub fn mark(&mut self, v: u32, label: u32) {
        push(&mut self.sample.marks, [v, label]);
    }

    /// Triangles so far.
    pub fn n_triangles(&self) -> usize {
        self.sample.triangles.len()
    }

    /// [`Builder::finish`]; the triangles from `first` on are sheets.
    pub fn finish_with_sheets(mut self, first: usize) -> Sample {
        let n = self.sample.triangles.len();
        self.sample.sheets = (0..n).map(|t| t >= first).collect();
        self.finish()
    }

    /// Ends a patch: later patches share no point with it.
    pub fn close_seams(&mut self) {
        self.seam.clear();
    }

    /// The surface, points numbered in the order in which triangles first name them: as reading a
    /// file of it would.
    pub fn finish(mut self) -> Sample {
        const UNNAMED: u32 = u32::MAX;
        let mut old2new = filled(self.sample.points.len(), UNNAMED);
        let mut points = Vec::new();
        reserve(&mut points, self.sample.points.len());
        let sample = &mut self.sample;
        let corners = sample.triangles.iter_mut().flatten();
        let ends = sample.edges.iter_mut().flat_map(|edge| &mut edge[..2]);
        let marks = sample.marks.iter_mut().map(|mark| &mut mark[0]);
        for v in corners.chain(ends).chain(marks) {
            let new = &mut old2new[*v as usize];
            if *new == UNNAMED {
                *new = points.len() as u32;
                points.push(sample.points[*v as usize]);
            }
            *v = *new;
        }
        self.sample.points = points;
        self.sample
    }
}

/// Refuses a surface too large to build in memory.
pub(super) fn triangles_checked(
    name: &'static str,
    n_triangles: f64,
    bytes_max: u64,
) -> Result<(), SampleError> {
    if n_triangles.is_nan() || n_triangles > TRIANGLES_MAX as f64 {
        return Err(SampleError::TooMany { name, found: n_triangles, expected: TRIANGLES_MAX });
    }
    let needed = BYTES_TRIANGLE * n_triangles as u64;
    match needed <= bytes_max {
        true => Ok(()),
        false => Err(SampleError::Memory { name, needed }),
    }
}

/// Above this a sample is refused.
const TRIANGLES_MAX: u64 = 100_000_000;
/// Bytes per triangle while a sample is built: half a point and another half while points are numbered, corners, a
/// label, growth.
const BYTES_TRIANGLE: u64 = 50;
