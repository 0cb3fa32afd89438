//! Names and messages are in plain words, and only the command line knows its flags.
//!
//! Why: a word found in no textbook has to be learned, and a message that names a flag does not help callers of the library.
//! How: the test checks names of types, functions and files in the sources, and string literals. Tests are left out.

mod sources;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use sources::{sources, src};

/// Former names of types, which must not come back.
const TYPES: &[&str] = &[
    "Bar", "Column", "Crew", "Found", "Goodness", "Inquiry", "List", "Missing", "Paged", "Rescue",
    "Room", "Stop", "Talk", "Told", "Wish",
];
/// Words that must not be part of a name.
const PARTS: &[&str] = &[
    "crew", "goodness", "hopeless", "inquiry", "judge", "made", "rims", "tell", "tells", "told",
    "whole", "wish", "wishes",
];
/// Words that must not be names of files.
const FILES: &[&str] =
    &["again", "ahead", "before", "crew", "fine", "held", "keep", "rims", "room", "whole", "wish"];
/// Words that must not be in an error message.
const IN_NO_MESSAGE: &[&str] = &["crew", "made", "told"];

/// Modules whose names are not yet plain.
const NAMES_OPEN: &[&str] = &["cli", "kernel/optimize"];

#[test]
fn names_are_plain() {
    let mut wrong = Vec::new();
    let mut n_names = 0;
    for path in below(&src(), NAMES_OPEN) {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        if FILES.contains(&&*stem) {
            wrong.push(format!("{}: the file's name", path.display()));
        }
        let text = without_tests(&read(&path));
        for (kind, name) in names(&text) {
            n_names += 1;
            let is_type = kind != "fn";
            let is_old = is_type && TYPES.contains(&&*name);
            if is_old || parts(&name).iter().any(|part| PARTS.contains(&&**part)) {
                wrong.push(format!("{}: {kind} {name}", path.display()));
            }
        }
    }
    assert!(n_names > 1000, "only {n_names} names found: does the test still read the sources?");
    assert!(wrong.is_empty(), "names that need explaining:\n{wrong:#?}");
}

#[test]
fn only_the_command_line_names_flags() {
    let names_flag = |path: &PathBuf| literals(&read(path)).iter().any(|text| has_flag(text));
    let all: BTreeSet<PathBuf> =
        below(&src(), &["cli", "engine/api"]).into_iter().filter(names_flag).collect();
    assert!(all.is_empty(), "string literals with flags of the command line in {all:#?}");
}

#[test]
fn error_messages_are_plain() {
    for path in below(&src(), &["cli"]) {
        for message in messages(&read(&path)) {
            let words: Vec<&str> = message.split(|c: char| !c.is_alphanumeric()).collect();
            let found = IN_NO_MESSAGE.iter().find(|word| words.contains(word));
            assert_eq!(found, None, "{}: {message}", path.display());
        }
    }
}

#[test]
fn literals_and_names_are_found() {
    let text = "fn a() { let x = \"one // two\\\" --flag\"; } // \"none\"\nstruct OldTold<'a>(char);\n\
        const C: char = '\"'; const R: &str = r#\"a\"b\"#;\n#[error(\"was told\")]\n#[cfg(test)]\nmod tests { \"x\" }\n";
    assert_eq!(literals(text), ["one // two\\\" --flag", "a\"b", "was told"]);
    assert!(has_flag(&literals(text)[0]) && !has_flag("a -- b, --, c--d"));
    assert_eq!(messages(text), ["was told"]);
    let found: Vec<_> = names(text).collect();
    let expected = [("fn", "a"), ("struct", "OldTold"), ("mod", "tests")];
    assert_eq!(found, expected.map(|(kind, name)| (kind, name.to_owned())));
    assert_eq!(parts("OldTold"), ["old", "told"]);
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).expect("a source file is readable")
}

/// All sources, except those of some modules.
fn below(root: &Path, but: &[&str]) -> Vec<PathBuf> {
    let mut found = sources(root);
    found.retain(|path| !but.iter().any(|name| path.starts_with(root.join(name))));
    found
}

