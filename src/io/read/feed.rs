//! Bytes of a file as words, lines or small blocks, each with its place.

use std::io::{BufRead, Cursor, Read, Seek, SeekFrom};

use super::error::{FilePlace, ReadError, ReadFault, Spot};
use super::words::COORDINATE_MAX;
pub(super) use super::words::{check_point, name, not_a_number, parse, quote, text};
use tetdb_base::geom::Point;
use tetdb_base::surface::{NoteKind, SurfaceBuilder, SurfaceError};

/// Longest word accepted in text: numbers and keywords are far shorter.
const WORD_MAX: usize = 4096;
/// Longest line accepted where lines matter; a polygon of a million corners still fits.
const LINE_MAX: usize = 16 << 20;

/// Result of everything that reads.
pub(super) type Result<T> = std::result::Result<T, ReadError>;

/// A position in a file.
pub(super) struct Position {
    file: String,
    /// Bytes taken so far.
    pub offset: u64,
    /// Line of the next byte, from 1; counted by the text functions only.
    pub line: u64,
    /// Places are counted in bytes.
    pub is_binary: bool,
}

/// A reader over a file's bytes that counts bytes and lines.
///
/// Memory: the reader's buffer, one word and one line. Nothing is allocated from a declared count.
pub(super) struct Feed<R> {
    reader: R,
    /// Length of the whole file.
    pub len: u64,
    /// The first byte of content: 3 behind a byte order mark.
    start: u64,
    pub at: Position,
    /// A comment runs from this byte to the end of its line.
    pub comment: Option<u8>,
    word: Vec<u8>,
}

impl<R: BufRead + Seek> Feed<R> {
    /// Goes back to the first byte, behind a byte order mark.
    pub fn rewind(&mut self) -> Result<()> {
        let done = self.reader.seek(SeekFrom::Start(self.start));
        done.map_err(|e| broken(self.place(), &e))?;
        (self.at.offset, self.at.line) = (self.start, 1);
        Ok(())
    }
}

impl<R: BufRead> Feed<R> {
    pub fn new(file: &str, reader: R, len: u64) -> Self {
        Self {
            reader,
            len,
            start: 0,
            at: Position { file: file.to_owned(), offset: 0, line: 1, is_binary: false },
            comment: None,
            word: Vec::new(),
        }
    }

    /// Skips the byte order mark of UTF-8 at the beginning.
    pub fn skip_mark(&mut self) {
        self.take(3);
        self.start = 3;
    }

    /// Returns up to `N` first bytes without taking them, and their number.
    pub fn with_head<const N: usize>(mut self) -> Result<([u8; N], usize, Feed<impl BufRead>)> {
        let mut head = [0; N];
        let mut n = 0;
        while n < N {
            match self.reader.read(&mut head[n..]) {
                Ok(0) => break,
                Ok(k) => n += k,
                Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                Err(e) => return Err(broken(self.place(), &e)),
            }
        }
        let reader = Cursor::new(head).take(n as u64).chain(self.reader);
        Ok((head, n, Feed::new(&self.at.file, reader, self.len)))
    }

    /// First bytes, as many as the reader holds, without taking them.
    pub fn head(&mut self) -> Result<&[u8]> {
        fill(&mut self.reader, &self.at)
    }

    pub fn file(&self) -> &str {
        &self.at.file
    }

    pub fn place(&self) -> FilePlace {
        self.at.place()
    }

    /// The error of a fault here.
    pub fn refuse(&self, fault: ReadFault) -> ReadError {
        self.place().refuse(fault)
    }

    pub fn truncated(&self, expected: impl Into<String>) -> ReadError {
        let found = "the end of the file".to_owned();
        self.refuse(ReadFault::Truncated { expected: expected.into(), found })
    }

    pub fn unexpected(&self, expected: impl Into<String>, found: &[u8]) -> ReadError {
        self.refuse(ReadFault::Unexpected { expected: expected.into(), found: quote(found) })
    }

    pub fn unsupported(&self, what: impl Into<String>) -> ReadError {
        self.refuse(ReadFault::Unsupported(what.into()))
    }

    pub fn out_of_range(&self, index: i64, low: i64, high: i64) -> ReadError {
        self.refuse(ReadFault::IndexOutOfRange { index, low, high })
    }

