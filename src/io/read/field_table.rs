//! Values of a field, from `.npy` arrays and from tables of text.
//!
//! An array has a row for each value, in C order. A table has a line for each value: its numbers, and before them an id where its first
//! line names a column `id`, or where ids are expected.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use super::error::{ReadError, Spot};
use super::feed::Result;
use super::lengths::{ArrayFile, sides_of};
use tetdb_schema::field::{COMPONENTS, FieldNumber, Scalar};

/// Longest line of a table.
const LINE_MAX: u64 = 1 << 16;

/// A value as it is read.
#[derive(Clone, Debug, Default)]
pub struct FieldValue {
    /// Its id; empty where there are none.
    pub id: String,
    /// Its numbers.
    pub numbers: Vec<Scalar>,
    /// Line of a table, or row of an array from 0.
    pub line: u64,
}

/// A file of values, read front to back.
pub struct FieldTable {
    file: ArrayFile,
    /// Number of rows of an array and the type of its numbers; `None` for a table.
    array: Option<(u64, ArrayNumber)>,
    components: u32,
    number: FieldNumber,
    has_ids: bool,
    separator: char,
    /// The first line of values of a table, already read.
    ahead: Option<String>,
    line: u64,
}

/// Type of an array's numbers: kind `f`, `i` or `u`, bytes, high bytes first.
type ArrayNumber = (u8, usize, bool);

impl FieldTable {
    /// Opens a file. With `expects_ids`, the first column of a table is ids also where its first line does not say so.
    ///
    /// Errors: the file cannot be read; a type or shape that no field has.
    pub fn open(path: &Path, expects_ids: bool) -> Result<Self> {
        let file = ArrayFile::open(path)?;
        let mut table = Self {
            file,
            array: None,
            components: 1,
            number: FieldNumber::F64,
            has_ids: expects_ids,
            separator: ' ',
            ahead: None,
            line: 0,
        };
        match path.extension().is_some_and(|e| e.eq_ignore_ascii_case("npy")) {
            true => table.array_head()?,
            false => table.table_head()?,
        }
        Ok(table)
    }

    /// Numbers of a value.
    pub fn components(&self) -> u32 {
        self.components
    }

    /// The type that holds all numbers.
    pub fn number(&self) -> FieldNumber {
        self.number
    }

    /// Returns whether values have ids.
    pub fn has_ids(&self) -> bool {
        self.has_ids
    }

    /// Number of values, where the file says it.
    pub fn n_values(&self) -> Option<u64> {
        self.array.map(|(n, _)| n)
    }

    /// The place of a value in words.
    pub fn place(&self, line: u64) -> String {
        match self.array {
            Some(_) => format!("{}, row {line}", self.file.name),
            None => format!("{}, line {line}", self.file.name),
        }
    }

    fn array_head(&mut self) -> Result<()> {
        let (kind, is_by_rows, shape) = self.file.head_words()?;
        let word = kind.trim_start_matches(['<', '=', '|', '>']);
        let [letter, digit] = word.as_bytes() else { return Err(self.bad_type(&kind)) };
        let bytes = usize::from(digit.wrapping_sub(b'0'));
        self.number = match (letter, bytes) {
            (b'f', 4) => FieldNumber::F32,
            (b'f', 8) => FieldNumber::F64,
            (b'i', 1 | 2 | 4) | (b'u', 1 | 2) => FieldNumber::I32,
            (b'i', 8) | (b'u', 4) => FieldNumber::I64,
            _ => return Err(self.bad_type(&kind)),
        };
        let sides = sides_of(&shape);
        let inner: Option<u32> =
            sides.iter().skip(1).map(|side| side.parse::<u32>().ok()).product();
        let n = sides.first().and_then(|side| side.parse().ok());
        let fits = inner.filter(|c| COMPONENTS.contains(c) && (is_by_rows || *c == 1));
        let (Some(components), Some(n)) = (fits, n) else {
            let expected = "a row for each value, of 1, 3, 6 or 9 numbers, in C order";
            let found = format!("an array of shape {shape}");
            return Err(self.file.unexpected(Spot::Byte(8), expected, found));
        };
        self.components = components;
        self.array = Some((n, (*letter, bytes, kind.starts_with('>'))));
        Ok(())
    }

    fn bad_type(&self, kind: &str) -> ReadError {
        let expected = "float32, float64 or integers of up to 8 bytes";
        self.file.unexpected(Spot::Byte(8), expected, format!("type {kind}"))
    }

