//! The command `field`: values kept with a finished mesh.

use std::path::Path;

use serde_json::json;

use super::args::{AddFieldArgs, FieldAction, FieldArgs};
use super::console::Console;
use super::failure::Failure;
use super::memory;
use super::words::count;
use tetdb_engine::api::{Code, Field, FieldIds, FieldSource, NewField, Store, Word, short};

pub fn run(args: &FieldArgs, console: &Console) -> Result<u8, Failure> {
    let read = match &args.action {
        FieldAction::Add(add) => &add.read,
        FieldAction::List(list) => &list.read,
        FieldAction::Drop(drop) => &drop.read,
    };
    let settings = console.settings(memory::requested(read.memory.as_deref())?, None);
    match &args.action {
        FieldAction::Add(add) => {
            let (new, source) = (new_field(add), source(add)?);
            let field = Store::open_with(&args.store, settings)?.add_field_from(&new, &source)?;
            console.done();
            if console.is_json() {
                console.answer(&json!({ "schema": 1, "field": field }));
            } else if !console.is_quiet() {
                console.line(&format!("added {}", line(&field)));
            }
        }
        FieldAction::List(list) => {
            let fields = Store::open_with(&args.store, list.at.of(settings))?.fields()?;
            if console.is_json() {
                console.answer(&json!({ "schema": 1, "fields": fields }));
            } else if fields.is_empty() {
                console.note("the store has no fields");
            }
            if !console.is_json() {
                fields.iter().for_each(|field| console.line(&line(field)));
            }
        }
        FieldAction::Drop(drop) => {
            Store::open_with(&args.store, settings)?.drop_field(&drop.name)?;
            if console.is_json() {
                console.answer(&json!({ "schema": 1, "dropped": drop.name }));
            } else if !console.is_quiet() {
                console.line(&format!("dropped {}", drop.name));
            }
        }
    }
    Ok(0)
}

fn new_field(args: &AddFieldArgs) -> NewField {
    let mut new = NewField::new(&args.name, args.at);
    if let Some(number) = args.number {
        new = new.number(number);
    }
    if let Some(components) = args.components {
        new = new.components(components);
    }
    new
}

/// A file by its ending, or an expression.
fn source(args: &AddFieldArgs) -> Result<FieldSource, Failure> {
    let path = Path::new(&args.from);
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let ids = match args.ids.as_deref() {
        None => FieldIds::AsFound,
        Some("stable") => FieldIds::Stable,
        Some("export") => FieldIds::Export,
        Some(file) => FieldIds::File(file.into()),
    };
    match &*ending {
        "npy" | "csv" | "tsv" | "txt" => Ok(FieldSource::File(path.to_owned(), ids)),
        _ if path.is_file() => {
            let message = "the format of a file of values does not follow from its name";
            let failure = Failure::new(Code::UnknownFormat, message).at(&args.from);
            Err(failure.help("end the name with .npy or .csv"))
        }
        _ if args.ids.is_some() => {
            let message = "--ids belongs to a file of values, and --from is an expression";
            Err(Failure::new(Code::Usage, message)
                .help("leave --ids away, or give a .npy or .csv file"))
        }
        _ => Ok(FieldSource::Expression(args.from.clone())),
    }
}

/// A field in one line.
pub fn line(field: &Field) -> String {
    let kind = match field.components {
        1 => field.number.word().to_owned(),
        n => format!("{n} x {}", field.number.word()),
    };
    let ranges: Vec<String> = field
        .ranges
        .iter()
        .map(|range| {
            let nan = match range.nan {
                0 => String::new(),
                n => format!(" and {}", count(n, "NaN")),
            };
            match range.low <= range.high {
                true => format!("{} to {}{nan}", short(range.low), short(range.high)),
                false => format!("no number{nan}"),
            }
        })
        .collect();
    format!(
        "{}: {kind} at {}, {} values, {}; {}",
        field.name,
        field.at.word(),
        field.values,
        memory::show(field.bytes),
        ranges.join(", ")
    )
}
