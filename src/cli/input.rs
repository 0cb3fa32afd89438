//! Surfaces given as arguments: files, or generated samples.

use std::path::Path;

use super::args::{RemeshArgs, RepairArgs, SheetArgs, WrapLengths};
use super::console::Console;
use super::failure::Failure;
use super::words::count;
use super::wrap;
use tetdb_engine::api::{
    Code, EmbeddedKind, Error, Length, MeshOptions, RepairKind, RepairStep, ResolveReport,
    Settings, Surface, SurfaceRemesh, SurfaceWrap, SurfaceWritten,
};

/// The same settings, with temporary files in the folder of `file` or its nearest existing parent.
pub fn scratch_beside(settings: Settings, file: &Path) -> Settings {
    let absolute = std::path::absolute(file).unwrap_or_default();
    let above = absolute.ancestors().skip(usize::from(file != Path::new(".")));
    match above.into_iter().find(|folder| folder.is_dir()) {
        Some(folder) => settings.scratch(folder),
        None => settings,
    }
}

/// Says what of a surface its file does not keep.
pub fn note_lost(surface: &Surface, written: SurfaceWritten, console: &Console) {
    if !written.labels_kept {
        console.note("note: this format has no place for the labels");
    }
    if !surface.seeds().is_empty() {
        console.note("note: points that mark regions and holes are not written");
    }
}

/// Says how a surface was repaired.
pub fn note_repaired(steps: &[RepairStep], console: &Console) {
    if steps.is_empty() {
        console.note("note: the surface has no defects, and was not repaired");
    }
    for step in steps {
        match step {
            RepairStep::Resolve(done) => note_resolved(done, console),
            RepairStep::Winding(done) => {
                console.note(&format!("note: closed: {}", done.in_words()));
            }
            RepairStep::Wrap(_) => console.note(&format!("note: wrapped: {}", step.in_words())),
            other => console.note(&format!("note: repaired: {}", other.in_words())),
        }
    }
}

/// Says what was done to crossings, and which regions there are now.
fn note_resolved(done: &ResolveReport, console: &Console) {
    console.note(&format!("note: resolved: {}", done.done.in_words()));
    if let [first, rest @ ..] = &done.regions[..] {
        let or = rest.iter().map(|rule| format!(" or --regions {rule}")).collect::<String>();
        console.note(&format!(
            "note: parts overlap, and parity leaves empty what lies in two of them: --regions {first}{or} fills that too"
        ));
    }
}

/// The lengths of the wrap that a mesh begins with, if it does.
fn wrap_lengths(repair: &RepairArgs) -> Result<Option<SurfaceWrap>, Failure> {
    let [gap, offset] = [&repair.wrap_gap, &repair.wrap_offset].map(Clone::clone);
    let is_wrap = matches!(repair.repair, Some(RepairKind::Wrap));
    if !is_wrap && (gap.is_some() || offset.is_some()) {
        let message = "--wrap-gap and --wrap-offset belong to --repair wrap";
        return Err(Failure::new(Code::Usage, message).help("leave them out, or wrap the surface"));
    }
    let lengths = wrap::lengths(&WrapLengths { gap, offset }, ["wrap-gap", "wrap-offset"])?;
    Ok(is_wrap.then_some(lengths))
}

/// Repairs a surface; the error for one that goes around nothing says what is left to do.
pub fn repaired_by(
    surface: Surface,
    kind: RepairKind,
    settings: &Settings,
) -> Result<(Surface, Vec<RepairStep>), Failure> {
    surface.repaired_by(kind, settings).map_err(|e| match e.code() {
        Code::NothingFilled => Failure::from(e).help(
            "--repair wrap puts a closed surface around all of it, at an offset; a sheet inside another surface is given with --embed",
        ),
        _ => e.into(),
    })
}

/// Repairs a surface if that is asked for, and says how.
pub fn repaired(
    surface: Surface,
    repair: &RepairArgs,
    settings: &Settings,
    console: &Console,
) -> Result<Surface, Failure> {
    let lengths = wrap_lengths(repair)?;
    let Some(kind) = repair.repair else { return Ok(surface) };
    let (surface, steps) = match lengths {
        Some(lengths) => {
            let (wrap, done) = surface.wrapped_with(&lengths, settings)?;
            (wrap, vec![RepairStep::Wrap(done)])
        }
        None => repaired_by(surface, kind, settings)?,
    };
    note_repaired(&steps, console);
    Ok(surface)
}

