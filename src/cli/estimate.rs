//! `estimate`, and the look at disk and memory before `mesh` begins.

use std::path::Path;

use serde_json::json;

use super::args::EstimateArgs;
use super::console::Console;
use super::failure::{Failure, in_flags};
use super::input::Space;
use super::words::count;
use super::{config, input, memory, threads};
use tetdb_base::geom::short;
use tetdb_base::storage::n_threads;
use tetdb_engine::api::job::take_seeds;
use tetdb_engine::api::preflight::free_at;
use tetdb_engine::api::{default_cap, divide, predict};

pub fn run(args: &EstimateArgs, console: &Console) -> Result<u8, Failure> {
    let mut options = config::options(&args.shape)?;
    let (cap, whence) = match memory::asked(args.memory.as_deref())? {
        Some(cap) => (cap, "--memory".to_owned()),
        None => default_cap(),
    };
    let threads = threads::asked(args.threads)?.unwrap_or_else(n_threads);
    let store = args.output.as_deref().unwrap_or(Path::new("."));
    // The cap is that of the run to come; what is said of it needs the surface, however large.
    let space = Space { cap: cap.max(default_cap().0), beside: store };
    let mut surface =
        input::load_valid(&args.surfaces, (&args.sheets, options.refine_surface), space, console)?;
    take_seeds(&mut options, &surface.inner.seeds);
    if options.refine_surface {
        let settings = console.settings(Some(cap), args.threads);
        divide(&mut surface, &options.clone().into(), None, cap, store, &settings)?;
    }
    let options = options.into();
    let prepared = predict(&surface.inner, &options, cap, store)?;
    let estimate = &prepared.estimate;
    let disk_free = free_at(store);
    let disk = estimate.disk_peak_bytes(cap, threads);
    let fits_memory = cap >= estimate.memory_least_bytes();
    let fits_disk = disk_free.is_none_or(|free| free >= disk);
    if console.is_json() {
        console.answer(&json!({
            "schema": 1,
            "tets": round(estimate.tets()),
            "vertices": round(estimate.vertices),
            "triangles": estimate.triangles,
            "subdomains": estimate.subdomains,
            "sizes": prepared.sizes.to_string(),
            "size_field": { "leaves": prepared.sizes.n_leaves, "bytes": prepared.sizes.bytes },
            "store_bytes": estimate.store_bytes(),
            "disk_peak_bytes": disk,
            "disk_free_bytes": disk_free,
            "memory_cap_bytes": cap,
            "peak_bytes": estimate.memory_bytes(cap, threads),
            "memory_least_bytes": estimate.memory_least_bytes(),
            "memory_full_bytes": estimate.memory_full_bytes(threads),
            "threads": threads,
            "wall_s": estimate.seconds(threads),
            "workers": args.workers.map(|n| {
                let forecast = estimate.forecast(n);
                json!({
                    "n": n, "wall_s": forecast.wall_s(), "serial_s": forecast.serial_s, "cuts_s": forecast.cuts_s,
                    "subdomains_s": forecast.subdomains_s, "wall_least_s": estimate.forecast(u32::MAX).wall_s(),
                })
            }),
            "fits": { "memory": fits_memory, "disk": fits_disk },
        }));
        return Ok(0);
    }
    console.line(&prepared.sizes.to_string());
    for warning in &prepared.sizes.warnings {
        console.warn(&in_flags(warning));
    }
    console.line(&format!(
        "about {} tetrahedra and {} vertices from {} triangles, in {}",
        round(estimate.tets()),
        round(estimate.vertices),
        estimate.triangles,
        match estimate.subdomains {
            1 => "one piece".to_owned(),
            n => format!("{n} sub-domains"),
        }
    ));
    let (least, full) = (estimate.memory_least_bytes(), estimate.memory_full_bytes(threads));
    console.line(&format!(
        "memory: {} with a cap of {} ({whence}); the smallest cap is {}{}",
        memory::show(estimate.memory_bytes(cap, threads)),
        memory::show(cap),
        memory::show(least),
        match full > least {
            true => format!(", and more than {} brings nothing", memory::show(full)),
            false => String::new(),
        }
    ));
    let free = disk_free.map_or(String::new(), |free| format!("; {} are free", memory::show(free)));
    console.line(&format!(
        "disk: {} at most on the way, {} for the finished store{free}",
        memory::show(disk),
        memory::show(estimate.store_bytes()),
    ));
    console.line(&format!(
        "time: about {} s on {} of a 2.6 GHz server; needle-shaped triangles make it longer",
        short(estimate.seconds(threads).max(1.0).round()),
        count(threads as u64, "thread")
    ));
    if let Some(n) = args.workers {
        let forecast = estimate.forecast(n);
        let seconds = |s: f64| short(s.max(1.0).round());
        console.line(&format!(
            "time: about {} s with {}, of these {} for what one process does, {} for cuts, {} for sub-domains; no number of them takes less than {} s",
            seconds(forecast.wall_s()),
            count(n, "worker"),
            seconds(forecast.serial_s),
            seconds(forecast.cuts_s),
            seconds(forecast.subdomains_s),
            seconds(estimate.forecast(u32::MAX).wall_s()),
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
