//! Refusals before anything is written: too little memory, too little disk.

use std::path::{Path, PathBuf};
use tetdb_schema::code::Code;

use super::error::{Error, Remedy};
use super::{Settings, show_bytes};
use crate::pipeline::{self, Estimate, REFUSED_BELOW};
use tetdb_base::geom::short;
use tetdb_base::storage::{ScratchSpace, available_bytes, n_threads};
use tetdb_base::surface::Surface;

/// The part of `cap` that a surface leaves free, with scratch files in the folder that holds the store.
pub fn scratch_beside(surface: &Surface, cap: u64, store: &Path) -> Result<ScratchSpace, Error> {
    let folder = folder_of(store)
        .ok_or_else(|| Error::new(Code::Io, "there is no folder above it").at(store.display()))?;
    Ok(ScratchSpace::new(cap.saturating_sub(surface.bytes() as u64), &folder))
}

/// Refuses a surface that leaves too little of `cap`, before any work on it.
pub fn surface_fits(surface: &Surface, cap: u64) -> Result<(), Error> {
    let least = pipeline::least_for(surface);
    if cap >= least {
        return Ok(());
    }
    let message = format!(
        "the surface alone takes {}: with a cap of {} too little is left for the mesh",
        show_bytes(surface.bytes() as u64),
        show_bytes(cap)
    );
    Err(Error::new(Code::Memory, message).with_remedy(Remedy::Memory(least)))
}

/// Refuses a mesh that memory or disk cannot hold.
pub fn preflight(
    estimate: &Estimate,
    cap: u64,
    store: &Path,
    settings: &Settings,
) -> Result<(), Error> {
    let least = estimate.memory_least_bytes();
    if cap < least {
        let message = format!(
            "the surface and its size field take {}: with a cap of {} too little is left for the mesh",
            show_bytes(estimate.resident_bytes(cap)),
            show_bytes(cap)
        );
        return Err(Error::new(Code::Memory, message).with_remedy(Remedy::Memory(least)));
    }
    let Some(free) = free_at(store) else {
        return Ok(());
    };
    let needed = estimate.disk_peak_bytes(cap, n_threads());
    if (free as f64) < REFUSED_BELOW * needed as f64 {
        return Err(no_room(estimate.tets(), needed, free).at(store.display()));
    }
    if free < needed {
        settings.warn(format!(
            "the mesh may need {} of disk on the way; {} are free",
            show_bytes(needed),
            show_bytes(free)
        ));
    }
    Ok(())
}

/// The error of a disk that is not expected to hold `tets` tetrahedra.
pub fn no_room(tets: f64, needed: u64, free: u64) -> Error {
    let message = format!(
        "about {} tetrahedra are expected, which need {} of disk on the way; {} are free",
        short(tets.round()),
        show_bytes(needed),
        show_bytes(free)
    );
    Error::new(Code::NoRoom, message)
        .with_help("ask for longer edges, allow more memory, or put the store on another disk")
        .with_remedy(Remedy::General)
}

/// Adds the free disk space to an error of a full disk. With `needed`, the predicted bytes of the whole run, also adds the bytes
/// missing.
pub fn with_free_space(mut error: Error, store: &Path, needed: Option<u64>) -> Error {
    if let (Code::DiskFull, Some(free)) = (error.code(), free_at(store)) {
        error.add(&format!("; {} are free", show_bytes(free)));
        let missing = needed.map_or(0, |n| n.saturating_sub(bytes_on_disk(store) + free));
        if missing > 0 {
            error.add(&format!(", about {} more are needed", show_bytes(missing)));
        }
    }
    error
}

/// Bytes that the files in a folder occupy on disk, if the system reports them; otherwise their lengths.
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

/// The nearest existing folder above a store.
fn folder_of(store: &Path) -> Option<PathBuf> {
    let absolute = std::path::absolute(store).ok()?;
    let above = absolute.ancestors().skip(usize::from(store != Path::new(".")));
    above.into_iter().find(|folder| folder.is_dir()).map(Path::to_owned)
}

/// Free bytes on the disk of a store.
pub fn free_at(store: &Path) -> Option<u64> {
    available_bytes(&folder_of(store)?)
}
