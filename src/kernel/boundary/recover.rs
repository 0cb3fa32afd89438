//! The order of recovery: map, flips for segments, flips for facets, points for the rest.

use std::time::Instant;

use super::chain::PatchFailure;
use super::complex::{PagedComplex, TetComplex, edge_key};
use super::error::{BoundaryError, FacetPlace};
use super::find::{Outcome, SearchResult, find_face};
use super::flips::{CROSSINGS_MAX, Flipper};
use super::map::{MissingFacets, map};
use super::nearness::narrowest;
use super::points::recover_by_points;
use super::report::{RecoveryReport, RecoveryWatcher};
use super::target::RecoveryTarget;
use super::tidy::tidy;
use super::turn::{from_hubs, turn_segment};
use crate::mesh::Mesh;
use tetdb_base::storage::{Pages, check_cancelled};

/// Nesting depth of edge removals in each pass, and the number of ring searches per target.
const LEVELS: [(u32, u32); 3] = [(0, 40), (1, 80), (2, 160)];

/// Parts a segment may cross to be flipped for before edges are turned. Flips cost the square of this: where a fan of slats lies across
/// a Delaunay mesh its segments cross hundreds.
const CROSSINGS_FIRST: usize = 8;

/// Makes every facet of `mesh` a required face on both sides.
///
/// The mesh must be the Delaunay mesh of the facets' vertices inside the enclosing box, with `tet_of` refreshed.
/// Vertices are added only inside volumes, tagged as Steiner points. Bounded work; ids and order depend on the mesh alone.
///
/// Errors: [`BoundaryError`] names the facets; the mesh is then valid but without them.
pub fn recover<P: Pages>(mesh: &mut Mesh<P>) -> Result<RecoveryReport, BoundaryError> {
    recover_with_progress(mesh, &|_, _| {})
}

/// As [`recover`]; `watch` gets the segments and facets that are there, of those that were missing.
pub fn recover_with_progress<P: Pages>(
    mesh: &mut Mesh<P>,
    watch: &RecoveryWatcher,
) -> Result<RecoveryReport, BoundaryError> {
    let clock = Instant::now();
    let mut missing = map(mesh);
    let mut report = RecoveryReport {
        facets: mesh.n_facets(),
        missing_facets: missing.facets.len() as u32,
        missing_segments: missing.segments.len() as u32,
        map_time: clock.elapsed(),
        ..RecoveryReport::default()
    };
    let clock = Instant::now();
    flip_segments(mesh, &mut missing, &mut report, CROSSINGS_FIRST, watch);
    turn_segments(mesh, &mut missing, &mut report, watch);
    flip_segments(mesh, &mut missing, &mut report, CROSSINGS_MAX, watch);
    flip_facets(mesh, &mut missing, &mut report, watch);
    report.flip_time = clock.elapsed();
    let clock = Instant::now();
    let failures = recover_by_points(mesh, &mut missing, &mut report, watch);
    tidy(mesh, &mut report);
    report.point_time = clock.elapsed();
    match failures.first() {
        None => Ok(report),
        Some(&(n, failure)) => Err(explain(mesh, n, failure, &failures)),
    }
}

fn explain<P: Pages>(
    mesh: &mut Mesh<P>,
    n: u32,
    failure: PatchFailure,
    failures: &[(u32, PatchFailure)],
) -> BoundaryError {
    let reason = match failure {
        PatchFailure::Vertex(v) => {
            return BoundaryError::VertexOnFacet {
                owner: mesh.vertex_attribute(v).1,
                point: mesh.point(v),
                facet: Box::new(place(mesh, n)),
            };
        }
        PatchFailure::Crossed(_) => "another triangle crosses it",
        PatchFailure::Precision(what) => what,
        PatchFailure::TooMuch => "it crosses too many edges",
        PatchFailure::Broken(what) => what,
    };
    let facets: Vec<u32> = failures.iter().map(|&(n, _)| n).collect();
    BoundaryError::NotRecovered {
        nearness: narrowest(mesh, &facets),
        facets: facets.into_iter().map(|n| place(mesh, n)).collect(),
        reason,
    }
}

