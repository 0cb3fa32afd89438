//! Last steps of an import: sub-domains sealed one by one, and the catalog's rows.

use std::collections::{BTreeMap, BTreeSet};
use std::iter::Peekable;
use std::time::Instant;

use super::place::{AT_ONCE, Placed};
use super::planes::cut_between;
use super::records::{KeptSide, PartTet, PartVertex, TetSide};
use crate::pipeline::error::PipelineError;
use crate::pipeline::mesh::commit::close;
use crate::pipeline::mesh::owners::topology_row;
use crate::pipeline::progress::{Event, Watcher};
use crate::pipeline::seal::totals::{journal, totals_of};
use crate::pipeline::tree;
use tetdb_base::storage::{
    DiskPath, ScratchSpace, Sorted, SpillVec, SpillVecBuilder, StorageError, check_cancelled,
};
use tetdb_base::surface::Surface;
use tetdb_io::read::RawField;
use tetdb_kernel::topology::NeighborCounts;
use tetdb_schema::blob::{Blob, BlobContent};
use tetdb_schema::catalog::{RegionRow, StoreState};
use tetdb_schema::ids::{Owner, SubdomainId, VertexId};
use tetdb_schema::page::NONE;
use tetdb_schema::record::{InterfaceFace, SealedFacet, SealedTet, SealedVertex, tag};
use tetdb_schema::topology::FaceOwners;
use tetdb_schema::unsealed::TetLinks;
use tetdb_store::sealed::{Form, Sealed, SealedWriter, sorted_face};
use tetdb_store::store::{Catalog, INPUT_TRIANGLES};

/// Generation of the files. No later mesh of a sub-domain has it.
pub const GENERATION: u32 = 1;

/// The numbers that name a face of an interface.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct InCut {
    cut: u32,
    index: u32,
}

const NO_CUT: InCut = InCut { cut: 0, index: 0 };

/// Values of the file, and their order in the store.
pub struct StoreValues {
    /// In the order of the file.
    pub fields: Vec<RawField>,
    /// The vertex and the tetrahedron of the file for each in the order of the sub-domains.
    pub order: [SpillVec<u32>; 2],
}

struct Writing<'a> {
    placed: Placed,
    /// The surface after its triangles were oriented.
    surface: &'a Surface,
    /// Rank of each sub-domain; those without tetrahedra have none.
    n: u32,
    /// The lasting name of each shared vertex that is not on the surface.
    names: SpillVec<u64>,
    in_cut: SpillVec<InCut>,
    local: SpillVec<u32>,
    /// The vertex and tetrahedron of the file for each in the order of the store; empty where the file has no values.
    order: [SpillVecBuilder<u32>; 2],
    space: &'a ScratchSpace,
}

/// Writes a placed mesh into a new store and seals it; returns the values of the file. `surface` is that of the mesh, its triangles turned at most.
///
/// Errors: the disk. Unwinds where a scratch file fails.
pub fn write(
    catalog: &mut Catalog,
    placed: Placed,
    surface: &Surface,
    space: &ScratchSpace,
    watch: &Watcher,
) -> Result<StoreValues, PipelineError> {
    let clock = Instant::now();
    let (n, n_vertices, n_kept) = (placed.n_parts, placed.points.len(), placed.kept.len());
    let mut writing = Writing {
        placed,
        surface,
        n,
        names: space.vec(n_vertices, u64::MAX),
        in_cut: space.vec(n_kept, NO_CUT),
        local: space.vec(n_vertices, NONE),
        order: [(); 2].map(|()| space.builder_within(space.available() / 16)),
        space,
    };
    let vertices = writing.name_vertices()?;
    let (owners, tet_sides) = writing.number_interfaces()?;
    let empty = space.sorter_within(0);
    let order = std::mem::replace(&mut writing.placed.order, empty).finish()?;
    let mut streams = Streams {
        tets: order.peekable(),
        vertices: vertices.peekable(),
        sides: tet_sides.peekable(),
    };
    let (mut sealed, mut labels) = (Vec::new(), BTreeMap::new());
    for rank in 0..n {
        let path = catalog.file_path(rank, GENERATION);
        sealed.push(writing.subdomain(rank, &path, &mut streams, &mut labels, watch)?);
    }
    drop(streams);
    let mut neighbors = NeighborCounts::default();
    for table in owners.values() {
        table.faces.iter().for_each(|&[low, high]| neighbors.add(low, high));
    }
    let Writing { placed, order, .. } = writing;
    commit(catalog, &placed, surface, &sealed, (&owners, &neighbors), labels, clock)?;
    close(catalog, n)?;
    Ok(StoreValues { fields: placed.values.fields, order: order.map(SpillVecBuilder::finish) })
}

