//! Completions, manual pages and help exist for every command.
//!
//! Why: users do not find a command without completion or example.
//! How: the list of commands is taken from the program's own help. Each command must be in all of these.

use super::place::Place;

fn commands(place: &Place) -> Vec<String> {
    let help = place.run(&["--help"]).succeeds().stdout();
    let lines =
        help.lines().skip_while(|l| *l != "Commands:").skip(1).take_while(|l| !l.is_empty());
    let names = lines.filter_map(|l| l.strip_prefix("  ")?.split_whitespace().next());
    let names: Vec<String> = names.map(str::to_owned).filter(|n| n != "help").collect();
    assert!(names.len() >= 12, "{help}");
    names
}

#[test]
fn every_command_has_examples() {
    let place = Place::new();
    for name in commands(&place) {
        let help = place.run(&[&name, "--help"]).succeeds().stdout();
        let examples = help.split("Example").nth(1).unwrap_or_default();
        assert!(examples.contains(&format!("tetdb {name}")), "{help}");
    }
}

#[test]
fn shells_complete_every_command() {
    let place = Place::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = place.run(&["completions", shell]).succeeds().stdout();
        for name in commands(&place) {
            assert!(script.contains(&name), "{shell} does not know {name}");
        }
        assert!(script.contains("touching-surface"), "{shell} knows no options of query");
    }
    assert_eq!(place.run(&["completions", "dash"]).exit(), Some(2));
}

#[test]
fn every_command_has_a_manual_page() {
    let place = Place::new();
    let page = place.run(&["man"]).succeeds().stdout();
    assert!(page.contains(".TH tetdb 1"), "{page}");
    place.run(&["man", "--dir", "."]).succeeds();
    for name in commands(&place) {
        let page = place.run(&["man", &name]).succeeds().stdout();
        let written = std::fs::read_to_string(place.path(&format!("tetdb-{name}.1")));
        assert_eq!(written.expect("a page was written"), page);
        assert!(page.contains(&format!(".TH tetdb-{name} 1")), "{page}");
    }
    assert_eq!(place.run(&["man", "nothing"]).exit(), Some(2));
}

#[test]
fn quiet_commands_tell_of_warnings_and_errors_alone() {
    let place = Place::new();
    let balls = "sample:balls,count=2,h=0.2";
    let told = place.run(&["mesh", balls, "-o", "a.tetdb"]).succeeds();
    let quiet = place.run(&["mesh", balls, "-o", "b.tetdb", "--quiet"]).succeeds();
    assert!(!told.stderr().is_empty());
    assert_eq!(quiet.stderr(), "");
    assert_eq!(quiet.stdout(), "", "a summary nobody asked for");
    assert!(told.stdout().contains("finished and verified"));
    let asked = place.run(&["info", "b.tetdb", "--quiet"]).succeeds();
    assert!(asked.stdout().contains("finished and verified"));
    let warned = place.run(&["-q", "mesh", balls, "-o", "c.tetdb", "--hmax", "0.05"]);
    let text = warned.succeeds().stderr();
    assert!(!text.is_empty() && text.lines().all(|l| l.starts_with("warning: ")), "{text}");
    let refused = place.run(&["info", "nothing.tetdb", "-q"]);
    assert!(refused.stderr().starts_with("error["), "{}", refused.stderr());
}
