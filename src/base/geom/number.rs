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

/// A count with a sentence about it: `[vertex was|vertices were] left out` has the words for one and for several.
pub fn counted(n: u64, sentence: &str) -> String {
    let mut text = format!("{n} ");
    let mut rest = sentence;
    while let Some((before, (words, after))) =
        rest.split_once('[').and_then(|(before, rest)| Some((before, rest.split_once(']')?)))
    {
        let (one, several) = words.split_once('|').unwrap_or((words, words));
        text += before;
        text += if n == 1 { one } else { several };
        rest = after;
    }
    text + rest
}

#[cfg(test)]
mod tests {
    use super::{counted, short};

    #[test]
    fn one_is_no_plural() {
        let text = "[vertex belongs|vertices belong] to no triangle and [was|were] left out";
        assert_eq!(counted(1, text), "1 vertex belongs to no triangle and was left out");
        assert_eq!(counted(0, text), "0 vertices belong to no triangle and were left out");
    }

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
