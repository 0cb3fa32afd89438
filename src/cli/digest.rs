//! `digest`: one number for the mesh.

use serde_json::json;

use super::args::StoreArgs;
use super::console::Console;
use super::failure::Failure;
use super::memory;
use tetdb_engine::api::store::open_finished;

pub fn run(args: &StoreArgs, console: &Console) -> Result<u8, Failure> {
    // One row of the catalog is read.
    memory::asked(args.memory.as_deref())?;
    let mut store = open_finished(&args.store)?;
    let [tets, interfaces] = store.digest()?;
    if console.is_json() {
        console.answer(&json!({ "schema": 1, "digest": tets.to_string(), "interface_digest": interfaces.to_string() }));
    } else {
        console.line(&tets.to_string());
    }
    Ok(0)
}
