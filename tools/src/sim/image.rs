//! What a loss of power leaves: all that was synced, and some of what was not.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use super::content::{Content, SECTOR};
use super::disk::SimDisk;
use super::state::{FileState, NameChange, Node, Pending, State};
use super::{Rng, Trouble};

/// A disk after a loss of power at one moment.
#[derive(Clone, Debug)]
pub struct Wreck {
    /// The call before which power went.
    pub call: u64,
    pub disk: Arc<SimDisk>,
}

impl NameChange {
    pub(super) fn apply(&self, names: &mut BTreeMap<PathBuf, Node>) {
        if let Some(path) = &self.removed {
            names.remove(path);
        }
        if let Some((path, node)) = &self.added {
            names.insert(path.clone(), *node);
        }
    }
}

impl Wreck {
    /// Files: what was synced, then each later write whole, lost, or torn between sectors. Names: as the folders were synced, then some of
    /// the later changes, in half of the wrecks a beginning of them as a journal would have it, in the others any of them.
    pub(super) fn of(state: &State, call: u64, rng: &mut Rng) -> Self {
        let mut names = state.names_synced.clone();
        let kept = rng.below(state.name_changes.len() as u64 + 1) as usize;
        let in_order = rng.percent(50);
        for (i, change) in state.name_changes.iter().enumerate() {
            let keep = match in_order {
                true => i < kept,
                false => rng.percent(50),
            };
            if keep {
                change.apply(&mut names);
            }
        }
        // What is in a folder that is gone is gone.
        let folders = names.clone();
        names.retain(|path, _| {
            let above = path.ancestors().skip(1);
            above
                .filter(|a| !a.as_os_str().is_empty())
                .all(|a| folders.get(a) == Some(&Node::Folder))
        });
        let share = [0, 20, 50, 80, 100][rng.below(5) as usize];
        let mut files = Vec::new();
        for node in names.values_mut() {
            if let Node::File(f) = node {
                let content = after_loss(&state.files[*f], share, rng);
                *f = files.len();
                files.push(FileState {
                    synced: content.clone(),
                    now: content,
                    pending: Vec::new(),
                    is_linked: true,
                });
            }
        }
        let blocks = files.iter().map(|f| f.now.blocks_used()).sum();
        let disk = SimDisk::with(State {
            blocks,
            names_synced: names.clone(),
            names,
            files,
            trouble: Trouble::default(),
            ..State::default()
        });
        Self { call, disk }
    }
}

fn after_loss(file: &FileState, share: u64, rng: &mut Rng) -> Content {
    let mut content = file.synced.clone();
    for pending in &file.pending {
        let whole = rng.percent(share);
        match pending {
            Pending::SetLen(len) if whole => content.set_len(*len),
            Pending::SetLen(_) => {}
            Pending::Write(offset, data) if whole => content.write(*offset, data),
            Pending::Write(offset, data) if share > 0 && rng.percent(30) => {
                torn(&mut content, *offset, data, rng);
            }
            Pending::Write(..) => {}
        }
    }
    content
}

/// Writes some of the sectors.
fn torn(content: &mut Content, offset: u64, data: &[u8], rng: &mut Rng) {
    let mut at = 0;
    while at < data.len() {
        let to_edge = SECTOR - (offset as usize + at) % SECTOR;
        let end = (at + to_edge).min(data.len());
        if rng.percent(50) {
            content.write(offset + at as u64, &data[at..end]);
        }
        at = end;
    }
}
