//! The exact path: patches around facets that flips cannot recover.

use super::chain::Trouble;
use super::effort::{EFFORTS, Effort};
use super::find::{SearchResult, find_face};
use super::flat::{FlatPart, flat_parts, single_parts};
use super::free_vertex::remove_free;
use super::map::MissingFacets;
use super::patch::Patch;
use super::report::{RecoveryReport, RecoveryWatcher};
use super::space::{PagedSpace, Space, edge_key, sorted};
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
) -> Vec<(u32, Trouble)> {
    let mut troubles = Vec::new();
    for _ in 0..ROUNDS_MAX {
        let before = missing.facets.len();
        troubles.clear();
        let mut left = Vec::new();
        for group in groups(mesh, &missing.facets, &mut missing.protected) {
            check_cancelled();
            report.notify(watch);
            report.patches += 1;
            let Err((facets, trouble)) = recover_group(mesh, missing, &group, report) else {
                report.facets_by_points += group.len() as u32;
                continue;
            };
            report.facets_by_points += (group.len() - facets.len()) as u32;
            troubles.extend(facets.iter().map(|&n| (n, trouble)));
            left.extend(facets);
        }
        missing.facets = left;
        if missing.facets.is_empty() || missing.facets.len() == before {
            break;
        }
    }
    troubles
}

/// Recovers the facets of `group`, those in one plane as one part if possible; returns those left and why.
fn recover_group<P: Pages>(
    mesh: &mut Mesh<P>,
    missing: &mut MissingFacets,
    group: &[u32],
    report: &mut RecoveryReport,
) -> Result<(), (Vec<u32>, Trouble)> {
    // A triangle given twice is one face.
    let mut seen = IdSet::default();
    let corners: Vec<[u32; 3]> = group.iter().map(|&n| mesh.facet(n).vertices).collect();
    let mut once = corners.clone();
    once.retain(|&f| seen.insert(sorted(f)));
    let parts = flat_parts(&mut PagedSpace(mesh, &missing.protected), &once);
    let mut left = group.to_vec();
    if parts.len() < once.len() && attempt(mesh, missing, &parts, report).is_ok() {
        turn_inside(mesh, missing, &parts, report);
        left.retain(|&n| !require_facet(mesh, n));
        once = left.iter().map(|&n| mesh.facet(n).vertices).collect();
        once.retain(|&f| seen.remove(&sorted(f)));
    }
    if !left.is_empty() {
        let parts = single_parts(&once);
        if let Err(trouble) = attempt(mesh, missing, &parts, report) {
            return Err((left, trouble));
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
    let mut s = PagedSpace(mesh, &none);
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
        let rim = part.rim.iter().map(|&(a, b)| edge_key(a, b));
        missing.protected.extend(rim);
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
            if find_edge(&mut PagedSpace(mesh, &none), p, q).is_some() {
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
/// Of a part of several facets the faces are not required: they are not yet those of the surface.
fn attempt<P: Pages>(
    mesh: &mut Mesh<P>,
    missing: &MissingFacets,
    parts: &[FlatPart],
    report: &mut RecoveryReport,
) -> Result<(), Trouble> {
    let mut outcome = Err(Trouble::TooMuch);
    for effort in EFFORTS {
        outcome = try_parts(mesh, &missing.protected, parts, effort, report);
        if matches!(outcome, Ok(()) | Err(Trouble::Vertex(_))) {
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
) -> Result<(), Trouble> {
    let mut patch = Patch::new(mesh, protected, effort);
    let mut local: Vec<FlatPart> = parts.iter().map(|p| p.renamed(|v| patch.vertex(v))).collect();
    if effort.reversed {
        local.reverse();
    }
    let mut skin =
        CavitySkin { facets: local.iter().map(|p| p.facets[0]).collect(), ..CavitySkin::default() };
    let outcome = build(&mut patch, &mut skin, &local);
    let named = |trouble| match trouble {
        Trouble::Vertex(v) => Trouble::Vertex(patch.mesh_id(v)),
        Trouble::Crossed(f) => Trouble::Crossed(f.map(|v| patch.mesh_id(v))),
        other => other,
    };
    let points = outcome.map_err(named)?;
    if !patch.is_sound() {
        return Err(Trouble::Precision("doubles leave no volume beside it"));
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
        return Err(Trouble::Broken("a facet is not whole"));
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
    let mut s = PagedSpace(mesh, &none);
    for face in free {
        match find_face(&mut s, face) {
            SearchResult::Face(face) => s.release(face),
            _ => panic!("face {face:?} of a flat part was recovered and is not there"),
        }
    }
    Ok(())
}

/// Whether none of the vertices has left the surface or, of many, less than one in [`FEW`].
fn is_slow(before: usize, after: usize) -> bool {
    before == after || before > MANY && (before - after) * FEW < before
}

/// Chains, faces, suppression; returns how many vertices were on the surface for a while.
fn build<P: Pages>(
    patch: &mut Patch<'_, P>,
    skin: &mut CavitySkin,
    parts: &[FlatPart],
) -> Result<u32, Trouble> {
    let mut chains: IdMap<(u32, u32), Vec<u32>> = IdMap::default();
    let mut on_segments: Vec<u32> = Vec::new();
    for &(a, b) in parts.iter().flat_map(|p| &p.rim) {
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
        let rim: Vec<(u32, u32)> = part
            .rim
            .iter()
            .flat_map(|side| chains[side].windows(2).map(|edge| (edge[0], edge[1])))
            .collect();
        let faces = patch.cover(part, &rim)?;
        let on_rim: IdSet<u32> = rim.iter().map(|edge| edge.0).collect();
        let mut inside: Vec<u32> = faces
            .iter()
            .flatten()
            .copied()
            .filter(|v| !on_rim.contains(v) && !part.has(*v))
            .collect();
        inside.sort_unstable();
        inside.dedup();
        for &face in &faces {
            skin.faces.insert(sorted(face), (k, face));
        }
        for &face in &faces {
            let [p, q, r] = face;
            let t = find_edge(patch, p, q).ok_or(Trouble::Broken("a face was lost"))?;
            let around = shell(patch, t, p, q).ok_or(Trouble::Broken("a facet on the hull"))?;
            let i = around
                .ring
                .iter()
                .position(|&v| v == r)
                .ok_or(Trouble::Broken("a face was lost"))?;
            // tets[i] has p, q, r and the next of the ring: the face is opposite that one.
            let t = around.tets[i];
            let next = around.ring[(i + 1) % around.ring.len()];
            let l = patch.tet(t).local(next).expect("a vertex of the shell");
            patch.require(FaceRef::new(t, l));
        }
        points += inside.len() as u32;
        // What has no room now may have some when others are gone.
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
        let mut trouble = None;
        let mut left = Vec::new();
        for v in late {
            if let Err(why) = patch.suppress(skin, v) {
                trouble = Some(why);
                left.push(v);
            }
        }
        late = left;
        match trouble {
            // Mostly a few of thousands have no room: they alone go where no double is, all else is as good as it was. Each try in vain takes
            // milliseconds, and when one finds room now and then, hundreds of others are tried again.
            Some(_) if is_slow(before, late.len()) && !patch.effort.exact => {
                patch.effort.exact = true;
            }
            Some(trouble) if late.len() == before => return Err(trouble),
            _ => {}
        }
    }
    for v in 0..patch.n_vertices() {
        if patch.is_new(v) && patch.is_in_use(v) {
            remove_free(patch, v, 0.0);
        }
    }
    if patch.effort.exact {
        patch.settle()?;
    }
    Ok(points)
}
