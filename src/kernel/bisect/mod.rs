//! One cut: plane, refined zone, interface, two children.
//!
//! 1. `plane`: across an axis of inertia of the load to come, where the load is shared as wanted.
//! 2. `zone`: edges that meet a band around it are divided until the band has its final density.
//! 3. `core`: its middle is copied out and optimized as a mesh of its own.
//! 4. `interface`: faces of these final tetrahedra are chosen, by a minimum cut and moves; from then on they are required.
//! 5. `write_child`: each side becomes a mesh of its own.
//!
//! Tetrahedra at the interface (Z) that later vertices could destroy are frozen, so that valid ones stay valid. Hits on
//! them are counted; if there are none, the interface has cost the Delaunay property nothing.
//!
//! Source: the paper, section 1.1.

mod axes;
mod child_builder;
mod core;
mod flow;
mod inherit;
mod interface;
mod interface_faces;
mod load;
mod load_profile;
mod moves;
mod open_cut;
mod plane;
mod report;
mod side_labels;
mod surface;
mod write_child;
mod zone;

pub use axes::principal_axes;
pub use flow::{Capacity, FlowArc, Graph};
pub use interface::InterfaceReport;
pub use load::{SizeFn, load_of};
pub use load_profile::ChosenPlane;
pub use open_cut::OpenCut;
pub use plane::{PlaneChoice, choose as choose_plane};
pub use report::{CutReport, StageSeconds};
pub use side_labels::InterfaceMeasures;
pub use surface::{CuttingSurface, Plane};
pub use write_child::write_child;
pub use zone::{OutsideZones, WIDTH_MIN, WIDTH_NOISE, Zone};

use std::time::Instant;

use crate::blocks::{self, Field, RefineReport};
use crate::mesh::Mesh;
use crate::optimize::{self, Mode, Settings};
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::{DiskPath, Pages};

/// Sweeps of smoothing of a core at most, since its surroundings are smoothed later, once more with all but its interface. On a box of 1.2 M the
/// Kolmogorov distance of qualities near the interface is 0.008 with two, 0.018 with three and 0.038 with as many as bring the core to rest.
const CORE_SWEEPS: u32 = 2;

/// Parameters of a cut.
#[derive(Clone, Copy)]
pub struct CutPlan<'a> {
    /// Number of the cut, from 1.
    pub cut: u32,
    /// Share of the load that belongs on the low side.
    pub low: f64,
    /// Choice of the cutting plane.
    pub plane: PlaneChoice,
    /// Zones of the cuts above it.
    pub earlier: &'a [Zone],
    /// Wanted length at a position.
    pub h: &'a SizeFn<'a>,
    /// Box of the whole mesh.
    pub bounds: Aabb,
    /// Settings of the optimization of the core.
    pub optimize: Settings,
}

/// A sub-domain whose zone is refined.
pub struct RefinedZone {
    /// The zone that was refined.
    pub zone: Zone,
    plane: ChosenPlane,
    refine: RefineReport,
    seconds: StageSeconds,
}

/// Faces of an interface as points, seen from the low side: before and after the choice.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InterfaceFaces {
    /// Faces before the choice.
    pub natural: Vec<[Point; 3]>,
    /// Faces of the chosen interface.
    pub chosen: Vec<[Point; 3]>,
}

/// The first part of a cut: the plane is chosen and its zone refined. `dir` takes what leaves memory.
///
/// `progress` receives a stage and, if it is known, how many predicted tetrahedra of how many are done. Effects: all ids of
/// tetrahedra of `host` may change. Unwinds with errors of the disk.
pub fn refine<P: Pages>(
    host: &mut Mesh<P>,
    plan: &CutPlan,
    dir: &DiskPath,
    progress: &dyn Fn(&'static str, Option<(u64, u64)>),
) -> RefinedZone {
    let clock = Instant::now();
    let mut seconds = StageSeconds::default();
    progress("choose a plane", None);
    plane::set_sizes(host, plan.h);
    let plane = plane::choose(host, plan.h, plan.bounds.low, plan.low, plan.plane);
    seconds.plane = clock.elapsed().as_secs_f64();
    let zone = Zone { cut: plan.cut, surface: plane.plane };
    let field = Field {
        h: plan.h,
        place: &zone::InZone { zone: &zone, earlier: plan.earlier },
        bounds: plan.bounds,
    };
    let progress = &mut |done, total| progress("refine the zone", Some((done, total)));
    let refine = blocks::saturate(host, &field, Mode::None, dir, progress).refine;
    seconds.zone = clock.elapsed().as_secs_f64() - seconds.plane;
    RefinedZone { zone, plane, refine, seconds }
}

/// The second part: chooses the interface in `core`, which must be empty; `faces` receives the natural and
/// the chosen faces.
pub fn choose<P: Pages, Q: Pages>(
    host: &mut Mesh<P>,
    core: &mut Mesh<Q>,
    plan: &CutPlan,
    refined: RefinedZone,
    mut faces: Option<&mut InterfaceFaces>,
    progress: &dyn Fn(&'static str, Option<(u64, u64)>),
) -> OpenCut {
    let RefinedZone { zone, plane, refine, mut seconds } = refined;
    let clock = Instant::now();
    progress("choose the interface", None);
    let core_boundary = core::extract(host, core, &zone.surface);
    let mut settings = plan.optimize;
    settings.odt_sweeps = settings.odt_sweeps.min(CORE_SWEEPS);
    optimize::run_with(core, settings, &|_| {});
    seconds.core = clock.elapsed().as_secs_f64();
    let natural = faces.as_mut().map(|f| &mut f.natural);
    let (interface, labels) = interface::choose(core, &zone.surface, &core_boundary, natural);
    if let Some(faces) = faces {
        faces.chosen = interface_faces::interface_points(core, &labels);
    }
    let vertices = interface_faces::number_interface(core, &labels, plan.cut);
    let (z_tets, z_enclosed) = side_labels::enclosed(core, &labels, &zone.surface, plan.h);
    let layers_least =
        side_labels::layers_least(host, core, &labels, &core_boundary, &zone.surface);
    seconds.interface = clock.elapsed().as_secs_f64() - seconds.core;
    OpenCut {
        zone,
        report: CutReport {
            plane,
            refine,
            interface,
            vertices,
            z_tets,
            z_enclosed,
            layers_least,
            seconds,
        },
        core_boundary,
        labels,
    }
}
