//! A lock file: one process at a time holds it.
//!
//! The system's lock on the file decides; it ends with the process. On a file system without locks, the existence of
//! the file decides: the process that creates the file holds the lock. A file left by a dead process of this host is
//! taken over. The file names its holder, for messages to other processes.
//!
//! On some cluster file systems every machine gets the lock it requests. So a process that gets the lock on an existing
//! file still reads it: a living process of this host that the file names holds the lock, and so does a process of
//! another host while it renews the file.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

/// Others that come and go with their file while it is opened; each costs one attempt.
const ATTEMPTS: u32 = 100;
/// Without locks two processes may take over a dead process's file at once: after this time the file names the one that
/// has it.
const SETTLED_AFTER: Duration = Duration::from_millis(200);

/// Between two times that a holder renews its file.
const RENEWED_EVERY: Duration = Duration::from_millis(500);
/// A holder on another host that has not renewed its file for this long is considered gone: six renewal intervals, so
/// that a slow disk does not count as death.
const RENEWED_WITHIN: Duration = Duration::from_secs(3);

/// A right that is held; it ends when this is dropped.
#[derive(Debug)]
pub struct FileLock {
    /// `None`: nothing to release.
    held: Option<Renewed>,
    path: Mutex<PathBuf>,
    text: String,
    is_by_name: bool,
}

/// Reasons to refuse the lock.
#[derive(Debug)]
pub enum Refused {
    /// Another process holds the lock; its description, as far as the file gives one.
    Held(String),
    /// The system does not let the file be created or read.
    Io(io::Error),
}

/// The content of the file.
#[derive(Debug, Serialize, Deserialize)]
struct Holder {
    host: String,
    process: u32,
    /// Seconds since 1970.
    time: u64,
    /// Differs between any two that are taken on one host.
    run: String,
    /// Start time of the process, in the system's ticks: a later process may have the same number. 0: unknown.
    #[serde(default)]
    began: u64,
}

