//! The load ∫ h⁻³ over the filled volumes, without the skin at the surface in which no vertices are added.
//!
//! Cells of the octree, and parts of its leaves, are taken in the order of their uncertainty. A cell is divided while
//! the sizes in it differ, or the surface may pass through it. The triangle above a cell's middle decides between
//! inside and outside; a cell nearer to its middle than the surface has one answer for all its parts. In the remaining
//! cells at the surface points are sampled; their total volume follows from the triangles.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use rayon::prelude::*;

use super::field::SizeField;
use super::tree::{DEPTH, LEAF, Leaf, octant_of};
use tetdb_base::geom::{Point, mix};
use tetdb_base::storage::{for_each_mut, parallel, spare_threads};
use tetdb_base::surface::{EnclosedVolumes, Seeker};

/// Cells examined, at most. Eight times as many change the sum by 0.2 %, and took half of the time of small runs.
const CELLS_MAX: usize = 1 << 13;
/// Cells examined, at least: the estimate of the uncertainty needs some.
const CELLS_MIN: usize = 1 << 11;
/// Wanted accuracy of the sum. Errors of cells at the surface have either sign and are added by squares.
const TOLERANCE: f64 = 0.003;
/// Cells whose parts are examined in one batch, if there are threads: most of the next cells in order are divided
/// anyway.
const BATCH_CELLS: usize = 32;
/// Points drawn in the cells that the surface passes through, at least.
const POINTS: usize = 1 << 14;
/// Triangles that one search on the surface may test before fewer cells and points are examined: ordinary surfaces have
/// a tenth.
const EFFORT_ORDINARY: f64 = 500.0;
/// Cells and points are no fewer than this share: the sum then is good to a tenth.
const SHARE_MIN: f64 = 0.0625;
/// Greatest factor by which the sampled volume is believed to be wrong.
const FACTOR_MAX: f64 = 2.0;
/// Share of a cell's uncertain part that is wrong in the mean, when cut by the surface.
const SHARE_CUT: f64 = 0.3;
/// Share of the uncertain part that is wrong in the mean, for sizes that differ within part of a leaf and are read at
/// eight points.
const SHARE_SIZES: f64 = 0.02;

/// Layer at the surface without vertices, in units of h.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceSkin {
    /// To triangles, and to vertices.
    pub triangles: f64,
    /// Distance to vertices.
    pub vertices: f64,
}

/// A domain: the volumes of a surface that are filled.
pub struct Domain<'a> {
    /// Finds where points lie relative to the surface.
    pub seeker: &'a Seeker<'a>,
    /// The volumes of the surface.
    pub volumes: &'a EnclosedVolumes,
    /// By volume.
    pub filled: &'a [bool],
}

#[derive(Clone, Copy, Debug)]
struct IntegrationCell {
    leaf: Leaf,
    /// The octree's entry at this cell or above it.
    entry: u32,
    /// True if it is all in a filled volume.
    is_inside: bool,
    /// True if it is also farther from the surface than the skin.
    is_deep: bool,
    load: f64,
    /// Volume of its filled part, if the surface does not pass through it.
    volume: f64,
    unknown: f64,
    /// True if the skin's limit may pass through it; true if the surface may pass through it.
    is_cut: bool,
    is_crossed: bool,
    /// True if vertices are added in it.
    is_counted: bool,
}

impl SizeField {
    /// Load of the points of `domain` that are outside the skin of its surface.
    ///
    /// Accuracy: about one part in a hundred. The bits are the same on every machine and for any number of threads.
    pub fn load(&self, domain: &Domain, skin: SurfaceSkin) -> f64 {
        let share = (EFFORT_ORDINARY / domain.seeker.effort()).clamp(SHARE_MIN, 1.0);
        let mut sum = LoadSum {
            field: self,
            share,
            domain,
            skin,
            ranges: self.ranges(),
            least: self.frame.side / f64::from(1u32 << DEPTH),
            heap: BinaryHeap::new(),
            crossed: Vec::new(),
            known: 0.0,
            volume: 0.0,
            cut: 0.0,
            sizes: 0.0,
        };
        sum.add(sum.examined(IntegrationCell {
            leaf: Leaf::ROOT,
            entry: self.tree.root,
            is_inside: false,
            is_deep: false,
            load: 0.0,
            volume: 0.0,
            unknown: 0.0,
            is_cut: true,
            is_crossed: true,
            is_counted: true,
        }));
        sum.run()
    }

