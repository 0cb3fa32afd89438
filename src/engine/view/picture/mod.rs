//! Pictures of flat polygons with a color bar: PNG and SVG.
//!
//! Polygons are drawn as they arrive, so memory does not grow with their number. A PNG is held as pixels; an SVG is written line
//! by line.

mod color;
mod digits;
#[cfg(feature = "pictures")]
mod png;
mod svg;

use std::collections::BTreeSet;
use std::path::Path;

pub use color::{Rgb, category, scale};

use tetdb_io::write::WriteError;

type Result<T> = std::result::Result<T, WriteError>;

/// File endings of the formats.
pub const ENDINGS: &str = if cfg!(feature = "pictures") { ".png or .svg" } else { ".svg" };

/// Share of the picture left free on each side.
const MARGIN: f64 = 0.04;
/// Width of the color bar and its numbers, as a share of the height.
const BAR: f64 = 0.16;
/// Width of the list of categories as a share of the height, and its largest number of entries.
const KINDS: f64 = 0.075;
const KINDS_MOST: usize = 24;
/// Mean edge length in pixels below which edges are not drawn, since they would cover the picture.
const EDGE_PIXELS_MIN: f64 = 4.0;

/// A color bar from the least value up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorBar {
    /// Value of the first color.
    pub least: f64,
    /// Value of the last color.
    pub most: f64,
}

/// Size and contents of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureFrame {
    /// Width and height in pixels.
    pub pixels: [u32; 2],
    /// Low and high corner of the drawing, in its own units, with the second axis up.
    pub bounds: [[f64; 2]; 2],
    /// Mean length of an edge in the units of the drawing.
    pub edge: f64,
    /// The color bar beside the picture, if there is one.
    pub bar: Option<ColorBar>,
    /// True if colors stand for categories; those passed to [`Picture::kind`] are listed.
    pub kinds: bool,
}

/// A picture under construction.
pub struct Picture {
    canvas: Canvas,
    frame: PictureFrame,
    scale: f64,
    center: [f64; 2],
    middle: [f64; 2],
    /// Width of edges in pixels, if they are drawn.
    line: Option<f32>,
    /// Categories drawn so far.
    kinds: BTreeSet<u32>,
}

enum Canvas {
    #[cfg(feature = "pictures")]
    Png(png::Png),
    Svg(svg::Svg),
}

