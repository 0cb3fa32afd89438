//! Versions saved, restored and dropped by processes that are killed.
//!
//! Why: a version promises that its files stay; a file removed too early is a mesh lost, one removed too late is disk lost.
//! How: a history of versions on a disk in memory. Each step is killed before every single change of the disk. Then now and all
//! versions are read to the last record: all must be as before the step or as after it, with exactly the files that those need, and
//! the step done again must give the latter.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use tetdb_engine::pipeline;
use tetdb_schema::catalog::VersionRow;
use tetdb_store::audit;
use tetdb_store::store::{BEFORE, Catalog};
use tetdb_tools::sim::{Case, Ended, SimDisk, Trouble};

#[derive(Clone, Copy, Debug)]
enum Act {
    Change,
    Save(u32),
    Restore(u32),
    Drop(u32),
}

const HISTORY: [Act; 11] = [
    Act::Save(1),
    Act::Change,
    Act::Save(2),
    Act::Restore(1),
    Act::Restore(BEFORE),
    Act::Restore(1),
    Act::Drop(2),
    Act::Restore(BEFORE),
    Act::Save(3),
    Act::Drop(1),
    Act::Drop(3),
];

fn act(case: &Case, disk: &Arc<SimDisk>, act: Act) -> Ended {
    if let Act::Change = act {
        return case.change(disk);
    }
    let mut catalog = Catalog::open_writable(case.store(disk))?;
    match act {
        Act::Change => {}
        Act::Save(number) => {
            let name = format!("v{number}");
            let new = catalog.version_now(VersionRow { name, ..VersionRow::default() })?;
            catalog.commit(|step| {
                step.set_version(number, &new);
                Ok(())
            })?;
        }
        Act::Restore(number) => drop(pipeline::restore(&mut catalog, number)?),
        Act::Drop(number) => catalog.commit(|step| {
            step.remove_version(number);
            Ok(())
        })?,
    }
    Ok(catalog.close()?)
}

/// Digests of now and of all versions, from their records, and the names of all files.
type State = (BTreeMap<Option<u32>, String>, BTreeSet<String>);

fn state(case: &Case, disk: &Arc<SimDisk>) -> State {
    case.check(disk).expect("a sound store");
    let mut catalog = Catalog::open(case.store(disk)).expect("a store");
    let versions = catalog.versions().expect("no damage");
    let mut readers = BTreeMap::from([(None, catalog.share())]);
    readers.extend(versions.iter().map(|(&number, version)| (Some(number), catalog.at(version))));
    let digests = readers.into_iter().map(|(number, mut reader)| {
        let found = audit::digest(&mut reader, 4 << 20).expect("every file is there");
        assert_eq!(found, reader.digest().expect("no damage"), "{number:?}");
        (number, found[0].to_string())
    });
    let names = disk.files().into_iter().map(|(path, _)| path.display().to_string());
    (digests.collect(), names.filter(|name| !name.ends_with("writer.lock")).collect())
}

#[test]
fn a_step_killed_anywhere_is_done_or_not_and_no_file_is_lost_or_left() {
    let case = Case::tiny();
    let disk = SimDisk::new();
    case.run(&disk).expect("a sound disk");
    let (mut n_killed, mut seen, meshed) = (0, BTreeSet::new(), state(&case, &disk).1);
    for step in HISTORY {
        let (before, old) = (disk.copy(), state(&case, &disk));
        disk.set_trouble(Trouble::default());
        act(&case, &disk, step).expect("a sound disk");
        let (boundaries, new) = (disk.boundaries(), state(&case, &disk));
        assert_ne!(old, new, "{step:?}");
        // Most of a change is one mesh written; `changes.rs` kills that.
        let stride = if let Act::Change = step { 7 } else { 1 };
        for boundary in (0..boundaries).step_by(stride) {
            let killed = before.copy();
            killed.set_trouble(Trouble { die_at_boundary: Some(boundary), ..Trouble::default() });
            let _ = act(&case, &killed, step);
            killed.set_trouble(Trouble::default());
            let found = state(&case, &killed);
            let is_new = found == new;
            assert!(is_new || found == old, "{step:?} killed at {boundary}: {found:?}");
            if !is_new {
                act(&case, &killed, step).expect("a sound disk");
                assert_eq!(state(&case, &killed), new, "{step:?} again");
            }
            seen.insert(is_new);
            n_killed += 1;
        }
    }
    assert!(n_killed > 50 && seen.len() == 2, "{n_killed} {seen:?}");
    // One file of each changed sub-domain is what undoing brings back.
    pipeline::forget(&mut Catalog::open_writable(case.store(&disk)).expect("a store"))
        .expect("a sound disk");
    assert_eq!(state(&case, &disk).1.len(), meshed.len());
}
