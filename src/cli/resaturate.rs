//! `resaturate`: sub-domains of a finished store made again.

use std::collections::BTreeSet;
use std::path::PathBuf;
use tetdb_schema::code::Code;

use serde_json::{Value, json};

use super::args::ResaturateArgs;
use super::console::Console;
use super::failure::Failure;
use super::info::{hex, share_below_two};
use super::resaturate_sizes::{self, new_sizes};
use super::words::count;
use super::{memory, mesh};
use tetdb_base::geom::short;
use tetdb_base::storage::Budget;
use tetdb_engine::api::job::options_of;
use tetdb_engine::api::remesh::{damaged, verify_changed};
use tetdb_engine::api::store::{open_finished, open_to_change};
use tetdb_engine::api::targets::inputs_of;
use tetdb_engine::api::{Remesh, Settings};
use tetdb_engine::pipeline::{
    self, Forecast, NewSizes, Options, Remade, ResaturateSummary, Resaturation,
};
use tetdb_store::store::Catalog;

pub fn run(args: &ResaturateArgs, console: &Console) -> Result<u8, Failure> {
    check(args)?;
    let mut inputs = inputs_of(&args.store);
    inputs.extend(args.sizes.size_field.iter().map(PathBuf::from));
    let settings = mesh::begin(&args.run, &inputs, console)?;
    let cap = settings.cap()?;
    let budget = Budget::new(cap);
    let mut open = match args.dry_run {
        true => open_finished(&args.store)?,
        false => open_to_change(&args.store, &settings)?,
    };
    if args.forget {
        return forget(open, console);
    }
    if args.undo {
        let lock = open.lock();
        let summary = pipeline::undo(&mut open)?;
        open.close()?;
        if let (false, Some(lock)) = (args.run.no_verify, lock) {
            verify_changed(&args.store, &settings, lock)?;
        }
        return finish(args, &summary, &settings, console);
    }
    let options = Options::from(options_of(&open.job()?, &args.store)?);
    let sizes = new_sizes(args, &mut open, &options, &settings)?;
    let ranks = ranks(args, &mut open, &options, sizes.as_ref(), &budget)?;
    if ranks.is_empty() {
        console.note(match args.repair {
            true => "no sub-domain is damaged",
            false => "no sub-domain would have other sizes",
        });
        if console.is_json() {
            console.answer(&json!({ "schema": 1, "subdomains": [] }));
        }
        return Ok(0);
    }
    if args.dry_run {
        let what = Resaturation { ranks, sizes, repair: args.repair };
        let list = pipeline::forecast(&mut open, &options, &what, &budget)?;
        print_forecast(&list, console);
        return Ok(0);
    }
    let lock = open.lock();
    drop(open);
    let ranks: Vec<u32> = ranks.into_iter().collect();
    let mut remesh = Remesh::new(args.store.clone(), settings.clone())
        .subdomains(&ranks)
        .prepared_sizes(sizes)
        .locked(lock)
        .verify(!args.run.no_verify);
    if args.repair {
        remesh = remesh.repair();
    }
    let summary = remesh.run_reported()?;
    console.done();
    finish(args, &summary, &settings, console)
}

/// Refuses what makes no sense together, before anything is read.
fn check(args: &ResaturateArgs) -> Result<(), Failure> {
    let usage = |message: &str, help: &str| Err(Failure::new(Code::Usage, message).help(help));
    let has_sizes = resaturate_sizes::are_given(args);
    if args.undo || args.forget || args.repair {
        return match has_sizes {
            true => {
                usage("--undo, --forget and --repair take no sizes", "leave the size options away")
            }
            false => Ok(()),
        };
    }
    match (args.changed, has_sizes, args.subdomain.is_empty()) {
        (true, false, _) => {
            usage("--changed has no sizes to compare with", "give size options, such as --hsiz 1%")
        }
        (false, _, true) => usage(
            "nothing says which sub-domains to make again",
            "name them, as in --subdomain 5,9, or give sizes and --changed; `tetdb info STORE` lists them",
        ),
        _ => Ok(()),
    }
}

