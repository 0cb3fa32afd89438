//! A disk in memory that fails, fills up, dies and loses power when it is told to.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tetdb_base::storage::DiskPath;

use super::Trouble;
use super::content::BLOCK;
use super::door::Door;
use super::image::Wreck;
use super::state::{Call, Node, State};

/// A disk in memory. Is not: locked; one process uses it.
#[derive(Debug, Default)]
pub struct SimDisk {
    state: Mutex<State>,
}

impl SimDisk {
    /// An empty disk: only the folder `/`.
    pub fn new() -> Arc<Self> {
        let names = BTreeMap::from([(PathBuf::from("/"), Node::Folder)]);
        Self::with(State { names_synced: names.clone(), names, ..State::default() })
    }

    pub(super) fn with(state: State) -> Arc<Self> {
        Arc::new(Self { state: Mutex::new(state) })
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, State> {
        // Nothing panics within a call; a test that does elsewhere need not fail here too.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A path on this disk.
    pub fn path(self: &Arc<Self>, path: &str) -> DiskPath {
        DiskPath::on(Arc::new(Door(self.clone())), path)
    }

    /// From now on there is this trouble; calls are counted from 0.
    pub fn set_trouble(&self, trouble: Trouble) {
        let mut state = self.lock();
        state.trouble = trouble;
        (state.calls, state.boundaries, state.is_dead) = (0, 0, false);
        state.by_call.clear();
    }

    /// Calls since [`SimDisk::set_trouble`].
    pub fn calls(&self) -> u64 {
        self.lock().calls
    }

    /// How often each was made since then.
    pub fn by_call(&self) -> BTreeMap<Call, u64> {
        self.lock().by_call.clone()
    }

    /// Syncs, changes of names and of lengths since then.
    pub fn boundaries(&self) -> u64 {
        self.lock().boundaries
    }

    /// Whether the disk has stopped.
    pub fn is_dead(&self) -> bool {
        self.lock().is_dead
    }

    /// Bytes that files take up.
    pub fn used_bytes(&self) -> u64 {
        self.lock().used_bytes()
    }

    /// The most they ever took up.
    pub fn used_bytes_peak(&self) -> u64 {
        self.lock().blocks_peak * BLOCK as u64
    }

    /// What was taken down at the moments the trouble names.
    pub fn take_wrecks(&self) -> Vec<Wreck> {
        std::mem::take(&mut self.lock().wrecks)
    }

    /// Another disk with the same files.
    pub fn copy(&self) -> Arc<Self> {
        let state = self.lock().clone();
        Self::with(State {
            trouble: Trouble::default(),
            is_dead: false,
            wrecks: Vec::new(),
            ..state
        })
    }

    /// All files with their lengths.
    pub fn files(&self) -> Vec<(PathBuf, u64)> {
        let state = self.lock();
        let files = state.names.iter().filter_map(|(path, node)| match node {
            Node::File(f) => Some((path.clone(), state.files[*f].now.len())),
            Node::Folder => None,
        });
        files.collect()
    }

    /// Turns one bit of a file around.
    pub fn flip(&self, path: &Path, offset: u64, bit: u8) {
        let mut state = self.lock();
        if let Some(&Node::File(f)) = state.names.get(path) {
            state.files[f].now.flip(offset, bit);
        }
    }

    /// Bytes of a file.
    pub fn read_file(&self, path: &Path) -> Option<Vec<u8>> {
        let state = self.lock();
        let Some(&Node::File(f)) = state.names.get(path) else {
            return None;
        };
        let mut bytes = vec![0; state.files[f].now.len() as usize];
        state.files[f].now.read(0, &mut bytes);
        Some(bytes)
    }
}
