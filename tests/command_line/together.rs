//! Readers and the writer of a finished store do not disturb each other.
//!
//! Why: a long export must not block a change, nor a change a query.
//! How: the program changes a store while others read it. Each answer must be of the mesh before or after the change. Removed data must
//! be reported as removed, not as damaged.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use tetdb_base::storage::StoreFile;
use tetdb_store::audit;
use tetdb_store::store::{Catalog, StoreError, WriterLock};

use super::place::Place;

const MEMORY: usize = 16 << 20;

/// A finished store of two sub-domains.
fn store(place: &Place) {
    let line = "mesh sample:box,h=0.045 -o a.tetdb --subdomains 2 --no-verify";
    place.run_line(line).succeeds();
}

/// Digest of all records that a reader finds.
fn found(reader: &mut Catalog) -> Result<String, StoreError> {
    let [told, _] = reader.digest()?;
    let [found, _] = audit::digest(reader, MEMORY)?;
    assert_eq!(told, found, "one state's catalog, another's records");
    Ok(found.to_string())
}

/// All files of a folder with their bytes.
fn content(dir: &Path) -> BTreeSet<(String, Vec<u8>)> {
    let entries = fs::read_dir(dir).expect("a folder");
    let content = entries.map(|entry| {
        let entry = entry.expect("an entry");
        let bytes = fs::read(entry.path()).expect("a file");
        (entry.file_name().to_string_lossy().into_owned(), bytes)
    });
    content.collect()
}

#[test]
fn a_question_during_a_change_is_answered_from_before_or_after_it() {
    let place = Place::new();
    store(&place);
    let before = place.digest("a.tetdb");
    let words = "resaturate a.tetdb --subdomain 0,1 --refine-by 0.7 --no-verify";
    let words: Vec<&str> = words.split_whitespace().collect();
    let mut writer = place.command(&words).spawn().expect("it starts");
    let (mut answers, mut n) = (Vec::new(), 0);
    while writer.try_wait().expect("it is ours").is_none() {
        place.run_line("query a.tetdb --point 0.5,0.5,0.5").succeeds();
        answers.push(place.digest("a.tetdb"));
        n += 1;
    }
    assert!(writer.wait().expect("it is ours").success());
    let after = place.digest("a.tetdb");
    assert_ne!(before, after);
    assert!(n > 0);
    let of_both = |digest: &String| *digest == before || *digest == after;
    assert!(answers.iter().all(of_both) && answers.is_sorted_by_key(|a| *a == after));
}

#[test]
fn a_reader_keeps_to_the_state_it_began_with_and_hinders_no_writer() {
    let place = Place::new();
    store(&place);
    let path = place.path("a.tetdb");
    let before = place.digest("a.tetdb");
    let mut reader = Catalog::open(&path).expect("a finished store");
    let change = "resaturate a.tetdb --subdomain 1 --refine-by 0.8";
    place.run_line(change).succeeds();
    let after = place.digest("a.tetdb");
    // The replaced files are kept as the previous version.
    assert_eq!(found(&mut reader).expect("its files are there"), before);
    assert!(!reader.is_current());
    let mut second = Catalog::open(&path).expect("a finished store");
    place.run_line("resaturate a.tetdb --subdomain 0 --refine-by 0.9 --no-verify").succeeds();
    // Now the first version of sub-domain 1 is removed.
    let gone = found(&mut reader).expect_err("a file is gone");
    assert!(matches!(gone, StoreError::Changed { .. }) && !gone.is_damage());
    assert_eq!(tetdb::Error::from(gone).code(), "store-changed");
    assert_eq!(found(&mut second).expect("its files are there"), after);
    place.run_line("resaturate a.tetdb --undo").succeeds();
    assert_eq!(place.digest("a.tetdb"), after);
}

