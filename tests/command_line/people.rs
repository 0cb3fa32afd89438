//! The output of the program for people: unprompted, during a run and at the end.
//!
//! Why: a summary that hides the box of a part, or a hint that leads nowhere, costs a user an hour.
//! How: small parts are checked, meshed and queried, and the output is compared with what a person would look for.

use super::place::{Place, TETRA};

/// All output of a command.
fn said(place: &Place, line: &str) -> String {
    let done = place.run_line(line).succeeds();
    done.stdout() + &done.stderr()
}

#[test]
fn box_and_labels_are_named_by_check_and_info() {
    let place = Place::new();
    place.write("part.off", TETRA);
    place.run_line("mesh part.off").succeeds();
    for command in ["check part.off", "info part.tetdb"] {
        let said = said(&place, command);
        assert!(said.contains("box (0, 0, 0) to (1, 1, 1)"), "{said}");
        assert!(said.contains("labels: part"), "{said}");
    }
}

#[test]
fn numbers_have_four_digits_and_ones_no_plural() {
    let place = Place::new();
    place.write("part.off", TETRA);
    let said = said(&place, "mesh part.off --size-sphere 0,0,0,0.1,0.3 --hsiz 0.123456");
    assert!(said.contains("1 shape,") && said.contains("in 1 sub-domain;"), "{said}");
    for bad in ["(s)", "0.0000", "100.0000", "e0 ", "e0,", "bytes per tetrahedron", "1 shapes"] {
        assert!(!said.contains(bad), "{bad:?} in {said}");
    }
}

#[test]
fn internals_are_for_those_who_ask_and_quiet_is_quiet() {
    let place = Place::new();
    place.write("part.off", TETRA);
    let usual = said(&place, "mesh part.off -o a.tetdb");
    assert!(!usual.contains("catalog,"), "{usual}");
    assert!(usual.contains("`tetdb report a.tetdb a.html`"), "{usual}");
    assert!(usual.contains("`tetdb export a.tetdb"), "{usual}");
    let more = said(&place, "mesh part.off -o b.tetdb --verbose");
    assert!(more.contains("catalog,") && more.contains("coarse mesh"), "{more}");
    for quiet in [
        "mesh part.off -o c.tetdb --quiet",
        "resaturate c.tetdb --subdomain 0 --refine-by 0.5 --quiet",
        "resaturate c.tetdb --undo --quiet",
        "resaturate c.tetdb --forget --quiet",
    ] {
        assert_eq!(said(&place, quiet), "", "{quiet}");
    }
}

#[test]
fn a_mesh_file_named_as_the_store_is_sent_to_export() {
    let place = Place::new();
    place.write("part.off", TETRA);
    let error = place.run_line("mesh part.off -o part.vtu --json").error();
    assert_eq!(error["code"], "usage");
    assert!(error["help"].to_string().contains("--export part.vtu"), "{error}");
    assert!(!place.path("part.vtu").exists());
}

#[test]
fn rows_of_all_tetrahedra_are_exported_as_a_question_about_all_answers_them() {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.5 -o b.tetdb --no-verify").succeeds();
    for (format, option) in [("csv", "--csv"), ("jsonl", "--json")] {
        let rows = |line: &str| place.run_line(line).succeeds().stdout();
        let exported = rows(&format!("export b.tetdb - --format {format}"));
        assert_eq!(exported, rows(&format!("query b.tetdb {option}")));
        for command in ["export b.tetdb a", "query b.tetdb -o b"] {
            place.run_line(&format!("{command}.{format}")).succeeds();
        }
        let [a, b] = ["a", "b"].map(|name| std::fs::read(place.path(&format!("{name}.{format}"))));
        assert_eq!(a.expect("exported"), b.expect("answered"));
    }
    for line in ["a.csv a.vtu", "a.csv --pieces", "- --format csv --order 2"] {
        let done = place.run_line(&format!("export b.tetdb {line} --json"));
        assert_eq!(done.error()["code"], "usage", "{line}");
    }
}

#[test]
fn solid_models_get_advice() {
    let place = Place::new();
    place.write("part.step", "ISO-10303-21;\nHEADER;\n");
    place.write("part", "ISO-10303-21;\nHEADER;\n");
    place.write("part.igs", "S 1\n");
    for name in ["part.step", "part", "part.igs"] {
        let error = place.run(&["check", name, "--json"]).error();
        assert_eq!(error["code"], "unknown-format", "{error}");
        assert!(error["help"].to_string().contains("gmsh -2"), "{error}");
    }
}

