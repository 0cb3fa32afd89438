//! Coarse snapshots for sub-domains of an imported store, which has none: each is meshed from its shell.
//!
//! Every face of the shell is a face of the coarse mesh, and no vertex is added on it, so it is what a snapshot is for any other
//! store. A snapshot is made when its sub-domain is first meshed again, and kept.

use std::collections::BTreeSet;
use std::time::Instant;

use super::shell::{Shell, without_snapshot};
use super::sizes::{recorded_field, room};
use crate::pipeline::error::PipelineError;
use crate::pipeline::mesh::coarse::{recovered_and_colored, triangulate};
use crate::pipeline::plan::{Options, Plan};
use crate::pipeline::progress::Watcher;
use crate::pipeline::seal::totals::journal;
use crate::pipeline::work::coarse_snapshot::save;
use crate::pipeline::workers::{WorkerFn, map_bounded};
use tetdb_base::geom::HilbertFrame;
use tetdb_base::storage::{Backing, Budget, DiskPath, Pager, ScratchSpace, attempt};
use tetdb_base::surface::Surface;
use tetdb_kernel::boundary::fill_by_sides;
use tetdb_kernel::mesh::{Mesh, MeshFacet, MeshInterfaceFace, VertexTag, Workspace, renumber};
use tetdb_schema::blob::Blob;
use tetdb_schema::catalog::CoarseRow;
use tetdb_schema::ids::{Owner, VertexId};
use tetdb_store::sealed::Subdomain;
use tetdb_store::store::Catalog;

/// Job that makes one snapshot.
struct SnapshotJob {
    part: Subdomain,
    path: DiskPath,
    scratch: DiskPath,
    share: Plan,
}

/// Makes the missing coarse snapshots of these sub-domains of an imported store, and records the size field of the whole if there is none.
///
/// The mesh of the store stays as it is. Effects: a commit for each snapshot. Errors: a sub-domain that does not exist; a face that
/// cannot be recovered; damage; too little memory or disk.
pub fn add_snapshots(
    catalog: &mut Catalog,
    options: &Options,
    ranks: &BTreeSet<u32>,
    budget: &Budget,
    watch: &Watcher,
) -> Result<(), PipelineError> {
    let missing = without_snapshot(catalog, ranks)?;
    if missing.is_empty() || !catalog.job()?.is_imported() {
        return Ok(());
    }
    let field = match catalog.blob(Blob::SizeField)? {
        Some(_) => None,
        None => {
            let room = room(catalog, budget)?;
            Some(attempt(|| recorded_field(catalog, options, &room))??.to_bytes())
        }
    };
    let held = missing.iter().map(Shell::bytes).max().unwrap_or(0);
    let plan = Plan::new(budget.cap(), held)?;
    let leased = held + plan.frames + plan.redb + plan.redb / 2 + plan.buffers;
    let _lease = budget.lease(leased, "coarse meshes")?;
    // Each worker holds the shell of its sub-domain.
    let fitting = (plan.frames + held) / held.max(1);
    let workers = plan.workers().min(missing.len()).min(fitting.max(1) as usize);
    let of_shells = held * (workers as u64 - 1);
    let plan = Plan { frames: plan.frames - of_shells.min(plan.frames / 2), ..plan };
    let share = plan.shared_by(workers as u64);
    let run = &|job: SnapshotJob, watch: &Watcher| job.run(watch);
    map_bounded(
        &mut (catalog, field),
        missing,
        &vec![run as WorkerFn<SnapshotJob, (CoarseRow, Instant)>; workers],
        watch,
        |(catalog, _), row| {
            let scratch = catalog.scratch_dir()?.join(format!("coarse-{}", row.rank));
            scratch.create_dir_all()?;
            Ok(SnapshotJob {
                part: catalog.open_subdomain(row.rank, (share.redb / 2) as usize)?,
                path: catalog.coarse_path(row.rank, row.generation),
                scratch,
                share,
            })
        },
        |(catalog, field), (row, clock)| {
            let state = catalog.state()?;
            catalog.commit(|step| {
                step.list_coarse(&row);
                if let Some(field) = field.take() {
                    step.set_blob(Blob::SizeField, &field);
                }
                let measures = [("coarse_tets", row.tets as f64)];
                let mut journal = journal(state, "coarse mesh of a sub-domain", clock, &measures);
                journal.subdomain = Some(row.rank);
                step.append_journal(&journal);
                Ok(())
            })?;
            Ok(())
        },
    )
}

