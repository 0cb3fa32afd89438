//! A sub-domain between the choice of its interface and its two children.

use super::core::CoreBoundary;
use super::labels::Labels;
use super::report::CutReport;
use super::zone::Zone;

/// A sub-domain cut open: its interface is chosen, the children are not yet written.
pub struct Opened {
    /// The refined zone of the cut.
    pub zone: Zone,
    /// How the cut went.
    pub report: CutReport,
    pub(super) rim: CoreBoundary,
    pub(super) labels: Labels,
}
