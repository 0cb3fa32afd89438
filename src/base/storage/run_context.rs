//! The context of one run in a process: its threads, its cancel token, its panics.
//!
//! The context is an attribute of a thread: of the caller's thread during a call, of the run's own pool, and of the
//! workers it starts. Parallel work goes through [`parallel`], which sends it to the pool of the run instead of the
//! process's.

use std::cell::RefCell;
use std::panic::PanicHookInfo;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, Once, OnceLock, PoisonError};

use rayon::prelude::*;
use rayon::{Scope, ThreadPool, ThreadPoolBuilder};

use super::cancel_token::CancelToken;
use super::step_clock::{in_order, shared};

/// Small items that are worth handing to another thread.
const ITEMS_MIN: usize = 1024;

thread_local! {
    static CURRENT: RefCell<Option<RunContext>> = const { RefCell::new(None) };
}

/// The context of one run. Clones are the same run.
#[derive(Clone)]
pub struct RunContext {
    run: Arc<RunState>,
    /// `None` on the threads of the pool, where parallel work already runs.
    pool: Option<Arc<Pool>>,
}

struct RunState {
    cancel: CancelToken,
    panic: Mutex<Option<CaughtPanic>>,
    /// Threads outside the pool that are busy.
    busy: AtomicUsize,
}

/// A panic inside a run.
#[derive(Clone, Debug)]
pub struct CaughtPanic {
    /// The message and where it came from.
    pub message: String,
    /// True if the panic came from an assertion of redb, which means a damaged tree.
    pub is_in_redb: bool,
}

/// Threads, begun when they are first needed and ended with the run.
struct Pool {
    n_threads: usize,
    run: Arc<RunState>,
    threads: OnceLock<Option<ThreadPool>>,
    n_alive: Arc<(Mutex<usize>, Condvar)>,
}

impl RunContext {
    /// A run with a pool of `n_threads` threads, which ends when `cancel` is cancelled.
    pub fn new(n_threads: usize, cancel: CancelToken) -> Self {
        catch_messages();
        let run = Arc::new(RunState { cancel, panic: Mutex::new(None), busy: AtomicUsize::new(0) });
        let pool = Pool {
            n_threads: n_threads.max(1),
            run: Arc::clone(&run),
            threads: OnceLock::new(),
            n_alive: Arc::default(),
        };
        Self { run, pool: Some(Arc::new(pool)) }
    }

    /// The context of this thread, to be entered by a thread it starts.
    pub fn current() -> Option<Self> {
        CURRENT.with_borrow(Clone::clone)
    }

    /// Does `work` as part of this run.
    pub fn enter<T>(&self, work: impl FnOnce() -> T) -> T {
        struct Restore(Option<RunContext>);
        impl Drop for Restore {
            fn drop(&mut self) {
                CURRENT.set(self.0.take());
            }
        }
        let _restore = Restore(CURRENT.replace(Some(self.clone())));
        work()
    }

    /// Runs `work` with this thread counted as busy.
    pub fn busy<T>(work: impl FnOnce() -> T) -> T {
        struct Busy(Option<RunContext>);
        impl Drop for Busy {
            fn drop(&mut self) {
                if let Some(context) = &self.0 {
                    context.run.busy.fetch_sub(1, Ordering::Relaxed);
                }
            }
        }
        let context = Self::current();
        if let Some(context) = &context {
            context.run.busy.fetch_add(1, Ordering::Relaxed);
        }
        let _busy = Busy(context);
        work()
    }

    /// The first panic of the run, which is then forgotten.
    pub fn take_panic(&self) -> Option<CaughtPanic> {
        let mut panic = (self.run.panic.lock()).unwrap_or_else(PoisonError::into_inner);
        panic.take()
    }

    /// Returns whether this is a thread of the run's pool.
    pub(super) fn is_in_pool() -> bool {
        CURRENT.with_borrow(|current| current.as_ref().is_some_and(|c| c.pool.is_none()))
    }

