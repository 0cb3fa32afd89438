//! Reads all of a store with `tetdb-schema` and redb alone: `cargo run --release --example read_store -- part.tetdb`.
//!
//! A store is a directory. Its catalog has rows, each with a kind, and names the files that count. In each file, chunks of
//! tetrahedra, vertices, facets and interface faces have keys composed of their kind and number; a store written with `--seal none`
//! has working pages in their place. The program prints every row of the catalog, the counts and the first record of every kind in
//! each file, and the files of a plan of tasks. Then it prints counts, volume and digest as `tetdb info` and `tetdb digest` do.
//! The bytes are described in `schema/README.md`. A catalog in which a writer was killed must first be repaired by redb: open a copy
//! of it for writing.

use std::collections::BTreeMap;
use std::error::Error;
use std::fmt::Debug;
use std::path::Path;

use redb::{ReadOnlyDatabase, ReadOnlyTable, ReadableDatabase, ReadableTable, TableDefinition};
use tetdb_schema::archive::Archivable;
use tetdb_schema::blob::{Blob, BlobContent};
use tetdb_schema::catalog::{
    CoarseRow, FileRow, InterfaceRow, Job, JournalRow, RegionRow, StageRow, StoreState,
    SubdomainRow, TopologyRow, VersionRow, WiresRow,
};
use tetdb_schema::chunk::{
    ChunkAddress, ChunkRecord, Decoder, RangeSummary, TetSummary, VertexSummary,
};
use tetdb_schema::digest::{Digest, vertex_mix};
use tetdb_schema::labels::LabelSet;
use tetdb_schema::page::{PageAddress, SLOTS, open_page, page_key, u32_le};
use tetdb_schema::record::{
    CoarseFace, CoarseTet, CoarseVertex, InterfaceFace, SealedFacet, SealedTet, SealedVertex,
    WorkingFacet,
};
use tetdb_schema::row::{FORMAT_MAGIC, RowKind, checked_bytes, decode};
use tetdb_schema::topology::{FaceOwners, StageFaces};
use tetdb_schema::totals::SubdomainTotals;
use tetdb_schema::tree::{CutPlane, SubtreeMesh, WORKING_KINDS};
use tetdb_schema::unsealed::{PageDecoder, PageRecord};
use tetdb_schema::work::{
    PlanRecord, TaskMark, TaskOrders, TaskReceipts, WorkKind, body, from_bytes,
};

/// The only table of every file.
const PAGES: TableDefinition<u64, &[u8]> = TableDefinition::new("pages");

type Outcome<T> = Result<T, Box<dyn Error>>;
type Pages = ReadOnlyTable<u64, &'static [u8]>;

/// Counts, volume and digest of a finished store.
#[derive(Debug, Default, PartialEq)]
pub struct Summary {
    pub subdomains: usize,
    pub tets: u64,
    pub vertices: u64,
    pub volume: f64,
    /// 32 hex digits.
    pub digest: String,
}

/// Reads the mesh of a finished store, a sub-domain's vertices in memory at a time.
pub fn read(store: &Path) -> Outcome<Summary> {
    let mut summary = Summary::default();
    let mut digest = Digest::default();
    for row in rows::<SubdomainRow>(&open(store, "catalog.redb")?, RowKind::Subdomain)? {
        let (file, rank) = (row.file(), row.rank);
        let table = open(store, &file.subdomain_name())?;
        let vertices: Vec<SealedVertex> = records(&table, file)?;
        let mixes: Vec<u64> = vertices.iter().map(|v| vertex_mix(v.point)).collect();
        // One chunk at a time would do; the whole list is shorter to write.
        let tets: Vec<SealedTet> = records(&table, file)?;
        for tet in &tets {
            let [a, b, c, d] = tet.nodes.map(|v| vertices[v as usize].point);
            summary.volume += volume(a, b, c, d);
            digest.add_tet(tet.nodes.map(|v| mixes[v as usize]), tet.region, rank);
        }
        summary.subdomains += 1;
        summary.tets += tets.len() as u64;
        summary.vertices += vertices.len() as u64;
    }
    summary.digest = digest.to_string();
    Ok(summary)
}

