//! Operations in postfix order.

/// Most values waiting for their operation.
pub(super) const STACK_MAX: usize = 64;

/// A function of one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unary {
    Abs,
    Ceil,
    Cos,
    Exp,
    Floor,
    Log,
    Negate,
    Not,
    Round,
    Sign,
    Sin,
    Sqrt,
    Tan,
}

/// A function of two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BinaryOp {
    Add,
    And,
    Divide,
    Equal,
    Greater,
    GreaterEqual,
    Less,
    LessEqual,
    Max,
    Min,
    Multiply,
    NotEqual,
    Or,
    Power,
    Subtract,
}

/// An operation: takes its values from the top of the stack, leaves one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Op {
    Constant(f64),
    /// The value at a position.
    Variable(usize),
    Unary(Unary),
    BinaryOp(BinaryOp),
    /// True if the value is in the list of this number.
    In(usize),
    /// Truth, number, number: the first of the numbers where the truth holds.
    If,
}