    /// Returns whether the run of this thread is cancelled.
    #[inline]
    pub fn is_current_cancelled() -> bool {
        CURRENT.with_borrow(|current| current.as_ref().is_some_and(|c| c.run.cancel.is_cancelled()))
    }
}

impl Pool {
    /// `None` where the system gives no threads: the caller's does all the work then.
    fn threads(&self) -> Option<&ThreadPool> {
        let begin = || {
            let (run, n_alive) = (Arc::clone(&self.run), Arc::clone(&self.n_alive));
            let n_alive_at_exit = Arc::clone(&self.n_alive);
            let built = ThreadPoolBuilder::new()
                .num_threads(self.n_threads)
                .start_handler(move |_| {
                    let run = Arc::clone(&run);
                    CURRENT.set(Some(RunContext { run, pool: None }));
                    *n_alive.0.lock().unwrap_or_else(PoisonError::into_inner) += 1;
                })
                .exit_handler(move |_| {
                    *n_alive_at_exit.0.lock().unwrap_or_else(PoisonError::into_inner) -= 1;
                    n_alive_at_exit.1.notify_all();
                })
                .build();
            built.ok()
        };
        self.threads.get_or_init(begin).as_ref()
    }
}

impl Drop for Pool {
    /// Waits for the threads: none is left when a run has ended.
    fn drop(&mut self) {
        if let Some(threads) = self.threads.take() {
            // A thread that has not begun yet is counted only when it does.
            threads.as_ref().map(|pool| pool.broadcast(|_| ()));
            drop(threads);
            let n_alive = self.n_alive.0.lock().unwrap_or_else(PoisonError::into_inner);
            drop(self.n_alive.1.wait_while(n_alive, |n| *n > 0));
        }
    }
}

/// Does `work` where its parallel parts belong: in the pool of this run.
pub fn parallel<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    let pool = RunContext::current().and_then(|context| context.pool);
    match pool.as_ref().and_then(|pool| pool.threads()) {
        Some(threads) => shared(spare_threads(), || threads.install(work)),
        None => work(),
    }
}

/// Does `work` that threads would share if there were any to spare.
fn counted<T>(work: impl FnOnce() -> T) -> T {
    if RunContext::is_in_pool() { work() } else { shared(1, work) }
}

/// Does tasks in an order, on threads that `work` starts; it returns the seconds of all of them and of the longest chain.
pub fn shared_tasks(work: impl FnOnce() -> [f64; 2]) {
    if RunContext::is_in_pool() {
        work();
    } else {
        in_order(work);
    }
}

/// Does both, side by side where a thread is to spare: handing work to threads that others keep busy takes longer than doing it.
pub fn join<A: Send, B: Send>(
    a: impl FnOnce() -> A + Send,
    b: impl FnOnce() -> B + Send,
) -> (A, B) {
    match spare_threads() {
        1 => counted(|| (a(), b())),
        _ => parallel(|| rayon::join(a, b)),
    }
}

/// Does `work` on each item, side by side where a thread is to spare.
pub fn for_each_mut<T: Send>(items: &mut [T], work: impl Fn(&mut T) + Sync + Send) {
    match spare_threads() {
        1 => counted(|| items.iter_mut().for_each(work)),
        _ => parallel(|| items.par_iter_mut().for_each(work)),
    }
}

/// Replaces the content of `all` by the results of `found` for all items, in order; in parallel if a thread is free.
pub fn map_into<T: Sync, U: Send>(
    items: &[T],
    all: &mut Vec<U>,
    found: impl Fn(&T) -> U + Sync + Send,
) {
    match spare_threads() {
        1 => counted(|| {
            all.clear();
            all.extend(items.iter().map(found));
        }),
        _ => parallel(|| {
            let items = items.par_iter().with_min_len(ITEMS_MIN);
            items.map(found).collect_into_vec(all);
        }),
    }
}

