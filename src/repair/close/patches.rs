//! The surface between inside and outside: triangles of the input, and faces that close holes.

use std::collections::BTreeMap;

use super::sides::Sides;
use super::winding::area_normal;
use tetdb_base::geom::Point;
use tetdb_base::storage::FlatPages;
use tetdb_base::surface::{Surface, drop_unused_points, replace_triangles};
use tetdb_kernel::mesh::{Mesh, VertexTag};

/// Labels for closed holes at most; smaller holes share the last one.
pub const LABELS_MAX: usize = 1000;
/// Name of the labels for closed holes, before their number.
const LABEL: &str = "closed-hole-";

/// A hole that was closed.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct ClosedHole {
    /// Label of the new triangles.
    pub label: String,
    /// Number of new triangles.
    pub triangles: usize,
    /// Their area.
    pub area: f64,
    /// Length of their boundary.
    pub boundary: f64,
    /// The middle of the first of them.
    pub at: [f64; 3],
}

/// What became of the triangles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Kept {
    pub turned: usize,
    pub dropped_inside: usize,
    pub dropped_outside: usize,
    /// Second triangles of the same vertices.
    pub dropped_repeated: usize,
    pub holes: Vec<ClosedHole>,
    pub points_added: usize,
}

/// Ascending vertices of a triangle.
fn sorted(mut face: [u32; 3]) -> [u32; 3] {
    face.sort_unstable();
    face
}

/// Returns whether two triangles of the same vertices run alike.
fn same_direction(a: [u32; 3], [x, y, z]: [u32; 3]) -> bool {
    [[x, y, z], [y, z, x], [z, x, y]].contains(&a)
}

/// Keeps the triangles of `surface` between inside and outside, turned outward, and adds the faces that close its holes.
pub fn keep(surface: &mut Surface, mesh: &mut Mesh<FlatPages>, sides: &Sides) -> Kept {
    let mut facets: Vec<([u32; 3], u32)> =
        (0..mesh.n_facets()).map(|n| (sorted(mesh.facet(n).vertices), n)).collect();
    facets.sort_unstable();
    // By triangle: whether its front and its back are inside.
    let mut inside = vec![[false; 2]; surface.n_triangles()];
    let mut closing: Vec<[u32; 3]> = Vec::new();
    let mut from = 0;
    while let Some((t, tet)) = mesh.next_tet(from) {
        from = t + 1;
        if !sides.is_inside(t) {
            continue;
        }
        for (i, across) in tet.neighbor.into_iter().enumerate() {
            let face = tet.face(i);
            if !tet.is_required(i) {
                if !across.exists() || !sides.is_inside(across.tet()) {
                    closing.push(face);
                }
                continue;
            }
            let key = sorted(face);
            let first = facets.partition_point(|(other, _)| *other < key);
            for &(_, n) in facets[first..].iter().take_while(|(other, _)| *other == key) {
                let facet = mesh.facet(n);
                // Faces are seen from outside the tetrahedron, which lies behind a facet that runs alike.
                let side = usize::from(same_direction(facet.vertices, face));
                inside[facet.input as usize][side] = true;
            }
        }
    }
    let is_second = second_of_two(&facets);
    let mut kept = Kept::default();
    for (t, inside) in inside.iter().enumerate() {
        match inside {
            [true, true] => kept.dropped_inside += 1,
            [false, false] => kept.dropped_outside += 1,
            [true, false] if is_second[t] => kept.dropped_repeated += 1,
            [true, false] => kept.turned += 1,
            [false, true] => {}
        }
    }
    replace_triangles(surface, |t, [a, b, c], pieces| match inside[t as usize] {
        [false, true] => pieces.push([a, b, c]),
        [true, false] if !is_second[t as usize] => pieces.push([a, c, b]),
        _ => {}
    });
    add_closing(surface, mesh, &closing, &mut kept);
    drop_unused_points(surface);
    *surface = surface.part(false);
    kept
}

/// Triangles given from both sides: one of the two looks outward.
fn second_of_two(facets: &[([u32; 3], u32)]) -> Vec<bool> {
    let mut is_second = vec![false; facets.len()];
    for pair in facets.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        pair.iter().for_each(|(_, n)| is_second[*n as usize] = true);
    }
    is_second
}

