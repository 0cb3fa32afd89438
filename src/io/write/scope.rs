//! The part of a store that becomes one mesh.

use std::collections::BTreeSet;

/// Boundary faces of the written mesh, besides those shared with sub-domains that are not written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FaceSet {
    /// Input triangles.
    Skin,
    /// Input triangles and all interface faces.
    SkinAndInterfaces,
    /// All interface faces, no input triangle.
    Interfaces,
    /// No face at all, for processes that write no faces.
    Nothing,
}

/// The written part: these sub-domains, or all when there are none, with these faces.
#[derive(Clone, Copy)]
pub(super) struct Scope<'s> {
    pub ranks: &'s BTreeSet<u32>,
    /// Only these regions, or all when there are none.
    pub regions: &'s BTreeSet<u32>,
    pub faces: FaceSet,
    /// Each sub-domain numbers all its vertices, also shared ones.
    pub apart: bool,
}

/// Stands for all sub-domains and all regions.
static ALL: BTreeSet<u32> = BTreeSet::new();

impl Scope<'_> {
    /// All sub-domains and regions, with the input triangles.
    pub const WHOLE: Self =
        Scope { ranks: &ALL, regions: &ALL, faces: FaceSet::Skin, apart: false };

    /// Returns whether a sub-domain is written.
    pub fn holds(&self, rank: u32) -> bool {
        self.ranks.is_empty() || self.ranks.contains(&rank)
    }

    /// The region, or 0 where it is not written.
    pub fn region(&self, region: u32) -> u32 {
        let is_written = self.regions.is_empty() || self.regions.contains(&region);
        if is_written { region } else { 0 }
    }

    /// Returns whether sub-domain `rank`, which is written, lists its faces towards `other`.
    pub fn lists(&self, rank: u32, other: u32) -> bool {
        !self.holds(other) || (self.faces != FaceSet::Skin && rank < other)
    }
}
