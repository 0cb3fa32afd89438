//! The exact path: patches around facets that flips cannot recover.

use super::chain::PatchFailure;
use super::complex::{PagedComplex, TetComplex, edge_key, sorted};
use super::effort::{EFFORTS, Effort};
use super::find::{SearchResult, find_face};
use super::flat_parts::{FlatPart, flat_parts, single_parts};
use super::free_vertex::remove_free;
use super::map::MissingFacets;
use super::patch::RecoveryPatch;
use super::report::{RecoveryReport, RecoveryWatcher};
use super::suppress::CavitySkin;
use super::turn::{from_hubs, turn_segment};
use super::walk::{find_edge, shell};
use crate::mesh::{FaceRef, Mesh};
use tetdb_base::geom::{IdMap, IdSet};
use tetdb_base::storage::{Pages, check_cancelled};

/// Times the facets left are tried again after others succeeded.
const ROUNDS_MAX: usize = 4;

/// See [`is_slow`].
const FEW: usize = 8;
const MANY: usize = 64;

/// Recovers the missing facets, patch by patch; returns those left with their trouble.
pub(super) fn recover_by_points<P: Pages>(
    mesh: &mut Mesh<P>,
    missing: &mut MissingFacets,
    report: &mut RecoveryReport,
    watch: &RecoveryWatcher,
) -> Vec<(u32, PatchFailure)> {
    let mut failures = Vec::new();
    for _ in 0..ROUNDS_MAX {
        let before = missing.facets.len();
        failures.clear();
        let mut left = Vec::new();
        for group in groups(mesh, &missing.facets, &mut missing.protected) {
            check_cancelled();
            report.notify(watch);
            report.patches += 1;
            let Err((facets, failure)) = recover_group(mesh, missing, &group, report) else {
                report.facets_by_points += group.len() as u32;
                continue;
            };
            report.facets_by_points += (group.len() - facets.len()) as u32;
            failures.extend(facets.iter().map(|&n| (n, failure)));
            left.extend(facets);
        }
        missing.facets = left;
        if missing.facets.is_empty() || missing.facets.len() == before {
            break;
        }
    }
    failures
}

/// Recovers the facets of `group`, those in one plane as one part if possible; returns those left and why.
fn recover_group<P: Pages>(
    mesh: &mut Mesh<P>,
    missing: &mut MissingFacets,
    group: &[u32],
    report: &mut RecoveryReport,
) -> Result<(), (Vec<u32>, PatchFailure)> {
    // A triangle given twice is one face.
    let mut seen = IdSet::default();
    let corners: Vec<[u32; 3]> = group.iter().map(|&n| mesh.facet(n).vertices).collect();
    let mut once = corners.clone();
    once.retain(|&f| seen.insert(sorted(f)));
    let parts = flat_parts(&mut PagedComplex(mesh, &missing.protected), &once);
    let mut left = group.to_vec();
    if parts.len() < once.len() && attempt(mesh, missing, &parts, report).is_ok() {
        turn_inside(mesh, missing, &parts, report);
        left.retain(|&n| !require_facet(mesh, n));
        once = left.iter().map(|&n| mesh.facet(n).vertices).collect();
        once.retain(|&f| seen.remove(&sorted(f)));
    }
    if !left.is_empty() {
        let parts = single_parts(&once);
        if let Err(failure) = attempt(mesh, missing, &parts, report) {
            return Err((left, failure));
        }
    }
    for n in left {
        assert!(require_facet(mesh, n), "facet {n} was recovered and is not there");
    }
    Ok(())
}

/// Marks facet `n` as required, if it is a face.
fn require_facet<P: Pages>(mesh: &mut Mesh<P>, n: u32) -> bool {
    let f = mesh.facet(n).vertices;
    let none = IdSet::default();
    let mut s = PagedComplex(mesh, &none);
    match find_face(&mut s, f) {
        SearchResult::Face(face) => {
            s.require(face);
            true
        }
        _ => false,
    }
}

/// Turns edges of the parts, which are sets of faces now, until their own segments are there.
fn turn_inside<P: Pages>(
    mesh: &mut Mesh<P>,
    missing: &mut MissingFacets,
    parts: &[FlatPart],
    report: &mut RecoveryReport,
) {
    for part in parts {
        let outline = part.outline.iter().map(|&(a, b)| edge_key(a, b));
        missing.protected.extend(outline);
    }
    for part in parts {
        for (a, b) in from_hubs(&part.inner) {
            turn_segment(mesh, missing, report, a, b);
        }
    }
}

