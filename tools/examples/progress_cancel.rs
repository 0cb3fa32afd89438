//! Progress, cancelling and resuming: `cargo run --release --example progress_cancel -- box.tetdb`.
//!
//! A listener prints what the run reports and cancels it once there is something to resume. The resumed run gives the same mesh as one
//! that was never interrupted.

use std::error::Error;
use std::sync::Mutex;

use tetdb::{CancelToken, Event, Mesher, Settings, Store, Surface};

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("usage: progress_cancel STORE")?;

    let token = CancelToken::new();
    let in_listener = token.clone();
    let cancelled = Mesher::new(Surface::sample("box,h=0.06")?)
        .cancel(&token)
        .progress(move |event| {
            // Any thread may cancel: a signal handler, a button, a watchdog.
            if matches!(event, Event::StoreBegun(_)) {
                in_listener.cancel();
            }
        })
        .create(&path);
    let error = cancelled.err().ok_or("the run was not cancelled")?;
    assert!(error.is_cancelled(), "{error}");
    println!("cancelled: {error}");

    // The same token serves again; other runs in this process never noticed.
    token.reset();
    let stage = Mutex::new("");
    let settings = Settings::new().cancel(&token).progress(move |event| match event {
        // `done` of `total` comes with it, many times a second.
        Event::Progress { stage: now, .. } => {
            let mut last = stage.lock().expect("no listener panics");
            if std::mem::replace(&mut *last, *now) != *now {
                println!("working: {now}");
            }
        }
        Event::Note(text) | Event::Warning(text) => println!("{text}"),
        _ => {}
    });
    let store = Store::resume(&path, settings)?;

    let folder = tempfile::tempdir()?;
    let uninterrupted =
        Mesher::new(Surface::sample("box,h=0.06")?).create(folder.path().join("b.tetdb"))?;
    assert!(store.is_same_mesh(&uninterrupted));
    println!("the same mesh: {}", store.summary().digest);
    Ok(())
}
