//! What is asked for and what was done.

use tetdb_base::geom::short;

/// What to do. Lengths are in input units.
#[derive(Clone, Copy, Debug)]
pub struct RemeshSettings {
    /// Greatest distance of the old surface from the new one, and of the new from the old.
    pub tolerance: f64,
    /// Cosine of the angle between normals from which an edge is kept.
    pub feature_cos: f64,
    /// Greatest length of edges; infinite for none.
    pub hmax: f64,
    /// Least length of edges; 0 for a share of the tolerance.
    pub hmin: f64,
    /// Growth of lengths with the distance.
    pub growth: f64,
}

impl RemeshReport {
    /// What was done, in words.
    pub fn in_words(&self) -> String {
        format!(
            "{} triangles became {}, with a smallest angle of {} degrees ({} before); no point of either surface is farther than {} from the other",
            self.triangles_before,
            self.triangles,
            short(self.angle),
            short(self.angle_before),
            short(self.distance_bound)
        )
    }
}

/// What was done.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct RemeshReport {
    /// Triangles of the input.
    pub triangles_before: u64,
    /// Triangles of the result.
    pub triangles: u64,
    /// Edges divided.
    pub splits: u64,
    /// Edges collapsed.
    pub collapses: u64,
    /// Edges flipped.
    pub flips: u64,
    /// Vertices moved.
    pub moves: u64,
    /// Bound on the distance of any point of either surface from the other, in input units.
    pub distance_bound: f64,
    /// Smallest angle of the input in degrees.
    pub angle_before: f64,
    /// Smallest angle of the result in degrees.
    pub angle: f64,
    /// Kept curves: edges between faces, borders of labels, edges with more than two triangles.
    pub curves: u64,
    /// Vertices that stayed because kept curves end there or bend sharply.
    pub corners: u64,
}
