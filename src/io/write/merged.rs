//! Sub-domains of a store as one mesh, streamed.

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use tetdb_schema::ids::TetId;
use tetdb_schema::record::SealedVertex;

use super::error::{Result, WriteError};
use super::faces::{FaceSorter, FaceSource, Faces};
use super::numbering::{Numbering, PartNumbers, Sharer, candidates, sharers};
use crate::sealed::SealedError;
use crate::sealed::{Shape, Subdomain};
use crate::storage::{Sorted, check_cancelled};
use crate::store::{Catalog, StoreError};
use tetdb_schema::catalog::SubdomainRow;

/// Counts records and tells.
pub(super) struct Progress<'a> {
    report: &'a dyn Fn(u64, u64),
    done: Cell<u64>,
    total: Cell<u64>,
}

impl<'a> Progress<'a> {
    pub fn new(report: &'a dyn Fn(u64, u64)) -> Self {
        let (done, total) = (Cell::new(0), Cell::new(0));
        Self {
            report,
            done,
            total,
        }
    }

    /// Counts `n` more records; the place where a request to stop is heard.
    fn advance(&self, n: usize) {
        check_cancelled();
        let done = self.done.get() + n as u64;
        self.done.set(done);
        (self.report)(done, self.total.get().max(done));
    }
}

/// A tetrahedron of the merged mesh.
pub(super) struct Tet {
    /// Numbers of its vertices; positive volume in this order.
    pub nodes: [u64; 4],
    pub region: u32,
    pub subdomain: u32,
    /// Its name for ever.
    pub id: TetId,
    /// NaN in a pass that does not ask for it.
    pub quality: f64,
}

/// Which faces bound what is written, beside those that it shares with sub-domains that are not written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FaceSet {
    /// Input triangles.
    Skin,
    /// Input triangles and all interface faces.
    SkinAndInterfaces,
    /// All interface faces, no input triangle.
    Interfaces,
}

/// What is written: these sub-domains, or all when there are none, with these faces.
#[derive(Clone, Copy)]
pub(super) struct Scope<'s> {
    pub ranks: &'s BTreeSet<u32>,
    pub faces: FaceSet,
    /// Each sub-domain numbers all its vertices, also those it shares.
    pub apart: bool,
}

/// A sub-domain in the merged mesh.
#[derive(Clone, Copy)]
pub(super) struct Part {
    pub rank: u32,
    /// Number of the first vertex that it numbers.
    pub first_vertex: u64,
    /// Vertices that it has.
    pub n_vertices: u64,
    pub n_tets: u64,
}

/// A sub-domain being read, and its numbers in the merged mesh.
pub(super) struct Opened {
    pub part: Subdomain,
    pub numbers: PartNumbers,
    /// Number of its first tetrahedron.
    pub first_tet: u64,
}

impl Scope<'_> {
    fn holds(&self, rank: u32) -> bool {
        self.ranks.is_empty() || self.ranks.contains(&rank)
    }

    /// Whether the face between sub-domain `rank`, which is written, and `other` is listed, and by this side.
    fn lists(&self, rank: u32, other: u32) -> bool {
        !self.holds(other) || (self.faces != FaceSet::Skin && rank < other)
    }
}

/// Sub-domains of a finished store as one conforming mesh.
///
/// Shape: `parts` by rank. Each pass reads every chunk once and holds a quarter of the memory.
pub(super) struct Merged<'a> {
    store: &'a mut Catalog,
    parts: Vec<SubdomainRow>,
    numbering: Numbering,
    faces: Faces,
    label_names: Vec<String>,
    region_names: Vec<String>,
    dir: PathBuf,
    memory: usize,
    progress: Progress<'a>,
}

