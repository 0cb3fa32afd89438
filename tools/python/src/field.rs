//! The values of a field in one sub-domain.

use std::sync::{Mutex, PoisonError};

use numpy::PyArray1;
use pyo3::prelude::*;
use tetdb::{CancelToken, FieldReader, FieldValues};

use crate::watched::watched;

/// A field of a sub-domain, open for reading.
#[pyclass(frozen, module = "tetdb._native")]
pub struct Field {
    reader: Mutex<FieldReader>,
    #[pyo3(get)]
    n_chunks: u32,
}

impl Field {
    pub fn new(reader: FieldReader) -> Self {
        Self { n_chunks: reader.n_chunks(), reader: Mutex::new(reader) }
    }
}

#[pymethods]
impl Field {
    /// The numbers of a chunk, value by value.
    fn chunk<'py>(&self, py: Python<'py>, chunk: u32) -> PyResult<Bound<'py, PyAny>> {
        let values = watched(py, &CancelToken::new(), None, || {
            let mut reader = self.reader.lock().unwrap_or_else(PoisonError::into_inner);
            Ok(reader.chunk(chunk)?)
        })?;
        Ok(match values {
            FieldValues::F32(list) => PyArray1::from_vec(py, list).into_any(),
            FieldValues::F64(list) => PyArray1::from_vec(py, list).into_any(),
            FieldValues::I32(list) => PyArray1::from_vec(py, list).into_any(),
            FieldValues::I64(list) => PyArray1::from_vec(py, list).into_any(),
        })
    }
}
