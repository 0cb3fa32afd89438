//! A box with layers, wells through them, and sensors between.
//!
//! ```text
//!    ___|_______|____
//!   |   |       |    |     On the grid of `faults`: a layer is a sheet of all cells' sides at a height; a well goes down a column of
//!   |...|.......|....|     grid points from the top, an edge for each cell, and ends inside; a sensor is a point in the middle of a
//!   |   |  x    |    |     cell. So layers and wells share vertices, shifted as those of faults.
//!   |...|............|
//!   |________________|
//! ```

use super::build::{Builder, triangles_checked};
use super::faults::{Grid, rectangle};
use super::random::Random;
use super::{Sample, SampleError};
use tetdb_base::geom::{Point, mix};

/// `wells,count=20,seed=1,cells=10,layers=3,points=20,shift=0.1`: wells, cells along a side of the unit box, layers, sensors.
#[derive(Clone, Debug, PartialEq)]
pub struct Wells {
    pub count: usize,
    pub seed: u64,
    pub cells: u32,
    pub layers: u32,
    pub points: usize,
    pub shift: f64,
}

impl Wells {
    /// Cells along a side for so many wells to have a column each, twice over.
    pub(super) fn cells_default(count: usize) -> u32 {
        Self::cells_least(2 * count).max(8)
    }

    pub(super) fn cells_least(count: usize) -> u32 {
        2 + (count as f64).sqrt() as u32
    }

    pub(super) fn make(&self, bytes_max: u64) -> Result<Sample, SampleError> {
        let n = self.cells;
        let squares = f64::from(n) * f64::from(n);
        let triangles =
            2.0 * squares * (6.0 + f64::from(self.layers)) + (self.count as f64) * f64::from(n);
        triangles_checked("wells", triangles, bytes_max)?;
        let grid = Grid { cells: n, seed: self.seed, shift: self.shift };
        let mut build = Builder::default();
        grid.shell(&mut build);
        let first = build.n_triangles();
        for layer in 1..=self.layers {
            let label = build.label(format!("layer-{layer}"));
            for side in rectangle(2, layer * n / (self.layers + 1), [0, 0], [n; 2]) {
                grid.push(&mut build, side, false, label);
            }
        }
        let mut random = Random::new(self.seed);
        let inner = n - 1;
        for (well, column) in
            self.chosen(self.count, u64::from(inner) * u64::from(inner)).enumerate()
        {
            let label = build.label(format!("well-{}", well + 1));
            let (x, y) = (1 + column as u32 / inner, 1 + column as u32 % inner);
            let depth = n / 3 + (random.unit() * f64::from(n - 1 - n / 3)) as u32;
            let mut above = build.seam_point(grid.point([x, y, n]));
            for z in (n - depth..n).rev() {
                let below = build.seam_point(grid.point([x, y, z]));
                build.edge([above, below], label);
                above = below;
            }
        }
        let label = build.label("sensors");
        let cells = u64::from(n).pow(3);
        for cell in self.chosen(self.points, cells) {
            let at = [1, n, n * n].map(|step| (cell / u64::from(step)) as u32 % n);
            let middle = Point::from_array(at.map(|i| f64::from(i) + 0.5));
            let point = build.point(middle / f64::from(n));
            build.mark(point, label);
        }
        Ok(build.finish_with_sheets(first))
    }

    /// `count` of the numbers below `end`, all different.
    fn chosen(&self, count: usize, end: u64) -> impl Iterator<Item = u64> {
        let mut known = std::collections::HashSet::new();
        let mut key = self.seed ^ end;
        std::iter::repeat_with(move || {
            key = mix(key.wrapping_add(1));
            key % end
        })
        .filter(move |&number| known.insert(number))
        .take(count)
    }
}
