//! The same patch tried in several ways.
//!
//! Where doubles leave little room, it depends on what was flipped before and where the first points went whether the last
//! one finds a place. Nothing of a failed attempt is written, so others can follow.

/// One way to work on a patch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    /// How deep flips nest before a point is put, and how many ring searches they may take.
    pub flip_level: u32,
    pub flip_work: u32,
    /// A piece of a segment shorter than this share is used only when no other is found.
    pub piece_min: f64,
    /// Where in its piece of a segment a point goes first.
    pub lean: f64,
    /// Segments from their other ends, facets and vertices in the other order.
    pub reversed: bool,
}

/// From the cheapest on. Of a hundred thousand random cuts, all but some seven are recovered by one of them; in all but one of
/// those, triangles are nearer to each other than the last bits of their coordinates.
pub(super) const EFFORTS: [Effort; 10] = {
    let first = Effort {
        flip_level: 1,
        flip_work: 60,
        piece_min: 1e-12,
        lean: 0.5,
        reversed: false,
    };
    let roomy = Effort {
        piece_min: 1e-3,
        ..first
    };
    let deep = Effort {
        flip_level: 3,
        flip_work: 1000,
        ..first
    };
    [
        first,
        Effort {
            reversed: true,
            ..first
        },
        roomy,
        Effort {
            reversed: true,
            ..roomy
        },
        deep,
        Effort {
            reversed: true,
            ..deep
        },
        Effort { lean: 0.1, ..first },
        Effort { lean: 0.9, ..first },
        Effort {
            lean: 0.1,
            reversed: true,
            ..deep
        },
        Effort { lean: 0.9, ..deep },
    ]
};
