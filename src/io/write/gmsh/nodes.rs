//! Vertices by the entities they stand with.

use std::path::{Path, PathBuf};

use super::super::error::Result;
use super::super::merged::{Merged, Opened};
use super::super::stream::{Records, scratch};
use super::entities::Entities;
use super::out::Out;
use crate::storage::{Payload, SortRecord, Sorter, sort_record};

sort_record! {
    /// An entity that a vertex is on, or, behind all of these, where it is.
    struct Claim {
        vertex: u64,
        /// [`POSITION`] for a position.
        entity: u32,
        point: Payload<[f64; 3]>,
    }
}

sort_record! {
    /// A vertex by its entity.
    struct Node {
        entity: u32,
        vertex: u64,
        point: Payload<[f64; 3]>,
    }
}

const POSITION: u32 = u32::MAX;
const NODE_BYTES: usize = size_of::<<Node as SortRecord>::Bytes>();

/// The vertices of a file, sorted, in a scratch file.
pub(super) struct Nodes {
    pub n: u64,
    /// How many stand with each entity, by its place.
    counts: Vec<u64>,
    span: [u64; 2],
    path: PathBuf,
}

/// Gives each vertex of the sub-domains at places `which` its entity.
pub(super) fn gather(
    mesh: &mut Merged,
    which: &[usize],
    entities: &Entities,
    name: &Path,
) -> Result<Nodes> {
    let parts = mesh.parts();
    let (dir, bytes) = (mesh.dir().to_owned(), mesh.sorter_bytes());
    let mut claims = Sorter::new(&dir, bytes);
    let mut claim = |vertex, entity, point| {
        claims.push(Claim {
            vertex,
            entity,
            point: Payload(point),
        })
    };
    mesh.faces().each(|face| {
        if let Some(entity) = entities.surface(face.label, face.subdomain) {
            for vertex in face.vertices {
                claim(vertex, entity, [0.0; 3])?;
            }
        }
        Ok(())
    })?;
    for &p in which {
        let Opened {
            mut part, numbers, ..
        } = mesh.open_part(p)?;
        let volumes = entities.volumes_of(parts[p].rank);
        // Inside, all tetrahedra around a vertex are of one region, so that the first one tells it: a bit for each vertex.
        let mut is_known = vec![0u64; parts[p].n_vertices.div_ceil(64) as usize];
        if let (1, Some(&entity)) = (volumes.len(), volumes.values().next()) {
            for v in 0..parts[p].n_vertices as u32 {
                claim(numbers.of(v), entity, [0.0; 3])?;
            }
        } else {
            for tet in part.tets() {
                let tet = tet?.1;
                for v in tet.nodes {
                    let (word, bit) = (v as usize / 64, 1 << (v % 64));
                    if is_known.get(word).is_some_and(|w| w & bit == 0) {
                        is_known[word] |= bit;
                        claim(numbers.of(v), volumes[&tet.region], [0.0; 3])?;
                    }
                }
            }
        }
        for (v, vertex) in (0u32..).zip(part.vertices()) {
            claim(numbers.of(v), POSITION, vertex?.point)?;
        }
        mesh.advance(parts[p].n_vertices as usize);
    }
    let mut sorter = Sorter::new(&dir, bytes);
    let mut last = None;
    for claim in claims.finish()? {
        let claim = claim?;
        match last {
            Some((vertex, entity)) if vertex == claim.vertex => {
                if claim.entity == POSITION && entity != POSITION {
                    sorter.push(Node {
                        entity,
                        vertex,
                        point: claim.point,
                    })?;
                    last = Some((vertex, POSITION));
                }
            }
            _ => last = Some((claim.vertex, claim.entity)),
        }
    }
    let file = name.file_name().unwrap_or_default().to_string_lossy();
    let mut nodes = Nodes {
        n: 0,
        counts: vec![0; entities.tags().len()],
        span: [u64::MAX, 0],
        path: dir.join(format!("nodes-{file}")),
    };
    let mut stream = scratch(&nodes.path)?;
    for node in sorter.finish()? {
        let node = node?;
        nodes.n += 1;
        nodes.counts[node.entity as usize] += 1;
        let [least, greatest] = nodes.span;
        nodes.span = [least.min(node.vertex + 1), greatest.max(node.vertex + 1)];
        stream.bytes(&node.to_bytes());
        stream.end()?;
    }
    stream.finish()?;
    Ok(nodes)
}

impl Nodes {
    /// Writes them entity by entity: first the tags of its vertices, then where they are.
    pub fn write(&self, out: &mut Out, entities: &Entities) -> Result<()> {
        let blocks = self.counts.iter().filter(|&&n| n > 0).count() as u64;
        for n in [blocks, self.n, self.span[0], self.span[1]] {
            out.size(n);
        }
        out.end()?;
        let mut first = 0;
        for (&n, (dim, tag, _)) in self.counts.iter().zip(entities.tags()) {
            if n == 0 {
                continue;
            }
            for word in [dim, tag, 0] {
                out.int(word);
            }
            out.size(n);
            out.end()?;
            self.each(first, n, |node| {
                out.size(node.vertex + 1);
                out.end()
            })?;
            self.each(first, n, |node| {
                node.point.0.into_iter().for_each(|x| out.double(x));
                out.end()
            })?;
            first += n;
        }
        Ok(())
    }

    fn each(&self, first: u64, n: u64, mut each: impl FnMut(Node) -> Result<()>) -> Result<()> {
        let mut records = Records::<NODE_BYTES>::open(&self.path, first)?;
        for _ in 0..n {
            let Some(record) = records.next()? else { break };
            each(Node::from_bytes(&record))?;
        }
        Ok(())
    }
}
