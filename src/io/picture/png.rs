//! PNG, by tiny-skia.

use std::path::{Path, PathBuf};

use tiny_skia::{
    Color, FillRule, LineJoin, Paint, Path as Outline, PathBuilder, Pixmap, Stroke, Transform,
};

use super::Result;
use super::color::Rgb;
use crate::io::write::{WriteError, bytes};

pub(super) struct Png {
    out: PathBuf,
    pixels: Pixmap,
}

impl Png {
    /// Errors: no memory for so many pixels.
    pub fn new(out: &Path, [width, height]: [u32; 2]) -> Result<Self> {
        let mut pixels = Pixmap::new(width, height).ok_or_else(|| WriteError::TooLarge {
            path: out.to_owned(),
            what: "pixels",
            limit: 1 << 28,
            found: u64::from(width) * u64::from(height),
        })?;
        pixels.fill(Color::WHITE);
        Ok(Self {
            out: out.to_owned(),
            pixels,
        })
    }

    pub fn polygon(&mut self, corners: &[[f32; 2]], color: Rgb, line: Option<f32>) {
        let Some(outline) = outline(corners) else {
            return;
        };
        let Rgb([r, g, b]) = color;
        let mut paint = Paint::default();
        paint.set_color_rgba8(r, g, b, 255);
        // Smooth edges would let the background through between neighbors.
        paint.anti_alias = false;
        let whole = Transform::identity();
        self.pixels
            .fill_path(&outline, &paint, FillRule::EvenOdd, whole, None);
        if let Some(width) = line {
            let mut paint = Paint::default();
            paint.set_color_rgba8(30, 30, 30, 220);
            let stroke = Stroke {
                width,
                line_join: LineJoin::Round,
                ..Stroke::default()
            };
            self.pixels
                .stroke_path(&outline, &paint, &stroke, whole, None);
        }
    }

    pub fn finish(self) -> Result<u64> {
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
