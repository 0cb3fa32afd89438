//! `version`: states of a store under names, read with `--at-version`.
//!
//! Why: a version that is not what was saved, or that keeps too much or too little on disk, is worse than a copy of the folder.
//! How: digests and values of before and after are compared through every command that reads; files are counted; kills come at any time.
//! `tools/tests/versions.rs` kills each step before every change of the disk.

use std::collections::BTreeSet;

use serde_json::Value;

use super::fields::fields;
use super::place::Place;

/// `a.tetdb` in two sub-domains with a field, saved as `base`; then the second one is meshed again. Digests of before and after.
fn made() -> (Place, String, String) {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.045 -o a.tetdb --subdomains 2 --no-verify").succeeds();
    place.run_line("field a.tetdb add T --at vertices --from x+2*y").succeeds();
    let old = place.digest("a.tetdb");
    place.run_line("version a.tetdb save base --note first").succeeds();
    place.run_line("resaturate a.tetdb --subdomain 1 --refine-by 0.8 --no-verify").succeeds();
    let new = place.digest("a.tetdb");
    assert_ne!(old, new);
    (place, old, new)
}

fn list(place: &Place) -> Vec<Value> {
    let answer = place.run_line("version a.tetdb list --json").succeeds().json();
    answer["versions"].as_array().expect("a list").clone()
}

/// Files of sub-domains and of fields, and their bytes.
fn files(place: &Place) -> (BTreeSet<String>, u64) {
    let is_kept = |name: &String| name.contains("/subdomain-") || name.contains("/field-");
    let names: BTreeSet<String> = place.names().into_iter().filter(is_kept).collect();
    let bytes =
        names.iter().map(|name| std::fs::metadata(place.path(name)).expect("it is there").len());
    let sum = bytes.sum();
    (names, sum)
}

#[test]
fn every_command_that_reads_reads_a_version() {
    let (place, old, new) = made();
    let at = |line: &str| place.run_line(&format!("{line} --at-version base")).succeeds();
    assert_eq!(at("digest a.tetdb").stdout().trim(), old);
    assert_eq!(at("info a.tetdb --json").json()["digest"], *old);
    assert_eq!(at("verify a.tetdb --full --json").json()["valid"], true);
    let tets = |line: &str| at(line).stdout().lines().count();
    assert!(
        tets("query a.tetdb --csv --where T>1")
            < place.run_line("query a.tetdb --csv --where T>1").succeeds().stdout().lines().count()
    );
    at("export a.tetdb old.mesh");
    place.run_line("export a.tetdb new.mesh").succeeds();
    let bytes = |name: &str| std::fs::read(place.path(name)).expect("it is there").len();
    assert!(bytes("old.mesh") < bytes("new.mesh"));
    for line in
        ["snapshot a.tetdb a.svg --color T", "report a.tetdb a.html", "info a.tetdb --excess"]
    {
        at(line);
    }
    // The first mesh of a comparison, and the store that fields come from.
    let compared = place.run_line("compare a.tetdb a.tetdb --at-version base --json").json();
    assert_eq!(
        (&compared["same"], &compared["digests"]),
        (&false.into(), &serde_json::json!([old, new]))
    );
    place.run_line("mesh sample:box,h=0.1 -o b.tetdb --no-verify").succeeds();
    place.run_line("transfer a.tetdb b.tetdb --at-version base").succeeds();
    assert_eq!(fields(&place, "b.tetdb")[0]["name"], "T");
    // A field added later is not part of the version, and its range is that of the version.
    let then = at("field a.tetdb list --json").json()["fields"].clone();
    place.run_line("field a.tetdb add later --at tets --from quality").succeeds();
    assert_eq!(fields(&place, "a.tetdb").len(), 2);
    assert_eq!(at("field a.tetdb list --json").json()["fields"], then);
    assert_ne!(then[0]["values"], fields(&place, "a.tetdb")[0]["values"]);
    assert!(at("field a.tetdb list").stdout().starts_with("T: f64 at vertices, "));
    // Both meshes have one sub-domain in common.
    let diff = place.run_line("version a.tetdb diff base now --json");
    assert_eq!(diff.exit(), Some(7));
    let diff = diff.json();
    let changed: Vec<bool> = (diff["subdomains"].as_array().expect("a list").iter())
        .filter_map(|part| part["changed"].as_bool())
        .collect();
    assert_eq!(changed, [false, true]);
    assert_eq!(diff["qualities"]["first"]["all"]["tets"], diff["subdomains"][1]["tets"][0]);
    place.run_line("version a.tetdb diff base base").succeeds();
    place.run_line("resaturate a.tetdb --subdomain 0 --refine-by 0.8 --no-verify").succeeds();
    let whole = place.run_line("version a.tetdb diff base now --json").json()["qualities"].clone();
    let compared = place.run_line("compare a.tetdb a.tetdb --at-version base --json").json();
    for key in ["first", "second", "digests", "same"] {
        assert_eq!(whole[key], compared[key], "{key}");
    }
}

