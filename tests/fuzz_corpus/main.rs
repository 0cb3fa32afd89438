//! Inputs once found by fuzzing are fed to readers and decoders again, with some mutations.
//!
//! Why: any content of a file or disk is answered with an error, never with a panic.
//! How: `tools/fuzz` mutates its corpus for as long as requested and keeps its finds. Here every file of the corpus runs, and a few
//! mutations for each target.

#[path = "../../tools/fuzz/src/file.rs"]
mod file;
#[path = "../../tools/fuzz/src/mesh.rs"]
mod mesh;
#[path = "../../tools/fuzz/src/mutate.rs"]
mod mutate;
#[path = "../../tools/fuzz/src/store.rs"]
mod store;
#[path = "../../tools/fuzz/src/targets.rs"]
mod targets;

use std::path::{Path, PathBuf};

use mutate::Mutator;
use targets::{TARGETS, Target};
use tetdb_io::read::read_memory;

/// Mutated inputs for each target.
const SMOKE: usize = 500;

fn corpus(target: &Target) -> Vec<(PathBuf, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/fuzz/corpus");
    let entries = std::fs::read_dir(folder.join(target.name)).expect("each target has a folder");
    let mut paths: Vec<PathBuf> = entries.map(|e| e.expect("readable").path()).collect();
    paths.sort();
    let read = |p: PathBuf| (p.clone(), std::fs::read(p).expect("readable"));
    paths.into_iter().map(read).collect()
}

#[test]
fn the_corpus_is_answered_without_panics() {
    for target in TARGETS {
        for (path, bytes) in corpus(target) {
            println!("{}", path.display());
            (target.run)(&bytes);
        }
    }
}

#[test]
fn seeds_of_readers_are_surfaces() {
    for target in TARGETS {
        let Some(format) = target.format else {
            continue;
        };
        for (path, bytes) in corpus(target) {
            let name = path.to_string_lossy();
            if !name.contains("found-") {
                let surface = read_memory(format, &name, &bytes).unwrap_or_else(|e| panic!("{e}"));
                assert!(surface.n_triangles() >= 4, "{name}");
            }
        }
    }
}

#[test]
fn seeds_of_readers_of_meshes_are_meshes() {
    for target in TARGETS.iter().filter(|t| ["vtkhdf", "vtu", "inp", "msh"].contains(&t.name)) {
        for (path, bytes) in corpus(target) {
            let name = path.to_string_lossy();
            if !name.contains("found-") {
                let mesh = mesh::read(target.name, &bytes).unwrap_or_else(|e| panic!("{e}"));
                assert!(mesh.tets.len() >= 2, "{name}");
            }
        }
    }
}

#[test]
fn mutated_seeds_are_answered_without_panics() {
    for target in TARGETS {
        let seeds: Vec<Vec<u8>> = corpus(target).into_iter().map(|c| c.1).collect();
        let mut mutator = Mutator::new(20);
        for _ in 0..SMOKE {
            (target.run)(&mutator.mutated(&seeds));
        }
    }
}
