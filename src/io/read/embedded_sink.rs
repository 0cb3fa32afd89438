//! The target of readers of edges and points.

use std::collections::HashMap;

use tetdb_base::geom::Point;
use tetdb_base::surface::{EmbeddedSet, SurfaceError};

/// The kind of elements to read from a file that may have both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WireKind {
    /// Edges: `.obj`, `.vtk`, `.poly`.
    Edges,
    /// Points: `.obj`, `.vtk`, `.node`, `.csv`, `.txt`.
    Points,
}

/// Edges or points being read.
#[derive(Default)]
pub(super) struct EmbeddedSink {
    pub set: EmbeddedSet,
    /// Name of elements without a name of their own.
    stem: String,
    labels: HashMap<String, u32>,
    bytes_max: u64,
}

impl EmbeddedSink {
    /// A target for a file of this name, of at most so many bytes.
    pub fn called(stem: String, bytes_max: u64) -> Self {
        Self { stem, bytes_max, ..Self::default() }
    }

    /// Refuses `more` bytes that do not fit beside what it holds.
    pub fn check_bytes(&self, more: u64) -> Result<(), SurfaceError> {
        match self.set.bytes() + more > self.bytes_max {
            true => Err(SurfaceError::EmbedMemory {
                bytes_max: self.bytes_max,
                vertices: self.set.points.len(),
            }),
            false => Ok(()),
        }
    }

    pub fn label(&mut self, name: &str) -> u32 {
        let name = if name.is_empty() { &self.stem } else { name };
        if let Some(&label) = self.labels.get(name) {
            return label;
        }
        let label = self.set.label_names.len() as u32;
        self.set.label_names.push(name.to_owned());
        self.labels.insert(name.to_owned(), label);
        label
    }

    pub fn point(&mut self, p: Point) -> Result<(), SurfaceError> {
        self.set.points.push(p);
        self.check_bytes(0)
    }

    pub fn line(&mut self, vertices: &[u32], label: u32) -> Result<(), SurfaceError> {
        let pairs = vertices.windows(2).map(|v| [v[0], v[1], label]);
        self.set.edges.extend(pairs);
        self.check_bytes(0)
    }

    pub fn mark(&mut self, v: u32, label: u32) -> Result<(), SurfaceError> {
        self.set.marks.push([v, label]);
        self.check_bytes(0)
    }
}
