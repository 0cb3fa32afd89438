//! A store open for queries.

use std::path::Path;
use std::sync::{Arc, Mutex};

use datafusion::execution::SendableRecordBatchStream;
use datafusion::execution::memory_pool::FairSpillPool;
use datafusion::execution::runtime_env::RuntimeEnvBuilder;
use datafusion::prelude::{SQLOptions, SessionConfig, SessionContext};
use tetdb::{Bytes, Error, Settings, Store};
use tetdb_arrow::Table;

use super::failure::of_query;
use super::table::{Readers, StoreTable};

/// Least memory of a reader: that of any run.
const READER_BYTES: u64 = 64 << 20;

/// A finished store, open for queries.
///
/// ```
/// # let dir = tempfile::tempdir()?;
/// # let path = dir.path().join("box.tetdb");
/// # tetdb::Mesher::new(tetdb::Surface::sample("box,h=0.2")?).create(&path)?;
/// use futures::StreamExt;
///
/// let database = tetdb_sql::Database::open(&path, tetdb::Settings::new())?;
/// let runtime = tokio::runtime::Builder::new_multi_thread().build()?;
/// runtime.block_on(async {
///     let mut rows = database.query("SELECT max(quality) FROM tets WHERE x < 0.5").await?;
///     while let Some(batch) = rows.next().await {
///         println!("{} rows", batch.map_err(|e| database.error(e))?.num_rows());
///     }
///     Ok::<(), tetdb::Error>(())
/// })?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Database {
    context: SessionContext,
    /// Tables with their columns, as help shows them.
    tables: String,
}

impl Database {
    /// Opens a store. `settings`: memory, threads, the version. Errors: as [`Store::open`]; `memory` below 128 MiB.
    pub fn open(path: impl AsRef<Path>, settings: Settings) -> Result<Self, Error> {
        let path = path.as_ref().to_owned();
        let half = settings.cap()? / 2;
        let n_threads = settings.n_threads();
        let n_max = ((half / READER_BYTES) as usize).clamp(1, n_threads);
        let share = settings.clone().threads(1).memory(Bytes(half / n_max as u64));
        let store = Store::open_with(&path, share.clone())?;
        let readers = Readers { path, settings: share, n_max };
        // Names of fields are as they were given, in conditions as in SQL.
        let config = SessionConfig::new()
            .with_target_partitions(n_threads)
            .set_bool("datafusion.sql_parser.enable_ident_normalization", false);
        let pool = Arc::new(FairSpillPool::new(half as usize));
        let environment = RuntimeEnvBuilder::new().with_memory_pool(pool).build_arc();
        let environment = environment.map_err(|e| of_query(e, ""))?;
        let context = SessionContext::new_with_config_rt(config, environment);
        let (store, mut tables) = (Arc::new(Mutex::new(store)), Vec::new());
        for table in Table::ALL {
            let provider = StoreTable::new(readers.clone(), &store, table)?;
            let schema = datafusion::catalog::TableProvider::schema(&provider);
            let names: Vec<String> = schema.fields().iter().map(|f| quoted(f.name())).collect();
            tables.push(format!("{} ({})", table.name(), names.join(", ")));
            let registered = context.register_table(table.name(), Arc::new(provider));
            registered.map_err(|e| of_query(e, ""))?;
        }
        Ok(Self { context, tables: tables.join("; ") })
    }

    /// Starts a query: one statement that reads, or EXPLAIN of one. Rows are found as they are taken.
    ///
    /// Errors: `bad-query`, where the help lists tables and columns; damage; too little memory.
    pub async fn query(&self, sql: &str) -> Result<SendableRecordBatchStream, Error> {
        let only_reads = SQLOptions::new()
            .with_allow_ddl(false)
            .with_allow_dml(false)
            .with_allow_statements(false);
        let started = async {
            let frame = self.context.sql_with_options(sql, only_reads).await?;
            frame.execute_stream().await
        };
        started.await.map_err(|e| self.error(e))
    }

    /// The error behind one of DataFusion's.
    pub fn error(&self, error: datafusion::common::DataFusionError) -> Error {
        of_query(error, &self.tables)
    }
}

/// A name as a query writes it.
fn quoted(name: &str) -> String {
    let is_plain = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if is_plain { name.to_owned() } else { format!("\"{name}\"") }
}
