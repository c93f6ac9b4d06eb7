//! Bodies of the author's own, and what a spawn calls a body.

use crate::check::checker::Checker;
use crate::check::declaration::unknown_word;
use crate::check::expression::Place;
use crate::check::mistakes::{Report, field};
use crate::check::names::docs;
use crate::check::names::unknown;
use crate::check::references::Symbol;
use crate::model::body::{Changes, parameters};
use crate::model::vocabulary::{Body, BodyClass, BodyField, Word};
use crate::model::{BodyDef, BodyWord, Type, WordExpr, code};
use crate::syntax::ast::{ItemKind, Span};
use crate::syntax::{Diagnostic, ast, nearest};
use avastra_base::units::{Dimension, quantity_short};

const KG_PER_T: f64 = 1000.0;

impl BodyField {
    /// The range of a number: its dimension, and both ends in SI. `None` for a field without a number.
    pub fn range(self) -> Option<(Dimension, f64, f64)> {
        Some(match self {
            BodyField::Like => return None,
            BodyField::Length => (Dimension::LENGTH, 0.3, 20.0),
            BodyField::Width => (Dimension::LENGTH, 0.3, 3.0),
            BodyField::Height => (Dimension::LENGTH, 0.3, 4.5),
            BodyField::Wheelbase => (Dimension::LENGTH, 0.3, 15.0),
            BodyField::Mass => (Dimension::MASS, 0.1, 40_000.0),
            BodyField::Acceleration => (Dimension::ACCEL, 0.5, 8.0),
            BodyField::Deceleration => (Dimension::ACCEL, 1.0, 12.0),
        })
    }
}

impl Checker {
    pub(super) fn declare_bodies(&mut self, items: &[&ast::Item]) {
        for (item, declared) in self.declared("body", items, ItemKind::as_body).1 {
            let body = self.body(item, declared);
            self.bodies.extend(body);
        }
    }

    pub(super) fn body(&mut self, item: &ast::Item, declared: &ast::Block) -> Option<BodyDef> {
        self.note_fields(&declared.fields, BodyField::ALL, &Place::default());
        let fields = self.fields_known::<BodyField>(&declared.fields);
        let name = &declared.name;
        if Body::from_name(&name.text).is_some() || BodyClass::from_name(&name.text).is_some() {
            let message = format!("the engine has a body `{}` already", name.text);
            let error = Diagnostic::error(code::DUPLICATE, message).at(name.span, "declared again");
            self.report(error.help("give yours another name"));
        }
        let like = match field(&fields, BodyField::Like) {
            Some(like) => self.engine_body(like),
            None => {
                let lacks = format!("`{}` does not say what it is like", name.text);
                self.missing_field(BodyField::Like, name.span, lacks)
            }
        };
        let mut number = |wanted| self.body_number(&fields, wanted);
        let changes = Changes {
            length_m: number(BodyField::Length),
            width_m: number(BodyField::Width),
            height_m: number(BodyField::Height),
            wheelbase_m: number(BodyField::Wheelbase),
            mass_t: number(BodyField::Mass).map(|mass_kg| mass_kg / KG_PER_T),
            acceleration_mps2_max: number(BodyField::Acceleration),
            deceleration_mps2_max: number(BodyField::Deceleration),
        };
        let like = like?;
        let shape = parameters(like).changed(&changes);
        if let Some(wheelbase) = field(&fields, BodyField::Wheelbase)
            && (!like.is_vehicle() || shape.wheelbase_m >= shape.length_m)
        {
            let error = Diagnostic::error(code::SETTING, "this wheelbase is not possible");
            self.report(match like.is_vehicle() {
                false => error.at(wheelbase.span, format!("a `{}` has no axles", like.name())),
                true => {
                    let length = quantity_short(shape.length_m, Dimension::LENGTH);
                    error.at(wheelbase.span, format!("the whole body is {length} long"))
                }
            });
        }
        Some(BodyDef { name: name.text.clone(), docs: docs(item), like, shape, span: name.span })
    }

    /// The body of the engine that an expression names.
    fn engine_body(&mut self, expr: &ast::Expr) -> Option<Body> {
        let Some(name) = self.name_of(expr, "a body of the engine") else {
            self.look_at(expr, &Place::default(), None);
            return None;
        };
        let found = Body::from_name(name);
        found.into_iter().for_each(|body| self.references.word(expr.span, body));
        found.or_else(|| self.reject(unknown_word("body", name, Body::names(), expr.span)))
    }

    /// A number of a body in SI; `None` if it is not given, or broken.
    fn body_number(&mut self, fields: &[(BodyField, &ast::Expr)], wanted: BodyField) -> Option<f64> {
        let value = field(fields, wanted)?;
        let (dimension, low, high) = wanted.range()?;
        let expr = self.typed(value, &Place::default(), Type::Quantity(dimension))?;
        let number = self.fold_number(&expr)?.to_f64();
        if (low..=high).contains(&number) {
            return Some(number);
        }
        let shown = |number: f64| quantity_short(number, dimension);
        let message = format!("a {} of {} is not possible", wanted.name(), shown(number));
        let error = Diagnostic::error(code::SETTING, message);
        self.reject(error.at(value.span, format!("must lie within {} .. {}", shown(low), shown(high))))
    }

    /// Reads the body of a spawn: a word of the engine, a body that the author declared, or an expression of an enum whose
    /// variants are such words.
    pub(super) fn body_word(&mut self, expr: &ast::Expr, place: &Place<'_>) -> Option<WordExpr<BodyWord>> {
        let known = |checker: &Checker, name: &str, span| {
            checker.body_named(name).ok_or_else(|| unknown_body(name, span))
        };
        self.word_or_enum("body", expr, place, known, Checker::note_body)
    }

    pub(super) fn body_named(&self, name: &str) -> Option<BodyWord> {
        let own = self.bodies.iter().position(|body| body.name == name);
        let like = own.map(|own| self.bodies[own].like).or_else(|| Body::from_name(name))?;
        Some(BodyWord { like, own })
    }

    /// The bodies that a name in a list stands for: one, or all of a class.
    pub(super) fn bodies_named(&mut self, name: &str, span: Span) -> Option<Vec<BodyWord>> {
        if let Some(body) = self.body_named(name) {
            self.note_body(span, name);
            return Some(vec![body]);
        }
        if let Some(class) = BodyClass::from_name(name) {
            self.references.note(span, Symbol::Engine(class.name(), class.meaning()), false);
            let held = Body::ALL.iter().copied().filter(|body| class.holds(*body));
            return Some(held.map(BodyWord::engine).collect());
        }
        let names =
            Body::names().chain(BodyClass::names()).chain(self.bodies.iter().map(|body| body.name.as_str()));
        let error = unknown("body", name, span, names);
        self.reject(error)
    }

    fn note_body(&mut self, span: Span, name: &str) {
        self.references.uses(span, Symbol::Body(name.to_owned()));
        self.references.word_named::<Body>(span, name);
    }

    /// The body as its author calls it.
    pub(super) fn body_name(&self, body: BodyWord) -> String {
        body.own.map_or_else(|| body.like.name().to_owned(), |own| self.bodies[own].name.clone())
    }
}

/// A body that neither the engine nor the author has.
fn unknown_body(name: &str, span: Span) -> Diagnostic {
    let error = unknown_word("body", name, Body::names(), span);
    match nearest(name, Body::names()) {
        Some(_) => error,
        None => error
            .note(format!("one of your own is declared so: `body {name} {{ like: Sedan, width: 0.8 m }}`")),
    }
}
