//! An undivided mesh that is saturated in blocks.
//!
//! Why: threads work on parts of the mesh at the same time, and parts leave memory. Neither may show in the mesh, and no face of the
//! input may be lost where a part ends.
//! How: samples with several regions, sheets, edges and thin parts are meshed with one thread and three, and with so little memory that
//! bricks leave it. All must have one digest, and be verified against the surface. Counts and qualities are compared with those of
//! the other kernel.

use tetdb_base::storage::{Budget, CancelToken, RunContext, ScratchSpace};
use tetdb_base::surface::Surface;
use tetdb_engine::pipeline::{
    self, MeshOptions, Options, OptionsText, Plan, RunOptions, Trial, silent,
};
use tetdb_kernel::bisect::Method;
use tetdb_kernel::samples::SampleSpec;
use tetdb_schema::catalog::Job;
use tetdb_store::audit::{self, Level, Report, VerifyOptions};
use tetdb_store::store::Catalog;

/// What is compared of a mesh.
struct Made {
    report: Report,
    bad: u64,
    worst: f64,
}

fn made(surface: &Surface, mesh: &MeshOptions, in_blocks: bool, plan: Option<Plan>) -> Made {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let path = dir.path().join("one.tetdb");
    let trial = Trial { plan, ..Trial::default() };
    let method = Method { in_blocks, ..Method::default() };
    let options =
        Options { mesh: mesh.clone(), run: RunOptions { method, trial, ..RunOptions::default() } };
    let budget = Budget::new(256 << 20);
    let mut catalog = Catalog::create(&path, &Job::default()).expect("an empty place");
    let summary = pipeline::mesh(&mut catalog, surface, &options, &budget, &silent);
    let fine = summary.expect("a sample meshes").fine;
    assert!(fine.values().all(|fine| fine.refine.unexamined == 0), "{fine:?}");
    catalog.close().expect("room on the disk");
    let mut store = Catalog::open(&path).expect("what was just written");
    let row = store.subdomains().expect("sealed rows").remove(0);
    let verify =
        VerifyOptions { level: Level::Delaunay, memory_bytes: 64 << 20, temp_dir: path.clone() };
    let report = audit::verify(&mut store, Some(surface), &verify).expect("a sound store");
    assert!(report.valid, "{report:?}");
    let bins = row.quality.bins;
    Made { report, bad: bins[1..].iter().sum(), worst: row.quality.worst }
}

fn options(regions: Option<&str>) -> MeshOptions {
    let text = OptionsText {
        subdomains: Some("1".to_owned()),
        regions: regions.map(str::to_owned),
        ..OptionsText::default()
    };
    text.try_into().expect("words of options")
}

#[test]
fn neither_threads_nor_memory_show() {
    // Frames for 16 pages: everything leaves memory again and again.
    let narrow = Plan { frames: 1 << 20, redb: 1 << 20, buffers: 2 << 20 };
    for (words, regions) in [
        ("knot,h=0.06", None),
        ("balls,count=20", Some("all")),
        ("faults,cells=16", None),
        ("wells,cells=14,count=40", None),
        ("needles,count=300", None),
    ] {
        let spec = SampleSpec::parse(words).and_then(|spec| spec.make());
        let mut surface: Surface = spec.expect("a sample").into();
        surface.add_support_triangles(&ScratchSpace::boundless()).expect("edges apart");
        let options = options(regions);
        let run = |threads, plan| {
            let run = RunContext::new(threads, CancelToken::new());
            run.enter(|| made(&surface, &options, true, plan))
        };
        let one = run(1, None);
        for other in [run(3, None), run(2, Some(narrow))] {
            assert_eq!(one.report.digest, other.report.digest, "{words}");
        }
        let old = made(&surface, &options, false, None);
        let (n, n_old) = (one.report.tets as f64, old.report.tets as f64);
        assert!((0.85..1.1).contains(&(n / n_old)), "{words}: {n} tetrahedra for {n_old}");
        assert!(
            one.bad as f64 <= old.bad as f64 + 0.002 * n,
            "{words}: {} bad for {}",
            one.bad,
            old.bad
        );
        let worst_max = (1.2 * old.worst).max(3.5);
        assert!(one.worst <= worst_max, "{words}: worst {} for {}", one.worst, old.worst);
    }
}