/// Everything in a store, finished or not: names and contents.
pub fn describe(store: &Path) -> Outcome<Vec<(String, String)>> {
    let catalog = open(store, "catalog.redb")?;
    let mut all = catalog_rows(&catalog)?;
    let mut finished: Vec<SubdomainRow> = rows(&catalog, RowKind::Subdomain)?;
    finished.extend(rows(&catalog, RowKind::Previous)?);
    finished.extend(rows::<StageRow>(&catalog, RowKind::Stage)?.into_iter().map(|s| s.row));
    let versions: Vec<VersionRow> = rows(&catalog, RowKind::Version)?;
    for file in rows::<FileRow>(&catalog, RowKind::File)? {
        let is_finished = finished.iter().any(|row| row.file() == file)
            || versions.iter().any(|version| version.meshes.contains(&file));
        all.extend(file_records(store, file, is_finished)?);
    }
    for row in rows::<CoarseRow>(&catalog, RowKind::Coarse)? {
        all.extend(coarse_records(store, row.file())?);
    }
    all.extend(work_records(&store.join("work"))?);
    Ok(all)
}

fn open(store: &Path, name: &str) -> Outcome<Pages> {
    let file = ReadOnlyDatabase::open(store.join(name)).map_err(|e| format!("{name}: {e}"))?;
    Ok(file.begin_read()?.open_table(PAGES)?)
}

/// All rows of a kind, in order of their keys.
fn rows<T: Archivable>(catalog: &Pages, kind: RowKind) -> Outcome<Vec<T>> {
    let mut all = Vec::new();
    for row in catalog.range(kind.keys())? {
        let (key, value) = row?;
        all.push(decode(key.value(), value.value())?);
    }
    Ok(all)
}

/// Every row of the catalog; blobs last, each joined from its pieces.
fn catalog_rows(catalog: &Pages) -> Outcome<Vec<(String, String)>> {
    let mut all = Vec::new();
    let mut blobs = BTreeMap::<u32, Vec<u8>>::new();
    for row in catalog.iter()? {
        let (key, value) = row?;
        let (key, value) = (key.value(), value.value());
        let kind = RowKind::from_key(key).ok_or("a row of no known kind")?;
        if kind == RowKind::Blob {
            let bytes = blobs.entry((key >> 32) as u32 & 0xff_ffff).or_default();
            bytes.extend(checked_bytes(key, value)?);
        } else {
            all.push((format!("{kind:?}"), row_text(kind, key, value)?));
        }
    }
    for (number, bytes) in blobs {
        let blob = Blob::from_number(number).ok_or("a blob of no known number")?;
        all.push((format!("{blob:?}"), blob_text(blob, &bytes).ok_or("a damaged blob")?));
    }
    Ok(all)
}

fn row_text(kind: RowKind, key: u64, value: &[u8]) -> Result<String, String> {
    fn text<T: Archivable + Debug>(key: u64, value: &[u8]) -> Result<String, String> {
        Ok(format!("{:?}", decode::<T>(key, value)?))
    }
    match kind {
        RowKind::Format => {
            let version = checked_bytes(key, value)?.strip_prefix(FORMAT_MAGIC);
            Ok(format!("version {:?}", version.ok_or("not a store of tetdb")?))
        }
        RowKind::State => text::<StoreState>(key, value),
        RowKind::Job => text::<Job>(key, value),
        RowKind::Labels | RowKind::RegionNames => text::<Vec<String>>(key, value),
        RowKind::Regions => text::<Vec<RegionRow>>(key, value),
        RowKind::Subdomain | RowKind::Previous => text::<SubdomainRow>(key, value),
        RowKind::File => text::<FileRow>(key, value),
        RowKind::Interface => text::<Vec<InterfaceRow>>(key, value),
        RowKind::Topology => text::<TopologyRow>(key, value),
        RowKind::Journal => text::<JournalRow>(key, value),
        RowKind::Coarse => text::<CoarseRow>(key, value),
        RowKind::Stage => text::<StageRow>(key, value),
        RowKind::Embedded => text::<WiresRow>(key, value),
        RowKind::LabelSets => text::<Vec<LabelSet>>(key, value),
        RowKind::Version => text::<VersionRow>(key, value),
        RowKind::Copy => Ok(format!("{} bytes of a row", checked_bytes(key, value)?.len())),
        _ => Err(format!("a row of kind {kind:?}")),
    }
}

