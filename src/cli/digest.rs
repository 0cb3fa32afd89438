//! `digest`: one number for the mesh.

use serde_json::json;

use super::args::StoreArgs;
use super::failure::Failure;
use super::store;
use super::talk::Talk;

pub fn run(args: &StoreArgs, talk: &Talk) -> Result<u8, Failure> {
    let mut store = store::open_finished(&args.store)?;
    let [tets, interfaces] = store.digest()?;
    if talk.is_json() {
        talk.answer(&json!({ "schema": 1, "digest": tets.to_string(), "interface_digest": interfaces.to_string() }));
    } else {
        talk.line(&tets.to_string());
    }
    Ok(0)
}
