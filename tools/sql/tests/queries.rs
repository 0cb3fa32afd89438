//! Answers of SQL are those of the store's own arrays and questions, whatever is pushed down, and the plans say what was.

use std::path::PathBuf;

use arrow::array::{Array, ArrayRef, AsArray, RecordBatch};
use arrow::datatypes::{Float64Type, Int32Type, Int64Type};
use arrow::util::display::array_value_to_string;
use futures::StreamExt;
use tempfile::TempDir;
use tetdb::data::Hit;
use tetdb::{
    Bytes, Error, FieldNumber, FieldPlace, FieldValues, Length, Mesher, NewField, Regions,
    Settings, Sizes, Store, Subdomains, Surface,
};
use tetdb_sql::Database;

/// A store with two sub-domains, three regions and fields of each kind.
struct Case {
    _dir: TempDir,
    path: PathBuf,
    hits: Vec<Hit>,
    /// Values of the field `T`, parallel to the hits; every hundredth is NaN.
    t: Vec<f64>,
}

fn values(n: usize, first: usize) -> Vec<f64> {
    let value = |i: usize| if i % 100 == 7 { f64::NAN } else { (i * 37 % 1001) as f64 / 1000.0 };
    (first..first + n).map(value).collect()
}

impl Case {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("part.tetdb");
        let surface = Surface::sample("balls,count=2,h=0.07").unwrap();
        let mut store = Mesher::new(surface)
            .sizes(Sizes::interior(Length::units(0.04)))
            .regions(Regions::All)
            .subdomains(Subdomains::Exactly(2))
            .create(&path)
            .unwrap();
        store.save_version("bare", "", None).unwrap();
        let mut n = 0;
        let mut count = |mesh: &mut tetdb::data::Subdomain, chunk: u32| {
            let own = mesh.tet_summaries()[chunk as usize].count as usize;
            n += own;
            values(own, n - own)
        };
        let new = NewField::new("T", FieldPlace::Tets);
        store.add_field(&new, |mesh, chunk| Ok(FieldValues::F64(count(mesh, chunk)))).unwrap();
        let new = NewField::new("k", FieldPlace::Tets).number(FieldNumber::I64);
        let of_chunk = |mesh: &mut tetdb::data::Subdomain, chunk: u32| {
            let records = mesh.tet_chunk(chunk)?.records;
            Ok(FieldValues::I64(records.iter().map(|tet| i64::from(tet.nodes[0])).collect()))
        };
        store.add_field(&new, of_chunk).unwrap();
        let new = NewField::new("u", FieldPlace::Vertices).components(3);
        let of_chunk = |mesh: &mut tetdb::data::Subdomain, chunk: u32| {
            let records = mesh.vertex_chunk(chunk)?.records;
            Ok(FieldValues::F64(records.iter().flat_map(|v| v.point.map(|x| 2.0 * x)).collect()))
        };
        store.add_field(&new, of_chunk).unwrap();
        let hits = store.query().collect().unwrap();
        let t = values(hits.len(), 0);
        Self { _dir: dir, path, hits, t }
    }

    fn database(&self) -> Database {
        let settings = Settings::new().threads(2).memory(Bytes::mib(512));
        Database::open(&self.path, settings).unwrap()
    }

    fn rows(&self, holds: impl Fn(&Hit, f64) -> bool) -> Vec<&Hit> {
        let all = self.hits.iter().zip(&self.t);
        all.filter(|(hit, t)| holds(hit, **t)).map(|(hit, _)| hit).collect()
    }
}

fn asked(database: &Database, sql: &str) -> Result<RecordBatch, Error> {
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).build().unwrap();
    runtime.block_on(async {
        let mut rows = database.query(sql).await?;
        let (schema, mut batches) = (rows.schema(), Vec::new());
        while let Some(batch) = rows.next().await {
            batches.push(batch.map_err(|e| database.error(e))?);
        }
        Ok(arrow::compute::concat_batches(&schema, &batches).unwrap())
    })
}

fn cell(column: &ArrayRef, row: usize) -> String {
    array_value_to_string(column, row).unwrap()
}

fn plan(database: &Database, sql: &str) -> String {
    let found = asked(database, sql).unwrap();
    (0..found.num_rows()).map(|i| cell(found.column(1), i)).collect()
}

