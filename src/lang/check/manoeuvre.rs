//! Orders and manoeuvres: what a vehicle is told, phase by phase, and how spawns and orders name manoeuvres.

use core::ops::RangeInclusive;

use crate::check::checker::{Checker, each};
use crate::check::expression::Place;
use crate::check::names::docs;
use crate::check::references::Symbol;
use crate::check::report::{Report, all_of, as_written, field};
use crate::model::command::{CommandDef, Moves, Told};
use crate::model::expr::{Expr, ExprKind, Who};
use crate::model::field::{Fields, Kind, Term, Unit};
use crate::model::vocabulary::{Body, CHANGE, Fact, Field, LIGHT, ROAD_USER, Site, TrafficRule, Verb, Word};
use crate::model::{
    EnumDef, ManoeuvreCall, ManoeuvreDef, OrderDef, PhaseDef, REPEAT, Type, WordExpr, code, reached, told,
};
use crate::prove::VARIANTS_MAX;
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

/// Of more that lead to no end not each is told.
const CIRCLES_MAX: usize = 100;

impl Checker {
    /// Notes the names that actions give to what they spawn. Phases, orders and rules may stand before them.
    pub(super) fn declare_bearers(&mut self, items: &[&ast::Item]) {
        let effects = each(items, ItemKind::as_action).flat_map(|(_, action)| &action.effects);
        let spawns = effects.filter_map(ast::Effect::spawn);
        for (name, spawn) in spawns.flat_map(|spawn| spawn.bearers.iter().map(move |name| (name, spawn))) {
            let ast::Spawn { body, place, fields, .. } = spawn;
            let is_on_foot = |name: &String| {
                let own = self.bodies.iter().find(|body| body.name == *name);
                let like = own.map(|own| own.like).or_else(|| Body::from_name(name));
                like.is_some_and(|like| !like.is_vehicle())
            };
            let does = fields.iter().find(|field| field.name.text == Field::Does.name());
            let verb = does.and_then(|field| match &field.value.kind {
                ast::ExprKind::Name(verb) => Verb::from_name(verb),
                _ => None,
            });
            let has = match (&body.kind, verb) {
                _ if place.trajectory().is_some() => Told::to(Verb::Follow),
                (ast::ExprKind::Name(body), Some(verb)) if is_on_foot(body) => Told::to(verb),
                (ast::ExprKind::Name(body), None) if is_on_foot(body) => Told::to(Verb::WalkAhead),
                _ => Told::BY_DRIVERS,
            };
            let most = self.obeys.entry(name.text.clone()).or_default();
            *most = most.and(has);
            let is_of_facts =
                Fact::ALL.iter().any(|fact| fact.name().split('.').next() == Some(name.text.as_str()));
            if is_of_facts || name.text == LIGHT.0 {
                let message = format!("`{}` cannot be the name of a road user", name.text);
                let error = Diagnostic::error(code::NOT_HERE, message);
                self.report(error.at(name.span, "the engine's own word").help("choose another name"));
            } else if !self.bearers.contains(&name.text) {
                self.bearers.push(name.text.clone());
            }
        }
    }

    /// The names of road users are the values of a type of their own, if a parameter is of that type.
    pub(super) fn declare_road_users(&mut self, items: &[&ast::Item]) {
        let of_actions =
            each(items, ItemKind::as_action).flat_map(|(_, action)| &action.params).map(|it| &it.ty);
        let of_manoeuvres =
            each(items, ItemKind::as_manoeuvre).flat_map(|(_, it)| &it.params).map(|it| &it.ty);
        let is_of_them =
            |ty: &ast::Type| matches!(&ty.kind, ast::TypeKind::Named(name) if name.text == ROAD_USER.0);
        let is_taken = self.enum_names.get(ROAD_USER.0).is_some();
        if is_taken || !of_actions.chain(of_manoeuvres).any(is_of_them) {
            return;
        }
        let span = Span::NONE;
        let variants: Vec<String> = self.bearers.iter().take(VARIANTS_MAX).cloned().collect();
        let odds = vec![1; variants.len()];
        let name = ROAD_USER.0.to_owned();
        self.enums.push(EnumDef { name, docs: Vec::new(), variants, ordered: false, odds, span });
        self.references.set_enums(self.enums.clone());
    }

    pub(super) fn is_road_user(&self, ty: Type) -> bool {
        matches!(ty, Type::Enum(of) if self.enums[of.0].name == ROAD_USER.0)
    }

    /// The road user that a name stands for: a parameter, or a name that a spawn gives.
    pub(super) fn who(&mut self, name: &str, span: Span, place: &Place<'_>) -> Option<Who> {
        let is_given = |(local, ty): &(String, Type)| local == name && self.is_road_user(*ty);
        if let Some(local) = place.locals.iter().position(is_given) {
            if let Some(owner) = place.owner {
                self.references.uses_parameter(&ast::Name::new(name, span), owner);
            }
            return Some(Who::Given(local));
        }
        let bearer = self.bearers.iter().position(|bearer| bearer == name)?;
        self.references.uses(span, Symbol::RoadUser(name.to_owned()));
        Some(Who::Named(bearer))
    }

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
        // What is left is part of a circle, leads to one, or hands over too often.
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

