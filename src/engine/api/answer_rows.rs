//! Answers as rows with named columns.

use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

use super::{Error, Scalar, Store, VARIABLES};
use serde_json::{Map, Value, json};
use tetdb_schema::field::FieldPlace;
use tetdb_schema::ids::VertexId;
use tetdb_store::query::Hit;

/// A column of answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AnswerColumn {
    /// The located point; see [`AnswerRow::from_point`].
    Point,
    /// Barycentric coordinates of the located point.
    Barycentric,
    /// Id of the tetrahedron.
    Id,
    /// Ids of the four vertices.
    Vertices,
    /// Positions of the four vertices.
    Points,
    /// A variable of conditions, as a position in [`VARIABLES`].
    Variable(usize),
    /// A component of a field; see [`Store::answer_columns`].
    Field {
        /// Its name in conditions.
        name: &'static str,
        /// Place among the columns of fields of a question.
        place: usize,
        /// True if the numbers are integers.
        is_integer: bool,
    },
}

const REGION: usize = 1;
const SUBDOMAIN: usize = 2;

impl AnswerColumn {
    /// The column named `id`, `vertices`, `points` or one of [`VARIABLES`].
    pub fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "id" => Self::Id,
            "vertices" => Self::Vertices,
            "points" => Self::Points,
            _ => Self::Variable(VARIABLES.iter().position(|v| *v == name)?),
        })
    }

    /// Name of the column.
    pub fn name(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Barycentric => "barycentric",
            Self::Id => "id",
            Self::Vertices => "vertices",
            Self::Points => "points",
            Self::Variable(v) => VARIABLES[v],
            Self::Field { name, .. } => name,
        }
    }

    /// Returns whether the column's values are integers.
    pub fn is_integer(self) -> bool {
        matches!(self, Self::Variable(REGION | SUBDOMAIN) | Self::Field { is_integer: true, .. })
    }

    /// Number of values of this column in a row.
    pub fn width(self) -> usize {
        match self {
            Self::Point => 3,
            Self::Barycentric | Self::Vertices => 4,
            Self::Points => 12,
            _ => 1,
        }
    }
}

/// Names of columns of fields. Each is kept for the whole process, once.
static NAMES: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());

fn kept(name: &str) -> &'static str {
    let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = names.get(name) {
        return known;
    }
    let kept: &'static str = Box::leak(name.to_owned().into_boxed_str());
    names.insert(kept);
    kept
}

impl Store {
    /// The columns of these names: `id`, `vertices`, `points`, one of [`VARIABLES`], or a component of a field; `None` for another name.
    /// A question with columns of fields is given all its columns by [`Query::with_columns`](super::Query::with_columns).
    ///
    /// Errors: damage.
    pub fn answer_columns(&self, names: &[&str]) -> Result<Vec<Option<AnswerColumn>>, Error> {
        let fields = self.fields()?;
        let mut n = 0;
        let of_field = |name: &str, place: usize| {
            let field = fields.iter().find(|field| field.columns.iter().any(|c| c == name))?;
            let is_integer = field.number.is_integer() && field.at == FieldPlace::Tets;
            Some(AnswerColumn::Field { name: kept(name), place, is_integer })
        };
        let columns = names.iter().map(|name| {
            AnswerColumn::from_name(name).or_else(|| {
                let column = of_field(name, n);
                n += usize::from(column.is_some());
                column
            })
        });
        Ok(columns.collect())
    }
}

/// A value in a row.
#[derive(Clone, Debug, PartialEq)]
pub enum AnswerValue {
    /// An id.
    Text(String),
    /// An integer.
    Integer(i64),
    /// A number.
    Number(f64),
    /// No value: the point lies outside the mesh.
    Missing,
}

/// One answer: a tetrahedron, or a located point with the tetrahedron that contains it.
#[derive(Clone, Copy, Debug)]
pub struct AnswerRow {
    /// The tetrahedron; `None` if a located point lies outside the mesh.
    pub hit: Option<Hit>,
    /// The located point and its barycentric coordinates.
    pub located: Option<([f64; 3], [f64; 4])>,
}

impl From<Hit> for AnswerRow {
    fn from(hit: Hit) -> Self {
        Self { hit: Some(hit), located: None }
    }
}