#[test]
fn a_version_keeps_what_later_changes_replace_and_no_more() {
    let (place, old, new) = made();
    // Undoing the change needs the same files.
    assert_eq!(list(&place)[0]["bytes"], 0);
    let (all, bytes) = files(&place);
    place.run_line("resaturate a.tetdb --forget").succeeds();
    assert_eq!(files(&place).0, all);
    let own = list(&place)[0]["bytes"].as_u64().expect("a number");
    let info = place.run_line("info a.tetdb --json").succeeds().json();
    assert_eq!((info["version_bytes"].as_u64(), &info["versions"][0]), (Some(own), &"base".into()));
    place.run_line("verify a.tetdb --full").succeeds();
    // What the store and another version have costs nothing.
    place.run_line("version a.tetdb save fine").succeeds();
    place.run_line("field a.tetdb add late --at tets --from 1").succeeds();
    place.run_line("field a.tetdb drop T").succeeds();
    assert_eq!(fields(&place, "a.tetdb")[0]["name"], "late");
    place.run_line("version a.tetdb restore base").succeeds();
    assert_eq!((place.digest("a.tetdb"), fields(&place, "a.tetdb").len()), (old, 1));
    assert_eq!(fields(&place, "a.tetdb")[0]["name"], "T");
    place.run_line("query a.tetdb --where T>1 --limit 1").succeeds();
    place.run_line("resaturate a.tetdb --undo").succeeds();
    assert_eq!((place.digest("a.tetdb"), fields(&place, "a.tetdb").len()), (new, 1));
    assert_eq!(fields(&place, "a.tetdb")[0]["name"], "late");
    // A field of no version is not lost by undoing.
    place.run_line("version a.tetdb restore base --no-verify").succeeds();
    place.run_line("field a.tetdb add lost --at tets --from 1").succeeds();
    let refused = place.run_line("resaturate a.tetdb --undo --json");
    assert_eq!(refused.error()["code"], "bad-field");
    place.run_line("field a.tetdb drop lost").succeeds();
    place.run_line("resaturate a.tetdb --undo --no-verify").succeeds();
    place.run_line("field a.tetdb drop late").succeeds();
    let dropped = place.run_line("version a.tetdb drop base --json").succeeds().json();
    // The values of T in the sub-domain that is the same stay with the other version.
    assert_eq!(dropped["bytes"].as_u64(), Some(own));
    assert_eq!(files(&place).1, bytes - own);
    place.run_line("version a.tetdb drop fine").succeeds();
    assert_eq!(files(&place).0.len(), 2);
    place.run_line("verify a.tetdb --full").succeeds();
}

#[test]
fn a_damaged_file_is_repaired_for_versions_too() {
    let (place, old, _) = made();
    let name = files(&place).0.into_iter().find(|name| name.contains("subdomain-00000"));
    let path = place.path(&name.expect("it is there"));
    let mut bytes = std::fs::read(&path).expect("it can be read");
    let middle = bytes.len() / 2;
    bytes[middle..middle + 4096].fill(7);
    std::fs::write(&path, bytes).expect("it can be written");
    for line in ["verify a.tetdb", "verify a.tetdb --at-version base"] {
        assert_eq!(place.run_line(line).exit(), Some(4), "{line}");
    }
    place.run_line("resaturate a.tetdb --repair").succeeds();
    assert!(!path.exists());
    place.run_line("verify a.tetdb --full").succeeds();
    place.run_line("verify a.tetdb --full --at-version base").succeeds();
    place.run_line("version a.tetdb restore base").succeeds();
    assert_eq!(place.digest("a.tetdb"), old);
    // Damage of what only a version has is found and named.
    place.run_line("resaturate a.tetdb --undo --no-verify").succeeds();
    place.run_line("resaturate a.tetdb --forget").succeeds();
    let now = place.run_line("info a.tetdb --json").succeeds().json();
    // The one of now has a number of more digits, and comes first.
    let name = files(&place).0.into_iter().rfind(|name| name.contains("subdomain-00001"));
    let path = place.path(&name.expect("it is there"));
    let mut bytes = std::fs::read(&path).expect("it can be read");
    let middle = bytes.len() / 2;
    bytes[middle..middle + 4096].fill(7);
    std::fs::write(&path, bytes).expect("it can be written");
    let found = place.run_line("verify a.tetdb --json");
    assert_eq!((found.exit(), &found.error()["code"]), (Some(4), &"damaged".into()));
    assert!(found.stderr().contains("subdomain-00001"), "{}", found.stderr());
    place.run_line("version a.tetdb drop base").succeeds();
    place.run_line("verify a.tetdb").succeeds();
    assert_eq!(place.digest("a.tetdb"), now["digest"].as_str().expect("text"));
}

