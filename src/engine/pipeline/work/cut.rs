//! One bisection: reads the file of a subtree and writes the files of its two children.

use super::common::Common;
use super::cut_journal::CutJournal;
use super::soundness::panic_is_damage_of;
use super::stages::{StageFiles, Stages};
use super::traffic::traffic_of;
use crate::pipeline::error::PipelineError;
use crate::pipeline::plan::Plan;
use crate::pipeline::progress::{Event, Watcher};
use crate::pipeline::tree::{DONE, open_subtree};
use tetdb_base::storage::{Backing, DiskPath, Pager, PagerStats, StepClock, attempt};
use tetdb_kernel::bisect::{self, CutPlan, CutReport, OpenCut, Zone};
use tetdb_kernel::mesh::{Mesh, Workspace};
use tetdb_kernel::optimize::Settings;
use tetdb_schema::catalog::Stage;
use tetdb_schema::tree::{RankRange, SubtreeMesh};
use tetdb_schema::work::{CutOrder, CutReceipt, InheritedFace};

/// The bisection of a subtree.
pub struct CutJob<'a> {
    pub order: &'a CutOrder,
    /// File of the subtree, and files of its children.
    pub base: DiskPath,
    pub written: [DiskPath; 2],
    /// Folder of the intermediate meshes, if they are kept.
    pub output: &'a DiskPath,
    pub scratch: DiskPath,
    /// Zones of the cuts above the subtree.
    pub zones: Vec<Zone>,
    pub common: Common<'a>,
    pub share: Plan,
}

/// A child subtree as stored in its file.
struct Child {
    mesh: SubtreeMesh,
    /// Interface faces inherited from the parent.
    inherited: Vec<InheritedFace>,
}

impl CutJob<'_> {
    /// Performs the cut. A failed page access unwinds to here.
    pub fn run(self, watch: &Watcher) -> Result<(CutReceipt, CutReport), PipelineError> {
        let place = (&self.base, self.order.parent.ranks.first);
        let divide = || panic_is_damage_of(place, || self.open(), || self.divide(watch));
        let divided = attempt(divide)??;
        // The folder is empty by now, and thousands of cuts would leave as many folders.
        let _ = self.scratch.remove_dir_all();
        Ok(divided)
    }

    fn divide(&self, watch: &Watcher) -> Result<(CutReceipt, CutReport), PipelineError> {
        let clock = StepClock::start();
        let (parent, common) = (self.order.parent, self.common);
        let ranks = parent.ranks;
        let space = Workspace { dir: &self.scratch, memory: self.share.buffers / 2 };
        let mut host = self.open()?;
        let mut core =
            Mesh::new(Pager::new(self.share.frames / 4, Some(self.backing(ranks.first, None, 4))));
        let plan = CutPlan {
            cut: ranks.cut(),
            low: ranks.low_share(),
            plane: common.plane,
            earlier: &self.zones,
            h: &|p| common.field.h(p),
            bounds: common.bounds,
            optimize: Settings::of(common.mode),
        };
        let progress = |stage, done: Option<_>| {
            watch(done.map_or(Event::begin(stage), |done| Event::tets(stage, done)));
        };
        let kept = common.keeps_stages.then(|| StageFiles {
            cut: ranks.cut(),
            output: self.output,
            scratch: &self.scratch,
            memory: self.share.buffers,
            bounds: common.bounds,
        });
        let mut stages = Stages::default();
        if let Some(kept) = &kept {
            kept.save(&mut host, Stage::Coarse, &mut stages, watch)?;
        }
        let refined = bisect::refine(&mut host, &plan, &self.scratch, &progress);
        if let Some(kept) = &kept {
            kept.save(&mut host, Stage::Refined, &mut stages, watch)?;
        }
        let faces = kept.as_ref().map(|_| &mut stages.faces);
        let opened = bisect::choose(&mut host, &mut core, &plan, refined, faces, &progress);
        let mut pages = PagerStats::default();
        let [low, high] = ranks.children();
        let mut child = |ranks, path| {
            let (child, stats) =
                self.child((&mut host, &mut core), &opened, (ranks, path), &space)?;
            pages.add(stats);
            Ok::<_, PipelineError>(child)
        };
        let low = child(low, &self.written[0])?;
        let high = child(high, &self.written[1])?;
        pages.add(host.pages().stats());
        let journal = CutJournal {
            cut: ranks.cut(),
            subdomain: ranks.first,
            report: &opened.report,
            pages,
            frames_used: host.pages().frames_used() + core.pages().frames_used(),
        };
        let receipt = CutReceipt {
            parent,
            zone: opened.zone.into(),
            children: [low.mesh, high.mesh],
            faces: opened.report.interface.chosen.faces as u32,
            inherited: high.inherited,
            stages: stages.rows(&opened.zone),
            stage_faces: stages.face_bytes(),
            journal: journal.row(&clock),
            traffic: traffic_of(pages, journal.frames_used),
        };
        Ok((receipt, opened.report))
    }

    /// Opens the mesh of the subtree from its file.
    fn open(&self) -> Result<Mesh, PipelineError> {
        let parent = self.order.parent;
        let backing = self.backing(parent.ranks.first, None, 2);
        open_subtree(parent, self.base.clone(), backing, self.share.frames / 2)
    }

    fn child(
        &self,
        (host, core): (&mut Mesh, &mut Mesh),
        opened: &OpenCut,
        (ranks, path): (RankRange, &DiskPath),
        space: &Workspace,
    ) -> Result<(Child, PagerStats), PipelineError> {
        let backing = self.backing(ranks.first, Some(path.clone()), 2);
        let mut mesh = Mesh::new(Pager::new(self.share.frames / 4, Some(backing)));
        let high = ranks.first == opened.zone.cut;
        let bounds = &self.common.bounds;
        bisect::write_child(host, core, &mut mesh, opened, high, bounds, space)?;
        let mut inherited = Vec::new();
        for n in 0..mesh.n_interface_faces() {
            let face = mesh.interface_face(n);
            if face.cut != opened.zone.cut {
                inherited.push(InheritedFace { cut: face.cut, index: face.index, side: face.side });
            }
        }
        inherited.sort_unstable();
        if mesh.n_tets() == 0 {
            let cut = opened.zone.cut;
            return Err(PipelineError::EmptyPart { cut });
        }
        let [below, all] = opened.report.plane.load;
        let load = if high { all - below } else { below };
        let child_mesh = SubtreeMesh {
            ranks,
            generation: self.order.parent.generation + DONE,
            state: mesh.state(),
            extents: mesh.pages().extents(),
            load,
        };
        let stats = mesh.into_pages().finish();
        let child = Child { mesh: child_mesh, inherited };
        Ok((child, stats))
    }

    /// Backing for pages that leave memory, with 1/`share` of redb's cache.
    fn backing(&self, subdomain: u32, made: Option<DiskPath>, share: u64) -> Backing {
        Backing {
            subdomain,
            generation: self.order.parent.generation + DONE,
            spill: self.scratch.clone(),
            output: made,
            base: None,
            cache_bytes: (self.share.redb / share) as usize,
        }
    }
}
