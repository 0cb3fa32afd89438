//! Summarizes a field.

use std::collections::BTreeMap;

use super::constraint::SizeConstraint;
use super::field::SizeField;
use super::length::Length;
use super::options::{SizeOptions, Targets};
use super::seeds::Seeds;
use super::summary::{SizeRange, SizeSummary, SizeWarning};
use tetdb_base::geom::{Point, short};
use tetdb_base::storage::{OrRaise, ScratchSpace, sort_record};

impl SizeField {
    /// Summary of the field and the origin of its sizes. A scratch file that fails unwinds.
    pub(super) fn summary(
        &self,
        seeds: &Seeds,
        targets: &Targets,
        options: &SizeOptions,
        constraints: &[&dyn SizeConstraint],
        scratch: &ScratchSpace,
    ) -> SizeSummary {
        let side = self.frame.side;
        let all = seeds.vertices().map(|v| (seeds.h(v) * side, 1.0));
        let surface = weighted_range(all, scratch);
        let middles = self.tree.leaves().enumerate().map(|(i, leaf)| {
            let values = self.values.get(i);
            let mean = values.iter().map(|&h| f64::from(h)).sum::<f64>() / 8.0;
            let p = self.frame.low + (leaf.low() + Point::splat(0.5 * leaf.side())) * side;
            (self.of_sources(p).min(mean * side), leaf.side() * leaf.side() * leaf.side())
        });
        let with_sources = weighted_range(middles, scratch);
        let median = with_sources.median;
        let (low, mut high) = self.range();
        let cube = [self.frame.low, self.frame.low + Point::splat(side)];
        let middles = self.sources.iter().map(|s| s.middle().clamp(cube[0], cube[1]));
        let low = middles.map(|p| self.of_sources(p)).fold(low.min(with_sources.low), f64::min);
        if !self.sources.is_empty() {
            high = with_sources.high;
        }
        let wanted = [("hsiz", targets.hsiz), ("hmax", targets.hmax)];
        let warnings = wanted.into_iter().filter_map(|(option, wanted)| {
            let wanted = wanted?;
            if wanted < FAR_BELOW * surface.median {
                return Some(SizeWarning::FarBelowSurface {
                    option,
                    wanted,
                    surface_median: surface.median,
                    away: (surface.median - wanted) / targets.beta,
                });
            }
            // An upper bound that nothing comes near is no disappointment.
            let is_far_above = option == "hsiz" && wanted > FAR_ABOVE * high;
            is_far_above.then_some(SizeWarning::NeverReached { option, wanted, most: high })
        });
        let warnings = warnings.chain(self.far_below_edges(seeds, options, constraints));
        SizeSummary {
            source: describe_source(options, targets),
            surface,
            field: SizeRange { low, median, high },
            beta: targets.beta,
            n_leaves: self.n_leaves(),
            bytes: self.bytes(),
            warnings: warnings.collect(),
        }
    }

    /// The least size that shapes ask for at a position.
    fn of_sources(&self, p: Point) -> f64 {
        self.sources.iter().map(|source| source.h(p, self.beta)).fold(f64::INFINITY, f64::min)
    }

    /// One warning for each kind of shape, formula and file: the vertex where the wanted size is the least share of the edges.
    fn far_below_edges(
        &self,
        seeds: &Seeds,
        options: &SizeOptions,
        constraints: &[&dyn SizeConstraint],
    ) -> Vec<SizeWarning> {
        let mut worst = BTreeMap::<&'static str, (f64, SizeWarning)>::new();
        let mut look = |option, wanted: f64, edges: f64, at: Point| {
            let share = wanted / edges;
            if share < FAR_BELOW && worst.get(option).is_none_or(|(least, _)| share < *least) {
                let warning =
                    SizeWarning::FarBelowEdges { option, wanted, edges, at: at.to_array() };
                worst.insert(option, (share, warning));
            }
        };
        let step = seeds.h.len().div_ceil(VERTICES_ASKED).max(1);
        for v in seeds.vertices() {
            let (p, edges) = (seeds.points[v as usize], seeds.h(v) * self.frame.side);
            for (asked, source) in options.sources.iter().zip(&self.sources) {
                look(asked.option(), source.h(p, self.beta), edges, p);
            }
            for constraint in constraints.iter().filter(|_| (v as usize).is_multiple_of(step)) {
                if let (Some(option), Ok(wanted)) = (constraint.option(), constraint.h(p)) {
                    look(option, wanted, edges, p);
                }
            }
        }
        worst.into_values().map(|(_, warning)| warning).collect()
    }
}

sort_record! {
    /// A number and its weight.
    struct Weighted {
        x: f64,
        weight: f64,
    }
}

/// Lowest, weighted median and highest of a list of positive numbers with weights that is not empty.
fn weighted_range(list: impl Iterator<Item = (f64, f64)>, scratch: &ScratchSpace) -> SizeRange {
    let mut sorter = scratch.sorter::<Weighted>();
    let mut total = 0.0;
    for (x, weight) in list {
        total += weight;
        sorter.push(Weighted { x, weight }).or_raise();
    }
    let mut sum = 0.0;
    let mut range = SizeRange { low: f64::INFINITY, median: f64::NAN, high: 0.0 };
    for next in sorter.finish().or_raise() {
        let Weighted { x, weight } = next.or_raise();
        let is_below = sum < 0.5 * total;
        sum += weight;
        if is_below && sum >= 0.5 * total {
            range.median = x;
        }
        (range.low, range.high) = (range.low.min(x), x);
    }
    range
}

/// Below this share of the surface's median edge, an interior size is warned about: the surface is
/// not divided, so that large triangles would stand against small tetrahedra.
const FAR_BELOW: f64 = 0.4;

/// Vertices at which formulas and files are compared with the edges, about: some 10 ms. With few, a small place is missed.
const VERTICES_ASKED: usize = 1 << 16;

/// A wanted size above this multiple of the field's longest length is warned about: it has no effect, and is often in
/// another unit.
const FAR_ABOVE: f64 = 4.0;

fn plural(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

fn describe_source(options: &SizeOptions, targets: &Targets) -> String {
    let mut parts = Vec::new();
    let named = [
        ("hsiz", options.hsiz, targets.hsiz),
        ("hmin", options.hmin, targets.hmin),
        ("hmax", options.hmax, targets.hmax),
    ];
    for (name, asked, length) in named {
        match (asked, length) {
            (Some(Length::Percent(share)), Some(h)) => {
                parts.push(format!("{name} {share}% = {}", short(h)));
            }
            (Some(_), Some(h)) => parts.push(format!("{name} {h}")),
            _ => {}
        }
    }
    if !options.sources.is_empty() {
        parts.push(plural(options.sources.len(), "shape"));
    }
    if !options.regions.is_empty() {
        parts.push(plural(options.regions.len(), "region"));
    }
    if !options.labels.is_empty() {
        parts.push(plural(options.labels.len(), "label"));
    }
    if options.formula.is_some() {
        parts.push("size_expr".to_owned());
    }
    parts.push("the surface's edges".to_owned());
    format!("{}, hgrad {}", parts.join(", "), options.gradation())
}
