//! Parses tokens to operations by precedence climbing, and checks their types.

use super::op::{BinaryOp, Op, Unary};
use super::words::{Token, fault, next_word};
use super::{ExprError, ExprKind, Expression};

/// Binding strength of operators, from the loosest.
const OR: u8 = 1;
const AND: u8 = 2;
const COMPARISON: u8 = 4;
const SUM: u8 = 5;
const PRODUCT: u8 = 6;
const POWER: u8 = 7;

/// An infix operator.
struct Infix {
    binds: u8,
    /// The kind of its operands.
    takes: ExprKind,
    gives: ExprKind,
    op: BinaryOp,
}

fn infix(word: Token) -> Option<Infix> {
    let (binds, op) = match word {
        Token::Name("or") => (OR, BinaryOp::Or),
        Token::Name("and") => (AND, BinaryOp::And),
        Token::Sign("=" | "==") => (COMPARISON, BinaryOp::Equal),
        Token::Sign("!=") => (COMPARISON, BinaryOp::NotEqual),
        Token::Sign("<") => (COMPARISON, BinaryOp::Less),
        Token::Sign("<=") => (COMPARISON, BinaryOp::LessEqual),
        Token::Sign(">") => (COMPARISON, BinaryOp::Greater),
        Token::Sign(">=") => (COMPARISON, BinaryOp::GreaterEqual),
        Token::Sign("+") => (SUM, BinaryOp::Add),
        Token::Sign("-") => (SUM, BinaryOp::Subtract),
        Token::Sign("*") => (PRODUCT, BinaryOp::Multiply),
        Token::Sign("/") => (PRODUCT, BinaryOp::Divide),
        Token::Sign("^") => (POWER, BinaryOp::Power),
        _ => return None,
    };
    let (takes, gives) = match binds {
        OR | AND => (ExprKind::Truth, ExprKind::Truth),
        COMPARISON => (ExprKind::Number, ExprKind::Truth),
        _ => (ExprKind::Number, ExprKind::Number),
    };
    Some(Infix { binds, takes, gives, op })
}

/// The meaning of a name in front of a bracket.
enum Function {
    One(Unary),
    Two(BinaryOp),
    /// Two or more.
    Many(BinaryOp),
    If,
}

const FUNCTIONS: &str =
    "abs, ceil, cos, exp, floor, if, log, max, min, pow, round, sign, sin, sqrt, tan";

fn function(name: &str) -> Option<Function> {
    Some(match name {
        "abs" => Function::One(Unary::Abs),
        "ceil" => Function::One(Unary::Ceil),
        "cos" => Function::One(Unary::Cos),
        "exp" => Function::One(Unary::Exp),
        "floor" => Function::One(Unary::Floor),
        "if" => Function::If,
        "log" => Function::One(Unary::Log),
        "max" => Function::Many(BinaryOp::Max),
        "min" => Function::Many(BinaryOp::Min),
        "pow" => Function::Two(BinaryOp::Power),
        "round" => Function::One(Unary::Round),
        "sign" => Function::One(Unary::Sign),
        "sin" => Function::One(Unary::Sin),
        "sqrt" => Function::One(Unary::Sqrt),
        "tan" => Function::One(Unary::Tan),
        _ => return None,
    })
}

struct Parser<'a> {
    text: &'a str,
    variables: &'a [&'a str],
    /// The current token, its begin and its end.
    word: Token<'a>,
    start: usize,
    end: usize,
    ops: Vec<Op>,
    lists: Vec<Vec<f64>>,
    /// Values on the stack after `ops`.
    waiting: usize,
    /// Brackets and signs around the place.
    depth: usize,
}

impl Expression {
    /// Reads `text`; `variables` are the names it may use, by position.
    ///
    /// Errors: the first fault and its place.
    pub fn parse(text: &str, variables: &[&str]) -> Result<Self, ExprError> {
        parse(text, variables)
    }
}

