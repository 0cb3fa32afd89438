//! Wedges of a ball between facets, and places in them for a vertex that sees all faces.

use std::collections::BTreeSet;

use super::chain::PatchFailure;
use super::complex::{TetComplex, sorted};
use super::free_vertex::moved;
use super::grow::{GrownCavity, Obstacle, grow};
use super::inscribed_ball::{ball_center, clearance};
use super::patch::RecoveryPatch;
use super::suppress::{CavitySkin, Fan, half_space};
use super::walk::swapped;
use tetdb_base::geom::{Dyadic, IdSet, Point};
use tetdb_base::storage::Pages;

/// A place nearer than this to the planes around it, in units of the wedge, is second choice.
const CLEARANCE_MIN: f64 = 1e-3;

/// Required faces beyond a wedge that may be added to its bounds, one after the other.
const FIRM_MAX: usize = 24;

/// Times a place eight times nearer is looked for: to the last bits of a double.
const NEARER_MAX: i32 = 16;

/// Vertices of a wedge between which directions into it are looked for.
const DIRECTIONS_MAX: usize = 12;

/// Times an exact place is looked for half as far away.
const HALVES_MAX: usize = 400;

/// Coordinates of an exact place keep bits down to this share of its distance.
const FINE: f64 = 1.0 / 65536.0;

/// Tetrahedra of the ball between the same facets.
pub(super) struct Wedge {
    pub tets: Vec<u32>,
    /// Fans that bound it, and the sign of the side it is on.
    pub walls: Vec<(usize, bool)>,
}

