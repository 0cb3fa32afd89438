//! Reads a finished store with `tetdb-schema` and redb alone: `cargo run --release --example read_store -- part.tetdb`.
//!
//! A store is a directory. Its catalog names the files that count, one for each sub-domain. In each file, chunks of tetrahedra and
//! of vertices have keys composed of their kind and number, and `tetdb-schema` decodes them; a store written with `--seal none` has
//! working pages in their place. Counts, volume and digest are printed, as `tetdb info` and `tetdb digest` print them. The bytes are
//! described in `schema/README.md`.

use std::error::Error;
use std::path::Path;

use redb::{ReadOnlyDatabase, ReadableDatabase, TableDefinition};
use tetdb_schema::chunk::{ChunkAddress, ChunkKind, Decoder};
use tetdb_schema::digest::{Digest, vertex_mix};
use tetdb_schema::record::{SealedTet, SealedVertex};
use tetdb_schema::unsealed::{PageDecoder, PageRecord};

/// The only table of every file.
const PAGES: TableDefinition<u64, &[u8]> = TableDefinition::new("pages");
/// Kind of the catalog's rows that name a file: a checksum of eight bytes, the sub-domain u32, the generation u32.
const FILE_ROWS: u64 = 70;

/// What is counted.
#[derive(Debug, Default, PartialEq)]
pub struct Summary {
    pub subdomains: usize,
    pub tets: u64,
    pub vertices: u64,
    pub volume: f64,
    /// 32 hex digits.
    pub digest: String,
}

/// Reads a whole store, a sub-domain's vertices in memory at a time.
pub fn read(store: &Path) -> Result<Summary, Box<dyn Error>> {
    let mut summary = Summary::default();
    let mut digest = Digest::default();
    for (subdomain, generation) in files(store)? {
        let name = format!("subdomain-{subdomain:05}-g{generation}.redb");
        let file = ReadOnlyDatabase::open(store.join(name))?;
        let vertices: Vec<SealedVertex> = records(&file, subdomain, generation)?;
        let mixes: Vec<u64> = vertices.iter().map(|v| vertex_mix(v.point)).collect();
        // One chunk at a time would do; the whole list is shorter to write.
        let tets: Vec<SealedTet> = records(&file, subdomain, generation)?;
        for tet in &tets {
            let [a, b, c, d] = tet.nodes.map(|v| vertices[v as usize].point);
            summary.volume += volume(a, b, c, d);
            let corners = tet.nodes.map(|v| mixes[v as usize]);
            digest.add_tet(corners, tet.region, subdomain);
        }
        summary.subdomains += 1;
        summary.tets += tets.len() as u64;
        summary.vertices += vertices.len() as u64;
    }
    summary.digest = digest.to_string();
    Ok(summary)
}

/// The files that count: sub-domain and generation.
fn files(store: &Path) -> Result<Vec<(u32, u32)>, Box<dyn Error>> {
    let catalog = ReadOnlyDatabase::open(store.join("catalog.redb"))?;
    let table = catalog.begin_read()?.open_table(PAGES)?;
    let mut files = Vec::new();
    for row in table.range(FILE_ROWS << 56..(FILE_ROWS + 1) << 56)? {
        let (_, value) = row?;
        let word = |at: usize| -> Result<u32, Box<dyn Error>> {
            let bytes = value.value().get(at..at + 4).ok_or("a short row")?;
            Ok(u32::from_le_bytes(bytes.try_into()?))
        };
        files.push((word(8)?, word(12)?));
    }
    Ok(files)
}

/// All records of a kind: chunk after chunk, or page after page, until there is none.
fn records<R: PageRecord>(
    file: &ReadOnlyDatabase,
    subdomain: u32,
    generation: u32,
) -> Result<Vec<R>, Box<dyn Error>> {
    let table = file.begin_read()?.open_table(PAGES)?;
    let mut decoder = Decoder::<R>::new()?;
    let (mut all, mut chunk) = (Vec::new(), Vec::new());
    for number in 0.. {
        let kind: ChunkKind = R::KIND;
        let address = ChunkAddress { kind, subdomain, generation, chunk: number };
        let Some(value) = table.get(address.key())? else {
            break;
        };
        // Checks checksum, kind, sub-domain, generation and number.
        decoder.decode(value.value(), address, &mut chunk)?;
        all.append(&mut chunk);
    }
    let mut pages = PageDecoder::new(subdomain, generation);
    for page in 0.. {
        let (main, beside) = PageDecoder::keys::<R>(page);
        let Some(value) = table.get(main)? else { break };
        pages.open::<R>(page, value.value())?;
        if let Some(beside) = beside {
            let value = table.get(beside)?.ok_or("attributes are missing")?;
            pages.open_extra::<R>(page, value.value())?;
        }
        pages.records(page, &mut chunk)?;
        all.append(&mut chunk);
    }
    Ok(all)
}

fn volume(a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]) -> f64 {
    let [u, v, w] = [b, c, d].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
    let cross = [v[1] * w[2] - v[2] * w[1], v[2] * w[0] - v[0] * w[2], v[0] * w[1] - v[1] * w[0]];
    (u[0] * cross[0] + u[1] * cross[1] + u[2] * cross[2]) / 6.0
}

#[allow(dead_code)] // A test reads this file as a module.
fn main() -> Result<(), Box<dyn Error>> {
    let store = std::env::args().nth(1).ok_or("usage: read_store STORE")?;
    let summary = read(Path::new(&store))?;
    println!(
        "{} sub-domains, {} tetrahedra, {} vertices, volume {:.9}, digest {}",
        summary.subdomains, summary.tets, summary.vertices, summary.volume, summary.digest
    );
    Ok(())
}
