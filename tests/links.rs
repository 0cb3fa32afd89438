//! Relative links of the pages lead to files.
//!
//! Why: a page on a code host whose links are broken leads its reader astray, and nothing else follows them.
//! How: in every `.md` of the repository, each target of a link that is no address, anchor or item of the documentation must exist.

use std::fs;
use std::path::{Path, PathBuf};

fn pages(folder: &Path, all: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder is readable") {
        let path = entry.expect("an entry is readable").path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        match path.is_dir() {
            true if name.starts_with('.') || name.starts_with("target") || name == "shared" => {}
            true => pages(&path, all),
            false if name.ends_with(".md") => all.push(path),
            false => {}
        }
    }
}

/// Targets of `[text](target)` and of `[name]: target`, outside of blocks of code.
fn targets(page: &str) -> Vec<String> {
    let (mut found, mut in_block) = (Vec::new(), false);
    for line in page.lines() {
        in_block ^= line.trim_start().starts_with("```");
        if in_block {
            continue;
        }
        let inline = line.split("](").skip(1).filter_map(|rest| rest.split(')').next());
        found.extend(inline.map(str::to_owned));
        if let Some((_, target)) = line.strip_prefix('[').and_then(|rest| rest.split_once("]: ")) {
            found.push(target.to_owned());
        }
    }
    found
}

#[test]
fn every_relative_link_leads_to_a_file() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (mut all, mut wrong, mut n) = (Vec::new(), Vec::new(), 0);
    pages(root, &mut all);
    for path in all {
        let page = fs::read_to_string(&path).expect("a page is text");
        for target in targets(&page) {
            let file = target.split('#').next().unwrap_or_default();
            // `guide::start` and `crate::Error` are resolved by the documentation.
            if file.is_empty() || target.contains("://") || target.contains("::") {
                continue;
            }
            n += 1;
            if !path.with_file_name(file).exists() {
                wrong.push(format!("{}: {target}", path.display()));
            }
        }
    }
    assert!(n > 50, "only {n} links found");
    assert!(wrong.is_empty(), "links that lead nowhere:\n{wrong:#?}");
}

#[test]
fn links_are_found() {
    let page = "[a](b.md) and [c](d.md#e)\n```\n[f](g.md)\n```\n[h]: i.rs\n";
    assert_eq!(targets(page), ["b.md", "d.md#e", "i.rs"]);
}
