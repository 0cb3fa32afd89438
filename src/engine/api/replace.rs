//! Replacing a store by a new one, in steps that may be interrupted anywhere.
//!
//! `X.tetdb` stays the old store until the new one is completely sealed in `X.tetdb.being-made`. Then the old store is renamed to
//! `X.tetdb.being-replaced`, the new one to `X.tetdb`, and the old one is removed. The next run finds out how far an interrupted
//! exchange got. These names are chosen so that nobody uses them for a copy, because folders with these names are renamed and removed.

use std::path::{Path, PathBuf};

use super::{Error, Settings};
use tetdb_base::storage::DiskPath;
use tetdb_schema::catalog::StoreState;
use tetdb_store::store::{Catalog, StoreError, WriterLock};

/// Path where the new store is built.
pub fn new_of(path: &Path) -> PathBuf {
    sibling(path, "being-made")
}

fn old_of(path: &Path) -> PathBuf {
    sibling(path, "being-replaced")
}

/// The path with one more extension, so that stores with the same stem never collide.
fn sibling(path: &Path, extension: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".");
    name.push(extension);
    name.into()
}

/// State of the store at a path; `None` if there is no readable store.
fn state(path: &Path) -> Option<StoreState> {
    path.is_dir().then(|| Catalog::open(path).ok()?.state().ok()).flatten()
}

/// Returns whether an unfinished replacement of the store at `path` exists.
pub fn is_begun(path: &Path) -> bool {
    state(&new_of(path)).is_some()
}

/// Completes an interrupted exchange; all names are right afterwards.
///
/// Errors: the disk; `busy` while another run holds the lock of the new store, which it keeps until all names are right.
pub fn settle(path: &Path, settings: &Settings) -> Result<(), Error> {
    let (new, old) = (new_of(path), old_of(path));
    let places = [&new, path, &old];
    let Some(place) = places.into_iter().find(|place| Catalog::is_at(*place)) else {
        return Ok(());
    };
    if !new.exists() && !old.exists() {
        return Ok(());
    }
    let lock = match WriterLock::acquire(place) {
        Err(StoreError::NotFound { .. } | StoreError::Busy { .. }) => {
            let (path, writer) = (path.to_owned(), "another process".to_owned());
            return Err(StoreError::Busy { path, writer }.into());
        }
        other => other?,
    };
    if !path.exists() && state(&new).is_some_and(StoreState::is_finished) {
        rename(&new, path)?;
        lock.moved_to(path);
        settings.note(format!(
            "{} was finished as {}, and has its place now",
            path.display(),
            new.display()
        ));
    }
    if !path.exists() && state(&old).is_some() {
        rename(&old, path)?;
        lock.moved_to(path);
    }
    if path.exists() && state(&old).is_some() {
        remove(&old)?;
    }
    Ok(())
}

/// Opens a begun replacement for writing if it has the same job; otherwise removes it.
///
/// Errors: the disk; another process writes it; it is no store, or damaged. Nothing is removed in these cases.
pub fn take_up(
    path: &Path,
    is_same: impl FnOnce(&mut Catalog) -> bool,
) -> Result<Option<Catalog>, Error> {
    let new = new_of(path);
    if !new.exists() {
        return Ok(None);
    }
    let mut catalog = match Catalog::open_writable(&new) {
        Ok(catalog) => catalog,
        Err(StoreError::NotOurs { .. }) if Catalog::is_vacant(&new) => return Ok(None),
        Err(error) => return Err(error.into()),
    };
    if is_same(&mut catalog) {
        return Ok(Some(catalog));
    }
    let _lock = catalog.lock();
    drop(catalog);
    remove(&new)?;
    Ok(None)
}

/// Puts the new store in the place of the old one. The new store is sealed and closed, and its lock is held.
///
/// Errors: the disk.
pub fn exchange(path: &Path, lock: &WriterLock) -> Result<(), Error> {
    let (new, old) = (new_of(path), old_of(path));
    // A store with a live writer is not replaced. While this lock is held, no writer can start.
    let held = match Catalog::open_writable(path) {
        Err(error @ StoreError::Busy { .. }) => return Err(error.into()),
        other => other.ok(),
    };
    if path.exists() {
        rename(path, &old)?;
    }
    rename(&new, path)?;
    lock.moved_to(path);
    if old.exists() {
        remove(&old)?;
    }
    drop(held);
    Ok(())
}

/// Removes a store that this program created. It is renamed first, so that its name always belongs to a complete store or to nothing.
///
/// Errors: the disk.
pub fn remove(path: &Path) -> Result<(), Error> {
    let removed = sibling(path, "being-removed");
    if removed.exists() {
        DiskPath::from(&removed).remove_dir_all()?;
    }
    rename(path, &removed)?;
    Ok(DiskPath::from(&removed).remove_dir_all()?)
}

/// Renames a folder. Errors: the disk.
fn rename(from: &Path, to: &Path) -> Result<(), Error> {
    Ok(DiskPath::from(from).rename(&to.into())?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stores_with_the_same_stem_have_names_of_their_own() {
        let names = ["part.tetdb", "part.v1", "part.v2", "part", "a/part.tetdb"];
        let mut beside: Vec<PathBuf> = (names.iter())
            .flat_map(|name| [new_of(Path::new(name)), old_of(Path::new(name))])
            .collect();
        beside.sort();
        beside.dedup();
        assert_eq!(beside.len(), 2 * names.len());
        assert_eq!(new_of(Path::new("a/part")), Path::new("a/part.being-made"));
    }
}
