//! The summary of sizes for the user.

use std::fmt;

use tetdb_base::geom::short;

/// Lowest, median and highest of some lengths, in input units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizeRange {
    /// The least length.
    pub low: f64,
    /// The median length.
    pub median: f64,
    /// The greatest length.
    pub high: f64,
}

/// Origin and range of sizes.
#[derive(Clone, Debug, PartialEq)]
pub struct SizeSummary {
    /// Options in effect, in words.
    pub source: String,
    /// Sizes of the surface's vertices: means of their edges' lengths.
    pub surface: SizeRange,
    /// Sizes of the field; the median is by volume of the surface's cube, not of the domain.
    pub field: SizeRange,
    /// Slope bound, `ln(hgrad)`.
    pub beta: f64,
    /// Leaves of the octree.
    pub n_leaves: usize,
    /// Memory of the field in bytes.
    pub bytes: usize,
    /// Surprising consequences of the options.
    pub warnings: Vec<SizeWarning>,
}

/// A consequence of the options that may surprise the user.
#[derive(Clone, Debug, PartialEq)]
pub enum SizeWarning {
    /// The wanted interior size is far below the surface's edges, which are kept.
    FarBelowSurface {
        /// The option that sets the size.
        option: &'static str,
        /// The size it sets.
        wanted: f64,
        /// Median size of the surface.
        surface_median: f64,
        /// Distance from edges of that length at which the gradation lets sizes come down to it.
        away: f64,
    },
    /// A size wanted at a place of the surface is far below its edges there, which are kept.
    FarBelowEdges {
        /// The option that asks for the size.
        option: &'static str,
        /// The size wanted there.
        wanted: f64,
        /// Mean length of the edges at the place.
        edges: f64,
        /// The place.
        at: [f64; 3],
    },
    /// The wanted interior size is longer than the gradation lets sizes grow within the surface.
    NeverReached {
        /// The option that sets the size.
        option: &'static str,
        /// The size it sets.
        wanted: f64,
        /// The longest that comes out.
        most: f64,
    },
}

impl SizeWarning {
    /// The option that asks for the size.
    pub fn option(&self) -> &'static str {
        match self {
            Self::FarBelowSurface { option, .. }
            | Self::FarBelowEdges { option, .. }
            | Self::NeverReached { option, .. } => option,
        }
    }

    /// Whether dividing the surface's triangles first would help.
    pub fn needs_finer_surface(&self) -> bool {
        !matches!(self, Self::NeverReached { .. })
    }

    /// The sentence behind the option.
    pub fn detail(&self) -> String {
        match self {
            Self::FarBelowSurface { wanted, surface_median, away, .. } => format!(
                "{} is far below the surface's edges, which are kept: next to them edges of tetrahedra stay near the median of {}, and \
                 reach {} only {} or more away from them",
                short(*wanted),
                short(*surface_median),
                short(*wanted),
                short(*away)
            ),
            Self::FarBelowEdges { wanted, edges, at, .. } => format!(
                "{} is far below the surface's edges, which are kept: they are about {} long at ({}), and tetrahedra on them are badly shaped",
                short(*wanted),
                short(*edges),
                at.map(short).join(", ")
            ),
            Self::NeverReached { wanted, most, .. } => format!(
                "{} is never reached: from the surface's edges lengths grow to {} at most (hgrad says how fast); is it in the surface's unit?",
                short(*wanted),
                short(*most)
            ),
        }
    }
}

impl fmt::Display for SizeWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.option(), self.detail())?;
        match self.needs_finer_surface() {
            true => f.write_str("; refine the surface first"),
            false => Ok(()),
        }
    }
}

impl fmt::Display for SizeSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let SizeRange { low, median, high } = self.surface;
        write!(
            f,
            "sizes from {}; surface median {} ({} to {}), wanted inside its box {} ({} to {})",
            self.source,
            short(median),
            short(low),
            short(high),
            short(self.field.median),
            short(self.field.low),
            short(self.field.high)
        )
    }
}
