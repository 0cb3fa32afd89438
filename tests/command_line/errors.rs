//! Each error code can be provoked. Its message has a place and help, and the command leaves nothing behind.
//!
//! Why: a script can rely on a code only if the code really occurs, with its exit code.
//! How: one case for each row of the table. Each runs twice, for programs and for people. The folder must be unchanged afterwards.

use std::collections::BTreeSet;

use tetdb::Code;

use super::place::{Place, TETRA, TETRA_INWARD};

/// Codes with a test of their own, in the file named.
const ELSEWHERE: &[(&str, &str)] = &[
    ("damaged", "damage.rs"),
    ("store-format", "damage.rs"),
    ("busy", "crash.rs"),
    ("store-changed", "together.rs"),
    ("store-unfinished", "crash.rs"),
    ("stopped", "crash.rs"),
    ("surface-changed", "below"),
    ("size-field-changed", "size_files.rs"),
    ("no-coarse-leaf", "resaturate.rs"),
    ("nothing-to-undo", "resaturate.rs"),
    ("store-recipe", "tests/front_door"),
    ("no-tasks", "tasks.rs"),
    ("tasks-left", "tasks.rs"),
    ("task-file", "tasks.rs"),
    ("invalid-mesh", "below"),
    ("contradicting-orientation", "walls.rs"),
    ("bad-field", "fields.rs"),
    ("bad-version", "versions.rs"),
    ("not-periodic", "periodic.rs"),
    ("bad-mesh", "import.rs"),
    ("bad-seed", "seeds.rs"),
    ("sheet-outside", "sheets.rs"),
    ("wire-outside", "wires.rs"),
    ("degenerate-edge", "wires.rs"),
    ("duplicate-wire", "wires.rs"),
    ("wire-contact", "wires.rs"),
    ("wire-too-near", "wires.rs"),
];

/// Codes that no test provokes, and the reasons.
const UNPROVOKED: &[(&str, &str)] = &[
    ("internal", "a case that provokes it is a bug to mend"),
    ("surface-too-large", "takes more than four billion triangles"),
    ("unrecovered-triangles", "every surface known to end so has been dealt with"),
    ("disk-full", "takes a disk to fill"),
    ("format-limit", "takes a mesh beyond 32-bit counts"),
];

/// A command that must be refused.
struct Case {
    word: &'static str,
    exit: i32,
    /// Existing files, by name and content.
    files: &'static [(&'static str, &'static str)],
    /// Commands to run before, which must succeed.
    before: &'static [&'static str],
    line: &'static str,
    /// Text that the message or the place must contain.
    names: &'static str,
}

const fn case(word: &'static str, exit: i32, line: &'static str, names: &'static str) -> Case {
    Case { word, exit, files: &[], before: &[], line, names }
}

/// A query to a store of one tetrahedron.
const fn asked(word: &'static str, exit: i32, line: &'static str, names: &'static str) -> Case {
    Case { word, exit, files: &[("a.off", TETRA)], before: &["mesh a.off"], line, names }
}

/// A surface file that `mesh` refuses.
const fn bad_file(
    word: &'static str,
    files: &'static [(&'static str, &'static str)],
    line: &'static str,
    names: &'static str,
) -> Case {
    Case { word, exit: 3, files, before: &[], line, names }
}

