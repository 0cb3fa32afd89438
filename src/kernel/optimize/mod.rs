//! Raise the worst qualities, touch no required face.
//!
//! 1. `lawson`: flips until no face is found that is not locally Delaunay and can be flipped.
//! 2. `odt`: free vertices move to where an optimal Delaunay triangulation has them, then 1 again; a few sweeps.
//! 3. `rounds`: every tetrahedron with q ≥ 2 is attacked by edge removal, then face swap, then smoothing.
//! 4. `rounds` for the goal `WORST`: the worst tetrahedra left are attacked by collapse and insertion too.
//! 5. `rounds` for the goal `SHARE`: bad tetrahedra left, except those the surface forces, are attacked by all
//!    of these; the sum over the tetrahedra involved decides.
//! 6. `mend`: tetrahedra far worse than the surface forces (`shape`) are attacked, worst first, also by vertices in growing
//!    cavities.
//!
//! Placement of points alone leaves 86 to 90 % of the tetrahedra below q = 2 and slivers without bound;
//! steps 1 and 2 give 97 %, step 3 aimed at *every* q ≥ 2 gives 99 % and more. Aimed only at q ≥ 2.86
//! it would stop near 94 %.
//!
//! Invariants: a change is accepted only when the worst quality of what it replaces rises (1 to 4), or when fewer are bad and
//! none falls below both the worst before and q = 3.5 (5); every new tetrahedron is exactly positive; required faces and vertices that are not free stay as they are. Work goes page by page of
//! tetrahedra, in id order, whatever is resident: the result does not depend on paging.
//!
//! Source: the paper, section 1.1; L. Chen and J. Xu, "Optimal Delaunay triangulations" (2004); L. A. Freitag and
//! C. Ollivier-Gooch, "Tetrahedral mesh improvement using swapping and smoothing" (1997); B. M. Klingner and
//! J. R. Shewchuk, "Aggressive tetrahedral mesh improvement" (2007).

mod bad_fraction;
mod collapse;
mod deficit;
mod goals;
mod insertion;
mod lawson;
#[cfg(test)]
mod measure;
mod mend;
mod objective;
mod odt;
mod pages;
mod rounds;
mod run;
mod smooth;
mod sphere;
mod stuck;
mod sums;
mod swap;
#[cfg(test)]
mod tests;
mod vertex_operations;

pub use goals::OperationCounts;
pub use lawson::LawsonStats;
#[cfg(test)]
pub use measure::{Histogram, QualityTable, measure};
pub use mend::{MendCounts, is_to_mend};
pub use run::{Mode, OptimizeReport, Progress, Settings, improve_all_but, mend, run, run_with};
