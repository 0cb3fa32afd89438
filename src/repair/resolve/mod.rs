//! Crossing triangles divided where they cross.
//!
//! ```text
//!      pairs of triangles that touch      `tetdb_base::surface::pairs_that_touch`
//!   -> what each pair has in common       `meeting`: exact points, `exact`
//!   -> segments in each triangle          `arrangement`: divided where they cross each other
//!   -> triangles of its points            `triangulation`: the segments are edges
//!   -> points rounded once, then again from the start until no pair is left
//! ```
//!
//! All signs and comparisons are exact until a point is rounded to doubles, which may join it to a vertex some 1e-15 away. Rounding turns
//! the pieces of a triangle by some 1e-16 of the size, so that new pairs may touch; that is what the rounds are for.

mod arrangement;
mod exact;
mod meeting;
mod near;
mod triangulation;

#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, HashMap};

use rayon::prelude::*;

use arrangement::Arrangement;
use exact::ExactPoint;
use meeting::{Meeting, clipped, meeting};
use near::NearVertices;
use tetdb_base::geom::{Point, counted, short};
use tetdb_base::storage::{ScratchSpace, check_cancelled, parallel};
use tetdb_base::surface::{
    Contact, Merged, PAIRS_MAX, Surface, drop_folds, drop_unused_points, merge_repeated,
    pairs_that_touch, replace_triangles,
};
use triangulation::triangulate;

/// Rounds at most. Surfaces of real files take two or three; with more, a knot of needles is beyond doubles.
const ROUNDS_MAX: usize = 12;
/// A fold lower than this share of the diagonal is rounding, and is dropped where it closed on itself.
const FOLD_SHARE: f64 = 1e-12;
/// Pairs grow at most to this many times those at first. Where they grow, rounding makes more than dividing resolves.
const GROWTH_MAX: u64 = 4;
const GROWTH_LEAST: u64 = 200;
/// Triangles handled between two looks at whether the run is cancelled.
const AT_ONCE: usize = 1 << 12;
/// Places listed at most.
const LISTED_MAX: usize = 16;

/// What [`resolve`] did.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Resolved {
    /// Pairs of triangles that touched where they should not, before anything was divided.
    pub pairs: u64,
    /// Triangles divided; pieces that were divided again count again.
    pub divided: usize,
    /// Vertices added.
    pub points_added: usize,
    /// Rounds of dividing; 0 where nothing was to be done.
    pub rounds: usize,
    /// The longest distance, in input units, between a point of an intersection and the vertex it became.
    pub moved_most: f64,
    /// Triangles without area that were dropped, folds of rounding among them.
    pub collapsed_dropped: usize,
    /// Triangles that were joined with one of the same vertices and direction, which is in the groups of both.
    pub merged: usize,
}

/// Crossings that cannot be resolved.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ResolveError {
    /// So many triangles touch that their pairs are not even counted.
    #[error("more than {PAIRS_MAX} pairs of triangles cross or touch")]
    TooMany,
    /// Rounding made new crossings in every round.
    #[error("{n} pairs of triangles still cross after {rounds} rounds of dividing, the first of them {}", places[0].kind)]
    Unsettled {
        /// Pairs that are left.
        n: u64,
        /// Rounds done.
        rounds: usize,
        /// Some of the places; one at least.
        places: Vec<Contact>,
    },
}