/// Names declared in code, each with its keyword.
fn names(code: &str) -> impl Iterator<Item = (&str, String)> {
    const KEYWORDS: &[&str] = &["enum", "fn", "mod", "struct", "trait", "type"];
    let words: Vec<&str> = code.split_whitespace().collect();
    let pairs: Vec<_> = words
        .windows(2)
        .filter(|pair| KEYWORDS.contains(&pair[0]))
        .map(|pair| {
            let is_name = |c: &char| c.is_alphanumeric() || *c == '_';
            (pair[0], pair[1].chars().take_while(is_name).collect())
        })
        .collect();
    pairs.into_iter()
}

/// The words of a name, in lower case.
fn parts(name: &str) -> Vec<String> {
    let is_constant = name.chars().all(|c| !c.is_lowercase());
    let mut parts = vec![String::new()];
    for c in name.chars() {
        if c == '_' || c.is_uppercase() && !is_constant {
            parts.push(String::new());
        }
        if c != '_' {
            parts.last_mut().expect("there is one").extend(c.to_lowercase());
        }
    }
    parts.retain(|part| !part.is_empty());
    parts
}

/// Returns whether a text contains a flag: `--word` at its beginning or after a character that is neither a letter, a digit nor `-`.
fn has_flag(text: &str) -> bool {
    text.match_indices("--").any(|(at, _)| {
        let after = text[at + 2..].chars().next();
        let joined = text[..at].ends_with(|c: char| c.is_alphanumeric() || c == '-');
        !joined && after.is_some_and(|c| c.is_ascii_lowercase())
    })
}

/// The texts of `#[error("…")]`.
fn messages(text: &str) -> Vec<String> {
    text.split("#[error(")
        .skip(1)
        .filter_map(|rest| literals(rest.split(")]").next()?).into_iter().next())
        .collect()
}

/// String literals outside comments, up to the tests at the file's foot.
fn literals(text: &str) -> Vec<String> {
    let end = text.find("#[cfg(test)]\nmod tests {").unwrap_or(text.len());
    let mut rest = &text[..end];
    let mut found = Vec::new();
    while let Some(at) = rest.find(['"', '/', '\'']) {
        let before = &rest[..at];
        rest = &rest[at..];
        if rest.starts_with("//") {
            rest = rest.find('\n').map_or("", |end| &rest[end..]);
        } else if let Some(inside) = rest.strip_prefix('"') {
            let hashes = before.len() - before.trim_end_matches('#').len();
            let is_raw =
                before.trim_end_matches('#').ends_with('r') && (hashes > 0 || is_word_r(before));
            let length = match is_raw {
                true => inside.find(&format!("\"{}", "#".repeat(hashes))),
                false => closing_quote(inside),
            };
            let length = length.unwrap_or(inside.len());
            found.push(inside[..length].to_owned());
            rest = inside.get(length + 1..).unwrap_or_default();
        } else {
            // A character literal, which may be a quote, or a lifetime.
            let is_char = rest.starts_with("'\"'") || rest.starts_with("'\\");
            rest = &rest[if is_char { 3 } else { 1 }..];
        }
    }
    found
}

/// Returns whether a text ends with the word `r`.
fn is_word_r(text: &str) -> bool {
    text.strip_suffix('r').is_some_and(|t| !t.ends_with(|c: char| c.is_alphanumeric() || c == '_'))
}

/// Position of the closing quote of a string.
fn closing_quote(text: &str) -> Option<usize> {
    let mut escaped = false;
    text.char_indices().find_map(|(at, c)| {
        let ends = c == '"' && !escaped;
        escaped = c == '\\' && !escaped;
        ends.then_some(at)
    })
}

/// The text without comments, without the tests at its end, and without items declared only for tests.
fn without_tests(text: &str) -> String {
    let mut lines = Vec::new();
    let mut rest = text.lines().peekable();
    while let Some(line) = rest.next() {
        let code = line.split("//").next().unwrap_or_default();
        if code.trim() == "#[cfg(test)]" {
            match rest.peek() {
                // A module with a body; `mod tests;` only names a file.
                Some(next) if next.starts_with("mod ") && next.contains('{') => break,
                Some(next) if next.ends_with(';') => _ = rest.next(),
                _ => {}
            }
            continue;
        }
        lines.push(code);
    }
    lines.join("\n")
}
