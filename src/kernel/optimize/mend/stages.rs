//! What mending is about, one stage after the other.
//!
//! 1. By q: a solver fails on the worst ones, which have millions. What stands beside a needle of the surface is as bad as what stands on it, and by
//!    excess nothing could take its place.
//! 2. The worst q of all, whatever it costs the others beside it: in a fan of needles no sum falls when one of them is made better.
//! 3. The worst excess of all, q over the bound, likewise: the surface's needles hide it from 2.
//! 4. The number of those of q ≥ 10.
//! 5. The worst q once more.
//!
//! Between 1 and 2 excess was once brought down like q: of a hundred tries four had success, and the worst got no better.

use super::face_bounds::FaceBounds;
use super::star::Goal;
use super::vertex::FLAT;
use crate::mesh::anatomy::FACES;
use crate::mesh::{Mesh, Tet};
use tetdb_base::geom::Point;
use tetdb_base::shape::face_floor;
use tetdb_base::shape::{is_below, quality};
use tetdb_base::storage::Pages;

/// What stands on a needle of the surface is as good as it can be below this excess.
const EXCESS_MAX: f64 = 2.0;
/// Beside the worst, those above this share of its q or excess are mended.
const WORST_SHARE: f64 = 0.9;
/// Tetrahedra listed and tried at least; see [`Stage::one_in`]. On a wing of sixteen thousand needles all but a few are bad.
const TRIED_MIN: usize = 500;

/// What a part of the work is about.
#[derive(Clone, Copy)]
pub(super) struct Stage {
    pub(super) goal: Goal,
    /// Tetrahedra are bad above this q and this excess.
    quality_max: f64,
    excess_max: f64,
    /// An operation is to raise the value of what is mended by this factor at least: less is worth no change.
    pub(super) gain_min: f64,
    /// See `Aim::more`.
    pub(super) more: u32,
    /// See `Aim::tets_max`.
    pub(super) tets_max: usize,
    /// Passes over what is still bad; each tries what has changed since it was tried before.
    pub(super) passes_max: u32,
    /// Bad tetrahedra listed, and tried in a pass, are at most a constant and one in so many of the mesh: each takes some milliseconds.
    one_in: u32,
}

/// What brings the worst q of all down.
pub(super) const WORST: Stage = Stage {
    goal: Goal::Worst,
    // Rounds leave even surfaces below it.
    quality_max: 4.0,
    excess_max: 1.05,
    gain_min: 1.03,
    more: 16,
    tets_max: 40,
    passes_max: 20,
    one_in: 200,
};

/// On balls and even scans the rounds before leave next to nothing of the kind, so that little is touched there.
///
/// Cavities of flat tetrahedra need 20 in the median, 37 for nine in ten.
pub(super) const STAGES: [Stage; 5] = [
    Stage {
        goal: Goal::Quality,
        quality_max: 50.0,
        excess_max: EXCESS_MAX,
        gain_min: 1.1,
        more: 3,
        tets_max: 40,
        passes_max: 3,
        one_in: 100,
    },
    WORST,
    Stage { goal: Goal::WorstExcess, excess_max: 4.0, ..WORST },
    Stage {
        goal: Goal::Count,
        quality_max: 10.0,
        excess_max: EXCESS_MAX,
        gain_min: 1.1,
        more: 0,
        tets_max: 24,
        passes_max: 2,
        one_in: 60,
    },
    WORST,
];

/// True if a tetrahedron with these corners may be mended; bit i of `required` tells that face i is required. Mending does not change a mesh
/// that has no such tetrahedron.
pub fn is_to_mend(points: [Point; 4], required: u8) -> bool {
    if !is_below(points, 1.0 / WORST.quality_max) {
        return false;
    }
    let q = quality(points);
    let floor = |i: usize| face_floor(FACES[i].map(|k| points[k]));
    !(0..4).any(|i| required >> i & 1 != 0 && q <= WORST.excess_max * floor(i))
}

impl Stage {
    /// The same where only those are bad that are flat.
    pub(super) fn of_flat(&self) -> Self {
        Self { quality_max: 1.0 / FLAT, ..*self }
    }

    /// Most tetrahedra of a pass, of a mesh of so many.
    pub(super) fn tried_max(&self, n_tets: u32) -> usize {
        TRIED_MIN + (n_tets / self.one_in) as usize
    }

    /// What is done about the bad ones listed; `None` when nothing is. Of the worst, those that are much better than the worst may stay as they are until
    /// that is better, and those of a q better than the worst that the surface forces.
    pub(super) fn at(&self, list: &[(u64, u32)], forced: f64) -> Option<Self> {
        let worst = f64::from_bits(list.first()?.0);
        let mut stage = *self;
        let limit = match self.goal {
            Goal::Quality | Goal::Count => return Some(stage),
            Goal::Worst => &mut stage.quality_max,
            Goal::WorstExcess => &mut stage.excess_max,
        };
        // Where rounding makes a determinant zero, the badness is infinite.
        *limit = limit.max(WORST_SHARE * worst.min(f64::MAX));
        if self.goal == Goal::Worst {
            *limit = limit.max(forced);
        }
        (worst > *limit).then_some(stage)
    }
}

impl Stage {
    /// Whether one of badness `worst` is to be mended before this one, whose bound need not be found by search then.
    pub(super) fn is_for_later<P: Pages>(&self, mesh: &mut Mesh<P>, tet: &Tet, worst: f64) -> bool {
        if self.goal != Goal::WorstExcess {
            return false;
        }
        let points = mesh.points(tet);
        if !is_below(points, 1.0 / self.quality_max) {
            return false;
        }
        let mut bound = 1.0f64;
        for i in (0..4).filter(|&i| tet.is_required(i)) {
            bound = bound.max(face_floor(tet.face(i).map(|v| mesh.point(v))));
        }
        let excess_most = quality(points) / bound;
        excess_most > self.excess_max && excess_most < WORST_SHARE * worst
    }
}

/// A tetrahedron in the eyes of a stage.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Judgment {
    Good,
    /// Its q, which the surface forces.
    Forced(f64),
    /// Its q, or its excess.
    Bad(f64),
}

impl Judgment {
    /// How bad a bad one is.
    pub(super) fn bad(self) -> Option<f64> {
        match self {
            Self::Good | Self::Forced(_) => None,
            Self::Bad(badness) => Some(badness),
        }
    }
}

/// What a tetrahedron is to a stage.
pub(super) fn judge<P: Pages>(
    mesh: &mut Mesh<P>,
    tet: &Tet,
    stage: &Stage,
    bounds: &mut FaceBounds,
) -> Judgment {
    let points = mesh.points(tet);
    if !is_below(points, 1.0 / stage.quality_max) {
        return Judgment::Good;
    }
    let q = quality(points);
    for i in (0..4).filter(|&i| tet.is_required(i)) {
        if q <= stage.excess_max * face_floor(tet.face(i).map(|v| mesh.point(v))) {
            return Judgment::Forced(q);
        }
    }
    if stage.goal != Goal::WorstExcess && bounds.is_surely_above(tet, points, q, stage.excess_max) {
        return Judgment::Bad(q);
    }
    // A face without area in doubles is no reason to do anything.
    let excess = q / bounds.of_tet(tet, points);
    if excess.is_nan() || excess <= stage.excess_max {
        return Judgment::Forced(q);
    }
    Judgment::Bad(match stage.goal {
        Goal::WorstExcess => excess,
        Goal::Quality | Goal::Count | Goal::Worst => q,
    })
}
