//! Where readers of edges and points put them.

use crate::surface::WireSet;

/// What is wanted of a file that may have both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WireKind {
    /// Edges: `.obj`, `.vtk`, `.poly`.
    Edges,
    /// Points: `.obj`, `.vtk`, `.node`, `.csv`, `.txt`.
    Points,
}

/// Edges or points being read.
#[derive(Default)]
pub(super) struct WireSink {
    pub set: WireSet,
    /// What is called by no name of its own is called so.
    stem: String,
}

impl WireSink {
    /// For a file of this name.
    pub fn called(stem: String) -> Self {
        Self {
            stem,
            ..Self::default()
        }
    }

    pub fn label(&mut self, name: &str) -> u32 {
        let name = if name.is_empty() { &self.stem } else { name };
        let known = self.set.label_names.iter().position(|n| n == name);
        let place = known.unwrap_or_else(|| {
            self.set.label_names.push(name.to_owned());
            self.set.label_names.len() - 1
        });
        place as u32
    }

    pub fn line(&mut self, vertices: &[u32], label: u32) {
        let pairs = vertices.windows(2).map(|v| [v[0], v[1], label]);
        self.set.edges.extend(pairs);
    }

    pub fn mark(&mut self, v: u32, label: u32) {
        self.set.marks.push([v, label]);
    }
}