fn commit(
    catalog: &mut Catalog,
    placed: &Placed,
    surface: &Surface,
    sealed: &[Sealed],
    (owners, neighbors): (&BTreeMap<u32, FaceOwners>, &NeighborCounts),
    mut labels: BTreeMap<u32, BTreeSet<u32>>,
    clock: Instant,
) -> Result<(), PipelineError> {
    let last = placed.regions.last().map_or(0, |region| region.0);
    let mut names = vec![String::new(); last as usize];
    placed.regions.iter().for_each(|(number, name)| names[*number as usize - 1].clone_from(name));
    let region = |region: u32| RegionRow {
        region,
        volume: 0.0,
        tets: 0,
        filled: placed.regions.binary_search_by_key(&region, |r| r.0).is_ok(),
        labels: labels.remove(&region).unwrap_or_default().into_iter().collect(),
    };
    let regions: Vec<RegionRow> = (1..=last).map(region).collect();
    let tets: u64 = sealed.iter().map(|part| part.row.tets).sum();
    catalog.commit(|step| {
        for part in sealed {
            let rank = part.row.rank;
            step.list_file(rank, GENERATION);
            step.set_subdomain(&part.row);
            step.set_blob(Blob::Totals(rank), &totals_of(part).to_bytes());
            step.set_topology(&topology_row(neighbors, rank));
        }
        for (&cut, table) in owners {
            step.set_blob(Blob::FaceOwners(cut), &table.to_bytes());
        }
        step.set_labels(&surface.label_names);
        if !surface.label_sets.is_empty() {
            step.set_label_sets(&surface.label_sets);
        }
        step.set_regions(&regions);
        if names.iter().any(|name| !name.is_empty()) {
            step.set_region_names(&names);
        }
        step.set_blob(Blob::Bounds, &tree::corners(&placed.bounds).to_bytes());
        step.set_blob(Blob::SubdomainCount, &(sealed.len() as u32).to_le_bytes());
        step.set_state(StoreState::Bisected);
        let measures =
            [(INPUT_TRIANGLES, surface.n_triangles() as f64), ("imported_tets", tets as f64)];
        step.append_journal(&journal(StoreState::Bisected, "import", clock, &measures));
        Ok(())
    })?;
    Ok(())
}

/// Sorted records of all sub-domains, each read up to its last record.
struct Streams {
    tets: Peekable<Sorted<PartTet>>,
    vertices: Peekable<Sorted<PartVertex>>,
    sides: Peekable<Sorted<TetSide>>,
}

