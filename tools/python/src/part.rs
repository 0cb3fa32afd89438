//! A sub-domain as arrays: each chunk is decoded into the array that is returned.

use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

use numpy::{Element, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use tetdb::CancelToken;
use tetdb::data::schema::record::SealedTet;
use tetdb::data::{Chunk, SealedError, Shape, Subdomain};

use crate::failure::Failure;
use crate::watched::watched;

/// A finished sub-domain open for reading; calls from several threads follow one another.
#[pyclass(frozen, module = "tetdb._native")]
pub struct Part {
    inner: Mutex<Subdomain>,
    n_tets: usize,
    n_vertices: usize,
    n_facets: usize,
    n_faces: usize,
}

/// A vertex that no tetrahedron of the block has.
const NOT_IN_BLOCK: i32 = -1;
/// Words of a facet and of an interface face.
const FACET_WORDS: usize = 10;
const FACE_WORDS: usize = 7;

impl Part {
    pub fn new(part: Subdomain) -> Self {
        let row = part.row().clone();
        Self {
            inner: Mutex::new(part),
            n_tets: row.tets as usize,
            n_vertices: row.vertices as usize,
            n_facets: row.facets as usize,
            n_faces: row.interface_faces as usize,
        }
    }

    fn lock(&self) -> MutexGuard<'_, Subdomain> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// An array of `n` rows of `width`, into which `read` decodes.
    fn rows<'py, T: Element + Default + Copy + Send>(
        &self,
        py: Python<'py>,
        (n, width): (usize, usize),
        read: impl FnOnce(&mut Subdomain, &mut [T], &CancelToken) -> Result<(), Failure> + Send,
    ) -> PyResult<Bound<'py, PyArray2<T>>> {
        let array = PyArray2::zeros(py, [n, width], false);
        let token = CancelToken::new();
        {
            let mut filled = array.readwrite();
            let out = filled.as_slice_mut()?;
            watched(py, &token, None, || read(&mut self.lock(), out, &token))?;
        }
        Ok(array)
    }
}

/// Puts each record of `chunks` into the next `width` places of `out`.
fn decode<R, T>(
    chunks: impl Iterator<Item = Result<Chunk<R>, SealedError>>,
    (out, width): (&mut [T], usize),
    token: &CancelToken,
    mut put: impl FnMut(&R, &mut [T]),
) -> Result<(), Failure> {
    let mut rows = out.chunks_exact_mut(width);
    for chunk in chunks {
        if token.is_cancelled() {
            return Err(Failure::cancelled());
        }
        for (record, row) in chunk?.records.iter().zip(&mut rows) {
            put(record, row);
        }
    }
    Ok(())
}

fn signed<const N: usize>(numbers: [u32; N]) -> [i32; N] {
    numbers.map(u32::cast_signed)
}

#[pymethods]
impl Part {
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.rows(py, (self.n_vertices, 3), |part, out, token| {
            let chunks = part.vertex_chunks();
            decode(chunks, (out, 3), token, |v, row| row.copy_from_slice(&v.point))
        })
    }

    fn vertex_ids<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i64>>> {
        self.rows(py, (self.n_vertices, 1), |part, out, token| {
            let chunks = part.vertex_chunks();
            decode(chunks, (out, 1), token, |v, row| row[0] = v.id.cast_signed())
        })
    }

    fn lengths<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        self.rows(py, (self.n_vertices, 1), |part, out, token| {
            let chunks = part.vertex_chunks();
            decode(chunks, (out, 1), token, |v, row| row[0] = v.h)
        })
    }

    fn tets<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i32>>> {
        self.rows(py, (self.n_tets, 4), |part, out, token| {
            let chunks = part.tet_chunks();
            decode(chunks, (out, 4), token, |tet, row| row.copy_from_slice(&signed(tet.nodes)))
        })
    }

    fn regions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i32>>> {
        self.rows(py, (self.n_tets, 1), |part, out, token| {
            let chunks = part.tet_chunks();
            decode(chunks, (out, 1), token, |tet, row| row[0] = tet.region.cast_signed())
        })
    }

    fn quality<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.rows(py, (self.n_tets, 1), |part, out, token| {
            let mut rows = out.iter_mut();
            for chunk in 0..part.tet_summaries().len() {
                if token.is_cancelled() {
                    return Err(Failure::cancelled());
                }
                for tet in part.tet_chunk(chunk as u32)?.records {
                    let corners = part.corners(tet.nodes)?.map(|corner| corner.point);
                    if let Some(row) = rows.next() {
                        *row = Shape::new(corners).quality;
                    }
                }
            }
            Ok(())
        })
    }

    /// Rows of vertices (3), cut, number in the cut, the other sub-domain, tetrahedron.
    fn interfaces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i32>>> {
        self.rows(py, (self.n_faces, FACE_WORDS), |part, out, token| {
            let chunks = part.interface_chunks();
            decode(chunks, (out, FACE_WORDS), token, |face, row| {
                let [a, b, c] = face.vertices;
                let words = [a, b, c, face.cut, face.index, face.other, face.tet];
                row.copy_from_slice(&signed(words));
            })
        })
    }

    /// Rows of triangle (2 words, low first), vertices (3), label, regions (2), tetrahedra (2, -1: none).
    fn facets<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i32>>> {
        self.rows(py, (self.n_facets, FACET_WORDS), |part, out, token| {
            let chunks = part.facet_chunks();
            decode(chunks, (out, FACET_WORDS), token, |facet, row| {
                let [a, b, c] = facet.vertices;
                let (low, high) = (facet.triangle as u32, (facet.triangle >> 32) as u32);
                let ([front, behind], [t0, t1]) = (facet.regions, facet.tets);
                let words = [low, high, a, b, c, facet.label, front, behind, t0, t1];
                row.copy_from_slice(&signed(words));
            })
        })
    }

    /// Tetrahedra `first..first + count` with their own points: points, vertex ids, tetrahedra, regions.
    fn block<'py>(
        &self,
        py: Python<'py>,
        first: usize,
        count: usize,
    ) -> PyResult<BlockArrays<'py>> {
        let range = first..first.saturating_add(count).min(self.n_tets);
        let token = CancelToken::new();
        let read = || Ok(Block::read(&mut self.lock(), range, &token)?);
        watched(py, &token, None, read)?.arrays(py)
    }
}

