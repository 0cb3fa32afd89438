//! Tables of a finished store as Arrow record batches, streamed chunk by chunk.
//!
//! ```
//! # let dir = tempfile::tempdir()?;
//! # let path = dir.path().join("box.tetdb");
//! # tetdb::Mesher::new(tetdb::Surface::sample("box,h=0.2")?).create(&path)?;
//! use tetdb_arrow::{Scan, Table};
//!
//! let scan = Scan::new(Table::Tets).columns(&["id", "quality"]).condition("x < 0.5");
//! for batch in scan.open(tetdb::Store::open(&path)?)? {
//!     println!("{} rows", batch?.num_rows());
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Columns of tetrahedra and vertices have the names and types of the Parquet export. Behind them come the fields of the store, with the
//! names that conditions have for them: `T`, or `u.x`, `u.y`, `u.z`.
//!
//! Memory: that of the store's session, within its cap; beside it one chunk of decoded records, its batch, and some MiB for an open
//! sub-domain and each field asked for.
//!
//! Reading order: `table` (names and schemas), `scan` (what is asked for, the chunks to read), `batches` (the stream), and what reads a
//! chunk: `tets`, `vertices`, `faces`; `catalog` has the tables without chunks.

mod batches;
mod catalog;
mod faces;
mod fields;
mod scan;
mod table;
mod tets;
mod vertices;

pub use batches::Batches;
pub use scan::{Chunk, Scan};
pub use table::Table;
