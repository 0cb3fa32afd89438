//! Numbers of an array in a file: text, base64 or raw bytes, plain or in blocks packed with zlib, read one by one.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};

use super::hdf_rows::HdfRows;
use super::{Feed, FilePlace, ReadFault, Result};
use crate::read::error::Spot;
use crate::read::xml::base64_word;
use tetdb_schema::field::{FieldNumber, Scalar};
use tetdb_schema::word::Word;

/// Bytes read at once.
const BUFFER_BYTES: usize = 1 << 16;

/// Most packed blocks of an array: at the usual 32 KiB each 128 GiB.
const BLOCKS_MAX: u64 = 1 << 22;

/// How a list of bytes is stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Coding {
    /// As it is.
    Raw,
    /// In letters, parts of which may end in padding.
    Base64,
}

/// How binary arrays of a file are stored.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    pub is_big: bool,
    /// Bytes of a length before an array; 0 where there is none.
    pub header: usize,
    pub is_packed: bool,
    /// Most bytes of an unpacked block.
    pub block_max: u64,
}

/// A type of numbers: bytes, and the value of them with the low one first.
#[derive(Clone, Copy)]
struct NumberType {
    bytes: usize,
    value: fn([u8; 8]) -> f64,
    whole: fn([u8; 8]) -> Option<i64>,
}

/// A number as a whole one, if it is that.
fn float(x: f64) -> Option<i64> {
    (x.fract() == 0.0 && x.abs() < 1e15).then_some(x as i64)
}

/// The type of a name of VTK.
fn number_type(name: &str) -> Option<NumberType> {
    macro_rules! number {
        ($type:ty, $whole:expr) => {
            NumberType {
                bytes: size_of::<$type>(),
                value: |b| <$type>::from_le_bytes(std::array::from_fn(|i| b[i])) as f64,
                whole: |b| $whole(<$type>::from_le_bytes(std::array::from_fn(|i| b[i]))),
            }
        };
    }
    Some(match name {
        "Int8" => number!(i8, |x| Some(i64::from(x))),
        "UInt8" => number!(u8, |x| Some(i64::from(x))),
        "Int16" => number!(i16, |x| Some(i64::from(x))),
        "UInt16" => number!(u16, |x| Some(i64::from(x))),
        "Int32" => number!(i32, |x| Some(i64::from(x))),
        "UInt32" => number!(u32, |x| Some(i64::from(x))),
        "Int64" => number!(i64, Some),
        "UInt64" => number!(u64, |x| i64::try_from(x).ok()),
        "Float32" => number!(f32, |x| float(f64::from(x))),
        "Float64" => number!(f64, float),
        _ => return None,
    })
}

/// The type of a field that holds all numbers of a type of VTK.
pub fn field_number(name: &str) -> Option<FieldNumber> {
    Some(match name {
        "Int8" | "UInt8" | "Int16" | "UInt16" | "Int32" => FieldNumber::I32,
        "UInt32" | "Int64" | "UInt64" => FieldNumber::I64,
        "Float32" => FieldNumber::F32,
        "Float64" => FieldNumber::F64,
        _ => return None,
    })
}

/// The numbers of an array, front to back.
pub struct Numbers {
    place: FilePlace,
    from: From,
    what: &'static str,
}

enum From {
    /// One number again and again.
    Constant(i64),
    Hdf(Box<HdfNumbers>),
    Text(Box<Feed<BufReader<ToTag>>>),
    Binary(Box<Binary>),
}

/// A file to its next `<`: an array must not take the numbers of the one behind it.
struct ToTag {
    file: File,
    is_over: bool,
}

impl Read for ToTag {
    fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        if self.is_over {
            return Ok(0);
        }
        let n = self.file.read(bytes)?;
        let text = bytes[..n].iter().position(|&b| b == b'<');
        self.is_over = text.is_some();
        Ok(text.unwrap_or(n))
    }
}

/// Numbers of an array in an HDF5 file.
struct HdfNumbers {
    rows: HdfRows,
    kind: NumberType,
    /// Bytes of a block, and how many are taken.
    ready: Vec<u8>,
    taken: usize,
}

impl HdfNumbers {
    /// The bytes of the next number, the low one first.
    #[inline]
    fn next(&mut self) -> Option<[u8; 8]> {
        if self.taken == self.ready.len() {
            (self.ready, self.taken) = (self.rows.next_block()?, 0);
        }
        let n = self.kind.bytes;
        let mut bytes = [0; 8];
        bytes[..n].copy_from_slice(self.ready.get(self.taken..)?.get(..n)?);
        self.taken += n;
        Some(bytes)
    }
}

struct Binary {
    file: BufReader<File>,
    coding: Coding,
    layout: Layout,
    kind: NumberType,
    /// Bytes of the file that are decoded and not taken.
    decoded: VecDeque<u8>,
    /// Packed sizes of the blocks to come.
    blocks: VecDeque<usize>,
    /// Bytes to come where nothing is packed.
    left: u64,
    /// Unpacked bytes, and how many are taken.
    ready: Vec<u8>,
    taken: usize,
}

