//! What a disk in memory holds and counts, and what goes wrong with a call.

use std::collections::BTreeMap;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::content::{BLOCK, Content};
use super::image::Wreck;
use super::{Rng, Trouble};

/// Error number the system has for a failed disk.
const EIO: i32 = 5;

/// What a call does, as far as trouble and counts tell calls apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Call {
    Read,
    Write,
    Resize,
    Sync,
    SyncFile,
    SyncDir,
    Create,
    Open,
    Rename,
    Unlink,
    List,
}

impl Call {
    /// Whether a store is another one after it, as a crash sees it.
    fn is_boundary(self) -> bool {
        !matches!(self, Self::Read | Self::Write | Self::Open | Self::List)
    }
}

/// What comes of a call that gives no error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Told {
    Done,
    /// The caller is told that it is done, which it is not.
    Lied,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Node {
    Folder,
    File(usize),
}

/// A change of names that a sync of its folder makes last.
#[derive(Clone, Debug)]
pub(super) struct NameChange {
    pub folder: PathBuf,
    pub removed: Option<PathBuf>,
    pub added: Option<(PathBuf, Node)>,
}

#[derive(Clone, Debug)]
pub(super) enum Pending {
    Write(u64, Arc<[u8]>),
    SetLen(u64),
}

#[derive(Clone, Debug, Default)]
pub(super) struct FileState {
    pub now: Content,
    pub synced: Content,
    pub pending: Vec<Pending>,
    pub is_linked: bool,
}

/// Everything; what a crash keeps of it is decided in [`Wreck`].
#[derive(Clone, Debug, Default)]
pub(super) struct State {
    pub names: BTreeMap<PathBuf, Node>,
    pub names_synced: BTreeMap<PathBuf, Node>,
    pub name_changes: Vec<NameChange>,
    pub files: Vec<FileState>,
    pub trouble: Trouble,
    /// Calls since the trouble was set, and among them those that are boundaries.
    pub calls: u64,
    pub boundaries: u64,
    pub by_call: BTreeMap<Call, u64>,
    pub is_dead: bool,
    /// Blocks of linked files, and the most there ever were.
    pub blocks: u64,
    pub blocks_peak: u64,
    pub wrecks: Vec<Wreck>,
}

impl State {
    pub(super) fn used_bytes(&self) -> u64 {
        self.blocks * BLOCK as u64
    }

    /// A file has lost its name, and with it its room.
    pub(super) fn unlink(&mut self, f: usize) {
        self.files[f].is_linked = false;
        self.blocks -= self.files[f].now.blocks_used();
    }

    /// Changes a file's content and keeps count of its room.
    pub(super) fn edit(&mut self, f: usize, edit: impl FnOnce(&mut FileState)) {
        let file = &mut self.files[f];
        let before = file.now.blocks_used();
        edit(file);
        if file.is_linked {
            self.blocks = self.blocks + file.now.blocks_used() - before;
            self.blocks_peak = self.blocks_peak.max(self.blocks);
        }
    }

    /// Counts a call; an error when it is to fail.
    pub(super) fn begin(&mut self, call: Call) -> io::Result<Told> {
        let number = self.calls;
        while let Some(&(at, seed)) = self.trouble.crash_at.last().filter(|(at, _)| *at <= number) {
            debug_assert!(at <= number);
            self.trouble.crash_at.pop();
            let wreck = Wreck::of(self, number, &mut Rng(seed));
            self.wrecks.push(wreck);
        }
        if self.is_dead {
            return Err(io::Error::from_raw_os_error(EIO));
        }
        self.calls += 1;
        *self.by_call.entry(call).or_default() += 1;
        if call.is_boundary() {
            if self.trouble.die_at_boundary == Some(self.boundaries) {
                self.is_dead = true;
                return Err(io::Error::from_raw_os_error(EIO));
            }
            self.boundaries += 1;
        }
        let fails = match self.trouble.fail_at {
            Some(at) if self.trouble.fails_on => number >= at,
            Some(at) => number == at,
            None => false,
        };
        match fails {
            true => Err(io::Error::from_raw_os_error(EIO)),
            false if self.trouble.lies == Some(call) => Ok(Told::Lied),
            false => Ok(Told::Done),
        }
    }

    pub(super) fn node(&self, path: &Path) -> io::Result<Node> {
        (self.names.get(path).copied()).ok_or_else(|| ErrorKind::NotFound.into())
    }

    pub(super) fn file(&self, path: &Path) -> io::Result<usize> {
        match self.node(path)? {
            Node::File(f) => Ok(f),
            Node::Folder => Err(ErrorKind::IsADirectory.into()),
        }
    }

    pub(super) fn change(&mut self, removed: Option<&Path>, added: Option<(&Path, Node)>) {
        let any = removed.or(added.map(|(path, _)| path));
        let folder = any.and_then(Path::parent).unwrap_or(Path::new(""));
        self.name_changes.push(NameChange {
            folder: folder.to_owned(),
            removed: removed.map(Path::to_owned),
            added: added.map(|(path, node)| (path.to_owned(), node)),
        });
        if let Some(path) = removed {
            self.names.remove(path);
        }
        if let Some((path, node)) = added
            && let Some(Node::File(old)) = self.names.insert(path.to_owned(), node)
        {
            self.unlink(old);
        }
    }

    pub(super) fn create(&mut self, path: &Path) -> io::Result<usize> {
        let folder = path.parent().unwrap_or(Path::new(""));
        if self.node(folder)? != Node::Folder {
            return Err(ErrorKind::NotADirectory.into());
        }
        self.files.push(FileState { is_linked: true, ..FileState::default() });
        let f = self.files.len() - 1;
        self.change(None, Some((path, Node::File(f))));
        Ok(f)
    }

    pub(super) fn write(&mut self, f: usize, offset: u64, data: &[u8]) -> io::Result<()> {
        let begun = self.begin(Call::Write);
        let new = self.files[f].now.blocks_new(offset, data.len()) * BLOCK as u64;
        let full = (self.trouble.space).is_some_and(|space| self.used_bytes() + new > space);
        // A write that fails may have written some of it.
        let done = match (&begun, full) {
            (Ok(_), false) => data,
            _ if self.is_dead || full => return begun.and(Err(ErrorKind::StorageFull.into())),
            _ => &data[..data.len() / 2],
        };
        self.edit(f, |file| {
            file.now.write(offset, done);
            file.pending.push(Pending::Write(offset, done.into()));
        });
        begun.map(|_| ())
    }
}

impl FileState {
    pub(super) fn sync(&mut self) {
        self.synced = self.now.clone();
        self.pending.clear();
    }
}