/// Facets that share missing segments belong together: a point on a segment needs all facets around it.
fn groups<P: Pages>(
    mesh: &mut Mesh<P>,
    facets: &[u32],
    protected: &mut IdSet<u64>,
) -> Vec<Vec<u32>> {
    let none = IdSet::default();
    let mut by_segment: IdMap<u64, usize> = IdMap::default();
    let mut parent: Vec<usize> = (0..facets.len()).collect();
    fn root(parent: &mut [usize], mut i: usize) -> usize {
        while parent[i] != i {
            parent[i] = parent[parent[i]];
            i = parent[i];
        }
        i
    }
    for (i, &n) in facets.iter().enumerate() {
        let [a, b, c] = mesh.facet(n).vertices;
        for (p, q) in [(a, b), (b, c), (c, a)] {
            if find_edge(&mut PagedComplex(mesh, &none), p, q).is_some() {
                protected.insert(edge_key(p, q));
                continue;
            }
            let j = *by_segment.entry(edge_key(p, q)).or_insert(i);
            let (x, y) = (root(&mut parent, i), root(&mut parent, j));
            parent[x.max(y)] = x.min(y);
        }
    }
    let mut groups: Vec<Vec<u32>> = vec![Vec::new(); facets.len()];
    for (i, &n) in facets.iter().enumerate() {
        groups[root(&mut parent, i)].push(n);
    }
    groups.retain(|g| !g.is_empty());
    groups
}

/// Tries one effort after the other until the parts are sets of faces.
///
/// Faces of a part with several facets are not required: they are not yet those of the surface.
fn attempt<P: Pages>(
    mesh: &mut Mesh<P>,
    missing: &MissingFacets,
    parts: &[FlatPart],
    report: &mut RecoveryReport,
) -> Result<(), PatchFailure> {
    let mut outcome = Err(PatchFailure::TooMuch);
    for effort in EFFORTS {
        outcome = try_parts(mesh, &missing.protected, parts, effort, report);
        if matches!(outcome, Ok(()) | Err(PatchFailure::Vertex(_))) {
            break;
        }
    }
    outcome
}

fn try_parts<P: Pages>(
    mesh: &mut Mesh<P>,
    protected: &IdSet<u64>,
    parts: &[FlatPart],
    effort: Effort,
    report: &mut RecoveryReport,
) -> Result<(), PatchFailure> {
    let mut patch = RecoveryPatch::new(mesh, protected, effort);
    let mut local: Vec<FlatPart> = parts.iter().map(|p| p.renamed(|v| patch.vertex(v))).collect();
    if effort.reversed {
        local.reverse();
    }
    let mut skin =
        CavitySkin { facets: local.iter().map(|p| p.facets[0]).collect(), ..CavitySkin::default() };
    let outcome = build(&mut patch, &mut skin, &local);
    let named = |failure| match failure {
        PatchFailure::Vertex(v) => PatchFailure::Vertex(patch.mesh_id(v)),
        PatchFailure::Crossed(f) => PatchFailure::Crossed(f.map(|v| patch.mesh_id(v))),
        other => other,
    };
    let points = outcome.map_err(named)?;
    if !patch.is_sound() {
        return Err(PatchFailure::Precision("doubles leave no volume beside it"));
    }
    let n_facets: usize = local.iter().map(|p| p.facets.len()).sum();
    let is_whole =
        |p: &FlatPart| p.facets.len() > 1 || skin.faces.contains_key(&sorted(p.facets[0]));
    let own: IdSet<u32> = local.iter().flat_map(|p| &p.facets).flatten().copied().collect();
    let adds_none = skin.faces.keys().flatten().all(|v| own.contains(v));
    if !local.iter().all(is_whole)
        || skin.faces.len() != n_facets
        || !adds_none
        || !patch.keeps_required()
    {
        return Err(PatchFailure::Broken("a facet is not whole"));
    }
    report.points_on_surface += points;
    let free: Vec<[u32; 3]> = skin
        .faces
        .iter()
        .filter(|(_, (part, _))| local[*part].facets.len() > 1)
        .map(|(face, _)| face.map(|v| patch.mesh_id(v)))
        .collect();
    let added = patch.commit();
    report.steiner = report.steiner.saturating_add_signed(added as i32);
    let none = IdSet::default();
    let mut s = PagedComplex(mesh, &none);
    for face in free {
        match find_face(&mut s, face) {
            SearchResult::Face(face) => s.release(face),
            _ => panic!("face {face:?} of a flat part was recovered and is not there"),
        }
    }
    Ok(())
}

