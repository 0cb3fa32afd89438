//! The library and the program use the same calls.
//!
//! Why: a store left by one of them must be complete for the other, and a program that embeds the library must survive any outcome of a
//! run.
//! How: each creates stores, which the other verifies, resumes and changes. Concurrent runs are cancelled, refused and finished.

use std::path::Path;
use std::process::{Command, Output};
use std::sync::atomic::{AtomicBool, Ordering};
use tetdb::Code;

use tetdb::{
    CancelToken, Event, Length, Mesher, Order, Settings, Sizes, Store, Subdomains, Surface,
    VerifyLevel,
};
use tetdb_store::store::Catalog;

type Outcome = Result<(), Box<dyn std::error::Error>>;

fn program(dir: &Path, words: &[&str]) -> std::io::Result<Output> {
    Command::new(env!("CARGO_BIN_EXE_tetdb")).args(words).current_dir(dir).output()
}

/// Output of the program, which must succeed.
fn answer(dir: &Path, words: &[&str]) -> std::io::Result<String> {
    let output = program(dir, words)?;
    let talk = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{words:?}: {talk}");
    Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// A cube of side 1 in 12 triangles.
fn cube() -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let points = (0..8).map(|i| [i & 1, i >> 1 & 1, i >> 2 & 1].map(f64::from));
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    (points.collect(), triangles.collect())
}

fn mesher() -> Result<Mesher, tetdb::Error> {
    let (points, triangles) = cube();
    let surface = Surface::from_arrays(&points, &triangles, None)?.refined(Length::units(0.2))?;
    Ok(Mesher::new(surface).threads(2))
}

#[test]
fn what_the_library_makes_from_arrays_the_program_goes_on_with() -> Outcome {
    let dir = tempfile::tempdir()?;
    let path = dir.path().join("cube.tetdb");
    let mut store = mesher()?.subdomains(Subdomains::Exactly(1)).create(&path)?;
    assert!(store.summary().is_verified && store.summary().n_tets > 100);
    let near = store.query().in_box([0.0; 3], [0.1; 3]).collect()?;
    assert!(!near.is_empty());
    let digest = store.summary().digest.clone();
    drop(store);
    let run = |words: &[&str]| answer(dir.path(), words);
    assert_eq!(run(&["digest", "cube.tetdb"])?, digest);
    run(&["verify", "cube.tetdb", "--full"])?;
    run(&["info", "cube.tetdb", "--json"])?;
    run(&["resume", "cube.tetdb"])?;
    run(&["resaturate", "cube.tetdb", "--subdomain", "0", "--refine-by", "0.7"])?;
    assert_ne!(run(&["digest", "cube.tetdb"])?, digest);
    let store = Store::open(&path)?.undo()?;
    assert_eq!(store.summary().digest, digest);
    Ok(())
}

#[test]
fn what_the_program_makes_the_library_goes_on_with() -> Outcome {
    let dir = tempfile::tempdir()?;
    let words = ["mesh", "sample:box,h=0.2", "-o", "box.tetdb", "--hsiz", "10%"];
    answer(dir.path(), &words)?;
    let theirs = Store::open(dir.path().join("box.tetdb"))?;
    let ours = Mesher::new(Surface::sample("box,h=0.2")?)
        .sizes(Sizes::interior(Length::share_of_diagonal(0.1)))
        .threads(1)
        .create(dir.path().join("ours.tetdb"))?;
    assert!(ours.is_same_mesh(&theirs));
    assert!(theirs.verify(VerifyLevel::Delaunay)?.is_valid());
    let n = theirs.summary().n_tets;
    let changed = theirs.remesh().subdomains(&[0]).scaled(0.7).run()?;
    assert!(changed.store.summary().n_tets > n);
    answer(dir.path(), &["verify", "box.tetdb"])?;
    // Repeating the job returns the same store.
    let again = Mesher::new(Surface::sample("box,h=0.2")?)
        .sizes(Sizes::interior(Length::share_of_diagonal(0.1)))
        .create(dir.path().join("ours.tetdb"))?;
    assert!(again.is_same_mesh(&ours));
    let other = Mesher::new(Surface::sample("box,h=0.25")?).create(dir.path().join("ours.tetdb"));
    assert_eq!(other.err().map(|e| e.code()), Some(Code::StoreExists));
    Ok(())
}

