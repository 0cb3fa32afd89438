//! What must hold whatever the disk does: each function brings one trouble over the fault case and says what was wrong.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use tetdb::catalog::{Catalog, CatalogError};
use tetdb::pipeline::PipelineError;

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

/// The exit code the program has for an error.
pub fn exit_code(error: PipelineError) -> u8 {
    match error {
        PipelineError::Catalog(e) => e.exit_code(),
        PipelineError::Store(e) => CatalogError::from(e).exit_code(),
        _ => 3,
    }
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
