//! One sub-domain: a worker saturates, optimizes and seals it alone.

use std::collections::BTreeMap;

use tetdb_schema::ids::SubdomainId;

use super::coarse_snapshot::save;
use super::common::Common;
use super::saturate::{FineReport, saturate_and_optimize};
use super::soundness::panic_is_damage_of;
use super::traffic::traffic_of;
use crate::pipeline::error::PipelineError;
use crate::pipeline::plan::Plan;
use crate::pipeline::progress::Watcher;
use crate::pipeline::seal::compact::seal;
use crate::pipeline::seal::target::SealTarget;
use crate::pipeline::seal::totals::{by_threads, journal, totals_of};
use crate::pipeline::tree::open_subtree;
use tetdb_base::storage::{Backing, DiskPath, PagerStats, StepClock, attempt};
use tetdb_kernel::bisect::Zone;
use tetdb_kernel::mesh::Mesh;
use tetdb_kernel::sizing::{SizeField, TETS_PER_LOAD};
use tetdb_schema::blob::BlobContent;
use tetdb_schema::catalog::{CoarseRow, StoreState};
use tetdb_schema::topology::FacesAcross;
use tetdb_schema::tree::SubtreeMesh;
use tetdb_schema::work::SubdomainReceipt;
use tetdb_store::sealed::{Form, Sealed};

/// Job that meshes one sub-domain.
pub struct SubdomainJob {
    pub mesh: SubtreeMesh,
    /// File of its coarse mesh, and the sealed file to write.
    pub base: DiskPath,
    pub sealed: DiskPath,
    pub form: Form,
    /// Generation of the sealed file.
    pub generation: u32,
    /// Size field of the sub-domain itself, in place of that of the whole.
    pub field: Option<SizeField>,
    /// Path of the coarse snapshot, if it is kept.
    pub kept: Option<DiskPath>,
    pub scratch: DiskPath,
    pub zones: Vec<Zone>,
    /// Owners of the other side of its interface faces, by cut.
    pub owners: BTreeMap<u32, FacesAcross>,
    pub share: Plan,
}

/// A finished sub-domain; its file is not yet listed.
pub struct FinishedSubdomain {
    pub mesh: SubtreeMesh,
    pub sealed: Sealed,
    pub kept: Option<CoarseRow>,
    /// Seconds taken to write the coarse snapshot.
    pub keep_s: f64,
    pub fine: FineReport,
    pub pages: PagerStats,
    pub frames_used: usize,
    pub seal_seconds: f64,
    pub clock: StepClock,
}

impl SubdomainJob {
    /// Meshes the sub-domain. A failed page access unwinds to here.
    pub fn run(self, common: Common, watch: &Watcher) -> Result<FinishedSubdomain, PipelineError> {
        let (subtree, base) = (self.mesh, self.base.clone());
        let (generation, scratch, share) = (self.generation, self.scratch.clone(), self.share);
        let open = || {
            let backing = Backing {
                subdomain: subtree.ranks.first,
                generation,
                spill: scratch.clone(),
                output: None,
                base: None,
                cache_bytes: share.redb as usize,
            };
            open_subtree(subtree, base.clone(), backing, share.frames)
        };
        attempt(|| {
            panic_is_damage_of((&base, subtree.ranks.first), open, || {
                self.finish(open()?, common, watch)
            })
        })?
    }

    /// Like `run`, for a mesh that is open.
    pub fn finish(
        self,
        mut mesh: Mesh,
        common: Common,
        watch: &Watcher,
    ) -> Result<FinishedSubdomain, PipelineError> {
        let clock = StepClock::start();
        let (rank, coarse) = (self.mesh.ranks.first, self.mesh.generation);
        let kept = match &self.kept {
            Some(path) => Some(save(&mut mesh, path, rank, coarse, self.share.buffers)?),
            None => None,
        };
        let keep_s = clock.seconds();
        let (fine, finished) = saturate_and_optimize(
            &mut mesh,
            self.field.as_ref().unwrap_or(common.field),
            common,
            &self.zones,
            &self.scratch,
            watch,
        );
        let generation = self.generation;
        let target = SealTarget {
            path: &self.sealed,
            form: self.form,
            scratch: &self.scratch,
            subdomain: SubdomainId::new(rank).expect("fewer parts than ranks"),
            generation,
            memory: self.share.buffers,
            bounds: common.bounds,
            owners: Some(&self.owners),
        };
        let seal_clock = StepClock::start();
        let sealed = seal(&mut mesh, finished, &target, watch)?;
        let seal_seconds = seal_clock.seconds();
        let pager = mesh.into_pages();
        let (pages, frames_used) = (pager.stats(), pager.frames_used());
        drop(pager);
        let _ = self.scratch.remove_dir_all();
        Ok(FinishedSubdomain {
            mesh: self.mesh,
            sealed,
            kept,
            keep_s,
            fine,
            pages,
            frames_used,
            seal_seconds,
            clock,
        })
    }
}

impl FinishedSubdomain {
    /// Returns the receipt for the commit. The commit sets the state of the store in the journal row.
    pub fn receipt(&self) -> SubdomainReceipt {
        let refine = &self.fine.refine;
        let measures = [
            ("predicted_tets", TETS_PER_LOAD * self.mesh.load),
            ("coarse_tets", f64::from(self.mesh.state.n_tets())),
            ("keep_s", self.keep_s),
            ("inserted_vertices", refine.inserted as f64),
            ("over_constrained_tets", refine.over_constrained as f64),
            ("zone_rejects", refine.out_of_place as f64),
            ("frozen_hits", refine.frozen_hits as f64),
            ("unexamined_tets", refine.unexamined as f64),
            ("pages_read", self.pages.pages_read as f64),
            ("pages_written", self.pages.pages_written as f64),
            ("frames_used", self.frames_used as f64),
            ("refine_s", self.fine.seconds[0]),
            ("optimize_s", self.fine.seconds[1]),
            ("seal_s", self.seal_seconds),
        ];
        let step = "saturate, optimize, seal";
        let measures: Vec<_> = measures.into_iter().chain(by_threads(&self.clock)).collect();
        let mut journal = journal(StoreState::Bisected, step, self.clock.begun(), &measures);
        journal.subdomain = Some(self.mesh.ranks.first);
        SubdomainReceipt {
            coarse: self.mesh.generation,
            row: self.sealed.row.clone(),
            kept: self.kept,
            totals: totals_of(&self.sealed).to_bytes(),
            journal,
            traffic: traffic_of(self.pages, self.frames_used),
        }
    }
}