const CASES: &[Case] = &[
    case("usage", 2, "mesh sample:box --threads 0 -o x.tetdb", "--threads 0"),
    case("usage", 2, "estimate sample:box --threads 0", "--threads 0"),
    case("usage", 2, "verify a.tetdb --threads 0", "--threads 0"),
    case("usage", 2, "mesh sample:box --no-such-option", "--no-such-option"),
    case("usage", 2, "mesh sample:box sample:knot -o x.tetdb", "sample"),
    case("bad-size", 2, "mesh sample:box,h=0.5 --hsiz 0% -o x.tetdb", "0%"),
    case("bad-size", 2, "mesh sample:box,h=0.5 --hmin 3 --hmax 1 -o x.tetdb", "--hmin"),
    case("bad-size", 2, "mesh sample:box,h=0.5 --size-sphere 1,2,3 -o x.tetdb", "--size-sphere"),
    Case {
        word: "bad-config",
        exit: 2,
        files: &[("bad.toml", "hsize = \"2%\"\n")],
        before: &[],
        line: "mesh sample:box,h=0.5 --config bad.toml -o x.tetdb",
        names: "hsize",
    },
    case("bad-memory", 2, "mesh sample:box,h=0.5 --memory 512 -o x.tetdb", "512"),
    asked("bad-query", 2, "query a.tetdb --box 1,1,1,0,0,0", "--box"),
    asked("bad-query", 2, "query a.tetdb --select id,shape", "shape"),
    asked("bad-query", 2, "query a.tetdb --tet 12", "12"),
    asked("bad-expression", 2, "query a.tetdb --where quality>", "quality>"),
    asked("bad-expression", 2, "query a.tetdb --where quality+1", "compares"),
    asked("no-such-part", 3, "query a.tetdb --tet 0:99", "0:99"),
    asked("no-such-part", 3, "query a.tetdb --ball cut1:7", "cut1:7"),
    asked("no-such-part", 3, "query a.tetdb --label hull", "hull"),
    asked("no-such-part", 3, "query a.tetdb --subdomain 4", "4"),
    asked("unreadable-file", 3, "query a.tetdb --points missing.txt", "missing.txt"),
    asked("unexpected-text", 3, "query a.tetdb --points a.off", "a.off, line 1"),
    asked("unknown-format", 3, "query a.tetdb --region 1 -o a.xyz", "a.xyz"),
    asked("bad-query", 2, "snapshot a.tetdb a.svg --plane 9,9,9,0,0,1", "--plane 9,9,9"),
    asked("bad-query", 2, "snapshot a.tetdb a.svg --size 10x10", "10x10"),
    asked("unknown-format", 3, "snapshot a.tetdb a.gif", "a.gif"),
    case("bad-sample", 2, "mesh sample:bix -o x.tetdb", "bix"),
    case("bad-sample", 2, "mesh sample:box,g=1 -o x.tetdb", "g"),
    case("unreadable-file", 3, "mesh missing.stl -o x.tetdb", "missing.stl"),
    bad_file("unknown-format", &[("a.txt", "hello\n")], "mesh a.txt -o x.tetdb", "a.txt"),
    bad_file(
        "truncated-file",
        &[("cut.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n")],
        "mesh cut.stl -o x.tetdb",
        "cut.stl, line 6",
    ),
    bad_file(
        "unexpected-text",
        &[("a.off", "OFX\n4 4\n")],
        "mesh a.off -o x.tetdb",
        "a.off, line 1",
    ),
    bad_file(
        "not-a-number",
        &[(
            "nan.stl",
            "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 nan 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n",
        )],
        "mesh nan.stl -o x.tetdb",
        "nan.stl, line 5",
    ),
    bad_file(
        "index-out-of-range",
        &[("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n")],
        "mesh a.off -o x.tetdb",
        "a.off, line 6",
    ),
    bad_file(
        "count-mismatch",
        &[("a.off", "OFF\n999999999999 4 0\n0 0 0\n")],
        "mesh a.off -o x.tetdb",
        "a.off, line 2",
    ),
    bad_file(
        "coordinate-range",
        &[("a.off", "OFF\n4 1 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1e300\n3 0 2 3\n")],
        "mesh a.off -o x.tetdb",
        "a.off, line 6",
    ),
    bad_file(
        "unsupported-content",
        &[("a.mesh", "MeshVersionFormatted 2\nDimension 2\nVertices\n1\n0 0 0\nEnd\n")],
        "mesh a.mesh -o x.tetdb",
        "a.mesh, line 2",
    ),
    bad_file("empty-surface", &[("a.stl", "")], "mesh a.stl -o x.tetdb", "a.stl"),
    bad_file(
        "empty-surface",
        &[("a.off", "OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n")],
        "mesh a.off -o x.tetdb",
        "a.off",
    ),
    bad_file(
        "degenerate-triangle",
        &[(
            "a.off",
            "OFF\n4 4 0\n0 0 0\n1 0 0\n2 0 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n",
        )],
        "mesh a.off -o x.tetdb",
        "triangle 0 near (1, 0, 0)",
    ),
    bad_file(
        "duplicate-triangle",
        &[(
            "a.off",
            "OFF\n4 5 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n3 0 2 1\n",
        )],
        "mesh a.off -o x.tetdb",
        "triangles 0 and 4",
    ),
    bad_file(
        "open-surface",
        &[("a.off", "OFF\n4 3 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n")],
        "mesh a.off -o x.tetdb",
        "near (",
    ),
    bad_file(
        "self-intersection",
        &[(
            "a.off",
            "OFF\n8 8 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n.1 .1 .1\n1.1 .1 .1\n.1 1.1 .1\n.1 .1 1.1\n\
             3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n3 4 6 5\n3 4 5 7\n3 5 6 7\n3 4 7 6\n",
        )],
        "mesh a.off -o x.tetdb",
        "triangles 2 and 4",
    ),
    bad_file(
        "nothing-filled",
        &[("a.off", TETRA_INWARD)],
        "mesh a.off --regions by-orientation -o x.tetdb",
        "by-orientation",
    ),
    case("lossy-format", 3, "sample knot,h=0.3 -o a.stlb", "a.stlb"),
    case("no-such-store", 3, "info missing.tetdb", "missing.tetdb"),
    case("memory", 6, "mesh sample:box,h=0.5 --memory 5MiB -o x.tetdb", "5MiB"),
    case(
        "no-room",
        6,
        "mesh sample:box,h=0.5 --size-sphere 0.5,0.5,0.5,0.2,0.0001 -o x.tetdb",
        "3.5",
    ),
    Case {
        word: "io",
        exit: 6,
        files: &[("file", "")],
        before: &[],
        line: "mesh sample:box,h=0.5 -o file/x.tetdb",
        names: "file/x.tetdb",
    },
    Case {
        word: "store-exists",
        exit: 8,
        files: &[("a.off", TETRA)],
        before: &["mesh a.off"],
        line: "mesh a.off --hsiz 0.3",
        names: "a.tetdb",
    },
    Case {
        word: "not-a-store",
        exit: 8,
        files: &[("file", "")],
        before: &[],
        line: "mesh sample:box,h=0.5 -o file",
        names: "file",
    },
];

