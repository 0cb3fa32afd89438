//! The command `check`: reports whether a surface can be meshed, how to repair it, and what mesh it allows.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::args::CheckArgs;
use super::check_report::Printed;
use super::config;
use super::console::Console;
use super::failure::Failure;
use super::input;
use super::memory;
use super::words;
use tetdb_engine::api::targets::check_target;
use tetdb_engine::api::{
    Code, RepairReport, RepairStep, Surface, SurfaceReport, WELD_SHARE_MAX, short, typed,
};

pub fn run(args: &CheckArgs, console: &Console) -> Result<u8, Failure> {
    // Options are validated before anything is read.
    if args.repair.is_some() && (args.sheets.allow_open || args.sheets.files().next().is_some()) {
        return Err(Failure::new(Code::Usage, "a surface is repaired before sheets are embedded")
            .help("repair each file for itself"));
    }
    let weld_share = args.weld.as_deref().map(share).transpose()?;
    let inputs = args.surfaces.iter().chain(args.sheets.files());
    let inputs: Vec<PathBuf> = inputs.map(PathBuf::from).collect();
    for out in args.write.iter().chain(&args.write_bad) {
        check_target(out, &inputs)?;
    }
    // A check writes no temporary files next to its input.
    let settings = console.settings(memory::requested(args.memory.as_deref())?, None);
    let options = typed(config::inside_of(&args.inside))?;
    let mut surface =
        input::load_with(&args.surfaces, Ok, &args.sheets, &options, &settings, console)?;
    if args.repair.is_none() {
        surface = surface.inside_settled(options.embed_outside, &settings)?;
    }
    let mut repair = None;
    if args.repair == Some(None) || args.weld.is_some() {
        let done;
        (surface, done) = surface.repair_reported(weld_share, &settings)?;
        repair = Some(done);
    }
    let mut steps = None;
    if let Some(Some(kind)) = args.repair {
        let done;
        (surface, done) = input::repaired_by(surface, kind, &settings)?;
        steps = Some(done);
    }
    let report = surface.report(&settings, console.is_verbose())?;
    let written = write_files(args, &surface, &report, console)?;
    if console.is_json() {
        let mut answer = json!(report);
        answer["schema"] = json!(1);
        if let Some(repair) = &repair {
            answer["repair"] = json!(repair);
        }
        for step in steps.iter().flatten() {
            match step {
                RepairStep::Resolve(done) => answer["resolve"] = json!(done),
                RepairStep::Winding(done) => answer["winding"] = json!(done),
                RepairStep::Wrap(done) => answer["wrap"] = json!(done),
                RepairStep::Weld(done) => answer["repair"] = json!(done),
                _ => {}
            }
        }
        for (field, value) in written {
            answer[field] = value;
        }
        console.answer(&answer);
    } else {
        if let Some(repair) = &repair {
            print_repair(repair, console);
        }
        if let Some(steps) = &steps {
            input::note_repaired(steps, console);
        }
        let surfaces: Vec<String> =
            args.surfaces.iter().map(|word| words::quoted(Path::new(word))).collect();
        let (surfaces, is_repaired) = (&surfaces.join(" "), args.repair.is_some());
        Printed { surface: &surface, report: &report, surfaces, is_repaired }.print(console);
    }
    Ok(if report.is_valid() { 0 } else { 3 })
}

fn share(text: &str) -> Result<f64, Failure> {
    match text.parse::<f64>() {
        Ok(share) if share > 0.0 && share <= WELD_SHARE_MAX => Ok(share),
        _ => Err(Failure::new(
            Code::BadSize,
            format!(
                "--weld {text} is not a share of the box diagonal, expected above 0 and at most {WELD_SHARE_MAX}"
            ),
        )
        .help("for example --weld 1e-6; `tetdb check SURFACE` says what would close an open surface")),
    }
}

fn print_repair(report: &RepairReport, console: &Console) {
    console.line(&format!(
        "before: {} triangles, {} vertices, {} defects",
        report.triangles_before, report.vertices_before, report.n_defects_before
    ));
    let done = &report.done;
    let joined = match (report.weld, report.weld_distance) {
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

/// Writes the requested files. Returns fields of the answer.
fn write_files(
    args: &CheckArgs,
    surface: &Surface,
    report: &SurfaceReport,
    console: &Console,
) -> Result<Vec<(&'static str, serde_json::Value)>, Failure> {
    let mut fields = Vec::new();
    if let Some(out) = &args.write {
        let written = surface.write(out)?;
        let state = match report.validation.n_defects {
            0 => "validated again, free of defects".to_owned(),
            n => format!("validated again, still with {n} defects"),
        };
        console.note(&format!("wrote {}: {state}", out.display()));
        input::note_lost(surface, written, console);
        fields.push((
            "written",
            json!({ "file": out.display().to_string(), "bytes": written.bytes, "labels_kept": written.labels_kept }),
        ));
    }
    if let Some(out) = &args.write_bad {
        let n = surface.write_defects(report, out)?;
        let mut file = None;
        if n == 0 {
            // Some programs cannot read a file without cells.
            console.note(&format!("no triangle is defective: {} was not written", out.display()));
        } else {
            console.note(&format!("wrote {n} defective triangles to {}", out.display()));
            file = Some(out.display().to_string());
        }
        fields.push(("bad_triangles", json!({ "file": file, "triangles": n })));
    }
    Ok(fields)
}
