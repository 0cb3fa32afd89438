//! Counts, lists and sizes as text.

use std::borrow::Cow;
use std::ffi::OsStr;

use tetdb_engine::api::short;

/// Largest number of names listed.
const LISTED: usize = 12;

/// A count with its noun: `1 label`, `2 labels`.
pub fn count(n: impl Into<u64>, what: &str) -> String {
    tetdb_engine::api::count(n.into(), what)
}

/// The range of qualities of a row of a table: `1 to 2`, of the last one `10 and more`.
pub fn quality_range(bin: usize, n_bins: usize) -> String {
    match bin + 1 == n_bins {
        true => format!("{:>2} and more", bin + 1),
        false => format!("{:>2} to {}", bin + 1, bin + 2),
    }
}

/// A quality in four digits, or in as many as keep it within its row of a table.
pub fn worst(q: f64) -> String {
    let text = short(q);
    let is_in_its_row =
        |text: &str| text.parse::<f64>().is_ok_and(|shown| shown.floor() == q.floor());
    match is_in_its_row(&text) || q >= 10.0 {
        true => text,
        false => (4..16)
            .map(|digits| format!("{q:.digits$}"))
            .find(|text| is_in_its_row(text))
            .unwrap_or(text),
    }
}

/// Names separated by commas; of many, only the first.
pub fn listed<T: AsRef<str>>(names: &[T]) -> String {
    let shown: Vec<&str> = names.iter().take(LISTED).map(AsRef::as_ref).collect();
    let rest = match names.len().saturating_sub(LISTED) {
        0 => String::new(),
        n => format!(" and {n} more"),
    };
    shown.join(", ") + &rest
}

/// A box by its corners.
pub fn bounds([low, high]: [[f64; 3]; 2]) -> String {
    let corner = |p: [f64; 3]| p.map(short).join(", ");
    format!("({}) to ({})", corner(low), corner(high))
}

/// Largest number of characters shown of a message; more than the longest path has.
const TEXT_MAX: usize = 5000;

/// The beginning and the end of a text that is too long to read, such as one that repeats its input.
pub fn shortened(text: &str) -> Cow<'_, str> {
    let n = text.chars().count();
    if n <= TEXT_MAX {
        return text.into();
    }
    let begin = text.chars().take(TEXT_MAX / 2);
    let end = text.chars().skip(n - TEXT_MAX / 2);
    begin.chain(" … ".chars()).chain(end).collect::<String>().into()
}

/// A path as a word of a shell's command, in quotes where it needs them.
pub fn quoted(path: impl AsRef<OsStr>) -> String {
    let text = path.as_ref().to_string_lossy();
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "/._-+=:@%,".contains(c);
    match !text.is_empty() && text.chars().all(is_plain) {
        true => text.into_owned(),
        false => single_quoted(&text),
    }
}

/// Text in quotes, as one word of a shell's command.
pub fn single_quoted(text: &str) -> String {
    format!("'{}'", text.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_no_plural_and_long_lists_end() {
        assert_eq!(count(1u32, "region"), "1 region");
        assert_eq!(count(0u32, "region"), "0 regions");
        assert_eq!(
            count(1u32, "tetrahedron") + " " + &count(2u32, "vertex"),
            "1 tetrahedron 2 vertices"
        );
        assert_eq!(quality_range(0, 10).trim(), "1 to 2");
        assert_eq!(quality_range(9, 10), "10 and more");
        let names: Vec<String> = (0..14).map(|n| n.to_string()).collect();
        assert!(listed(&names).ends_with("11 and 2 more"));
        assert_eq!(bounds([[0.0; 3], [1.0, 0.5, 1e-9]]), "(0, 0, 0) to (1, 0.5, 1e-9)");
        assert_eq!([worst(1.99996), worst(2.0), worst(2.1151)], ["1.99996", "2", "2.115"]);
    }

    #[test]
    fn quoted_words_are_read_back_as_one() {
        assert_eq!(quoted("/a/part-1.stl"), "/a/part-1.stl");
        assert_eq!(quoted("sample:box,h=0.1"), "sample:box,h=0.1");
        assert_eq!(quoted("my part.stl"), "'my part.stl'");
        assert_eq!(quoted("it's"), "'it'\\''s'");
        assert_eq!(quoted(""), "''");
    }
}
