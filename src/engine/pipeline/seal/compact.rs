//! Seals a finished mesh: renumbers it so that what is near in space is near in the file, drops neighbors and compresses.
//!
//! Every stage is a stream or an external sort, so a mesh of any size passes through a small lease:
//! 1. vertices get their numbers brick by brick; those of a mesh in pages are sorted along the Hilbert curve (a scratch map holds old → new);
//! 2. tetrahedra come sorted by their new numbers, smallest vertex first;
//! 3. their required faces are sorted by vertices and joined with the facets, which gives each facet its tetrahedra.

use tetdb_schema::ids::{Owner, SubdomainId, VertexId};
use tetdb_schema::page::{NONE, RECORDS};
use tetdb_schema::record::{InterfaceFace, SealedFacet, SealedTet, SealedVertex, tag};
use tetdb_schema::unsealed::TetLinks;

use super::neighbors::Neighbors;
use super::records::{InputFace, RequiredTetFace, TetRecord};
use super::target::SealTarget;
use crate::pipeline::error::PipelineError;
use crate::pipeline::progress::{Event, Watcher};
use tetdb_base::geom::HilbertFrame;
use tetdb_base::storage::{
    KeyedId, Pages, SortRecord, Sorted, Sorter, StorageError, check_cancelled, kind, spare_threads,
};
use tetdb_kernel::blocks::{Finished, FinishedTet, FinishedVertex};
use tetdb_kernel::mesh::anatomy::FACES;
use tetdb_kernel::mesh::{Mesh, Scan, VertexTag, dense, scan_parts, sparse, tets_of_page};
use tetdb_store::sealed::{Form, Sealed, SealedWriter, sorted_face};

/// Bytes that a writer holds beside its share of the buffers, however small that is: tables of faces, chunks being packed. Pages make room.
const WRITER_BYTES: u64 = 12 << 20;

/// Writes `mesh`, or `finished` in its place with its facets, to `target`. The order and the numbers are the same in every storage form.
///
/// Invariant: `tet_of` is right for all vertices of a mesh in pages. Effects: the mesh's scratch map is overwritten and cleared.
pub fn seal<P: Pages>(
    mesh: &mut Mesh<P>,
    finished: Option<Finished>,
    target: &SealTarget,
    watch: &Watcher,
) -> Result<Sealed, PipelineError> {
    let mut writer = SealedWriter::create_as(
        target.form,
        target.path,
        target.subdomain,
        target.generation,
        (target.memory / 2) as usize,
    )?;
    let faces = match finished {
        Some(finished) => seal_bricks(mesh, &finished, target, &mut writer, watch)?,
        None => seal_pages(mesh, target, &mut writer, watch)?,
    };
    facets(mesh, faces, target, &mut writer)?;
    mesh.clear_scratch();
    mesh.pages_mut().use_at_most(u64::MAX);
    Ok(writer.finish()?)
}

/// Writes the vertices and tetrahedra of a mesh in bricks; returns the required faces. `mesh` has the rest.
fn seal_bricks<P: Pages>(
    mesh: &mut Mesh<P>,
    finished: &Finished,
    target: &SealTarget,
    writer: &mut SealedWriter,
    watch: &Watcher,
) -> Result<Sorted<RequiredTetFace>, PipelineError> {
    finished.make_room(WRITER_BYTES);
    let (frame, mut local) = (HilbertFrame::new(&target.bounds), 0);
    finished.number(mesh, &frame, vertices_at_once(target), &mut |some| {
        report_progress(watch, "seal vertices", u64::from(local), finished.n_vertices());
        let records = (local..).zip(some).map(|(n, v)| record(v, n, target.subdomain));
        writer.push_vertices(&records.collect::<Vec<_>>())?;
        local += some.len() as u32;
        Ok::<_, PipelineError>(())
    })?;
    let order = || finished.tets().map(|tet| Ok(record_of(tet)));
    let mut neighbors = match target.form {
        Form::Packed => None,
        Form::Pages => Some(Neighbors::of(order(), target)?),
    };
    tets(order(), finished.n_tets(), &mut neighbors, target, writer, watch)
}