#[test]
fn a_cancelled_run_goes_on_in_the_same_process_and_in_the_program() -> Outcome {
    let dir = tempfile::tempdir()?;
    let whole = mesher()?.create(dir.path().join("whole.tetdb"))?;
    for (name, by_program) in [("a.tetdb", false), ("b.tetdb", true)] {
        let (path, token) = (dir.path().join(name), CancelToken::new());
        let inner = token.clone();
        let begun = mesher()?.cancel(&token).progress(move |event| {
            if matches!(event, Event::StoreBegun(_)) {
                inner.cancel();
            }
        });
        let error = begun.create(&path).err().ok_or("it was cancelled")?;
        assert!(error.is_cancelled(), "{error}");
        assert_eq!(error.exit_code(), 130);
        let refused = Store::open(&path).err().map(|e| e.code());
        assert_eq!(refused, Some(Code::StoreUnfinished));
        token.reset();
        let store = match by_program {
            true => {
                answer(dir.path(), &["resume", name])?;
                Store::open(&path)?
            }
            false => Store::resume(&path, Settings::new().cancel(&token))?,
        };
        assert!(store.is_same_mesh(&whole));
    }
    Ok(())
}

/// Number of threads of this process, if the system reports it.
fn n_threads() -> Option<usize> {
    Some(std::fs::read_dir("/proc/self/task").ok()?.count())
}

#[test]
fn of_three_runs_at_once_each_ends_in_its_own_way() -> Outcome {
    let dir = tempfile::tempdir()?;
    let whole = mesher()?.create(dir.path().join("whole.tetdb"))?;
    let token = CancelToken::new();
    let was_cancelled = AtomicBool::new(false);
    std::thread::scope(|scope| -> Outcome {
        let cancelled = scope.spawn(|| {
            let inner = token.clone();
            let run = mesher()?.cancel(&token).progress(move |_| inner.cancel());
            run.create(dir.path().join("cancelled.tetdb"))
        });
        let refused = scope.spawn(|| {
            let (points, mut triangles) = cube();
            triangles.pop();
            let open = Surface::from_arrays(&points, &triangles, None)?;
            Mesher::new(open).create(dir.path().join("refused.tetdb"))
        });
        let finished = scope.spawn(|| mesher()?.create(dir.path().join("finished.tetdb")));
        let cancelled = cancelled.join().expect("no call unwinds into its caller");
        was_cancelled.store(cancelled.is_err_and(|e| e.is_cancelled()), Ordering::Relaxed);
        let refused = refused.join().expect("no call unwinds into its caller");
        assert_eq!(refused.err().map(|e| e.code()), Some(Code::OpenSurface));
        let finished = finished.join().expect("no call unwinds into its caller");
        assert!(finished?.is_same_mesh(&whole));
        Ok(())
    })?;
    assert!(was_cancelled.into_inner());
    assert!(!dir.path().join("refused.tetdb").exists());
    Ok(())
}

#[test]
fn a_run_leaves_no_thread_behind() -> Outcome {
    let dir = tempfile::tempdir()?;
    let run = |name: &str| -> Outcome {
        let mut store = mesher()?.threads(5).create(dir.path().join(name))?;
        let worst = store.query().order_by("quality", Order::Falling)?.limit(2);
        assert_eq!(worst.collect()?.len(), 2);
        Ok(())
    };
    run("first.tetdb")?;
    // Other tests of this process start and end threads. Threads left over by runs would add up.
    let mut least = usize::MAX;
    for i in 0..8 {
        run(&format!("{i}.tetdb"))?;
        least = least.min(n_threads().unwrap_or(0));
    }
    assert!(least < 30, "{least} threads");
    Ok(())
}

