//! The segments along which a triangle is divided, divided where they cross each other.

use std::collections::{BTreeSet, HashMap};

use super::exact::{ExactPoint, Projection};
use tetdb_base::geom::Point;

/// Points and segments in a triangle. Points 0, 1, 2 are its corners; segments 0, 1, 2 its edges, each from corner k.
pub struct Arrangement {
    pub plane: Projection,
    pub points: Vec<ExactPoint>,
    /// Points by their rounded coordinates.
    at: HashMap<[u64; 3], Vec<u32>>,
    segments: Vec<[u32; 2]>,
    /// Points inside each segment.
    on: Vec<Vec<u32>>,
}

impl Arrangement {
    /// The triangle `t`, which must have area, with nothing in it.
    pub fn new(t: [Point; 3]) -> Self {
        let mut new = Self {
            plane: Projection::new(t),
            points: Vec::new(),
            at: HashMap::new(),
            segments: vec![[0, 1], [1, 2], [2, 0]],
            on: vec![Vec::new(); 3],
        };
        t.iter().for_each(|&p| _ = new.point(&p.into()));
        new
    }

    /// The three corners.
    pub fn corners(&self) -> [ExactPoint; 3] {
        [0, 1, 2].map(|k| self.points[k].clone())
    }

    /// The number of a point, which is added if new.
    fn point(&mut self, p: &ExactPoint) -> u32 {
        let key = (p.at + Point::ZERO).to_array().map(f64::to_bits);
        let known = self.at.entry(key).or_default();
        let equal = |&k: &&u32| self.points[*k as usize].compare(p).is_eq();
        if let Some(&k) = known.iter().find(equal) {
            return k;
        }
        known.push(self.points.len() as u32);
        self.points.push(p.clone());
        self.points.len() as u32 - 1
    }

    /// Adds a segment in the closed triangle; equal ends are a point.
    pub fn add(&mut self, [a, b]: &[ExactPoint; 2]) {
        let ends = [self.point(a), self.point(b)];
        self.segments.push(ends);
    }

    /// Finds the points at which segments cross or touch.
    pub fn divide(&mut self) {
        let mut seen = BTreeSet::new();
        self.segments.retain(|&[a, b]| seen.insert([a.min(b), a.max(b)]));
        self.on = vec![Vec::new(); self.segments.len()];
        let boxes: Vec<[Point; 2]> = (self.segments.iter())
            .map(|s| s.map(|p| self.points[p as usize].at))
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        let mut order: Vec<usize> = (0..boxes.len()).collect();
        order.sort_by(|&i, &j| boxes[i][0].x.total_cmp(&boxes[j][0].x).then(i.cmp(&j)));
        for (n, &i) in order.iter().enumerate() {
            let near = order[n + 1..].iter().take_while(|&&j| boxes[j][0].x <= boxes[i][1].x);
            for &j in near {
                let [p, q] = [boxes[i], boxes[j]];
                if p[0].cmple(q[1]).all() && q[0].cmple(p[1]).all() {
                    self.meet(i.min(j), i.max(j));
                }
            }
        }
    }

    /// Adds the common points of two segments to each.
    fn meet(&mut self, i: usize, j: usize) {
        let (s, t) = (self.segments[i], self.segments[j]);
        let turns = |s: [u32; 2], t: [u32; 2]| t.map(|e| self.turn(s[0], s[1], e));
        let (t_turns, s_turns) = (turns(s, t), turns(t, s));
        let mut touch = [(i, s, t, t_turns), (j, t, s, s_turns)].map(|(k, own, other, turns)| {
            let inside = |e: u32| {
                let [a, b, e] = [own[0], own[1], e].map(|p| &self.points[p as usize]);
                let (low, high) = if a.compare(b).is_lt() { (a, b) } else { (b, a) };
                low.compare(e).is_lt() && e.compare(high).is_lt()
            };
            let ends = [0, 1].into_iter().filter(|&e| turns[e] == 0 && inside(other[e]));
            (k, ends.map(|e| other[e]).collect::<Vec<u32>>())
        });
        if t_turns[0] * t_turns[1] < 0 && s_turns[0] * s_turns[1] < 0 {
            let [a, b, c, d] = [s[0], s[1], t[0], t[1]].map(|p| &self.points[p as usize]);
            let (a_value, b_value) = (self.plane.area(c, d, a), self.plane.area(c, d, b));
            let crossing = ExactPoint::between(a, b, &a_value, &b_value);
            let crossing = self.point(&crossing);
            touch.iter_mut().for_each(|(_, found)| found.push(crossing));
        }
        for (k, found) in touch {
            self.on[k].extend(found);
        }
    }

    /// The turn of three points.
    pub fn turn(&self, a: u32, b: u32, c: u32) -> i32 {
        let [a, b, c] = [a, b, c].map(|p| &self.points[p as usize]);
        self.plane.turn(a, b, c)
    }

    /// The points inside edge `k` of the triangle.
    pub fn on_edge(&self, k: usize) -> impl Iterator<Item = &ExactPoint> {
        self.on[k].iter().map(|&p| &self.points[p as usize])
    }

    /// Adds a point inside edge `k` of the triangle.
    pub fn add_on_edge(&mut self, k: usize, p: &ExactPoint) {
        let p = self.point(p);
        self.on[k].push(p);
    }

    /// Returns whether nothing divides the triangle.
    pub fn is_undivided(&self) -> bool {
        self.points.len() == 3
    }

    /// Pairs of points that are edges of the divided triangle, those on its own edges among them.
    pub fn edges(&self) -> BTreeSet<[u32; 2]> {
        let mut edges = BTreeSet::new();
        for (ends, on) in self.segments.iter().zip(&self.on) {
            let mut chain: Vec<u32> = ends.iter().chain(on).copied().collect();
            chain.sort_by(|&p, &q| self.points[p as usize].compare(&self.points[q as usize]));
            chain.dedup();
            edges.extend(chain.windows(2).map(|pair| [pair[0].min(pair[1]), pair[0].max(pair[1])]));
        }
        edges
    }
}
