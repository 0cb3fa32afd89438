//! Sizes of memory as typed on the command line.

use super::failure::Failure;
use tetdb_engine::api::Code;
pub use tetdb_engine::api::peak_bytes as peak;
pub(super) use tetdb_engine::api::show_bytes as show;
use tetdb_engine::api::{MEMORY_LEAST, default_cap};

/// The cap in bytes: the requested one, or a share of the free memory. Errors: as [`requested`].
pub fn cap(option: Option<&str>) -> Result<u64, Failure> {
    Ok(requested(option)?.unwrap_or_else(|| default_cap().0))
}

/// The requested cap. Errors: it is no size; it is below the minimum of any run.
pub fn requested(option: Option<&str>) -> Result<Option<u64>, Failure> {
    let Some(text) = option else { return Ok(None) };
    let bytes = parse(text)?;
    if bytes < MEMORY_LEAST.0 {
        let least = MEMORY_LEAST.0 >> 20;
        let message = format!("{text} is less memory than the {least} MiB any run needs");
        let help = format!("give at least {least}MiB");
        return Err(Failure::new(Code::Memory, message).help(help));
    }
    Ok(Some(bytes))
}

/// Parses sizes such as `512MiB`, `8G`, `2GB`.
pub fn parse(text: &str) -> Result<u64, Failure> {
    let bad = |why: &str| {
        Failure::new(Code::BadMemory, format!("'{text}' is not a memory size: {why}"))
            .help("write a number with its unit: 512MiB, 8GiB (or 8G), 2GB (10^9 bytes)")
    };
    let text = text.trim();
    let split = text
        .find(|c: char| !(c.is_ascii_digit() || c == '.'))
        .ok_or_else(|| bad("a unit is missing"))?;
    let number: f64 = text[..split].parse().map_err(|_| bad("the number cannot be read"))?;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_mean_what_they_say() {
        for (text, bytes) in
            [("64MiB", 64 << 20), ("2G", 2 << 30), ("1.5GiB", 3 << 29), ("2GB", 2_000_000_000)]
        {
            assert_eq!(parse(text).expect(text), bytes);
        }
        for text in ["512", "", "GiB", "5 parsecs", "1e9"] {
            assert_eq!(parse(text).expect_err(text).code, "bad-memory");
        }
    }
}
