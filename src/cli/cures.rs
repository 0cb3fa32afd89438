//! What would mend the triangles that spoil a mesh: each cure is tried on a copy of the surface, and its gain counted.

use serde_json::{Value, json};

use super::input::Space;
use tetdb_base::geom::short;
use tetdb_base::shape::face_least;
use tetdb_base::storage::attempt;
use tetdb_base::surface::{
    Fitness, Surface, closedness, fitness, repair, repair_bytes, split, validate_with,
};
use tetdb_kernel::sizing::SizeField;

/// Shares of the box diagonal within which points are joined on trial.
const WELDS: [f64; 4] = [1e-6, 1e-5, 1e-4, 1e-3];
/// A cure is named when it leaves at most this part of what is wrong.
const GAIN: f64 = 0.6;
/// Memory for a trial of divided triangles: those of a surface small enough to be checked in a second or two.
const BYTES_MAX: u64 = 64 << 20;

/// How well triangles are shaped.
#[derive(Clone, Copy)]
struct Shapes {
    triangles: usize,
    /// Those that force a quality of 10 or worse.
    hopeless: u64,
    /// The least quality that a tetrahedron on the worst of them can have.
    least: f64,
}

impl Shapes {
    fn of(surface: &Surface, fitness: &Fitness) -> Self {
        Self {
            triangles: surface.n_triangles(),
            hopeless: fitness.hopeless_triangles,
            least: face_least(surface.corners(fitness.worst_triangle)),
        }
    }

    fn share(&self) -> f64 {
        self.hopeless as f64 / self.triangles.max(1) as f64
    }

    fn is_gain_on(&self, before: &Self) -> bool {
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

/// A command that makes a better surface, and what it leaves.
pub struct Cure {
    /// Points nearer than this share of the box diagonal are joined; none: long triangles are divided.
    weld: Option<f64>,
    before: Shapes,
    after: Shapes,
}

/// The cures of a surface without defects that gain something; `field` has its default sizes.
pub fn cures(surface: &Surface, found: &Fitness, field: &SizeField, space: Space) -> Vec<Cure> {
    let before = Shapes::of(surface, found);
    if before.hopeless == 0 || space.cap / 2 < repair_bytes(surface) {
        return Vec::new();
    }
    let measured = |tried: &Surface| Shapes::of(tried, &fitness(tried, &closedness(tried)));
    let h = |p| field.h(p);
    let divided = split(surface, &h, BYTES_MAX.min(space.cap / 4)).ok();
    let divided = divided.map(|(fine, _)| (None, measured(&fine)));
    let welded = WELDS.into_iter().filter_map(|share| {
        let mut tried = surface.clone();
        let done = repair(&mut tried, Some(share * surface.bounds().diagonal()));
        let scratch = space.scratch(&tried).ok()?;
        let is_valid = done.points_joined > 0
            && tried.n_triangles() > 0
            && attempt(|| validate_with(&tried, &scratch)).is_ok_and(|found| found.is_valid());
        is_valid.then(|| (Some(share), measured(&tried)))
    });
    // The smallest change of the shape that does it.
    let welded = welded.filter(|(_, after)| after.is_gain_on(&before)).take(1);
    let tried = divided.into_iter().chain(welded);
    tried
        .filter(|(_, after)| after.is_gain_on(&before))
        .map(|(weld, after)| Cure { weld, before, after })
        .collect()
}

impl Cure {
    /// For people; `surfaces` are the words of the command line.
    pub fn sentence(&self, surfaces: &str) -> String {
        let way = match self.weld {
            None => {
                format!("`tetdb mesh {surfaces} --refine-surface` divides long triangles first")
            }
            Some(share) => format!(
                "`tetdb check {surfaces} --repair --weld {share:e} --write OUT` joins points nearer than {share:e} of the box diagonal"
            ),
        };
        let (after, before) = (self.after.in_words(), self.before.in_words());
        format!("{way}: then {after}; now {before}")
    }

    /// For programs.
    pub fn json(&self) -> Value {
        json!({
            "way": if self.weld.is_some() { "weld" } else { "refine-surface" }, "weld": self.weld,
            "triangles": self.after.triangles, "hopeless_triangles": self.after.hopeless, "least_quality": self.after.least,
        })
    }
}
