//! A Delaunay mesh in plain arrays, into which points are inserted one by one.
//!
//! It begins as one tetrahedron around everything. Signs are exact and ties are broken by coordinates, so each cavity is star-shaped and
//! all tetrahedra have positive volume. Is not: the mesher. `kernel` has that, over pages.

use tetdb_base::geom::{IdMap, Point, in_sphere_perturbed, orient};

/// No tetrahedron, no face.
pub const NONE: u32 = u32::MAX;
/// Vertices of each face, counter-clockwise seen from outside.
pub const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];
/// Vertices of the first tetrahedron.
pub const N_FAR: u32 = 4;

/// A tetrahedron of positive volume.
#[derive(Clone, Copy)]
pub struct Tet {
    /// Its vertices; the first is [`NONE`] in a slot that is free.
    pub vertices: [u32; 4],
    /// Across each face, four times the tetrahedron there plus its face; [`NONE`] at the hull.
    pub across: [u32; 4],
}

/// The mesh.
pub struct Delaunay {
    /// Positions of the vertices.
    pub points: Vec<Point>,
    /// The tetrahedra.
    pub tets: Vec<Tet>,
    /// How often each slot was filled.
    pub stamps: Vec<u32>,
    /// A tetrahedron at each vertex.
    pub tet_at: Vec<u32>,
    free: Vec<u32>,
    /// Twice the number of the cavity for its members, one more for those looked at in vain.
    marks: Vec<u32>,
    turn: u32,
    cavity: Vec<u32>,
    /// Outer faces of the cavity: vertices, and what is across.
    faces: Vec<([u32; 3], u32)>,
    links: IdMap<u64, u32>,
}

impl Delaunay {
    /// One tetrahedron of these vertices, whose volume is positive.
    pub fn new(corners: [Point; 4]) -> Self {
        let first = Tet { vertices: [0, 1, 2, 3], across: [NONE; 4] };
        Self {
            points: corners.to_vec(),
            tets: vec![first],
            stamps: vec![0],
            tet_at: vec![0; 4],
            free: Vec::new(),
            marks: vec![0],
            turn: 0,
            cavity: Vec::new(),
            faces: Vec::new(),
            links: IdMap::default(),
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        (self.tets.capacity() * (size_of::<Tet>() + 8)
            + self.points.capacity() * (size_of::<Point>() + 4)
            + self.free.capacity() * 4) as u64
    }

    /// Positions of the vertices of a tetrahedron.
    #[inline]
    pub fn corners(&self, t: u32) -> [Point; 4] {
        self.tets[t as usize].vertices.map(|v| self.points[v as usize])
    }

    /// Vertices of a face.
    #[inline]
    pub fn face(&self, t: u32, i: usize) -> [u32; 3] {
        FACES[i].map(|k| self.tets[t as usize].vertices[k])
    }

    /// Whether the slot holds a tetrahedron.
    pub fn is_live(&self, t: u32) -> bool {
        self.tets[t as usize].vertices[0] != NONE
    }

    /// The tetrahedron that holds `p`, walking from `hint`; `None` outside of all.
    pub fn locate(&self, p: Point, hint: u32) -> Option<u32> {
        let (mut tet, mut entry) = (hint, 4);
        'walk: loop {
            let corners = self.corners(tet);
            for (i, [a, b, c]) in FACES.into_iter().enumerate() {
                if i != entry && orient(p, corners[a], corners[b], corners[c]) < 0.0 {
                    let across = self.tets[tet as usize].across[i];
                    if across == NONE {
                        return None;
                    }
                    (tet, entry) = (across >> 2, across as usize & 3);
                    continue 'walk;
                }
            }
            return Some(tet);
        }
    }

    /// Inserts `p`, unless it is nearer than `spacing` to a vertex; returns whether it did. [`Delaunay::new_tets`] has its tetrahedra.
    pub fn insert(&mut self, p: Point, hint: u32, spacing: f64) -> bool {
        let Some(start) = self.locate(p, hint) else { return false };
        self.gather(p, start);
        let square = spacing * spacing;
        // The nearest vertex of all is one of the cavity.
        let corners = self.cavity.iter().flat_map(|&t| self.tets[t as usize].vertices);
        if corners.into_iter().any(|v| self.points[v as usize].distance_squared(p) < square) {
            return false;
        }
        self.fill(p);
        true
    }

    /// Lists the tetrahedra whose spheres hold `p`, and the faces around them.
    fn gather(&mut self, p: Point, start: u32) {
        self.turn += 1;
        let (inside, looked_at) = (2 * self.turn, 2 * self.turn + 1);
        self.cavity.clear();
        self.faces.clear();
        self.cavity.push(start);
        self.marks[start as usize] = inside;
        let mut next = 0;
        while let Some(&t) = self.cavity.get(next) {
            next += 1;
            for (i, across) in self.tets[t as usize].across.into_iter().enumerate() {
                if across != NONE {
                    let other = across >> 2;
                    let mark = self.marks[other as usize];
                    if mark == inside {
                        continue;
                    }
                    if mark != looked_at {
                        let [a, b, c, d] = self.corners(other);
                        if in_sphere_perturbed(a, b, c, d, p) {
                            self.marks[other as usize] = inside;
                            self.cavity.push(other);
                            continue;
                        }
                        self.marks[other as usize] = looked_at;
                    }
                }
                self.faces.push((self.face(t, i), across));
            }
        }
    }

