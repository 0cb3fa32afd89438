//! `sample`: made surfaces as files.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use serde_json::json;

use super::args::SampleArgs;
use super::console::Console;
use super::failure::Failure;
use super::input::{self, Space};
use tetdb_engine::api::targets::check_target;
use tetdb_io::write;
use tetdb_kernel::samples::PREFIX;

/// Writes to the standard output.
fn to_stdout(word: &str, format: &str, space: Space, console: &Console) -> Result<u8, Failure> {
    let surface = input::load(&[word.to_owned()], space, console)?.inner;
    // A file first, with a name nobody else has: the writers know files alone.
    let file = std::env::temp_dir().join(format!("tetdb-sample-{}.{format}", std::process::id()));
    let copied = write::surface(&surface, &file)
        .map_err(Failure::from)
        .and_then(|_| copy(&file, console).map_err(|e| Failure::new("io", e).at(file.display())));
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

/// The file for what is inside a surface in `file`.
fn beside(file: &Path, what: &str, end: Option<&str>) -> PathBuf {
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
    let temporary = std::env::temp_dir().join("sample");
    let is_stdout = args.output == Path::new("-");
    let place = if is_stdout { &temporary } else { &args.output };
    let space = Space::of(args.memory.as_deref(), place)?;
    if is_stdout {
        return to_stdout(&word, format, space, console);
    }
    if args.format.is_some() {
        let message = "--format is for -o -; a file's ending says its format";
        return Err(Failure::new("usage", message).help("name the file .stl, .off, .obj or .ply"));
    }
    check_target(&args.output, &[])?;
    let surface = input::load(&[word], space, console)?.inner;
    let mut embed = String::new();
    if surface.n_sheet_triangles() > 0 {
        let sheets = beside(&args.output, "sheets", None);
        check_target(&sheets, &[])?;
        write::surface(&surface.part(true), &sheets)?;
        embed += &format!(" --embed {}", sheets.display());
    }
    if surface.has_embedded() {
        let wires = beside(&args.output, "wires", Some("obj"));
        check_target(&wires, &[])?;
        write::wires(&surface.embedded_set(), &wires)?;
        for (option, n) in
            [("edges", surface.embedded.edges.len()), ("points", surface.embedded.points.len())]
        {
            if n > 0 {
                embed += &format!(" --embed-{option} {}", wires.display());
            }
        }
    }
    match embed.is_empty() {
        true => write::surface(&surface, &args.output)?,
        false => write::surface(&surface.part(false), &args.output)?,
    };
    if !embed.is_empty() {
        let shell = args.output.display();
        console.note(&format!("what is inside has files of its own: `tetdb mesh {shell}{embed}`"));
    }
    let (triangles, vertices) = (surface.n_input_triangles(), surface.n_vertices());
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
