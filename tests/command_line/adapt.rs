//! `adapt`: lengths from the error of a field.
//!
//! Why: a number of tetrahedra is well spent only where the solution needs them.
//! How: fields with known second derivatives have known best lengths; the error of their interpolation is compared with that of a uniform mesh
//! of as many tetrahedra.

use super::fields::doubles;
use super::place::Place;
use serde_json::Value;

const LAYER: &str = "exp(-x/0.15)";
/// Away from the surface and interfaces, whose triangles stay.
const BUMP: &str = "exp(-((x-0.4)^2+(y-0.5)^2+(z-0.5)^2)/0.02)";

/// A store with the fields of these tests, in sub-domains if more than one is asked for.
fn made(place: &Place, name: &str, more: &str) {
    place.run_line(&format!("mesh sample:box,h=0.045 -o {name} --no-verify {more}")).succeeds();
    for (field, from) in [
        ("layer", format!("--at vertices --from {LAYER}")),
        ("bump", format!("--at vertices --from {BUMP}")),
        ("quadratic", "--at vertices --from x*x+y*y-2*z*z".to_owned()),
        ("linear", "--at vertices --from 3+x-2*y".to_owned()),
        ("u", "--at vertices --from x*x,y,z --type f32".to_owned()),
        ("mark", "--at vertices --from round(4*x) --type i32".to_owned()),
        ("heat", "--at tets --from x*x".to_owned()),
        ("hole", "--at vertices --from 1/(x-x)".to_owned()),
    ] {
        place.run_line(&format!("field {name} add {field} {from}")).succeeds();
    }
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

/// The root mean square of what a function differs from its linear interpolation in the middle of tetrahedra, and their number.
fn error(place: &Place, store: &str) -> (f64, usize) {
    place.run_line(&format!("export {store} m.npy")).succeeds();
    let points = doubles(place, "m_points.npy");
    let bytes = std::fs::read(place.path("m_tets.npy")).expect("an array");
    let from = 10 + usize::from(bytes[8]) + 256 * usize::from(bytes[9]);
    let size = if bytes[..from].windows(2).any(|two| two == b"i8") { 8 } else { 4 };
    let index = |b: &[u8]| b.iter().rev().fold(0usize, |n, &byte| n << 8 | usize::from(byte));
    let tets: Vec<usize> = bytes[from..].chunks_exact(size).map(index).collect();
    let middle = glam::DVec3::new(0.4, 0.5, 0.5);
    let f = |p: glam::DVec3| (-p.distance_squared(middle) / 0.02).exp();
    let (mut sum, mut volumes) = (0.0, 0.0);
    for tet in tets.chunks(4) {
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| {
            let at = 3 * tet[i];
            glam::DVec3::new(points[at], points[at + 1], points[at + 2])
        });
        let volume = (b - a).dot((c - a).cross(d - a)) / 6.0;
        let mean = [a, b, c, d].iter().map(|&p| f(p)).sum::<f64>() / 4.0;
        sum += volume * (mean - f((a + b + c + d) / 4.0)).powi(2);
        volumes += volume;
    }
    ((sum / volumes).sqrt(), tets.len() / 4)
}

/// Second derivatives that are everywhere the same ask for one length, and those of a layer for lengths that grow with it.
#[test]
fn lengths_follow_known_second_derivatives() {
    let place = Place::new();
    made(&place, "a.tetdb", "");
    let plan = |more: &str| {
        let line = format!("adapt a.tetdb --factor 1 --dry-run --json {more}");
        place.run_line(&line).succeeds().json()["plan"].clone()
    };
    // The surface keeps its lengths, about 0.045, and the gradation binds the others to them.
    for how in ["hessian", "jump"] {
        let flat = plan(&format!("--field quadratic --estimate {how}"));
        let [least, greatest] = [0, 1].map(|i| number(&flat["sizes"][i]));
        assert!(least > 0.033 && greatest < 0.066, "{how}: {flat}");
        let steep = plan(&format!("--field layer --estimate {how}"));
        let [least, greatest] = [0, 1].map(|i| number(&steep["sizes"][i]));
        assert!(greatest > 3.0 * least, "{how}: {steep}");
        assert_eq!(steep["subdomains"][0]["is_changed"], true);
    }
    // Limits bind.
    let narrow = plan("--field layer --hmin 0.04 --hmax 0.05");
    assert!(number(&narrow["sizes"][0]) > 0.0399 && number(&narrow["sizes"][1]) < 0.066);
}

