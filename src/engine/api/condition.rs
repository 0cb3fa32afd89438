//! Conditions that select tetrahedra.

use super::{Error, Store};
pub use tetdb_base::expr::ExprError;
use tetdb_base::expr::{ExprKind, Expression};
use tetdb_schema::code::Code;
use tetdb_store::query::ExtraVariable;
pub use tetdb_store::query::VARIABLES;

/// A condition on the [`VARIABLES`] of a tetrahedron, such as `quality > 6 and region in [1, 2]`.
///
/// ```
/// use tetdb_engine::api::Condition;
///
/// assert!(Condition::parse("quality > 6 and x < 0.5").is_ok());
/// assert_eq!(Condition::parse("quality > six").unwrap_err().at, 10);
/// ```
#[derive(Clone, Debug)]
pub struct Condition {
    pub(super) expression: Expression,
    /// Variables of one store, behind [`VARIABLES`].
    pub(super) extra: Vec<ExtraVariable>,
}

impl Condition {
    /// Parses a condition. Errors: the byte where `text` makes no sense, and the reason.
    pub fn parse(text: &str) -> Result<Self, ExprError> {
        Self::parse_with(text, Vec::new())
    }

    /// Parses a condition that may also name these variables.
    fn parse_with(text: &str, known: Vec<(String, ExtraVariable)>) -> Result<Self, ExprError> {
        let all = |known: &[(String, ExtraVariable)]| -> Vec<String> {
            let extra = known.iter().map(|(name, _)| name.clone());
            VARIABLES.iter().map(|name| (*name).to_owned()).chain(extra).collect()
        };
        let parse = |names: &[String]| {
            Expression::parse(text, &names.iter().map(String::as_str).collect::<Vec<_>>())
        };
        let whole = parse(&all(&known))?;
        let named = known.into_iter().enumerate();
        let named: Vec<_> = named
            .filter(|(i, _)| whole.names(VARIABLES.len() + i))
            .map(|(_, variable)| variable)
            .collect();
        let parsed = parse(&all(&named))?;
        if parsed.kind() == ExprKind::Truth {
            let extra = named.into_iter().map(|(_, variable)| variable).collect();
            return Ok(Self { expression: parsed, extra });
        }
        let message = "this is a number; a condition compares, such as `quality > 6`".to_owned();
        Err(ExprError { at: 0, message })
    }

    /// [`Condition::parse`] with an [`Error`] for the caller. Errors: `bad-expression`.
    pub(super) fn parse_located(text: &str) -> Result<Self, Error> {
        Self::located(text, Self::parse(text))
    }

    fn located(text: &str, parsed: Result<Self, ExprError>) -> Result<Self, Error> {
        parsed.map_err(|error| {
            Error::new(Code::BadExpression, &error)
                .at(format!("character {} of {text}", error.at + 1))
                .with_help("such as quality > 6 and region in [1, 2]")
        })
    }
}

impl Store {
    /// Parses a condition that may also name fields of the store, such as `temperature > 300` or `u.x < 0`, and its regions, such as
    /// `region = rock`. Errors: damage; in the inner result as [`Condition::parse`].
    pub fn condition(&self, text: &str) -> Result<Result<Condition, ExprError>, Error> {
        let mut known = self.field_variables()?;
        for (number, name) in (1u32..).zip(&self.summary().region_names) {
            let is_new =
                !VARIABLES.contains(&&**name) && known.iter().all(|(other, _)| other != name);
            if !name.is_empty() && is_new {
                known.push((name.clone(), ExtraVariable::Number(number.into())));
            }
        }
        Ok(Condition::parse_with(text, known))
    }

    /// [`Store::condition`] with one kind of error.
    pub(super) fn condition_located(&self, text: &str) -> Result<Condition, Error> {
        Condition::located(text, self.condition(text)?)
    }

    /// The component of a field with this name. Errors: `bad-query`.
    pub(super) fn field_variable(&self, name: &str) -> Result<ExtraVariable, Error> {
        let mut known = self.field_variables()?;
        match known.iter().position(|(other, _)| other == name) {
            Some(i) => Ok(known.swap_remove(i).1),
            None => {
                let names: Vec<&str> = known.iter().map(|(name, _)| &**name).collect();
                let message = match names.is_empty() {
                    true => format!("{name}: there is no such field; the store has none"),
                    false => format!("{name}: expected a field, one of {}", names.join(", ")),
                };
                Err(Error::new(Code::BadQuery, message))
            }
        }
    }

    /// All components of fields, by the names that conditions have for them.
    pub(super) fn field_variables(&self) -> Result<Vec<(String, ExtraVariable)>, Error> {
        let fields = self.catalog_shared().fields()?.into_iter();
        let of_field = fields.flat_map(|field| {
            let names = (0u32..).zip(field.columns());
            names
                .map(|(i, name)| (name, ExtraVariable::Field(field.clone(), i)))
                .collect::<Vec<_>>()
        });
        Ok(of_field.collect())
    }
}
