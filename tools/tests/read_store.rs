//! The example that knows only the schema reads what the library wrote.
//!
//! Why: a store must be readable by programs that do not have the mesher.
//! How: a small mesh in two sub-domains, read by the example and by the library; the example's text names no `tetdb::`.

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
