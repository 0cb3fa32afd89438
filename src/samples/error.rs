//! What can be wrong with the name of a sample.

use std::fmt;

/// Why a sample cannot be made. Each message names the offending word and what would do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SampleError {
    #[error(
        "there is no sample called `{found}`; the samples are {}",
        Words(expected)
    )]
    UnknownName {
        found: String,
        expected: &'static [&'static str],
    },
    #[error(
        "sample `{name}` has no key `{found}`; its keys are {}",
        Words(expected)
    )]
    UnknownKey {
        name: &'static str,
        found: String,
        expected: &'static [&'static str],
    },
    #[error(
        "`{found}` in sample `{name}` is not of the form key=value; the keys are {}",
        Words(expected)
    )]
    NotAPair {
        name: &'static str,
        found: String,
        expected: &'static [&'static str],
    },
    #[error("sample `{name}` is given `{key}` twice")]
    Twice { name: &'static str, key: String },
    #[error("sample `{name}`: {key}={found} is not {expected}")]
    BadValue {
        name: &'static str,
        key: &'static str,
        found: String,
        expected: String,
    },
    #[error(
        "sample `{name}` would have about {found:.3e} triangles, more than {expected}; choose a larger h or a smaller count"
    )]
    TooMany {
        name: &'static str,
        found: f64,
        expected: u64,
    },
    #[error(
        "no room was found for ball {placed} of {count} (radius {radius}) with seed {seed}; try another seed or count"
    )]
    NoRoom {
        placed: usize,
        count: usize,
        radius: f64,
        seed: u64,
    },
}

/// A list of words for people: `` `a`, `b` ``.
struct Words<'a>(&'a [&'a str]);

impl fmt::Display for Words<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, word) in self.0.iter().enumerate() {
            let comma = if i == 0 { "" } else { ", " };
            write!(f, "{comma}`{word}`")?;
        }
        Ok(())
    }
}