    /// The error of a declared count that cannot be right.
    pub fn miscounted(
        &self,
        what: &'static str,
        declared: impl ToString,
        found: impl Into<String>,
    ) -> ReadError {
        let (declared, found) = (declared.to_string(), found.into());
        self.refuse(ReadFault::CountMismatch { what, declared, found })
    }

    /// Gives a builder's refusal this place.
    pub fn placed<T>(&self, result: std::result::Result<T, SurfaceError>) -> Result<T> {
        result.map_err(|source| self.refuse(ReadFault::Surface(source)))
    }

    /// Refuses a declared count that the rest of the file cannot hold at `bytes_min` each.
    pub fn check_count(&self, what: &'static str, declared: i64, bytes_min: u64) -> Result<u64> {
        let left = self.len.saturating_sub(self.at.offset);
        // The last text record may lack its line end.
        let fits =
            u64::try_from(declared).ok().filter(|&n| n.saturating_mul(bytes_min) <= left + 1);
        fits.ok_or_else(|| {
            self.miscounted(what, declared, format!("{left} bytes left in the file"))
        })
    }

    /// The error of a text that ended after `found` of `declared` things.
    pub fn too_few(&self, what: &'static str, declared: u64, found: u64) -> ReadError {
        self.miscounted(what, declared, format!("{found} found before the end of the file"))
    }

    /// Refuses the end of a text before record `found` of `declared`.
    pub fn need_record(&mut self, what: &'static str, declared: u64, found: u64) -> Result<()> {
        match !self.at.is_binary && self.at_end()? {
            true => Err(self.too_few(what, declared, found)),
            false => Ok(()),
        }
    }

    // --- text ---------------------------------------------------------------------------------

    /// The next byte, not taken; `None` at the end.
    pub fn peek(&mut self) -> Result<Option<u8>> {
        let buffer = fill(&mut self.reader, &self.at)?;
        Ok(buffer.first().copied())
    }

    fn take(&mut self, n: usize) {
        self.reader.consume(n);
        self.at.offset += n as u64;
    }

    /// Skips white space and comments, over line ends only when `lines`; true when a word follows.
    fn skip_blank(&mut self, lines: bool) -> Result<bool> {
        let mut in_comment = false;
        loop {
            let buffer = fill(&mut self.reader, &self.at)?;
            if buffer.is_empty() {
                return Ok(false);
            }
            let mut n = 0;
            let mut stop = None;
            for &b in buffer {
                if b == b'\n' {
                    if !lines {
                        stop = Some(false);
                        break;
                    }
                    in_comment = false;
                    self.at.line += 1;
                } else if !in_comment {
                    if Some(b) == self.comment {
                        in_comment = true;
                    } else if !b.is_ascii_whitespace() {
                        stop = Some(true);
                        break;
                    }
                }
                n += 1;
            }
            self.take(n);
            if let Some(found) = stop {
                return Ok(found);
            }
        }
    }

    /// The next word on this or a later line; false at the end of the file. See [`Self::word`].
    pub fn next_word(&mut self) -> Result<bool> {
        if !self.skip_blank(true)? {
            return Ok(false);
        }
        self.take_word()?;
        Ok(true)
    }

    /// The next word on this line; false at its end.
    pub fn next_word_in_line(&mut self) -> Result<bool> {
        if !self.skip_blank(false)? {
            return Ok(false);
        }
        self.take_word()?;
        Ok(true)
    }

    /// Returns whether only white space and comments are left.
    pub fn at_end(&mut self) -> Result<bool> {
        Ok(!self.skip_blank(true)?)
    }

    /// The word taken last.
    pub fn word(&self) -> &[u8] {
        &self.word
    }

    fn take_word(&mut self) -> Result<()> {
        self.word.clear();
        loop {
            let buffer = fill(&mut self.reader, &self.at)?;
            let comment = self.comment;
            let end = buffer.iter().position(|&b| b.is_ascii_whitespace() || Some(b) == comment);
            let n = end.unwrap_or(buffer.len());
            let done = end.is_some() || buffer.is_empty();
            self.word.extend_from_slice(&buffer[..n]);
            self.take(n);
            if self.word.len() > WORD_MAX {
                self.word.truncate(40);
                return Err(self.unexpected("text", &self.word));
            }
            if done {
                return Ok(());
            }
        }
    }

