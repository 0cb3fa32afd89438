//! `check`: can a surface be meshed, what would mend it, what mesh does it allow?

use std::path::PathBuf;

use serde_json::json;

use super::args::CheckArgs;
use super::check_report::Findings;
use super::console::Console;
use super::failure::Failure;
use super::input::{self, Space};
use super::memory;
use tetdb_base::geom::short;
use tetdb_base::storage::attempt;
use tetdb_base::surface::{Repair, Surface, repair, repair_bytes, validate_with};
use tetdb_engine::api;
use tetdb_engine::api::error::{Error, Remedy};
use tetdb_engine::api::surface::WELD_SHARE_MAX;
use tetdb_engine::api::targets::check_target;
use tetdb_io::write;

/// A repair that was made.
struct Mended {
    weld_share: Option<f64>,
    weld_distance: Option<f64>,
    done: Repair,
    /// Triangles, vertices and defects before.
    before: (usize, usize, u64),
}

pub fn run(args: &CheckArgs, console: &Console) -> Result<u8, Failure> {
    // Options are checked before anything is read.
    if args.repair && (args.sheets.allow_open || args.sheets.files().next().is_some()) {
        return Err(Failure::new("usage", "a surface is repaired before sheets are embedded")
            .help("repair each file for itself"));
    }
    let weld_share = args.weld.as_deref().map(share).transpose()?;
    let inputs = args.surfaces.iter().chain(args.sheets.files());
    let inputs: Vec<PathBuf> = inputs.map(PathBuf::from).collect();
    for out in args.write.iter().chain(&args.write_bad) {
        check_target(out, &inputs)?;
    }
    // A check writes nothing beside what it reads.
    let beside = std::env::temp_dir().join("check");
    let space = Space::of(args.memory.as_deref(), &beside)?;
    let mut input = input::load_with(&args.surfaces, (&args.sheets, false), space, console)?;
    let mended = match args.repair {
        true => Some(mend(&mut input, weld_share, space)?),
        false => None,
    };
    let findings = Findings::of(&input.inner, input.turned, space, console)?;
    let written = write_files(args, &input.inner, &findings, console)?;
    if console.is_json() {
        let mut answer = findings.json();
        if let Some(mended) = &mended {
            answer["repair"] = mended.json();
        }
        for (field, value) in written {
            answer[field] = value;
        }
        console.answer(&answer);
    } else {
        if let Some(mended) = &mended {
            mended.print(console);
        }
        findings.print(&args.surfaces, mended.is_some(), console);
    }
    Ok(if findings.is_valid() { 0 } else { 3 })
}

fn share(text: &str) -> Result<f64, Failure> {
    match text.parse::<f64>() {
        Ok(share) if share > 0.0 && share <= WELD_SHARE_MAX => Ok(share),
        _ => Err(Failure::new(
            "bad-size",
            format!(
                "--weld {text} is not a share of the box diagonal, expected above 0 and at most {WELD_SHARE_MAX}"
            ),
        )
        .help("for example --weld 1e-6; `tetdb check SURFACE` says what would close an open surface")),
    }
}

/// Repairs; errors: too little memory for it.
fn mend(
    input: &mut api::Surface,
    weld_share: Option<f64>,
    space: Space,
) -> Result<Mended, Failure> {
    let surface = &mut input.inner;
    let least = repair_bytes(surface);
    if space.cap < least {
        let message = format!(
            "a surface of {} triangles is repaired in {} of memory",
            surface.n_triangles(),
            memory::show(least)
        );
        return Err(Error::new("memory", message).with_remedy(Remedy::Memory(least)).into());
    }
    let scratch = space.scratch(surface)?;
    let n_defects = attempt(|| validate_with(surface, &scratch))?.n_defects;
    let before = (surface.n_triangles(), surface.n_vertices(), n_defects);
    let weld_distance = weld_share.map(|share| share * surface.bounds().diagonal());
    let mut done = repair(surface, weld_distance);
    // Those turned while reading count too.
    done.turned += input.turned;
    input.turned = done.turned;
    Ok(Mended { weld_share, weld_distance, done, before })
}

impl Mended {
    fn json(&self) -> serde_json::Value {
        let (triangles, vertices, n_defects) = self.before;
        json!({
            "weld": self.weld_share, "weld_distance": self.weld_distance, "points_joined": self.done.points_joined,
            "collapsed_dropped": self.done.collapsed_dropped, "repeated_dropped": self.done.repeated_dropped,
            "divided": self.done.divided, "turned": self.done.turned,
            "before": { "triangles": triangles, "vertices": vertices, "n_defects": n_defects },
        })
    }

    fn print(&self, console: &Console) {
        let (triangles, vertices, n_defects) = self.before;
        console.line(&format!(
            "before: {triangles} triangles, {vertices} vertices, {n_defects} defects"
        ));
        let done = &self.done;
        let joined = match (self.weld_share, self.weld_distance) {
            (Some(share), Some(distance)) => format!(
                "{} points joined (nearer than {share:e} of the box diagonal, {}), ",
                done.points_joined,
                short(distance)
            ),
            _ => String::new(),
        };
        console.line(&format!(
            "repair: {joined}{} triangles without area and {} repeated ones dropped, {} divided at T-junctions, {} turned",
            done.collapsed_dropped, done.repeated_dropped, done.divided, done.turned
        ));
    }
}

/// Writes what was asked for; returns fields of the answer.
fn write_files(
    args: &CheckArgs,
    surface: &Surface,
    findings: &Findings,
    console: &Console,
) -> Result<Vec<(&'static str, serde_json::Value)>, Failure> {
    let mut fields = Vec::new();
    if let Some(out) = &args.write {
        let report = write::surface(surface, out)?;
        let state = match findings.validation.n_defects {
            0 => "validated again, free of defects".to_owned(),
            n => format!("validated again, still with {n} defects"),
        };
        console.note(&format!("wrote {}: {state}", out.display()));
        if !report.labels_kept {
            console.note("note: this format has no place for the labels");
        }
        fields.push((
            "written",
            json!({ "file": out.display().to_string(), "bytes": report.bytes, "labels_kept": report.labels_kept }),
        ));
    }
    if let Some(out) = &args.write_bad {
        let defects = &findings.validation.defects;
        let mut n = 0;
        let mut file = None;
        if defects.is_empty() {
            // A file without cells is one that some programs cannot read.
            console.note(&format!("no triangle is defective: {} was not written", out.display()));
        } else {
            n = write::defects(surface, defects, out)?;
            console.note(&format!("wrote {n} defective triangles to {}", out.display()));
            file = Some(out.display().to_string());
        }
        fields.push(("bad_triangles", json!({ "file": file, "triangles": n })));
    }
    Ok(fields)
}
