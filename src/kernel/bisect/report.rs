//! The report of a cut.

use super::interface::InterfaceReport;
use super::load_profile::ChosenPlane;
use crate::blocks::RefineReport;

/// The report of a cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutReport {
    /// The plane and the load on its sides.
    pub plane: ChosenPlane,
    /// Report of the saturation of the zone.
    pub refine: RefineReport,
    /// Report of the choice of the interface.
    pub interface: InterfaceReport,
    /// Interface vertices of the cut, which bear its number.
    pub vertices: u32,
    /// Tetrahedra with a face on the interface, and those whose circumsphere lies in the refined zone.
    pub z_tets: u64,
    /// Of these, tetrahedra whose circumsphere lies in the refined zone.
    pub z_enclosed: u64,
    /// Tetrahedra, from face to face, between the interface and the first with a vertex out of the refined zone, at least; three
    /// stands for more.
    pub layers_least: Option<u32>,
    /// Wall time of each stage.
    pub seconds: StageSeconds,
}

/// Wall time of the stages of a cut.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageSeconds {
    /// Choosing the plane.
    pub plane: f64,
    /// Saturating the refined zone.
    pub zone: f64,
    /// Copying the core out and optimizing it.
    pub core: f64,
    /// Choosing the interface.
    pub interface: f64,
}