#[test]
fn each_case_ends_with_its_word() {
    for case in CASES {
        let place = Place::new();
        for (name, content) in case.files {
            place.write(name, content);
        }
        for line in case.before {
            place.run_line(line).succeeds();
        }
        let names = place.names();

        let done = place.run_line(&format!("{} --json", case.line));
        let error = done.error();
        let said = format!("`tetdb {}` said {error}", case.line);
        assert_eq!(
            (error["code"].as_str(), done.exit()),
            (Some(case.word), Some(case.exit)),
            "{said}"
        );
        assert_eq!(error["exit"].as_i64(), Some(i64::from(case.exit)), "{said}");
        assert!(error["help"].as_str().is_some_and(|h| !h.is_empty()), "{said}");
        let found = [&error["message"], &error["where"]]
            .iter()
            .any(|text| text.as_str().is_some_and(|t| t.contains(case.names)));
        assert!(found, "{said}, which does not name {}", case.names);
        assert_eq!(place.names(), names, "{said} and left something behind");

        let done = place.run_line(case.line);
        let text = done.stderr();
        assert!(
            text.contains(&format!("error[{}]: ", case.word)) && text.contains("help: "),
            "{text}"
        );
        assert_eq!(done.exit(), Some(case.exit), "{text}");
        assert_eq!(place.names(), names, "`tetdb {}` left something behind", case.line);
        helps_can_be_pasted(&place, error["help"].as_str().unwrap_or_default());
    }
}

/// Options in the commands of a help text must exist.
fn helps_can_be_pasted(place: &Place, help: &str) {
    for command in help.split('`').skip(1).step_by(2).filter(|c| c.starts_with("tetdb ")) {
        let mut words = command.split_whitespace().skip(1);
        let name = words.next().filter(|w| !w.starts_with('-'));
        let page = place.run(&[name.unwrap_or("help"), "--help"]).succeeds().stdout();
        for option in words.filter(|w| w.starts_with("--") && *w != "--help") {
            assert!(
                page.contains(option),
                "{help:?} names an option `tetdb {name:?}` does not have"
            );
        }
    }
}

#[test]
fn a_changed_surface_is_noticed() {
    let place = Place::new();
    place.write("a.off", TETRA);
    place.run_line("mesh a.off").succeeds();
    place.write("a.off", TETRA.replace("0 0 1\n3", "0 0 2\n3"));
    let done = place.run_line("verify a.tetdb --json");
    let error = done.error();
    assert_eq!(
        (error["code"].as_str(), done.exit()),
        (Some("surface-changed"), Some(8)),
        "{error}"
    );
    assert!(error["where"].as_str().is_some_and(|w| w.ends_with("a.off")), "{error}");
}

