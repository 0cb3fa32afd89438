//! `--force`: a new store takes the place of an old one, and may be interrupted anywhere.
//!
//! `X.tetdb` is the old store until all of the new one is sealed in `X.tetdb-new`. Then the old one is renamed to `X.tetdb-old`, the new one takes
//! its name, and the old one is removed. Whoever comes next finds out how far that was.

use std::path::{Path, PathBuf};

use super::failure::Failure;
use super::talk::Talk;
use crate::catalog::{Catalog, Store, StoreState};

/// Where the new store is made.
pub fn new_of(path: &Path) -> PathBuf {
    path.with_extension("tetdb-new")
}

fn old_of(path: &Path) -> PathBuf {
    path.with_extension("tetdb-old")
}

/// How far the store at a path is; `None` where there is none that can be read.
fn state(path: &Path) -> Option<StoreState> {
    path.is_dir()
        .then(|| Store::open(path).ok()?.catalog().state().ok())
        .flatten()
}

/// Whether a replacement of the store at `path` was begun and not brought to its end.
pub fn is_begun(path: &Path) -> bool {
    state(&new_of(path)).is_some()
}

/// Brings to its end what an interrupted exchange left: the names are right afterwards. Errors: the disk.
pub fn settle(path: &Path, talk: &Talk) -> Result<(), Failure> {
    let (new, old) = (new_of(path), old_of(path));
    if !path.exists() && state(&new).is_some_and(StoreState::is_finished) {
        rename(&new, path)?;
        talk.note(&format!(
            "{} was finished as {}, and has its place now",
            path.display(),
            new.display()
        ));
    }
    if !path.exists() && state(&old).is_some() {
        rename(&old, path)?;
    }
    if path.exists() && state(&old).is_some() {
        remove(&old)?;
    }
    Ok(())
}

/// Opens an unfinished replacement for writing if it is of this job, else removes what is there. Errors: the disk; another process writes it.
pub fn take_up(
    path: &Path,
    is_same: impl FnOnce(&mut Catalog) -> bool,
) -> Result<Option<Catalog>, Failure> {
    let new = new_of(path);
    if !new.exists() {
        return Ok(None);
    }
    if state(&new).is_some() {
        let mut catalog = Catalog::open_writable(&new)?;
        if is_same(&mut catalog) {
            return Ok(Some(catalog));
        }
    }
    remove(&new)?;
    Ok(None)
}

/// The new store, which is sealed and closed, takes its place. Errors: the disk.
pub fn exchange(path: &Path) -> Result<(), Failure> {
    let (new, old) = (new_of(path), old_of(path));
    if path.exists() {
        rename(path, &old)?;
    }
    rename(&new, path)?;
    if old.exists() {
        remove(&old)?;
    }
    Ok(())
}

/// Removes a store: a directory whose catalog carried our magic, or that this run made. Errors: the disk.
pub fn remove(path: &Path) -> Result<(), Failure> {
    std::fs::remove_dir_all(path).map_err(|e| Failure::new("io", e).at(path.display()))
}

fn rename(from: &Path, to: &Path) -> Result<(), Failure> {
    std::fs::rename(from, to).map_err(|e| Failure::new("io", e).at(to.display()))
}
