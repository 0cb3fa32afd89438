//! Tags and arrays of an XML text that is held in memory; what follows a tag may be binary.

use super::Spot;

/// A tag: its name, its attributes and where it ends.
#[derive(Debug)]
pub(super) struct Tag<'t> {
    /// Without the prefix of its namespace.
    pub name: &'t str,
    text: &'t str,
    pub is_end: bool,
    /// A tag that ends itself.
    pub is_empty: bool,
    /// The byte behind it.
    pub end: usize,
}

impl<'t> Tag<'t> {
    /// The next tag from a byte on. Comments and declarations are passed over.
    pub fn next(text: &'t [u8], mut from: usize) -> Option<Self> {
        loop {
            let start = from + text.get(from..)?.iter().position(|&b| b == b'<')?;
            let rest = &text[start..];
            if rest.starts_with(b"<!--") {
                from = start + 4 + rest[4..].windows(3).position(|w| w == b"-->")?;
                continue;
            }
            let mut quote = None;
            let length = rest.iter().position(|&b| match quote {
                Some(open) => {
                    if b == open {
                        quote = None;
                    }
                    false
                }
                None if b == b'"' || b == b'\'' => {
                    quote = Some(b);
                    false
                }
                None => b == b'>',
            })?;
            let end = start + length + 1;
            if matches!(rest.get(1), Some(b'!' | b'?')) {
                from = end;
                continue;
            }
            let inside = std::str::from_utf8(&rest[1..length]).ok()?;
            let (is_end, inside) = (inside.starts_with('/'), inside.trim_start_matches('/'));
            let is_empty = inside.ends_with('/');
            let inside = inside.trim_end_matches('/');
            let (name, text) =
                inside.split_at(inside.find(char::is_whitespace).unwrap_or(inside.len()));
            let name = name.rsplit(':').next().unwrap_or_default();
            return Some(Self { name, text, is_end, is_empty, end });
        }
    }

    /// The value of an attribute, whatever the prefix of its namespace.
    pub fn get(&self, key: &str) -> Option<&'t str> {
        let mut rest = self.text;
        loop {
            let (name, after) = rest.split_once('=')?;
            let after = after.trim_start();
            let quote = after.chars().next().filter(|c| matches!(c, '"' | '\''))?;
            let (value, next) = after[1..].split_once(quote)?;
            if name.trim().rsplit(':').next() == Some(key) {
                return Some(value);
            }
            rest = next;
        }
    }
}

/// Counts lines while a text is read from its beginning.
#[derive(Default)]
pub(super) struct Lines {
    at: usize,
    n: u64,
}

impl Lines {
    /// Goes on to a byte that is not before the last one.
    pub fn advance(&mut self, text: &[u8], at: usize) {
        self.n += text[self.at..at].iter().filter(|&&b| b == b'\n').count() as u64;
        self.at = at;
    }

    /// The line of that byte, from 1 on.
    pub fn line(&self) -> u64 {
        1 + self.n
    }
}

/// The line of a byte.
pub(super) fn line_of(text: &[u8], byte: usize) -> Spot {
    let before = &text[..byte.min(text.len())];
    Spot::Line(1 + before.iter().filter(|&&b| b == b'\n').count() as u64)
}

/// The text of an attribute or an element without its escapes.
pub(super) fn unescaped(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('&') {
        plain += before;
        let escape = after.split_once(';').and_then(|(word, after)| {
            let number = |digits: &str| match digits.strip_prefix(['x', 'X']) {
                Some(digits) => u32::from_str_radix(digits, 16).ok(),
                None => digits.parse().ok(),
            };
            let c = match word {
                "amp" => '&',
                "lt" => '<',
                "gt" => '>',
                "quot" => '"',
                "apos" => '\'',
                _ => char::from_u32(number(word.strip_prefix('#')?)?)?,
            };
            Some((c, after))
        });
        match escape {
            Some((c, after)) => {
                plain.push(c);
                rest = after;
            }
            None => {
                plain.push('&');
                rest = after;
            }
        }
    }
    plain + rest
}

/// The next four letters of base64: up to three bytes, and their number.
pub(super) fn base64_word(text: &mut &[u8]) -> Option<([u8; 3], usize)> {
    let (mut word, mut n_bits) = (0u32, 0);
    let mut left = 4;
    while left > 0 {
        let (&letter, rest) = text.split_first()?;
        *text = rest;
        let bits = match letter {
            b'A'..=b'Z' => letter - b'A',
            b'a'..=b'z' => letter - b'a' + 26,
            b'0'..=b'9' => letter - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            b'=' => {
                (word, left) = (word << 6, left - 1);
                continue;
            }
            _ if letter.is_ascii_whitespace() => continue,
            _ => return None,
        };
        (word, n_bits, left) = (word << 6 | u32::from(bits), n_bits + 6, left - 1);
    }
    let [_, bytes @ ..] = word.to_be_bytes();
    Some((bytes, n_bits / 8))
}

/// The numbers of an array of bytes, of a type in VTK's words.
pub(super) fn numbers(kind: &str, is_big: bool, content: &[u8]) -> Option<Vec<f64>> {
    macro_rules! numbers {
        ($type:ty) => {
            (content.chunks_exact(size_of::<$type>()))
                .map(|b| {
                    let bytes = b.try_into().unwrap_or_default();
                    let x = if is_big {
                        <$type>::from_be_bytes(bytes)
                    } else {
                        <$type>::from_le_bytes(bytes)
                    };
                    x as f64
                })
                .collect()
        };
    }
    Some(match kind {
        "Int8" => numbers!(i8),
        "UInt8" => numbers!(u8),
        "Int16" => numbers!(i16),
        "UInt16" => numbers!(u16),
        "Int32" => numbers!(i32),
        "UInt32" => numbers!(u32),
        "Int64" => numbers!(i64),
        "UInt64" => numbers!(u64),
        "Float32" => numbers!(f32),
        "Float64" => numbers!(f64),
        _ => return None,
    })
}
