//! One sweep of smoothing towards an optimal Delaunay triangulation.
//!
//! Each free vertex moves to the mean of the circumcenters of its tetrahedra, weighted by volume / h³.
//! Seen from a corner, volume times circumcenter is a polynomial, so slivers (no volume, circumcenter far away)
//! do no harm. All vertices move at once, from sums gathered tetrahedron by tetrahedron in scratch pages
//! that run parallel to the vertex pages: one vertex at a time, through balls, cost four times as much for the same
//! gain. Vertices of a tetrahedron that would not stay positive go back. After the sweep the caller restores
//! local Delaunay by flips.
//!
//! Source: L. Chen and M. Holst, "Efficient mesh optimization schemes based on optimal Delaunay triangulations" (2011).

use tetdb_schema::page::{RECORDS, SLOT_BITS, Slot};

use super::pages::Way;
use super::smooth::is_free;
use super::sums::{Sums, four, set_four};
use crate::mesh::anatomy::FACES;
use crate::mesh::{Mesh, Scan, Tet, dense, scan_parts, sparse, tets_of_page};
use crate::reconnect::Ball;
use tetdb_base::geom::{Point, orient};
use tetdb_base::storage::{Pages, check_cancelled, kind};

/// Longest move in units of h: longer ones make tetrahedra that do not stay positive, shorter ones need more sweeps.
const MOVE_MAX: f64 = 0.3;

/// A vertex may halve its move 1 / STEP_BACK − 1 times before it goes back altogether: without that, 6 % stay where they were, with one halving 2 %.
const STEP_BACK: f64 = 0.5;

/// Pages whose sums are one term of a vertex's sum: the positions depend on it.
const GROUP_PAGES: usize = 8;
/// Groups summed before they are added up.
const BATCH_GROUPS: usize = 8;

/// Moves done in one sweep, and vertices taken back because a tetrahedron would not stay positive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Moves {
    pub(super) moved: u64,
    pub(super) held: u64,
}

/// Moves every free vertex once. Effects: the scratch pages are used and forgotten; no connection changes.
pub(super) fn sweep<P: Pages>(mesh: &mut Mesh<P>, way: Way) -> Moves {
    let pages = mesh.pages_mut();
    pages.clear::<{ kind::SCRATCH }>();
    let n = pages.n_pages::<{ kind::VERTICES }>();
    for _ in 0..n {
        pages.append_page::<{ kind::SCRATCH }>();
    }
    gather(mesh, way);
    let mut moves = displace(mesh, way.turned());
    restore(mesh, way.turned(), &mut moves);
    mesh.pages_mut().clear::<{ kind::SCRATCH }>();
    moves
}

/// Adds up circumcenters at all vertices; those of required and hull faces get a sum that is not a number.
///
/// Each group of pages has sums of its own, which are added in the order of groups: so they do not depend on who computed them.
fn gather<P: Pages>(mesh: &mut Mesh<P>, way: Way) {
    let pages: Vec<u32> = way.tet_pages(mesh).collect();
    let groups: Vec<Vec<u32>> = pages.chunks(GROUP_PAGES).map(<[u32]>::to_vec).collect();
    for batch in groups.chunks(BATCH_GROUPS) {
        check_cancelled();
        for sums in scan_parts(mesh, batch, &Circumcenters) {
            sums.add_to(mesh);
        }
    }
}

/// Sums weighted circumcenters over a group of pages.
struct Circumcenters;

impl Scan for Circumcenters {
    type Part = Vec<u32>;
    type Output = Sums;

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, group: &Vec<u32>) -> Sums {
        let mut sums = Sums::default();
        for &page in group {
            tets_of_page(mesh, page, |mesh, _, tet| add(&mut sums, mesh, &tet));
        }
        sums
    }
}

#[inline(always)]
fn add<P: Pages>(sums: &mut Sums, mesh: &mut Mesh<P>, tet: &Tet) {
    let ends = mesh.ends(tet);
    let p = [ends[0].point, ends[1].point, ends[2].point, ends[3].point];
    let size = |i: usize| f64::from(ends[i].h);
    let sizes = (size(0) + size(1)) + (size(2) + size(3));
    let weight = if sizes > 0.0 { 64.0 / (sizes * sizes * sizes) } else { 1.0 };
    let (u, v, w) = (p[1] - p[0], p[2] - p[0], p[3] - p[0]);
    let (vw, wu, uv) = (v.cross(w), w.cross(u), u.cross(v));
    let det = u.dot(vw) * weight;
    let sum = (vw * u.dot(u) + wu * v.dot(v) + uv * w.dot(w)) * weight;
    let at = [Point::ZERO, u, v, w];
    for (i, corner) in at.into_iter().enumerate() {
        if ends[i].fixed {
            continue;
        }
        // Seen from another corner, the center is nearer by that corner's position.
        let own = sum - corner * (2.0 * det);
        sums.add(tet.vertex(i), [own.x, own.y, own.z, det]);
    }
    pin(sums, tet);
}

