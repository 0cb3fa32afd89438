//! MEDIT `.meshb` binary, versions 1 to 4, both byte orders.
//!
//! | field | v1 | v2 | v3 | v4 |
//! |---|---|---|---|---|
//! | position of the next keyword | i32 | i32 | i64 | i64 |
//! | counts, vertex numbers, references | i32 | i32 | i32 | i64 |
//! | coordinates | f32 | f64 | f64 | f64 |
//!
//! The file begins with 1 (its bytes tell the order) and the version; each section with its keyword
//! and the position after it. Source: the libMeshb documentation of the GMF format.

use std::collections::BTreeMap;
use std::io::BufRead;

use super::feed::Feed;
use super::medit::{RefLabels, note_reference, note_tets};
use super::{ReadError, Result, SurfaceSink};
use tetdb_base::geom::Point;
use tetdb_base::surface::NoteKind;

pub(super) const DIMENSION: i64 = 3;
pub(super) const VERTICES: i64 = 4;
const TRIANGLES: i64 = 6;
const QUADRILATERALS: i64 = 7;
pub(super) const TETRAHEDRA: i64 = 8;
const PRISMS: i64 = 9;
const HEXAHEDRA: i64 = 10;
const TRIANGLES_P2: i64 = 24;
const PYRAMIDS: i64 = 49;
const END: i64 = 54;

pub(super) struct Numbers<R> {
    pub(super) feed: Feed<R>,
    big: bool,
    pub(super) version: i32,
}

impl<R: BufRead> Numbers<R> {
    pub(super) fn i32(&mut self) -> Result<i32> {
        let bytes = self.feed.bytes::<4>()?;
        Ok(if self.big { i32::from_be_bytes(bytes) } else { i32::from_le_bytes(bytes) })
    }

    fn i64(&mut self) -> Result<i64> {
        let bytes = self.feed.bytes::<8>()?;
        Ok(if self.big { i64::from_be_bytes(bytes) } else { i64::from_le_bytes(bytes) })
    }

    /// A count, vertex number or reference.
    pub(super) fn integer(&mut self) -> Result<i64> {
        if self.version >= 4 { self.i64() } else { Ok(i64::from(self.i32()?)) }
    }

    /// A position in the file.
    fn position(&mut self) -> Result<i64> {
        if self.version >= 3 { self.i64() } else { Ok(i64::from(self.i32()?)) }
    }

    pub(super) fn coordinate(&mut self) -> Result<f64> {
        let x = if self.version == 1 {
            f64::from(f32::from_bits(self.i32()? as u32))
        } else {
            f64::from_bits(self.i64()? as u64)
        };
        self.feed.checked(x)
    }

    pub(super) fn integer_bytes(&self) -> u64 {
        if self.version >= 4 { 8 } else { 4 }
    }

    pub(super) fn count(&mut self, what: &'static str, bytes_min: u64) -> Result<u64> {
        let declared = self.integer()?;
        self.feed.check_count(what, declared, bytes_min)
    }
}

impl<R: BufRead> Numbers<R> {
    /// Begins a binary file: its byte order and version.
    pub(super) fn open(mut feed: Feed<R>) -> Result<Self> {
        feed.binary = true;
        let magic = feed.bytes::<4>()?;
        let big = match i32::from_le_bytes(magic) {
            1 => false,
            0x0100_0000 => true,
            _ => return Err(feed.unexpected("1 as the first number of a .meshb file", &magic)),
        };
        let mut numbers = Self { feed, big, version: 0 };
        numbers.version = numbers.i32()?;
        if !(1..=4).contains(&numbers.version) {
            let version = numbers.version;
            return Err(numbers.feed.unsupported(format!("version {version} of .meshb")));
        }
        Ok(numbers)
    }

