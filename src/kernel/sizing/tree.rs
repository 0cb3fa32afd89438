//! The octree. Cells have about the local size where sizes differ, and near small bodies far from all others; elsewhere
//! they are as large as possible.
//!
//! Two leaves that share as much as a corner differ by one level at most. Cells are addressed on an
//! integer lattice of 2^20 per axis; octants and corners are numbered x + 2y + 4z.

use super::SizingError;
use super::options::Targets;
use super::seeds::Seeds;
use rayon::prelude::*;
use tetdb_base::geom::Point;
use tetdb_base::storage::parallel;

/// Levels below the root: sizes from 1 to 1e-6 of the surface's extent.
pub(super) const DEPTH: u32 = 20;
/// Lattice cells along an axis.
pub(super) const LATTICE: u32 = 1 << DEPTH;
/// Marks an entry as a leaf.
pub(super) const LEAF: u32 = 1 << 31;
/// Corners are numbered by u32 and a leaf has eight.
const LEAVES_MAX: usize = 1 << 28;
/// Leaves stay wider than this many of their smallest size. With 2, leaves where sizes vary are one to
/// two sizes wide, over which the gradation lets the size change by half; with 1, eight times as many.
pub(super) const CELLS_PER_SIZE: f64 = 2.0;
/// Sizes in a cell may spread this much without a trend: irregular surfaces do.
const SPREAD_MAX: f64 = 2.0;
/// The means of its eight parts may differ this much, if each has at least `TREND_SEEDS`.
const TREND_MAX: f64 = 1.2;
const TREND_SEEDS: u32 = 4;
/// A cell wider than this many of its smallest size, times the root of the number of seeds in and around its parent,
/// lies far from all but a small body. A surface of even edges that comes near has fourteen times as many seeds, a
/// straight rod enough for 48 sizes. With 8 a body alone in a cube takes up to twice as many tetrahedra; with 2 a tenth
/// fewer, and rods count less.
const SPARSE_FROM: f64 = 4.0;
/// Interior sizes within this ratio of the surface's need no transition.
const TARGET_MAX: f64 = 1.15;
/// Lists at least this long are divided in parallel.
const PARALLEL_SEEDS: usize = 8192;
/// The parts of longer lists are handled one after the other, each in parallel within: all parts together would hold 14
/// times a list.
const PARALLEL_SEEDS_MAX: usize = 1 << 18;

/// Position of a leaf on the lattice; its side is `2^(DEPTH - level)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Leaf {
    pub anchor: [u32; 3],
    pub level: u32,
}

impl Leaf {
    pub const ROOT: Self = Self { anchor: [0; 3], level: 0 };

    /// Side in lattice units.
    pub fn width(&self) -> u32 {
        LATTICE >> self.level
    }

    /// Side in units of the root's.
    pub fn side(&self) -> f64 {
        1.0 / f64::from(1u32 << self.level)
    }

    pub fn low(&self) -> Point {
        let [x, y, z] = self.anchor.map(f64::from);
        Point::new(x, y, z) * (1.0 / f64::from(LATTICE))
    }

    pub fn child(&self, octant: usize) -> Self {
        let level = self.level + 1;
        Self { anchor: shift(self.anchor, octant, LATTICE >> level), level }
    }

    /// Lattice position of a corner.
    pub fn corner(&self, corner: usize) -> [u32; 3] {
        shift(self.anchor, corner, self.width())
    }
}

fn shift(p: [u32; 3], octant: usize, by: u32) -> [u32; 3] {
    std::array::from_fn(|axis| p[axis] + (octant >> axis & 1) as u32 * by)
}

/// Cells as blocks of eight entries: `LEAF | leaf number`, or the number of the block of children.
///
/// Invariant once numbered: blocks and leaves in depth-first order, so that near cells are near in memory.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tree {
    pub root: u32,
    pub blocks: Vec<[u32; 8]>,
}