    fn table_head(&mut self) -> Result<()> {
        let Some(first) = self.text_line()? else {
            let expected = "a line for each value";
            return Err(self.file.unexpected(Spot::Line(1), expected, "an empty file".to_owned()));
        };
        let found = [',', ';', '\t'].into_iter().find(|sign| first.contains(*sign));
        self.separator = found.unwrap_or(' ');
        let words = self.words(&first);
        let is_value = |word: &&str| scalar(word).is_some() || word.contains(':');
        let is_head = !words.iter().all(is_value);
        if is_head {
            self.has_ids |= words[0].eq_ignore_ascii_case("id");
        }
        let n = words.len() as u32 - u32::from(self.has_ids);
        if !COMPONENTS.contains(&n) {
            let (expected, found) = (self.expected(), format!("{} columns", words.len()));
            return Err(self.file.unexpected(Spot::Line(self.line), &expected, found));
        }
        self.components = n;
        self.ahead = (!is_head).then_some(first);
        Ok(())
    }

    fn expected(&self) -> String {
        let ids = if self.has_ids { "an id and " } else { "" };
        format!("{ids}1, 3, 6 or 9 numbers in each line")
    }

    fn words<'a>(&self, line: &'a str) -> Vec<&'a str> {
        match self.separator {
            ' ' => line.split_whitespace().collect(),
            sign => line.split(sign).map(str::trim).collect(),
        }
    }

    /// The next line that is neither empty nor a comment.
    fn text_line(&mut self) -> Result<Option<String>> {
        loop {
            let mut bytes = Vec::new();
            let mut limited: std::io::Take<&mut BufReader<File>> =
                self.file.from.by_ref().take(LINE_MAX);
            let read = limited.read_until(b'\n', &mut bytes);
            self.line += 1;
            let here = Spot::Line(self.line);
            read.map_err(|e| self.file.unexpected(here, "a line", e.to_string()))?;
            if bytes.is_empty() {
                return Ok(None);
            }
            if bytes.len() as u64 == LINE_MAX && bytes.last() != Some(&b'\n') {
                let found = "a line of more than 65,536 bytes".to_owned();
                return Err(self.file.unexpected(here, "a line of a table", found));
            }
            let text = String::from_utf8_lossy(&bytes);
            let text = text.trim_start_matches('\u{feff}').trim();
            if !text.is_empty() && !text.starts_with('#') {
                return Ok(Some(text.to_owned()));
            }
        }
    }

    /// Reads the next value into `value`; returns `false` after the last. Errors: the file, and where.
    pub fn read(&mut self, value: &mut FieldValue) -> Result<bool> {
        value.numbers.clear();
        if let Some((n, (letter, bytes, big))) = self.array {
            value.line = self.line;
            if self.line == n {
                return self.array_end();
            }
            let mut row = self.file.take(bytes * self.components as usize)?;
            for word in row.chunks_mut(bytes) {
                if big {
                    word.reverse();
                }
                value.numbers.push(array_number(letter, word));
            }
            self.line += 1;
            return Ok(true);
        }
        let line = match self.ahead.take() {
            Some(line) => line,
            None => match self.text_line()? {
                Some(line) => line,
                None => return Ok(false),
            },
        };
        value.line = self.line;
        let words = self.words(&line);
        let (ids, numbers) = words.split_at(usize::from(self.has_ids).min(words.len()));
        value.id.clear();
        value.id.push_str(ids.first().unwrap_or(&""));
        if numbers.len() != self.components as usize {
            let expected = format!("{} numbers, as in the first line", self.components);
            let found = numbers.len().to_string();
            return Err(self.file.unexpected(Spot::Line(self.line), &expected, found));
        }
        for word in numbers {
            let number = scalar(word).ok_or_else(|| {
                let found = format!("{word:?}");
                self.file.unexpected(Spot::Line(self.line), "a number", found)
            })?;
            value.numbers.push(number);
        }
        Ok(true)
    }

    fn array_end(&mut self) -> Result<bool> {
        match self.file.from.fill_buf().is_ok_and(<[u8]>::is_empty) {
            true => Ok(false),
            false => {
                let expected = "the end of the file behind its last number";
                Err(self.file.unexpected(Spot::File, expected, "more bytes".to_owned()))
            }
        }
    }
}

/// A number of a table; `nan` and `inf` are numbers too.
fn scalar(word: &str) -> Option<Scalar> {
    let whole = word.parse().map(Scalar::Int).ok();
    whole.or_else(|| word.parse().map(Scalar::Float).ok())
}

/// A number of an array, low bytes first.
fn array_number(letter: u8, word: &[u8]) -> Scalar {
    let mut low = [0; 8];
    low[..word.len()].copy_from_slice(word);
    let bits = u64::from_le_bytes(low);
    let shift = 64 - 8 * word.len() as u32;
    match (letter, word.len()) {
        (b'f', 4) => Scalar::Float(f64::from(f32::from_bits(bits as u32))),
        (b'f', _) => Scalar::Float(f64::from_bits(bits)),
        (b'i', _) => Scalar::Int(((bits << shift) as i64) >> shift),
        _ => Scalar::Int(bits as i64),
    }
}