/// Divides triangles along their intersections, until none touch but in the vertices and edges they share.
///
/// Pieces have the label of their triangle and take its place in the order. Triangles that touch no other and have no divided edge
/// keep their vertices. Triangles without area are dropped, and those repeated in one direction are merged. Effects: new vertices
/// follow the old ones. Memory: 300 bytes for each triangle of a pair and some kilobytes for each pair. A scratch file that fails
/// unwinds, as a cancelled run does ([`attempt`](tetdb_base::storage::attempt)).
///
/// # Errors
/// [`ResolveError`]; the surface is then between two rounds.
pub fn resolve(surface: &mut Surface, scratch: &ScratchSpace) -> Result<Resolved, ResolveError> {
    let mut done = Resolved::default();
    let n_points = surface.n_vertices();
    loop {
        done.merge(surface);
        if done.rounds > 0 {
            done.collapsed_dropped += drop_folds(surface, FOLD_SHARE * surface.bounds().diagonal());
        }
        check_cancelled();
        let pairs = pairs_that_touch(surface, scratch).ok_or(ResolveError::TooMany)?;
        let n = pairs.len() as u64;
        if done.rounds == 0 {
            done.pairs = n;
        }
        if n == 0 {
            done.points_added = surface.n_vertices().saturating_sub(n_points);
            return Ok(done);
        }
        if done.rounds == ROUNDS_MAX || n > GROWTH_MAX * done.pairs + GROWTH_LEAST {
            let places = pairs.iter().take(LISTED_MAX).map(|(_, contact)| *contact).collect();
            return Err(ResolveError::Unsettled { n, rounds: done.rounds, places });
        }
        done.rounds += 1;
        round(surface, &pairs, &mut done);
    }
}

impl Resolved {
    /// The counts in words.
    pub fn in_words(&self) -> String {
        let mut text = counted(self.pairs, "[pair|pairs] of triangles met where they should not; ");
        text += &counted(self.divided as u64, "[triangle was|triangles were] divided, ");
        text += &counted(self.points_added as u64, "[vertex was|vertices were] added");
        text += &format!(", none farther than {} from its exact place", short(self.moved_most));
        for (n, what) in [
            (self.merged, "repeated [triangle was|triangles were] merged"),
            (self.collapsed_dropped, "[triangle|triangles] without area [was|were] dropped"),
        ] {
            if n > 0 {
                text += &format!(", {}", counted(n as u64, what));
            }
        }
        text
    }

    fn merge(&mut self, surface: &mut Surface) {
        let Merged { collapsed, repeated } = merge_repeated(surface);
        self.collapsed_dropped += collapsed;
        self.merged += repeated;
    }
}

/// `work` on all items in order, on all threads; a cancelled run unwinds.
fn all<T: Sync, U: Send>(items: &[T], work: impl Fn(&T) -> U + Sync) -> Vec<U> {
    let mut results = Vec::with_capacity(items.len());
    for some in items.chunks(AT_ONCE) {
        check_cancelled();
        results.extend(parallel(|| some.par_iter().map(&work).collect::<Vec<U>>()));
    }
    results
}

/// Divides the triangles of all pairs once.
fn round(surface: &mut Surface, pairs: &[([u32; 2], Contact)], done: &mut Resolved) {
    let meetings = all(pairs, |([p, q], _)| meeting(surface.corners(*p), surface.corners(*q)));
    let mut of_triangle: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (k, (pair, _)) in pairs.iter().enumerate() {
        pair.iter().for_each(|t| of_triangle.entry(*t).or_default().push(k));
    }
    let touched: Vec<(u32, Vec<usize>)> = of_triangle.into_iter().collect();
    let arrangements = all(&touched, |(t, own)| {
        let mut arrangement = Arrangement::new(surface.corners(*t));
        let (corners, plane) = (arrangement.corners(), arrangement.plane);
        for &k in own {
            let [p, q] = pairs[k].0;
            match &meetings[k] {
                Meeting::Along(ends) => arrangement.add(ends),
                Meeting::Coplanar => {
                    let other = surface.corners(if p == *t { q } else { p });
                    for k in 0..3 {
                        let (a, b) = (other[k], other[(k + 1) % 3]);
                        if let Some(ends) = clipped(a, b, &corners, &plane) {
                            arrangement.add(&ends);
                        }
                    }
                }
                Meeting::Apart => {}
            }
        }
        arrangement.divide();
        arrangement
    });
    let touched = touched.into_iter().map(|(t, _)| t);
    let mut divided: BTreeMap<u32, Arrangement> = touched.zip(arrangements).collect();
    share_edges(surface, &mut divided);
    divided.retain(|_, arrangement| !arrangement.is_undivided());
    replace(surface, divided, done);
}

