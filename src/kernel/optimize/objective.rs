//! What makes one change around a bad tetrahedron better than another: the search for it is the same.

use super::deficit::{AcceptanceFloor, Deficit, GAIN};
use super::smooth::raised;
use crate::mesh::{Mesh, Tet};
use crate::reconnect::{Forced, RingTriangulation};
use tetdb_base::geom::Point;
use tetdb_base::shape::inverse_quality;
use tetdb_base::storage::Pages;

/// A measure of changes: a number for new tetrahedra together, and what it must exceed.
///
/// A search begins with [`Objective::least`], the first bar of all, and raises it by what it finds.
pub(super) trait Objective {
    /// What is known of the tetrahedra that a change takes away.
    type Old: Copy;
    /// The number for no tetrahedra.
    const NOTHING: f64;

    /// What a change must be worth at least, around a bad tetrahedron of goodness `own`.
    fn least(own: f64) -> f64;
    /// Looks at what a change takes away.
    fn old<P: Pages>(mesh: &mut Mesh<P>, records: &[Tet]) -> Self::Old;
    /// The number that new tetrahedra must exceed for their change to be worth more than `best`.
    fn floor(old: Self::Old, best: f64) -> f64;
    /// What a change is worth whose new tetrahedra have this number.
    fn worth(old: Self::Old, number: f64) -> f64;
    /// The number with one more tetrahedron, of goodness `good`.
    fn with(old: Self::Old, number: f64, good: f64) -> f64;
    /// Whether `n_new` tetrahedra of this number may take the place of `n_old`, where vertices go.
    fn allows(old: Self::Old, n_old: usize, number: f64, n_new: usize) -> bool;
    /// The triangulation of a ring of `n` vertices with the highest number above `floor`; the number is its `worst`.
    fn solve(
        triangulation: &mut RingTriangulation,
        n: usize,
        floor: f64,
        cone: impl FnMut(usize, usize, usize) -> f64,
    ) -> bool;

    /// The number of these tetrahedra, or any number of at most `floor` once it is not above `floor`.
    #[inline(always)]
    fn number(old: Self::Old, floor: f64, tets: impl IntoIterator<Item = [Point; 4]>) -> f64 {
        let mut number = Self::NOTHING;
        for points in tets {
            number = Self::with(old, number, inverse_quality(points));
            if number <= floor {
                break;
            }
        }
        number
    }
}

/// By the worst goodness of all. What is taken away holds the bad tetrahedron, hence is no better than it.
#[derive(Default)]
pub(super) struct Worst;

impl Objective for Worst {
    type Old = ();
    const NOTHING: f64 = f64::INFINITY;

    fn least(own: f64) -> f64 {
        raised(own)
    }

    #[inline(always)]
    fn old<P: Pages>(_: &mut Mesh<P>, _: &[Tet]) {}

    #[inline(always)]
    fn floor((): (), best: f64) -> f64 {
        best
    }

    #[inline(always)]
    fn worth((): (), number: f64) -> f64 {
        number
    }

    #[inline(always)]
    fn with((): (), number: f64, good: f64) -> f64 {
        number.min(good)
    }

    fn allows((): (), _: usize, _: f64, n_new: usize) -> bool {
        n_new > 0
    }

    fn solve(
        triangulation: &mut RingTriangulation,
        n: usize,
        floor: f64,
        cone: impl FnMut(usize, usize, usize) -> f64,
    ) -> bool {
        triangulation.solve(n, floor, Forced::Nothing, cone)
    }
}

/// By the sum of what is [`Deficit`].
#[derive(Default)]
pub(super) struct Sum;

impl Objective for Sum {
    /// With the bar that follows from it.
    type Old = (Deficit, AcceptanceFloor);
    const NOTHING: f64 = 0.0;

    fn least(_: f64) -> f64 {
        GAIN
    }

    fn old<P: Pages>(mesh: &mut Mesh<P>, records: &[Tet]) -> (Deficit, AcceptanceFloor) {
        let old = Deficit::of(mesh, records);
        (old, old.bar())
    }

    #[inline(always)]
    fn floor((old, _): (Deficit, AcceptanceFloor), best: f64) -> f64 {
        old.sum + best
    }

    #[inline(always)]
    fn worth((old, _): (Deficit, AcceptanceFloor), number: f64) -> f64 {
        number - old.sum
    }

    #[inline(always)]
    fn with((_, bar): (Deficit, AcceptanceFloor), number: f64, good: f64) -> f64 {
        number + bar.worth(good)
    }

    /// Where all are bad, fewer of them are no gain by themselves: what is missing has to fall in the mean, too. Without that,
    /// `tray_bottom.stl` loses two thirds of its tetrahedra, the good ones among them.
    fn allows(
        (old, _): (Deficit, AcceptanceFloor),
        n_old: usize,
        number: f64,
        n_new: usize,
    ) -> bool {
        n_new > 0 && number / n_new as f64 > old.sum / n_old as f64
    }

    fn solve(
        triangulation: &mut RingTriangulation,
        n: usize,
        floor: f64,
        cone: impl FnMut(usize, usize, usize) -> f64,
    ) -> bool {
        triangulation.solve_sum(n, floor, cone)
    }
}
