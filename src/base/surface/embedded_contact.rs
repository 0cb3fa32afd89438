//! Contacts of embedded edges and points with triangles and other edges, by exact signs.

use super::contact::{Contact, ContactKind, Projection, edge_meets, segment_in_plane, side};
use crate::geom::{Point, orient};

/// An edge with the numbers of its vertices; equal numbers mean equal points and the reverse.
#[derive(Clone, Copy)]
pub(super) struct EmbeddedEdge {
    pub ids: [u32; 2],
    pub ends: [Point; 2],
}

/// Relation of an edge to a triangle.
pub(super) enum EdgeAtTriangle {
    /// They share at most a vertex.
    Apart,
    /// The edge is a side of the triangle.
    Side,
    /// They have a forbidden contact.
    Touching(Contact),
}

/// Returns whether `t` has an area, without which the signs below mean nothing.
pub(super) fn has_area(t: &[Point; 3]) -> bool {
    Projection::new(t).turn(t[0], t[1], t[2]) != 0
}

impl EmbeddedEdge {
    /// The vertex shared with another set of vertices, as places in both, when there is one alone.
    fn shared(&self, others: &[u32]) -> Vec<(usize, usize)> {
        let places = self.ids.iter().enumerate();
        let place = |(i, id)| Some((i, others.iter().position(|other| other == id)?));
        places.filter_map(place).collect()
    }

    /// Relation of the edge to triangle `t`, which must have an area.
    pub fn at_triangle(&self, t: [Point; 3], t_ids: [u32; 3]) -> EdgeAtTriangle {
        let [a, b] = self.ends;
        let touch = match self.shared(&t_ids).as_slice() {
            [] => match [a, b].map(|x| side(&t, x)) {
                [0, 0] => segment_in_plane(a, b, &t),
                [at_a, at_b] => edge_meets(a, b, at_a, at_b, &t),
            },
            &[(i, k)] => leaves_into(self.ends[1 - i], [t[k], t[(k + 1) % 3], t[(k + 2) % 3]]),
            _ => return EdgeAtTriangle::Side,
        };
        touch.map_or(EdgeAtTriangle::Apart, EdgeAtTriangle::Touching)
    }

    /// A contact with another edge outside a common vertex. Edges of the same vertices give none.
    pub fn at_edge(&self, other: &Self) -> Option<Contact> {
        let ([a, b], [c, d]) = (self.ends, other.ends);
        let found = |kind, at| Some(Contact { kind, at });
        match self.shared(&other.ids).as_slice() {
            [] => {}
            &[(i, k)] => {
                let (from, x, y) = (self.ends[i], self.ends[1 - i], other.ends[1 - k]);
                // In line, and to the same side of the vertex: differences of doubles have the right sign.
                let is_back = (x - from).cmpgt(Point::ZERO) == (y - from).cmpgt(Point::ZERO)
                    && (x - from).cmplt(Point::ZERO) == (y - from).cmplt(Point::ZERO);
                let is_overlap = is_back && !has_area(&[from, x, y]);
                return is_overlap
                    .then_some(Contact { kind: ContactKind::EdgeOnEdge, at: from.midpoint(x) });
            }
            _ => return None,
        }
        if orient(a, b, c, d) != 0.0 {
            return None;
        }
        let Some(third) = [c, d].into_iter().find(|&x| has_area(&[a, b, x])) else {
            // All in one line.
            let (low, high) = (a.min(b), a.max(b));
            let is_on = |x: Point| low.cmple(x).all() && x.cmple(high).all();
            let covered = c.min(d).cmple(a).all() && a.cmple(c.max(d)).all();
            let at = [c, d].into_iter().find(|&x| is_on(x));
            return at.or(covered.then_some(a)).and_then(|at| found(ContactKind::EdgeOnEdge, at));
        };
        let plane = Projection::new(&[a, b, third]);
        let [of_c, of_d] = [c, d].map(|x| plane.turn(a, b, x));
        let [of_a, of_b] = [a, b].map(|x| plane.turn(c, d, x));
        if of_c * of_d > 0 || of_a * of_b > 0 {
            return None;
        }
        let ends = [(of_c, c), (of_d, d), (of_a, a), (of_b, b)];
        match ends.into_iter().find(|(turn, _)| *turn == 0) {
            Some((_, at)) => found(ContactKind::VertexOnEdge, at),
            None => found(ContactKind::EdgeOnEdge, plane.crossing(a, b, c, d)),
        }
    }
}

/// Returns whether the edge from the first corner of `t` to `x` lies in the plane of `t` and goes into it, or along its side.
fn leaves_into(x: Point, t: [Point; 3]) -> Option<Contact> {
    if side(&t, x) != 0 {
        return None;
    }
    let plane = Projection::new(&t);
    let hand = plane.turn(t[0], t[1], t[2]);
    let turns = [plane.turn(t[0], t[1], x), plane.turn(t[0], x, t[2])].map(|turn| hand * turn);
    let kind = match turns.contains(&0) {
        true => ContactKind::EdgeOnEdge,
        false => ContactKind::CoplanarOverlap,
    };
    let at = t[0].midpoint(x);
    turns.iter().all(|&turn| turn >= 0).then_some(Contact { kind, at })
}

