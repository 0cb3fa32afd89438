//! A sub-domain with a chosen interface, before its two children are written.

use super::core::CoreBoundary;
use super::report::CutReport;
use super::side_labels::SideLabels;
use super::zone::Zone;

/// A sub-domain cut open: its interface is chosen, the children are not yet written.
pub struct OpenCut {
    /// The refined zone of the cut.
    pub zone: Zone,
    /// Report of the cut.
    pub report: CutReport,
    pub(super) core_boundary: CoreBoundary,
    pub(super) labels: SideLabels,
}
