//! Samples sizes given by position into the octree once: cells are divided where sizes change, corners take the least.
//!
//! ```text
//!   +---+---+   27 places of a cell are asked: where what lies between the corners does not follow from
//!   | · | · |   them, the cell is divided, down to two wanted lengths. Cells of a 32nd of the cube are all
//!   +---+---+   asked, so what is narrower than a 64th of it may be missed where it stands alone.
//!   | · | · |
//!   +---+---+
//! ```

use rayon::prelude::*;

use super::SizingError;
use super::constraint::SizeConstraint;
use super::corners::TreeCorners;
use super::seeds::OctreeFrame;
use super::tree::{DEPTH, LATTICE, Leaf, Tree};
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::{SpillVec, check_cancelled, parallel};

/// Levels down to which every cell is sampled.
const LEVELS_ASKED: u32 = 5;
/// Cells sampled in one batch.
const CELLS_AT_ONCE: usize = 1 << 16;
/// Cells at most: as many leaves as can be numbered.
const CELLS_MAX: usize = 1 << 28;
/// Constraints between corners may differ from interpolated values by this share.
pub(super) const BEND_MAX: f64 = 0.1;

/// Constraints for one surface, in its box.
pub(super) struct SizeConstraints<'a> {
    pub list: &'a [&'a dyn SizeConstraint],
    pub frame: OctreeFrame,
    pub bounds: Aabb,
    /// Lower bound of all constraints, in units of the cube's side.
    pub least: f64,
    /// Values between corners may differ from the interpolated ones by this share.
    pub bend_max: f64,
    /// Where a constraint is not linear, cells are no wider than this many of its least lengths in them.
    pub cells_per_size: f64,
    /// Cells are divided that far outside the box, in their own widths.
    pub beside: f64,
}

impl SizeConstraints<'_> {
    /// The least constraint at a lattice position, in units of the cube's side. Outside the surface's box it is that of
    /// the nearest point.
    fn h(&self, at: [u32; 3]) -> Result<f64, SizingError> {
        let mut least = f64::INFINITY;
        for constraint in self.list {
            least = least.min(constraint.h(self.place(at))?);
        }
        Ok((least / self.frame.side).max(self.least))
    }

    fn place(&self, at: [u32; 3]) -> Point {
        let [x, y, z] = at.map(|x| f64::from(x) * (1.0 / f64::from(LATTICE)));
        let p = self.frame.low + Point::new(x, y, z) * self.frame.side;
        p.clamp(self.bounds.low, self.bounds.high)
    }

    /// Divides leaves of `tree` where constraints require it.
    pub fn refine(&self, tree: &mut Tree) -> Result<(), SizingError> {
        if self.list.is_empty() {
            return Ok(());
        }
        let mut all = Vec::new();
        let mut cells = tree.cells();
        loop {
            let some: Vec<_> = cells.by_ref().take(CELLS_AT_ONCE).collect();
            if some.is_empty() {
                break;
            }
            let shapes: Result<Vec<Vec<bool>>, _> = parallel(|| {
                some.into_par_iter()
                    .map(|(number, cell)| match number {
                        Some(_) => self.shape_of(cell),
                        None => Ok(vec![true]),
                    })
                    .collect()
            });
            all.extend(shapes?.into_iter().flatten());
            if all.len() > CELLS_MAX {
                return Err(SizingError::TooLarge { found: all.len(), expected: CELLS_MAX });
            }
        }
        *tree = Tree::from_shape(&all);
        Ok(())
    }

    /// Subdivision of a cell, depth first: true for divided cells.
    fn shape_of(&self, cell: Leaf) -> Result<Vec<bool>, SizingError> {
        if cell.level == DEPTH || !self.is_in_bounds(cell) {
            return Ok(vec![false]);
        }
        let (divided, is_asked) = self.is_divided(cell)?;
        if !divided && (!is_asked || cell.level >= LEVELS_ASKED) {
            return Ok(vec![false]);
        }
        check_cancelled();
        let part = |octant: usize| self.shape_of(cell.child(octant));
        let parts: Result<Vec<Vec<bool>>, _> = match cell.level < 3 {
            true => parallel(|| (0..8).into_par_iter().map(part).collect()),
            false => (0..8).map(part).collect(),
        };
        let parts = parts?;
        if !divided && parts.iter().all(|shape| shape.len() == 1) {
            return Ok(vec![false]);
        }
        let mut shape = vec![true];
        parts.iter().for_each(|part| shape.extend(part));
        Ok(shape)
    }

    pub fn is_in_bounds(&self, cell: Leaf) -> bool {
        let width = cell.side() * self.frame.side;
        let beside = Point::splat(self.beside * width);
        let low = self.frame.low + cell.low() * self.frame.side - beside;
        let high = low + Point::splat(width) + beside + beside;
        self.bounds.meets(&Aabb { low, high })
    }

    /// Returns whether a cell is divided, and whether values were sampled to decide that.
    fn is_divided(&self, cell: Leaf) -> Result<(bool, bool), SizingError> {
        let half = cell.width() / 2;
        if half == 0 {
            return Ok((false, false));
        }
        let middle = self.place(cell.anchor.map(|x| x + half));
        let width = cell.side() * self.frame.side;
        let mut is_asked = false;
        for constraint in self.list {
            match constraint.divides(middle, width) {
                Some(true) => return Ok((true, false)),
                Some(false) => {}
                None => is_asked = true,
            }
        }
        if !is_asked {
            return Ok((false, false));
        }
        let mut h = [0.0f64; 27];
        for (i, h) in h.iter_mut().enumerate() {
            let step = [i % 3, i / 3 % 3, i / 9].map(|k| k as u32 * half);
            *h = self.h(std::array::from_fn(|k| cell.anchor[k] + step[k]))?;
        }
        let least = h.iter().copied().fold(f64::INFINITY, f64::min);
        let is_fine = !least.is_finite() || cell.side() <= self.cells_per_size * least;
        Ok((!is_fine && bends(&h, self.bend_max), true))
    }

    /// Lowers values at the corners of leaves to the constraints there.
    pub fn lower(
        &self,
        tree: &Tree,
        corners: &mut TreeCorners,
        h: &mut SpillVec<f32>,
    ) -> Result<(), SizingError> {
        if self.list.is_empty() {
            return Ok(());
        }
        corners.sample(tree, &|at| self.h(at), |id, wanted| {
            h.change(id, |h| *h = h.min(wanted as f32));
        })
    }
}

/// Returns whether some of 27 values is far from the mean of the corners around it.
fn bends(h: &[f64; 27], most: f64) -> bool {
    (0..27).any(|i| {
        let at = [i % 3, i / 3 % 3, i / 9];
        let mut sum = 0.0;
        for corner in 0..8usize {
            let end = |axis: usize| match at[axis] {
                1 => 2 * (corner >> axis & 1),
                side => side,
            };
            sum += h[end(0) + 3 * end(1) + 9 * end(2)];
        }
        let mean = sum / 8.0;
        // Infinite on both sides is the same, on one side it is not.
        mean != h[i] && (mean - h[i]).abs() > most * h[i].min(mean)
    })
}
