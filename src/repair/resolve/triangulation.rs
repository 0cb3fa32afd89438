//! Triangles of the points in a triangle, with given edges among theirs; every sign is exact.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use super::arrangement::Arrangement;
use robust::Coord;
use tetdb_base::geom::Point;

/// Flips at most for each edge while triangles get better shapes. These are found from rounded points, which could go in circles.
const FLIPS_MAX: usize = 64;

/// Triangles of the points of an arrangement.
struct Triangulation<'a> {
    of: &'a Arrangement,
    /// From the vertices of an edge, in the direction of its triangle, to the third vertex.
    apex: BTreeMap<[u32; 2], u32>,
    /// The points in the triangle's plane, rounded, to choose between triangles.
    flat: Vec<Coord<f64>>,
}

/// The triangles of an arrangement, in the direction of its triangle; sorted, each from its lowest number.
pub fn triangulate(of: &Arrangement) -> Vec<[u32; 3]> {
    let edges = of.edges();
    let corners = of.corners().map(|p| p.at);
    let across = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
    let x = (corners[1] - corners[0]).normalize_or_zero();
    let y = across.cross(x);
    let flat = |p: Point| Coord { x: (p - corners[0]).dot(x), y: (p - corners[0]).dot(y) };
    let flat = of.points.iter().map(|p| flat(p.at)).collect();
    let mut new = Triangulation { of, apex: BTreeMap::new(), flat };
    new.add([0, 1, 2]);
    let mut start = [0, 1];
    for p in 3..of.points.len() as u32 {
        start = new.insert(p, start);
    }
    let none = BTreeSet::new();
    new.improve(&none);
    for &edge in &edges {
        new.force(edge);
    }
    new.improve(&edges);
    let is_first = |&(&[a, b], &c): &(&[u32; 2], &u32)| a < b && a < c;
    new.apex.iter().filter(is_first).map(|(&[a, b], &c)| [a, b, c]).collect()
}

