//! The description of a new field: name, place, type and components.

use super::{Code, Error, VARIABLES};
use tetdb_schema::field::{COMPONENTS, FieldNumber, FieldPlace, FieldRow, Scalar};
use tetdb_schema::word::Word;
use tetdb_store::sealed::Subdomain;

/// Names of columns, of arrays of exports and of words of the language, which no field can have.
const RESERVED: [&str; 27] = [
    "id",
    "vertices",
    "points",
    "point",
    "barycentric",
    "h",
    "and",
    "or",
    "not",
    "in",
    "true",
    "false",
    "pi",
    "global_id",
    "vertex_id",
    "input_id",
    "label",
    "tets",
    "triangles",
    "connectivity",
    "offsets",
    "types",
    "v0",
    "v1",
    "v2",
    "v3",
    "tag",
];

/// A field to be added. Type and components are those of the values where they are not set.
#[derive(Clone, Debug)]
pub struct NewField {
    pub(super) name: String,
    pub(super) place: FieldPlace,
    pub(super) number: Option<FieldNumber>,
    pub(super) components: Option<u32>,
}

impl NewField {
    /// A field with this name.
    pub fn new(name: impl Into<String>, at: FieldPlace) -> Self {
        Self { name: name.into(), place: at, number: None, components: None }
    }

    /// Sets the type of the numbers.
    pub fn number(mut self, number: FieldNumber) -> Self {
        self.number = Some(number);
        self
    }

    /// Sets how many numbers a value has: 1, 3, 6 or 9.
    pub fn components(mut self, components: u32) -> Self {
        self.components = Some(components);
        self
    }

    /// The row of the field. Errors: `bad-field` for a name or a number of components that no field has.
    pub(super) fn row(&self, number: FieldNumber, components: u32) -> Result<FieldRow, Error> {
        let name = &self.name;
        let is_word = name.chars().all(|c| c.is_alphanumeric() || c == '_')
            && name.chars().next().is_some_and(|c| c.is_alphabetic() || c == '_');
        if !is_word || name.len() > 64 {
            let message = format!("{name:?} is no name for a field");
            return Err(
                bad(message).with_help("use up to 64 letters, digits and _, a letter first")
            );
        }
        if VARIABLES.contains(&&**name) || RESERVED.contains(&&**name) {
            let message = format!("{name} is a column of every store, or a word of conditions");
            return Err(bad(message).with_help("take another name"));
        }
        if self.components.is_some_and(|n| n != components) || !COMPONENTS.contains(&components) {
            let expected = self.components.map_or("1, 3, 6 or 9".to_owned(), |n| n.to_string());
            return Err(bad(format!(
                "the values of {name} have {components} numbers, expected {expected}"
            ))
            .with_help("1 number is a scalar, 3 are a vector, 6 or 9 a tensor; such as -y, x, 0"));
        }
        let number = self.number.unwrap_or(number);
        Ok(FieldRow { id: 0, name: name.clone(), place: self.place, number, components })
    }
}

/// An error of a field.
pub(super) fn bad(message: impl ToString) -> Error {
    Error::new(Code::BadField, message)
}

/// The word of a number. Errors: the type has no such number.
pub(super) fn packed(number: FieldNumber, value: Scalar) -> Result<u64, Error> {
    number.pack(value).ok_or_else(|| {
        let shown = match value {
            Scalar::Int(n) => n.to_string(),
            Scalar::Float(x) => x.to_string(),
        };
        bad(format!("{shown} is no number of type {}", number.word())).with_help(
            "choose another type: f64 for numbers with a fraction, i64 for large integers",
        )
    })
}

/// Gives the words of the values in a chunk of a sub-domain.
pub(super) type Words<'w> = dyn FnMut(&mut Subdomain, u32) -> Result<Vec<u64>, Error> + 'w;
