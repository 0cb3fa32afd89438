//! `resaturate`: sub-domains of a finished store made again.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::{Value, json};

use super::args::ResaturateArgs;
use super::console::Console;
use super::failure::Failure;
use super::info::{hex, share_below_two};
use super::input::Space;
use super::resaturate_sizes::{self, new_sizes};
use super::{memory, mesh, signals, store, verify};
use crate::audit::Level;
use crate::pipeline::{self, Forecast, NewSizes, Options, Remade, ResaturateSummary, Resaturation};
use crate::storage::Budget;
use crate::store::{Catalog, StoreError};
use tetdb_schema::catalog::StoreState;

pub fn run(args: &ResaturateArgs, console: &Console) -> Result<u8, Failure> {
    check(args)?;
    let (cap, _) = mesh::begin(&args.run, console)?;
    // What is read before the change ends at a signal all the same; a change is one commit.
    signals::store_begins();
    let budget = Budget::new(cap);
    let mut open = store::open_finished(&args.store)?;
    if args.forget {
        drop(open);
        return forget(&args.store, console);
    }
    if args.undo {
        drop(open);
        let mut catalog = Catalog::open_writable(&args.store)?;
        let summary = pipeline::undo(&mut catalog)?;
        catalog.close()?;
        return finish(args, &summary, cap, console);
    }
    let options = resaturate_sizes::options_of(&mut open, &args.store)?;
    let sizes = new_sizes(args, &mut open, &options, cap, console)?;
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
    let what = Resaturation {
        ranks,
        sizes,
        repair: args.repair,
    };
    if args.dry_run {
        let list = pipeline::forecast(&mut open, &options, &what, &budget)?;
        tell_forecast(&list, console);
        return Ok(0);
    }
    drop(open);
    let mut catalog = Catalog::open_writable(&args.store)?;
    let watch = |event| console.progress(event);
    let summary = pipeline::resaturate(&mut catalog, &options, &what, &budget, &watch)?;
    console.done();
    catalog.close()?;
    finish(args, &summary, cap, console)
}

/// Refuses what makes no sense together, before anything is read.
fn check(args: &ResaturateArgs) -> Result<(), Failure> {
    let usage = |message: &str, help: &str| Err(Failure::new("usage", message).help(help));
    let has_sizes = resaturate_sizes::are_given(args);
    if args.undo || args.forget || args.repair {
        return match has_sizes {
            true => usage(
                "--undo, --forget and --repair take no sizes",
                "leave the size options away",
            ),
            false => Ok(()),
        };
    }
    match (args.changed, has_sizes, args.subdomain.is_empty()) {
        (true, false, _) => usage(
            "--changed has no sizes to compare with",
            "give size options, such as --hsiz 1%",
        ),
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
        _ if args.repair && args.subdomain.is_empty() => damaged(open),
        _ => Ok(args.subdomain.iter().copied().collect()),
    }
}

/// The sub-domains of which something cannot be read.
fn damaged(open: &mut Catalog) -> Result<BTreeSet<u32>, Failure> {
    let mut ranks = BTreeSet::new();
    for row in open.subdomains()? {
        match read_all(open, row.rank) {
            Err(error) if error.is_damage() => drop(ranks.insert(row.rank)),
            other => other?,
        }
    }
    Ok(ranks)
}

fn read_all(catalog: &mut Catalog, rank: u32) -> Result<(), StoreError> {
    /// For chunks and what redb holds of the file.
    const MEMORY_BYTES: usize = 8 << 20;
    let mut part = catalog.open_subdomain(rank, MEMORY_BYTES)?;
    part.vertex_chunks().try_for_each(|c| c.map(drop))?;
    part.tet_chunks().try_for_each(|c| c.map(drop))?;
    part.facet_chunks().try_for_each(|c| c.map(drop))?;
    part.interface_chunks().try_for_each(|c| c.map(drop))?;
    Ok(part.check()?)
}

fn forget(path: &Path, console: &Console) -> Result<u8, Failure> {
    let mut catalog = Catalog::open_writable(path)?;
    let n = pipeline::forget(&mut catalog)?;
    catalog.close()?;
    if console.is_json() {
        console.answer(&json!({ "schema": 1, "forgotten": n }));
    } else {
        console.line(&format!(
            "dropped the previous version of {n} sub-domain(s)"
        ));
    }
    Ok(0)
}

fn tell_forecast(list: &[Forecast], console: &Console) {
    if console.is_json() {
        let list: Vec<Value> = (list.iter())
            .map(|f| json!({ "id": f.rank, "tets": f.tets, "predicted_tets": f.predicted.round() }))
            .collect();
        console.answer(&json!({ "schema": 1, "dry_run": true, "subdomains": list }));
        return;
    }
    for f in list {
        console.line(&format!(
            "sub-domain {:>4}: {:>10} tetrahedra, about {:.3e} to expect",
            f.rank, f.tets, f.predicted
        ));
    }
}

/// Verifies, exports, tells.
fn finish(
    args: &ResaturateArgs,
    summary: &ResaturateSummary,
    cap: u64,
    console: &Console,
) -> Result<u8, Failure> {
    if !args.run.no_verify {
        prove(&args.store, cap, console)?;
    }
    mesh::write_exports(&args.store, &args.run, cap, console)?;
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
    for part in &summary.parts {
        let (old, new) = (&part.before, &part.after);
        console.line(&format!(
            "sub-domain {}: {} -> {} tetrahedra; {:.2} -> {:.2} % of quality below 2; worst {:.3} -> {:.3}",
            new.rank,
            old.tets,
            new.tets,
            share_below_two(&old.quality),
            share_below_two(&new.quality),
            old.quality.worst,
            new.quality.worst
        ));
        console.line(&match old.digest == new.digest {
            true => format!("  digest {} as before", hex(new.digest)),
            false => format!("  digest {} -> {}", hex(old.digest), hex(new.digest)),
        });
        console.line(&format!(
            "  {} interface faces as before, digest {}",
            new.interface_faces,
            hex(new.interface_digest)
        ));
    }
    console.line(&format!(
        "{} other sub-domain(s) as before; digest of all {digest}",
        all - summary.parts.len()
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

/// Verifies the whole store, against its surface if that is still there.
fn prove(path: &Path, cap: u64, console: &Console) -> Result<(), Failure> {
    let report = {
        let mut open = store::open_finished(path)?;
        let surface = store::surface_of(&mut open, &[], Space::Boundless, console).ok();
        let surface = surface.as_ref().map(|input| &input.surface);
        if surface.is_none() {
            console.note("note: the surface is not where it was; the mesh is verified without it");
        }
        verify::check(&mut open, console, surface, cap, Level::Delaunay)?
    };
    if !report.valid {
        let failure = verify::invalid(&report, path);
        return Err(failure.help(format!(
            "`tetdb resaturate {} --undo` brings back what was before",
            path.display()
        )));
    }
    console.note(&verify::sentence(&report));
    let mut catalog = Catalog::open_writable(path)?;
    catalog.commit(|step| {
        step.set_state(StoreState::Verified);
        Ok(())
    })?;
    Ok(catalog.close()?)
}
