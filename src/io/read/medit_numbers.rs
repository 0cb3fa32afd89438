//! Sections and numbers of MEDIT files: `.mesh` and `.sol` in text, `.meshb` and `.solb` in binary of versions 1 to 4 and both byte orders.
//!
//! A text file is a list of words: keywords, each followed by numbers. A binary file begins with 1 (its bytes give the order) and the
//! version; each section begins with the number of its keyword and the position after it.
//!
//! | field | v1 | v2 | v3 | v4 |
//! |---|---|---|---|---|
//! | position of the next keyword | i32 | i32 | i64 | i64 |
//! | counts, vertex numbers, references | i32 | i32 | i32 | i64 |
//! | coordinates | f32 | f64 | f64 | f64 |
//!
//! Source: the libMeshb documentation of the GMF format.

use std::io::BufRead;

use super::feed::Feed;
use super::{ReadFault, Result};
use tetdb_base::geom::Point;

/// Keywords by their numbers in binary files, in small letters.
const KEYWORDS: [(i64, &str); 31] = [
    (3, "dimension"),
    (4, "vertices"),
    (5, "edges"),
    (6, "triangles"),
    (7, "quadrilaterals"),
    (8, "tetrahedra"),
    (9, "prisms"),
    (10, "hexahedra"),
    (24, "trianglesp2"),
    (25, "edgesp2"),
    (27, "quadrilateralsq2"),
    (30, "tetrahedrap2"),
    (33, "hexahedraq2"),
    (49, "pyramids"),
    (62, "solatvertices"),
    (86, "prismsp2"),
    (87, "pyramidsp2"),
    (88, "quadrilateralsq3"),
    (89, "quadrilateralsq4"),
    (90, "trianglesp3"),
    (91, "trianglesp4"),
    (92, "edgesp3"),
    (93, "edgesp4"),
    (96, "tetrahedrap3"),
    (97, "tetrahedrap4"),
    (98, "hexahedraq3"),
    (99, "hexahedraq4"),
    (100, "pyramidsp3"),
    (101, "pyramidsp4"),
    (102, "prismsp3"),
    (103, "prismsp4"),
];
/// Number of the last keyword.
const END: i64 = 54;

/// How the numbers of a file are encoded.
#[derive(Clone, Copy)]
enum Encoding {
    Text,
    Binary { big: bool, version: i32 },
}

/// How the head of a file or a section was read.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum SectionRead {
    /// To its end: a keyword follows.
    Whole,
    /// Not to its end: the rest is skipped.
    Part,
}

/// A MEDIT file being read.
pub(super) struct MeditNumbers<R> {
    pub feed: Feed<R>,
    encoding: Encoding,
}

impl<R: BufRead> MeditNumbers<R> {
    /// Begins a file, in text before the number of its version. Errors: another kind of file.
    pub fn open(mut feed: Feed<R>, is_binary: bool) -> Result<Self> {
        if !is_binary {
            feed.comment = Some(b'#');
            feed.need_keyword("MeshVersionFormatted")?;
            return Ok(Self { feed, encoding: Encoding::Text });
        }
        feed.at.is_binary = true;
        let magic = feed.bytes::<4>()?;
        let big = match i32::from_le_bytes(magic) {
            1 => false,
            0x0100_0000 => true,
            _ => return Err(feed.unexpected("1 as the first number of a .meshb file", &magic)),
        };
        let version = i32_of(feed.bytes()?, big);
        if !(1..=4).contains(&version) {
            return Err(feed.unsupported(format!("version {version} of .meshb")));
        }
        Ok(Self { feed, encoding: Encoding::Binary { big, version } })
    }

    /// Reads the version of a text file; that of a binary file is known.
    pub fn text_version(&mut self) -> Result<()> {
        match self.encoding {
            Encoding::Text => self.feed.integer("the version").map(drop),
            Encoding::Binary { .. } => Ok(()),
        }
    }

    /// Calls `read` with the keyword of each section in small letters; in binary with an empty word for unknown ones.
    ///
    /// `head` says how the head of a text file was read. Errors: no keyword where one must be; those of `read`.
    pub fn sections(
        &mut self,
        head: SectionRead,
        mut read: impl FnMut(&mut Self, &str) -> Result<SectionRead>,
    ) -> Result<()> {
        let Encoding::Binary { version, .. } = self.encoding else {
            return self.text_sections(head, read);
        };
        while self.feed.at.offset < self.feed.len {
            let number = i64::from(self.i32()?);
            if number == END {
                break;
            }
            let next = if version >= 3 { self.i64()? } else { self.i32()?.into() };
            let keyword = KEYWORDS.iter().find(|row| row.0 == number);
            read(self, keyword.map_or("", |row| row.1))?;
            if next == 0 {
                break;
            }
            self.skip_to(next)?;
        }
        Ok(())
    }

