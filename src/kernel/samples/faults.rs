//! A box with faults in it: rectangles on a grid that cut each other, end on each other and end inside.
//!
//! ```text
//!    _______________
//!   |    |    .     |      The box is divided into cells. A fault is a rectangle of cells' sides in a plane between cells;
//!   |____|____.     |      where two cross they share the grid's edges, and where two lie upon each other the first has
//!   |    |    .     |      the sides. Grid points inside are shifted, so that no fault is flat and no two meet at right
//!   |    |..........|      angles; without shifts (`shift=0`) all that can be coplanar is.
//!   |____|__________|
//! ```

use std::collections::BTreeMap;

use super::build::{Builder, triangles_checked};
use super::random::Random;
use super::{Sample, SampleError};
use tetdb_base::geom::{Point, mix};

/// Random numbers of shifts are not those of faults.
const SHIFTS: u64 = 0x5eed_0f5b_1f75;

/// `faults,count=12,seed=1,cells=8,shift=0.1`: faults, and cells along a side of the unit box; shifts in cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Faults {
    pub count: usize,
    pub seed: u64,
    pub cells: u32,
    pub shift: f64,
}

/// A side of a cell: the axis it is orthogonal to, and the grid point at its low corner.
pub(super) type CellSide = (usize, [u32; 3]);

impl Faults {
    pub(super) fn make(&self, bytes_max: u64) -> Result<Sample, SampleError> {
        let squares = f64::from(self.cells) * f64::from(self.cells);
        triangles_checked("faults", 2.0 * squares * (6.0 + self.count as f64), bytes_max)?;
        let grid = Grid { cells: self.cells, seed: self.seed, shift: self.shift };
        let mut build = Builder::default();
        grid.shell(&mut build);
        let first = build.n_triangles();
        let mut sides = BTreeMap::new();
        for (label, fault) in self.faults().into_iter().enumerate() {
            let label = build.label(format!("fault-{}", label + 1));
            for side in fault {
                sides.entry(side).or_insert(label);
            }
        }
        for (side, label) in sides {
            grid.push(&mut build, side, false, label);
        }
        Ok(build.finish_with_sheets(first))
    }

    /// The sides of each fault: rectangles of a third of the box or more, at random.
    fn faults(&self) -> Vec<Vec<CellSide>> {
        let mut random = Random::new(self.seed);
        let mut below = |n: u32| (random.unit() * f64::from(n)) as u32;
        let least = self.cells.div_ceil(3);
        let one = |_| {
            let (axis, at) = (below(3) as usize, 1 + below(self.cells - 1));
            let spans = [0; 2].map(|_| {
                let length = least + below(self.cells - least + 1);
                let low = below(self.cells - length + 1);
                (low, low + length)
            });
            let [low, high] = [spans.map(|s| s.0), spans.map(|s| s.1)];
            rectangle(axis, at, low, high)
        };
        (0..self.count).map(one).collect()
    }
}

/// The grid points of the unit box.
pub(super) struct Grid {
    pub cells: u32,
    pub seed: u64,
    pub shift: f64,
}

impl Grid {
    /// The sides of the box, with a label of their own.
    pub fn shell(&self, build: &mut Builder) {
        let shell = build.label("box");
        for axis in 0..3 {
            for at in [0, self.cells] {
                for side in rectangle(axis, at, [0, 0], [self.cells; 2]) {
                    self.push(build, side, at == 0, shell);
                }
            }
        }
    }

    pub fn push(&self, build: &mut Builder, (axis, low): CellSide, inward: bool, label: u32) {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let [a, b, c, d] = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[du, dv]| {
            let mut at = low;
            at[u] += du;
            at[v] += dv;
            build.seam_point(self.point(at))
        });
        // Diagonals change from side to side.
        let triangles = match low.iter().sum::<u32>() % 2 {
            0 => [[a, b, c], [a, c, d]],
            _ => [[a, b, d], [b, c, d]],
        };
        for t in triangles {
            build.triangle(t, inward, label);
        }
    }

    /// A point of the grid; those on the box are where they are.
    pub fn point(&self, at: [u32; 3]) -> Point {
        let n = self.cells;
        let whole = Point::from_array(at.map(f64::from));
        if at.iter().any(|&i| i == 0 || i == n) {
            return whole / f64::from(n);
        }
        let key = at.iter().fold(self.seed ^ SHIFTS, |key, &i| mix(key ^ u64::from(i)));
        let mut random = Random::new(key);
        let shift = (2.0 * random.in_cube() - Point::ONE) * self.shift;
        (whole + shift) / f64::from(n)
    }
}

/// The sides orthogonal to `axis` at `at`, from `low` to `high` along the two axes that follow.
pub(super) fn rectangle(axis: usize, at: u32, low: [u32; 2], high: [u32; 2]) -> Vec<CellSide> {
    let mut sides = Vec::new();
    for i in low[0]..high[0] {
        for j in low[1]..high[1] {
            let mut corner = [at; 3];
            (corner[(axis + 1) % 3], corner[(axis + 2) % 3]) = (i, j);
            sides.push((axis, corner));
        }
    }
    sides
}
