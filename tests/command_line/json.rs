//! The guide's chapter on scripting lists exactly the keys of the JSON answers.
//!
//! Why: scripts are written from that page.
//! How: the commands of each section run. The keys of their answers, over all runs of a section, must be those of its tables.

use std::collections::BTreeSet;

use serde_json::Value;

use super::place::Place;

const PAGE: &str = include_str!("../../src/guide/scripting.md");
/// Keys below these may have any name.
const FREE: [&str; 5] =
    ["options", "subdomains[].sizes.options", "findings", "measures.chunks", "qualities"];

/// The commands of each section, in order. The surfaces are written first.
const RUNS: [(&str, &[&str]); 23] = [
    ("sample", &["sample box,h=0.045 -o box.stl", "sample sphere,h=0.2 -o sphere.stl"]),
    (
        "check",
        &[
            "check sphere.stl",
            "check holes.off --write-bad bad.vtu",
            "check crossing.off",
            "check groups.msh",
            "check needles.off",
            "check sample:broken,kind=crossings",
            "check sample:broken,kind=crossings --repair=resolve --write r.off",
            "check sample:broken,kind=holes",
            "check sample:broken,kind=holes --repair=winding --write w.off",
            "check sample:broken,kind=soup --repair=wrap --write s.off",
            "check holes.off --repair --weld 1e-3 --write fixed.off",
        ],
    ),
    ("estimate", &["estimate box.stl --subdomains 2 --memory 256MiB --workers 4"]),
    (
        "info",
        &[
            "mesh box.stl -o a.tetdb --subdomains 2 --keep-stages --memory 256MiB",
            "resume a.tetdb",
            "mesh sample:wells,count=1,points=1 -o wells.tetdb",
            "mesh groups.msh -o groups.tetdb",
            "mesh box.stl -o t.tetdb --subdomains 2 --coarse-only --memory 256MiB",
        ],
    ),
    ("plan", &["plan t.tetdb --tasks 2"]),
    ("work", &["work t.tetdb --task 1"]),
    ("gather", &["gather t.tetdb"]),
    ("digest", &["digest a.tetdb"]),
    ("verify", &["verify a.tetdb --full", "verify a.tetdb --against sphere.stl"]),
    ("compare", &["compare a.tetdb a.tetdb"]),
    ("export", &["export a.tetdb a.vtu a.npy", "export a.tetdb a.json"]),
    ("refine-surface", &["refine-surface sphere.stl fine.stl --hsiz 0.1"]),
    ("remesh-surface", &["remesh-surface sphere.stl even.stl --tolerance 1%"]),
    ("wrap", &["wrap sphere.stl -o wrap.stl --gap 10%"]),
    (
        "query",
        &[
            "query a.tetdb --point 0.1,0.2,0.3 --point 7,7,7",
            "query a.tetdb --tet 0:5",
            "query a.tetdb --tet 0:5 --select id,x,y,z,edge_min,edge_max,angle_min,angle_max,excess",
        ],
    ),
    (
        "field",
        &[
            "field a.tetdb add T --at vertices --from x",
            "field a.tetdb list",
            "field a.tetdb drop T",
            "field a.tetdb add q --at tets --from x",
            "field a.tetdb add w --at vertices --from x*x*x",
        ],
    ),
    ("transfer", &["transfer a.tetdb wells.tetdb"]),
    (
        "adapt",
        &[
            "adapt a.tetdb --field w --factor 0.9 --dry-run",
            "adapt a.tetdb --field w --factor 1.5 --change 1.01",
        ],
    ),
    ("snapshot", &["snapshot a.tetdb a.svg"]),
    ("report", &["report a.tetdb a.html"]),
    (
        "resaturate",
        &[
            "resaturate a.tetdb --subdomain 1 --refine-by 0.9 --dry-run",
            "resaturate a.tetdb --subdomain 1 --refine-by 0.9",
            "info a.tetdb --excess",
            "resaturate a.tetdb --undo",
            "resaturate a.tetdb --repair --subdomain 0",
            "resaturate a.tetdb --forget",
        ],
    ),
    ("periodic", &["periodic a.tetdb x-low=x-high", "periodic a.tetdb"]),
    (
        "version",
        &[
            "version a.tetdb save one --note first",
            "version a.tetdb list",
            "version a.tetdb show one",
            "info a.tetdb",
            "resaturate a.tetdb --subdomain 1 --refine-by 0.9 --no-verify",
            "field a.tetdb drop q",
            "field a.tetdb add r --at tets --from y",
            "version a.tetdb diff one now",
            "version a.tetdb restore one",
            "version a.tetdb save two --keep 1",
            "version a.tetdb drop two",
        ],
    ),
];

/// An open surface with a repeated triangle and a vertex on an edge.
const HOLES: &str = "OFF\n9 8 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n0.5 0.5 0.5\n0.5 0 0\n0.5 0 0\n\
    3 0 1 2\n3 0 2 3\n3 0 1 5\n3 0 1 5\n3 0 5 4\n3 0 1 7\n3 3 6 2\n3 2 5 0\n";
/// Two tetrahedra that cross, and a triangle with an edge that its neighbor has in two pieces.
const CROSSING: &str = "OFF\n13 11 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0.1 0.1 0.1\n2 0.1 0.1\n0.1 2 0.1\n0.1 0.1 2\n\
    5 0 0\n7 0 0\n6 1 0\n6 0 0\n6 -1 0\n\
    3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n3 4 6 5\n3 4 5 7\n3 4 7 6\n3 5 6 7\n3 8 9 10\n3 11 8 12\n3 9 11 12\n";

