//! Files being written: a folder beside the output, which is always removed; the files are renamed when all are complete.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use tetdb_base::storage::{available_bytes, host_name, is_process_gone};

use super::error::{Result, WriteError};

/// The name that stands for standard output.
pub(super) const STDOUT: &str = "-";

/// Numbers the folders of the process.
static NUMBER: AtomicU32 = AtomicU32::new(0);

/// A hidden folder beside the output that holds unfinished files and scratch.
///
/// Invariant: no file has its name before [`OutputFiles::publish`]; dropping removes the folder.
pub(super) struct OutputFiles {
    dir: PathBuf,
    /// Unfinished files and their final paths.
    files: Vec<(PathBuf, PathBuf)>,
}

impl OutputFiles {
    /// Creates the folder for `out`. Errors: the parent folder does not exist or is not writable.
    pub fn new(out: &Path) -> Result<Self> {
        let name = out.file_name().unwrap_or_default().to_string_lossy();
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let folder = match out == Path::new(STDOUT) {
            true => std::env::temp_dir(),
            false => folder(out).to_owned(),
        };
        let (host, process) = (host_name(), std::process::id());
        let dir = folder.join(format!(".{name}.{host}.{process}-{number}.tmp"));
        if out.is_dir() {
            let source = std::io::Error::from(ErrorKind::IsADirectory);
            return Err(WriteError::io(out, source));
        }
        remove_abandoned(&name, &dir);
        fs::create_dir(&dir).map_err(|e| WriteError::io(out, e))?;
        let files = Vec::new();
        Ok(Self { dir, files })
    }

    /// The folder, for scratch.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// Creates a file that will become `out` and needs about `bytes`; for standard output returns `out`.
    ///
    /// Errors: less disk is free; the file cannot be created.
    pub fn create(&mut self, out: &Path, bytes: u64) -> Result<PathBuf> {
        if out == Path::new(STDOUT) {
            return Ok(out.to_owned());
        }
        if let Some(available) = available_bytes(&self.dir).filter(|&free| free < bytes) {
            return Err(WriteError::NoSpace { path: out.to_owned(), needed: bytes, available });
        }
        let path = self.dir.join(format!("out-{}", self.files.len()));
        File::create_new(&path).map_err(|e| WriteError::io(&path, e))?;
        self.files.push((path.clone(), out.to_owned()));
        Ok(path)
    }

    /// Syncs all files, then renames them into place; returns paths and lengths.
    ///
    /// Existing files of an output of several are removed first, so that old and new ones never mix. Errors: the disk.
    pub fn publish(self) -> Result<Vec<(PathBuf, u64)>> {
        let mut done = Vec::new();
        for (path, out) in &self.files {
            let synced = File::open(path).and_then(|f| f.sync_all().and(f.metadata()));
            let length = synced.map_err(|e| WriteError::io(out, e))?.len();
            done.push((out.clone(), length));
        }
        if self.files.len() > 1 {
            for (_, out) in &self.files {
                match fs::remove_file(out) {
                    Err(e) if e.kind() != ErrorKind::NotFound => {
                        return Err(WriteError::io(out, e));
                    }
                    _ => (),
                }
            }
        }
        // No other work between the renames, so that a kill rarely finds only some of the files.
        let folders: BTreeSet<&Path> = self.files.iter().map(|(_, out)| folder(out)).collect();
        for folder in &folders {
            fs::create_dir_all(folder).map_err(|e| WriteError::io(folder, e))?;
        }
        for (path, out) in &self.files {
            fs::rename(path, out).map_err(|e| WriteError::io(out, e))?;
        }
        for folder in folders {
            let synced = File::open(folder).and_then(|d| d.sync_all());
            synced.map_err(|e| WriteError::io(folder, e))?;
        }
        Ok(done)
    }
}

impl OutputFiles {
    /// Publishes the one file; returns its length. Errors: as [`OutputFiles::publish`].
    pub fn publish_one(self) -> Result<u64> {
        Ok(self.publish()?.iter().map(|(_, bytes)| bytes).sum())
    }
}

impl Drop for OutputFiles {
    fn drop(&mut self) {
        // A folder that cannot be removed is only untidy.
        let _ = fs::remove_dir_all(&self.dir);
    }
}

/// Removes folders that killed writers of the same file left on this machine, also one of `new`'s name, because systems reuse process numbers.
/// A folder that cannot be removed stays.
fn remove_abandoned(name: &str, new: &Path) {
    let is_abandoned = |path: &Path| {
        let file_name = path.file_name().unwrap_or_default().to_string_lossy();
        let middle = file_name
            .strip_prefix(&format!(".{name}."))
            .and_then(|rest| rest.strip_suffix(".tmp"))
            .and_then(|rest| rest.rsplit_once('.'));
        let writer = middle.and_then(|(host, writer)| {
            let (process, number) = writer.split_once('-')?;
            number.parse::<u32>().ok()?;
            Some((host, process.parse().ok()?))
        });
        writer.is_some_and(|(host, process)| path == new || is_process_gone(host, process))
    };
    for entry in fs::read_dir(folder(new)).into_iter().flatten().flatten() {
        if is_abandoned(&entry.path()) {
            let _ = fs::remove_dir_all(entry.path());
        }
    }
}

/// The folder a file is in.
fn folder(out: &Path) -> &Path {
    match out.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_of_killed_writers_go_and_others_stay() -> std::io::Result<()> {
        let dir = tempfile::tempdir()?;
        let (host, here) = (host_name(), std::process::id());
        // No process has a number this high.
        let gone =
            [format!(".a.vtu.{host}.4294967295-0.tmp"), format!(".a.vtu.{host}.{here}-77.tmp")];
        let stay = [
            format!(".a.vtu.{host}.{here}-78.tmp"),
            format!(".b.vtu.{host}.4294967295-0.tmp"),
            ".a.vtu.another.host.4294967295-0.tmp".to_owned(),
            format!(".a.vtu.{host}.mine.tmp"),
        ];
        for name in gone.iter().chain(&stay) {
            fs::create_dir(dir.path().join(name))?;
            fs::write(dir.path().join(name).join("out-0"), b"half")?;
        }
        remove_abandoned("a.vtu", &dir.path().join(&gone[1]));
        let there = |name: &String| dir.path().join(name).exists();
        assert!(stay.iter().all(there));
        assert!(!there(&gone[1]));
        assert_eq!(there(&gone[0]), !Path::new("/proc/self").exists());
        Ok(())
    }
}