/// Points (n, 3), vertex ids (n), tetrahedra (m, 4) that name rows of points, regions (m).
pub type BlockArrays<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray2<i32>>,
    Bound<'py, PyArray1<i32>>,
);

/// Consecutive tetrahedra with their own points.
#[derive(Default)]
pub struct Block {
    points: Vec<f64>,
    ids: Vec<i64>,
    tets: Vec<i32>,
    regions: Vec<i32>,
}

impl Block {
    /// Reads tetrahedra by number, and each chunk of vertices that has corners of theirs once. Errors: damage; `token`.
    pub fn read(
        part: &mut Subdomain,
        range: Range<usize>,
        token: &CancelToken,
    ) -> Result<Self, tetdb::Error> {
        let mut block = Self::default();
        // The rows of the vertices of each chunk; empty where the block has none of them.
        let mut rows = vec![Vec::new(); part.vertex_summaries().len()];
        let mut firsts = Vec::with_capacity(rows.len());
        let mut n = 0;
        for summary in part.vertex_summaries() {
            firsts.push(n);
            n += summary.count;
        }
        block.read_tets(part, range, token)?;
        if block.tets.iter().any(|v| v.cast_unsigned() >= n) {
            return Err(part.damaged("a tetrahedron names no vertex").into());
        }
        let place = |part: &Subdomain, v: i32| {
            let chunk = part.vertex_chunk_of(v.cast_unsigned());
            (chunk, (v.cast_unsigned() - firsts[chunk]) as usize)
        };
        for &v in &block.tets {
            let (chunk, i) = place(part, v);
            let of_chunk = &mut rows[chunk];
            of_chunk.resize(part.vertex_summaries()[chunk].count as usize, NOT_IN_BLOCK);
            of_chunk[i] = 0;
        }
        for (chunk, rows) in rows.iter_mut().enumerate().filter(|(_, rows)| !rows.is_empty()) {
            if token.is_cancelled() {
                return Err(tetdb::Error::stopped());
            }
            let vertices = part.vertex_chunk(chunk as u32)?.records;
            let all = rows.iter_mut().zip(&vertices);
            for (row, vertex) in all.filter(|(row, _)| **row != NOT_IN_BLOCK) {
                *row = block.ids.len() as i32;
                block.points.extend(vertex.point);
                block.ids.push(vertex.id.cast_signed());
            }
        }
        for v in &mut block.tets {
            let (chunk, i) = place(part, *v);
            *v = rows[chunk][i];
        }
        Ok(block)
    }

    /// Reads tetrahedra that name vertices of the sub-domain.
    fn read_tets(
        &mut self,
        part: &mut Subdomain,
        range: Range<usize>,
        token: &CancelToken,
    ) -> Result<(), tetdb::Error> {
        self.tets.reserve_exact(4 * range.len());
        self.regions.reserve_exact(range.len());
        let mut first = 0;
        for chunk in 0..part.tet_summaries().len() {
            let end = first + part.tet_summaries()[chunk].count as usize;
            if end > range.start && first < range.end {
                if token.is_cancelled() {
                    return Err(tetdb::Error::stopped());
                }
                let records = part.tet_chunk(chunk as u32)?.records;
                let from = range.start.saturating_sub(first);
                let to = (range.end - first).min(records.len());
                for SealedTet { nodes, region } in &records[from..to] {
                    self.tets.extend(signed(*nodes));
                    self.regions.push(region.cast_signed());
                }
            }
            first = end;
        }
        Ok(())
    }

    pub fn arrays(self, py: Python<'_>) -> PyResult<BlockArrays<'_>> {
        let (n, m) = (self.ids.len(), self.regions.len());
        Ok((
            PyArray1::from_vec(py, self.points).reshape([n, 3])?,
            PyArray1::from_vec(py, self.ids),
            PyArray1::from_vec(py, self.tets).reshape([m, 4])?,
            PyArray1::from_vec(py, self.regions),
        ))
    }
}

/// Qualities of tetrahedra that name rows of `points`.
#[pyfunction]
pub fn qualities<'py>(
    py: Python<'py>,
    points: PyReadonlyArray2<'py, f64>,
    tets: PyReadonlyArray2<'py, i32>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (points, tets) = (points.as_slice()?, tets.as_slice()?.as_chunks::<4>().0);
    let all = PyArray1::zeros(py, tets.len(), false);
    {
        let mut filled = all.readwrite();
        let out = filled.as_slice_mut()?;
        let corner = |v: i32| tetdb::data::DVec3::from_slice(&points[3 * v as usize..]);
        py.detach(|| {
            for (tet, quality) in tets.iter().zip(out) {
                *quality = Shape::new(tet.map(corner)).quality;
            }
        });
    }
    Ok(all)
}
