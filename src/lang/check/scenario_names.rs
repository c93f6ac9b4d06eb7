//! The names in scenarios and policies.
//!
//! Every place in them takes one kind of name and literal values only, so the names are known from the declarations alone.
//! A scenario over a broken space, or a policy with a broken seal, has them all the same.

use crate::check::expression::enum_of;
use crate::check::references::{References, Symbol};
use crate::model::Type;
use crate::model::vocabulary::{BREACHED, Fact, KEPT, RECURRENCE, ScenarioClaim, StartField, WAIT};
use crate::syntax::ast;
use crate::syntax::ast::{Expr, ExprKind, Field, ItemKind, Name};

/// Notes the names in the scenarios and policies of a file.
pub(super) fn note(file: &ast::File, references: &mut References) {
    for item in &file.items {
        match &item.kind {
            ItemKind::Scenario(scenario) => references.note_scenario(scenario),
            ItemKind::Policy(policy) => references.note_policy(policy),
            _ => {}
        }
    }
}

impl References {
    fn note_scenario(&mut self, scenario: &ast::Scenario) {
        self.note_origin(&scenario.origin);
        self.uses(scenario.road.span, Symbol::Road(scenario.road.text.clone()));
        scenario.start.iter().for_each(|field| self.note_start(field));
        for step in &scenario.steps {
            self.note_call(&step.action);
            for field in &step.drawn {
                self.note_argument(&step.action.name.text, &field.name, &field.value);
            }
            step.once
                .iter()
                .chain(&step.held)
                .chain(&step.after)
                .for_each(|clause| self.note_value(clause, None));
        }
        for expect in &scenario.expects {
            self.note_claim(&expect.claim);
            expect.clauses.iter().for_each(|clause| self.note_value(&clause.value, None));
        }
    }

    fn note_policy(&mut self, policy: &ast::Policy) {
        self.note_origin(&policy.origin);
        for line in &policy.rules {
            line.condition.iter().for_each(|condition| self.note_condition(condition));
            line.actions.iter().for_each(|action| self.note_call(action));
        }
    }

    fn note_origin(&mut self, fields: &[Field]) {
        for field in fields {
            let symbol = match field.name.text.as_str() {
                "with" | "without" => Symbol::Rule,
                "roads" => Symbol::Road,
                _ => continue,
            };
            let ExprKind::List(items) = &field.value.kind else { continue };
            for item in items {
                if let ExprKind::Name(name) = &item.kind {
                    self.uses(item.span, symbol(name.clone()));
                }
            }
        }
    }

    /// `time: Noon`, `sky: { Rain: High }`.
    fn note_start(&mut self, field: &Field) {
        let symbol = Symbol::State(field.name.text.clone());
        let (key, ty) = self.declaration(&symbol).map_or((None, None), |state| (state.key, state.ty));
        self.uses(field.name.span, symbol);
        self.word_named::<StartField>(field.name.span, &field.name.text);
        match (&field.value.kind, key) {
            (ExprKind::Record(cells), Some(key)) => {
                for cell in cells {
                    self.variant(&cell.name, Some(key.0));
                    self.note_value(&cell.value, ty);
                }
            }
            _ => self.note_value(&field.value, ty),
        }
    }

    /// An action with values of its axes, by name or in their order.
    fn note_call(&mut self, call: &ast::Call) {
        let action = Symbol::Action(call.name.text.clone());
        let parts = self.declaration(&action).map(|action| action.parts.clone()).unwrap_or_default();
        let axes = parts.iter().filter_map(|part| self.declaration(part).filter(|part| part.axis));
        let types: Vec<Option<Type>> = axes.map(|axis| axis.ty).collect();
        self.uses(call.name.span, action);
        if call.name.text == WAIT.0 {
            self.note(call.name.span, Symbol::Engine(WAIT.0, WAIT.1), false);
        }
        for (index, argument) in call.args.iter().enumerate() {
            match &argument.name {
                Some(name) => self.note_argument(&call.name.text, name, &argument.value),
                None => self.note_value(&argument.value, types.get(index).copied().flatten()),
            }
        }
    }

    fn note_argument(&mut self, action: &str, name: &Name, value: &Expr) {
        let symbol = Symbol::Parameter(action.to_owned(), name.text.clone());
        let ty = self.declaration(&symbol).and_then(|parameter| parameter.ty);
        self.uses(name.span, symbol);
        self.note_value(value, ty);
    }

    /// A literal of a type, if the type is known.
    fn note_value(&mut self, value: &Expr, ty: Option<Type>) {
        match &value.kind {
            ExprKind::Number(number) => self.number(number),
            ExprKind::Name(name) => self.variant(&Name::new(name.clone(), value.span), enum_of(ty)),
            ExprKind::Unary { operand, .. } => self.note_value(operand, ty),
            ExprKind::List(items) => items.iter().for_each(|item| self.note_value(item, ty)),
            _ => {}
        }
    }

    /// `collision`, `counted`, `end == arrived`, `proc == [0.5]`.
    fn note_claim(&mut self, claim: &Expr) {
        match &claim.kind {
            ExprKind::Name(name) => {
                self.uses(claim.span, Symbol::Verdict(name.clone()));
                self.word_named::<ScenarioClaim>(claim.span, name);
                self.word_named::<Fact>(claim.span, name);
            }
            ExprKind::Field { base, field } => {
                if let ExprKind::Name(name) = &base.kind {
                    self.uses(base.span, Symbol::Requirement(name.clone()));
                }
                if let Some((word, meaning)) =
                    [BREACHED, KEPT, RECURRENCE].into_iter().find(|(word, _)| *word == field.text)
                {
                    self.note(field.span, Symbol::Engine(word, meaning), false);
                }
            }
            ExprKind::Binary { left, right, .. } => {
                self.note_claim(left);
                self.note_value(right, None);
            }
            _ => {}
        }
    }

    /// `ego_speed > 8 m/s and time == Night`: variables of the engine and their values.
    fn note_condition(&mut self, condition: &Expr) {
        match &condition.kind {
            ExprKind::Binary { left, right, .. } => {
                self.note_condition(left);
                self.note_condition(right);
            }
            _ => self.note_value(condition, None),
        }
    }
}
