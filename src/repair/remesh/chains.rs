//! Curves that are kept: feature edges, borders of labels, edges with more or fewer than two triangles.

use tetdb_base::geom::{IdMap, Point};

use super::mesh::{EdgeKey, Mesh, Span, VertexKind, edge};

/// A curve of the input between two corners, or round to its start.
pub struct Chain {
    points: Vec<Point>,
    /// Length of the curve up to each point.
    along: Vec<f64>,
}

impl Chain {
    fn new(points: Vec<Point>) -> Self {
        let mut length = 0.0;
        let mut along = vec![0.0];
        for pair in points.windows(2) {
            length += pair[0].distance(pair[1]);
            along.push(length);
        }
        Self { points, along }
    }

    /// Length of the curve.
    pub fn length(&self) -> f64 {
        self.along.last().copied().unwrap_or(0.0)
    }

    /// Returns whether it runs round.
    pub fn is_closed(&self) -> bool {
        self.points.first() == self.points.last()
    }

    /// Returns whether two curves have an end in common.
    pub fn meets(&self, other: &Self) -> bool {
        let ends = |chain: &Self| [chain.points[0], chain.points[chain.points.len() - 1]];
        ends(self).iter().any(|p| ends(other).contains(p))
    }

    /// The point at a length.
    pub fn point(&self, at: f64) -> Point {
        let i = self.along.partition_point(|&x| x <= at).clamp(1, self.points.len() - 1);
        let (x, y) = (self.along[i - 1], self.along[i]);
        let t = if y > x { ((at - x) / (y - x)).clamp(0.0, 1.0) } else { 0.0 };
        self.points[i - 1] + (self.points[i] - self.points[i - 1]) * t
    }

    /// Greatest distance of the curve between two lengths from the segment `a b`, whose ends are the curve's there.
    ///
    /// It bounds the distance of the segment from the curve as well: the feet of the curve's points cover the segment.
    pub fn deviation(&self, from: f64, to: f64, a: Point, b: Point) -> f64 {
        let (low, high) = (from.min(to), from.max(to));
        let first = self.along.partition_point(|&x| x <= low);
        let last = self.along.partition_point(|&x| x < high);
        let between = self.points[first..last.max(first)].iter();
        between.map(|&p| distance_to_segment(p, a, b)).fold(0.0, f64::max)
    }

    /// Longest pieces whose chords stay within `deviation` of the curve, one after the other from its start.
    pub fn chords(&self, deviation: f64) -> Vec<(f64, f64)> {
        let mut chords = Vec::new();
        let mut i = 0;
        while i + 1 < self.points.len() {
            let mut j = i + 1;
            while j + 1 < self.points.len()
                && self.deviation(
                    self.along[i],
                    self.along[j + 1],
                    self.points[i],
                    self.points[j + 1],
                ) <= deviation
            {
                j += 1;
            }
            chords.push((self.along[i], self.along[j]));
            i = j;
        }
        chords
    }
}

fn distance_to_segment(p: Point, a: Point, b: Point) -> f64 {
    let along = b - a;
    let t = (p - a).dot(along) / along.length_squared();
    p.distance(a + along * if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.0 })
}

/// Joins the kept edges of `mesh` to chains and sets the kinds of its vertices. `turn_cos`: cosine of the turn that makes a corner.
pub fn build(mesh: &mut Mesh, kept: &[EdgeKey], turn_cos: f64) -> Vec<Chain> {
    let mut at_vertex: IdMap<u32, Vec<u32>> = IdMap::default();
    for &(a, b) in kept {
        at_vertex.entry(a).or_default().push(b);
        at_vertex.entry(b).or_default().push(a);
    }
    let point = |mesh: &Mesh, v: u32| mesh.points[v as usize];
    for v in 0..mesh.points.len() as u32 {
        let kind = match at_vertex.get(&v).map(Vec::as_slice) {
            None => VertexKind::Free,
            Some(&[a, b]) => {
                let (x, y) = (point(mesh, v) - point(mesh, a), point(mesh, b) - point(mesh, v));
                match x.dot(y) < turn_cos * x.length() * y.length() {
                    true => VertexKind::Corner,
                    false => VertexKind::Curve,
                }
            }
            Some(_) => VertexKind::Corner,
        };
        let is_one_fan = mesh.is_one_fan(v);
        mesh.kinds[v as usize] = if is_one_fan { kind } else { VertexKind::Corner };
    }
    let mut chains = Vec::new();
    // Those with corners first, then those that run round, from their smallest vertex.
    for corners_only in [true, false] {
        for &(a, b) in kept {
            for (from, to) in [(a, b), (b, a)] {
                let is_corner = mesh.kinds[from as usize] == VertexKind::Corner;
                if is_corner == corners_only && !mesh.features.contains_key(&edge(from, to)) {
                    mesh.kinds[from as usize] = VertexKind::Corner;
                    chains.push(walk(mesh, &at_vertex, from, to, chains.len() as u32));
                }
            }
        }
    }
    chains
}

fn walk(mesh: &mut Mesh, at_vertex: &IdMap<u32, Vec<u32>>, from: u32, to: u32, id: u32) -> Chain {
    let mut vertices = vec![from, to];
    let (mut before, mut v) = (from, to);
    while mesh.kinds[v as usize] == VertexKind::Curve {
        let [a, b] = at_vertex[&v][..] else { break };
        (before, v) = (v, if a == before { b } else { a });
        vertices.push(v);
    }
    let chain = Chain::new(vertices.iter().map(|&v| mesh.points[v as usize]).collect());
    for (k, pair) in vertices.windows(2).enumerate() {
        let ends = [(pair[0], chain.along[k]), (pair[1], chain.along[k + 1])];
        mesh.features.insert(edge(pair[0], pair[1]), Span::new(id, ends[0], ends[1]));
    }
    chain
}
