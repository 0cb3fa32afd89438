//! Steiner points at the end of recovery: removes unneeded ones, and moves the others away from the planes next to
//! them.

use super::complex::{PagedComplex, TetComplex};
use super::free_vertex::{ball_flatness, remove_free};
use super::inscribed_ball::{HalfSpace, ball_center, clearance};
use super::report::RecoveryReport;
use super::suppress::half_space;
use super::walk::ball;
use crate::mesh::{Mesh, VertexTag};
use tetdb_base::geom::{IdSet, Point};
use tetdb_base::storage::{Pages, check_cancelled};

/// Rounds over all points: the clearance grows by a factor each time.
const ROUNDS_MAX: usize = 8;

/// Least factor by which a move must raise the clearance.
const GAIN_MIN: f64 = 1.25;

/// Shares of the way to the best place that are tried.
const SHARES: [f64; 6] = [1.0, 0.5, 0.1, 1e-2, 1e-4, 1e-6];

/// Visits the Steiner points until none goes or moves any more, a bounded number of times.
pub(super) fn tidy<P: Pages>(mesh: &mut Mesh<P>, report: &mut RecoveryReport) {
    if report.steiner == 0 {
        return;
    }
    let steiner = |mesh: &mut Mesh<P>, v: u32| {
        mesh.tet_of(v) != tetdb_schema::page::NONE
            && mesh.vertex_attribute(v).0 == VertexTag::Steiner
    };
    let mut left: Vec<u32> = mesh.vertex_ids().filter(|&v| steiner(mesh, v)).collect();
    let none = IdSet::default();
    // Only points next to a change are visited again.
    let mut beside: IdSet<u32> = left.iter().copied().collect();
    for _ in 0..ROUNDS_MAX {
        let due = std::mem::take(&mut beside);
        left.retain(|&v| {
            if !due.contains(&v) && !beside.contains(&v) {
                return true;
            }
            check_cancelled();
            let mut s = PagedComplex(mesh, &none);
            let ball = ball(&mut s, v);
            let near: Vec<u32> = ball.iter().flat_map(|&t| s.tet(t).vertices()).collect();
            let flatness = ball_flatness(&mut s, v);
            let is_gone = remove_free(&mut s, v, flatness);
            if is_gone {
                s.drop_steiner(v);
                report.steiner = report.steiner.saturating_sub(1);
            }
            if is_gone || gain_clearance(&mut s, v) {
                beside.extend(near);
            }
            !is_gone
        });
        if beside.is_empty() {
            break;
        }
    }
}

/// Moves a free vertex to the place of the largest clearance in its ball, if that gains enough.
pub(super) fn gain_clearance<P: Pages>(s: &mut PagedComplex<'_, P>, v: u32) -> bool {
    let old = s.position(v);
    let ball = ball(s, v);
    let mut reach = 0.0f64;
    let mut planes: Vec<HalfSpace> = Vec::new();
    for &t in &ball {
        let tet = s.tet(t);
        let Some(i) = tet.local(v) else { continue };
        let corners = tet.face(i).map(|u| s.position(u) - old);
        reach = corners.iter().map(|c| c.length()).fold(reach, f64::max);
        planes.extend(half_space(corners));
    }
    let Some(way) = ball_center(&planes, reach) else {
        return false;
    };
    let now = clearance(&planes, Point::ZERO);
    // If rounding rules out the best place, one on the way there may do.
    for share in SHARES {
        if clearance(&planes, way * share) <= GAIN_MIN * now.max(0.0) {
            continue;
        }
        s.0.set_point(v, old + way * share);
        let holds = ball.iter().all(|&t| {
            let q = s.tet(t).vertices();
            s.orient(q) > 0.0
        });
        if holds {
            return true;
        }
    }
    s.0.set_point(v, old);
    false
}