impl Tree {
    /// The balanced octree for these seeds and wanted sizes (all in units of the root's side), divided further before it is balanced.
    pub fn build(
        seeds: &Seeds,
        targets: &Targets,
        divide_further: impl FnOnce(&mut Self) -> Result<(), SizingError>,
    ) -> Result<Self, SizingError> {
        let all: Vec<u32> = seeds.all().collect();
        Self::build_near(&all, seeds, targets, divide_further)
    }

    /// The same, for some of the seeds.
    pub fn build_near(
        some: &[u32],
        seeds: &Seeds,
        targets: &Targets,
        divide_further: impl FnOnce(&mut Self) -> Result<(), SizingError>,
    ) -> Result<Self, SizingError> {
        let shape = shape_of(Leaf::ROOT, some, some.len(), seeds, targets);
        let mut tree = Self::from_shape(&shape);
        drop(shape);
        divide_further(&mut tree)?;
        tree.balance()?;
        Ok(tree.numbered())
    }

    /// Bytes of memory held.
    pub fn bytes(&self) -> usize {
        self.blocks.capacity() * size_of::<[u32; 8]>()
    }

    /// From the depth-first list of "is divided".
    pub fn from_shape(shape: &[bool]) -> Self {
        fn entry(shape: &mut impl Iterator<Item = bool>, blocks: &mut Vec<[u32; 8]>) -> u32 {
            if shape.next() != Some(true) {
                return LEAF;
            }
            let block = blocks.len();
            blocks.push([LEAF; 8]);
            for octant in 0..8 {
                blocks[block][octant] = entry(shape, blocks);
            }
            block as u32
        }
        let mut blocks = Vec::new();
        let root = entry(&mut shape.iter().copied(), &mut blocks);
        Self { root, blocks }
    }

    /// The entry of the leaf that holds a lattice cell: block and octant (none for the root), level.
    fn find(&self, cell: [u32; 3]) -> (Option<(usize, usize)>, u32) {
        let (mut place, mut entry, mut level) = (None, self.root, 0);
        while entry & LEAF == 0 {
            let octant = octant_of(cell, level);
            place = Some((entry as usize, octant));
            entry = self.blocks[entry as usize][octant];
            level += 1;
        }
        (place, level)
    }

    /// Number and level of the leaf that holds a lattice cell.
    pub fn leaf_at(&self, cell: [u32; 3]) -> (u32, u32) {
        let (mut entry, mut level) = (self.root, 0);
        while entry & LEAF == 0 {
            entry = self.blocks[entry as usize][octant_of(cell, level)];
            level += 1;
        }
        (entry & !LEAF, level)
    }