/// The same for a mesh in pages.
fn seal_pages<P: Pages>(
    mesh: &mut Mesh<P>,
    target: &SealTarget,
    writer: &mut SealedWriter,
    watch: &Watcher,
) -> Result<Sorted<RequiredTetFace>, PipelineError> {
    if let Some([_, most]) = mesh.pages().bytes_used() {
        mesh.pages_mut().use_at_most(most.saturating_sub(WRITER_BYTES).max(most / 2));
    }
    mesh.clear_scratch();
    vertices(mesh, target, writer, watch)?;
    let mut neighbors = match target.form {
        Form::Packed => None,
        Form::Pages => Some(Neighbors::of(sort_tets(mesh, target)?, target)?),
    };
    let order = sort_tets(mesh, target)?;
    tets(order, u64::from(mesh.n_tets()), &mut neighbors, target, writer, watch)
}

fn report_progress(watch: &Watcher, stage: &'static str, done: u64, total: u64) {
    check_cancelled();
    watch(Event { stage, done, total: Some(total), unit: "records" });
}

fn vertices<P: Pages>(
    mesh: &mut Mesh<P>,
    target: &SealTarget,
    writer: &mut SealedWriter,
    watch: &Watcher,
) -> Result<(), PipelineError> {
    let frame = HilbertFrame::new(&target.bounds);
    let mut sorter = Sorter::<KeyedId>::new(target.scratch, target.memory / 4);
    let ids: Vec<u32> = mesh.vertex_ids().step_by(IDS).collect();
    for batch in ids.chunks(BATCH) {
        for keys in scan_parts(mesh, batch, &Keys(frame)) {
            sorter.extend(&keys)?;
        }
    }
    let (mut order, mut local) = (sorter.finish()?, 0);
    let at_once = vertices_at_once(target);
    loop {
        let ids = order.by_ref().take(at_once).map(|record| Ok::<_, StorageError>(record?.id));
        let ids: Vec<u32> = ids.collect::<Result<_, _>>()?;
        if ids.is_empty() {
            return Ok(());
        }
        report_progress(watch, "seal vertices", u64::from(local), u64::from(mesh.n_vertices()));
        let scan = Vertices { ids: &ids, first: local, subdomain: target.subdomain };
        let parts: Vec<u32> = (0..ids.len().div_ceil(IDS) as u32).collect();
        writer.push_vertices(&scan_parts(mesh, &parts, &scan).concat())?;
        for v in ids {
            mesh.set_scratch(dense(v), local);
            local += 1;
        }
    }
}

/// Vertices written at once: with memory for it each thread has a batch to pack.
fn vertices_at_once(target: &SealTarget) -> usize {
    let batch_bytes = (IDS * BATCH * size_of::<SealedVertex>()) as u64;
    let n_batches = (target.memory / 16 / batch_bytes).clamp(1, spare_threads() as u64);
    IDS * BATCH * n_batches as usize
}

/// Vertices scanned as one part.
const IDS: usize = 1024;

/// Scan that returns the keys of the vertices from one on.
struct Keys(HilbertFrame);

impl Scan for Keys {
    type Part = u32;
    type Output = Vec<<KeyedId as SortRecord>::Bytes>;

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, &first: &u32) -> Self::Output {
        let mut keys = Vec::with_capacity(IDS);
        let ids = (dense(first)..dense(mesh.vertex_ids_end())).take(IDS).map(sparse);
        for v in ids {
            // A surface vertex between two empty regions has no tetrahedron, but its facets are still written.
            if mesh.tet_of(v) == NONE && mesh.vertex_attribute(v).0 != VertexTag::Surface {
                continue;
            }
            let key = self.0.index(mesh.point(v));
            keys.push(KeyedId { key, id: v }.to_bytes());
        }
        keys
    }
}

/// Scan that returns the records of vertices with these ids, `IDS` at a time; `first` is the new number of the first.
struct Vertices<'a> {
    ids: &'a [u32],
    first: u32,
    subdomain: SubdomainId,
}

