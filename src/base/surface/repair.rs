//! Repairs on demand: joins near points, drops useless triangles, divides triangles at T-junctions, turns neighbors
//! alike.

use std::collections::{BTreeMap, BTreeSet, HashSet};

use super::Surface;
use super::boundary_loops::{TJunction, has_near_junctions, t_junctions};
use super::edges::{Closedness, Facets, closedness};
use super::label_sets::drop_unused_labels;
use super::orientation::orient_alike;
use super::validate::validate;
use super::weld::drop_unused_points;
use super::weld_near::{n_near, weld_near};
use crate::geom::Point;
use crate::storage::ScratchSpace;

/// Shares of the box diagonal that [`closing`] tries after none.
const CLOSING_SHARES: [f64; 7] = [1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3];
/// Rounds of dividing at most: each divides one edge of a triangle, at all vertices on it.
const ROUNDS_MAX: usize = 64;

/// Result of [`repair`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Repair {
    /// Points joined to another.
    pub points_joined: usize,
    /// Triangles without area that were dropped.
    pub collapsed_dropped: usize,
    /// Triangles of the same vertices and orientation as an earlier one that were dropped.
    pub repeated_dropped: usize,
    /// Triangles divided at a T-junction.
    pub divided: usize,
    /// Triangles turned round to run like their neighbors.
    pub turned: usize,
}

/// Bytes of memory that [`repair`] and [`closing`] hold, the surface among them: 140 to 175 for a triangle.
pub fn repair_bytes(surface: &Surface) -> u64 {
    const TRIANGLE: u64 = 180;
    TRIANGLE * surface.n_triangles() as u64
}

/// Repairs everything that needs no guess.
///
/// Joins points not farther apart than `weld` (when given, in input units), drops triangles without area and repeated ones,
/// divides triangles at vertices that lie on their open edges (exactly, or as near as `weld`), turns neighbors alike.
/// Effects: renumbers vertices and triangles; no coordinate changes but by joining. Is not: a promise; validate the result.
pub fn repair(surface: &mut Surface, weld: Option<f64>) -> Repair {
    mend(surface, weld, false)
}

/// [`repair`] with a choice: with `to_close`, triangles are divided only if that may close the surface.
fn mend(surface: &mut Surface, weld: Option<f64>, to_close: bool) -> Repair {
    let mut done = Repair::default();
    if let Some(distance) = weld {
        done.points_joined = weld_near(surface, distance);
    }
    for _ in 0..ROUNDS_MAX {
        drop_useless(surface, &mut done);
        let n = divide(surface, weld.unwrap_or(0.0), to_close);
        done.divided += n;
        if n == 0 {
            break;
        }
    }
    drop_useless(surface, &mut done);
    done.turned = orient_alike(surface).flipped.len();
    done
}

/// Drops triangles without area and repeated ones.
fn drop_useless(surface: &mut Surface, done: &mut Repair) {
    let facets = Facets::new(surface, &ScratchSpace::boundless());
    let mut drop = vec![false; surface.n_triangles()];
    for &(t, _) in &facets.degenerate {
        drop[t as usize] = true;
        done.collapsed_dropped += 1;
    }
    for &[_, t] in &facets.duplicates {
        done.repeated_dropped += usize::from(!drop[t as usize]);
        drop[t as usize] = true;
    }
    if drop.contains(&true) {
        replace_triangles(surface, |t, triangle, pieces| {
            if !drop[t as usize] {
                pieces.push(triangle);
            }
        });
        drop_unused_points(surface);
    }
}

/// Result of [`merge_repeated`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Merged {
    /// Triangles without area that were dropped.
    pub collapsed: usize,
    /// Triangles of the same vertices and direction as an earlier one, which now has their labels too.
    pub repeated: usize,
}

