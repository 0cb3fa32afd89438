//! Pictures exist, have the right size, and show the right elements.
//!
//! Why: people believe a picture at a glance, so it must show the actual mesh.
//! How: the PNG's head and some of its pixels are checked, by way of a second picture. The SVG's polygons are counted and measured.
//! `tests/questions` shows that a section covers the cut area exactly once.

use super::place::Place;

/// Corners of the polygons of an SVG file with their fill color, without the color bar.
fn polygons(text: &str) -> Vec<(Vec<[f64; 2]>, &str)> {
    let paths = text.lines().filter(|l| l.contains("stroke=\"#222\""));
    paths
        .map(|line| {
            let word = |name: &str| {
                let at = line.find(name).expect("the attribute") + name.len();
                line[at..].split('"').next().expect("its end")
            };
            let corners = word(" d=\"M").trim_end_matches('z').split('L');
            let corners = corners.map(|corner| {
                let (x, y) = corner.split_once(',').expect("two numbers");
                [x.parse().expect("a number"), y.parse().expect("a number")]
            });
            (corners.collect(), word("fill=\""))
        })
        .collect()
}

fn area(corners: &[[f64; 2]]) -> f64 {
    let turned = corners.iter().zip(corners.iter().cycle().skip(1));
    let twice: f64 = turned.map(|(p, q)| p[0] * q[1] - p[1] * q[0]).sum();
    twice.abs() / 2.0
}

#[test]
fn a_cut_is_drawn_whole_and_in_its_colors() {
    let place = Place::new();
    let line = "mesh sample:box,h=0.05 -o a.tetdb --subdomains 2";
    place.run_line(line).succeeds();
    let cut = "snapshot a.tetdb cut.svg --size 500x500 --plane 0.5,0.5,0.5,0,0,1 --json";
    let answer = place.run_line(cut).succeeds().json();
    let svg = std::fs::read_to_string(place.path("cut.svg")).expect("it was written");
    let pieces = polygons(&svg);
    assert_eq!(answer["pieces"], pieces.len());
    assert_eq!(answer["bytes"], svg.len());
    // The square has margins of 4 % on both sides, and space for the list of colors.
    let sum: f64 = pieces.iter().map(|(corners, _)| area(corners)).sum();
    assert!((sum / (422.5 * 422.5) - 1.0).abs() < 0.002, "{sum}");
    for color in pieces.iter().map(|(_, color)| *color) {
        let square = format!("fill=\"{color}\" stroke=\"{color}\"");
        assert_eq!(svg.matches(&square).count(), 1, "a square of each color");
    }
    let mut colors: Vec<&str> = pieces.iter().map(|(_, color)| *color).collect();
    colors.sort_unstable();
    colors.dedup();
    assert_eq!(colors.len(), 2, "a color for each sub-domain");

    let whole = "snapshot a.tetdb whole.svg --crinkle --color size --where x<0.5 --size 500x500";
    place.run_line(whole).succeeds();
    let svg = std::fs::read_to_string(place.path("whole.svg")).expect("it was written");
    let pieces = polygons(&svg);
    assert!(pieces.iter().all(|(corners, _)| corners.len() == 3));
    let widest = pieces.iter().flat_map(|(c, _)| c).map(|c| c[0]).fold(0.0, f64::max);
    assert!(widest < 420.0, "the bar of colors has its place: {widest}");
}

#[test]
#[cfg(feature = "pictures")]
fn a_png_has_the_size_asked_for() {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.2 -o a.tetdb").succeeds();
    for (name, options) in [("a.png", ""), ("b.png", ""), ("c.png", "--color quality")] {
        let line = format!("snapshot a.tetdb {name} --size 320x240 {options}");
        place.run_line(&line).succeeds();
    }
    let read = |name: &str| std::fs::read(place.path(name)).expect("it was written");
    let png = read("a.png");
    assert!(png.starts_with(b"\x89PNG\r\n\x1a\n"));
    let side = |at: usize| png[at..at + 4].try_into().map(u32::from_be_bytes);
    assert_eq!([side(16).ok(), side(20).ok()], [Some(320), Some(240)]);
    assert_eq!(png, read("b.png"), "the same mesh gives the same picture");
    assert_ne!(png, read("c.png"));
}