impl<'a> Merged<'a> {
    /// Numbers the vertices and sorts the boundary faces, with scratch in `dir`.
    ///
    /// Errors: a store that is not finished, damage, the disk.
    pub fn open(
        store: &'a mut Catalog,
        scope: Scope,
        dir: &Path,
        memory: usize,
        progress: Progress<'a>,
    ) -> Result<Self> {
        let catalog = &mut *store;
        let mut parts = catalog.subdomains()?;
        parts.retain(|row| scope.holds(row.rank));
        let (label_names, region_names) = (catalog.labels()?, catalog.region_names()?);
        let counts: Vec<_> = parts.iter().map(|row| (row.rank, row.vertices)).collect();
        let numbering = Numbering::new(store, &counts, scope.apart, dir, memory)?;
        let first_label = label_names.len() as u32;
        let mut sorter = FaceSorter::new(dir, memory as u64 / 4);
        let mut tet_first = 0;
        for (p, row) in parts.iter().enumerate() {
            let numbers = numbering.part(p)?;
            let part = FaceSource {
                rank: row.rank,
                numbers: &numbers,
                tet_first,
            };
            let mut from = store.open_subdomain(row.rank, memory / 4)?;
            collect_faces(&mut from, &part, scope, first_label, &mut sorter)?;
            tet_first += row.tets;
        }
        let faces = sorter.finish()?;
        Ok(Self {
            store,
            parts,
            numbering,
            faces,
            label_names,
            region_names,
            dir: dir.to_owned(),
            memory,
            progress,
        })
    }

    pub fn n_vertices(&self) -> u64 {
        self.numbering.n_vertices()
    }

    /// The sub-domains, by rank.
    pub fn parts(&self) -> Vec<Part> {
        let part = |(p, row): (usize, &SubdomainRow)| Part {
            rank: row.rank,
            first_vertex: self.numbering.first(p),
            n_vertices: row.vertices,
            n_tets: row.tets,
        };
        self.parts.iter().enumerate().map(part).collect()
    }

    /// Sub-domain `p`, to be read as it is. Errors: damage, the disk.
    pub fn open_part(&mut self, p: usize) -> Result<Opened> {
        let (numbers, first_tet) = self.numbers_of(p)?;
        let rank = self.parts[p].rank;
        Ok(Opened {
            part: self.store.open_subdomain(rank, self.memory / 4)?,
            numbers,
            first_tet,
        })
    }

    /// Numbers of the vertices of sub-domain `p`, and of its first tetrahedron. Errors: the disk.
    pub fn numbers_of(&self, p: usize) -> Result<(PartNumbers, u64)> {
        let before: u64 = self.parts[..p].iter().map(|row| row.tets).sum();
        Ok((self.numbering.part(p)?, before))
    }

    /// Every vertex that several sub-domains have, by the places of these. Errors: damage, the disk.
    pub fn sharers(&mut self) -> Result<Sorted<Sharer>> {
        let counts: Vec<_> = self.parts.iter().map(|r| (r.rank, r.vertices)).collect();
        let by_id = candidates(self.store, &counts, &self.dir, self.memory)?;
        sharers(by_id, &self.dir, self.sorter_bytes())
    }

    /// Numbers of the filled regions, ascending. Errors: damage.
    pub fn filled_regions(&mut self) -> Result<Vec<u32>> {
        let rows = self.store.regions()?;
        Ok((rows.iter().filter(|r| r.filled))
            .map(|r| r.region)
            .collect())
    }

    /// How many labels the input has.
    pub fn n_labels(&self) -> u32 {
        self.label_names.len() as u32
    }

    /// The name of a label; one that the input has not stands for the interface to a sub-domain.
    pub fn label_name(&self, label: u32) -> String {
        match self.label_names.get(label as usize) {
            Some(name) => name.clone(),
            None => format!("interface_{}", label - self.n_labels()),
        }
    }

    /// What a region is called: its own name, or one after its number.
    pub fn region_name(&self, region: u32) -> String {
        let place = (region as usize).checked_sub(1);
        match place.and_then(|place| self.region_names.get(place)) {
            Some(name) if !name.is_empty() => name.clone(),
            _ => format!("region_{region}"),
        }
    }

