//! Which tetrahedra are inside: a minimum cut between those that winding numbers put inside and outside.
//!
//! A tetrahedron on the wrong side costs its volume times the distance of its winding number from one half. A face between inside and
//! outside costs its area, and nothing where a triangle of the input is. So a hole is closed where winding numbers say, and by small faces
//! where they are undecided.

use rayon::prelude::*;

use super::coarse::Watcher;
use super::winding::{WindingTree, area_normal};
use tetdb_base::geom::{Aabb, Point, orient};
use tetdb_base::storage::{FlatPages, check_cancelled, parallel};
use tetdb_kernel::bisect::{FlowArc, Graph};
use tetdb_kernel::mesh::{Mesh, Tet, VertexTag, dense};

/// Cost of a face: its area times this share of its longest edge. With 0.02, a box without its lid that is ten times as wide as deep is
/// emptied rather than closed; with 0, the faces that close a ragged hole follow the last digits of winding numbers.
const SMOOTH: f64 = 0.004;
/// Tetrahedra with edges above this share of the diagonal are looked at in five points; winding numbers vary in them.
const LARGE: f64 = 1.0 / 32.0;
/// Sum of all costs as whole numbers.
const SUM: f64 = (1u64 << 58) as f64;
/// More than all costs.
const NEVER: u64 = 1 << 60;
/// Tetrahedra whose winding numbers are found together.
const AT_ONCE: usize = 1 << 14;
/// Winding numbers that leave doubt.
const DOUBTFUL: std::ops::Range<f64> = 0.3..0.7;

/// Tetrahedra inside, and sums over all but those at the loose box.
#[derive(Default)]
pub struct Sides {
    /// By dense number.
    pub is_inside: Vec<bool>,
    /// Volume weighted with the winding number.
    pub volume_by_winding: f64,
    /// Volume inside.
    pub volume: f64,
    /// Volume with a winding number between 0.3 and 0.7.
    pub volume_doubtful: f64,
}

impl Sides {
    /// Returns whether tetrahedron `t` is inside.
    pub fn is_inside(&self, t: u32) -> bool {
        self.is_inside[dense(t) as usize]
    }
}

/// A tetrahedron between triangles, with what decides about its side.
#[derive(Clone, Copy, Default)]
struct Weighed {
    volume: f64,
    winding: f64,
}

/// Decides for each tetrahedron.
pub fn choose_sides(mesh: &mut Mesh<FlatPages>, tree: &WindingTree, watch: &Watcher) -> Sides {
    let n = dense(mesh.tet_ids_end()) as usize;
    let weighed = weigh(mesh, tree, n, watch);
    let mut sides = Sides::default();
    for Weighed { volume, winding } in &weighed {
        sides.volume_by_winding += volume * winding;
        if DOUBTFUL.contains(&winding.abs()) {
            sides.volume_doubtful += volume;
        }
    }
    watch("choose the inside", 0, 0);
    let costs: Vec<[f64; 4]> = face_costs(mesh, n);
    let volumes = weighed.iter().map(|w| w.volume).sum::<f64>();
    let scale = SUM / (volumes + costs.iter().flatten().sum::<f64>());
    let mut graph = Graph::<u64>::default();
    let mut from = 0;
    for (k, costs) in costs.iter().enumerate() {
        let tet = mesh.next_tet(from).filter(|(t, _)| dense(*t) as usize == k);
        let Some((t, tet)) = tet else {
            graph.push([FlowArc::NONE; 4], [0; 4], [0; 2]);
            continue;
        };
        from = t + 1;
        let arcs = tet.neighbor.map(|across| match across.exists() {
            true => FlowArc::new(dense(across.tet()), across.face()),
            false => FlowArc::NONE,
        });
        let Weighed { volume, winding } = weighed[k];
        let pull = winding.abs() - 0.5;
        // One at least, so that the smallest goes where it belongs.
        let cost = ((volume * pull.abs() * scale) as u64).max(1);
        let terminal = match () {
            () if volume == 0.0 => [0, NEVER],
            () if pull > 0.0 => [cost, 0],
            () => [0, cost],
        };
        graph.push(arcs, costs.map(|cost| (cost * scale) as u64), terminal);
    }
    graph.cut();
    sides.is_inside = (0..n as u32).map(|k| graph.is_source_side(k)).collect();
    let inside = weighed.iter().zip(&sides.is_inside).filter(|(_, is_inside)| **is_inside);
    sides.volume = inside.map(|(w, _)| w.volume).sum();
    sides
}

