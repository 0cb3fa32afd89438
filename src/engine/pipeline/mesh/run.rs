//! Driver of one meshing run: coarse mesh, bisections, sub-domains, sealed store.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::coarse::{CoarseReport, inserted, recovered};
use super::commit::{close, commit_subdomain, subdomain_order};
use super::head_start::{HeadStart, head_start};
use crate::pipeline::error::PipelineError;
use crate::pipeline::plan::leases::Leases;
use crate::pipeline::plan::subdomains::n_subdomains;
use crate::pipeline::plan::{Estimate, Options, Plan, Prepared, prepare};
use crate::pipeline::progress::{JobProgress, Watcher};
use crate::pipeline::seal::totals::{by_threads, journal};
use crate::pipeline::tasks::{ask, begin, wrong_receipt};
use crate::pipeline::tree::{self, DONE};
use crate::pipeline::work::common::Common;
use crate::pipeline::work::traffic::pages_of;
use crate::pipeline::work::{FineReport, Worker, WorkerPool, Workplace};
use crate::pipeline::workers::{WorkerFn, map_bounded};
use tetdb_base::geom::{Aabb, HilbertFrame};
use tetdb_base::storage::{Backing, Budget, Pager, PagerStats, ScratchSpace, StepClock, attempt};
use tetdb_base::surface::Surface;
use tetdb_kernel::bisect::{CutReport, load_of};
use tetdb_kernel::boundary::RegionSummary;
use tetdb_kernel::mesh::{Mesh, Workspace, renumber};
use tetdb_kernel::sizing::{SizeField, SizeSummary, TETS_PER_LOAD};
use tetdb_schema::blob::{Blob, BlobContent};
use tetdb_schema::catalog::{JournalRow, RegionRow, StoreState, WiresRow};
use tetdb_schema::tree::{RankRange, SubtreeMesh};
use tetdb_schema::work::{Receipt, SubdomainOrder, SubdomainReceipt, Traffic, WorkOrder};
use tetdb_store::store::{Catalog, INPUT_TRIANGLES};

/// Generation of the coarse mesh's file.
const COARSE: u32 = 1;

/// Report of a run. A field is absent if an earlier run had already completed its step.
#[derive(Clone, Debug)]
pub struct Summary {
    /// The coarse mesh of the whole domain.
    pub coarse: Option<CoarseReport>,
    /// The size field.
    pub sizes: Option<SizeSummary>,
    /// The bisections of this run, in order.
    pub cuts: Vec<CutReport>,
    /// Reports of refinement and optimization for the sub-domains of this run, by rank.
    pub fine: BTreeMap<u32, FineReport>,
    /// Number of sub-domains of the mesh.
    pub subdomains: u32,
    /// Requested number of sub-domains, if it was larger than the mesh allows.
    pub subdomains_requested: Option<u32>,
    /// Pages read and written.
    pub pages: PagerStats,
    /// Largest number of pages held in memory at once.
    pub frames_used: usize,
}

/// Meshes a valid `surface` into the store of `catalog`, starting after the last committed step.
///
/// The result depends on surface and options alone, not on the budget, the threads or the number of interruptions. Effects:
/// commits one step after another. Errors: the store keeps its last committed step.
pub fn mesh(
    catalog: &mut Catalog,
    surface: &Surface,
    options: &Options,
    budget: &Budget,
    watch: &Watcher,
) -> Result<Summary, PipelineError> {
    let scratch = catalog.scratch_dir()?;
    let left = budget.cap().saturating_sub(surface.bytes() as u64);
    match catalog.blob(Blob::SizeField)? {
        None => {
            let (prepared, begun) = head_start(surface, options, budget.cap(), watch, |taken| {
                let room = ScratchSpace::new(left.saturating_sub(taken), scratch);
                prepare(surface, options, None, &room)
            })?;
            let surface = Cow::Borrowed(surface);
            mesh_prepared(catalog, surface, options, (prepared, begun), budget, watch)
        }
        Some(bytes) => {
            let room = ScratchSpace::new(left, scratch);
            let field = attempt(|| SizeField::from_bytes_in(&bytes, &room))??;
            drop(bytes);
            let field = field.with_sources(&options.mesh.sizes, surface.bounds().diagonal())?;
            let surface = Cow::Borrowed(surface);
            go_on(catalog, surface, options, &field, None, budget, watch)
        }
    }
}