    /// Names of regions 0 (none), 1, 2, …, a zero after each; nothing when no region has one.
    pub fn region_names(&self) -> Vec<u8> {
        match self.region_names.len() as u32 {
            0 => Vec::new(),
            n => {
                let name = |region| self.region_name(region).into_bytes().into_iter().chain([0]);
                [0].into_iter().chain((1..=n).flat_map(name)).collect()
            }
        }
    }

    /// Counts records that were read past the passes, for progress.
    pub fn advance(&self, n: usize) {
        self.progress.advance(n);
    }

    /// Refuses a mesh that has not what its records announced.
    pub fn expect_count(&self, what: &str, expected: u64, found: u64) -> Result<()> {
        if expected == found {
            return Ok(());
        }
        Err(StoreError::Sealed(SealedError::Content {
            path: self.store.dir().to_owned(),
            subdomain: self.parts.first().map_or(0, |row| row.rank),
            what: format!("{found} {what} where {expected} were expected"),
        })
        .into())
    }

    /// Number of sub-domains.
    pub fn n_parts(&self) -> usize {
        self.parts.len()
    }

    pub fn n_tets(&self) -> u64 {
        self.parts.iter().map(|row| row.tets).sum()
    }

    pub fn n_faces(&self) -> u64 {
        self.faces.n
    }

    pub fn faces(&self) -> &Faces {
        &self.faces
    }

    /// The folder for scratch.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// Bytes for a sorter beside a pass.
    pub fn sorter_bytes(&self) -> u64 {
        self.memory as u64 / 4
    }

    /// Names of the labels the faces have, ascending by label.
    pub fn labels(&self) -> BTreeMap<u32, String> {
        let name = |&label: &u32| (label, self.label_name(label));
        self.faces.labels.keys().map(name).collect()
    }

    /// Announces how many passes will come, for progress.
    pub fn expect_passes(&self, vertices: u64, tets: u64) {
        let v: u64 = self.parts.iter().map(|row| row.vertices).sum();
        let total = vertices * v + tets * self.n_tets();
        self.progress.total.set(total);
    }

    /// Tells that all is done.
    pub fn report_end(&self) {
        let total = self.progress.total.get().max(self.progress.done.get());
        (self.progress.report)(total, total);
    }

    /// Refuses what does not fit the format's numbers.
    pub fn check_limits(&self, out: &Path, limit: u64) -> Result<()> {
        let elements = self.n_tets() + self.n_faces();
        for (what, found) in [("vertices", self.n_vertices()), ("elements", elements)] {
            if found > limit {
                let path = out.to_owned();
                return Err(WriteError::TooLarge {
                    path,
                    what,
                    limit,
                    found,
                });
            }
        }
        Ok(())
    }

    /// Every vertex with its number, ascending. Errors: damage, those of `each`.
    pub fn vertices(
        &mut self,
        mut each: impl FnMut(u64, &SealedVertex) -> Result<()>,
    ) -> Result<()> {
        for (p, row) in self.parts.iter().enumerate() {
            let numbers = self.numbering.part(p)?;
            let mut part = self.store.open_subdomain(row.rank, self.memory / 4)?;
            for chunk in part.vertex_chunks() {
                let chunk = chunk?;
                let end = u64::from(chunk.first) + chunk.records.len() as u64;
                if end > row.vertices {
                    return Err(too_many_vertices(self.store, row, end).into());
                }
                for (local, vertex) in (chunk.first..).zip(&chunk.records) {
                    if let Some(number) = numbers.own(local) {
                        each(number, vertex)?;
                    }
                }
                self.progress.advance(chunk.records.len());
            }
        }
        Ok(())
    }

    /// Every tetrahedron in the order of its number. Errors: damage, those of `each`.
    pub fn tets(&mut self, each: impl FnMut(&Tet) -> Result<()>) -> Result<()> {
        self.pass(false, each)
    }

    /// As [`Merged::tets`], with qualities.
    pub fn tets_with_quality(&mut self, each: impl FnMut(&Tet) -> Result<()>) -> Result<()> {
        self.pass(true, each)
    }

