//! One file of a store of which bytes were changed, opened to be written: read, changed, and closed.
//!
//! What fails may fail with any error. A second panic while the first unwinds ends the process, which is why this one has its own.

use std::path::Path;
use std::sync::OnceLock;

use tetdb_base::storage::StoreFile;

const CACHE_BYTES: usize = 1 << 16;
/// As many values as give the tree two levels.
const N: u64 = 300;

struct Sound {
    dir: tempfile::TempDir,
    bytes: Vec<u8>,
}

fn sound() -> Sound {
    let shared = Path::new("/dev/shm");
    let dir = match shared.is_dir() {
        true => tempfile::tempdir_in(shared),
        false => tempfile::tempdir(),
    };
    let dir = dir.expect("a folder");
    let path = dir.path().join("sound.redb");
    let mut file = StoreFile::create(&path, CACHE_BYTES).expect("a new file");
    let value = [7u8; 90];
    for first in [0, N / 2] {
        let keys = first..first + N / 2;
        file.write(keys.map(|key| (key, &value[..]))).expect("room");
    }
    file.compact().expect("room");
    let bytes = std::fs::read(path).expect("readable");
    Sound { dir, bytes }
}

/// Each eight bytes are a change: where (four bytes), how many bytes, what.
pub fn changed(bytes: &[u8]) {
    static SOUND: OnceLock<Sound> = OnceLock::new();
    let sound = SOUND.get_or_init(sound);
    let mut content = sound.bytes.clone();
    for change in bytes.chunks_exact(8).take(8) {
        let at = u32::from_le_bytes([change[0], change[1], change[2], change[3]]) as usize;
        let at = at % content.len();
        let what = change[5];
        match change[4] % 16 {
            0..=9 => content[at] ^= 1 << (what % 8),
            10..=13 => content[at] = what,
            14 => {
                let end = (at + usize::from(change[6]) * 16 + 1).min(content.len());
                content[at..end].fill(what);
            }
            _ => content.truncate(at.max(1)),
        }
    }
    let path = sound.dir.path().join("changed.redb");
    // A file that was damaged is not closed: the next one is another.
    let _ = std::fs::remove_file(&path);
    std::fs::write(&path, &content).expect("writable");
    for writable in [false, true] {
        if let Ok(mut file) = StoreFile::open_repaired(&path, CACHE_BYTES, writable) {
            let _ = file.scan(0..u64::MAX, |_, _| true);
            let _ = file.check();
            if writable {
                let _ = file.write((0..9).map(|key| (key * 37, &bytes[..bytes.len().min(500)])));
                let _ = file.change((0..N).step_by(3).map(|key| (key, None)));
                let _ = file.compact();
            }
        }
    }
}
