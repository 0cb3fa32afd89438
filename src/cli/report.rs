//! `report`: a page about a mesh, to be opened in a browser.

use serde_json::json;

use super::args::ReportArgs;
use super::console::Console;
use super::failure::Failure;
use super::memory;
use tetdb_engine::api::page::write_page;
use tetdb_engine::api::targets::{check_target, inputs_of};

pub fn run(args: &ReportArgs, console: &Console) -> Result<u8, Failure> {
    check_target(&args.output, &inputs_of(&args.store))?;
    let settings = console.settings(memory::asked(args.read.memory.as_deref())?, None);
    let written = write_page(&args.store, &args.output, &settings)?;
    console.done();
    let (file, scene) = (args.output.display(), &written.scene);
    if console.is_json() {
        let shown = |name: &str| json!({ "of": scene[name]["of"], "shown": scene[name]["shown"] });
        console.answer(&json!({
            "schema": 1, "file": file.to_string(), "bytes": written.bytes, "boundary": shown("boundary"),
            "interfaces": shown("interfaces"), "chunks": written.measures,
        }));
    } else {
        console.note(&format!("wrote {file} ({})", memory::show(written.bytes)));
    }
    Ok(0)
}
