//! The size field: built once, read from every thread.

use super::SizingError;
use super::constraint::SizeConstraint;
use super::constraints::{BEND_MAX, SizeConstraints};
use super::corners::TreeCorners;
use super::gather::surface_seeds;
use super::options::SizeOptions;
use super::seeds::{OctreeFrame, octree_frame};
use super::sources::ResolvedSource;
use super::summary::SizeSummary;
use super::tree::{CELLS_PER_SIZE, DEPTH, LATTICE, LEAF, Leaf, Tree, octant_of};
use super::values::CornerSizes;
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::{FrozenSpillVec, ScratchSpace, SpillVec};

/// Levels that one access to the jump table replaces: 32,768 entries of 8 bytes stay in cache.
const JUMP: u32 = 5;

/// Largest share of the scratch space that values take, and the bytes they may take of any.
const SHARE: u64 = 8;
const SHARE_MIN: u64 = 512 << 10;

/// Inverse widths of cells by level, in lattice units.
const WIDTHS_INVERSE: [f64; DEPTH as usize + 1] = {
    let mut list = [0.0; DEPTH as usize + 1];
    let mut level = 0;
    while level <= DEPTH as usize {
        list[level] = 1.0 / (LATTICE >> level) as f64;
        level += 1;
    }
    list
};

/// Wanted edge length as a function of position.
///
/// Continuous (up to the rounding of f32 values, 1e-7 of h), positive, with `beta = ln(hgrad)` bounding its
/// slope: `|h(x) - h(y)| <= beta · |x - y|` between corners of a leaf. Inside a leaf each partial
/// derivative is at most `beta`, so that the slope is below `√3 · beta`; 1.52 is the most seen
/// between random points. Where the surface has needles `ln(hgrad_needles)` takes the place of `beta`.
/// Outside the surface's box the value of the nearest point of a slightly larger cube.
#[derive(Clone, Debug)]
pub struct SizeField {
    pub(super) frame: OctreeFrame,
    pub(super) beta: f64,
    pub(super) tree: Tree,
    /// Values at the corners of each leaf, in units of the cube's side: one half cache line.
    pub(super) values: FrozenSpillVec<[f32; 8]>,
    jump: Jump,
    /// Lattice cells per input unit.
    per_lattice: f64,
    /// Shapes with sizes of their own; not part of [`SizeField::to_bytes`].
    pub(super) sources: Vec<ResolvedSource>,
}

/// Sizes besides those of the surface's edges and the options.
#[derive(Clone, Copy, Default)]
pub struct ExtraSizes<'a> {
    /// Wanted sizes as functions of position.
    pub constraints: &'a [&'a dyn SizeConstraint],
    /// One for each vertex of the surface.
    pub at_vertices: Option<&'a [f64]>,
    /// Vertices that no triangle uses, with their sizes.
    pub at_points: &'a [(u32, f64)],
}

/// Start of the descent: the entry and its level, for each cell of a regular grid.
#[derive(Clone, Debug, PartialEq)]
struct Jump {
    level: u32,
    cells: Vec<(u32, u32)>,
}

impl SizeField {
    /// Builds the field of a surface: triangles index points.
    ///
    /// # Errors
    /// Options that make no sense for this surface; a surface without edges.
    pub fn build(
        points: &[Point],
        triangles: &[[u32; 3]],
        options: &SizeOptions,
    ) -> Result<Self, SizingError> {
        let scratch = ScratchSpace::boundless();
        Ok(Self::build_with(points, triangles, options, &ExtraSizes::default(), &scratch)?.0)
    }

    /// Builds the field with extra sizes, and summarizes the origin of its sizes. The result does not depend on
    /// `scratch`.
    ///
    /// # Errors
    /// As [`SizeField::build`]; a constraint without a size somewhere in the surface's box. A scratch file that fails
    /// unwinds ([`attempt`](tetdb_base::storage::attempt)).
    pub fn build_with(
        points: &[Point],
        triangles: &[[u32; 3]],
        options: &SizeOptions,
        extra: &ExtraSizes,
        scratch: &ScratchSpace,
    ) -> Result<(Self, SizeSummary), SizingError> {
        let (frame, bounds) = octree_frame(points, triangles);
        let targets = options.resolve(bounds.diagonal())?;
        let scaled = targets.scaled(1.0 / frame.side);
        let mut seeds =
            surface_seeds(points, triangles, frame, &scaled, extra.at_vertices, scratch)?;
        for &(v, h) in extra.at_points {
            seeds.h[v as usize] = h * seeds.per_side;
        }
        let mut list = extra.constraints.to_vec();
        list.extend(options.formula.iter().map(|f| f as &dyn SizeConstraint));
        let constraints = SizeConstraints {
            list: &list,
            frame,
            bounds,
            least: scaled.hmin.unwrap_or(0.0),
            bend_max: BEND_MAX,
            cells_per_size: CELLS_PER_SIZE,
            beside: 0.0,
        };
        let tree = Tree::build(&seeds, &scaled, |tree| constraints.refine(tree))?;
        let _held = scratch.lease(seeds.bytes() + tree.bytes());
        let mut corners = TreeCorners::new(&tree, scratch);
        let mut sizes = CornerSizes {
            tree: &tree,
            corners: &mut corners,
            seeds: &seeds,
            beta: scaled.beta,
            slope_factor: None,
            scratch,
            parts: None,
        };
        sizes.gather_slope_factors();
        let h = sizes.values(&scaled, &constraints)?;
        drop(sizes);
        let field = Self::from_corners(frame, targets.beta, tree, corners, h, scratch)
            .with_sources(options, bounds.diagonal())?;
        let summary = field.summary(&seeds, &targets, options, &list, scratch);
        Ok((field, summary))
    }