#[test]
fn what_makes_no_sense_is_refused() {
    let (place, _, new) = made();
    place.run_line("mesh sample:box,h=0.045 -o u.tetdb --subdomains 2 --coarse-only").succeeds();
    for (line, code, exit) in [
        ("version a.tetdb save base", "bad-version", 3),
        ("version a.tetdb save now", "bad-version", 3),
        ("version a.tetdb save a/b", "bad-version", 3),
        ("version a.tetdb save x --keep 0", "usage", 2),
        ("version a.tetdb restore other", "no-such-part", 3),
        ("version a.tetdb drop other", "no-such-part", 3),
        ("version a.tetdb show other", "no-such-part", 3),
        ("version a.tetdb diff base other", "no-such-part", 3),
        ("digest a.tetdb --at-version other", "no-such-part", 3),
        ("info a.tetdb --at-version other", "no-such-part", 3),
        ("field a.tetdb list --at-version other", "no-such-part", 3),
        ("version u.tetdb save x", "store-unfinished", 8),
        ("version b.tetdb save x", "no-such-store", 3),
    ] {
        let done = place.run_line(&format!("{line} --json"));
        assert_eq!((done.exit(), &done.error()["code"]), (Some(exit), &code.into()), "{line}");
    }
    for name in ["b", "c", "d"] {
        place.run_line(&format!("version a.tetdb save {name}")).succeeds();
    }
    let saved = place.run_line("version a.tetdb save e --keep 3 --json").succeeds().json();
    assert_eq!(saved["dropped"], serde_json::json!(["base", "b"]));
    let names: Vec<Value> =
        list(&place).into_iter().map(|version| version["name"].clone()).collect();
    assert_eq!(names, ["c", "d", "e"]);
    assert_eq!(place.digest("a.tetdb"), new);
}

/// An undo deletes the present mesh, so the previous one is read first.
#[test]
fn what_is_damaged_does_not_come_back() {
    for kind in ["/subdomain-00001-", "/field-00001-"] {
        damaged_stays_away(kind);
    }
}

fn damaged_stays_away(kind: &str) {
    let (place, _, new) = made();
    let generation = |name: &String| {
        let digits = name.rsplit_once("-g").and_then(|(_, end)| end.strip_suffix(".redb"));
        digits.and_then(|digits| digits.parse::<u32>().ok()).expect("a generation")
    };
    let both = files(&place).0.into_iter().filter(|name| name.contains(kind));
    let path = place.path(&both.min_by_key(generation).expect("two files"));
    let mut bytes = std::fs::read(&path).expect("readable");
    let n = bytes.len();
    bytes[(8 * 4096).min(n / 4)..(12 * 4096).min(n * 3 / 4)].fill(0x5A);
    std::fs::write(&path, bytes).expect("writable");
    for line in ["version a.tetdb restore base", "resaturate a.tetdb --undo"] {
        let done = place.run_line(line);
        assert_eq!(done.exit(), Some(4), "{}", done.stderr());
        assert!(done.stderr().contains("nothing was changed"), "{}", done.stderr());
        assert!(!done.stderr().contains("internal error"), "{}", done.stderr());
        assert_eq!(place.digest("a.tetdb"), new);
        place.run_line("query a.tetdb --where quality>1 --csv").succeeds();
    }
}

#[test]
fn kills_leave_versions_whole() {
    let (place, old, new) = made();
    place.run_line("version a.tetdb save fine").succeeds();
    let words = |line: &str| line.split(' ').map(str::to_owned).collect::<Vec<_>>();
    let mut n_killed = 0;
    for i in 0..24u64 {
        let line = match i % 4 {
            0 => "version a.tetdb save extra",
            1 => "version a.tetdb restore base --no-verify",
            2 => "version a.tetdb restore fine --no-verify",
            _ => "version a.tetdb drop extra",
        };
        let words = words(line);
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let mut child = place.command(&words).spawn().expect("the program starts");
        std::thread::sleep(std::time::Duration::from_millis(2 + 3 * (i % 7)));
        let _ = child.kill();
        n_killed += usize::from(child.wait().expect("it ends").code().is_none());
        let at = |name: &str| {
            let line = format!("digest a.tetdb --at-version {name}");
            place.run_line(&line).succeeds().stdout().trim().to_owned()
        };
        assert_eq!((at("base"), at("fine")), (old.clone(), new.clone()));
        assert!([&old, &new].contains(&&place.digest("a.tetdb")));
    }
    assert!(n_killed > 4, "{n_killed}");
    for line in
        ["verify a.tetdb", "verify a.tetdb --at-version base", "verify a.tetdb --at-version fine"]
    {
        place.run_line(line).succeeds();
    }
}