/// Drops triangles without area, and makes one triangle of those with the same vertices and direction.
///
/// That one is in all their groups. Effects: where something was dropped, vertices and labels that nothing uses go.
pub fn merge_repeated(surface: &mut Surface) -> Merged {
    let Facets { degenerate, duplicates, .. } = Facets::new(surface, &ScratchSpace::boundless());
    if degenerate.is_empty() && duplicates.is_empty() {
        return Merged::default();
    }
    let mut drop = vec![false; surface.n_triangles()];
    degenerate.iter().for_each(|&(t, _)| drop[t as usize] = true);
    let repeated: Vec<[u32; 2]> = duplicates
        .into_iter()
        .filter(|[_, t]| !std::mem::replace(&mut drop[*t as usize], true))
        .collect();
    surface.join_labels(&repeated);
    replace_triangles(surface, |t, triangle, pieces| {
        if !drop[t as usize] {
            pieces.push(triangle);
        }
    });
    drop_unused_points(surface);
    drop_unused_labels(surface);
    Merged { collapsed: degenerate.len(), repeated: repeated.len() }
}

/// Drops folds that closed on themselves: triangles lower than `height` with an open edge, where each other edge has three facets.
///
/// Without them the neighbors are joined as they were before the fold. Returns how many went.
pub fn drop_folds(surface: &mut Surface, height: f64) -> usize {
    let is_low = |[a, b, c]: [Point; 3]| {
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        (b - a).cross(c - a).length() <= height * longest
    };
    let mut n = 0;
    loop {
        let mut facets = Facets::new(surface, &ScratchSpace::boundless());
        let (mut is_open, mut is_needed) =
            (vec![false; surface.n_triangles()], vec![false; surface.n_triangles()]);
        facets.each_edge(|uses| match uses {
            [only] => is_open[only.triangle() as usize] = true,
            [a, b] => [a, b].into_iter().for_each(|u| is_needed[u.triangle() as usize] = true),
            _ => {}
        });
        let mut drop = BTreeSet::new();
        let mut seen = HashSet::new();
        for t in (0..surface.n_triangles()).filter(|&t| is_open[t] && !is_needed[t]) {
            let edges = edges_of(surface.triangles[t]);
            // Of two that share an edge the second is judged without the first.
            if is_low(surface.corners(t as u32)) && !edges.iter().any(|edge| seen.contains(edge)) {
                seen.extend(edges);
                drop.insert(t as u32);
            }
        }
        let backs = facets.two_sided.iter().filter(|[t, _]| drop.contains(t));
        let backs: Vec<u32> = backs.map(|[_, back]| *back).collect();
        drop.extend(backs);
        if drop.is_empty() {
            return n;
        }
        n += drop.len();
        replace_triangles(surface, |t, triangle, pieces| {
            if !drop.contains(&t) {
                pieces.push(triangle);
            }
        });
        drop_unused_points(surface);
    }
}

fn edges_of([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)])
}

/// Divides triangles with vertices on an open edge of theirs, one edge of each, and returns how many.
///
/// Only where it brings two open edges together; a sheet that merely touches an open edge changes nothing.
fn divide(surface: &mut Surface, distance: f64, to_close: bool) -> usize {
    let found = closedness(surface);
    if found.is_closed() {
        return 0;
    }
    let junctions = t_junctions(surface, &found, distance);
    if to_close && !may_close(&found, &junctions) {
        return 0;
    }
    let sorted = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
    let mut open: Vec<[u32; 2]> = found.open.iter().map(|(_, edge)| sorted(*edge)).collect();
    open.sort_unstable();
    // Triangle -> its edge and the vertices along it, both ends among them.
    let mut cuts: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for on_edge in junctions.chunk_by(|a, b| (a.triangle, a.edge) == (b.triangle, b.edge)) {
        let (triangle, [a, b]) = (on_edge[0].triangle, on_edge[0].edge);
        let [from, to] = [a, b].map(|v| surface.points[v as usize]);
        let along = |v: u32| (surface.points[v as usize] - from).dot(to - from);
        let mut chain: Vec<u32> = on_edge.iter().map(|j| j.vertex).collect();
        chain.sort_unstable_by(|&v, &w| along(v).total_cmp(&along(w)));
        chain.insert(0, a);
        chain.push(b);
        let brings_together = |pair: &[u32]| {
            let edge = sorted([pair[0], pair[1]]);
            open.binary_search(&edge).is_ok()
        };
        let own = &surface.triangles[triangle as usize];
        let apex_is_free = !chain[1..chain.len() - 1].iter().any(|v| own.contains(v));
        if apex_is_free && chain.windows(2).any(brings_together) {
            cuts.entry(triangle).or_insert(chain);
        }
    }
    replace_triangles(surface, |t, triangle, pieces| {
        let Some(chain) = cuts.get(&t) else {
            pieces.push(triangle);
            return;
        };
        let ends = [chain[0], chain[chain.len() - 1]];
        let apex = triangle.into_iter().find(|v| !ends.contains(v));
        let apex = apex.expect("a facet has three vertices");
        pieces.extend(chain.windows(2).map(|pair| [pair[0], pair[1], apex]));
    });
    cuts.len()
}

