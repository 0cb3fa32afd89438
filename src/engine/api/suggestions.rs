//! Suggested changes of a surface that would improve the mesh.
//!
//! Each change is tried on a copy of the surface, and its gain is measured.

use serde::Serialize;

use super::{Error, Settings};
use tetdb_base::geom::short;
use tetdb_base::shape::face_least;
use tetdb_base::storage::attempt;
use tetdb_base::surface::{
    Fitness, Surface, closedness, fitness, repair, repair_bytes, split, validate_with,
};
use tetdb_kernel::sizing::SizeField;

/// Joining distances to try, as shares of the box diagonal.
const WELDS: [f64; 4] = [1e-6, 1e-5, 1e-4, 1e-3];
/// A change is suggested if it reduces the share of bad triangles or the worst quality to at most this part.
const GAIN: f64 = 0.6;
/// Memory for trying to divide triangles: enough for surfaces that are checked within a second or two.
const BYTES_MAX: u64 = 64 << 20;

/// Shapes of the triangles of a surface, summed up.
#[derive(Clone, Copy)]
struct Shapes {
    triangles: usize,
    /// Triangles that force a quality of 10 or worse.
    spoiled: u64,
    /// Best quality possible for a tetrahedron on the worst triangle.
    least: f64,
}

impl Shapes {
    fn of(surface: &Surface, fitness: &Fitness) -> Self {
        Self {
            triangles: surface.n_triangles(),
            spoiled: fitness.hopeless_triangles,
            least: face_least(surface.corners(fitness.worst_triangle)),
        }
    }

    fn share(&self) -> f64 {
        self.spoiled as f64 / self.triangles.max(1) as f64
    }

    /// Returns whether the worst triangle allows better, and that or the number of bad ones by enough.
    fn is_gain_on(&self, before: &Self) -> bool {
        if self.least >= before.least {
            return false;
        }
        let part = if self.share() <= before.share() {
            (self.share() / before.share()).min(self.least / before.least)
        } else {
            1.0
        };
        part <= GAIN
    }

    fn in_words(&self) -> String {
        format!(
            "{} % of {} triangles force a quality of 10 or worse, the worst {}",
            short(100.0 * self.share()),
            self.triangles,
            short(self.least)
        )
    }
}

/// A change that would improve the surface.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct Suggestion {
    /// `weld` or `refine-surface`.
    pub way: &'static str,
    /// Joins points closer than this share of the box diagonal; `None`: divides long triangles.
    pub weld: Option<f64>,
    /// Number of triangles after the change.
    pub triangles: usize,
    /// Triangles after the change that force a quality of 10 or worse.
    #[serde(rename = "hopeless_triangles")]
    pub spoiled_triangles: u64,
    /// Best quality possible for a tetrahedron on the worst triangle after the change.
    pub least_quality: f64,
    /// Shapes after the change and now, in words.
    #[serde(skip)]
    pub effect: String,
}

/// Lists the changes that would improve a surface without defects. `field` has its default sizes.
pub(super) fn suggestions(
    surface: &Surface,
    found: &Fitness,
    field: &SizeField,
    settings: &Settings,
) -> Result<Vec<Suggestion>, Error> {
    let (before, cap) = (Shapes::of(surface, found), settings.cap()?);
    if before.spoiled == 0 || cap / 2 < repair_bytes(surface) {
        return Ok(Vec::new());
    }
    let measured = |tried: &Surface| Shapes::of(tried, &fitness(tried, &closedness(tried)));
    let h = |p| field.h(p);
    let divided = split(surface, &h, BYTES_MAX.min(cap / 4)).ok();
    let divided = divided.map(|(fine, _)| (None, measured(&fine)));
    let welded = WELDS.into_iter().filter_map(|share| {
        let mut tried = surface.clone();
        let done = repair(&mut tried, Some(share * surface.bounds().diagonal()));
        let scratch = settings.scratch_space(tried.bytes() as u64).ok()?;
        let is_valid = done.points_joined > 0
            && tried.n_triangles() > 0
            && attempt(|| validate_with(&tried, &scratch)).is_ok_and(|found| found.is_valid());
        is_valid.then(|| (Some(share), measured(&tried)))
    });
    // Only the weld with the smallest distance that gains enough is kept.
    let welded = welded.filter(|(_, after)| after.is_gain_on(&before)).take(1);
    let tried = divided.into_iter().chain(welded);
    let gained = tried.filter(|(_, after)| after.is_gain_on(&before));
    let suggestion = |(weld, after): (Option<f64>, Shapes)| Suggestion {
        way: if weld.is_some() { "weld" } else { "refine-surface" },
        weld,
        triangles: after.triangles,
        spoiled_triangles: after.spoiled,
        least_quality: after.least,
        effect: format!("then {}; now {}", after.in_words(), before.in_words()),
    };
    Ok(gained.map(suggestion).collect())
}
