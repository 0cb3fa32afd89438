//! Three typical parts from CAD programs: a fan, slats and a perforated plate.
//!
//! ```text
//!    .--.         |||||       *---------*    A flat disk is a fan of triangles around one of its corners; a long
//!   / \\ `.       |||||       |\ ,---. /|    rod's wall is slats as long as the rod; between the holes of a plate
//!  (---\\--)      |||||       | (     ) |    triangles go from a few corners to all points of a hole, for no
//!   `..._\'       |||||       |/ `---' \|    point is added inside.
//!                             *---------*
//! ```

use super::build::Builder;
use super::build::triangles_checked;
use super::prism::{Flat, Prism, pieces};
use super::random::Random;
use super::trig::sin_cos_turns;
use super::{Sample, SampleError};
use tetdb_base::geom::Point;

/// Segments of a circle in each quarter, at least.
const QUARTER_MIN: usize = 2;
/// Height of disk and plate, length of the rod, radius of both.
const THICKNESS: f64 = 0.1;
const LENGTH: f64 = 10.0;
const RADIUS: f64 = 0.5;
/// Positions of the parts along x: none is near another.
const PLACES: [f64; 3] = [0.0, 2.0, 4.0];

/// `needles,count=64,holes=9,seed=1`: segments of each circle, a multiple of four, and holes of the plate.
#[derive(Clone, Debug, PartialEq)]
pub struct Needles {
    pub count: usize,
    pub holes: usize,
    pub seed: u64,
}

impl Needles {
    pub(super) fn make(&self, bytes_max: u64) -> Result<Sample, SampleError> {
        let quarter = self.count.div_ceil(4).max(QUARTER_MIN);
        let circle = 4.0 * quarter as f64;
        triangles_checked("needles", circle * (8.0 + 4.0 * self.holes as f64), bytes_max)?;
        let mut random = Random::new(self.seed);
        let mut build = Builder::default();
        let turn = random.unit();
        let parts = [
            ("fan", fan(4 * quarter, turn), THICKNESS),
            ("slats", fan(4 * quarter, turn + random.unit()), LENGTH),
            ("plate", plate(self.holes, quarter, &mut random), THICKNESS),
        ];
        for ((name, flat, height), x) in parts.into_iter().zip(PLACES) {
            let labels = ["low", "high", "around"].map(|end| build.label(format!("{name}-{end}")));
            let prism =
                Prism { at: &|u, v, w| Point::new(x + u, v, w), heights: [0.0, height], labels };
            prism.push(&mut build, &flat, &flat.triangles);
        }
        Ok(build.finish())
    }
}

/// A disk around the origin, all of it seen from one corner.
fn fan(n: usize, turn: f64) -> Flat {
    let corner = |i: usize| {
        let (sin, cos) = sin_cos_turns(turn + i as f64 / n as f64);
        [RADIUS * cos, RADIUS * sin]
    };
    Flat {
        points: (0..n).map(corner).collect(),
        triangles: (1..n as u32 - 1).map(|i| [0, i, i + 1]).collect(),
    }
}

/// A plate of rows of cells with a round hole in each.
fn plate(holes: usize, quarter: usize, random: &mut Random) -> Flat {
    let n_rows = (holes as f64).sqrt() as usize;
    let n_columns = holes.div_ceil(n_rows);
    let mut lines = |n: usize| -> Vec<f64> {
        let mut at = 0.0;
        let widths = pieces(n, || 1.0 + random.unit());
        let ends = widths.iter().map(|width| {
            at += width;
            at
        });
        std::iter::once(0.0).chain(ends).collect()
    };
    let (xs, ys) = (lines(n_columns), lines(n_rows));
    let mut flat = Flat { points: Vec::new(), triangles: Vec::new() };
    for y in &ys {
        flat.points.extend(xs.iter().map(|x| [*x, *y]));
    }
    for row in 0..n_rows {
        for column in 0..n_columns {
            let first = (row * (n_columns + 1) + column) as u32;
            let above = first + n_columns as u32 + 1;
            // From the upper right, counter-clockwise: the corners behind the four quarters of a circle.
            let corners = [above + 1, above, first, first + 1];
            let share = 0.2 + 0.7 * random.unit();
            cell(&mut flat, corners, quarter, 0.5 * share);
        }
    }
    flat
}

/// A cell around a hole whose radius is a share of its narrower side.
fn cell(flat: &mut Flat, corners: [u32; 4], quarter: usize, share: f64) {
    let [high, low] = [corners[0], corners[2]].map(|v| flat.points[v as usize]);
    let sides = [high[0] - low[0], high[1] - low[1]];
    let middle = [low[0] + 0.5 * sides[0], low[1] + 0.5 * sides[1]];
    let radius = share * sides[0].min(sides[1]);
    let first = flat.points.len() as u32;
    let n = 4 * quarter;
    for i in 0..n {
        let (sin, cos) = sin_cos_turns(i as f64 / n as f64);
        flat.points.push([middle[0] + radius * cos, middle[1] + radius * sin]);
    }
    let at = |i: usize| first + (i % n) as u32;
    for (k, &corner) in corners.iter().enumerate() {
        let begin = k * quarter;
        for i in begin..begin + quarter {
            flat.triangles.push([at(i + 1), at(i), corner]);
        }
        // Between this corner and the next, at the point of the hole that is nearest to their side.
        let next = corners[(k + 1) % 4];
        flat.triangles.push([corner, next, at(begin + quarter)]);
    }
}
