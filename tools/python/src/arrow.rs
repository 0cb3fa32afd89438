//! Tables of a store as Arrow streams, by the PyCapsule interface: DuckDB, Polars, pandas and pyarrow take them without copies.

use std::path::PathBuf;
use std::sync::Arc;
use std::thread::ThreadId;

use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::{RecordBatch, RecordBatchReader};
use arrow_schema::ffi::FFI_ArrowSchema;
use arrow_schema::{ArrowError, SchemaRef};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyDict};
use tetdb::CancelToken;
use tetdb_arrow::{Batches, Scan, Table};

use crate::failure::Failure;
use crate::run::SettingWords;
use crate::watched::watched;

/// A question to a table, which is asked anew by each reader.
#[pyclass(frozen, module = "tetdb._native")]
pub struct ArrowStream {
    path: PathBuf,
    settings: SettingWords,
    scan: Scan,
    schema: SchemaRef,
}

impl ArrowStream {
    /// Errors: those of the question, before anything is read.
    pub fn new(
        path: PathBuf,
        settings: SettingWords,
        store: &mut tetdb::Store,
        (table, condition, columns): (&str, Option<String>, Option<Vec<String>>),
    ) -> Result<Self, Failure> {
        let mut scan = Scan::new(Table::from_name(table)?);
        if let Some(names) = columns {
            scan = scan.columns(&names);
        }
        if let Some(text) = condition {
            scan = scan.condition(text);
        }
        scan.check(store)?;
        Ok(Self { path, settings, schema: scan.schema(store)?, scan })
    }
}

#[pymethods]
impl ArrowStream {
    /// Names and types of the columns.
    #[getter]
    fn schema<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for field in self.schema.fields() {
            all.set_item(field.name(), field.data_type().to_string().to_lowercase())?;
        }
        Ok(all)
    }

    fn __arrow_c_schema__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyCapsule>> {
        let schema = FFI_ArrowSchema::try_from(self.schema.as_ref());
        let schema = schema.map_err(|e| Failure::internal(&e.to_string()).raised(py))?;
        PyCapsule::new_with_value(py, schema, c"arrow_schema")
    }

    /// A stream from the first row on, with the store opened for it alone. Its columns have the types of `schema`, whatever is requested.
    #[pyo3(signature = (requested_schema=None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        drop(requested_schema);
        let token = CancelToken::new();
        let batches = watched(py, &token, None, || {
            let settings = self.settings.settings(&token, None);
            let store = tetdb::Store::open_with(&self.path, settings)?;
            Ok(self.scan.clone().open(store)?)
        })?;
        let threading = py.import("threading")?;
        let is_main =
            threading.call_method0("current_thread")?.is(&threading.call_method0("main_thread")?);
        let main = is_main.then(|| std::thread::current().id());
        let reader = WatchedBatches { batches, main };
        let stream = FFI_ArrowArrayStream::new(Box::new(reader));
        PyCapsule::new_with_value(py, stream, c"arrow_array_stream")
    }
}

/// Batches that end early after a signal whose handler raises.
struct WatchedBatches {
    batches: Batches,
    /// Python's main thread, which alone handles signals. On another thread nobody looks for them, because that thread may be waited for
    /// with the interpreter's lock held.
    main: Option<ThreadId>,
}

impl WatchedBatches {
    /// Errors: what was raised.
    fn look(&self) -> Result<(), ArrowError> {
        if self.main != Some(std::thread::current().id()) {
            return Ok(());
        }
        Python::attach(|py| {
            let Err(raised) = py.check_signals() else {
                return Ok(());
            };
            let message = format!("stopped: {raised}");
            if raised.is_instance_of::<PyKeyboardInterrupt>(py) {
                // The reader raises an error of its own now. The interrupt itself is to come behind it.
                let again = py.import("_thread").and_then(|m| m.call_method0("interrupt_main"));
                drop(again);
            }
            Err(ArrowError::ComputeError(message))
        })
    }
}

impl Iterator for WatchedBatches {
    type Item = Result<RecordBatch, ArrowError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Err(stopped) = self.look() {
                return Some(Err(stopped));
            }
            match self.batches.read_chunk()? {
                Ok(batch) if batch.num_rows() == 0 => {}
                batch => return Some(batch.map_err(|e| ArrowError::ExternalError(Box::new(e)))),
            }
        }
    }
}

impl RecordBatchReader for WatchedBatches {
    fn schema(&self) -> SchemaRef {
        Arc::clone(&self.batches.schema())
    }
}
