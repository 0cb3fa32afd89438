//! The command `sample`: writes generated surfaces to files.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use serde_json::json;

use super::args::SampleArgs;
use super::console::Console;
use super::failure::Failure;
use super::words::quoted;
use super::{input, memory};
use tetdb_engine::api::targets::check_target;
use tetdb_engine::api::{Code, SAMPLE_PREFIX as PREFIX, Settings, Surface};

/// Writes to the standard output.
fn to_stdout(
    word: &str,
    format: &str,
    settings: &Settings,
    console: &Console,
) -> Result<u8, Failure> {
    let surface = Surface::load(&[word.to_owned()], settings)?;
    // The writers only write files, so a temporary file with the process id in its name comes first.
    let name = format!("tetdb-sample-{}.{format}", std::process::id());
    let file = settings.scratch_dir().join(name);
    let copied = surface.write(&file).map_err(Failure::from).and_then(|_| {
        copy(&file, console).map_err(|e| Failure::new(Code::Io, e).at(file.display()))
    });
    let _ = std::fs::remove_file(&file);
    copied.map(|()| 0)
}

fn copy(file: &Path, console: &Console) -> std::io::Result<()> {
    let mut from = BufReader::new(File::open(file)?);
    loop {
        let bytes = from.fill_buf()?;
        let n = bytes.len();
        if n == 0 || !console.write(bytes) {
            return Ok(());
        }
        from.consume(n);
    }
}

/// Path of the file for content inside a surface written to `file`.
fn sibling(file: &Path, what: &str, end: Option<&str>) -> PathBuf {
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    let own = file.extension().unwrap_or_default().to_string_lossy();
    file.with_file_name(format!("{stem}_{what}.{}", end.unwrap_or(&own)))
}

pub fn run(args: &SampleArgs, console: &Console) -> Result<u8, Failure> {
    let word = if args.sample.starts_with(PREFIX) {
        args.sample.clone()
    } else {
        format!("{PREFIX}{}", args.sample)
    };
    let format = args.format.as_deref().unwrap_or("stl");
    let settings = console.settings(memory::requested(args.memory.as_deref())?, None);
    if args.output == Path::new("-") {
        return to_stdout(&word, format, &settings, console);
    }
    if args.format.is_some() {
        let message = "--format is for -o -; a file's ending says its format";
        return Err(
            Failure::new(Code::Usage, message).help("name the file .stl, .off, .obj or .ply")
        );
    }
    check_target(&args.output, &[])?;
    let surface = Surface::load(&[word], &input::scratch_beside(settings, &args.output))?;
    let [shell, sheets] = surface.split_sheets();
    let mut embed = String::new();
    if surface.n_sheet_triangles() > 0 {
        let file = sibling(&args.output, "sheets", None);
        check_target(&file, &[])?;
        sheets.write(&file)?;
        embed += &format!(" --embed {}", quoted(&file));
    }
    let [edges, points] = surface.n_embedded();
    if edges + points > 0 {
        let file = sibling(&args.output, "wires", Some("obj"));
        check_target(&file, &[])?;
        surface.write_embedded(&file)?;
        for (option, n) in [("edges", edges), ("points", points)] {
            if n > 0 {
                embed += &format!(" --embed-{option} {}", quoted(&file));
            }
        }
    }
    let written = match embed.is_empty() {
        true => surface.write(&args.output)?,
        false => shell.write(&args.output)?,
    };
    input::note_lost(&surface, written, console);
    if !embed.is_empty() {
        let shell = quoted(&args.output);
        console.note(&format!("what is inside has files of its own: `tetdb mesh {shell}{embed}`"));
    }
    let (triangles, vertices) = (surface.n_triangles(), surface.n_vertices());
    if console.is_json() {
        let file = args.output.display().to_string();
        console.answer(
            &json!({ "schema": 1, "file": file, "triangles": triangles, "vertices": vertices }),
        );
    } else {
        console.note(&format!(
            "wrote {triangles} triangles and {vertices} vertices to {}",
            args.output.display()
        ));
    }
    Ok(0)
}
