//! The command `export`: files for other programs.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::args::{ExportArgs, QueryArgs};
use super::console::Console;
use super::failure::Failure;
use super::memory;
use super::query;
use super::query_ask::regions;
use tetdb_engine::api::{
    Code, ExportOptions, Exported, MESH_ENDINGS, MeshFormat, Settings, Share, Store, Writers,
    check_target, inputs_of,
};

pub fn run(args: &ExportArgs, console: &Console) -> Result<u8, Failure> {
    let is_first = share_of_ranks().is_none_or(|share| share.number == 1);
    if let Some(all) = rows(args)? {
        return match is_first {
            true => query::run(&all, console),
            false => Ok(0),
        };
    }
    let reports = write_share(args, console, is_first);
    #[cfg(feature = "mpi")]
    let reports = super::ranks::gather(reports, |all, others| add(all, others, console));
    let reports = reports?;
    if console.is_json() {
        console.answer(&json!({ "schema": 1, "exports": reports }));
    }
    Ok(0)
}

/// This rank's share of the pieces, if the user gave none. Files that are no pieces are written by the first rank.
fn share_of_ranks() -> Option<Share> {
    #[cfg(feature = "mpi")]
    return super::ranks::share();
    #[cfg(not(feature = "mpi"))]
    None
}

/// The ranks as joint writers of one file; `None` for a single process.
fn writers() -> Option<Box<dyn Writers>> {
    #[cfg(feature = "mpi")]
    return super::ranks::writers();
    #[cfg(not(feature = "mpi"))]
    None
}

/// Adds the files and counts of other ranks.
#[cfg(feature = "mpi")]
fn add(all: &mut [Exported], others: Vec<Exported>, console: &Console) {
    for (exported, other) in all.iter_mut().zip(others) {
        note(&other, console);
        exported.files.extend(other.files);
        exported.vertices += other.vertices;
        exported.tets += other.tets;
        exported.triangles += other.triangles;
    }
}

fn write_share(
    args: &ExportArgs,
    console: &Console,
    is_first: bool,
) -> Result<Vec<Exported>, Failure> {
    let settings =
        args.at.of(console.settings(memory::requested(args.read.memory.as_deref())?, None));
    let options = options(args, &settings)?;
    let mut outs = Vec::new();
    for out in &args.out {
        if args.format.is_none() {
            check_format(out)?;
        }
        let format = options.check(out)?;
        let of_ranks = share_of_ranks().filter(|_| options.is_in_pieces(format));
        let writers = options.is_shared_file(format).then(writers).flatten();
        let is_shared = of_ranks.is_some() && args.share.is_none() || writers.is_some();
        outs.push((out, of_ranks, is_first || is_shared, writers));
    }
    let to_stdout = args.out.iter().any(|out| out == Path::new("-"));
    if to_stdout && (console.is_json() || args.out.len() > 1) {
        return Err(Failure::new(
            Code::Usage,
            "the standard output holds one mesh and nothing else",
        )
        .help("leave --json and other names out"));
    }
    if !args.force {
        let inputs = inputs_of(&args.store);
        for out in &args.out {
            check_target(out, &inputs).map_err(|e| Failure::from(e).or_force(out))?;
        }
    }
    let store = Store::open_with(&args.store, settings)?;
    let mut reports = Vec::new();
    for (out, of_ranks, is_ours, writers) in outs {
        if is_ours {
            note_numbers(options.check(out)?, &store, console);
        }
        let options = match of_ranks.filter(|_| args.share.is_none()) {
            Some(Share { number, of }) => options.clone().share(number, of),
            None => options.clone(),
        };
        reports.push(match (is_ours, writers) {
            (false, _) => Exported::default(),
            (true, None) => reported(store.export(out, &options)?, console),
            (true, Some(w)) => reported(store.export_together(out, &options, &*w)?, console),
        });
    }
    Ok(reports)
}