impl SnapshotJob {
    fn run(mut self, watch: &Watcher) -> Result<(CoarseRow, Instant), PipelineError> {
        let clock = Instant::now();
        let row = attempt(|| self.make(watch))??;
        let _ = self.scratch.remove_dir_all();
        Ok((row, clock))
    }

    fn make(&mut self, watch: &Watcher) -> Result<CoarseRow, PipelineError> {
        let Self { part, path, scratch, share } = self;
        let (rank, generation) = (part.row().rank, part.row().generation);
        let shell = Shell::read(part)?;
        let sides = shell.sides(part)?;
        let backing = Backing {
            subdomain: rank,
            generation,
            spill: scratch.clone(),
            output: None,
            base: None,
            cache_bytes: share.redb as usize,
        };
        let mut mesh = Mesh::new(Pager::new(share.frames, Some(backing)));
        let surface = Surface {
            points: shell.points(),
            triangles: shell.triangles.clone(),
            labels: vec![0; shell.triangles.len()],
            ..Surface::default()
        };
        let frame = HilbertFrame::new(&surface.bounds());
        let room = ScratchSpace::new(share.buffers / 2, &*scratch);
        triangulate(&mut mesh, &surface, &room, watch)
            .map_err(|_| part.damaged("two vertices of its shell are at one place"))?;
        drop(surface);
        let (_, is_sound) = recovered_and_colored(&mut mesh, watch, |mesh| {
            Ok(fill_by_sides(mesh, &|n| sides[n as usize])?)
        })?;
        if !is_sound || mesh.n_tets() == 0 {
            return Err(part.damaged("its faces do not enclose its regions").into());
        }
        let space = Workspace { dir: scratch, memory: share.buffers / 2 };
        renumber(&mut mesh, &frame, &space)?;
        name_shell(&mut mesh, &shell, rank)
            .ok_or_else(|| part.damaged("a vertex of its shell has another owner"))?;
        save(&mut mesh, path, rank, generation, share.buffers)
    }
}

/// Gives vertices and faces of a coarse mesh, whose facets are the triangles of the shell, what the store has on record for them.
fn name_shell(mesh: &mut Mesh, shell: &Shell, rank: u32) -> Option<()> {
    let vertices: Vec<u32> = mesh.vertex_ids().collect();
    for v in vertices {
        let (VertexTag::Surface, index) = mesh.vertex_attribute(v) else { continue };
        let name = VertexId::from_number(shell.vertices[index as usize].id)?;
        match name.owner {
            Owner::Surface => mesh.set_vertex_attribute(v, VertexTag::Surface, name.index),
            Owner::Cut(cut) => mesh.set_interface_vertex(v, cut, name.index),
            Owner::Subdomain(_) => return None,
        }
    }
    for (face, &triangle) in shell.faces.iter().zip(&shell.triangle_of) {
        let (known, numbers) = (mesh.facet(triangle), shell.triangles[triangle as usize]);
        let corner = |v: u32| {
            let i = numbers.iter().position(|&w| w == v).expect("the same three");
            known.vertices[i]
        };
        mesh.add_interface_face(MeshInterfaceFace {
            vertices: face.vertices.map(corner),
            cut: face.cut,
            index: face.index,
            side: u32::from(rank >= face.cut),
        });
    }
    for (n, facet) in (0..).zip(&shell.facets) {
        let vertices = mesh.facet(n).vertices;
        let (label, input, regions) = (facet.label, facet.triangle, facet.regions);
        mesh.set_facet(n, MeshFacet { vertices, label, input, regions });
    }
    mesh.truncate_facets(shell.facets.len() as u32);
    Some(())
}