/// Reads a whole text.
fn parse(text: &str, variables: &[&str]) -> Result<Expression, ExprError> {
    if text.len() > Expression::TEXT_MAX {
        let most = Expression::TEXT_MAX;
        return Err(fault(0, format!("it is longer than {most} bytes")));
    }
    let mut parser = Parser {
        text,
        variables,
        word: Token::End,
        start: 0,
        end: 0,
        ops: Vec::new(),
        lists: Vec::new(),
        waiting: 0,
        depth: 0,
    };
    parser.advance()?;
    let kind = parser.expression(OR)?;
    if parser.word != Token::End {
        let what = parser.found();
        return Err(fault(parser.start, format!("expected an operator or the end, found {what}")));
    }
    Ok(Expression { ops: parser.ops, lists: parser.lists, kind })
}

impl<'a> Parser<'a> {
    fn advance(&mut self) -> Result<(), ExprError> {
        (self.word, self.start, self.end) = next_word(self.text, self.end)?;
        Ok(())
    }

    /// The word at hand as a message names it.
    fn found(&self) -> String {
        match self.word {
            Token::End => "the end".to_owned(),
            _ => format!("`{}`", &self.text[self.start..self.end]),
        }
    }

    fn expect(&mut self, sign: &'static str) -> Result<(), ExprError> {
        if self.word != Token::Sign(sign) {
            let found = self.found();
            return Err(fault(self.start, format!("expected `{sign}`, found {found}")));
        }
        self.advance()
    }

    fn push(&mut self, op: Op) -> Result<(), ExprError> {
        match op {
            Op::Constant(_) | Op::Variable(_) => self.waiting += 1,
            Op::Unary(_) | Op::In(_) => {}
            Op::BinaryOp(_) => self.waiting -= 1,
            Op::If => self.waiting -= 2,
        }
        if self.waiting > Expression::STACK_MAX {
            return Err(self.too_deep());
        }
        self.ops.push(op);
        Ok(())
    }

    fn too_deep(&self) -> ExprError {
        fault(self.start, "too much within each other; take it apart")
    }

    /// Operators that bind at least as tightly as `least`, and their operands.
    fn expression(&mut self, least: u8) -> Result<ExprKind, ExprError> {
        self.depth += 1;
        if self.depth > Expression::STACK_MAX {
            return Err(self.too_deep());
        }
        let start = self.start;
        let mut kind = self.operand()?;
        let mut compared = false;
        loop {
            if self.word == Token::Name("in") && least <= COMPARISON {
                self.not_chained(compared)?;
                check(kind, ExprKind::Number, start, "in")?;
                kind = self.list()?;
                compared = true;
                continue;
            }
            let Some(operator) = infix(self.word).filter(|o| o.binds >= least) else {
                break;
            };
            if operator.binds == COMPARISON {
                self.not_chained(compared)?;
            }
            let name = &self.text[self.start..self.end];
            check(kind, operator.takes, start, name)?;
            self.advance()?;
            let right = self.start;
            // Powers to the right, all others to the left.
            let binds = operator.binds + u8::from(operator.binds != POWER);
            let other = self.expression(binds)?;
            check(other, operator.takes, right, name)?;
            self.push(Op::BinaryOp(operator.op))?;
            kind = operator.gives;
            compared = operator.binds == COMPARISON;
        }
        self.depth -= 1;
        Ok(kind)
    }

    fn not_chained(&self, compared: bool) -> Result<(), ExprError> {
        match compared {
            true => Err(fault(self.start, "comparisons are not chained; write `a < b and b < c`")),
            false => Ok(()),
        }
    }

    fn operand(&mut self) -> Result<ExprKind, ExprError> {
        let (word, start) = (self.word, self.start);
        match word {
            Token::Number(value) => {
                self.advance()?;
                self.push(Op::Constant(value))?;
                Ok(ExprKind::Number)
            }
            Token::Sign("(") => {
                self.advance()?;
                let kind = self.expression(OR)?;
                self.expect(")")?;
                Ok(kind)
            }
            Token::Sign("-") => self.prefix(Unary::Negate, POWER, ExprKind::Number),
            Token::Name("not") => self.prefix(Unary::Not, COMPARISON, ExprKind::Truth),
            Token::Name(name) if !matches!(name, "and" | "or" | "in") => self.name(name),
            _ => {
                let found = self.found();
                Err(fault(start, format!("expected a number, a name or `(`, found {found}")))
            }
        }
    }

