//! Protection of input files from being overwritten.

use std::path::{Path, PathBuf};
use tetdb_schema::code::Code;

use super::Error;
use tetdb_io::read::boundary_of;
use tetdb_schema::source::Source;
use tetdb_store::store::Catalog;

/// File endings, and endings of the companion files read with them: TetGen's points, the background mesh of sizes.
const READ: [(&str, &[&str]); 4] = [
    ("poly", &["node"]),
    ("smesh", &["node"]),
    ("sol", &["mesh", "meshb"]),
    ("solb", &["mesh", "meshb"]),
];
/// File endings, and endings of the companion files written with them.
const WRITTEN: [(&str, &[&str]); 1] = [("ele", &["node", "face", "edge"])];

/// Refuses to write to `out` if it is a folder or one of `inputs`, also through links. Companion files of both are checked too.
///
/// Errors: `usage`.
pub fn check_target(out: &Path, inputs: &[PathBuf]) -> Result<(), Error> {
    let refused = |message: String| {
        Err(Error::new(Code::Usage, message).with_help("choose another name for what is written"))
    };
    if out.is_dir() {
        let what = match Catalog::open(out).is_ok() {
            true => "a store",
            false => "a folder",
        };
        return refused(format!("{} is {what}, no file to be written", out.display()));
    }
    let written = with_others(out, &WRITTEN);
    let files = inputs.iter().map(|input| boundary_of(input).unwrap_or_else(|| input.clone()));
    let read = files.flat_map(|input| with_others(&input, &READ));
    for input in read {
        if let Some(out) = written.iter().find(|out| is_same_file(&input, out)) {
            let same = match *out == input {
                true => String::new(),
                false => format!(" is the same file as {}, which", input.display()),
            };
            return refused(format!(
                "{}{same} is an input, and would be overwritten",
                out.display()
            ));
        }
    }
    Ok(())
}

/// A file, and the companion files that `others` lists for its ending.
fn with_others(file: &Path, others: &[(&str, &[&str])]) -> Vec<PathBuf> {
    let ending = file.extension().unwrap_or_default().to_string_lossy();
    let others = others.iter().filter(|(of, _)| ending.eq_ignore_ascii_case(of));
    let others = others.flat_map(|(_, endings)| endings.iter().map(|e| file.with_extension(e)));
    [file.to_owned()].into_iter().chain(others).collect()
}

/// Lists the files that a store was made from.
pub fn inputs_of(store: &Path) -> Vec<PathBuf> {
    let job = Catalog::open(store).and_then(|mut catalog| catalog.job());
    let sources = job.map(|job| job.surfaces).unwrap_or_default();
    let sources = sources.iter().filter_map(Source::from_record);
    sources.filter_map(|source| source.origin.file().map(PathBuf::from)).collect()
}

/// Returns whether two paths lead to the same file.
fn is_same_file(a: &Path, b: &Path) -> bool {
    let (Ok(a_meta), Ok(b_meta)) = (a.metadata(), b.metadata()) else {
        return false;
    };
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        (a_meta.dev(), a_meta.ino()) == (b_meta.dev(), b_meta.ino())
    }
    #[cfg(not(unix))]
    {
        let _ = (a_meta, b_meta);
        matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
    }
}
