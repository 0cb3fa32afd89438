//! The command `estimate`: predicts a mesh and its cost before a run.

use std::path::Path;

use serde_json::json;

use super::args::EstimateArgs;
use super::console::Console;
use super::failure::{Failure, in_flags};
use super::words::count;
use super::{config, input, memory, threads};
use tetdb_engine::api::{Mesher, default_cap, short};

pub fn run(args: &EstimateArgs, console: &Console) -> Result<u8, Failure> {
    let options = config::options(&args.shape)?;
    let (cap, whence) = match memory::requested(args.memory.as_deref())? {
        Some(cap) => (cap, "--memory".to_owned()),
        None => default_cap(),
    };
    let settings = console.settings(Some(cap), threads::requested(args.threads)?);
    let threads = settings.n_threads();
    let store = args.output.as_deref().unwrap_or(Path::new("."));
    // `cap` belongs to the planned run. The estimate itself needs the surface in memory, however large.
    let wide = console.settings(Some(cap.max(default_cap().0)), args.threads);
    let wide = input::scratch_beside(wide, store);
    let surface = input::load_with(
        &args.surfaces,
        |surface| {
            let how = (&args.repair, &args.remesh);
            input::prepared(surface, how, &options, &wide, console)
        },
        &args.sheets,
        &options,
        &wide,
        console,
    )?;
    surface.validate_with(&wide)?;
    let found = Mesher::with_options(surface, options).settings(settings).predict_at(store)?;
    let (fits_memory, fits_disk) = (found.fits_memory, found.fits_disk());
    if console.is_json() {
        console.answer(&json!({
            "schema": 1,
            "tets": round(found.tets),
            "vertices": round(found.vertices),
            "triangles": found.triangles,
            "subdomains": found.subdomains,
            "sizes": found.sizes.to_string(),
            "size_field": { "leaves": found.sizes.n_leaves, "bytes": found.sizes.bytes },
            "store_bytes": found.store.0,
            "disk_peak_bytes": found.disk_peak.0,
            "disk_free_bytes": found.disk_free.map(|free| free.0),
            "memory_cap_bytes": cap,
            "peak_bytes": found.memory.0,
            "memory_least_bytes": found.memory_least.0,
            "memory_full_bytes": found.memory_full.0,
            "threads": threads,
            "wall_s": found.seconds,
            "workers": args.workers.map(|n| {
                let of = found.workers(n);
                json!({
                    "n": n, "wall_s": of.wall_s, "serial_s": of.serial_s, "cuts_s": of.cuts_s,
                    "subdomains_s": of.subdomains_s, "wall_least_s": of.wall_least_s,
                })
            }),
            "fits": { "memory": fits_memory, "disk": fits_disk },
        }));
        return Ok(0);
    }
    console.line(&found.sizes.to_string());
    for warning in &found.sizes.warnings {
        console.warn(&in_flags(warning));
    }
    console.line(&format!(
        "about {} tetrahedra and {} vertices from {} triangles, in {}",
        round(found.tets),
        round(found.vertices),
        found.triangles,
        match found.subdomains {
            1 => "one piece".to_owned(),
            n => format!("{n} sub-domains"),
        }
    ));
    let (least, full) = (found.memory_least, found.memory_full);
    console.line(&format!(
        "memory: {} with a cap of {} ({whence}); the smallest cap is {least}{}",
        found.memory,
        memory::show(cap),
        match full > least {
            true => format!(", and more than {full} brings nothing"),
            false => String::new(),
        }
    ));
    let free = found.disk_free.map_or(String::new(), |free| format!("; {free} are free"));
    console.line(&format!(
        "disk: {} at most on the way, {} for the finished store{free}",
        found.disk_peak, found.store
    ));
    let seconds = |s: f64| short(s.max(1.0).round());
    console.line(&format!(
        "time: about {} s on {} of a 2.6 GHz server; needle-shaped triangles make it longer",
        seconds(found.seconds),
        count(threads as u64, "thread")
    ));
    if let Some(n) = args.workers {
        let of = found.workers(n);
        console.line(&format!(
            "time: about {} s with {}, of these {} for what one process does, {} for cuts, {} for sub-domains; no number of them takes less than {} s",
            seconds(of.wall_s),
            count(n, "worker"),
            seconds(of.serial_s),
            seconds(of.cuts_s),
            seconds(of.subdomains_s),
            seconds(of.wall_least_s),
        ));
    }
    console.line(match (fits_memory, fits_disk) {
        (true, true) => "fits: yes",
        (true, false) => "fits: no, the disk is too small",
        (false, true) => "fits: no, the memory cap is too small",
        (false, false) => "fits: no, neither memory nor disk hold it",
    });
    Ok(0)
}

fn round(x: f64) -> u64 {
    x.round() as u64
}