impl AnswerRow {
    /// The row of a located point, from the result of [`Store::locate_barycentric`](super::Store::locate_barycentric).
    pub fn from_point(point: [f64; 3], found: Option<(Hit, [f64; 4])>) -> Self {
        let shares = found.map_or([f64::NAN; 4], |(_, shares)| shares);
        Self { hit: found.map(|(hit, _)| hit), located: Some((point, shares)) }
    }

    /// Values of a column. Shape: [`AnswerColumn::width`] values.
    pub fn values(&self, column: AnswerColumn) -> Vec<AnswerValue> {
        let numbers = |list: &[f64]| list.iter().map(|&x| AnswerValue::Number(x)).collect();
        if let (AnswerColumn::Point, Some((point, _))) = (column, self.located) {
            return numbers(&point);
        }
        let Some(hit) = &self.hit else {
            return vec![AnswerValue::Missing; column.width()];
        };
        match column {
            AnswerColumn::Point => Vec::new(),
            AnswerColumn::Barycentric => {
                numbers(&self.located.map_or([f64::NAN; 4], |(_, shares)| shares))
            }
            AnswerColumn::Id => vec![AnswerValue::Text(hit.id.to_string())],
            AnswerColumn::Vertices => hit.vertices.map(vertex).map(AnswerValue::Text).into(),
            AnswerColumn::Points => numbers(&hit.corners.map(|c| c.to_array()).concat()),
            AnswerColumn::Variable(v) if column.is_integer() => {
                vec![AnswerValue::Integer(hit.values()[v] as i64)]
            }
            AnswerColumn::Variable(v) => vec![AnswerValue::Number(hit.values()[v])],
            AnswerColumn::Field { place, .. } => vec![match hit.extra[place] {
                Scalar::Int(n) => AnswerValue::Integer(n),
                Scalar::Float(x) => AnswerValue::Number(x),
            }],
        }
    }

    /// The row as a JSON object with a key for each column.
    pub fn object(&self, columns: &[AnswerColumn]) -> Value {
        let mut object = Map::new();
        object.insert("schema".to_owned(), json!(1));
        for &column in columns {
            let mut values: Vec<Value> = self.values(column).into_iter().map(json_value).collect();
            let value = match column {
                AnswerColumn::Points if self.hit.is_some() => {
                    values.chunks(3).map(|c| Value::from(c.to_vec())).collect()
                }
                _ if self.hit.is_none() && column != AnswerColumn::Point => Value::Null,
                _ if column.width() == 1 => values.remove(0),
                _ => Value::from(values),
            };
            object.insert(column.name().to_owned(), value);
        }
        Value::Object(object)
    }

    /// The row as comma-separated values, in the order of [`csv_head`].
    pub fn csv(&self, columns: &[AnswerColumn]) -> String {
        let values = columns.iter().flat_map(|&column| self.values(column));
        let words = values.map(|value| match value {
            AnswerValue::Text(text) => text,
            AnswerValue::Integer(n) => n.to_string(),
            AnswerValue::Number(x) => x.to_string(),
            AnswerValue::Missing => String::new(),
        });
        words.collect::<Vec<_>>().join(",")
    }
}

/// Comma-separated names of all values of a row.
pub fn csv_head(columns: &[AnswerColumn]) -> String {
    let names = columns.iter().flat_map(|&column| {
        let name = column.name();
        let one = column.width() == 1;
        (0..column.width()).map(move |i| match (one, column) {
            (true, _) => name.to_owned(),
            (_, AnswerColumn::Point) => format!("point_{}", ["x", "y", "z"][i]),
            (_, AnswerColumn::Points) => format!("{}{}", ["x", "y", "z"][i % 3], i / 3),
            _ => format!("{name}{i}"),
        })
    });
    names.collect::<Vec<_>>().join(",")
}

fn vertex(number: u64) -> String {
    VertexId::from_number(number).map_or_else(|| number.to_string(), |id| id.to_string())
}

fn json_value(value: AnswerValue) -> Value {
    match value {
        AnswerValue::Text(text) => text.into(),
        AnswerValue::Integer(n) => n.into(),
        AnswerValue::Number(x) => x.into(),
        AnswerValue::Missing => Value::Null,
    }
}
