//! A store on a disk that fails, fills up, loses power or tells lies.
//!
//! Why: long runs meet all of it, and work that was done must not be lost, nor a mesh be another one for it.
//! How: a small mesh in eight sub-domains, with so little memory that pages leave it, is made on a disk in memory with one trouble at a
//! time; then the disk is sound again, and the run goes on. `soak` does the same for every call, with a larger mesh, and for hours.

use std::sync::OnceLock;

use tetdb_store::audit::{self, Level, VerifyOptions};
use tetdb_store::store::Catalog;
use tetdb_tools::sim::{Call, Case, End, Reference, Rng, SimDisk, Trouble, Wreck, unclean};

/// The case and its undisturbed run.
fn case() -> &'static (Case, Reference) {
    static CASE: OnceLock<(Case, Reference)> = OnceLock::new();
    CASE.get_or_init(|| {
        let case = Case::tiny();
        let reference = case.reference();
        (case, reference)
    })
}

/// Losses of power in one run on a disk that lies, or does not.
fn wrecks(n: u64, seed: u64, lies: Option<Call>) -> Vec<Wreck> {
    let (case, reference) = case();
    let mut rng = Rng(seed);
    let mut crash_at: Vec<(u64, u64)> =
        (0..n).map(|_| (rng.below(reference.calls), rng.word())).collect();
    crash_at.sort_unstable_by(|a, b| b.cmp(a));
    let (disk, end) = case.troubled(Trouble { crash_at, lies, ..Trouble::default() });
    assert_eq!(end, End::Done, "nobody sees a loss of power coming");
    disk.take_wrecks()
}

#[test]
fn the_large_case_is_one_where_pages_leave_memory_and_sorts_have_runs() {
    let unlinked = |case: &Case| {
        let disk = SimDisk::new();
        case.run(&disk).expect("a sound disk");
        let calls = disk.by_call();
        assert!(calls[&Call::Read] > 1000, "{calls:?}");
        calls[&Call::Unlink]
    };
    // Both have as many sub-domains, so that what is removed beyond is runs.
    let (small, large) = (unlinked(&Case::tiny()), unlinked(&Case::small()));
    assert!(large > small, "{large} files are removed, and {small}");
}

#[test]
fn a_call_that_fails_is_an_error_and_no_work_is_lost() {
    let (case, reference) = case();
    let step = reference.calls as usize / 23;
    for (i, call) in (0..reference.calls).step_by(step).enumerate() {
        let (disk, end) = case.troubled(Trouble {
            fail_at: Some(call),
            fails_on: i % 3 == 2,
            ..Trouble::default()
        });
        assert_eq!(unclean(&end), None, "call {call} failed");
        if let Err(wrong) = case.resumed(&disk, reference) {
            panic!("call {call} failed, then {wrong}");
        }
    }
}

#[test]
fn a_run_killed_between_two_changes_goes_on() {
    let (case, reference) = case();
    let step = reference.boundaries as usize / 23;
    for boundary in (0..reference.boundaries).step_by(step) {
        let (disk, end) =
            case.troubled(Trouble { die_at_boundary: Some(boundary), ..Trouble::default() });
        assert_eq!(unclean(&end), None, "killed at {boundary}");
        if let Err(wrong) = case.resumed(&disk, reference) {
            panic!("killed at boundary {boundary}, then {wrong}");
        }
    }
}

#[test]
fn a_full_disk_is_told_and_the_run_goes_on_when_there_is_room() {
    let (case, reference) = case();
    for share in 0..8 {
        let space = reference.bytes_peak * share / 8;
        let (disk, end) = case.troubled(Trouble { space: Some(space), ..Trouble::default() });
        match end {
            End::Failed(6, text) => assert!(text.contains("no space left"), "{text}"),
            other => panic!("{space} bytes of room: {other:?}"),
        }
        if let Err(wrong) = case.resumed(&disk, reference) {
            panic!("{space} bytes of room, then {wrong}");
        }
    }
    let (_, end) = case.troubled(Trouble {
        // Which step is under way while another is committed differs a little from run to run.
        space: Some(2 * reference.bytes_peak),
        ..Trouble::default()
    });
    assert_eq!(end, End::Done, "more room than the undisturbed run took");
}

#[test]
fn what_a_loss_of_power_leaves_is_a_store() {
    let (case, reference) = case();
    for (i, wreck) in wrecks(150, 5, None).into_iter().enumerate() {
        let survived = case.survives(&wreck, reference);
        assert_eq!(survived, Ok(()), "power lost before call {}", wreck.call);
        if i % 25 == 0 {
            let resumed = case.resumed(&wreck.disk, reference);
            assert_eq!(resumed, Ok(()), "power lost before call {}", wreck.call);
        }
    }
}

/// Were this not so, the test above could not fail.
#[test]
fn a_disk_whose_syncs_do_nothing_is_found_out() {
    let (case, reference) = case();
    for lies in [Call::Sync, Call::SyncFile, Call::SyncDir] {
        let wrecks = wrecks(40, 6, Some(lies));
        let broken = wrecks.iter().filter(|w| case.survives(w, reference).is_err());
        let n = broken.count();
        assert!(n > 4, "{lies:?}: only {n} of {} are broken", wrecks.len());
    }
}

#[test]
fn a_bit_that_was_turned_is_found_or_changes_nothing() {
    let (case, reference) = case();
    let whole = SimDisk::new();
    case.run(&whole).expect("a sound disk");
    let files = whole.files();
    let mut rng = Rng(8);
    let (mut found, mut harmless) = (0, 0);
    for _ in 0..120 {
        let (path, len) = &files[rng.below(files.len() as u64) as usize];
        let (offset, bit) = (rng.below(*len), rng.below(8) as u8);
        let disk = whole.copy();
        disk.flip(path, offset, bit);
        let place = format!("{} byte {offset} bit {bit}", path.display());
        match verified(case, &disk) {
            Ok(true) => {
                harmless += 1;
                let digests = case.digests(&disk).map_err(|e| e.to_string());
                assert_eq!(digests.as_ref(), Ok(&reference.digests), "{place}");
            }
            Ok(false) => panic!("{place}: the mesh is said to be invalid"),
            Err(error) => {
                found += 1;
                assert!(error.is_damage(), "{place}: {error}");
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                assert!(error.to_string().contains(&*name), "{place}: {error}");
            }
        }
    }
    assert!(found > 8 && harmless > 8, "{found} found, {harmless} harmless");
}

fn verified(
    case: &Case,
    disk: &std::sync::Arc<SimDisk>,
) -> Result<bool, tetdb_store::store::StoreError> {
    let scratch = tempfile::tempdir().expect("a temporary directory");
    let options = VerifyOptions::new(Level::Delaunay, 32 << 20, scratch.path().to_owned());
    let mut store = Catalog::open(case.store(disk))?;
    Ok(audit::verify(&mut store, None, &options)?.valid)
}
