//! One bisection as a step: the part's file in, the files of its two children out, one commit.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::PathBuf;
use std::time::Instant;

use super::PipelineError;
use super::run::{Run, file_backing, journal, remove};
use super::tree::{self, Part, PartMesh, blob};
use super::watch::Event;
use crate::bisect::{self, CutPlan, CutReport, Opened, PlaneChoice, Steps};
use crate::catalog::{CatalogError, NeighborRow, StoreState, TopologyRow};
use crate::mesh::{Mesh, Workspace};
use crate::optimize::Settings;
use crate::store::{Backing, Pager, PagerStats, StoreFile};
use crate::topology::{Neighbors, Owners};

/// Generations a bisection is on: what it changes in place, and what it leaves.
pub(super) const WORK: u32 = 1;
pub(super) const DONE: u32 = 2;

/// A child as its file holds it.
struct Child {
    mesh: PartMesh,
    /// Cut and number of the faces it took over from its parent, and on which side of those cuts it is.
    inherited: Vec<(u32, u32, u32)>,
    stats: PagerStats,
}

impl Run<'_> {
    /// Bisects `parent`; returns how the cut went.
    pub(super) fn divide(&mut self, parent: PartMesh) -> Result<CutReport, PipelineError> {
        let clock = Instant::now();
        let part = parent.part;
        let cut = part.cut();
        let zones = tree::zones_above(self.catalog, part, self.n)?;
        let mut host = self.reopen(parent, self.plan.frames / 2)?;
        let scratch = self.catalog.scratch_dir()?;
        let space = Workspace {
            dir: &scratch,
            memory: self.plan.buffers / 2,
        };
        let core_path = scratch.join(format!("core-{cut}.redb"));
        let mut core = Mesh::new(Pager::new(
            self.plan.frames / 4,
            Some(file_backing(part.first, 0, core_path, &self.plan, 4)),
        ));
        let field = self.field;
        let mode = self.optimize_mode()?;
        let plan = CutPlan {
            cut,
            low: part.low_share(),
            choice: PlaneChoice::default(),
            earlier: &zones,
            h: &|p| field.h(p),
            bounds: self.bounds,
            optimize: Settings::of(mode),
            steps: Steps::default(),
        };
        let watch = self.watch;
        let opened = bisect::open(&mut host, &mut core, &plan, &space, &|stage, done| {
            watch(Event {
                stage,
                done,
                total: None,
                unit: "vertices",
            });
        })?;
        let mut children = Vec::with_capacity(2);
        for child in part.children() {
            let generation = parent.generation + DONE;
            let made = self.child((&mut host, &mut core), &opened, child, generation, &space)?;
            children.push(made);
        }
        let host_stats = host.pages().stats();
        for mesh in [host, core] {
            if let Some(path) = mesh.into_pages().discard() {
                remove(&path)?;
            }
        }
        self.pages.add(host_stats);
        for child in &children {
            self.pages.add(child.stats);
        }
        self.commit_children(parent, &opened, &children, clock)?;
        Ok(opened.report)
    }

    fn child(
        &mut self,
        (host, core): (&mut Mesh, &mut Mesh),
        opened: &Opened,
        part: Part,
        generation: u32,
        space: &Workspace,
    ) -> Result<Child, PipelineError> {
        let path = self.catalog.file_path(part.first, generation);
        let backing = file_backing(part.first, generation, path, &self.plan, 2);
        let mut mesh = Mesh::new(Pager::new(self.plan.frames / 4, Some(backing)));
        let high = part.first == opened.zone.cut;
        bisect::write_child(host, core, &mut mesh, opened, high, &self.bounds, space)?;
        mesh.pages_mut().flush();
        let mut inherited = Vec::new();
        for n in 0..mesh.n_interface_faces() {
            let face = mesh.interface_face(n);
            if face.cut != opened.zone.cut {
                inherited.push((face.cut, face.index, face.side));
            }
        }
        inherited.sort_unstable();
        let [below, all] = opened.report.plane.load;
        let load = if high { all - below } else { below };
        let part_mesh = PartMesh {
            part,
            generation,
            state: mesh.state(),
            extents: mesh.pages().extents(),
            load,
        };
        let pager = mesh.into_pages();
        let stats = pager.stats();
        pager.discard();
        Ok(Child {
            mesh: part_mesh,
            inherited,
            stats,
        })
    }

    fn commit_children(
        &mut self,
        parent: PartMesh,
        opened: &Opened,
        children: &[Child],
        clock: Instant,
    ) -> Result<(), PipelineError> {
        let cut = opened.zone.cut;
        let [low, high] = [&children[0], &children[1]];
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
            let other = table
                .other(index, side)
                .ok_or_else(|| CatalogError::Content {
                    path: self.catalog.dir().to_owned(),
                    subdomain: low_name,
                    what: format!("face {index} of cut {cut} has no owner"),
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
            ("plane_s", report.seconds.plane),
            ("zone_s", report.seconds.zone),
            ("core_s", report.seconds.core),
            ("interface_s", report.seconds.interface),
            ("load_low", report.plane.load[0]),
            ("load", report.plane.load[1]),
        ];
        let mut row = journal(StoreState::Bisected, "bisect", clock, &measures);
        row.subdomain = Some(low_name);
        self.catalog.commit(|step| {
            for child in children {
                step.list_file(child.mesh.part.first, child.mesh.generation);
                let number = blob::PART + child.mesh.part.first;
                step.set_blob(number, &child.mesh.to_bytes());
            }
            step.unlist_file(parent.part.first, parent.generation);
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
        Ok(())
    }

    /// The working mesh of a part, with changes going to the next generation.
    pub(super) fn reopen(&mut self, part: PartMesh, frames: u64) -> Result<Mesh, PipelineError> {
        let first = part.part.first;
        let base = self.catalog.file_path(first, part.generation);
        let work = self.catalog.file_path(first, part.generation + WORK);
        let backing = file_backing(first, part.generation + WORK, work, &self.plan, 2);
        open_part(part, base, backing, frames)
    }
}

/// Opens a part's mesh from the file `base`.
pub(super) fn open_part(
    part: PartMesh,
    base: PathBuf,
    mut backing: Backing,
    frames: u64,
) -> Result<Mesh, PipelineError> {
    backing.base = Some(StoreFile::open_repaired(
        &base,
        backing.cache_bytes / 2,
        false,
    )?);
    let mut pager = Pager::new(frames, Some(backing));
    pager.adopt(part.extents);
    Ok(Mesh::with_state(pager, part.state))
}

/// The owners of a cut's faces.
pub(super) fn read_owners(
    catalog: &mut crate::catalog::Catalog,
    cut: u32,
) -> Result<Owners, CatalogError> {
    let bytes = catalog.blob(blob::OWNERS + cut)?.unwrap_or_default();
    Owners::from_bytes(&bytes).ok_or_else(|| CatalogError::Content {
        path: catalog.dir().to_owned(),
        subdomain: cut,
        what: format!("the table of owners of cut {cut} is damaged"),
    })
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
