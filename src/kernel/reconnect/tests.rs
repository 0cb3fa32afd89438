//! Random flips on small meshes: after any of them, the mesh must be valid.

use super::attribute::EDGE_FLAGS;
use super::*;
use crate::delaunay::{Kernel, enclose};
use crate::mesh::anatomy::EDGE_OF;
use crate::mesh::{FaceRef, Mesh, Tet};
use tetdb_base::geom::{Aabb, Point, orient};
use tetdb_base::storage::{FlatPages, Pages};

type Flat = Mesh<FlatPages>;

/// Deterministic pseudo-random numbers in [0, 1).
fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

fn build(points: &[Point]) -> Flat {
    let mut mesh = Mesh::new(FlatPages::default());
    let mut kernel = Kernel::default();
    let mut hint = enclose(&mut mesh, &Aabb::around(points.iter().copied()));
    for &p in points {
        let v = mesh.add_vertex(p, 0.0);
        hint = kernel.insert(&mut mesh, v, p, hint).expect("inside the box and new");
    }
    mesh.refresh_tet_of();
    mesh
}

fn grid(n: i32) -> Vec<Point> {
    let mut points = Vec::new();
    for x in 0..n {
        for y in 0..n {
            for z in 0..n {
                points.push(Point::new(f64::from(x), f64::from(y), f64::from(z)));
            }
        }
    }
    points
}

fn cloud(n: usize) -> Vec<Point> {
    let mut next = random(11);
    (0..n).map(|_| Point::new(next(), next(), next())).collect()
}

fn live(mesh: &mut Flat) -> Vec<(u32, Tet)> {
    let mut all = Vec::new();
    let mut from = 0;
    while let Some((t, tet)) = mesh.next_tet(from) {
        from = t + 1;
        all.push((t, tet));
    }
    all
}

/// Checks everything an operation promises; returns six times the volume, the required faces and the required edges.
fn checked(mesh: &mut Flat) -> (f64, Vec<[u32; 3]>, Vec<[u32; 2]>) {
    let (mut volume, mut faces, mut edges) = (0.0, Vec::new(), Vec::new());
    let all = live(mesh);
    assert_eq!(all.len(), mesh.n_tets() as usize);
    for (t, tet) in all {
        let [a, b, c, d] = mesh.points(&tet);
        let six = orient(a, b, c, d);
        assert!(six > 0.0, "tetrahedron {t} is not positive");
        volume += six;
        for i in 0..4 {
            let mut face = tet.face(i);
            face.sort_unstable();
            let across = tet.neighbor[i];
            if across.exists() {
                let other = mesh.tet(across.tet());
                assert_eq!(other.neighbor[across.face()], FaceRef::new(t, i));
                let mut same = other.face(across.face());
                same.sort_unstable();
                assert_eq!(face, same);
                assert_eq!(other.is_required(across.face()), tet.is_required(i));
            }
            if tet.is_required(i) {
                faces.push(face);
            }
            let v = tet.vertex(i);
            let told = mesh.tet_of(v);
            assert!(mesh.tet(told).local(v).is_some(), "tet_of {v} is {told}");
        }
        let (region, flags) = mesh.tet_attribute(t);
        assert_eq!((region, flags >> 6), (5, 4), "attribute of {t}");
        for (e, [i, j]) in crate::mesh::anatomy::EDGES.into_iter().enumerate() {
            if flags & 1 << e != 0 {
                let (v, w) = (tet.vertex(i), tet.vertex(j));
                edges.push([v.min(w), v.max(w)]);
            }
        }
    }
    faces.sort_unstable();
    faces.dedup();
    edges.sort_unstable();
    edges.dedup();
    (volume, faces, edges)
}

/// Requires some faces and their edges (by the flag), gives every tetrahedron region 5 and flag 8.
fn constrain(mesh: &mut Flat) {
    for (t, tet) in live(mesh) {
        if t % 17 == 0 && tet.neighbor[2].exists() {
            mesh.set_required(FaceRef::new(t, 2), true);
        }
    }
    let mut edges = Vec::new();
    for (_, tet) in live(mesh) {
        for i in (0..4).filter(|&i| tet.is_required(i)) {
            let [a, b, c] = tet.face(i);
            edges.extend([[a, b], [b, c], [a, c]].map(|[v, w]| [v.min(w), v.max(w)]));
        }
    }
    for (t, tet) in live(mesh) {
        let mut flags = 4 << 6;
        for (e, [i, j]) in crate::mesh::anatomy::EDGES.into_iter().enumerate() {
            let (v, w) = (tet.vertex(i), tet.vertex(j));
            if edges.contains(&[v.min(w), v.max(w)]) {
                flags |= 1 << e;
            }
        }
        mesh.set_tet_attribute(t, 5, flags);
    }
}

