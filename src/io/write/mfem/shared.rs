//! Vertices, edges and faces that several sub-domains have, in groups by these sub-domains.
//!
//! Shared entities lie on the boundary of each of their sub-domains. The corners, edges and faces of input triangles and interface faces are
//! sorted by the numbers of their vertices in the whole, so that equal ones meet. Every side lists them in this order, and begins each edge and
//! face at the same vertex.

use std::collections::BTreeMap;

use super::super::error::Result;
use super::super::merged::{Merged, OpenedPart};
use super::super::stream::Stream;
use super::lines::{TRIANGLE, list};
use tetdb_base::storage::{Sorted, Sorter, sort_record};
use tetdb_schema::record::NO_TET;
use tetdb_store::sealed::MergeReader;

sort_record! {
    /// A vertex, an edge or a face on the boundary of a sub-domain.
    struct Entity {
        /// Numbers of its vertices in the whole, ascending; the last one is repeated to fill three places.
        key: [u64; 3],
        part: u32,
        /// Numbers of the vertices in the sub-domain, parallel to `key`.
        locals: [u32; 3],
    }
}

sort_record! {
    /// A shared entity as one of its sub-domains lists it.
    struct SharedMember {
        part: u32,
        group: u32,
        /// Vertices less one.
        dimension: u32,
        key: [u64; 3],
        locals: [u32; 3],
    }
}

/// The entities on the boundaries of all sub-domains, equal ones next to each other.
fn entities(mesh: &mut Merged) -> Result<Sorted<Entity>> {
    let mut entities = Sorter::new(mesh.dir(), mesh.sorter_bytes());
    for p in 0..mesh.n_parts() {
        let OpenedPart { mut part, numbers, .. } = mesh.open_part(p)?;
        let mut push = |face: [u32; 3]| -> Result<()> {
            let [i, j, k] = numbers.vertices(face)?;
            let [u, v, w] = numbers.all_in_part(face)?;
            let mut ends = [(i, u), (j, v), (k, w)];
            ends.sort_unstable();
            let [a, b, c] = ends;
            for ends in [[a; 3], [b; 3], [c; 3], [a, b, b], [a, c, c], [b, c, c], ends] {
                entities.push(Entity {
                    key: ends.map(|end| end.0),
                    part: p as u32,
                    locals: ends.map(|end| end.1),
                })?;
            }
            Ok(())
        };
        for facet in part.facets() {
            let facet = facet?;
            if facet.tets.iter().any(|&tet| tet != NO_TET) {
                push(facet.vertices)?;
            }
        }
        for face in part.interfaces() {
            push(face?.vertices)?;
        }
    }
    Ok(entities.finish()?)
}

/// All shared entities.
pub(super) struct Shared {
    members: MergeReader<SharedMember>,
    /// Places of the sub-domains of each group.
    groups: Vec<Vec<u32>>,
    /// Vertices, edges and faces of each sub-domain's groups.
    counts: BTreeMap<(u32, u32), [u64; 3]>,
}

impl Shared {
    /// Finds the shared entities. Errors: damage, the disk.
    pub fn gather(mesh: &mut Merged) -> Result<Self> {
        let (mut entities, mut all) = (MergeReader::new(entities(mesh)?), Vec::new());
        let mut members = Sorter::new(mesh.dir(), mesh.sorter_bytes());
        let mut group_of = BTreeMap::new();
        let mut counts = BTreeMap::<_, [u64; 3]>::new();
        while entities.next_group(&mut all, |a, b| a.key == b.key)? {
            all.dedup();
            if all.len() == 1 {
                continue;
            }
            let ranks: Vec<u32> = all.iter().map(|e| e.part).collect();
            let n = group_of.len() as u32;
            let group = *group_of.entry(ranks).or_insert(n);
            let [a, b, c] = all[0].key;
            let dimension = u32::from(a != b) + u32::from(b != c);
            for &Entity { key, part, locals } in &all {
                counts.entry((part, group)).or_default()[dimension as usize] += 1;
                members.push(SharedMember { part, group, dimension, key, locals })?;
            }
        }
        let mut groups = vec![Vec::new(); group_of.len()];
        for (ranks, group) in group_of {
            groups[group as usize] = ranks;
        }
        let members = MergeReader::new(members.finish()?);
        Ok(Self { members, groups, counts })
    }

    /// Writes the shared entities of the sub-domain at place `p`; later calls are for later sub-domains. Errors: the disk.
    pub fn write(&mut self, p: u32, stream: &mut Stream) -> Result<()> {
        let groups: Vec<_> = self.counts.range((p, 0)..(p + 1, 0)).collect();
        // The first group is the sub-domain alone.
        stream.text(&format!(
            "\ncommunication_groups\nnumber_of_groups {}\n\n1 {p}\n",
            groups.len() + 1
        ));
        for ((_, group), _) in &groups {
            let ranks = &self.groups[*group as usize];
            stream.integer(ranks.len() as u64, b' ');
            list(stream, &ranks.iter().map(|&rank| rank.into()).collect::<Vec<_>>())?;
        }
        stream.text("\n");
        for (dimension, what) in ["vertices", "edges", "faces"].iter().enumerate() {
            let total: u64 = groups.iter().map(|(_, n)| n[dimension]).sum();
            stream.text(&format!("total_shared_{what} {total}\n"));
        }
        for (&(_, group), counts) in groups {
            for (dimension, what) in (0..).zip(["vertices", "edges", "faces"]) {
                stream.text(&format!("\nshared_{what} {}\n", counts[dimension as usize]));
                let here = (p, group, dimension);
                let order = |m: &SharedMember| (m.part, m.group, m.dimension);
                while let Some(member) = self.members.next_if(|m| order(m) <= here)? {
                    if order(&member) < here {
                        continue; // of a sub-domain that is not written
                    }
                    if dimension == 2 {
                        stream.integer(TRIANGLE, b' ');
                    }
                    let locals = member.locals.map(u64::from);
                    list(stream, &locals[..=dimension as usize])?;
                }
            }
        }
        Ok(())
    }
}