/// `None` for damaged bytes.
fn blob_text(blob: Blob, bytes: &[u8]) -> Option<String> {
    fn text<T: BlobContent + Debug>(bytes: &[u8]) -> Option<String> {
        Some(format!("{:?}", T::from_bytes(bytes)?))
    }
    match blob {
        Blob::Recipe | Blob::SubdomainCount => text::<u32>(bytes),
        Blob::Bounds => text::<[[f64; 3]; 2]>(bytes),
        Blob::Subtree(first) => Some(format!("{:?}", SubtreeMesh::from_bytes(first, bytes)?)),
        Blob::CutPlane(cut) => Some(format!("{:?}", CutPlane::from_bytes(cut, bytes)?)),
        Blob::FaceOwners(_) => {
            let owners = FaceOwners::from_bytes(bytes)?.faces;
            Some(format!("{} faces, the first of {:?}", owners.len(), owners.first()))
        }
        Blob::Totals(_) | Blob::PreviousTotals(_) => text::<SubdomainTotals>(bytes),
        Blob::Request(_) | Blob::PreviousRequest(_) => String::from_utf8(bytes.to_vec()).ok(),
        Blob::StageFaces(_) => {
            let StageFaces { natural, chosen } = StageFaces::from_bytes(bytes)?;
            Some(format!("{} natural faces, {} chosen", natural.len(), chosen.len()))
        }
        // A size field: its magic and an octree, which needs the mesher to evaluate.
        _ => Some(format!("{}, {} bytes", bytes.get(..8)?.escape_ascii(), bytes.len())),
    }
}

/// Records of a file: of a finished sub-domain or stage, sealed or not, or of a subtree that is not finished.
fn file_records(store: &Path, file: FileRow, is_finished: bool) -> Outcome<Vec<(String, String)>> {
    let name = file.subdomain_name();
    let table = open(store, &name)?;
    if !is_finished {
        return Ok(vec![(name, working_pages(&table, file.subdomain)?)]);
    }
    let texts = [
        first_of(&records::<SealedTet>(&table, file)?),
        first_of(&records::<SealedVertex>(&table, file)?),
        first_of(&records::<SealedFacet>(&table, file)?),
        first_of(&records::<InterfaceFace>(&table, file)?),
        first_of(&chunks::<TetSummary>(&table, file)?),
        first_of(&chunks::<VertexSummary>(&table, file)?),
        first_of(&chunks::<RangeSummary<false>>(&table, file)?),
        first_of(&chunks::<RangeSummary<true>>(&table, file)?),
    ];
    Ok(texts.into_iter().map(|text| (name.clone(), text)).collect())
}

/// The number of records of a kind, and the first.
fn first_of<R: Debug>(records: &[R]) -> String {
    let kind = std::any::type_name::<R>().rsplit("::").next().unwrap_or_default();
    format!("{} {kind}, the first {:?}", records.len(), records.first())
}

/// Pages of each kind in the file of a mesh that is not finished; all are checked.
fn working_pages(table: &Pages, subdomain: u32) -> Outcome<String> {
    let mut frame = vec![[u32_le::from_native(0); 8]; SLOTS];
    let mut counts = Vec::new();
    for kind in WORKING_KINDS {
        let keys = page_key(kind, 0)..=page_key(kind, u32::MAX);
        let mut n_pages = 0;
        for row in table.range(keys)? {
            let (key, value) = row?;
            let address = PageAddress { kind, subdomain, page: key.value() as u32 };
            open_page(value.value(), address, &mut frame)?;
            n_pages += 1;
        }
        counts.push(format!("{n_pages} pages of {kind:?}"));
    }
    Ok(counts.join(", "))
}

/// Records of a coarse snapshot.
fn coarse_records(store: &Path, file: FileRow) -> Outcome<Vec<(String, String)>> {
    let name = file.coarse_name();
    let table = open(store, &name)?;
    let texts = [
        first_of(&chunks::<CoarseTet>(&table, file)?),
        first_of(&chunks::<CoarseVertex>(&table, file)?),
        first_of(&chunks::<WorkingFacet>(&table, file)?),
        first_of(&chunks::<CoarseFace>(&table, file)?),
    ];
    Ok(texts.into_iter().map(|text| (name.clone(), text)).collect())
}

