//! Files opened for a reader.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use super::error::{FilePlace, ReadError, Spot};
use super::feed::{Feed, Result};

/// Bytes of the read buffer of one file.
const BUFFER_BYTES: usize = 256 << 10;

pub(super) fn open(path: &Path) -> Result<Feed<BufReader<File>>> {
    let (reader, length) = open_plain(path)?;
    Ok(Feed::new(&path.to_string_lossy(), reader, length))
}

/// Opens a regular file; tells its length.
pub(super) fn open_plain(path: &Path) -> Result<(BufReader<File>, u64)> {
    let name = path.to_string_lossy();
    let unreadable = |reason: String| ReadError::Unreadable {
        place: FilePlace {
            file: name.to_string(),
            spot: Spot::Totals,
        },
        reason,
    };
    let file = File::open(path).map_err(|e| unreadable(e.to_string()))?;
    let meta = file.metadata().map_err(|e| unreadable(e.to_string()))?;
    if !meta.is_file() {
        return Err(unreadable("it is not a regular file".to_owned()));
    }
    Ok((BufReader::with_capacity(BUFFER_BYTES, file), meta.len()))
}