    /// Takes a word that must be there.
    pub fn need_word(&mut self, expected: &'static str) -> Result<()> {
        if self.next_word()? { Ok(()) } else { Err(self.truncated(expected)) }
    }

    /// Takes the word `expected` (any case).
    pub fn need_keyword(&mut self, expected: &'static str) -> Result<()> {
        self.need_word(expected)?;
        if self.word.eq_ignore_ascii_case(expected.as_bytes()) {
            Ok(())
        } else {
            Err(self.unexpected(format!("`{expected}`"), &self.word))
        }
    }

    /// The last word as a number of type `T`.
    pub fn parse<T: std::str::FromStr>(&self, what: &'static str) -> Result<T> {
        parse(&self.word).ok_or_else(|| not_a_number(&self.place(), what, &self.word))
    }

    /// Takes an integer.
    pub fn integer(&mut self, what: &'static str) -> Result<i64> {
        self.need_word(what)?;
        self.parse(what)
    }

    /// Takes a count and checks it against the bytes left.
    pub fn count(&mut self, what: &'static str, bytes_min: u64) -> Result<u64> {
        let declared = self.integer(what)?;
        self.check_count(what, declared, bytes_min)
    }

    /// Takes a finite coordinate.
    pub fn coordinate(&mut self) -> Result<f64> {
        self.need_word("a coordinate")?;
        self.word_coordinate()
    }

    /// The last word as a finite coordinate.
    pub fn word_coordinate(&self) -> Result<f64> {
        let x: f64 = self.parse("a coordinate")?;
        self.checked(x)
    }

    /// Refuses coordinates that are not finite or too large.
    pub fn checked(&self, x: f64) -> Result<f64> {
        if x.abs() < COORDINATE_MAX {
            Ok(x)
        } else if x.is_finite() {
            Err(self.refuse(ReadFault::CoordinateRange(x)))
        } else {
            let found = if self.at.is_binary { x.to_string() } else { quote(&self.word) };
            Err(self.refuse(ReadFault::NotANumber { what: "a coordinate", found }))
        }
    }

    /// A word of a line that began at `place` as a finite coordinate.
    pub fn coordinate_of(&self, word: &[u8], place: &FilePlace) -> Result<f64> {
        let value = parse(word).filter(|x: &f64| x.is_finite());
        let value = value.ok_or_else(|| not_a_number(place, "a coordinate", word))?;
        self.checked(value).map_err(|_| place.refuse(ReadFault::CoordinateRange(value)))
    }

    /// Takes three coordinates.
    pub fn point(&mut self) -> Result<Point> {
        Ok(Point::new(self.coordinate()?, self.coordinate()?, self.coordinate()?))
    }

    /// Takes an index of 1 ..= n and returns it 0-based.
    pub fn index(&mut self, base: i64, n: u64) -> Result<u32> {
        let index = self.integer("a vertex number")?;
        self.check_index(index, base, n)
    }

    /// Checks an index of `base ..` against `n` and returns it 0-based.
    pub fn check_index(&self, index: i64, base: i64, n: u64) -> Result<u32> {
        match index.checked_sub(base).map(u64::try_from) {
            Some(Ok(i)) if i < n && i < u64::from(u32::MAX) => Ok(i as u32),
            _ => Err(self.out_of_range(index, base, base.saturating_add_unsigned(n) - 1)),
        }
    }

    /// Skips to just after the end of this line.
    pub fn skip_line(&mut self) -> Result<()> {
        loop {
            let buffer = fill(&mut self.reader, &self.at)?;
            if buffer.is_empty() {
                return Ok(());
            }
            if let Some(i) = buffer.iter().position(|&b| b == b'\n') {
                self.take(i + 1);
                self.at.line += 1;
                return Ok(());
            }
            let n = buffer.len();
            self.take(n);
        }
    }

