//! Manoeuvres: parameters, phases, and how spawns and orders name them.

use crate::check::checker::{Checker, docs, each};
use crate::check::expression::Place;
use crate::check::references::Symbol;
use crate::check::report::{Report, field};
use crate::model::vocabulary::{Fact, PhaseField, Site, Word};
use crate::model::{ManoeuvreCall, ManoeuvreDef, PhaseDef, Type, code};
use crate::syntax::ast::ItemKind;
use crate::syntax::{Diagnostic, ast};
use avastra_base::units::Dimension;

const DURATION: Type = Type::Quantity(Dimension::DURATION);

/// Largest number of phases of a manoeuvre.
const PHASES_MAX: usize = 100;

impl Checker {
    /// Notes the names that actions give to what they spawn. Phases, orders and rules may stand before them.
    pub(super) fn declare_bearers(&mut self, items: &[&ast::Item]) {
        let effects = each(items, ItemKind::as_action).flat_map(|(_, action)| &action.effects);
        for effect in effects {
            let ast::EffectKind::Spawn { bearer: Some(name), .. } = &effect.kind else { continue };
            if Fact::ALL.iter().any(|fact| fact.name().split('.').next() == Some(name.text.as_str())) {
                let message = format!("`{}` cannot be the name of a road user", name.text);
                let error = Diagnostic::error(code::NOT_HERE, message);
                self.report(error.at(name.span, "the engine's own word").help("choose another name"));
            } else if !self.bearers.contains(&name.text) {
                self.bearers.push(name.text.clone());
            }
        }
    }

    pub(super) fn declare_manoeuvres(&mut self, items: &[&ast::Item]) {
        let (names, declared) = self.declared("manoeuvre", items, ItemKind::as_manoeuvre);
        self.manoeuvre_names = names;
        for (item, manoeuvre) in declared {
            let found = self.manoeuvre(item, manoeuvre);
            self.manoeuvres.push(found);
        }
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
                    declared.phases.iter().for_each(|phase| drop(checker.phase(phase, &place)));
                };
                self.quietly(look);
                return None;
            }
        };
        let phases: Vec<PhaseDef> = phases.into_iter().collect::<Option<_>>()?;
        Some(ManoeuvreDef { name: declared.name.text.clone(), docs: docs(item), parameters, phases })
    }

    fn phase(&mut self, declared: &ast::Phase, place: &Place<'_>) -> Option<PhaseDef> {
        let mut all = true;
        let mut part = |checker: &mut Checker, expr: Option<&ast::Expr>, ty: Type| {
            let found = expr.map(|expr| checker.typed(expr, place, ty));
            all &= !matches!(found, Some(None));
            found.flatten()
        };
        let once = part(self, declared.once.as_ref(), Type::Bool);
        let within = part(self, declared.within.as_ref(), DURATION);
        let after = part(self, declared.after.as_ref(), DURATION);
        self.note_fields::<PhaseField>(&declared.fields, place);
        let fields = self.fields_known(&declared.fields);
        let speed = part(self, field(&fields, PhaseField::Speed), Type::Quantity(Dimension::SPEED));
        let rate = part(self, field(&fields, PhaseField::Rate), Type::Quantity(Dimension::ACCEL));
        if field(&fields, PhaseField::Speed).is_none() {
            let message = "the phase does not say how fast".to_owned();
            return self.missing_field(PhaseField::Speed, declared.span, message);
        }
        if let (Some(within), None) = (&declared.within, &declared.once) {
            let error =
                Diagnostic::error(code::NOT_HERE, "`within` limits how long a phase waits for its `once`");
            return self.reject(
                error.at(within.span, "without a `once`").help("write `after` for a time that passes"),
            );
        }
        let speed = speed.filter(|_| all)?;
        Some(PhaseDef { once, within, after, speed, rate })
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
