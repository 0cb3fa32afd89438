//! Files of points are read the same way by every option, or refused with both readings.
//!
//! Why: a decimal comma or a number in front makes other points of a file, and nothing shows it.
//! How: one point in several dialects for each option; lines with two readings.

use super::place::Place;

#[test]
fn points_are_the_same_in_every_dialect_and_option() {
    let place = Place::new();
    place.write("a.csv", "0.25,0.5,0.75,probe\n");
    place.write(
        "b.csv",
        b"\xef\xbb\xbfX [m];Y [m];Z [m];Name\r\n0,25;0,5;0,75;probe\r\n".as_slice(),
    );
    place.write("c.txt", "id\tlabel\tz\ty\tx\n12\tprobe\t0,75\t0,5\t0,25\n");
    let mut digests = Vec::new();
    for file in ["a.csv", "b.csv", "c.txt"] {
        let line = format!(
            "mesh sample:box,h=0.5 -o p.tetdb --force --embed-points {file} --name {file}=in"
        );
        place.run_line(&line).succeeds();
        digests.push(place.digest("p.tetdb"));
        let named = place.run_line("query p.tetdb --json --label in").succeeds();
        assert!(!named.stdout().is_empty(), "{file}");
        let answer = place.run_line(&format!("query p.tetdb --csv --points {file}")).succeeds();
        assert!(answer.stdout().contains("\n0.25,0.5,0.75,"), "{file}: {}", answer.stdout());
        assert!(answer.stderr().contains("without their names"), "{}", answer.stderr());
        let line = format!("mesh sample:box,h=0.5 -o s.tetdb --force --seeds {file}");
        place.run_line(&line).succeeds();
        let info = place.run_line("info s.tetdb --json").succeeds().json();
        assert_eq!(info["regions"][0]["name"], "probe", "{file}");
    }
    digests.dedup();
    assert_eq!(digests.len(), 1);
}

#[test]
fn lines_with_two_readings_are_refused_by_every_option() {
    let place = Place::new();
    place.write("ids.txt", "# stations\n1 0.25 0.5 0.75\n2 0.5 0.5 0.5\n");
    place.run_line("mesh sample:box,h=0.5 -o a.tetdb").succeeds();
    for (line, code) in [
        ("mesh sample:box,h=0.5 -o b.tetdb --embed-points ids.txt", "unexpected-text"),
        ("mesh sample:box,h=0.5 -o b.tetdb --seeds ids.txt", "bad-seed"),
        ("query a.tetdb --points ids.txt", "unexpected-text"),
    ] {
        let run = place.run_line(&format!("{line} --json"));
        let error = run.error();
        assert_eq!((run.exit(), error["code"].as_str()), (Some(3), Some(code)), "{error}");
        assert!(error["where"].as_str().is_some_and(|p| p.ends_with("ids.txt, line 2")), "{error}");
        let message = error["message"].as_str().unwrap_or_default();
        assert!(message.contains("x 1, y 0.25") && message.contains("x 0.25, y 0.5"), "{message}");
        assert!(error["help"].as_str().is_some_and(|h| h.contains("id x y z")), "{error}");
    }
    assert!(!place.path("b.tetdb").exists());
}
