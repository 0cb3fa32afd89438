//! Long campaigns against the store, seeded and unattended.
//!
//! ```text
//! soak MODE RESULTS [--seed N] [--items N] [--minutes N] [--program PATH] [--model box|faults|wells]
//! ```
//! Modes: `kills`, `flips`, `swaps`, `races` and `readers` (of the program at PATH), `images`, `faults`, `deaths`, `space` (of the library, on a disk in memory). Each item
//! appends a line of JSON to the file RESULTS; a campaign that was stopped goes on behind its last line. Exit 1 when something was wrong.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tetdb_tools::soak::{Item, Mode, Model};

struct Args {
    mode: String,
    results: PathBuf,
    seed: u64,
    items: u64,
    minutes: u64,
    program: PathBuf,
    model: String,
}

fn args() -> Option<Args> {
    let mut words = std::env::args().skip(1);
    let mut args = Args {
        mode: words.next()?,
        results: words.next()?.into(),
        seed: 1,
        items: u64::MAX,
        minutes: u64::MAX / 60,
        program: "tetdb".into(),
        model: "box".to_owned(),
    };
    while let Some(word) = words.next() {
        let value = words.next()?;
        match word.as_str() {
            "--seed" => args.seed = value.parse().ok()?,
            "--items" => args.items = value.parse().ok()?,
            "--minutes" => args.minutes = value.parse().ok()?,
            "--program" => args.program = value.into(),
            "--model" => args.model = value,
            _ => return None,
        }
    }
    Some(args)
}

/// The first item that has no line yet.
fn first_item(args: &Args) -> u64 {
    let text = std::fs::read_to_string(&args.results).unwrap_or_default();
    let lines = text.lines().filter_map(|l| serde_json::from_str::<Value>(l).ok());
    let ours = lines
        .filter(|l| l["mode"] == args.mode && l["seed"] == args.seed && l["model"] == args.model);
    ours.filter_map(|l| l["item"].as_u64()).max().map_or(0, |last| last + 1)
}

fn main() -> ExitCode {
    let Some(args) = args() else {
        eprintln!(
            "soak MODE RESULTS [--seed N] [--items N] [--minutes N] [--program PATH] [--model NAME]"
        );
        return ExitCode::from(2);
    };
    let first = first_item(&args);
    let Some(model) = Model::called(&args.model) else {
        eprintln!("models: box, faults, wells");
        return ExitCode::from(2);
    };
    let Some(mut mode) = Mode::new(&args.mode, &args.program, &model) else {
        eprintln!("modes: kills, flips, swaps, races, readers, images, faults, deaths, space");
        return ExitCode::from(2);
    };
    // Panics are caught and counted.
    std::panic::set_hook(Box::new(|_| {}));
    let end = Instant::now() + Duration::from_secs(60 * args.minutes.min(1 << 20));
    let mut n_wrong = 0;
    for item in first..args.items.min(mode.items()) {
        if Instant::now() > end {
            break;
        }
        let clock = Instant::now();
        let Item { counts, wrong } = mode.item(args.seed, item);
        n_wrong += wrong.len();
        let line = json!({
            "mode": args.mode, "model": args.model, "seed": args.seed, "item": item, "counts": counts, "wrong": wrong,
            "seconds": clock.elapsed().as_secs_f64(),
        });
        let file = OpenOptions::new().create(true).append(true).open(&args.results);
        if let Err(e) = file.and_then(|mut f| writeln!(f, "{line}")) {
            eprintln!("{}: {e}", args.results.display());
            return ExitCode::from(2);
        }
        for text in &wrong {
            println!("item {item}: {text}");
        }
    }
    ExitCode::from(u8::from(n_wrong > 0))
}