    fn pass(&mut self, quality: bool, mut each: impl FnMut(&Tet) -> Result<()>) -> Result<()> {
        for (p, row) in self.parts.iter().enumerate() {
            let numbers = self.numbering.part(p)?;
            let mut part = self.store.open_subdomain(row.rank, self.memory / 4)?;
            let mut expected = 0;
            for chunk in 0..part.tet_summaries().len() {
                let chunk = part.tet_chunk(chunk as u32)?;
                for (local, tet) in (chunk.first..).zip(&chunk.records) {
                    let id = TetId::new(part.id(), local)
                        .filter(|_| local == expected && u64::from(local) < row.tets);
                    let id = id.ok_or_else(|| damaged(&part, local, expected))?;
                    expected += 1;
                    if let Some(&v) = tet.nodes.iter().find(|&&v| u64::from(v) >= row.vertices) {
                        part.corner(v)?;
                    }
                    let quality = if quality {
                        Shape::of(part.corners(tet.nodes)?.map(|c| c.point)).quality
                    } else {
                        f64::NAN
                    };
                    each(&Tet {
                        nodes: tet.nodes.map(|v| numbers.of(v)),
                        region: tet.region,
                        subdomain: row.rank,
                        id,
                        quality,
                    })?;
                }
                self.progress.advance(chunk.records.len());
            }
            if u64::from(expected) != row.tets {
                return Err(damaged(&part, row.tets as u32, expected).into());
            }
        }
        Ok(())
    }

    /// The regions that have tetrahedra; decodes only chunks with several.
    ///
    /// Errors: damage.
    pub fn regions(&mut self) -> Result<BTreeSet<u32>> {
        let mut regions = BTreeSet::new();
        for row in &self.parts {
            let mut part = self.store.open_subdomain(row.rank, self.memory / 4)?;
            for chunk in 0..part.tet_summaries().len() {
                let [least, greatest] = part.tet_summaries()[chunk].regions;
                regions.extend([least, greatest]);
                if greatest.saturating_sub(least) > 1 {
                    let chunk = part.tet_chunk(chunk as u32)?;
                    regions.extend(chunk.records.iter().map(|t| t.region));
                }
            }
        }
        Ok(regions)
    }
}

fn damaged(part: &Subdomain, found: u32, expected: u32) -> StoreError {
    StoreError::Sealed(SealedError::Content {
        path: part.path().to_owned(),
        subdomain: part.id().rank(),
        what: format!("tetrahedron {found} stands where {expected} was expected"),
    })
}

fn too_many_vertices(catalog: &Catalog, row: &SubdomainRow, end: u64) -> StoreError {
    StoreError::Sealed(SealedError::Content {
        path: catalog
            .file_path(row.rank, row.generation)
            .path()
            .to_owned(),
        subdomain: row.rank,
        what: format!(
            "a chunk ends at vertex {end}, the catalog counts {}",
            row.vertices
        ),
    })
}

/// Hands the faces of a sub-domain that `scope` lists to `sorter`; interface faces are labelled by the sub-domain behind
/// them, from `first_label` on.
fn collect_faces(
    from: &mut Subdomain,
    part: &FaceSource,
    scope: Scope,
    first_label: u32,
    sorter: &mut FaceSorter,
) -> Result<()> {
    let n_vertices = from.row().vertices;
    let path = from.path().to_owned();
    let checked = |vertices: [u32; 3]| match vertices.iter().any(|&v| u64::from(v) >= n_vertices) {
        false => Ok(()),
        true => Err(StoreError::Sealed(SealedError::Content {
            path: path.clone(),
            subdomain: part.rank,
            what: format!("a face names vertices {vertices:?}"),
        })),
    };
    if scope.faces != FaceSet::Interfaces {
        for facet in from.facets() {
            let facet = facet?;
            checked(facet.vertices)?;
            sorter.push(&facet, part)?;
        }
    }
    for face in from.interfaces() {
        let face = face?;
        if scope.lists(part.rank, face.other) {
            checked(face.vertices)?;
            sorter.push_interface(&face, first_label + face.other, part)?;
        }
    }
    Ok(())
}
