//! One bisection as a step: the part's file in, the files of its two children out, one commit.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::time::Instant;

use super::common::Common;
use super::owners::read_owners;
use super::run::Run;
use super::stages::{StageFiles, Stages};
use crate::bisect::{self, CutPlan, CutReport, Opened, Zone};
use crate::mesh::{Mesh, Workspace};
use crate::optimize::Settings;
use crate::pipeline::error::PipelineError;
use crate::pipeline::plan::Plan;
use crate::pipeline::progress::{Event, Watcher};
use crate::pipeline::seal::totals::journal;
use crate::pipeline::tree::{self, DONE, PartMesh, TreePart, blob, open_part};
use crate::pipeline::workers::work_off;
use crate::sealed::SealedError;
use crate::storage::{Backing, DiskPath, Pager, PagerStats, attempt};
use crate::store::StoreError;
use crate::topology::{Neighbors, Owners};
use tetdb_schema::catalog::{NeighborRow, Stage, StoreState, TopologyRow};

/// What a worker needs to bisect a part.
pub(in crate::pipeline) struct CutJob {
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
pub(in crate::pipeline) struct Divided {
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
    /// Cut and number of the faces it took over from its parent, and on which side of those cuts it is.
    inherited: Vec<(u32, u32, u32)>,
}

impl CutJob {
    /// Does the whole job; a failed page access ends here.
    pub(in crate::pipeline) fn run(
        self,
        common: Common,
        watch: &Watcher,
    ) -> Result<Divided, PipelineError> {
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
            kept.keep(&mut host, Stage::Coarse, &mut stages, watch)?;
        }
        let refined = bisect::refine(&mut host, &plan, &space, &progress)?;
        if let Some(kept) = &self.kept {
            kept.keep(&mut host, Stage::Refined, &mut stages, watch)?;
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
                inherited.push((face.cut, face.index, face.side));
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
    pub(in crate::pipeline) fn divide_all(&mut self) -> Result<Vec<CutReport>, PipelineError> {
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
        let faces = opened.report.interface.chosen.faces as u32;
        let (low_name, high_name) = (low.mesh.part.first, high.mesh.part.first);
        let mut neighbors = neighbors_of(&self.catalog.topology()?);
        let mut owners = BTreeMap::from([(cut, Owners::new(faces, low_name, high_name))]);
        neighbors.set(low_name, high_name, u64::from(faces));
        for &(cut, index, side) in &high.inherited {
            let table = match owners.entry(cut) {
                Entry::Occupied(entry) => entry.into_mut(),
                Entry::Vacant(entry) => entry.insert(read_owners(self.catalog, cut)?),
            };
            let other = table.other(index, side).ok_or_else(|| {
                StoreError::Sealed(SealedError::Content {
                    path: self.catalog.dir().to_owned(),
                    subdomain: low_name,
                    what: format!("face {index} of cut {cut} has no owner"),
                })
            })?;
            table.faces[index as usize][side as usize] = high_name;
            neighbors.remove(low_name, other);
            neighbors.add(high_name, other);
        }
        // Who was a neighbor of the parent is one of a child: no other row changes.
        let mut names: Vec<u32> = neighbors.of(low_name).iter().map(|n| n.0).collect();
        names.extend(neighbors.of(high_name).iter().map(|n| n.0));
        names.extend([low_name, high_name]);
        names.sort_unstable();
        names.dedup();
        let report = opened.report;
        let interface = report.interface;
        let measures = [
            ("cut", f64::from(cut)),
            ("zone_vertices", report.refine.inserted as f64),
            ("zone_rejects", report.refine.out_of_place as f64),
            ("frozen_hits", report.refine.frozen_hits as f64),
            ("free_tets", interface.free_tets as f64),
            ("moves", interface.moves as f64),
            ("natural_faces", interface.natural.faces as f64),
            ("minimum_faces", interface.minimum.faces as f64),
            ("interface_faces", interface.chosen.faces as f64),
            ("natural_face_quality", interface.natural.quality_mean()),
            ("interface_face_quality", interface.chosen.quality_mean()),
            (
                "natural_over_constrained",
                interface.natural.over_constrained as f64,
            ),
            ("over_constrained", interface.chosen.over_constrained as f64),
            ("at_surface", interface.chosen.at_surface as f64),
            ("natural_pinched", interface.natural.pinched as f64),
            ("pinched", interface.chosen.pinched as f64),
            ("z_tets", report.z_tets as f64),
            ("z_enclosed", report.z_enclosed as f64),
            (
                "layers_least",
                report.layers_least.map_or(f64::INFINITY, f64::from),
            ),
            ("choice_bytes", interface.bytes as f64),
            ("plane_s", report.seconds.plane),
            ("zone_s", report.seconds.zone),
            ("core_s", report.seconds.core),
            ("interface_s", report.seconds.interface),
            ("load_low", report.plane.load[0]),
            ("load", report.plane.load[1]),
            ("pages_read", divided.pages.pages_read as f64),
            ("pages_written", divided.pages.pages_written as f64),
            ("frames_used", divided.frames_used as f64),
        ];
        let mut row = journal(StoreState::Bisected, "bisect", divided.clock, &measures);
        row.subdomain = Some(low_name);
        self.catalog.commit(|step| {
            for child in children {
                step.list_file(child.mesh.part.first, child.mesh.generation);
                let number = blob::PART + child.mesh.part.first;
                step.set_blob(number, &child.mesh.to_bytes());
            }
            step.unlist_file(parent.part.first, parent.generation);
            stages.describe(&opened.zone, step);
            step.set_blob(blob::CUT + cut, &tree::plane_bytes(&opened.zone.surface));
            for (cut, table) in &owners {
                step.set_blob(blob::OWNERS + cut, &table.to_bytes());
            }
            for &name in &names {
                step.set_topology(&topology_row(&neighbors, name));
            }
            step.set_state(StoreState::Bisected);
            step.append_journal(&row);
            Ok(())
        })?;
        self.pages.add(divided.pages);
        self.frames_used = self.frames_used.max(divided.frames_used);
        Ok([low.mesh, high.mesh])
    }
}

fn neighbors_of(rows: &[TopologyRow]) -> Neighbors {
    let mut neighbors = Neighbors::default();
    for row in rows {
        for neighbor in &row.neighbors {
            neighbors.set(row.subdomain, neighbor.subdomain, neighbor.faces);
        }
    }
    neighbors
}

fn topology_row(neighbors: &Neighbors, name: u32) -> TopologyRow {
    let of = neighbors.of(name).into_iter();
    TopologyRow {
        subdomain: name,
        neighbors: of
            .map(|(subdomain, faces)| NeighborRow { subdomain, faces })
            .collect(),
    }
}
