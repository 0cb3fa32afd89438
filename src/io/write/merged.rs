//! Sub-domains of a store as one mesh, streamed.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::{Path, PathBuf};

use tetdb_schema::field::{FieldPlace, FieldRow};
use tetdb_schema::ids::TetId;
use tetdb_schema::record::SealedVertex;

use super::doubles::Doubles;
use super::embedded::{WrittenEmbedded, memory_left};
use super::error::{Result, WriteError};
use super::faces::{FaceSorter, FaceSource, MergedFace, MergedFaces};
use super::merged_fields::{FieldChunk, fits_doubles, has_values_at, open_fields};
use super::merged_parts::{collect_faces, misplaced, required_faces};
use super::numbering::{
    Numbering, PartNumbers, Sharer, Source, shareable_vertices, sharers, sources,
};
use super::read_progress::ReadProgress;
use super::scope::{FaceSet, Scope};
use tetdb_base::shape::excess_near;
use tetdb_base::storage::Sorted;
use tetdb_schema::catalog::SubdomainRow;
use tetdb_schema::labels::LabelSet;
use tetdb_store::sealed::{SealedError, Shape, Subdomain};
use tetdb_store::store::Catalog;

/// A tetrahedron of the merged mesh.
pub(super) struct MergedTet {
    /// Numbers of its vertices; positive volume in this order.
    pub nodes: [u64; 4],
    pub region: u32,
    pub subdomain: u32,
    /// Lasting id.
    pub id: TetId,
    /// NaN in a pass that does not measure it.
    pub quality: f64,
    /// Quality over the least quality that the tetrahedron's faces on the surface allow; NaN in a pass that does not measure it.
    pub excess: f64,
    /// Words of the values of fields, where these are read.
    pub fields: Vec<u64>,
}

/// Measures of tetrahedra in a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Measured {
    Nothing,
    /// [`MergedTet::quality`].
    Quality,
    /// [`MergedTet::quality`] and [`MergedTet::excess`].
    Excess,
}

/// A sub-domain in the merged mesh.
#[derive(Clone, Copy)]
pub(super) struct Part {
    pub rank: u32,
    /// Number of the first vertex that the sub-domain numbers.
    pub first_vertex: u64,
    /// Vertices of the sub-domain.
    pub n_vertices: u64,
    pub n_tets: u64,
}

/// A sub-domain being read, and its numbers in the merged mesh.
pub(super) struct OpenedPart {
    pub part: Subdomain,
    pub numbers: PartNumbers,
}