/// Returns whether dividing may close the surface: each open edge is divided, or an end of it lies on another open edge.
fn may_close(found: &Closedness, junctions: &[TJunction]) -> bool {
    let mut on_edge: Vec<u32> = junctions.iter().map(|j| j.vertex).collect();
    on_edge.sort_unstable();
    found.open.iter().all(|&(triangle, edge)| {
        let is_cut =
            junctions.binary_search_by_key(&(triangle, edge), |j| (j.triangle, j.edge)).is_ok();
        is_cut || edge.iter().any(|v| on_edge.binary_search(v).is_ok())
    })
}

/// Replaces each triangle by the output of `pieces`; labels and files follow.
pub fn replace_triangles(
    surface: &mut Surface,
    pieces: impl Fn(u32, [u32; 3], &mut Vec<[u32; 3]>),
) {
    let old = std::mem::take(&mut surface.triangles);
    let old_labels = std::mem::take(&mut surface.labels);
    let mut files = surface.files.iter_mut().peekable();
    for (t, (triangle, label)) in (0u32..).zip(old.into_iter().zip(old_labels)) {
        while let Some(file) = files.next_if(|file| file.triangle_first <= t) {
            file.triangle_first = surface.triangles.len() as u32;
        }
        pieces(t, triangle, &mut surface.triangles);
        surface.labels.resize(surface.triangles.len(), label);
    }
    for file in files {
        file.triangle_first = surface.triangles.len() as u32;
    }
}

/// Result of a tentative repair of an open surface.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Closing {
    /// Points this near are joined, as a share of the box diagonal; 0 means none.
    pub share: f64,
    /// The distance in input units.
    pub distance: f64,
    /// Points that would be joined to others.
    pub points_joined: usize,
    /// Open edges left; where dividing cannot close them all, before any was divided.
    pub open_edges: usize,
    /// No edge is open, and there is something left.
    pub closes: bool,
    /// Defects left when it closes.
    pub defects_left: Option<u64>,
}

/// Tries [`repair`] without joining points, then with growing distances, until no edge is open.
///
/// The last entry says whether one distance was enough. A distance is skipped if it joins no points and puts no vertex
/// on an open edge: the result would be that without joining.
pub fn closing(surface: &Surface) -> Vec<Closing> {
    let diagonal = surface.bounds().diagonal();
    let (first, unjoined) = try_closing(surface, None);
    let mut tried = vec![first];
    if tried[0].closes {
        return tried;
    }
    let distances = CLOSING_SHARES.map(|share| share * diagonal);
    let may_divide = has_near_junctions(&unjoined, &closedness(&unjoined), &distances);
    drop(unjoined);
    for ((share, distance), may_divide) in CLOSING_SHARES.into_iter().zip(distances).zip(may_divide)
    {
        let same = !may_divide && n_near(surface, distance) == 0;
        let mut outcome = match same {
            true => tried[0].clone(),
            false => try_closing(surface, Some(distance)).0,
        };
        (outcome.share, outcome.distance) = (share, distance);
        let closes = outcome.closes;
        tried.push(outcome);
        if closes {
            break;
        }
    }
    tried
}

/// The repaired surface and its outcome. The caller sets the outcome's share.
fn try_closing(surface: &Surface, weld: Option<f64>) -> (Closing, Surface) {
    let mut joined = surface.clone();
    let done = mend(&mut joined, weld, true);
    let found = closedness(&joined);
    let closes = found.is_closed() && joined.n_triangles() > 0;
    let outcome = Closing {
        share: 0.0,
        distance: 0.0,
        points_joined: done.points_joined,
        open_edges: found.open.len(),
        closes,
        defects_left: closes.then(|| validate(&joined).n_defects),
    };
    (outcome, joined)
}
