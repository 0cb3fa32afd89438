//! Sizes along long edges and in large triangles.

use super::options::Targets;
use super::seeds::{EdgeSeed, Seeds};
use tetdb_base::geom::Point;
use tetdb_base::storage::{FrozenSpillVec, ScratchSpace, SpillVecBuilder};

/// An edge gets seeds when it is longer than this many of its ends' sizes. Edges of even surfaces are shorter, and their meshes stay the same;
/// other values were not tried.
const LONG_FROM: f64 = 2.0;
/// Seeds from one end of an edge to its middle at most, besides the seed there. At the steepest slope sizes grow 1.7
/// times from one to the next: sixteen reach 5,000 times the end's size. Beyond that, the averages between fill in.
const STEPS_MAX: u32 = 16;
/// Seeds kept for any surface; at most as many as it has vertices are added. If there would be more, their steps are
/// doubled.
const SEEDS_MIN: usize = 1 << 17;
/// Steps are not stretched further: each long edge has its middle then, and next to nothing else.
const STRETCH_MAX: f64 = 64.0;

/// An edge or a triangle's middle line in units of the cube's side: both ends, with their sizes and slopes.
struct Span {
    ends: [Point; 2],
    h: [f64; 2],
    slope_factor: [f64; 2],
    length: f64,
    slope: f64,
}

impl Span {
    /// The size a part `u` of the length from the first end.
    fn h_at(&self, u: f64) -> f64 {
        let [a, b] = self.h;
        let grown = |h: f64, share: f64| h + self.slope * share * self.length;
        grown(a, u).min(grown(b, 1.0 - u)).min(self.length)
    }

    /// Calls `place` with where seeds are, from each end towards the middle: the same places whichever end is first.
    fn each(&self, stretch: f64, mut place: impl FnMut(f64)) {
        for is_second in [false, true] {
            let [near, far] = match is_second {
                false => self.h,
                true => [self.h[1], self.h[0]],
            };
            let mut u = 0.0;
            for _ in 0..STEPS_MAX {
                let grown = near + self.slope * u * self.length;
                let bound = far + self.slope * (1.0 - u) * self.length;
                u += stretch * grown.min(bound).min(self.length) / self.length;
                // Half a step before the middle its own seed is near enough.
                if u + 0.5 * stretch * grown / self.length >= 0.5 {
                    break;
                }
                place(if is_second { 1.0 - u } else { u });
            }
        }
        place(0.5);
    }
}

/// Seeds of the edges and triangles that are long for the sizes at their corners; none on even surfaces.
///
/// `at_vertices`, in input units: no seed is above the interpolated values. Source of the rule: an experiment with
/// eleven surfaces from CAD programs; it left even surfaces unchanged.
pub(super) fn edge_seeds(
    seeds: &Seeds,
    triangles: &[[u32; 3]],
    targets: &Targets,
    at_vertices: Option<&[f64]>,
    scratch: &ScratchSpace,
) -> Option<FrozenSpillVec<EdgeSeed>> {
    let along = Along { seeds, slope: targets.beta * targets.slope_factor_max(), at_vertices };
    let most = (triangles.len() / 2).max(SEEDS_MIN);
    let mut stretch = 1.0;
    while stretch < STRETCH_MAX && along.count(triangles, stretch) > most {
        stretch *= 2.0;
    }
    let mut list = scratch.builder::<EdgeSeed>();
    for triangle in triangles {
        along.take(triangle, stretch, &mut list);
    }
    match list.is_empty() {
        true => None,
        false => Some(list.finish().freeze()),
    }
}

struct Along<'a> {
    seeds: &'a Seeds<'a>,
    /// With which sizes grow from an edge's ends.
    slope: f64,
    at_vertices: Option<&'a [f64]>,
}

