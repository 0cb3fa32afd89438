//! Components found page by page equal those of a walk from tetrahedron to tetrahedron.

use super::build::delaunay;
use super::shapes::{cube, joined, placed};
use crate::boundary::flood::{Flood, OUTSIDE};
use crate::boundary::recover;
use crate::mesh::Mesh;
use tetdb_base::geom::{Aabb, Point, orient};
use tetdb_base::storage::FlatPages;

/// Component, volume and number of tetrahedra by tetrahedron and by component, found by walking: the outside first, the others as they come.
fn walked(mesh: &mut Mesh<FlatPages>) -> (Vec<u32>, Vec<(f64, u32)>) {
    let mut of = vec![0; mesh.tet_ids_end() as usize];
    let mut found = vec![(0.0, 0)];
    let mut starts = vec![mesh.tet_of(0)];
    let mut from = 0;
    while let Some((t, _)) = mesh.next_tet(from) {
        from = t + 1;
        starts.push(t);
    }
    for start in starts {
        if of[start as usize] != 0 {
            continue;
        }
        let component = found.len() as u32;
        let (mut volume, mut n) = (0.0, 0);
        of[start as usize] = component;
        let mut stack = vec![start];
        while let Some(t) = stack.pop() {
            let tet = mesh.tet(t);
            let [a, b, c, d] = mesh.points(&tet);
            volume += orient(a, b, c, d) / 6.0;
            n += 1;
            for i in (0..4).filter(|&i| tet.neighbor[i].exists() && !tet.is_required(i)) {
                let across = tet.neighbor[i].tet();
                if of[across as usize] == 0 {
                    of[across as usize] = component;
                    stack.push(across);
                }
            }
        }
        found.push((volume, n));
    }
    (of, found)
}

#[test]
fn components_across_pages_are_those_that_a_walk_finds() {
    // A shell in a shell, and eleven cubes side by side in the inner one.
    let solid = cube(12, |x, y, _| (x + y).is_multiple_of(2));
    let small = cube(2, |_, _, _| true);
    let mut parts = vec![
        placed(&solid, Point::splat(1.0), Point::ZERO),
        placed(&solid, Point::splat(0.8), Point::splat(1.2)),
    ];
    for i in 0..11 {
        let at = Point::new(1.5 + 0.8 * f64::from(i), 5.0, 6.0);
        parts.push(placed(&small, Point::splat(0.3), at));
    }
    let (points, triangles) = joined(&parts);
    let mut mesh = delaunay(&points, &triangles);
    recover(&mut mesh).expect("cubes apart from each other");
    let (of, expected) = walked(&mut mesh);
    let flood = Flood::run(&mut mesh);
    assert!(mesh.n_tets() > 3 * 2046, "several pages");
    assert_eq!(expected.len(), 1 + 14);
    assert_eq!(flood.components.len(), expected.len());
    let mut from = 0;
    while let Some((t, _)) = mesh.next_tet(from) {
        from = t + 1;
        assert_eq!(mesh.tet_attribute(t).0, of[t as usize], "tetrahedron {t}");
    }
    for (component, (volume, n)) in flood.components.iter().zip(expected) {
        assert_eq!(component.tets, n);
        assert!((component.volume - volume).abs() <= 1e-12 * volume);
    }
    let bounds = Aabb::around(points.iter().copied());
    let inside = bounds.high - bounds.low;
    let inner: f64 = flood.volumes().map(|c| flood.components[c as usize].volume).sum();
    assert!((inner - inside.x * inside.y * inside.z).abs() < 1e-9 * inner);
    assert!(flood.components[OUTSIDE as usize].volume > 0.0);
}
