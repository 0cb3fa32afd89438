//! The memory limit of a run, and the memory that is free.

use std::fmt;

use crate::pipeline::MEMORY_MIN;

/// Share of the free memory that is used if no cap is given.
const DEFAULT_SHARE: f64 = 0.6;
/// Free memory assumed if the system does not report it.
const UNKNOWN_FREE: u64 = 4 << 30;

/// The smallest cap of any run.
pub const MEMORY_LEAST: Bytes = Bytes(MEMORY_MIN);

/// A number of bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Bytes(
    /// The number.
    pub u64,
);

impl Bytes {
    /// `n` times 2^20.
    pub const fn mib(n: u64) -> Self {
        Self(n << 20)
    }

    /// `n` times 2^30.
    pub const fn gib(n: u64) -> Self {
        Self(n << 30)
    }
}

impl fmt::Display for Bytes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&show_bytes(self.0))
    }
}

/// Formats bytes with a readable unit.
#[doc(hidden)]
pub fn show_bytes(bytes: u64) -> String {
    let b = bytes as f64;
    match bytes {
        0..=0x3ff => format!("{bytes} bytes"),
        0x400..=0xfffff => format!("{:.0} KiB", b / 1024.0),
        0x10_0000..=0x9f_ffff => format!("{:.1} MiB", b / 1048576.0),
        0xa0_0000..=0x3fff_ffff => format!("{:.0} MiB", b / 1048576.0),
        _ => format!("{:.1} GiB", b / 1073741824.0),
    }
}

/// The default cap, and its origin in words.
#[doc(hidden)]
pub fn default_cap() -> (u64, String) {
    let (free, whence) = free();
    let bytes = (free as f64 * DEFAULT_SHARE) as u64;
    let words = format!("60 % of the {} {whence}", show_bytes(free));
    (bytes.max(MEMORY_MIN), words)
}

/// Free bytes of the system, of the control group, or within the limits of the process, whichever is least.
fn free() -> (u64, &'static str) {
    let system = match field("/proc/meminfo", "MemAvailable:") {
        Some(bytes) => (Some(bytes), "free in this machine"),
        None => (Some(UNKNOWN_FREE), "assumed to be free: the system does not report it"),
    };
    let of_process = |limit, used| {
        let used = field("/proc/self/status", used)?;
        Some(limit_of(limit)?.saturating_sub(used + BESIDE_CAP))
    };
    let all = [
        system,
        (group_free(), "free in this control group"),
        (
            of_process("Max address space", "VmSize:"),
            "left of this process's limit of address space",
        ),
        (of_process("Max data size", "VmData:"), "left of this process's limit of data"),
    ];
    let known = all.into_iter().filter_map(|(bytes, words)| Some((bytes?, words)));
    known.min_by_key(|(bytes, _)| *bytes).expect("the first is always known")
}

/// Bytes of a process that do not count towards its cap: code and stacks.
const BESIDE_CAP: u64 = 32 << 20;

/// A value in bytes from a system file whose lines count in KiB.
fn field(file: &str, name: &str) -> Option<u64> {
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find(|line| line.starts_with(name))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? * 1024)
}

/// A limit that the system enforces on this process; `None` if there is none.
fn limit_of(name: &str) -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/limits").ok()?;
    let line = text.lines().find(|line| line.starts_with(name))?;
    line[name.len()..].split_whitespace().next()?.parse().ok()
}

fn group_free() -> Option<u64> {
    let number = |path: String| std::fs::read_to_string(path).ok()?.trim().parse::<u64>().ok();
    let groups = std::fs::read_to_string("/proc/self/cgroup").ok()?;
    for line in groups.lines() {
        let mut parts = line.splitn(3, ':');
        let (_, kinds, path) = (parts.next()?, parts.next()?, parts.next()?);
        let (limit, used) = if kinds.is_empty() {
            let base = format!("/sys/fs/cgroup{path}");
            (number(format!("{base}/memory.max")), number(format!("{base}/memory.current")))
        } else if kinds.split(',').any(|k| k == "memory") {
            let base = format!("/sys/fs/cgroup/memory{path}");
            (
                number(format!("{base}/memory.limit_in_bytes")),
                number(format!("{base}/memory.usage_in_bytes")),
            )
        } else {
            continue;
        };
        if let (Some(limit), Some(used)) = (limit, used) {
            return Some(limit.saturating_sub(used));
        }
    }
    None
}

/// The most memory this process has ever held, in bytes, if the system reports it.
pub fn peak_bytes() -> Option<u64> {
    field("/proc/self/status", "VmHWM:")
}
