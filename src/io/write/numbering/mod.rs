//! Dense numbers of what is written: vertices over all sub-domains, with shared vertices counted once.
//!
//! A shared vertex has the same id in each of its sub-domains, and the sub-domain of lowest rank numbers it. Four external sorts treat the
//! few vertices that can be shared: by id (the sub-domains that share one), by place (its number), by group (its number for the others), by
//! place again (a table for each sub-domain). `source` finds what is written of each sub-domain, and `subset` numbers it;
//! `corners` numbers the vertices of chosen elements.

mod corners;
mod source;
mod subset;

use std::path::{Path, PathBuf};

pub(super) use corners::{CornerSorter, DenseCorners};
pub(super) use source::{Source, sources};
pub(super) use subset::Subset;

use tetdb_schema::ids::{Owner, SubdomainId, VertexId};

use super::error::Result;
use super::stream::{RecordReader, save};
use tetdb_base::storage::{Sorted, Sorter, sort_record};
use tetdb_store::sealed::{MergeReader, SealedError};
use tetdb_store::store::Catalog;

sort_record! {
    /// A vertex that another sub-domain may also have.
    pub(super) struct ShareableVertex {
        pub id: u64,
        /// Place in the list of parts.
        pub part: u32,
        /// Number in the part, among what is written of it.
        pub local: u32,
    }
}

sort_record! {
    /// A vertex that several parts have.
    struct SharedVertex {
        part: u32,
        local: u32,
        /// Equal for all parts that have the vertex.
        group: u64,
        /// Another part numbers it.
        is_elsewhere: bool,
    }
}

sort_record! {
    /// A group's number, or a part that needs it.
    struct GroupMember {
        group: u64,
        /// False for the part that numbers the group, which comes first.
        is_elsewhere: bool,
        part: u32,
        local: u32,
        /// The number; 0 where it is not yet known.
        number: u64,
    }
}

sort_record! {
    /// A vertex of a part that another part numbers.
    struct TableEntry {
        part: u32,
        local: u32,
        number: u64,
    }
}

/// Numbers of all vertices.
///
/// Shape: `firsts[p]` = number of the first own vertex of part `p`, `shared[p]` = number of its vertices that
/// an earlier part numbers; parts are sub-domains by rank. Vertices that are not written have no number.
pub(super) struct Numbering {
    firsts: Vec<u64>,
    shared: Vec<u64>,
    table: PathBuf,
    n_vertices: u64,
}

/// Numbers of the vertices and tetrahedra of one part.
///
/// Shape: `locals`, ascending, are numbered elsewhere, as `numbers[i]`; all others follow `first`.
pub(super) struct PartNumbers {
    /// File and rank of the sub-domain.
    place: (PathBuf, u32),
    first: u64,
    locals: Vec<u32>,
    numbers: Vec<u64>,
    n_locals: u32,
    /// Number of the first tetrahedron.
    pub first_tet: u64,
    /// The written subset; `None` stands for all.
    subset: Option<Subset>,
}

impl PartNumbers {
    /// The number of vertex `local`; `None` where it is not written.
    #[inline]
    pub fn vertex(&self, local: u32) -> Option<u64> {
        Some(self.dense_vertex(self.in_part(local)?))
    }

    /// The number of vertex `local` among those of the part that are written; `None` where it is not.
    #[inline]
    pub fn in_part(&self, local: u32) -> Option<u32> {
        match &self.subset {
            None => (local < self.n_locals).then_some(local),
            Some(subset) => subset.vertices.rank(local),
        }
    }

    /// The number of tetrahedron `local`; `None` where it is not written.
    #[inline]
    pub fn tet(&self, local: u32) -> Option<u64> {
        let dense = match &self.subset {
            None => local,
            Some(subset) => subset.tets.rank(local)?,
        };
        Some(self.first_tet + u64::from(dense))
    }

    /// The numbers of the vertices of a record that is written. Errors: damage, where the record names a vertex that is not written.
    #[inline]
    pub fn vertices<const N: usize>(&self, locals: [u32; N]) -> Result<[u64; N]> {
        let numbers = self.all_in_part(locals)?;
        Ok(numbers.map(|local| self.dense_vertex(local)))
    }

    /// Number of vertices of the part that are written.
    pub fn n_in_part(&self) -> u64 {
        match &self.subset {
            None => self.n_locals.into(),
            Some(subset) => subset.vertices.n(),
        }
    }

