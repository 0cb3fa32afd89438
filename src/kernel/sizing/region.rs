//! One size for some of the enclosed volumes.

use super::SizingError;
use super::constraint::SizeConstraint;
use tetdb_base::geom::Point;
use tetdb_base::storage::ScratchSpace;
use tetdb_base::surface::{EnclosedVolumes, Seeker};

/// Cells at the border of a region are at most this many of its lengths wide.
const BORDER_CELLS: f64 = 2.0;

/// A length inside a region; away from it lengths grow as the gradation allows.
pub struct Region<'a> {
    seeker: &'a Seeker<'a>,
    volumes: &'a EnclosedVolumes,
    /// By volume.
    is_here: Vec<bool>,
    /// Sees the triangles around the region.
    border: Seeker<'a>,
    h: f64,
    beta: f64,
}

impl<'a> Region<'a> {
    /// Length `h` in the volumes that `is_here` names, for a field of slope `beta`. A scratch file that fails unwinds.
    pub fn new(
        seeker: &'a Seeker<'a>,
        volumes: &'a EnclosedVolumes,
        is_here: Vec<bool>,
        h: f64,
        beta: f64,
        scratch: &ScratchSpace,
    ) -> Self {
        let is_border = |t: u32| {
            let [front, back] = volumes.of_side[t as usize].map(|v| is_here[v as usize]);
            front || back
        };
        Self {
            seeker,
            volumes,
            border: Seeker::with_filter(seeker.surface(), scratch, is_border),
            is_here,
            h,
            beta,
        }
    }

    fn holds(&self, p: Point) -> bool {
        self.is_here[self.volumes.at(self.seeker, p) as usize]
    }
}

impl SizeConstraint for Region<'_> {
    fn h(&self, p: Point) -> Result<f64, SizingError> {
        if self.holds(p) {
            return Ok(self.h);
        }
        // Farther away the grading of the field does the same.
        let reach = 2.0 * BORDER_CELLS * self.h;
        Ok(self.h + self.beta * self.border.distance(p, reach))
    }

    fn divides(&self, middle: Point, width: f64) -> Option<bool> {
        let reach = 0.5 * 3f64.sqrt() * width;
        let is_at_border = self.border.distance(middle, reach).is_finite();
        Some(is_at_border && width > BORDER_CELLS * self.h)
    }
}
