//! Options as typed, from files where a number is a number and a list of numbers a list.

use std::fmt;

use serde::de::{Deserialize, Deserializer, Error, SeqAccess, Visitor};

/// A text, as it would be typed, of a text or a number.
struct Word(String);

struct WordVisitor;

impl Visitor<'_> for WordVisitor {
    type Value = Word;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a text or a number")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Word, E> {
        Ok(Word(text.to_owned()))
    }

    fn visit_i64<E: Error>(self, x: i64) -> Result<Word, E> {
        Ok(Word(x.to_string()))
    }

    fn visit_u64<E: Error>(self, x: u64) -> Result<Word, E> {
        Ok(Word(x.to_string()))
    }

    fn visit_f64<E: Error>(self, x: f64) -> Result<Word, E> {
        Ok(Word(x.to_string()))
    }
}

impl<'de> Deserialize<'de> for Word {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_any(WordVisitor)
    }
}

/// A text, as it would be typed, of a text, a number or a list of both.
struct Typed(String);

struct TypedVisitor;

impl<'de> Visitor<'de> for TypedVisitor {
    type Value = Typed;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a text, a number or a list of numbers")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Typed, E> {
        Ok(Typed(text.to_owned()))
    }

    fn visit_i64<E: Error>(self, x: i64) -> Result<Typed, E> {
        Ok(Typed(x.to_string()))
    }

    fn visit_u64<E: Error>(self, x: u64) -> Result<Typed, E> {
        Ok(Typed(x.to_string()))
    }

    fn visit_f64<E: Error>(self, x: f64) -> Result<Typed, E> {
        Ok(Typed(x.to_string()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Typed, A::Error> {
        let mut parts = Vec::new();
        while let Some(Word(part)) = list.next_element()? {
            parts.push(part);
        }
        Ok(Typed(parts.join(",")))
    }
}

impl<'de> Deserialize<'de> for Typed {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_any(TypedVisitor)
    }
}

/// One option.
pub(super) fn text<'de, D: Deserializer<'de>>(from: D) -> Result<Option<String>, D::Error> {
    Ok(Option::<Word>::deserialize(from)?.map(|Word(text)| text))
}

/// A list of options.
pub(super) fn texts<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<String>, D::Error> {
    let all = Vec::<Typed>::deserialize(from)?;
    Ok(all.into_iter().map(|Typed(text)| text).collect())
}
