//! Small constructors for syntax trees that do not come from text.

use avastra_base::outside::in_comment;
use avastra_base::units::{Dimension, decimal};
use avastra_lang::model::{Space, Type, Value};
use avastra_lang::syntax::LANGUAGE;
use avastra_lang::syntax::ast::{
    Arg, BinaryOp, Call, Clause, ClauseKind, Comparison, Doc, Expect, Expr, ExprKind, Field, File, Item,
    ItemKind, Name, Number, Span, Text, Use,
};

/// How every emitted file begins.
const EMITTED: &str = "Emitted by `avastra ";

/// Whether a text is of a file that was emitted.
pub fn is_emitted(text: &str) -> bool {
    text.strip_prefix("//! ").is_some_and(|line| line.starts_with(EMITTED))
}

/// A file with one item, made in a space. The first line names the command that emitted it, and what to do with it; `docs` are the
/// item's.
pub fn file(
    command: &str,
    advice: &str,
    space: &Space,
    space_path: &str,
    docs: Vec<Doc>,
    kind: ItemKind,
) -> File {
    let item = |docs, kind| Item { docs, kind, span: Span::NONE };
    let digest = Some(Text::new(space.meaning.seal(), Span::NONE));
    let space_use = Use { path: Text::new(space_path, Span::NONE), digest, without: Vec::new() };
    File {
        docs: vec![doc(&format!("{EMITTED}{command}`; {advice}."))],
        items: vec![
            item(Vec::new(), ItemKind::Language(digits(LANGUAGE.to_string()))),
            item(Vec::new(), ItemKind::Use(space_use)),
            item(docs, kind),
        ],
        span: Span::NONE,
    }
}

/// A line of documentation; the text may be from outside.
pub fn doc(text: &str) -> Doc {
    Doc { text: in_comment(text), span: Span::NONE }
}

pub fn name(text: &str) -> Expr {
    Expr::built(ExprKind::Name(text.to_owned()))
}

pub fn text(value: impl Into<String>) -> Expr {
    Expr::built(ExprKind::Text(value.into()))
}

/// A number without a unit, digits as given.
pub fn digits(digits: impl Into<String>) -> Number {
    Number { digits: digits.into(), unit: None, span: Span::NONE }
}

pub fn whole(value: u64) -> Expr {
    Expr::built(ExprKind::Number(digits(value.to_string())))
}

/// A quantity in its SI unit, as the shortest decimal that reads back to the same `f64`.
pub fn quantity(value: f64, dimension: Dimension) -> Expr {
    written(decimal(value.abs(), false), value < 0.0, dimension)
}

/// A quantity rounded to some decimals.
pub fn rounded(value: f64, decimals: usize, dimension: Dimension) -> Expr {
    written(format!("{:.decimals$}", value.abs()), value < 0.0, dimension)
}

fn written(digits: String, negative: bool, dimension: Dimension) -> Expr {
    signed(digits, negative, &dimension.si_unit())
}

/// A number with its sign and its unit; the unit may be empty.
pub fn signed(digits: String, negative: bool, unit: &str) -> Expr {
    let unit = (!unit.is_empty()).then(|| Name::built(unit));
    let number = Expr::built(ExprKind::Number(Number { digits, unit, span: Span::NONE }));
    if negative {
        let op = avastra_lang::syntax::ast::UnaryOp::Negate;
        return Expr::built(ExprKind::Unary { op, operand: Box::new(number) });
    }
    number
}

/// A value of the language as its literal.
pub fn value(space: &Space, value: Value, ty: Type) -> Expr {
    match (value, ty) {
        (Value::Bool(truth), _) => Expr::built(ExprKind::Bool(truth)),
        (Value::Variant(index, variant), _) => name(&space.enums[index.0].variants[variant]),
        (Value::Number(number), Type::Quantity(dimension)) => quantity(number, dimension),
        (Value::Number(number), _) => quantity(number, Dimension::RATIO),
    }
}

pub fn field(field: &str, value: Expr) -> Field {
    Field { name: Name::built(field), value, span: Span::NONE }
}

/// `stops_at_red.breached`.
pub fn part(of: &str, part: &str) -> Expr {
    Expr::built(ExprKind::Field { base: Box::new(name(of)), field: Name::built(part) })
}

pub fn record(fields: Vec<Field>) -> Expr {
    Expr::built(ExprKind::Record(fields))
}

pub fn list(items: Vec<Expr>) -> Expr {
    Expr::built(ExprKind::List(items))
}

pub fn call(function: &str, args: Vec<(String, Expr)>) -> Call {
    let args = args.into_iter().map(|(name, value)| Arg { name: Some(Name::built(name)), value });
    Call { name: Name::built(function), args: args.collect(), span: Span::NONE }
}

pub fn equal(left: Expr, right: Expr) -> Expr {
    binary(BinaryOp::Compare(Comparison::Equal), left, right)
}

pub fn binary(op: BinaryOp, left: Expr, right: Expr) -> Expr {
    let (left, right) = (Box::new(left), Box::new(right));
    Expr::built(ExprKind::Binary { op, op_span: Span::NONE, left, right })
}

/// `npc#2`.
pub fn road_user(id: u32) -> Expr {
    Expr::built(ExprKind::Numbered { name: Name::built("npc"), number: id.to_string() })
}

pub fn clause(kind: ClauseKind, value: Expr) -> Clause {
    Clause { kind, value, span: Span::NONE }
}

pub fn expect(claim: Expr, clauses: Vec<Clause>) -> Expect {
    Expect { claim, clauses, span: Span::NONE }
}