    /// All cells, depth first, each before its children; of a leaf its number.
    pub fn cells(&self) -> Cells<'_> {
        Cells { tree: self, stack: vec![(self.root, Leaf::ROOT)] }
    }

    /// All leaves, depth first: in the order of their numbers, once they are numbered.
    pub fn leaves(&self) -> impl Iterator<Item = Leaf> {
        self.cells().filter_map(|(number, leaf)| number.map(|_| leaf))
    }

    /// Divides leaves until neighbors differ by one level at most, from the deepest level up.
    fn balance(&mut self) -> Result<(), SizingError> {
        let deepest = self.leaves().map(|leaf| leaf.level).max().unwrap_or(0);
        for level in (2..=deepest).rev() {
            // No leaf of this level appears or goes while those around are divided, so the walk may see them as they were.
            let mut stack = vec![(self.root, Leaf::ROOT)];
            while let Some((entry, cell)) = stack.pop() {
                if entry & LEAF == 0 {
                    if cell.level < level {
                        let block = self.blocks[entry as usize];
                        stack.extend((0..8).map(|o| (block[o], cell.child(o))));
                    }
                } else if cell.level == level {
                    self.divide_around(cell)?;
                }
            }
        }
        Ok(())
    }

    /// Divides neighbors of a leaf that are larger than twice its width.
    fn divide_around(&mut self, leaf: Leaf) -> Result<(), SizingError> {
        for cell in leaf.outer_neighbors() {
            while let (Some((block, octant)), found) = self.find(cell) {
                if found + 1 >= leaf.level {
                    break;
                }
                self.divide(block, octant)?;
            }
        }
        Ok(())
    }

    fn divide(&mut self, block: usize, octant: usize) -> Result<(), SizingError> {
        let found = self.blocks.len() * 7;
        if found > LEAVES_MAX {
            return Err(SizingError::TooLarge { found, expected: LEAVES_MAX });
        }
        self.blocks[block][octant] = self.blocks.len() as u32;
        self.blocks.push([LEAF; 8]);
        Ok(())
    }

    /// The same tree with blocks and leaves numbered depth first.
    pub fn numbered(&self) -> Self {
        fn copy(from: &Tree, entry: u32, to: &mut Tree, n_leaves: &mut u32) -> u32 {
            if entry & LEAF != 0 {
                *n_leaves += 1;
                return LEAF | (*n_leaves - 1);
            }
            let block = to.blocks.len();
            to.blocks.push([LEAF; 8]);
            for octant in 0..8 {
                let child = from.blocks[entry as usize][octant];
                to.blocks[block][octant] = copy(from, child, to, n_leaves);
            }
            block as u32
        }
        let mut tree = Self { root: LEAF, blocks: Vec::with_capacity(self.blocks.len()) };
        tree.root = copy(self, self.root, &mut tree, &mut 0);
        tree
    }
}

/// A walk over all cells of a tree.
pub(super) struct Cells<'a> {
    tree: &'a Tree,
    stack: Vec<(u32, Leaf)>,
}

impl Iterator for Cells<'_> {
    type Item = (Option<u32>, Leaf);

    fn next(&mut self) -> Option<Self::Item> {
        let (entry, cell) = self.stack.pop()?;
        if entry & LEAF != 0 {
            return Some((Some(entry & !LEAF), cell));
        }
        let block = &self.tree.blocks[entry as usize];
        self.stack.extend((0..8).rev().map(|o| (block[o], cell.child(o))));
        Some((None, cell))
    }
}

/// The octant of a lattice cell in its ancestor at `level`.
#[inline]
pub(super) fn octant_of(cell: [u32; 3], level: u32) -> usize {
    let bit = DEPTH - 1 - level;
    let at = |axis: usize| cell[axis] >> bit & 1;
    (at(0) | at(1) << 1 | at(2) << 2) as usize
}

impl Leaf {
    /// Lattice cells next to this leaf outside its parent: up to seven, across the faces, edges and
    /// corner that it shares with its parent.
    pub fn outer_neighbors(&self) -> impl Iterator<Item = [u32; 3]> + use<> {
        let (anchor, width) = (self.anchor, self.width());
        (1..8usize).filter_map(move |across| {
            let mut cell = anchor;
            for (axis, x) in cell.iter_mut().enumerate() {
                if across >> axis & 1 == 1 {
                    let upper = *x & width != 0;
                    *x = if upper {
                        Some(*x + width).filter(|&x| x < LATTICE)?
                    } else {
                        x.checked_sub(1)?
                    };
                }
            }
            Some(cell)
        })
    }
}

