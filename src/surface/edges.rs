//! Which triangles meet at which edges: holes, repeated and collapsed triangles, parts.

use rayon::prelude::*;

use super::Surface;
use super::rims::{in_line, open_groups};

/// What edges alone tell about a surface.
///
/// A facet given twice with opposite orientation is one two-sided facet and counts once at its edges.
/// Lists are sorted by triangle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Closedness {
    /// Different edges.
    pub n_edges: usize,
    /// Triangle and vertices (in its direction) of each edge with one triangle only.
    pub open: Vec<(u32, [u32; 2])>,
    /// Connected groups of open edges: the rims of the holes.
    pub n_open_loops: usize,
    /// Edges with three or more facets.
    pub n_nonmanifold: usize,
    /// Of those, the ones with an odd number: walls that divide a volume.
    pub n_odd: usize,
    /// Edges of two triangles that run along them in the same direction.
    pub n_inconsistent: usize,
    /// Triangles without area; true when a vertex is repeated, false when the corners are in line.
    pub degenerate: Vec<(u32, bool)>,
    /// A triangle and a later one of the same vertices and orientation.
    pub duplicates: Vec<[u32; 2]>,
    /// A triangle and a later one of the same vertices and opposite orientation.
    pub two_sided: Vec<[u32; 2]>,
    /// Parts joined through edges.
    pub n_components: usize,
}

impl Closedness {
    /// Whether every edge has a second facet.
    pub fn is_closed(&self) -> bool {
        self.open.is_empty()
    }
}

/// Looks at the edges of a surface. Near-linear: two sorts; memory 16 bytes per triangle and per edge use.
pub fn closedness(surface: &Surface) -> Closedness {
    Facets::of(surface).closedness(surface)
}

/// The triangles that count: collapsed ones and repetitions set apart.
pub(super) struct Facets {
    pub degenerate: Vec<(u32, bool)>,
    pub duplicates: Vec<[u32; 2]>,
    pub two_sided: Vec<[u32; 2]>,
    /// Uses of edges by facets, sorted by edge.
    pub uses: Vec<EdgeUse>,
    /// Per triangle: not the first of its vertices, or a vertex repeated.
    pub is_left_out: Vec<bool>,
}

/// One facet at one edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct EdgeUse {
    /// Smaller vertex in the high half, larger in the low half.
    pub edge: u64,
    /// `4 * triangle + k`, the edge going from corner k to the next.
    half: u32,
}

impl EdgeUse {
    pub fn triangle(self) -> u32 {
        self.half >> 2
    }

    /// The corner the edge starts at.
    pub fn corner(self) -> usize {
        (self.half & 3) as usize
    }

    /// The edge's vertices in the direction of the triangle.
    pub fn vertices(self, surface: &Surface) -> [u32; 2] {
        let t = surface.triangles[self.triangle() as usize];
        [t[self.corner()], t[(self.corner() + 1) % 3]]
    }

    pub fn is_forward(self, surface: &Surface) -> bool {
        let [a, b] = self.vertices(surface);
        a < b
    }
}

/// Whether two uses of one edge run along it in the same direction.
pub(super) fn same_direction(surface: &Surface, a: EdgeUse, b: EdgeUse) -> bool {
    a.is_forward(surface) == b.is_forward(surface)
}

impl Facets {
    pub fn of(surface: &Surface) -> Self {
        let degenerate: Vec<(u32, bool)> = (0..surface.n_triangles() as u32)
            .into_par_iter()
            .filter_map(|t| collapse(surface, t).map(|repeated| (t, repeated)))
            .collect();
        let mut is_left_out = vec![false; surface.n_triangles()];
        for &(t, repeated) in &degenerate {
            is_left_out[t as usize] = repeated;
        }
        let (duplicates, two_sided) = repetitions(surface, &mut is_left_out);
        let mut uses: Vec<EdgeUse> = Vec::with_capacity(3 * surface.n_triangles());
        for (t, triangle) in (0u32..).zip(&surface.triangles) {
            if is_left_out[t as usize] {
                continue;
            }
            for k in 0..3 {
                let (a, b) = (triangle[k as usize], triangle[(k as usize + 1) % 3]);
                let edge = u64::from(a.min(b)) << 32 | u64::from(a.max(b));
                uses.push(EdgeUse {
                    edge,
                    half: 4 * t + k,
                });
            }
        }
        uses.par_sort_unstable();
        Self {
            degenerate,
            duplicates,
            two_sided,
            uses,
            is_left_out,
        }
    }