/// The edges of a triangle, each with its lower vertex first.
fn edges_of([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)])
}

/// Gives all triangles at a divided edge the points on it.
fn share_edges(surface: &Surface, divided: &mut BTreeMap<u32, Arrangement>) {
    let mut on_edges: HashMap<[u32; 2], Vec<ExactPoint>> = HashMap::new();
    for (&t, arrangement) in divided.iter() {
        for (k, edge) in edges_of(surface.triangles[t as usize]).into_iter().enumerate() {
            for p in arrangement.on_edge(k) {
                let known = on_edges.entry(edge).or_default();
                if !known.iter().any(|q| q.compare(p).is_eq()) {
                    known.push(p.clone());
                }
            }
        }
    }
    for (t, triangle) in (0u32..).zip(&surface.triangles) {
        for (k, edge) in edges_of(*triangle).into_iter().enumerate() {
            for p in on_edges.get(&edge).into_iter().flatten() {
                let new = || Arrangement::new(surface.corners(t));
                divided.entry(t).or_insert_with(new).add_on_edge(k, p);
            }
        }
    }
}

/// Replaces divided triangles by their pieces, and rounds the points.
fn replace(surface: &mut Surface, divided: BTreeMap<u32, Arrangement>, done: &mut Resolved) {
    let divided: Vec<(u32, Arrangement)> = divided.into_iter().collect();
    let triangulated = all(&divided, |(_, arrangement)| {
        let places = arrangement.points[3..].iter().map(|p| (p.at + Point::ZERO, p.distance(p.at)));
        (triangulate(arrangement), places.collect::<Vec<_>>())
    });
    let mut near = NearVertices::new(surface);
    for v in divided.iter().flat_map(|(t, _)| surface.triangles[*t as usize]) {
        near.add(v, surface.points[v as usize]);
    }
    let mut pieces: HashMap<u32, Vec<[u32; 3]>> = HashMap::new();
    let mut is_short = false;
    for ((t, _), (triangles, places)) in divided.iter().zip(triangulated) {
        let mut ids = surface.triangles[*t as usize].to_vec();
        for (at, moved) in places {
            let (v, distance) = near.find_or_add(at, &mut surface.points);
            done.moved_most = done.moved_most.max(moved + distance);
            ids.push(v);
        }
        let mut kept = triangles;
        kept.iter_mut().for_each(|t| *t = t.map(|p| ids[p as usize]));
        let n = kept.len();
        kept.retain(|[a, b, c]| a != b && b != c && c != a);
        is_short |= kept.len() < n;
        done.divided += usize::from(kept.len() > 1);
        pieces.insert(*t, kept);
    }
    // A wall given from both sides is divided as its first triangle is.
    let key = |triangle: [u32; 3]| {
        let mut key = triangle;
        key.sort_unstable();
        key
    };
    let by_vertices: HashMap<[u32; 3], u32> =
        divided.iter().map(|(t, _)| (key(surface.triangles[*t as usize]), *t)).rev().collect();
    let triangles = surface.triangles.clone();
    replace_triangles(surface, |t, triangle, out| {
        let first = by_vertices.get(&key(triangle)).copied();
        let Some(own) = first.and_then(|first| pieces.get(&first)) else {
            out.push(triangle);
            return;
        };
        let is_turned =
            first.is_some_and(|first| !same_direction(triangles[first as usize], triangle));
        out.extend(own.iter().map(|&[a, b, c]| if is_turned { [a, c, b] } else { [a, b, c] }));
        debug_assert!(first.is_some_and(|first| first <= t));
    });
    if is_short {
        drop_unused_points(surface);
    }
}

/// Returns whether two triangles of the same vertices run alike.
fn same_direction(a: [u32; 3], [x, y, z]: [u32; 3]) -> bool {
    [[x, y, z], [y, z, x], [z, x, y]].contains(&a)
}