impl Triangulation<'_> {
    fn add(&mut self, [a, b, c]: [u32; 3]) {
        for (edge, apex) in [([a, b], c), ([b, c], a), ([c, a], b)] {
            self.apex.insert(edge, apex);
        }
    }

    fn remove(&mut self, [a, b, c]: [u32; 3]) {
        for edge in [[a, b], [b, c], [c, a]] {
            self.apex.remove(&edge);
        }
    }

    fn turn(&self, a: u32, b: u32, c: u32) -> i32 {
        self.of.turn(a, b, c)
    }

    /// Divides the triangle that holds point `p`, or the two at the edge that does. `start` is an edge to search from; returns another.
    fn insert(&mut self, p: u32, start: [u32; 2]) -> [u32; 2] {
        let [a, b, c] = self.triangle_at(p, start);
        let edge = [[a, b, c], [b, c, a], [c, a, b]];
        match edge.into_iter().find(|&[a, b, _]| self.turn(a, b, p) == 0) {
            None => {
                self.remove([a, b, c]);
                edge.into_iter().for_each(|[a, b, _]| self.add([a, b, p]));
                [a, b]
            }
            Some([a, b, c]) => {
                let beyond = self.apex.get(&[b, a]).copied();
                self.remove([a, b, c]);
                self.add([a, p, c]);
                self.add([p, b, c]);
                if let Some(d) = beyond {
                    self.remove([b, a, d]);
                    self.add([b, p, d]);
                    self.add([p, a, d]);
                }
                [b, c]
            }
        }
    }

    /// A triangle that holds point `p`, found by walking from an edge.
    fn triangle_at(&self, p: u32, start: [u32; 2]) -> [u32; 3] {
        let mut edge = start;
        for _ in 0..self.apex.len() {
            let ([a, b], Some(&c)) = (edge, self.apex.get(&edge)) else {
                break;
            };
            let mut sides = [[a, b], [b, c], [c, a]].into_iter();
            match sides.find(|&[a, b]| self.turn(a, b, p) < 0) {
                None => return [a, b, c],
                Some([a, b]) => edge = [b, a],
            }
        }
        let holds = |[a, b, c]: [u32; 3]| {
            [[a, b], [b, c], [c, a]].into_iter().all(|[a, b]| self.turn(a, b, p) >= 0)
        };
        let all = self.apex.iter().map(|(&[a, b], &c)| [a, b, c]);
        all.into_iter().find(|&t| holds(t)).expect("the point lies in the triangle that is divided")
    }

    /// The other two corners at an inner edge if the four corners are strictly convex.
    fn convex(&self, [a, b]: [u32; 2]) -> Option<[u32; 2]> {
        let (&c, &d) = (self.apex.get(&[a, b])?, self.apex.get(&[b, a])?);
        (self.turn(a, d, c) > 0 && self.turn(d, b, c) > 0).then_some([c, d])
    }

    fn flip(&mut self, [a, b]: [u32; 2], [c, d]: [u32; 2]) {
        self.remove([a, b, c]);
        self.remove([b, a, d]);
        self.add([a, d, c]);
        self.add([d, b, c]);
    }

    /// Makes an edge appear. S. W. Sloan, "A fast algorithm for generating constrained Delaunay triangulations", 1993.
    fn force(&mut self, [a, b]: [u32; 2]) {
        let mut crossed = self.crossed([a, b]);
        let mut left = 16 + crossed.len() * crossed.len() * 4;
        while let Some([u, v]) = crossed.pop_front() {
            left = left.saturating_sub(1);
            if left == 0 {
                // Exact signs let every edge appear; validation would see a missing one.
                debug_assert!(false, "edge {a} {b} does not appear");
                return;
            }
            let Some([c, d]) = self.convex([u, v]) else {
                crossed.push_back([u, v]);
                continue;
            };
            self.flip([u, v], [c, d]);
            if self.turn(a, b, c) * self.turn(a, b, d) < 0 {
                crossed.push_back([c, d]);
            }
        }
    }

    /// The edges that cross the segment of two points, in order; none if it is an edge.
    fn crossed(&self, [a, b]: [u32; 2]) -> VecDeque<[u32; 2]> {
        let mut crossed = VecDeque::new();
        if self.apex.contains_key(&[a, b]) || self.apex.contains_key(&[b, a]) {
            return crossed;
        }
        let around = self.apex.range([a, 0]..=[a, u32::MAX]);
        let first = around
            .into_iter()
            .find(|&(&[_, u], &v)| self.turn(a, u, b) > 0 && self.turn(a, b, v) > 0);
        let Some((&[_, mut u], &(mut v))) = first else {
            debug_assert!(false, "no triangle at {a} towards {b}");
            return crossed;
        };
        loop {
            crossed.push_back([u, v]);
            match self.apex.get(&[v, u]) {
                Some(&w) if w != b => match self.turn(a, b, w) > 0 {
                    true => v = w,
                    false => u = w,
                },
                _ => return crossed,
            }
        }
    }

    /// Flips edges that are not `fixed` until the triangles are Delaunay, as far as rounded points tell.
    fn improve(&mut self, fixed: &BTreeSet<[u32; 2]>) {
        let mut queue: VecDeque<[u32; 2]> =
            self.apex.keys().filter(|[a, b]| a < b).copied().collect();
        let mut left = FLIPS_MAX * queue.len();
        while let Some([a, b]) = queue.pop_front() {
            if fixed.contains(&[a, b]) {
                continue;
            }
            let Some([c, d]) = self.convex([a, b]) else {
                continue;
            };
            let [p, q, r, s] = [a, b, c, d].map(|v| self.flat[v as usize]);
            if robust::incircle(p, q, r, s) <= 0.0 {
                continue;
            }
            self.flip([a, b], [c, d]);
            let around = [[a, d], [d, b], [b, c], [c, a]];
            queue.extend(around.map(|[a, b]| [a.min(b), a.max(b)]));
            left -= 1;
            if left == 0 {
                return;
            }
        }
    }
}
