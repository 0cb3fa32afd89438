//! The example that knows only the schema reads what the library wrote.
//!
//! Why: a store must be readable by programs that do not have the mesher.
//! How: a small mesh in two sub-domains, read by the example and by the library; the example's text names no `tetdb::`. Then a store
//! with every kind of record, and one with a plan of tasks, are described by the example.

use tetdb::{Length, Mesher, Sizes, Store, Subdomains, Surface, Tasks};
use tetdb_base::storage::Budget;
use tetdb_engine::pipeline::{self, MeshOptions, OptionsText};
use tetdb_kernel::samples::SampleSpec;
use tetdb_schema::catalog::Job;
use tetdb_store::store::Catalog;

#[path = "../examples/read_store.rs"]
mod example;

#[test]
fn the_schema_alone_reads_a_store() -> Result<(), Box<dyn std::error::Error>> {
    let digests = ["packed", "none"].map(check);
    let [packed, pages] = digests;
    assert_eq!(packed?, pages?);
    Ok(())
}

/// Makes a store in this form and reads it twice; returns its digest.
fn check(seal: &str) -> Result<String, Box<dyn std::error::Error>> {
    let dir = tempfile::tempdir()?;
    let path = dir.path().join("box.tetdb");
    let surface = SampleSpec::parse("box,h=0.05")?.make()?.into();
    let text = OptionsText {
        subdomains: Some("2".to_owned()),
        seal: Some(seal.to_owned()),
        ..OptionsText::default()
    };
    let job = Job { options: serde_json::to_string(&text)?, ..Job::default() };
    let options = MeshOptions::try_from(text)?.into();
    let mut catalog = Catalog::create(&path, &job)?;
    pipeline::mesh(&mut catalog, &surface, &options, &Budget::new(256 << 20), &|_| {})?;
    catalog.close()?;

    let found = example::read(&path)?;
    let mut store = Catalog::open(&path)?;
    let rows = store.subdomains()?;
    assert_eq!(found.subdomains, 2);
    assert_eq!(found.subdomains, rows.len());
    assert_eq!(found.tets, rows.iter().map(|r| r.tets).sum::<u64>());
    assert_eq!(found.vertices, rows.iter().map(|r| r.vertices).sum::<u64>());
    assert!((found.volume - rows.iter().map(|r| r.volume).sum::<f64>()).abs() < 1e-9);
    assert_eq!(found.digest, store.digest()?[0].to_string());
    let text = include_str!("../examples/read_store.rs");
    assert!(!text.contains("tetdb::"), "the example may use the schema only");
    Ok(found.digest)
}

/// The contents under a name, which must be there.
fn texts<'a>(all: &'a [(String, String)], name: &str) -> Vec<&'a str> {
    let texts: Vec<&str> =
        all.iter().filter(|(n, _)| n == name).map(|(_, text)| &text[..]).collect();
    assert!(!texts.is_empty(), "{name} is missing");
    texts
}

#[test]
fn the_schema_alone_reads_every_record() -> Result<(), Box<dyn std::error::Error>> {
    let dir = tempfile::tempdir()?;
    let path = dir.path().join("box.tetdb");
    let rod = [[0.2, 0.2, 0.2], [0.3, 0.3, 0.3]];
    let surface = Surface::sample("box,h=0.04")?
        .embedded_edges_of(&rod, &[[0, 1]], None, "rod")?
        .embedded_points_of(&[[0.7, 0.7, 0.7]], None, "probe")?;
    Mesher::new(surface)
        .subdomains(Subdomains::Exactly(2))
        .region_seed([0.5, 0.4, 0.4], Some("inside"))
        .keep_stages(true)
        .create(&path)?;
    let sizes = Sizes::interior(Length::units(0.03));
    Store::open(&path)?.remesh().subdomains(&[1]).sizes(sizes).run()?;

    let all = example::describe(&path)?;
    assert_eq!(texts(&all, "Format"), ["version [1, 0]"]);
    for kind in [
        "State",
        "Job",
        "Labels",
        "Regions",
        "RegionNames",
        "Embedded",
        "SizeField",
        "Recipe",
        "Bounds",
        "Version",
        "Copy",
        "StageFaces(1)",
        "CutPlane(1)",
        "FaceOwners(1)",
        "Totals(1)",
        "SubdomainField(1)",
        "Request(1)",
    ] {
        texts(&all, kind);
    }
    let mut catalog = Catalog::open(&path)?;
    assert_eq!(texts(&all, "Subdomain").len(), catalog.subdomains()?.len());
    assert_eq!(texts(&all, "File").len(), catalog.files()?.len());
    assert_eq!(texts(&all, "Interface").len(), 1);
    assert_eq!(texts(&all, "Topology").len(), catalog.topology()?.len());
    assert_eq!(texts(&all, "Journal").len(), catalog.journal()?.len());
    assert_eq!(texts(&all, "Coarse").len(), catalog.coarse_snapshots()?.len());
    assert_eq!(texts(&all, "Stage").len(), catalog.stages()?.len());
    assert_eq!(texts(&all, "SubdomainCount"), ["2"]);
    assert!(texts(&all, "RegionNames")[0].contains("inside"));
    let row = &catalog.subdomains()?[0];
    let records = texts(&all, &row.file().subdomain_name());
    assert!(records[0].starts_with(&format!("{} SealedTet, the first Some", row.tets)));
    assert_eq!(records.len(), 8);
    let kept = &catalog.coarse_snapshots()?[0];
    let records = texts(&all, &kept.file().coarse_name());
    assert!(records[1].starts_with(&format!("{} CoarseVertex, the first Some", kept.vertices)));

    let path = dir.path().join("tasks.tetdb");
    Mesher::new(Surface::sample("box,h=0.04")?)
        .subdomains(Subdomains::Exactly(2))
        .coarse_only(true)
        .create_unfinished(&path)?;
    let tasks = Tasks::of(&path);
    let first = tasks.plan(2)?;
    tasks.run(first[0])?;
    let all = example::describe(&path)?;
    assert!(texts(&all, "Subtree(0)")[0].contains("RankRange { first: 0, count: 2 }"));
    assert!(texts(&all, "work/plan")[0].starts_with("PlanRecord"));
    for file in ["orders", "receipts"] {
        texts(&all, &format!("work/task-{:05}.{file}", first[0]));
    }
    let pages = texts(&all, "subdomain-00000-g1.redb");
    assert!(!pages[0].starts_with("0 pages of Tets"), "{pages:?}");
    Ok(())
}
