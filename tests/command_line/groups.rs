//! Triangles in several groups keep all of them, from the file to the answers.
//!
//! How: a box of two triangles a side, as MSH 2.2 and 4.1, whose low x side is in two groups and whose top is in a third with the rest.

use std::fmt::Write as _;
use std::io::Write as _;
use std::process::Stdio;

use serde_json::{Value, json};

use super::place::Place;

/// Sides as corners (bits x, y, z), seen from outside: low and high x, y and z.
const SIDES: [[usize; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

const NAMES: &str =
    "$PhysicalNames\n3\n2 1 \"walls\"\n2 2 \"inlet\"\n2 3 \"lid, outer\"\n$EndPhysicalNames\n";

/// The physical groups of a side.
fn groups(side: usize) -> &'static [usize] {
    match side {
        0 => &[1, 2],
        5 => &[1, 3],
        _ => &[1],
    }
}

fn nodes(of: impl Fn(usize, [usize; 3]) -> String) -> String {
    (0..8).map(|c| of(c + 1, [c & 1, c >> 1 & 1, c >> 2])).collect()
}

/// The box with elements listed once for each group.
pub fn msh22() -> String {
    let mut elements = String::new();
    let mut n = 0;
    for (side, [a, b, c, d]) in SIDES.into_iter().enumerate() {
        for triangle in [[a, b, c], [a, c, d]] {
            for group in groups(side) {
                n += 1;
                let [a, b, c] = triangle.map(|v| v + 1);
                writeln!(elements, "{n} 2 2 {group} {} {a} {b} {c}", side + 1).expect("text grows");
            }
        }
    }
    let nodes = nodes(|tag, [x, y, z]| format!("{tag} {x} {y} {z}\n"));
    format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n{NAMES}$Nodes\n8\n{nodes}$EndNodes\n$Elements\n{n}\n{elements}$EndElements\n"
    )
}

/// The box with entities of several groups.
fn msh41() -> String {
    let mut entities = String::new();
    let mut elements = String::new();
    for (side, [a, b, c, d]) in SIDES.into_iter().enumerate() {
        let groups = groups(side);
        let list: Vec<String> = groups.iter().map(usize::to_string).collect();
        let (tag, n) = (side + 1, groups.len());
        writeln!(entities, "{tag} 0 0 0 1 1 1 {n} {} 0", list.join(" ")).expect("text grows");
        let [a, b, c, d] = [a, b, c, d].map(|v| v + 1);
        let first = 2 * side + 1;
        writeln!(elements, "2 {tag} 2 2\n{first} {a} {b} {c}\n{} {a} {c} {d}", first + 1)
            .expect("text grows");
    }
    let tags: String = (1..=8).map(|n| format!("{n}\n")).collect();
    let nodes = nodes(|_, [x, y, z]| format!("{x} {y} {z}\n"));
    format!(
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n{NAMES}$Entities\n0 0 6 0\n{entities}$EndEntities\n\
        $Nodes\n1 8 1 8\n2 1 0 8\n{tags}{nodes}$EndNodes\n$Elements\n6 12 1 12\n{elements}$EndElements\n"
    )
}

/// Labels of the box and those of several groups: in version 2 the groups come first.
fn labels(is_v2: bool) -> (Value, Value) {
    let lid = "lid, outer";
    let (names, sets) = match is_v2 {
        true => (json!(["walls", "inlet", lid, "walls+inlet", "walls+lid, outer"]), [3, 4]),
        false => (json!(["walls", "inlet", "walls+inlet", lid, "walls+lid, outer"]), [2, 4]),
    };
    let lid = if is_v2 { 2 } else { 3 };
    let members =
        json!([{ "label": sets[0], "members": [0, 1] }, { "label": sets[1], "members": [0, lid] }]);
    (names, members)
}

fn check_labels(found: &Value, is_v2: bool) {
    assert_eq!((found["labels"].clone(), found["label_sets"].clone()), labels(is_v2));
}

/// Tetrahedra on a label, by its name or number.
fn count(place: &Place, store: &str, label: &str) -> usize {
    let run = place.run(&["query", store, "--label", label, "--json"]);
    run.succeeds().stdout().lines().count()
}

#[test]
fn all_groups_are_in_check_info_and_questions() {
    let place = Place::new();
    place.write("a.msh", msh22());
    place.write("b.msh", msh41());
    for (name, is_v2) in [("a", true), ("b", false)] {
        let check = place.run(&["check", &format!("{name}.msh"), "--json"]).succeeds().json();
        check_labels(&check, is_v2);
        assert_eq!(check["triangles"], 12);
        let said = place.run_line(&format!("check {name}.msh")).succeeds().stdout();
        assert!(said.contains("labels: walls, inlet, ") && said.contains("walls+inlet"), "{said}");
        place.run_line(&format!("mesh {name}.msh -o {name}.tetdb --hsiz 0.3")).succeeds();
        let store = format!("{name}.tetdb");
        let info = place.run(&["info", &store, "--json"]).succeeds().json();
        check_labels(&info, is_v2);
        let [walls, inlet, both] =
            ["walls", "inlet", "walls+inlet"].map(|label| count(&place, &store, label));
        let lid = count(&place, &store, if is_v2 { "2" } else { "3" });
        assert!(inlet > 0 && inlet == both && lid > 0, "{inlet} {both} {lid}");
        let all = place.run(&["query", &store, "--touching-surface", "--json"]).stdout();
        assert!(walls > inlet && walls <= all.lines().count(), "{walls} {inlet}");
        place.run_line(&format!("verify {store} --full")).succeeds();
    }
}

