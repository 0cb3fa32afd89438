//! From a surface to the mesh recovery starts with, and the checks after each stage.

use std::collections::HashMap;

use crate::delaunay::{Kernel, enclose, insertion_key};
use crate::mesh::{FaceRef, Mesh, MeshFacet, VertexTag};
use tetdb_base::geom::{Aabb, HilbertFrame, Point, orient};
use tetdb_base::storage::{FlatPages, Pages};

/// The Delaunay mesh of `points` in its box, with `triangles` as facets.
pub fn delaunay(points: &[Point], triangles: &[[u32; 3]]) -> Mesh<FlatPages> {
    let mut mesh = Mesh::new(FlatPages::default());
    let bounds = Aabb::around(points.iter().copied());
    let mut hint = enclose(&mut mesh, &bounds);
    let frame = HilbertFrame::new(&bounds);
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    order.sort_by_key(|&i| insertion_key(&frame, points[i as usize]));
    let mut kernel = Kernel::default();
    let mut id = vec![0; points.len()];
    for i in order {
        let p = points[i as usize];
        let v = mesh.add_vertex(p, 0.0);
        mesh.set_vertex_attribute(v, VertexTag::Surface, i);
        hint = kernel.insert(&mut mesh, v, p, hint).expect("inside the box and new");
        id[i as usize] = v;
    }
    for (n, t) in triangles.iter().enumerate() {
        mesh.add_facet(MeshFacet {
            vertices: t.map(|i| id[i as usize]),
            label: 0,
            input: n as u64,
            regions: [0; 2],
        });
    }
    mesh.refresh_tet_of();
    mesh
}

/// Volumes exactly positive, neighbors mutual, required faces on both sides.
pub fn check<P: Pages>(mesh: &mut Mesh<P>) {
    let mut from = 0;
    let mut n = 0;
    while let Some((t, tet)) = mesh.next_tet(from) {
        from = t + 1;
        n += 1;
        let [a, b, c, d] = mesh.points(&tet);
        assert!(orient(a, b, c, d) > 0.0, "tetrahedron {t} is not positive");
        for i in 0..4 {
            let across = tet.neighbor[i];
            if !across.exists() {
                continue;
            }
            let other = mesh.tet(across.tet());
            assert_eq!(other.neighbor[across.face()], FaceRef::new(t, i));
            assert_eq!(other.is_required(across.face()), tet.is_required(i));
            let (mut f, mut g) = (tet.face(i), other.face(across.face()));
            f.sort_unstable();
            g.sort_unstable();
            assert_eq!(f, g);
        }
    }
    assert_eq!(n, mesh.n_tets());
}

/// The required faces are the facets, no more and no fewer; no vertex lies on the surface but its own.
pub fn check_facets<P: Pages>(mesh: &mut Mesh<P>) {
    let mut wanted: HashMap<[u32; 3], bool> = HashMap::new();
    for n in 0..mesh.n_facets() {
        let mut f = mesh.facet(n).vertices;
        f.sort_unstable();
        wanted.insert(f, false);
    }
    let mut from = 0;
    while let Some((t, tet)) = mesh.next_tet(from) {
        from = t + 1;
        for i in (0..4).filter(|&i| tet.is_required(i)) {
            let mut f = tet.face(i);
            f.sort_unstable();
            let found = wanted.get_mut(&f);
            *found.unwrap_or_else(|| panic!("face {f:?} of {t} is required and no facet")) = true;
        }
    }
    let lost = wanted.values().filter(|&&found| !found).count();
    assert_eq!(lost, 0, "facets that are no faces");
}
