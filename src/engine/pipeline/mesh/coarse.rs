//! The coarse mesh: the Delaunay mesh of the surface's vertices with every surface triangle recovered and the outside emptied.
//! Where recovery leaves it non-Delaunay, flips restore the Delaunay property.

use crate::pipeline::error::PipelineError;
use crate::pipeline::plan::Options;
use crate::pipeline::progress::{Event, Watcher};
use tetdb_base::geom::HilbertFrame;
use tetdb_base::storage::{KeyedId, OrRaise, Pages, ScratchSpace};
use tetdb_base::surface::Surface;
use tetdb_kernel::boundary::{RecoveryReport, VolumeRegions, fill_regions, recover_with_progress};
use tetdb_kernel::delaunay::{Kernel, KernelStats, Rejected, enclose, insertion_key};
use tetdb_kernel::mesh::{Mesh, MeshFacet, SHEET, VertexTag};
use tetdb_kernel::optimize;
use tetdb_schema::word::Word;

/// Report of the coarse step.
#[derive(Clone, Debug)]
pub struct CoarseReport {
    /// Counters of the Delaunay insertion.
    pub kernel: KernelStats,
    /// Report of the boundary recovery.
    pub recovery: RecoveryReport,
    /// The volumes, and which of them are filled.
    pub regions: VolumeRegions,
}

/// Number of points between two events to the watcher.
const REPORT_EVERY: usize = 4096;

/// Builds the coarse mesh of a valid surface in an empty mesh.
///
/// Errors: a triangle that cannot be recovered; no region is filled. Failed page or scratch file accesses unwind.
pub fn coarse<P: Pages>(
    mesh: &mut Mesh<P>,
    surface: &Surface,
    options: &Options,
    scratch: &ScratchSpace,
    watch: &Watcher,
) -> Result<CoarseReport, PipelineError> {
    let kernel = inserted(mesh, surface, scratch, watch);
    recovered(mesh, kernel, options, watch)
}

/// [`triangulate`] for a valid surface; panics if a vertex is refused.
pub fn inserted<P: Pages>(
    mesh: &mut Mesh<P>,
    surface: &Surface,
    scratch: &ScratchSpace,
    watch: &Watcher,
) -> KernelStats {
    triangulate(mesh, surface, scratch, watch).unwrap_or_else(|(i, why)| {
        let p = surface.points[i as usize];
        panic!("vertex {i} of the surface at {p} was refused: {why:?}")
    })
}

/// Second half of [`coarse`]: recovers the surface and fills the regions. It reads the facets of the mesh, not the surface.
pub fn recovered<P: Pages>(
    mesh: &mut Mesh<P>,
    kernel: KernelStats,
    options: &Options,
    watch: &Watcher,
) -> Result<CoarseReport, PipelineError> {
    let (recovery, regions) = recovered_and_colored(mesh, watch, |mesh| {
        let regions = fill_regions(mesh, &options.mesh.regions)?;
        match mesh.n_tets() {
            0 => Err(PipelineError::NothingFilled {
                policy: options.mesh.regions.policy.word().to_owned(),
            }),
            _ => Ok(regions),
        }
    })?;
    Ok(CoarseReport { kernel, recovery, regions })
}

/// Recovers the facets of a Delaunay mesh of their vertices, lets `color` keep what they enclose, and restores the Delaunay property.
pub fn recovered_and_colored<P: Pages, T>(
    mesh: &mut Mesh<P>,
    watch: &Watcher,
    color: impl FnOnce(&mut Mesh<P>) -> Result<T, PipelineError>,
) -> Result<(RecoveryReport, T), PipelineError> {
    watch(Event::begin("recover the surface"));
    mesh.refresh_tet_of();
    let recovery = recover_with_progress(mesh, &|done, total| {
        watch(Event {
            done,
            total: (total > 0).then_some(total),
            unit: "edges and triangles",
            ..Event::begin("recover the surface")
        });
    })?;
    watch(Event::begin("color the regions"));
    let colored = color(mesh)?;
    if recovery.missing_segments + recovery.missing_facets > 0 {
        // Recovery leaves the mesh non-Delaunay. In a Delaunay mesh, inserted points have smaller cavities: dividing a scanned
        // surface's mesh takes an eighth less time.
        optimize::run(mesh, optimize::Mode::None, &|p| watch(p.into()));
    }
    Ok((recovery, colored))
}

/// Inserts the surface's vertices and adds its facets to the mesh.
///
/// Vertices are numbered in the order of insertion, so that near vertices share pages. The vertex attribute keeps the number that
/// the vertex has in the surface. Errors: a refused vertex; a valid surface has none.
pub fn triangulate<P: Pages>(
    mesh: &mut Mesh<P>,
    surface: &Surface,
    scratch: &ScratchSpace,
    watch: &Watcher,
) -> Result<KernelStats, (u32, Rejected)> {
    let bounds = surface.bounds();
    let frame = HilbertFrame::new(&bounds);
    let mut order = scratch.sorter::<KeyedId>();
    for (i, &p) in (0u32..).zip(&surface.points) {
        let key = insertion_key(&frame, p);
        order.push(KeyedId { key, id: i }).or_raise();
    }
    let order = order.finish().or_raise();
    let mut kernel = Kernel::default();
    let mut hint = enclose(mesh, &bounds);
    let total = surface.points.len();
    let mut number = scratch.vec(total, 0u32);
    for (k, record) in order.enumerate() {
        let i = record.or_raise().id;
        let p = surface.points[i as usize];
        let v = mesh.add_vertex(p, 0.0);
        mesh.set_vertex_attribute(v, VertexTag::Surface, i);
        number.set(i as usize, v);
        hint = kernel.insert(mesh, v, p, hint).map_err(|why| (i, why))?;
        if k % REPORT_EVERY == 0 {
            watch(Event {
                stage: "coarse mesh",
                done: k as u64,
                total: Some(total as u64),
                unit: "vertices",
            });
        }
    }
    for (n, (corners, &label)) in surface.triangles.iter().zip(&surface.labels).enumerate() {
        mesh.add_facet(MeshFacet {
            vertices: corners.map(|c| number.get(c as usize)),
            label,
            input: n as u64,
            regions: [0, u32::from(surface.is_sheet(n as u32)) * SHEET],
        });
    }
    Ok(kernel.stats)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::progress::silent;
    use tetdb_base::storage::FlatPages;
    use tetdb_kernel::samples::SampleSpec;

    /// No face of the finished coarse mesh can be flipped towards Delaunay any more.
    #[test]
    fn it_is_delaunay_again_after_recovery() {
        let spec = SampleSpec::parse("needles,count=32").expect("a good sample");
        let surface: Surface = spec.make().expect("room for three parts").into();
        let mut mesh = Mesh::new(FlatPages::default());
        let room = ScratchSpace::boundless();
        let made = coarse(&mut mesh, &surface, &Options::default(), &room, &silent);
        let recovery = made.expect("it can be recovered").recovery;
        assert!(recovery.missing_segments + recovery.missing_facets > 0);
        let again = optimize::run(&mut mesh, optimize::Mode::None, &|_| ()).flips;
        assert_eq!(again.flips_23 + again.flips_32 + again.flips_44, 0);
    }
}
