//! Manoeuvres: what a vehicle is told, phase by phase, and how spawns and orders name manoeuvres.

use core::ops::RangeInclusive;

use crate::check::checker::Checker;
use crate::check::expression::Place;
use crate::check::mistakes::{Report, as_written, field};
use crate::check::names::docs;
use crate::check::references::Symbol;
use crate::model::command::{CommandDef, Told};
use crate::model::expr::{Expr, ExprKind};
use crate::model::vocabulary::{CHANGE, Field, Site, Word};
use crate::model::{ManoeuvreCall, ManoeuvreDef, PhaseDef, REPEAT, Type, code, reached, told};
use crate::syntax::ast::{ItemKind, Span};
use crate::syntax::{Diagnostic, ast};
use avastra_base::units::Dimension;

const DURATION: Type = Type::Quantity(Dimension::DURATION);

/// Times that a phase waits, s.
const TIME_S: RangeInclusive<f64> = 0.0..=f64::INFINITY;

/// Largest number of phases of a manoeuvre.
const PHASES_MAX: usize = 100;

/// Most manoeuvres that hand over one to another.
const HAND_OVERS_MAX: usize = 100;

/// Above this many manoeuvres that lead to no end, one message stands for all.
const CIRCLES_MAX: usize = 100;

impl Checker {
    pub(super) fn declare_manoeuvres(&mut self, items: &[&ast::Item]) {
        let (names, declared) = self.declared("manoeuvre", items, ItemKind::as_manoeuvre);
        self.manoeuvre_names = names;
        self.manoeuvres = vec![None; declared.len()];
        for index in self.by_hand_over(&declared) {
            let (item, manoeuvre) = declared[index];
            if manoeuvre.name.text == CHANGE.0 {
                let message = format!("`{}` cannot be the name of a manoeuvre", CHANGE.0);
                let error = Diagnostic::error(code::NOT_HERE, message);
                let error = error.at(manoeuvre.name.span, "`during change` means lane changes");
                self.report(error.help("choose another name"));
            }
            self.manoeuvres[index] = self.manoeuvre(item, manoeuvre);
        }
    }

    /// The manoeuvres, each after those to which it hands over. Reports those that come back to themselves, and leaves them
    /// out.
    fn by_hand_over(&mut self, declared: &[(&ast::Item, &ast::Manoeuvre)]) -> Vec<usize> {
        let next: Vec<Vec<(usize, Span)>> = declared
            .iter()
            .map(|(_, manoeuvre)| {
                let fields = manoeuvre.phases.iter().flat_map(|phase| &phase.fields);
                let then = fields.filter(|field| field.name.text == Field::Then.name());
                let calls = then.filter_map(|field| match &field.value.kind {
                    ast::ExprKind::Call(call) => {
                        Some((self.manoeuvre_names.get(&call.name.text)?, call.span))
                    }
                    _ => None,
                });
                calls.collect()
            })
            .collect();
        // Rounds, in each of which those come whose next ones have come.
        let mut order: Vec<usize> = Vec::new();
        let mut has_come = vec![false; declared.len()];
        for _ in 0..HAND_OVERS_MAX {
            let is_due =
                |index: &usize| !has_come[*index] && next[*index].iter().all(|(next, _)| has_come[*next]);
            let due: Vec<usize> = (0..declared.len()).filter(is_due).collect();
            if due.is_empty() {
                break;
            }
            due.iter().for_each(|index| has_come[*index] = true);
            order.extend(due);
        }
        let reaches = |from: usize, to: usize| {
            let (mut found, mut looked) = (vec![from], 0);
            while let Some(one) = found.get(looked).copied() {
                looked += 1;
                let fresh = next[one].iter().map(|(next, _)| *next).filter(|next| !found.contains(next));
                let fresh: Vec<usize> = fresh.collect();
                found.extend(fresh);
            }
            found.contains(&to)
        };
        // Each manoeuvre left is part of a circle, leads to a circle, or hands over too often.
        let left: Vec<usize> = (0..declared.len()).filter(|index| !has_come[*index]).collect();
        if let Some(first) = left.first().filter(|_| left.len() > CIRCLES_MAX) {
            let message = format!("{} manoeuvres hand over more than {HAND_OVERS_MAX} times", left.len());
            let error = Diagnostic::error(code::TOO_MUCH, message);
            self.report(error.at(declared[*first].1.name.span, "the first of them, or in a circle"));
            return order;
        }
        for index in left {
            let Some((_, span)) = next[index].iter().find(|(next, _)| reaches(*next, index)) else {
                if let Some((_, span)) = next[index].iter().find(|(next, _)| !has_come[*next]) {
                    let message = format!("`{}` leads to no end", declared[index].1.name.text);
                    let error = Diagnostic::error(code::TOO_MUCH, message);
                    let most = format!("at most {HAND_OVERS_MAX} hand over one to another, in no circle");
                    self.report(error.at(*span, most));
                }
                continue;
            };
            let message = format!("`{}` comes back to itself", declared[index].1.name.text);
            let error =
                Diagnostic::error(code::RECURSION, message).at(*span, "by this, or by what follows it");
            self.report(error.help("write `repeat N` for phases that come several times"));
        }
        order
    }

