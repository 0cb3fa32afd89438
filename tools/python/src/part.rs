//! A sub-domain as arrays: each chunk is decoded into the array that is returned.

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
const NOT_IN_BLOCK: u32 = u32::MAX;
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
    #[expect(clippy::type_complexity, reason = "what Python takes apart at once")]
    fn block<'py>(
        &self,
        py: Python<'py>,
        first: usize,
        count: usize,
    ) -> PyResult<(
        Bound<'py, PyArray2<f64>>,
        Bound<'py, PyArray1<i64>>,
        Bound<'py, PyArray2<i32>>,
        Bound<'py, PyArray1<i32>>,
    )> {
        let end = first.saturating_add(count).min(self.n_tets);
        let n = end.saturating_sub(first);
        let tets = PyArray2::zeros(py, [n, 4], false);
        let regions = PyArray1::zeros(py, n, false);
        let token = CancelToken::new();
        let (points, ids);
        {
            let (mut tets, mut regions) = (tets.readwrite(), regions.readwrite());
            let (tets, regions) = (tets.as_slice_mut()?, regions.as_slice_mut()?);
            let (places, n_points) = watched(py, &token, None, || {
                tets_of_block(&mut self.lock(), first..end, (&mut *tets, regions), &token)
            })?;
            points = PyArray2::zeros(py, [n_points, 3], false);
            ids = PyArray1::zeros(py, n_points, false);
            let (mut points, mut ids) = (points.readwrite(), ids.readwrite());
            let (points, ids) = (points.as_slice_mut()?, ids.as_slice_mut()?);
            watched(py, &token, None, || {
                points_of_block(&mut self.lock(), &places, (points, ids), &token)?;
                let place = |v: &mut i32| *v = places[*v as usize].cast_signed();
                tets.iter_mut().for_each(place);
                Ok(())
            })?;
        }
        Ok((points, ids, tets, regions))
    }
}

/// Reads tetrahedra; returns for each vertex its place in the block, and how many have one.
fn tets_of_block(
    part: &mut Subdomain,
    range: std::ops::Range<usize>,
    (tets, regions): (&mut [i32], &mut [i32]),
    token: &CancelToken,
) -> Result<(Vec<u32>, usize), Failure> {
    let mut places = vec![NOT_IN_BLOCK; part.row().vertices as usize];
    let (mut chunk_first, mut done) = (0, 0);
    for chunk in 0..part.tet_summaries().len() {
        let chunk_end = chunk_first + part.tet_summaries()[chunk].count as usize;
        if chunk_end > range.start && chunk_first < range.end {
            if token.is_cancelled() {
                return Err(Failure::cancelled());
            }
            let records = part.tet_chunk(chunk as u32)?.records;
            let from = range.start.saturating_sub(chunk_first);
            let to = (range.end - chunk_first).min(records.len());
            for SealedTet { nodes, region } in &records[from..to] {
                tets[4 * done..4 * done + 4].copy_from_slice(&signed(*nodes));
                regions[done] = region.cast_signed();
                nodes.iter().for_each(|v| places[*v as usize] = 0);
                done += 1;
            }
        }
        chunk_first = chunk_end;
    }
    let mut n_points = 0;
    for place in places.iter_mut().filter(|place| **place == 0) {
        *place = n_points;
        n_points += 1;
    }
    Ok((places, n_points as usize))
}

/// Reads the vertices that have a place, each chunk of them at most once.
fn points_of_block(
    part: &mut Subdomain,
    places: &[u32],
    (points, ids): (&mut [f64], &mut [i64]),
    token: &CancelToken,
) -> Result<(), Failure> {
    let mut first = 0;
    for chunk in 0..part.vertex_summaries().len() {
        let end = first + part.vertex_summaries()[chunk].count as usize;
        let places = &places[first..end];
        first = end;
        if places.iter().all(|place| *place == NOT_IN_BLOCK) {
            continue;
        }
        if token.is_cancelled() {
            return Err(Failure::cancelled());
        }
        let vertices = part.vertex_chunk(chunk as u32)?.records;
        let all = places.iter().zip(&vertices);
        for (place, vertex) in all.filter(|(place, _)| **place != NOT_IN_BLOCK) {
            let place = *place as usize;
            points[3 * place..3 * place + 3].copy_from_slice(&vertex.point);
            ids[place] = vertex.id.cast_signed();
        }
    }
    Ok(())
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
