//! One remeshing run: jobs for workers, then one commit.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use super::fields::FieldChanges;
use super::request::Resaturation;
use super::sizes::{Recorded, Values, predicted, recorded_field, room};
use super::summary::{Forecast, ResaturateSummary, Resaturated};
use crate::pipeline::error::PipelineError;
use crate::pipeline::import::GENERATION;
use crate::pipeline::plan::{Options, Plan, REFUSED_BELOW};
use crate::pipeline::progress::{JobProgress, Watcher};
use crate::pipeline::seal::totals::{journal, sum_totals, totals_of};
use crate::pipeline::tree::{self, read_blob};
use crate::pipeline::work::coarse_snapshot::reopen;
use crate::pipeline::work::common::Common;
use crate::pipeline::work::soundness::{check_owners, panic_is_damage_of};
use crate::pipeline::work::subdomain::{FinishedSubdomain, SubdomainJob};
use crate::pipeline::workers::{WorkerFn, map_bounded};
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::{Backing, Budget, DiskPath, attempt, available_bytes};
use tetdb_kernel::mesh::Workspace;
use tetdb_kernel::sizing::{BackgroundMesh, SizeField};
use tetdb_schema::blob::{Blob, BlobContent};
use tetdb_schema::catalog::{CoarseRow, StoreState, SubdomainRow, VersionRow};
use tetdb_schema::field::FieldPart;
use tetdb_schema::row::RowKind;
use tetdb_schema::topology::FaceOwners;
use tetdb_schema::tree::{MeshState, RankRange, SubtreeMesh};
use tetdb_store::sealed::SealedError;
use tetdb_store::sealed::{CoarseSnapshot, Form};
use tetdb_store::store::{BEFORE, Catalog, StoreError};

/// State of one remeshing run.
pub struct RemeshRun<'a> {
    pub catalog: &'a mut Catalog,
    options: &'a Options,
    what: &'a Resaturation,
    /// The recorded size field of the whole mesh.
    pub field: Arc<SizeField>,
    /// Rows of the sub-domains to remesh, by rank.
    rows: Vec<(SubdomainRow, Option<CoarseRow>)>,
    /// True if the store was imported: a sub-domain may have no coarse snapshot yet.
    is_imported: bool,
    /// The latest generation of each sub-domain's files.
    last: BTreeMap<u32, u32>,
    /// Number of recorded steps. New generations depend on it, so that none occurs twice, not even that of a file that was
    /// undone. A reader may still look for such a file.
    steps: u32,
    n: u32,
    clock: Instant,
}

/// Job that remeshes one sub-domain.
struct RemeshJob {
    subdomain: SubdomainJob,
    kept: CoarseRow,
    path: DiskPath,
}

impl RemeshJob {
    fn run(self, common: Common, watch: &Watcher) -> Result<FinishedSubdomain, PipelineError> {
        let Self { subdomain, kept, path } = self;
        let (share, generation) = (subdomain.share, subdomain.generation);
        let (rank, scratch) = (kept.rank, subdomain.scratch.clone());
        let open = || {
            let backing = Backing {
                subdomain: rank,
                generation,
                spill: scratch.clone(),
                output: None,
                base: None,
                cache_bytes: share.redb as usize,
            };
            let space = Workspace { dir: &scratch, memory: share.buffers / 2 };
            let mut kept = CoarseSnapshot::open(&path, kept, (share.redb / 2) as usize)?;
            reopen(&mut kept, backing, share.frames, &space)
        };
        attempt(|| {
            panic_is_damage_of((&path, rank), open, || {
                let mut mesh = open()?;
                check_owners(&mut mesh, &subdomain.owners, (&path, rank))?;
                subdomain.finish(mesh, common, watch)
            })
        })?
    }
}