/// The results of `found` for items that take long each, in order; in parallel if a thread is free.
pub fn map_long<T: Sync, U: Send>(items: &[T], found: impl Fn(&T) -> U + Sync + Send) -> Vec<U> {
    if items.len() < 2 || spare_threads() == 1 {
        return counted(|| items.iter().map(found).collect());
    }
    parallel(|| items.par_iter().map(found).collect())
}

/// A scope whose tasks go to the pool of this run; `work` itself stays on this thread.
pub fn in_place_scope<'scope, T>(work: impl FnOnce(&Scope<'scope>) -> T) -> T {
    let pool = RunContext::current().and_then(|context| context.pool);
    match pool.as_ref().and_then(|pool| pool.threads()) {
        Some(threads) => threads.in_place_scope(work),
        None => rayon::in_place_scope(work),
    }
}

/// Threads of this run.
pub fn n_threads() -> usize {
    let pool = RunContext::current().and_then(|context| context.pool);
    pool.map_or_else(rayon::current_num_threads, |pool| pool.n_threads)
}

/// Number of threads of this run that are not busy, this thread included. The number changes at any moment: no result
/// may depend on it.
pub fn spare_threads() -> usize {
    let busy = RunContext::current().map_or(0, |context| context.run.busy.load(Ordering::Relaxed));
    n_threads().saturating_sub(busy.saturating_sub(1)).max(1)
}

/// From now on the message of a panic inside a run goes to the run; all others go where they went before.
fn catch_messages() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| match RunContext::current() {
            Some(context) => context.run.remember(info),
            None => before(info),
        }));
    });
}

impl RunState {
    fn remember(&self, info: &PanicHookInfo) {
        let file = info.location().map_or("", std::panic::Location::file);
        let mut panic = self.panic.lock().unwrap_or_else(PoisonError::into_inner);
        panic.get_or_insert_with(|| CaughtPanic {
            message: info.to_string(),
            is_in_redb: std::path::Path::new(file)
                .iter()
                .any(|part| part.to_string_lossy().starts_with("redb-")),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::storage::{StorageError, attempt, check_cancelled};

    #[test]
    fn a_token_ends_its_own_run_and_no_other() {
        let tokens = [CancelToken::new(), CancelToken::new()];
        let runs = tokens.clone().map(|token| RunContext::new(2, token));
        tokens[0].cancel();
        let look =
            || attempt(|| parallel(|| (0..4).into_par_iter().for_each(|_| check_cancelled())));
        assert!(matches!(runs[0].enter(look), Err(StorageError::Cancelled)));
        assert!(runs[1].enter(look).is_ok());
        assert!(look().is_ok(), "what is no run is not cancelled");
        tokens[0].reset();
        assert!(runs[0].enter(look).is_ok());
    }

    #[test]
    fn threads_are_left_by_those_who_are_not_busy() {
        let run = RunContext::new(3, CancelToken::new());
        let spare = || run.enter(spare_threads);
        assert_eq!(spare(), 3);
        run.enter(|| {
            RunContext::busy(|| {
                assert_eq!(spare(), 3);
                RunContext::busy(|| assert_eq!(spare(), 2));
                let ended = std::panic::catch_unwind(|| RunContext::busy(|| panic!("midway")));
                assert!(ended.is_err());
                RunContext::busy(|| {
                    RunContext::busy(|| RunContext::busy(|| assert_eq!(spare(), 1)))
                });
            });
        });
        assert_eq!(spare(), 3);
    }

    #[test]
    fn a_panic_is_kept_by_its_run_and_no_thread_is_left() {
        let run = RunContext::new(3, CancelToken::new());
        let n_alive = Arc::clone(&run.pool.as_ref().expect("it has a pool").n_alive);
        let ended = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            run.enter(|| parallel(|| panic!("a broken invariant")))
        }));
        assert!(ended.is_err());
        let panic = run.take_panic().expect("it was caught");
        assert!(panic.message.contains("a broken invariant") && !panic.is_in_redb);
        assert_eq!(run.enter(n_threads), 3);
        drop(run);
        assert_eq!(*n_alive.0.lock().expect("nobody panics with it"), 0);
    }
}