#[test]
fn stages_are_drawn_where_they_were_kept_and_change_nothing() {
    let place = Place::new();
    for (name, more) in [("a.tetdb", "--keep-stages"), ("b.tetdb", "")] {
        let line = format!("mesh sample:box,h=0.05 -o {name} --subdomains 2 --no-verify {more}");
        place.run_line(&line).succeeds();
    }
    assert_eq!(place.digest("a.tetdb"), place.digest("b.tetdb"));
    let pieces = |stage: &str| {
        let line = format!("snapshot a.tetdb {stage}.svg --stage 1:{stage} --json");
        let answer = place.run_line(&line).succeeds().json();
        answer["pieces"].as_u64().expect("a number")
    };
    assert!(pieces("refined") > 2 * pieces("coarse"));
    let svg = std::fs::read_to_string(place.path("coarse.svg")).expect("it was written");
    assert!(svg.contains("#0a0a0a"), "the plane of the cut is a line");
    let info = place.run_line("info a.tetdb --json").succeeds().json();
    assert_eq!(info["stages"].as_array().map(Vec::len), Some(2));
    assert!(info["stages"][1]["tets"].as_u64() > info["stages"][0]["tets"].as_u64());
    let journal = info["journal"].as_array().expect("a list");
    let cut = journal.iter().find(|row| row["step"] == "bisect").expect("a cut");
    let measure = |name: &str| {
        let list = cut["measures"].as_array().expect("a list");
        let found = list.iter().find(|m| m["name"] == name);
        found.expect("the measure")["value"].as_f64()
    };
    assert_eq!(Some(pieces("natural") as f64), measure("natural_faces"));
    assert_eq!(Some(pieces("interface") as f64), measure("interface_faces"));
    for line in [
        "snapshot b.tetdb c.svg --stage 1:coarse --json",
        "snapshot b.tetdb c.svg --stage 1:natural --json",
        "snapshot a.tetdb c.svg --stage 2:refined --json",
    ] {
        assert_eq!(place.run_line(line).error()["code"], "no-such-part", "{line}");
    }
    for line in [
        "snapshot a.tetdb c.svg --stage 1 --json",
        "snapshot a.tetdb c.svg --from 1,0,0 --json",
        "snapshot a.tetdb c.svg --surface --color quality --json",
        "snapshot a.tetdb c.svg --surface --from 0,0,0 --json",
    ] {
        assert_eq!(place.run_line(line).error()["code"], "bad-query", "{line}");
    }
}

#[test]
fn surfaces_are_drawn_with_what_bounds_them() {
    let place = Place::new();
    let line = "mesh sample:box,h=0.05 -o a.tetdb --subdomains 2 --no-verify";
    place.run_line(line).succeeds();
    let info = place.run_line("info a.tetdb --json").succeeds().json();
    let part = &info["subdomains"][1];
    let pieces = |options: &str| {
        let line = format!("snapshot a.tetdb a.svg --json {options}");
        let answer = place.run_line(&line).succeeds().json();
        answer["pieces"].as_u64().expect("a number")
    };
    let number = |key: &str| part[key].as_u64().expect("a number");
    assert_eq!(pieces("--shell 1"), number("facets") + number("interface_faces"));
    let all = number("facets") + info["subdomains"][0]["facets"].as_u64().expect("a number");
    assert_eq!(pieces("--surface"), all);
    // Half of the surface, and for each tetrahedron in the plane one to three faces that point to the viewer.
    let plane = "0.5,0.5,0.5,1,0,0";
    let cut = place.run_line(&format!("query a.tetdb --plane {plane} --json"));
    let cut = cut.succeeds().stdout().lines().count() as u64;
    let shown = pieces(&format!("--surface --plane {plane}"));
    let (least, most) = (all / 2 + cut, all / 2 + 3 * cut);
    assert!(
        cut > 0 && shown > least - all / 20 && shown < most + all / 20,
        "{shown} of {all}, {cut}"
    );
    let failed = place.run_line("snapshot a.tetdb b.svg --shell 2 --json");
    assert_eq!(failed.error()["code"], "no-such-part");
}

#[test]
fn a_surface_that_is_cut_open_shows_tetrahedra_and_labels_have_colors() {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.5 -o box.tetdb").succeeds();
    let pieces = |options: &str| {
        let line = format!("snapshot box.tetdb a.png --surface --size 200x200 --json {options}");
        let answer = place.run_line(&line).succeeds().json();
        answer["pieces"].as_u64().expect("a number")
    };
    let (whole, cut) = (pieces(""), pieces("--plane 0.5,0.5,0.5,1,0,0"));
    let tets = place.run_line("query box.tetdb --plane 0.5,0.5,0.5,1,0,0 --json");
    let n_cut = tets.succeeds().stdout().lines().count() as u64;
    assert!(n_cut > 0 && cut > n_cut && cut <= whole + 3 * n_cut, "{whole} {cut} {n_cut}");
    assert_eq!(pieces("--color label"), whole);
    // Cut tetrahedra have no label, and none of the listed colors.
    let line = "snapshot box.tetdb a.svg --surface --plane 0.5,0.5,0.5,1,0,0 --color label";
    place.run_line(line).succeeds();
    let picture = std::fs::read_to_string(place.path("a.svg")).expect("a picture");
    assert!(!picture.contains(&u32::MAX.to_string()));
    let refused = place.run_line("snapshot box.tetdb a.png --color label --json");
    assert_eq!(refused.error()["code"], "bad-query");
}
