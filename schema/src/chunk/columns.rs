//! Columns of numbers: zigzag differences, varints, byte planes, small dictionaries.

use thiserror::Error;

/// A payload that no encoder writes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct Malformed(pub &'static str);

/// Columns under construction, one after the other.
#[derive(Default)]
pub struct ColumnWriter {
    pub(super) bytes: Vec<u8>,
}

/// Maps small differences of either sign to small numbers.
#[inline]
pub(super) const fn zigzag32(value: u32, base: u32) -> u32 {
    let d = value.wrapping_sub(base) as i32;
    (d << 1 ^ d >> 31) as u32
}

/// The inverse of [`zigzag32`].
#[inline]
pub(super) const fn unzigzag32(z: u32, base: u32) -> u32 {
    base.wrapping_add(z >> 1 ^ (z & 1).wrapping_neg())
}

/// [`zigzag32`] for 64 bits.
#[inline]
pub(super) const fn zigzag64(value: u64, base: u64) -> u64 {
    let d = value.wrapping_sub(base) as i64;
    (d << 1 ^ d >> 63) as u64
}

/// The inverse of [`zigzag64`].
#[inline]
pub(super) const fn unzigzag64(z: u64, base: u64) -> u64 {
    base.wrapping_add(z >> 1 ^ (z & 1).wrapping_neg())
}

impl ColumnWriter {
    /// One number, seven bits a byte, low bits first.
    #[inline]
    pub fn varint(&mut self, mut v: u64) {
        while v >= 0x80 {
            self.bytes.push(v as u8 | 0x80);
            v >>= 7;
        }
        self.bytes.push(v as u8);
    }

    /// Bytes as they are.
    pub fn raw(&mut self, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
    }

    /// A column as `width` planes: first the lowest byte of every value, then the next.
    pub fn planes(&mut self, values: &[u64], width: usize) {
        for plane in 0..width {
            let bytes = values.iter().map(|v| (v >> (8 * plane)) as u8);
            self.bytes.extend(bytes);
        }
    }

    /// A column of 32 bits as planes, without the high planes in which every byte is zero.
    pub fn planes32(&mut self, values: &[u32]) {
        let all = values.iter().fold(0, |all, v| all | v);
        let width = (39 - (all | 1).leading_zeros()) / 8;
        self.bytes.push(width as u8);
        for plane in 0..width {
            let bytes = values.iter().map(|v| (v >> (8 * plane)) as u8);
            self.bytes.extend(bytes);
        }
    }

    /// A column of mostly few different values: a dictionary and for each record a place in it, or differences.
    pub fn dictionary(&mut self, values: impl Iterator<Item = u64> + Clone) {
        let mut words: Vec<u64> = Vec::new();
        let mut places = Vec::with_capacity(values.size_hint().0);
        let mut last = 0;
        for v in values.clone() {
            if words.get(last) != Some(&v) {
                last = words.iter().position(|&w| w == v).unwrap_or(words.len());
                if last == WORDS_MAX {
                    self.bytes.push(DIFFERENCES);
                    let mut base = 0;
                    for v in values {
                        self.varint(zigzag64(v, base));
                        base = v;
                    }
                    return;
                }
                if last == words.len() {
                    words.push(v);
                }
            }
            places.push(last as u8);
        }
        self.bytes.push(DICTIONARY);
        self.varint(words.len() as u64);
        for &w in &words {
            self.varint(w);
        }
        if words.len() > 1 {
            self.bytes.extend_from_slice(&places);
        }
    }
}

/// Most words of a dictionary: a place is one byte. Looking words up is linear, which 256 keeps harmless.
const WORDS_MAX: usize = 256;
const DICTIONARY: u8 = 0;
const DIFFERENCES: u8 = 1;

/// Columns being read, in the order they were written.
pub struct ColumnReader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> ColumnReader<'a> {
    /// Starts at the first column.
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// Fails unless everything has been read.
    pub(super) fn finish(self) -> Result<(), Malformed> {
        if self.at == self.bytes.len() {
            Ok(())
        } else {
            Err(Malformed("bytes after the last column"))
        }
    }

    /// The next `n` bytes.
    pub fn raw(&mut self, n: usize) -> Result<&'a [u8], Malformed> {
        let rest = &self.bytes[self.at..];
        let taken = rest.get(..n).ok_or(Malformed("a column ends early"))?;
        self.at += n;
        Ok(taken)
    }

    /// One varint.
    #[inline]
    pub fn varint(&mut self) -> Result<u64, Malformed> {
        match self.bytes.get(self.at) {
            Some(&byte) if byte < 0x80 => {
                self.at += 1;
                Ok(u64::from(byte))
            }
            _ => self.long_varint(),
        }
    }

    fn long_varint(&mut self) -> Result<u64, Malformed> {
        let mut v = 0;
        for shift in (0..64).step_by(7) {
            let &byte = self.bytes.get(self.at).ok_or(Malformed("a number ends early"))?;
            self.at += 1;
            v |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Ok(v);
            }
        }
        Err(Malformed("a number has more than 64 bits"))
    }

    /// One varint of 32 bits.
    #[inline]
    pub fn varint32(&mut self) -> Result<u32, Malformed> {
        let v = self.varint()?;
        u32::try_from(v).map_err(|_| Malformed("a number has more than 32 bits"))
    }

    /// A column of `count` values in `width` planes.
    pub fn planes(&mut self, count: usize, width: usize) -> Result<Vec<u64>, Malformed> {
        let mut values = vec![0u64; count];
        for plane in 0..width {
            let bytes = self.raw(count)?;
            for (v, &byte) in values.iter_mut().zip(bytes) {
                *v |= u64::from(byte) << (8 * plane);
            }
        }
        Ok(values)
    }

    /// The inverse of [`ColumnWriter::planes32`]; fills `values`.
    pub fn planes32(&mut self, values: &mut [u32]) -> Result<(), Malformed> {
        let width = self.raw(1)?[0];
        if !(1..=4).contains(&width) {
            return Err(Malformed("a column of no known width"));
        }
        let count = values.len();
        for (v, &byte) in values.iter_mut().zip(self.raw(count)?) {
            *v = u32::from(byte);
        }
        for plane in 1..width {
            for (v, &byte) in values.iter_mut().zip(self.raw(count)?) {
                *v |= u32::from(byte) << (8 * plane);
            }
        }
        Ok(())
    }

    /// The inverse of [`ColumnWriter::dictionary`]: calls `set` with each record's place and value.
    pub fn dictionary(
        &mut self,
        count: usize,
        mut set: impl FnMut(usize, u64),
    ) -> Result<(), Malformed> {
        match self.raw(1)?[0] {
            DIFFERENCES => {
                let mut base = 0;
                for i in 0..count {
                    base = unzigzag64(self.varint()?, base);
                    set(i, base);
                }
            }
            DICTIONARY => {
                let n = self.varint()?;
                if n > WORDS_MAX as u64 || (n == 0 && count > 0) {
                    return Err(Malformed("a dictionary of a wrong length"));
                }
                let words = (0..n).map(|_| self.varint()).collect::<Result<Vec<_>, _>>()?;
                if n == 1 {
                    (0..count).for_each(|i| set(i, words[0]));
                } else if n > 1 {
                    for (i, &place) in self.raw(count)?.iter().enumerate() {
                        let word = words.get(usize::from(place));
                        set(i, *word.ok_or(Malformed("a place beyond the dictionary"))?);
                    }
                }
            }
            _ => return Err(Malformed("an unknown form of column")),
        }
        Ok(())
    }
}
