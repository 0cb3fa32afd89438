//! From a surface to a sealed store, step by step, through the library: resident, in one sub-domain, on all cores.
//!
//! `cargo bench --bench pipeline -- [sample]`; without arguments a smoke size.

use std::time::Instant;

use tetdb::catalog::{Catalog, Job};
use tetdb::pipeline::{self, Options, silent};
use tetdb::samples::SampleSpec;
use tetdb::store::Budget;
use tetdb::surface::Surface;

fn main() {
    let word = std::env::args()
        .skip(1)
        .find(|a| !a.starts_with("--"))
        .unwrap_or_else(|| "balls,count=4".to_owned());
    let surface: Surface = SampleSpec::parse(&word)
        .and_then(|spec| spec.make())
        .expect("a sample")
        .into();
    let dir = tempfile::tempdir().expect("a temporary directory");
    let job = Job::default();
    let path = dir.path().join("bench.tetdb");
    let mut catalog = Catalog::create(&path, &job).expect("an empty place");
    let budget = Budget::new(8 << 30);
    let clock = Instant::now();
    pipeline::mesh(
        &mut catalog,
        &surface,
        &Options::default(),
        &budget,
        &silent,
    )
    .expect("a sample meshes");
    let seconds = clock.elapsed().as_secs_f64();
    let rows = catalog.subdomains().expect("sealed rows");
    let tets: u64 = rows.iter().map(|r| r.tets).sum();
    let bytes: u64 = rows.iter().map(|r| r.bytes).sum();
    for step in catalog.journal().expect("a journal") {
        println!("{:<28} {:8.2} s", step.step, step.seconds);
    }
    println!(
        "{word}: {} triangles, {} tetrahedra, {:.0} per second, {:.2} bytes each on disk",
        surface.n_triangles(),
        tets,
        tets as f64 / seconds,
        bytes as f64 / tets as f64
    );
}