    fn text_sections(
        &mut self,
        mut before: SectionRead,
        mut read: impl FnMut(&mut Self, &str) -> Result<SectionRead>,
    ) -> Result<()> {
        while self.next_keyword(before)? {
            let keyword = String::from_utf8_lossy(self.feed.word()).to_ascii_lowercase();
            if !keyword.starts_with(|c: char| c.is_ascii_alphabetic()) {
                return Err(self.feed.unexpected("a MEDIT keyword", self.feed.word()));
            }
            if keyword == "end" {
                break;
            }
            before = read(self, &keyword)?;
        }
        Ok(())
    }

    /// Takes the next word, after what is left of a section; returns false at the end.
    fn next_keyword(&mut self, before: SectionRead) -> Result<bool> {
        while self.feed.next_word()? {
            if before == SectionRead::Whole || self.feed.word()[0].is_ascii_alphabetic() {
                return Ok(true);
            }
        }
        Ok(false)
    }

    fn skip_to(&mut self, next: i64) -> Result<()> {
        let feed = &mut self.feed;
        match u64::try_from(next) {
            Ok(next) if (feed.at.offset..=feed.len).contains(&next) => {
                feed.skip_bytes(next - feed.at.offset)
            }
            _ => {
                let (from, to) = (feed.at.offset, feed.len);
                let expected = format!("the next section between byte {from} and {to}");
                let found = format!("byte {next}");
                Err(feed.refuse(ReadFault::Unexpected { expected, found }))
            }
        }
    }

    fn i32(&mut self) -> Result<i32> {
        let bytes = self.feed.bytes()?;
        Ok(i32_of(bytes, self.is_big()))
    }

    fn i64(&mut self) -> Result<i64> {
        let bytes = self.feed.bytes()?;
        Ok(if self.is_big() { i64::from_be_bytes(bytes) } else { i64::from_le_bytes(bytes) })
    }

    fn is_big(&self) -> bool {
        matches!(self.encoding, Encoding::Binary { big: true, .. })
    }

    /// A number that has 32 bits in every version.
    pub fn small_integer(&mut self, what: &'static str) -> Result<i64> {
        match self.encoding {
            Encoding::Text => self.feed.integer(what),
            Encoding::Binary { .. } => Ok(self.i32()?.into()),
        }
    }

    /// A count, vertex number or reference.
    pub fn integer(&mut self, what: &'static str) -> Result<i64> {
        match self.encoding {
            Encoding::Binary { version: 4.., .. } => self.i64(),
            _ => self.small_integer(what),
        }
    }

    /// A floating point number.
    pub fn real(&mut self, what: &'static str) -> Result<f64> {
        let x = match self.encoding {
            Encoding::Text => {
                self.feed.need_word(what)?;
                return self.feed.parse(what);
            }
            Encoding::Binary { version: 1, .. } => f64::from(f32::from_bits(self.i32()? as u32)),
            Encoding::Binary { .. } => f64::from_bits(self.i64()? as u64),
        };
        self.feed.checked(x)
    }

    /// Three coordinates.
    pub fn point(&mut self) -> Result<Point> {
        let mut coordinate = || {
            let x = self.real("a coordinate")?;
            self.feed.checked(x)
        };
        Ok(Point::new(coordinate()?, coordinate()?, coordinate()?))
    }

    /// The vertex numbers of an element, of `n_vertices`, counted from 0.
    pub fn corners<const N: usize>(&mut self, n_vertices: u64) -> Result<[u32; N]> {
        let mut corners = [0; N];
        for corner in &mut corners {
            let index = self.integer("a vertex number")?;
            *corner = self.feed.check_index(index, 1, n_vertices)?;
        }
        Ok(corners)
    }

    /// The count of a section, compared with the bytes left: each record has so many coordinates and integers.
    pub fn count(&mut self, what: &'static str, coordinates: u64, integers: u64) -> Result<u64> {
        let declared = self.integer(what)?;
        let bytes_min = match self.encoding {
            Encoding::Text => 2 * (coordinates + integers),
            Encoding::Binary { version, .. } => {
                let coordinate = if version == 1 { 4 } else { 8 };
                let integer = if version >= 4 { 8 } else { 4 };
                coordinate * coordinates + integer * integers
            }
        };
        self.feed.check_count(what, declared, bytes_min)
    }

    /// The number of elements in a section that is skipped; 0 where a text has none.
    pub fn skipped_count(&mut self) -> Result<u64> {
        if let Encoding::Binary { .. } = self.encoding {
            return self.count("elements", 0, 3);
        }
        let has_none = !self.feed.at_end()?
            && self.feed.peek()?.is_some_and(|byte| byte.is_ascii_alphabetic());
        if has_none {
            return Ok(0);
        }
        self.feed.need_word("the number of elements")?;
        self.feed.parse("the number of elements")
    }
}

fn i32_of(bytes: [u8; 4], big: bool) -> i32 {
    if big { i32::from_be_bytes(bytes) } else { i32::from_le_bytes(bytes) }
}