    /// Joins a new vertex to the outer faces.
    fn fill(&mut self, p: Point) {
        let v = self.points.len() as u32;
        self.points.push(p);
        let n_faces = self.faces.len();
        for &t in self.cavity.iter().skip(n_faces) {
            self.tets[t as usize].vertices[0] = NONE;
            self.stamps[t as usize] += 1;
            self.free.push(t);
        }
        self.cavity.truncate(n_faces);
        while self.cavity.len() < n_faces {
            let t = self.free.pop().unwrap_or_else(|| {
                self.tets.push(Tet { vertices: [NONE; 4], across: [NONE; 4] });
                self.stamps.push(0);
                self.marks.push(0);
                self.tets.len() as u32 - 1
            });
            self.cavity.push(t);
        }
        self.links.clear();
        self.tet_at.push(self.cavity[0]);
        for k in 0..n_faces {
            let (([a, b, c], outside), t) = (self.faces[k], self.cavity[k]);
            self.stamps[t as usize] += 1;
            self.tets[t as usize] = Tet { vertices: [v, a, b, c], across: [outside, 0, 0, 0] };
            if outside != NONE {
                self.tets[outside as usize >> 2].across[outside as usize & 3] = 4 * t;
            }
            // Face j is opposite the j-th vertex and holds the edge of the two others.
            for (j, x, y) in [(1, b, c), (2, c, a), (3, a, b)] {
                let key = u64::from(x.min(y)) << 32 | u64::from(x.max(y));
                let own = 4 * t + j;
                match self.links.remove(&key) {
                    None => {
                        self.links.insert(key, own);
                    }
                    Some(other) => {
                        self.tets[t as usize].across[j as usize] = other;
                        self.tets[other as usize >> 2].across[other as usize & 3] = own;
                    }
                }
            }
            for x in [a, b, c] {
                self.tet_at[x as usize] = t;
            }
        }
    }

    /// Tetrahedra of the last insertion.
    pub fn new_tets(&self) -> &[u32] {
        &self.cavity
    }

    /// Lists the tetrahedra at vertex `v`.
    pub fn star(&self, v: u32, star: &mut Vec<u32>) {
        star.clear();
        star.push(self.tet_at[v as usize]);
        let mut next = 0;
        while let Some(&t) = star.get(next) {
            next += 1;
            let Tet { vertices, across } = self.tets[t as usize];
            for i in (0..4).filter(|&i| vertices[i] != v && across[i] != NONE) {
                let other = across[i] >> 2;
                if !star.contains(&other) {
                    star.push(other);
                }
            }
        }
    }
}

/// Center of the sphere through four points, and its radius. Not a number where the tetrahedron is too flat.
pub fn circumsphere([a, b, c, d]: [Point; 4]) -> (Point, f64) {
    let (u, v, w) = (b - a, c - a, d - a);
    let (vw, wu, uv) = (v.cross(w), w.cross(u), u.cross(v));
    let to = (vw * u.length_squared() + wu * v.length_squared() + uv * w.length_squared())
        / (2.0 * u.dot(vw));
    (a + to, to.length())
}

/// Center of the circle through three points, and its radius.
pub fn circumcircle([a, b, c]: [Point; 3]) -> (Point, f64) {
    let (u, v) = (b - a, c - a);
    let n = u.cross(v);
    let to = (n.cross(u) * v.length_squared() + v.cross(n) * u.length_squared())
        / (2.0 * n.length_squared());
    (a + to, to.length())
}

#[cfg(test)]
mod tests {
    use super::*;
    use tetdb_base::geom::mix;

    #[test]
    fn spheres_are_empty_and_neighbors_know_each_other_in_a_grid_with_ties() {
        let far = [[1.0, 1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, 1.0]];
        let mut mesh = Delaunay::new(far.map(|p| Point::from(p) * 100.0));
        let mut points: Vec<Point> = (0..64u32)
            .map(|k| Point::new(f64::from(k & 3), f64::from(k >> 2 & 3), f64::from(k >> 4)))
            .collect();
        points.sort_by_key(|p| mix(p.dot(Point::new(1.0, 10.0, 100.0)) as u64));
        for &p in &points {
            let hint = mesh.tet_at[mesh.points.len() - 1];
            assert!(mesh.insert(p, hint, 1e-3));
            assert!(!mesh.insert(p, mesh.tet_at[mesh.points.len() - 1], 1e-3));
        }
        for t in (0..mesh.tets.len() as u32).filter(|&t| mesh.is_live(t)) {
            let [a, b, c, d] = mesh.corners(t);
            assert!(orient(a, b, c, d) > 0.0);
            let own = mesh.tets[t as usize];
            for v in (0..mesh.points.len() as u32).filter(|v| !own.vertices.contains(v)) {
                assert!(!in_sphere_perturbed(a, b, c, d, mesh.points[v as usize]));
            }
            for (i, across) in own.across.into_iter().enumerate().filter(|(_, x)| *x != NONE) {
                let back = mesh.tets[across as usize >> 2].across[across as usize & 3];
                assert_eq!(back, 4 * t + i as u32);
            }
        }
        let mut star = Vec::new();
        for v in 0..mesh.points.len() as u32 {
            mesh.star(v, &mut star);
            let all = (0..mesh.tets.len() as u32).filter(|&t| mesh.is_live(t));
            let at = all.filter(|&t| mesh.tets[t as usize].vertices.contains(&v)).count();
            assert_eq!(star.len(), at);
        }
    }

    #[test]
    fn spheres_and_circles_pass_through_their_points() {
        let p = [[0.0, 0.0, 0.0], [2.0, 0.5, 0.0], [0.3, 3.0, 0.0], [0.5, 0.5, 1.0]];
        let p = p.map(Point::from);
        let (center, radius) = circumsphere(p);
        assert!(p.iter().all(|x| (x.distance(center) - radius).abs() < 1e-12));
        let circle = [p[0], p[1], p[2]];
        let (center, radius) = circumcircle(circle);
        assert!(circle.iter().all(|x| (x.distance(center) - radius).abs() < 1e-12));
        assert!(center.z.abs() < 1e-12);
    }
}
