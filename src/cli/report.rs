//! The command `report`: a page about a mesh for a web browser.

use serde_json::json;

use super::args::ReportArgs;
use super::console::Console;
use super::failure::Failure;
use super::memory;
use tetdb_engine::api::Store;

pub fn run(args: &ReportArgs, console: &Console) -> Result<u8, Failure> {
    let settings =
        args.at.of(console.settings(memory::requested(args.read.memory.as_deref())?, None));
    let reported = Store::open_with(&args.store, settings)?.report(&args.output)?;
    console.done();
    let file = args.output.display().to_string();
    if console.is_json() {
        let mut answer = json!(reported);
        answer["schema"] = json!(1);
        answer["file"] = json!(file);
        console.answer(&answer);
    } else {
        console.note(&format!("wrote {file} ({})", memory::show(reported.bytes)));
    }
    Ok(0)
}
