//! The values of a field in one sub-domain, and those of a new one from a callable.

use std::sync::{Mutex, PoisonError};

use numpy::{Element, PyArray1, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use tetdb::data::Subdomain;
use tetdb::data::schema::chunk::TetSummary;
use tetdb::{CancelToken, FieldPlace, FieldReader, FieldValues};

use crate::failure::Failure;
use crate::part::Block;
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

/// A Python callable that gives the values of a new field, called with the arrays of a chunk: points (n, 3) of vertices; of tetrahedra
/// sub-domain, number of the first, and the arrays of a block. It returns the numbers one after the other, in an array of one of the four types.
pub struct FieldCallable {
    pub callable: Py<PyAny>,
    /// The exception of the call that failed.
    pub raised: Option<PyErr>,
}

impl FieldCallable {
    /// The values of a chunk. Errors: damage; `stopped` where something was raised.
    pub fn values(
        &mut self,
        mesh: &mut Subdomain,
        chunk: u32,
        place: FieldPlace,
    ) -> Result<FieldValues, tetdb::Error> {
        let given = match place {
            FieldPlace::Vertices => {
                let vertices = mesh.vertex_chunk(chunk)?.records;
                Given::Points(vertices.iter().flat_map(|vertex| vertex.point).collect())
            }
            FieldPlace::Tets => {
                let count = |chunks: &[TetSummary]| chunks.iter().map(|c| c.count as usize).sum();
                let (before, rest) = mesh.tet_summaries().split_at(chunk as usize);
                let first: usize = count(before);
                let range = first..first + count(&rest[..1]);
                let rank = mesh.row().rank;
                Given::Tets(rank, first, Block::read(mesh, range, &CancelToken::new())?)
            }
        };
        Python::attach(|py| ask(py, &self.callable, given)).map_err(|error| {
            self.raised = Some(error);
            tetdb::Error::stopped()
        })
    }
}

/// Arguments of a call.
enum Given {
    Points(Vec<f64>),
    Tets(u32, usize, Block),
}

fn ask(py: Python<'_>, callable: &Py<PyAny>, given: Given) -> PyResult<FieldValues> {
    let found = match given {
        Given::Points(list) => {
            let n = list.len() / 3;
            callable.call1(py, (PyArray1::from_vec(py, list).reshape([n, 3])?,))?
        }
        Given::Tets(rank, first, block) => callable.call1(py, (rank, first, block.arrays(py)?))?,
    };
    let found = found.bind(py);
    let values = list(found).map(FieldValues::F64);
    let values = values.or_else(|| list(found).map(FieldValues::F32));
    let values = values.or_else(|| list(found).map(FieldValues::I32));
    let values = values.or_else(|| list(found).map(FieldValues::I64));
    values
        .ok_or_else(|| Failure::internal("a field has numbers of a type it cannot have").raised(py))
}

fn list<T: Element + Copy>(found: &Bound<'_, PyAny>) -> Option<Vec<T>> {
    let array: PyReadonlyArray1<T> = found.extract().ok()?;
    Some(array.as_slice().ok()?.to_vec())
}