impl Along<'_> {
    /// The long edges of a triangle that run from a lower to a higher number: one of the two triangles at each edge has it so.
    fn long_edges(&self, triangle: &[u32; 3]) -> impl Iterator<Item = ([u32; 2], Span)> {
        let edges = [0, 1, 2].map(|k| [triangle[k], triangle[(k + 1) % 3]]);
        edges.into_iter().filter_map(|edge| {
            let [v, w] = edge;
            if v > w {
                return None;
            }
            let ends = edge.map(|v| self.seeds.at(v));
            let h = edge.map(|v| self.seeds.h(v));
            let length = ends[0].distance(ends[1]);
            let span = Span {
                ends,
                h,
                slope_factor: edge.map(|v| self.seeds.slope_factor(v)),
                length,
                slope: self.slope,
            };
            (length > LONG_FROM * h[0].max(h[1])).then_some((edge, span))
        })
    }

    fn count(&self, triangles: &[[u32; 3]], stretch: f64) -> usize {
        let mut n = 0;
        for triangle in triangles {
            for (_, span) in self.long_edges(triangle) {
                span.each(stretch, |_| n += 1);
            }
        }
        n
    }

    fn take(&self, triangle: &[u32; 3], stretch: f64, list: &mut SpillVecBuilder<EdgeSeed>) {
        for (edge, span) in self.long_edges(triangle) {
            let [p, q] = span.ends;
            span.each(stretch, |u| {
                let between = |[a, b]: [f64; 2]| a + (b - a) * u;
                let h = self.lowered(span.h_at(u), edge, [1.0 - u, u]);
                list.push(seed(p + (q - p) * u, h, between(span.slope_factor)));
            });
        }
        self.take_middle(triangle, list);
    }

    /// The middle of a triangle all of whose corners are small for it.
    fn take_middle(&self, triangle: &[u32; 3], list: &mut SpillVecBuilder<EdgeSeed>) {
        let corners = triangle.map(|v| self.seeds.at(v));
        let h = triangle.map(|v| self.seeds.h(v));
        let [a, b, c] = corners;
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        if longest <= LONG_FROM * h[0].max(h[1]).max(h[2]) {
            return;
        }
        let middle = (a + b + c) / 3.0;
        let grown = (corners.iter().zip(h)).map(|(p, h)| h + self.slope * p.distance(middle));
        let least = grown.fold(longest, f64::min);
        let slope_factor = triangle.map(|v| self.seeds.slope_factor(v)).iter().sum::<f64>() / 3.0;
        let h = self.lowered(least, *triangle, [1.0 / 3.0; 3]);
        list.push(seed(middle, h, slope_factor));
    }

    /// A size between vertices that have sizes of their own.
    fn lowered<const N: usize>(&self, h: f64, vertices: [u32; N], shares: [f64; N]) -> f64 {
        let Some(given) = self.at_vertices else {
            return h;
        };
        let own = (vertices.iter().zip(shares)).map(|(&v, share)| share * given[v as usize]);
        h.min(own.sum::<f64>() / self.seeds.frame.side)
    }
}

fn seed(at: Point, h: f64, slope_factor: f64) -> EdgeSeed {
    [at.x, at.y, at.z, h, slope_factor].map(|x| x as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn span(h: [f64; 2], length: f64) -> Span {
        Span {
            ends: [Point::ZERO, Point::X * length],
            h,
            slope_factor: [1.0; 2],
            length,
            slope: 0.7,
        }
    }

    fn places(span: &Span) -> Vec<f64> {
        let mut places = Vec::new();
        span.each(1.0, |u| places.push(u));
        places.sort_unstable_by(f64::total_cmp);
        places
    }

    #[test]
    fn sizes_grow_from_both_ends_up_to_the_length() {
        let long = span([1e-4, 2e-3], 1.0);
        let h: Vec<f64> = places(&long).iter().map(|&u| long.h_at(u)).collect();
        assert!(h[0] < 3e-4 && h[h.len() - 1] < 4e-3, "{h:?}");
        let most = h.iter().copied().fold(0.0, f64::max);
        assert!(most > 0.3 && most <= 1.0, "{h:?}");
        let short = span([0.45, 0.4], 1.0);
        assert!(short.h_at(0.5) <= 1.0 && places(&short).contains(&0.5));
    }

    #[test]
    fn an_edge_and_its_reverse_have_the_same_seeds() {
        let (there, back) = (span([1e-3, 0.02], 1.0), span([0.02, 1e-3], 1.0));
        let (a, b) = (places(&there), places(&back));
        assert_eq!(a.len(), b.len());
        for (u, v) in a.iter().zip(b.iter().rev()) {
            assert!((u + v - 1.0).abs() < 1e-12 && (there.h_at(*u) - back.h_at(*v)).abs() < 1e-12);
        }
    }

    #[test]
    fn no_edge_has_more_seeds_than_its_steps() {
        assert_eq!(places(&span([1e-12, 1e-12], 1.0)).len(), 2 * STEPS_MAX as usize + 1);
    }
}