impl Scan for Vertices<'_> {
    type Part = u32;
    type Output = Vec<SealedVertex>;

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, &part: &u32) -> Vec<SealedVertex> {
        let ids = self.ids.iter().zip(self.first..).skip(part as usize * IDS).take(IDS);
        ids.map(|(&v, local)| record(&FinishedVertex::of(mesh, v), local, self.subdomain)).collect()
    }
}

/// The record of a vertex that is number `local`.
fn record(vertex: &FinishedVertex, local: u32, subdomain: SubdomainId) -> SealedVertex {
    let (cut, index) = vertex.owner;
    let (tag, id) = match vertex.tag {
        VertexTag::Surface => (tag::SURFACE, VertexId { owner: Owner::Surface, index }.number()),
        VertexTag::Interface => {
            (tag::INTERFACE, VertexId { owner: Owner::Cut(cut), index }.number())
        }
        VertexTag::Steiner => (tag::STEINER, SealedVertex::own_id(subdomain, local)),
        _ => (tag::FREE, SealedVertex::own_id(subdomain, local)),
    };
    SealedVertex { point: vertex.point.to_array(), h: vertex.h, tag, id }
}

/// Parts scanned before their records go on: 4 MB of tetrahedra.
const BATCH: usize = 64;

fn sort_tets<P: Pages>(
    mesh: &mut Mesh<P>,
    target: &SealTarget,
) -> Result<Sorted<TetRecord>, PipelineError> {
    let mut sorter = Sorter::<TetRecord>::new(target.scratch, target.memory / 4);
    let pages: Vec<u32> = (0..mesh.pages().n_pages::<{ kind::TETS }>()).collect();
    for batch in pages.chunks(BATCH) {
        check_cancelled();
        for records in scan_parts(mesh, batch, &Records) {
            sorter.extend(&records)?;
        }
    }
    Ok(sorter.finish()?)
}

fn record_of(FinishedTet { tet, flags, required }: FinishedTet) -> TetRecord {
    TetRecord { nodes: tet.nodes, region: tet.region, flags, required }
}

/// Scan that returns the tetrahedra of a page under their new numbers.
struct Records;

impl Scan for Records {
    type Part = u32;
    type Output = Vec<<TetRecord as SortRecord>::Bytes>;

    fn scan<P: Pages>(&self, mesh: &mut Mesh<P>, &page: &u32) -> Self::Output {
        let mut records = Vec::with_capacity(RECORDS);
        tets_of_page(mesh, page, |mesh, t, tet| {
            let mut nodes = [0; 4];
            for (i, node) in nodes.iter_mut().enumerate() {
                *node = mesh.scratch(dense(tet.vertex(i)));
            }
            let record = record_of(FinishedTet::new(&tet, nodes, mesh.tet_attribute(t)));
            records.push(record.to_bytes());
        });
        records
    }
}

fn tets(
    order: impl Iterator<Item = Result<TetRecord, StorageError>> + Send,
    n_tets: u64,
    neighbors: &mut Option<Neighbors>,
    target: &SealTarget,
    writer: &mut SealedWriter,
    watch: &Watcher,
) -> Result<Sorted<RequiredTetFace>, PipelineError> {
    let mut faces = Sorter::new(target.scratch, target.memory / 4);
    let (mut order, mut done) = ((0..).zip(order).peekable(), 0);
    while order.peek().is_some() {
        let mut placed = (order.by_ref()).map(|(t, record): (u32, _)| {
            let record: TetRecord = record?;
            done = u64::from(t) + 1;
            for i in (0..4).filter(|i| record.required >> i & 1 != 0) {
                let (vertices, odd) = sorted_face(FACES[i].map(|k| record.nodes[k]));
                faces.push(RequiredTetFace { vertices, tet: t, odd })?;
            }
            let place = TetLinks {
                neighbors: match neighbors {
                    Some(neighbors) => neighbors.next()?,
                    None => [NONE; 4],
                },
                required: record.required,
                flags: record.flags,
            };
            let (nodes, region) = (record.nodes, record.region);
            Ok::<_, PipelineError>((SealedTet { nodes, region }, place))
        });
        writer.push_tets(&mut placed)?;
        report_progress(watch, "seal tetrahedra", done, n_tets);
    }
    Ok(faces.finish()?)
}

