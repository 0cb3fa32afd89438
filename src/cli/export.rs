//! `export`: files for other programs.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::args::{ExportArgs, QueryArgs};
use super::console::Console;
use super::failure::Failure;
use super::memory;
use super::query;
use super::query_ask::regions;
use crate::api::targets::{check_target, inputs_of};
use crate::api::{Error, Exported, Settings, show};
use crate::io::write::{Content, ENDINGS, MeshFormat, Order, Selection, check};

pub fn run(args: &ExportArgs, console: &Console) -> Result<u8, Failure> {
    if let Some(all) = rows(args)? {
        return query::run(&all, console);
    }
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

/// The question about all tetrahedra whose answer is to be written, where that is asked for: rows of values.
fn rows(args: &ExportArgs) -> Result<Option<QueryArgs>, Failure> {
    let word = |out: &PathBuf| match &args.format {
        Some(word) => word.to_ascii_lowercase(),
        None => (out.extension().unwrap_or_default().to_string_lossy()).to_ascii_lowercase(),
    };
    let is_rows = |out: &PathBuf| matches!(word(out).as_str(), "csv" | "jsonl");
    if !args.out.iter().any(is_rows) {
        return Ok(None);
    }
    let of_meshes = [
        args.pieces,
        args.ascii,
        args.boundary,
        args.interfaces,
        args.ghosts,
        args.split_sheets,
        args.order != 1,
        args.read.json,
    ];
    let ([out], false) = (&args.out[..], of_meshes.contains(&true)) else {
        let message = ".csv and .jsonl are one file of rows, a tetrahedron each, and no mesh";
        return Err(Failure::new("usage", message).help(
            "export it alone, with --subdomain, --region or --memory only; `tetdb query` chooses rows and columns",
        ));
    };
    let to_stdout = out == Path::new("-");
    let subdomains: Vec<String> = args.subdomain.iter().map(u32::to_string).collect();
    Ok(Some(QueryArgs {
        store: args.store.clone(),
        subdomain: (!subdomains.is_empty()).then(|| subdomains.join(",")),
        region: args.region.clone(),
        csv: to_stdout && word(out) == "csv",
        json: to_stdout && word(out) == "jsonl",
        output: (!to_stdout).then(|| out.clone()),
        memory: args.read.memory.clone(),
        ..QueryArgs::default()
    }))
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