#[test]
fn a_reader_of_a_store_that_was_replaced_gets_nothing_of_the_new_one() {
    let place = Place::new();
    store(&place);
    let mut reader = Catalog::open(place.path("a.tetdb")).expect("a finished store");
    let line = "mesh sample:box,h=0.042 -o a.tetdb --subdomains 2 --force --no-verify";
    place.run_line(line).succeeds();
    let refused = found(&mut reader).expect_err("its files are gone");
    assert!(matches!(refused, StoreError::Changed { .. }), "{refused}");
    let mut new = Catalog::open(place.path("a.tetdb")).expect("a finished store");
    assert_eq!(found(&mut new).expect("sound"), place.digest("a.tetdb"));
}

#[test]
fn a_second_writer_is_busy_and_says_who_is_first() {
    let place = Place::new();
    store(&place);
    let path = place.path("a.tetdb");
    let held = WriterLock::acquire(&path).expect("nobody has it");
    for line in [
        "resaturate a.tetdb --subdomain 0 --json",
        "resaturate a.tetdb --forget --json",
        "resaturate a.tetdb --repair --json",
        "resume a.tetdb --json",
        "mesh sample:box,h=0.3 -o a.tetdb --force --json",
    ] {
        let done = place.run_line(line);
        assert_eq!(done.exit(), Some(5), "{line}: {}", done.stderr());
        let message = done.error()["message"].to_string();
        assert!(message.contains(&std::process::id().to_string()), "{message}");
    }
    place.run_line("verify a.tetdb").succeeds();
    drop(held);
    assert!(!path.join("writer.lock").exists());
}

#[test]
fn what_a_killed_writer_left_is_read_as_it_is_and_cleaned_up_by_the_next() {
    let place = Place::new();
    store(&place);
    let path = place.path("a.tetdb");
    let digest = place.digest("a.tetdb");
    // As earlier versions of the program left it: changed in place, and not closed.
    let mut file = StoreFile::open(path.join("catalog.redb"), 1 << 20, true).expect("a catalog");
    let key = u64::MAX - 1;
    file.write([(key, &[1][..])].into_iter()).expect("room");
    let torn = fs::read(path.join("catalog.redb")).expect("a catalog");
    drop(file);
    for (name, bytes) in [
        ("catalog.redb", &torn[..]),
        ("catalog.redb-next", b"half of it"),
        ("writer.lock", b"{\"host\":\"x\",\"process\":1,\"time\":1,\"run\":\"1\"}"),
        ("subdomain-00000-g77.redb", b"half of it"),
    ] {
        fs::write(path.join(name), bytes).expect("room");
    }
    let before = content(&path);
    assert_eq!(place.digest("a.tetdb"), digest);
    for line in ["query a.tetdb --point 0.5,0.5,0.5", "info a.tetdb", "verify a.tetdb"] {
        place.run_line(line).succeeds();
    }
    assert!(content(&path) == before, "reading changes nothing");
    place.run_line("resaturate a.tetdb --subdomain 0 --no-verify").succeeds();
    assert_eq!(place.digest("a.tetdb"), digest);
    let names: Vec<String> = content(&path).into_iter().map(|(name, _)| name).collect();
    for gone in ["catalog.redb-next", "writer.lock", "subdomain-00000-g77.redb"] {
        assert!(!names.iter().any(|name| name == gone), "{gone} in {names:?}");
    }
}

#[test]
fn of_two_runs_of_one_job_none_fails_but_while_the_other_writes() {
    let place = Place::new();
    for delay in [0, 10, 40, 160, 640] {
        let start = || {
            let words = ["mesh", "sample:box,h=0.2", "-o", "x.tetdb"];
            place.command(&words).spawn().expect("the program starts")
        };
        let mut one = start();
        std::thread::sleep(std::time::Duration::from_millis(delay));
        let mut two = start();
        let exits = [&mut one, &mut two].map(|child| child.wait().expect("it ends").code());
        let fine = |code| matches!(code, Some(0 | 5));
        assert!(exits.into_iter().all(fine) && exits.contains(&Some(0)), "{delay} ms: {exits:?}");
        place.run_line("verify x.tetdb").succeeds();
        let left = content(&place.path("x.tetdb"));
        assert!(left.iter().all(|(name, _)| !name.contains("lock")), "{delay} ms");
        fs::remove_dir_all(place.path("x.tetdb")).expect("it is ours");
    }
}