#[test]
fn negative_numbers_reach_the_option_before_them() {
    let place = Place::new();
    place.write("part.off", TETRA);
    let error = place.run_line("mesh part.off --hsiz -1 --json").error();
    assert_eq!(error["code"], "bad-size");
    let message = error["message"].to_string();
    assert!(message.contains("--hsiz -1") && message.contains("above zero"), "{message}");
    let error = place.run_line("check part.off -1 --json").error();
    assert!(error["message"].to_string().contains("negative number"), "{error}");
    for apart in ["0.1 0.2 0.3", "-0.1 -0.2 -0.3"] {
        let error = place.run_line(&format!("query part.tetdb --point {apart} --json")).error();
        assert!(error["help"].to_string().contains("with commas"), "{error}");
    }
}

#[test]
fn numbers_of_a_configuration_are_numbers() {
    let place = Place::new();
    place.write("part.off", TETRA);
    place.write("a.toml", "hsiz = 0.25\nsize_sphere = [[0, 0, 0, 0.1, 0.05]]\n");
    place.write("b.toml", "hsiz = \"0.25\"\nsize_sphere = [\"0,0,0,0.1,0.05\"]\n");
    for name in ["a", "b"] {
        let line = format!("mesh part.off --config {name}.toml -o {name}.tetdb");
        place.run_line(&line).succeeds();
    }
    assert_eq!(place.digest("a.tetdb"), place.digest("b.tetdb"));
}

#[test]
fn sizes_that_edges_of_the_surface_forbid_are_said_to_stay_out_of_reach() {
    let place = Place::new();
    let said = said(&place, "estimate sample:box,h=0.3 --hsiz 0.03");
    for words in ["--hsiz 0.03 is far below", "away from them", "tetdb refine-surface"] {
        assert!(said.contains(words), "{words}: {said}");
    }
}

#[test]
fn check_and_estimate_expect_the_same() {
    let place = Place::new();
    let check = place.run_line("check sample:knot,h=0.1 --json").json();
    let estimate = place.run_line("estimate sample:knot,h=0.1 --json").json();
    let expected = check["fitness"]["tets_expected"].as_f64().expect("a number");
    assert_eq!(Some(expected.round() as u64), estimate["tets"].as_u64());
    place.run_line("mesh sample:knot,h=0.1 -o k.tetdb").succeeds();
    let actual = place.run_line("info k.tetdb --json").json()["tets"].as_f64();
    let ratio = expected / actual.expect("a number");
    assert!((0.9..1.1).contains(&ratio), "{ratio}");
}

#[test]
fn what_is_printed_leads_from_a_broken_surface_to_a_picture() {
    let place = Place::new();
    let command = |text: &str, words: &str| {
        let start = format!("`tetdb {words} ");
        let at = text.find(&start).unwrap_or_else(|| panic!("no {words}: {text}"));
        let line = text[at + "`tetdb ".len()..].split('`').next();
        line.expect("it begins with one").to_owned()
    };
    for kind in ["holes", "crossings", "doubled", "soup"] {
        let file = format!("{kind}.off");
        place.run_line(&format!("sample broken,kind={kind},seed=4 -o {file}")).succeeds();
        let said = place.run_line(&format!("check {file}")).stdout();
        let done = place.run_line(&command(&said, "mesh")).succeeds();
        place.run_line(&command(&done.stderr(), "snapshot")).succeeds();
        assert!(place.path(&format!("{kind}.png")).exists());
    }
    let said = place.run_line("check sample:needles,seed=2").succeeds().stdout();
    let line = command(&said, "mesh");
    assert!(line.ends_with("--remesh-surface"), "{line}");
}

#[test]
fn an_open_surface_is_not_sent_to_the_command_it_comes_from() {
    let place = Place::new();
    place.write("open.off", TETRA.replace("4 4 0", "4 3 0").replace("3 0 3 2\n", ""));
    let said = place.run_line("check open.off").stdout();
    let help = said.lines().find(|line| line.starts_with("help:"));
    assert!(help.is_none_or(|help| !help.contains("tetdb check SURFACE")), "{said}");
}

#[test]
fn a_ply_of_one_label_is_corners_alone() {
    let place = Place::new();
    place.run_line("sample box,h=0.5 -o one.ply").succeeds();
    place.write("part.off", TETRA);
    place.run_line("refine-surface part.off one.ply --hsiz 0.5").succeeds();
    let bytes = std::fs::read(place.path("one.ply")).expect("it was written");
    let head = String::from_utf8_lossy(&bytes[..300.min(bytes.len())]).into_owned();
    assert!(!head.contains("property int label"), "{head}");
    place.run_line("check one.ply").succeeds();
}

