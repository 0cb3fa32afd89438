//! The folder of tasks: its names, and file writes that complete or leave no file.

use std::collections::BTreeSet;
use std::io::{Read, Write};
use std::path::Path;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use crate::pipeline::error::PipelineError;
use crate::pipeline::plan::RECIPE;
use tetdb_base::storage::{DiskPath, StorageError, check_cancelled, host_name};
use tetdb_schema::archive::Archivable;
use tetdb_schema::work::{PlanRecord, TaskMark, WorkKind, body, from_bytes, head, to_bytes};

/// Pause between two checks for a late file.
const LOOK_AGAIN: Duration = Duration::from_millis(250);
/// Bytes copied at once.
const COPY: usize = 1 << 20;

/// Deadline for a missing file, which may only be late: other machines see new names after a delay.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patience(Option<Instant>);

impl Patience {
    pub fn of(wait: Duration) -> Self {
        Self(Instant::now().checked_add(wait))
    }

    /// Waits a little; returns false once the deadline has passed.
    fn goes_on(self) -> bool {
        check_cancelled();
        let left = self.0.and_then(|end| end.checked_duration_since(Instant::now()));
        left.is_some_and(|left| {
            std::thread::sleep(left.min(LOOK_AGAIN));
            true
        })
    }

    /// Calls `look` until it returns a value or the deadline passes.
    pub fn until<T>(
        self,
        mut look: impl FnMut() -> Result<Option<T>, StorageError>,
    ) -> Result<Option<T>, StorageError> {
        loop {
            let found = look()?;
            if found.is_some() || !self.goes_on() {
                return Ok(found);
            }
        }
    }
}

/// Returns a name that no other process on any machine uses.
pub(super) fn attempt_name() -> String {
    let host: String =
        host_name().chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    let nanos = now.unwrap_or_default().as_nanos();
    format!("{host}-{}-{nanos}", std::process::id())
}

/// The folder `work` of a store.
#[derive(Clone, Debug)]
pub(super) struct TaskFolder {
    pub dir: DiskPath,
}

impl TaskFolder {
    pub fn of(dir: DiskPath) -> Self {
        Self { dir }
    }

    pub fn plan_path(&self) -> DiskPath {
        self.dir.join("plan")
    }

    pub fn stage_path(&self) -> DiskPath {
        self.dir.join("stage")
    }

    pub fn committed_path(&self) -> DiskPath {
        self.dir.join("committed")
    }

    pub fn field_path(&self) -> DiskPath {
        self.dir.join("size-field")
    }

    pub fn orders_path(&self, task: u32) -> DiskPath {
        self.dir.join(format!("task-{task:05}.orders"))
    }

    pub fn receipts_path(&self, task: u32) -> DiskPath {
        self.dir.join(format!("task-{task:05}.receipts"))
    }

    pub fn mark_path(&self, task: u32) -> DiskPath {
        self.dir.join(format!("task-{task:05}.mark"))
    }

    /// Folder of the files of an attempt.
    pub fn files_dir(&self, attempt: &str) -> DiskPath {
        self.dir.join(format!("files-{attempt}"))
    }

    /// Reads the plan. Errors: no plan of this recipe version; damage.
    pub fn plan(&self, patience: Patience) -> Result<PlanRecord, PipelineError> {
        let path = self.plan_path();
        let no_plan = |reason: String| PipelineError::NoPlan {
            path: self.dir.folder().path().to_owned(),
            reason,
        };
        let bytes = patience
            .until(|| read(&path))?
            .ok_or_else(|| no_plan("it has no plan of tasks".to_owned()))?;
        let plan: PlanRecord =
            from_bytes(WorkKind::Plan, &bytes).map_err(|e| no_plan(format!("its plan: {e}")))?;
        match plan.recipe {
            RECIPE => Ok(plan),
            other => Err(no_plan(format!(
                "it was planned by version {other} of the recipe, this is version {RECIPE}"
            ))),
        }
    }

    /// Number of the current stage; 0 if none is recorded.
    pub fn stage(&self) -> Result<usize, StorageError> {
        let bytes = read(&self.stage_path())?.unwrap_or_default();
        let text = String::from_utf8_lossy(&bytes);
        Ok(text.trim().parse().unwrap_or(0))
    }

    /// Numbers of the committed tasks of the current stage, as of the last gathering.
    pub fn committed(&self) -> Result<BTreeSet<u32>, StorageError> {
        let bytes = read(&self.committed_path())?.unwrap_or_default();
        let text = String::from_utf8_lossy(&bytes);
        Ok(text.split_whitespace().filter_map(|word| word.parse().ok()).collect())
    }

