//! The operators of expressions: how tightly each binds, and how equal ones group.
//!
//! This is the only table of precedence. The parser builds trees by it (`expression`), and the printer puts
//! parentheses by it (`print_expression`). Which token is which operator says `grammar::role`.

use crate::syntax::ast::{Arithmetic, BinaryOp, Expr, ExprKind, UnaryOp};

/// A prefix or an infix operator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operator {
    Unary(UnaryOp),
    Binary(BinaryOp),
    /// `lo .. hi`, which is no [`BinaryOp`]: it makes no value.
    Range,
}

/// How `a op b op c` is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Grouping {
    Left,
    Right,
    /// Refused: `a < b < c`.
    Never,
}

/// Level of an expression that needs parentheses before `.` and `[` alone.
pub const OPERAND: u8 = u8::MAX - 1;
/// Level of an expression that never needs parentheses.
pub const BASE: u8 = u8::MAX;

impl Operator {
    /// The table: a higher level binds tighter. A prefix groups to the right, because its operand may begin with it.
    fn binding(self) -> (u8, Grouping) {
        match self {
            Operator::Binary(BinaryOp::Implies) => (1, Grouping::Right),
            Operator::Binary(BinaryOp::Or) => (2, Grouping::Left),
            Operator::Binary(BinaryOp::And) => (3, Grouping::Left),
            Operator::Unary(UnaryOp::Not) => (4, Grouping::Right),
            Operator::Binary(BinaryOp::Compare(_) | BinaryOp::In) => (5, Grouping::Never),
            Operator::Range => (6, Grouping::Never),
            Operator::Binary(BinaryOp::Arithmetic(Arithmetic::Add | Arithmetic::Subtract)) => {
                (7, Grouping::Left)
            }
            Operator::Binary(BinaryOp::Arithmetic(Arithmetic::Multiply | Arithmetic::Divide)) => {
                (8, Grouping::Left)
            }
            Operator::Unary(UnaryOp::Negate) => (9, Grouping::Right),
        }
    }

    pub fn level(self) -> u8 {
        self.binding().0
    }

    pub fn grouping(self) -> Grouping {
        self.binding().1
    }

    /// Whether the operator stands between two expressions.
    pub fn is_infix(self) -> bool {
        !matches!(self, Operator::Unary(_))
    }

    /// The lowest level of a left operand without parentheses.
    pub fn left_least(self) -> u8 {
        self.level() + u8::from(self.grouping() != Grouping::Left)
    }

    /// The lowest level of a right operand without parentheses.
    pub fn right_least(self) -> u8 {
        self.level() + u8::from(self.grouping() != Grouping::Right)
    }
}

/// How tightly the outermost part of an expression binds.
pub fn level(expr: &Expr) -> u8 {
    match &expr.kind {
        ExprKind::Binary { op, .. } => Operator::Binary(*op).level(),
        ExprKind::Range { .. } => Operator::Range.level(),
        ExprKind::Unary { op, .. } => Operator::Unary(*op).level(),
        // `12 m.x` and `lane 1/1 at 2 m[0]` would read as something else.
        ExprKind::Number(_) | ExprKind::LanePoint { .. } => OPERAND,
        ExprKind::Text(_)
        | ExprKind::Bool(_)
        | ExprKind::Name(_)
        | ExprKind::Field { .. }
        | ExprKind::Index { .. }
        | ExprKind::Call(_)
        | ExprKind::List(_)
        | ExprKind::Record(_)
        | ExprKind::Match { .. }
        | ExprKind::Numbered { .. } => BASE,
    }
}
