//! Ghosts: tetrahedra that share a vertex with one of another partition.

use std::path::PathBuf;

use super::super::error::Result;
use super::super::merged::{Merged, OpenedPart};
use super::super::stream::{RecordReader, save};
use super::out::Out;
use tetdb_base::storage::{Payload, Sorter, sort_record};
use tetdb_store::sealed::MergeReader;

sort_record! {
    /// A tetrahedron as a ghost of another partition.
    pub(super) struct Ghost {
        /// Place of the partition that has it as a ghost.
        to: u32,
        pub region: u32,
        /// Rank of its own partition.
        pub from: u32,
        /// Number of the tetrahedron in the whole.
        pub number: u64,
        pub nodes: Payload<[u64; 4]>,
        pub points: Payload<[f64; 12]>,
    }
}

/// Ghosts of all partitions, in a scratch file.
pub(super) struct Ghosts {
    /// Number of the first ghost of each partition, and the number of all.
    firsts: Vec<u64>,
    path: PathBuf,
}

impl Ghosts {
    /// Finds the ghosts. Errors: damage, the disk.
    pub fn gather(mesh: &mut Merged) -> Result<Self> {
        let mut sharers = MergeReader::new(mesh.sharers()?);
        let mut sorter = Sorter::new(mesh.dir(), mesh.sorter_bytes());
        for p in 0..mesh.n_parts() {
            // Vertices of this sub-domain by number, ascending, each with the place of another sub-domain that has it.
            let mut shared: Vec<(u64, u32)> = Vec::new();
            let OpenedPart { mut part, numbers } = mesh.open_part(p)?;
            while let Some(sharer) = sharers.next_if(|s| s.part as usize == p)? {
                shared.push((numbers.dense_vertex(sharer.local), sharer.other));
            }
            shared.sort_unstable();
            let rank = part.id().rank();
            let mut others = Vec::new();
            for chunk in 0..part.tet_summaries().len() {
                let chunk = part.tet_chunk(chunk as u32)?;
                for (local, tet) in (chunk.first..).zip(&chunk.records) {
                    let Some(number) = numbers.tet(local) else {
                        continue;
                    };
                    let nodes = numbers.vertices(tet.nodes)?;
                    others.clear();
                    for v in nodes {
                        let from = shared.partition_point(|s| s.0 < v);
                        let of_vertex = shared[from..].iter().take_while(|s| s.0 == v);
                        others.extend(of_vertex.map(|s| s.1));
                    }
                    if others.is_empty() {
                        continue;
                    }
                    others.sort_unstable();
                    others.dedup();
                    let corners = part.corners(tet.nodes)?;
                    let mut points = [0.0; 12];
                    for (to, corner) in points.chunks_exact_mut(3).zip(corners) {
                        to.copy_from_slice(&corner.point.to_array());
                    }
                    for &to in &others {
                        sorter.push(Ghost {
                            to,
                            region: tet.region,
                            from: rank,
                            number,
                            nodes: Payload(nodes),
                            points: Payload(points),
                        })?;
                    }
                }
            }
        }
        let mut counts = vec![0; mesh.n_parts()];
        let path = mesh.dir().join("ghosts");
        save(sorter.finish()?, &path, |ghost: &Ghost| counts[ghost.to as usize] += 1)?;
        let mut firsts = vec![0];
        for count in counts {
            firsts.push(firsts[firsts.len() - 1] + count);
        }
        Ok(Self { firsts, path })
    }

    /// Calls `each` with the ghosts of the partition at place `p`, by region and partition. Errors: the disk, those of `each`.
    pub fn each(&self, p: usize, each: impl FnMut(&Ghost) -> Result<()>) -> Result<()> {
        let n = self.firsts[p + 1] - self.firsts[p];
        RecordReader::open(&self.path, self.firsts[p])?.each_of(n, each)
    }

    /// Lists the ghosts of the partitions at places `which`: element, its partition, the partition that has it as a ghost.
    pub fn write(&self, out: &mut Out, which: &[usize], mesh: &Merged) -> Result<()> {
        let counts = which.iter().map(|&p| self.firsts[p + 1] - self.firsts[p]);
        out.size(counts.sum());
        out.end()?;
        let parts = mesh.parts();
        for &p in which {
            self.each(p, |ghost| {
                out.size(mesh.n_faces() + ghost.number + 1);
                out.int(ghost.from + 1);
                out.size(1);
                out.int(parts[p].rank + 1);
                out.end()
            })?;
        }
        Ok(())
    }
}
