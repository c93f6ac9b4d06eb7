//! Plain data in the language: records, lists, texts, numbers, truth values and `none`.

use serde_json::{Map, Value};

use crate::syntax::ast::{Expr, ExprKind, Field, Name, Number, Span, UnaryOp};

/// The word for "not given".
const NONE: &str = "none";

/// Data as an expression that was never text.
pub fn expression(value: &Value) -> Expr {
    let kind = match value {
        Value::Null => ExprKind::Name(NONE.to_owned()),
        Value::Bool(truth) => ExprKind::Bool(*truth),
        Value::String(text) => ExprKind::Text(text.clone()),
        Value::Array(items) => ExprKind::List(items.iter().map(expression).collect()),
        Value::Object(entries) => {
            let field =
                |(name, value)| Field { name: Name::built(name), value: expression(value), span: Span::NONE };
            ExprKind::Record(entries.iter().map(|(name, value)| field((name.as_str(), value))).collect())
        }
        Value::Number(number) => {
            let text = number.to_string();
            let digits = text.strip_prefix('-').unwrap_or(&text).to_owned();
            let number = Number { digits, unit: None, span: Span::NONE };
            let number = Expr::built(ExprKind::Number(number));
            if !text.starts_with('-') {
                return number;
            }
            ExprKind::Unary { op: UnaryOp::Negate, operand: Box::new(number) }
        }
    };
    Expr::built(kind)
}

/// Fields as a record.
///
/// # Errors
/// The mistake, and where it is.
pub(crate) fn record(fields: &[Field]) -> Result<Map<String, Value>, (Span, &'static str)> {
    let mut entries = Map::new();
    for field in fields {
        let value = data(&field.value)?;
        if entries.insert(field.name.text.clone(), value).is_some() {
            return Err((field.name.span, "given twice"));
        }
    }
    Ok(entries)
}

fn data(expr: &Expr) -> Result<Value, (Span, &'static str)> {
    // Read by the library that wrote it, so that numbers come back exactly.
    let number = |text: &str| serde_json::from_str(text).map_err(|_| (expr.span, "no number"));
    let wrong = (expr.span, "wanted a text, a number, a list or a record");
    match &expr.kind {
        ExprKind::Name(name) if name == NONE => Ok(Value::Null),
        ExprKind::Bool(truth) => Ok(Value::Bool(*truth)),
        ExprKind::Text(text) => Ok(Value::String(text.clone())),
        ExprKind::List(items) => Ok(Value::Array(items.iter().map(data).collect::<Result<_, _>>()?)),
        ExprKind::Record(fields) => Ok(Value::Object(record(fields)?)),
        ExprKind::Number(read) if read.unit.is_none() => number(&read.digits),
        ExprKind::Unary { op: UnaryOp::Negate, operand } => match &operand.kind {
            ExprKind::Number(read) if read.unit.is_none() => number(&format!("-{}", read.digits)),
            _ => Err(wrong),
        },
        _ => Err(wrong),
    }
}
