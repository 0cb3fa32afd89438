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
