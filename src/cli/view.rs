//! The command `view`: a server for the browser of this machine, until Ctrl-C.

use std::time::Duration;

use super::args::ViewArgs;
use super::console::Console;
use super::failure::Failure;
use super::view_server::{Secret, Server};
use super::{memory, threads};
use tetdb_engine::api::{Bytes, CancelToken, Code, MEMORY_LEAST, Viewer};

/// How often the end is looked for.
const PAUSE: Duration = Duration::from_millis(50);
/// Answers under way at once: a section does not wait for a long condition.
const WORKERS: u64 = 2;

pub fn run(args: &ViewArgs, console: &Console) -> Result<u8, Failure> {
    let memory = memory::requested(args.memory.as_deref())?;
    let settings = args.at.of(console.settings(memory, threads::requested(args.threads)?));
    let cap = settings.cap()?;
    let n = (cap / MEMORY_LEAST.0).clamp(1, WORKERS);
    let open = |_| {
        let token = CancelToken::new();
        let settings = settings.clone().memory(Bytes(cap / n)).cancel(&token);
        Ok((Viewer::open(&args.store, settings)?, token))
    };
    let viewers = (0..n).map(open).collect::<Result<Vec<_>, Failure>>()?;
    let server =
        Server::start(args.port.unwrap_or(0), viewers).map_err(|error| match args.port {
            Some(port) => {
                Failure::new(Code::Io, format!("port {port} cannot be listened to: {error}"))
                    .help("choose another with --port, or leave it out for one that is free")
            }
            None => Failure::new(Code::Io, format!("no port can be listened to: {error}")),
        })?;
    console.line(&server.address(Secret::Printed));
    console.end_answer()?;
    if !args.no_open {
        open_browser(&server.address(Secret::Opened), console);
    }
    console.note("Ctrl-C ends it");
    while !console.cancel().is_cancelled() {
        std::thread::sleep(PAUSE);
    }
    server.stop();
    Ok(0)
}

/// Opens the address in a browser, if this machine shows windows.
fn open_browser(address: &str, console: &Console) {
    let is_set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let has_windows = !cfg!(all(unix, not(target_os = "macos")))
        || ["DISPLAY", "WAYLAND_DISPLAY"].into_iter().any(is_set);
    if !has_windows || open::that_detached(address).is_err() {
        console.note("no browser was opened; open the address in one on this machine");
    }
}