impl Numbers {
    /// Text from byte `at` of a file to the next `<`.
    pub fn text(name: &str, mut file: File, at: u64, what: &'static str) -> Result<Self> {
        let place = FilePlace { file: name.to_owned(), spot: Spot::Byte(at) };
        let len = file.seek(SeekFrom::End(0)).and_then(|len| {
            file.seek(SeekFrom::Start(at))?;
            Ok(len)
        });
        let len = len.map_err(|e| place.refuse(ReadFault::Unreadable(e.to_string())))?;
        let text = ToTag { file, is_over: false };
        let mut feed = Feed::new(name, BufReader::with_capacity(BUFFER_BYTES, text), len);
        (feed.at.offset, feed.at.is_binary) = (at, true);
        Ok(Self { place, from: From::Text(Box::new(feed)), what })
    }

    /// Binary numbers from byte `at` of a file.
    pub fn binary(
        name: &str,
        mut file: File,
        at: u64,
        kind: &str,
        (coding, layout): (Coding, Layout),
        what: &'static str,
    ) -> Result<Self> {
        let place = FilePlace { file: name.to_owned(), spot: Spot::Byte(at) };
        let kind = number_type(kind).ok_or_else(|| {
            place.refuse(ReadFault::Unsupported(format!("an array of the type {kind:?}")))
        })?;
        file.seek(SeekFrom::Start(at))
            .map_err(|e| place.refuse(ReadFault::Unreadable(e.to_string())))?;
        let mut binary = Binary {
            file: BufReader::with_capacity(BUFFER_BYTES, file),
            coding,
            layout,
            kind,
            decoded: VecDeque::new(),
            blocks: VecDeque::new(),
            left: u64::MAX,
            ready: Vec::new(),
            taken: 0,
        };
        let numbers = |from| Self { place, from, what };
        if layout.header == 0 {
            return Ok(numbers(From::Binary(Box::new(binary))));
        }
        let begun = binary.begin();
        let numbers = numbers(From::Binary(Box::new(binary)));
        match begun {
            Some(()) => Ok(numbers),
            None => Err(numbers.too_short()),
        }
    }

    /// Numbers of an array in an HDF5 file, whose type has this name in VTK.
    pub fn hdf(place: FilePlace, rows: HdfRows, kind: &str, what: &'static str) -> Result<Self> {
        let kind = number_type(kind).ok_or_else(|| {
            place.refuse(ReadFault::Unsupported(format!("an array of the type {kind:?}")))
        })?;
        let numbers = HdfNumbers { rows, kind, ready: Vec::new(), taken: 0 };
        Ok(Self { place, from: From::Hdf(Box::new(numbers)), what })
    }

    /// One number as often as it is asked for.
    pub fn constant(place: FilePlace, number: i64) -> Self {
        Self { place, from: From::Constant(number), what: "a number" }
    }

    fn too_short(&self) -> super::ReadError {
        let (expected, found) = (self.what.to_owned(), "the end, or damaged data".to_owned());
        self.place.refuse(ReadFault::Truncated { expected, found })
    }

    /// The next number.
    #[inline]
    pub fn real(&mut self) -> Result<f64> {
        match &mut self.from {
            From::Text(feed) => {
                feed.need_word(self.what)?;
                feed.parse(self.what)
            }
            From::Binary(binary) => match binary.next() {
                Some(bytes) => Ok((binary.kind.value)(bytes)),
                None => Err(self.too_short()),
            },
            From::Hdf(hdf) => match hdf.next() {
                Some(bytes) => Ok((hdf.kind.value)(bytes)),
                None => Err(self.too_short()),
            },
            From::Constant(number) => Ok(*number as f64),
        }
    }

    /// The next number, which must be whole.
    #[inline]
    pub fn integer(&mut self) -> Result<i64> {
        self.next_integer()?.ok_or_else(|| {
            let (expected, found) = (self.what.to_owned(), "a broken number".to_owned());
            self.place.refuse(ReadFault::Unexpected { expected, found })
        })
    }

    /// The next number; `None` for one that is not whole, or beyond 64 bits.
    #[inline]
    fn next_integer(&mut self) -> Result<Option<i64>> {
        Ok(match &mut self.from {
            From::Text(feed) => {
                feed.need_word(self.what)?;
                if let Ok(x) = feed.parse::<i64>(self.what) {
                    return Ok(Some(x));
                }
                let x: f64 = feed.parse(self.what)?;
                float(x)
            }
            From::Binary(binary) => match binary.next() {
                Some(bytes) => (binary.kind.whole)(bytes),
                None => return Err(self.too_short()),
            },
            From::Hdf(hdf) => match hdf.next() {
                Some(bytes) => (hdf.kind.whole)(bytes),
                None => return Err(self.too_short()),
            },
            From::Constant(number) => Some(*number),
        })
    }

