//! All steps of one run.

use std::path::PathBuf;
use std::time::Instant;

use tetdb_schema::ids::SubdomainId;

use super::coarse::{CoarseReport, coarse};
use super::fine::{FineReport, fine};
use super::seal::{Target, seal};
use super::watch::Watcher;
use super::{Options, PipelineError, Plan};
use crate::boundary::RegionSummary;
use crate::catalog::{Catalog, JournalRow, Measure, RegionRow, Sealed, StoreState};
use crate::geom::{Aabb, HilbertFrame};
use crate::mesh::{Mesh, MeshState, Workspace, renumber};
use crate::sizing::{SizeField, SizeSummary};
use crate::store::{Backing, Budget, Pager, PagerStats, StoreFile, attempt};
use crate::surface::Surface;

/// Numbers of the catalog's blobs.
const BLOB_SIZE_FIELD: u32 = 1;
const BLOB_MESH_STATE: u32 = 2;
/// Generations of the only sub-domain.
const COARSE: u32 = 1;
const WORK: u32 = 2;
const SEALED: u32 = 3;

/// What a run did; a part is absent when an earlier run had done its step.
#[derive(Clone, Debug)]
pub struct Summary {
    pub coarse: Option<CoarseReport>,
    pub sizes: Option<SizeSummary>,
    pub fine: FineReport,
    pub sealed: Sealed,
    pub pages: PagerStats,
    pub frames_used: usize,
}

/// Meshes `surface`, which must be valid, into the store of `catalog`, going on from where the store stands.
///
/// The result depends on surface and options alone: not on the budget, threads, or how often it was interrupted.
/// Effects: commits one step after the other. Errors: the store stands at its last step.
pub fn mesh(
    catalog: &mut Catalog,
    surface: &Surface,
    options: &Options,
    budget: &Budget,
    watch: &Watcher,
) -> Result<Summary, PipelineError> {
    let surface_lease = budget.lease(surface.bytes() as u64, "the surface")?;
    let mut sizes = None;
    let field = match catalog.blob(BLOB_SIZE_FIELD)? {
        Some(bytes) => SizeField::from_bytes(&bytes)?
            .with_sources(&options.sizes()?, surface.bounds().diagonal())?,
        None => {
            let built = SizeField::build_with_summary(
                &surface.points,
                &surface.triangles,
                &options.sizes()?,
            )?;
            sizes = Some(built.1);
            built.0
        }
    };
    let field_lease = budget.lease(field.bytes() as u64, "the size field")?;
    let plan = Plan::new(budget.cap(), surface_lease.bytes() + field_lease.bytes())?;
    let _lease = budget.lease(
        plan.frames + plan.redb + plan.redb / 2 + plan.buffers,
        "the working mesh",
    )?;
    // Unwinding from a failed page access ends here; a step's commit is its last act, so nothing is half done.
    attempt(|| {
        let run = Run {
            catalog,
            surface,
            options,
            field: &field,
            plan,
            bounds: surface.bounds(),
            watch,
        };
        run.steps(sizes)
    })?
}

struct Run<'a> {
    catalog: &'a mut Catalog,
    surface: &'a Surface,
    options: &'a Options,
    field: &'a SizeField,
    plan: Plan,
    bounds: Aabb,
    watch: &'a Watcher<'a>,
}

