//! The sub-domain of each tetrahedron: by planes across the axes of inertia, each dividing the tetrahedra as the tree of sub-domains wants.
//!
//! The planes come from a sample of centroids that depends on the mesh alone. A tetrahedron goes to the side of its centroid.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use tetdb_base::geom::{Point, lex_cmp};
use tetdb_kernel::bisect::principal_axes;
use tetdb_schema::tree::RankRange;

/// Most centroids in the sample: 12 MB. With fewer, sub-domains of 10 M tetrahedra would differ by more than a hundredth.
pub const SAMPLE_MAX: u64 = 1 << 19;

/// Planes by the number of their cut.
pub struct Planes {
    n: u32,
    /// The axis, and the first centroid on the high side.
    planes: BTreeMap<u32, (Point, Point)>,
}

impl Planes {
    /// Planes for `n` sub-domains of such centroids. Effects: the sample is reordered.
    pub fn new(n: u32, sample: &mut [Point]) -> Self {
        let mut planes = Self { n, planes: BTreeMap::new() };
        planes.divide(RankRange::root(n), sample);
        planes
    }

    fn divide(&mut self, range: RankRange, sample: &mut [Point]) {
        if range.count == 1 {
            return;
        }
        let axis = axis(sample);
        let at = sample.len() as u64 * u64::from(range.count / 2) / u64::from(range.count);
        let (low, high) = match (at as usize) < sample.len() {
            true => {
                sample.select_nth_unstable_by(at as usize, |a, b| order(axis, a, b));
                self.planes.insert(range.cut(), (axis, sample[at as usize]));
                sample.split_at_mut(at as usize)
            }
            false => {
                self.planes.insert(range.cut(), (axis, Point::ZERO));
                (sample, &mut [][..])
            }
        };
        let [below, above] = range.children();
        self.divide(below, low);
        self.divide(above, high);
    }

    /// The sub-domain of a centroid.
    pub fn part(&self, centroid: Point) -> u32 {
        let mut range = RankRange::root(self.n);
        while range.count > 1 {
            let (axis, first) = self.planes[&range.cut()];
            let [low, high] = range.children();
            range = if order(axis, &centroid, &first).is_lt() { low } else { high };
        }
        range.first
    }
}

/// Along an axis; ties by coordinates.
fn order(axis: Point, a: &Point, b: &Point) -> Ordering {
    axis.dot(*a).total_cmp(&axis.dot(*b)).then_with(|| lex_cmp(*a, *b))
}

/// The axis of the largest inertia.
fn axis(points: &[Point]) -> Point {
    let n = points.len().max(1) as f64;
    let middle = points.iter().sum::<Point>() / n;
    let mut m = [[0.0; 3]; 3];
    for p in points {
        let d = (*p - middle).to_array();
        for (i, row) in m.iter_mut().enumerate() {
            (0..3).for_each(|j| row[j] += d[i] * d[j] / n);
        }
    }
    principal_axes(&m)[0]
}

/// The cut that separates two sub-domains of `n`.
pub fn cut_between(n: u32, a: u32, b: u32) -> u32 {
    let mut range = RankRange::root(n);
    loop {
        let [low, high] = range.children();
        match (a < high.first, b < high.first) {
            (true, true) => range = low,
            (false, false) => range = high,
            _ => return range.cut(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_share_a_cloud_and_cuts_separate() {
        let point =
            |i: u32| Point::new(f64::from(i % 40), f64::from(i / 40 % 7), f64::from(i / 280));
        for n in [1, 2, 3, 7] {
            let mut sample: Vec<Point> = (0..2000).map(point).collect();
            let planes = Planes::new(n, &mut sample);
            let mut counts = vec![0; n as usize];
            (0..2000).for_each(|i| counts[planes.part(point(i)) as usize] += 1);
            assert!(counts.iter().all(|&k| k > 1000 / n), "{n}: {counts:?}");
            for (a, b) in (0..n).flat_map(|b| (0..b).map(move |a| (a, b))) {
                let cut = cut_between(n, a, b);
                assert!(a < cut && cut <= b);
            }
        }
        assert!(Planes::new(3, &mut []).part(Point::ONE) < 3);
    }
}
