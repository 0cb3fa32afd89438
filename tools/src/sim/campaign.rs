//! What must hold whatever the disk does: each function brings one trouble over the fault case and says what was wrong.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use tetdb_engine::pipeline::PipelineError;
use tetdb_store::store::Catalog;

use super::{Case, Digests, SimDisk, Trouble, Wreck};

/// How a run with trouble ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum End {
    /// The trouble did no harm.
    Done,
    /// An error with this exit code.
    Failed(u8, String),
    /// Which must not be.
    Panicked(String),
}

/// An undisturbed run.
pub struct Reference {
    pub digests: Digests,
    pub calls: u64,
    pub boundaries: u64,
    /// Calls until the store had its first commit.
    pub calls_to_create: u64,
    pub bytes_peak: u64,
}

/// A finished store and what an undisturbed change makes of it.
pub struct Changed {
    pub whole: Arc<SimDisk>,
    pub digests: Digests,
    pub calls: u64,
    pub boundaries: u64,
}

/// The exit code the program has for an error.
pub fn exit_code(error: PipelineError) -> u8 {
    tetdb::Error::from(error).exit_code()
}

fn ended(run: impl FnOnce() -> Result<(), PipelineError>) -> End {
    match catch_unwind(AssertUnwindSafe(run)) {
        Ok(Ok(())) => End::Done,
        Ok(Err(e)) => {
            let text = e.to_string();
            End::Failed(exit_code(e), text)
        }
        Err(payload) => {
            let text = payload.downcast_ref::<String>().cloned();
            let word = payload.downcast_ref::<&str>().map(|s| (*s).to_owned());
            End::Panicked(text.or(word).unwrap_or_default())
        }
    }
}

impl Case {
    /// Runs on a sound disk.
    pub fn reference(&self) -> Reference {
        let disk = SimDisk::new();
        let store = self.store(&disk);
        Catalog::create(&store, &Default::default()).expect("a sound disk");
        let calls_to_create = disk.calls();
        let disk = SimDisk::new();
        self.run(&disk).expect("a sound disk");
        let (calls, boundaries) = (disk.calls(), disk.boundaries());
        Reference {
            calls,
            boundaries,
            calls_to_create,
            bytes_peak: disk.used_bytes_peak(),
            digests: self.digests(&disk).expect("a sound disk"),
        }
    }

    /// Runs on a new disk with `trouble`; returns the disk, sound again, and how the run ended.
    pub fn troubled(&self, trouble: Trouble) -> (Arc<SimDisk>, End) {
        let disk = SimDisk::new();
        disk.set_trouble(trouble);
        let end = ended(|| self.run(&disk));
        disk.set_trouble(Trouble::default());
        (disk, end)
    }

    /// The finished store, the same after a change, its digests, and the calls and boundaries the change took.
    pub fn changed(&self, reference: &Reference) -> Changed {
        let whole = SimDisk::new();
        self.run(&whole).expect("a sound disk");
        let disk = whole.copy();
        disk.set_trouble(Trouble::default());
        self.change(&disk).expect("a sound disk");
        let (calls, boundaries) = (disk.calls(), disk.boundaries());
        let digests = self.digests(&disk).expect("a sound disk");
        assert_ne!(digests[0], reference.digests[0], "the change changes");
        assert_eq!(digests[1], reference.digests[1], "interfaces stay");
        Changed { whole, digests, calls, boundaries }
    }

    /// Changes the finished store with `trouble`, then again on the sound disk. Errors: what was wrong: a store in between, or another mesh.
    pub fn change_troubled(
        &self,
        trouble: Trouble,
        reference: &Reference,
        changed: &Changed,
    ) -> Result<bool, String> {
        let disk = changed.whole.copy();
        disk.set_trouble(trouble);
        let end = ended(|| self.change(&disk));
        disk.set_trouble(Trouble::default());
        if let Some(wrong) = unclean(&end) {
            return Err(wrong);
        }
        let is_new = self.is_changed(&disk, reference, changed)?;
        if end == End::Done && !is_new {
            return Err("said to be done, and is not".to_owned());
        }
        if !is_new {
            match ended(|| self.change(&disk)) {
                End::Done => {}
                end => return Err(format!("again: {end:?}")),
            }
            if !self.is_changed(&disk, reference, changed)? {
                return Err("again, and nothing has changed".to_owned());
            }
        }
        Ok(is_new)
    }

    /// Whether a store is the new one, not the old. Errors: it is neither.
    pub fn is_changed(
        &self,
        disk: &Arc<SimDisk>,
        reference: &Reference,
        changed: &Changed,
    ) -> Result<bool, String> {
        self.check(disk).map_err(|e| format!("check: {e}"))?;
        let digests = self.digests(disk).map_err(|e| format!("digest: {e}"))?;
        if digests == changed.digests {
            return Ok(true);
        }
        match digests == reference.digests {
            true => Ok(false),
            false => Err(format!("neither the old mesh nor the new: {digests:?}")),
        }
    }

    /// Goes on with a store. Errors: what was wrong with it, or with the mesh it became.
    pub fn resumed(&self, disk: &Arc<SimDisk>, reference: &Reference) -> Result<(), String> {
        match ended(|| self.run(disk)) {
            End::Done => {}
            end => return Err(format!("resume: {end:?}")),
        }
        let digests = self.digests(disk).map_err(|e| format!("digest: {e}"))?;
        match digests == reference.digests {
            true => Ok(()),
            false => Err(format!("another mesh: {digests:?}")),
        }
    }

    /// Looks at what a loss of power left; before the first commit there need not be a store.
    pub fn survives(&self, wreck: &Wreck, reference: &Reference) -> Result<(), String> {
        let store = self.store(&wreck.disk);
        if wreck.call <= reference.calls_to_create
            && (!store.exists() || Catalog::is_vacant(&store))
        {
            return Ok(());
        }
        match catch_unwind(AssertUnwindSafe(|| self.check(&wreck.disk))) {
            Ok(Ok(_)) => Ok(()),
            Ok(Err(e)) => Err(e.to_string()),
            Err(_) => Err("panic".to_owned()),
        }
    }
}

/// What is wrong with an end that only an error of the disk may have caused.
pub fn unclean(end: &End) -> Option<String> {
    match end {
        End::Done | End::Failed(6, _) => None,
        other => Some(format!("{other:?}")),
    }
}
