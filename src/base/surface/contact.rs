//! Contacts of two triangles, by exact signs.

use std::fmt;

use robust::Coord;

use crate::geom::{Point, orient};

/// The kinds of contact between two triangles that should not touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ContactKind {
    /// An edge of one goes through the inside of the other.
    Crossing,
    /// They lie in one plane and share an area.
    CoplanarOverlap,
    /// Two edges cross, or lie along each other.
    EdgeOnEdge,
    /// A vertex of one lies inside the other.
    VertexOnFace,
    /// A vertex of one lies on an edge of the other: a T-junction.
    VertexOnEdge,
}

impl ContactKind {
    /// The word for this kind.
    pub fn word(self) -> &'static str {
        match self {
            Self::Crossing => "crossing",
            Self::CoplanarOverlap => "coplanar-overlap",
            Self::EdgeOnEdge => "edge-on-edge",
            Self::VertexOnFace => "vertex-on-face",
            Self::VertexOnEdge => "vertex-on-edge",
        }
    }
}

impl fmt::Display for ContactKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Crossing => "they cross",
            Self::CoplanarOverlap => "they overlap in one plane",
            Self::EdgeOnEdge => "an edge of one touches an edge of the other",
            Self::VertexOnFace => "a vertex of one lies on the other (T-junction)",
            Self::VertexOnEdge => "a vertex of one lies on an edge of the other (T-junction)",
        })
    }
}

/// A contact of two triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Kind of the contact.
    pub kind: ContactKind,
    /// A point of the contact; rounded, unless it is a vertex.
    pub at: Point,
}

/// Returns whether triangles `p` and `q` touch elsewhere than in the vertices and the edge they share, and how.
///
/// `p_ids` and `q_ids` are the vertices' ids; equal ids mean equal points and the reverse. Both triangles must have
/// area. Triangles of the same three vertices give `None`: they are duplicates. The answer is exact; if several kinds
/// apply, the first in the order of [`ContactKind`] is given. The tests depend on the number of shared vertices. None:
/// every edge against the other triangle. One: the edge opposite to it, because the two cuts with the common line both
/// begin at that vertex. Two: whether the triangles lie in one plane on one side of the edge.
pub fn contact(p: [Point; 3], p_ids: [u32; 3], q: [Point; 3], q_ids: [u32; 3]) -> Option<Contact> {
    let mut shared = [(0, 0); 3];
    let mut n = 0;
    for (i, id) in p_ids.iter().enumerate() {
        if let Some(j) = q_ids.iter().position(|other| other == id) {
            shared[n] = (i, j);
            n += 1;
        }
    }
    match n {
        0 => apart(p, q),
        1 => {
            let (i, j) = shared[0];
            let rotate = |t: [Point; 3], k: usize| [t[k], t[(k + 1) % 3], t[(k + 2) % 3]];
            at_vertex(rotate(p, i), rotate(q, j))
        }
        2 => {
            let [(i, j), (k, l), _] = shared;
            at_edge([p[i], p[k], p[3 - i - k]], q[3 - j - l])
        }
        _ => None,
    }
}

/// Returns whether the closed triangle `t` and the closed triangle, edge or point `s` share a point.
///
/// `t` must have area; the corners of `s` may be equal or in line. The answer is exact.
pub fn meets(t: &[Point; 3], s: &[Point; 3]) -> bool {
    let sides = s.map(|x| side(t, x));
    if one_side(sides) {
        return false;
    }
    let meets = |[a, b]: [Point; 2], [x, y]: [i8; 2], of| edge_meets(a, b, x, y, of).is_some();
    let ring = [[0, 1], [1, 2], [2, 0]];
    if ring.iter().any(|&[k, l]| meets([s[k], s[l]], [sides[k], sides[l]], t)) {
        return true;
    }
    if Projection::new(s).turn(s[0], s[1], s[2]) == 0 {
        return false;
    }
    let sides = t.map(|x| side(s, x));
    ring.iter().any(|&[k, l]| meets([t[k], t[l]], [sides[k], sides[l]], s))
}

/// The side of the plane of `t` on which `x` lies: 1, 0 or −1.
#[inline]
pub(super) fn side(t: &[Point; 3], x: Point) -> i8 {
    let [a, b, c] = *t;
    // Four points of an axis-parallel plane are common in generated surfaces. They skip the expansions, which would
    // always be reached, because the determinant is zero.
    let flat = a.cmpeq(b) & b.cmpeq(c) & c.cmpeq(x);
    if flat.any() {
        return 0;
    }
    sign(orient(a, b, c, x))
}

#[inline]
fn sign(x: f64) -> i8 {
    i8::from(x > 0.0) - i8::from(x < 0.0)
}

fn one_side(signs: [i8; 3]) -> bool {
    signs == [1; 3] || signs == [-1; 3]
}

fn worse(a: Option<Contact>, b: Option<Contact>) -> Option<Contact> {
    match (a, b) {
        (Some(x), Some(y)) => Some(if y.kind < x.kind { y } else { x }),
        (x, y) => x.or(y),
    }
}

