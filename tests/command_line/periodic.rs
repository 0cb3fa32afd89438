//! `periodic` and `mesh --periodic`: labels whose triangles are the same at two places.
//!
//! Why: a solver joins what the pairs say; one wrong or missing pair is a wrong solution without any sign of it.
//! How: pairs of a box by coordinates, however they were recorded; what is no pair is named; `tests/periodic.py` has the readers.

use super::place::Place;
use serde_json::Value;

const BOX: &str = "sample:box,x=1,y=0.75,z=1.25,h=0.1";
const SIDES: [f64; 3] = [1.0, 0.75, 1.25];

fn pairs(place: &Place, store: &str) -> Value {
    place.run_line(&format!("periodic {store} --json")).succeeds().json()["periodic"].clone()
}

/// The numbers of a `.npy` array, as bytes.
fn array<const N: usize>(place: &Place, name: &str) -> Vec<[u8; N]> {
    let bytes = std::fs::read(place.path(name)).expect("the array was written");
    let head = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    bytes[head..].as_chunks().0.to_vec()
}

fn numbers(place: &Place, name: &str) -> Vec<usize> {
    array(place, name).into_iter().map(|n| i32::from_le_bytes(n) as usize).collect()
}

#[test]
fn pairs_are_the_same_however_they_were_recorded() {
    let place = Place::new();
    let all = "x-low=x-high y-low=y-high 4=5";
    let flags: String = all.split(' ').map(|pair| format!("--periodic {pair} ")).collect();
    place.run_line(&format!("mesh {BOX} -o one.tetdb {flags}")).succeeds();
    let mesh = format!("mesh {BOX} -o two.tetdb --no-verify --hsiz 0.04 --subdomains 2");
    place.run_line(&mesh).succeeds();
    let digest = place.digest("two.tetdb");
    assert_eq!(pairs(&place, "two.tetdb"), serde_json::json!([]));
    place.run_line(&format!("periodic two.tetdb {all} --memory 64MiB")).succeeds();
    assert_eq!(pairs(&place, "one.tetdb"), pairs(&place, "two.tetdb"));
    assert_eq!(place.digest("two.tetdb"), digest);
    for store in ["one", "two"] {
        place.run_line(&format!("export {store}.tetdb {store}.npy {store}.mfem")).succeeds();
        let coordinates = array::<8>(&place, &format!("{store}_points.npy"));
        let point = |v: usize| [0, 1, 2].map(|i| f64::from_le_bytes(coordinates[3 * v + i]));
        let nodes = numbers(&place, &format!("{store}_periodic.npy"));
        let which = numbers(&place, &format!("{store}_periodic_pair.npy"));
        let mut n_low = 0;
        for (pair, axis) in nodes.as_chunks::<2>().0.iter().zip(which) {
            let [mut a, b] = pair.map(point);
            assert_eq!(a[axis], 0.0);
            a[axis] = SIDES[axis];
            assert_eq!(a, b, "{pair:?}");
            n_low += 1;
        }
        let on =
            |side: usize| (0..coordinates.len() / 3).filter(|&v| point(v)[side] == 0.0).count();
        assert_eq!(n_low, on(0) + on(1) + on(2), "a vertex of {store} has no partner");
        let text = std::fs::read_to_string(place.path(&format!("{store}_periodic.csv")));
        let text = text.expect("MFEM has a table beside it");
        assert_eq!(text.lines().count(), n_low + 1);
        // The eight corners are one vertex: seven of them are partners, all with the least of them.
        let is_corner = |v: usize| (0..3).all(|i| point(v)[i] == 0.0 || point(v)[i] == SIDES[i]);
        let least = numbers(&place, &format!("{store}_periodic_least.npy"));
        let corners =
            nodes.as_chunks::<2>().0.iter().zip(&least).filter(|(pair, _)| is_corner(pair[0]));
        let least: Vec<usize> = corners.map(|(_, &least)| least).collect();
        let first = (0..coordinates.len() / 3).find(|&v| is_corner(v));
        assert_eq!((least.len(), least.iter().copied().min()), (12, first));
        assert!(least.iter().all(|&v| Some(v) == first));
    }
    let done = place.run_line("export two.tetdb two.vtkhdf").succeeds();
    assert!(done.stderr().contains("without the periodic pairs"), "{}", done.stderr());
    place.run_line("export two.tetdb flat.vtkhdf --one-partition").succeeds();
    assert!(place.names().contains("flat_periodic.csv"));
    place.run_line("periodic two.tetdb 4=5 --drop").succeeds();
    assert_eq!(pairs(&place, "two.tetdb").as_array().map(Vec::len), Some(2));
    place.run_line(&format!("{mesh} --periodic 4=5")).succeeds();
    assert_eq!(pairs(&place, "two.tetdb").as_array().map(Vec::len), Some(3));
}

