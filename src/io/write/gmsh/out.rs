//! Numbers as text or as bytes, little end first.

use std::path::Path;

use super::super::error::Result;
use super::super::stream::Stream;

/// A file being written.
pub(super) struct Out {
    pub stream: Stream,
    ascii: bool,
}

impl Out {
    pub fn open(path: &Path, ascii: bool) -> Result<Self> {
        let stream = Stream::open(path)?;
        Ok(Self { stream, ascii })
    }

    pub fn text(&mut self, text: &str) {
        self.stream.text(text);
    }

    /// A section of the file between its marks.
    pub fn section(
        &mut self,
        name: &str,
        fill: impl FnOnce(&mut Self) -> Result<()>,
    ) -> Result<()> {
        self.text(&format!("${name}\n"));
        fill(self)?;
        // Readers of binary sections skip white space before the mark.
        let break_line = if self.ascii { "" } else { "\n" };
        self.text(&format!("{break_line}$End{name}\n"));
        Ok(())
    }

    #[inline]
    pub fn int(&mut self, value: u32) {
        if self.ascii {
            self.stream.integer(value.into(), b' ');
        } else {
            self.stream.bytes(&value.to_le_bytes());
        }
    }

    #[inline]
    pub fn size(&mut self, value: u64) {
        if self.ascii {
            self.stream.integer(value, b' ');
        } else {
            self.stream.bytes(&value.to_le_bytes());
        }
    }

    #[inline]
    pub fn double(&mut self, value: f64) {
        if self.ascii {
            self.stream.double(value, b' ');
        } else {
            self.stream.bytes(&value.to_le_bytes());
        }
    }

    /// Ends a record.
    #[inline]
    pub fn end(&mut self) -> Result<()> {
        if self.ascii {
            self.stream.text("\n");
        }
        self.stream.end()
    }

    pub fn finish(self) -> Result<()> {
        self.stream.finish()
    }
}
