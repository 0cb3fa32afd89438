//! A store answers queries, and every form of an answer has the same content.
//!
//! Why: a mesh is of little use if a place or a bad tetrahedron cannot be found in it, and scripts read the answers.
//! How: all tetrahedra of a small mesh are read as objects and recomputed here. The same queries are then asked in other forms.
//! `tests/questions` shows that the right tetrahedra are found.

use std::io::Write;
use std::process::Stdio;

use serde_json::Value;

use super::place::{Done, Place};

fn small() -> Place {
    let place = Place::new();
    let line = "mesh sample:box,h=0.2 -o a.tetdb --regions all";
    place.run_line(line).succeeds();
    place
}

fn objects(done: &Done) -> Vec<Value> {
    let text = done.stdout();
    let lines = text.lines().map(serde_json::from_str);
    lines.collect::<Result<_, _>>().expect("an object a line")
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

/// Equal up to the last bit, which the JSON reader used here may lose.
fn near(x: f64, value: &Value) -> bool {
    (x - number(value)).abs() <= 1e-15 * x.abs()
}

fn corners(tet: &Value) -> [[f64; 3]; 4] {
    [0, 1, 2, 3].map(|i| [0, 1, 2].map(|k| number(&tet["points"][i][k])))
}

fn ids(objects: &[Value]) -> Vec<&str> {
    objects.iter().map(|o| o["id"].as_str().unwrap_or("-")).collect()
}

#[test]
fn all_tetrahedra_add_up_to_the_mesh() {
    let place = small();
    let info = place.run_line("info a.tetdb --json").succeeds().json();
    let done = place.run_line("query a.tetdb --json").succeeds();
    let all = objects(&done);
    assert_eq!(info["tets"], all.len());
    let mut volume = 0.0;
    for tet in &all {
        assert_eq!(tet["schema"], 1);
        let [a, b, c, d] = corners(tet);
        let [u, v, w] = [b, c, d].map(|p| [0, 1, 2].map(|k| p[k] - a[k]));
        let cross = [0, 1, 2].map(|k| {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            v[i] * w[j] - v[j] * w[i]
        });
        let own = (0..3).map(|k| u[k] * cross[k]).sum::<f64>() / 6.0;
        assert!((own - number(&tet["volume"])).abs() < 1e-12);
        volume += own;
    }
    assert!((volume - number(&info["regions"][0]["volume"])).abs() < 1e-9);
    let worst = "query a.tetdb --order-by quality --desc --limit 1 --json";
    let worst = objects(&place.run_line(worst).succeeds());
    assert_eq!(worst[0]["quality"], info["subdomains"][0]["worst_q"]);
    let measures: Value =
        serde_json::from_str(done.stderr().trim()).expect("one object about the cost");
    assert_eq!(measures["measures"]["found"], all.len());
    assert_eq!(measures["measures"]["chunks"]["tet_chunks_read"], 1);
}

#[test]
fn points_are_answered_in_their_order_from_anywhere() {
    let place = small();
    place.write("probes.txt", "# three\n0.51, 0.52, 0.53\n\n7 7 7\t# outside\n0.1 0.2 0.3\n");
    let line = "query a.tetdb --points probes.txt --json";
    let from_file = objects(&place.run_line(line).succeeds());
    assert_eq!(from_file.len(), 3);
    assert_eq!(from_file[1]["id"], Value::Null);
    assert_eq!(from_file[1]["point"], serde_json::json!([7.0, 7.0, 7.0]));
    let line = "query a.tetdb --point 0.51,0.52,0.53 --point 7,7,7 --point 0.1,0.2,0.3 --json";
    assert_eq!(objects(&place.run_line(line).succeeds()), from_file);
    let mut command = place.command(&["query", "a.tetdb", "--points", "-", "--json"]);
    let mut child = command.stdin(Stdio::piped()).spawn().expect("it starts");
    let mut stdin = child.stdin.take().expect("a pipe");
    stdin.write_all(b"0.1 0.2 0.3\n").expect("it reads");
    drop(stdin);
    let output = child.wait_with_output().expect("it ends");
    let piped: Value = serde_json::from_slice(&output.stdout).expect("one object");
    assert_eq!(piped, from_file[2]);
    for found in [&from_file[0], &from_file[2]] {
        let shares = [0, 1, 2, 3].map(|i| number(&found["barycentric"][i]));
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        for axis in 0..3 {
            let again: f64 = (0..4).map(|i| shares[i] * corners(found)[i][axis]).sum();
            assert!((again - number(&found["point"][axis])).abs() < 1e-12);
        }
    }
}

#[test]
fn files_hold_what_is_printed() {
    let place = small();
    let question = "query a.tetdb --sphere 0.5,0.5,0.5,0.2";
    let objects = objects(&place.run_line(&format!("{question} --json")).succeeds());
    assert!(objects.len() > 10);
    for name in ["out.csv", "out.jsonl", "out.npy", "out.vtu"] {
        place.run_line(&format!("{question} -o {name}")).succeeds();
    }
    let read = |name: &str| std::fs::read(place.path(name)).expect("it was written");
    let printed = place.run_line(&format!("{question} --json")).stdout();
    assert_eq!(read("out.jsonl"), printed.into_bytes());

    let csv = String::from_utf8(read("out.csv")).expect("text");
    let columns = "--csv --select id,subdomain,region,quality,volume,vertices,points";
    let printed = place.run_line(&format!("{question} {columns}")).stdout();
    assert_eq!(csv, printed);
    let rows: Vec<Vec<&str>> = csv.lines().map(|l| l.split(',').collect()).collect();
    assert_eq!(rows[0][5..10].join(" "), "vertices0 vertices1 vertices2 vertices3 x0");
    for (row, object) in rows[1..].iter().zip(&objects) {
        assert_eq!(row[0], object["id"].as_str().unwrap_or_default());
        let parsed = |i: usize| row[i].parse().unwrap_or(f64::NAN);
        assert!(near(parsed(3), &object["quality"]));
        assert!(near(parsed(20), &object["points"][3][2]));
    }

    let npy = read("out.npy");
    assert_eq!(&npy[..8], b"\x93NUMPY\x01\x00");
    let start = 10 + usize::from(u16::from_le_bytes([npy[8], npy[9]]));
    let head = String::from_utf8_lossy(&npy[10..start]).into_owned();
    assert!(head.contains(&format!("'shape': ({},)", objects.len())), "{head}");
    let width = 3 * 8 + 2 * 8 + 4 * 8 + 12 * 8;
    assert_eq!(npy.len() - start, width * objects.len());
    for (row, object) in npy[start..].chunks(width).zip(&objects) {
        let quality = row[24..32].try_into().map(f64::from_le_bytes);
        assert!(near(quality.unwrap_or(f64::NAN), &object["quality"]));
    }

    let vtu = read("out.vtu");
    let head = String::from_utf8_lossy(&vtu[..600]).into_owned();
    assert!(head.contains(&format!("NumberOfCells=\"{}\"", objects.len())), "{head}");
}

#[test]
fn questions_are_answered_as_asked() {
    let place = small();
    let ask =
        |line: &str| objects(&place.run_line(&format!("query a.tetdb {line} --json")).succeeds());
    let bad = ask("--where quality>1.8");
    assert!(!bad.is_empty() && bad.iter().all(|t| number(&t["quality"]) > 1.8));
    let sorted = ask("--order-by -volume --limit 5");
    assert_eq!(sorted.len(), 5);
    assert!(sorted.is_sorted_by(|a, b| number(&a["volume"]) >= number(&b["volume"])));
    let one = &sorted[0];
    let id = one["id"].as_str().unwrap_or_default();
    assert_eq!(ids(&ask(&format!("--tet {id}"))), [id]);
    for neighbor in ask(&format!("--neighbors {id}")) {
        let own = one["vertices"].as_array().expect("four");
        let other = neighbor["vertices"].as_array().expect("four");
        assert_eq!(own.iter().filter(|v| other.contains(v)).count(), 3);
    }
    let [a, b] = [0, 1].map(|i| one["vertices"][i].as_str().unwrap_or_default());
    let shell = ask(&format!("--shell {a},{b}"));
    let ball = ask(&format!("--ball {a}"));
    assert!(ids(&shell).contains(&id) && ids(&shell).iter().all(|t| ids(&ball).contains(t)));
    let inside = ask("--box 0.2,0.2,0.2,0.9,0.9,0.9 --inside");
    let meeting = ask("--box 0.2,0.2,0.2,0.9,0.9,0.9");
    assert!(!inside.is_empty() && inside.len() < meeting.len());
    assert!(!ask("--plane 0.5,0.5,0.5,1,2,-1 --touching-surface --region 1").is_empty());
    let on_label = ask("--label 0 --subdomain 0");
    assert!(on_label.iter().all(|t| {
        let vertices = t["vertices"].as_array().expect("four");
        let input = |v: &&Value| v.as_str().is_some_and(|v| v.starts_with("surface:"));
        vertices.iter().filter(input).count() >= 3
    }));
    assert!(!on_label.is_empty());
}

#[test]
fn a_fault_in_an_expression_is_pointed_at() {
    let place = small();
    let done = place.run(&["query", "a.tetdb", "--where", "region = 1 and qality > 6"]);
    let text = done.stderr();
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[0].starts_with("error[bad-expression]: there is no variable `qality`"));
    assert_eq!(lines[1].find("qality"), lines[2].find('^'), "{text}");
    assert_eq!(done.exit(), Some(2));
}

#[test]
fn regions_and_edges_that_are_not_there_are_refused_and_chunks_count_once() {
    let place = small();
    for (asked, named) in [
        ("--region 5", "no region 5; the regions are 1"),
        ("--region 1,0", "no region 0"),
        ("--shell surface:0,surface:1000000", "vertex"),
        ("--shell surface:0,surface:7", "no edge of the mesh joins surface:0 and surface:7"),
    ] {
        let done = place.run_line(&format!("query a.tetdb {asked} --json"));
        assert_eq!(done.exit(), Some(3), "{asked}");
        let error = done.error();
        assert_eq!(error["code"], "no-such-part", "{asked}");
        assert!(error["message"].to_string().contains(named), "{asked}: {error}");
    }
    place.write("p.txt", "0.1 0.2 0.3\n0.9 0.8 0.9\n0.5 0.5 0.5\n0.01 0.01 0.99\n");
    for asked in ["--points p.txt", "--point 0.1,0.2,0.3 --point 0.11,0.2,0.3", "--ball surface:1"]
    {
        let done = place.run_line(&format!("query a.tetdb {asked}")).succeeds();
        assert!(done.stderr().contains("read 1 of 1 "), "{}", done.stderr());
    }
}