#[test]
fn what_is_no_pair_is_refused_with_its_place() {
    let place = Place::new();
    place
        .run_line(&format!("mesh {BOX} -o a.tetdb --periodic x-low=x-high --no-verify"))
        .succeeds();
    let before = pairs(&place, "a.tetdb");
    for (line, code) in [
        ("periodic a.tetdb x-low=y-low", "not-periodic"),
        ("periodic a.tetdb x-low=z-low:rotate", "not-periodic"),
        ("periodic a.tetdb x-high=x-low", "not-periodic"),
        ("periodic a.tetdb y-low=x-high", "not-periodic"),
        ("periodic a.tetdb y-low=y-low", "not-periodic"),
        ("periodic a.tetdb y-low=y-high --periodic-tolerance -1", "usage"),
        ("periodic a.tetdb y-low=y-high --periodic-tolerance nan", "not-periodic"),
        ("periodic a.tetdb y-low=back", "no-such-part"),
        ("periodic a.tetdb y-low=y-high --drop", "no-such-part"),
        ("periodic a.tetdb y-low", "usage"),
    ] {
        let done = place.run_line(&format!("{line} --json"));
        assert_eq!(done.error()["code"], code, "{line}");
        assert_eq!(pairs(&place, "a.tetdb"), before, "{line}");
    }
    let names = place.names();
    let done = place.run_line(&format!("mesh {BOX} -o b.tetdb --periodic x-low=y-low --json"));
    assert_eq!((done.exit(), &done.error()["code"]), (Some(3), &"not-periodic".into()));
    let text = done.error()["message"].as_str().expect("text").to_owned();
    assert!(text.contains("has no partner: moved to ("), "{text}");
    assert!(done.error()["where"].as_str().is_some_and(|at| at.starts_with('(')));
    assert_eq!(place.names(), names);
}

#[test]
fn tolerances_of_any_size_end_in_pairs_or_in_words() {
    let place = Place::new();
    place.run_line(&format!("mesh {BOX} -o a.tetdb --no-verify")).succeeds();
    // Wrong labels, and no distance at all: nothing is looked for without end.
    let done =
        place.run_line("periodic a.tetdb x-low=y-low:translate --periodic-tolerance 0 --json");
    let text = done.error()["message"].as_str().expect("text").to_owned();
    assert!(text.contains("allowed is 0"), "{text}");
    // Farther than vertices are from each other, two have the same partner.
    let done =
        place.run_line("periodic a.tetdb x-low=y-low:translate --periodic-tolerance 9 --json");
    assert_eq!(done.error()["code"], "not-periodic");
    // What is on record stays as it is, and nobody has to wait for it.
    let again = format!("mesh {BOX} -o b.tetdb --no-verify --periodic x-low=x-high");
    place.run_line(&again).succeeds();
    let before = std::fs::read(place.path("b.tetdb").join("catalog.redb")).expect("the catalog");
    place.run_line(&again).succeeds();
    let after = std::fs::read(place.path("b.tetdb").join("catalog.redb")).expect("the catalog");
    assert!(before == after, "the catalog was written");
}
