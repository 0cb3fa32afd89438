//! The coarse mesh: the Delaunay mesh of the surface's vertices with every triangle of it, emptied outside.

use rayon::prelude::*;

use super::watch::{Event, Watcher};
use super::{Options, PipelineError};
use crate::boundary::{RecoveryReport, Regions, fill_regions, recover};
use crate::delaunay::{Kernel, KernelStats, enclose, insertion_key};
use crate::geom::HilbertFrame;
use crate::mesh::{Facet, Mesh, VertexTag};
use crate::store::Pages;
use crate::surface::Surface;

/// What the coarse step did.
#[derive(Clone, Debug)]
pub struct CoarseReport {
    pub kernel: KernelStats,
    pub recovery: RecoveryReport,
    pub regions: Regions,
}

/// Points between two words to the watcher.
const TELL_EVERY: usize = 4096;

/// Builds the coarse mesh of a valid surface into an empty mesh.
///
/// Errors: triangles that cannot be recovered; regions of which none is filled.
pub fn coarse<P: Pages>(
    mesh: &mut Mesh<P>,
    surface: &Surface,
    options: &Options,
    watch: &Watcher,
) -> Result<CoarseReport, PipelineError> {
    let kernel = triangulate(mesh, surface, watch);
    watch(stage("recover the surface"));
    mesh.refresh_tet_of();
    let recovery = recover(mesh)?;
    watch(stage("color the regions"));
    let regions = fill_regions(mesh, &options.regions()?)?;
    if mesh.n_tets() == 0 {
        return Err(PipelineError::NothingFilled {
            policy: options
                .regions
                .clone()
                .unwrap_or_else(|| "parity".to_owned()),
        });
    }
    Ok(CoarseReport {
        kernel,
        recovery,
        regions,
    })
}

fn stage(stage: &'static str) -> Event {
    Event {
        stage,
        done: 0,
        total: None,
        unit: "",
    }
}

/// Inserts the surface's vertices and lists its facets.
///
/// Vertices are numbered in the order of insertion, so that near vertices share pages; the number in the surface is
/// kept as the owner's index.
fn triangulate<P: Pages>(mesh: &mut Mesh<P>, surface: &Surface, watch: &Watcher) -> KernelStats {
    let bounds = surface.bounds();
    let frame = HilbertFrame::new(&bounds);
    let mut order: Vec<(u64, u32)> = surface
        .points
        .par_iter()
        .enumerate()
        .map(|(i, &p)| (insertion_key(&frame, p), i as u32))
        .collect();
    order.par_sort_unstable();
    let mut kernel = Kernel::default();
    let mut hint = enclose(mesh, &bounds);
    let mut number = vec![0u32; surface.points.len()];
    let total = order.len();
    for (k, (_, i)) in order.into_iter().enumerate() {
        let p = surface.points[i as usize];
        let v = mesh.add_vertex(p, 0.0);
        mesh.set_vertex_attribute(v, VertexTag::Surface, i);
        number[i as usize] = v;
        hint = kernel
            .insert(mesh, v, p, hint)
            .unwrap_or_else(|e| panic!("vertex {i} of the surface at {p} was refused: {e:?}"));
        if k % TELL_EVERY == 0 {
            watch(Event {
                stage: "coarse mesh",
                done: k as u64,
                total: Some(total as u64),
                unit: "vertices",
            });
        }
    }
    for (n, (corners, &label)) in surface.triangles.iter().zip(&surface.labels).enumerate() {
        mesh.add_facet(Facet {
            vertices: corners.map(|c| number[c as usize]),
            label,
            input: n as u64,
            regions: [0, 0],
        });
    }
    kernel.stats
}