/// A file that is renewed while this lives.
#[derive(Debug)]
struct Renewed {
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Renewed {
    fn new(file: File) -> Self {
        let (stop, stopped) = channel();
        // The file, and with it its lock, is closed when the thread ends.
        let renew = move || {
            while stopped.recv_timeout(RENEWED_EVERY) == Err(RecvTimeoutError::Timeout) {
                // A failure to renew does not end the lock.
                let _ = file.set_modified(SystemTime::now());
            }
        };
        Self { thread: Some(std::thread::spawn(renew)), stop: Some(stop) }
    }
}

impl Drop for Renewed {
    fn drop(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl FileLock {
    /// A lock that no other process requests, for example on a disk in memory.
    pub fn unshared() -> Self {
        Self { held: None, path: Mutex::default(), text: String::new(), is_by_name: false }
    }

    /// Takes the right. Errors: another has it; the folder takes no files.
    pub fn acquire(path: &Path) -> Result<Self, Refused> {
        Self::acquire_with(path, File::try_lock)
    }

    fn acquire_with(
        path: &Path,
        try_lock: impl Fn(&File) -> Result<(), TryLockError>,
    ) -> Result<Self, Refused> {
        let text = serde_json::to_string(&Holder::this()).unwrap_or_default();
        let mut is_taken_over = false;
        for _ in 0..ATTEMPTS {
            let Some((mut file, is_new)) = open(path)? else {
                continue;
            };
            let is_by_name = match try_lock(&file) {
                Ok(()) if is_new => false,
                Ok(()) if is_held_all_the_same(path) => {
                    return Err(Refused::Held(holder(path)));
                }
                Ok(()) => {
                    is_taken_over = true;
                    false
                }
                Err(TryLockError::WouldBlock) => return Err(Refused::Held(holder(path))),
                Err(TryLockError::Error(e)) if !knows_no_locks(&e) => return Err(e.into()),
                Err(TryLockError::Error(_)) if is_new => true,
                Err(TryLockError::Error(_)) => {
                    if may_live(path) {
                        return Err(Refused::Held(holder(path)));
                    }
                    is_taken_over = true;
                    remove(path)?;
                    continue;
                }
            };
            file.set_len(0)?;
            file.rewind()?;
            file.write_all(text.as_bytes())?;
            if is_taken_over {
                std::thread::sleep(SETTLED_AFTER);
            }
            // The previous holder may have removed the file meanwhile. Then this one has no name, and another process
            // may lock a new one.
            if fs::read_to_string(path).is_ok_and(|found| found == text) {
                return Ok(Self {
                    held: Some(Renewed::new(file)),
                    path: Mutex::new(path.to_owned()),
                    text,
                    is_by_name,
                });
            }
        }
        Err(Refused::Held(holder(path)))
    }

    /// Returns whether the file alone decides, because its file system has no locks.
    pub fn is_by_name(&self) -> bool {
        self.is_by_name
    }

    /// The folder of the file has another name now.
    pub fn moved_to(&self, path: &Path) {
        *self.path.lock().unwrap_or_else(PoisonError::into_inner) = path.to_owned();
    }
}

impl Drop for FileLock {
    fn drop(&mut self) {
        let path = self.path.lock().unwrap_or_else(PoisonError::into_inner);
        // While the lock is held no other process writes the file; a file with another text belongs to another process.
        if self.held.is_some() && fs::read_to_string(&*path).is_ok_and(|found| found == self.text) {
            let _ = remove(&path);
        }
    }
}

impl From<io::Error> for Refused {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

/// The file, and whether it is new; `None` when it went between two looks.
fn open(path: &Path) -> io::Result<Option<(File, bool)>> {
    let mut options = OpenOptions::new();
    options.read(true).write(true);
    match options.clone().create_new(true).open(path) {
        Ok(file) => return Ok(Some((file, true))),
        Err(e) if e.kind() != ErrorKind::AlreadyExists => return Err(e),
        Err(_) => {}
    }
    match options.open(path) {
        Ok(file) => Ok(Some((file, false))),
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(None),
        Err(e) => Err(e),
    }
}

fn remove(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(e) if e.kind() != ErrorKind::NotFound => Err(e),
        _ => Ok(()),
    }
}

fn knows_no_locks(error: &io::Error) -> bool {
    /// Error numbers of Linux without a lock manager, the call or its support: ENOLCK, ENOSYS, EOPNOTSUPP.
    const NUMBERS: [i32; 3] = [37, 38, 95];
    let number = error.raw_os_error();
    error.kind() == ErrorKind::Unsupported || number.is_some_and(|n| NUMBERS.contains(&n))
}

impl Holder {
    fn this() -> Self {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let now = SystemTime::now().duration_since(UNIX_EPOCH);
        let now = now.unwrap_or_default();
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        Self {
            host: host_name(),
            process: std::process::id(),
            time: now.as_secs(),
            run: format!("{}-{count}", now.as_nanos()),
            began: began(std::process::id()),
        }
    }

    /// Returns whether the holder proves to be alive: as a process of this host, or by renewing its file.
    fn lives(&self, path: &Path) -> bool {
        if self.host == host_name() {
            return self.began != 0 && self.began == began(self.process);
        }
        let modified = || {
            // Opened anew: other machines' changes are seen then.
            let file = File::open(path).ok()?;
            file.metadata().ok()?.modified().ok()
        };
        let first = modified();
        let looks = RENEWED_WITHIN.as_millis() / RENEWED_EVERY.as_millis();
        (0..looks).any(|_| {
            std::thread::sleep(RENEWED_EVERY);
            modified() != first
        })
    }

    fn read(path: &Path) -> Option<Self> {
        /// More is none of ours.
        const BYTES_MAX: u64 = 4096;
        let mut text = String::new();
        let file = File::open(path).ok()?;
        file.take(BYTES_MAX).read_to_string(&mut text).ok()?;
        serde_json::from_str(&text).ok()
    }
}

/// Returns whether an existing file, whose lock is free, still belongs to a living process.
fn is_held_all_the_same(path: &Path) -> bool {
    let Some(holder) = Holder::read(path) else {
        // A process that has just created the file will write it soon; one that died before writing never will.
        std::thread::sleep(SETTLED_AFTER);
        return Holder::read(path).is_some_and(|holder| holder.lives(path));
    };
    holder.lives(path)
}

/// Start time of a process of this host; 0 if the system does not report it.
fn began(process: u32) -> u64 {
    /// Place of the number in the line, counted behind the name, which may hold anything.
    const BEGAN: usize = 19;
    let line = fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    let behind = line.rsplit_once(')').map_or("", |(_, behind)| behind);
    let number = behind.split_whitespace().nth(BEGAN);
    number.and_then(|n| n.parse().ok()).unwrap_or(0)
}

/// Returns whether the process that left the file may still run; processes of other hosts may.
fn may_live(path: &Path) -> bool {
    let Some(holder) = Holder::read(path) else {
        return true;
    };
    // Another process may have its number by now. Where the system does not say when a process began, it may be the same.
    let now = began(holder.process);
    let is_another =
        holder.host == host_name() && ![now, holder.began].contains(&0) && now != holder.began;
    !is_another && !is_process_gone(&holder.host, holder.process)
}

/// The process that a lock file names, in words.
pub fn holder(path: &Path) -> String {
    match Holder::read(path) {
        Some(Holder { host, process, .. }) => format!("process {process} on {host}"),
        None => "another process".to_owned(),
    }
}

/// Returns whether a process has certainly ended; for processes of other hosts this is unknown.
pub fn is_process_gone(host: &str, process: u32) -> bool {
    let processes = Path::new("/proc");
    host == host_name()
        && processes.join("self").exists()
        && !processes.join(process.to_string()).exists()
}

/// The name of this machine.
pub fn host_name() -> String {
    let read = |path| fs::read_to_string(path).ok();
    let name = read("/proc/sys/kernel/hostname").or_else(|| read("/etc/hostname"));
    let name = name.or_else(|| std::env::var("HOSTNAME").ok());
    name.map_or_else(|| "this host".to_owned(), |n| n.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn without_locks(_: &File) -> Result<(), TryLockError> {
        Err(TryLockError::Error(ErrorKind::Unsupported.into()))
    }

    fn that_refuse_nobody(_: &File) -> Result<(), TryLockError> {
        Ok(())
    }

    fn is_held(lock: Result<FileLock, Refused>) -> bool {
        matches!(lock, Err(Refused::Held(_)))
    }

    #[test]
    fn one_holder_at_a_time_with_locks_and_without() -> io::Result<()> {
        let dir = tempfile::tempdir()?;
        let path = dir.path().join("lock");
        for try_lock in [File::try_lock, without_locks, that_refuse_nobody] {
            let acquire = || FileLock::acquire_with(&path, try_lock);
            let held = acquire().expect("nobody has it");
            let Err(Refused::Held(words)) = acquire() else {
                panic!("held twice");
            };
            let number = std::process::id().to_string();
            assert!(words.contains(&number), "{words}");
            drop(held);
            assert!(!path.exists());
            drop(acquire().expect("it was given back"));
        }
        Ok(())
    }

    #[test]
    fn what_a_dead_process_left_is_taken_over_and_another_hosts_is_not() -> io::Result<()> {
        let dir = tempfile::tempdir()?;
        let path = dir.path().join("lock");
        let mut left = Holder::this();
        // No process has the greatest number.
        left.process = u32::MAX;
        fs::write(&path, serde_json::to_string(&left)?)?;
        let held = FileLock::acquire_with(&path, without_locks).expect("its holder is gone");
        assert!(held.is_by_name());
        drop(held);
        // Another process has its number.
        left.process = std::process::id();
        left.began += 1;
        fs::write(&path, serde_json::to_string(&left)?)?;
        drop(FileLock::acquire_with(&path, without_locks).expect("its holder is gone too"));
        left.host += ".elsewhere";
        fs::write(&path, serde_json::to_string(&left)?)?;
        assert!(is_held(FileLock::acquire_with(&path, without_locks)));
        drop(FileLock::acquire(&path).expect("where there are locks, they decide"));
        Ok(())
    }

    #[test]
    fn a_file_that_another_host_renews_is_held_whatever_the_locks_say() -> io::Result<()> {
        let dir = tempfile::tempdir()?;
        let path = dir.path().join("lock");
        let mut left = Holder::this();
        left.host += ".elsewhere";
        fs::write(&path, serde_json::to_string(&left)?)?;
        let renewed = Renewed::new(File::open(&path)?);
        let acquire = || FileLock::acquire_with(&path, that_refuse_nobody);
        assert!(is_held(acquire()));
        drop(renewed);
        drop(acquire().expect("it is not renewed any more"));
        Ok(())
    }

    #[test]
    fn of_many_threads_one_has_it() {
        for try_lock in [File::try_lock, that_refuse_nobody] {
            one_of_many_threads_has_it(try_lock);
        }
    }

    fn one_of_many_threads_has_it(try_lock: impl Fn(&File) -> Result<(), TryLockError> + Sync) {
        let dir = tempfile::tempdir().expect("a folder");
        let path = dir.path().join("lock");
        let inside = AtomicU32::new(0);
        let taken = AtomicU32::new(0);
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| {
                    for _ in 0..300 {
                        if let Ok(_held) = FileLock::acquire_with(&path, &try_lock) {
                            assert_eq!(inside.fetch_add(1, Ordering::SeqCst), 0);
                            taken.fetch_add(1, Ordering::SeqCst);
                            std::thread::yield_now();
                            inside.fetch_sub(1, Ordering::SeqCst);
                        }
                    }
                });
            }
        });
        assert!(taken.into_inner() > 0);
    }

    #[test]
    fn a_lock_whose_folder_was_renamed_goes_with_it() -> io::Result<()> {
        let dir = tempfile::tempdir()?;
        let [a, b] = ["a", "b"].map(|name| dir.path().join(name));
        fs::create_dir(&a)?;
        let held = FileLock::acquire(&a.join("lock")).expect("nobody has it");
        fs::rename(&a, &b)?;
        assert!(is_held(FileLock::acquire(&b.join("lock"))));
        held.moved_to(&b.join("lock"));
        drop(held);
        assert!(!b.join("lock").exists());
        Ok(())
    }
}
