//! Evaluating fields on all threads, and writing them.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::old_mesh::{OldMesh, TargetSlice, TargetValues, add};
use super::{FieldTransfer, TransferMethod};
use crate::query::QueryError;
use crate::sealed::{FieldWriter, Subdomain};
use crate::store::Catalog;
use tetdb_base::geom::Point;
use tetdb_base::storage::{check_cancelled, parallel};
use tetdb_schema::catalog::{FileRow, SubdomainRow};
use tetdb_schema::field::{FieldPart, FieldPlace};

/// Least memory of the old mesh open for one thread: below it there is none for the files of two fields.
const SOURCE_BYTES: u64 = 24 << 20;
/// Memory of one new file.
const FILE_BYTES: [u64; 2] = [2 << 20, 16 << 20];
/// Vertices or tetrahedra that a thread evaluates at a time: some milliseconds, in a box that meets few chunks.
const TARGETS: usize = 256;
/// Bytes of the targets and values of a chunk.
const CHUNK_BYTES: u64 = 8 << 20;

/// A field on its new mesh.
#[derive(Clone, Debug)]
pub struct Transferred {
    /// The files that were written, which no catalog lists yet.
    pub parts: Vec<FieldPart>,
    /// Vertices outside of the old mesh, or tetrahedra that share nothing with it; a vertex counts in each of its sub-domains.
    pub outside: u64,
    /// Share of the new mesh's volume that the old one covers; of values by overlap.
    pub covered: Option<f64>,
    /// Sums of value times volume before and after, for each component; of values at tetrahedra that are no integers.
    pub integrals: Option<[Vec<f64>; 2]>,
}

/// Evaluates fields of the sub-domains `from` on the sub-domains `to`, which need not be listed yet, within `memory` bytes.
///
/// Effects: writes files that the caller lists; after an error there are none. Errors: damage; the disk; too little memory.
pub fn transfer(
    (from, from_rows): (&Catalog, &[SubdomainRow]),
    (to, to_rows): (&Catalog, &[SubdomainRow]),
    fields: &[FieldTransfer],
    memory: u64,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Vec<Transferred>, QueryError> {
    let done = run((from, from_rows), (to, to_rows), fields, memory, progress);
    if done.is_err() {
        for (field, row) in fields.iter().flat_map(|f| to_rows.iter().map(move |row| (f, row))) {
            // What stays behind is removed when the store is next changed.
            let file = FileRow { subdomain: row.rank, generation: field.serial };
            let _ = to.field_path(file).remove_file();
        }
    }
    done
}

fn run(
    (from, from_rows): (&Catalog, &[SubdomainRow]),
    (to, to_rows): (&Catalog, &[SubdomainRow]),
    fields: &[FieldTransfer],
    memory: u64,
    progress: &mut dyn FnMut(u64, u64),
) -> Result<Vec<Transferred>, QueryError> {
    let n_threads = parallel(rayon::current_num_threads) as u64;
    let n_sources = (memory / 2 / SOURCE_BYTES).clamp(1, n_threads);
    let source_bytes = (memory / 2 / n_sources).max(SOURCE_BYTES);
    let open = |_| OldMesh::open(from, from_rows, source_bytes).map(Mutex::new);
    let sources = (0..n_sources).map(open).collect::<Result<Vec<_>, _>>()?;
    let n_at_once = (memory / (16 << 20)).clamp(1, 8) as usize;
    let file_bytes = (memory / 4 / n_at_once as u64).clamp(FILE_BYTES[0], FILE_BYTES[1]);
    let run = TransferRun {
        sources,
        to,
        to_rows,
        file_bytes: file_bytes as usize,
        n_chunks: (memory / 8 / CHUNK_BYTES).clamp(1, n_sources) as usize,
    };
    let count =
        |field: &FieldTransfer| to_rows.iter().map(|row| n_values(row, field.old.place)).sum();
    let total: u64 = fields.iter().map(count).map(|n: u64| n).sum();
    let mut done = 0;
    let mut found = vec![None; fields.len()];
    for place in [FieldPlace::Vertices, FieldPlace::Tets] {
        let at_place: Vec<usize> =
            (0..fields.len()).filter(|&i| fields[i].old.place == place).collect();
        for group in at_place.chunks(n_at_once) {
            let own: Vec<FieldTransfer> = group.iter().map(|&i| fields[i].clone()).collect();
            let transferred = run.group(place, &own, &mut |n| {
                done += n * own.len() as u64;
                progress(done, total);
            })?;
            group.iter().zip(transferred).for_each(|(&i, one)| found[i] = Some(one));
        }
    }
    Ok(found.into_iter().flatten().collect())
}

fn n_values(row: &SubdomainRow, place: FieldPlace) -> u64 {
    match place {
        FieldPlace::Vertices => row.vertices,
        FieldPlace::Tets => row.tets,
    }
}

/// The positions of a chunk of the new mesh.
enum ChunkPositions {
    Points(Vec<Point>),
    Tets(Vec<[Point; 4]>),
}

impl ChunkPositions {
    /// Errors: damage.
    fn read(place: FieldPlace, mesh: &mut Subdomain, chunk: u32) -> Result<Self, QueryError> {
        let (read, expected) = match place {
            FieldPlace::Vertices => {
                let vertices = mesh.vertex_chunk(chunk)?.records;
                let points = vertices.iter().map(|v| Point::from_array(v.point)).collect();
                (Self::Points(points), mesh.vertex_summaries()[chunk as usize].count)
            }
            FieldPlace::Tets => {
                let tets = mesh.tet_chunk(chunk)?.records;
                let mut corners =
                    |nodes| Ok::<_, QueryError>(mesh.corners::<4>(nodes)?.map(|c| c.point));
                let tets: Result<_, _> = tets.iter().map(|tet| corners(tet.nodes)).collect();
                (Self::Tets(tets?), mesh.tet_summaries()[chunk as usize].count)
            }
        };
        match read.len() == expected as usize {
            true => Ok(read),
            false => Err(mesh.damaged(format!("chunk {chunk} is not as its summary says")).into()),
        }
    }

    fn len(&self) -> usize {
        match self {
            Self::Points(points) => points.len(),
            Self::Tets(tets) => tets.len(),
        }
    }

    fn targets(&self) -> Vec<TargetSlice<'_>> {
        match self {
            Self::Points(points) => points.chunks(TARGETS).map(TargetSlice::Points).collect(),
            Self::Tets(tets) => tets.chunks(TARGETS).map(TargetSlice::Tets).collect(),
        }
    }
}

