//! Files in the making: a folder beside the output, removed whatever happens; rename when all are whole.

use crate::store::available_bytes;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use super::{Result, WriteError};

/// Numbers drafts within the process.
static NUMBER: AtomicU32 = AtomicU32::new(0);

/// A hidden folder beside the output that holds unfinished files and scratch.
///
/// Invariant: what it holds counts for nobody until [`Draft::publish`]; dropped, it leaves nothing.
pub(super) struct Draft {
    dir: PathBuf,
    /// Unfinished files and where they belong.
    files: Vec<(PathBuf, PathBuf)>,
}

impl Draft {
    /// Makes the folder for `out`. Errors: its place does not exist or may not be written.
    pub fn new(out: &Path) -> Result<Self> {
        let name = out.file_name().unwrap_or_default().to_string_lossy();
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let dir = folder(out).join(format!(".{name}.{}-{number}.tmp", std::process::id()));
        if out.is_dir() {
            let source = std::io::Error::from(std::io::ErrorKind::IsADirectory);
            return Err(WriteError::io(out, source));
        }
        fs::create_dir(&dir).map_err(|e| WriteError::io(out, e))?;
        let files = Vec::new();
        Ok(Self { dir, files })
    }

    /// The folder, for scratch.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// A new file that will become `out`, expected to need `bytes`.
    ///
    /// Errors: less than that is free; the file cannot be made.
    pub fn create(&mut self, out: &Path, bytes: u64) -> Result<PathBuf> {
        if let Some(available) = available_bytes(&self.dir).filter(|&free| free < bytes) {
            return Err(WriteError::NoSpace {
                path: out.to_owned(),
                needed: bytes,
                available,
            });
        }
        let path = self.dir.join(format!("out-{}", self.files.len()));
        File::create_new(&path).map_err(|e| WriteError::io(&path, e))?;
        self.files.push((path.clone(), out.to_owned()));
        Ok(path)
    }

    /// Syncs all files, then renames them into place. Returns places and lengths.
    ///
    /// Errors: the disk. Files of one mesh are renamed one after the other: each is whole, old or new.
    pub fn publish(self) -> Result<Vec<(PathBuf, u64)>> {
        let mut done = Vec::new();
        for (path, out) in &self.files {
            let synced = File::open(path).and_then(|f| f.sync_all().and(f.metadata()));
            let length = synced.map_err(|e| WriteError::io(out, e))?.len();
            done.push((out.clone(), length));
        }
        for (path, out) in &self.files {
            fs::rename(path, out).map_err(|e| WriteError::io(out, e))?;
            let parent = folder(out);
            let synced = File::open(parent).and_then(|d| d.sync_all());
            synced.map_err(|e| WriteError::io(parent, e))?;
        }
        Ok(done)
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        // Nothing depends on it; a folder that stays is only untidy.
        let _ = fs::remove_dir_all(&self.dir);
    }
}

/// The folder a file is in.
fn folder(out: &Path) -> &Path {
    match out.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}
