//! One bisection as a step: the part's file in, the files of its two children out, one commit.

use std::time::Instant;

use super::common::Common;
use super::cut_journal::CutJournal;
use super::owners::{InheritedFace, NewCut, TopologyChange};
use super::run::Run;
use super::stages::{StageFiles, Stages};
use crate::bisect::{self, CutPlan, CutReport, Opened, Zone};
use crate::mesh::{Mesh, Workspace};
use crate::optimize::Settings;
use crate::pipeline::error::PipelineError;
use crate::pipeline::plan::Plan;
use crate::pipeline::progress::{Event, Watcher};
use crate::pipeline::tree::{self, DONE, PartMesh, TreePart, blob, open_part};
use crate::pipeline::workers::work_off;
use crate::storage::{Backing, DiskPath, Pager, PagerStats, attempt};
use tetdb_schema::catalog::{Stage, StoreState};

/// What a worker needs to bisect a part.
pub(crate) struct CutJob {
    pub parent: PartMesh,
    /// The part's file, and those of its children.
    base: DiskPath,
    made: [DiskPath; 2],
    scratch: DiskPath,
    /// Zones of the cuts above it.
    zones: Vec<Zone>,
    /// Where meshes on their way go, when they are kept.
    kept: Option<StageFiles>,
    share: Plan,
}

/// A part in two; its files are not yet listed.
pub(crate) struct Divided {
    parent: PartMesh,
    opened: Opened,
    stages: Stages,
    children: [Child; 2],
    pages: PagerStats,
    frames_used: usize,
    clock: Instant,
}

/// A child as its file holds it.
struct Child {
    mesh: PartMesh,
    /// Interface faces it took over from its parent.
    inherited: Vec<InheritedFace>,
}

impl CutJob {
    /// Does the whole job; a failed page access ends here.
    pub(crate) fn run(self, common: Common, watch: &Watcher) -> Result<Divided, PipelineError> {
        let divided = attempt(|| self.divide(common, watch))??;
        // Empty by now; thousands of cuts would leave as many folders.
        let _ = self.scratch.remove_dir_all();
        Ok(divided)
    }

    fn divide(&self, common: Common, watch: &Watcher) -> Result<Divided, PipelineError> {
        let clock = Instant::now();
        let part = self.parent.part;
        let space = Workspace {
            dir: &self.scratch,
            memory: self.share.buffers / 2,
        };
        let backing = self.backing(part.first, None, 2);
        let mut host = open_part(
            self.parent,
            self.base.clone(),
            backing,
            self.share.frames / 2,
        )?;
        let mut core = Mesh::new(Pager::new(
            self.share.frames / 4,
            Some(self.backing(part.first, None, 4)),
        ));
        let plan = CutPlan {
            cut: part.cut(),
            low: part.low_share(),
            method: common.method,
            earlier: &self.zones,
            h: &|p| common.field.h(p),
            bounds: common.bounds,
            optimize: Settings::of(common.mode),
        };
        let progress = |stage, done| {
            watch(Event {
                stage,
                done,
                total: None,
                unit: "vertices",
            });
        };
        let mut stages = Stages::default();
        if let Some(kept) = &self.kept {
            kept.save(&mut host, Stage::Coarse, &mut stages, watch)?;
        }
        let refined = bisect::refine(&mut host, &plan, &space, &progress)?;
        if let Some(kept) = &self.kept {
            kept.save(&mut host, Stage::Refined, &mut stages, watch)?;
        }
        let faces = self.kept.as_ref().map(|_| &mut stages.faces);
        let opened = bisect::choose(&mut host, &mut core, &plan, refined, faces, &progress);
        let mut pages = PagerStats::default();
        let mut children = Vec::with_capacity(2);
        for (child, path) in part.children().into_iter().zip(&self.made) {
            let (made, stats) = self.child(
                (&mut host, &mut core),
                &opened,
                (child, path),
                common,
                &space,
            )?;
            pages.add(stats);
            children.push(made);
        }
        pages.add(host.pages().stats());
        let frames_used = host.pages().frames_used() + core.pages().frames_used();
        let Ok(children) = children.try_into() else {
            unreachable!("a cut has two sides");
        };
        Ok(Divided {
            parent: self.parent,
            opened,
            stages,
            children,
            pages,
            frames_used,
            clock,
        })
    }

