//! What a user is told about sizes.

use super::field::SizeField;
use super::options::{Length, SizeOptions, Targets};
use super::seeds::Seed;
use std::fmt;

/// Below this share of the surface's median edge, an interior size is warned about: the surface is
/// not divided, so that large triangles would stand against small tetrahedra.
const FAR_BELOW: f64 = 0.4;

/// Lowest, median and highest of some lengths, in input units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    pub low: f64,
    pub median: f64,
    pub high: f64,
}

/// Where sizes came from and what they are.
#[derive(Clone, Debug, PartialEq)]
pub struct SizeSummary {
    /// Options in effect, in words.
    pub source: String,
    /// Sizes of the surface's vertices: means of their edges' lengths.
    pub surface: Range,
    /// Sizes of the field; the median is by volume of the surface's cube, not of the domain.
    pub field: Range,
    /// Slope bound, `ln(hgrad)`.
    pub beta: f64,
    pub n_leaves: usize,
    pub bytes: usize,
    pub warnings: Vec<SizeWarning>,
}

/// What will not come out as the user may expect.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum SizeWarning {
    /// The wanted interior size is far below the surface's edges, which are kept.
    FarBelowSurface {
        option: &'static str,
        wanted: f64,
        surface_median: f64,
    },
}

impl fmt::Display for SizeWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::FarBelowSurface {
                option,
                wanted,
                surface_median,
            } => write!(
                f,
                "{option} {wanted:.4} is far below the surface's edges (median {surface_median:.4}), which are kept: \
                 near the surface tetrahedra stay large; refine the surface first"
            ),
        }
    }
}

impl fmt::Display for SizeSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Range { low, median, high } = self.surface;
        write!(
            f,
            "sizes from {}; surface median {median:.4} ({low:.4} to {high:.4}), volume median {:.4} ({:.4} to {:.4})",
            self.source, self.field.median, self.field.low, self.field.high
        )
    }
}

pub(super) fn of(
    field: &SizeField,
    seeds: &[Seed],
    targets: &Targets,
    options: &SizeOptions,
) -> SizeSummary {
    let side = field.frame.side;
    let surface = weighted_range(seeds.iter().map(|s| (s.h * side, 1.0)).collect());
    let leaves = field.tree.leaves();
    let middles = leaves.iter().zip(&field.values).map(|(leaf, values)| {
        let mean = values.iter().map(|&h| f64::from(h)).sum::<f64>() / 8.0;
        (mean * side, leaf.side() * leaf.side() * leaf.side())
    });
    let (low, high) = field.range();
    let median = weighted_range(middles.collect()).median;
    let wanted = [("--hsiz", targets.hsiz), ("--hmax", targets.hmax)];
    let warnings = wanted.into_iter().filter_map(|(option, wanted)| {
        let wanted = wanted.filter(|&h| h < FAR_BELOW * surface.median)?;
        Some(SizeWarning::FarBelowSurface {
            option,
            wanted,
            surface_median: surface.median,
        })
    });
    SizeSummary {
        source: source_of(options, targets),
        surface,
        field: Range { low, median, high },
        beta: targets.beta,
        n_leaves: field.n_leaves(),
        bytes: field.bytes(),
        warnings: warnings.collect(),
    }
}

/// Lowest, weighted median and highest of a list that is not empty.
fn weighted_range(mut list: Vec<(f64, f64)>) -> Range {
    list.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let total: f64 = list.iter().map(|x| x.1).sum();
    let mut sum = 0.0;
    let middle = list.iter().find(|x| {
        sum += x.1;
        sum >= 0.5 * total
    });
    let value = |x: Option<&(f64, f64)>| x.map_or(0.0, |x| x.0);
    Range {
        low: value(list.first()),
        median: value(middle),
        high: value(list.last()),
    }
}

fn source_of(options: &SizeOptions, targets: &Targets) -> String {
    let mut parts = Vec::new();
    let named = [
        ("--hsiz", options.hsiz, targets.hsiz),
        ("--hmin", options.hmin, targets.hmin),
        ("--hmax", options.hmax, targets.hmax),
    ];
    for (name, asked, length) in named {
        match (asked, length) {
            (Some(Length::Percent(share)), Some(h)) => {
                parts.push(format!("{name} {share}% = {h:.4}"));
            }
            (Some(_), Some(h)) => parts.push(format!("{name} {h}")),
            _ => {}
        }
    }
    if !options.sources.is_empty() {
        parts.push(format!("{} shapes", options.sources.len()));
    }
    if !options.regions.is_empty() {
        parts.push(format!("{} regions", options.regions.len()));
    }
    if options.formula.is_some() {
        parts.push("--size-expr".to_owned());
    }
    parts.push("the surface's edges".to_owned());
    format!("{}, --hgrad {}", parts.join(", "), options.hgrad)
}