    /// A manoeuvre, and all to which it hands over.
    pub(super) fn reached(&self, manoeuvre: usize) -> Vec<usize> {
        reached(manoeuvre, |index| self.manoeuvres.get(index)?.as_ref())
    }

    pub(super) fn manoeuvre(&mut self, item: &ast::Item, declared: &ast::Manoeuvre) -> Option<ManoeuvreDef> {
        let owner = Symbol::Manoeuvre(declared.name.text.clone());
        if !self.has_few_parameters(&declared.name, declared.params.len()) {
            return None;
        }
        if declared.phases.is_empty() || declared.phases.len() > PHASES_MAX {
            let message = format!("`{}` has {} phases", declared.name.text, declared.phases.len());
            let code = if declared.phases.is_empty() { code::NO_EFFECT } else { code::TOO_MUCH };
            let error = Diagnostic::error(code, message).at(declared.name.span, "");
            self.report(
                error.help(format!("give it 1 to {PHASES_MAX}, such as `after 3 s {{ speed: 0 m/s }}`")),
            );
        }
        self.once("parameter", declared.params.iter().map(|parameter| &parameter.name));
        let types: Vec<Option<Type>> = declared.params.iter().map(|p| self.plain_type(&p.ty)).collect();
        for (parameter, ty) in declared.params.iter().zip(&types) {
            if let (Some(symbol), Some(ty)) = (owner.parameter(&parameter.name.text), ty) {
                self.references.typed(&symbol, *ty, None);
            }
        }
        // A broken type passes for a truth value, so that the phases are checked for their names.
        let is_whole = types.iter().all(Option::is_some);
        let named = declared.params.iter().zip(types);
        let parameters: Vec<(String, Type)> =
            named.map(|(p, ty)| (p.name.text.clone(), ty.unwrap_or(Type::Bool))).collect();
        let place = Place { locals: &parameters, owner: Some(&owner), site: Site::Phase, ..Place::default() };
        let phases: Vec<Option<PhaseDef>> = match is_whole {
            true => declared.phases.iter().map(|phase| self.phase(phase, &place)).collect(),
            false => {
                let look = |checker: &mut Checker| {
                    drop(checker.repeat(declared, &parameters, &owner));
                    declared.phases.iter().for_each(|phase| drop(checker.phase(phase, &place)));
                };
                self.quietly(look);
                return None;
            }
        };
        let repeat = self.repeat(declared, &parameters, &owner);
        let hands_over = |phase: &Option<PhaseDef>| {
            phase.as_ref().is_some_and(|phase| phase.then.is_some() && phase.only_if.is_none())
        };
        if let Some(at) = phases.iter().position(hands_over).filter(|at| at + 1 < phases.len()) {
            let error = Diagnostic::error(code::NEVER_REACHED, "the phases after this one never come");
            let error = error.at(declared.phases[at].span, "it hands over to another manoeuvre");
            self.report(error.help("leave them out, or write `if …` before its fields"));
        }
        let never_ends = |phase: &Option<PhaseDef>| phase.as_ref().is_some_and(PhaseDef::never_ends);
        for (at, pair) in declared.phases.windows(2).enumerate().filter(|(at, _)| never_ends(&phases[*at])) {
            if pair[1].once.is_none() {
                let error = Diagnostic::error(code::NEVER_REACHED, "this phase never comes");
                let error = error.at(pair[1].span, "waits for the end of the one before");
                let error = error.beside(declared.phases[at].span, "`continuous`: it does not end by itself");
                self.report(error.help("say when with `once …`"));
            }
        }
        let phases: Vec<PhaseDef> = phases.into_iter().collect::<Option<_>>()?;
        let name = declared.name.text.clone();
        Some(ManoeuvreDef { name, docs: docs(item), parameters, repeat: repeat?, phases })
    }

