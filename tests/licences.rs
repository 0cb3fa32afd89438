//! All dependencies of this program have permissive licences.
//!
//! Why: MIT OR Apache-2.0 is a promise about the whole program, and one dependency can break it.
//! How: `cargo metadata` lists the packages built on this platform; each licence expression must offer a permissive choice.

use std::process::Command;

/// Licences that require no more than a notice.
const PERMISSIVE: &[&str] = &[
    "MIT",
    "MIT-0",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC0-1.0",
    "ISC",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
    "0BSD",
];

#[test]
fn every_dependency_is_permissive() {
    let packages = packages();
    assert!(packages.len() > 10, "only {} packages were listed", packages.len());
    for package in &packages {
        let (name, licence) = (&package["name"], package["license"].as_str());
        let licence =
            licence.unwrap_or_else(|| panic!("{name} names no licence; look at its licence file"));
        assert!(is_permissive(licence), "{name} is under {licence}");
    }
}

#[test]
fn expressions_are_read_as_they_are_meant() {
    for good in [
        "MIT OR Apache-2.0",
        "MIT/Apache-2.0",
        "GPL-3.0 OR MIT",
        "(MIT OR GPL-2.0) AND Unicode-3.0",
    ] {
        assert!(is_permissive(good), "{good}");
    }
    for bad in [
        "GPL-3.0",
        "LGPL-2.1-only",
        "MIT AND GPL-3.0",
        "AGPL-3.0 OR LGPL-3.0",
        "MIT AND (GPL-2.0 OR MPL-2.0)",
        "",
    ] {
        assert!(!is_permissive(bad), "{bad}");
    }
}

fn packages() -> Vec<serde_json::Value> {
    let rustc =
        Command::new("rustc").arg("-vV").output().expect("rustc is there, it built this test");
    let version = String::from_utf8(rustc.stdout).expect("rustc speaks UTF-8");
    let host =
        version.lines().find_map(|l| l.strip_prefix("host: ")).expect("rustc names its host");
    let cargo = Command::new(env!("CARGO"))
        .args([
            "metadata",
            "--offline",
            "--locked",
            "--format-version",
            "1",
            "--filter-platform",
            host,
        ])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo is there, it runs this test");
    assert!(cargo.status.success(), "{}", String::from_utf8_lossy(&cargo.stderr));
    let metadata: serde_json::Value =
        serde_json::from_slice(&cargo.stdout).expect("cargo metadata is JSON");
    metadata["packages"].as_array().expect("metadata lists packages").clone()
}

/// Returns whether some choice of the expression is permissive: OR needs one side, AND needs both.
fn is_permissive(expression: &str) -> bool {
    let text = expression.replace('/', " OR ");
    let text = text.trim();
    if let Some(sides) = split_outside(text, " OR ") {
        return sides.iter().any(|side| is_permissive(side));
    }
    if let Some(sides) = split_outside(text, " AND ") {
        return sides.iter().all(|side| is_permissive(side));
    }
    match text.strip_prefix('(').and_then(|t| t.strip_suffix(')')) {
        Some(inner) => is_permissive(inner),
        None => PERMISSIVE.contains(&text),
    }
}

/// The parts between occurrences of `word` outside all parentheses; `None` if there are none.
fn split_outside<'a>(text: &'a str, word: &str) -> Option<Vec<&'a str>> {
    let (mut parts, mut from, mut depth) = (Vec::new(), 0, 0);
    for (i, c) in text.char_indices() {
        match c {
            '(' => depth += 1,
            ')' => depth -= 1,
            _ if depth == 0 && text[i..].starts_with(word) => {
                parts.push(&text[from..i]);
                from = i + word.len();
            }
            _ => {}
        }
    }
    parts.push(&text[from..]);
    (parts.len() > 1).then_some(parts)
}
