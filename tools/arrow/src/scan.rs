//! A question to a table, and the chunks to read for it.

use std::fmt;

use arrow_schema::SchemaRef;
use tetdb::{Code, Error, Store, TetChunk};

use super::{Batches, Table};

/// A chunk of a sub-domain's tetrahedra, vertices or faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chunk {
    /// Rank of the sub-domain.
    pub subdomain: u32,
    /// Number of the chunk in the sub-domain.
    pub chunk: u32,
    /// Its number of rows, if all of them are known to be rows of the answer.
    pub whole: Option<u32>,
}

/// A question to one table: all rows and columns, unless less is asked for.
#[derive(Clone, Debug)]
pub struct Scan {
    pub(super) table: Table,
    pub(super) columns: Option<Vec<String>>,
    pub(super) condition: Option<String>,
    pub(super) limit: Option<usize>,
    pub(super) chunks: Option<Vec<Chunk>>,
}

impl Scan {
    /// All of a table.
    pub fn new(table: Table) -> Self {
        Self { table, columns: None, condition: None, limit: None, chunks: None }
    }

    /// Only these columns, in this order.
    pub fn columns<S: AsRef<str>>(mut self, names: &[S]) -> Self {
        self.columns = Some(names.iter().map(|name| name.as_ref().to_owned()).collect());
        self
    }

    /// Only tetrahedra that fulfill a condition; see [`Query::where_`](tetdb::Query::where_). Other tables take none.
    pub fn condition(mut self, text: impl Into<String>) -> Self {
        self.condition = Some(text.into());
        self
    }

    /// At most so many rows.
    pub fn limit(mut self, n: usize) -> Self {
        self.limit = Some(n);
        self
    }

    /// Only rows of these chunks.
    pub fn only(mut self, chunks: Vec<Chunk>) -> Self {
        self.chunks = Some(chunks);
        self
    }

    /// The limit.
    pub fn most(&self) -> usize {
        self.limit.unwrap_or(usize::MAX)
    }

    /// The schema of the answer. Errors: `bad-query` for a column that is not there; damage.
    pub fn schema(&self, store: &Store) -> Result<SchemaRef, Error> {
        let all = self.table.schema(store)?;
        let Some(names) = &self.columns else {
            return Ok(all);
        };
        let places = names.iter().map(|name| {
            all.index_of(name).map_err(|_| {
                let known: Vec<&str> = all.fields().iter().map(|f| f.name().as_str()).collect();
                let (table, known) = (self.table.name(), known.join(", "));
                let message = format!("{table} has no column {name}; there are {known}");
                Error::new(Code::BadQuery, message)
            })
        });
        let places = places.collect::<Result<Vec<usize>, Error>>()?;
        Ok(all.project(&places).expect("the places are those of columns").into())
    }

    /// The chunks that may have rows, in the order of the store, and the number of all chunks; none for tables without chunks.
    ///
    /// Errors: `bad-expression`; damage.
    pub fn chunks(&self, store: &mut Store) -> Result<(Vec<Chunk>, u64), Error> {
        let kind = match self.table {
            Table::Tets => 0,
            Table::Vertices => 1,
            Table::Faces => 2,
            _ => return Ok((Vec::new(), 0)),
        };
        let rows = &store.summary().subdomains;
        let n_chunks = rows.iter().map(|row| u64::from(row.chunks[kind])).sum();
        let chunks = match (&self.chunks, &self.condition) {
            (Some(chunks), _) => chunks.clone(),
            (None, Some(condition)) => {
                let found = store.query().where_(condition)?.chunks()?.into_iter();
                let whole = |c: &TetChunk| c.is_whole.then_some(c.n_tets);
                found
                    .map(|c| Chunk { subdomain: c.subdomain, chunk: c.chunk, whole: whole(&c) })
                    .collect()
            }
            (None, None) => {
                let of = |row: &tetdb::data::schema::catalog::SubdomainRow| {
                    let subdomain = row.rank;
                    (0..row.chunks[kind]).map(move |chunk| Chunk { subdomain, chunk, whole: None })
                };
                rows.iter().flat_map(of).collect()
            }
        };
        Ok((chunks, n_chunks))
    }

    /// Number of rows as far as the catalog has it: without a condition and chosen chunks, before the limit.
    pub fn n_rows(&self, store: &Store) -> Option<u64> {
        let all = store.summary();
        let n = match self.table {
            _ if self.condition.is_some() || self.chunks.is_some() => return None,
            Table::Tets => all.n_tets,
            Table::Vertices => all.n_vertices,
            Table::Faces => all.subdomains.iter().map(|row| row.facets).sum(),
            Table::Interfaces => all.interfaces.len() as u64,
            Table::Subdomains => all.subdomains.len() as u64,
            Table::Regions => all.regions.len() as u64,
            Table::Labels => all.labels.len() as u64,
            Table::Versions => return None,
        };
        Some(n)
    }

    /// Checks the question without reading the mesh. Errors: as [`Scan::open`].
    pub fn check(&self, store: &mut Store) -> Result<(), Error> {
        self.schema(store)?;
        if let Some(condition) = self.condition.as_ref().filter(|_| self.table == Table::Tets) {
            store.query().where_(condition)?;
        }
        if self.condition.is_some() && self.table != Table::Tets {
            let message =
                format!("a condition selects tetrahedra, not rows of {}", self.table.name());
            return Err(Error::new(Code::BadQuery, message)
                .with_help("read the whole table, and select where it is read"));
        }
        Ok(())
    }

    /// Starts reading. `store` is read by nobody else meanwhile; open one for each stream.
    ///
    /// Errors: `bad-query` for a column that is not there, or for a condition on a table that takes none; `bad-expression`; damage.
    pub fn open(self, mut store: Store) -> Result<Batches, Error> {
        self.check(&mut store)?;
        Batches::new(self, store)
    }
}

impl fmt::Display for Scan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "table={}", self.table.name())?;
        if let Some(names) = &self.columns {
            write!(f, ", columns=[{}]", names.join(", "))?;
        }
        if let Some(condition) = &self.condition {
            write!(f, ", where={condition}")?;
        }
        match self.limit {
            Some(n) => write!(f, ", limit={n}"),
            None => Ok(()),
        }
    }
}