    /// The field with the shapes of `options`, for a surface whose box has that diagonal.
    ///
    /// # Errors
    /// Options that make no sense for this surface.
    pub fn with_sources(
        mut self,
        options: &SizeOptions,
        diagonal: f64,
    ) -> Result<Self, SizingError> {
        let least = options.resolve(diagonal)?.hmin.unwrap_or(0.0);
        let resolved = options.sources.iter().map(|s| s.resolve(diagonal, least));
        self.sources = resolved.collect();
        Ok(self)
    }

    /// The field of these sizes at the corners of leaves.
    pub(super) fn from_corners(
        frame: OctreeFrame,
        beta: f64,
        tree: Tree,
        mut corners: TreeCorners,
        mut h: SpillVec<f32>,
        scratch: &ScratchSpace,
    ) -> Self {
        let mut values = scratch.builder_within(Self::share_of(scratch.cap()));
        for i in 0..corners.of_leaf.len() {
            let mut at_corners = [0.0; 8];
            for (value, c) in at_corners.iter_mut().zip(corners.of_leaf.get(i)) {
                *value = h.get(c as usize);
            }
            values.push(at_corners);
        }
        drop((corners, h));
        Self::from_parts(frame, beta, tree, values.finish().freeze())
    }

    /// Bytes that values take of a scratch space of `bytes`, at most.
    pub fn share_of(bytes: u64) -> u64 {
        (bytes / SHARE).max(SHARE_MIN)
    }

    pub(super) fn from_parts(
        frame: OctreeFrame,
        beta: f64,
        tree: Tree,
        values: FrozenSpillVec<[f32; 8]>,
    ) -> Self {
        let jump = Jump::new(&tree);
        Self {
            frame,
            beta,
            tree,
            values,
            jump,
            per_lattice: f64::from(LATTICE) / frame.side,
            sources: Vec::new(),
        }
    }

    /// The wanted edge length at a position, in input units.
    #[inline]
    pub fn h(&self, p: Point) -> f64 {
        let at = self.on_lattice(p);
        // Spelled out, here and below: `map` on arrays is not always inlined, and this is called ten million times.
        let of = |x: f64| (x as u32).min(LATTICE - 1);
        let cell = [of(at[0]), of(at[1]), of(at[2])];
        let (mut entry, mut level) = self.jump.at(cell);
        while entry & LEAF == 0 {
            entry = self.tree.blocks[entry as usize][octant_of(cell, level)];
            level += 1;
        }
        let mask = !((LATTICE >> level) - 1);
        let per_width = WIDTHS_INVERSE[level as usize];
        let within = |i: usize| (at[i] - f64::from(cell[i] & mask)) * per_width;
        let local = [within(0), within(1), within(2)];
        let mut h = trilinear(&self.values.get((entry & !LEAF) as usize), local) * self.frame.side;
        for source in &self.sources {
            h = h.min(source.h(p, self.beta));
        }
        h
    }

    /// Returns whether the octree is finer than a cube of that width somewhere near its middle.
    fn is_finer_in(&self, middle: Point, width: f64) -> bool {
        let is_finer = |p: Point| {
            let cell = self.on_lattice(p).map(|x| (x as u32).min(LATTICE - 1));
            let (_, level) = self.tree.leaf_at(cell);
            // Widths of cells differ by factors of two, those of another cube by any.
            self.frame.side / f64::from(1u32 << level) < 0.99 * width
        };
        let quarter = |i: usize, axis: usize| if i >> axis & 1 == 1 { 0.25 } else { -0.25 };
        let step = |i: usize| Point::new(quarter(i, 0), quarter(i, 1), quarter(i, 2));
        is_finer(middle) || (0..8).any(|i| is_finer(middle + step(i) * width))
    }

