//! The command `adapt`: sub-domains meshed again with the lengths that a field asks for.

use serde_json::json;

use super::args::AdaptArgs;
use super::console::Console;
use super::failure::Failure;
use super::mesh;
use super::resaturate::finish;
use super::words::count;
use tetdb_engine::api::{AdaptPlan, Error, LongFaces, OptionsText, Store, inputs_of, short};

pub fn run(args: &AdaptArgs, console: &Console) -> Result<u8, Failure> {
    let settings = mesh::begin(&args.run, &inputs_of(&args.store), console)?;
    let store = Store::open_with(&args.store, settings.clone())?;
    let limits = OptionsText {
        hmin: args.hmin.clone(),
        hmax: args.hmax.clone(),
        hgrad: args.hgrad.clone(),
        ..OptionsText::default()
    };
    let sizes = (limits.sizes().map_err(Error::from)?, None);
    let adapt = store.adapt(&args.field).sizes(sizes.into()).change(args.change);
    let adapt = adapt.verify(!args.run.no_verify).estimate(args.estimate.unwrap_or_default());
    let adapt = match (args.tets, args.factor) {
        (Some(n), _) => adapt.tets(n),
        (None, factor) => adapt.factor(factor.unwrap_or(1.0)),
    };
    if args.dry_run {
        let plan = adapt.plan()?;
        console.done();
        match console.is_json() {
            true => console.answer(&json!({ "schema": 1, "dry_run": true, "plan": plan })),
            false => print(&plan, console),
        }
        return Ok(0);
    }
    let adapted = adapt.run()?;
    console.done();
    if !console.is_json() && !console.is_quiet() {
        print(&adapted.plan, console);
    }
    if adapted.remeshed.subdomains.is_empty() {
        console.note("no sub-domain would have other sizes");
    }
    finish((&args.store, &args.run), (&adapted.remeshed, Some(&adapted.plan)), &settings, console)
}

fn print(plan: &AdaptPlan, console: &Console) {
    let changed: Vec<_> = plan.subdomains.iter().filter(|s| s.is_changed).collect();
    let [least, greatest] = plan.sizes.map(short);
    console.line(&format!(
        "{} tetrahedra, {} wanted, about {} to expect; lengths from {least} to {greatest}",
        plan.tets,
        short(plan.wanted_tets),
        short(plan.predicted_tets)
    ));
    for s in &changed {
        console.line(&format!(
            "sub-domain {:>4}: {:>10} tetrahedra, about {} to expect; other lengths in {} % of it",
            s.id,
            s.tets,
            short(s.predicted_tets),
            short(100.0 * s.changed_share)
        ));
    }
    let kept = (plan.subdomains.len() - changed.len()) as u64;
    if kept > 0 {
        console.line(&format!("{} unchanged", count(kept, "sub-domain")));
    }
    for (what, faces) in
        [("surface triangle", &plan.surface), ("interface triangle", &plan.interfaces)]
    {
        let LongFaces { triangles, too_long, greatest_ratio, .. } = faces;
        if *too_long > 0 {
            console.line(&format!(
                "{} of {triangles} longer than wanted there, {} times at most; they stay",
                count(*too_long, what),
                short(*greatest_ratio)
            ));
        }
    }
}
