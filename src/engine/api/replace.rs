//! A new store takes the place of an old one, and may be interrupted anywhere.
//!
//! `X.tetdb` is the old store until all of the new one is sealed in `X.tetdb.being-made`. Then the old one is renamed to
//! `X.tetdb.being-replaced`, the new one takes its name, and the old one is removed. Whoever comes next finds out how far that was. The names
//! are such as nobody gives to a copy of their own, for what bears them is renamed and removed.

use std::path::{Path, PathBuf};

use super::{Error, Settings};
use tetdb_base::storage::DiskPath;
use tetdb_schema::catalog::StoreState;
use tetdb_store::store::{Catalog, StoreError, WriterLock};

/// Where the new store is built.
#[doc(hidden)]
pub fn new_of(path: &Path) -> PathBuf {
    beside(path, "being-made")
}

fn old_of(path: &Path) -> PathBuf {
    beside(path, "being-replaced")
}

/// The path with one more extension: stores with the same stem never meet.
fn beside(path: &Path, extension: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".");
    name.push(extension);
    name.into()
}

/// How far the store at a path is; `None` where there is none that can be read.
fn state(path: &Path) -> Option<StoreState> {
    path.is_dir().then(|| Catalog::open(path).ok()?.state().ok()).flatten()
}

/// Whether a replacement of the store at `path` was begun and not brought to its end.
#[doc(hidden)]
pub fn is_begun(path: &Path) -> bool {
    state(&new_of(path)).is_some()
}

/// Brings to its end what an interrupted exchange left: the names are right afterwards.
///
/// Errors: the disk; `busy` while another run is at it, which has the lock of the new store until all names are right.
#[doc(hidden)]
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

/// Opens a replacement that was begun for writing if it is of this job, else removes it.
///
/// Errors: the disk; another process writes it; what is there is no store, or damaged: nothing is removed then.
#[doc(hidden)]
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

/// The new store, which is sealed and closed and whose lock is held, takes its place. Errors: the disk.
#[doc(hidden)]
pub fn exchange(path: &Path, lock: &WriterLock) -> Result<(), Error> {
    let (new, old) = (new_of(path), old_of(path));
    // A store whose writer lives is not replaced; while this one is held, no writer begins.
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

/// Removes a store that this program made. It has another name first: what has its name is a whole store, or nothing. Errors: the disk.
#[doc(hidden)]
pub fn remove(path: &Path) -> Result<(), Error> {
    let removed = beside(path, "being-removed");
    if removed.exists() {
        DiskPath::from(&removed).remove_dir_all()?;
    }
    rename(path, &removed)?;
    Ok(DiskPath::from(&removed).remove_dir_all()?)
}

/// Errors: the disk.
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
