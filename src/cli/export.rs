//! `export`: files for other programs.

use std::path::Path;

use serde_json::json;

use super::args::ExportArgs;
use super::console::Console;
use super::failure::Failure;
use super::memory;
use super::query_ask::regions;
use crate::api::targets::{check_target, inputs_of};
use crate::api::{Error, Exported, Settings, show};
use crate::io::write::{Content, ENDINGS, MeshFormat, Order, Selection, check};

pub fn run(args: &ExportArgs, console: &Console) -> Result<u8, Failure> {
    let settings = console.settings(memory::asked(args.read.memory.as_deref())?, None);
    let format = match &args.format {
        Some(word) => Some(MeshFormat::of_word(word).ok_or_else(|| {
            Failure::new("unknown-format", "no format has this name")
                .at(word)
                .help(format!(
                    "choose msh22, or an ending without its dot: {ENDINGS}"
                ))
        })?),
        None => None,
    };
    let regions = match &args.region {
        Some(text) => regions(text, &show::region_names(&args.store)?)?,
        None => Vec::new(),
    };
    let selection = Selection {
        subdomains: args.subdomain.iter().copied().collect(),
        regions: regions.into_iter().collect(),
        pieces: args.pieces,
        content: match (args.boundary, args.interfaces) {
            (true, _) => Content::Boundary,
            (_, true) => Content::Interfaces,
            _ => Content::Mesh,
        },
        format,
        ascii: args.ascii,
        ghosts: args.ghosts,
        split_sheets: args.split_sheets,
        order: match args.order {
            2 => Order::Second,
            _ => Order::First,
        },
    };
    for out in &args.out {
        if format.is_none() {
            check_format(out)?;
        }
        check(out, &selection).map_err(Error::from)?;
    }
    let to_stdout = args.out.iter().any(|out| out == Path::new("-"));
    if to_stdout && (console.is_json() || args.out.len() > 1) {
        return Err(Failure::new(
            "usage",
            "the standard output holds one mesh and nothing else",
        )
        .help("leave --json and other names out"));
    }
    if !args.force {
        let inputs = inputs_of(&args.store);
        args.out
            .iter()
            .try_for_each(|out| check_target(out, &inputs))?;
    }
    let mut reports = Vec::new();
    for out in &args.out {
        reports.push(write(&args.store, out, &selection, &settings, console)?);
    }
    if console.is_json() {
        console.answer(&json!({ "schema": 1, "exports": reports }));
    }
    Ok(0)
}

/// Refuses names whose format cannot be told, before any work.
pub fn check_format(out: &Path) -> Result<(), Failure> {
    match MeshFormat::of_extension(out) {
        Some(_) => Ok(()),
        None => Err(Failure::new(
            "unknown-format",
            "the format of a mesh file does not follow from its name",
        )
        .at(out.display())
        .help(format!("end the name with {ENDINGS}"))),
    }
}

/// Writes one file, and what belongs to it.
pub fn write(
    path: &Path,
    out: &Path,
    selection: &Selection,
    settings: &Settings,
    console: &Console,
) -> Result<Exported, Failure> {
    let exported = show::export(path, out, selection, settings)?;
    console.done();
    for (file, bytes) in &exported.files {
        console.note(&format!(
            "wrote {} ({})",
            file.display(),
            memory::show(*bytes)
        ));
    }
    Ok(exported)
}
