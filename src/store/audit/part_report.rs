//! The findings of one sub-domain, to be added to those of the others by any process.

use super::Report;
use super::against::FoundTriangles;
use super::embedded::FoundEmbedded;
use super::interface::InterfaceSides;

/// The findings of one sub-domain. Memory: its interface faces, and bits for its facets.
#[derive(rkyv::Archive, rkyv::Serialize, rkyv::Deserialize, Clone, Debug)]
pub struct PartReport {
    pub(super) report: Report,
    pub(super) digests: [[u64; 2]; 2],
    /// Region, tetrahedra, volume.
    pub(super) regions: Vec<(u32, u64, f64)>,
    pub(super) volumes: MeshVolumes,
    pub(super) interfaces: InterfaceSides,
    /// `None` without an input to compare with.
    pub(super) triangles: Option<FoundTriangles>,
    pub(super) embedded: Option<FoundEmbedded>,
}

/// Volumes of a sub-domain, or the sums of those of several.
#[derive(rkyv::Archive, rkyv::Serialize, rkyv::Deserialize, Clone, Debug, Default)]
pub(super) struct MeshVolumes {
    pub of_tets: f64,
    pub within_boundary: f64,
    /// Sum of the absolute values of the summands of the volume within the boundary.
    pub scale: f64,
    /// Bound of the rounding of these summands; for needles and thin plates it exceeds the tolerance.
    pub rounding: f64,
}

impl MeshVolumes {
    pub fn and(&self, next: &Self) -> Self {
        Self {
            of_tets: self.of_tets + next.of_tets,
            within_boundary: self.within_boundary + next.within_boundary,
            scale: self.scale + next.scale,
            rounding: self.rounding + next.rounding,
        }
    }
}