    /// Reports a figure of a phase that is written out, out of its bounds. What is computed is brought into them later.
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

    pub(super) fn order(
        &mut self,
        who: &ast::Name,
        fields: &[ast::Field],
        place: &Place<'_>,
        span: Span,
    ) -> Option<OrderDef> {
        let bearer = self.named_road_user(who, place);
        let among = Field::of_orders();
        self.note_fields(fields, &among, place);
        let (declared, fields) = (fields.len(), self.fields_among(fields, &among));
        let manoeuvre = match field(&fields, Field::Then) {
            Some(value) => match self.manoeuvre_call(value, place) {
                Some(call) => Some(call?),
                None => return self.no_manoeuvre(value, place),
            },
            None => None,
        };
        let command = self.command(&fields, place)?;
        if let Some(continuous) = command.expr(Field::Continuous) {
            let error = Diagnostic::error(code::NOT_HERE, "only the `speed` of a phase is `continuous`");
            let error = error.at(continuous.span, "in an order, whose numbers are drawn");
            return self.reject(error.help("write a manoeuvre with that phase, and order `then: …`"));
        }
        if let (Some(to), true) = (field(&fields, Field::To), bearer.is_some() && command.to() == bearer) {
            let error = Diagnostic::error(code::IMPOSSIBLE_SPAWN, "nobody keeps a gap to itself");
            let help = "name somebody else, or leave `to` out: then the gap is to the ego vehicle";
            return self
                .reject(error.at(to.span, format!("this is who is ordered, `{}`", who.text)).help(help));
        }
        if manoeuvre.is_none() && command.is_empty() {
            // A misspelt field was reported.
            if fields.len() < declared {
                return None;
            }
            let message = "the order tells the vehicle nothing".to_owned();
            return self.missing_field(Field::Speed, span, message);
        }
        let told = manoeuvre.as_ref().map_or(Told::NOTHING, |call| self.told(call.manoeuvre));
        let has = match bearer {
            Some(Who::Given(_)) => self.obeys.values().copied().reduce(Told::and),
            Some(Who::Named(_)) | None => self.obeys.get(&who.text).copied(),
        };
        let has = has.unwrap_or(Told::BY_DRIVERS);
        // Nobody on foot is told a rate.
        let moves = Moves::told(has);
        if bearer.is_some() && !has.covers(told.and(command.told())) {
            let message = format!("`{}` cannot be told that", who.text);
            let error = Diagnostic::error(code::IMPOSSIBLE_SPAWN, message);
            let error = error.at(who.span, "on foot, or on a trajectory, whenever it is there");
            let help = format!("it can be told {}", has.words());
            self.report(error.help(help));
        }
        Some(OrderDef { who: bearer?, command, manoeuvre, moves, span })
    }

    /// The road user that an order is for, or beside whom another one appears.
    pub(super) fn named_road_user(&mut self, who: &ast::Name, place: &Place<'_>) -> Option<Who> {
        self.who(&who.text, who.span, place).or_else(|| {
            self.references.uses(who.span, Symbol::RoadUser(who.text.clone()));
            let of_type = place.locals.iter().filter(|(_, ty)| self.is_road_user(*ty));
            let known = of_type.map(|(name, _)| name).chain(&self.bearers).map(String::as_str);
            let mut error = self.unknown("road user", &who.text, who.span, known);
            let name_it = || format!("name it where it appears: `spawn … as {} ahead …`", who.text);
            error.help = error.help.or_else(|| Some(name_it()));
            self.reject(error)
        })
    }

    fn no_manoeuvre<T>(&mut self, value: &ast::Expr, place: &Place<'_>) -> Option<T> {
        self.look_at(value, place, None);
        let error =
            Diagnostic::error(code::TYPE_MISMATCH, "the `then` of an order or a phase is a manoeuvre");
        let error = error.at(value.span, "no call of one");
        self.reject(error.help("write its name and what it is given: `then: brake(4 m/s^2)`"))
    }

