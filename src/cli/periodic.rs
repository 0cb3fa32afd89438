//! The command `periodic`: labels whose triangles are the same at two places.

use serde_json::json;

use super::args::PeriodicArgs;
use super::console::Console;
use super::failure::Failure;
use super::memory;
use tetdb_engine::api::Store;

pub fn run(args: &PeriodicArgs, console: &Console) -> Result<u8, Failure> {
    let settings = console.settings(memory::requested(args.read.memory.as_deref())?, None);
    let mut store = Store::open_with(&args.store, settings)?;
    for pair in args.pairs() {
        match args.drop {
            true => store.drop_periodic(&pair)?,
            false => drop(store.add_periodic(&pair)?),
        }
    }
    let pairs = store.periodic()?;
    if console.is_json() {
        console.answer(&json!({ "schema": 1, "periodic": pairs }));
    } else if pairs.is_empty() {
        console.note("the store has no periodic pairs");
    }
    if !console.is_json() {
        pairs.iter().for_each(|pair| console.line(&pair.to_string()));
    }
    Ok(0)
}
