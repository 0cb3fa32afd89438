//! The tetrahedra between the triangles: a Delaunay mesh in a loose box, in which all of them are faces.

use tetdb_base::geom::HilbertFrame;
use tetdb_base::storage::{FlatPages, check_cancelled};
use tetdb_base::surface::Surface;
use tetdb_kernel::boundary::{BoundaryError, recover_with_progress};
use tetdb_kernel::delaunay::{Kernel, enclose, insertion_key};
use tetdb_kernel::mesh::{Mesh, MeshFacet, SHEET, VertexTag};

/// Gets a stage, and how much of it is done of how much.
pub type Watcher<'a> = dyn Fn(&'static str, u64, u64) + 'a;

/// Vertices inserted between two looks at whether the run is cancelled.
const AT_ONCE: usize = 1 << 12;

/// Makes the mesh. Facets and vertices of the surface keep their numbers in `input` and in the vertex attribute.
///
/// # Errors
/// Triangles that cannot be recovered. The triangles must not touch but in common vertices and edges.
pub fn coarse(surface: &Surface, watch: &Watcher) -> Result<Mesh<FlatPages>, BoundaryError> {
    let mut mesh = Mesh::new(FlatPages::default());
    let bounds = surface.bounds();
    let frame = HilbertFrame::new(&bounds);
    let mut order: Vec<(u64, u32)> =
        (0u32..).zip(&surface.points).map(|(i, &p)| (insertion_key(&frame, p), i)).collect();
    order.sort_unstable();
    let mut kernel = Kernel::default();
    let mut hint = enclose(&mut mesh, &bounds);
    let mut number = vec![0u32; order.len()];
    for (k, &(_, i)) in order.iter().enumerate() {
        let p = surface.points[i as usize];
        let v = mesh.add_vertex(p, 0.0);
        mesh.set_vertex_attribute(v, VertexTag::Surface, i);
        number[i as usize] = v;
        hint = kernel
            .insert(&mut mesh, v, p, hint)
            .unwrap_or_else(|why| panic!("vertex {i} at {p} was refused: {why:?}"));
        if k % AT_ONCE == 0 {
            check_cancelled();
            watch("coarse mesh", k as u64, order.len() as u64);
        }
    }
    for (n, (corners, &label)) in surface.triangles.iter().zip(&surface.labels).enumerate() {
        mesh.add_facet(MeshFacet {
            vertices: corners.map(|c| number[c as usize]),
            label,
            input: n as u64,
            regions: [0, SHEET],
        });
    }
    mesh.refresh_tet_of();
    recover_with_progress(&mut mesh, &|done, total| watch("recover the surface", done, total))?;
    Ok(mesh)
}