impl Run<'_> {
    fn steps(mut self, sizes: Option<SizeSummary>) -> Result<Summary, PipelineError> {
        let (mut mesh, coarse) = if self.catalog.state()? < StoreState::Coarse {
            let (mesh, report) = self.coarse_step()?;
            (mesh, Some(report))
        } else {
            (self.reopen_coarse()?, None)
        };
        let clock = Instant::now();
        let scratch = self.catalog.scratch_dir()?;
        let space = Workspace {
            dir: &scratch,
            memory: self.plan.buffers / 2,
        };
        let fine = fine(
            &mut mesh,
            self.field,
            self.bounds,
            self.options,
            &space,
            self.watch,
        )?;
        let subdomain = SubdomainId::new(0).expect("zero is a rank");
        let target = Target {
            path: &self.catalog.file_path(0, SEALED),
            scratch: &scratch,
            subdomain,
            generation: SEALED,
            memory: self.plan.buffers,
            bounds: self.bounds,
        };
        let sealed = seal(&mut mesh, &target, self.watch)?;
        let pager = mesh.into_pages();
        let (pages, frames_used) = (pager.stats(), pager.frames_used());
        let work = pager.discard();
        let regions = final_regions(self.catalog.regions()?, &sealed);
        self.catalog.commit(|step| {
            step.set_regions(&regions);
            step.set_subdomain(&sealed.row);
            step.list_file(0, SEALED);
            step.unlist_file(0, COARSE);
            step.set_state(StoreState::Sealed);
            step.append_journal(&journal(
                StoreState::Sealed,
                "saturate, optimize, seal",
                clock,
                &[
                    ("inserted_vertices", fine.refine.inserted as f64),
                    ("pages_read", pages.pages_read as f64),
                    ("pages_written", pages.pages_written as f64),
                ],
            ));
            Ok(())
        })?;
        if let Some(path) = work {
            remove(&path)?;
        }
        Ok(Summary {
            coarse,
            sizes,
            fine,
            sealed,
            pages,
            frames_used,
        })
    }

    fn backing(&self, generation: u32, base: Option<StoreFile>) -> Backing {
        Backing {
            subdomain: 0,
            generation,
            work_path: self.catalog.file_path(0, generation),
            base,
            cache_bytes: self.plan.redb as usize,
        }
    }

    fn coarse_step(&mut self) -> Result<(Mesh, CoarseReport), PipelineError> {
        let clock = Instant::now();
        let pager = Pager::new(self.plan.frames, Some(self.backing(COARSE, None)));
        let mut mesh = Mesh::new(pager);
        let report = coarse(&mut mesh, self.surface, self.options, self.watch)?;
        let scratch = self.catalog.scratch_dir()?;
        let space = Workspace {
            dir: &scratch,
            memory: self.plan.buffers / 2,
        };
        renumber(&mut mesh, &HilbertFrame::new(&self.bounds), &space)?;
        mesh.pages_mut().flush();
        let state: Vec<u8> = mesh
            .state()
            .to_words()
            .into_iter()
            .flat_map(u32::to_le_bytes)
            .collect();
        let extents = mesh.pages().extents().into_iter().flatten();
        let counts: Vec<u8> = extents.flat_map(u32::to_le_bytes).collect();
        let (field, surface) = (self.field.to_bytes(), self.surface);
        self.catalog.commit(|step| {
            step.list_file(0, COARSE);
            step.set_labels(&surface.label_names);
            step.set_regions(&report.regions.list.iter().map(region_row).collect());
            step.set_blob(BLOB_SIZE_FIELD, &field);
            step.set_blob(BLOB_MESH_STATE, &[state, counts].concat());
            step.set_state(StoreState::Coarse);
            step.append_journal(&journal(
                StoreState::Coarse,
                "coarse mesh",
                clock,
                &[
                    (
                        "missing_segments",
                        f64::from(report.recovery.missing_segments),
                    ),
                    ("missing_facets", f64::from(report.recovery.missing_facets)),
                ],
            ));
            Ok(())
        })?;
        let path = self.catalog.file_path(0, WORK);
        mesh.pages_mut().next_generation(WORK, path);
        Ok((mesh, report))
    }

    fn reopen_coarse(&mut self) -> Result<Mesh, PipelineError> {
        let base = StoreFile::open_repaired(
            &self.catalog.file_path(0, COARSE),
            self.plan.redb as usize / 2,
            false,
        )?;
        let bytes = self.catalog.blob(BLOB_MESH_STATE)?.unwrap_or_default();
        let mut words = bytes
            .chunks_exact(4)
            .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        let mut next = || words.next().unwrap_or(0);
        let state = MeshState::from_words(std::array::from_fn(|_| next()));
        let extents = std::array::from_fn(|_| [next(), next()]);
        let mut pager = Pager::new(self.plan.frames, Some(self.backing(WORK, Some(base))));
        pager.adopt(extents);
        Ok(Mesh::with_state(pager, state))
    }
}

fn region_row(region: &RegionSummary) -> RegionRow {
    RegionRow {
        region: region.region,
        volume: region.volume,
        tets: 0,
        filled: region.region != 0,
        labels: region.labels.clone(),
    }
}

/// The regions with the numbers of the sealed mesh; until then they count no tetrahedra.
fn final_regions(mut rows: Vec<RegionRow>, sealed: &Sealed) -> Vec<RegionRow> {
    for row in rows.iter_mut().filter(|row| row.filled) {
        let totals = sealed.regions.get(&row.region).copied().unwrap_or_default();
        (row.tets, row.volume) = (totals.tets, totals.volume);
    }
    rows
}

fn journal(state: StoreState, step: &str, clock: Instant, measures: &[(&str, f64)]) -> JournalRow {
    JournalRow {
        state,
        subdomain: Some(0),
        step: step.to_owned(),
        seconds: clock.elapsed().as_secs_f64(),
        measures: measures
            .iter()
            .map(|&(name, value)| Measure {
                name: name.to_owned(),
                value,
            })
            .collect(),
    }
}

fn remove(path: &PathBuf) -> Result<(), PipelineError> {
    std::fs::remove_file(path).map_err(|source| {
        let path = path.clone();
        PipelineError::Store(crate::store::StoreError::Io { path, source })
    })
}
