//! Orders and receipts as messages: one process holds the store's lock, and others perform its orders.

use std::path::Path;
use std::sync::mpsc::channel;
use std::time::Duration;
use tetdb_schema::code::Code;

use super::folder::{Patience, TaskFolder, attempt_name, copy, damaged, scratch_in};
use super::perform::TaskSettings;
use crate::pipeline::error::PipelineError;
use crate::pipeline::plan::{MeshOptions, Options, Plan, RECIPE};
use crate::pipeline::progress::Watcher;
use crate::pipeline::tree::corners;
use crate::pipeline::work::common::Common;
use crate::pipeline::work::{Worker, WorkerPool, Workplace};
use tetdb_base::geom::{Aabb, Point};
use tetdb_base::storage::RemoteFailure;
use tetdb_base::storage::{Budget, DiskPath, RunContext, ScratchSpace, attempt};
use tetdb_kernel::sizing::SizeField;
use tetdb_schema::blob::Blob;
use tetdb_schema::work::{Receipt, RunRecord, WorkKind, WorkOrder, from_bytes, to_bytes};
use tetdb_store::store::Catalog;

/// Longest wait for late files of other machines.
const WAIT: Duration = Duration::from_secs(60);

/// Starts the remote workers; returns the number of orders they perform at once. Effects: writes the size field to the store's
/// folder of tasks. Errors: the disk; those of the remote workers.
pub fn begin(
    pool: &dyn WorkerPool,
    catalog: &mut Catalog,
    options: &Options,
    bounds: &Aabb,
) -> Result<usize, PipelineError> {
    let dir = std::path::absolute(catalog.dir()).unwrap_or_else(|_| catalog.dir().to_owned());
    let field = catalog.blob(Blob::SizeField)?.unwrap_or_default();
    let folder = TaskFolder::of(catalog.work_dir());
    folder.dir.create_dir_all()?;
    folder.set_field(&field)?;
    let run = RunRecord {
        recipe: RECIPE,
        store: dir.to_string_lossy().into_owned(),
        bounds: corners(bounds),
        options: serde_json::to_string(&options.mesh).unwrap_or_default(),
    };
    Ok(pool.begin(&to_bytes(WorkKind::Plan, &run))?)
}

/// Sends an order to a remote worker; returns its receipt once the written files are visible. Errors: those of the remote worker;
/// a receipt that cannot be read; a missing file.
pub fn ask(
    pool: &dyn WorkerPool,
    slot: usize,
    order: &WorkOrder,
    store: &DiskPath,
) -> Result<Receipt, PipelineError> {
    let bytes = pool.perform(slot, to_bytes(WorkKind::Orders, order))?;
    let receipt: Receipt = from_bytes(WorkKind::Receipts, &bytes)
        .map_err(|e| damaged(store, &format!("a receipt: {e}")))?;
    let patience = Patience::of(WAIT);
    for name in receipt.files() {
        wait_for(&store.join(name), patience)?;
    }
    Ok(receipt)
}

/// Error for a receipt of another kind than its order.
pub fn wrong_receipt() -> PipelineError {
    PipelineError::Helper(RemoteFailure {
        code: Code::Internal,
        message: "a helper's receipt is of another kind than its order".to_owned(),
    })
}

fn wait_for(path: &DiskPath, patience: Patience) -> Result<(), PipelineError> {
    let found = patience.until(|| Ok(path.is_file().then_some(())))?;
    found.ok_or_else(|| damaged(path, "it is missing"))
}

/// Performs orders of `job` until `next` returns `None`. It calls `started` once, with the number of orders it performs at once,
/// and `answer` with the receipt or error of each order.
///
/// Shape: `next` returns an order and the slot that performs it; slots are below the number passed to `started`. Errors: a failed
/// start.
pub fn serve(
    job: &[u8],
    settings: &TaskSettings,
    budget: &Budget,
    watch: &(dyn Fn(crate::pipeline::Event) + Sync),
    started: impl FnOnce(usize),
    next: &mut dyn FnMut() -> Option<(usize, Vec<u8>)>,
    answer: &(dyn Fn(usize, Result<Vec<u8>, PipelineError>) + Sync),
) -> Result<(), PipelineError> {
    let patience = Patience::of(settings.wait);
    let store_of = |job: &RunRecord| DiskPath::from(Path::new(&job.store));
    let job: RunRecord = from_bytes(WorkKind::Plan, job)
        .map_err(|e| damaged(&DiskPath::from(Path::new(".")), &format!("the job: {e}")))?;
    let store = store_of(&job);
    if job.recipe != RECIPE {
        return Err(damaged(&store, "another version of the program holds it"));
    }
    let options: MeshOptions =
        serde_json::from_str(&job.options).map_err(|e| damaged(&store, &e.to_string()))?;
    let options = Options::from(options);
    let bounds = Aabb::around(job.bounds.map(Point::from_array));
    let name = attempt_name();
    let local = settings.scratch.as_deref().map(|dir| scratch_in(dir, &name));
    let folder = TaskFolder::of(Catalog::work_dir_at(&store));
    let scratch = match &local {
        Some(local) => local.join("scratch"),
        None => folder.dir.join(format!("scratch-{name}")),
    };
    scratch.create_dir_all()?;
    let space = ScratchSpace::new(budget.cap() / 2, &scratch);
    let bytes = folder.field(patience)?;
    let field = attempt(|| SizeField::from_bytes_in(&bytes, &space))??
        .with_sources(&options.mesh.sizes, bounds.diagonal())?;
    drop(bytes);
    let _field = budget.lease(field.bytes() as u64, "the size field")?;
    let plan = Plan::new(budget.cap(), field.bytes() as u64)?;
    let slots = plan.workers();
    let share = plan.shared_by(slots as u64);
    let worker = Worker {
        place: Workplace {
            output: local.clone().unwrap_or_else(|| store.clone()),
            store: store.clone(),
            scratch: scratch.clone(),
        },
        common: Common::new(&options, &field, bounds),
    };
    let one = |order: &[u8], watch: &Watcher| {
        attempt(|| {
            let order: WorkOrder =
                from_bytes(WorkKind::Orders, order).map_err(|e| damaged(&store, &e))?;
            let patience = Patience::of(settings.wait);
            wait_for(&store.join(order.input()), patience)?;
            let receipt = worker.perform(order, share, watch)?;
            for name in receipt.files() {
                match &local {
                    Some(local) => {
                        let here = local.join(&name);
                        copy(&here, &store.join(&name))?;
                        here.remove_file()?;
                    }
                    None => store.join(&name).sync_file()?,
                }
            }
            store.sync_dir()?;
            Ok(to_bytes(WorkKind::Receipts, &receipt))
        })?
    };
    started(slots);
    std::thread::scope(|scope| {
        let orders: Vec<_> = (0..slots)
            .map(|slot| {
                let (order, orders) = channel::<Vec<u8>>();
                let (one, context) = (&one, RunContext::current());
                scope.spawn(move || {
                    let work = || {
                        for order in orders {
                            answer(slot, one(&order, &|event| watch(event)));
                        }
                    };
                    match context {
                        Some(context) => context.enter(work),
                        None => work(),
                    }
                });
                order
            })
            .collect();
        while let Some((slot, order)) = next() {
            // A slot that has ended has answered with the reason.
            let _ = orders[slot % slots].send(order);
        }
    });
    let _ = local.unwrap_or(scratch).remove_dir_all();
    Ok(())
}
