//! PNG pictures, by tiny-skia.

use std::path::{Path, PathBuf};

use tiny_skia::{
    Color, FillRule, LineJoin, Paint, Path as Outline, PathBuilder, Pixmap, Stroke, Transform,
};

use super::color::Rgb;
use tetdb_io::write::WriteError;
use tetdb_io::write::bytes;

/// Color and opacity of edges.
const EDGE: ([u8; 3], f64) = ([30; 3], 0.86);

pub(super) struct Png {
    out: PathBuf,
    pixels: Pixmap,
    /// Height of the visible triangle in each pixel; empty until a triangle in space is drawn.
    heights: Vec<f32>,
}

impl Png {
    /// Begins a picture. Errors: no memory for so many pixels.
    pub fn new(out: &Path, [width, height]: [u32; 2]) -> Result<Self, WriteError> {
        let mut pixels = Pixmap::new(width, height).ok_or_else(|| WriteError::TooLarge {
            path: out.to_owned(),
            what: "pixels",
            limit: 1 << 28,
            found: u64::from(width) * u64::from(height),
        })?;
        pixels.fill(Color::WHITE);
        Ok(Self { out: out.to_owned(), pixels, heights: Vec::new() })
    }

    pub fn polygon(&mut self, corners: &[[f32; 2]], color: Rgb, line: Option<f32>) {
        let Some(outline) = outline(corners) else {
            return;
        };
        let Rgb([r, g, b]) = color;
        let mut paint = Paint::default();
        paint.set_color_rgba8(r, g, b, 255);
        // With smooth edges, the background would show between neighbors.
        paint.anti_alias = false;
        let whole = Transform::identity();
        self.pixels.fill_path(&outline, &paint, FillRule::EvenOdd, whole, None);
        if let Some(width) = line {
            let mut paint = Paint::default();
            paint.set_color_rgba8(30, 30, 30, 220);
            let stroke = Stroke { width, line_join: LineJoin::Round, ..Stroke::default() };
            self.pixels.stroke_path(&outline, &paint, &stroke, whole, None);
        }
    }

    /// Draws a triangle that hides lower ones. Its edges are drawn inside the triangle.
    pub fn solid(
        &mut self,
        corners: [[f64; 2]; 3],
        heights: [f64; 3],
        color: Rgb,
        line: Option<f32>,
    ) {
        let (width, height) = (self.pixels.width() as usize, self.pixels.height() as usize);
        if self.heights.is_empty() {
            self.heights = vec![f32::NEG_INFINITY; width * height];
        }
        let [a, b, c] = corners;
        let twice = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
            (q[0] - p[0]) * (r[1] - p[1]) - (r[0] - p[0]) * (q[1] - p[1])
        };
        let area = twice(a, b, c);
        if area == 0.0 {
            return;
        }
        let length = |p: [f64; 2], q: [f64; 2]| (q[0] - p[0]).hypot(q[1] - p[1]);
        // Heights of the triangle over its three sides, in pixels.
        let over = [length(b, c), length(c, a), length(a, b)].map(|side| area.abs() / side);
        // Pixels whose centers may lie in the triangle.
        let range = |axis: usize, end: usize| {
            let [x, y, z] = corners.map(|p| p[axis]);
            let (from, to) = (x.min(y).min(z) - 0.5, x.max(y).max(z) - 0.5);
            (from.ceil().max(0.0) as usize, ((to.floor() + 1.0).max(0.0) as usize).min(end))
        };
        let ((left, right), (top, foot)) = (range(0, width), range(1, height));
        let half = line.map(|w| 0.5 * f64::from(w.max(0.8)));
        let data = self.pixels.data_mut();
        for y in top..foot {
            for x in left..right {
                let p = [x as f64 + 0.5, y as f64 + 0.5];
                let shares = [twice(p, b, c), twice(a, p, c), twice(a, b, p)].map(|s| s / area);
                // A little more than the triangle is drawn, so that no pixel between neighbors is left out.
                if shares.iter().any(|&s| s < -1e-9) {
                    continue;
                }
                let z = (0..3).map(|k| shares[k] * heights[k]).sum::<f64>() as f32;
                let at = y * width + x;
                if z < self.heights[at] {
                    continue;
                }
                self.heights[at] = z;
                let from_side = (0..3).map(|k| shares[k] * over[k]).fold(f64::INFINITY, f64::min);
                let edge = half.map_or(0.0, |half| (half + 0.5 - from_side).clamp(0.0, 1.0));
                let (ink, most) = EDGE;
                let share = edge * most;
                let mixed = [0, 1, 2].map(|k| {
                    (f64::from(color.0[k]) * (1.0 - share) + f64::from(ink[k]) * share).round()
                        as u8
                });
                data[4 * at..4 * at + 3].copy_from_slice(&mixed);
                data[4 * at + 3] = 255;
            }
        }
    }

    pub fn finish(self) -> Result<u64, WriteError> {
        let encoded = self.pixels.encode_png().map_err(|e| WriteError::Io {
            path: self.out.clone(),
            source: std::io::Error::other(e),
        })?;
        bytes(&self.out, &encoded)
    }
}

fn outline(corners: &[[f32; 2]]) -> Option<Outline> {
    let mut builder = PathBuilder::new();
    let (first, rest) = corners.split_first()?;
    builder.move_to(first[0], first[1]);
    rest.iter().for_each(|[x, y]| builder.line_to(*x, *y));
    builder.close();
    builder.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_nearer_hides_what_is_farther_in_any_order() {
        let near = ([[2.0, 2.0], [30.0, 4.0], [6.0, 28.0]], [3.0, 3.0, 3.0], Rgb([200, 0, 0]));
        // The far triangle rises above the near one on the left.
        let far = ([[0.0, 0.0], [31.0, 0.0], [0.0, 31.0]], [9.0, -9.0, 2.0], Rgb([0, 200, 0]));
        let draw = |order: [_; 2]| {
            let mut png = Png::new(Path::new("a.png"), [32, 32]).expect("a small picture");
            for (corners, heights, color) in order {
                png.solid(corners, heights, color, None);
            }
            png.pixels
        };
        let (one, other) = (draw([near, far]), draw([far, near]));
        assert!(one.data() == other.data());
        let color = |x: u32, y: u32| {
            let p = one.pixel(x, y).expect("within the picture");
            (p.red(), p.green())
        };
        assert_eq!((color(3, 3), color(20, 6)), ((0, 200), (200, 0)));
        assert_eq!(color(31, 31), (255, 255), "nothing is drawn there");
    }

    #[test]
    fn neighbors_leave_no_gap() {
        let mut png = Png::new(Path::new("a.png"), [64, 64]).expect("a small picture");
        let middle = [31.3, 29.7];
        let rim: Vec<[f64; 2]> = (0..12)
            .map(|k| {
                let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 12.0).sin_cos();
                [middle[0] + 25.0 * cos, middle[1] + 25.0 * sin]
            })
            .collect();
        for k in 0..12 {
            png.solid([middle, rim[k], rim[(k + 1) % 12]], [0.0; 3], Rgb([0; 3]), None);
        }
        for (x, y) in (0..64).flat_map(|x| (0..64).map(move |y| (x, y))) {
            let from = (f64::from(x) + 0.5 - middle[0]).hypot(f64::from(y) + 0.5 - middle[1]);
            let red = png.pixels.pixel(x, y).expect("within the picture").red();
            assert!(from > 24.0 || red == 0, "a gap at {x} {y}");
        }
    }
}
