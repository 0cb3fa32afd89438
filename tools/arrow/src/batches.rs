//! The stream of record batches: a batch for each chunk with rows.

use std::sync::Arc;
use std::vec::IntoIter;

use arrow_array::{ArrayRef, RecordBatch, RecordBatchOptions, RecordBatchReader};
use arrow_schema::{ArrowError, SchemaRef};
use tetdb::data::Subdomain;
use tetdb::{ChunkedQuery, Error, Guard, Store};

use super::fields::FieldColumns;
use super::{Chunk, Scan, Table, catalog, faces, tets, vertices};

/// Record batches of a [`Scan`]. Ends after the first error.
pub struct Batches {
    pub(super) store: Store,
    guard: Guard,
    pub(super) schema: SchemaRef,
    scan: Scan,
    chunks: IntoIter<Chunk>,
    /// Rows that may still come.
    left: usize,
    /// The condition.
    pub(super) query: Option<ChunkedQuery>,
    part: Option<Subdomain>,
    pub(super) fields: FieldColumns,
    /// The table without chunks is still to come.
    is_whole: bool,
}

/// Columns of a chunk, and its number of rows.
pub(super) type Rows = (usize, Vec<ArrayRef>);

impl Batches {
    pub(super) fn new(scan: Scan, mut store: Store) -> Result<Self, Error> {
        let schema = scan.schema(&store)?;
        let query = match &scan.condition {
            Some(condition) => Some(store.query().where_(condition)?.by_chunk()?),
            None => None,
        };
        let fields = FieldColumns::new(&store, scan.table, &schema)?;
        let (chunks, n_chunks) = scan.chunks(&mut store)?;
        let is_chunked = matches!(scan.table, Table::Tets | Table::Vertices | Table::Faces);
        debug_assert!(is_chunked || n_chunks == 0);
        Ok(Self {
            left: scan.limit.unwrap_or(usize::MAX),
            is_whole: !is_chunked,
            chunks: chunks.into_iter(),
            part: None,
            guard: store.guard(),
            store,
            schema,
            scan,
            query,
            fields,
        })
    }

    /// The schema of all batches.
    pub fn schema(&self) -> SchemaRef {
        Arc::clone(&self.schema)
    }

    /// Reads the next chunk. Its batch may be without rows; `None` after the last.
    ///
    /// Errors: damage; too little memory; `store-changed`; `stopped`.
    pub fn read_chunk(&mut self) -> Option<Result<RecordBatch, Error>> {
        if self.left == 0 {
            return None;
        }
        let rows = match self.chunks.next() {
            Some(chunk) => {
                let guard = self.guard.clone();
                guard.run(|| self.rows(chunk))
            }
            None if std::mem::take(&mut self.is_whole) => {
                catalog::rows(&self.store, self.scan.table, &self.schema)
            }
            None => return None,
        };
        let batch = rows.map(|(n, columns)| {
            let n_rows = n.min(self.left);
            self.left -= n_rows;
            let options = RecordBatchOptions::new().with_row_count(Some(n));
            RecordBatch::try_new_with_options(self.schema(), columns, &options)
                .expect("each column has the type that the schema names, and a value for each row")
                .slice(0, n_rows)
        });
        if batch.is_err() {
            self.left = 0;
        }
        Some(batch)
    }

    fn rows(&mut self, at: Chunk) -> Result<Rows, Error> {
        match self.scan.table {
            Table::Tets => tets::rows(self, at),
            Table::Vertices => vertices::rows(self, at),
            _ => faces::rows(self, at),
        }
    }

    /// The open sub-domain of a chunk.
    pub(super) fn part(&mut self, rank: u32) -> Result<&mut Subdomain, Error> {
        if self.part.as_ref().is_none_or(|part| part.id().rank() != rank) {
            self.part = None;
            self.part = Some(self.store.subdomain(rank)?);
        }
        Ok(self.part.as_mut().expect("it was opened above"))
    }
}

impl Iterator for Batches {
    type Item = Result<RecordBatch, ArrowError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            match self.read_chunk()? {
                Ok(batch) if batch.num_rows() == 0 => {}
                batch => return Some(batch.map_err(|e| ArrowError::ExternalError(Box::new(e)))),
            }
        }
    }
}

impl RecordBatchReader for Batches {
    fn schema(&self) -> SchemaRef {
        self.schema()
    }
}
