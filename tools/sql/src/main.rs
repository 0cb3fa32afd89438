//! The program `tetdb-sql`.

mod output;

use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use arrow::error::ArrowError;
use clap::Parser;
use futures::StreamExt;
use tetdb::{Bytes, Code, Error, Settings};
use tetdb_sql::Database;

use output::{Form, ROWS_MAX, RowWriter};

/// Answers a question to a store in SQL.
///
/// Tables: tets, vertices, faces, interfaces, subdomains, regions, labels, versions. Fields of the store are columns of tets or vertices; a
/// component is written with quotes: "u.x". EXPLAIN shows the condition that the store is given, and EXPLAIN ANALYZE how many chunks were
/// read.
#[derive(Parser)]
#[command(name = "tetdb-sql", version, after_help = EXAMPLES)]
struct Arguments {
    /// The store: a directory that tetdb wrote
    store: PathBuf,
    /// One statement; left out, --file has it
    #[arg(required_unless_present = "file")]
    query: Option<String>,
    /// Read the statement from a file, or with - from the standard input
    #[arg(short, long, conflicts_with = "query")]
    file: Option<PathBuf>,
    /// Lines of comma-separated values, the names first
    #[arg(long, conflicts_with = "json")]
    csv: bool,
    /// One JSON object per line
    #[arg(long)]
    json: bool,
    /// Ask the store as it was in the version of this name
    #[arg(long, value_name = "NAME")]
    at_version: Option<String>,
    /// Memory for readers and DataFusion together, such as 2GiB; at least 128MiB
    #[arg(long, value_name = "SIZE", value_parser = size)]
    memory: Option<u64>,
    /// Number of threads [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

const EXAMPLES: &str = "Examples:
  tetdb-sql part.tetdb 'SELECT region, count(*), max(quality) FROM tets GROUP BY region'
  tetdb-sql part.tetdb 'SELECT id, quality FROM tets ORDER BY quality DESC LIMIT 10' --csv
  tetdb-sql part.tetdb 'EXPLAIN ANALYZE SELECT count(*) FROM tets WHERE x < 0.1'";

/// Bytes of a size with its unit. Errors: it has no unit, or no meaning.
fn size(text: &str) -> Result<u64, String> {
    const UNITS: [(&str, u32); 6] =
        [("MiB", 20), ("M", 20), ("GiB", 30), ("G", 30), ("TiB", 40), ("T", 40)];
    let bytes = UNITS.iter().find_map(|(unit, shift)| {
        let number: f64 = text.strip_suffix(unit)?.trim().parse().ok()?;
        Some((number * (1u64 << shift) as f64) as u64)
    });
    match bytes {
        Some(bytes) if bytes >= 128 << 20 => Ok(bytes),
        Some(_) => Err("less than the 128MiB that a query needs".to_owned()),
        None => Err("write a number with its unit: 512MiB, 8GiB".to_owned()),
    }
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let place = error.place().map(|place| format!("\n  at {place}")).unwrap_or_default();
            // A query that is stopped leaves nothing to resume.
            let help = error.help().filter(|_| !error.is_cancelled());
            let help = help.map(|help| format!("\nhelp: {help}")).unwrap_or_default();
            // Errors: nobody can be told.
            let _ =
                writeln!(io::stderr(), "error[{}]: {}{place}{help}", error.code(), error.message());
            ExitCode::from(match error.is_cancelled() {
                true => 130,
                false => error.exit_code(),
            })
        }
    }
}

fn unreadable(path: &Path, error: &io::Error) -> Error {
    Error::new(Code::UnreadableFile, error).at(path.display())
}

fn run(arguments: &Arguments) -> Result<(), Error> {
    let mut sql = arguments.query.clone().unwrap_or_default();
    if let Some(path) = &arguments.file {
        let read = match path.as_os_str() == "-" {
            true => io::stdin().read_to_string(&mut sql).map(drop),
            false => std::fs::read_to_string(path).map(|text| sql = text),
        };
        read.map_err(|e| unreadable(path, &e))?;
    }
    let mut settings = Settings::new();
    if let Some(bytes) = arguments.memory {
        settings = settings.memory(Bytes(bytes));
    }
    if let Some(n) = arguments.threads {
        settings = settings.threads(n.into());
    }
    if let Some(name) = &arguments.at_version {
        settings = settings.at_version(name);
    }
    let form = match (arguments.csv, arguments.json) {
        (true, _) => Form::Csv,
        (_, true) => Form::Json,
        _ => Form::Table,
    };
    let n_threads = settings.n_threads();
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(n_threads)
        .enable_all()
        .build()
        .map_err(|e| Error::new(Code::Memory, format!("no threads: {e}")))?;
    let database = Database::open(&arguments.store, settings)?;
    let done = runtime.block_on(async {
        // A task of its own: this thread looks for Ctrl-C while chunks are read.
        let answered = tokio::spawn(async move { answer(&database, &sql, form).await });
        tokio::select! {
            done = answered => done.unwrap_or_else(|e| Err(Error::internal(e.to_string()))),
            Ok(()) = tokio::signal::ctrl_c() => Err(Error::stopped()),
        }
    });
    // A thread that reads a chunk is not waited for.
    runtime.shutdown_background();
    done
}

async fn answer(database: &Database, sql: &str, form: Form) -> Result<(), Error> {
    let mut rows = database.query(sql).await?;
    let out = Output(io::BufWriter::new(io::stdout()));
    let mut writer = RowWriter::new(form, rows.schema(), out).map_err(unwritten)?;
    while let Some(batch) = rows.next().await {
        let batch = batch.map_err(|e| database.error(e))?;
        if !writer.write(batch).map_err(unwritten)? {
            break;
        }
    }
    if writer.finish().map_err(unwritten)? {
        // Errors: nobody can be told.
        let _ = writeln!(
            io::stderr(),
            "the first {ROWS_MAX} rows; --csv and --json write all, LIMIT asks for fewer"
        );
    }
    Ok(())
}

/// The standard output. A reader that has read enough ends the program.
struct Output(io::BufWriter<io::Stdout>);

impl Output {
    fn checked<T>(done: io::Result<T>) -> io::Result<T> {
        if let Err(error) = &done
            && error.kind() == io::ErrorKind::BrokenPipe
        {
            std::process::exit(0);
        }
        done
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        Self::checked(self.0.write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        Self::checked(self.0.flush())
    }
}

/// The error of writing.
fn unwritten(error: ArrowError) -> Error {
    match &error {
        ArrowError::IoError(..) | ArrowError::CsvError(_) => {
            Error::new(Code::DiskFull, error).with_help("free some space where the output goes")
        }
        _ => Error::internal(error.to_string()),
    }
}