    /// The uses of each edge together.
    pub fn edges(&self) -> impl Iterator<Item = &[EdgeUse]> {
        self.uses.chunk_by(|a, b| a.edge == b.edge)
    }

    pub fn closedness(&self, surface: &Surface) -> Closedness {
        let mut found = Closedness {
            degenerate: self.degenerate.clone(),
            duplicates: self.duplicates.clone(),
            two_sided: self.two_sided.clone(),
            ..Closedness::default()
        };
        let mut parts = Groups::new(surface.n_triangles());
        for uses in self.edges() {
            found.n_edges += 1;
            match uses {
                [only] => found.open.push((only.triangle(), only.vertices(surface))),
                [a, b] => found.n_inconsistent += usize::from(same_direction(surface, *a, *b)),
                more => {
                    found.n_nonmanifold += 1;
                    found.n_odd += more.len() % 2;
                }
            }
            for pair in uses.windows(2) {
                parts.join(pair[0].triangle(), pair[1].triangle());
            }
        }
        let roots = (0..surface.n_triangles() as u32)
            .filter(|&t| !self.is_left_out[t as usize] && parts.root(t) == t);
        found.n_components = roots.count();
        found.open.sort_unstable();
        let groups = open_groups(&found.open);
        found.n_open_loops = groups.iter().max().map_or(0, |&last| last as usize + 1);
        found
    }
}

/// Whether triangle `t` has no area, exactly: `Some(true)` when a vertex is repeated.
fn collapse(surface: &Surface, t: u32) -> Option<bool> {
    let [a, b, c] = surface.triangles[t as usize];
    if a == b || b == c || c == a {
        return Some(true);
    }
    let [a, b, c] = surface.corners(t);
    in_line(a, b, c).then_some(false)
}

/// Pairs of triangles of the same vertices; all but the first of each set are left out.
fn repetitions(surface: &Surface, is_left_out: &mut [bool]) -> (Vec<[u32; 2]>, Vec<[u32; 2]>) {
    let mut keys: Vec<([u32; 3], u32)> = (0..surface.n_triangles() as u32)
        .into_par_iter()
        .filter(|&t| !is_left_out[t as usize])
        .map(|t| {
            let mut key = surface.triangles[t as usize];
            key.sort_unstable();
            (key, t)
        })
        .collect();
    keys.par_sort_unstable();
    let (mut duplicates, mut two_sided) = (Vec::new(), Vec::new());
    for set in keys.chunk_by(|a, b| a.0 == b.0).filter(|set| set.len() > 1) {
        let first = set[0].1;
        let mut opposite = None;
        for &(_, t) in &set[1..] {
            is_left_out[t as usize] = true;
            let same =
                is_odd(surface.triangles[first as usize]) == is_odd(surface.triangles[t as usize]);
            match (same, opposite) {
                (true, _) => duplicates.push([first, t]),
                (false, Some(earlier)) => duplicates.push([earlier, t]),
                (false, None) => {
                    opposite = Some(t);
                    two_sided.push([first, t]);
                }
            }
        }
    }
    duplicates.sort_unstable();
    two_sided.sort_unstable();
    (duplicates, two_sided)
}

/// Whether sorting the vertices takes an odd number of exchanges.
fn is_odd([a, b, c]: [u32; 3]) -> bool {
    (a < b) ^ (b < c) ^ (c < a)
}

/// Disjoint sets of 0 .. n; the root of a set is its smallest member.
pub(super) struct Groups {
    parent: Vec<u32>,
}

impl Groups {
    pub fn new(n: usize) -> Self {
        Self {
            parent: (0..n as u32).collect(),
        }
    }

    pub fn root(&mut self, mut i: u32) -> u32 {
        while self.parent[i as usize] != i {
            let above = self.parent[self.parent[i as usize] as usize];
            self.parent[i as usize] = above;
            i = above;
        }
        i
    }

    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }
}
