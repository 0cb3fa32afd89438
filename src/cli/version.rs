//! The command `version`: states of a store kept under names.

use serde_json::json;

use super::args::{VersionAction, VersionArgs};
use super::compare::{self, DIFFERENT};
use super::console::Console;
use super::failure::Failure;
use super::memory;
use super::words::{count, worst};
use tetdb_engine::api::{Store, Version, VersionDiff};

pub fn run(args: &VersionArgs, console: &Console) -> Result<u8, Failure> {
    let settings = console.settings(memory::requested(args.read().memory.as_deref())?, None);
    let mut store = Store::open_with(&args.store, settings)?;
    let (answer, lines) = match &args.action {
        VersionAction::Save(args) => {
            let keep = args.keep.map(|n| n as usize);
            let dropped = store.save_version(&args.name, &args.note, keep)?;
            let mut lines = vec![format!("saved version {}", args.name)];
            lines.extend(dropped.iter().map(|name| format!("dropped version {name}")));
            (json!({ "schema": 1, "saved": args.name, "dropped": dropped }), lines)
        }
        VersionAction::List(_) => {
            let versions = store.versions()?;
            if versions.is_empty() {
                console.note("the store has no versions");
            }
            versions.iter().for_each(|version| print(version, console));
            (json!({ "schema": 1, "versions": versions }), Vec::new())
        }
        VersionAction::Show(args) => {
            let version = store.version(&args.name)?;
            print(&version, console);
            if !console.is_json() && !version.fields.is_empty() {
                console.line(&format!("  fields {}", version.fields.join(", ")));
            }
            (json!({ "schema": 1, "version": version }), Vec::new())
        }
        VersionAction::Diff(args) => {
            let diff = store.diff_versions(&args.first, &args.second)?;
            match console.is_json() {
                true => {
                    let mut answer = json!(diff);
                    answer["schema"] = json!(1);
                    console.answer(&answer);
                }
                false => print_diff(&diff, console),
            }
            return Ok(if diff.same { 0 } else { DIFFERENT });
        }
        VersionAction::Restore(args) => {
            let restored = store.restore_version(&args.of.name, !args.no_verify)?;
            console.done();
            let ranks: Vec<u32> = restored.subdomains.iter().map(|[_, row]| row.rank).collect();
            let digest = &restored.store.summary().digest;
            let n = count(ranks.len() as u64, "sub-domain");
            let line = format!("restored version {}: {n} changed; digest {digest}", args.of.name);
            let answer = json!({ "schema": 1, "restored": args.of.name, "changed": ranks, "digest": digest });
            (answer, vec![line])
        }
        VersionAction::Drop(args) => {
            let bytes = store.drop_version(&args.name)?;
            let line = format!("dropped version {}: {} freed", args.name, memory::show(bytes));
            (json!({ "schema": 1, "dropped": args.name, "bytes": bytes }), vec![line])
        }
    };
    match (console.is_json(), console.is_quiet()) {
        (true, _) => console.answer(&answer),
        (false, true) => {}
        _ => lines.iter().for_each(|line| console.line(line)),
    }
    Ok(0)
}

fn print(version: &Version, console: &Console) {
    if console.is_json() {
        return;
    }
    let note = if version.note.is_empty() { "" } else { ": " };
    console.line(&format!(
        "{}{note}{}\n  {} in {}, {}, {} to free; digest {}",
        version.name,
        version.note,
        count(version.tets, "tetrahedron"),
        count(version.subdomains as u64, "sub-domain"),
        count(version.fields.len() as u64, "field"),
        memory::show(version.bytes),
        version.digest
    ));
}

fn print_diff(diff: &VersionDiff, console: &Console) {
    let mut n_same = 0u64;
    for part in &diff.subdomains {
        if !part.changed {
            n_same += 1;
            continue;
        }
        console.line(&format!(
            "sub-domain {}: {} -> {} tetrahedra, {} -> {} vertices, worst {} -> {}",
            part.id,
            part.tets[0],
            part.tets[1],
            part.vertices[0],
            part.vertices[1],
            worst(part.worst_q[0]),
            worst(part.worst_q[1])
        ));
    }
    for (word, names) in [("only before", &diff.fields_before), ("only after", &diff.fields_after)]
    {
        if !names.is_empty() {
            console.line(&format!("fields or values {word}: {}", names.join(", ")));
        }
    }
    console.line(&format!("{} the same", count(n_same, "sub-domain")));
    if diff.subdomains.iter().any(|part| part.changed) {
        console.line("the changed sub-domains:");
        compare::print(&diff.qualities.first, &diff.qualities.second, console);
    }
}
