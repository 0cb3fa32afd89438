//! What shapes a mesh, besides its sizes.

/// Which regions that the surface encloses are filled with tetrahedra.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Regions {
    /// Those that an odd number of shells separates from the outside.
    #[default]
    Parity,
    /// Every bounded region.
    All,
    /// Those that touch the outer shells from inside.
    Outer,
    /// What the triangles' front sides turn away from.
    ByOrientation,
    /// Those of [`Mesher::region_seed`](super::Mesher::region_seed); where only holes are given, all others.
    Seeds,
}

/// How far tetrahedra are improved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Optimize {
    /// Not at all: the constrained Delaunay mesh.
    None,
    /// As far as the mesh stays Delaunay.
    Delaunay,
    /// Flips, smoothing and everything else.
    #[default]
    Full,
}

/// How finished sub-domains are kept; it does not shape the mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Seal {
    /// Sorted and compressed.
    #[default]
    Packed,
    /// As working pages, twelve times as large.
    None,
}

/// Into how many sub-domains the mesh is divided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Subdomains {
    /// One for each two million predicted tetrahedra; above 64 million there are 32, which grow to four million each.
    #[default]
    Auto,
    /// So many, from 1; fewer where they would have less than 25,000 tetrahedra.
    Exactly(u32),
}

impl Regions {
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Parity => "parity",
            Self::All => "all",
            Self::Outer => "outer",
            Self::ByOrientation => "by-orientation",
            Self::Seeds => "seeds",
        }
    }
}

impl Optimize {
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Delaunay => "delaunay",
            Self::Full => "full",
        }
    }
}

impl Seal {
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Packed => "packed",
            Self::None => "none",
        }
    }
}
