//! Triangles at each edge: open edges, repeated and collapsed triangles, connected parts.

use rayon::prelude::*;
use robust::Coord;

use super::Surface;
use crate::geom::Point;
use crate::storage::{OrRaise, ScratchSpace, SpillVec, parallel, sort_record};

/// Properties of a surface that follow from its edges.
///
/// A facet given twice with opposite orientation is one two-sided facet and counts once at its edges.
/// Lists are sorted by triangle.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Closedness {
    /// Different edges.
    pub n_edges: usize,
    /// Triangle and vertices (in its direction) of each edge with one triangle only.
    pub open: Vec<(u32, [u32; 2])>,
    /// Edges with one triangle that is part of a sheet, where the sheet ends inside.
    pub n_free: usize,
    /// Connected groups of open edges: boundary loops of the holes.
    pub n_open_loops: usize,
    /// Edges with three or more facets.
    pub n_nonmanifold: usize,
    /// Non-manifold edges with an odd number of facets: walls that divide a volume.
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
    /// Returns whether every edge has a second facet.
    pub fn is_closed(&self) -> bool {
        self.open.is_empty()
    }
}

/// Looks at the edges of a surface. Near-linear: two sorts; memory 16 bytes per triangle and 12 per edge use.
pub fn closedness(surface: &Surface) -> Closedness {
    Facets::new(surface, &ScratchSpace::boundless()).closedness(surface)
}

/// The triangles that count: collapsed ones and repetitions set apart.
pub(super) struct Facets {
    pub degenerate: Vec<(u32, bool)>,
    pub duplicates: Vec<[u32; 2]>,
    pub two_sided: Vec<[u32; 2]>,
    /// Uses of edges by facets, sorted by edge.
    uses: SpillVec<TriangleAtEdge>,
    /// Per triangle: not the first of its vertices, or a vertex repeated.
    pub is_left_out: Vec<bool>,
}

sort_record! {
    /// One facet at one edge.
    #[derive(Eq, PartialOrd, Ord, bytemuck::Pod, bytemuck::Zeroable)]
    #[repr(C)]
    pub(super) struct TriangleAtEdge {
        /// The edge's vertices, the smaller one first.
        pub edge: [u32; 2],
        /// `4 * triangle + k`, the edge going from corner k to the next.
        half: u32,
    }
}

sort_record! {
    /// A triangle by its vertices.
    struct SortedTriangle {
        /// Ascending.
        vertices: [u32; 3],
        triangle: u32,
    }
}

impl TriangleAtEdge {
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

/// Returns whether two uses of one edge run along it in the same direction.
pub(super) fn same_direction(surface: &Surface, a: TriangleAtEdge, b: TriangleAtEdge) -> bool {
    a.is_forward(surface) == b.is_forward(surface)
}

impl Facets {
    /// A scratch file that fails unwinds.
    pub fn new(surface: &Surface, scratch: &ScratchSpace) -> Self {
        let degenerate: Vec<(u32, bool)> = parallel(|| {
            (0..surface.n_triangles() as u32)
                .into_par_iter()
                .filter_map(|t| collapse(surface, t).map(|repeated| (t, repeated)))
                .collect()
        });
        let mut is_left_out = vec![false; surface.n_triangles()];
        for &(t, repeated) in &degenerate {
            is_left_out[t as usize] = repeated;
        }
        let (duplicates, two_sided) = repetitions(surface, &mut is_left_out, scratch);
        let mut sorter = scratch.sorter::<TriangleAtEdge>();
        for (t, triangle) in (0u32..).zip(&surface.triangles) {
            if is_left_out[t as usize] {
                continue;
            }
            for k in 0..3 {
                let (a, b) = (triangle[k as usize], triangle[(k as usize + 1) % 3]);
                let edge_use = TriangleAtEdge { edge: [a.min(b), a.max(b)], half: 4 * t + k };
                sorter.push(edge_use).or_raise();
            }
        }
        let mut uses = scratch.builder();
        for edge_use in sorter.finish().or_raise() {
            uses.push(edge_use.or_raise());
        }
        let uses = uses.finish();
        Self { degenerate, duplicates, two_sided, uses, is_left_out }
    }

    /// Calls `visit` with the uses of each edge together.
    pub fn each_edge(&mut self, mut visit: impl FnMut(&[TriangleAtEdge])) {
        let mut together = Vec::new();
        for i in 0..self.uses.len() {
            let next = self.uses.get(i);
            if together.last().is_some_and(|u: &TriangleAtEdge| u.edge != next.edge) {
                visit(&together);
                together.clear();
            }
            together.push(next);
        }
        if !together.is_empty() {
            visit(&together);
        }
    }

