//! Tags of an XML text that is held in memory; what follows a tag may be binary.

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

    /// The value of an attribute.
    pub fn get(&self, key: &str) -> Option<&'t str> {
        let mut rest = self.text;
        loop {
            let (name, after) = rest.split_once('=')?;
            let after = after.trim_start();
            let quote = after.chars().next().filter(|c| matches!(c, '"' | '\''))?;
            let (value, next) = after[1..].split_once(quote)?;
            if name.trim() == key {
                return Some(value);
            }
            rest = next;
        }
    }
}
