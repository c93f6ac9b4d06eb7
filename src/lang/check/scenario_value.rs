//! Values in scenarios. They are literals, and each is read back to exactly the `f64` that was written.

use crate::check::expression::{number_help, unknown_unit};
use crate::check::names::unknown;
use crate::model::scenario::Figure;
use crate::model::{Space, Type, Value, code};
use crate::syntax::ast::UnaryOp;
use crate::syntax::{Diagnostic, ast};
use avastra_base::units;
use avastra_base::units::{Dimension, Rational};

/// The value of a literal, which must be of the given type.
///
/// # Errors
/// If it is not a literal, or is of another type.
pub(super) fn value(space: &Space, expr: &ast::Expr, ty: Type) -> Result<Value, Diagnostic> {
    match (ty, &expr.kind) {
        (Type::Enum(of), ast::ExprKind::Name(name)) => {
            let variants = &space.enums[of.0].variants;
            match variants.iter().position(|variant| variant == name) {
                Some(variant) => Ok(Value::Variant(of, variant)),
                None => Err(unknown("variant", name, expr.span, variants.iter().map(String::as_str))),
            }
        }
        (Type::Bool, ast::ExprKind::Bool(truth)) => Ok(Value::Bool(*truth)),
        (Type::Int, _) => {
            let is_plain = |literal: &ast::Number| literal.unit.is_none();
            let found = match &expr.kind {
                ast::ExprKind::Number(literal) if !is_plain(literal) => None,
                _ => Some(number(expr, Dimension::RATIO)?).filter(|found| found.floor() == *found),
            };
            found.map(Value::Number).ok_or_else(|| {
                Diagnostic::error(code::TYPE_MISMATCH, "wanted a whole number").at(expr.span, "not one")
            })
        }
        (Type::Quantity(dimension), _) => number(expr, dimension).map(Value::Number),
        (Type::Enum(of), _) => {
            let message = format!("wanted a `{}`", space.enums[of.0].name);
            Err(Diagnostic::error(code::TYPE_MISMATCH, message).at(expr.span, "not one"))
        }
        (Type::Bool, _) => {
            Err(Diagnostic::error(code::TYPE_MISMATCH, "wanted `true` or `false`").at(expr.span, "neither"))
        }
    }
}

/// A number in SI units.
///
/// # Errors
/// If it is not a number, or its unit is unknown or of another dimension.
pub(super) fn number(expr: &ast::Expr, dimension: Dimension) -> Result<f64, Diagnostic> {
    match &expr.kind {
        ast::ExprKind::Unary { op: UnaryOp::Negate, operand } => {
            number(operand, dimension).map(|value| -value)
        }
        ast::ExprKind::Number(literal) => in_unit(literal, dimension, Rational::ONE, "wanted"),
        _ => Err(Diagnostic::error(code::TYPE_MISMATCH, "wanted a number").at(expr.span, "not one")),
    }
}

/// A number in SI units, with the number of decimals that were written.
///
/// # Errors
/// As [`number`].
pub(super) fn figure(expr: &ast::Expr, dimension: Dimension) -> Result<Figure, Diagnostic> {
    let value = number(expr, dimension)?;
    let literal = match &expr.kind {
        ast::ExprKind::Unary { operand, .. } => &operand.kind,
        kind => kind,
    };
    let ast::ExprKind::Number(literal) = literal else {
        return Ok(Figure { value, decimals: DECIMALS_MAX, unit: "", factor: 1.0 });
    };
    let unit = literal.unit.as_ref().and_then(|unit| units::unit(&unit.text));
    let factor = unit.map_or(1.0, |unit| unit.factor().to_f64());
    let unit = unit.map_or("", |unit| unit.word);
    Ok(Figure { value: value / factor, decimals: decimals(&literal.digits), unit, factor })
}

/// More decimals than these an `f64` does not have.
const DECIMALS_MAX: usize = 17;

/// Decimals of a literal: 2 of `14.22`, of `1422e-2` and of `0.1422e2`.
fn decimals(digits: &str) -> usize {
    let (digits, exponent) = digits.split_once(['e', 'E']).unwrap_or((digits, "0"));
    let exponent = exponent.parse().unwrap_or(0_i64);
    let fraction = digits.split_once('.').map_or(0, |(_, fraction)| fraction.len() as i64);
    fraction.saturating_sub(exponent).clamp(0, DECIMALS_MAX as i64) as usize
}

/// The number of a literal in its own unit, given by its factor to SI. `what` begins the complaint about another dimension:
/// "wanted", or the thing that has the dimension.
///
/// # Errors
/// If its unit is unknown or of another dimension, or if it is too large.
pub(super) fn in_unit(
    literal: &ast::Number,
    dimension: Dimension,
    own: Rational,
    what: &str,
) -> Result<f64, Diagnostic> {
    let (found, factor) = match &literal.unit {
        None => (Dimension::RATIO, Rational::ONE),
        Some(word) => {
            let unit = units::unit(&word.text).ok_or_else(|| unknown_unit(word))?;
            (unit.dimension, unit.factor())
        }
    };
    if found != dimension {
        let message = format!("unit mismatch: {what} `{dimension}`, found `{found}`");
        let error = Diagnostic::error(code::UNIT_MISMATCH, message);
        let error = error.at(literal.span, format!("this is `{found}`"));
        return Err(error.help_if(number_help("", literal, dimension)));
    }
    let value = if factor == own {
        // The text is parsed as `f64` directly, so that the value is the same to the last bit.
        literal.digits.parse::<f64>().ok().filter(|value| value.is_finite())
    } else {
        let digits = Rational::from_literal(&literal.digits);
        digits.and_then(|digits| digits.checked_mul(factor)?.checked_div(own)).map(Rational::to_f64)
    };
    let too_large = || Diagnostic::error(code::NUMBER, "the number is too large").at(literal.span, "");
    value.ok_or_else(too_large)
}
