//! Free space of a disk.

use std::path::Path;

/// Bytes free on the disk of `dir`, if the system reports them.
#[cfg(unix)]
pub fn available_bytes(dir: &Path) -> Option<u64> {
    let disk = rustix::fs::statvfs(dir).ok()?;
    Some(disk.f_bavail.saturating_mul(disk.f_frsize))
}

/// Elsewhere a full disk is found while writing.
#[cfg(not(unix))]
pub fn available_bytes(_: &Path) -> Option<u64> {
    None
}