/// No shared vertex.
fn apart(p: [Point; 3], q: [Point; 3]) -> Option<Contact> {
    let q_sides = q.map(|x| side(&p, x));
    if one_side(q_sides) {
        return None;
    }
    if q_sides == [0; 3] {
        return in_plane(&p, &q);
    }
    let p_sides = p.map(|x| side(&q, x));
    if one_side(p_sides) {
        return None;
    }
    let mut found = None;
    for k in 0..3 {
        let l = (k + 1) % 3;
        found = worse(found, edge_meets(q[k], q[l], q_sides[k], q_sides[l], &p));
        found = worse(found, edge_meets(p[k], p[l], p_sides[k], p_sides[l], &q));
    }
    found
}

/// The first vertices are one.
fn at_vertex(p: [Point; 3], q: [Point; 3]) -> Option<Contact> {
    let (c, d) = (side(&p, q[1]), side(&p, q[2]));
    if c * d > 0 {
        return None;
    }
    if (c, d) == (0, 0) {
        let plane = Projection::new(&p);
        if plane.are_corners_apart(&p, &q) {
            return None;
        }
        let touch = worse(segment_in_plane(q[1], q[2], &p), segment_in_plane(p[1], p[2], &q))?;
        return Some(match plane.separation(&p, &q) {
            Separation::None => Contact { kind: ContactKind::CoplanarOverlap, at: touch.at },
            _ => touch,
        });
    }
    let (a, b) = (side(&q, p[1]), side(&q, p[2]));
    if a * b > 0 {
        return None;
    }
    worse(edge_meets(q[1], q[2], c, d, &p), edge_meets(p[1], p[2], a, b, &q))
}

/// The other triangle has the first two vertices of `p` and the apex `y`.
fn at_edge(p: [Point; 3], y: Point) -> Option<Contact> {
    if side(&p, y) != 0 {
        return None;
    }
    let plane = Projection::new(&p);
    let [u, v, x] = p;
    let overlap = plane.turn(u, v, x) * plane.turn(u, v, y) > 0;
    overlap.then(|| Contact { kind: ContactKind::CoplanarOverlap, at: (u + v + y) / 3.0 })
}

/// The closed edge `a b`, its ends on the given sides of the plane of `t`, against the closed `t`.
pub(super) fn edge_meets(
    a: Point,
    b: Point,
    a_side: i8,
    b_side: i8,
    t: &[Point; 3],
) -> Option<Contact> {
    if a_side * b_side > 0 {
        return None;
    }
    if (a_side, b_side) == (0, 0) {
        return segment_in_plane(a, b, t);
    }
    // The line a b passes each edge of t on the same hand when it goes through the triangle.
    let turns = [0, 1, 2].map(|k| sign(orient(a, b, t[k], t[(k + 1) % 3])));
    if turns.contains(&1) && turns.contains(&-1) {
        return None;
    }
    let n_on_edges = turns.iter().filter(|&&s| s == 0).count();
    let end_on_plane = a_side == 0 || b_side == 0;
    let kind = match (end_on_plane, n_on_edges) {
        (true, 0) => ContactKind::VertexOnFace,
        (false, 0) => ContactKind::Crossing,
        (false, 1) => ContactKind::EdgeOnEdge,
        _ => ContactKind::VertexOnEdge,
    };
    let at = match (a_side, b_side) {
        (0, _) => a,
        (_, 0) => b,
        _ => {
            let (x, y) = (orient(t[0], t[1], t[2], a).abs(), orient(t[0], t[1], t[2], b).abs());
            a + (b - a) * (x / (x + y))
        }
    };
    Some(Contact { kind, at })
}

/// Separation of two coplanar triangles by a line through an edge of one.
#[derive(Clone, Copy, PartialEq)]
enum Separation {
    /// With nothing on the line.
    Strict,
    /// With contact on the line.
    Weak,
    None,
}

/// A projection along an axis that keeps the triangles of one plane from collapsing.
#[derive(Clone, Copy)]
pub(super) struct Projection {
    axis: usize,
}

impl Projection {
    /// A projection for the plane of `t`, which must have area.
    pub fn new(t: &[Point; 3]) -> Self {
        let normal = (t[1] - t[0]).cross(t[2] - t[0]).abs().to_array();
        let best = (0..3).max_by(|&i, &j| normal[i].total_cmp(&normal[j])).unwrap_or(2);
        let mut axes = [best, (best + 1) % 3, (best + 2) % 3].into_iter().map(|axis| Self { axis });
        axes.find(|plane| plane.turn(t[0], t[1], t[2]) != 0).unwrap_or(Self { axis: best })
    }

    fn flat(self, p: Point) -> Coord<f64> {
        match self.axis {
            0 => Coord { x: p.y, y: p.z },
            1 => Coord { x: p.z, y: p.x },
            _ => Coord { x: p.x, y: p.y },
        }
    }

    /// 1 when `a b c` turn to the left, exactly.
    pub fn turn(self, a: Point, b: Point, c: Point) -> i8 {
        sign(robust::orient2d(self.flat(a), self.flat(b), self.flat(c)))
    }