/// Adds faces of the mesh as triangles, with a label for each patch of them that hangs together, the largest first.
fn add_closing(
    surface: &mut Surface,
    mesh: &mut Mesh<FlatPages>,
    closing: &[[u32; 3]],
    kept: &mut Kept,
) {
    let mut added = BTreeMap::new();
    let mut triangles = Vec::with_capacity(closing.len());
    for face in closing {
        triangles.push(face.map(|v| match mesh.vertex_attribute(v) {
            (VertexTag::Surface, i) => i,
            _ => *added.entry(v).or_insert_with(|| {
                surface.points.push(mesh.point(v));
                surface.points.len() as u32 - 1
            }),
        }));
    }
    kept.points_added = added.len();
    let first = surface.label_names.len() as u32;
    let mut patches = connected(&triangles);
    let corners = |surface: &Surface, t: usize| triangles[t].map(|v| surface.points[v as usize]);
    let area = |t: &usize| 0.5 * area_normal(corners(surface, *t)).length();
    let areas: Vec<f64> = patches.iter().map(|patch| patch.iter().map(area).sum()).collect();
    let mut order: Vec<usize> = (0..patches.len()).collect();
    order.sort_by(|&a, &b| areas[b].total_cmp(&areas[a]).then(a.cmp(&b)));
    for (n, &k) in order.iter().enumerate() {
        let patch = std::mem::take(&mut patches[k]);
        if n < LABELS_MAX {
            let numbered = (2..).map(|again| format!("{LABEL}{}~{again}", n + 1));
            let mut names = std::iter::once(format!("{LABEL}{}", n + 1)).chain(numbered);
            let name = names.find(|name| !surface.label_names.contains(name));
            surface.label_names.push(name.expect("one number is free"));
        }
        let label = first + n.min(LABELS_MAX - 1) as u32;
        let [a, b, c] = corners(surface, patch[0]);
        kept.holes.push(ClosedHole {
            label: surface.label_names[label as usize].clone(),
            triangles: patch.len(),
            area: areas[k],
            boundary: boundary(&triangles, &patch, &surface.points),
            at: ((a + b + c) / 3.0).to_array(),
        });
        surface.triangles.extend(patch.iter().map(|&t| triangles[t]));
        surface.labels.resize(surface.triangles.len(), label);
    }
}

/// The edges of triangles, lower vertex first, each with its triangle; sorted.
fn edges(triangles: &[[u32; 3]], chosen: impl Iterator<Item = usize>) -> Vec<([u32; 2], usize)> {
    let of = |t: usize| {
        let [a, b, c] = triangles[t];
        [[a, b], [b, c], [c, a]].map(|[a, b]| ([a.min(b), a.max(b)], t))
    };
    let mut edges: Vec<_> = chosen.flat_map(of).collect();
    edges.sort_unstable();
    edges
}

/// Triangles that hang together through edges, in the order of their first triangles.
pub fn connected(triangles: &[[u32; 3]]) -> Vec<Vec<usize>> {
    fn root(on: &mut [usize], mut t: usize) -> usize {
        while on[t] != t {
            on[t] = on[on[t]];
            t = on[t];
        }
        t
    }
    let mut on: Vec<usize> = (0..triangles.len()).collect();
    for pair in edges(triangles, 0..triangles.len()).windows(2) {
        if pair[0].0 == pair[1].0 {
            let (a, b) = (root(&mut on, pair[0].1), root(&mut on, pair[1].1));
            on[a.max(b)] = a.min(b);
        }
    }
    let mut patches: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for t in 0..triangles.len() {
        patches.entry(root(&mut on, t)).or_default().push(t);
    }
    patches.into_values().collect()
}

/// Length of the edges of a patch with an odd number of its triangles.
fn boundary(triangles: &[[u32; 3]], patch: &[usize], points: &[Point]) -> f64 {
    let edges = edges(triangles, patch.iter().copied());
    let groups = edges.chunk_by(|a, b| a.0 == b.0).filter(|group| group.len() % 2 == 1);
    groups.map(|group| group[0].0.map(|v| points[v as usize])).map(|[a, b]| a.distance(b)).sum()
}