/// Sub-domains of a finished store as one conforming mesh.
///
/// Shape: `parts` by rank. Each pass reads every chunk once and holds a quarter of the memory.
pub(super) struct Merged<'a> {
    pub(super) store: &'a mut Catalog,
    parts: Vec<Source>,
    regions: BTreeSet<u32>,
    numbering: Numbering,
    /// Whether the vertices of each sub-domain have numbers of their own.
    pub(super) is_apart: bool,
    faces: MergedFaces,
    doubles: Option<Doubles>,
    embedded: WrittenEmbedded,
    support_first: u64,
    label_names: Vec<String>,
    pub(super) label_sets: Vec<LabelSet>,
    region_names: Vec<String>,
    /// Fields at vertices and at tetrahedra that are read with them.
    fields: [Vec<FieldRow>; 2],
    dir: PathBuf,
    pub(super) memory: usize,
    progress: ReadProgress<'a>,
    /// Sub-domains whose vertices and tetrahedra are read, by place.
    window: Range<usize>,
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
        progress: ReadProgress<'a>,
    ) -> Result<Self> {
        let (label_names, region_names) = (store.labels()?, store.region_names()?);
        let (label_sets, row) = (store.label_sets()?, store.wires()?);
        let memory = memory_left(&row, memory)?;
        let parts = sources(store, scope, dir, memory)?;
        let numbering = Numbering::new(store, &parts, scope.apart, dir, memory)?;
        let first_label = label_names.len() as u32;
        let mut embedded = WrittenEmbedded::gather(store, &row, (&parts, &numbering), memory)?;
        let mut sorter = FaceSorter::new(dir, memory as u64 / 4);
        let with_faces = scope.faces != FaceSet::Nothing;
        for (p, source) in parts.iter().enumerate().filter(|_| with_faces) {
            let numbers = numbering.part(store, &parts, p)?;
            let rank = source.row.rank;
            let mut from = store.open_subdomain(rank, memory / 4)?;
            let part = FaceSource { rank, numbers: &numbers, scope };
            collect_faces(&mut from, &part, [first_label.into(), row.fin_first], &mut sorter)?;
        }
        let faces = sorter.finish()?;
        let is_whole = scope.regions.is_empty() && scope.ranks.is_empty();
        let mut mesh = Self {
            store,
            window: 0..parts.len(),
            parts,
            regions: scope.regions.clone(),
            numbering,
            is_apart: scope.apart,
            faces,
            doubles: None,
            embedded: WrittenEmbedded::default(),
            support_first: row.fin_first,
            label_names,
            label_sets,
            region_names,
            fields: Default::default(),
            dir: dir.to_owned(),
            memory,
            progress,
        };
        if !embedded.edges.is_empty() && !is_whole {
            let mut edges = embedded.edges_to_find();
            mesh.tets(|tet| {
                edges.find(tet.nodes);
                Ok(())
            })?;
            embedded.keep_found(&edges);
        }
        mesh.embedded = embedded;
        Ok(mesh)
    }

    /// The fields at vertices and at tetrahedra that are written: at vertices none where some are doubled, with midpoints only those that
    /// have means; with `as_doubles`, none whose integers no double holds. Errors: damage.
    pub fn fields_read(
        &mut self,
        has_midpoints: bool,
        as_doubles: bool,
    ) -> Result<[Vec<FieldRow>; 2]> {
        let parts = self.store.field_parts()?;
        let mut fields = self.store.fields()?;
        fields.retain(|field| !as_doubles || fits_doubles(field, &parts));
        let (mut vertices, tets): (Vec<_>, _) =
            fields.into_iter().partition(|field| field.place == FieldPlace::Vertices);
        vertices.retain(|field| has_values_at(field, has_midpoints, self.doubles.is_some()));
        Ok([vertices, tets])
    }

    /// As [`Merged::fields_read`], and reads those at tetrahedra with all later passes. Errors: damage.
    pub fn read_fields(
        &mut self,
        has_midpoints: bool,
        as_doubles: bool,
    ) -> Result<[Vec<FieldRow>; 2]> {
        self.fields = self.fields_read(has_midpoints, as_doubles)?;
        Ok(self.fields.clone())
    }

    /// The written embedded edges and points.
    pub fn embedded(&self) -> &WrittenEmbedded {
        &self.embedded
    }

    /// Number of the first support triangle: facets from here on hold embedded edges and are no input triangles.
    pub fn support_first(&self) -> u64 {
        self.support_first
    }

    /// Vertices and their doubles.
    pub fn n_vertices(&self) -> u64 {
        self.numbering.n_vertices() + self.doubles.as_ref().map_or(0, |doubles| doubles.n)
    }

    /// Adds doubles of vertices to all later passes.
    pub fn set_doubles(&mut self, doubles: Doubles) {
        self.doubles = Some(doubles);
    }

    /// Replaces each face by those that `each` puts for it. Errors: the disk, those of `each`.
    pub fn rewrite_faces(
        &mut self,
        each: impl FnMut(&MergedFace, &mut dyn FnMut(&MergedFace) -> Result<()>) -> Result<()>,
    ) -> Result<()> {
        self.faces = self.faces.rewritten(&self.dir.join("split-faces"), each)?;
        Ok(())
    }

    /// The sub-domains, by rank.
    pub fn parts(&self) -> Vec<Part> {
        let part = |(p, source): (usize, &Source)| Part {
            rank: source.row.rank,
            first_vertex: self.numbering.first(p),
            n_vertices: source.n_vertices,
            n_tets: source.n_tets,
        };
        self.parts.iter().enumerate().map(part).collect()
    }

    /// Sub-domain `p`, to be read as it is. Errors: damage, the disk.
    pub fn open_part(&mut self, p: usize) -> Result<OpenedPart> {
        let rank = self.parts[p].row.rank;
        Ok(OpenedPart {
            part: self.store.open_subdomain(rank, self.memory / 4)?,
            numbers: self.numbers_of(p)?,
        })
    }

    /// Numbers of the vertices and tetrahedra of sub-domain `p`. Errors: the disk.
    pub fn numbers_of(&self, p: usize) -> Result<PartNumbers> {
        self.numbering.part(self.store, &self.parts, p)
    }

    /// Every vertex that several sub-domains have, by the places of these. Errors: damage, the disk.
    pub fn sharers(&mut self) -> Result<Sorted<Sharer>> {
        let by_id = shareable_vertices(self.store, &self.parts, &self.dir, self.memory)?;
        sharers(by_id, &self.dir, self.sorter_bytes())
    }

    /// Numbers of the filled regions that are written, ascending. Errors: damage.
    pub fn filled_regions(&mut self) -> Result<Vec<u32>> {
        let rows = self.store.regions()?;
        let filled = rows.iter().filter(|row| row.filled);
        let regions = filled.map(|row| row.region);
        Ok(regions.filter(|region| self.writes(*region)).collect())
    }

    /// Returns whether only some regions are written.
    pub fn is_of_regions(&self) -> bool {
        !self.regions.is_empty()
    }

    /// Returns whether the tetrahedra of a region are written.
    pub fn writes(&self, region: u32) -> bool {
        self.regions.is_empty() || self.regions.contains(&region)
    }

    /// Number of labels of the input.
    pub fn n_labels(&self) -> u32 {
        self.label_names.len() as u32
    }

    /// The name of a label; labels beyond those of the input stand for interfaces to sub-domains.
    pub fn label_name(&self, label: u32) -> String {
        match self.label_names.get(label as usize) {
            Some(name) => name.clone(),
            None => format!("interface_{}", label - self.n_labels()),
        }
    }

    /// The name of a region, or `region_N` where it has none.
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

    /// Counts records that were read outside the passes, for progress.
    pub fn advance(&self, n: usize) {
        self.progress.advance(n);
    }

    /// Refuses a count that differs from the announced one.
    pub fn expect_count(&self, what: &str, expected: u64, found: u64) -> Result<()> {
        if expected == found {
            return Ok(());
        }
        let rank = self.parts.first().map_or(0, |source| source.row.rank);
        let what = format!("{found} {what} where {expected} were expected");
        Err(SealedError::content(self.store.dir(), rank, what).into())
    }

    /// Number of sub-domains.
    pub fn n_parts(&self) -> usize {
        self.parts.len()
    }

    pub fn n_tets(&self) -> u64 {
        self.parts.iter().map(|source| source.n_tets).sum()
    }

    pub fn n_faces(&self) -> u64 {
        self.faces.n
    }

    pub fn faces(&self) -> &MergedFaces {
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

    /// Announces the number of passes, for progress.
    pub fn expect_passes(&self, vertices: u64, tets: u64) {
        let all = |of: fn(&SubdomainRow) -> u64| self.parts.iter().map(|s| of(&s.row)).sum::<u64>();
        let total = vertices * all(|row| row.vertices) + tets * all(|row| row.tets);
        self.progress.total.set(total);
    }

    /// Narrows all later passes to the vertices and tetrahedra of some sub-domains; counts and numbers stay.
    pub fn look_at(&mut self, window: Range<usize>) {
        self.window = window;
    }

    /// Reports that all is done.
    pub fn report_end(&self) {
        let total = self.progress.total.get().max(self.progress.done.get());
        (self.progress.report)(total, total);
    }

    /// Refuses a mesh with more vertices, `n_midpoints` among them, or elements than `limit`.
    pub fn check_limits(&self, out: &Path, limit: u64, n_midpoints: u64) -> Result<()> {
        let elements = self.n_tets() + self.n_faces();
        let vertices = self.n_vertices() + n_midpoints;
        for (what, found) in [("vertices", vertices), ("elements", elements)] {
            if found > limit {
                let path = out.to_owned();
                return Err(WriteError::TooLarge { path, what, limit, found });
            }
        }
        Ok(())
    }

    /// Every vertex with its number, ascending. Errors: damage, those of `each`.
    pub fn vertices(
        &mut self,
        mut each: impl FnMut(u64, &SealedVertex) -> Result<()>,
    ) -> Result<()> {
        self.vertices_with(&[], |number, vertex, _| each(number, vertex))
    }

    /// As [`Merged::vertices`], with the words of the values of fields, one after the other.
    pub fn vertices_with(
        &mut self,
        fields: &[FieldRow],
        mut each: impl FnMut(u64, &SealedVertex, &[u64]) -> Result<()>,
    ) -> Result<()> {
        for p in self.window.clone() {
            let Source { row, .. } = &self.parts[p];
            let numbers = self.numbers_of(p)?;
            let row = row.clone();
            let mut part = self.store.open_subdomain(row.rank, self.memory / 4)?;
            let mut files = open_fields(self.store, fields, &part)?;
            for (c, chunk) in (0..).zip(part.vertex_chunks()) {
                let chunk = chunk?;
                let end = u64::from(chunk.first) + chunk.records.len() as u64;
                if end > row.vertices {
                    let what = format!(
                        "a chunk ends at vertex {end}, the catalog counts {}",
                        row.vertices
                    );
                    return Err(part.damaged(what).into());
                }
                let values = FieldChunk::read(&mut files, c)?;
                for (i, vertex) in chunk.records.iter().enumerate() {
                    if let Some(number) = numbers.own(chunk.first + i as u32) {
                        each(number, vertex, &values.row(i))?;
                    }
                }
                self.progress.advance(chunk.records.len());
            }
        }
        let first = self.numbering.n_vertices();
        match &self.doubles {
            Some(doubles) => {
                doubles.each(|place, double| each(first + place, &double.sealed(), &[]))
            }
            None => Ok(()),
        }
    }

    /// Every tetrahedron in the order of its number. Errors: damage, those of `each`.
    pub fn tets(&mut self, each: impl FnMut(&MergedTet) -> Result<()>) -> Result<()> {
        self.measured_tets(Measured::Nothing, each)
    }

    /// As [`Merged::tets`], measured. Errors: also the disk.
    pub fn measured_tets(
        &mut self,
        measured: Measured,
        mut each: impl FnMut(&MergedTet) -> Result<()>,
    ) -> Result<()> {
        let mut changes = self.doubles.as_ref().map(Doubles::changes).transpose()?;
        for p in self.window.clone() {
            let row = self.parts[p].row.clone();
            let numbers = self.numbers_of(p)?;
            let mut part = self.store.open_subdomain(row.rank, self.memory / 4)?;
            let fields = self.fields[1].clone();
            let mut files = open_fields(self.store, &fields, &part)?;
            let mut on_surface = match measured {
                Measured::Nothing | Measured::Quality => None,
                Measured::Excess => {
                    let memory = self.memory as u64 / 8;
                    Some(required_faces(&mut part, &self.dir, memory)?)
                }
            };
            let mut expected = 0;
            for c in 0..part.tet_summaries().len() {
                let chunk = part.tet_chunk(c as u32)?;
                let values = FieldChunk::read(&mut files, c as u32)?;
                for (local, tet) in (chunk.first..).zip(&chunk.records) {
                    let id = TetId::new(part.id(), local)
                        .filter(|_| local == expected && u64::from(local) < row.tets);
                    let id = id.ok_or_else(|| misplaced(&part, local, expected))?;
                    expected += 1;
                    let Some(number) = numbers.tet(local) else {
                        continue;
                    };
                    let (mut quality, mut excess) = (f64::NAN, f64::NAN);
                    if measured != Measured::Nothing {
                        let points = part.corners(tet.nodes)?.map(|c| c.point);
                        quality = Shape::new(points).quality;
                        if let Some(on_surface) = &mut on_surface {
                            let faces = on_surface.faces_of(local, tet.nodes)?;
                            excess = match faces.contains(&true) {
                                true => excess_near(points, faces),
                                false => quality,
                            };
                        }
                    }
                    let mut nodes = numbers.vertices(tet.nodes)?;
                    if let Some(changes) = &mut changes {
                        changes.apply(number, &mut nodes)?;
                    }
                    each(&MergedTet {
                        nodes,
                        region: tet.region,
                        subdomain: row.rank,
                        id,
                        quality,
                        excess,
                        fields: values.row((local - chunk.first) as usize),
                    })?;
                }
                self.progress.advance(chunk.records.len());
            }
            if u64::from(expected) != row.tets {
                return Err(misplaced(&part, row.tets as u32, expected).into());
            }
        }
        Ok(())
    }
}
