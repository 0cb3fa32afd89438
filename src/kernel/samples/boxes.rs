//! Boxes with near-equilateral triangles on their faces.
//!
//! ```text
//!   *----*----*----*     Even rows stand on the grid of the box's edges, odd rows are shifted by
//!   | \ / \  / \ / |     half a step, so that triangles have edges 1, 1.12 and 1.12 steps long
//!   *--*---*----*--*     instead of 1, 1 and 1.41. The first inner points of a shifted row are
//!   | / \ / \  / \ |     moved inward, which leaves a shortest edge of 0.62 steps.
//!   *----*----*----*
//! ```

use super::SampleError;
use super::build::Builder;
use super::build::triangles_checked;
use super::sample::Sample;
use tetdb_base::geom::{Aabb, Point};

/// A box `box,x=X,y=Y,z=Z,h=H` with a corner at the origin; one label per face.
pub(super) fn make_box(sides: Point, h: f64, bytes_max: u64) -> Result<Sample, SampleError> {
    let bounds = Aabb { low: Point::ZERO, high: sides };
    triangles_checked("box", box_triangles(&bounds, h), bytes_max)?;
    let mut build = Builder::default();
    let labels = ["x-low", "x-high", "y-low", "y-high", "z-low", "z-high"];
    let labels = labels.map(|name| build.label(name));
    push_box(&mut build, &bounds, h, false, labels);
    Ok(build.finish())
}

/// Steps along a side: one when `h` is about the side or longer, else even, so that the last row
/// of a face is an unshifted one.
fn steps(side: f64, h: f64) -> f64 {
    let half = (side / h / 2.0 + 0.5).floor();
    if half < 1.0 { 1.0 } else { 2.0 * half }
}

/// Triangles of a box, a few per thousand below the truth because of the shifted rows' ends.
pub(super) fn box_triangles(bounds: &Aabb, h: f64) -> f64 {
    let n = (bounds.high - bounds.low).to_array().map(|s| steps(s, h));
    4.0 * (n[0] * n[1] + n[1] * n[2] + n[2] * n[0])
}

/// Adds the surface of a box with edges of about `h`; labels in the order x low, x high, y low, …
pub(super) fn push_box(build: &mut Builder, bounds: &Aabb, h: f64, inward: bool, labels: [u32; 6]) {
    let n = (bounds.high - bounds.low).to_array().map(|side| steps(side, h) as u32);
    for axis in 0..3 {
        for high in [false, true] {
            let face = BoxFace { bounds, n, axis, high };
            let rows: Vec<Vec<BoxCorner>> =
                (0..=face.rows()).map(|row| face.row(build, row)).collect();
            let label = labels[2 * axis + usize::from(high)];
            for pair in rows.windows(2) {
                stitch(build, &pair[0], &pair[1], inward == high, label);
            }
        }
    }
    build.close_seams();
}

/// One face of a box: rows along axis `axis + 1`, stacked along `axis + 2`.
struct BoxFace<'a> {
    bounds: &'a Aabb,
    n: [u32; 3],
    axis: usize,
    high: bool,
}

/// A point of a row: its place along the row in steps, and its id.
#[derive(Clone, Copy)]
struct BoxCorner {
    at: f64,
    id: u32,
}

impl BoxFace<'_> {
    fn rows(&self) -> u32 {
        self.n[(self.axis + 2) % 3]
    }

    fn row(&self, build: &mut Builder, row: u32) -> Vec<BoxCorner> {
        let n = self.n[(self.axis + 1) % 3];
        let shifted = row % 2 == 1 && row != self.rows();
        let inner = if shifted { n } else { n - 1 };
        let mut corners = Vec::with_capacity(inner as usize + 2);
        for i in 0..inner + 2 {
            let at = match i {
                0 => 0.0,
                i if i > inner => f64::from(n),
                i if shifted => shifted_place(i - 1, n),
                i => f64::from(i),
            };
            let p = self.place(at, f64::from(row));
            let on_seam = i == 0 || i > inner || row == 0 || row == self.rows();
            let id = if on_seam { build.seam_point(p) } else { build.point(p) };
            corners.push(BoxCorner { at, id });
        }
        corners
    }

    /// Position of a place of this face, by the same rounding for all faces that share an edge.
    fn place(&self, along: f64, across: f64) -> Point {
        let mut p = Point::ZERO;
        let (low, high) = (self.bounds.low, self.bounds.high);
        p[self.axis] = if self.high { high[self.axis] } else { low[self.axis] };
        for (axis, at) in [(self.axis + 1, along), (self.axis + 2, across)] {
            let axis = axis % 3;
            let n = f64::from(self.n[axis]);
            p[axis] =
                if at == n { high[axis] } else { low[axis] + (high[axis] - low[axis]) * (at / n) };
        }
        p
    }
}

/// Place of the `i`-th inner point of a shifted row of `n` steps.
fn shifted_place(i: u32, n: u32) -> f64 {
    /// Distances by which the first points move away from the side; both are tuned by eye on edge lengths.
    const MOVES: [f64; 2] = [0.12, 0.04];
    let middle = f64::from(i) + 0.5;
    if n < 4 {
        return middle;
    }
    let from_left = MOVES.get(i as usize).copied().unwrap_or(0.0);
    let from_right = MOVES.get((n - 1 - i) as usize).copied().unwrap_or(0.0);
    middle + from_left - from_right
}

/// Triangles between two rows of one face, each time along the shorter diagonal.
fn stitch(build: &mut Builder, lower: &[BoxCorner], upper: &[BoxCorner], inward: bool, label: u32) {
    let (mut i, mut j) = (0, 0);
    while i + 1 < lower.len() || j + 1 < upper.len() {
        let step_lower = match (lower.get(i + 1), upper.get(j + 1)) {
            (Some(a), Some(b)) => (a.at - upper[j].at).abs() <= (b.at - lower[i].at).abs(),
            (next, _) => next.is_some(),
        };
        if step_lower {
            let corners = [lower[i].id, lower[i + 1].id, upper[j].id];
            build.triangle(corners, inward, label);
            i += 1;
        } else {
            let corners = [lower[i].id, upper[j + 1].id, upper[j].id];
            build.triangle(corners, inward, label);
            j += 1;
        }
    }
}