struct TransferRun<'a> {
    /// The old mesh, for each thread.
    sources: Vec<Mutex<OldMesh>>,
    to: &'a Catalog,
    to_rows: &'a [SubdomainRow],
    file_bytes: usize,
    /// Chunks of the new mesh in memory at once.
    n_chunks: usize,
}

impl TransferRun<'_> {
    /// Evaluates and writes fields at one place.
    fn group(
        &self,
        place: FieldPlace,
        fields: &[FieldTransfer],
        progress: &mut dyn FnMut(u64),
    ) -> Result<Vec<Transferred>, QueryError> {
        let mut sums = TargetValues::new(fields, &[]);
        let mut parts = vec![Vec::new(); fields.len()];
        for row in self.to_rows {
            let mut mesh = self.to.open_row(row.clone(), self.file_bytes)?;
            let mut writers = Vec::new();
            for field in fields {
                let file = FileRow { subdomain: row.rank, generation: field.serial };
                let (path, serial) = (self.to.field_path(file), field.serial);
                let writer = FieldWriter::create(path, &field.new, &mesh, serial, self.file_bytes)?;
                writers.push(writer);
            }
            let chunks: Vec<u32> = match place {
                FieldPlace::Vertices => (0..mesh.vertex_summaries().len() as u32).collect(),
                FieldPlace::Tets => (0..mesh.tet_summaries().len() as u32).collect(),
            };
            for batch in chunks.chunks(self.n_chunks) {
                let read = |&chunk| ChunkPositions::read(place, &mut mesh, chunk);
                let positions = batch.iter().map(read).collect::<Result<Vec<_>, _>>()?;
                for values in self.evaluate(&positions, fields)? {
                    for (writer, words) in writers.iter_mut().zip(&values.words) {
                        writer.push(words)?;
                    }
                    progress((values.words[0].len() / fields[0].old.components as usize) as u64);
                    sums.outside += values.outside;
                    add(&mut sums.integrals, &values.integrals);
                    sums.volumes = [0, 1].map(|i| sums.volumes[i] + values.volumes[i]);
                }
            }
            for (writer, parts) in writers.into_iter().zip(&mut parts) {
                parts.push(writer.finish(&mut mesh)?);
            }
        }
        let before = match place {
            FieldPlace::Vertices => None,
            FieldPlace::Tets => Some(self.source(0).integrals(fields)?),
        };
        let found = parts.into_iter().zip(sums.integrals).enumerate();
        let found = found.map(|(i, (parts, after))| {
            let before = before.as_ref().filter(|_| !fields[i].old.number.is_integer());
            Transferred {
                parts,
                outside: sums.outside,
                covered: (fields[i].method == TransferMethod::Overlap)
                    .then(|| sums.volumes[1] / sums.volumes[0]),
                integrals: before.map(|all| [all[i].clone(), after]),
            }
        });
        Ok(found.collect())
    }

    /// The values of chunks on all threads, in order.
    fn evaluate(
        &self,
        positions: &[ChunkPositions],
        fields: &[FieldTransfer],
    ) -> Result<Vec<TargetValues>, QueryError> {
        let targets: Vec<(usize, TargetSlice)> = (0..)
            .zip(positions)
            .flat_map(|(chunk, of)| of.targets().into_iter().map(move |targets| (chunk, targets)))
            .collect();
        let evaluate = |(_, targets): &(usize, TargetSlice)| {
            check_cancelled();
            let thread = rayon::current_thread_index().unwrap_or(0);
            self.source(thread).values(targets, fields)
        };
        let found: Result<Vec<TargetValues>, _> =
            parallel(|| targets.par_iter().with_max_len(1).map(evaluate).collect());
        let mut chunks: Vec<TargetValues> =
            positions.iter().map(|_| TargetValues::new(fields, &[])).collect();
        for ((chunk, _), values) in targets.iter().zip(found?) {
            let all = &mut chunks[*chunk];
            for (words, more) in all.words.iter_mut().zip(values.words) {
                words.extend(more);
            }
            all.outside += values.outside;
            add(&mut all.integrals, &values.integrals);
            all.volumes = [0, 1].map(|i| all.volumes[i] + values.volumes[i]);
        }
        Ok(chunks)
    }

    fn source(&self, thread: usize) -> std::sync::MutexGuard<'_, OldMesh> {
        let source = &self.sources[thread % self.sources.len()];
        source.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
