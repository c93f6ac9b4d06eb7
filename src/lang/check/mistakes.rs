//! Helpers of every check: reporting a mistake and going on, and reading the fields of a block.

use crate::check::names::{Names, unknown};
use crate::model::code;
use crate::model::vocabulary::Word;
use crate::syntax::ast::{Field, Name, Span};
use crate::syntax::{Diagnostic, ast, print_expr};
use avastra_base::units::Rational;

/// A check that collects mistakes and goes on after each.
pub(super) trait Report {
    fn report(&mut self, diagnostic: Diagnostic);

    /// Reports why there is no value.
    fn reject<T>(&mut self, diagnostic: Diagnostic) -> Option<T> {
        self.report(diagnostic);
        None
    }

    /// The value, or `None` once its mistake is reported.
    fn take<T>(&mut self, value: Result<T, Diagnostic>) -> Option<T> {
        value.map_err(|error| self.report(error)).ok()
    }

    /// The name that an expression is. Reports anything else; `wanted` says of what, for example `a rule`.
    fn name_of<'a>(&mut self, expr: &'a ast::Expr, wanted: &str) -> Option<&'a str> {
        let ast::ExprKind::Name(name) = &expr.kind else {
            let error = Diagnostic::error(code::TYPE_MISMATCH, format!("wanted {wanted}"));
            return self.reject(error.at(expr.span, "not a name"));
        };
        Some(name)
    }

    /// Reports every name that stands twice.
    fn once<'a>(&mut self, kind: &str, names: impl IntoIterator<Item = &'a Name>) {
        let mut known = Names::default();
        for name in names {
            self.take(known.declare(kind, name));
        }
    }

    /// Reports every field that stands twice.
    fn fields_once(&mut self, kind: &str, fields: &[Field]) {
        self.once(kind, fields.iter().map(|field| &field.name));
    }

    /// The fields of a block with their values. Reports every field that stands twice or that the block
    /// does not have.
    fn fields_known<'a, W: Word>(&mut self, fields: &'a [Field]) -> Vec<(W, &'a ast::Expr)> {
        self.fields_among(fields, W::ALL)
    }

    /// The same of a block that has only some of these fields.
    fn fields_among<'a, W: Word>(&mut self, fields: &'a [Field], among: &[W]) -> Vec<(W, &'a ast::Expr)> {
        self.fields_once("field", fields);
        let mut known = Vec::new();
        for Field { name, value, .. } in fields {
            match W::from_name(&name.text).filter(|word| among.contains(word)) {
                Some(word) => known.push((word, value)),
                None => {
                    let names = among.iter().map(|word| word.name());
                    self.report(unknown("field", &name.text, name.span, names));
                }
            }
        }
        known
    }

    /// The slot of an argument: by its name, else by its position. Reports an argument without a slot, and an argument
    /// whose slot is `given` already.
    fn slot(
        &mut self,
        call: &ast::Call,
        position: usize,
        names: &[&str],
        given: &mut [Option<Span>],
    ) -> Option<usize> {
        let ast::Arg { name, value } = &call.args[position];
        let found = match name {
            Some(name) => names.iter().position(|known| *known == name.text),
            None => Some(position).filter(|position| *position < names.len()),
        };
        let Some(slot) = found else {
            return self.reject(match name {
                Some(name) => unknown("argument", &name.text, name.span, names.iter().copied()),
                None => {
                    let message = format!("`{}` takes {} arguments", call.name.text, names.len());
                    Diagnostic::error(code::ARGUMENTS, message).at(value.span, "one too many")
                }
            });
        };
        let Some(first) = given[slot].replace(value.span) else { return Some(slot) };
        let message = format!("`{}` is given twice", names[slot]);
        let error = Diagnostic::error(code::DUPLICATE, message).at(value.span, "again here");
        self.reject(error.beside(first, "first here").help("remove one of them"))
    }

    /// Reports that a block lacks a field which it needs.
    fn missing_field<T>(&mut self, field: impl Word, span: Span, message: String) -> Option<T> {
        let error = Diagnostic::error(code::MISSING_FIELD, message);
        self.reject(error.at(span, format!("`{}: …` is missing", field.name())))
    }
}

/// An expression as it is written, and its value beside it where that does not show.
pub(super) fn with_value(expr: &ast::Expr, value: Rational, unit: &str) -> String {
    let written = print_expr(expr);
    match expr.kind {
        ast::ExprKind::Number(_) => format!("`{written}`"),
        _ => format!("`{written}` ({} {unit})", value.to_f64()),
    }
}

/// All of them, or `None` if one is missing. Each is looked at, so that every mistake is reported and not just the first.
pub(super) fn all_of<T>(found: impl Iterator<Item = Option<T>>) -> Option<Vec<T>> {
    let found: Vec<Option<T>> = found.collect();
    found.into_iter().collect()
}

/// The written value, or nothing where the file has none; `None` if it is broken.
pub(super) fn as_written<T>(found: Option<Option<T>>) -> Option<Option<T>> {
    match found {
        Some(found) => found.map(Some),
        None => Some(None),
    }
}

/// The value of the first field of that name.
pub(super) fn field<'a, W: Word>(fields: &[(W, &'a ast::Expr)], wanted: W) -> Option<&'a ast::Expr> {
    fields.iter().find(|(field, _)| *field == wanted).map(|(_, value)| *value)
}
