//! Ctrl-C, SIGTERM and SIGHUP end a run between two page accesses; a second one ends it at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::time::Duration;
use tetdb_engine::api::CancelToken;

use signal_hook::consts::{SIGABRT, SIGHUP, SIGINT, SIGTERM};
use signal_hook::flag::register_conditional_shutdown;
use signal_hook::iterator::Signals;

static RECEIVED: AtomicI32 = AtomicI32::new(0);
/// Whether there is a store that can be resumed.
static HAS_STORE: AtomicBool = AtomicBool::new(false);
/// Whether what is under way must end in order: a step of a store, a file that is half written.
static IN_ORDER: AtomicBool = AtomicBool::new(false);
/// What reads, validates and sizes a surface looks for signals here and there only; it has so long to end by itself.
const PATIENCE: Duration = Duration::from_millis(1000);

/// From now on memory that the system refuses ends the process like any other lack of memory.
///
/// Long arrays ask for memory in a way that can fail (`storage::reserve`). All the rest, libraries too, ends in the standard library, which says how
/// many bytes were refused and aborts. Panics do not abort, so nothing else comes by here but a stack that is full.
pub fn end_without_memory() {
    // Errors: the system knows no such signal; the process then ends by it.
    let _ = register_conditional_shutdown(SIGABRT, NO_MEMORY, Arc::new(AtomicBool::new(true)));
}

/// The exit code of too little memory.
const NO_MEMORY: i32 = 6;

/// Listens from now on, and cancels the run; where nothing would be left behind it ends soon after what `last` says, whose answer is the exit code.
///
/// Errors: the system refuses; the run then simply cannot be stopped gently.
pub fn listen(cancel: &CancelToken, last: impl Fn() -> u8 + Send + Sync + 'static) {
    let mut which = vec![SIGINT, SIGTERM];
    if !is_ignored(SIGHUP) {
        which.push(SIGHUP);
    }
    let Ok(mut signals) = Signals::new(which) else {
        return;
    };
    let (token, last) = (cancel.clone(), Arc::new(last));
    std::thread::spawn(move || {
        for signal in signals.forever() {
            if RECEIVED.swap(signal, Ordering::Relaxed) != 0 {
                std::process::exit(128 + signal);
            }
            token.cancel();
            let last = last.clone();
            std::thread::spawn(move || {
                std::thread::sleep(PATIENCE);
                if !IN_ORDER.load(Ordering::SeqCst) {
                    std::process::exit(last().into());
                }
            });
        }
    });
}

/// Whether the process was begun to ignore a signal, as `nohup` does with SIGHUP; also where the system does not say.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|l| l.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_none_or(|mask| mask >> (signal - 1) & 1 != 0)
}

/// From now on there is a store: a step under way ends in order, however long that takes.
pub fn store_begins() {
    HAS_STORE.store(true, Ordering::SeqCst);
    end_in_order();
}

/// From now on something is under way that would leave something behind.
pub fn end_in_order() {
    IN_ORDER.store(true, Ordering::SeqCst);
}

/// Whether there is a store to go on with.
pub fn has_store() -> bool {
    HAS_STORE.load(Ordering::SeqCst)
}

/// 128 + the signal that stopped the run.
pub fn exit_code() -> u8 {
    match RECEIVED.load(Ordering::Relaxed) {
        0 => 128 + SIGINT as u8,
        signal => 128 + signal as u8,
    }
}