    /// Skips to just after the next occurrence of `pattern`, whose first byte is nowhere else in it.
    pub fn skip_past(&mut self, pattern: &[u8]) -> Result<()> {
        let mut matched = 0;
        loop {
            let buffer = fill(&mut self.reader, &self.at)?;
            if buffer.is_empty() {
                return Err(self.truncated(quote(pattern)));
            }
            let mut n = 0;
            while n < buffer.len() && matched < pattern.len() {
                let b = buffer[n];
                self.at.line += u64::from(b == b'\n');
                matched =
                    if b == pattern[matched] { matched + 1 } else { usize::from(b == pattern[0]) };
                n += 1;
            }
            self.take(n);
            if matched == pattern.len() {
                return Ok(());
            }
        }
    }

    /// Appends the rest of this line to `out` and takes its end; false at the end of the file.
    pub fn read_line(&mut self, out: &mut Vec<u8>) -> Result<bool> {
        let start = out.len();
        loop {
            let buffer = fill(&mut self.reader, &self.at)?;
            if buffer.is_empty() {
                return Ok(out.len() > start);
            }
            let end = buffer.iter().position(|&b| b == b'\n');
            let n = end.unwrap_or(buffer.len());
            out.extend_from_slice(&buffer[..n]);
            self.take(n + usize::from(end.is_some()));
            if out.len() > LINE_MAX {
                return Err(self.unsupported(format!("a line longer than {LINE_MAX} bytes")));
            }
            if end.is_some() {
                self.at.line += 1;
                return Ok(true);
            }
        }
    }

    /// The error of a file without triangles.
    pub fn empty(&self) -> ReadError {
        FilePlace { file: self.at.file.clone(), spot: Spot::File }.refuse(ReadFault::Empty)
    }

    /// Notes what stands behind the declared content.
    pub fn note_rest(&mut self, builder: &mut SurfaceBuilder) -> Result<()> {
        let is_over = !self.at.is_binary && self.at_end()?;
        let n = self.len.saturating_sub(self.at.offset);
        if !is_over && n > 0 {
            builder.note(NoteKind::TrailingBytes { n });
        }
        Ok(())
    }

    /// Ends the file of `builder`, which must have triangles of it.
    pub fn finish(&self, builder: &mut SurfaceBuilder) -> Result<()> {
        if builder.n_file_triangles() == 0 {
            return Err(self.empty());
        }
        self.placed(builder.end_file())
    }

    // --- binary -------------------------------------------------------------------------------

    /// Takes exactly `N` bytes.
    #[inline]
    pub fn bytes<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut block = [0; N];
        match self.reader.read_exact(&mut block) {
            Ok(()) => {
                self.at.offset += N as u64;
                Ok(block)
            }
            Err(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
                Err(self.truncated(format!("{N} more bytes")))
            }
            Err(e) => Err(broken(self.place(), &e)),
        }
    }

    /// Takes all bytes left, at most `limit`.
    pub fn rest(&mut self, limit: u64) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let read = (&mut self.reader).take(limit.saturating_add(1)).read_to_end(&mut bytes);
        read.map_err(|e| broken(self.place(), &e))?;
        let needed = bytes.len() as u64;
        match needed > limit {
            true => Err(self.refuse(ReadFault::TooLarge { what: "the file", needed, limit })),
            false => Ok(bytes),
        }
    }

    /// Skips `n` bytes.
    pub fn skip_bytes(&mut self, mut n: u64) -> Result<()> {
        while n > 0 {
            let buffer = fill(&mut self.reader, &self.at)?;
            let got = buffer.len();
            if got == 0 {
                return Err(self.truncated(format!("{n} more bytes")));
            }
            let step = n.min(got as u64);
            self.take(step as usize);
            n -= step;
        }
        Ok(())
    }
}

impl Position {
    fn place(&self) -> FilePlace {
        let spot = match self.is_binary {
            true => Spot::Byte(self.offset),
            false => Spot::Line(self.line),
        };
        FilePlace { file: self.file.clone(), spot }
    }
}

/// The bytes at hand, none at the end of the file.
fn fill<'b, R: BufRead>(reader: &'b mut R, at: &Position) -> Result<&'b [u8]> {
    reader.fill_buf().map_err(|e| broken(at.place(), &e))
}

fn broken(place: FilePlace, error: &std::io::Error) -> ReadError {
    place.refuse(ReadFault::Unreadable(error.to_string()))
}
