//! Small meshes against the definition: mutual neighbors, positive volumes, empty spheres.

use super::*;
use crate::mesh::{FaceRef, Mesh, Tet};
use tetdb_base::geom::{Aabb, Point, in_sphere_perturbed, orient};
use tetdb_base::storage::{FlatPages, Pager, Pages};

/// Deterministic pseudo-random numbers in [0, 1).
fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

fn build<P: Pages>(mut mesh: Mesh<P>, points: &[Point]) -> Mesh<P> {
    let mut kernel = Kernel::default();
    let mut hint = enclose(&mut mesh, &Aabb::around(points.iter().copied()));
    for &p in points {
        let v = mesh.add_vertex(p, 0.0);
        hint = kernel.insert(&mut mesh, v, p, hint).expect("inside the box and new");
    }
    mesh
}

/// Checks the mesh and returns its tetrahedra as sorted coordinate bits.
fn checked<P: Pages>(mesh: &mut Mesh<P>) -> Vec<[[u64; 3]; 4]> {
    let mut all = Vec::new();
    let mut from = 0;
    while let Some((t, tet)) = mesh.next_tet(from) {
        from = t + 1;
        let p = mesh.points(&tet);
        assert!(orient(p[0], p[1], p[2], p[3]) > 0.0, "tetrahedron {t} is not positive");
        for i in 0..4 {
            let across = tet.neighbor[i];
            if !across.exists() {
                continue;
            }
            let other: Tet = mesh.tet(across.tet());
            assert_eq!(other.neighbor[across.face()], FaceRef::new(t, i));
            let (mut a, mut b) = (tet.face(i), other.face(across.face()));
            a.sort_unstable();
            b.sort_unstable();
            assert_eq!(a, b);
            let apex = mesh.point(other.vertex(across.face()));
            assert!(
                !in_sphere_perturbed(p[0], p[1], p[2], p[3], apex),
                "face {i} of {t} is not Delaunay"
            );
        }
        let mut bits = p.map(|p| p.to_array().map(f64::to_bits));
        bits.sort_unstable();
        all.push(bits);
    }
    assert_eq!(all.len(), mesh.n_tets() as usize);
    all.sort_unstable();
    all
}

fn grid(n: i32, scale: f64) -> Vec<Point> {
    let mut points = Vec::new();
    for x in 0..n {
        for y in 0..n {
            for z in 0..n {
                points.push(Point::new(f64::from(x), f64::from(y), f64::from(z)) * scale);
            }
        }
    }
    points
}

#[test]
fn the_mesh_is_a_function_of_the_point_set() {
    let mut next = random(7);
    let cloud: Vec<Point> = (0..700).map(|_| Point::new(next(), next(), next())).collect();
    let ring: Vec<Point> = (0..40)
        .map(|i| {
            let t = f64::from(i) / 40.0;
            Point::new(t, t * t, 0.0)
        })
        .collect();
    for (name, mut points) in
        [("cloud", cloud), ("grid", grid(7, 1.0)), ("fine grid", grid(6, 1e-9)), ("curve", ring)]
    {
        let first = checked(&mut build(Mesh::new(FlatPages::default()), &points));
        points.reverse();
        let half = points.len() / 2;
        points.rotate_left(half);
        let second = checked(&mut build(Mesh::new(Pager::new(1 << 24, None)), &points));
        assert_eq!(first, second, "{name}");
    }
}

#[test]
fn a_point_given_twice_is_refused_and_changes_nothing() {
    let mut mesh = build(Mesh::new(FlatPages::default()), &grid(3, 1.0));
    let before = checked(&mut mesh);
    let p = Point::new(1.0, 2.0, 0.0);
    let v = mesh.add_vertex(p, 0.0);
    let refused = Kernel::default().insert(&mut mesh, v, p, 0);
    assert!(matches!(refused, Err(Rejected::Duplicate(_))), "{refused:?}");
    assert_eq!(before, checked(&mut mesh));
}
