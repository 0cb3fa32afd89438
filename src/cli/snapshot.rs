//! The command `snapshot`: a picture of a cut through the mesh, or of surfaces in space.

use super::args::SnapshotArgs;
use super::console::Console;
use super::failure::Failure;
use super::memory;
use super::query_ask::{bad, condition, numbers};
use tetdb_engine::api::{Code, ColorBy, Snapped, Snapshot, Store, Word};

/// Least and greatest width or height of a picture, in pixels.
const SIDE: std::ops::RangeInclusive<u32> = 64..=16_384;

pub fn run(args: &SnapshotArgs, console: &Console) -> Result<u8, Failure> {
    let settings =
        args.at.of(console.settings(memory::requested(args.read.memory.as_deref())?, None));
    let store = Store::open_with(&args.store, settings)?;
    let snapshot = snapshot(args, &store).map_err(|error| match error.code {
        Code::BadQuery => error.help("`tetdb snapshot --help` has examples"),
        _ => error,
    })?;
    let snapped = store.snapshot(&args.output, &snapshot).map_err(|error| {
        match (error.code(), &args.plane) {
            (Code::BadQuery, Some(plane)) => {
                bad("--plane", plane, "a plane that cuts tetrahedra of the mesh")
            }
            _ => error.into(),
        }
    })?;
    console.done();
    print(args, &snapped, console);
    Ok(0)
}

/// The requested picture. Errors: options that make no sense.
fn snapshot(args: &SnapshotArgs, store: &Store) -> Result<Snapshot, Failure> {
    let [width, height] = pixels(&args.size)?;
    let (mut snapshot, in_space) = subject(args)?;
    if let (Some(from), false) = (&args.from, in_space) {
        let expected = "a picture in space: --surface, --shell, or an interface with --stage";
        return Err(bad("--from", from, expected));
    }
    let color = ColorBy::from_word(&args.color);
    if in_space && color == Some(ColorBy::Quality) {
        let expected = "subdomain, region, size or label, for faces have no quality";
        return Err(bad("--color", "quality", expected));
    }
    if !in_space && color == Some(ColorBy::Label) {
        let expected = "with --surface or --shell, for tetrahedra have no label";
        return Err(bad("--color", "label", expected));
    }
    snapshot = snapshot.pixels(width, height);
    snapshot = match color {
        Some(color) => snapshot.color(color),
        None => {
            let fields: Vec<String> =
                store.fields()?.into_iter().flat_map(|field| field.columns).collect();
            if in_space || !fields.contains(&args.color) {
                let words = ColorBy::WORDS.iter().map(|(_, word)| (*word).to_owned());
                let words: Vec<String> =
                    words.chain(fields.into_iter().filter(|_| !in_space)).collect();
                return Err(bad("--color", &args.color, &format!("one of {}", words.join(", "))));
            }
            snapshot.color_field(&args.color)
        }
    };
    if let Some(text) = &args.plane {
        let expected = "six numbers, a point and a direction towards the viewer";
        let [x, y, z, nx, ny, nz] = numbers("--plane", text, expected)?;
        if [nx, ny, nz] == [0.0; 3] {
            return Err(bad("--plane", text, expected));
        }
        snapshot = snapshot.plane([x, y, z], [nx, ny, nz]);
    }
    if let Some(text) = &args.from {
        let expected = "three numbers, a direction towards the viewer";
        let from = numbers("--from", text, expected)?;
        if from == [0.0; 3] {
            return Err(bad("--from", text, expected));
        }
        snapshot = snapshot.seen_from(from);
    }
    if let Some(text) = &args.condition {
        snapshot = snapshot.condition(condition(text, store)?);
    }
    Ok(match args.crinkle {
        true => snapshot.crinkle(),
        false => snapshot,
    })
}

/// The subject of the picture, and true if it is in space.
fn subject(args: &SnapshotArgs) -> Result<(Snapshot, bool), Failure> {
    if args.surface {
        return Ok((Snapshot::surface(), true));
    }
    if let Some(rank) = args.shell {
        return Ok((Snapshot::shell(rank), true));
    }
    let Some(text) = &args.stage else {
        return Ok((Snapshot::cut(), false));
    };
    let expected =
        "a cut and what to show of it, such as 1:coarse, 1:refined, 1:natural or 1:interface";
    let named = text.split_once(':').and_then(|(cut, what)| {
        let cut = cut.trim().parse().ok()?;
        Some(match what.trim() {
            "coarse" => (Snapshot::stage(cut, false), false),
            "refined" => (Snapshot::stage(cut, true), false),
            "natural" => (Snapshot::interface(cut, false), true),
            "interface" => (Snapshot::interface(cut, true), true),
            _ => return None,
        })
    });
    named.ok_or_else(|| bad("--stage", text, expected))
}

fn print(args: &SnapshotArgs, snapped: &Snapped, console: &Console) {
    let file = args.output.display().to_string();
    if console.is_json() {
        let mut answer = serde_json::json!(snapped);
        answer["schema"] = 1.into();
        answer["file"] = file.into();
        console.answer(&answer);
        return;
    }
    let (bytes, chunks) = (memory::show(snapped.bytes), snapped.chunks);
    console.note(&format!(
        "wrote {file} ({bytes}): {} pieces; read {} of {} chunks of tetrahedra",
        snapped.pieces, chunks.tet_chunks_read, chunks.tet_chunks
    ));
}

fn pixels(text: &str) -> Result<[u32; 2], Failure> {
    let sides = text.split_once('x').and_then(|(w, h)| {
        let side = |s: &str| s.trim().parse().ok().filter(|n| SIDE.contains(n));
        Some([side(w)?, side(h)?])
    });
    let expected = "width and height in pixels, such as 1600x1200, each from 64 to 16384";
    sides.ok_or_else(|| bad("--size", text, expected))
}
