//! `remesh-surface`: needles become even triangles within a tolerance.
//!
//! Why: the quality of tetrahedra ends where that of the surface does.

use super::place::Place;

/// A cylinder of `n` facets in one label, with caps in another.
fn cylinder(n: usize) -> String {
    let mut text = String::new();
    for z in [0.0, 3.0] {
        for k in 0..n {
            let angle = k as f64 / n as f64 * std::f64::consts::TAU;
            text += &format!("v {} {} {z}\n", angle.cos(), angle.sin());
        }
    }
    text += "g side\n";
    for k in 0..n {
        let (a, b) = (k + 1, (k + 1) % n + 1);
        text += &format!("f {a} {b} {}\nf {a} {} {}\n", n + b, n + b, n + a);
    }
    text += "g caps\n";
    for k in 2..n {
        text += &format!("f 1 {} {k}\nf {} {} {}\n", k + 1, n + 1, n + k, n + k + 1);
    }
    text
}

#[test]
fn needles_become_even_triangles_and_good_tetrahedra() {
    let place = Place::new();
    place.write("rod.obj", cylinder(60));
    let made =
        place.run_line("remesh-surface rod.obj even.obj --tolerance 0.3% --json").succeeds().json();
    let report = &made["report"];
    let number = |key: &str| report[key].as_f64().expect("a number");
    assert_eq!(number("triangles_before"), 236.0);
    assert!(number("angle_before") < 3.0 && number("angle") > 15.0, "{report}");
    assert!((number("distance_bound") - 0.003 * 17f64.sqrt()).abs() < 1e-3, "{report}");
    let checked = place.run_line("check even.obj --json").succeeds().json();
    assert_eq!(checked["labels"].as_array().map(Vec::len), Some(2), "{checked}");
    place.run_line("mesh even.obj -o even.tetdb").succeeds();
    place.run_line("verify even.tetdb --full").succeeds();
    let bad = place.run_line("query even.tetdb --where quality>4 --json").succeeds();
    assert_eq!(
        bad.stdout().lines().filter(|l| l.contains("quality")).count(),
        0,
        "{}",
        bad.stdout()
    );
    let said = place.run_line("remesh-surface rod.obj again.obj --tolerance 0.3%").succeeds();
    assert!(said.stderr().contains("farther than"), "{}", said.stderr());
    let [one, other] =
        ["even.obj", "again.obj"].map(|name| std::fs::read(place.path(name)).unwrap());
    assert_eq!(one, other, "the same each time");
}