#[test]
fn answers_are_those_of_the_store() {
    let case = Case::new();
    let database = case.database();
    type Holds = fn(&Hit, f64) -> bool;
    // What is NaN is greater than all numbers in SQL. `exact`: no filter is left to DataFusion.
    let filters: [(&str, bool, Holds); 21] = [
        ("quality > 1.5", true, |h, _| h.shape.quality > 1.5),
        ("x < 0.5 AND y >= 0.25", true, |h, _| h.centroid().x < 0.5 && h.centroid().y >= 0.25),
        ("x < 0.1 OR z > 0.9", true, |h, _| h.centroid().x < 0.1 || h.centroid().z > 0.9),
        ("NOT (x < 0.1 OR z > 0.9)", true, |h, _| h.centroid().x >= 0.1 && h.centroid().z <= 0.9),
        ("x BETWEEN 0.2 AND 0.3", true, |h, _| (0.2..=0.3).contains(&h.centroid().x)),
        ("x NOT BETWEEN 0.2 AND 0.3", true, |h, _| !(0.2..=0.3).contains(&h.centroid().x)),
        ("region = 1", true, |h, _| h.region == 1),
        ("region IN (0, 2)", true, |h, _| [0, 2].contains(&h.region)),
        ("region NOT IN (0, 2, 5, 7, 9)", true, |h, _| ![0, 2, 5, 7, 9].contains(&h.region)),
        ("region < 1.5", true, |h, _| h.region <= 1),
        ("subdomain = 1 AND 0.5 > x", true, |h, _| {
            h.id.subdomain().rank() == 1 && h.centroid().x < 0.5
        }),
        ("edge_max <= 0.05 AND angle_min > 40", true, |h, _| {
            h.edges()[1] <= 0.05 && h.angles()[0] > 40.0
        }),
        ("volume <> 1", true, |_, _| true),
        ("quality > 100", true, |h, _| h.shape.quality > 100.0),
        ("k < 100", true, |_, _| true),
        ("x > 0", false, |h, _| h.centroid().x > 0.0),
        ("T > 0.5", false, |_, t| t > 0.5 || t.is_nan()),
        ("T <= 0.5", false, |_, t| t <= 0.5),
        ("T = 0.5", true, |_, t| t == 0.5),
        ("id % 7 = 3 AND x < 0.5", false, |h, _| h.id.number() % 7 == 3 && h.centroid().x < 0.5),
        ("x < y", false, |h, _| h.centroid().x < h.centroid().y),
    ];
    for (filter, is_exact, holds) in filters {
        let sql = format!("SELECT id, quality, v3, \"T\" FROM tets WHERE {filter} ORDER BY id");
        let found = asked(&database, &sql).unwrap();
        let mut expected = case.rows(holds);
        if filter.starts_with('k') {
            let ids = case.database();
            let all = asked(&ids, "SELECT id, k FROM tets ORDER BY id").unwrap();
            let k = all.column(1).as_primitive::<Int64Type>();
            expected = case
                .hits
                .iter()
                .zip(k.values())
                .filter(|(_, k)| **k < 100)
                .map(|(h, _)| h)
                .collect();
        }
        let ids: Vec<i64> = expected.iter().map(|h| h.id.number() as i64).collect();
        assert_eq!(found.column(0).as_primitive::<Int64Type>().values(), &ids[..], "{filter}");
        let quality: Vec<f64> = expected.iter().map(|h| h.shape.quality).collect();
        assert_eq!(
            found.column(1).as_primitive::<Float64Type>().values(),
            &quality[..],
            "{filter}"
        );
        let n = asked(&database, &format!("SELECT count(*) FROM tets WHERE {filter}")).unwrap();
        assert_eq!(cell(n.column(0), 0), ids.len().to_string(), "{filter}");
        let plan = plan(&database, &format!("EXPLAIN SELECT id FROM tets WHERE {filter}"));
        assert_eq!(plan.contains("FilterExec"), !is_exact, "{filter}: {plan}");
    }
}