    /// As [`PartNumbers::vertices`], among those of the part that are written.
    #[inline]
    pub fn all_in_part<const N: usize>(&self, locals: [u32; N]) -> Result<[u32; N]> {
        let mut numbers = [0; N];
        for (number, local) in numbers.iter_mut().zip(locals) {
            *number = self.in_part(local).ok_or_else(|| self.names(&locals))?;
        }
        Ok(numbers)
    }

    #[cold]
    fn names(&self, locals: &[u32]) -> SealedError {
        let (path, subdomain) = &self.place;
        SealedError::content(path, *subdomain, format!("a record names vertices {locals:?}"))
    }

    /// The number of a vertex that has this number among those of the part that are written.
    #[inline]
    pub fn dense_vertex(&self, local: u32) -> u64 {
        if self.locals.is_empty() {
            return self.first + u64::from(local);
        }
        match self.locals.binary_search(&local) {
            Ok(i) => self.numbers[i],
            Err(before) => self.first + u64::from(local) - before as u64,
        }
    }

    /// The number of vertex `local` if this part is the one that numbers it.
    #[inline]
    pub fn own(&self, local: u32) -> Option<u64> {
        self.vertex(local).filter(|&number| number >= self.first)
    }
}

impl Numbering {
    /// Numbers the vertices of all sub-domains; with `apart`, each sub-domain numbers all of its own.
    ///
    /// Holds about `memory` bytes. Errors: damage, the disk.
    pub fn new(
        store: &mut Catalog,
        parts: &[Source],
        apart: bool,
        dir: &Path,
        memory: usize,
    ) -> Result<Self> {
        let mut numbering = Self {
            firsts: Vec::with_capacity(parts.len()),
            shared: vec![0; parts.len()],
            table: dir.join("shared"),
            n_vertices: 0,
        };
        let mut places = Sorter::new(dir, memory as u64 / 4);
        if parts.len() > 1 && !apart {
            let by_id = shareable_vertices(store, parts, dir, memory)?;
            numbering.group(store, parts, by_id, &mut places)?;
        }
        for (part, shared) in parts.iter().zip(&numbering.shared) {
            numbering.firsts.push(numbering.n_vertices);
            numbering.n_vertices += part.n_vertices - shared;
        }
        let groups = numbering.number(places.finish()?, dir, memory)?;
        carry(groups, dir, memory, &numbering.table)?;
        Ok(numbering)
    }

    /// Finds vertices with equal ids.
    fn group(
        &mut self,
        store: &mut Catalog,
        parts: &[Source],
        by_id: Sorted<ShareableVertex>,
        places: &mut Sorter<SharedVertex>,
    ) -> Result<()> {
        let (mut by_id, mut same, mut group) = (MergeReader::new(by_id), Vec::new(), 0);
        while by_id.next_group(&mut same, |a, b| a.id == b.id)? {
            let [first, others @ ..] = &same[..] else { continue };
            if others.is_empty() {
                continue;
            }
            group += 1;
            places.push(first.shared(group, false))?;
            for other in others {
                if other.part == first.part {
                    let rank = parts[other.part as usize].row.rank;
                    return Err(twice(store, rank, other.id));
                }
                places.push(other.shared(group, true))?;
                self.shared[other.part as usize] += 1;
            }
        }
        Ok(())
    }

    /// Gives each group its number.
    fn number(
        &self,
        places: Sorted<SharedVertex>,
        dir: &Path,
        memory: usize,
    ) -> Result<Sorted<GroupMember>> {
        let mut groups = Sorter::new(dir, memory as u64 / 4);
        let (mut part, mut shared) = (0, 0);
        for vertex in places {
            let vertex = vertex?;
            if vertex.part != part {
                (part, shared) = (vertex.part, 0);
            }
            let mut member = GroupMember {
                group: vertex.group,
                is_elsewhere: vertex.is_elsewhere,
                part,
                local: vertex.local,
                number: 0,
            };
            if vertex.is_elsewhere {
                shared += 1;
            } else {
                member.number = self.firsts[part as usize] + u64::from(vertex.local) - shared;
            }
            groups.push(member)?;
        }
        Ok(groups.finish()?)
    }

    /// The number of the first vertex that part `p` numbers.
    pub fn first(&self, p: usize) -> u64 {
        self.firsts[p]
    }

    /// Number of vertices of the merged mesh.
    pub fn n_vertices(&self) -> u64 {
        self.n_vertices
    }