    /// How often a manoeuvre goes through its phases. It is known before the first one, so it asks for no moment.
    fn repeat(
        &mut self,
        declared: &ast::Manoeuvre,
        parameters: &[(String, Type)],
        owner: &Symbol,
    ) -> Option<Option<Expr>> {
        let Some(written) = &declared.repeat else { return Some(None) };
        let place = Place { locals: parameters, owner: Some(owner), ..Place::default() };
        let times = self.typed(written, &place, Type::Int)?;
        if self.written_out(&times).is_some_and(|count| !REPEAT.contains(&count)) {
            let (low, high) = (REPEAT.start(), REPEAT.end());
            let message = format!("a manoeuvre is repeated {low} to {high} times");
            let error = Diagnostic::error(code::OUT_OF_BOUNDS, message);
            return self.reject(error.at(written.span, format!("must lie within {low} .. {high}")));
        }
        Some(Some(times))
    }

    fn phase(&mut self, declared: &ast::Phase, place: &Place<'_>) -> Option<PhaseDef> {
        let mut all = true;
        let mut part = |checker: &mut Checker, expr: Option<&ast::Expr>, ty: Type| {
            let found = expr.map(|expr| checker.typed(expr, place, ty));
            all &= !matches!(found, Some(None));
            found.flatten()
        };
        let once = part(self, declared.once.as_ref(), Type::Bool);
        let held = part(self, declared.held.as_ref(), DURATION);
        let within = part(self, declared.within.as_ref(), DURATION);
        let after = part(self, declared.after.as_ref(), DURATION);
        let only_if = part(self, declared.only_if.as_ref(), Type::Bool);
        let among = Field::of_orders();
        self.note_fields(&declared.fields, &among, place);
        let fields = self.fields_among(&declared.fields, &among);
        let then = match field(&fields, Field::Then) {
            Some(value) => match self.manoeuvre_call(value, place) {
                Some(call) => Some(call),
                None => return self.no_manoeuvre(value, place),
            },
            None => None,
        };
        let command = self.command(&fields, place);
        if let Some(command) = &command {
            for figure in command.figures() {
                self.check_figure(figure.expr, figure.field.name(), figure.unit.name, &figure.unit.bounds);
            }
        }
        for (expr, name) in [(&held, "for"), (&within, "within"), (&after, "after")] {
            expr.iter().for_each(|expr| self.check_figure(expr, name, "s", &TIME_S));
        }
        let waits = declared.fields.is_empty() && (declared.once.is_some() || declared.after.is_some());
        let tells_nothing = command.as_ref().is_some_and(CommandDef::is_empty);
        if tells_nothing && then.is_none() && !waits {
            // A misspelt field was reported.
            if fields.len() < declared.fields.len() {
                return None;
            }
            let message = "the phase tells the vehicle nothing".to_owned();
            return self.missing_field(Field::Speed, declared.span, message);
        }
        if let (Some(within), None) = (&declared.within, &declared.once) {
            let error =
                Diagnostic::error(code::NOT_HERE, "`within` limits how long a phase waits for its `once`");
            return self.reject(
                error.at(within.span, "without a `once`").help("write `after` for a time that passes"),
            );
        }
        let command = command.filter(|_| all)?;
        Some(PhaseDef { once, held, within, after, only_if, command, then: as_written(then)? })
    }

