//! The command `digest`: the digest of a mesh.

use serde_json::json;

use super::args::StoreArgs;
use super::console::Console;
use super::failure::Failure;
use super::memory;
use tetdb_engine::api::Store;

pub fn run(args: &StoreArgs, console: &Console) -> Result<u8, Failure> {
    let settings = args.at.of(console.settings(memory::requested(args.memory.as_deref())?, None));
    let store = Store::open_with(&args.store, settings)?;
    let (digest, interface_digest) = (&store.summary().digest, &store.summary().interface_digest);
    if console.is_json() {
        console.answer(
            &json!({ "schema": 1, "digest": digest, "interface_digest": interface_digest }),
        );
    } else {
        console.line(digest);
    }
    Ok(0)
}