impl<P: Pages> RecoveryPatch<'_, P> {
    pub(super) fn wedges(
        &mut self,
        skin: &CavitySkin,
        x: u32,
        ball: &[u32],
        fans: &[Fan],
    ) -> Result<Vec<Wedge>, PatchFailure> {
        let mut seen: IdSet<u32> = IdSet::default();
        let mut wedges = Vec::new();
        for &first in ball {
            if !seen.insert(first) {
                continue;
            }
            let mut wedge = Wedge { tets: vec![first], walls: Vec::new() };
            let mut next = 0;
            while next < wedge.tets.len() {
                let t = wedge.tets[next];
                next += 1;
                let tet = self.tet(t);
                for i in (0..4).filter(|&i| tet.vertex(i) != x) {
                    if !tet.is_required(i) {
                        let across = self.across(t, i);
                        if seen.insert(across.tet()) {
                            wedge.tets.push(across.tet());
                        }
                        continue;
                    }
                    let facet = skin.faces[&sorted(tet.face(i))].0;
                    let f = skin.facets[facet];
                    let above = self.orient([f[0], f[1], f[2], tet.vertex(i)]) > 0.0;
                    let fan = fans
                        .iter()
                        .position(|fan| fan.facet == facet)
                        .expect("fans were made from these faces");
                    if !wedge.walls.contains(&(fan, above)) {
                        wedge.walls.push((fan, above));
                    }
                }
            }
            let both = |&(fan, above): &(usize, bool)| wedge.walls.contains(&(fan, !above));
            if wedge.walls.iter().any(both) {
                return Err(PatchFailure::Broken("a facet does not separate its sides"));
            }
            wedges.push(wedge);
        }
        Ok(wedges)
    }

    /// The wedge and its walls joined to one of its own vertices.
    pub(super) fn join_to_link(
        &mut self,
        x: u32,
        wedge: &Wedge,
        walls: &[[u32; 3]],
        fans: &[Fan],
    ) -> Option<Vec<[u32; 4]>> {
        let on_wall: IdSet<u32> = fans.iter().flat_map(|f| f.polygon.iter().copied()).collect();
        let mut candidates: Vec<u32> = wedge
            .tets
            .iter()
            .flat_map(|&t| self.tets_vertices(t))
            .filter(|v| *v != x && !on_wall.contains(v))
            .collect();
        candidates.sort_unstable();
        candidates.dedup();
        'next: for u in candidates {
            let mut quads = Vec::new();
            for &t in &wedge.tets {
                let tet = self.tet(t);
                if tet.local(u).is_none() {
                    quads.push(swapped(&tet, tet.local(x)?, u));
                }
            }
            quads.extend(walls.iter().map(|&[p, q, r]| [p, q, r, u]));
            for &q in &quads {
                if self.orient(q) <= 0.0 {
                    continue 'next;
                }
            }
            return Some(quads);
        }
        None
    }

    /// The wedge and its walls joined to a new vertex inside; `taken` has the ball and the tetrahedra of other wedges.
    pub(super) fn join_to_new(
        &mut self,
        x: u32,
        wedge: &Wedge,
        walls: &[[u32; 3]],
        taken: &IdSet<u32>,
    ) -> Option<GrownCavity> {
        let origin = self.position(x);
        let mut reach = 0.0f64;
        let mut planes = Vec::new();
        // Planes that no growth can pass: the walls and required faces.
        let mut firm = Vec::new();
        let mut plane = |corners: [Point; 3], is_firm: bool| {
            reach = corners.iter().map(|c| c.length()).fold(reach, f64::max);
            if let Some(half) = half_space(corners) {
                planes.push(half);
                if is_firm {
                    firm.push(half);
                }
            }
        };
        for &t in &wedge.tets {
            let tet = self.tet(t);
            let i = tet.local(x)?;
            let corners = tet.face(i).map(|v| self.offset(x, v));
            plane(corners, tet.is_required(i));
        }
        for &[p, q, r] in walls {
            // Seen from inside counter-clockwise, so the outward normal is reversed.
            plane([q, p, r].map(|v| self.offset(x, v)), true);
        }
        let mut proposals: Vec<(Point, bool)> = Vec::new();
        let best = ball_center(&planes, reach);
        let roomy = best.is_some_and(|d| clearance(&planes, d) > CLEARANCE_MIN * reach);
        let mean_direction = self.mean_direction(x, wedge);
        let halves = |d: Point, n: i32| (0..n).map(move |k| d * 0.5f64.powi(k));
        if let Some(d) = best.filter(|_| roomy) {
            proposals.push((d, false));
        }
        // Required faces met beyond the wedge bound the place as well, and are found by meeting them. Far from `x` they may
        // leave no place together; nearer, fewer are met.
        for nearer in 0..NEARER_MAX {
            let reach = reach * 0.125f64.powi(nearer);
            let mut met = firm.clone();
            for _ in 0..FIRM_MAX {
                let Some(d) = ball_center(&met, reach) else { break };
                match self.join_at(x, wedge, walls, taken, origin + d, true) {
                    Ok(grown) => return Some(grown),
                    Err(Obstacle::Required(face)) => {
                        met.extend(half_space(face.map(|v| self.offset(x, v))));
                    }
                    Err(Obstacle::Other) => {
                        proposals.extend(halves(d, 24).map(|d| (d, true)));
                        break;
                    }
                }
            }
        }
        proposals.extend(halves(mean_direction, 24).map(|d| (d, true)));
        if let Some(d) = best {
            proposals.extend(halves(d, 45).map(|d| (d, false)));
        }
        proposals.extend(halves(mean_direction, 45).map(|d| (d, false)));
        let found = proposals.into_iter().find_map(|(d, may_grow)| {
            self.join_at(x, wedge, walls, taken, origin + d, may_grow).ok()
        });
        if found.is_some() || !self.effort.exact {
            return found;
        }
        let mut directions: Vec<Point> = best.into_iter().chain([mean_direction]).collect();
        directions.extend(self.directions(x, wedge, walls));
        directions.into_iter().find_map(|way| self.join_near(x, wedge, walls, way))
    }

    /// Directions into the cone between the walls: to vertices of the wedge, to the middle between two, and away from it.
    fn directions(&self, x: u32, wedge: &Wedge, walls: &[[u32; 3]]) -> Vec<Point> {
        let corners = wedge
            .tets
            .iter()
            .flat_map(|&t| self.tet_now(t).vertices())
            .chain(walls.iter().flatten().copied());
        let corners: BTreeSet<u32> = corners.filter(|&v| v != x).collect();
        let mut to: Vec<Point> = corners.iter().map(|&v| self.offset(x, v)).collect();
        to.retain(|&d| d.length() > 0.0);
        let n = to.len().min(DIRECTIONS_MAX);
        for i in 0..n {
            for j in 0..i {
                let between = to[i].normalize() + to[j].normalize();
                let size = to[i].length().min(to[j].length());
                to.extend([between * size, between * -size]);
            }
        }
        to
    }

    /// The wedge and its walls joined to a new vertex as near to `x` as it takes, which is kept exact.
    pub(super) fn join_near(
        &mut self,
        x: u32,
        wedge: &Wedge,
        walls: &[[u32; 3]],
        mut way: Point,
    ) -> Option<GrownCavity> {
        let from = self.exact_place(x);
        for _ in 0..HALVES_MAX {
            // Half of the visible distance leaves clearance on both sides.
            way *= 0.5;
            let exact = from.moved(way, &Dyadic::from(way.length() * FINE));
            let p = self.add_vertex(exact.rounded(), Some(exact));
            let mut quads: Vec<[u32; 4]> = walls.iter().map(|&[a, b, c]| [a, b, c, p]).collect();
            // The walls lie in planes through `x`: a direction behind one of them is behind it everywhere.
            let between_walls = quads.iter().all(|&q| self.orient(q) > 0.0);
            let grown = between_walls.then(|| self.join_all(x, wedge, p));
            if let Some(Some(mut grown)) = grown {
                grown.quads.append(&mut quads);
                return Some(grown);
            }
            self.drop_vertex(p);
            if !between_walls {
                break;
            }
        }
        None
    }

    /// The wedge and its walls joined to a new vertex at `place`.
    pub(super) fn join_at(
        &mut self,
        x: u32,
        wedge: &Wedge,
        walls: &[[u32; 3]],
        taken: &IdSet<u32>,
        place: Point,
        may_grow: bool,
    ) -> Result<GrownCavity, Obstacle> {
        let p = self.add_vertex(place, None);
        let quads: Vec<[u32; 4]> = walls.iter().map(|&[a, b, c]| [a, b, c, p]).collect();
        let mut grown = Err(Obstacle::Other);
        if quads.iter().all(|&q| self.orient(q) > 0.0) {
            grown = if may_grow {
                let mut others = taken.clone();
                others.retain(|t| !wedge.tets.contains(t));
                grow(self, &wedge.tets, p, Some(x), walls, &others)
                    .and_then(GrownCavity::without_lost_vertices)
            } else {
                self.join_all(x, wedge, p).ok_or(Obstacle::Other)
            };
        }
        match &mut grown {
            Ok(grown) => grown.quads.extend(quads),
            Err(_) => self.drop_vertex(p),
        }
        grown
    }

    /// The wedge with `x` moved to `p`, if all volumes stay positive.
    pub(super) fn join_all(&mut self, x: u32, wedge: &Wedge, p: u32) -> Option<GrownCavity> {
        let quads = moved(self, x, p, &wedge.tets, &mut 0)?;
        Some(GrownCavity { cavity: wedge.tets.clone(), quads, lost: Vec::new() })
    }

    /// From `x` to the mean of the wedge's other vertices: a direction to try when the planes give none.
    fn mean_direction(&mut self, x: u32, wedge: &Wedge) -> Point {
        let mut sum = Point::ZERO;
        let mut n = 0.0;
        for &t in &wedge.tets {
            for v in self.tets_vertices(t) {
                if v != x {
                    sum += self.offset(x, v);
                    n += 1.0;
                }
            }
        }
        sum / n
    }
}