impl<'a> RemeshRun<'a> {
    pub fn open(
        catalog: &'a mut Catalog,
        options: &'a Options,
        what: &'a Resaturation,
        budget: &Budget,
    ) -> Result<Self, PipelineError> {
        let clock = Instant::now();
        let (mut rows, is_imported) = (Vec::new(), catalog.job()?.is_imported());
        for &rank in &what.ranks {
            let row = catalog.subdomain(rank)?;
            let kept = catalog.coarse_snapshot(rank)?;
            // The mesh of the file is not that of the snapshot made later.
            let is_of_file = is_imported && row.generation == GENERATION;
            if is_of_file && what.repair || kept.is_none() && !is_imported {
                let (path, subdomain) = (catalog.dir().to_owned(), rank);
                return Err(StoreError::NoCoarseSnapshot { path, subdomain }.into());
            }
            rows.push((row, kept));
        }
        let mut last = BTreeMap::new();
        for file in catalog.files()? {
            let newest = last.entry(file.subdomain).or_insert(file.generation);
            *newest = file.generation.max(*newest);
        }
        Ok(Self {
            field: Arc::new(recorded_field(catalog, options, &room(catalog, budget)?)?),
            last,
            steps: catalog.journal()?.len() as u32,
            n: tree::recorded_n_subdomains(catalog)?,
            catalog,
            options,
            what,
            rows,
            is_imported,
            clock,
        })
    }

    /// Returns the field of each remeshed sub-domain; `None` for that of the whole.
    pub fn fields(
        &mut self,
        budget: &Budget,
    ) -> Result<BTreeMap<u32, Option<SizeField>>, PipelineError> {
        let memory = budget.available() / 4;
        let mut fields = BTreeMap::new();
        let values = self.what.sizes.as_ref().and_then(|s| s.values.as_ref());
        if let Some(values) = values {
            self.count(values)?;
        }
        let _lease = match &self.what.sizes {
            Some(_) => Some(budget.lease(self.field_bytes(values), "building size fields")?),
            None => None,
        };
        let room = room(self.catalog, budget)?;
        let recorded = Recorded { whole: &self.field, room: &room };
        let mut from = 0;
        for (row, _) in &self.rows {
            let field = match &self.what.sizes {
                Some(sizes) => {
                    let first = from;
                    from += match values {
                        Some(Values::Nearest(_)) => row.vertices,
                        _ => row.tets,
                    } as usize;
                    recorded.build_new(self.catalog, row.rank, sizes, first, memory)?
                }
                None => recorded.own(self.catalog, row.rank)?,
            };
            fields.insert(row.rank, field);
        }
        Ok(fields)
    }

    /// Bytes for building the fields one after another, besides the arrays, which go to scratch files if they are too large.
    fn field_bytes(&self, values: Option<&Values>) -> u64 {
        /// Bytes per point of the skin, with its size and its places in lists; per face; per leaf of the octree while it is
        /// built.
        const POINT: u64 = 24 + 40;
        const FACE: u64 = 12;
        const LEAF: u64 = 16;
        let one = |(row, kept): &(SubdomainRow, Option<CoarseRow>)| {
            let [low, high] = row.bounds.map(Point::from_array);
            let leaves = self.field.n_leaves_in(&Aabb { low, high }) as u64;
            let faces = row.facets + row.interface_faces;
            let vertices = kept.map_or(faces.min(row.vertices), |kept| kept.vertices);
            let skin = POINT * vertices + FACE * faces + LEAF * leaves;
            match values {
                Some(Values::Nearest(_)) => skin + BackgroundMesh::bytes(row.vertices, 0),
                Some(_) => skin + BackgroundMesh::bytes(row.vertices, row.tets),
                None => skin,
            }
        };
        let most = self.rows.iter().map(one).max().unwrap_or(0);
        self.field.bytes() as u64 + most + values.map_or(0, Values::bytes)
    }

    /// Checks the number of lengths. Errors: not one for each tetrahedron or vertex.
    fn count(&self, values: &Values) -> Result<(), PipelineError> {
        let tets: u64 = self.rows.iter().map(|(row, _)| row.tets).sum();
        let vertices = match (values, &self.rows[..]) {
            (Values::Nearest(_), rows) => rows.iter().map(|(row, _)| row.vertices).sum(),
            (_, [(row, _)]) => row.vertices,
            _ => 0,
        };
        let (found, expected) = match values {
            Values::Tets(h) => (h.len() as u64, tets),
            Values::Vertices(h) => (h.len() as u64, vertices),
            Values::Nearest(h) => (h.len() as u64, vertices),
        };
        match found == expected {
            true => Ok(()),
            false => Err(PipelineError::SizeCount { found, tets, vertices }),
        }
    }

