//! Signals: Ctrl-C, SIGTERM and SIGHUP end a run between two page accesses. A second signal ends it at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::time::Duration;
use tetdb_engine::api::CancelToken;

use signal_hook::consts::{SIGABRT, SIGINT, SIGTERM};
use signal_hook::flag::register_conditional_shutdown;

static RECEIVED: AtomicI32 = AtomicI32::new(0);
/// True if a store exists that can be resumed.
static HAS_STORE: AtomicBool = AtomicBool::new(false);
/// True if the work in progress must end in order: a step of a store, or a half-written file.
static IN_ORDER: AtomicBool = AtomicBool::new(false);
/// Time for a run to end by itself. Reading, validating and sizing a surface check for signals only now and then.
const PATIENCE: Duration = Duration::from_millis(1000);

/// Lets memory refused by the system end the process with the exit code for too little memory.
///
/// Long arrays request memory in a way that can fail (`storage::reserve`). All other requests, also in libraries, end in the standard
/// library, which reports the number of bytes and aborts. Panics do not abort, so the only other cause is a full stack.
pub fn end_without_memory() {
    // Errors: the signal is unknown to the system, and then ends the process.
    let _ = register_conditional_shutdown(SIGABRT, NO_MEMORY, Arc::new(AtomicBool::new(true)));
}

/// Exit code for too little memory.
const NO_MEMORY: i32 = 6;

/// Listens for signals and cancels the run. If nothing would be left behind, the process then ends soon, with the exit code returned by
/// `last`.
///
/// Errors: the system refuses; the run then cannot be cancelled by signals.
pub fn listen(cancel: &CancelToken, last: impl Fn() -> u8 + Send + Sync + 'static) {
    let Some(signals) = incoming() else {
        return;
    };
    let (token, last) = (cancel.clone(), Arc::new(last));
    std::thread::spawn(move || {
        for signal in signals {
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

/// The signals that end a run, as they come; none if the system refuses.
#[cfg(unix)]
fn incoming() -> Option<impl Iterator<Item = i32>> {
    use signal_hook::consts::SIGHUP;
    let mut which = vec![SIGINT, SIGTERM];
    if !is_ignored(SIGHUP) {
        which.push(SIGHUP);
    }
    let mut signals = signal_hook::iterator::Signals::new(which).ok()?;
    Some(std::iter::from_fn(move || signals.forever().next()))
}

/// Returns whether the process was started with a signal ignored, as by `nohup` for SIGHUP. Also true if the system does not report it.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|l| l.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_none_or(|mask| mask >> (signal - 1) & 1 != 0)
}

/// Like above, for systems without a queue of signals: looks 20 times a second.
#[cfg(not(unix))]
fn incoming() -> Option<impl Iterator<Item = i32>> {
    use signal_hook::flag::register_usize;
    use std::sync::atomic::AtomicUsize;
    let last = Arc::new(AtomicUsize::new(0));
    for signal in [SIGINT, SIGTERM] {
        register_usize(signal, last.clone(), signal as usize).ok()?;
    }
    Some(std::iter::from_fn(move || {
        loop {
            std::thread::sleep(Duration::from_millis(50));
            let signal = last.swap(0, Ordering::Relaxed);
            if signal != 0 {
                return Some(signal as i32);
            }
        }
    }))
}

/// Announces that a store exists. A step in progress then ends in order, however long it takes.
pub fn store_begins() {
    HAS_STORE.store(true, Ordering::SeqCst);
    end_in_order();
}

/// Announces that the work in progress would leave something behind if it ended at once.
pub fn end_in_order() {
    IN_ORDER.store(true, Ordering::SeqCst);
}

/// Returns whether a store exists that can be resumed.
pub fn has_store() -> bool {
    HAS_STORE.load(Ordering::SeqCst)
}

/// 128 plus the number of the signal that ended the run.
pub fn exit_code() -> u8 {
    match RECEIVED.load(Ordering::Relaxed) {
        0 => 128 + SIGINT as u8,
        signal => 128 + signal as u8,
    }
}