impl Picture {
    /// Begins the picture `out`. Errors: an unknown ending; a folder that cannot be written; too many pixels.
    pub fn new(out: &Path, frame: PictureFrame) -> Result<Self> {
        let ending = out.extension().and_then(|e| e.to_str()).unwrap_or_default();
        let canvas = match ending.to_ascii_lowercase().as_str() {
            #[cfg(feature = "pictures")]
            "png" => Canvas::Png(png::Png::new(out, frame.pixels)?),
            "svg" => Canvas::Svg(svg::Svg::new(out, frame.pixels)?),
            _ => {
                return Err(WriteError::UnknownFormat { path: out.to_owned(), known: ENDINGS });
            }
        };
        let [width, height] = frame.pixels.map(f64::from);
        let beside = if frame.kinds { KINDS } else { 0.0 };
        let bar = frame.bar.map_or(beside * height, |_| BAR * height);
        let margin = MARGIN * width.min(height);
        let room = [width - bar - 2.0 * margin, height - 2.0 * margin];
        let [low, high] = frame.bounds;
        let extent = [high[0] - low[0], high[1] - low[1]];
        let fit = (room[0] / extent[0]).min(room[1] / extent[1]);
        let scale = if fit.is_finite() { fit } else { 1.0 };
        let line = (frame.edge * scale >= EDGE_PIXELS_MIN)
            .then(|| (frame.edge * scale * 0.04).clamp(0.3, 1.5) as f32);
        Ok(Self {
            canvas,
            frame,
            scale,
            center: [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])],
            middle: [margin + 0.5 * room[0], margin + 0.5 * room[1]],
            line,
            kinds: BTreeSet::new(),
        })
    }

    /// Adds a category to the list beside the picture.
    pub fn kind(&mut self, kind: u32) {
        if self.kinds.len() <= KINDS_MOST {
            self.kinds.insert(kind);
        }
    }

    /// Draws a polygon of up to four corners over the picture so far. Errors: the disk.
    pub fn polygon(&mut self, corners: &[[f64; 2]], color: Rgb) -> Result<()> {
        let mut pixels = [[0.0; 2]; 4];
        for (pixel, corner) in pixels.iter_mut().zip(corners) {
            *pixel = [
                (self.middle[0] + (corner[0] - self.center[0]) * self.scale) as f32,
                (self.middle[1] - (corner[1] - self.center[1]) * self.scale) as f32,
            ];
        }
        let pixels = &pixels[..corners.len().min(4)];
        match &mut self.canvas {
            #[cfg(feature = "pictures")]
            Canvas::Png(canvas) => canvas.polygon(pixels, color, self.line),
            Canvas::Svg(canvas) => canvas.polygon(pixels, color, self.line)?,
        }
        Ok(())
    }

    /// Draws a triangle in space. `heights` grow towards the viewer, and nearer triangles hide farther ones. A format without
    /// depth draws each triangle over the earlier ones, so the far ones must come first. Errors: the disk.
    pub fn solid(&mut self, corners: &[[f64; 2]; 3], heights: [f64; 3], color: Rgb) -> Result<()> {
        match &mut self.canvas {
            #[cfg(feature = "pictures")]
            Canvas::Png(canvas) => {
                let pixels = corners.map(|c| {
                    [
                        self.middle[0] + (c[0] - self.center[0]) * self.scale,
                        self.middle[1] - (c[1] - self.center[1]) * self.scale,
                    ]
                });
                canvas.solid(pixels, heights, color, self.line);
                Ok(())
            }
            Canvas::Svg(_) => {
                #[cfg(not(feature = "pictures"))]
                let _ = heights;
                self.polygon(corners, color)
            }
        }
    }

    /// Draws a straight black line through a point, across all of the picture. Errors: the disk.
    pub fn line(&mut self, [point, direction]: [[f64; 2]; 2]) -> Result<()> {
        let [low, high] = self.frame.bounds;
        // The part within the bounds, a little longer.
        let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
        for axis in 0..2 {
            if direction[axis] != 0.0 {
                let ends = [low[axis], high[axis]].map(|x| (x - point[axis]) / direction[axis]);
                from = from.max(ends[0].min(ends[1]));
                to = to.min(ends[0].max(ends[1]));
            }
        }
        if from.is_nan() || to.is_nan() || from >= to || !(to - from).is_finite() {
            return Ok(());
        }
        let more = 0.02 * (to - from);
        let half = 0.0012 * f64::from(self.frame.pixels[1]).max(400.0) / self.scale;
        let across = [-direction[1] * half, direction[0] * half];
        let corner =
            |t: f64, side: f64| [0, 1].map(|k| point[k] + direction[k] * t + across[k] * side);
        let (from, to) = (from - more, to + more);
        let corners = [corner(from, -1.0), corner(to, -1.0), corner(to, 1.0), corner(from, 1.0)];
        let line = self.line.take();
        let drawn = self.polygon(&corners, Rgb([10; 3]));
        self.line = line;
        drawn
    }

    /// Draws the color bar or the list of categories and gives the file its name; returns the length of the file. Errors: the
    /// disk.
    pub fn finish(mut self) -> Result<u64> {
        if let Some(bar) = self.frame.bar {
            self.bar(bar)?;
        } else if self.frame.kinds {
            self.list()?;
        }
        match self.canvas {
            #[cfg(feature = "pictures")]
            Canvas::Png(canvas) => canvas.finish(),
            Canvas::Svg(canvas) => canvas.finish(),
        }
    }

    fn rectangle(&mut self, [x, y]: [f32; 2], [w, h]: [f32; 2], color: Rgb) -> Result<()> {
        let corners = [[x, y], [x + w, y], [x + w, y + h], [x, y + h]];
        match &mut self.canvas {
            #[cfg(feature = "pictures")]
            Canvas::Png(canvas) => canvas.polygon(&corners, color, None),
            Canvas::Svg(canvas) => canvas.polygon(&corners, color, None)?,
        }
        Ok(())
    }

    /// Draws a column of colors at the right, with five numbers beside it.
    fn bar(&mut self, bar: ColorBar) -> Result<()> {
        const STEPS: u16 = 64;
        let [width, height] = self.frame.pixels.map(|n| n as f32);
        let (left, top, tall) = (width - BAR as f32 * height, 0.2 * height, 0.6 * height);
        let step = tall / f32::from(STEPS);
        for i in 0..STEPS {
            let share = (f64::from(i) + 0.5) / f64::from(STEPS);
            let y = top + tall - step * f32::from(i + 1);
            self.rectangle([left, y], [0.02 * height, step], scale(share))?;
        }
        let pixel = (height / 400.0).max(1.0).round();
        for i in 0..5u16 {
            let share = f64::from(i) / 4.0;
            let text = digits::shown(bar.least + share * (bar.most - bar.least));
            let y = top + tall * (1.0 - share as f32) - 2.5 * pixel;
            self.text([left + 0.03 * height, y], pixel, &text)?;
        }
        Ok(())
    }

    /// Draws squares of the drawn categories at the right, with a number beside each.
    fn list(&mut self) -> Result<()> {
        let [width, height] = self.frame.pixels.map(|n| n as f32);
        let (left, side) = (width - KINDS as f32 * height, 0.022 * height);
        let kinds: Vec<u32> = self.kinds.iter().copied().take(KINDS_MOST).collect();
        let step = 1.5 * side;
        let top = 0.5 * (height - step * kinds.len() as f32);
        let pixel = (height / 400.0).max(1.0).round();
        for (n, kind) in kinds.into_iter().enumerate() {
            let y = top + step * n as f32;
            self.rectangle([left, y], [side, side], category(kind))?;
            let text = kind.to_string();
            let at = [left + 1.4 * side, y + 0.5 * side - 2.5 * pixel];
            self.text(at, pixel, &text)?;
        }
        Ok(())
    }

    /// Draws digits with dots of `pixel` pixels.
    fn text(&mut self, [x, y]: [f32; 2], pixel: f32, text: &str) -> Result<()> {
        for place in digits::pixels(text) {
            let [column, row] = place.map(f32::from);
            let corner = [x + column * pixel, y + row * pixel].map(f32::round);
            self.rectangle(corner, [pixel, pixel], Rgb([40; 3]))?;
        }
        Ok(())
    }
}