    /// Predicts the numbers of tetrahedra with these fields.
    pub fn forecast(
        &mut self,
        fields: &BTreeMap<u32, Option<SizeField>>,
        budget: &Budget,
    ) -> Result<Vec<Forecast>, PipelineError> {
        let room = room(self.catalog, budget)?;
        let recorded = Recorded { whole: &self.field, room: &room };
        let memory = budget.available() / 4;
        let mut list = Vec::new();
        for (row, _) in &self.rows {
            let predicted = match (&self.what.sizes, &fields[&row.rank]) {
                (Some(_), Some(new)) => {
                    let old = recorded.own(self.catalog, row.rank)?;
                    let old = old.as_ref().unwrap_or(&self.field);
                    predicted(self.catalog, row.rank, [old, new], memory)?
                }
                _ => row.tets as f64,
            };
            list.push(Forecast { rank: row.rank, tets: row.tets, predicted });
        }
        Ok(list)
    }

    /// Refuses new files that the disk is not expected to hold; the old ones stay until the commit, and as a version after it.
    fn check_disk(&self, forecast: &[Forecast]) -> Result<(), PipelineError> {
        let of = |((row, _), new): (&(SubdomainRow, _), &Forecast)| {
            row.bytes as f64 * new.predicted / row.tets.max(1) as f64
        };
        let needed: f64 = self.rows.iter().zip(forecast).map(of).sum();
        match available_bytes(self.catalog.dir()) {
            Some(free) if (free as f64) < REFUSED_BELOW * needed => Err(PipelineError::NoRoom {
                tets: forecast.iter().map(|new| new.predicted).sum(),
                needed: needed as u64,
                free,
            }),
            _ => Ok(()),
        }
    }

    pub fn run(
        &mut self,
        fields: BTreeMap<u32, Option<SizeField>>,
        budget: &Budget,
        watch: &Watcher,
    ) -> Result<ResaturateSummary, PipelineError> {
        let forecast = self.forecast(&fields, budget)?;
        self.check_disk(&forecast)?;
        let of = |field: &SizeField| field.bytes() as u64;
        let own: u64 = fields.values().flatten().map(of).sum();
        let sizes = self.what.sizes.as_ref();
        let requested = sizes.and_then(|s| s.field.as_ref()).map_or(0, of)
            + sizes.and_then(|s| s.base.as_ref()).map_or(0, of)
            + sizes.and_then(|s| s.values.as_ref()).map_or(0, Values::bytes);
        // The fields of the sub-domains are also held as bytes until they are committed.
        let made: BTreeMap<u32, Vec<u8>> = (fields.iter())
            .filter_map(|(&rank, field)| Some((rank, field.as_ref()?.to_bytes())))
            .filter(|_| self.what.sizes.is_some())
            .collect();
        let encoded: u64 = made.values().map(|bytes| bytes.len() as u64).sum();
        let held = own + encoded + of(&self.field) + requested;
        let _fields = budget.lease(held, "the size fields")?;
        let plan = Plan::new(budget.cap(), held)?;
        let leased = plan.frames + plan.redb + plan.redb / 2 + plan.buffers;
        let lease = budget.lease(leased, "the working mesh")?;
        let bounds = tree::bounds(self.catalog)?;
        let workers = plan.workers().min(self.rows.len()).max(1);
        let share = plan.shared_by(workers as u64).without_file();
        let whole = Arc::clone(&self.field);
        let common = Common::new(self.options, &whole, bounds);
        let tets = self.rows.iter().map(|(row, _)| row.tets).sum::<u64>().max(1);
        let per_cent = 100.0 / tets as f64;
        let work: BTreeMap<u32, f64> =
            self.rows.iter().map(|(row, _)| (row.rank, row.tets as f64 * per_cent)).collect();
        let progress = JobProgress::new("mesh sub-domains again", "%", [0.0, 100.0]);
        let mut state = (self, BTreeMap::new());
        let run = &|job: RemeshJob, watch: &Watcher| {
            let job_of_all = (job.kept.rank, work[&job.kept.rank]);
            let done = match work.len() {
                1 => job.run(common, watch)?,
                _ => job.run(common, &|event| progress.heard(job_of_all, event, watch))?,
            };
            progress.finished(job_of_all, watch);
            Ok(Box::new(done))
        };
        map_bounded(
            &mut state,
            fields.into_iter().collect(),
            &vec![run as WorkerFn<RemeshJob, Box<FinishedSubdomain>>; workers],
            watch,
            |(again, _), (rank, field)| again.job(rank, field, share),
            |(_, finished), subdomain| {
                finished.insert(subdomain.sealed.row.rank, *subdomain);
                Ok(())
            },
        )?;
        let (again, finished) = state;
        drop(lease);
        again.commit(finished, &made, (budget.available(), watch))
    }