    /// Adds the words of the next value of a field to `words`: so many numbers of a type. Errors: the type has no such number; the name of the
    /// array and the value's place among these say where.
    pub fn value(
        &mut self,
        (number, components): (FieldNumber, u32),
        (array, row): (&str, u64),
        words: &mut Vec<u64>,
    ) -> Result<()> {
        for _ in 0..components {
            let next = match number.is_integer() {
                true => self.next_integer()?.map(Scalar::Int),
                false => Some(Scalar::Float(self.real()?)),
            };
            let Some(word) = next.and_then(|next| number.pack(next)) else {
                let first = if let From::Hdf(hdf) = &self.from { hdf.rows.first() } else { 0 };
                let (array, row, number) = (array.to_owned(), first + row, number.word());
                return Err(self.place.refuse(ReadFault::FieldValue { array, row, number }));
            };
            words.push(word);
        }
        Ok(())
    }

    /// Ends reading. Errors: there are more numbers.
    pub fn end(mut self) -> Result<()> {
        let is_over = match &mut self.from {
            From::Text(feed) => feed.at_end()?,
            From::Binary(binary) => binary.next().is_none(),
            From::Hdf(hdf) => hdf.next().is_none(),
            From::Constant(_) => true,
        };
        match is_over {
            true => Ok(()),
            false => {
                let expected = format!("the end of the array of {}", self.what);
                let found = "more numbers".to_owned();
                Err(self.place.refuse(ReadFault::Unexpected { expected, found }))
            }
        }
    }

    pub fn place(&self) -> &FilePlace {
        &self.place
    }
}

impl Binary {
    /// Reads the lengths before an array.
    fn begin(&mut self) -> Option<()> {
        let n = self.length()?;
        if !self.layout.is_packed {
            self.left = n;
            return Some(());
        }
        let (size, last) = (self.length()?, self.length()?);
        if size.max(last) > self.layout.block_max {
            return None;
        }
        if n > BLOCKS_MAX {
            return None;
        }
        for _ in 0..n {
            let size = usize::try_from(self.length()?).ok()?;
            self.blocks.push_back(size);
        }
        Some(())
    }

    fn length(&mut self) -> Option<u64> {
        let mut bytes = [0; 8];
        let header = self.layout.header;
        self.take(&mut bytes[..header])?;
        if self.layout.is_big {
            bytes[..header].reverse();
        }
        Some(u64::from_le_bytes(bytes))
    }

    /// Takes bytes of the file, decoded and still packed.
    fn take(&mut self, bytes: &mut [u8]) -> Option<()> {
        if self.coding == Coding::Raw {
            return self.file.read_exact(bytes).ok();
        }
        for byte in bytes {
            while self.decoded.is_empty() {
                let mut word = [0; 4];
                let mut n = 0;
                while n < 4 {
                    let letter = *self.file.fill_buf().ok()?.first()?;
                    self.file.consume(1);
                    if !letter.is_ascii_whitespace() {
                        word[n] = letter;
                        n += 1;
                    }
                }
                let (three, n) = base64_word(&mut &word[..])?;
                self.decoded.extend(&three[..n]);
            }
            *byte = self.decoded.pop_front()?;
        }
        Some(())
    }

    /// Fills `ready` with the next bytes.
    fn refill(&mut self) -> Option<()> {
        self.ready.drain(..self.taken);
        self.taken = 0;
        let kept = self.ready.len();
        if !self.layout.is_packed {
            let n = self.left.min(BUFFER_BYTES as u64) as usize;
            // Without a length the file ends the array.
            let n = match (self.left, self.coding) {
                (u64::MAX, Coding::Raw) => self.file.fill_buf().ok()?.len(),
                _ => n,
            };
            self.ready.resize(kept + n, 0);
            let mut ready = std::mem::take(&mut self.ready);
            let done = self.take(&mut ready[kept..]);
            self.ready = ready;
            if self.left != u64::MAX {
                self.left -= n as u64;
            }
            return done.filter(|()| n > 0);
        }
        let size = self.blocks.pop_front()?;
        if size as u64 > self.layout.block_max.saturating_mul(2) {
            return None;
        }
        let mut block = vec![0; size];
        self.take(&mut block)?;
        let unpack = flate2::read::ZlibDecoder::new(&block[..]);
        let n = unpack.take(self.layout.block_max).read_to_end(&mut self.ready).ok()?;
        (n > 0).then_some(())
    }

    /// The bytes of the next number, the low one first.
    #[inline]
    fn next(&mut self) -> Option<[u8; 8]> {
        let n = self.kind.bytes;
        while self.ready.len() - self.taken < n {
            self.refill()?;
        }
        let mut bytes = [0; 8];
        bytes[..n].copy_from_slice(&self.ready[self.taken..][..n]);
        self.taken += n;
        if self.layout.is_big {
            bytes[..n].reverse();
        }
        Some(bytes)
    }
}
