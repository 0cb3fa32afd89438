//! Filters of SQL in the store's language of conditions.
//!
//! A condition is exact, or holds for more rows than the filter; DataFusion then filters again. SQL here compares in IEEE's total order: a
//! NaN is greater than all numbers, or less if its sign is set, and -0 is less than 0. In the store's language a comparison with NaN is
//! false but for `!=`, and -0 equals 0. So a column that may have NaN is compared by `not`, and a comparison with zero takes in both zeros.
//! Columns are never NULL.

use std::collections::HashMap;

use arrow::datatypes::DataType;
use datafusion::common::ScalarValue;
use datafusion::logical_expr::{BinaryExpr, Expr, Operator};

/// Greatest integer up to which all are doubles, and beyond which none rounds down to one of them.
const WHOLE_MAX: i64 = (1 << 53) - 1;

/// Columns that conditions know.
pub(crate) type Columns = HashMap<String, Column>;

/// A column of numbers.
#[derive(Clone, Debug)]
pub(crate) struct Column {
    pub number: DataType,
    /// True if some of its values are not numbers.
    pub has_nan: bool,
}

/// A condition that holds wherever a filter does.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Condition {
    pub text: String,
    /// True if it holds nowhere else.
    pub is_exact: bool,
}

impl Condition {
    fn exact(text: String) -> Self {
        Self { text, is_exact: true }
    }

    /// Both conditions joined by a word.
    fn joined(self, word: &str, other: Self) -> Self {
        let text = format!("({} {word} {})", self.text, other.text);
        Self { text, is_exact: self.is_exact && other.is_exact }
    }
}

/// The condition of a filter; `None` if the language has none.
pub(crate) fn translate(filter: &Expr, columns: &Columns) -> Option<Condition> {
    truth(filter, false, columns)
}

/// The condition of `filter`, or of its opposite.
fn truth(filter: &Expr, is_opposite: bool, columns: &Columns) -> Option<Condition> {
    match filter {
        Expr::Not(inner) => truth(inner, !is_opposite, columns),
        Expr::BinaryExpr(BinaryExpr { left, op: op @ (Operator::And | Operator::Or), right }) => {
            let (a, b) = (truth(left, is_opposite, columns), truth(right, is_opposite, columns));
            match (a, b, (*op == Operator::And) != is_opposite) {
                (Some(a), Some(b), true) => Some(a.joined("and", b)),
                (Some(a), Some(b), false) => Some(a.joined("or", b)),
                // The other side is left to DataFusion.
                (Some(one), None, true) | (None, Some(one), true) => {
                    Some(Condition { is_exact: false, ..one })
                }
                _ => None,
            }
        }
        Expr::BinaryExpr(BinaryExpr { left, op, right }) => {
            let op = if is_opposite { op.negate()? } else { *op };
            compare(left, op, right, columns).or_else(|| compare(right, op.swap()?, left, columns))
        }
        Expr::Between(between) => {
            let is_outside = between.negated != is_opposite;
            let (low, high) = match is_outside {
                false => (Operator::GtEq, Operator::LtEq),
                true => (Operator::Lt, Operator::Gt),
            };
            let low = compare(&between.expr, low, &between.low, columns)?;
            let high = compare(&between.expr, high, &between.high, columns)?;
            Some(low.joined(if is_outside { "or" } else { "and" }, high))
        }
        Expr::InList(list) => {
            let is_outside = list.negated != is_opposite;
            let (op, word) = match is_outside {
                false => (Operator::Eq, "or"),
                true => (Operator::NotEq, "and"),
            };
            let each = list.list.iter().map(|value| compare(&list.expr, op, value, columns));
            let each = each.collect::<Option<Vec<Condition>>>()?;
            if each.iter().all(|one| one.is_exact) {
                let (name, ..) = column_of(&list.expr, columns)?;
                let numbers = each.iter().filter_map(|one| one.text.rsplit(' ').next());
                let text = format!("{name} in [{}]", numbers.collect::<Vec<_>>().join(", "));
                return Some(Condition::exact(match is_outside {
                    false => text,
                    true => format!("not ({text})"),
                }));
            }
            each.into_iter().reduce(|all, one| all.joined(word, one))
        }
        _ => None,
    }
}

