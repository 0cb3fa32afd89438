//! A room imports only from lower floors, never from its own.
//!
//! Why: the topology kernel must not come to know formats, nor the store geometry, one convenient import at a time.
//! How: every `crate::ROOM` in the sources, tests left out, is looked up in the house below.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Rooms from the lowest floor up.
const HOUSE: &[&[&str]] = &[
    &["geom", "expr"],
    &["storage"],
    &["mesh", "surface", "sealed"],
    &["delaunay", "reconnect", "sizing", "samples", "store"],
    &["boundary", "refine", "optimize"],
    &["bisect", "topology"],
    &["pipeline", "audit", "query"],
    &["io"],
    &["view"],
    &["api"],
    &["cli"],
];

/// Files and modules at the top of the crate that are no rooms.
const NOT_ROOMS: &[&str] = &["lib", "main", "guide"];

fn floor(room: &str) -> Option<usize> {
    HOUSE.iter().position(|rooms| rooms.contains(&room))
}

#[test]
fn rooms_import_only_from_lower_floors() {
    let mut wrong = BTreeSet::new();
    let mut n_imports = 0;
    for path in sources(&src()) {
        let Some(room) = room_of(&path) else { continue };
        let here =
            floor(&room).unwrap_or_else(|| panic!("{room} has no floor in this test's house"));
        let text = fs::read_to_string(&path).expect("a source file is readable");
        for other in imports(&without_tests(&text)) {
            if other == room || NOT_ROOMS.contains(&other.as_str()) {
                continue;
            }
            n_imports += 1;
            match floor(&other) {
                Some(there) if there < here => {}
                _ => _ = wrong.insert(format!("{}: {room} imports {other}", path.display())),
            }
        }
    }
    assert!(
        n_imports > 50,
        "only {n_imports} imports found: does the test still read the sources?"
    );
    assert!(
        wrong.is_empty(),
        "imports that go up or sideways:\n{wrong:#?}"
    );
}

#[test]
fn every_room_is_a_module_of_the_crate() {
    let lib = fs::read_to_string(src().join("lib.rs")).expect("src/lib.rs is readable");
    let declared: BTreeSet<&str> = lib
        .lines()
        .filter_map(|l| l.trim_start().strip_prefix("pub mod ")?.strip_suffix(';'))
        .collect();
    let found: BTreeSet<String> = sources(&src()).iter().filter_map(|p| room_of(p)).collect();
    assert_eq!(declared, found.iter().map(String::as_str).collect());
}

#[test]
fn imports_are_found_however_they_are_written() {
    let text = "use crate::storage::Page;\nuse crate::{geom::Point, mesh::{Tet, Face}};\nlet x = crate::sizing::f();\n\
        /// [`crate::io`] is only named\n#[cfg(test)]\nmod tests { use crate::cli; }\n";
    let found: BTreeSet<String> = imports(&without_tests(text)).into_iter().collect();
    assert_eq!(
        found,
        ["geom", "mesh", "sizing", "storage"]
            .map(String::from)
            .into()
    );
}

fn src() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// All Rust files below `dir`, test files left out.
fn sources(dir: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(dir).expect("a source folder is readable") {
        let path = entry.expect("a folder entry is readable").path();
        let is_tests = path.file_stem().is_some_and(|stem| stem == "tests");
        if is_tests {
            continue;
        } else if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
    found
}

/// The folder (or file) directly below `src`.
fn room_of(path: &Path) -> Option<String> {
    let first = path.strip_prefix(src()).ok()?.iter().next()?;
    let room = Path::new(first).file_stem()?.to_string_lossy().into_owned();
    (!NOT_ROOMS.contains(&room.as_str())).then_some(room)
}

/// The text without comments, up to the tests at its foot.
fn without_tests(text: &str) -> String {
    let mut lines = Vec::new();
    let mut rest = text.lines().peekable();
    while let Some(line) = rest.next() {
        let code = line.split("//").next().unwrap_or_default();
        // A module with a body; `mod tests;` only names a file.
        let ends = code.trim() == "#[cfg(test)]"
            && rest
                .peek()
                .is_some_and(|next| next.starts_with("mod ") && next.contains('{'));
        if ends {
            break;
        }
        lines.push(code);
    }
    lines.join("\n")
}

/// First names after `crate::`, also inside braces.
fn imports(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    for (at, _) in text.match_indices("crate::") {
        // `crate_name::` and `$crate::` are other things.
        if text[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_') {
            continue;
        }
        let rest = &text[at + "crate::".len()..];
        match rest.strip_prefix('{') {
            Some(list) => found.extend(names_in_braces(list)),
            None => found.push(name(rest)),
        }
    }
    // Types and functions of the crate's root are in lower floors' reach.
    found.retain(|n| n.starts_with(|c: char| c.is_ascii_lowercase()));
    found
}

fn names_in_braces(list: &str) -> Vec<String> {
    let (mut depth, mut start, mut found) = (0, true, Vec::new());
    for (i, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => start = true,
            c if c.is_whitespace() => {}
            _ if start => {
                found.push(name(&list[i..]));
                start = false;
            }
            _ => {}
        }
    }
    found
}

fn name(text: &str) -> String {
    text.chars()
        .take_while(|c| c.is_alphanumeric() || *c == '_')
        .collect()
}