/// Volumes and winding numbers by dense number. Those at the loose box have no volume.
fn weigh(
    mesh: &mut Mesh<FlatPages>,
    tree: &WindingTree,
    n: usize,
    watch: &Watcher,
) -> Vec<Weighed> {
    let mut weighed = vec![Weighed::default(); n];
    let mut bounds = None::<Aabb>;
    for v in mesh.vertex_ids().collect::<Vec<_>>() {
        if mesh.vertex_attribute(v).0 == VertexTag::Surface {
            let p = mesh.point(v);
            bounds = Some(bounds.map_or(Aabb::around([p]), |b| b.with(p)));
        }
    }
    let large = LARGE * bounds.map_or(0.0, |b| b.diagonal());
    let mut some: Vec<(usize, [Point; 4])> = Vec::with_capacity(AT_ONCE);
    let mut from = 0;
    loop {
        let next = mesh.next_tet(from);
        if let Some((t, tet)) = next {
            from = t + 1;
            if !at_box(mesh, &tet) {
                some.push((dense(t) as usize, mesh.points(&tet)));
            }
        }
        if some.len() == AT_ONCE || next.is_none() {
            check_cancelled();
            let found: Vec<f64> = parallel(|| {
                some.par_iter().map(|(_, corners)| winding(tree, *corners, large)).collect()
            });
            for (&(k, [a, b, c, d]), winding) in some.iter().zip(found) {
                weighed[k] = Weighed { volume: orient(a, b, c, d) / 6.0, winding };
            }
            some.clear();
            watch("winding numbers", u64::from(dense(from)).min(n as u64), n as u64);
        }
        if next.is_none() {
            return weighed;
        }
    }
}

fn at_box(mesh: &mut Mesh<FlatPages>, tet: &Tet) -> bool {
    tet.vertices().into_iter().any(|v| mesh.vertex_attribute(v).0 == VertexTag::EnclosingBox)
}

/// The mean winding number in a tetrahedron.
fn winding(tree: &WindingTree, corners: [Point; 4], large: f64) -> f64 {
    let [a, b, c, d] = corners;
    let middle = (a + b + c + d) * 0.25;
    let in_middle = tree.at(middle);
    if corners.iter().all(|p| p.distance(middle) <= large) {
        return in_middle;
    }
    let around = corners.map(|p| tree.at(middle.lerp(p, 0.6)));
    (in_middle + around.iter().sum::<f64>()) / 5.0
}

/// Costs of the faces of each tetrahedron; those of the input cost nothing.
fn face_costs(mesh: &mut Mesh<FlatPages>, n: usize) -> Vec<[f64; 4]> {
    let mut costs = vec![[0.0; 4]; n];
    let mut from = 0;
    while let Some((t, tet)) = mesh.next_tet(from) {
        from = t + 1;
        for (i, across) in tet.neighbor.into_iter().enumerate() {
            if !across.exists() || tet.is_required(i) || across.tet() < t {
                continue;
            }
            let corners = tet.face(i).map(|v| mesh.point(v));
            let [a, b, c] = corners;
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            let other = mesh.tet(across.tet());
            if at_box(mesh, &tet) && at_box(mesh, &other) {
                continue;
            }
            let cost = 0.5 * area_normal(corners).length() * longest * SMOOTH;
            costs[dense(t) as usize][i] = cost;
            costs[dense(across.tet()) as usize][across.face()] = cost;
        }
    }
    costs
}
