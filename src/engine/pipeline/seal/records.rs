//! Sort records of sealing.

use tetdb_base::storage::sort_record;

sort_record! {
    /// A tetrahedron under its new numbers.
    pub struct TetRecord {
        /// Rotated so that the least comes first.
        pub nodes: [u32; 4],
        pub region: u32,
        pub flags: u32,
        /// Bit i: face i is required.
        pub required: u8,
    }
}

sort_record! {
    /// A required face of a tetrahedron.
    pub struct RequiredTetFace {
        /// Ascending.
        pub vertices: [u32; 3],
        pub tet: u32,
        /// True if the ascending order is odd in the tetrahedron.
        pub odd: bool,
    }
}

sort_record! {
    /// A facet or an interface face, which is a required face of its tetrahedra.
    pub struct InputFace {
        /// Ascending.
        pub vertices: [u32; 3],
        /// True for an interface face, false for a facet. Both facets of a wall given from both sides come before any interface face.
        pub at_interface: bool,
        pub number: u32,
        /// True if the ascending order is odd in the facet or interface face.
        pub odd: bool,
    }
}

sort_record! {
    /// A face of a tetrahedron.
    pub struct SortedTetFace {
        /// Ascending.
        pub vertices: [u32; 3],
        /// 4 · tetrahedron + face.
        pub place: u32,
    }
}

sort_record! {
    /// Two sides of a face, each as 4 · tetrahedron + face.
    pub struct NeighborLink {
        pub from: u32,
        pub to: u32,
    }
}
