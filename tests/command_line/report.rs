//! The page of a mesh agrees with the other commands, and contains everything it needs.
//!
//! Why: the recipient of a page has nothing else.
//! How: the data is extracted from the page and compared with `info`. `tests/report.py` checks the page in a browser.

use serde_json::Value;

use super::place::Place;

/// Text of the script element with this id.
fn script<'a>(page: &'a str, id: &str) -> &'a str {
    let start = format!("id=\"{id}\">");
    let rest = page.split(&start).nth(1).expect("the element");
    rest.split("</script>").next().expect("its end")
}

fn page(place: &Place, line: &str, name: &str) -> (Value, String, Value) {
    let answer = place.run_line(line).succeeds().json();
    let text = std::fs::read_to_string(place.path(name)).expect("it was written");
    assert_eq!(answer["bytes"], text.len());
    let data = serde_json::from_str(script(&text, "data")).expect("JSON");
    (answer, text, data)
}

#[test]
fn a_page_tells_what_info_tells() {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.05 -o a.tetdb --subdomains 2 --no-verify").succeeds();
    let info = place.run_line("info a.tetdb --json").succeeds().json();
    let (answer, text, data) = page(&place, "report a.tetdb a.html --json", "a.html");
    for key in ["tets", "vertices", "bytes"] {
        assert_eq!(data["counts"][key], info[key], "{key}");
    }
    assert_eq!(data["digest"], info["digest"]);
    assert_eq!(data["title"], "a");
    let sum = |list: &Value| -> u64 {
        let list = list.as_array().expect("a list");
        list.iter().filter_map(Value::as_u64).sum()
    };
    let tets = info["tets"].as_u64().expect("a number");
    let statistics = &data["statistics"];
    assert_eq!(sum(&data["bins"]), tets);
    assert_eq!(sum(&statistics["quality"]["bins"]), tets);
    assert_eq!(sum(&statistics["angles"]["bins"]), 6 * tets);
    let line = "query a.tetdb --order-by excess --desc --limit 1 --select excess --json";
    let worst = place.run_line(line).succeeds().stdout();
    let worst: Value = serde_json::from_str(worst.lines().next().expect("one")).expect("JSON");
    assert_eq!(statistics["excess"]["worst"], worst["excess"]);
    let info = place.run_line("info a.tetdb --excess --json").succeeds().json();
    assert_eq!(info["excess"], statistics["excess"]);
    let line = "query a.tetdb --where excess>2 --select id --json";
    let above = place.run_line(line).succeeds().stdout().lines().count() as u64;
    let found = statistics["excess"]["above_two"].as_u64();
    assert_eq!(found, Some(above));
    let edges = &statistics["edges"];
    assert_eq!(
        sum(&edges["bins"]) + sum(&edges["given_bins"]),
        edges["edges"].as_u64().expect("a number")
    );
    // Counts each edge once, by Euler's formula for the vertices, edges, faces and tetrahedra of a ball.
    let shared = info["interfaces"][0]["faces"].as_u64().expect("faces");
    let facets = data["counts"]["triangles"].as_u64().expect("a number");
    assert!(edges["of_about"] == edges["edges"] && shared > 0);
    let faces = 2 * tets + facets / 2;
    let cut_vertices = data["counts"]["vertices"].as_u64().expect("a number");
    let all = edges["edges"].as_u64().expect("a number");
    // Vertices of the interface count in both sub-domains. The interface is a disk: V = F / 2 + 1 + half the length of its boundary
    // loop.
    let vertices = all + tets + 1 - faces;
    assert!(vertices < cut_vertices && vertices > cut_vertices - shared);
    let median = edges["median"].as_f64().expect("a number");
    assert!((0.8..1.2).contains(&median), "{median}");

    assert_eq!(data["subdomains"].as_array().map(Vec::len), Some(2));
    assert!(data["subdomains"][1]["predicted"].as_f64() > Some(0.0));
    assert_eq!(data["interfaces"][0][3], info["interfaces"][0]["faces"]);
    let steps = data["steps"].as_array().expect("a list");
    let rows: usize = steps.iter().filter_map(|s| Some(s["rows"].as_array()?.len())).sum();
    assert_eq!(Some(rows), info["journal"].as_array().map(Vec::len));
    let names: Vec<&Value> = steps.iter().filter_map(|s| s["names"].as_array()).flatten().collect();
    for name in
        ["natural_faces", "zone_rejects", "frozen_hits", "pages_read", "frames_used", "optimize_s"]
    {
        assert!(names.iter().any(|n| *n == name), "{name}");
    }
    assert_eq!(answer["boundary"]["of"], facets);
    assert_eq!(answer["interfaces"]["shown"], shared);
    for axis in ["x", "y", "z"] {
        for number in 0..9 {
            let packed = script(&text, &format!("surface-cut-{axis}-{number}"));
            assert!(packed.len() > 1000, "{axis} {number}");
        }
    }
}

#[test]
fn a_page_is_the_same_whatever_the_memory_and_replaces_another() {
    let place = Place::new();
    place.run_line("mesh sample:balls,count=5 -o a.tetdb --no-verify").succeeds();
    let (_, first, _) = page(&place, "report a.tetdb a.html --json", "a.html");
    place.write("a.html", "something else");
    let line = "report a.tetdb a.html --json --memory 64MiB";
    let (_, second, _) = page(&place, line, "a.html");
    assert!(first == second, "the pages differ");
    let failed = place.run_line("report a.tetdb a.pdf --json");
    assert_eq!(failed.error()["code"], "unknown-format");
    let failed = place.run_line("report b.tetdb a.html --json");
    assert_eq!(failed.error()["code"], "no-such-store");
}