    /// Leaves whose lowest corner is in a box.
    pub fn n_leaves_in(&self, bounds: &Aabb) -> usize {
        let is_inside = |leaf: &Leaf| {
            let low = self.frame.low + leaf.low() * self.frame.side;
            bounds.low.cmple(low).all() && low.cmple(bounds.high).all()
        };
        self.tree.leaves().filter(is_inside).count()
    }

    /// Position in lattice units; points outside are moved to the cube's wall.
    #[inline]
    fn on_lattice(&self, p: Point) -> [f64; 3] {
        let at = (p - self.frame.low) * self.per_lattice;
        let clamped = |x: f64| x.clamp(0.0, f64::from(LATTICE));
        [clamped(at.x), clamped(at.y), clamped(at.z)]
    }

    /// Slope that the gradation allows, `ln(hgrad)`.
    pub fn beta(&self) -> f64 {
        self.beta
    }

    /// Number of leaves of the octree.
    pub fn n_leaves(&self) -> usize {
        self.values.len()
    }

    /// Smallest and largest value at any corner, in input units: no value of the field is beyond.
    pub fn range(&self) -> (f64, f64) {
        let (mut low, mut high) = (f32::INFINITY, 0f32);
        for i in 0..self.values.len() {
            for h in self.values.get(i) {
                (low, high) = (low.min(h), high.max(h));
            }
        }
        (f64::from(low) * self.frame.side, f64::from(high) * self.frame.side)
    }

    /// Memory held, in bytes.
    pub fn bytes(&self) -> usize {
        self.octree_bytes() + self.values.bytes()
    }

    /// Memory held by a field built in a scratch space of that many bytes.
    pub fn bytes_in(&self, scratch: u64) -> u64 {
        let values = (self.values.len() * size_of::<[f32; 8]>()) as u64;
        self.octree_bytes() as u64 + values.min(Self::share_of(scratch))
    }

    /// Bytes held in any scratch space.
    pub fn octree_bytes(&self) -> usize {
        size_of::<Self>() + self.tree.bytes() + self.jump.cells.capacity() * size_of::<(u32, u32)>()
    }
}

/// A field built with these sizes is divided where their octree is; its shapes are sampled only.
impl SizeConstraint for SizeField {
    fn h(&self, p: Point) -> Result<f64, SizingError> {
        Ok(Self::h(self, p))
    }

    fn divides(&self, middle: Point, width: f64) -> Option<bool> {
        match self.is_finer_in(middle, width) {
            true => Some(true),
            false if self.sources.is_empty() => Some(false),
            false => None,
        }
    }
}

/// Value at `local`, each coordinate from 0 to 1.
#[inline]
fn trilinear(values: &[f32; 8], [x, y, z]: [f64; 3]) -> f64 {
    let at = |i: usize| f64::from(values[i]);
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let low = mix(mix(at(0), at(1), x), mix(at(2), at(3), x), y);
    let high = mix(mix(at(4), at(5), x), mix(at(6), at(7), x), y);
    mix(low, high, z)
}

impl Jump {
    fn new(tree: &Tree) -> Self {
        // A tree of few blocks fits in cache itself.
        let level = if tree.blocks.len() < 512 { 0 } else { JUMP };
        let mut cells = vec![(tree.root, 0); 1 << (3 * level)];
        if level > 0 {
            let mut stack = vec![(tree.root, Leaf::ROOT)];
            while let Some((entry, leaf)) = stack.pop() {
                if entry & LEAF != 0 || leaf.level == level {
                    Self::fill(&mut cells, level, &leaf, entry);
                    continue;
                }
                let block = &tree.blocks[entry as usize];
                stack.extend((0..8).map(|o| (block[o], leaf.child(o))));
            }
        }
        Self { level, cells }
    }

    fn fill(cells: &mut [(u32, u32)], level: u32, leaf: &Leaf, entry: u32) {
        let n = 1u32 << (level - leaf.level);
        let [x, y, z] = leaf.anchor.map(|c| c >> (DEPTH - level));
        for k in 0..n * n * n {
            let cell = [x + k % n, y + k / n % n, z + k / n / n];
            cells[Self::index(cell, level)] = (entry, leaf.level);
        }
    }

    #[inline]
    fn index([x, y, z]: [u32; 3], level: u32) -> usize {
        (((z << level | y) << level) | x) as usize
    }

    #[inline]
    fn at(&self, cell: [u32; 3]) -> (u32, u32) {
        let coarse = cell.map(|c| c >> (DEPTH - self.level));
        self.cells[Self::index(coarse, self.level)]
    }
}
