//! Several attempts at the same patch.
//!
//! Where doubles leave little clearance, success depends on earlier flips and on the places of the first points. A
//! failed attempt writes nothing, so others can follow.

/// Parameters of one attempt at a patch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    /// Nesting depth of flips before a point is put, and the number of ring searches.
    pub flip_level: u32,
    pub flip_work: u32,
    /// A piece of a segment shorter than this share is used only when no other is found.
    pub piece_min: f64,
    /// First place of a point in its piece of a segment.
    pub lean: f64,
    /// Segments from their other ends, facets and vertices in the other order.
    pub reversed: bool,
    /// Vertices that leave the surface may go where no double is, until all have left.
    pub exact: bool,
}

/// From the cheapest on. The first ones recover all but a few of a hundred thousand random cuts. The exact ones recover
/// the rest, where doubles have an answer at all.
pub(super) const EFFORTS: [Effort; 13] = {
    let first = Effort {
        flip_level: 1,
        flip_work: 60,
        piece_min: 1e-12,
        lean: 0.5,
        reversed: false,
        exact: false,
    };
    let roomy = Effort { piece_min: 1e-3, ..first };
    let deep = Effort { flip_level: 3, flip_work: 1000, ..first };
    [
        first,
        Effort { reversed: true, ..first },
        roomy,
        Effort { reversed: true, ..roomy },
        deep,
        Effort { reversed: true, ..deep },
        Effort { lean: 0.1, ..first },
        Effort { lean: 0.9, ..first },
        Effort { lean: 0.1, reversed: true, ..deep },
        Effort { lean: 0.9, ..deep },
        Effort { exact: true, ..first },
        Effort { exact: true, reversed: true, ..deep },
        Effort { exact: true, lean: 0.1, ..roomy },
    ]
};
