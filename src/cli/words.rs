//! Counts, lists and sizes as text.

use std::borrow::Cow;
use std::path::Path;

use tetdb_engine::api::short;

/// Largest number of names listed.
const LISTED: usize = 12;

/// A count with its noun: `1 label`, `2 labels`.
pub fn count(n: impl Into<u64>, what: &str) -> String {
    match n.into() {
        1 => format!("1 {what}"),
        n => format!("{n} {what}s"),
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
pub fn quoted(path: &Path) -> String {
    let text = path.to_string_lossy();
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
        let names: Vec<String> = (0..14).map(|n| n.to_string()).collect();
        assert!(listed(&names).ends_with("11 and 2 more"));
        assert_eq!(bounds([[0.0; 3], [1.0, 0.5, 1e-9]]), "(0, 0, 0) to (1, 0.5, 1e-9)");
    }
}
