//! The command `compare`: two meshes side by side, as in the paper.

use serde_json::json;

use super::args::CompareArgs;
use super::console::Console;
use super::failure::Failure;
use super::memory;
use super::words::{quality_range, worst};
use tetdb_engine::api::{Comparison, Population, Qualities};

/// Exit code if the meshes differ.
pub const DIFFERENT: u8 = 7;

pub fn run(args: &CompareArgs, console: &Console) -> Result<u8, Failure> {
    let settings =
        args.at.of(console.settings(memory::requested(args.read.memory.as_deref())?, None));
    let found = Comparison::of(&args.first, &args.second, &settings)?;
    if console.is_json() {
        let mut answer = json!(found);
        answer["schema"] = json!(1);
        console.answer(&answer);
    } else {
        print(&found.first, &found.second, console);
        console.line(if found.same {
            "the meshes are the same, bit by bit"
        } else {
            "the meshes differ"
        });
    }
    Ok(if found.same { 0 } else { DIFFERENT })
}

pub fn print(a: &Qualities, b: &Qualities, console: &Console) {
    console.line(&format!(
        "{:<14} {:>14} {:>9} {:>14} {:>9} {:>9}",
        "", "first", "", "second", "", "change"
    ));
    let count = |name: &str, a: u64, b: u64| {
        console.line(&format!("{name:<14} {a:>14} {:>9} {b:>14} {:>9} {}", "", "", change(a, b)));
    };
    count("sub-domains", a.subdomains, b.subdomains);
    count("interfaces", a.interface_faces, b.interface_faces);
    for (name, a, b) in [
        ("all", &a.all, &b.all),
        ("not forced", &a.unforced, &b.unforced),
        ("forced", &a.forced, &b.forced),
        ("at interfaces", &a.at_interface, &b.at_interface),
    ] {
        population(name, a, b, console);
    }
}

fn population(name: &str, a: &Population, b: &Population, console: &Console) {
    if a.tets + b.tets == 0 {
        return;
    }
    console.line(&format!(
        "{name:<14} {:>14} {:>9} {:>14} {:>9} {}",
        a.tets,
        "",
        b.tets,
        "",
        change(a.tets, b.tets)
    ));
    for bin in (0..a.bins.len()).filter(|&k| a.bins[k] + b.bins[k] > 0) {
        let points = match a.tets == 0 || b.tets == 0 {
            true => String::new(),
            false => format!("{:>+8.4} points", 100.0 * (b.share(bin) - a.share(bin))),
        };
        console.line(&format!(
            "  {:<12} {:>14} {} {:>14} {} {points}",
            quality_range(bin, a.bins.len()),
            a.bins[bin],
            share(a, bin),
            b.bins[bin],
            share(b, bin)
        ));
    }
    let worst = [a, b].map(|group| match group.tets {
        0 => "-".to_owned(),
        _ => worst(group.worst),
    });
    console.line(&format!("  {:<12} {:>14} {:>9} {:>14}", "worst", worst[0], "", worst[1]));
}

/// The share of a bin in percent; empty without tetrahedra.
fn share(group: &Population, bin: usize) -> String {
    match group.tets {
        0 => format!("{:>9}", ""),
        _ => format!("{:>8.4}%", 100.0 * group.share(bin)),
    }
}

/// The change from `a` to `b` in percent.
fn change(a: u64, b: u64) -> String {
    if a == 0 {
        return String::new();
    }
    format!("{:>+8.2}%", 100.0 * (b as f64 / a as f64 - 1.0))
}