/// Says of triangles in an error that they are counted in the repaired or remeshed surface.
pub fn in_prepared(mut failure: Failure, (repair, args): (&RepairArgs, &RemeshArgs)) -> Failure {
    let what = match (args.remesh_surface, repair.repair) {
        (true, _) => "remeshed",
        (false, Some(_)) => "repaired",
        (false, None) => return failure,
    };
    if let Some(place) = failure.place.as_mut().filter(|place| place.starts_with("triangle")) {
        place.push_str(&format!("; triangles are counted in the {what} surface"));
    }
    failure
}

/// Repairs and remeshes a surface before it is meshed with `options`, where that is asked for.
pub fn prepared(
    surface: Surface,
    (repair, args): (&RepairArgs, &RemeshArgs),
    options: &MeshOptions,
    settings: &Settings,
    console: &Console,
) -> Result<Surface, Failure> {
    let surface = repaired(surface, repair, settings, console)?;
    if !args.remesh_surface {
        return Ok(surface);
    }
    let mut how = SurfaceRemesh::default().sized(&options.sizes);
    if let Some(text) = &args.remesh_tolerance {
        how.tolerance = Length::parse("remesh-tolerance", text).map_err(Error::from)?;
    }
    how.feature_angle = args.remesh_angle.unwrap_or(how.feature_angle);
    let (even, report) = surface.remeshed_with(&how, settings)?;
    console.note(&format!("note: remeshed: {}", report.in_words()));
    Ok(even)
}

/// Reads files or generates a sample, and embeds sheets, edges and points.
///
/// `prepare` is called before anything is embedded. As `options` say, triangles are divided where edges and points lie on them, and points are moved there.
pub fn load_with(
    arguments: &[String],
    prepare: impl FnOnce(Surface) -> Result<Surface, Failure>,
    sheets: &SheetArgs,
    options: &MeshOptions,
    settings: &Settings,
    console: &Console,
) -> Result<Surface, Failure> {
    let mut names: Vec<(&str, &str)> = Vec::new();
    for text in &sheets.name {
        let (file, name) = text.rsplit_once('=').unwrap_or((text, ""));
        if name.is_empty() || !sheets.files().any(|embedded| embedded == file) {
            let message = format!("--name {text} is not an embedded file, `=` and a name");
            return Err(Failure::new(Code::Usage, message)
                .help("such as --embed fault.stl --name fault.stl=north"));
        }
        names.push((file, name));
    }
    let mut surface = prepare(Surface::load(arguments, settings)?)?;
    if sheets.allow_open {
        let (with, n) = surface.open_parts_with(settings)?;
        surface = with;
        console.note(&format!("note: sheets: {} of open parts", count(n as u64, "triangle")));
    }
    let name_of = |file: &String| {
        let name = names.iter().find(|(known, _)| known == file);
        name.map(|(_, name)| *name)
    };
    for file in &sheets.embed {
        let sheet = Surface::load(std::slice::from_ref(file), settings)?;
        surface = surface.embedded(sheet, name_of(file))?;
    }
    if options.refine_surface {
        surface = surface.dividing();
    }
    if let Some(within) = options.snap_embedded {
        surface = surface.snapping(within);
    }
    surface = surface.own_edges_with(settings)?;
    let edges = sheets.embed_edges.iter().map(|file| (file, EmbeddedKind::Edges));
    let points = sheets.embed_points.iter().map(|file| (file, EmbeddedKind::Points));
    for (file, kind) in edges.chain(points) {
        surface = surface.embedded_with(file, kind, name_of(file), settings)?;
    }
    let [edges, points] = surface.n_embedded().map(|n| n as u64);
    if edges + points > 0 {
        console.note(&format!(
            "note: inside: {} and {}",
            count(edges, "edge"),
            count(points, "point")
        ));
    }
    Ok(surface)
}
