//! The surface while it changes: triangles, those around each vertex, and the kept edges.

use tetdb_base::geom::{IdMap, Point};

/// An edge as its vertices, the smaller first.
pub type EdgeKey = (u32, u32);

/// The key of the edge between two vertices.
pub fn edge(a: u32, b: u32) -> EdgeKey {
    (a.min(b), a.max(b))
}

/// The part of a curve that an edge stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// Number of the chain.
    pub chain: u32,
    /// Lengths along it at the edge's smaller and larger vertex.
    pub at: [f64; 2],
}

impl Span {
    /// Length along the chain at vertex `v` of the edge `key`.
    pub fn at_vertex(&self, key: EdgeKey, v: u32) -> f64 {
        self.at[usize::from(v != key.0)]
    }

    /// The part of a chain for the edge from `a` at length `x` to `b` at length `y`.
    pub fn new(chain: u32, (a, x): (u32, f64), (b, y): (u32, f64)) -> Self {
        Self { chain, at: if a < b { [x, y] } else { [y, x] } }
    }
}

/// What a vertex may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VertexKind {
    /// It moves on the surface.
    Free,
    /// It moves along a kept curve.
    Curve,
    /// It stays.
    Corner,
}

/// Triangles and their neighborhood. A removed triangle has no place in `around`, and `is_alive` is false.
pub struct Mesh {
    /// Positions.
    pub points: Vec<Point>,
    /// Vertices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Label of each triangle.
    pub labels: Vec<u32>,
    /// False for a removed triangle.
    pub is_alive: Vec<bool>,
    /// Triangles at each vertex.
    pub around: Vec<Vec<u32>>,
    /// Kind of each vertex.
    pub kinds: Vec<VertexKind>,
    /// Kept edges.
    pub features: IdMap<EdgeKey, Span>,
    /// Triangles of each label.
    pub n_of_label: Vec<u32>,
    /// Numbers of removed triangles, for those to come.
    free: Vec<u32>,
}

impl Mesh {
    /// A mesh without kept edges.
    pub fn new(points: Vec<Point>, triangles: Vec<[u32; 3]>, labels: Vec<u32>) -> Self {
        let mut around = vec![Vec::new(); points.len()];
        for (t, triangle) in (0u32..).zip(&triangles) {
            triangle.iter().for_each(|&v| around[v as usize].push(t));
        }
        let mut n_of_label = vec![0; labels.iter().map(|&l| l as usize + 1).max().unwrap_or(0)];
        labels.iter().for_each(|&l| n_of_label[l as usize] += 1);
        Self {
            is_alive: vec![true; triangles.len()],
            kinds: vec![VertexKind::Free; points.len()],
            features: IdMap::default(),
            points,
            triangles,
            labels,
            around,
            n_of_label,
            free: Vec::new(),
        }
    }

    /// Corners of triangle `t`.
    pub fn corners(&self, t: u32) -> [Point; 3] {
        self.triangles[t as usize].map(|v| self.points[v as usize])
    }

    /// Numbers of the triangles there are.
    pub fn alive(&self) -> impl Iterator<Item = u32> {
        (0..self.triangles.len() as u32).filter(|&t| self.is_alive[t as usize])
    }

    /// Triangles at the edge between two vertices.
    pub fn at_edge(&self, a: u32, b: u32) -> Vec<u32> {
        let has = |t: &&u32| self.triangles[**t as usize].contains(&b);
        self.around[a as usize].iter().filter(has).copied().collect()
    }

    /// The third vertex of a triangle at an edge.
    pub fn apex(&self, t: u32, a: u32, b: u32) -> u32 {
        let [x, y, z] = self.triangles[t as usize];
        x ^ y ^ z ^ a ^ b
    }

    /// Vertices joined to `v` by an edge, ascending.
    pub fn neighbors(&self, v: u32) -> Vec<u32> {
        let around = self.around[v as usize].iter();
        let mut all: Vec<u32> =
            around.flat_map(|&t| self.triangles[t as usize]).filter(|&u| u != v).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Edges of the triangles there are, ascending.
    pub fn edges(&self) -> Vec<EdgeKey> {
        let of = |t: u32| {
            let [a, b, c] = self.triangles[t as usize];
            [edge(a, b), edge(b, c), edge(c, a)]
        };
        let mut all: Vec<EdgeKey> = self.alive().flat_map(of).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// The kept edges at a vertex: the other ends, ascending.
    pub fn kept_at(&self, v: u32) -> Vec<u32> {
        let mut all = self.neighbors(v);
        all.retain(|&u| self.features.contains_key(&edge(u, v)));
        all
    }

    /// Returns whether the triangles at a vertex hang together through edges at it.
    pub fn is_one_fan(&self, v: u32) -> bool {
        let around = &self.around[v as usize];
        let Some(&first) = around.first() else { return true };
        let (mut seen, mut stack) = (vec![first], vec![first]);
        while let Some(t) = stack.pop() {
            for u in self.triangles[t as usize].into_iter().filter(|&u| u != v) {
                for &s in around {
                    if self.triangles[s as usize].contains(&u) && !seen.contains(&s) {
                        seen.push(s);
                        stack.push(s);
                    }
                }
            }
        }
        seen.len() == around.len()
    }

    /// Adds a triangle.
    pub fn add(&mut self, triangle: [u32; 3], label: u32) -> u32 {
        let t = match self.free.pop() {
            Some(t) => {
                let i = t as usize;
                (self.triangles[i], self.labels[i], self.is_alive[i]) = (triangle, label, true);
                t
            }
            None => {
                self.triangles.push(triangle);
                self.labels.push(label);
                self.is_alive.push(true);
                self.triangles.len() as u32 - 1
            }
        };
        triangle.iter().for_each(|&v| self.around[v as usize].push(t));
        self.n_of_label[label as usize] += 1;
        t
    }

    /// Removes a triangle.
    pub fn remove(&mut self, t: u32) {
        for v in self.triangles[t as usize] {
            self.around[v as usize].retain(|&s| s != t);
        }
        self.is_alive[t as usize] = false;
        self.free.push(t);
        self.n_of_label[self.labels[t as usize] as usize] -= 1;
    }

    /// Adds a vertex.
    pub fn add_vertex(&mut self, p: Point, kind: VertexKind) -> u32 {
        self.points.push(p);
        self.kinds.push(kind);
        self.around.push(Vec::new());
        self.points.len() as u32 - 1
    }
}

/// Twice the area of a triangle times its normal.
pub fn area_normal([a, b, c]: [Point; 3]) -> Point {
    (b - a).cross(c - a)
}

/// Quality of a triangle: area over squared edges, 1 for a regular one and 0 for a flat one.
pub fn quality(t: [Point; 3]) -> f64 {
    let [a, b, c] = t;
    let squares = a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a);
    2.0 * 3f64.sqrt() * area_normal(t).length() / squares
}

/// Cosine of the angle between two area normals, at most `1`.
pub fn cosine(x: Point, y: Point) -> f64 {
    x.dot(y) / (x.length() * y.length())
}

/// Smallest angle of a triangle in radians.
pub fn smallest_angle([a, b, c]: [Point; 3]) -> f64 {
    let angle =
        |x: Point, y: Point, z: Point| (y - x).cross(z - x).length().atan2((y - x).dot(z - x));
    angle(a, b, c).min(angle(b, c, a)).min(angle(c, a, b))
}
