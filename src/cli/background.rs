//! Sizes from a file, known again by its content.

use std::path::Path;

use xxhash_rust::xxh3::Xxh3;

use super::failure::Failure;
use super::input::source;
use crate::io::read::{read_sizes, size_files};
use crate::pipeline::Options;
use crate::sizing::Background;

/// Notes in the options where the file is and what it holds.
pub fn identify(options: &mut Options) -> Result<(), Failure> {
    options.size_field_hash = None;
    if let Some(file) = &options.size_field {
        let path =
            std::path::absolute(file).map_err(|e| Failure::new("unreadable-file", e).at(file))?;
        options.size_field_hash = Some(hash(&path)?);
        options.size_field = Some(path.to_string_lossy().into_owned());
    }
    Ok(())
}

/// Reads the sizes of identified options, in at most half of what may be held.
///
/// Errors: `size-field-changed` when the files are not what they were.
pub fn read(options: &Options, cap: u64) -> Result<Option<Background>, Failure> {
    let Some(file) = &options.size_field else {
        return Ok(None);
    };
    let path = Path::new(file);
    if options.size_field_hash != Some(hash(path)?) {
        return Err(Failure::new(
            "size-field-changed",
            "the sizes are not those the store was begun with",
        )
        .at(file)
        .help("put the old files back, or mesh again with --force"));
    }
    Ok(Some(read_sizes(path, cap / 2)?))
}

/// Of the sizes and the mesh beside them.
fn hash(path: &Path) -> Result<String, Failure> {
    let (sizes, mesh) = size_files(path)?;
    let mut all = Xxh3::new();
    for file in [Some(sizes), mesh].into_iter().flatten() {
        for half in source(&file)?.hash {
            all.update(&half.to_le_bytes());
        }
    }
    Ok(format!("{:032x}", all.digest128()))
}