fn positive_cones(a: Point, b: Point, ring: &[Point]) -> impl Fn(usize, usize, usize) -> f64 + '_ {
    move |i, j, k| {
        let above = orient(ring[i], ring[j], ring[k], b);
        let below = orient(a, ring[i], ring[j], ring[k]);
        if above > 0.0 && below > 0.0 { above.min(below) } else { f64::NEG_INFINITY }
    }
}

/// Returns whether the shell's edge is flagged as required.
fn edge_is_required<P: Pages>(shell: &Shell, mesh: &mut Mesh<P>) -> bool {
    let (_, flags) = mesh.tet_attribute(shell.tets[0]);
    let [i, j, ..] = shell.locals[0].map(usize::from);
    flags & EDGE_FLAGS & 1 << EDGE_OF[i][j] != 0
}

#[test]
fn random_flips_keep_a_mesh_a_mesh() {
    for points in [cloud(300), grid(6)] {
        let mut mesh = build(&points);
        constrain(&mut mesh);
        let before = checked(&mut mesh);
        let mut next = random(3);
        let (mut shell, mut ring, mut new) = (Shell::default(), Vec::new(), Vec::new());
        let mut triangulation = RingTriangulation::default();
        let (mut removed, mut swapped) = (0, 0);
        for _ in 0..4000 {
            let t = (next() * f64::from(mesh.tet_ids_end())) as u32;
            if t & 2047 >= 2046 || !mesh.tet(t).is_live() {
                continue;
            }
            if next() < 0.5 {
                let e = (next() * 6.0) as usize;
                if !shell.gather(&mut mesh, t, e, 64) || !shell.closed || shell.required {
                    continue;
                }
                if edge_is_required(&shell, &mut mesh) {
                    continue;
                }
                let (a, b) = shell.points(&mut mesh, &mut ring);
                let cone = positive_cones(a, b, &ring);
                if triangulation.solve(ring.len(), 0.0, Forced::Nothing, cone) {
                    remove_edge(&mut mesh, &shell, &triangulation, &mut new);
                    assert_eq!(new.len(), 2 * (ring.len() - 2));
                    removed += 1;
                }
            } else {
                let face = FaceRef::new(t, (next() * 4.0) as usize);
                let Some(swap) = FaceSwap::gather(&mut mesh, face) else {
                    continue;
                };
                let (p, q, xyz) = swap.points(&mut mesh);
                if FaceSwap::is_positive(p, q, xyz) {
                    swap.apply(&mut mesh);
                    swapped += 1;
                }
            }
        }
        assert!(removed > 100 && swapped > 0, "{removed} {swapped}");
        let after = checked(&mut mesh);
        assert!((before.0 - after.0).abs() < 1e-9 * before.0);
        assert_eq!(before.1, after.1);
        assert_eq!(before.2, after.2);
    }
}

#[test]
fn shells_and_balls_agree_with_a_search() {
    let mut mesh = build(&cloud(200));
    let all = live(&mut mesh);
    let (mut shell, mut ball) = (Shell::default(), Ball::default());
    for &(t, tet) in all.iter().step_by(7) {
        for (e, [i, j]) in crate::mesh::anatomy::EDGES.into_iter().enumerate() {
            assert!(shell.gather(&mut mesh, t, e, 1000));
            let (a, b) = (tet.vertex(i), tet.vertex(j));
            assert_eq!((shell.a, shell.b), (a, b));
            let has = |r: &Tet| r.local(a).is_some() && r.local(b).is_some();
            assert_eq!(shell.tets.len(), all.iter().filter(|(_, r)| has(r)).count());
            let n = shell.n_ring();
            assert_eq!(n, shell.tets.len() + usize::from(!shell.closed));
            let p = [a, b].map(|v| mesh.point(v));
            for k in 0..shell.tets.len() {
                let r = [shell.ring[k], shell.ring[(k + 1) % n]];
                let q = r.map(|v| mesh.point(v));
                assert!(orient(p[0], p[1], q[0], q[1]) > 0.0);
                let local = shell.locals[k].map(|l| shell.records[k].vertex(l.into()));
                assert_eq!(local, [a, b, r[0], r[1]]);
            }
        }
        let v = tet.vertex(0);
        assert!(ball.gather_of(&mut mesh, v, usize::MAX));
        let n = all.iter().filter(|(_, r)| r.local(v).is_some()).count();
        assert_eq!(ball.tets.len(), n);
        assert_eq!(ball.closed, v >= 8, "only box vertices are on the hull");
        assert!(!ball.gather_of(&mut mesh, v, n - 1));
    }
}