#[test]
fn bad_options_and_bad_surfaces_are_refused_before_anything_is_written() {
    let place = Place::new();
    place.run_line("sample box,h=0.5 -o box.off").succeeds();
    place.write("open.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
    for (line, exit, words) in [
        ("box.off out.off --tolerance 0", 2, "tolerance"),
        ("box.off out.off --tolerance nan", 2, "tolerance"),
        ("box.off out.off --tolerance 30%", 2, "a tenth of the box diagonal"),
        ("box.off out.off --tolerance 1e-12", 2, "rounding"),
        ("box.off out.off --feature-angle 0", 2, "feature angle"),
        ("box.off out.off --feature-angle=-3", 2, "feature angle"),
        ("box.off out.off --hgrad 0.5", 2, "hgrad"),
        ("box.off out.off --hmin 1 --hmax 0.5", 2, "hmin"),
        ("box.off box.off", 2, "--force"),
        ("open.off out.off", 3, "open"),
        ("box.off out.xyz", 3, "xyz"),
    ] {
        let refused = place.run_line(&format!("remesh-surface {line}"));
        assert_eq!(refused.exit(), Some(exit), "{line}: {}", refused.stderr());
        assert!(refused.stderr().contains(words), "{line}: {}", refused.stderr());
        assert!(!place.path("out.off").exists() && !place.path("out.xyz").exists(), "{line}");
    }
    let line = "remesh-surface box.off fine.off --hsiz 0.001 --hmin 0.001 --memory 64MiB --json";
    let refused = place.run_line(line);
    assert_eq!(refused.exit(), Some(6), "{}", refused.stderr());
    assert_eq!(refused.error()["code"], "memory");
}

#[test]
fn a_mesh_that_begins_with_remeshing_is_resumed_and_verified() {
    let place = Place::new();
    place.write("rod.obj", cylinder(60));
    let line = "mesh rod.obj --remesh-surface --remesh-tolerance 0.3% --hsiz 0.4";
    let notes = place.run_line(&format!("{line} -o one.tetdb --threads 1")).succeeds().stderr();
    assert!(notes.contains("remeshed: 236 triangles became"), "{notes}");
    place.run_line(&format!("{line} -o two.tetdb --coarse-only")).succeeds();
    place.run_line("resume two.tetdb --threads 2").succeeds();
    assert_eq!(place.digest("one.tetdb"), place.digest("two.tetdb"));
    place.run_line("verify two.tetdb --full").succeeds();
    place.run_line("verify two.tetdb --against rod.obj").succeeds();
    place.run_line("remesh-surface rod.obj even.obj --tolerance 0.3% --hsiz 0.4").succeeds();
    place.run_line("mesh even.obj --hsiz 0.4 -o even.tetdb").succeeds();
    assert_eq!(place.digest("one.tetdb"), place.digest("even.tetdb"));
    let info = place.run_line("info two.tetdb").succeeds().stdout();
    assert!(info.contains("remeshed (tolerance="), "{info}");
    let size = |line: &str| {
        let answer = place.run_line(&format!("estimate rod.obj {line} --json")).succeeds().json();
        answer["triangles"].as_u64().expect("a count")
    };
    let plain = size("--remesh-surface --hsiz 0.4");
    assert!(size("--remesh-surface --hsiz 0.1") > plain + plain / 2);
    let sphere = "--size-sphere 1,0,0,0.5,0.05";
    assert!(size(&format!("--remesh-surface --hsiz 0.4 {sphere}")) > plain + plain / 10);
    assert!(size("--remesh-surface --size-expr 0.05+0.05*z") > 2 * plain);
    for (line, words) in [
        ("--remesh-tolerance 1%", "--remesh-surface"),
        ("--remesh-surface --remesh-tolerance 0", "--remesh-tolerance 0:"),
        ("--repair wrap --wrap-gap 0", "--wrap-gap 0:"),
        ("--repair wrap --wrap-offset x", "--wrap-offset x:"),
        ("--remesh-surface --remesh-angle 0", "feature angle"),
    ] {
        let refused = place.run_line(&format!("mesh rod.obj -o bad.tetdb {line}"));
        assert_eq!(refused.exit(), Some(2), "{line}: {}", refused.stderr());
        assert!(refused.stderr().contains(words), "{line}: {}", refused.stderr());
    }
}

#[test]
fn a_repaired_surface_is_remeshed_and_sizes_by_place_are_on_record() {
    let place = Place::new();
    place.run_line("sample broken,kind=holes,count=5 -o scan.stl").succeeds();
    let line = "mesh scan.stl --repair auto --remesh-surface --remesh-tolerance 1%";
    let line = format!("{line} --size-expr 0.2+0.1*abs(x) --size-box -1,-1,-1,0,0,0,0.1,0.5");
    place.run_line(&format!("{line} -o a.tetdb")).succeeds();
    place.run_line("verify a.tetdb --full").succeeds();
    place.run_line("verify a.tetdb --against scan.stl").succeeds();
    place.run_line("verify a.tetdb --against scan.stl --repair winding").succeeds();
    place.write("post.obj", "v 0 0 0\nv 0.1 0 0.2\nv 0 0.1 0.2\nf 1 2 3\n");
    place.run_line(&format!("{line} --embed post.obj -o c.tetdb")).succeeds();
    for repair in ["", "--repair auto"] {
        let line = format!("verify c.tetdb --against scan.stl --embed post.obj {repair}");
        place.run_line(&line).succeeds();
    }
    let info = place.run_line("info a.tetdb").succeeds().stdout();
    let [closed, remeshed] = ["closed by", "remeshed ("].map(|words| info.find(words));
    assert!(closed.is_some() && closed < remeshed, "{info}");
    let file = std::fs::File::open(place.path("scan.stl")).expect("written");
    let words: Vec<&str> = "mesh - --repair auto --remesh-surface -o b.tetdb".split(' ').collect();
    let done = place.command(&words).stdin(file).output().expect("it runs");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    place.run_line("verify b.tetdb --full").succeeds();
}
