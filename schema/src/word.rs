//! Words of a job: enums that are written as one of a few words.

/// An enum that is written as a word, on the command line, in files of options and on record.
pub trait Word: Copy + PartialEq + 'static {
    /// Every value with its word.
    const WORDS: &'static [(Self, &'static str)];

    /// The word of a value.
    fn word(self) -> &'static str {
        let row = Self::WORDS.iter().find(|(value, _)| *value == self);
        row.map_or("", |(_, word)| word)
    }

    /// The value of a word; `None` for any other text.
    fn from_word(word: &str) -> Option<Self> {
        Self::WORDS.iter().find(|(_, w)| *w == word).map(|(value, _)| *value)
    }
}