#[test]
fn pages_of_the_manual_have_examples() {
    let page = said(&Place::new(), "man query");
    assert!(page.contains(".SH EXAMPLES\n.nf\ntetdb query"), "{page}");
}

#[test]
fn many_regions_are_summed_and_few_listed() {
    let place = Place::new();
    let few = place.run_line("mesh sample:box,h=0.5 --no-verify -o few.tetdb");
    assert!(few.succeeds().stdout().contains("\n  region    1: volume"));
    let many = place.run_line("mesh sample:balls,count=20,h=0.1 --no-verify -o many.tetdb");
    let said = many.succeeds().stdout();
    assert!(said.contains("--json lists them"), "{said}");
    assert!(!said.contains("\n  region "), "{said}");
}

#[test]
fn help_wraps_at_the_width_of_the_terminal() {
    let place = Place::new();
    for width in [60, 100] {
        let mut command = place.command(&["query", "--help"]);
        let done = command.env("COLUMNS", width.to_string()).output();
        let text = done.expect("it starts").stdout;
        // Examples are lines that can be copied.
        let options = String::from_utf8_lossy(&text).into_owned();
        let options = options.split("Examples:").next().unwrap_or_default().to_owned();
        let widest = options.lines().map(|line| line.chars().count()).max();
        assert!(widest.is_some_and(|w| w <= width && w > width - 20), "{widest:?} of {width}");
    }
}

/// Errors are colored on a terminal that allows colors. `script` of util-linux gives a command a terminal.
#[cfg(target_os = "linux")]
#[test]
fn errors_have_colors_on_a_terminal_that_may_have_them() {
    let place = Place::new();
    let line = format!("{} check none.off", super::place::program().display());
    let said = |no_color: &str| {
        let run = std::process::Command::new("script")
            .args(["-qec", &line, "/dev/null"])
            .env("NO_COLOR", no_color)
            .env("TERM", "xterm")
            .stdin(std::process::Stdio::null())
            .current_dir(place.path("."))
            .output();
        run.ok().map(|run| String::from_utf8_lossy(&run.stdout).into_owned())
    };
    let (Some(with), Some(without)) = (said(""), said("1")) else {
        return;
    };
    for text in [&with, &without] {
        assert!(text.contains("error"), "{text}");
    }
    assert!(with.contains("\u{1b}[1;31m"), "{with:?}");
    assert!(!without.contains("\u{1b}["), "{without:?}");
    let piped = place.run_line("check none.off").stderr();
    assert!(!piped.contains("\u{1b}["), "{piped:?}");
}

#[test]
fn the_help_of_samples_names_each_with_all_its_keys() {
    let place = Place::new();
    let help = place.run_line("sample --help").succeeds().stdout();
    let names = tetdb_kernel::samples::SAMPLES;
    let words = help.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains(&names.join(", ")), "{help}");
    for name in names {
        let line = help.lines().find(|line| line.trim_start().starts_with(&format!("{name} ")));
        let line = line.unwrap_or_else(|| panic!("no line for {name} in {help}"));
        let asked = format!("check sample:{name},nothing=1 --json");
        let error = place.run_line(&asked).error()["message"].to_string();
        let keys = error.rsplit_once("keys are").map_or("", |(_, keys)| keys);
        let keys: Vec<&str> =
            keys.split(|c: char| !c.is_alphanumeric()).filter(|k| !k.is_empty()).collect();
        assert!(!keys.is_empty(), "{error}");
        for key in keys {
            assert!(line.split([' ', ',']).any(|word| word == key), "{name} has {key}: {line}");
        }
    }
}

#[test]
fn help_can_be_copied_into_a_shell() {
    let place = Place::new();
    std::fs::create_dir(place.path("my dir")).expect("a folder");
    let open = TETRA.replace("4 4 0", "4 3 0").replace("3 0 3 2\n", "");
    place.write("my dir/open.off", open);
    place.write("it's.off", TETRA);
    for (words, help) in [
        (&["mesh", "my dir/open.off"][..], "`tetdb check 'my dir/open.off'`"),
        (&["info", "my dir/none"], "-o 'my dir/none'`"),
        (&["query", "it's.off"], "a surface is looked at by `tetdb check SURFACE`"),
        (&["mesh", "it's.off", "--no-verify"], "`tetdb report 'it'\\''s.tetdb' 'it'\\''s.html'`"),
        (&["verify", "it's.tetdb"], "`tetdb resume 'it'\\''s.tetdb'` verifies"),
    ] {
        let said = place.run(words).stderr();
        assert!(said.contains(help), "{words:?}: {said}");
    }
}
