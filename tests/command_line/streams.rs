//! Pipes, compressed files, and endless inputs.
//!
//! Why: a surface often comes from another program, compressed or not. A device without end must not fill the memory.
//! How: surfaces are passed in every supported way. Endless and pathological inputs must be refused soon, with a place.

use std::io::Write;
use std::process::Stdio;

use super::place::{Place, TETRA, program};

/// CRC-32 and a stored block: gzip without compression.
fn gzip(bytes: &[u8]) -> Vec<u8> {
    let crc = !bytes.iter().fold(!0u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |c, _| c >> 1 ^ (0xedb8_8320 & (c & 1).wrapping_neg()))
    });
    let length = bytes.len() as u16;
    let mut out = vec![0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 255, 1];
    out.extend(length.to_le_bytes());
    out.extend((!length).to_le_bytes());
    out.extend(bytes);
    out.extend(crc.to_le_bytes());
    out.extend((bytes.len() as u32).to_le_bytes());
    out
}

#[test]
fn packed_surfaces_are_the_surfaces_they_hold() {
    let place = Place::new();
    place.write("part.off", TETRA);
    place.write("part.off.gz", gzip(TETRA.as_bytes()));
    place.write("part.off.zst", zstd::bulk::compress(TETRA.as_bytes(), 3).expect("room"));
    for (k, name) in ["part.off", "part.off.gz", "part.off.zst"].iter().enumerate() {
        place.run_line(&format!("mesh {name} -o {k}.tetdb")).succeeds();
        place.run_line(&format!("verify {k}.tetdb")).succeeds();
        assert_eq!(place.digest("0.tetdb"), place.digest(&format!("{k}.tetdb")));
        let labels = place.run_line(&format!("info {k}.tetdb --json")).json()["labels"].clone();
        assert_eq!(labels, serde_json::json!(["part"]));
    }
}

#[test]
fn what_unpacks_to_more_than_its_share_of_memory_is_refused() {
    let place = Place::new();
    let zeros = zstd::bulk::compress(&vec![b' '; 40 << 20], 3).expect("room");
    place.write("bomb.off.zst", zeros);
    let error = place.run_line("mesh bomb.off.zst --memory 64MiB --json").error();
    assert_eq!(error["code"], "memory", "{error}");
    place.write("cut.off.gz", &gzip(TETRA.as_bytes())[..40]);
    let error = place.run_line("check cut.off.gz --json").error();
    assert_eq!(error["code"], "unreadable-file", "{error}");
}

#[test]
fn a_surface_may_come_by_the_standard_input() {
    let place = Place::new();
    let mut texts = vec![TETRA.as_bytes().to_vec()];
    for format in ["stl", "ply", "off"] {
        let line = format!("sample box,h=0.5 -o - --format {format}");
        texts.push(place.run_line(&line).succeeds().stdout_bytes());
    }
    for text in texts {
        let mut command = place.command(&["check", "-"]);
        let mut child = command.stdin(Stdio::piped()).spawn().expect("it starts");
        let mut input = child.stdin.take().expect("a pipe");
        input.write_all(&text).expect("it reads");
        drop(input);
        let output = child.wait_with_output().expect("it ends");
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success() && said.contains("it can be meshed"), "{said}");
    }
}

#[test]
fn endless_and_enormous_inputs_are_refused_at_once() {
    let place = Place::new();
    place.write("part.off", TETRA);
    place.run_line("mesh part.off").succeeds();
    let long = "# a comment\n".repeat(20 << 16);
    place.write("long.toml", long);
    let made = std::process::Command::new("mkfifo").arg(place.path("pipe.sol")).status();
    assert!(made.is_ok_and(|made| made.success()), "mkfifo works here");
    for (line, code) in [
        ("check /dev/zero", "unreadable-file"),
        ("mesh part.off --config /dev/zero", "unreadable-file"),
        ("mesh part.off --config pipe.sol", "unreadable-file"),
        ("mesh part.off --config long.toml", "unreadable-file"),
        ("mesh part.off --size-field pipe.sol", "unreadable-file"),
        ("query part.tetdb --points /dev/zero", "unreadable-file"),
        ("verify part.tetdb --against /dev/urandom", "unreadable-file"),
    ] {
        let words: Vec<&str> = line.split(' ').chain(["--json"]).collect();
        let mut command = std::process::Command::new("timeout");
        command.arg("20").arg(program()).args(words);
        let command = command.current_dir(place.path("."));
        let output = command.output().expect("it starts");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(said.contains(code), "{line}: {:?} {said}", output.status);
    }
}

