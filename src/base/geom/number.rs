//! Numbers in a short form for people.

/// A number with at most four significant digits; very large and very small ones with a power of ten.
pub fn short(x: f64) -> String {
    let rounded: f64 = format!("{x:.3e}").parse().unwrap_or(x);
    if rounded == 0.0 {
        "0".to_owned()
    } else if (1e-4..1e7).contains(&rounded.abs()) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

/// A count with its noun: `1 label`, `2 labels`.
pub fn count(n: u64, what: &str) -> String {
    match n {
        1 => format!("1 {what}"),
        n => match what {
            "tetrahedron" => format!("{n} tetrahedra"),
            "vertex" => format!("{n} vertices"),
            _ => format!("{n} {what}s"),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::short;

    #[test]
    fn four_digits_are_shown_and_no_idle_zeros() {
        for (x, text) in [
            (1.0, "1"),
            (0.0, "0"),
            (0.000_123_456, "0.0001235"),
            (-12_412.407_8, "-12410"),
            (1.8e-9, "1.8e-9"),
            (3.0e12, "3e12"),
            (0.999_97, "1"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(short(x), text);
        }
    }
}
