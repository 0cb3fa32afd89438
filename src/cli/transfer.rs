//! The command `transfer`: fields of one store evaluated on the mesh of another.

use serde_json::json;

use super::args::TransferArgs;
use super::console::Console;
use super::failure::Failure;
use super::field::line;
use super::words::count;
use super::{memory, threads};
use tetdb_engine::api::{Store, TransferredField, Word, short};

pub fn run(args: &TransferArgs, console: &Console) -> Result<u8, Failure> {
    let cap = memory::requested(args.read.memory.as_deref())?;
    let settings = console.settings(cap, threads::requested(args.threads)?);
    let from = Store::open_with(&args.from, args.at.of(settings.clone()))?;
    let names: Vec<&str> = args.field.iter().map(String::as_str).collect();
    let fields = Store::open_with(&args.to, settings)?.transfer_from(&from, &names, args.method)?;
    console.done();
    if console.is_json() {
        console.answer(&json!({ "schema": 1, "fields": fields }));
    } else if !console.is_quiet() {
        for field in &fields {
            console.line(&format!("added {}", line(&field.field)));
            console.line(&format!("  {}", how(field)));
        }
    }
    Ok(0)
}

/// How values were evaluated, in one line.
pub fn how(field: &TransferredField) -> String {
    let mut said = vec![format!(
        "{}, {} from outside",
        field.method.word(),
        count(field.from_outside, "value")
    )];
    // Rounding alone is no gap.
    if let Some(covered) = field.covered.filter(|covered| *covered < 1.0 - 1e-9) {
        said.push(format!("{} % of the mesh covered", short(100.0 * covered)));
    }
    if let Some([before, after]) = &field.integrals {
        for (component, (before, after)) in before.iter().zip(after).enumerate() {
            let name = &field.field.columns[component];
            let change = (after - before) / before.abs().max(f64::MIN_POSITIVE);
            let (before, after) = (short(*before), short(*after));
            said.push(format!(
                "integral of {name} {before} -> {after} (relative change {change:.0e})"
            ));
        }
    }
    said.join("; ")
}