#[test]
fn groups_joins_and_other_tables() {
    let case = Case::new();
    let database = case.database();
    let store = Store::open(&case.path).unwrap();
    let summary = store.summary();

    let found = asked(&database, "SELECT subdomain, count(*) AS n, s.tets, max(quality), s.worst_q FROM tets JOIN subdomains s USING (subdomain) GROUP BY subdomain, s.tets, s.worst_q ORDER BY subdomain").unwrap();
    assert_eq!(found.num_rows(), 2);
    for (i, row) in summary.subdomains.iter().enumerate() {
        let numbers = [1, 2].map(|c| found.column(c).as_primitive::<Int64Type>().value(i) as u64);
        assert_eq!(numbers, [row.tets; 2]);
        let worst = [3, 4].map(|c| found.column(c).as_primitive::<Float64Type>().value(i));
        assert_eq!(worst, [row.quality.worst; 2]);
    }
    let found = asked(&database, "SELECT r.region, r.tets, count(t.id), r.name FROM regions r LEFT JOIN tets t ON t.region = r.region GROUP BY r.region, r.tets, r.name ORDER BY r.region").unwrap();
    assert_eq!(found.num_rows(), summary.regions.len());
    assert_eq!(found.column(1).as_ref(), found.column(2).as_ref());
    assert_eq!(found.column(3).null_count(), found.num_rows());

    let found =
        asked(&database, "SELECT id, quality FROM tets ORDER BY quality DESC, id LIMIT 5").unwrap();
    let mut worst: Vec<&Hit> = case.hits.iter().collect();
    worst.sort_by(|a, b| b.shape.quality.total_cmp(&a.shape.quality).then(a.id.cmp(&b.id)));
    let ids: Vec<i64> = worst[..5].iter().map(|h| h.id.number() as i64).collect();
    assert_eq!(found.column(0).as_primitive::<Int64Type>().values(), &ids[..]);

    let found = asked(
        &database,
        "SELECT label, count(*), sum(area) FROM faces JOIN labels USING (label) GROUP BY label",
    )
    .unwrap();
    let n: i64 = found.column(1).as_primitive::<Int64Type>().values().iter().sum();
    assert_eq!(n as u64, summary.subdomains.iter().map(|row| row.facets).sum::<u64>());
    let found =
        asked(&database, "SELECT count(*) FROM vertices WHERE abs(\"u.x\" - 2 * x) > 0").unwrap();
    assert_eq!(cell(found.column(0), 0), "0");
    let found = asked(&database, "SELECT low, high, faces FROM interfaces").unwrap();
    assert_eq!(found.column(0).as_primitive::<Int32Type>().values(), &[0]);
    let found = asked(&database, "SELECT name FROM versions").unwrap();
    assert_eq!(cell(found.column(0), 0), "bare");
    let found = asked(&database, "SELECT id FROM tets LIMIT 3").unwrap();
    assert_eq!(found.num_rows(), 3);
}

#[test]
fn plans_say_what_the_store_does() {
    let case = Case::new();
    let database = case.database();
    let said = plan(&database, "EXPLAIN SELECT id FROM tets WHERE x < 0.05 AND id > 4");
    assert!(said.contains("where=x < 5e-2") && said.contains("columns=[id]"), "{said}");
    // The tetrahedra of the second sub-domain alone.
    let said = plan(&database, "EXPLAIN ANALYZE SELECT count(*) FROM tets WHERE subdomain = 1");
    let store = Store::open(&case.path).unwrap();
    let chunks: Vec<u32> = store.summary().subdomains.iter().map(|row| row.chunks[0]).collect();
    assert!(said.contains(&format!("chunks={} of {}", chunks[1], chunks[0] + chunks[1])), "{said}");
    assert!(said.contains(&format!("chunks_read={}", chunks[1])), "{said}");
    assert!(said.contains(&format!("chunks_skipped={}", chunks[0])), "{said}");
    // A count alone reads no mesh.
    let said = plan(&database, "EXPLAIN SELECT count(*) FROM tets");
    assert!(!said.contains("StoreScan"), "{said}");
    let found = asked(&database, "SELECT count(*) FROM tets").unwrap();
    assert_eq!(cell(found.column(0), 0), case.hits.len().to_string());
}

#[test]
fn a_version_has_its_own_columns() {
    let case = Case::new();
    let settings = Settings::new().threads(1).memory(Bytes::mib(128)).at_version("bare");
    let bare = Database::open(&case.path, settings).unwrap();
    assert!(asked(&bare, "SELECT \"T\" FROM tets").is_err());
    let found = asked(&bare, "SELECT max(quality) FROM tets").unwrap();
    assert_eq!(
        cell(found.column(0), 0),
        cell(asked(&case.database(), "SELECT max(quality) FROM tets").unwrap().column(0), 0)
    );
}

#[test]
fn wrong_queries_say_what_there_is() {
    let case = Case::new();
    let database = case.database();
    for (sql, word) in [
        ("SELEC id FROM tets", "SELEC"),
        ("SELECT id FROM tet", "tet"),
        ("SELECT idd FROM tets", "idd"),
        ("SELECT id + FROM tets", ""),
        ("DROP TABLE tets", "DDL"),
        ("INSERT INTO tets (id) VALUES (1)", "DML"),
        ("COPY (SELECT 1) TO 'x.csv'", "DML"),
        ("CREATE EXTERNAL TABLE t STORED AS CSV LOCATION '/etc/passwd'", "DDL"),
        ("SET x = 1", "SetVariable"),
        ("SELECT 1; SELECT 2", ""),
        ("SELECT id FROM 'other.csv'", ""),
        ("", ""),
    ] {
        let error = asked(&database, sql).err().unwrap_or_else(|| panic!("{sql} was answered"));
        assert_eq!((error.code().as_str(), error.exit_code()), ("bad-query", 2), "{sql}: {error}");
        assert!(error.message().contains(word), "{sql}: {error}");
        let help = error.help().unwrap_or_default();
        assert!(help.contains("tets (id, subdomain") && help.contains("\"u.x\""), "{sql}: {error}");
    }
    let error = Database::open(case.path.join("nothing"), Settings::new()).err().unwrap();
    assert_eq!(error.code().as_str(), "no-such-store");
}