    /// Least and greatest value below each block, in units of the cube's side.
    fn ranges(&self) -> Vec<[f32; 2]> {
        let mut ranges = vec![[f32::INFINITY, 0.0]; self.tree.blocks.len()];
        // Blocks are numbered depth first: children after their parents.
        for (b, block) in self.tree.blocks.iter().enumerate().rev() {
            let [mut low, mut high] = ranges[b];
            for &entry in block {
                let [l, h] = if entry & LEAF == 0 {
                    ranges[entry as usize]
                } else {
                    range(&self.values.get((entry & !LEAF) as usize))
                };
                (low, high) = (low.min(l), high.max(h));
            }
            ranges[b] = [low, high];
        }
        ranges
    }
}

fn range(values: &[f32; 8]) -> [f32; 2] {
    let all = values.iter();
    all.fold([f32::INFINITY, 0.0], |[l, h], &x| [l.min(x), h.max(x)])
}

struct LoadSum<'a> {
    field: &'a SizeField,
    /// Share of the ordinary number of cells and points.
    share: f64,
    domain: &'a Domain<'a>,
    skin: SurfaceSkin,
    ranges: Vec<[f32; 2]>,
    /// Side of the octree's finest cells.
    least: f64,
    heap: BinaryHeap<ByUnknown>,
    /// Cells that the surface passes through and that are not divided: no vertex is near them, or they are the smallest.
    crossed: Vec<IntegrationCell>,
    /// Load and volume of cells of which all is known.
    known: f64,
    volume: f64,
    /// Squares of the uncertainty at the surface; sum of the uncertainty elsewhere.
    cut: f64,
    sizes: f64,
}

