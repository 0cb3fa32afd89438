//! Ctrl-C and SIGTERM end a run between two page accesses; a second one ends it at once.

use std::sync::atomic::{AtomicI32, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

static RECEIVED: AtomicI32 = AtomicI32::new(0);

/// Listens from now on. Errors: the system refuses; the run then simply cannot be stopped gently.
pub fn listen() {
    let Ok(mut signals) = Signals::new([SIGINT, SIGTERM]) else {
        return;
    };
    std::thread::spawn(move || {
        for signal in signals.forever() {
            if RECEIVED.swap(signal, Ordering::Relaxed) != 0 {
                std::process::exit(128 + signal);
            }
            crate::store::request_stop();
        }
    });
}

/// 128 + the signal that stopped the run.
pub fn exit_code() -> u8 {
    match RECEIVED.load(Ordering::Relaxed) {
        SIGTERM => 143,
        _ => 130,
    }
}