    /// Reports a figure of a phase that is written out and lies out of bounds. A computed figure is brought into them later.
    fn check_figure(&mut self, expr: &Expr, name: &str, unit: &str, bounds: &RangeInclusive<f64>) {
        if self.written_out(expr).is_some_and(|value| !bounds.contains(&value)) {
            let message = format!("the `{name}` of a phase lies out of bounds");
            let range = match bounds.end().is_finite() {
                true => format!("must lie within {} .. {} {unit}", bounds.start(), bounds.end()),
                false => format!("must be at least {} {unit}", bounds.start()),
            };
            self.report(Diagnostic::error(code::OUT_OF_BOUNDS, message).at(expr.span, range));
        }
    }

    /// The value of an expression that is written out in numbers.
    fn written_out(&mut self, expr: &Expr) -> Option<f64> {
        let is_open = |kind: &ExprKind| {
            !matches!(kind, ExprKind::Number(_) | ExprKind::Negate(_) | ExprKind::Arithmetic(..))
        };
        let value = (!expr.any(is_open)).then(|| self.quietly(|checker| checker.fold_number(expr)))??;
        Some(value.to_f64())
    }

    /// The fields that the phases of a manoeuvre tell; none, if it is broken.
    pub(super) fn told(&self, manoeuvre: usize) -> Told {
        told(manoeuvre, |index| self.manoeuvres.get(index)?.as_ref())
    }

    /// Whether a phase of a manoeuvre has such a command.
    pub(super) fn has_command(&self, manoeuvre: usize, is_so: impl Fn(&CommandDef) -> bool) -> bool {
        let all = self.reached(manoeuvre);
        let mut phases = all.iter().flat_map(|one| &self.manoeuvres[*one]).flat_map(|one| &one.phases);
        phases.any(|phase| is_so(&phase.command))
    }

    /// `brake(4 m/s^2)` in the `then` of a spawn or an order; `None` if the value is no call. The inner `None` stands for a
    /// mistake, which is reported.
    pub(super) fn manoeuvre_call(
        &mut self,
        value: &ast::Expr,
        place: &Place<'_>,
    ) -> Option<Option<ManoeuvreCall>> {
        let ast::ExprKind::Call(call) = &value.kind else { return None };
        // A function may give `Keep` or `Change`.
        let name = &call.name.text;
        if self.manoeuvre_names.get(name).is_none() && self.function_names.get(name).is_some() {
            return None;
        }
        let symbol = Symbol::Manoeuvre(name.clone());
        self.references.uses(call.name.span, symbol.clone());
        let named = call.args.iter().filter_map(|argument| argument.name.as_ref());
        named.for_each(|name| self.references.uses_parameter(name, &symbol));
        let Some(manoeuvre) = self.manoeuvre_names.get(&call.name.text) else {
            self.look_at_arguments(&call.args, place);
            let names = self.manoeuvre_names.all();
            let mut error = self.unknown("manoeuvre", &call.name.text, call.name.span, names);
            let declare = || format!("declare it with `manoeuvre {}(…) {{ … }}`", call.name.text);
            error.help = error.help.or_else(|| Some(declare()));
            return Some(self.reject(error));
        };
        // A broken one was reported where it stands.
        let Some(definition) = self.manoeuvres.get(manoeuvre).and_then(Option::as_ref) else {
            self.look_at_arguments(&call.args, place);
            return Some(None);
        };
        let parameters = definition.parameters.clone();
        let arguments = self.arguments(call, &parameters, None, place);
        Some(arguments.map(|arguments| ManoeuvreCall { manoeuvre, arguments }))
    }
}