impl LoadSum<'_> {
    fn run(mut self) -> f64 {
        let [cells_min, cells_max] =
            [CELLS_MIN, CELLS_MAX].map(|n| (n as f64 * self.share) as usize);
        let mut n = 1;
        let mut in_heap: f64 = self.heap.iter().map(|c| c.cell.load).sum();
        while n < cells_max {
            let unknown = self.cut.max(0.0).sqrt() * SHARE_CUT + self.sizes.max(0.0);
            if n > cells_min && unknown < TOLERANCE * (self.known + in_heap) {
                break;
            }
            let Some((cell, parts)) = self.pop() else {
                break;
            };
            in_heap -= cell.load;
            self.count(&cell, -1.0);
            for part in parts {
                in_heap += self.add(part);
                n += 1;
            }
        }
        let mut rest: Vec<ByUnknown> = std::mem::take(&mut self.heap).into_vec();
        rest.sort_unstable();
        self.known + self.load_of_rest(&rest)
    }

    /// The cell of greatest uncertainty, and its parts. If threads are free, the parts of the next cells in order are
    /// examined in the same batch; the result depends on nothing but the cell.
    fn pop(&mut self) -> Option<(IntegrationCell, [IntegrationCell; 8])> {
        let mut first = self.heap.pop()?;
        if first.parts.is_none() {
            let n = if spare_threads() > 1 { BATCH_CELLS } else { 1 };
            let mut batch = vec![first];
            batch.extend(std::iter::from_fn(|| self.heap.pop()).take(n - 1));
            for_each_mut(&mut batch, |next| {
                if next.parts.is_none() {
                    let part = |octant| self.examined(self.child(&next.cell, octant));
                    next.parts = Some(Box::new(std::array::from_fn(part)));
                }
            });
            self.heap.extend(batch.drain(1..));
            first = batch.pop()?;
        }
        Some((first.cell, *first.parts?))
    }

    /// Load of the cells that are left. In cells that the surface passes through, points are sampled. A plane at the
    /// distance of the middle would cut off too little where the surface bends, and is useless where a cell contains
    /// many parts of it. The sampled load is scaled by the ratio of exact to sampled volume.
    fn load_of_rest(&self, rest: &[ByUnknown]) -> f64 {
        let (mut load, mut volume) = (0.0, self.volume);
        let mut crossed: Vec<&IntegrationCell> = self.crossed.iter().collect();
        for ByUnknown { cell, .. } in rest {
            if cell.is_crossed {
                crossed.push(cell);
            } else {
                load += cell.load;
                volume += cell.volume;
            }
        }
        let points = (POINTS as f64 * self.share) as usize;
        let each = points.div_ceil(crossed.len().max(1)) as u64;
        let sampled: Vec<[f64; 2]> =
            parallel(|| crossed.into_par_iter().map(|cell| self.sampled(cell, each)).collect());
        let [found, at_surface] =
            (sampled.iter()).fold([0.0; 2], |s, d| [s[0] + d[0], s[1] + d[1]]);
        let expected = self.domain.volume() - volume;
        let factor = match found > 0.0 {
            true => (expected / found).clamp(1.0 / FACTOR_MAX, FACTOR_MAX),
            false => 1.0,
        };
        load + factor * at_surface
    }

    /// Volume and load of a cell's filled part by the mean of some points in it.
    fn sampled(&self, cell: &IntegrationCell, points: u64) -> [f64; 2] {
        let (field, skin) = (self.field, self.skin);
        let Domain { seeker, volumes, filled } = *self.domain;
        let side = field.frame.side;
        let low = field.frame.low + cell.leaf.low() * side;
        let width = cell.leaf.side() * side;
        let mut state = (cell.leaf.anchor.into_iter())
            .fold(u64::from(cell.leaf.level), |s, x| mix(s ^ u64::from(x)));
        let mut next = || {
            state = mix(state);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let mut sum = [0.0; 2];
        for _ in 0..points {
            let p = low + Point::new(next(), next(), next()) * width;
            if !filled[volumes.at(seeker, p) as usize] {
                continue;
            }
            sum[0] += 1.0;
            let h = field.h(p);
            let near = |share: f64| share * h;
            if seeker.distance(p, near(skin.triangles)) >= near(skin.triangles)
                && seeker.distance_to_vertices(p, near(skin.vertices)) >= near(skin.vertices)
            {
                sum[1] += self.inverse_cube(h);
            }
        }
        sum.map(|x| x * width * width * width / points as f64)
    }

    fn child(&self, cell: &IntegrationCell, octant: usize) -> IntegrationCell {
        let leaf = cell.leaf.child(octant);
        let entry = match cell.entry & LEAF {
            0 => {
                self.field.tree.blocks[cell.entry as usize][octant_of(leaf.anchor, cell.leaf.level)]
            }
            _ => cell.entry,
        };
        IntegrationCell { leaf, entry, ..*cell }
    }

    /// Keeps an examined cell. Returns the load that went into the heap.
    fn add(&mut self, cell: IntegrationCell) -> f64 {
        if !cell.is_counted {
            self.volume += cell.volume;
            return 0.0;
        }
        if cell.unknown == 0.0 || cell.leaf.level == DEPTH {
            if cell.is_crossed {
                self.crossed.push(cell);
                return 0.0;
            }
            self.known += cell.load;
            self.volume += cell.volume;
            return 0.0;
        }
        self.count(&cell, 1.0);
        self.heap.push(ByUnknown { cell, parts: None });
        cell.load
    }

    fn count(&mut self, cell: &IntegrationCell, sign: f64) {
        match cell.is_cut {
            true => self.cut += sign * cell.unknown * cell.unknown,
            false => self.sizes += sign * cell.unknown,
        }
    }

    /// Examines a cell with a given place.
    fn examined(&self, mut cell: IntegrationCell) -> IntegrationCell {
        cell.is_counted = self.examine(&mut cell);
        cell
    }

    /// Finds out about a cell; false when no vertices are added in it.
    fn examine(&self, cell: &mut IntegrationCell) -> bool {
        let field = self.field;
        let width = cell.leaf.side() * field.frame.side;
        let middle =
            field.frame.low + (cell.leaf.low() * field.frame.side) + Point::splat(0.5 * width);
        let reach = 0.5 * 3f64.sqrt() * width;
        let [low, high] = self.sizes(cell, middle, reach);
        let volume = width * width * width;
        let mut share = 1.0;
        cell.volume = volume;
        (cell.is_cut, cell.is_crossed) = (false, false);
        if !cell.is_deep {
            let Domain { seeker, volumes, filled } = *self.domain;
            let SurfaceSkin { triangles, vertices } = self.skin;
            let far = reach + triangles.max(vertices) * high;
            let away = seeker.distance(middle, far);
            let inside = cell.is_inside || filled[volumes.at(seeker, middle) as usize];
            if away >= reach && !inside {
                cell.volume = 0.0;
                return false;
            }
            cell.is_crossed = away < reach;
            // No vertex is nearer than the surface.
            let away_vertices = match away < far {
                true => seeker.distance_to_vertices(middle, reach + vertices * high),
                false => f64::INFINITY,
            };
            cell.is_inside |= away >= reach;
            cell.is_deep =
                away >= reach + triangles * high && away_vertices >= reach + vertices * high;
            let h = field.h(middle);
            let depth = match inside {
                true => (away - triangles * h).min(away_vertices - vertices * h),
                false => -away - triangles * h,
            };
            share = (0.5 + depth / width).clamp(0.0, 1.0);
            cell.is_cut = depth.abs() < reach + triangles.max(vertices) * (high - low);
            if cell.is_inside && !cell.is_cut && share == 0.0 {
                return false;
            }
        }
        let spread = volume * (self.inverse_cube(low) - self.inverse_cube(high));
        if cell.entry & LEAF == 0 {
            cell.load = share * volume * self.inverse_cube(field.h(middle));
            cell.unknown = spread;
        } else {
            cell.load = share * volume * self.mean_inverse_cube(middle, width);
            cell.unknown = SHARE_SIZES * spread;
        }
        if cell.is_cut {
            cell.unknown += volume * self.inverse_cube(high);
        }
        true
    }

    /// Bounds on the sizes in a cell.
    fn sizes(&self, cell: &IntegrationCell, middle: Point, reach: f64) -> [f64; 2] {
        let field = self.field;
        let [low, high] = match cell.entry & LEAF {
            0 => self.ranges[cell.entry as usize],
            _ => range(&field.values.get((cell.entry & !LEAF) as usize)),
        };
        let [mut low, mut high] = [low, high].map(|h| f64::from(h) * field.frame.side);
        if cell.entry & LEAF != 0 {
            // In part of a leaf sizes differ by no more than the slope allows, which is more next to needles.
            let (_, level) = field.tree.leaf_at(cell.leaf.anchor);
            let width = field.frame.side / f64::from(1u32 << level);
            let slope = 3f64.sqrt() * field.beta.max((high - low) / width);
            let h = field.h(middle);
            let step = slope * reach;
            (low, high) = (low.max(h - step), high.min(h + step));
        }
        for source in &field.sources {
            let h = source.h(middle, field.beta);
            let step = field.beta * reach;
            low = low.min((h - step).max(source.least()));
            high = high.min(h + step);
        }
        [low, high.max(low)]
    }

    /// h⁻³, for no length below the side of the octree's finest cells. Where vertices nearly coincide, tiny sizes stand
    /// for a point, and a cell cannot resolve how fast they grow around it.
    fn inverse_cube(&self, h: f64) -> f64 {
        let h = h.max(self.least);
        1.0 / (h * h * h)
    }

    /// Mean of h⁻³ by the eight points of Gauss.
    fn mean_inverse_cube(&self, middle: Point, width: f64) -> f64 {
        let step = width * 0.5 / 3f64.sqrt();
        let at = |i: usize, axis: usize| if i >> axis & 1 == 1 { step } else { -step };
        let all = (0..8).map(|i| {
            let p = middle + Point::new(at(i, 0), at(i, 1), at(i, 2));
            self.inverse_cube(self.field.h(p))
        });
        all.sum::<f64>() / 8.0
    }
}

/// Cells ordered by uncertainty, then by place.
struct ByUnknown {
    cell: IntegrationCell,
    /// The parts of the cell, if they were examined already.
    parts: Option<Box<[IntegrationCell; 8]>>,
}

impl ByUnknown {
    fn place(&self) -> ([u32; 3], u32) {
        (self.cell.leaf.anchor, self.cell.leaf.level)
    }
}

impl Ord for ByUnknown {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_unknown = self.cell.unknown.total_cmp(&other.cell.unknown);
        by_unknown.then_with(|| self.place().cmp(&other.place()))
    }
}

impl PartialOrd for ByUnknown {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for ByUnknown {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for ByUnknown {}
