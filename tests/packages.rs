//! Files of packages repeat what `Cargo.toml` says, and every crate that is published says what it is.
//!
//! Why: a registry refuses a crate without a description, and a version that was raised in one file alone is found by users.
//! How: `Cargo.toml` has versions, addresses and words once; manifests of other tools are compared with it.

use std::fs;
use std::path::{Path, PathBuf};

use toml::{Table, Value};

fn read(path: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn table(path: &str) -> Table {
    read(path).parse().unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// The table `workspace.package`.
fn shared() -> Table {
    table("Cargo.toml")["workspace"]["package"].as_table().expect("a table").clone()
}

/// The value after `key` in a line of its own.
fn line<'a>(text: &'a str, key: &str) -> &'a str {
    let value = text.lines().find_map(|line| line.trim().strip_prefix(key));
    value.unwrap_or_else(|| panic!("no line `{key}`")).trim().trim_matches('"')
}

/// Folders of the crates that are published.
fn published() -> Vec<PathBuf> {
    let folders = fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("src")).expect("src");
    let folders = folders.map(|entry| entry.expect("an entry").path());
    let mut all: Vec<PathBuf> = folders.filter(|path| path.join("Cargo.toml").exists()).collect();
    assert_eq!(all.len(), 7, "{all:?}");
    all.extend(["", "schema"].map(PathBuf::from));
    all
}

#[test]
fn published_crates_are_described() {
    for folder in published() {
        let path = folder.join("Cargo.toml");
        let path = path.to_str().expect("a name in ASCII");
        let package = table(path)["package"].clone();
        let words = ["description", "license", "repository", "homepage", "documentation", "readme"];
        for word in words.into_iter().chain(["keywords", "categories", "rust-version"]) {
            assert!(package.get(word).is_some(), "{path} has no {word}");
        }
        assert!(package.get("publish").is_none(), "{path}");
    }
    for path in ["tools", "tools/python", "tools/fuzz", "tools/arrow", "tools/sql"]
        .map(|folder| format!("{folder}/Cargo.toml"))
    {
        assert_eq!(table(&path)["package"].get("publish"), Some(&Value::Boolean(false)), "{path}");
    }
}

/// The texts lie at the top; each package has links to them, which `cargo package` and maturin replace by the texts.
#[test]
fn every_package_has_the_licences() {
    for folder in published().into_iter().chain(["tools/python".into()]) {
        for name in ["LICENSE-MIT", "LICENSE-APACHE"] {
            let path = folder.join(name);
            let path = path.to_str().expect("a name in ASCII");
            assert!(read(path) == read(name), "{path} is not {name} of the sources");
        }
    }
}

#[test]
fn versions_addresses_and_words_are_the_same_everywhere() {
    let shared = shared();
    let text = |word: &str| shared[word].as_str().expect("a string").to_owned();
    let (version, licence) = (text("version"), text("license"));

    let python = table("tools/python/Cargo.toml");
    for word in ["version", "edition", "rust-version", "license"] {
        assert_eq!(python["package"][word], shared[word], "tools/python/Cargo.toml: {word}");
    }
    for path in ["tools/arrow/Cargo.toml", "tools/sql/Cargo.toml"] {
        for word in ["version", "edition", "license"] {
            assert_eq!(table(path)["package"][word], shared[word], "{path}: {word}");
        }
    }
    let project = table("tools/python/pyproject.toml")["project"].clone();
    assert_eq!(project["license"].as_str(), Some(&*licence));
    assert_eq!(project["keywords"], shared["keywords"]);
    assert_eq!(project["urls"]["Repository"], shared["repository"]);
    assert_eq!(project["urls"]["Homepage"], shared["homepage"]);
    let documentation = project["urls"]["Documentation"].as_str().expect("a string");
    assert!(documentation.starts_with(&text("homepage")), "{documentation}");

    assert_eq!(line(&read("CITATION.cff"), "version:"), version);
    let recipe = read("tools/packages/conda/meta.yaml");
    assert_eq!(line(&recipe, "{% set version ="), format!("{version}\" %}}"));
    assert_eq!(line(&recipe, "license:"), licence);
    assert_eq!(line(&recipe, "home:"), text("homepage"));
    assert_eq!(line(&recipe, "dev_url:"), text("repository"));

    let dependencies = table("Cargo.toml")["workspace"]["dependencies"].clone();
    for (name, dependency) in dependencies.as_table().expect("a table") {
        if dependency.get("path").is_some() {
            assert_eq!(dependency["version"].as_str(), Some(&*version), "{name}");
        }
    }
}

#[test]
fn dependencies_come_from_crates_io() {
    for path in [
        "Cargo.lock",
        "tools/python/Cargo.lock",
        "tools/sql/Cargo.lock",
        "tools/fuzz/Cargo.lock",
        "tests/outside/Cargo.lock",
    ] {
        let lock = table(path);
        let packages = lock["package"].as_array().expect("a list");
        let sources = packages.iter().filter_map(|package| package.get("source")?.as_str());
        let sources: Vec<&str> = sources.collect();
        assert!(sources.len() > 10, "{path}: {} packages", sources.len());
        let index = "registry+https://github.com/rust-lang/crates.io-index";
        assert!(sources.iter().all(|source| *source == index), "{path}: {sources:?}");
    }
}

#[test]
fn one_address_takes_reports() {
    let package = table("Cargo.toml")["package"].clone();
    let maintainer = package["metadata"]["deb"]["maintainer"].as_str().expect("a string");
    let address = maintainer.split(['<', '>']).nth(1).expect("an address");
    assert!(
        read("SECURITY.md").contains(address),
        "SECURITY.md has another address than {address}"
    );
    let private = read(".github/ISSUE_TEMPLATE/config.yml");
    let repository = shared()["repository"].as_str().expect("a string").to_owned();
    assert!(line(&private, "url:").starts_with(&repository), "{private}");
}