    fn prefix(&mut self, op: Unary, binds: u8, kind: ExprKind) -> Result<ExprKind, ExprError> {
        let name = &self.text[self.start..self.end];
        self.advance()?;
        let start = self.start;
        let found = self.expression(binds)?;
        check(found, kind, start, name)?;
        self.push(Op::Unary(op))?;
        Ok(kind)
    }

    fn name(&mut self, name: &str) -> Result<ExprKind, ExprError> {
        let start = self.start;
        self.advance()?;
        if let Some(v) = self.variables.iter().position(|known| *known == name) {
            self.push(Op::Variable(v))?;
            return Ok(ExprKind::Number);
        }
        let (value, kind) = match name {
            "pi" => (std::f64::consts::PI, ExprKind::Number),
            "true" => (1.0, ExprKind::Truth),
            "false" => (0.0, ExprKind::Truth),
            _ => {
                return match function(name) {
                    Some(function) => self.call(name, &function),
                    None => Err(self.unknown(name, start)),
                };
            }
        };
        self.push(Op::Constant(value))?;
        Ok(kind)
    }

    fn unknown(&self, name: &str, start: usize) -> ExprError {
        let message = if self.word == Token::Sign("(") {
            format!("there is no function `{name}`; there are {FUNCTIONS}")
        } else if self.variables.is_empty() {
            format!("there is no variable `{name}`")
        } else {
            let known = self.variables.join(", ");
            format!("there is no variable `{name}`; there are {known}")
        };
        fault(start, message)
    }

    fn call(&mut self, name: &str, function: &Function) -> Result<ExprKind, ExprError> {
        self.expect("(")?;
        match function {
            Function::One(op) => {
                self.argument(name, ExprKind::Number)?;
                self.push(Op::Unary(*op))?;
            }
            Function::Two(op) => {
                self.argument(name, ExprKind::Number)?;
                self.expect(",")?;
                self.argument(name, ExprKind::Number)?;
                self.push(Op::BinaryOp(*op))?;
            }
            Function::Many(op) => {
                self.argument(name, ExprKind::Number)?;
                loop {
                    self.expect(",")?;
                    self.argument(name, ExprKind::Number)?;
                    self.push(Op::BinaryOp(*op))?;
                    if self.word == Token::Sign(")") {
                        break;
                    }
                }
            }
            Function::If => {
                self.argument(name, ExprKind::Truth)?;
                for _ in 0..2 {
                    self.expect(",")?;
                    self.argument(name, ExprKind::Number)?;
                }
                self.push(Op::If)?;
            }
        }
        self.expect(")")?;
        Ok(ExprKind::Number)
    }

    fn argument(&mut self, name: &str, kind: ExprKind) -> Result<(), ExprError> {
        let start = self.start;
        let found = self.expression(OR)?;
        check(found, kind, start, name)
    }

    /// `in [number, ..]`.
    fn list(&mut self) -> Result<ExprKind, ExprError> {
        self.advance()?;
        self.expect("[")?;
        let mut list = Vec::new();
        loop {
            let negative = self.word == Token::Sign("-");
            if negative {
                self.advance()?;
            }
            let Token::Number(value) = self.word else {
                let found = self.found();
                return Err(fault(self.start, format!("a list holds numbers, found {found}")));
            };
            list.push(if negative { -value } else { value });
            self.advance()?;
            if self.word != Token::Sign(",") {
                break;
            }
            self.advance()?;
        }
        self.expect("]")?;
        self.push(Op::In(self.lists.len()))?;
        self.lists.push(list);
        Ok(ExprKind::Truth)
    }
}

/// An operand of another kind than its operator takes is a fault.
fn check(found: ExprKind, expected: ExprKind, at: usize, name: &str) -> Result<(), ExprError> {
    match (expected, found) {
        (ExprKind::Number, ExprKind::Truth) => {
            let message = format!("`{name}` takes numbers, this is a truth");
            Err(fault(at, message))
        }
        (ExprKind::Truth, ExprKind::Number) => {
            let message = format!("`{name}` takes truths such as `x > 1`, this is a number");
            Err(fault(at, message))
        }
        _ => Ok(()),
    }
}