/// The contact of `p`, which is no corner of `t`, with `t`.
pub(super) fn point_at_triangle(p: Point, t: &[Point; 3]) -> Option<Contact> {
    match side(t, p) {
        0 => segment_in_plane(p, p, t),
        _ => None,
    }
}

/// Returns whether `p`, which is no end of it, lies on an edge.
pub(super) fn is_on_edge(p: Point, [a, b]: [Point; 2]) -> bool {
    a.min(b).cmple(p).all() && p.cmple(a.max(b)).all() && !has_area(&[a, b, p])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::mix;

    type Whole = [i64; 3];

    fn cross(a: Whole, b: Whole) -> Whole {
        [0, 1, 2].map(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3])
    }

    fn dot(a: Whole, b: Whole) -> i64 {
        a.iter().zip(b).map(|(x, y)| x * y).sum()
    }

    fn less(a: Whole, b: Whole) -> Whole {
        [0, 1, 2].map(|i| a[i] - b[i])
    }

    /// Returns whether two closed edges between whole points share a point, by solving for it.
    fn share_a_point([p, a]: [Whole; 2], [q, b]: [Whole; 2]) -> bool {
        let (u, v, w) = (less(a, p), less(b, q), less(q, p));
        let n = cross(u, v);
        if n != [0; 3] {
            let within = |x: i64| (0..=dot(n, n)).contains(&x);
            return dot(w, n) == 0 && within(dot(cross(w, v), n)) && within(dot(cross(w, u), n));
        }
        let at = |x: Whole| dot(less(x, p), u);
        let (low, high) = (at(q).min(at(b)), at(q).max(at(b)));
        cross(w, u) == [0; 3] && low <= dot(u, u) && high >= 0
    }

    #[test]
    fn edges_touch_where_an_equation_says_so() {
        let whole = |k: u64| [0, 1, 2].map(|i| (mix(k ^ i << 40) % 4) as i64);
        let point = |p: Whole| Point::from_array(p.map(|x| x as f64));
        let mut counts = [0; 2];
        for k in 0..200_000u64 {
            let p = [0, 1, 2, 3].map(|i| whole(4 * k + i));
            // Equal points have equal numbers.
            let id = |i: usize| {
                p.iter().position(|q| *q == p[i]).map(|at| at as u32).unwrap_or_default()
            };
            let edge = |i: usize, j: usize| EmbeddedEdge {
                ids: [id(i), id(j)],
                ends: [point(p[i]), point(p[j])],
            };
            if p[0] == p[1] || p[2] == p[3] {
                continue;
            }
            let ids = [edge(0, 1).ids, edge(2, 3).ids];
            let shared: Vec<u32> = ids[0].into_iter().filter(|v| ids[1].contains(v)).collect();
            let expected = match shared[..] {
                [] => share_a_point([p[0], p[1]], [p[2], p[3]]),
                [v] => {
                    let others = ids.map(|ends| ends.into_iter().find(|&w| w != v).unwrap_or(v));
                    let [x, y] = others.map(|w| less(p[w as usize], p[v as usize]));
                    cross(x, y) == [0; 3] && dot(x, y) > 0
                }
                _ => false,
            };
            assert_eq!(edge(0, 1).at_edge(&edge(2, 3)).is_some(), expected, "{p:?}");
            counts[usize::from(expected)] += 1;
        }
        assert!(counts.iter().all(|&n| n > 5_000), "{counts:?}");
    }

    #[test]
    fn points_of_triangles_and_edges_are_found() {
        let t = [Point::ZERO, Point::new(4.0, 0.0, 2.0), Point::new(0.0, 4.0, 2.0)];
        assert!(
            point_at_triangle(Point::new(1.0, 1.0, 1.0), &t)
                .is_some_and(|c| c.kind == ContactKind::VertexOnFace)
        );
        assert!(
            point_at_triangle(Point::new(2.0, 2.0, 2.0), &t)
                .is_some_and(|c| c.kind == ContactKind::VertexOnEdge)
        );
        assert!(point_at_triangle(Point::new(3.0, 3.0, 3.0), &t).is_none());
        assert!(point_at_triangle(Point::new(1.0, 1.0, 1.000_000_1), &t).is_none());
        assert!(is_on_edge(Point::new(2.0, 0.0, 1.0), [t[0], t[1]]));
        assert!(!is_on_edge(Point::new(6.0, 0.0, 3.0), [t[0], t[1]]));
        let edge = |a, b| EmbeddedEdge { ids: [0, 9], ends: [a, b] };
        let own = [0, 1, 2];
        let kind = |b: Point| match edge(t[0], b).at_triangle(t, own) {
            EdgeAtTriangle::Touching(c) => Some(c.kind),
            _ => None,
        };
        assert_eq!(kind(Point::new(1.0, 1.0, 1.0)), Some(ContactKind::CoplanarOverlap));
        assert_eq!(kind(Point::new(2.0, 0.0, 1.0)), Some(ContactKind::EdgeOnEdge));
        assert_eq!(kind(Point::new(-1.0, -1.0, -1.0)), None);
        assert_eq!(kind(Point::new(1.0, 1.0, 5.0)), None);
    }
}
