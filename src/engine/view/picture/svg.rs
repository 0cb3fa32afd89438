//! SVG pictures, written polygon by polygon.

use std::path::Path;

use super::color::Rgb;
use tetdb_io::write::TextFile;
use tetdb_io::write::WriteError;

pub(super) struct Svg {
    file: TextFile,
}

impl Svg {
    pub fn new(out: &Path, [width, height]: [u32; 2]) -> Result<Self, WriteError> {
        let mut file = TextFile::new(out)?;
        file.line(&format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\">\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n<g stroke-linejoin=\"round\">"
        ))?;
        Ok(Self { file })
    }

    pub fn polygon(
        &mut self,
        corners: &[[f32; 2]],
        color: Rgb,
        line: Option<f32>,
    ) -> Result<(), WriteError> {
        let points: Vec<String> = corners.iter().map(|[x, y]| format!("{x:.2},{y:.2}")).collect();
        let Rgb([r, g, b]) = color;
        // Where edges are not drawn, strokes of the fill color close the seams.
        let stroke = match line {
            Some(width) => format!("stroke=\"#222\" stroke-width=\"{width:.2}\""),
            None => format!("stroke=\"#{r:02x}{g:02x}{b:02x}\" stroke-width=\".4\""),
        };
        self.file.line(&format!(
            "<path d=\"M{}z\" fill=\"#{r:02x}{g:02x}{b:02x}\" {stroke}/>",
            points.join("L")
        ))
    }

    pub fn finish(mut self) -> Result<u64, WriteError> {
        self.file.line("</g>\n</svg>")?;
        self.file.finish()
    }
}
