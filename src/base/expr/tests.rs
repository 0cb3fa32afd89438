//! Expressions against a tree that is walked, and texts that are none.

use proptest::prelude::*;

use super::{ExprKind, Expression};

const NAMES: [&str; 3] = ["x", "y", "quality"];

/// An expression as a tree; the position distinguishes numbers from truths.
#[derive(Clone, Debug)]
enum Tree {
    Number(f64),
    Variable(usize),
    Negate(Box<Tree>),
    Call(&'static str, Vec<Tree>),
    Infix(&'static str, Box<Tree>, Box<Tree>),
    If(Box<Tree>, Box<Tree>, Box<Tree>),
    True,
    Not(Box<Tree>),
    In(Box<Tree>, Vec<f64>),
}

impl Tree {
    /// The text, every operand in brackets of its own.
    fn text(&self) -> String {
        match self {
            Self::Number(v) => format!("{v:?}"),
            Self::Variable(v) => NAMES[*v].to_owned(),
            Self::Negate(a) => format!("-({})", a.text()),
            Self::Call(name, list) => {
                let list: Vec<String> = list.iter().map(Self::text).collect();
                format!("{name}({})", list.join(", "))
            }
            Self::Infix(sign, a, b) => format!("({}) {sign} ({})", a.text(), b.text()),
            Self::If(c, a, b) => format!("if({},{},{})", c.text(), a.text(), b.text()),
            Self::True => "true".to_owned(),
            Self::Not(a) => format!("not ({})", a.text()),
            Self::In(a, list) => format!("({}) in {list:?}", a.text()),
        }
    }

    fn number(&self, values: &[f64]) -> f64 {
        match self {
            Self::Number(v) => *v,
            Self::Variable(v) => values[*v],
            Self::Negate(a) => -a.number(values),
            Self::Call(name, list) => {
                let list: Vec<f64> = list.iter().map(|t| t.number(values)).collect();
                let extreme = |better: fn(f64, f64) -> bool| match list.iter().any(|v| v.is_nan()) {
                    true => f64::NAN,
                    false => {
                        list[1..].iter().fold(list[0], |m, &v| if better(v, m) { v } else { m })
                    }
                };
                match *name {
                    "abs" => list[0].abs(),
                    "sqrt" => list[0].sqrt(),
                    "floor" => list[0].floor(),
                    "exp" => libm::exp(list[0]),
                    "sin" => libm::sin(list[0]),
                    "min" => extreme(|a, b| a < b),
                    "max" => extreme(|a, b| a > b),
                    other => panic!("no case for {other}"),
                }
            }
            Self::Infix(sign, a, b) => {
                let (a, b) = (a.number(values), b.number(values));
                match *sign {
                    "+" => a + b,
                    "-" => a - b,
                    "*" => a * b,
                    "/" => a / b,
                    "^" => libm::pow(a, b),
                    other => panic!("no case for {other}"),
                }
            }
            Self::If(c, a, b) => match c.truth(values) {
                true => a.number(values),
                false => b.number(values),
            },
            other => panic!("{other:?} is a truth"),
        }
    }

    fn truth(&self, values: &[f64]) -> bool {
        match self {
            Self::True => true,
            Self::Not(a) => !a.truth(values),
            Self::In(a, list) => list.contains(&a.number(values)),
            Self::Infix("and", a, b) => a.truth(values) && b.truth(values),
            Self::Infix("or", a, b) => a.truth(values) || b.truth(values),
            Self::Infix(sign, a, b) => {
                let (a, b) = (a.number(values), b.number(values));
                match *sign {
                    "=" => a == b,
                    "!=" => a != b,
                    "<" => a < b,
                    "<=" => a <= b,
                    ">" => a > b,
                    ">=" => a >= b,
                    other => panic!("no case for {other}"),
                }
            }
            other => panic!("{other:?} is a number"),
        }
    }
}

/// Small whole numbers and zero among others, so that equality and division by zero occur.
fn value() -> impl Strategy<Value = f64> {
    prop_oneof![(-3i32..4).prop_map(f64::from), -10.0..10.0, Just(1e300), Just(1e-300)]
}

fn number() -> BoxedStrategy<Tree> {
    let leaf = prop_oneof![
        value().prop_map(|v| Tree::Number(v.abs())),
        (0..3usize).prop_map(Tree::Variable)
    ];
    leaf.prop_recursive(4, 24, 3, |inner| {
        let two = (inner.clone(), inner.clone());
        prop_oneof![
            inner.clone().prop_map(|a| Tree::Negate(a.into())),
            (prop::sample::select(vec!["abs", "sqrt", "floor", "exp", "sin"]), inner.clone())
                .prop_map(|(name, a)| Tree::Call(name, vec![a])),
            (prop::sample::select(vec!["min", "max"]), prop::collection::vec(inner.clone(), 2..4))
                .prop_map(|(name, list)| Tree::Call(name, list)),
            (prop::sample::select(vec!["+", "-", "*", "/", "^"]), two.clone())
                .prop_map(|(sign, (a, b))| Tree::Infix(sign, a.into(), b.into())),
            (comparison(inner), two).prop_map(|(c, (a, b))| Tree::If(c.into(), a.into(), b.into())),
        ]
    })
    .boxed()
}

fn comparison(number: BoxedStrategy<Tree>) -> BoxedStrategy<Tree> {
    let signs = prop::sample::select(vec!["=", "!=", "<", "<=", ">", ">="]);
    prop_oneof![
        4 => (signs, number.clone(), number.clone())
            .prop_map(|(sign, a, b)| Tree::Infix(sign, a.into(), b.into())),
        1 => (number, prop::collection::vec(value(), 1..4)).prop_map(|(a, list)| Tree::In(a.into(), list)),
    ]
    .boxed()
}

fn truth() -> BoxedStrategy<Tree> {
    let leaf = prop_oneof![6 => comparison(number()), 1 => Just(Tree::True)];
    leaf.prop_recursive(3, 8, 2, |inner| {
        prop_oneof![
            inner.clone().prop_map(|a| Tree::Not(a.into())),
            (prop::sample::select(vec!["and", "or"]), inner.clone(), inner)
                .prop_map(|(sign, a, b)| Tree::Infix(sign, a.into(), b.into())),
        ]
    })
    .boxed()
}

proptest! {
    #[test]
    fn numbers_are_those_of_the_tree(tree in number(), values in prop::array::uniform3(value())) {
        let text = tree.text();
        let expression = Expression::parse(&text, &NAMES).map_err(|e| TestCaseError::fail(format!("{text}: {e}")))?;
        prop_assert_eq!(expression.kind(), ExprKind::Number);
        let (found, expected) = (expression.number(&values), tree.number(&values));
        prop_assert!(found.to_bits() == expected.to_bits() || found.is_nan() && expected.is_nan(), "{}: {} {}", text, found, expected);
    }

    #[test]
    fn truths_are_those_of_the_tree(tree in truth(), values in prop::array::uniform3(value())) {
        let text = tree.text();
        let expression = Expression::parse(&text, &NAMES).map_err(|e| TestCaseError::fail(format!("{text}: {e}")))?;
        prop_assert_eq!(expression.truth(&values), tree.truth(&values), "{}", text);
    }

    /// A condition that holds at a point of a range must be possible in that range.
    #[test]
    fn ranges_leave_nothing_out(
        tree in truth(),
        ends in prop::array::uniform3((value(), value())),
        shares in prop::array::uniform3(prop_oneof![Just(0.0), Just(1.0), 0.0..1.0])
    ) {
        let expression = Expression::parse(&tree.text(), &NAMES).map_err(|e| TestCaseError::fail(e.to_string()))?;
        let ranges = ends.map(|(a, b)| [a.min(b), a.max(b)]);
        let values = [0, 1, 2].map(|i| {
            let [low, high] = ranges[i];
            (low + shares[i] * (high - low)).clamp(low, high)
        });
        prop_assert!(expression.may_hold(&ranges) || !expression.truth(&values), "{}", tree.text());
        prop_assert!(!expression.must_hold_with(&ranges, &[]) || expression.truth(&values), "{}", tree.text());
    }

    /// No text makes the parser panic, and faults lie within it.
    #[test]
    fn any_text_is_an_expression_or_a_fault(text in ".{0,60}") {
        if let Err(e) = Expression::parse(&text, &NAMES) {
            prop_assert!(text.is_char_boundary(e.at), "{:?} at {}", text, e.at);
        }
    }

    #[test]
    fn any_words_are_an_expression_or_a_fault(
        words in prop::collection::vec(prop::sample::select(vec![
            "x", "quality", "1", ".5", "(", ")", "-", "not", "and", "or", "^", "=", "<", "in", "[", "]", ",", "max", "if", "pi", "é",
        ]), 0..400)
    ) {
        let text = words.join(" ");
        match Expression::parse(&text, &NAMES) {
            Ok(e) if e.kind() == ExprKind::Truth => _ = e.truth(&[1.0, 2.0, 3.0]),
            Ok(e) => _ = e.number(&[1.0, 2.0, 3.0]),
            Err(e) => prop_assert!(text.is_char_boundary(e.at), "{:?} at {}", text, e.at),
        }
    }
}

fn number_of(text: &str) -> f64 {
    Expression::parse(text, &["x"]).expect(text).number(&[3.0])
}

fn truth_of(text: &str) -> bool {
    Expression::parse(text, &["x"]).expect(text).truth(&[3.0])
}

#[test]
fn operators_bind_as_written() {
    for (text, value) in [
        ("1 + 2*3", 7.0),
        ("2^3^2", 512.0),
        ("-2^2", -4.0),
        ("2^-1", 0.5),
        ("8/4/2", 1.0),
        ("1-2-3", -4.0),
        ("- -x", 3.0),
        ("0.1 + 0.05*x", 0.1 + 0.05 * 3.0),
        ("max(1, x, 2) + min(4, .5)", 3.5),
        ("if(x > 2 and not x = 4, pow(x, 2), 0)", 9.0),
        ("sign(-x) + sign(0) + round(2.5)", 2.0),
        ("1e2+1E-2", 100.01),
        ("2*pi", std::f64::consts::TAU),
    ] {
        assert_eq!(number_of(text), value, "{text}");
    }
    for text in [
        "x = 3 or x = 4 and false",
        "not x < 1 and x >= 3",
        "not (x > 1 and x > 4)",
        "x in [1, 3] and not x in [-3]",
        "x + 1 in [4]",
        "1 != 0/0 and not 1 = 0/0 and not 1 < 0/0",
        "1/0 > 1e308 and -1/0 < x",
    ] {
        assert!(truth_of(text), "{text}");
    }
}

#[test]
fn faults_have_a_place_and_say_what_to_write() {
    for (text, at, says) in [
        ("", 0, "found the end"),
        ("1 +", 3, "found the end"),
        ("quality > 6 & x = 1", 12, "`and`"),
        ("qality > 6", 0, "quality"),
        ("cosh(x) > 6", 0, "there is no function `cosh`"),
        ("1 < x < 2", 6, "not chained"),
        ("x and x > 1", 0, "truths such as"),
        ("x > 1 and y", 10, "truths such as"),
        ("1 + (x > 2)", 4, "`+` takes numbers"),
        ("sqrt(x, 2)", 6, "expected `)`"),
        ("sqrt x", 5, "expected `(`"),
        ("max(x)", 5, "expected `,`"),
        ("x in [y]", 6, "a list holds numbers"),
        ("1.2.3", 3, "expected an operator"),
        ("x = 1e999", 4, "not a number"),
        (".", 0, "not a number"),
        ("x > 2 #", 6, "means nothing"),
        ("if(x, 1, 2)", 3, "`if` takes truths"),
        ("not x", 4, "`not` takes truths"),
    ] {
        let e = Expression::parse(text, &NAMES).expect_err(text);
        assert!(
            e.at == at && e.message.contains(says),
            "{text:?}: {e:?}, expected {says:?} at {at}"
        );
    }
}

#[test]
fn nothing_is_too_deep_for_an_answer() {
    for text in [
        "(".repeat(10_000),
        "-".repeat(10_000),
        "not ".repeat(4_000),
        "2^".repeat(8_000),
        "max(1,".repeat(2_000),
        "x ".repeat(Expression::TEXT_MAX),
    ] {
        let e = Expression::parse(&text, &["x"]).expect_err("far too deep");
        assert!(e.message.contains("too much") || e.message.contains("longer"));
    }
    // Long is not deep.
    assert_eq!(number_of(&("0".to_owned() + &"+x".repeat(1000))), 3000.0);
    let depth = Expression::STACK_MAX - 1;
    let text = "(1+".repeat(depth / 2) + "x" + &")".repeat(depth / 2);
    assert_eq!(number_of(&text), 3.0 + (depth / 2) as f64);
}

#[test]
fn ranges_rule_out_what_cannot_be() {
    let may = |text: &str, ranges: [[f64; 2]; 3]| {
        Expression::parse(text, &NAMES).expect(text).may_hold(&ranges)
    };
    let ranges = [[0.0, 1.0], [5.0, 5.0], [1.0, 2.5]];
    for text in [
        "quality > 6 and x > 0.5",
        "x > 1",
        "y != 5",
        "x + y < 4.9",
        "not (x <= 1)",
        "y in [1, 2, 6]",
        "sqrt(quality) > 2 or x*quality > 2.5",
        "if(y = 5, x, quality) > 1",
    ] {
        assert!(!may(text, ranges), "{text}");
    }
    for text in ["x >= 1", "quality > 2 and y = 5", "exp(x) > 100", "y in [5]"] {
        assert!(may(text, ranges), "{text}");
    }
}

#[test]
fn ranges_tell_what_holds_everywhere() {
    let ranges = [[0.0, 1.0], [5.0, 5.0], [1.0, 2.5]];
    let must = |text: &str, nan: &[bool]| {
        Expression::parse(text, &NAMES).expect(text).must_hold_with(&ranges, nan)
    };
    for text in ["x <= 1", "y = 5 and quality < 3", "not (x > 1)", "x < 0 or x + y < 6.5", "true"] {
        assert!(must(text, &[]), "{text}");
    }
    for text in ["x < 1", "y in [5]", "exp(x) > 0", "quality <= 2.4", "x != 0.5"] {
        assert!(!must(text, &[]), "{text}");
    }
    // What is not a number fulfills no comparison, except that it differs.
    assert!(!must("x <= 1", &[true, false, false]));
    assert!(must("y = 5 or x <= 1", &[true, false, false]));
}