#[test]
fn what_is_forced_is_there_and_the_worst_is_the_best_possible() {
    // Every triangulation of a hexagon, against the table.
    let mut next = random(5);
    let value: Vec<f64> = (0..216).map(|_| next()).collect();
    let cone = |i: usize, j: usize, k: usize| value[36 * i + 6 * j + k];
    fn all(
        i: usize,
        j: usize,
        cone: &dyn Fn(usize, usize, usize) -> f64,
    ) -> Vec<(f64, Vec<[u8; 3]>)> {
        if j - i < 2 {
            return vec![(f64::INFINITY, Vec::new())];
        }
        let mut found = Vec::new();
        for k in i + 1..j {
            for (x, left) in all(i, k, cone) {
                for (y, right) in all(k, j, cone) {
                    let mut t = vec![[i as u8, k as u8, j as u8]];
                    t.extend(left.iter().chain(&right));
                    found.push((x.min(y).min(cone(i, k, j)), t));
                }
            }
        }
        found
    }
    let every = all(0, 5, &cone);
    assert_eq!(every.len(), 14);
    let mut solver = RingTriangulation::default();
    let best = |keep: &dyn Fn(&Vec<[u8; 3]>) -> bool| {
        let kept = every.iter().filter(|(_, t)| keep(t));
        kept.map(|(w, _)| *w).fold(f64::NEG_INFINITY, f64::max)
    };
    assert!(solver.solve(6, -1.0, Forced::Nothing, cone));
    assert_eq!(solver.worst, best(&|_| true));
    assert!(solver.solve(6, -1.0, Forced::Diagonal(4, 1), cone));
    let has = |t: &Vec<[u8; 3]>| t.iter().any(|t| t.contains(&1) && t.contains(&4));
    assert_eq!(solver.worst, best(&has));
    assert!(has(&solver.triangles));
    assert!(solver.solve(6, -1.0, Forced::Triangle(3, 5, 1), cone));
    assert!(solver.triangles.contains(&[1, 3, 5]));
    assert_eq!(solver.triangles.len(), 4);
    let above = best(&|_| true);
    assert!(!solver.solve(6, above, Forced::Nothing, cone));

    // The largest sum of values, none of them above zero and some forbidden.
    let lacking = |i: usize, j: usize, k: usize| match cone(i, j, k) {
        value if value < 0.2 => f64::NEG_INFINITY,
        value => value - 1.0,
    };
    let sum = |t: &Vec<[u8; 3]>| {
        let of = |t: &[u8; 3]| lacking(t[0].into(), t[1].into(), t[2].into());
        t.iter().map(of).sum::<f64>()
    };
    let most = (every.iter().map(|(_, t)| sum(t))).fold(f64::NEG_INFINITY, f64::max);
    assert!(most.is_finite() && solver.solve_sum(6, -100.0, lacking));
    assert!((solver.worst - most).abs() < 1e-12 && (sum(&solver.triangles) - most).abs() < 1e-12);
    assert!(!solver.solve_sum(6, most + 1e-9, lacking));
}

#[test]
fn a_collapse_is_a_replacement() {
    let mut mesh = build(&cloud(200));
    constrain(&mut mesh);
    let before = checked(&mut mesh);
    let (mut ball, mut replacement) = (Ball::default(), Replacement::default());
    let mut done = 0;
    for v in 8..mesh.vertex_ids_end() {
        assert!(ball.gather_of(&mut mesh, v, 1000));
        if ball.required {
            continue;
        }
        let target = ball.records[0].vertices().into_iter().find(|&w| w != v);
        let target = target.expect("four vertices");
        let mut new = Vec::new();
        for (record, &local) in ball.records.iter().zip(&ball.locals) {
            if record.local(target).is_none() {
                let mut node = record.vertices();
                node[usize::from(local)] = target;
                new.push(node);
            }
        }
        let positive = new.iter().all(|node| {
            let [a, b, c, d] = node.map(|v| mesh.point(v));
            orient(a, b, c, d) > 0.0
        });
        if positive && replacement.apply(&mut mesh, &ball.tets, &ball.records, &new) {
            mesh.free_vertex(v);
            done += 1;
        }
        if !positive {
            let short = &new[..new.len() - 1];
            assert!(!replacement.apply(&mut mesh, &ball.tets, &ball.records, short));
        }
    }
    assert!(done > 10, "{done}");
    let after = checked(&mut mesh);
    assert!((before.0 - after.0).abs() < 1e-9 * before.0);
    assert_eq!(before.1, after.1);
}
