//! What tetrahedra lack: a measure in which one that nothing can mend does not hide the others.
//!
//! The worst goodness of a ball or shell says nothing of the rest. Where a needle of the surface makes one of them bad for ever, all
//! that touch it would stay as they are. Here each bad one counts as one and what it lacks, and their sum has to fall.

use crate::mesh::{Mesh, Tet};
use tetdb_base::shape::{INVERSE_QUALITY_WANTED, inverse_quality};
use tetdb_base::storage::Pages;

/// What a bad tetrahedron costs besides the goodness it lacks (at most 0.5). With 0.25, a few are made a little better rather than one good
/// (`plate_holes.stl`: 57.1 % of q in [1,2[ in place of 58.5 %).
const EACH: f64 = 1.0;
/// What one of q ≥ 10 costs besides: it is worth some others that are just bad (`cheese.off`: 2,980 of q ≥ 10 without, 1,652 with it). With 8, fewer of
/// q < 2 are left on thin walls.
const POOR: f64 = 4.0;
/// The least gain of a change. Smaller ones are worth nothing and keep queues full.
pub(super) const GAIN: f64 = 0.02;
/// What may become worse as long as it is above this: q = 3.5. At q = 3 most vertices that crowd a thin tube stay in each other's way
/// (`hilbert.off`: 41.6 % of all tetrahedra in [1,2[ in place of 51.7 %); without any bound, the worst get worse.
const TRADED: f64 = 1.0 / 3.5;

/// What a set of tetrahedra lacks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Deficit {
    /// At most zero.
    pub(super) sum: f64,
    pub(super) worst: f64,
}

/// What must not be made: a tetrahedron worse than both the worst before and [`TRADED`].
#[derive(Clone, Copy, Debug)]
pub(super) struct AcceptanceFloor(f64);

impl Default for Deficit {
    /// Of no tetrahedra.
    fn default() -> Self {
        Self { sum: 0.0, worst: f64::INFINITY }
    }
}

impl Deficit {
    /// Counts a tetrahedron of that goodness.
    pub(super) fn add(&mut self, good: f64) {
        self.sum += worth(good);
        self.worst = self.worst.min(good);
    }

    /// Of these tetrahedra.
    pub(super) fn of<P: Pages>(mesh: &mut Mesh<P>, records: &[Tet]) -> Self {
        let mut deficit = Self::default();
        for record in records {
            deficit.add(inverse_quality(mesh.points(record)));
        }
        deficit
    }

    /// The bar for what takes their place.
    pub(super) fn bar(&self) -> AcceptanceFloor {
        AcceptanceFloor(self.worst.clamp(0.0, TRADED))
    }
}

impl AcceptanceFloor {
    /// A bar that is no lower than `least`.
    pub(super) fn at_least(self, least: f64) -> Self {
        Self(self.0.max(least))
    }

    /// What a new tetrahedron adds to the sum: zero for a good one, `f64::NEG_INFINITY` for one that must not be made.
    #[inline]
    pub(super) fn worth(self, good: f64) -> f64 {
        if good < self.0 { f64::NEG_INFINITY } else { worth(good) }
    }
}

#[inline]
fn worth(good: f64) -> f64 {
    if good >= INVERSE_QUALITY_WANTED {
        0.0
    } else if good > 0.1 {
        good - INVERSE_QUALITY_WANTED - EACH
    } else {
        good - INVERSE_QUALITY_WANTED - EACH - POOR
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fewer_bad_ones_count_more_than_better_ones() {
        let of = |list: &[f64]| {
            let mut deficit = Deficit::default();
            list.iter().for_each(|&good| deficit.add(good));
            deficit
        };
        // A hopeless one beside another that is mended.
        let (before, after) = (of(&[0.05, 0.4]), of(&[0.05, 0.6]));
        assert!(after.sum > before.sum + GAIN && after.worst == before.worst);
        // One just bad is better than two, however near these are.
        assert!(of(&[0.3, 0.6]).sum > of(&[0.49, 0.49]).sum);
        assert_eq!(of(&[0.5, 1.0]).sum, 0.0);
        // One of q ≥ 10 is worth some that are just bad.
        assert!(of(&[0.11, 0.4, 0.4, 0.4]).sum > of(&[0.09, 0.6, 0.6, 0.6]).sum);
        // What was worse may stay as bad, never fall.
        let bar = before.bar();
        assert!(bar.worth(0.05).is_finite() && bar.worth(0.049) == f64::NEG_INFINITY);
        assert_eq!(of(&[0.4]).bar().worth(0.2), f64::NEG_INFINITY);
        assert!(of(&[0.4]).bar().worth(0.29).is_finite());
        assert_eq!(bar.at_least(0.1).worth(0.09), f64::NEG_INFINITY);
        // Not positive, even where there was no volume before.
        assert_eq!(of(&[0.0]).bar().worth(f64::NEG_INFINITY), f64::NEG_INFINITY);
    }
}
