//! A change of a finished store on a disk that fails, dies, fills up or loses power.
//!
//! Why: whoever makes a sub-domain again has a mesh to lose. How: two sub-domains of eight are made again on a disk in memory with one trouble at a time:
//! the store must be the old one or the new one, never in between, and the same change done again must give the new one.

use std::collections::BTreeSet;
use std::sync::OnceLock;

use tetdb_tools::sim::{Case, Changed, Reference, Rng, Trouble};

/// The case, its undisturbed run, and the undisturbed change.
fn case() -> &'static (Case, Reference, Changed) {
    static CASE: OnceLock<(Case, Reference, Changed)> = OnceLock::new();
    CASE.get_or_init(|| {
        let case = Case::tiny();
        let reference = case.reference();
        let changed = case.changed(&reference);
        (case, reference, changed)
    })
}

/// The change with each trouble; both ends must have been seen.
fn troubled(troubles: impl Iterator<Item = (String, Trouble)>) {
    let (case, reference, changed) = case();
    let mut seen = BTreeSet::new();
    for (name, trouble) in troubles {
        match case.change_troubled(trouble, reference, changed) {
            Ok(is_new) => drop(seen.insert(is_new)),
            Err(wrong) => panic!("{name}: {wrong}"),
        }
    }
    assert_eq!(seen, [false, true].into(), "both ends are met");
}

#[test]
fn a_change_killed_at_any_boundary_is_done_or_not() {
    let (.., changed) = case();
    assert!(changed.boundaries > 10, "{}", changed.boundaries);
    troubled((0..changed.boundaries).map(|boundary| {
        let trouble = Trouble { die_at_boundary: Some(boundary), ..Trouble::default() };
        (format!("killed at boundary {boundary}"), trouble)
    }));
}

#[test]
fn a_call_that_fails_leaves_the_old_mesh_or_the_new() {
    let (.., changed) = case();
    let step = (changed.calls as usize / 24).max(1);
    // The last calls too: they come after the commit.
    let calls = (0..changed.calls).step_by(step);
    let last = changed.calls.saturating_sub(6)..changed.calls;
    troubled(calls.chain(last).enumerate().map(|(i, call)| {
        let trouble = Trouble { fail_at: Some(call), fails_on: i % 3 == 2, ..Trouble::default() };
        (format!("call {call} fails"), trouble)
    }));
}

#[test]
fn a_full_disk_refuses_a_change_and_keeps_the_mesh() {
    let (case, reference, changed) = case();
    let used = changed.whole.used_bytes();
    let room = [0, 32, 64, 96, 128, 160, 192, 224, 2048];
    let ends = room.map(|kibibytes| {
        let trouble = Trouble { space: Some(used + (kibibytes << 10)), ..Trouble::default() };
        match case.change_troubled(trouble, reference, changed) {
            Ok(is_new) => is_new,
            Err(wrong) => panic!("{kibibytes} KiB of room: {wrong}"),
        }
    });
    assert_eq!((ends[0], ends[1], ends[8]), (false, false, true), "{ends:?}");
}

#[test]
fn a_loss_of_power_during_a_change_leaves_the_old_mesh_or_the_new() {
    let (case, reference, changed) = case();
    let mut rng = Rng(9);
    let mut crash_at: Vec<(u64, u64)> =
        (0..60).map(|_| (rng.below(changed.calls), rng.word())).collect();
    crash_at.sort_unstable_by(|a, b| b.cmp(a));
    let disk = changed.whole.copy();
    disk.set_trouble(Trouble { crash_at, ..Trouble::default() });
    case.change(&disk).expect("nobody sees a loss of power coming");
    let mut n = 0;
    for wreck in disk.take_wrecks() {
        let is_changed = case.is_changed(&wreck.disk, reference, changed);
        assert!(is_changed.is_ok(), "power lost before call {}: {is_changed:?}", wreck.call);
        n += 1;
    }
    assert!(n > 40, "{n}");
}
