//! Dense numbers of vertices over all sub-domains, with shared vertices counted once.
//!
//! A shared vertex has the same id in each sub-domain and is numbered where its rank is lowest.
//! Four external sorts of the few vertices that can be shared: by id (who shares), by place (the number
//! where it is numbered), by group (carried over to the others), by place again (a table per sub-domain).

use std::path::{Path, PathBuf};

use tetdb_schema::catalog::SubdomainRow;
use tetdb_schema::ids::{Owner, SubdomainId, VertexId};

use super::chosen::Chosen;
use super::error::Result;
use super::stream::{Records, scratch};
use tetdb_base::storage::{SortRecord, Sorted, Sorter, sort_record};
use tetdb_store::sealed::SealedError;
use tetdb_store::store::{Catalog, StoreError};

sort_record! {
    /// A vertex that another sub-domain may also have.
    pub(super) struct Candidate {
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
        /// The same for all parts that have it.
        group: u64,
        /// Another part numbers it.
        is_elsewhere: bool,
    }
}

sort_record! {
    /// A group's number, or a part that needs it.
    struct GroupMember {
        group: u64,
        /// Not the one that numbers it, which comes first.
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

/// Bytes of an entry in the scratch file.
const ENTRY: usize = size_of::<<TableEntry as SortRecord>::Bytes>();

/// A sub-domain of which all or some is written.
#[derive(Clone)]
pub(super) struct Source {
    pub row: SubdomainRow,
    /// What is written of it.
    pub n_tets: u64,
    pub n_vertices: u64,
    /// Where it stands which these are, unless it is all.
    pub chosen: Option<PathBuf>,
}

impl Source {
    pub fn chosen(&self) -> Result<Option<Chosen>> {
        let load = |path| Chosen::load(path, self.row.tets);
        self.chosen.as_deref().map(load).transpose()
    }
}

impl From<SubdomainRow> for Source {
    fn from(row: SubdomainRow) -> Self {
        Self { n_tets: row.tets, n_vertices: row.vertices, row, chosen: None }
    }
}

/// Numbers of all vertices.
///
/// Shape: `firsts[p]` = number of the first own vertex of part `p`, `shared[p]` = how many of its
/// vertices an earlier part numbers; parts are sub-domains by rank. Where not all of a sub-domain is written, what is counts densely.
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
    /// Its file and sub-domain.
    place: (PathBuf, u32),
    first: u64,
    locals: Vec<u32>,
    numbers: Vec<u64>,
    n_locals: u32,
    /// Number of the first tetrahedron.
    pub first_tet: u64,
    /// What is written, unless it is all.
    chosen: Option<Chosen>,
}

impl PartNumbers {
    /// The number of vertex `local`; one that is not written has none.
    #[inline]
    pub fn vertex(&self, local: u32) -> Option<u64> {
        match &self.chosen {
            None if local < self.n_locals => Some(self.of_dense(local)),
            None => None,
            Some(chosen) => Some(self.of_dense(chosen.vertices.rank(local)?)),
        }
    }

    /// The number of tetrahedron `local`; one that is not written has none.
    #[inline]
    pub fn tet(&self, local: u32) -> Option<u64> {
        let dense = match &self.chosen {
            None => local,
            Some(chosen) => chosen.tets.rank(local)?,
        };
        Some(self.first_tet + u64::from(dense))
    }

    /// The numbers of the vertices of a record that is written, so that they are too. Errors: damage; the record names others.
    #[inline]
    pub fn of<const N: usize>(&self, locals: [u32; N]) -> Result<[u64; N]> {
        let mut numbers = [0; N];
        for (number, local) in numbers.iter_mut().zip(locals) {
            *number = self.vertex(local).ok_or_else(|| self.names(&locals))?;
        }
        Ok(numbers)
    }

    #[cold]
    fn names(&self, locals: &[u32]) -> SealedError {
        let (path, subdomain) = self.place.clone();
        SealedError::Content {
            path,
            subdomain,
            what: format!("a record names vertices {locals:?}"),
        }
    }

    /// The number of a vertex that has this number among those of the part that are written.
    #[inline]
    pub fn of_dense(&self, local: u32) -> u64 {
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
    /// Numbers the vertices of all sub-domains. With `apart`, each has all of its own.
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
            let by_id = candidates(store, parts, dir, memory)?;
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
        by_id: Sorted<Candidate>,
        places: &mut Sorter<SharedVertex>,
    ) -> Result<()> {
        let mut owner: Option<(Candidate, bool)> = None;
        let mut group = 0u64;
        for candidate in by_id {
            let candidate = candidate?;
            match &mut owner {
                Some((first, several)) if first.id == candidate.id => {
                    if candidate.part == first.part {
                        let rank = parts[candidate.part as usize].row.rank;
                        return Err(twice(store, rank, candidate.id));
                    }
                    if !*several {
                        *several = true;
                        group += 1;
                        places.push(first.shared(group, false))?;
                    }
                    places.push(candidate.shared(group, true))?;
                    self.shared[candidate.part as usize] += 1;
                }
                _ => owner = Some((candidate, false)),
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

    /// The numbers of part `p` of `parts` of `store`. Memory: 12 bytes per vertex that another part numbers, and `Chosen` where that is not all.
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
            chosen: parts[p].chosen()?,
        };
        if n > 0 {
            let before = self.shared[..p].iter().sum();
            let mut entries = Records::<ENTRY>::open(&self.table, before)?;
            while part.locals.len() < n {
                let Some(entry) = entries.next()? else { break };
                let entry = TableEntry::from_bytes(&entry);
                part.locals.push(entry.local);
                part.numbers.push(entry.number);
            }
        }
        Ok(part)
    }
}

/// All vertices that are written and that another sub-domain may also have.
pub(super) fn candidates(
    store: &mut Catalog,
    parts: &[Source],
    dir: &Path,
    memory: usize,
) -> Result<Sorted<Candidate>> {
    let mut sorter = Sorter::new(dir, memory as u64 / 4);
    for (p, source) in (0u32..).zip(parts) {
        let rank = source.row.rank;
        let chosen = source.chosen()?;
        let mut part = store.open_subdomain(rank, memory / 4)?;
        let own = SubdomainId::new(rank).map(Owner::Subdomain);
        for (local, vertex) in (0u32..).zip(part.vertices()) {
            let id = vertex?.id;
            if VertexId::from_number(id).map(|v| v.owner) == own {
                continue;
            }
            let dense = match &chosen {
                None => Some(local),
                Some(chosen) => chosen.vertices.rank(local),
            };
            if let Some(local) = dense {
                sorter.push(Candidate { id, part: p, local })?;
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

/// Every vertex that several parts have, for each of these and each other one.
pub(super) fn sharers(by_id: Sorted<Candidate>, dir: &Path, bytes: u64) -> Result<Sorted<Sharer>> {
    let mut sorter = Sorter::new(dir, bytes);
    let mut group: Vec<Candidate> = Vec::new();
    for candidate in by_id {
        let candidate = candidate?;
        if group.first().is_some_and(|first| first.id != candidate.id) {
            group.clear();
        }
        for other in &group {
            for [a, b] in [[&candidate, other], [other, &candidate]] {
                sorter.push(Sharer { part: a.part, local: a.local, other: b.part })?;
            }
        }
        group.push(candidate);
    }
    Ok(sorter.finish()?)
}

impl Candidate {
    fn shared(&self, group: u64, is_elsewhere: bool) -> SharedVertex {
        SharedVertex { part: self.part, local: self.local, group, is_elsewhere }
    }
}

/// Carries each group's number to the parts that share it, and writes the tables one after the other.
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
    let mut stream = scratch(table)?;
    for entry in sorter.finish()? {
        stream.bytes(&entry?.to_bytes());
        stream.end()?;
    }
    stream.finish()
}

fn twice(store: &mut Catalog, rank: u32, id: u64) -> super::WriteError {
    StoreError::Sealed(SealedError::Content {
        path: store.dir().to_owned(),
        subdomain: rank,
        what: format!("two vertices have the id {id}"),
    })
    .into()
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
            chosen: None,
        };
        assert_eq!(numbers.of([0, 1, 2, 3]).unwrap(), [10, 4, 11, 12]);
        let error = numbers.of([0, 4, 2]).unwrap_err();
        assert_eq!(error.code(), "damaged");
        let text = error.to_string();
        assert!(text.contains("a.redb") && text.contains("[0, 4, 2]"), "{text}");
    }
}