/// Returns whether none of the vertices has left the surface or, of many, less than one in [`FEW`].
fn is_slow(before: usize, after: usize) -> bool {
    before == after || before > MANY && (before - after) * FEW < before
}

/// Chains, faces, suppression; returns how many vertices were on the surface for a while.
fn build<P: Pages>(
    patch: &mut RecoveryPatch<'_, P>,
    skin: &mut CavitySkin,
    parts: &[FlatPart],
) -> Result<u32, PatchFailure> {
    let mut chains: IdMap<(u32, u32), Vec<u32>> = IdMap::default();
    let mut on_segments: Vec<u32> = Vec::new();
    for &(a, b) in parts.iter().flat_map(|p| &p.outline) {
        if chains.contains_key(&(a, b)) {
            continue;
        }
        let chain = if patch.effort.reversed {
            let mut chain = patch.chain(b, a)?;
            chain.reverse();
            chain
        } else {
            patch.chain(a, b)?
        };
        on_segments.extend(&chain[1..chain.len() - 1]);
        chains.insert((b, a), chain.iter().rev().copied().collect());
        chains.insert((a, b), chain);
    }
    let mut points = on_segments.len() as u32;
    let mut late: Vec<u32> = Vec::new();
    for (k, part) in parts.iter().enumerate() {
        let outline: Vec<(u32, u32)> = part
            .outline
            .iter()
            .flat_map(|side| chains[side].windows(2).map(|edge| (edge[0], edge[1])))
            .collect();
        let faces = patch.cover(part, &outline)?;
        let on_outline: IdSet<u32> = outline.iter().map(|edge| edge.0).collect();
        let mut inside: Vec<u32> = faces
            .iter()
            .flatten()
            .copied()
            .filter(|v| !on_outline.contains(v) && !part.has(*v))
            .collect();
        inside.sort_unstable();
        inside.dedup();
        for &face in &faces {
            skin.faces.insert(sorted(face), (k, face));
        }
        for &face in &faces {
            let [p, q, r] = face;
            let t = find_edge(patch, p, q).ok_or(PatchFailure::Broken("a face was lost"))?;
            let around =
                shell(patch, t, p, q).ok_or(PatchFailure::Broken("a facet on the hull"))?;
            let i = around
                .ring
                .iter()
                .position(|&v| v == r)
                .ok_or(PatchFailure::Broken("a face was lost"))?;
            // tets[i] has p, q, r and the next vertex of the ring: the face is opposite that vertex.
            let t = around.tets[i];
            let next = around.ring[(i + 1) % around.ring.len()];
            let l = patch.tet(t).local(next).expect("a vertex of the shell");
            patch.require(FaceRef::new(t, l));
        }
        points += inside.len() as u32;
        // A vertex without clearance now may have some after others are gone.
        for v in inside {
            if patch.suppress(skin, v).is_err() {
                late.push(v);
            }
        }
    }
    late.extend(on_segments);
    if patch.effort.reversed {
        late.reverse();
    }
    while !late.is_empty() {
        let before = late.len();
        let mut failure = None;
        let mut left = Vec::new();
        for v in late {
            if let Err(why) = patch.suppress(skin, v) {
                failure = Some(why);
                left.push(v);
            }
        }
        late = left;
        match failure {
            // Usually a few of thousands have no clearance. They alone go to exact places; all others are already fine.
            // A failed try takes milliseconds, and if one vertex succeeds now and then, hundreds of others are tried
            // again.
            Some(_) if is_slow(before, late.len()) && !patch.effort.exact => {
                patch.effort.exact = true;
            }
            Some(failure) if late.len() == before => return Err(failure),
            _ => {}
        }
    }
    for v in 0..patch.n_vertices() {
        if patch.is_new(v) && patch.is_in_use(v) {
            remove_free(patch, v, 0.0);
        }
    }
    if patch.effort.exact {
        patch.round_to_doubles()?;
    }
    Ok(points)
}