impl Writing<'_> {
    /// Names the vertices of several sub-domains, and sorts all vertices by sub-domain.
    fn name_vertices(&mut self) -> Result<Sorted<PartVertex>, PipelineError> {
        let mut all = self.space.sorter_within(self.space.cap() / 8);
        let empty = self.space.sorter_within(0);
        let mut shared = std::mem::replace(&mut self.placed.shared, empty).finish()?.peekable();
        let mut counts: BTreeMap<u32, u32> = BTreeMap::new();
        for vertex in 0..self.placed.points.len() as u32 {
            let first = self.placed.first_part.get(vertex as usize);
            all.push(PartVertex { part: first, vertex })?;
            let mut ends = [first; 2];
            let mut last = first;
            let is_here = |s: &Result<super::records::SharedVertex, StorageError>| {
                s.as_ref().map_or(true, |s| s.vertex == vertex)
            };
            while let Some(side) = shared.next_if(is_here) {
                let part = side?.part;
                if part != last {
                    all.push(PartVertex { part, vertex })?;
                    ends = [ends[0].min(part), ends[1].max(part)];
                }
                last = part;
            }
            if ends[0] < ends[1] && self.placed.on_surface.get(vertex as usize) == NONE {
                let cut = cut_between(self.n, ends[0], ends[1]);
                let index = counts.entry(cut).or_default();
                let id = VertexId { owner: Owner::Cut(cut), index: *index };
                self.names.set(vertex as usize, id.number());
                *index += 1;
            }
        }
        Ok(all.finish()?)
    }

    /// Numbers the faces between sub-domains; sorts the tetrahedra at kept faces as all tetrahedra are sorted.
    fn number_interfaces(
        &mut self,
    ) -> Result<(BTreeMap<u32, FaceOwners>, Sorted<TetSide>), PipelineError> {
        let mut owners: BTreeMap<u32, FaceOwners> = BTreeMap::new();
        let mut sides = self.space.sorter_within(self.space.cap() / 8);
        for k in 0..self.placed.kept.len() {
            let [_, _, _, behind, front, _] = self.placed.kept.get(k);
            let mut parts = [NONE; 2];
            for ((tet, is_behind), part) in
                [(front, false), (behind, true)].into_iter().zip(&mut parts)
            {
                if tet == NONE {
                    continue;
                }
                let [a, b, c, d, region, rank] = self.placed.tets.get(tet as usize);
                *part = rank;
                let nodes = SealedTet { nodes: [a, b, c, d], region }.rotated().nodes;
                sides.push(TetSide { part: rank, nodes, kept: k as u32, behind: is_behind })?;
            }
            let [a, b] = parts;
            if a != NONE && a != b {
                let cut = cut_between(self.n, a, b);
                let faces = &mut owners.entry(cut).or_default().faces;
                self.in_cut.set(k, InCut { cut, index: faces.len() as u32 });
                faces.push([a.min(b), a.max(b)]);
            }
        }
        Ok((owners, sides.finish()?))
    }

    fn subdomain(
        &mut self,
        rank: u32,
        path: &DiskPath,
        streams: &mut Streams,
        labels: &mut BTreeMap<u32, BTreeSet<u32>>,
        watch: &Watcher,
    ) -> Result<Sealed, PipelineError> {
        let id = SubdomainId::new(rank).expect("fewer parts than ranks");
        let memory = (self.space.cap() / 2) as usize;
        let mut writer = SealedWriter::create_as(Form::Packed, path, id, GENERATION, memory)?;
        self.vertices(id, &mut streams.vertices, &mut writer)?;
        let mut kept = self.space.sorter_within(self.space.cap() / 8);
        let has_values = !self.placed.values.fields.is_empty();
        let (mut done, is_here) =
            (0u32, |t: &Result<PartTet, StorageError>| t.as_ref().map_or(true, |t| t.part == rank));
        loop {
            let from = done;
            check_cancelled();
            watch(Event {
                stage: "seal tetrahedra",
                done: done.into(),
                total: None,
                unit: "records",
            });
            let (local, sides, tets) = (&mut self.local, &mut streams.sides, &mut streams.tets);
            let order = &mut self.order[1];
            let mut some = std::iter::from_fn(|| tets.next_if(is_here)).take(AT_ONCE).map(|tet| {
                let tet: PartTet = tet?;
                let nodes = tet.nodes.map(|v| local.get(v as usize));
                let is_side = |s: &Result<TetSide, StorageError>| {
                    s.as_ref().map_or(true, |s| (s.part, s.nodes) == (rank, tet.nodes))
                };
                while let Some(side) = sides.next_if(is_side) {
                    let TetSide { kept: number, behind, .. } = side?;
                    let vertices = self.placed.kept.get(number as usize);
                    let (face, _) = sorted_face([0, 1, 2].map(|i| local.get(vertices[i] as usize)));
                    kept.push(KeptSide { face, kept: number, behind, tet: done })?;
                }
                if has_values {
                    order.push(tet.tet);
                }
                done += 1;
                let place = TetLinks { neighbors: [NONE; 4], required: 0, flags: 0 };
                Ok::<_, PipelineError>((SealedTet { nodes, region: tet.region }, place))
            });
            writer.push_tets(&mut some)?;
            if done == from {
                break;
            }
        }
        if done == 0 {
            return Err(PipelineError::EmptyPart { cut: rank });
        }
        self.faces(rank, kept.finish()?, &mut writer, labels)?;
        Ok(writer.finish()?)
    }

    fn vertices(
        &mut self,
        rank: SubdomainId,
        all: &mut Peekable<Sorted<PartVertex>>,
        writer: &mut SealedWriter,
    ) -> Result<(), PipelineError> {
        let is_here = |v: &Result<PartVertex, StorageError>| {
            v.as_ref().map_or(true, |v| v.part == rank.rank())
        };
        let (mut local, mut last) = (0, NONE);
        while let Some(vertex) = all.next_if(is_here) {
            let v = vertex?.vertex;
            if v == last {
                continue;
            }
            last = v;
            self.local.set(v as usize, local);
            let (surface, name) =
                (self.placed.on_surface.get(v as usize), self.names.get(v as usize));
            let (tag, id) = match (surface, name) {
                (NONE, u64::MAX) => (tag::FREE, SealedVertex::own_id(rank, local)),
                (NONE, name) => (tag::INTERFACE, name),
                (index, _) => (tag::SURFACE, VertexId { owner: Owner::Surface, index }.number()),
            };
            let point = self.placed.points.get(v as usize);
            writer.push_vertex(SealedVertex { point, h: 0.0, tag, id })?;
            if !self.placed.values.fields.is_empty() {
                self.order[0].push(self.placed.values.vertices.get(v as usize));
            }
            local += 1;
        }
        Ok(())
    }

    fn faces(
        &mut self,
        rank: u32,
        sides: Sorted<KeptSide>,
        writer: &mut SealedWriter,
        labels: &mut BTreeMap<u32, BTreeSet<u32>>,
    ) -> Result<(), PipelineError> {
        let mut sides = sides.peekable();
        while let Some(first) = sides.next() {
            let first = first?;
            let is_same = |s: &Result<KeptSide, StorageError>| {
                s.as_ref().map_or(true, |s| s.kept == first.kept)
            };
            let mut tets = [NONE; 2];
            let mut next = Some(first);
            while let Some(side) = next {
                tets[usize::from(side.behind)] = side.tet;
                next = sides.next_if(is_same).transpose()?;
            }
            let number = first.kept as usize;
            let [a, b, c, behind, front, triangle] = self.placed.kept.get(number);
            let vertices = [a, b, c].map(|v| self.local.get(v as usize));
            if triangle != NONE {
                let region = |tet: u32, placed: &mut Placed| match tet {
                    NONE => 0,
                    tet => placed.tets.get(tet as usize)[4],
                };
                let regions = [front, behind].map(|tet| region(tet, &mut self.placed));
                let label = self.surface.labels[triangle as usize];
                for region in regions {
                    labels.entry(region).or_default().insert(label);
                }
                let [x, y, z] = [a, b, c].map(|v| self.placed.on_surface.get(v as usize));
                let now = self.surface.triangles[triangle as usize];
                let is_turned = ![[x, y, z], [y, z, x], [z, x, y]].contains(&now);
                let mut facet =
                    SealedFacet { vertices, label, triangle: triangle.into(), regions, tets };
                if is_turned {
                    facet.vertices.swap(1, 2);
                    facet.regions.swap(0, 1);
                    facet.tets.swap(0, 1);
                }
                writer.push_facet(facet)?;
            }
            let InCut { cut, index } = self.in_cut.get(number);
            if cut != 0 {
                let is_behind = tets[1] != NONE;
                let (own, beyond) = if is_behind { (tets[1], front) } else { (tets[0], behind) };
                let mut face = InterfaceFace {
                    vertices,
                    cut,
                    index,
                    other: self.placed.tets.get(beyond as usize)[5],
                    tet: own,
                };
                if !is_behind {
                    face.vertices.swap(1, 2);
                }
                debug_assert_ne!(face.other, rank);
                writer.push_interface_face(face)?;
            }
        }
        Ok(())
    }
}
