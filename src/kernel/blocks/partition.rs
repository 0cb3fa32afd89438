//! The partition into bricks and blocks: a k-d tree over the predicted load.
//!
//! It is a function of the coarse mesh and of the sizes alone. A *brick* is a leaf. A *block* is a subtree of some tens of
//! thousands of tetrahedra; it works on its own bricks and on a *margin* of bricks around them. Two blocks conflict if their
//! regions, which are own bricks and margin, share a brick.

use super::load::Sample;
use tetdb_base::geom::{Aabb, Point, mix};
use tetdb_base::storage::{StorageError, map_long, raise};

/// Tetrahedra of a block when it is finished.
const BLOCK_TETS: f64 = 32_000.0;
/// A mesh is divided into at least so many blocks, unless these were smaller than [`BLOCK_TETS_MIN`].
const BLOCKS_MIN: f64 = 60.0;
const BLOCK_TETS_MIN: f64 = 6_000.0;
/// A mesh has at most about this many blocks: the number of a brick and a slot share 32 bits.
const BLOCKS_MAX: f64 = 1_900.0;
/// Bricks of a block, and tetrahedra of a brick when it is finished, at least.
const BRICKS: f64 = 64.0;
const BRICK_TETS_MIN: f64 = 250.0;
/// Width of the margin in wanted lengths: of division, and of smoothing with the rounds.
pub(super) const MARGINS: [f64; 2] = [3.0, 2.0];
/// Bricks listed in all regions at most: a hundred times as many as usual.
const LISTED_MAX: usize = 1 << 26;
/// Blocks whose regions are found before their bricks are counted.
const REGIONS_AT_ONCE: usize = 128;
/// The use of memory in the error for regions that overlap everywhere.
pub(super) const TOO_STEEP: &str =
    "a part of the mesh where wanted lengths change steeply, with its surroundings,";
/// Bins of the histogram that finds a weighted median.
const BINS: usize = 1024;
/// Orders in which the blocks are colored; the best counts.
const ORDERS: usize = 200;

/// Predicted tetrahedra of each block, in a mesh of `total` tetrahedra.
pub fn block_tets(total: f64) -> f64 {
    let block = BLOCK_TETS.min((total / BLOCKS_MIN).max(BLOCK_TETS_MIN));
    block.max(total / BLOCKS_MAX)
}

/// A branch of the tree.
#[derive(Clone, Copy, Debug)]
struct Branch {
    axis: usize,
    plane: f64,
    below: Node,
    above: Node,
}

#[derive(Clone, Copy, Debug)]
enum Node {
    Branch(u32),
    Leaf(u32),
}

/// A block.
#[derive(Clone, Debug)]
pub(super) struct Block {
    /// Its own bricks are consecutive.
    pub bricks: std::ops::Range<u32>,
    pub bounds: Aabb,
    /// Predicted tetrahedra.
    pub load: f64,
    /// Own bricks and margin in ascending order, for each of [`MARGINS`].
    pub regions: [Vec<u32>; MARGINS.len()],
    /// Blocks it conflicts with, likewise.
    pub conflicts: [Vec<u32>; MARGINS.len()],
    /// Blocks of one color do not conflict. Of two that do, the one of smaller color goes first.
    pub color: u32,
}

/// The partition.
#[derive(Debug)]
pub(super) struct KdPartition {
    branches: Vec<Branch>,
    root: Node,
    /// Boxes of the bricks, and the wanted length in the middle of each.
    bricks: Vec<(Aabb, f64)>,
    /// Boxes of the branches, and the greatest of those lengths.
    boxes: Vec<(Aabb, f64)>,
    /// The block of each brick.
    owners: Vec<u32>,
    pub blocks: Vec<Block>,
}

