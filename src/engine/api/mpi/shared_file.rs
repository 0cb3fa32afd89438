//! A file that all ranks write together, each its own partitions.

use std::cell::Cell;
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::mailbox::{DONE, END, FILE, Mailbox, PAUSE_MOST, failed};
use super::rank_workers::RankWorkers;
use tetdb_base::storage::RemoteFailure;
use tetdb_io::write::{Share, Writers};

/// Longest delay until files of other machines become visible.
pub const WAIT: Duration = Duration::from_secs(60);

pub struct SharedFile {
    mailbox: Arc<Mailbox>,
    workers: Arc<RankWorkers>,
    /// True once rank 0 has announced the file.
    is_announced: Cell<bool>,
}

impl SharedFile {
    pub fn new(mailbox: Arc<Mailbox>, workers: Arc<RankWorkers>) -> Self {
        Self { mailbox, workers, is_announced: Cell::new(false) }
    }

    fn announce_to_all(&self, message: &[u8]) {
        self.is_announced.set(true);
        self.mailbox.others().for_each(|rank| self.mailbox.send(rank, FILE, message.to_vec()));
    }
}

impl Writers for SharedFile {
    fn share(&self) -> Share {
        self.mailbox.share()
    }

    fn announce(&self, file: &Path) {
        self.announce_to_all(&[&[DONE], file.as_os_str().as_bytes()].concat());
    }

    fn hear(&self) -> Option<PathBuf> {
        let message = self.mailbox.receive_from(0, FILE)?;
        let path = PathBuf::from(OsStr::from_bytes(message.strip_prefix(&[DONE])?));
        // A file of another machine may become visible late.
        let begun = Instant::now();
        while !path.exists() && begun.elapsed() < WAIT {
            std::thread::sleep(PAUSE_MOST);
        }
        Some(path)
    }

    fn say(&self, done: Result<(), RemoteFailure>) {
        let message = match done {
            Ok(()) => vec![DONE],
            Err(failure) => failed(failure.code, &failure.message),
        };
        self.mailbox.send(0, FILE, message);
    }

    fn wait(&self) -> Result<(), RemoteFailure> {
        // All ranks have answered before the first error is returned, so that none writes when the file is removed.
        self.workers.answers(FILE).into_iter().try_for_each(|done| done.map(drop))
    }
}

impl Drop for SharedFile {
    /// If rank 0 failed before it created the file, tells the other ranks not to wait for it.
    fn drop(&mut self) {
        if self.mailbox.rank == 0 && !self.is_announced.get() {
            self.announce_to_all(&[END]);
        }
    }
}