#[test]
fn another_surfaces_mesh_is_invalid() {
    let place = Place::new();
    place.write("a.off", TETRA);
    place.run_line("mesh a.off").succeeds();
    let done = place.run_line("verify a.tetdb --against sample:box,h=0.5");
    assert_eq!(done.exit(), Some(7), "{}", done.stderr());
    assert!(done.stderr().contains("error[invalid-mesh]: a.tetdb"), "{}", done.stderr());
    // For programs, this result is an answer and not an error.
    let done = place.run_line("verify a.tetdb --against sample:box,h=0.5 --json");
    let report = done.json();
    assert_eq!((done.exit(), &report["valid"]), (Some(7), &false.into()));
    assert!(report["triangles_missing"].as_u64() > Some(0), "{report}");
}

#[test]
fn check_lists_defects_and_exits_3() {
    let place = Place::new();
    place.write("open.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    let done = place.run_line("check open.off --json");
    let answer = done.json();
    assert_eq!(
        (done.exit(), answer["valid"].as_bool(), answer["n_defects"].as_u64()),
        (Some(3), Some(false), Some(3)),
        "{answer}"
    );
    assert!(Code::ALL.iter().any(|code| answer["defects"][0]["code"] == code.as_str()), "{answer}");
    place.write("closed.off", TETRA);
    assert_eq!(place.run_line("check closed.off").exit(), Some(0));
}

#[test]
fn every_word_of_the_table_has_a_case_or_a_reason() {
    let mut covered: BTreeSet<&str> = CASES.iter().map(|c| c.word).collect();
    covered.extend(ELSEWHERE.iter().map(|(word, _)| *word));
    let without: Vec<&str> = Code::ALL
        .iter()
        .map(|code| code.as_str())
        .filter(|code| !covered.contains(code) && !UNPROVOKED.iter().any(|(word, _)| word == code))
        .collect();
    assert!(without.is_empty(), "no case provokes {without:?}");
}

#[test]
fn the_table_agrees_with_the_cases() {
    for case in CASES {
        let code = case.word.parse::<Code>().ok();
        assert_eq!(code.map(|code| i32::from(code.exit())), Some(case.exit), "{}", case.word);
    }
}

/// What a command refuses names a way out.
#[test]
fn a_refusal_says_what_to_do() {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.3 -o b.tetdb --no-verify").succeeds();
    let refused = |line: &str, exit: i32, words: &str| {
        let done = place.run_line(line);
        assert_eq!(done.exit(), Some(exit), "{line}: {}", done.stderr());
        assert!(done.stderr().contains(words), "{line}: {}", done.stderr());
    };
    refused("mesh sample:box,h=0.3 -o c.tetdb --subdomains 0", 2, "give 1 or more");
    refused("mesh sample:box,h=0.3 -o c.tetdb --threads 4000", 2, "--threads 4000");
    refused("verify b.tetdb --threads 4000", 2, "--threads 4000");
    refused("field b.tetdb drop nix", 3, "add a field to the store first");
    refused("field b.tetdb add a --at vertices --from 1,2", 3, "3 are a vector");
    refused("adapt b.tetdb --field nix", 2, "--factor");
    refused("periodic b.tetdb x-low=x-high --drop", 3, "there is nothing to drop");
    refused("work b.tetdb --task 1", 8, "is finished: no task is left");
    for name in ["..", ".", ".hidden", "a/b"] {
        refused(&format!("version b.tetdb save {name}"), 3, "no . at the beginning");
    }
    place.run_line("field b.tetdb add u --at tets --from x").succeeds();
    place.run_line("periodic b.tetdb y-low=y-high").succeeds();
    refused("field b.tetdb drop nix", 3, "take the name of one that is there");
    refused("periodic b.tetdb x-low=x-high --drop", 3, "there are y-low=y-high");
    // Crossings are resolved, and the holes remain.
    let holes = "mesh sample:broken,kind=holes -o c.tetdb --repair resolve";
    refused(holes, 3, "triangles are counted in the repaired surface");
    std::fs::create_dir(place.path("d.tetdb")).expect("a folder");
    place.write("d.tetdb/catalog.redb-new", "");
    refused("resume d.tetdb", 8, "there is nothing to go on with");
}