impl KdPartition {
    /// Divides samples of the load, whose weights are tetrahedra, in `bounds`. `h` is the wanted length at a point.
    pub fn new(mut samples: Vec<Sample>, bounds: Aabb, h: &(dyn Fn(Point) -> f64 + Sync)) -> Self {
        let total: f64 = samples.iter().map(|s| f64::from(s.weight)).sum();
        let block = block_tets(total);
        let brick = (block / BRICKS).max(BRICK_TETS_MIN);
        let mut partition = Self {
            branches: Vec::new(),
            root: Node::Leaf(0),
            bricks: Vec::new(),
            boxes: Vec::new(),
            owners: Vec::new(),
            blocks: Vec::new(),
        };
        let n_blocks = (total / block).ceil();
        partition.root = partition.split(&mut samples, n_blocks, bounds, (None, brick));
        for (bounds, length) in &mut partition.bricks {
            *length = h((bounds.low + bounds.high) * 0.5);
        }
        partition.boxes = vec![(Aabb::EMPTY, 0.0); partition.branches.len()];
        partition.find_boxes(partition.root);
        let mut n_listed = 0;
        for (kind, margin) in MARGINS.into_iter().enumerate() {
            for from in (0..partition.blocks.len()).step_by(REGIONS_AT_ONCE) {
                let some: Vec<_> = partition.blocks[from..].iter().take(REGIONS_AT_ONCE).collect();
                let regions = map_long(&some, |block| {
                    partition.around(&block.bounds, |b| block.bricks.contains(&b), margin)
                });
                for (block, region) in partition.blocks[from..].iter_mut().zip(regions) {
                    n_listed += region.len();
                    block.regions[kind] = region;
                }
                if n_listed > LISTED_MAX {
                    let [needed, available] = [n_listed, LISTED_MAX].map(|n| 4 * n as u64);
                    raise(StorageError::Budget { what: TOO_STEEP, needed, available });
                }
            }
            partition.find_conflicts(kind);
        }
        partition.color(0);
        partition
    }

    /// Narrows the regions for the margin in that place of [`MARGINS`] to what each block needs of them. Blocks that conflict no more may
    /// have the same color.
    pub fn narrow(&mut self, kind: usize, needed: Vec<Vec<u32>>) {
        for (block, needed) in self.blocks.iter_mut().zip(needed) {
            block.regions[kind].retain(|b| needed.binary_search(b).is_ok());
        }
        self.find_conflicts(kind);
        self.color(kind);
    }

    pub fn n_bricks(&self) -> usize {
        self.bricks.len()
    }

    /// Predicted tetrahedra of the largest region.
    pub fn largest_region(&self) -> f64 {
        let load = |b: u32| {
            let block = &self.blocks[self.owner(b) as usize];
            block.load / block.bricks.len() as f64
        };
        let regions = self.blocks.iter().flat_map(|block| &block.regions);
        regions.map(|region| region.iter().map(|&b| load(b)).sum()).fold(0.0, f64::max)
    }

    /// Bytes of all lists of bricks and blocks.
    pub fn bytes_listed(&self) -> u64 {
        let lists = self.blocks.iter().flat_map(|b| b.regions.iter().chain(&b.conflicts));
        lists.map(|list| (list.len() * size_of::<u32>()) as u64).sum()
    }

    /// Predicted tetrahedra of all blocks.
    pub fn load(&self) -> f64 {
        self.blocks.iter().map(|b| b.load).sum()
    }

    /// The brick of a place.
    #[inline]
    pub fn find(&self, p: Point) -> u32 {
        let mut node = self.root;
        loop {
            match node {
                Node::Leaf(brick) => return brick,
                Node::Branch(at) => {
                    let branch = &self.branches[at as usize];
                    let is_above = p[branch.axis] >= branch.plane;
                    node = if is_above { branch.above } else { branch.below };
                }
            }
        }
    }

    /// The block that owns a brick.
    pub fn owner(&self, brick: u32) -> u32 {
        self.owners[brick as usize]
    }