/// The documented keys of each section; those of `info` also under other names.
fn documented(section: &str) -> BTreeSet<String> {
    let mut inside = false;
    let mut keys = BTreeSet::new();
    for line in PAGE.lines() {
        if let Some(title) = line.strip_prefix("## ") {
            inside = title.starts_with(&format!("`tetdb {section}`")) || title.starts_with(section);
        }
        let Some(row) = line.strip_prefix("| `").filter(|_| inside) else {
            continue;
        };
        let cell = row.split(" |").next().unwrap_or_default();
        keys.extend(cell.trim_matches('`').split("`, `").map(str::to_owned));
    }
    assert!(!keys.is_empty(), "the chapter says nothing of {section}");
    keys
}

/// Collects the keys of a value; the keys below [`FREE`] count as one.
fn collect(value: &Value, key: &str, keys: &mut BTreeSet<String>) {
    match value {
        Value::Object(object) if FREE.contains(&key) => {
            if !object.is_empty() {
                keys.insert(format!("{key}.*"));
            }
        }
        Value::Object(object) => {
            for (name, value) in object {
                let key = match key {
                    "" => name.clone(),
                    above => format!("{above}.{name}"),
                };
                collect(value, &key, keys);
            }
        }
        Value::Array(list) => {
            for value in list {
                collect(value, &format!("{key}[]"), keys);
            }
        }
        _ => {
            keys.insert(key.to_owned());
        }
    }
}

/// Removes keys from `found` that are documented only by their parts: a null in place of an object or list has no parts.
fn settle(found: &mut BTreeSet<String>, named: &BTreeSet<String>) {
    found.retain(|key| {
        let parts = [format!("{key}."), format!("{key}[")];
        named.contains(key) || !named.iter().any(|t| parts.iter().any(|p| t.starts_with(p)))
    });
}
/// A cube with one corner doubled, 1e-5 of an edge apart.
pub const NEEDLES: &str = "OFF\n9 14 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n1e-5 0 1\n\
    3 0 2 1\n3 0 3 2\n3 4 8 6\n3 8 5 6\n3 4 6 7\n3 0 1 5\n3 0 5 8\n3 0 8 4\n\
    3 1 2 6\n3 1 6 5\n3 2 3 7\n3 2 7 6\n3 3 0 4\n3 3 4 7\n";

#[test]
fn every_key_is_documented_and_no_other() {
    let place = Place::new();
    place.write("holes.off", HOLES);
    place.write("crossing.off", CROSSING);
    place.write("needles.off", NEEDLES);
    place.write("groups.msh", super::groups::msh22());
    let talk = documented("stderr");
    let (mut said, mut of_info) = (BTreeSet::new(), BTreeSet::new());
    for (section, lines) in RUNS {
        let mut found = BTreeSet::new();
        for line in lines {
            let done = place.run_line(&format!("{line} --json"));
            assert!(matches!(done.exit(), Some(0 | 3 | 7)), "{line}: {}", done.stderr());
            // Between versions, the store is changed by other commands.
            let is_asked = line.starts_with(section) || line.starts_with("info");
            let is_other = section == "version" && !is_asked;
            for answer in done.stdout().lines().filter(|_| !is_other) {
                let value: Value = serde_json::from_str(answer).expect("an object a line");
                let into = match line.starts_with("info") || section == "info" {
                    true => &mut of_info,
                    false => &mut found,
                };
                collect(&value, "", into);
            }
            for line in done.stderr().lines() {
                let value: Value = serde_json::from_str(line).expect("an object a line");
                collect(&value, "", &mut said);
            }
        }
        if section != "info" {
            same(section, found);
        }
    }
    same("info", of_info);
    let failed = place.run_line("info nothing.tetdb --json").stderr();
    for line in failed.lines() {
        let value: Value = serde_json::from_str(line).expect("an object a line");
        collect(&value, "", &mut said);
    }
    // Only long runs print a line of progress. Its keys have a test of their own.
    settle(&mut said, &talk);
    let unnamed: Vec<&String> = said.difference(&talk).collect();
    assert!(unnamed.is_empty(), "keys on stderr that the chapter does not name: {unnamed:?}");
    let unsaid = talk.difference(&said).filter(|k| !k.starts_with("progress"));
    assert_eq!(unsaid.collect::<Vec<_>>(), Vec::<&String>::new());
}

fn same(section: &str, mut found: BTreeSet<String>) {
    let named = documented(section);
    settle(&mut found, &named);
    let unnamed: Vec<&String> = found.difference(&named).collect();
    let missing: Vec<&String> = named.difference(&found).collect();
    assert!(
        unnamed.is_empty() && missing.is_empty(),
        "{section}: the chapter does not name {unnamed:?}, and names {missing:?}, which no run answered"
    );
}

/// Every command with `--json` has a section.
#[test]
fn every_command_has_a_section() {
    let help = Place::new().run(&["--help"]).succeeds().stdout();
    let commands = help.lines().skip_while(|l| *l != "Commands:").skip(1);
    for line in commands.take_while(|l| !l.is_empty()) {
        let name = line.split_whitespace().next().unwrap_or_default();
        let is_silent = ["help", "completions", "man"].contains(&name);
        let is_named = PAGE.contains(&format!("## `tetdb {name}`"))
            || ["import", "mesh", "resume"].contains(&name) && PAGE.contains(&format!("`{name}`"));
        assert!(is_silent || is_named, "the chapter has no section on {name}");
    }
}
