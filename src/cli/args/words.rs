//! Options that take one of a few words.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use tetdb_engine::api::Word;

/// Parses a word of `T`. `helps` has a sentence for each word, or none at all.
pub fn word_of<T>(helps: &'static [&'static str]) -> impl TypedValueParser<Value = T>
where
    T: Word + Send + Sync,
{
    let helps = helps.iter().copied().map(Some).chain(std::iter::repeat(None));
    let values = T::WORDS.iter().zip(helps).map(|((_, word), help)| {
        let value = PossibleValue::new(*word);
        help.map_or(value.clone(), |help| value.help(help))
    });
    let parser = PossibleValuesParser::new(values.collect::<Vec<_>>());
    parser.map(|word| T::from_word(&word).expect("the parser accepts only words of the type"))
}