/// Which sub-domains to make again.
fn ranks(
    args: &ResaturateArgs,
    open: &mut Catalog,
    options: &Options,
    sizes: Option<&NewSizes>,
    budget: &Budget,
) -> Result<BTreeSet<u32>, Failure> {
    match sizes {
        Some(sizes) if args.changed => Ok(pipeline::changed(open, options, sizes, budget)?),
        _ if args.repair && args.subdomain.is_empty() => Ok(damaged(open)?),
        _ => Ok(args.subdomain.iter().copied().collect()),
    }
}

fn forget(mut catalog: Catalog, console: &Console) -> Result<u8, Failure> {
    let n = pipeline::forget(&mut catalog)?;
    catalog.close()?;
    if console.is_json() {
        console.answer(&json!({ "schema": 1, "forgotten": n }));
    } else if !console.is_quiet() {
        console.line(&format!("dropped the previous version of {}", count(n as u64, "sub-domain")));
    }
    Ok(0)
}

fn print_forecast(list: &[Forecast], console: &Console) {
    if console.is_json() {
        let list: Vec<Value> = (list.iter())
            .map(|f| json!({ "id": f.rank, "tets": f.tets, "predicted_tets": f.predicted.round() }))
            .collect();
        console.answer(&json!({ "schema": 1, "dry_run": true, "subdomains": list }));
        return;
    }
    for f in list {
        console.line(&format!(
            "sub-domain {:>4}: {:>10} tetrahedra, about {} to expect",
            f.rank,
            f.tets,
            short(f.predicted.round())
        ));
    }
}

/// Exports, and what changed.
fn finish(
    args: &ResaturateArgs,
    summary: &ResaturateSummary,
    settings: &Settings,
    console: &Console,
) -> Result<u8, Failure> {
    mesh::write_exports(&args.store, &args.run, settings, console)?;
    let cap = settings.cap()?;
    let mut open = Catalog::open(&args.store)?;
    let all = open.subdomains()?.len();
    let [digest, _] = open.digest()?;
    if console.is_json() {
        console.answer(&json!({
            "schema": 1, "store": args.store.display().to_string(), "digest": digest.to_string(),
            "subdomains": summary.parts.iter().map(object).collect::<Vec<_>>(),
            "unchanged": all - summary.parts.len(),
            "memory_cap_bytes": cap, "peak_bytes": memory::peak(),
            "pages_read": summary.pages.pages_read, "pages_written": summary.pages.pages_written,
            "frames_used": summary.frames_used,
        }));
        return Ok(0);
    }
    if console.is_quiet() {
        return Ok(0);
    }
    for part in &summary.parts {
        let (old, new) = (&part.before, &part.after);
        console.line(&format!(
            "sub-domain {}: {} -> {} tetrahedra; {} -> {} % of quality below 2; worst {} -> {}",
            new.rank,
            old.tets,
            new.tets,
            short(share_below_two(&old.quality)),
            short(share_below_two(&new.quality)),
            short(old.quality.worst),
            short(new.quality.worst)
        ));
        console.line(&match old.digest == new.digest {
            true => format!("  digest {} as before", hex(new.digest)),
            false => format!("  digest {} -> {}", hex(old.digest), hex(new.digest)),
        });
        if new.interface_faces > 0 {
            console.line(&format!(
                "  {} interface faces as before, digest {}",
                new.interface_faces,
                hex(new.interface_digest)
            ));
        }
    }
    console.line(&format!(
        "{} as before; digest of all {digest}",
        count((all - summary.parts.len()) as u64, "other sub-domain")
    ));
    Ok(0)
}

fn object(part: &Remade) -> Value {
    let (old, new) = (&part.before, &part.after);
    json!({
        "id": new.rank, "tets_before": old.tets, "tets": new.tets,
        "digest_before": hex(old.digest), "digest": hex(new.digest),
        "interface_digest_before": hex(old.interface_digest), "interface_digest": hex(new.interface_digest),
        "quality_before": old.quality, "quality": new.quality, "bytes": new.bytes,
        "inserted_vertices": part.fine.as_ref().map(|fine| fine.refine.inserted),
    })
}