    /// Records the current stage and its committed tasks.
    pub fn set_stage(&self, stage: usize, committed: &[u32]) -> Result<(), StorageError> {
        let words: Vec<String> = committed.iter().map(u32::to_string).collect();
        // Numbers of tasks are unique over all stages, so the order of these two writes does not matter.
        write(&self.committed_path(), &[words.join(" ").as_bytes()])?;
        write(&self.stage_path(), &[stage.to_string().as_bytes()])
    }

    pub fn mark(&self, task: u32) -> Option<TaskMark> {
        let bytes = read(&self.mark_path(task)).ok()??;
        serde_json::from_slice(&bytes).ok()
    }

    pub fn set_mark(&self, task: u32, mark: &TaskMark) -> Result<(), StorageError> {
        let text = serde_json::to_vec(mark).unwrap_or_default();
        write(&self.mark_path(task), &[&text])
    }

    /// Reads the bytes of the size field. Errors: the file is missing or damaged, with the fault in words.
    pub fn field(&self, patience: Patience) -> Result<Vec<u8>, PipelineError> {
        let path = self.field_path();
        let mut bytes =
            (patience.until(|| read(&path))?).ok_or_else(|| damaged(&path, "it is missing"))?;
        let length = body(WorkKind::SizeField, &bytes).map_err(|e| damaged(&path, &e))?.len();
        bytes.drain(..bytes.len() - length);
        Ok(bytes)
    }

    pub fn set_field(&self, field: &[u8]) -> Result<(), StorageError> {
        write(&self.field_path(), &[&head(WorkKind::SizeField, field), field])
    }
}

/// Error for a file of the folder that cannot be used.
pub(super) fn damaged(path: &DiskPath, what: &str) -> PipelineError {
    PipelineError::TaskFile { path: path.path().to_owned(), what: what.to_owned() }
}

/// Reads a whole file; `None` if it does not exist.
pub(super) fn read(path: &DiskPath) -> Result<Option<Vec<u8>>, StorageError> {
    if !path.is_file() {
        return Ok(None);
    }
    let mut bytes = Vec::new();
    let opened = path.disk().open_stream(path.path());
    match opened.and_then(|mut file| file.read_to_end(&mut bytes)) {
        Ok(_) => Ok(Some(bytes)),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(e) => Err(StorageError::io(path.path(), e)),
    }
}

/// Reads the record of a file; `None` if the file does not exist. The inner error is the fault of the record, in words.
pub(super) fn read_record<T: Archivable>(
    path: &DiskPath,
    kind: WorkKind,
) -> Result<Option<Result<T, String>>, StorageError> {
    Ok(read(path)?.map(|bytes| from_bytes(kind, &bytes)))
}

/// Writes a file completely or not at all.
pub(super) fn write(path: &DiskPath, bytes: &[&[u8]]) -> Result<(), StorageError> {
    let draft = draft_of(path);
    let written = (|| {
        let mut file = path.disk().create_stream(draft.path())?;
        bytes.iter().try_for_each(|part| file.write_all(part))?;
        file.flush()
    })();
    end_draft(&draft, path, written)
}

pub(super) fn write_record(
    path: &DiskPath,
    kind: WorkKind,
    record: &impl Archivable,
) -> Result<(), StorageError> {
    write(path, &[&to_bytes(kind, record)])
}

/// Copies a file, also to another disk.
pub(super) fn copy(from: &DiskPath, to: &DiskPath) -> Result<(), StorageError> {
    let draft = draft_of(to);
    let mut source =
        (from.disk().open_stream(from.path())).map_err(|e| StorageError::io(from.path(), e))?;
    let copied = (|| {
        let mut file = to.disk().create_stream(draft.path())?;
        let mut buffer = vec![0; COPY];
        loop {
            check_cancelled();
            match source.read(&mut buffer)? {
                0 => return file.flush(),
                n => file.write_all(&buffer[..n])?,
            }
        }
    })();
    end_draft(&draft, to, copied)
}

fn draft_of(path: &DiskPath) -> DiskPath {
    let name = path.path().file_name().unwrap_or_default().to_string_lossy();
    path.folder().join(format!("{name}.{}", attempt_name()))
}

fn end_draft(
    draft: &DiskPath,
    path: &DiskPath,
    written: std::io::Result<()>,
) -> Result<(), StorageError> {
    let done = written
        .map_err(|e| StorageError::io(path.path(), e))
        .and_then(|()| draft.sync_file())
        .and_then(|()| draft.rename(path));
    if done.is_err() {
        let _ = draft.remove_file();
    }
    done
}

/// Folder for files that only this process reads.
pub(super) fn scratch_in(dir: &Path, attempt: &str) -> DiskPath {
    DiskPath::from(dir).join(format!("tetdb-{attempt}"))
}