    /// Divides a cell into `n` parts of equal load: into blocks, or those of block `of` into bricks.
    fn split(
        &mut self,
        samples: &mut [Sample],
        n: f64,
        bounds: Aabb,
        of: (Option<u32>, f64),
    ) -> Node {
        if n <= 1.0 {
            return self.leaf(samples, bounds, of);
        }
        let extent = match samples {
            [] => bounds,
            _ => Aabb::around(samples.iter().map(|s| s.at)),
        };
        let size = extent.high - extent.low;
        let axis = (1..3).fold(0, |best, k| if size[k] > size[best] { k } else { best });
        let n_below = (n * 0.5).floor();
        let plane = weighted_quantile(samples, axis, &extent, n_below / n);
        let n_low = partition_by(samples, |s| s.at[axis] < plane);
        let (low, high) = samples.split_at_mut(n_low);
        let (mut below, mut above) = (bounds, bounds);
        below.high[axis] = plane;
        above.low[axis] = plane;
        let at = self.branches.len();
        let unknown = Node::Leaf(0);
        self.branches.push(Branch { axis, plane, below: unknown, above: unknown });
        let below = self.split(low, n_below, below, of);
        let above = self.split(high, n - n_below, above, of);
        self.branches[at] = Branch { axis, plane, below, above };
        Node::Branch(at as u32)
    }

    fn leaf(&mut self, samples: &mut [Sample], bounds: Aabb, of: (Option<u32>, f64)) -> Node {
        let (block, brick) = of;
        if let Some(block) = block {
            self.bricks.push((bounds, 0.0));
            self.owners.push(block);
            return Node::Leaf(self.bricks.len() as u32 - 1);
        }
        let load: f64 = samples.iter().map(|s| f64::from(s.weight)).sum();
        let (from, id) = (self.bricks.len() as u32, self.blocks.len() as u32);
        self.blocks.push(Block {
            bricks: from..from,
            bounds,
            load,
            regions: Default::default(),
            conflicts: Default::default(),
            color: 0,
        });
        let n_bricks = (load / brick).ceil().max(1.0);
        let node = self.split(samples, n_bricks, bounds, (Some(id), brick));
        self.blocks[id as usize].bricks.end = self.bricks.len() as u32;
        node
    }

    fn find_boxes(&mut self, node: Node) -> (Aabb, f64) {
        match node {
            Node::Leaf(brick) => self.bricks[brick as usize],
            Node::Branch(at) => {
                let branch = self.branches[at as usize];
                let (below, above) = (self.find_boxes(branch.below), self.find_boxes(branch.above));
                let both = (below.0.union(above.0), below.1.max(above.1));
                self.boxes[at as usize] = both;
                both
            }
        }
    }

    /// The bricks that `is_own` and those within `margin` lengths of the box around them; a brick's length is that wanted in its middle. In ascending
    /// order.
    pub fn around(&self, own: &Aabb, is_own: impl Fn(u32) -> bool, margin: f64) -> Vec<u32> {
        let mut found = Vec::new();
        let mut open = vec![self.root];
        while let Some(node) = open.pop() {
            let (bounds, length) = match node {
                Node::Leaf(brick) => self.bricks[brick as usize],
                Node::Branch(at) => self.boxes[at as usize],
            };
            let is_own = matches!(node, Node::Leaf(b) if is_own(b));
            if !is_own && gap(own, &bounds) > margin * length {
                continue;
            }
            match node {
                Node::Leaf(brick) => found.push(brick),
                Node::Branch(at) => {
                    let branch = &self.branches[at as usize];
                    open.extend([branch.below, branch.above]);
                }
            }
        }
        found.sort_unstable();
        found
    }