    /// Calls `read` with the keyword of each section, at the place after it; what it leaves of a section is skipped.
    pub(super) fn sections(
        &mut self,
        mut read: impl FnMut(&mut Self, i64) -> Result<()>,
    ) -> Result<()> {
        while self.feed.offset < self.feed.len {
            let keyword = i64::from(self.i32()?);
            if keyword == END {
                break;
            }
            let next = self.position()?;
            read(self, keyword)?;
            if next == 0 {
                break;
            }
            skip_to(&mut self.feed, next)?;
        }
        Ok(())
    }
}

pub(super) fn read<R: BufRead>(feed: Feed<R>, target: &mut SurfaceSink) -> Result<()> {
    let mut numbers = Numbers::open(feed)?;
    let mut n_vertices = 0;
    numbers.sections(|numbers, keyword| read_section(numbers, keyword, &mut n_vertices, target))?;
    numbers.feed.finish(target.builder)
}

fn skip_to<R: BufRead>(feed: &mut Feed<R>, next: i64) -> Result<()> {
    match u64::try_from(next) {
        Ok(next) if (feed.offset..=feed.len).contains(&next) => feed.skip_bytes(next - feed.offset),
        _ => Err(ReadError::Unexpected {
            place: feed.place(),
            expected: format!("the next section between byte {} and {}", feed.offset, feed.len),
            found: format!("byte {next}"),
        }),
    }
}

fn read_section<R: BufRead>(
    numbers: &mut Numbers<R>,
    keyword: i64,
    n_vertices: &mut u64,
    target: &mut SurfaceSink,
) -> Result<()> {
    let int = numbers.integer_bytes();
    match keyword {
        DIMENSION => {
            let dimension = numbers.i32()?;
            if dimension != 3 {
                return Err(numbers.feed.unsupported(format!("a mesh of dimension {dimension}")));
            }
        }
        VERTICES => {
            let coordinate = if numbers.version == 1 { 4 } else { 8 };
            let n = numbers.count("vertices", 3 * coordinate + int)?;
            for _ in 0..n {
                let p =
                    Point::new(numbers.coordinate()?, numbers.coordinate()?, numbers.coordinate()?);
                numbers.integer()?;
                numbers.feed.placed(target.builder.vertex(p))?;
            }
            *n_vertices += n;
        }
        TRIANGLES => read_faces(numbers, "triangles", 3, *n_vertices, target)?,
        QUADRILATERALS => read_faces(numbers, "quadrilaterals", 4, *n_vertices, target)?,
        TRIANGLES_P2 => return Err(numbers.feed.unsupported("curved triangles")),
        TETRAHEDRA => {
            let n = numbers.count("tetrahedra", 5 * int)?;
            let mut first = BTreeMap::new();
            for _ in 0..n {
                let mut corners = [0; 4];
                for corner in &mut corners {
                    let index = numbers.integer()?;
                    *corner = numbers.feed.check_index(index, 1, *n_vertices)?;
                }
                note_reference(&mut first, numbers.integer()?, corners);
            }
            note_tets(n, &first, target);
        }
        PRISMS | HEXAHEDRA | PYRAMIDS => {
            let n = numbers.count("solid elements", 5 * int)?;
            let what = match keyword {
                PRISMS => "prisms",
                HEXAHEDRA => "hexahedra",
                _ => "pyramids",
            };
            if n > 0 {
                target.builder.note(NoteKind::SkippedElements { what, n });
            }
        }
        _ => {}
    }
    Ok(())
}

fn read_faces<R: BufRead>(
    numbers: &mut Numbers<R>,
    what: &'static str,
    n_corners: usize,
    n_vertices: u64,
    target: &mut SurfaceSink,
) -> Result<()> {
    let bytes = numbers.integer_bytes() * (n_corners as u64 + 1);
    let n = numbers.count(what, bytes)?;
    let mut labels = RefLabels::default();
    for _ in 0..n {
        let mut corners = [0; 4];
        for corner in &mut corners[..n_corners] {
            let index = numbers.integer()?;
            *corner = numbers.feed.check_index(index, 1, n_vertices)?;
        }
        let label = labels.of(numbers.integer()?, target);
        numbers.feed.placed(target.builder.polygon(&corners[..n_corners], label))?;
    }
    Ok(())
}