    fn job(
        &mut self,
        rank: u32,
        field: Option<SizeField>,
        share: Plan,
    ) -> Result<RemeshJob, PipelineError> {
        let ranks = RankRange { first: rank, count: 1 };
        let mut owners = BTreeMap::new();
        for cut in ranks.cuts_above(self.n) {
            // Cuts of an imported store may have no faces.
            if !self.is_imported || self.catalog.blob(Blob::FaceOwners(cut))?.is_some() {
                let table: FaceOwners = read_blob(self.catalog, Blob::FaceOwners(cut))?;
                owners.insert(cut, table.across(rank));
            }
        }
        // Interface faces stay. A sub-domain with a field of its own may be refined up to them, as may any between which no cut was made.
        let zones = match field.is_some() || self.is_imported {
            true => Vec::new(),
            false => tree::zones_above(self.catalog, ranks, self.n)?,
        };
        let found = self.rows.iter().find(|(row, _)| row.rank == rank);
        let (row, kept) = found.expect("requested");
        let (row, kept) = (row.clone(), kept.expect("made before the run"));
        let last = self.last.get(&rank).copied().unwrap_or(0);
        let generation = last + 2 + 2 * self.steps;
        let scratch = self.catalog.scratch_dir()?.join(format!("leaf-{rank}"));
        scratch.create_dir_all()?;
        let subdomain = SubdomainJob {
            // The snapshot has its own counts.
            mesh: SubtreeMesh {
                ranks,
                generation,
                state: MeshState::default(),
                extents: Default::default(),
                load: 0.0,
            },
            base: self.catalog.coarse_path(rank, kept.generation),
            sealed: self.catalog.file_path(rank, generation),
            generation,
            // The storage form stays.
            form: Form::from_state(row.state).unwrap_or_default(),
            field,
            kept: None,
            scratch,
            zones: zones.into_iter().map(Into::into).collect(),
            owners,
            share,
        };
        Ok(RemeshJob { subdomain, kept, path: self.catalog.coarse_path(rank, kept.generation) })
    }

