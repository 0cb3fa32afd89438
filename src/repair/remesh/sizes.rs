//! Wanted edge lengths: the least over all sources, each growing with the distance from its place.

use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::ScratchSpace;
use tetdb_base::surface::BoxTree;

/// A place and the length wanted there.
pub type Source = (Point, f64);

/// Wanted lengths everywhere.
///
/// Invariant: the length changes by at most `growth` times the distance, and lies between `least` and `most`.
pub struct Sizes<'a> {
    sources: Vec<Source>,
    tree: Option<BoxTree>,
    /// Least length of each node of the tree, by level.
    lows: Vec<Vec<f64>>,
    growth: f64,
    least: f64,
    most: f64,
    /// The most at a place.
    most_at: &'a (dyn Fn(Point) -> f64 + Sync),
}

impl<'a> Sizes<'a> {
    /// Lengths from sources.
    pub fn new(
        sources: Vec<Source>,
        growth: f64,
        [least, most]: [f64; 2],
        most_at: &'a (dyn Fn(Point) -> f64 + Sync),
        scratch: &ScratchSpace,
    ) -> Self {
        let sources = thinned(sources);
        let bounds = Aabb::around(sources.iter().map(|s| s.0));
        let box_of = |i: u32| Aabb::around([sources[i as usize].0]);
        let tree = (!sources.is_empty())
            .then(|| BoxTree::new(&bounds, sources.len() as u32, scratch, |_| true, box_of));
        let mut lows: Vec<Vec<f64>> = Vec::new();
        for (level, nodes) in tree.iter().flat_map(|t| &t.levels).enumerate() {
            let tree = tree.as_ref().expect("it has levels");
            let low = |node| match level {
                0 => tree
                    .members(node)
                    .map(|i| sources[tree.order.get(i) as usize].1)
                    .fold(f64::INFINITY, f64::min),
                _ => tree
                    .children(level, node)
                    .map(|c| lows[level - 1][c])
                    .fold(f64::INFINITY, f64::min),
            };
            let of_level = (0..nodes.len()).map(low).collect();
            lows.push(of_level);
        }
        Self { sources, tree, lows, growth, least, most, most_at }
    }

    /// The wanted length at a place.
    pub fn at(&self, p: Point) -> f64 {
        self.near(p, std::iter::empty())
    }

    /// The same, quicker with places nearby whose lengths are known.
    pub fn near(&self, p: Point, known: impl Iterator<Item = Source>) -> f64 {
        let bounds = known.map(|(q, h)| h + self.growth * p.distance(q));
        let mut best = bounds.fold(self.most.min((self.most_at)(p)), f64::min);
        let Some(tree) = &self.tree else { return best.max(self.least) };
        let bound = |level: usize, node: usize| {
            let b = tree.levels[level].get(node);
            let away = (b.low - p).max(p - b.high).max(Point::ZERO).length();
            self.lows[level][node] + self.growth * away
        };
        let top = tree.levels.len() - 1;
        let mut stack = vec![(top, 0, bound(top, 0))];
        while let Some((level, node, low)) = stack.pop() {
            if low >= best {
                continue;
            }
            if level == 0 {
                for i in tree.members(node) {
                    let (at, h) = self.sources[tree.order.get(i) as usize];
                    best = best.min(h + self.growth * at.distance(p));
                }
                continue;
            }
            let from = stack.len();
            stack.extend(tree.children(level, node).map(|c| (level - 1, c, bound(level - 1, c))));
            stack[from..].sort_by(|a, b| b.2.total_cmp(&a.2));
        }
        best.max(self.least)
    }
}

/// The sources without those that another one in the same small cell makes needless.
fn thinned(mut sources: Vec<Source>) -> Vec<Source> {
    sources.retain(|s| s.1.is_finite() && s.1 > 0.0);
    let cell = |&(p, h): &Source| {
        let level = h.log2().floor();
        let size = level.exp2() * 0.5;
        let [x, y, z] = (p / size).floor().to_array();
        [level as i64, x as i64, y as i64, z as i64]
    };
    let key = |s: &Source| (cell(s), s.1.to_bits());
    sources.sort_by_cached_key(key);
    sources.dedup_by(|b, a| cell(a) == cell(b));
    sources
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_grow_from_the_sources_up_to_the_most() {
        let sources = vec![(Point::ZERO, 0.1), (Point::X * 10.0, 0.5), (Point::X * 0.01, 0.3)];
        let sizes =
            Sizes::new(sources, 0.25, [0.01, 1.0], &|_| f64::INFINITY, &ScratchSpace::boundless());
        assert_eq!(sizes.at(Point::ZERO), 0.1);
        assert!((sizes.at(Point::Y) - 0.35).abs() < 1e-12);
        assert!((sizes.at(Point::X * 9.0) - 0.75).abs() < 1e-12);
        assert_eq!(sizes.at(Point::Y * 100.0), 1.0);
    }
}
