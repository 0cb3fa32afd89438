//! Sort records of imports.

use tetdb_base::storage::sort_record;

sort_record! {
    /// A tetrahedron of a sub-domain.
    pub struct PartTet {
        pub part: u32,
        /// Rotated so that the least comes first.
        pub nodes: [u32; 4],
        pub region: u32,
        /// Its number in the file.
        pub tet: u32,
    }
}

sort_record! {
    /// A vertex of a sub-domain.
    pub struct PartVertex {
        pub part: u32,
        pub vertex: u32,
    }
}

sort_record! {
    /// A sub-domain that a vertex is in beside its first.
    pub struct SharedVertex {
        pub vertex: u32,
        pub part: u32,
    }
}

sort_record! {
    /// A triangle of the file, or a side of a face.
    pub struct FaceSide {
        /// Ascending.
        pub face: [u32; 3],
        pub is_tet: bool,
        /// True if the ascending order is odd in the tetrahedron.
        pub odd: bool,
        /// Label of a triangle; 4 · tetrahedron + face.
        pub of: u32,
    }
}

sort_record! {
    /// A tetrahedron with a face that is kept.
    pub struct TetSide {
        pub part: u32,
        pub nodes: [u32; 4],
        /// Number of the face.
        pub kept: u32,
        /// True for the tetrahedron that the face's normal points away from.
        pub behind: bool,
    }
}

sort_record! {
    /// A side of a kept face in its sub-domain.
    pub struct KeptSide {
        /// Numbers in the sub-domain, ascending.
        pub face: [u32; 3],
        pub kept: u32,
        pub behind: bool,
        pub tet: u32,
    }
}
