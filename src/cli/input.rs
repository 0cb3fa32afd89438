//! Surfaces as arguments: files, or samples made on the spot.

use std::io::Read;
use std::path::{Path, PathBuf};

use xxhash_rust::xxh3::Xxh3;

use super::console::Console;
use super::estimate;
use super::failure::Failure;
use crate::io::read::read_surface;
use crate::samples::{PREFIX, SampleSpec};
use crate::storage::{ScratchSpace, attempt};
use crate::surface::{Surface, Validation, orient_alike_in, validate_in};
use tetdb_schema::catalog::SurfaceSource;

/// A surface, read and turned one way, and where it came from.
pub struct Input {
    pub surface: Surface,
    pub sources: Vec<SurfaceSource>,
    /// Triangles that were turned round.
    pub turned: usize,
}

/// The memory a command may hold, and where its scratch files go.
#[derive(Clone, Copy)]
pub enum Space<'a> {
    /// All in memory.
    Boundless,
    /// Bytes in all, and the place of a store: scratch files are made beside it.
    Capped(u64, &'a Path),
}

impl Space<'_> {
    /// What there is beside a surface.
    pub fn room(self, surface: &Surface) -> Result<ScratchSpace, Failure> {
        match self {
            Self::Boundless => Ok(ScratchSpace::boundless()),
            Self::Capped(cap, store) => {
                let folder = estimate::folder_of(store).ok_or_else(|| {
                    Failure::new("io", "there is no folder above it").at(store.display())
                })?;
                let bytes = cap.saturating_sub(surface.bytes() as u64);
                Ok(ScratchSpace::new(bytes, &folder))
            }
        }
    }
}

/// Reads files or makes a sample.
pub fn load(arguments: &[String], space: Space, console: &Console) -> Result<Input, Failure> {
    let samples = arguments.iter().filter(|a| a.starts_with(PREFIX)).count();
    let mut input = match (samples, arguments) {
        (1, [word]) => made(word)?,
        (0, _) => from_files(arguments)?,
        _ => {
            return Err(
                Failure::new("usage", "a sample cannot be joined with other surfaces")
                    .help("write it to a file first: `tetdb sample balls,count=10 -o balls.stl`"),
            );
        }
    };
    for note in &input.surface.notes {
        console.note(&format!("note: {note}"));
    }
    input.surface.shrink();
    let room = space.room(&input.surface)?;
    let orientation = attempt(|| orient_alike_in(&mut input.surface, &room))?;
    input.turned = orientation.flipped.len();
    if input.turned > 0 {
        console.note(&format!(
            "note: {} triangles were turned to run like their neighbors",
            input.turned
        ));
    }
    Ok(input)
}

/// [`load`], and refuse a surface with defects.
pub fn load_valid(arguments: &[String], space: Space, console: &Console) -> Result<Input, Failure> {
    let input = load(arguments, space, console)?;
    validated(&input.surface, space)?;
    Ok(input)
}

/// Validates completely.
pub fn validated(surface: &Surface, space: Space) -> Result<Validation, Failure> {
    let room = space.room(surface)?;
    let validation = attempt(|| validate_in(surface, &room))?;
    validation.accept()?;
    Ok(validation)
}

fn made(word: &str) -> Result<Input, Failure> {
    let bad = |e: crate::samples::SampleError| {
        Failure::new("bad-sample", e).help(
            "for example sample:balls,count=100 or sample:box,h=0.1; see `tetdb sample --help`",
        )
    };
    let spec = SampleSpec::parse(word).map_err(bad)?;
    Ok(Input {
        surface: spec.make().map_err(bad)?.into(),
        sources: vec![SurfaceSource {
            path: spec.canonical(),
            bytes: 0,
            hash: [0; 2],
        }],
        turned: 0,
    })
}

fn from_files(arguments: &[String]) -> Result<Input, Failure> {
    let paths: Vec<PathBuf> = arguments.iter().map(PathBuf::from).collect();
    let surface = read_surface(&paths)?;
    let sources: Result<Vec<_>, Failure> = paths.iter().map(|p| source(p)).collect();
    Ok(Input {
        surface,
        sources: sources?,
        turned: 0,
    })
}

/// What identifies a file later: absolute path, length, hash.
pub fn source(path: &Path) -> Result<SurfaceSource, Failure> {
    let io = |e: std::io::Error| {
        Failure::new("unreadable-file", format!("the file cannot be read: {e}")).at(path.display())
    };
    let absolute = std::path::absolute(path).map_err(io)?;
    let mut file = std::fs::File::open(path).map_err(io)?;
    let mut hash = Xxh3::new();
    let (mut buffer, mut bytes) = (vec![0; 1 << 16], 0);
    loop {
        let n = file.read(&mut buffer).map_err(io)?;
        if n == 0 {
            break;
        }
        bytes += n as u64;
        hash.update(&buffer[..n]);
    }
    let digest = hash.digest128();
    Ok(SurfaceSource {
        path: absolute.to_string_lossy().into_owned(),
        bytes,
        hash: [digest as u64, (digest >> 64) as u64],
    })
}