/// Of a steep field all lengths are at a limit for many factors; those in between are found all the same.
#[test]
fn lengths_of_steep_fields_are_found_between_limits() {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.05 -o a.tetdb --subdomains 2 --no-verify").succeeds();
    for (field, slope) in [("u", 100), ("v", 60)] {
        let line = format!("field a.tetdb add {field} --at vertices --from exp(-{slope}*x)");
        place.run_line(&line).succeeds();
        for factor in [1.0, 1.5] {
            let line = format!("adapt a.tetdb --field {field} --factor {factor} --hmin 0.013");
            let answer = place.run_line(&format!("{line} --dry-run --json")).succeeds().json();
            let plan = &answer["plan"];
            let share = number(&plan["predicted_tets"]) / number(&plan["wanted_tets"]);
            assert!((share - 1.0).abs() < 0.02, "{field}, {factor}: {plan}");
        }
    }
    // Where the limits allow no such number, it is the nearest.
    let line = "adapt a.tetdb --field u --factor 100 --hmin 0.03 --dry-run --json";
    let plan = place.run_line(line).succeeds().json()["plan"].clone();
    assert!(number(&plan["predicted_tets"]) < 0.1 * number(&plan["wanted_tets"]), "{plan}");
    let [least, greatest] = [0, 1].map(|i| number(&plan["sizes"][i]));
    assert!((least - 0.03).abs() < 1e-9 && greatest < 0.06, "{plan}");
}

/// The number of tetrahedra is about the one asked for, the error below that of a uniform mesh of as many, and `--undo` brings back all.
#[test]
fn tetrahedra_are_as_many_as_asked_for_and_where_they_are_needed() {
    let place = Place::new();
    made(&place, "a.tetdb", "");
    let (first, n_first) = error(&place, "a.tetdb");
    let mut before = String::new();
    for (tets, n) in [("200k", 200e3), ("80000", 80e3)] {
        let line = format!("adapt a.tetdb --field bump --tets {tets} --json");
        before = place.digest("a.tetdb");
        let answer = place.run_line(&line).succeeds().json();
        assert!((number(&answer["plan"]["predicted_tets"]) / n - 1.0).abs() < 0.05);
        let (last, n_last) = error(&place, "a.tetdb");
        assert!((n_last as f64 / n - 1.0).abs() < 0.15, "{n_last} {tets}");
        // With equal lengths the error of values falls with the number to the power of two thirds.
        let uniform = first * (n_first as f64 / n_last as f64).powf(2.0 / 3.0);
        assert!(last < 0.4 * uniform, "{last} {uniform} of {n_last}");
    }
    place.run_line("verify a.tetdb --full").succeeds();
    place.run_line("resaturate a.tetdb --undo").succeeds();
    assert_eq!(before, place.digest("a.tetdb"));
}

#[test]
fn the_mesh_is_the_same_for_any_threads_and_memory() {
    let place = Place::new();
    let mut digests = Vec::new();
    for (store, how) in
        [("a.tetdb", "--threads 1 --memory 64MiB"), ("b.tetdb", "--threads 2 --memory 1GiB")]
    {
        made(&place, store, "--subdomains 3");
        let line = format!("adapt {store} --field layer --factor 1.5 {how}");
        place.run_line(&line).succeeds();
        place
            .run_line(&format!("adapt {store} --field u.x --estimate jump --factor 1 {how}"))
            .succeeds();
        digests.push(place.digest(store));
    }
    assert_eq!(digests[0], digests[1]);
}

#[test]
fn what_has_no_derivatives_is_refused() {
    let place = Place::new();
    made(&place, "a.tetdb", "");
    let before = place.digest("a.tetdb");
    for (line, code, exit, said) in [
        ("--field mark --factor 1", "bad-field", 3, "integers"),
        ("--field heat --factor 1", "bad-field", 3, "at tetrahedra"),
        ("--field linear --factor 1", "bad-field", 3, "linear"),
        ("--field u --factor 1", "bad-field", 3, "3 numbers"),
        ("--field u.w --factor 1", "bad-field", 3, "no component"),
        ("--field hole --factor 1", "bad-field", 3, "not finite"),
        ("--field nothing --factor 1", "no-such-part", 3, "there are layer"),
        ("--field layer --factor 1 --hmin 0.1 --hmax 0.05", "bad-size", 2, "above"),
        ("--field layer --factor -1", "bad-size", 2, "above 0"),
        ("--field layer --factor 1 --change 1", "bad-size", 2, "above 1"),
        ("--field layer --tets 5q", "usage", 2, "5M"),
        ("--field layer", "usage", 2, "--tets"),
    ] {
        let done = place.run_line(&format!("adapt a.tetdb {line} --json"));
        let error = done.error();
        assert_eq!((error["code"].as_str(), done.exit()), (Some(code), Some(exit)), "{error}");
        assert!(error["message"].as_str().is_some_and(|text| text.contains(said)), "{error}");
        let helps = error["help"].as_str().is_some_and(|help| !help.is_empty());
        // The message lists the fields that there are.
        assert!(helps || code == "no-such-part", "{error}");
    }
    assert_eq!(before, place.digest("a.tetdb"));
}