/// Like [`mesh`], for a new store, with the results of [`prepare`] and [`head_start`] for this surface and these options.
///
/// An owned surface is dropped once the coarse mesh exists, which frees its memory for the following steps. Errors: as [`mesh`].
pub fn mesh_prepared(
    catalog: &mut Catalog,
    surface: Cow<Surface>,
    options: &Options,
    (prepared, begun): (Prepared, Option<HeadStart>),
    budget: &Budget,
    watch: &Watcher,
) -> Result<Summary, PipelineError> {
    let Prepared { sizes, estimate, journal, .. } = prepared;
    let new = New { sizes, estimate, begun, journal };
    go_on(catalog, surface, options, &prepared.field, Some(new), budget, watch)
}

/// Row of the journal for the coarse mesh; called on its thread.
fn coarse_row(
    report: &CoarseReport,
    [n_triangles, predicted, head_start]: [f64; 3],
    (pages, frames_used): (PagerStats, usize),
    clock: &StepClock,
) -> JournalRow {
    let measures = [
        ("missing_segments", f64::from(report.recovery.missing_segments)),
        ("missing_facets", f64::from(report.recovery.missing_facets)),
        (INPUT_TRIANGLES, n_triangles),
        ("predicted_tets", predicted),
        ("head_start_s", head_start),
        ("pages_read", pages.pages_read as f64),
        ("pages_written", pages.pages_written as f64),
        ("frames_used", frames_used as f64),
    ];
    let measures: Vec<_> = measures.into_iter().chain(by_threads(clock)).collect();
    journal(StoreState::Coarse, "coarse mesh", clock.begun(), &measures)
}

/// Input of the first step: sizes, estimate and head start of a mesh that is not begun.
struct New {
    sizes: SizeSummary,
    estimate: Estimate,
    begun: Option<HeadStart>,
    journal: Option<JournalRow>,
}

fn go_on(
    catalog: &mut Catalog,
    surface: Cow<Surface>,
    options: &Options,
    field: &SizeField,
    new: Option<New>,
    budget: &Budget,
    watch: &Watcher,
) -> Result<Summary, PipelineError> {
    let held = Leases::of(&surface, field, options, budget)?;
    let run = Run {
        catalog,
        bounds: surface.bounds(),
        options,
        field,
        plan: held.plan,
        n: 1,
        pages: PagerStats::default(),
        frames_used: 0,
        watch,
        slots: None,
    };
    // A failed page access unwinds to here. Each step commits in its last action, so no step is half done.
    attempt(|| run.steps(surface, new, held, budget))?
}

pub struct Run<'a> {
    pub catalog: &'a mut Catalog,
    pub options: &'a Options,
    pub field: &'a SizeField,
    pub plan: Plan,
    pub bounds: Aabb,
    /// Number of sub-domains of the mesh.
    pub n: u32,
    pub pages: PagerStats,
    pub frames_used: usize,
    pub watch: &'a Watcher<'a>,
    /// Number of orders that remote workers perform at once; `None` before they have begun.
    pub slots: Option<usize>,
}

/// The remote workers, and the number of one of their slots; each slot performs one order at a time.
type Slot = (Arc<dyn WorkerPool>, usize);

/// The receipt of a finished sub-domain, and the report if this process meshed it.
type SubdomainDone = (Box<SubdomainReceipt>, Option<FineReport>);

impl<'a> Run<'a> {
    fn steps(
        mut self,
        surface: Cow<Surface>,
        new: Option<New>,
        mut held: Leases,
        budget: &Budget,
    ) -> Result<Summary, PipelineError> {
        let (mut open, mut coarse, mut sizes) = (None, None, None);
        let is_given = matches!(surface, Cow::Owned(_));
        let is_begun = self.catalog.state()? >= StoreState::Coarse;
        if let Some(new) = new.filter(|_| !is_begun) {
            let begun = new.begun.filter(|begun| begun.bytes() <= self.plan.frames);
            let (mesh, report) =
                self.coarse_step(surface, (&new.estimate, new.journal.as_ref()), begun)?;
            (open, coarse, sizes) = (Some(mesh), Some(report), Some(new.sizes));
        } else {
            drop(surface);
        }
        self.n = tree::recorded_n_subdomains(self.catalog)?;
        if is_given {
            held = held.without_surface(self.options, budget)?;
            self.plan = held.plan;
        }
        if self.options.run.coarse_only {
            return self.summary(coarse, sizes, Vec::new());
        }
        // Resident pages of the coarse mesh would take frames from the other meshes.
        open = open.filter(|_| self.n == 1);
        let cuts = self.divide_all()?;
        let mut summary = self.summary(coarse, sizes, cuts)?;
        let sealed: BTreeSet<u32> = self.catalog.subdomains()?.iter().map(|r| r.rank).collect();
        let mut left = tree::subtrees(self.catalog, self.n)?;
        left.retain(|p| !sealed.contains(&p.ranks.first));
        self.saturate_all(left, open, &mut summary)?;
        close(self.catalog, self.n)?;
        (summary.pages, summary.frames_used) = (self.pages, self.frames_used);
        Ok(summary)
    }