    fn find_conflicts(&mut self, kind: usize) {
        let mut blocks_of = vec![Vec::new(); self.bricks.len()];
        for (id, block) in (0u32..).zip(&self.blocks) {
            for &brick in &block.regions[kind] {
                blocks_of[brick as usize].push(id);
            }
        }
        let blocks: Vec<u32> = (0..self.blocks.len() as u32).collect();
        let conflicts = map_long(&blocks, |&id| {
            let mut is_seen = vec![false; self.blocks.len()];
            is_seen[id as usize] = true;
            let bricks = self.blocks[id as usize].regions[kind].iter();
            let mut others: Vec<u32> = bricks
                .flat_map(|&b| &blocks_of[b as usize])
                .copied()
                .filter(|&b| !std::mem::replace(&mut is_seen[b as usize], true))
                .collect();
            others.sort_unstable();
            others.shrink_to_fit();
            others
        });
        for (block, conflicts) in self.blocks.iter_mut().zip(conflicts) {
            block.conflicts[kind] = conflicts;
        }
    }

    /// Colors the blocks by their conflicts of a kind, greedily in many orders; the coloring with the shortest chain of tasks counts.
    fn color(&mut self, kind: usize) {
        let n = self.blocks.len();
        let mean = self.blocks.iter().map(|b| b.load).sum::<f64>() / n as f64;
        // Part of a task's time does not depend on its load.
        let times: Vec<f64> = self.blocks.iter().map(|b| 0.3 * b.load + 0.7 * mean).collect();
        let mut random = 12_345u64;
        let turns: Vec<(usize, u64)> = (0..ORDERS)
            .map(|turn| {
                let start = random;
                (0..n).for_each(|_| random = mix(random + 1));
                (turn, start)
            })
            .collect();
        let colors = |&(turn, start): &(usize, u64)| {
            let mut random = start;
            let mut keyed: Vec<_> = (0..n)
                .map(|b| {
                    random = mix(random + 1);
                    let degree = self.blocks[b].conflicts[kind].len();
                    // Every other order takes blocks with many conflicts first.
                    let first = if turn % 2 == 0 { usize::MAX - degree / 4 } else { 0 };
                    (first, random, b)
                })
                .collect();
            keyed.sort_unstable();
            self.greedy(kind, keyed.into_iter().map(|k| k.2))
        };
        let chains = map_long(&turns, |turn| self.longest_chain(kind, &colors(turn), &times));
        let best = turns.iter().zip(chains).min_by(|a, b| a.1.total_cmp(&b.1));
        let best = colors(best.expect("several orders").0);
        for (block, color) in self.blocks.iter_mut().zip(best) {
            block.color = color;
        }
    }

    fn greedy(&self, kind: usize, order: impl Iterator<Item = usize>) -> Vec<u32> {
        let mut colors = vec![u32::MAX; self.blocks.len()];
        let mut used = Vec::new();
        for b in order {
            used.clear();
            let conflicts = self.blocks[b].conflicts[kind].iter();
            used.extend(conflicts.map(|&c| colors[c as usize]).filter(|&c| c != u32::MAX));
            used.sort_unstable();
            used.dedup();
            let free = (0u32..).zip(&used).find(|(i, c)| *i != **c).map(|(i, _)| i);
            colors[b] = free.unwrap_or(used.len() as u32);
        }
        colors
    }

    fn longest_chain(&self, kind: usize, colors: &[u32], times: &[f64]) -> f64 {
        let mut order: Vec<usize> = (0..colors.len()).collect();
        order.sort_by_key(|&b| colors[b]);
        let mut ends = vec![0.0f64; colors.len()];
        for b in order {
            let before = self.blocks[b].conflicts[kind].iter().map(|&c| c as usize);
            let start = before.filter(|&c| colors[c] < colors[b]).map(|c| ends[c]);
            ends[b] = start.fold(0.0, f64::max) + times[b];
        }
        ends.into_iter().fold(0.0, f64::max)
    }
}

/// Distance of two boxes in the largest of the three directions.
fn gap(a: &Aabb, b: &Aabb) -> f64 {
    (b.low - a.high).max(a.low - b.high).max(Point::ZERO).max_element()
}