#[test]
fn copies_and_sheets_keep_the_groups() {
    let place = Place::new();
    place.write("a.msh", msh41());
    place.run_line("check a.msh --repair --write a.obj").succeeds();
    check_labels(&place.run_line("check a.obj --json").succeeds().json(), false);
    // A store keeps a copy of a surface that cannot be read twice.
    let mut command = place.command(&["mesh", "-", "-o", "c.tetdb"]);
    let mut child = command.stdin(Stdio::piped()).spawn().expect("it starts");
    let mut input = child.stdin.take().expect("a pipe");
    input.write_all(msh41().as_bytes()).expect("it reads");
    drop(input);
    assert!(child.wait_with_output().expect("it ends").status.success());
    check_labels(&place.run_line("check c.tetdb/surface.obj --json").succeeds().json(), false);
    let far = |c: usize, bit: usize| if c >> bit & 1 == 1 { 2 } else { -1 };
    let points = (0..8).map(|c| format!("{} {} {}\n", far(c, 0), far(c, 1), far(c, 2)));
    let faces = SIDES.iter().map(|[a, b, c, d]| format!("3 {a} {b} {c}\n3 {a} {c} {d}\n"));
    let outer = format!("OFF\n8 12 0\n{}{}", points.collect::<String>(), faces.collect::<String>());
    place.write("outer.off", outer);
    place.run_line("mesh outer.off --embed a.msh -o s.tetdb").succeeds();
    let info = place.run_line("info s.tetdb --json").succeeds().json();
    assert_eq!([&info["labels"][1], &info["labels"][3]], ["a:walls", "a:walls+a:inlet"]);
    assert_eq!(info["label_sets"][0], json!({ "label": 3, "members": [1, 2] }));
    assert!(count(&place, "s.tetdb", "a:inlet") > 0);
    // A length at a label holds for triangles of several groups too.
    place.run_line("mesh a.msh -o fine.tetdb --size-region inlet,0.1").succeeds();
}

#[test]
fn exports_keep_the_groups_or_say_so() {
    let place = Place::new();
    place.write("a.msh", msh41());
    place.run_line("mesh a.msh -o a.tetdb --hsiz 0.3 --subdomains 2").succeeds();
    let bytes = |name: &str| std::fs::read(place.path(name)).expect("it was written");
    let text = |name: &str| String::from_utf8_lossy(&bytes(name)).into_owned();
    for line in ["back.msh", "back_text.msh --ascii", "one.msh --region 1"] {
        place.run_line(&format!("export a.tetdb {line}")).succeeds();
        let name = line.split(' ').next().expect("a name");
        let check = place.run_line(&format!("check {name} --json")).succeeds().json();
        check_labels(&check, false);
        assert_eq!(check["triangles"], 12, "{name}");
    }
    let physical = text("back_text.msh");
    assert!(
        physical.contains("2 1 \"walls\"\n2 2 \"inlet\"\n2 4 \"lid, outer\"\n3 1"),
        "{physical}"
    );
    for name in ["a.vtu", "a.vtkhdf"] {
        place.run_line(&format!("export a.tetdb {name}")).succeeds();
        let boundary = text(&name.replace("a.", "a_boundary."));
        for group in ["group_walls", "group_inlet", "group_lid__outer"] {
            assert!(boundary.contains(group), "{name}: {group}");
        }
    }
    place.run_line("export a.tetdb a.inp").succeeds();
    let deck = text("a.inp");
    let sides = |name: &str| {
        let (_, rest) =
            deck.split_once(&format!("*SURFACE, TYPE=ELEMENT, NAME={name}\n")).expect("a surface");
        rest.lines().take_while(|line| !line.starts_with('*')).count()
    };
    assert_eq!([sides("walls"), sides("inlet"), sides("lid__outer")], [12, 2, 2]);
    assert_eq!(deck.matches("*NSET, NSET=").count(), 3);
    place.run_line("export a.tetdb a.mfem").succeeds();
    let sets = text("a.mfem");
    assert!(sets.contains("\"inlet\"\n1\n3\n") && sets.contains("\"walls\"\n3\n1 3 5\n"), "{sets}");
    place.run_line("export a.tetdb a.foam").succeeds();
    let patches = text("constant/polyMesh/boundary");
    assert!(patches.contains("inGroups        2(group_walls group_inlet);"), "{patches}");
    for name in ["a.msh22", "a.mesh", "a.npy", "a.ele"] {
        let said = place.run_line(&format!("export a.tetdb {name}")).succeeds().stderr();
        assert!(said.contains("such as walls+inlet"), "{name}: {said}");
    }
    // Without triangles of several groups nothing changes.
    place.run_line("sample box,h=0.5 -o plain.off").succeeds();
    place.run_line("mesh plain.off -o plain.tetdb --export plain.vtu").succeeds();
    assert!(!text("plain_boundary.vtu").contains("group_"));
}