#[test]
fn lengths_that_no_mesh_can_have_are_refused_before_work_begins() {
    let place = Place::new();
    place.run_line("mesh sample:box,h=0.5 -o b.tetdb --no-verify").succeeds();
    let info = place.run_line("info b.tetdb --json").succeeds().json();
    let n = info["subdomains"][0]["vertices"].as_u64().expect("a count");
    let head = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({n},), }}");
    let mut bytes = format!("\u{0}NUMPY\u{1}\u{0}\u{76}\u{0}{head:<117}\n").into_bytes();
    bytes[0] = 0x93;
    (0..n).for_each(|_| bytes.extend_from_slice(&1e-300_f64.to_le_bytes()));
    place.write("h.npy", bytes);
    let mut command = std::process::Command::new("timeout");
    command.arg("20").arg(program()).current_dir(place.path("."));
    let words = "resaturate b.tetdb --subdomain 0 --size-field h.npy --json";
    let output = command.args(words.split(' ')).output();
    let output = output.expect("it starts");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("expected a length"), "{said}");
}

/// A flat polygon with `n` corners, or `n` triangles on one edge.
fn around_a_circle(n: usize, is_polygon: bool) -> String {
    let corner = |k| {
        let (y, x) = (k as f64 / n as f64 * std::f64::consts::TAU).sin_cos();
        format!("{x} {y} 0\n")
    };
    let corners: String = (0..n).map(corner).collect();
    match is_polygon {
        true => {
            let all: Vec<String> = (0..n).map(|k| k.to_string()).collect();
            format!("OFF\n{n} 1 0\n{corners}{n} {}\n", all.join(" "))
        }
        false => {
            let triangles: String = (0..n).map(|k| format!("3 {k} {n} {}\n", n + 1)).collect();
            let head = format!("OFF\n{} {n} 0\n", n + 2);
            format!("{head}{corners}0 0 -1\n0 0 1\n{triangles}")
        }
    }
}

/// Processor time of `check` on a surface with defects; waiting does not count.
fn cpu_seconds_of_a_check(place: &Place, name: &str) -> f64 {
    let line = "TIMEFORMAT='%U %S'; { time \"$0\" check \"$1\" >/dev/null 2>&1; } 2>&1";
    let mut bash = std::process::Command::new("bash");
    bash.args(["-c", line])
        .arg(program())
        .arg(name)
        .env("LC_ALL", "C")
        .current_dir(place.path("."));
    let output = bash.output().expect("bash starts");
    assert_eq!(output.status.code(), Some(3), "check {name}");
    let times = String::from_utf8_lossy(&output.stdout).into_owned();
    let seconds = times.split_whitespace().map(str::parse::<f64>);
    seconds.map(|s| s.expect("a number")).sum()
}

#[test]
fn check_of_four_times_the_corners_or_triangles_takes_no_eight_times_as_long() {
    let place = Place::new();
    for is_polygon in [true, false] {
        let seconds = [3_000, 12_000].map(|n| {
            let name = format!("{n}.off");
            place.write(&name, around_a_circle(n, is_polygon));
            // On a busy machine, even the least of some runs takes longer.
            let one = |_| cpu_seconds_of_a_check(&place, &name);
            (0..3).map(one).fold(f64::INFINITY, f64::min)
        });
        let [few, many] = seconds;
        assert!(many < 8.0 * few, "{is_polygon}: {few} s, {many} s");
    }
}