/// Pins the vertices of required and hull faces.
#[inline(always)]
fn pin(sums: &mut Sums, tet: &Tet) {
    let inner = tet.neighbor.iter().all(|face| face.exists());
    if inner && !(0..4).any(|i| tet.is_required(i)) {
        return;
    }
    for (i, face) in FACES.into_iter().enumerate() {
        if tet.is_required(i) || !tet.neighbor[i].exists() {
            for k in face {
                sums.add(tet.vertex(k), [f64::NAN; 4]);
            }
        }
    }
}

/// Moves the vertices whose sums are numbers and whose tag allows it.
fn displace<P: Pages>(mesh: &mut Mesh<P>, way: Way) -> Moves {
    let mut moves = Moves::default();
    let n = mesh.pages_mut().n_pages::<{ kind::VERTICES }>();
    let (per_page, end) = (RECORDS as u32, dense(mesh.vertex_ids_end()));
    let of_page = |page: u32| page * per_page..end.min((page + 1) * per_page);
    for v in way.pages(n).flat_map(of_page).map(sparse) {
        let [x, y, z, volume] = four(mesh.pages_mut().read::<{ kind::SCRATCH }>(v));
        let mut shift = Point::new(x, y, z) / (2.0 * volume);
        let moving = volume > 0.0 && shift.is_finite() && is_free(mesh, v);
        let at = mesh.point(v);
        let flag = if moving { 1.0 } else { 0.0 };
        set_four(mesh.pages_mut().write::<{ kind::SCRATCH }>(v), [at.x, at.y, at.z, flag]);
        if moving {
            let (h, length) = (f64::from(mesh.size(v)), shift.length());
            if h > 0.0 && length > MOVE_MAX * h {
                shift *= MOVE_MAX * h / length;
            }
            mesh.set_point(v, at + shift);
            moves.moved += 1;
        }
    }
    moves
}

#[inline(always)]
fn is_positive<P: Pages>(mesh: &mut Mesh<P>, tet: &Tet) -> bool {
    let [a, b, c, d] = mesh.points(tet);
    orient(a, b, c, d) > 0.0
}

/// Takes vertices back until every tetrahedron is exactly positive; where all were taken back it is, as before.
fn restore<P: Pages>(mesh: &mut Mesh<P>, way: Way, moves: &mut Moves) {
    let (mut ball, mut list) = (Ball::default(), Vec::new());
    let pages: Vec<u32> = way.tet_pages(mesh).collect();
    for batch in pages.chunks(GROUP_PAGES * BATCH_GROUPS) {
        for t in scan_parts(mesh, batch, &Inverted).into_iter().flatten() {
            list.push((t, mesh.tet(t)));
            take_back(mesh, &mut list, &mut ball, moves);
        }
    }
}

/// Lists the tetrahedra of a page that are not positive.
struct Inverted;

impl Scan for Inverted {
    type Part = u32;
    type Output = Vec<u32>;

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, &page: &u32) -> Vec<u32> {
        let mut found = Vec::new();
        tets_of_page(mesh, page, |mesh, t, tet| {
            if !is_positive(mesh, &tet) {
                found.push(t);
            }
        });
        found
    }
}

/// Takes vertices back until the tetrahedra of the list are positive, and those around the vertices too.
fn take_back<P: Pages>(
    mesh: &mut Mesh<P>,
    list: &mut Vec<(u32, Tet)>,
    ball: &mut Ball,
    moves: &mut Moves,
) {
    // What is taken back here concerns tetrahedra near by; those passed already are in the list too.
    while let Some((t, tet)) = list.pop() {
        if is_positive(mesh, &tet) {
            continue;
        }
        for i in 0..4 {
            let v = tet.vertex(i);
            let [x, y, z, flag] = four(mesh.pages_mut().read::<{ kind::SCRATCH }>(v));
            if flag == 0.0 {
                continue;
            }
            let old = Point::new(x, y, z);
            let left = flag - STEP_BACK;
            let p = if left > 0.0 {
                (mesh.point(v) + old) * 0.5
            } else {
                moves.moved -= 1;
                moves.held += 1;
                old
            };
            mesh.set_point(v, p);
            set_four(mesh.pages_mut().write::<{ kind::SCRATCH }>(v), [x, y, z, left]);
            assert!(ball.gather(mesh, v, t, usize::MAX), "tetrahedron {t} has vertex {v}");
            list.extend(ball.tets.iter().copied().zip(ball.records.iter().copied()));
        }
    }
}

const _: () = assert!(size_of::<Slot>() == 4 * size_of::<f64>() && SLOT_BITS == 11);