/// The plan of tasks, their orders and receipts, where there is a plan.
fn work_records(work: &Path) -> Outcome<Vec<(String, String)>> {
    let mut all = Vec::new();
    let mut names = match std::fs::read_dir(work) {
        Ok(entries) => entries.map(|e| Ok(e?.path())).collect::<std::io::Result<Vec<_>>>()?,
        Err(_) => return Ok(all),
    };
    names.retain(|path| path.is_file());
    names.sort();
    for path in names {
        let bytes = std::fs::read(&path)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let text = match name.rsplit('.').next().unwrap_or_default() {
            "plan" => format!("{:?}", from_bytes::<PlanRecord>(WorkKind::Plan, &bytes)?),
            "size-field" => format!("{} bytes", body(WorkKind::SizeField, &bytes)?.len()),
            "stage" => String::from_utf8(bytes)?,
            "orders" => format!("{:?}", from_bytes::<TaskOrders>(WorkKind::Orders, &bytes)?),
            "receipts" => format!("{:?}", from_bytes::<TaskReceipts>(WorkKind::Receipts, &bytes)?),
            "mark" => format!("{:?}", serde_json::from_slice::<TaskMark>(&bytes)?),
            _ => continue,
        };
        all.push((format!("work/{name}"), text));
    }
    Ok(all)
}

/// All records of a kind in a finished sub-domain: chunk after chunk, or page after page.
fn records<R: PageRecord>(table: &Pages, file: FileRow) -> Outcome<Vec<R>> {
    let mut all = chunks(table, file)?;
    let mut pages = PageDecoder::new(file.subdomain, file.generation);
    let mut page_records = Vec::new();
    for page in 0.. {
        let (main, extra) = PageDecoder::keys::<R>(page);
        let Some(value) = table.get(main)? else { break };
        pages.open::<R>(page, value.value())?;
        if let Some(extra) = extra {
            let value = table.get(extra)?.ok_or("a page of extra words is missing")?;
            pages.open_extra::<R>(page, value.value())?;
        }
        pages.records(page, &mut page_records)?;
        all.append(&mut page_records);
    }
    Ok(all)
}

/// All records of a kind in chunks, until there is none.
fn chunks<R: ChunkRecord>(table: &Pages, file: FileRow) -> Outcome<Vec<R>> {
    let mut decoder = Decoder::<R>::new()?;
    let (mut all, mut chunk_records) = (Vec::new(), Vec::new());
    let FileRow { subdomain, generation } = file;
    for chunk in 0.. {
        let address = ChunkAddress { kind: R::KIND, subdomain, generation, chunk };
        let Some(value) = table.get(address.key())? else { break };
        // Checks checksum, kind, sub-domain, generation and number.
        decoder.decode(value.value(), address, &mut chunk_records)?;
        all.append(&mut chunk_records);
    }
    Ok(all)
}

fn volume(a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]) -> f64 {
    let [u, v, w] = [b, c, d].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
    let cross = [v[1] * w[2] - v[2] * w[1], v[2] * w[0] - v[0] * w[2], v[0] * w[1] - v[1] * w[0]];
    (u[0] * cross[0] + u[1] * cross[1] + u[2] * cross[2]) / 6.0
}

#[allow(dead_code)] // A test reads this file as a module.
fn main() -> Outcome<()> {
    let store = std::env::args().nth(1).ok_or("usage: read_store STORE")?;
    let store = Path::new(&store);
    for (name, text) in describe(store)? {
        println!("{name}: {text}");
    }
    let states: Vec<StoreState> = rows(&open(store, "catalog.redb")?, RowKind::State)?;
    if states.iter().all(|state| state.is_finished()) {
        let summary = read(store)?;
        println!(
            "{} sub-domains, {} tetrahedra, {} vertices, volume {:.9}, digest {}",
            summary.subdomains, summary.tets, summary.vertices, summary.volume, summary.digest
        );
    }
    Ok(())
}
