//! Steiner points are tidied wherever their ids lie.

use super::build::{check, delaunay};
use crate::boundary::report::RecoveryReport;
use crate::boundary::tidy::tidy;
use crate::delaunay::Kernel;
use crate::mesh::VertexTag;
use tetdb_base::geom::Point;

#[test]
fn the_last_point_of_several_pages_goes_too() {
    // More than the 2,046 vertices of a page, so that ids have gaps.
    let side = |i: u32| f64::from(i) + 0.1 * (f64::from(i) * 1.7).sin();
    let points: Vec<Point> = (0..13 * 13 * 13)
        .map(|i| Point::new(side(i % 13), side(i / 13 % 13) + 0.03 * side(i % 7), side(i / 169)))
        .collect();
    let mut mesh = delaunay(&points, &[]);
    // Beside another vertex its ball is flat: any other mesh of it is better.
    let p = points[6 * 169 + 6 * 13 + 6] + Point::new(1e-4, 2e-4, 3e-4);
    let v = mesh.add_vertex(p, 0.0);
    mesh.set_vertex_attribute(v, VertexTag::Steiner, 0);
    assert!(v >= mesh.n_vertices(), "ids have no gap");
    let hint = mesh.tet_of(0);
    Kernel::default().insert(&mut mesh, v, p, hint).expect("inside the box and new");
    mesh.refresh_tet_of();
    let mut report = RecoveryReport { steiner: 1, ..RecoveryReport::default() };
    let before = mesh.n_vertices();
    tidy(&mut mesh, &mut report);
    assert_eq!((report.steiner, mesh.n_vertices()), (0, before - 1));
    check(&mut mesh);
}
