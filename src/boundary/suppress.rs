//! A vertex on the surface is replaced by one vertex inside each volume around it.
//!
//! ```text
//!        c1--c2                      The faces of each facet at X form a fan. Without X the fan's outline is a
//!       / \  / \                     polygon in the facet's plane (for X on a segment, a' b' closes it), which has a
//!      a'--X---b'    facet 1         triangulation. The facets divide the ball of X into wedges. A point of a
//!       \ /  \ /                     wedge near X sees all outer faces of the wedge, as X does, and the polygons of
//!        d1--d2      facet 2         its two facets if it is inside their planes: an open cone at X, never empty.
//! ```
//! So in exact arithmetic there is always a place. It is taken as far from all planes as possible, rounded,
//! and accepted only if every exact sign is right. Before that, vertices that exist already are tried.
//!
//! Source: P.-L. George, H. Borouchaki and E. Saltel, "'Ultimate' robustness in meshing an arbitrary polyhedron",
//! International Journal for Numerical Methods in Engineering 58 (2003).

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use super::chain::Trouble;
use super::flips::Flipper;
use super::grow::{Grown, Obstacle};
use super::kernel::{HalfSpace, center};
use super::patch::Patch;
use super::polygon::triangulate;
use super::space::{Space, sorted};
use super::target::Target;
use super::walk::{ball, edge_at, swapped};
use crate::geom::Dyadic;
use crate::geom::Point;
use crate::mesh::FaceRef;
use crate::store::Pages;

/// A place nearer than this to the planes around it, in units of the wedge, is second choice.
const ROOM_MIN: f64 = 1e-3;

/// Required faces beyond a wedge that may be added to its bounds, one after the other.
const FIRM_MAX: usize = 24;

/// Times a place eight times nearer is looked for: to the last bits of a double.
const NEARER_MAX: i32 = 16;

/// Vertices of a wedge between which directions into it are looked for.
const WAYS_MAX: usize = 12;

/// Times an exact place is looked for half as far away.
const HALVES_MAX: usize = 400;

/// Coordinates of an exact place keep bits down to this share of its distance.
const FINE: f64 = 1.0 / 65536.0;

/// The facets of a patch and the faces that make them up.
#[derive(Default)]
pub(super) struct Skin {
    /// Corners of each facet.
    pub facets: Vec<[u32; 3]>,
    /// Sorted face to its facet and itself in the facet's direction.
    pub faces: HashMap<[u32; 3], (usize, [u32; 3])>,
}

/// The fan of one facet around the vertex.
struct Fan {
    facet: usize,
    /// In the facet's direction; open at the vertex if it lies on a segment.
    polygon: Vec<u32>,
    closed: bool,
}

/// Tetrahedra of the ball between the same facets.
struct Wedge {
    tets: Vec<u32>,
    /// Fans that bound it, and the sign of the side it is on.
    walls: Vec<(usize, bool)>,
}

/// The half-space behind a triangle; `None` when doubles see no normal.
pub(super) fn half_space([a, b, c]: [Point; 3]) -> Option<HalfSpace> {
    let normal = (b - a).cross(c - a).normalize_or_zero();
    (normal != Point::ZERO).then(|| HalfSpace {
        normal,
        offset: normal.dot(a),
    })
}

