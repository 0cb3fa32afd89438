//! Sizes of memory as typed, and how much there is.

use super::failure::Failure;

/// Share of the free memory that is taken when nothing is asked for.
const DEFAULT_SHARE: f64 = 0.6;
/// What is assumed where the system does not tell.
const UNKNOWN_FREE: u64 = 4 << 30;

/// The cap in bytes and where it came from.
pub fn cap(option: Option<&str>) -> Result<(u64, String), Failure> {
    match option {
        Some(text) => {
            let bytes = parse(text)?;
            if bytes < crate::pipeline::MEMORY_MIN {
                let least = crate::pipeline::MEMORY_MIN >> 20;
                return Err(Failure::new(
                    "memory",
                    format!("--memory {text} is less than the {least} MiB any run needs"),
                )
                .help(format!("give at least --memory {least}MiB")));
            }
            Ok((bytes, "--memory".to_owned()))
        }
        None => {
            let (free, whence) = free();
            let bytes = (free as f64 * DEFAULT_SHARE) as u64;
            Ok((
                bytes.max(crate::pipeline::MEMORY_MIN),
                format!("60 % of the {} {whence}", show(free)),
            ))
        }
    }
}

/// Reads `512MiB`, `8G`, `2GB`.
pub fn parse(text: &str) -> Result<u64, Failure> {
    let bad = |why: &str| {
        Failure::new(
            "bad-memory",
            format!("'{text}' is not a memory size: {why}"),
        )
        .help("write a number with its unit: 512MiB, 8GiB (or 8G), 2GB (10^9 bytes)")
    };
    let text = text.trim();
    let split = text
        .find(|c: char| !(c.is_ascii_digit() || c == '.'))
        .ok_or_else(|| bad("a unit is missing"))?;
    let number: f64 = text[..split]
        .parse()
        .map_err(|_| bad("the number cannot be read"))?;
    let unit: f64 = match text[split..].trim() {
        "K" | "KiB" => 1024.0,
        "M" | "MiB" => 1024.0 * 1024.0,
        "G" | "GiB" => 1024.0 * 1024.0 * 1024.0,
        "T" | "TiB" => 1024.0 * 1024.0 * 1024.0 * 1024.0,
        "kB" => 1e3,
        "MB" => 1e6,
        "GB" => 1e9,
        "TB" => 1e12,
        _ => return Err(bad("the unit is not known")),
    };
    Ok((number * unit) as u64)
}

/// Bytes in the unit a person would use.
pub fn show(bytes: u64) -> String {
    let b = bytes as f64;
    match bytes {
        0..=0xfffff => format!("{:.0} KiB", b / 1024.0),
        0x10_0000..=0x3fff_ffff => format!("{:.0} MiB", b / 1048576.0),
        _ => format!("{:.1} GiB", b / 1073741824.0),
    }
}

/// Free bytes of the system, or of the control group if that is less.
fn free() -> (u64, &'static str) {
    let system = std::fs::read_to_string("/proc/meminfo")
        .ok()
        .and_then(|text| {
            let line = text.lines().find(|l| l.starts_with("MemAvailable:"))?;
            Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? * 1024)
        });
    let system = system.unwrap_or(UNKNOWN_FREE);
    match group_free() {
        Some(group) if group < system => (group, "free in this control group"),
        _ => (system, "free in this machine"),
    }
}

fn group_free() -> Option<u64> {
    let number = |path: String| {
        std::fs::read_to_string(path)
            .ok()?
            .trim()
            .parse::<u64>()
            .ok()
    };
    let groups = std::fs::read_to_string("/proc/self/cgroup").ok()?;
    for line in groups.lines() {
        let mut parts = line.splitn(3, ':');
        let (_, kinds, path) = (parts.next()?, parts.next()?, parts.next()?);
        let (limit, used) = if kinds.is_empty() {
            let base = format!("/sys/fs/cgroup{path}");
            (
                number(format!("{base}/memory.max")),
                number(format!("{base}/memory.current")),
            )
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

/// The most this process has ever held, in bytes, where the system tells.
pub fn peak() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|l| l.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_mean_what_they_say() {
        for (text, bytes) in [
            ("64MiB", 64 << 20),
            ("2G", 2 << 30),
            ("1.5GiB", 3 << 29),
            ("2GB", 2_000_000_000),
        ] {
            assert_eq!(parse(text).expect(text), bytes);
        }
        for text in ["512", "", "GiB", "5 parsecs", "1e9"] {
            assert_eq!(parse(text).expect_err(text).code, "bad-memory");
        }
    }
}