    fn commit(
        &mut self,
        finished: BTreeMap<u32, FinishedSubdomain>,
        made: &BTreeMap<u32, Vec<u8>>,
        (memory, watch): (u64, &Watcher),
    ) -> Result<ResaturateSummary, PipelineError> {
        let mut totals = BTreeMap::new();
        let mut is_new = self.what.repair;
        for (row, _) in &self.rows {
            let (rank, sealed) = (row.rank, &finished[&row.rank].sealed);
            // Interface faces stay under any sizes, and a repair must restore the whole sub-domain. Otherwise the coarse snapshot
            // is a different one.
            let has_other_faces = sealed.row.interface_digest != row.interface_digest;
            let has_other_chunks = sealed.row.chunks != row.chunks;
            let is_same = sealed.row.digest == row.digest
                && !(has_other_chunks && has_values(self.catalog, row)?);
            if has_other_faces || self.what.repair && !is_same {
                return Err(StoreError::Sealed(SealedError::Content {
                    path: self.catalog.dir().to_owned(),
                    subdomain: rank,
                    what: match sealed.row.digest == row.digest {
                        true => "meshed again, it is packed otherwise than the values of its fields; drop the fields and versions with them first",
                        false => "meshed again, it is not what the catalog says it was",
                    }
                    .to_owned(),
                })
                .into());
            }
            is_new |= sealed.row.digest != row.digest;
            let own = made.get(&rank);
            is_new |=
                own.is_some() && own != self.catalog.blob(Blob::SubdomainField(rank))?.as_ref();
            totals.insert(rank, totals_of(sealed));
        }
        if !is_new {
            return self.leave(finished);
        }
        let regions = sum_totals(self.catalog, self.n, &totals)?.regions;
        let changed =
            |(row, _): &(SubdomainRow, _)| [row.clone(), finished[&row.rank].sealed.row.clone()];
        let changed: Vec<[SubdomainRow; 2]> = self.rows.iter().map(changed).collect();
        let versions = match self.what.repair {
            true => self.catalog.versions_with(&changed)?,
            false => vec![(BEFORE, self.catalog.version_now(VersionRow::default())?)],
        };
        // The step holds copies of these.
        let copies: u64 = versions.iter().map(|(_, new)| 2 * new.bytes()).sum();
        let memory = memory.saturating_sub(copies);
        let fields = match (self.what.drop_fields, self.what.repair) {
            (true, _) => FieldChanges::drop_all(self.catalog)?,
            (false, true) => FieldChanges::keep(self.catalog, &changed)?,
            (false, false) => FieldChanges::evaluate(self.catalog, &changed, memory, watch)?,
        };
        let (what, rows, clock) = (self.what, &self.rows, self.clock);
        let requested = what.sizes.as_ref().map(|sizes| sizes.requested.as_bytes());
        let step_name = match what.repair {
            true => "repair",
            false => "resaturate",
        };
        self.catalog.commit(|step| {
            versions.iter().for_each(|(number, version)| step.set_version(*number, version));
            for (row, _) in rows {
                let (rank, subdomain) = (row.rank, &finished[&row.rank]);
                step.list_file(rank, subdomain.sealed.row.generation);
                step.set_subdomain(&subdomain.sealed.row);
                step.set_blob(Blob::Totals(rank), &totals[&rank].to_bytes());
                step.unlist_file(rank, row.generation);
                if let (Some(field), Some(requested)) = (made.get(&rank), requested) {
                    step.set_blob(Blob::SubdomainField(rank), field);
                    step.set_blob(Blob::Request(rank), requested);
                }
                let refine = &subdomain.fine.refine;
                let measures = [
                    ("tets_before", row.tets as f64),
                    ("tets", subdomain.sealed.row.tets as f64),
                    ("inserted_vertices", refine.inserted as f64),
                    ("frozen_hits", refine.frozen_hits as f64),
                    ("pages_read", subdomain.pages.pages_read as f64),
                    ("pages_written", subdomain.pages.pages_written as f64),
                ];
                let since = if finished.len() == 1 { clock } else { subdomain.clock.begun() };
                let mut journal = journal(StoreState::Sealed, step_name, since, &measures);
                journal.subdomain = Some(rank);
                step.append_journal(&journal);
            }
            fields.list(step);
            step.set_regions(&regions);
            step.set_state(StoreState::Sealed);
            Ok(())
        })?;
        Ok(ResaturateSummary { fields: fields.evaluated, ..self.summary(finished) })
    }

    /// Handles an unchanged result: drops the new files. The version before the last change can still be restored.
    fn leave(
        &mut self,
        mut finished: BTreeMap<u32, FinishedSubdomain>,
    ) -> Result<ResaturateSummary, PipelineError> {
        for (row, _) in &self.rows {
            let subdomain = finished.get_mut(&row.rank).expect("made for each");
            let path = self.catalog.file_path(row.rank, subdomain.sealed.row.generation);
            // The file is not listed, so the next writer removes it if this removal fails.
            let _ = path.remove_file();
            subdomain.sealed.row = row.clone();
        }
        Ok(self.summary(finished))
    }

    fn summary(&self, finished: BTreeMap<u32, FinishedSubdomain>) -> ResaturateSummary {
        if let Ok(scratch) = self.catalog.scratch_dir() {
            // The scratch folder has no data of the store.
            let _ = scratch.remove_dir_all();
        }
        let mut summary = ResaturateSummary::default();
        for ((before, _), subdomain) in self.rows.iter().zip(finished.into_values()) {
            summary.pages.add(subdomain.pages);
            summary.frames_used = summary.frames_used.max(subdomain.frames_used);
            summary.parts.push(Resaturated {
                before: before.clone(),
                after: subdomain.sealed.row,
                fine: Some(subdomain.fine),
            });
        }
        summary
    }
}

/// Returns whether fields have values on this mesh, now or in a version. They lie as its chunks do.
fn has_values(catalog: &mut Catalog, row: &SubdomainRow) -> Result<bool, StoreError> {
    let parts: Vec<FieldPart> = catalog.everywhere(RowKind::FieldPart)?;
    Ok(parts.iter().any(|part| (part.rank, part.generation) == (row.rank, row.generation)))
}
