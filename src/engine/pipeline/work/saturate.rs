//! The fine step of one sub-domain: sizes, saturation, optimization.

use std::time::Instant;

use super::common::Common;
use crate::pipeline::progress::{Event, Watcher};
use tetdb_base::storage::{DiskPath, Pages};
use tetdb_kernel::bisect::{OutsideZones, Zone};
use tetdb_kernel::blocks::{self, Everywhere, Field, Finished, PlacementRule, RefineReport};
use tetdb_kernel::mesh::Mesh;
use tetdb_kernel::optimize::{self, Mode, OptimizeReport};
use tetdb_kernel::sizing::SizeField;

/// Report of the fine step.
#[derive(Clone, Debug)]
pub struct FineReport {
    /// Report of the division of edges.
    pub refine: RefineReport,
    /// Report of the optimization.
    pub optimize: OptimizeReport,
    /// Seconds of refinement and of optimization.
    pub seconds: [f64; 2],
}

/// Divides the edges of a coarse mesh and optimizes it. No vertex is added in `zones`, which are final. Where nothing is left to
/// do the mesh is returned in bricks, and is no longer in `mesh`.
pub fn saturate_and_optimize<P: Pages>(
    mesh: &mut Mesh<P>,
    field: &SizeField,
    common: Common,
    zones: &[Zone],
    dir: &DiskPath,
    watch: &Watcher,
) -> (FineReport, Option<Finished>) {
    const STAGE: &str = "divide and smooth";
    watch(Event::begin(STAGE));
    let clock = Instant::now();
    for v in mesh.vertex_ids() {
        let p = mesh.point(v);
        mesh.set_size(v, field.h(p) as f32);
    }
    let h = |p| field.h(p);
    let outside = OutsideZones(zones);
    let place: &dyn PlacementRule = if zones.is_empty() { &Everywhere } else { &outside };
    let wanted = Field { h: &h, place, bounds: common.bounds };
    let told = &mut |done, total| watch(Event::tets(STAGE, (done, total)));
    let (report, finished) = match common.mode {
        Mode::None => (blocks::saturate(mesh, &wanted, Mode::None, dir, told), None),
        mode => blocks::saturate_to_seal(mesh, &wanted, mode, dir, told),
    };
    let refined = clock.elapsed().as_secs_f64();
    let mut optimize =
        OptimizeReport { operations: report.operations, ..OptimizeReport::default() };
    match common.mode {
        _ if finished.is_some() => {}
        Mode::Full => optimize.mended = optimize::mend(mesh, &|p| watch(p.into())),
        Mode::Delaunay => mesh.refresh_tet_of(),
        Mode::None => optimize = optimize::run(mesh, common.mode, &|p| watch(p.into())),
    }
    let seconds = [refined, clock.elapsed().as_secs_f64() - refined];
    (FineReport { refine: report.refine, optimize, seconds }, finished)
}