impl<P: Pages> Patch<'_, P> {
    /// Removes edges of `x` that are on no facet, as far as that goes: fewer faces to be seen.
    pub(super) fn thin_out(&mut self, x: u32) {
        loop {
            let ball = ball(self, x);
            let mut link: Vec<(u32, u32)> = Vec::new();
            for &t in &ball {
                link.extend(
                    self.tets_vertices(t)
                        .into_iter()
                        .filter(|&v| v != x)
                        .map(|v| (v, t)),
                );
            }
            link.sort_unstable();
            link.dedup_by_key(|l| l.0);
            let mut thinner = false;
            for (v, t) in link {
                // Mostly still where it was: finding it again takes signs of exact points.
                let Some(t) = edge_at(self, t, x, v) else {
                    continue;
                };
                let mut flipper = Flipper::new(self, Target::Free);
                flipper.work = 1;
                thinner |= flipper.remove_edge(t, x, v, 0);
            }
            if !thinner {
                return;
            }
        }
    }

    /// Takes vertex `x` off the surface. Returns the number of vertices that replace it.
    pub(super) fn suppress(&mut self, skin: &mut Skin, x: u32) -> Result<u32, Trouble> {
        self.thin_out(x);
        let ball = ball(self, x);
        let fans = self.fans(skin, x, &ball)?;
        if fans.is_empty() {
            return Ok(0);
        }
        if fans.len() == 1 && !fans[0].closed {
            return Err(Trouble::Broken("a segment with one facet"));
        }
        if self.collapse_on_surface(skin, x, &ball, &fans) {
            return Ok(0);
        }
        let mut faces = Vec::new();
        for fan in &fans {
            faces.push(self.fill_polygon(skin.facets[fan.facet], &fan.polygon, &ball)?);
        }
        let wedges = self.wedges(skin, x, &ball, &fans)?;
        let mut old = ball.clone();
        let mut taken: HashSet<u32> = ball.iter().copied().collect();
        let mut new = Vec::new();
        let mut added = 0;
        for wedge in &wedges {
            let walls: Vec<[u32; 3]> = wedge
                .walls
                .iter()
                .flat_map(|&(fan, above)| {
                    let turn =
                        move |&[p, q, r]: &[u32; 3]| if above { [p, q, r] } else { [q, p, r] };
                    faces[fan].iter().map(turn)
                })
                .collect();
            if let Some(mut quads) = self.join_to_link(x, wedge, &walls, &fans) {
                new.append(&mut quads);
                continue;
            }
            match self.join_to_new(x, wedge, &walls, &taken) {
                Some(mut grown) => {
                    added += 1;
                    new.append(&mut grown.quads);
                    taken.extend(grown.cavity.iter().copied());
                    old.extend(&grown.cavity[wedge.tets.len()..]);
                }
                None => {
                    return Err(Trouble::Precision(
                        "doubles leave no place between it and its neighbors",
                    ));
                }
            }
        }
        let ids = self.replace(&old, &new);
        self.renew_skin(skin, x, &fans, &faces, &ids);
        Ok(added)
    }

    /// Takes free vertex `x` away if one of its neighbors can stand for it.
    pub(super) fn remove_free(&mut self, x: u32) -> bool {
        let ball = ball(self, x);
        let link: HashSet<u32> = ball
            .iter()
            .flat_map(|&t| self.tets_vertices(t))
            .filter(|&v| v != x)
            .collect();
        let mut link: Vec<u32> = link.into_iter().collect();
        link.sort_unstable();
        let mut best: Option<(f64, Vec<[u32; 4]>)> = None;
        for u in link {
            let Some(quads) = self.moved(x, u, &ball) else {
                continue;
            };
            let worst = quads
                .iter()
                .map(|&q| self.flatness(q))
                .fold(f64::INFINITY, f64::min);
            if best.as_ref().is_none_or(|b| worst > b.0) {
                best = Some((worst, quads));
            }
        }
        match best {
            Some((worst, quads)) if worst > 0.0 => {
                self.replace(&ball, &quads);
                true
            }
            _ => false,
        }
    }

    fn tets_vertices(&mut self, t: u32) -> [u32; 4] {
        self.tet(t).vertices()
    }

    fn flatness(&mut self, q: [u32; 4]) -> f64 {
        let volume = self.orient(q);
        let p = q.map(|v| self.position(v));
        let longest = (0..4)
            .flat_map(|i| (0..i).map(move |j| (i, j)))
            .map(|(i, j)| p[i].distance(p[j]))
            .fold(0.0, f64::max);
        volume / (longest * longest * longest)
    }

    /// The ball with `x` moved to its neighbor `u`, if all volumes stay positive.
    fn moved(&mut self, x: u32, u: u32, ball: &[u32]) -> Option<Vec<[u32; 4]>> {
        let mut quads = Vec::new();
        for &t in ball {
            let tet = self.tet(t);
            if tet.local(u).is_none() {
                let q = swapped(&tet, tet.local(x)?, u);
                if self.orient(q) <= 0.0 {
                    return None;
                }
                quads.push(q);
            }
        }
        Some(quads)
    }

    /// The fans of the facets around `x`.
    fn fans(&mut self, skin: &Skin, x: u32, ball: &[u32]) -> Result<Vec<Fan>, Trouble> {
        let mut edges: BTreeMap<usize, BTreeMap<u32, u32>> = BTreeMap::new();
        for &t in ball {
            let tet = self.tet(t);
            for i in (0..4).filter(|&i| tet.vertex(i) != x && tet.is_required(i)) {
                let Some(&(facet, face)) = skin.faces.get(&sorted(tet.face(i))) else {
                    return Err(Trouble::Broken("a facet of another patch at a new vertex"));
                };
                let k = face
                    .iter()
                    .position(|&v| v == x)
                    .expect("a face of the ball");
                edges
                    .entry(facet)
                    .or_default()
                    .insert(face[(k + 1) % 3], face[(k + 2) % 3]);
            }
        }
        let mut fans = Vec::new();
        for (facet, next) in edges {
            let ends: HashSet<u32> = next.values().copied().collect();
            let start = next.keys().copied().find(|p| !ends.contains(p));
            let closed = start.is_none();
            let first = start.unwrap_or_else(|| *next.keys().next().expect("not empty"));
            let mut polygon = vec![first];
            let mut at = first;
            while let Some(&q) = next.get(&at) {
                if q == first || polygon.len() > next.len() {
                    break;
                }
                polygon.push(q);
                at = q;
            }
            if polygon.len() != next.len() + usize::from(!closed) {
                return Err(Trouble::Broken("a facet meets a vertex twice"));
            }
            fans.push(Fan {
                facet,
                polygon,
                closed,
            });
        }
        Ok(fans)
    }

    /// Moves `x` along the surface onto a vertex all fans share.
    fn collapse_on_surface(&mut self, skin: &mut Skin, x: u32, ball: &[u32], fans: &[Fan]) -> bool {
        let candidates: Vec<u32> = match fans {
            [fan] => fan.polygon.clone(),
            _ => vec![
                fans[0].polygon[0],
                *fans[0].polygon.last().expect("not empty"),
            ],
        };
        for u in candidates {
            let Some(quads) = self.moved(x, u, ball) else {
                continue;
            };
            let faces: Vec<Vec<[u32; 3]>> = fans
                .iter()
                .map(|fan| {
                    let n = fan.polygon.len();
                    let last = if fan.closed { n } else { n - 1 };
                    (0..last)
                        .map(|i| [u, fan.polygon[i], fan.polygon[(i + 1) % n]])
                        .filter(|f| f[1] != u && f[2] != u)
                        .collect()
                })
                .collect();
            let ids = self.replace(ball, &quads);
            self.renew_skin(skin, x, fans, &faces, &ids);
            return true;
        }
        false
    }

    /// The best triangulation of a polygon in the plane of a facet, in its direction.
    fn fill_polygon(
        &mut self,
        f: [u32; 3],
        polygon: &[u32],
        ball: &[u32],
    ) -> Result<Vec<[u32; 3]>, Trouble> {
        let mut off_plane = None;
        'search: for &t in ball {
            for v in self.tets_vertices(t) {
                let side = self.orient([f[0], f[1], f[2], v]);
                if side != 0.0 {
                    off_plane = Some((v, side.signum()));
                    break 'search;
                }
            }
        }
        let (w, side) = off_plane.ok_or(Trouble::Broken("a flat ball"))?;
        let n = polygon.len();
        let found = triangulate(
            n,
            |_, _| true,
            |i, k, j| {
                let [a, b, c] = [polygon[i], polygon[k], polygon[j]];
                let turn = self.orient([a, b, c, w]) * side;
                if turn <= 0.0 {
                    return 0.0;
                }
                let [p, q, r] = [a, b, c].map(|v| self.position(v));
                let longest = p
                    .distance_squared(q)
                    .max(q.distance_squared(r))
                    .max(r.distance_squared(p));
                ((q - p).cross(r - p).length() / longest).max(f64::MIN_POSITIVE)
            },
        );
        let triangles = found.ok_or(Trouble::Broken("a fan without outline"))?;
        Ok(triangles
            .into_iter()
            .map(|t| t.map(|i| polygon[i]))
            .collect())
    }

    fn wedges(
        &mut self,
        skin: &Skin,
        x: u32,
        ball: &[u32],
        fans: &[Fan],
    ) -> Result<Vec<Wedge>, Trouble> {
        let mut seen: HashSet<u32> = HashSet::new();
        let mut wedges = Vec::new();
        for &first in ball {
            if !seen.insert(first) {
                continue;
            }
            let mut wedge = Wedge {
                tets: vec![first],
                walls: Vec::new(),
            };
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
                return Err(Trouble::Broken("a facet does not separate its sides"));
            }
            wedges.push(wedge);
        }
        Ok(wedges)
    }

    /// The wedge and its walls joined to one of its own vertices.
    fn join_to_link(
        &mut self,
        x: u32,
        wedge: &Wedge,
        walls: &[[u32; 3]],
        fans: &[Fan],
    ) -> Option<Vec<[u32; 4]>> {
        let on_wall: HashSet<u32> = fans
            .iter()
            .flat_map(|f| f.polygon.iter().copied())
            .collect();
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

    /// The wedge and its walls joined to a new vertex inside; `taken` holds the ball and what other wedges took.
    fn join_to_new(
        &mut self,
        x: u32,
        wedge: &Wedge,
        walls: &[[u32; 3]],
        taken: &HashSet<u32>,
    ) -> Option<Grown> {
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
        let best = center(&planes, reach);
        let roomy = best.is_some_and(|d| {
            let room = planes.iter().map(|h| h.offset - h.normal.dot(d));
            room.fold(f64::INFINITY, f64::min) > ROOM_MIN * reach
        });
        let heart = self.heart(x, wedge);
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
                let Some(d) = center(&met, reach) else { break };
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
        proposals.extend(halves(heart, 24).map(|d| (d, true)));
        if let Some(d) = best {
            proposals.extend(halves(d, 45).map(|d| (d, false)));
        }
        proposals.extend(halves(heart, 45).map(|d| (d, false)));
        let found = proposals.into_iter().find_map(|(d, may_grow)| {
            self.join_at(x, wedge, walls, taken, origin + d, may_grow)
                .ok()
        });
        if found.is_some() || !self.effort.exact {
            return found;
        }
        let mut ways: Vec<Point> = best.into_iter().chain([heart]).collect();
        ways.extend(self.ways(x, wedge, walls));
        ways.into_iter()
            .find_map(|way| self.join_near(x, wedge, walls, way))
    }

    /// Directions into the cone between the walls: to vertices of the wedge, to the middle between two, and away from it.
    fn ways(&self, x: u32, wedge: &Wedge, walls: &[[u32; 3]]) -> Vec<Point> {
        let corners = wedge
            .tets
            .iter()
            .flat_map(|&t| self.tet_now(t).vertices())
            .chain(walls.iter().flatten().copied());
        let corners: BTreeSet<u32> = corners.filter(|&v| v != x).collect();
        let mut to: Vec<Point> = corners.iter().map(|&v| self.offset(x, v)).collect();
        to.retain(|&d| d.length() > 0.0);
        let n = to.len().min(WAYS_MAX);
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
    fn join_near(
        &mut self,
        x: u32,
        wedge: &Wedge,
        walls: &[[u32; 3]],
        mut way: Point,
    ) -> Option<Grown> {
        let from = self.exact_place(x);
        for _ in 0..HALVES_MAX {
            // Half of what is seen leaves room on both sides.
            way *= 0.5;
            let exact = from.moved(way, &Dyadic::from(way.length() * FINE));
            let p = self.add_vertex(exact.rounded(), Some(exact));
            let mut quads: Vec<[u32; 4]> = walls.iter().map(|&[a, b, c]| [a, b, c, p]).collect();
            // The walls lie in planes through `x`: a way behind one of them is behind it everywhere.
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
    fn join_at(
        &mut self,
        x: u32,
        wedge: &Wedge,
        walls: &[[u32; 3]],
        taken: &HashSet<u32>,
        place: Point,
        may_grow: bool,
    ) -> Result<Grown, Obstacle> {
        let p = self.add_vertex(place, None);
        let quads: Vec<[u32; 4]> = walls.iter().map(|&[a, b, c]| [a, b, c, p]).collect();
        let mut grown = Err(Obstacle::Other);
        if quads.iter().all(|&q| self.orient(q) > 0.0) {
            grown = if may_grow {
                let mut others = taken.clone();
                others.retain(|t| !wedge.tets.contains(t));
                self.grow(&wedge.tets, p, Some(x), walls, &others)
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
    fn join_all(&mut self, x: u32, wedge: &Wedge, p: u32) -> Option<Grown> {
        let quads = self.moved(x, p, &wedge.tets)?;
        Some(Grown {
            cavity: wedge.tets.clone(),
            quads,
        })
    }

    /// From `x` to the mean of the wedge's other vertices: a direction to try when the planes give none.
    fn heart(&mut self, x: u32, wedge: &Wedge) -> Point {
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

    /// Forgets the faces at `x`, marks the new ones.
    fn renew_skin(
        &mut self,
        skin: &mut Skin,
        x: u32,
        fans: &[Fan],
        faces: &[Vec<[u32; 3]>],
        ids: &[u32],
    ) {
        for fan in fans {
            let n = fan.polygon.len();
            let last = if fan.closed { n } else { n - 1 };
            for i in 0..last {
                let old = sorted([x, fan.polygon[i], fan.polygon[(i + 1) % n]]);
                skin.faces.remove(&old);
            }
        }
        for (fan, faces) in fans.iter().zip(faces) {
            for &face in faces {
                skin.faces.insert(sorted(face), (fan.facet, face));
            }
        }
        self.require_known(skin, ids);
    }

    /// Marks the faces of `tets` that are in the skin.
    pub(super) fn require_known(&mut self, skin: &Skin, tets: &[u32]) {
        for &t in tets {
            let tet = self.tet(t);
            for i in 0..4 {
                if !tet.is_required(i) && skin.faces.contains_key(&sorted(tet.face(i))) {
                    self.require(FaceRef::new(t, i));
                }
            }
        }
    }
}