/// Subdivision of a cell, depth first. `near`: the seeds in the cell or half its side around it; `n_around`: their
/// number for the parent cell.
fn shape_of(
    cell: Leaf,
    near: &[u32],
    n_around: usize,
    seeds: &Seeds,
    targets: &Targets,
) -> Vec<bool> {
    if !is_divided(cell, near, n_around, seeds, targets) {
        return vec![false];
    }
    let part = |(octant, list): (usize, Option<Vec<u32>>)| {
        let inner = list.as_deref().unwrap_or(near);
        shape_of(cell.child(octant), inner, near.len(), seeds, targets)
    };
    let parts: Vec<Vec<bool>> = if near.len() >= PARALLEL_SEEDS_MAX {
        // One after the other, or all parts would be held at once.
        (0..8).map(|o| part((o, near_child(cell.child(o), near, seeds)))).collect()
    } else {
        let lists = near_children(cell, near, seeds);
        if near.len() >= PARALLEL_SEEDS {
            let lists: Vec<_> = lists.into_iter().enumerate().collect();
            parallel(|| lists.into_par_iter().map(part).collect())
        } else {
            lists.into_iter().enumerate().map(part).collect()
        }
    };
    let mut shape = vec![true];
    parts.iter().for_each(|part| shape.extend(part));
    shape
}

/// Seeds in each child or half its side around it; none where all those of `near` are.
fn near_children(cell: Leaf, near: &[u32], seeds: &Seeds) -> [Option<Vec<u32>>; 8] {
    let side = 0.5 * cell.side();
    // Along each axis, of the lower and the upper children.
    let ranges = [cell.child(0), cell.child(7)].map(|child| {
        let low = child.low() - Point::splat(0.5 * side);
        (low, low + Point::splat(2.0 * side))
    });
    let mut lists: [Vec<u32>; 8] = Default::default();
    for &s in near {
        let p = seeds.at(s);
        let [lower, upper] =
            ranges.map(|(low, high)| (p.cmpge(low) & p.cmple(high)).bitmask() as usize);
        for (octant, list) in lists.iter_mut().enumerate() {
            if (upper & octant) | (lower & !octant & 7) == 7 {
                list.push(s);
            }
        }
    }
    lists.map(|list| (list.len() < near.len()).then_some(list))
}

/// Seeds in a cell or half its side around it; none where all those of `near` are.
fn near_child(cell: Leaf, near: &[u32], seeds: &Seeds) -> Option<Vec<u32>> {
    let side = cell.side();
    let low = cell.low() - Point::splat(0.5 * side);
    let high = low + Point::splat(2.0 * side);
    let is_near = |s: &u32| {
        let p = seeds.at(*s);
        p.cmpge(low).all() && p.cmple(high).all()
    };
    let some = |some: &[u32]| some.iter().copied().filter(is_near).collect::<Vec<u32>>();
    let list = parallel(|| near.par_chunks(PARALLEL_SEEDS).map(some).collect::<Vec<_>>()).concat();
    (list.len() < near.len()).then_some(list)
}

/// Returns whether sizes in and around a cell ask for smaller cells.
fn is_divided(cell: Leaf, near: &[u32], n_around: usize, seeds: &Seeds, targets: &Targets) -> bool {
    if cell.level == DEPTH || near.is_empty() {
        return false;
    }
    let middle = cell.low() + Point::splat(0.5 * cell.side());
    let (mut low, mut high) = (f64::INFINITY, 0.0f64);
    let mut parts = [(0u32, 0.0f64); 8];
    for &s in near {
        let h = seeds.h(s);
        low = low.min(h);
        high = high.max(h);
        let part = &mut parts[seeds.at(s).cmpge(middle).bitmask() as usize];
        *part = (part.0 + 1, part.1 + h);
    }
    if cell.side() <= CELLS_PER_SIZE * low {
        return false;
    }
    let targets_differ = targets.any()
        && (targets.interior(low) > low * TARGET_MAX || targets.interior(high) * TARGET_MAX < high);
    let is_sparse = cell.side() > SPARSE_FROM * (n_around as f64).sqrt() * low;
    if targets_differ || high > low * SPREAD_MAX || is_sparse {
        return true;
    }
    let (mut low, mut high) = (f64::INFINITY, 0.0f64);
    for (count, sum) in parts {
        if count >= TREND_SEEDS {
            let mean = sum / f64::from(count);
            low = low.min(mean);
            high = high.max(mean);
        }
    }
    high > low * TREND_MAX
}