/// Joins facets and interface faces with the faces of tetrahedra; all ascend by their sorted vertices.
fn facets<P: Pages>(
    mesh: &mut Mesh<P>,
    faces: Sorted<RequiredTetFace>,
    target: &SealTarget,
    writer: &mut SealedWriter,
) -> Result<(), PipelineError> {
    let mut sorter = Sorter::new(target.scratch, target.memory / 4);
    for n in 0..mesh.n_facets() {
        let vertices = mesh.facet(n).vertices.map(|v| mesh.scratch(dense(v)));
        sorter.push(claim(vertices, n, false))?;
    }
    let n_interface_faces = target.owners.map_or(0, |_| mesh.n_interface_faces());
    for n in 0..n_interface_faces {
        let face = mesh.interface_face(n);
        let vertices = face.vertices.map(|v| mesh.scratch(dense(v)));
        sorter.push(claim(vertices, n, true))?;
    }
    let mut faces = faces.peekable();
    // A face may be both a facet and an interface face, so the tetrahedra read for it are kept for the next record.
    let (mut at, mut sides) = ([0; 3], [NONE; 2]);
    // A wall may be given from both sides, as two facets. Each refers only to the tetrahedron behind it, so both keep their
    // labels.
    let is_pair = |a: &InputFace, b: &InputFace| {
        a.vertices == b.vertices && !a.at_interface && !b.at_interface
    };
    let mut last: Option<InputFace> = None;
    let mut all = sorter.finish()?.peekable();
    while let Some(claim) = all.next() {
        let claim = claim?;
        if claim.vertices != at || sides == [NONE; 2] {
            sides = [NONE; 2];
            at = claim.vertices;
            let is_up_to = |face: &RequiredTetFace| face.vertices <= claim.vertices;
            while let Some(face) = faces.next_if(|f| f.as_ref().map_or(true, is_up_to)) {
                let face = face?;
                if face.vertices == claim.vertices {
                    sides[usize::from(face.odd)] = face.tet;
                }
            }
        }
        // The tetrahedron behind a facet has the face in the facet's orientation, the one in front in the opposite.
        let odd = usize::from(claim.odd);
        let next = all.peek().and_then(|next| next.as_ref().ok());
        let has_twin = [last.as_ref(), next].into_iter().flatten().any(|c| is_pair(c, &claim));
        let front = if has_twin { NONE } else { sides[1 - odd] };
        let tets = [front, sides[odd]];
        if claim.at_interface {
            push_interface_face(mesh, claim.number, tets[1], target, writer)?;
        } else {
            push_facet(mesh, claim.number, tets, writer)?;
        }
        last = Some(claim);
    }
    Ok(())
}

fn claim(vertices: [u32; 3], number: u32, at_interface: bool) -> InputFace {
    let (vertices, odd) = sorted_face(vertices);
    InputFace { vertices, at_interface, number, odd }
}

fn push_facet<P: Pages>(
    mesh: &mut Mesh<P>,
    number: u32,
    tets: [u32; 2],
    writer: &mut SealedWriter,
) -> Result<(), PipelineError> {
    let facet = mesh.facet(number);
    writer.push_facet(SealedFacet {
        vertices: facet.vertices.map(|v| mesh.scratch(dense(v))),
        label: facet.label,
        triangle: facet.input,
        regions: facet.regions,
        tets,
    })?;
    Ok(())
}

fn push_interface_face<P: Pages>(
    mesh: &mut Mesh<P>,
    number: u32,
    tet: u32,
    target: &SealTarget,
    writer: &mut SealedWriter,
) -> Result<(), PipelineError> {
    let face = mesh.interface_face(number);
    let owners = target.owners.and_then(|o| o.get(&face.cut));
    let other = owners.and_then(|o| o.other(face.index));
    let (Some(other), true) = (other, tet != NONE) else {
        panic!(
            "face {} of cut {} has no owner on the other side, or no tetrahedron in sub-domain {}",
            face.index, face.cut, target.subdomain
        );
    };
    writer.push_interface_face(InterfaceFace {
        vertices: face.vertices.map(|v| mesh.scratch(dense(v))),
        cut: face.cut,
        index: face.index,
        other,
        tet,
    })?;
    Ok(())
}
