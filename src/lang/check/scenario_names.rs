//! The names in scenarios and policies.
//!
//! Every place in them takes one kind of name and literal values only, so the names are known from the
//! declarations alone: a scenario over a broken space, or a policy with a broken seal, has them all the same.

use crate::check::expression::enum_of;
use crate::check::references::{References, Symbol};
use crate::model::Type;
use crate::model::vocabulary::{Fact, ScenarioClaim, StartField, WAIT};
use crate::syntax::ast;
use crate::syntax::ast::{Expr, ExprKind, Field, ItemKind, Name};

/// Notes the names in the scenarios and policies of a file.
pub(super) fn note(file: &ast::File, references: &mut References) {
    let mut notes = Notes { references };
    for item in &file.items {
        match &item.kind {
            ItemKind::Scenario(scenario) => notes.scenario(scenario),
            ItemKind::Policy(policy) => notes.policy(policy),
            _ => {}
        }
    }
}

struct Notes<'a> {
    references: &'a mut References,
}

impl Notes<'_> {
    fn scenario(&mut self, scenario: &ast::Scenario) {
        self.origin(&scenario.origin);
        self.references.uses(scenario.road.span, Symbol::Road(scenario.road.text.clone()));
        scenario.start.iter().for_each(|field| self.start(field));
        for step in &scenario.steps {
            self.call(&step.action);
            for field in &step.drawn {
                self.argument(&step.action.name.text, &field.name, &field.value);
            }
            step.once.iter().chain(&step.after).for_each(|clause| self.value(clause, None));
        }
        for expect in &scenario.expects {
            self.claim(&expect.claim);
            expect.clauses.iter().for_each(|clause| self.value(&clause.value, None));
        }
    }

    fn policy(&mut self, policy: &ast::Policy) {
        self.origin(&policy.origin);
        for line in &policy.rules {
            line.condition.iter().for_each(|condition| self.condition(condition));
            line.actions.iter().for_each(|action| self.call(action));
        }
    }

    fn origin(&mut self, fields: &[Field]) {
        for field in fields {
            let symbol = match field.name.text.as_str() {
                "with" | "without" => Symbol::Rule,
                "roads" => Symbol::Road,
                _ => continue,
            };
            let ExprKind::List(items) = &field.value.kind else { continue };
            for item in items {
                if let ExprKind::Name(name) = &item.kind {
                    self.references.uses(item.span, symbol(name.clone()));
                }
            }
        }
    }

    /// `time: Noon`, `sky: { Rain: High }`.
    fn start(&mut self, field: &Field) {
        let symbol = Symbol::State(field.name.text.clone());
        let (key, ty) =
            self.references.declaration(&symbol).map_or((None, None), |state| (state.key, state.ty));
        self.references.uses(field.name.span, symbol);
        self.references.word_named::<StartField>(field.name.span, &field.name.text);
        match (&field.value.kind, key) {
            (ExprKind::Record(cells), Some(key)) => {
                for cell in cells {
                    self.variant(&cell.name, Some(Type::Enum(key)));
                    self.value(&cell.value, ty);
                }
            }
            _ => self.value(&field.value, ty),
        }
    }

    /// An action with values of its axes, by name or in their order.
    fn call(&mut self, call: &ast::Call) {
        let action = Symbol::Action(call.name.text.clone());
        let parts =
            self.references.declaration(&action).map(|action| action.parts.clone()).unwrap_or_default();
        let axes = parts.iter().filter_map(|part| self.references.declaration(part).filter(|part| part.axis));
        let types: Vec<Option<Type>> = axes.map(|axis| axis.ty).collect();
        self.references.uses(call.name.span, action);
        if call.name.text == WAIT.0 {
            self.references.note(call.name.span, Symbol::Engine(WAIT.0, WAIT.1), false);
        }
        for (index, argument) in call.args.iter().enumerate() {
            match &argument.name {
                Some(name) => self.argument(&call.name.text, name, &argument.value),
                None => self.value(&argument.value, types.get(index).copied().flatten()),
            }
        }
    }

    fn argument(&mut self, action: &str, name: &Name, value: &Expr) {
        let symbol = Symbol::Parameter(action.to_owned(), name.text.clone());
        let ty = self.references.declaration(&symbol).and_then(|parameter| parameter.ty);
        self.references.uses(name.span, symbol);
        self.value(value, ty);
    }

    /// A literal of a type, if the type is known.
    fn value(&mut self, value: &Expr, ty: Option<Type>) {
        match &value.kind {
            ExprKind::Number(number) => self.references.number(number),
            ExprKind::Name(name) => self.variant(&Name::new(name.clone(), value.span), ty),
            ExprKind::Unary { operand, .. } => self.value(operand, ty),
            ExprKind::List(items) => items.iter().for_each(|item| self.value(item, ty)),
            _ => {}
        }
    }

    fn variant(&mut self, name: &Name, ty: Option<Type>) {
        self.references.variant(name, enum_of(ty));
    }

    /// `collision`, `counted`, `end == arrived`, `proc == [0.5]`.
    fn claim(&mut self, claim: &Expr) {
        match &claim.kind {
            ExprKind::Name(name) => {
                self.references.uses(claim.span, Symbol::Verdict(name.clone()));
                self.references.word_named::<ScenarioClaim>(claim.span, name);
                self.references.word_named::<Fact>(claim.span, name);
            }
            ExprKind::Binary { left, right, .. } => {
                self.claim(left);
                self.value(right, None);
            }
            _ => {}
        }
    }

    /// `ego_speed > 8 m/s and time == Night`: variables of the engine and their values.
    fn condition(&mut self, condition: &Expr) {
        match &condition.kind {
            ExprKind::Binary { left, right, .. } => {
                self.condition(left);
                self.condition(right);
            }
            _ => self.value(condition, None),
        }
    }
}
