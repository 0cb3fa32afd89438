//! The ranks of an MPI program, seen from this process.

use std::sync::OnceLock;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::failure::Failure;
use tetdb_engine::api::mpi::Ranks;
use tetdb_engine::api::{Settings, Share, Writers};

static RANKS: OnceLock<Ranks> = OnceLock::new();

/// The ranks of this program; `None` if it was started without an MPI launcher.
///
/// Errors: it was started by the launcher of another MPI.
pub(super) fn begin() -> Result<Option<Ranks>, Failure> {
    let ranks = Ranks::begin()?;
    if let Some(ranks) = ranks.as_ref().filter(|ranks| !ranks.is_alone()) {
        let _ = RANKS.set(ranks.clone());
    }
    Ok(ranks)
}

/// This rank's share of work divided among all ranks; `None` if there are no others.
pub(super) fn share() -> Option<Share> {
    RANKS.get().map(Ranks::share)
}

/// The ranks as joint writers of one file; `None` if there are no others.
pub(super) fn writers() -> Option<Box<dyn Writers>> {
    RANKS.get().map(Ranks::shared_file)
}

/// Lets a run of rank 0 use the other ranks, if any.
pub(super) fn share_work(settings: Settings) -> Settings {
    match RANKS.get() {
        Some(ranks) => ranks.share_work(settings),
        None => settings,
    }
}

/// Combines the results of all ranks on rank 0; other ranks send theirs. Errors: those of any rank.
pub(super) fn gather<T: Serialize + DeserializeOwned>(
    mine: Result<T, Failure>,
    add: impl Fn(&mut T, T),
) -> Result<T, Failure> {
    let Some(ranks) = RANKS.get() else {
        return mine;
    };
    let others = ranks.gather(mine.as_ref().map_err(|f| (f.code, f.message.as_str())));
    let mut all = mine?;
    others?.into_iter().for_each(|other| add(&mut all, other));
    Ok(all)
}