#[test]
fn a_store_of_another_recipe_is_not_gone_on_with() -> Outcome {
    let dir = tempfile::tempdir()?;
    let path = dir.path().join("old.tetdb");
    let token = CancelToken::new();
    let inner = token.clone();
    let begun = mesher()?.cancel(&token).progress(move |event| {
        if matches!(event, Event::StoreBegun(_)) {
            inner.cancel();
        }
    });
    assert!(begun.create(&path).is_err());
    let mut catalog = Catalog::open_writable(&path)?;
    catalog.commit(|step| {
        step.set_blob(tetdb_schema::blob::Blob::Recipe, &99u32.to_le_bytes());
        Ok(())
    })?;
    catalog.close()?;
    let error = Store::resume(&path, Settings::new()).err().ok_or("refused")?;
    assert_eq!((error.code(), error.exit_code()), (Code::StoreRecipe, 8));
    assert!(error.message().contains("99"), "{error}");
    let output = program(dir.path(), &["resume", "old.tetdb"])?;
    assert_eq!(output.status.code(), Some(8));
    Ok(())
}

#[test]
fn what_makes_no_sense_is_an_error_with_a_word() -> Outcome {
    let dir = tempfile::tempdir()?;
    let (points, triangles) = cube();
    let code = |result: Result<Surface, tetdb::Error>| result.err().map(|e| e.code());
    let mut wild = triangles.clone();
    wild[3][1] = 77;
    assert_eq!(code(Surface::from_arrays(&points, &wild, None)), Some(Code::IndexOutOfRange));
    let mut nan = points.clone();
    nan[2][0] = f64::NAN;
    assert_eq!(code(Surface::from_arrays(&nan, &triangles, None)), Some(Code::NotANumber));
    assert_eq!(
        code(Surface::from_arrays(&points, &triangles, Some(&["a"]))),
        Some(Code::CountMismatch)
    );
    assert_eq!(code(Surface::sample("teapot")), Some(Code::BadSample));
    assert_eq!(code(Surface::read(["nowhere.stl"])), Some(Code::UnreadableFile));
    let path = dir.path().join("x.tetdb");
    let word = |mesher: Mesher| mesher.create(&path).err().map(|e| e.code());
    let sizes = Sizes::interior(Length::units(-1.0));
    assert_eq!(word(mesher()?.sizes(sizes)), Some(Code::BadSize));
    assert_eq!(word(mesher()?.subdomains(Subdomains::Exactly(0))), Some(Code::Usage));
    assert_eq!(word(mesher()?.threads(0)), Some(Code::Usage));
    assert_eq!(word(mesher()?.memory(tetdb::Bytes::mib(3))), Some(Code::Memory));
    assert!(!path.exists(), "a refused run leaves nothing");
    Ok(())
}

