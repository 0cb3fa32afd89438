//! The command `resaturate`: meshes sub-domains of a finished store again.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::args::{ResaturateArgs, RunArgs};
use super::console::Console;
use super::failure::Failure;
use super::info::{hex, share_below_two};
use super::resaturate_sizes::{self, with_sizes};
use super::transfer::how;
use super::words::count;
use super::{memory, mesh};
use tetdb_engine::api::{
    AdaptPlan, Code, Remesh, RemeshForecast, Remeshed, Settings, Store, inputs_of, short,
};

pub fn run(args: &ResaturateArgs, console: &Console) -> Result<u8, Failure> {
    check(args)?;
    let mut inputs = inputs_of(&args.store);
    inputs.extend(args.sizes.size_field.iter().map(PathBuf::from));
    let settings = mesh::begin(&args.run, &inputs, console)?;
    let verify = !args.run.no_verify;
    if args.forget {
        return forget(Store::open_with(&args.store, settings)?, console);
    }
    if args.undo {
        let store = Store::open_with(&args.store, settings.clone())?;
        let undone = store.undo_reported(verify)?;
        return finish((&args.store, &args.run), (&undone, None), &settings, console);
    }
    let remesh = Remesh::new(&args.store, settings.clone()).verify(verify);
    let remesh = match (args.changed, args.repair) {
        (true, _) => remesh.changed(),
        (false, true) => remesh.subdomains(&args.subdomain).repair(),
        _ => remesh.subdomains(&args.subdomain),
    };
    let remesh = with_sizes(args, remesh)?;
    let remesh = if args.drop_fields { remesh.drop_fields() } else { remesh };
    if args.dry_run {
        let list = remesh.forecast()?;
        match list.is_empty() {
            true => print_nothing(args, console),
            false => print_forecast(&list, console),
        }
        return Ok(0);
    }
    let remeshed = remesh.run()?;
    if remeshed.subdomains.is_empty() {
        print_nothing(args, console);
        return Ok(0);
    }
    console.done();
    finish((&args.store, &args.run), (&remeshed, None), &settings, console)
}

/// Refuses options that exclude each other, before anything is read.
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

fn forget(mut store: Store, console: &Console) -> Result<u8, Failure> {
    let n = store.forget_previous()?;
    if console.is_json() {
        console.answer(&json!({ "schema": 1, "forgotten": n }));
    } else if !console.is_quiet() {
        console.line(&format!("dropped the previous version of {}", count(n as u64, "sub-domain")));
    }
    Ok(0)
}

fn print_nothing(args: &ResaturateArgs, console: &Console) {
    console.note(match args.repair {
        true => "no sub-domain is damaged",
        false => "no sub-domain would have other sizes",
    });
    if console.is_json() {
        console.answer(&json!({ "schema": 1, "subdomains": [] }));
    }
}

fn print_forecast(list: &[RemeshForecast], console: &Console) {
    if console.is_json() {
        console.answer(&json!({ "schema": 1, "dry_run": true, "subdomains": list }));
        return;
    }
    for f in list {
        console.line(&format!(
            "sub-domain {:>4}: {:>10} tetrahedra, about {} to expect",
            f.id,
            f.tets,
            short(f.predicted_tets)
        ));
    }
}

/// Exports the mesh and prints the changes.
pub fn finish(
    (store, run): (&Path, &RunArgs),
    (remeshed, plan): (&Remeshed, Option<&AdaptPlan>),
    settings: &Settings,
    console: &Console,
) -> Result<u8, Failure> {
    mesh::write_exports(store, run, settings, console)?;
    let cap = settings.cap()?;
    let summary = remeshed.store.summary();
    let (all, digest) = (summary.subdomains.len(), &summary.digest);
    let unchanged = all - remeshed.subdomains.len();
    if console.is_json() {
        let mut answer = json!({
            "schema": 1, "store": store.display().to_string(), "digest": digest,
            "subdomains": objects(remeshed),
            "unchanged": unchanged, "fields": remeshed.fields,
            "memory_cap_bytes": cap, "peak_bytes": memory::peak(),
            "pages_read": remeshed.pages_read, "pages_written": remeshed.pages_written,
            "frames_used": remeshed.frames_used,
        });
        if let Some(plan) = plan {
            answer["plan"] = json!(plan);
        }
        console.answer(&answer);
        return Ok(0);
    }
    if console.is_quiet() {
        return Ok(0);
    }
    for [old, new] in &remeshed.subdomains {
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
    for field in &remeshed.fields {
        console.line(&format!("field {}: {}", field.field.name, how(field)));
    }
    console.line(&format!(
        "{} as before; digest of all {digest}",
        count(unchanged as u64, "other sub-domain")
    ));
    Ok(0)
}

fn objects(remeshed: &Remeshed) -> Vec<Value> {
    let parts = remeshed.subdomains.iter().zip(&remeshed.inserted_vertices);
    let objects = parts.map(|([old, new], inserted)| {
        json!({
            "id": new.rank, "tets_before": old.tets, "tets": new.tets,
            "digest_before": hex(old.digest), "digest": hex(new.digest),
            "interface_digest_before": hex(old.interface_digest), "interface_digest": hex(new.interface_digest),
            "quality_before": old.quality, "quality": new.quality, "bytes": new.bytes, "inserted_vertices": inserted,
        })
    });
    objects.collect()
}
