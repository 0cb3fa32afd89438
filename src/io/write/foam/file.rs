//! Files of an OpenFOAM mesh: a head, then lists of numbers, as text or binary (little end first, labels of 32 bits, scalars of 64).
//!
//! Source: OpenFOAM's user guide, "Basic input/output file format" and "Mesh description".

use std::path::Path;

use super::super::error::Result;
use super::super::output_files::OutputFiles;
use super::super::stream::Stream;

/// A file being written.
pub(super) struct FoamFile {
    stream: Stream,
    pub ascii: bool,
}

impl FoamFile {
    /// Begins `dir/object`, which will need `bytes`.
    pub fn create(
        outputs: &mut OutputFiles,
        (dir, object, class): (&Path, &str, &str),
        note: &str,
        ascii: bool,
        bytes: u64,
    ) -> Result<Self> {
        let path = outputs.create(&dir.join(object), bytes)?;
        let mut stream = Stream::open(&path)?;
        let format = if ascii { "ascii" } else { "binary" };
        let note = match note {
            "" => String::new(),
            note => format!("    note        \"{note}\";\n"),
        };
        stream.text(&format!(
            "FoamFile\n{{\n    version     2.0;\n    format      {format};\n    class       {class};\n    \
             arch        \"LSB;label=32;scalar=64\";\n{note}    location    \"constant/polyMesh\";\n    object      {object};\n}}\n\n"
        ));
        Ok(Self { stream, ascii })
    }

    pub fn text(&mut self, text: &str) {
        self.stream.text(text);
    }

    /// A list of `n` entries that `fill` writes.
    pub fn list(&mut self, n: u64, fill: impl FnOnce(&mut Self) -> Result<()>) -> Result<()> {
        self.begin_list(n);
        fill(self)?;
        self.end_list(n);
        Ok(())
    }

    pub fn begin_list(&mut self, n: u64) {
        self.text(&format!("\n{n}\n"));
        // An empty list in binary has no parentheses.
        match (self.ascii, n) {
            (true, _) => self.text("(\n"),
            (false, 0) => (),
            (false, _) => self.text("("),
        }
    }

    pub fn end_list(&mut self, n: u64) {
        if self.ascii || n > 0 {
            self.text(")");
        }
        self.text("\n");
    }

    #[inline]
    pub fn label(&mut self, value: i32) -> Result<()> {
        if self.ascii {
            if value < 0 {
                self.stream.text("-");
            }
            self.stream.integer(value.unsigned_abs().into(), b'\n');
        } else {
            self.stream.bytes(&value.to_le_bytes());
        }
        self.stream.end()
    }

    pub fn bool(&mut self, value: bool) -> Result<()> {
        if self.ascii {
            self.stream.integer(value.into(), b'\n');
        } else {
            self.stream.bytes(&[u8::from(value)]);
        }
        self.stream.end()
    }

    /// A triangle of a list of faces; in binary its vertices alone.
    #[inline]
    pub fn face(&mut self, face: [u32; 3]) -> Result<()> {
        if self.ascii {
            self.stream.text("3(");
            self.stream.integers(face.map(u64::from), b' ', b')');
            self.stream.text("\n");
        } else {
            face.iter().for_each(|v| self.stream.bytes(&v.to_le_bytes()));
        }
        self.stream.end()
    }

    pub fn point(&mut self, point: [f64; 3]) -> Result<()> {
        if self.ascii {
            self.stream.text("(");
            self.stream.doubles(point, b' ', b')');
            self.stream.text("\n");
        } else {
            self.stream.double_bytes(point);
        }
        self.stream.end()
    }

    pub fn finish(self) -> Result<()> {
        self.stream.finish()
    }
}
