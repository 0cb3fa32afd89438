//! `estimate`, and the look at disk and memory before `mesh` begins.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::args::EstimateArgs;
use super::console::Console;
use super::failure::Failure;
use super::input::Space;
use super::{background, config, input, memory};
use crate::pipeline::{self, Estimate};
use crate::storage::available_bytes;
use crate::surface::Surface;

/// A mesh is refused when less than this share of the disk it is expected to take is free: predictions may be that far off.
const REFUSED_BELOW: f64 = 0.7;

pub fn run(args: &EstimateArgs, console: &Console) -> Result<u8, Failure> {
    let options = config::options(&args.shape)?;
    options.sizes()?;
    let (cap, whence) = memory::cap(args.memory.as_deref())?;
    let threads = args.threads.unwrap_or_else(rayon::current_num_threads);
    let store = args.output.as_deref().unwrap_or(Path::new("."));
    let space = Space::Capped(cap, store);
    let input = input::load_valid(&args.surfaces, space, console)?;
    let background = background::read(&options, cap)?;
    let room = space.room(&input.surface)?;
    let prepared = pipeline::prepare(&input.surface, &options, background.as_ref(), &room)?;
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
            "fits": { "memory": fits_memory, "disk": fits_disk },
        }));
        return Ok(0);
    }
    console.line(&prepared.sizes.to_string());
    for warning in &prepared.sizes.warnings {
        console.line(&format!("warning: {warning}"));
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
    console.line(&format!(
        "memory: {} with a cap of {} ({whence}); the smallest cap is {}, and more than {} brings nothing",
        memory::show(estimate.memory_bytes(cap, threads)),
        memory::show(cap),
        memory::show(estimate.memory_least_bytes()),
        memory::show(estimate.memory_full_bytes(threads)),
    ));
    let free = disk_free.map_or(String::new(), |free| {
        format!("; {} are free", memory::show(free))
    });
    console.line(&format!(
        "disk: {} while it is made, {} for the finished store{free}",
        memory::show(disk),
        memory::show(estimate.store_bytes()),
    ));
    console.line(&format!(
        "time: about {:.0} s on {threads} threads of a 2.6 GHz server; needles in the surface make it more",
        estimate.seconds(threads).max(1.0)
    ));
    console.line(match (fits_memory, fits_disk) {
        (true, true) => "fits: yes",
        (true, false) => "fits: no, the disk is too small",
        (false, true) => "fits: no, the memory cap is too small",
        (false, false) => "fits: no, neither memory nor disk hold it",
    });
    Ok(0)
}

/// Refuses a surface that leaves too little of the cap, before anything is made of it.
pub fn surface_fits(surface: &Surface, cap: u64) -> Result<(), Failure> {
    let least = pipeline::least_for(surface);
    if cap >= least {
        return Ok(());
    }
    let message = format!(
        "the surface alone takes {}: with a cap of {} too little is left for the mesh",
        memory::show(surface.bytes() as u64),
        memory::show(cap)
    );
    let help = format!("give at least --memory {}MiB", least.div_ceil(1 << 20));
    Err(Failure::new("memory", message).help(help))
}

/// Refuses a mesh that memory or disk cannot hold, before anything is written.
pub fn preflight(
    estimate: &Estimate,
    cap: u64,
    store: &Path,
    console: &Console,
) -> Result<(), Failure> {
    let least = estimate.memory_least_bytes();
    if cap < least {
        let message = format!(
            "the surface and its size field take {}: with a cap of {} too little is left for the mesh",
            memory::show(estimate.resident_bytes(cap)),
            memory::show(cap)
        );
        let help = format!("give at least --memory {}MiB", least.div_ceil(1 << 20));
        return Err(Failure::new("memory", message).help(help));
    }
    let Some(free) = free_at(store) else {
        return Ok(());
    };
    let needed = estimate.disk_peak_bytes(cap, rayon::current_num_threads());
    if (free as f64) < REFUSED_BELOW * needed as f64 {
        let message = format!(
            "about {:.3e} tetrahedra are expected, which need {} of disk while they are made; {} are free",
            estimate.tets(),
            memory::show(needed),
            memory::show(free)
        );
        return Err(Failure::new("no-room", message)
            .at(store.display())
            .help("`tetdb estimate SURFACE` tells what a mesh takes; ask for longer edges (--hsiz), give more --memory, or put the store on another disk with -o"));
    }
    if free < needed {
        console.note(&format!(
            "warning: the mesh may need {} of disk while it is made; {} are free",
            memory::show(needed),
            memory::show(free)
        ));
    }
    Ok(())
}

/// Says of a full disk what is missing: what is free, and what a run that is expected to need `needed` bytes in all still lacks.
pub fn with_room(mut failure: Failure, store: &Path, needed: Option<u64>) -> Failure {
    if let ("disk-full", Some(free)) = (failure.code, free_at(store)) {
        failure.message += &format!("; {} are free", memory::show(free));
        let missing = needed.map_or(0, |n| n.saturating_sub(bytes_on_disk(store) + free));
        if missing > 0 {
            failure.message += &format!(", about {} more are needed", memory::show(missing));
        }
    }
    failure
}

/// Bytes that files in a folder take up, where the system tells; else their lengths.
fn bytes_on_disk(dir: &Path) -> u64 {
    let entries = std::fs::read_dir(dir).into_iter().flatten().flatten();
    let bytes = entries.map(|entry| match entry.metadata() {
        Ok(metadata) if metadata.is_dir() => bytes_on_disk(&entry.path()),
        #[cfg(unix)]
        Ok(metadata) => std::os::unix::fs::MetadataExt::blocks(&metadata) * 512,
        #[cfg(not(unix))]
        Ok(metadata) => metadata.len(),
        Err(_) => 0,
    });
    bytes.sum()
}

/// The nearest folder that exists.
pub fn folder_of(store: &Path) -> Option<PathBuf> {
    let absolute = std::path::absolute(store).ok()?;
    let above = absolute
        .ancestors()
        .skip(usize::from(store != Path::new(".")));
    above
        .into_iter()
        .find(|folder| folder.is_dir())
        .map(Path::to_owned)
}

/// Bytes free where a store would be made.
fn free_at(store: &Path) -> Option<u64> {
    available_bytes(&folder_of(store)?)
}

fn round(x: f64) -> u64 {
    x.round() as u64
}