    /// The numbers of part `p` of `parts` of `store`. Memory: 12 bytes per vertex that another part numbers, and the [`Subset`].
    ///
    /// Errors: the disk.
    pub fn part(&self, store: &Catalog, parts: &[Source], p: usize) -> Result<PartNumbers> {
        let row = &parts[p].row;
        let path = store.file_path(row.rank, row.generation);
        let n = self.shared[p] as usize;
        let mut part = PartNumbers {
            place: (path.path().to_owned(), row.rank),
            first: self.firsts[p],
            locals: Vec::with_capacity(n),
            numbers: Vec::with_capacity(n),
            n_locals: row.vertices as u32,
            first_tet: parts[..p].iter().map(|part| part.n_tets).sum(),
            subset: parts[p].subset()?,
        };
        if n > 0 {
            let before = self.shared[..p].iter().sum();
            RecordReader::open(&self.table, before)?.each_of(n as u64, |entry: &TableEntry| {
                part.locals.push(entry.local);
                part.numbers.push(entry.number);
                Ok(())
            })?;
        }
        Ok(part)
    }
}

/// All vertices that are written and that another sub-domain may also have, by id.
pub(super) fn shareable_vertices(
    store: &mut Catalog,
    parts: &[Source],
    dir: &Path,
    memory: usize,
) -> Result<Sorted<ShareableVertex>> {
    let mut sorter = Sorter::new(dir, memory as u64 / 4);
    for (p, source) in (0u32..).zip(parts) {
        let rank = source.row.rank;
        let subset = source.subset()?;
        let mut part = store.open_subdomain(rank, memory / 4)?;
        let own = SubdomainId::new(rank).map(Owner::Subdomain);
        for (local, vertex) in (0u32..).zip(part.vertices()) {
            let id = vertex?.id;
            if VertexId::from_number(id).map(|v| v.owner) == own {
                continue;
            }
            let dense = match &subset {
                None => Some(local),
                Some(subset) => subset.vertices.rank(local),
            };
            if let Some(local) = dense {
                sorter.push(ShareableVertex { id, part: p, local })?;
            }
        }
    }
    Ok(sorter.finish()?)
}

sort_record! {
    /// A vertex of one part that another has too.
    pub(super) struct Sharer {
        pub part: u32,
        pub local: u32,
        pub other: u32,
    }
}

/// Every vertex that several parts have, once for each ordered pair of these.
pub(super) fn sharers(
    by_id: Sorted<ShareableVertex>,
    dir: &Path,
    bytes: u64,
) -> Result<Sorted<Sharer>> {
    let mut sorter = Sorter::new(dir, bytes);
    let (mut by_id, mut group) = (MergeReader::new(by_id), Vec::new());
    while by_id.next_group(&mut group, |a, b| a.id == b.id)? {
        for (i, a) in group.iter().enumerate() {
            for b in &group[i + 1..] {
                for [one, other] in [[a, b], [b, a]] {
                    sorter.push(Sharer { part: one.part, local: one.local, other: other.part })?;
                }
            }
        }
    }
    Ok(sorter.finish()?)
}

impl ShareableVertex {
    fn shared(&self, group: u64, is_elsewhere: bool) -> SharedVertex {
        SharedVertex { part: self.part, local: self.local, group, is_elsewhere }
    }
}

/// Gives each group's number to its other parts, and writes the tables of all parts one after the other.
fn carry(groups: Sorted<GroupMember>, dir: &Path, memory: usize, table: &Path) -> Result<()> {
    let mut sorter = Sorter::new(dir, memory as u64 / 4);
    let mut number = 0;
    for member in groups {
        let member = member?;
        if !member.is_elsewhere {
            number = member.number;
            continue;
        }
        sorter.push(TableEntry { part: member.part, local: member.local, number })?;
    }
    save(sorter.finish()?, table, |_| ())
}

fn twice(store: &mut Catalog, rank: u32, id: u64) -> super::WriteError {
    let what = format!("two vertices have the id {id}");
    SealedError::content(store.dir(), rank, what).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_that_name_vertices_beyond_the_last_are_damage() {
        let numbers = PartNumbers {
            place: ("a.redb".into(), 7),
            first: 10,
            locals: vec![1],
            numbers: vec![4],
            n_locals: 4,
            first_tet: 0,
            subset: None,
        };
        assert_eq!(numbers.vertices([0, 1, 2, 3]).unwrap(), [10, 4, 11, 12]);
        let error = numbers.vertices([0, 4, 2]).unwrap_err();
        assert_eq!(error.code(), "damaged");
        let text = error.to_string();
        assert!(text.contains("a.redb") && text.contains("[0, 4, 2]"), "{text}");
    }
}
