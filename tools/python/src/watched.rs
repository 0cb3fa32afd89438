//! Work without the interpreter's lock, while the calling thread looks after signals and reports progress.

use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;
use tetdb::{CancelToken, Event};

use crate::failure::Failure;

/// How often signals are looked for and progress is reported.
const PERIOD: Duration = Duration::from_millis(50);
/// As a program's first thread has.
const STACK_BYTES: usize = 8 << 20;

/// What a run has said and nobody has read yet: of progress only the last.
#[derive(Default)]
pub struct Board {
    unread: Mutex<(Vec<Event>, Option<Event>)>,
}

impl Board {
    pub fn listener(self: &Arc<Self>) -> impl Fn(&Event) + Send + Sync + 'static {
        let board = Arc::clone(self);
        move |event| {
            let mut unread = board.unread.lock().unwrap_or_else(PoisonError::into_inner);
            match event {
                Event::Progress { .. } => unread.1 = Some(event.clone()),
                _ => unread.0.push(event.clone()),
            }
        }
    }

    fn take(&self) -> Vec<Event> {
        let mut unread = self.unread.lock().unwrap_or_else(PoisonError::into_inner);
        let (mut events, last) = std::mem::take(&mut *unread);
        events.extend(last);
        events
    }
}

/// A Python callable `(kind, text, done, total, unit)` and the board it reads from.
pub struct Listener<'a> {
    pub board: &'a Board,
    pub callable: Option<&'a Py<PyAny>>,
}

impl Listener<'_> {
    fn read(&self, py: Python<'_>) -> PyResult<()> {
        let events = self.board.take();
        let Some(callable) = self.callable else {
            return Ok(());
        };
        for event in events {
            match event {
                Event::Progress { stage, done, total, unit } => {
                    callable.call1(py, ("progress", stage, done, total, unit))?
                }
                Event::Note(text) => say(py, callable, "note", &text)?,
                Event::Warning(text) => say(py, callable, "warning", &text)?,
                Event::SizeWarning(warning) => say(py, callable, "warning", &warning.to_string())?,
                Event::SurfaceMissing => say(
                    py,
                    callable,
                    "note",
                    "the surface is not where it was; the mesh is verified without it",
                )?,
                Event::StoreBegun(path) => say(py, callable, "store", &path.to_string_lossy())?,
                _ => continue,
            };
        }
        Ok(())
    }
}

fn say(py: Python<'_>, callable: &Py<PyAny>, kind: &str, text: &str) -> PyResult<Py<PyAny>> {
    callable.call1(py, (kind, text, 0, None::<u64>, ""))
}

/// Does `work` on a thread of its own, without the interpreter's lock.
///
/// A signal whose handler raises, or a listener that does, cancels `token`; the work then ends at its last finished step, and what was
/// raised is raised here.
pub fn watched<T: Send>(
    py: Python<'_>,
    token: &CancelToken,
    listener: Option<&Listener<'_>>,
    work: impl FnOnce() -> Result<T, Failure> + Send,
) -> PyResult<T> {
    let mut raised: Option<PyErr> = None;
    let look = |py: Python<'_>| {
        py.check_signals()?;
        listener.map_or(Ok(()), |listener| listener.read(py))
    };
    let done = py.detach(|| {
        std::thread::scope(|scope| {
            let (end, ended) = channel::<()>();
            let worker = std::thread::Builder::new().stack_size(STACK_BYTES);
            let worker = worker.spawn_scoped(scope, move || {
                let _end = end;
                work()
            });
            let Ok(worker) = worker else {
                return Err(Failure::internal("the system gives no thread"));
            };
            while ended.recv_timeout(PERIOD) == Err(RecvTimeoutError::Timeout) {
                if raised.is_none()
                    && let Err(error) = Python::attach(look)
                {
                    token.cancel();
                    raised = Some(error);
                }
            }
            let panicked = |_| Err(Failure::internal("a thread panicked"));
            worker.join().unwrap_or_else(panicked)
        })
    });
    if let Some(error) = raised {
        token.reset();
        return Err(error);
    }
    let done = done.map_err(|failure| failure.raised(py))?;
    // The last notes come after the last look.
    listener.map_or(Ok(()), |listener| listener.read(py))?;
    Ok(done)
}
