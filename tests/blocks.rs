//! Meshes of one sub-domain and of two that are saturated in blocks.
//!
//! Why: threads work on parts of the mesh at the same time, and parts leave memory. Neither may show in the mesh, and no face of the
//! input may be lost where a part ends.
//! How: samples with several regions, sheets, edges and thin parts are meshed with one thread and three, and with so little memory that
//! bricks leave it. All must have one digest, and be verified against the surface. Bounds on qualities are a little wider than what
//! was measured.

use tetdb_base::storage::{Budget, CancelToken, RunContext, ScratchSpace};
use tetdb_base::surface::Surface;
use tetdb_engine::pipeline::{
    self, MeshOptions, Options, OptionsText, Plan, RunOptions, Subdomains, Summary, Trial, silent,
};
use tetdb_kernel::samples::SampleSpec;
use tetdb_schema::catalog::Job;
use tetdb_store::audit::{self, Level, Report, VerifyOptions};
use tetdb_store::store::Catalog;

/// A finished mesh.
struct Made {
    /// Result of its verification.
    report: Report,
    /// Tetrahedra with q of 2 and more.
    bad: u64,
    /// Greatest q.
    worst: f64,
}

fn made(surface: &Surface, mesh: &MeshOptions, plan: Option<Plan>) -> Made {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let path = dir.path().join("one.tetdb");
    let trial = Trial { plan, ..Trial::default() };
    let options =
        Options { mesh: mesh.clone(), run: RunOptions { trial, ..RunOptions::default() } };
    let budget = Budget::new(256 << 20);
    let mut catalog = Catalog::create(&path, &Job::default()).expect("an empty place");
    let summary = pipeline::mesh(&mut catalog, surface, &options, &budget, &silent);
    let Summary { fine, cuts, subdomains, .. } = summary.expect("a sample meshes");
    assert_eq!(mesh.subdomains, Subdomains::Exactly(subdomains));
    assert!(fine.values().all(|fine| fine.refine.unexamined == 0), "{fine:?}");
    assert!(cuts.iter().all(|cut| cut.refine.unexamined == 0), "{cuts:?}");
    catalog.close().expect("room on the disk");
    let mut store = Catalog::open(&path).expect("what was just written");
    let rows = store.subdomains().expect("sealed rows");
    let verify =
        VerifyOptions { level: Level::Delaunay, memory_bytes: 64 << 20, temp_dir: path.clone() };
    let report = audit::verify(&mut store, Some(surface), &verify).expect("a sound store");
    assert!(report.valid, "{report:?}");
    let bad = rows.iter().flat_map(|row| &row.quality.bins[1..]).sum();
    Made { report, bad, worst: rows.iter().map(|row| row.quality.worst).fold(0.0, f64::max) }
}

fn options(regions: Option<&str>, subdomains: u32) -> MeshOptions {
    let text = OptionsText {
        subdomains: Some(subdomains.to_string()),
        regions: regions.map(str::to_owned),
        ..OptionsText::default()
    };
    text.try_into().expect("words of options")
}

#[test]
fn neither_threads_nor_memory_show() {
    // Frames for 16 pages: everything leaves memory again and again.
    let narrow = Plan { frames: 1 << 20, redb: 1 << 20, buffers: 2 << 20 };
    for (words, regions, subdomains, bad_max, worst_max) in [
        ("knot,h=0.06", None, 1, 1e-4, 2.5),
        ("balls,count=20", Some("all"), 1, 1e-4, 2.8),
        ("faults,cells=16", None, 1, 1e-3, 3.0),
        ("wells,cells=14,count=40", None, 1, 6e-3, 4.0),
        ("needles,count=300", None, 1, 0.98, 500.0),
        ("balls,count=20", None, 2, 1e-4, 2.8),
        ("faults,cells=20", None, 2, 1e-3, 3.0),
    ] {
        let spec = SampleSpec::parse(words).and_then(|spec| spec.make());
        let mut surface: Surface = spec.expect("a sample").into();
        surface.add_support_triangles(&ScratchSpace::boundless()).expect("edges apart");
        let options = options(regions, subdomains);
        let run = |threads, plan| {
            let run = RunContext::new(threads, CancelToken::new());
            run.enter(|| made(&surface, &options, plan))
        };
        let one = run(1, None);
        for other in [run(3, None), run(2, Some(narrow))] {
            assert_eq!(one.report.digest, other.report.digest, "{words}");
        }
        let bad = one.bad as f64 / one.report.tets as f64;
        assert!(bad <= bad_max && one.worst <= worst_max, "{words}: {bad} bad, {}", one.worst);
    }
}