/// A comparison of a column with a constant.
fn compare(left: &Expr, op: Operator, right: &Expr, columns: &Columns) -> Option<Condition> {
    let (name, column, compared_as) = column_of(left, columns)?;
    let Expr::Literal(value, _) = right else {
        return None;
    };
    let is_float = matches!(compared_as, DataType::Float32 | DataType::Float64);
    let number = match (value, &compared_as) {
        (ScalarValue::Float64(Some(x)), DataType::Float64) => *x,
        (ScalarValue::Float32(Some(x)), DataType::Float32) => f64::from(*x),
        (ScalarValue::Int32(Some(n)), DataType::Int32) => f64::from(*n),
        (ScalarValue::Int64(Some(n)), DataType::Int64) if (-WHOLE_MAX..=WHOLE_MAX).contains(n) => {
            *n as f64
        }
        _ => return None,
    };
    if !number.is_finite() {
        return None;
    }
    let shown = format!("{number:e}");
    let has_nan = is_float && column.has_nan;
    let is_zero = is_float && number == 0.0;
    let plain = |op: &str| Condition::exact(format!("{name} {op} {shown}"));
    // `wide` takes in both zeros; the opposite of `narrow` takes in NaN.
    let ordered = |op: &str, wide: &str, narrow: &str| match (is_zero, has_nan) {
        (false, false) => plain(op),
        (true, false) => Condition { is_exact: false, ..plain(wide) },
        (false, true) => {
            Condition { text: format!("not ({name} {narrow} {shown})"), is_exact: false }
        }
        (true, true) => {
            let text = format!("({name} {wide} {shown} or {name} != {name})");
            Condition { text, is_exact: false }
        }
    };
    Some(match op {
        Operator::Eq => Condition { is_exact: !is_zero, ..plain("=") },
        // -0 differs from 0 in SQL alone.
        Operator::NotEq if is_zero => return None,
        Operator::NotEq => plain("!="),
        Operator::Lt => ordered("<", "<=", ">="),
        Operator::LtEq => ordered("<=", "<=", ">"),
        Operator::Gt => ordered(">", ">=", "<="),
        Operator::GtEq => ordered(">=", ">=", "<"),
        _ => return None,
    })
}

/// The column of an expression, bare or widened, and the type in which it is compared.
fn column_of<'c>(expr: &Expr, columns: &'c Columns) -> Option<(String, &'c Column, DataType)> {
    match expr {
        Expr::Column(column) => {
            let known = columns.get(&column.name)?;
            Some((column.name.clone(), known, known.number.clone()))
        }
        Expr::Cast(cast) => {
            let (name, known, number) = column_of(&cast.expr, columns)?;
            let to = cast.field.data_type().clone();
            // Doubles are what conditions compare, so an i64 that is rounded to one is compared alike.
            let is_same =
                to == DataType::Float64 || (number, &to) == (DataType::Int32, &DataType::Int64);
            is_same.then_some((name, known, to))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use datafusion::prelude::{cast, ident, lit};

    fn columns() -> Columns {
        let column = |number: DataType, has_nan| Column { number, has_nan };
        HashMap::from([
            ("x".to_owned(), column(DataType::Float64, false)),
            ("region".to_owned(), column(DataType::Int32, false)),
            ("n".to_owned(), column(DataType::Int64, false)),
            ("T".to_owned(), column(DataType::Float32, false)),
            ("holes".to_owned(), column(DataType::Float64, true)),
        ])
    }

    fn said(filter: &Expr) -> Option<(String, bool)> {
        translate(filter, &columns()).map(|c| (c.text, c.is_exact))
    }

    #[test]
    fn filters_become_conditions() {
        let x = || ident("x");
        let wide = |name: &str| cast(ident(name), DataType::Float64);
        for (filter, text, is_exact) in [
            (x().lt(lit(0.5)), "x < 5e-1", true),
            (lit(0.5).lt(x()), "x > 5e-1", true),
            (!x().lt(lit(0.1)), "x >= 1e-1", true),
            (ident("region").eq(lit(3_i32)), "region = 3e0", true),
            (wide("region").lt(lit(2.5)), "region < 2.5e0", true),
            (ident("T").gt(lit(0.1_f32)), "T > 1.0000000149011612e-1", true),
            (wide("T").gt(lit(0.1)), "T > 1e-1", true),
            (x().between(lit(-1.0), lit(1.0)), "(x >= -1e0 and x <= 1e0)", true),
            (!x().between(lit(-1.0), lit(1.0)), "(x < -1e0 or x > 1e0)", true),
            (
                ident("region").in_list(vec![lit(1_i32), lit(2_i32)], true),
                "not (region in [1e0, 2e0])",
                true,
            ),
            (x().lt(lit(0.0)), "x <= 0e0", false),
            (x().eq(lit(0.0)), "x = 0e0", false),
            (ident("holes").gt(lit(1.0)), "not (holes <= 1e0)", false),
            (ident("holes").not_eq(lit(1.0)), "holes != 1e0", true),
            (x().lt(lit(1.0)).and(ident("id").eq(lit(4_i64))), "x < 1e0", false),
            (!x().lt(lit(1.0)).or(ident("n").gt(lit(7_i64))), "(x >= 1e0 and n <= 7e0)", true),
        ] {
            assert_eq!(said(&filter), Some((text.to_owned(), is_exact)), "{filter}");
        }
        for filter in [
            ident("id").eq(lit(4_i64)),
            x().lt(lit(1.0)).or(ident("id").eq(lit(4_i64))),
            x().not_eq(lit(0.0)),
            x().lt(lit(f64::INFINITY)),
            x().lt(lit(f64::NAN)),
            x().lt(lit(ScalarValue::Float64(None))),
            ident("n").lt(lit(1_i64 << 53)),
            cast(ident("x"), DataType::Float32).lt(lit(1.0_f32)),
            x().lt(ident("T")),
        ] {
            assert_eq!(said(&filter), None, "{filter}");
        }
    }
}