    /// Returns whether two triangles of one plane with the same first vertex share nothing else: no side of either's corner there is in the
    /// other's. Most that share a vertex in an even wall do not, and this costs a third of looking for contacts.
    fn are_corners_apart(self, p: &[Point; 3], q: &[Point; 3]) -> bool {
        let is_apart = |t: &[Point; 3], other: &[Point; 3]| {
            let hand = self.turn(t[0], t[1], t[2]);
            let holds = |x: Point| {
                hand * self.turn(t[0], t[1], x) >= 0 && hand * self.turn(t[0], x, t[2]) >= 0
            };
            !holds(other[1]) && !holds(other[2])
        };
        is_apart(p, q) && is_apart(q, p)
    }

    fn separation(self, p: &[Point; 3], q: &[Point; 3]) -> Separation {
        let mut found = Separation::None;
        for (t, other) in [(p, q), (q, p)] {
            let hand = self.turn(t[0], t[1], t[2]);
            for k in 0..3 {
                let sides = other.map(|x| hand * self.turn(t[k], t[(k + 1) % 3], x));
                if sides.iter().all(|&s| s < 0) {
                    return Separation::Strict;
                }
                if sides.iter().all(|&s| s <= 0) {
                    found = Separation::Weak;
                }
            }
        }
        found
    }

    /// Turns of `x` about the edges of `t`, positive inside.
    pub fn turns_about(self, t: &[Point; 3], x: Point) -> [i8; 3] {
        let hand = self.turn(t[0], t[1], t[2]);
        [0, 1, 2].map(|k| hand * self.turn(t[k], t[(k + 1) % 3], x))
    }
}

/// Two triangles of one plane without a shared vertex.
fn in_plane(p: &[Point; 3], q: &[Point; 3]) -> Option<Contact> {
    let separation = Projection::new(p).separation(p, q);
    if separation == Separation::Strict {
        return None;
    }
    let mut touch = None;
    for k in 0..3 {
        touch = worse(touch, segment_in_plane(q[k], q[(k + 1) % 3], p));
        touch = worse(touch, segment_in_plane(p[k], p[(k + 1) % 3], q));
    }
    let at = touch.map_or(p[0], |c| c.at);
    let kind = if separation == Separation::None {
        ContactKind::CoplanarOverlap
    } else {
        ContactKind::VertexOnEdge
    };
    Some(Contact { kind, at })
}

/// The closed segment `a b` in the plane of `t` against the closed `t`.
pub(super) fn segment_in_plane(a: Point, b: Point, t: &[Point; 3]) -> Option<Contact> {
    let plane = Projection::new(t);
    let (about_a, about_b) = (plane.turns_about(t, a), plane.turns_about(t, b));
    let mut found = None;
    for (x, about) in [(a, about_a), (b, about_b)] {
        if about.iter().all(|&s| s >= 0) {
            let kind = if about.contains(&0) {
                ContactKind::VertexOnEdge
            } else {
                ContactKind::VertexOnFace
            };
            found = worse(found, Some(Contact { kind, at: x }));
        }
    }
    let turns = t.map(|x| plane.turn(a, b, x));
    for k in 0..3 {
        let l = (k + 1) % 3;
        if turns[k] == 0 && a.min(b).cmple(t[k]).all() && t[k].cmple(a.max(b)).all() {
            found = worse(found, Some(Contact { kind: ContactKind::VertexOnEdge, at: t[k] }));
        }
        if turns[k] * turns[l] < 0 && about_a[k] * about_b[k] < 0 {
            let at = plane.crossing(a, b, t[k], t[l]);
            found = worse(found, Some(Contact { kind: ContactKind::EdgeOnEdge, at }));
        }
    }
    found
}

impl Projection {
    /// The rounded point where `a b` crosses the line `c d`.
    pub fn crossing(self, a: Point, b: Point, c: Point, d: Point) -> Point {
        let area = |x| robust::orient2d(self.flat(c), self.flat(d), self.flat(x)).abs();
        let (x, y) = (area(a), area(b));
        a + (b - a) * (x / (x + y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::mix;

    #[test]
    fn corners_are_apart_when_the_triangles_share_their_vertex_alone() {
        let at = |k: u64| (mix(k) % 7) as f64 - 3.0;
        let point = |k: u64| Point::new(at(k), at(k + 1), at(k) - 2.0 * at(k + 1));
        let mut n_apart = 0;
        for k in 0..20_000u64 {
            let [p, q] = [8 * k, 8 * k + 4].map(|k| [Point::ZERO, point(k), point(k + 2)]);
            let has_area = |t: &[Point; 3]| t[1].cross(t[2]) != Point::ZERO;
            if !has_area(&p) || !has_area(&q) {
                continue;
            }
            let touch = worse(segment_in_plane(q[1], q[2], &p), segment_in_plane(p[1], p[2], &q));
            let apart = Projection::new(&p).are_corners_apart(&p, &q);
            assert_eq!(apart, touch.is_none(), "{p:?} {q:?}");
            n_apart += u32::from(apart);
        }
        assert!((2_000..18_000).contains(&n_apart), "{n_apart}");
    }
}
