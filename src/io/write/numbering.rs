//! Dense numbers of vertices over all sub-domains, with shared vertices counted once.
//!
//! A shared vertex has the same id in each sub-domain and is numbered where its rank is lowest.
//! Four external sorts of the few vertices that can be shared: by id (who shares), by place (the number
//! where it is numbered), by group (carried over to the others), by place again (a table per sub-domain).

use std::path::{Path, PathBuf};

use tetdb_schema::ids::{Owner, SubdomainId, VertexId};

use super::error::Result;
use super::stream::{Records, scratch, word32, word64};
use crate::sealed::SealedError;
use crate::storage::{Sorted, Sorter};
use crate::store::{Catalog, StoreError};

/// Bytes of a record of the table: local number, then dense number.
const ENTRY: usize = 12;

/// Numbers of all vertices.
///
/// Shape: `firsts[p]` = number of the first own vertex of part `p`, `shared[p]` = how many of its
/// vertices an earlier part numbers; parts are sub-domains by rank.
pub(super) struct Numbering {
    firsts: Vec<u64>,
    shared: Vec<u64>,
    table: PathBuf,
    n_vertices: u64,
}

/// Numbers of the vertices of one part.
///
/// Shape: `locals`, ascending, are numbered elsewhere, as `numbers[i]`; all others follow `first`.
pub(super) struct PartNumbers {
    first: u64,
    locals: Vec<u32>,
    numbers: Vec<u64>,
}

impl PartNumbers {
    /// The number of vertex `local`.
    #[inline]
    pub fn of(&self, local: u32) -> u64 {
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
        let number = self.of(local);
        (number >= self.first).then_some(number)
    }
}

impl Numbering {
    /// Numbers the vertices of all sub-domains; `parts` are their ranks and numbers of vertices.
    ///
    /// Holds about `memory` bytes. Errors: damage, the disk.
    pub fn new(
        store: &mut Catalog,
        parts: &[(u32, u64)],
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
        if parts.len() > 1 {
            let by_id = candidates(store, parts, dir, memory)?;
            numbering.group(store, parts, by_id, &mut places)?;
        }
        for (part, shared) in parts.iter().zip(&numbering.shared) {
            numbering.firsts.push(numbering.n_vertices);
            numbering.n_vertices += part.1 - shared;
        }
        let groups = numbering.number(places.finish()?, dir, memory)?;
        carry(groups, dir, memory, &numbering.table)?;
        Ok(numbering)
    }

    /// Finds vertices with equal ids. A place is (part, local, group, whether another part numbers it).
    fn group(
        &mut self,
        store: &mut Catalog,
        parts: &[(u32, u64)],
        by_id: Sorted<16>,
        places: &mut Sorter<17>,
    ) -> Result<()> {
        let mut owner: Option<([u8; 16], bool)> = None;
        let mut group = 0u64;
        for record in by_id {
            let record = record?;
            match &mut owner {
                Some((first, several)) if first[..8] == record[..8] => {
                    let part = word32(&record, 8);
                    if part == word32(&first[..], 8) {
                        return Err(twice(store, parts[part as usize].0, word64(&record, 0)));
                    }
                    if !*several {
                        *several = true;
                        group += 1;
                        places.push(place(&first[8..], group, 0))?;
                    }
                    places.push(place(&record[8..], group, 1))?;
                    self.shared[part as usize] += 1;
                }
                _ => owner = Some((record, false)),
            }
        }
        Ok(())
    }

    /// Gives each group its number. A result is (group, 0, number) or (group, 1, part, local).
    fn number(&self, places: Sorted<17>, dir: &Path, memory: usize) -> Result<Sorted<17>> {
        let mut groups = Sorter::new(dir, memory as u64 / 4);
        let (mut part, mut shared) = (0, 0);
        for record in places {
            let record = record?;
            if word32(&record, 0) != part {
                (part, shared) = (word32(&record, 0), 0);
            }
            let mut out = [0; 17];
            out[..8].copy_from_slice(&record[8..16]);
            out[8] = record[16];
            if record[16] == 0 {
                let number = self.firsts[part as usize] + u64::from(word32(&record, 4)) - shared;
                out[9..].copy_from_slice(&number.to_be_bytes());
            } else {
                shared += 1;
                out[9..].copy_from_slice(&record[..8]);
            }
            groups.push(out)?;
        }
        Ok(groups.finish()?)
    }

    /// Number of vertices of the merged mesh.
    pub fn n_vertices(&self) -> u64 {
        self.n_vertices
    }

    /// The numbers of part `p`. Memory: 12 bytes per vertex that another part numbers.
    ///
    /// Errors: the disk.
    pub fn part(&self, p: usize) -> Result<PartNumbers> {
        let n = self.shared[p] as usize;
        let mut part = PartNumbers {
            first: self.firsts[p],
            locals: Vec::with_capacity(n),
            numbers: Vec::with_capacity(n),
        };
        if n > 0 {
            let before = self.shared[..p].iter().sum();
            let mut entries = Records::<ENTRY>::open(&self.table, before)?;
            while part.locals.len() < n {
                let Some(entry) = entries.next()? else { break };
                part.locals.push(word32(&entry, 0));
                part.numbers.push(word64(&entry, 4));
            }
        }
        Ok(part)
    }
}

/// All vertices that another sub-domain may also have, as (id, place in `parts`, local).
pub(super) fn candidates(
    store: &mut Catalog,
    parts: &[(u32, u64)],
    dir: &Path,
    memory: usize,
) -> Result<Sorted<16>> {
    let mut sorter = Sorter::new(dir, memory as u64 / 4);
    for (p, &(rank, _)) in (0u32..).zip(parts) {
        let mut part = store.open_subdomain(rank, memory / 4)?;
        let own = SubdomainId::new(rank).map(Owner::Subdomain);
        for (local, vertex) in (0u32..).zip(part.vertices()) {
            let id = vertex?.id;
            if VertexId::from_number(id).map(|v| v.owner) == own {
                continue;
            }
            let mut record = [0; 16];
            record[..8].copy_from_slice(&id.to_be_bytes());
            record[8..12].copy_from_slice(&p.to_be_bytes());
            record[12..].copy_from_slice(&local.to_be_bytes());
            sorter.push(record)?;
        }
    }
    Ok(sorter.finish()?)
}

fn place(part_and_local: &[u8], group: u64, shared: u8) -> [u8; 17] {
    let mut record = [0; 17];
    record[..8].copy_from_slice(part_and_local);
    record[8..16].copy_from_slice(&group.to_be_bytes());
    record[16] = shared;
    record
}

/// Carries each group's number to the parts that share it, and writes the tables one after the other.
fn carry(groups: Sorted<17>, dir: &Path, memory: usize, table: &Path) -> Result<()> {
    let mut sorter = Sorter::<16>::new(dir, memory as u64 / 4);
    let mut number = [0; 8];
    for record in groups {
        let record = record?;
        if record[8] == 0 {
            number.copy_from_slice(&record[9..]);
            continue;
        }
        let mut out = [0; 16];
        out[..8].copy_from_slice(&record[9..]);
        out[8..].copy_from_slice(&number);
        sorter.push(out)?;
    }
    let mut stream = scratch(table)?;
    for record in sorter.finish()? {
        stream.bytes(&record?[4..]);
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
