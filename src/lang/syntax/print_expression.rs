//! Expressions as text: parentheses where precedence needs them, and nowhere else.

use crate::syntax::ast::{Arg, Arm, BinaryOp, Call, Expr, ExprKind, Field, Number, UnaryOp};
use crate::syntax::layout::Layout;
use crate::syntax::operator::{BASE, Grouping, Operator, level};
use avastra_base::outside::is_bidi;

/// An expression in a place where any expression may stand.
pub fn expression(expr: &Expr) -> Layout {
    within(expr, 0)
}

/// An expression, in parentheses unless it binds at least as tightly as `least`.
fn within(expr: &Expr, least: u8) -> Layout {
    let bare = bare(expr);
    if level(expr) < least { Layout::row([Layout::text("("), bare, Layout::text(")")]) } else { bare }
}

fn bare(expr: &Expr) -> Layout {
    match &expr.kind {
        ExprKind::Number(value) => Layout::text(number(value)),
        ExprKind::Text(value) => Layout::text(quoted(value)),
        ExprKind::Bool(value) => Layout::text(value.to_string()),
        ExprKind::Name(name) => Layout::text(name),
        ExprKind::Unary { op, operand } => {
            let sign = match op {
                UnaryOp::Not => "not ",
                UnaryOp::Negate => "-",
            };
            Layout::row([Layout::text(sign), within(operand, Operator::Unary(*op).right_least())])
        }
        ExprKind::Binary { op, left, right, .. } => binary(*op, left, right),
        ExprKind::Range { low, high } => Layout::row([
            within(low, Operator::Range.left_least()),
            Layout::text(" .. "),
            within(high, Operator::Range.right_least()),
        ]),
        ExprKind::Field { base, field } => {
            Layout::row([within(base, BASE), Layout::text(format!(".{}", field.text))])
        }
        ExprKind::Index { base, index } => {
            Layout::row([within(base, BASE), Layout::text("["), expression(index), Layout::text("]")])
        }
        ExprKind::Call(inner) => call(inner),
        ExprKind::List(items) => Layout::listed("[", items.iter().map(expression), "]"),
        ExprKind::Record(entries) => fields(entries),
        ExprKind::Match { subject, arms } => {
            let mut parts = vec![Layout::text("match "), expression(subject), Layout::text(" ")];
            // A line break ends no value before a minus.
            let ended = |(at, one): (usize, &Arm)| match needs_comma(arms, at) {
                true => Layout::row([arm(one), Layout::IfBroken(",")]),
                false => arm(one),
            };
            parts.push(braced(arms.iter().enumerate().map(ended)));
            Layout::row(parts)
        }
        ExprKind::LanePoint { road, lane, station } => {
            let is_number = !road.value.is_empty() && road.value.bytes().all(|byte| byte.is_ascii_digit());
            let road = if is_number { road.value.clone() } else { quoted(&road.value) };
            Layout::text(format!("lane {road}/{} at {}", lane.text, number(station)))
        }
        ExprKind::Numbered { name, number } => Layout::text(format!("{}#{number}", name.text)),
    }
}

/// A chain of operators of one level breaks before each of them, or not at all.
fn binary(op: BinaryOp, left: &Expr, right: &Expr) -> Layout {
    let operator = Operator::Binary(op);
    let (left_least, right_least) = (operator.left_least(), operator.right_least());
    if operator.grouping() == Grouping::Never {
        return Layout::row([
            within(left, left_least),
            Layout::text(format!(" {} ", op.symbol())),
            within(right, right_least),
        ]);
    }
    let link = |op: BinaryOp, right: &Expr| {
        [Layout::Line(" "), Layout::text(format!("{} ", op.symbol())), within(right, right_least)]
    };
    let mut rest = Vec::from(link(op, right));
    let mut first = left;
    while let ExprKind::Binary { op: earlier, left, right, .. } = &first.kind {
        if operator.grouping() == Grouping::Right || Operator::Binary(*earlier).level() != operator.level() {
            break;
        }
        rest.splice(0..0, link(*earlier, right));
        first = left;
    }
    Layout::group([within(first, left_least), Layout::nest(rest)])
}

pub fn call(call: &Call) -> Layout {
    let args = call.args.iter().map(argument);
    Layout::row([Layout::text(&call.name.text), Layout::listed("(", args, ")")])
}

fn argument(arg: &Arg) -> Layout {
    match &arg.name {
        None => expression(&arg.value),
        Some(name) => Layout::row([Layout::text(format!("{}: ", name.text)), expression(&arg.value)]),
    }
}

/// `{ a: 1, b: 2 }`, or one entry a line without commas.
pub fn fields(entries: &[Field]) -> Layout {
    braced(entries.iter().map(field))
}

pub fn field(field: &Field) -> Layout {
    Layout::row([Layout::text(format!("{}: ", field.name.text)), expression(&field.value)])
}

pub fn braced(entries: impl Iterator<Item = Layout>) -> Layout {
    let mut inside = Vec::new();
    for entry in entries {
        inside.extend([Layout::Line(if inside.is_empty() { " " } else { ", " }), entry]);
    }
    if inside.is_empty() {
        return Layout::text("{}");
    }
    Layout::group([Layout::text("{"), Layout::nest(inside), Layout::Line(" "), Layout::text("}")])
}

pub fn arm(arm: &Arm) -> Layout {
    Layout::row([Layout::text(format!("{} => ", patterns(arm))), expression(&arm.value)])
}

/// Whether the case after this one begins with a minus, which would continue the value of this one on the line before.
pub fn needs_comma(arms: &[Arm], at: usize) -> bool {
    let next = arms.get(at + 1).and_then(|next| next.patterns.first());
    next.is_some_and(|pattern| pattern.text.starts_with('-'))
}

/// `A | B`, or `_` for the rest.
pub fn patterns(arm: &Arm) -> String {
    if arm.patterns.is_empty() {
        return "_".to_owned();
    }
    arm.patterns.iter().map(|pattern| pattern.text.as_str()).collect::<Vec<_>>().join(" | ")
}

pub fn number(number: &Number) -> String {
    match &number.unit {
        Some(unit) => format!("{} {}", number.digits, unit.text),
        None => number.digits.clone(),
    }
}

/// A text literal that reads back to `value`.
pub fn quoted(value: &str) -> String {
    let mut out = String::from("\"");
    for character in value.chars() {
        match character {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            '\t' => out.push_str("\\t"),
            // Characters that could change how the line looks are printed as escapes.
            _ if is_bidi(character) || character.is_control() => {
                out.push_str(&format!("\\u{{{:x}}}", u32::from(character)))
            }
            _ => out.push(character),
        }
    }
    out.push('"');
    out
}

/// Whether the text of the expression begins with a minus, which would continue the line before it.
pub fn begins_with_minus(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Unary { op: UnaryOp::Negate, .. } => true,
        ExprKind::Binary { op, left, .. } => {
            level(left) >= Operator::Binary(*op).level() && begins_with_minus(left)
        }
        ExprKind::Range { low, .. } => begins_with_minus(low),
        _ => false,
    }
}

/// An expression at the begin of a line. With a leading minus it would continue the line before, so it
/// gets parentheses.
pub fn expression_on_new_line(expr: &Expr) -> Layout {
    if begins_with_minus(expr) { within(expr, BASE) } else { expression(expr) }
}