    fn summary(
        &self,
        coarse: Option<CoarseReport>,
        sizes: Option<SizeSummary>,
        cuts: Vec<CutReport>,
    ) -> Result<Summary, PipelineError> {
        let requested = self.options.mesh.subdomains.count();
        Ok(Summary {
            coarse,
            sizes,
            cuts,
            fine: BTreeMap::new(),
            subdomains: self.n,
            subdomains_requested: requested.filter(|&requested| requested > self.n),
            pages: self.pages,
            frames_used: self.frames_used,
        })
    }

    /// Parameters common to all workers.
    pub fn common(&self) -> Common<'a> {
        Common::new(self.options, self.field, self.bounds)
    }

    fn coarse_step(
        &mut self,
        surface: Cow<Surface>,
        (estimate, prepared): (&Estimate, Option<&JournalRow>),
        begun: Option<HeadStart>,
    ) -> Result<(Mesh, CoarseReport), PipelineError> {
        let clock = StepClock::start();
        let scratch = self.catalog.scratch_dir()?;
        let backing = Backing {
            subdomain: 0,
            generation: COARSE,
            spill: scratch.clone(),
            output: None,
            base: None,
            cache_bytes: self.plan.redb as usize,
        };
        let head_start = begun.as_ref().map_or(0.0, |begun| begun.seconds);
        let room = ScratchSpace::new(self.plan.buffers / 2, &scratch);
        let (mut mesh, kernel) = match begun {
            Some(begun) => begun.into_mesh(self.plan.frames, backing),
            None => {
                let mut mesh = Mesh::new(Pager::new(self.plan.frames, Some(backing)));
                let kernel = inserted(&mut mesh, &surface, &room, self.watch);
                (mesh, kernel)
            }
        };
        let (label_names, label_sets) = (surface.label_names.clone(), surface.label_sets.clone());
        let wires = surface.has_embedded().then(|| wires_row(&surface));
        let n_triangles = surface.n_input_triangles();
        // The mesh holds all data of the surface that the following code needs.
        drop(surface);
        let report = recovered(&mut mesh, kernel, self.options, self.watch)?;
        let space = Workspace { dir: &scratch, memory: self.plan.buffers / 2 };
        renumber(&mut mesh, &HilbertFrame::new(&self.bounds), &space)?;
        let load = self.load(&mut mesh);
        // Where vertices nearly touch, sizes at points are close to zero and the estimate has no bound. The load of the mesh
        // itself has one.
        let predicted = estimate.tets().min(TETS_PER_LOAD * load);
        let (n, _) = n_subdomains(predicted, self.options);
        let path = self.catalog.file_path(0, COARSE);
        mesh.pages_mut().end_generation(path, COARSE + DONE);
        let part = SubtreeMesh {
            ranks: RankRange::root(n),
            generation: COARSE,
            state: mesh.state(),
            extents: mesh.pages().extents(),
            load,
        };
        let (pages, frames_used) = (mesh.pages().stats(), mesh.pages().frames_used());
        let (field, bounds) = (self.field.to_bytes(), self.bounds);
        let counts = [n_triangles as f64, predicted, head_start];
        let row = coarse_row(&report, counts, (pages, frames_used), &clock);
        self.catalog.commit(|step| {
            step.list_file(0, COARSE);
            step.set_labels(&label_names);
            if !label_sets.is_empty() {
                step.set_label_sets(&label_sets);
            }
            step.set_regions(&report.regions.list.iter().map(region_row).collect());
            let names = report.regions.names();
            if !names.is_empty() {
                step.set_region_names(&names);
            }
            if let Some(wires) = &wires {
                step.set_wires(wires);
            }
            step.set_blob(Blob::SizeField, &field);
            step.set_blob(Blob::Bounds, &tree::corners(&bounds).to_bytes());
            step.set_blob(Blob::SubdomainCount, &n.to_le_bytes());
            step.set_blob(Blob::Subtree(0), &part.to_bytes());
            step.set_state(StoreState::Coarse);
            if let Some(row) = prepared {
                step.append_journal(row);
            }
            step.append_journal(&row);
            Ok(())
        })?;
        Ok((mesh, report))
    }

    /// Returns the load of the coarse mesh. Effects: sets the sizes of its vertices.
    fn load(&self, mesh: &mut Mesh) -> f64 {
        for v in mesh.vertex_ids() {
            let p = mesh.point(v);
            mesh.set_size(v, self.field.h(p) as f32);
        }
        load_of(mesh, &|p| self.field.h(p))
    }

    /// Meshes the remaining sub-domains, as many at once as threads and memory allow.
    fn saturate_all(
        &mut self,
        left: Vec<SubtreeMesh>,
        open: Option<Mesh>,
        summary: &mut Summary,
    ) -> Result<(), PipelineError> {
        let worker = Worker { place: Workplace::in_store(self.catalog)?, common: self.common() };
        if let (Some(mesh), [part]) = (open, &left[..]) {
            let job =
                worker.subdomain_job(subdomain_order(self.catalog, self.n, *part)?, self.plan)?;
            let leaf = job.finish(mesh, worker.common, self.watch)?;
            return self.seal_step(&leaf.receipt(), Some(leaf.fine), summary);
        }
        let (workers, watch) = (self.plan.workers().min(left.len()), self.watch);
        let share = self.plan.shared_by(workers.max(1) as u64);
        let sealed: u64 = self.catalog.subdomains()?.iter().map(|row| row.tets).sum();
        let predicted = |load: f64| TETS_PER_LOAD * load;
        let rest: f64 = left.iter().map(|part| predicted(part.load)).sum();
        let done = [sealed as f64, sealed as f64 + rest];
        let progress = &JobProgress::new("mesh sub-domains", "tetrahedra", done);
        let of = |order: &SubdomainOrder| {
            let part = order.mesh;
            (part.ranks.first, predicted(part.load))
        };
        let here = |order: SubdomainOrder, watch: &Watcher| {
            let work = of(&order);
            let job = worker.subdomain_job(order, share)?;
            let leaf = job.run(worker.common, &|event| progress.heard(work, event, watch))?;
            progress.finished(work, watch);
            Ok((Box::new(leaf.receipt()), Some(leaf.fine)))
        };
        let there = match left.is_empty() {
            true => Vec::new(),
            false => self.pool()?,
        };
        let store = &worker.place.store;
        let elsewhere: Vec<_> = (there.iter())
            .map(|(pool, slot)| {
                move |order: SubdomainOrder, watch: &Watcher| {
                    let work = of(&order);
                    match ask(&**pool, *slot, &WorkOrder::Subdomain(order), store)? {
                        Receipt::Subdomain(receipt) => {
                            progress.finished(work, watch);
                            Ok((Box::new(receipt), None))
                        }
                        Receipt::Cut(_) => Err(wrong_receipt()),
                    }
                }
            })
            .collect();
        let mut workers: Vec<WorkerFn<SubdomainOrder, SubdomainDone>> = vec![&here; workers];
        workers.extend(elsewhere.iter().map(|worker| worker as WorkerFn<_, _>));
        map_bounded(
            &mut (self, summary),
            left,
            &workers,
            watch,
            |(run, _), part| Ok(subdomain_order(run.catalog, run.n, part)?),
            |(run, summary), (leaf, fine)| run.seal_step(&leaf, fine, summary),
        )
    }

    fn seal_step(
        &mut self,
        leaf: &SubdomainReceipt,
        fine: Option<FineReport>,
        summary: &mut Summary,
    ) -> Result<(), PipelineError> {
        commit_subdomain(self.catalog, leaf)?;
        self.count(leaf.traffic);
        let of_rank = fine.map(|fine| (leaf.row.rank, fine));
        summary.fine.extend(of_rank);
        Ok(())
    }

    /// Returns one entry for each order that remote workers perform at once; empty without remote workers. Effects: the workers
    /// begin.
    pub fn pool(&mut self) -> Result<Vec<Slot>, PipelineError> {
        let Some(pool) = self.options.run.remote.0.clone() else {
            return Ok(Vec::new());
        };
        let slots = match self.slots {
            Some(slots) => slots,
            None => begin(&*pool, self.catalog, self.options, &self.bounds)?,
        };
        self.slots = Some(slots);
        Ok((0..slots).map(|slot| (pool.clone(), slot)).collect())
    }

    /// Adds the traffic of an order to the totals of the run.
    pub fn count(&mut self, traffic: Traffic) {
        self.pages.add(pages_of(traffic));
        self.frames_used = self.frames_used.max(traffic.frames_used as usize);
    }
}

fn wires_row(surface: &Surface) -> WiresRow {
    WiresRow {
        edges: surface.embedded.edges.clone(),
        points: surface.embedded.points.clone(),
        fin_first: surface.n_input_triangles() as u64,
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
