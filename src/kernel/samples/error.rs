//! Errors in the name of a sample.

use std::fmt;

use tetdb_base::geom::short;

/// The reason why a sample cannot be built. Each message names the offending word and the valid ones.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SampleError {
    /// There is no sample of this name.
    #[error("there is no sample called `{found}`; the samples are {}", Words(expected))]
    UnknownName {
        /// The name found.
        found: String,
        /// The names there are.
        expected: &'static [&'static str],
    },
    /// The sample has no such key.
    #[error("sample `{name}` has no key `{found}`; its keys are {}", Words(expected))]
    UnknownKey {
        /// Name of the sample.
        name: &'static str,
        /// The key found.
        found: String,
        /// The keys there are.
        expected: &'static [&'static str],
    },
    /// A word is not of the form key=value.
    #[error(
        "`{found}` in sample `{name}` is not of the form key=value; the keys are {}",
        Words(expected)
    )]
    NotAPair {
        /// Name of the sample.
        name: &'static str,
        /// The word found.
        found: String,
        /// The keys there are.
        expected: &'static [&'static str],
    },
    /// A key is given twice.
    #[error("sample `{name}` is given `{key}` twice")]
    Twice {
        /// Name of the sample.
        name: &'static str,
        /// The key.
        key: String,
    },
    /// A value is not usable.
    #[error("sample `{name}`: {key}={found} is not {expected}")]
    BadValue {
        /// Name of the sample.
        name: &'static str,
        /// The key.
        key: &'static str,
        /// The value found.
        found: String,
        /// The values allowed, in words.
        expected: String,
    },
    /// The sample would have too many triangles.
    #[error(
        "sample `{name}` would have about {} triangles, more than {expected}; choose a larger h or a smaller count",
        short(*found)
    )]
    TooMany {
        /// Name of the sample.
        name: &'static str,
        /// Triangles it would have, about.
        found: f64,
        /// The most it may have.
        expected: u64,
    },
    /// It takes more memory than is allowed.
    #[error("sample `{name}` takes about {needed} bytes while it is generated")]
    Memory {
        /// Name of the sample.
        name: &'static str,
        /// Bytes, about.
        needed: u64,
    },
    /// A ball found no free place.
    #[error(
        "no room was found for ball {placed} of {count} (radius {radius}) with seed {seed}; try another seed or count"
    )]
    NoRoom {
        /// Number of the ball, from 1.
        placed: usize,
        /// Balls requested.
        count: usize,
        /// Radius of a ball.
        radius: f64,
        /// Seed of the random positions.
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