    pub fn closedness(&mut self, surface: &Surface) -> Closedness {
        let mut found = Closedness {
            degenerate: self.degenerate.clone(),
            duplicates: self.duplicates.clone(),
            two_sided: self.two_sided.clone(),
            ..Closedness::default()
        };
        let mut parts = Groups::new(surface.n_triangles());
        self.each_edge(|uses| {
            found.n_edges += 1;
            let mut of_shells = Vec::new();
            let uses = match surface.has_sheets() {
                false => uses,
                true => {
                    found.n_free +=
                        usize::from(matches!(uses, [u] if surface.is_sheet(u.triangle())));
                    of_shells.extend(uses.iter().filter(|u| !surface.is_sheet(u.triangle())));
                    &of_shells[..]
                }
            };
            match uses {
                [] => {}
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
        });
        let roots = (0..surface.n_triangles() as u32)
            .filter(|&t| !self.is_left_out[t as usize] && parts.root(t) == t);
        found.n_components = roots.count();
        found.open.sort_unstable();
        let groups = open_groups(&found.open);
        found.n_open_loops = groups.iter().max().map_or(0, |&last| last as usize + 1);
        found
    }
}

/// Returns whether triangle `t` has no area, exactly: `Some(true)` when a vertex is repeated.
fn collapse(surface: &Surface, t: u32) -> Option<bool> {
    let [a, b, c] = surface.triangles[t as usize];
    if a == b || b == c || c == a {
        return Some(true);
    }
    let [a, b, c] = surface.corners(t);
    in_line(a, b, c).then_some(false)
}

/// Pairs of triangles of the same vertices; all but the first of each set are left out.
fn repetitions(
    surface: &Surface,
    is_left_out: &mut [bool],
    scratch: &ScratchSpace,
) -> (Vec<[u32; 2]>, Vec<[u32; 2]>) {
    let mut sorter = scratch.sorter::<SortedTriangle>();
    for (t, triangle) in (0u32..).zip(&surface.triangles) {
        if !is_left_out[t as usize] {
            let mut vertices = *triangle;
            vertices.sort_unstable();
            sorter.push(SortedTriangle { vertices, triangle: t }).or_raise();
        }
    }
    let (mut duplicates, mut two_sided) = (Vec::new(), Vec::new());
    // A wall may be given from both sides, a sheet is given once, and not where a shell is.
    // Of the set at hand: its vertices, the first triangle, the first one of the other orientation.
    let mut set = None::<([u32; 3], u32, Option<u32>)>;
    for key in sorter.finish().or_raise() {
        let SortedTriangle { vertices, triangle: t } = key.or_raise();
        let Some((_, first, opposite)) = set.as_mut().filter(|set| set.0 == vertices) else {
            set = Some((vertices, t, None));
            continue;
        };
        is_left_out[t as usize] = true;
        let [known, new] = [*first, t].map(|t| is_odd(surface.triangles[t as usize]));
        let with_sheet = surface.is_sheet(*first) || surface.is_sheet(t);
        match (known == new || with_sheet, *opposite) {
            (true, _) => duplicates.push([*first, t]),
            (false, Some(earlier)) => duplicates.push([earlier, t]),
            (false, None) => {
                *opposite = Some(t);
                two_sided.push([*first, t]);
            }
        }
    }
    duplicates.sort_unstable();
    two_sided.sort_unstable();
    (duplicates, two_sided)
}

/// Returns whether sorting the vertices takes an odd number of exchanges.
fn is_odd([a, b, c]: [u32; 3]) -> bool {
    (a < b) ^ (b < c) ^ (c < a)
}

/// Disjoint sets of 0 .. n; the root of a set is its smallest member.
pub(super) struct Groups {
    parent: Vec<u32>,
}

impl Groups {
    pub fn new(n: usize) -> Self {
        Self { parent: (0..n as u32).collect() }
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

    /// The root of each, which is known when those below are.
    pub fn into_roots(mut self) -> Vec<u32> {
        for i in 0..self.parent.len() {
            self.parent[i] = self.parent[self.parent[i] as usize];
        }
        self.parent
    }
}

/// For each open edge the number of its connected group, counted in order of first appearance.
pub(super) fn open_groups(open: &[(u32, [u32; 2])]) -> Vec<u32> {
    let vertices = ends(open);
    let place = |v: u32| {
        let found = vertices.binary_search(&v);
        found.expect("every end is in the list") as u32
    };
    let mut groups = Groups::new(vertices.len());
    for (_, [a, b]) in open {
        groups.join(place(*a), place(*b));
    }
    let mut numbers = vec![u32::MAX; vertices.len()];
    let mut n = 0;
    open.iter()
        .map(|(_, [a, _])| {
            let number = &mut numbers[groups.root(place(*a)) as usize];
            if *number == u32::MAX {
                *number = n;
                n += 1;
            }
            *number
        })
        .collect()
}

/// The vertices of open edges, ascending.
pub(super) fn ends(open: &[(u32, [u32; 2])]) -> Vec<u32> {
    let mut vertices: Vec<u32> = open.iter().flat_map(|(_, v)| *v).collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices
}

/// Returns whether three points lie on a line, exactly.
pub(super) fn in_line(a: Point, b: Point, c: Point) -> bool {
    let flat = |axis: fn(Point) -> Coord<f64>| robust::orient2d(axis(a), axis(b), axis(c)) == 0.0;
    flat(|p| Coord { x: p.x, y: p.y })
        && flat(|p| Coord { x: p.y, y: p.z })
        && flat(|p| Coord { x: p.z, y: p.x })
}