/// A plane that has about `share` of the weight below it.
fn weighted_quantile(samples: &[Sample], axis: usize, extent: &Aabb, share: f64) -> f64 {
    let (low, high) = (extent.low[axis], extent.high[axis]);
    let scale = BINS as f64 / (high - low).max(f64::MIN_POSITIVE);
    let mut bins = [0.0; BINS];
    let mut total = 0.0;
    for s in samples {
        let bin = ((s.at[axis] - low) * scale) as usize;
        bins[bin.min(BINS - 1)] += f64::from(s.weight);
        total += f64::from(s.weight);
    }
    let wanted = share * total;
    let (mut sum, mut cut) = (0.0, BINS as f64 * share);
    for (i, &bin) in bins.iter().enumerate() {
        if bin > 0.0 && sum + bin > wanted {
            cut = i as f64 + ((wanted - sum) / bin).clamp(0.0, 1.0);
            break;
        }
        sum += bin;
    }
    low + cut / scale
}

/// Brings the samples that pass to the front, returns how many.
fn partition_by(samples: &mut [Sample], passes: impl Fn(&Sample) -> bool) -> usize {
    let (mut i, mut j) = (0, samples.len());
    while i < j {
        if passes(&samples[i]) {
            i += 1;
        } else {
            j -= 1;
            samples.swap(i, j);
        }
    }
    i
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetdb_base::storage::{CancelToken, RunContext};

    /// A grid of 20³ samples whose load falls along x, two hundred thousand tetrahedra in all.
    fn partition() -> KdPartition {
        let samples = (0..8000u32).map(|k| {
            let at = [k % 20, k / 20 % 20, k / 400].map(|i| (f64::from(i) + 0.5) / 20.0);
            Sample { at: Point::from_array(at), weight: (25.0 * (1.5 - at[0])) as f32 }
        });
        let h = |p: Point| 0.01 + 0.05 * p.x;
        KdPartition::new(samples.collect(), Aabb::around([Point::ZERO, Point::ONE]), &h)
    }

    /// No two blocks that may be visited at the same time have a brick in common; returns the number of colors.
    fn colors(partition: &KdPartition, kind: usize) -> usize {
        let mut of_color = std::collections::BTreeMap::<u32, Vec<u32>>::new();
        for block in &partition.blocks {
            assert!(block.bricks.clone().all(|b| block.regions[kind].binary_search(&b).is_ok()));
            of_color.entry(block.color).or_default().extend(&block.regions[kind]);
        }
        for bricks in of_color.values_mut() {
            let n = bricks.len();
            bricks.sort_unstable();
            bricks.dedup();
            assert_eq!(bricks.len(), n, "blocks of one color share a brick");
        }
        of_color.len()
    }

    #[test]
    fn blocks_of_one_color_share_no_brick() {
        let context = RunContext::new(2, CancelToken::new());
        context.enter(|| {
            let mut partition = partition();
            assert!(partition.blocks.len() > 10, "{} blocks", partition.blocks.len());
            let wide = colors(&partition, 0);
            let next_to =
                |block: &Block| partition.around(&block.bounds, |b| block.bricks.contains(&b), 0.0);
            let needed = partition.blocks.iter().map(next_to).collect();
            let before: usize = partition.blocks.iter().map(|b| b.regions[1].len()).sum();
            partition.narrow(1, needed);
            assert!(partition.blocks.iter().map(|b| b.regions[1].len()).sum::<usize>() < before);
            let narrow = colors(&partition, 1);
            assert!((2..wide).contains(&narrow), "{narrow} colors, {wide} of the wide regions");
        });
    }

    #[test]
    fn each_place_is_in_one_brick() {
        let partition = RunContext::new(1, CancelToken::new()).enter(partition);
        for k in 0..1000u32 {
            let p =
                Point::from_array([7, 31, 113].map(|prime| f64::from(k * prime % 1000) / 1000.0));
            let brick = partition.find(p);
            let bounds = partition.bricks[brick as usize].0;
            assert!(bounds.low.cmple(p).all() && p.cmple(bounds.high).all());
            assert!(partition.blocks[partition.owner(brick) as usize].bricks.contains(&brick));
        }
    }
}
