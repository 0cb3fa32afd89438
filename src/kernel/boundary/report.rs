//! Counts and times of boundary recovery.

use std::time::Duration;

/// Gets how much is done and how much there is to do.
pub type RecoveryWatcher<'a> = dyn Fn(u64, u64) + 'a;

/// Counts and times of a recovery.
#[derive(Clone, Debug, Default)]
pub struct RecoveryReport {
    /// Facets of the input.
    pub facets: u32,
    /// Facets the Delaunay mesh does not have.
    pub missing_facets: u32,
    /// Segments the Delaunay mesh does not have.
    pub missing_segments: u32,
    /// Segments recovered by flips.
    pub segments_by_flips: u32,
    /// Facets that flips recovered, or that were there once their segments were.
    pub facets_by_flips: u32,
    /// Facets recovered with vertices that were moved into the volumes afterwards.
    pub facets_by_points: u32,
    /// Patches in which that was done.
    pub patches: u32,
    /// Vertices put on the input for a while.
    pub points_on_surface: u32,
    /// Steiner points left, all inside volumes.
    pub steiner: u32,
    /// Flips done.
    pub flips: u64,
    /// Time to find missing segments and facets.
    pub map_time: Duration,
    /// Time to recover by flips.
    pub flip_time: Duration,
    /// Time to recover with vertices on the surface, which are then moved into the volumes.
    pub point_time: Duration,
}

impl RecoveryReport {
    /// Reports progress: the number recovered, of those that were missing. A segment that comes with the facets around
    /// it is never counted.
    pub(super) fn notify(&self, watch: &RecoveryWatcher) {
        let done = self.segments_by_flips + self.facets_by_flips + self.facets_by_points;
        let total = self.missing_segments + self.missing_facets;
        watch(u64::from(done), u64::from(total));
    }
}
