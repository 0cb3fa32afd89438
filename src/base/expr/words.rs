//! Splits text into tokens with their places.

use super::ExprError;

/// A word of an expression.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Token<'a> {
    Number(f64),
    Name(&'a str),
    /// An operator, bracket or comma.
    Sign(&'static str),
    End,
}

/// Signs, longer ones before those they begin with.
const SIGNS: [&str; 17] =
    ["==", "!=", "<=", ">=", "=", "<", ">", "+", "-", "*", "/", "^", "(", ")", "[", "]", ","];

/// Other spellings of words.
const WORDS: [(&str, &str); 2] = [("&&", "and"), ("||", "or")];

/// Operators of other languages, and their replacement here.
const FOREIGN: [(&str, &str); 5] =
    [("<>", "`!=`"), ("**", "`^`"), ("&", "`and`"), ("|", "`or`"), ("!", "`not`")];

/// The word at or after `at`, where it begins and where it ends.
///
/// Errors: a character no word has; a number that cannot be read.
pub(super) fn next_word(text: &str, at: usize) -> Result<(Token<'_>, usize, usize), ExprError> {
    let rest = &text[at..];
    let start = at + (rest.len() - rest.trim_start().len());
    let rest = &text[start..];
    let Some(first) = rest.chars().next() else {
        return Ok((Token::End, text.len(), text.len()));
    };
    if first.is_ascii_digit() || first == '.' {
        let length = number_length(rest.as_bytes());
        let value = rest[..length].parse::<f64>();
        // Beyond the greatest double a text reads as infinite, which is never intended.
        let value = value.ok().filter(|v| v.is_finite());
        return match value {
            Some(value) => Ok((Token::Number(value), start, start + length)),
            None => Err(fault(start, format!("{:?} is not a number", &rest[..length]))),
        };
    }
    if first.is_alphabetic() || first == '_' {
        let length = name_length(rest);
        return Ok((Token::Name(&rest[..length]), start, start + length));
    }
    if let Some((sign, word)) = WORDS.iter().find(|(sign, _)| rest.starts_with(sign)) {
        return Ok((Token::Name(word), start, start + sign.len()));
    }
    let foreign = FOREIGN.iter().find(|(sign, _)| rest.starts_with(sign));
    if let Some(&(sign, ours)) = foreign.filter(|_| !rest.starts_with("!=")) {
        return Err(fault(start, format!("write {ours} instead of `{sign}`")));
    }
    match SIGNS.iter().find(|sign| rest.starts_with(**sign)) {
        Some(sign) => Ok((Token::Sign(sign), start, start + sign.len())),
        None => Err(fault(start, format!("{first:?} means nothing here"))),
    }
}

/// Bytes of the name a text begins with: letters, digits and `_`; a point and more of these, as in `u.x`.
fn name_length(text: &str) -> usize {
    let word = |from: usize| {
        let rest = &text[from..];
        rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).map_or(text.len(), |n| from + n)
    };
    let end = word(0);
    let is_letter = |c: char| c.is_alphabetic() || c == '_';
    match text[end..].strip_prefix('.') {
        Some(rest) if rest.starts_with(is_letter) => word(end + 1),
        _ => end,
    }
}

/// Bytes of the number a text begins with: digits, a point, digits, an exponent where digits follow it.
fn number_length(text: &[u8]) -> usize {
    let digits = |from: usize| {
        let rest = text.get(from..).unwrap_or_default();
        from + rest.iter().take_while(|b| b.is_ascii_digit()).count()
    };
    let mut end = digits(0);
    if text.get(end) == Some(&b'.') {
        end = digits(end + 1);
    }
    if matches!(text.get(end), Some(b'e' | b'E')) {
        let signed = matches!(text.get(end + 1), Some(b'+' | b'-'));
        let from = end + 1 + usize::from(signed);
        if digits(from) > from {
            end = digits(from);
        }
    }
    end
}

/// An error at a place.
pub(super) fn fault(at: usize, message: impl Into<String>) -> ExprError {
    ExprError { at, message: message.into() }
}