    fn child(
        &self,
        (host, core): (&mut Mesh, &mut Mesh),
        opened: &Opened,
        (part, path): (TreePart, &DiskPath),
        common: Common,
        space: &Workspace,
    ) -> Result<(Child, PagerStats), PipelineError> {
        let backing = self.backing(part.first, Some(path.clone()), 2);
        let mut mesh = Mesh::new(Pager::new(self.share.frames / 4, Some(backing)));
        let high = part.first == opened.zone.cut;
        bisect::write_child(host, core, &mut mesh, opened, high, &common.bounds, space)?;
        let mut inherited = Vec::new();
        for n in 0..mesh.n_interface_faces() {
            let face = mesh.interface_face(n);
            if face.cut != opened.zone.cut {
                inherited.push(InheritedFace {
                    cut: face.cut,
                    index: face.index,
                    side: face.side,
                });
            }
        }
        inherited.sort_unstable();
        if mesh.n_tets() == 0 {
            let cut = opened.zone.cut;
            return Err(PipelineError::EmptyPart { cut });
        }
        let [below, all] = opened.report.plane.load;
        let load = if high { all - below } else { below };
        let part_mesh = PartMesh {
            part,
            generation: self.parent.generation + DONE,
            state: mesh.state(),
            extents: mesh.pages().extents(),
            load,
        };
        let stats = mesh.into_pages().finish();
        let child = Child {
            mesh: part_mesh,
            inherited,
        };
        Ok((child, stats))
    }

    /// Where pages go that leave memory, with one part in `share` of redb's cache.
    fn backing(&self, subdomain: u32, made: Option<DiskPath>, share: u64) -> Backing {
        Backing {
            subdomain,
            generation: self.parent.generation + DONE,
            spill: self.scratch.clone(),
            made,
            base: None,
            cache_bytes: (self.share.redb / share) as usize,
        }
    }
}

impl Run<'_> {
    /// Bisects until no part has more than one sub-domain, as many parts at once as there are threads and memory for.
    pub(crate) fn divide_all(&mut self) -> Result<Vec<CutReport>, PipelineError> {
        let mut whole = tree::parts(self.catalog, self.n)?;
        whole.retain(|p| p.part.count > 1);
        let workers = self.plan.workers();
        // One part alone has all the memory: its children come when it is done.
        let share = self.plan.shared_by(whole.len().min(workers).max(1) as u64);
        let mut jobs = Vec::with_capacity(whole.len());
        for part in whole.into_iter().rev() {
            jobs.push(self.cut_job(part, share)?);
        }
        let (common, watch) = (self.common()?, self.watch);
        let mut reports = Vec::new();
        let share = self.plan.shared_by(workers as u64);
        work_off(
            jobs,
            workers,
            watch,
            &|job: CutJob, watch| job.run(common, watch),
            &mut |done| {
                reports.push(done.opened.report);
                let mut jobs = Vec::with_capacity(2);
                for part in self.commit_children(done)?.into_iter().rev() {
                    if part.part.count > 1 {
                        jobs.push(self.cut_job(part, share)?);
                    }
                }
                Ok(jobs)
            },
        )?;
        Ok(reports)
    }

    fn cut_job(&mut self, parent: PartMesh, share: Plan) -> Result<CutJob, PipelineError> {
        let first = parent.part.first;
        let made = (parent.part.children())
            .map(|p| self.catalog.file_path(p.first, parent.generation + DONE));
        let scratch = self.scratch(&format!("cut-{}", parent.part.cut()))?;
        let kept = self.options.keep_stages.then(|| {
            let cut = parent.part.cut();
            StageFiles::new(self.catalog, cut, &scratch, share.buffers, self.bounds)
        });
        Ok(CutJob {
            parent,
            base: self.catalog.file_path(first, parent.generation),
            made,
            scratch,
            zones: tree::zones_above(self.catalog, parent.part, self.n)?,
            kept,
            share,
        })
    }

    /// Commits a bisection; returns the two parts.
    fn commit_children(&mut self, divided: Divided) -> Result<[PartMesh; 2], PipelineError> {
        let Divided {
            parent,
            opened,
            stages,
            children,
            ..
        } = &divided;
        let cut = opened.zone.cut;
        let [low, high] = children;
        let topology = TopologyChange::of_cut(
            self.catalog,
            &NewCut {
                cut,
                faces: opened.report.interface.chosen.faces as u32,
                low: low.mesh.part.first,
                high: high.mesh.part.first,
                inherited: &high.inherited,
            },
        )?;
        let journal = CutJournal {
            cut,
            subdomain: low.mesh.part.first,
            report: &opened.report,
            pages: divided.pages,
            frames_used: divided.frames_used,
        };
        let row = journal.row(divided.clock);
        self.catalog.commit(|step| {
            for child in children {
                step.list_file(child.mesh.part.first, child.mesh.generation);
                let number = blob::PART + child.mesh.part.first;
                step.set_blob(number, &child.mesh.to_bytes());
            }
            step.unlist_file(parent.part.first, parent.generation);
            stages.describe(&opened.zone, step);
            step.set_blob(blob::CUT + cut, &tree::plane_bytes(&opened.zone.surface));
            topology.commit(step);
            step.set_state(StoreState::Bisected);
            step.append_journal(&row);
            Ok(())
        })?;
        self.pages.add(divided.pages);
        self.frames_used = self.frames_used.max(divided.frames_used);
        Ok([low.mesh, high.mesh])
    }
}