    /// What the fields of an order or a phase tell a vehicle; `None` after a mistake, which is reported.
    fn command(&mut self, fields: &[(Field, &ast::Expr)], place: &Place<'_>) -> Option<CommandDef> {
        let command = self.told_by(fields, place);
        let mut all = true;
        let says = |wanted: Field| field(fields, wanted).is_some();
        let goes_aside = says(Field::Lane) || says(Field::Offset);
        let (keeps, is_early) = (says(Field::Keep), says(Field::Early));
        if let Some(value) = field(fields, Field::Early).filter(|_| keeps) {
            let error = Diagnostic::error(code::NOT_HERE, "`keep` and `early` both say the speed");
            let error = error.at(value.span, "beside `keep`");
            self.report(error.help("leave one of the two out, or write them in two phases"));
            all = false;
        }
        if let Some(value) = field(fields, Field::Continuous).filter(|_| keeps || is_early) {
            let error =
                Diagnostic::error(code::NOT_HERE, "`keep` and `early` say the speed at every tick already");
            self.report(error.at(value.span, "beside one of them").help("leave it out"));
            all = false;
        }
        for (part, of, is_there) in [
            (Field::To, "a `keep`", keeps),
            (Field::At, "an `early`", is_early),
            (Field::Reach, "an `early` and an `at`", is_early && says(Field::At)),
            (Field::Steady, "a `reach` and a `speed`", says(Field::Reach) && says(Field::Speed)),
            (Field::Rate, "a `speed`, a `keep` or an `early`", says(Field::Speed) || keeps || is_early),
            (Field::Aside, "a `lane` or an `offset`", goes_aside),
            (Field::Continuous, "a `speed`", says(Field::Speed)),
        ] {
            if let Some(value) = field(fields, part).filter(|_| !is_there) {
                let message = format!("`{}` belongs to {of}", part.name());
                let error = Diagnostic::error(code::NOT_HERE, message);
                let error = error.at(value.span, format!("without {of}"));
                self.report(error.help(format!("say {of}, too, or leave `{}` out", part.name())));
                all = false;
            }
        }
        command.filter(|_| all)
    }

    /// What fields tell, but for those that are read by themselves; `None` after a mistake, which is reported. All are read before
    /// one that is wrong leaves them out.
    pub(super) fn told_by(
        &mut self,
        fields: &[(Field, &ast::Expr)],
        place: &Place<'_>,
    ) -> Option<Fields<Term>> {
        let (mut told, mut all) = (Fields::default(), true);
        for (field, value) in fields {
            let quantity = |unit: &Unit| Type::Quantity(unit.dimension);
            let term = match field.kind() {
                Kind::Figure(unit, None) => {
                    let expr = self.typed(value, place, quantity(&unit));
                    expr.map(|expr| Term::Figure { expr, second: false })
                }
                Kind::Figure(first, Some(second)) => {
                    let expr = self.either(*field, value, [&first, &second], place);
                    expr.map(|expr| Term::Figure { second: expr.ty == quantity(&second), expr })
                }
                Kind::Truth => self.typed(value, place, Type::Bool).map(Term::Truth),
                Kind::Word(kind) => self.word_among(kind, value, place).map(Term::Word),
                Kind::Rules => self.ignored_rules(value, place).map(Term::Rules),
                Kind::Who => self.kept(value, place).map(Term::Who),
                Kind::Own => continue,
            };
            all &= term.is_some();
            told.set(*field, term);
        }
        all.then_some(told)
    }

    /// A quantity in one of two units.
    fn either(
        &mut self,
        field: Field,
        value: &ast::Expr,
        units: [&Unit; 2],
        place: &Place<'_>,
    ) -> Option<Expr> {
        let found = self.expr(value, place, None)?;
        if units.iter().any(|unit| found.ty == Type::Quantity(unit.dimension)) {
            return Some(found);
        }
        let label = format!("this is a `{}`", self.references.type_name(found.ty));
        let [first, second] = units.map(|unit| self.references.type_name(Type::Quantity(unit.dimension)));
        let message = format!("`{}` is a `{first}` or a `{second}`", field.name());
        let error = Diagnostic::error(code::UNIT_MISMATCH, message).at(value.span, label);
        // Its sentence ends with an example in each unit.
        let examples = field.meaning().split_once(": `").map(|(_, examples)| examples.trim_end_matches('.'));
        self.reject(error.help_if(examples.map(|examples| format!("write `{examples}"))))
    }

    /// The road user to whom a gap is kept.
    fn kept(&mut self, value: &ast::Expr, place: &Place<'_>) -> Option<Who> {
        if let ast::ExprKind::Name(name) = &value.kind {
            return self.named_road_user(&ast::Name::new(name, value.span), place);
        }
        self.look_at(value, place, None);
        let error = Diagnostic::error(code::TYPE_MISMATCH, "a gap is kept to a road user that has a name");
        self.reject(
            error.at(value.span, "no name").help("write `to: truck`, or leave `to` out for the ego vehicle"),
        )
    }

    /// The rules of the road that are ignored: `[Signals, Ego]`.
    pub(super) fn ignored_rules(
        &mut self,
        value: &ast::Expr,
        place: &Place<'_>,
    ) -> Option<Vec<WordExpr<TrafficRule>>> {
        let ast::ExprKind::List(items) = &value.kind else {
            self.look_at(value, place, None);
            let error = Diagnostic::error(code::TYPE_MISMATCH, "`ignores` is a list of rules of the road");
            let error = error.at(value.span, "no list");
            return self.reject(error.help("write them in brackets: `ignores: [Signals]`; `[]` for none"));
        };
        all_of(items.iter().map(|item| self.word::<TrafficRule>("rule of the road", item, place)))
    }

    /// What the phases of a manoeuvre tell; nothing, if it is broken.
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