/// The options from these arguments. Errors: values that make no sense; parts that the store does not have.
fn options(args: &ExportArgs, settings: &Settings) -> Result<ExportOptions, Failure> {
    let mut options = ExportOptions::new().subdomains(&args.subdomain);
    if let Some(word) = &args.format {
        options = options.format(MeshFormat::from_word(word).ok_or_else(|| {
            Failure::new(Code::UnknownFormat, "no format has this name")
                .at(word)
                .help(format!("choose msh22, or an ending without its dot: {MESH_ENDINGS}"))
        })?);
    }
    if let Some(text) = &args.region {
        let store = Store::open_with(&args.store, settings.clone())?;
        let regions = regions(text, store.summary());
        options =
            options.regions(&regions.map_err(|f| f.help("`tetdb info STORE` lists the regions"))?);
    }
    if let Some(Share { number, of }) = args.share {
        options = options.share(number, of);
    }
    type Flag = fn(ExportOptions) -> ExportOptions;
    let flags: [(bool, Flag); 9] = [
        (args.pieces, ExportOptions::pieces),
        (args.boundary, ExportOptions::boundary),
        (args.interfaces, ExportOptions::interfaces),
        (args.ascii, ExportOptions::ascii),
        (args.ghosts, ExportOptions::ghosts),
        (args.split_sheets, ExportOptions::split_sheets),
        (args.one_partition, ExportOptions::one_partition),
        (args.order == 2, ExportOptions::second_order),
        (args.force, ExportOptions::over_inputs),
    ];
    let given = flags.into_iter().filter(|(is_given, _)| *is_given);
    Ok(given.fold(options, |options, (_, add)| add(options)))
}

/// The query whose answer is exported, for a file of rows.
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
        args.one_partition,
        args.order != 1,
        args.read.json,
        args.share.is_some(),
    ];
    let ([out], false) = (&args.out[..], of_meshes.contains(&true)) else {
        let message = ".csv and .jsonl are one file of rows, a tetrahedron each, and no mesh";
        return Err(Failure::new(Code::Usage, message).help(
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
        at: args.at.clone(),
        memory: args.read.memory.clone(),
        ..QueryArgs::default()
    }))
}

/// Refuses a file name without a known format, before any work.
pub fn check_format(out: &Path) -> Result<(), Failure> {
    match MeshFormat::from_extension(out) {
        Some(_) => Ok(()),
        None => Err(Failure::new(
            Code::UnknownFormat,
            "the format of a mesh file does not follow from its name",
        )
        .at(out.display())
        .help(format!("end the name with {MESH_ENDINGS}"))),
    }
}

/// Writes the whole mesh, even over an input. The names of the files were checked before the run.
pub fn write(
    path: &Path,
    out: &Path,
    settings: &Settings,
    console: &Console,
) -> Result<(), Failure> {
    let store = Store::open_with(path, settings.clone())?;
    let options = ExportOptions::new().over_inputs();
    note_numbers(options.check(out)?, &store, console);
    reported(store.export(out, &options)?, console);
    Ok(())
}

/// Says that a format has numbers only where the store has names.
fn note_numbers(format: MeshFormat, store: &Store, console: &Console) {
    use MeshFormat::{Gmsh22, Medit, MeditBinary, Nastran, Numpy, Su2, TetGen};
    let summary = store.summary();
    if let Some(set) = summary.label_sets.first()
        && matches!(format, Gmsh22 | Medit | MeditBinary | Nastran | Numpy | TetGen)
    {
        let name = &summary.labels[set.label as usize];
        console.note(&format!(
            "note: this format has one label for a triangle; those of several groups have one of their own, such as {name}"
        ));
    }
    if format == Nastran {
        console.note("note: this format rounds coordinates to 16 characters, 11 to 15 digits");
    }
    if format == Su2 {
        console.note("note: this format has faces of the boundary alone, not sheets and walls between regions");
    }
    let is_name = |name: &String| name.parse::<u64>().is_err();
    if matches!(format, Medit | MeditBinary | Numpy | TetGen)
        && store.summary().labels.iter().any(is_name)
    {
        console.note("note: this format has numbers in place of the names of labels and regions, in the order of `tetdb info`");
    }
}

fn reported(exported: Exported, console: &Console) -> Exported {
    console.done();
    note(&exported, console);
    exported
}

fn note(exported: &Exported, console: &Console) {
    for (file, bytes) in &exported.files {
        console.note(&format!("wrote {} ({})", file.display(), memory::show(*bytes)));
    }
}
