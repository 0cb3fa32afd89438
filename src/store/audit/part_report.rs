//! What was found of one sub-domain, by whatever process: to be added to what was found of the others.

use super::Report;
use super::against::SeenTriangles;
use super::interface::InterfaceSides;
use super::wires::SeenWires;

/// What was found of one sub-domain. Memory: its interface faces, and bits for its facets.
#[derive(rkyv::Archive, rkyv::Serialize, rkyv::Deserialize, Clone, Debug)]
pub struct PartReport {
    pub(super) report: Report,
    pub(super) digests: [[u64; 2]; 2],
    /// Region, tetrahedra, volume.
    pub(super) regions: Vec<(u32, u64, f64)>,
    pub(super) volumes: MeshVolumes,
    pub(super) interfaces: InterfaceSides,
    /// Where there is an input to compare with.
    pub(super) triangles: Option<SeenTriangles>,
    pub(super) wires: Option<SeenWires>,
}

/// MeshVolumes of a sub-domain, or the sums of those of several.
#[derive(rkyv::Archive, rkyv::Serialize, rkyv::Deserialize, Clone, Debug, Default)]
pub(super) struct MeshVolumes {
    pub of_tets: f64,
    pub within_boundary: f64,
    /// Sum of the absolute values of what the volume within the boundary is made of.
    pub scale: f64,
    /// What rounding of those values adds up to at most: of needles and thin plates, more than the tolerance.
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