/// Facet `n` for a message.
pub(super) fn place<P: Pages>(mesh: &mut Mesh<P>, n: u32) -> FacetPlace {
    let facet = mesh.facet(n);
    FacetPlace { input: facet.input, corners: facet.vertices.map(|v| mesh.point(v)) }
}

/// Segments that run within flat parts of the surface.
fn turn_segments<P: Pages>(
    mesh: &mut Mesh<P>,
    missing: &mut MissingFacets,
    report: &mut RecoveryReport,
    watch: &RecoveryWatcher,
) {
    let mut left = Vec::new();
    for (a, b) in from_hubs(&std::mem::take(&mut missing.segments)) {
        check_cancelled();
        report.notify(watch);
        if turn_segment(mesh, missing, report, a, b) {
            report.segments_by_flips += 1;
        } else {
            left.push((a, b));
        }
    }
    missing.segments = left;
}

/// Tries to recover missing parts by flips, level by level, while that recovers enough of them.
///
/// `parts` selects the list of missing parts; `recover` tries one with a level and a limit of ring searches.
fn flip_missing<P: Pages, T: Copy>(
    mesh: &mut Mesh<P>,
    missing: &mut MissingFacets,
    report: &mut RecoveryReport,
    watch: &RecoveryWatcher,
    parts: impl Fn(&mut MissingFacets) -> &mut Vec<T>,
    recover: impl Fn(&mut Mesh<P>, &mut MissingFacets, &mut RecoveryReport, T, (u32, u32)) -> bool,
) {
    for level in LEVELS {
        loop {
            let mut left = std::mem::take(parts(missing));
            let before = left.len();
            left.retain(|&part| {
                check_cancelled();
                report.notify(watch);
                !recover(mesh, missing, report, part, level)
            });
            let after = left.len();
            *parts(missing) = left;
            if after == 0 {
                return;
            }
            if after + after / 16 >= before {
                break;
            }
        }
    }
}

fn flip_segments<P: Pages>(
    mesh: &mut Mesh<P>,
    missing: &mut MissingFacets,
    report: &mut RecoveryReport,
    crossings_max: usize,
    watch: &RecoveryWatcher,
) {
    let recover = |mesh: &mut Mesh<P>,
                   missing: &mut MissingFacets,
                   report: &mut RecoveryReport,
                   (a, b): (u32, u32),
                   (level, work)| {
        let mut s = PagedComplex(mesh, &missing.protected);
        let mut flipper = Flipper::new(&mut s, RecoveryTarget::Edge(a, b));
        flipper.work = work;
        flipper.crossings_max = crossings_max;
        let is_recovered = flipper.recover_edge(a, b, level) == Outcome::Recovered;
        report.flips += flipper.flips;
        if is_recovered {
            report.segments_by_flips += 1;
            missing.protected.insert(edge_key(a, b));
        }
        is_recovered
    };
    flip_missing(mesh, missing, report, watch, |missing| &mut missing.segments, recover);
}

fn flip_facets<P: Pages>(
    mesh: &mut Mesh<P>,
    missing: &mut MissingFacets,
    report: &mut RecoveryReport,
    watch: &RecoveryWatcher,
) {
    let recover = |mesh: &mut Mesh<P>,
                   missing: &mut MissingFacets,
                   report: &mut RecoveryReport,
                   n: u32,
                   (level, work)| {
        let f = mesh.facet(n).vertices;
        let mut s = PagedComplex(mesh, &missing.protected);
        let mut flipper = Flipper::new(&mut s, RecoveryTarget::Face(f));
        flipper.work = work;
        let outcome = flipper.recover_face(f, level);
        report.flips += flipper.flips;
        match find_face(&mut s, f) {
            SearchResult::Face(face) if outcome == Outcome::Recovered => {
                s.require(face);
                report.facets_by_flips += 1;
                true
            }
            _ => false,
        }
    };
    flip_missing(mesh, missing, report, watch, |missing| &mut missing.facets, recover);
}