#[test]
fn on_steps_needles_and_caps_what_the_surface_does_not_force_is_mended() -> Outcome {
    let dir = tempfile::tempdir()?;
    let at = |name: String| dir.path().join(name);
    for (spec, seed) in [("steps", 1), ("needles,count=16,holes=2", 2), ("caps,count=24", 3)]
        .into_iter()
        .flat_map(|(spec, first)| (first..first + 2).map(move |seed| (spec, seed)))
    {
        let mesher = |threads| {
            let surface = Surface::sample(&format!("{spec},seed={seed}"))?;
            Ok::<_, tetdb::Error>(Mesher::new(surface).threads(threads))
        };
        let name = spec.split(',').next().unwrap_or(spec);
        let mut store = mesher(1)?.create(at(format!("{name}{seed}.tetdb")))?;
        let other = mesher(2)?.create(at(format!("{name}{seed}_2.tetdb")))?;
        assert!(store.is_same_mesh(&other), "{spec} {seed}");
        assert!(store.summary().n_tets < 20_000, "{spec} {seed}");
        // No volume that is indistinguishable from zero, unless a triangle forces it.
        let flat = "volume < 1e-12*edge_max^3 and excess > 2";
        assert!(store.query().where_(flat)?.collect()?.is_empty(), "{spec} {seed}");
        let worst = store.query().order_by("excess", Order::Falling)?.limit(1);
        let worst = worst.collect()?.remove(0);
        assert!(
            worst.excess() >= 1.0 - 1e-9 && worst.excess() <= worst.shape.quality * (1.0 + 1e-9)
        );
        // A poor tetrahedron that is nearly as good as allowed has a face on the surface.
        let forced = store.query().where_("quality > 3 and excess < 1.5")?.collect()?;
        assert!(forced.iter().all(|hit| hit.on_surface.is_some_and(|faces| faces.contains(&true))));
    }
    Ok(())
}

/// A page can be changed so that its checksums are right. A run that reads it reports damage, never a bug of the program.
#[test]
fn pages_that_are_no_mesh_are_damage() -> Outcome {
    use redb::{Database, ReadableTable, TableDefinition};
    use tetdb_schema::page::{FRAME_BYTES, PageAddress, PageKind, Slot, page_key};
    use tetdb_schema::page::{open_page, seal_page, stored_bytes, u32_le};

    const TABLE: TableDefinition<u64, &[u8]> = TableDefinition::new("pages");
    let dir = tempfile::tempdir()?;
    let (path, token) = (dir.path().join("a.tetdb"), CancelToken::new());
    let inner = token.clone();
    let begun = mesher()?.cancel(&token).progress(move |event| {
        if let Event::Progress { stage: "divide and smooth", .. } = event {
            inner.cancel();
        }
    });
    let error = begun.create(&path).err().ok_or("it was cancelled")?;
    assert!(error.is_cancelled(), "{error}");
    let file = path.join("subdomain-00000-g1.redb");
    let good = std::fs::read(&file)?;
    // The first node and the first neighbor of a tetrahedron, and the first corner of a facet. The numbers are beyond the last page, or
    // belong to others.
    let beyond = [0x00ff_ff00, 0x0001_0000];
    for (kind, word, others) in [
        (PageKind::Tets, 0, [77, u32::MAX]),
        (PageKind::Tets, 4, [1500, 1501]),
        (PageKind::Facets, 0, beyond),
    ] {
        for number in beyond.into_iter().chain(others) {
            std::fs::write(&file, &good)?;
            let database = Database::open(&file)?;
            let write = database.begin_write()?;
            {
                let mut table = write.open_table(TABLE)?;
                let of_kind = page_key(kind, 0)..=page_key(kind, u32::MAX);
                let (key, stored) = match table.range(of_kind)?.next() {
                    Some(row) => row.map(|(key, page)| (key.value(), page.value().to_vec()))?,
                    None => return Err(format!("no page of {kind:?}").into()),
                };
                let address = PageAddress { kind, subdomain: 0, page: key as u32 };
                let mut frame: Vec<Slot> = bytemuck::zeroed_vec(FRAME_BYTES / size_of::<Slot>());
                let generation = open_page(&stored, address, &mut frame)?;
                frame[20][word] = u32_le::from_native(number);
                seal_page(&mut frame, address, generation);
                table.insert(key, stored_bytes(&frame))?;
            }
            write.commit()?;
            drop(database);
            for threads in [1, 2] {
                let resumed = Store::resume(&path, Settings::new().threads(threads));
                let code = resumed.err().map(|e| e.code());
                assert_eq!(code, Some(Code::Damaged), "word {word} of {kind:?}, {number}");
            }
        }
    }
    Ok(())
}
