//! Actions and groups: parameters with their domains, effects with the engine's words.

use std::collections::BTreeSet;

use crate::check::checker::{Checker, docs, each, literal};
use crate::check::declaration::{even_odds, unknown_word};
use crate::check::expression::{NUMBER_MAX, Place, is_beyond_states, is_number};
use crate::check::operator::with_range;
use crate::check::references::Symbol;
use crate::check::report::{Report, all_of, as_written, field};
use crate::check::rule::locals;
use crate::model::command::{CommandDef, Told};
use crate::model::expr::{Expr, ExprKind};
use crate::model::rules::rules_by_action;
use crate::model::vocabulary::{
    Colour, LIGHT, LaneChoice, LightColour, LightField, ShownLights, Side, Site, SpaceClaim, SpawnField,
    Then, Turning, Verb, Word,
};
use crate::model::{
    ActionDef, BodyWord, Domain, EffectDef, GroupDef, InRow, LightDef, ManoeuvreCall, Parameter, RuleDef,
    SetDef, SpawnDef, Type, Value, WordExpr, code,
};
use crate::prove::product_size;
use crate::syntax::ast::{ItemKind, ParamMode, Span};
use crate::syntax::{Diagnostic, ast, listed, nearest};
use avastra_base::units::{Dimension, Rational};

/// Largest number of rows in a table.
pub(crate) const ROWS_MAX: u64 = 100_000;

/// Limit on the number of proofs, which is rows times the rules that bind them times roads. It leaves room for four rules
/// on every row of the longest table on four roads; how many steps they take is counted while they are made.
const PROOFS_MAX: u64 = 2_000_000;

/// Largest number of values in an `Int` range.
const VALUES_MAX: i64 = 100_000;

/// Largest number of values that the parameters of all actions list together. A value counts once for each of its odds.
const LISTED_MAX: usize = 2_000_000;

/// Largest number of parameters of an action or a function.
pub(super) const PARAMETERS_MAX: usize = 100;

/// Largest number of road users that one action spawns.
const SPAWNS_MAX: usize = 100;

/// Largest number of rules that bind one action. Some proofs hold each of them against each other.
const RULES_MAX: usize = 1_000;

/// Largest number of actions that all groups name together.
const MEMBERS_MAX: usize = 1_000_000;

/// Largest number of operations in conditions and effects that are written for many actions, counted once for each action.
const COMPILED_MAX: usize = 500_000;

impl Checker {
    pub(super) fn declare_actions(&mut self, items: &[&ast::Item]) {
        let (names, actions) = self.declared("action", items, ItemKind::as_action);
        self.action_names = names;
        for (item, declared) in actions {
            let (action, is_whole) = self.action(item, declared).unzip();
            if is_whole == Some(false) {
                self.half_broken.insert(self.actions.len());
            }
            let names = action.iter().flat_map(|action: &ActionDef| &action.parameters);
            self.parameter_names.extend(names.map(|parameter| parameter.name.to_string()));
            self.actions.push(action);
        }
    }

    /// Whether an action or a function has few enough parameters; reports it if not.
    pub(super) fn has_few_parameters(&mut self, name: &ast::Name, count: usize) -> bool {
        if count > PARAMETERS_MAX {
            let message = format!("`{}` has {count} parameters", name.text);
            let error = Diagnostic::error(code::TOO_MUCH, message)
                .at(name.span, format!("at most {PARAMETERS_MAX} are possible"));
            self.report(error.help("make several of it, each with fewer parameters"));
        }
        count <= PARAMETERS_MAX
    }

    /// The action, and whether all its effects are sound. The sound ones are kept in any case, so that rules on
    /// this action are checked too.
    pub(super) fn action(&mut self, item: &ast::Item, declared: &ast::Action) -> Option<(ActionDef, bool)> {
        if !self.has_few_parameters(&declared.name, declared.params.len()) {
            return None;
        }
        let spawns =
            declared.effects.iter().filter(|effect| matches!(effect.kind, ast::EffectKind::Spawn { .. }));
        let spawns = spawns.count();
        if spawns > SPAWNS_MAX {
            let message = format!("`{}` spawns {spawns} road users", declared.name.text);
            let error = Diagnostic::error(code::TOO_MUCH, message)
                .at(declared.name.span, format!("at most {SPAWNS_MAX} are possible"));
            return self.reject(error.help("make several actions of it"));
        }
        let owner = Symbol::Action(declared.name.text.clone());
        let mut locals: Vec<(String, Type)> = Vec::new();
        let mut parameters = Vec::new();
        let mut sound = true;
        self.once("parameter", declared.params.iter().map(|parameter| &parameter.name));
        for parameter in &declared.params {
            let Some(ty) = self.plain_type(&parameter.ty) else {
                // Its name is kept, so that uses of it are not reported as unknown.
                locals.push((parameter.name.text.clone(), Type::Bool));
                sound = false;
                let place = Place { locals: &locals, owner: Some(&owner), ..Place::default() };
                let values = parameter.within.iter().chain(&parameter.condition);
                values.for_each(|expr| self.look_at(expr, &place, None));
                continue;
            };
            if let Some(symbol) = owner.parameter(&parameter.name.text) {
                self.references.typed(&symbol, ty, None);
            }
            // A mistake in its values is reported already; the type is enough to check the rest of the action.
            parameters.push(self.parameter(parameter, ty, &locals, &owner).unwrap_or_else(|| Parameter {
                name: parameter.name.text.as_str().into(),
                ty,
                axis: parameter.mode == ParamMode::Each,
                domain: Domain::Values(Vec::new()),
                condition: None,
                span: parameter.span,
            }));
            locals.push((parameter.name.text.clone(), ty));
        }
        let place = Place { locals: &locals, owner: Some(&owner), states: true, ..Place::default() };
        if !sound {
            let look = |checker: &mut Checker| {
                declared.effects.iter().for_each(|effect| drop(checker.effect(effect, &place)));
            };
            self.quietly(look);
            return None;
        }
        if declared.effects.is_empty() {
            let message = format!("`{}` has no effect", declared.name.text);
            let error = Diagnostic::error(code::NO_EFFECT, message).at(declared.name.span, "does nothing");
            self.report(error.help("give it a `set` or a `spawn`, or remove it"));
        }
        self.check_beside(&declared.effects);
        self.check_light_orders(&declared.effects);
        let effects: Vec<Option<Vec<EffectDef>>> =
            declared.effects.iter().map(|effect| self.effect(effect, &place)).collect();
        let is_whole = effects.iter().all(Option::is_some);
        let action = ActionDef {
            name: declared.name.text.clone(),
            docs: docs(item),
            parameters,
            effects: effects.into_iter().flatten().flatten().collect(),
            // Until `odds actions` says otherwise.
            odds: even_odds(),
            span: declared.name.span,
        };
        Some((action, is_whole))
    }

    /// Reports a second order of the light: a light is told one thing at a time.
    fn check_light_orders(&mut self, effects: &[ast::Effect]) {
        let of_light = |effect: &&ast::Effect| matches!(&effect.kind, ast::EffectKind::Order { who, .. } if who.text == LIGHT.0);
        if let Some(second) = effects.iter().filter(of_light).nth(1) {
            let error = Diagnostic::error(code::DUPLICATE, "an action tells the light two things");
            let help = "the later one alone would count; write an action for each";
            self.report(error.at(second.span, "told again").help(help));
        }
    }

    /// Reports places beside somebody whom the same action makes appear: nobody of that name is there when places are found.
    fn check_beside(&mut self, effects: &[ast::Effect]) {
        let spawns = || {
            effects.iter().filter_map(|effect| match &effect.kind {
                ast::EffectKind::Spawn { bearers, of, .. } => Some((bearers, of)),
                ast::EffectKind::Set { .. } | ast::EffectKind::Order { .. } => None,
            })
        };
        let own =
            |name: &ast::Name| spawns().any(|(bearers, _)| bearers.iter().any(|own| own.text == name.text));
        for name in spawns().filter_map(|(_, of)| of.as_ref()).filter(|name| own(name)) {
            let message = format!("`{}` appears in the same action", name.text);
            let error = Diagnostic::error(code::IMPOSSIBLE_SPAWN, message);
            let error = error.at(name.span, "not there yet, or another one");
            self.report(error.help("say both distances from the ego vehicle, or make two actions of it"));
        }
    }

    fn parameter(
        &mut self,
        declared: &ast::ActionParam,
        ty: Type,
        before: &[(String, Type)],
        owner: &Symbol,
    ) -> Option<Parameter> {
        let mut locals = before.to_vec();
        locals.push((declared.name.text.clone(), ty));
        let axis = declared.mode == ParamMode::Each;
        // The rows are the same at every moment; what is drawn may depend on it.
        let site = if axis { Site::Axis } else { Site::Where };
        let place = Place { locals: &locals, owner: Some(owner), states: !axis, site };
        let Some(domain) = self.values(declared, ty) else {
            declared.condition.iter().for_each(|condition| self.look_at(condition, &place, Some(Type::Bool)));
            return None;
        };
        let condition = match &declared.condition {
            None => None,
            Some(condition) => Some(self.typed(condition, &place, Type::Bool)?),
        };
        let name = declared.name.text.as_str().into();
        Some(Parameter { name, ty, axis, domain, condition, span: declared.span })
    }

    /// The values of a parameter before its `where`.
    fn values(&mut self, declared: &ast::ActionParam, ty: Type) -> Option<Domain> {
        let axis = declared.mode == ParamMode::Each;
        let domain = match &declared.within {
            Some(within) => self.domain(within, ty)?,
            None => match ty {
                Type::Bool => Domain::Values(vec![Value::Bool(false), Value::Bool(true)]),
                Type::Enum(of) if self.enums[of.0].variants.is_empty() => {
                    let error = Diagnostic::error(code::UNKNOWN, "no road user has a name here");
                    let error = error.at(declared.ty.span, "a type without values");
                    return self.reject(error.help("name one: `spawn BoxTruck as truck ahead …`"));
                }
                Type::Enum(of) => {
                    let count = self.enums[of.0].variants.len();
                    Domain::Values((0..count).map(|variant| Value::Variant(of, variant)).collect())
                }
                Type::Int | Type::Quantity(_) => {
                    let name = self.references.type_name(ty);
                    let message = format!("`{}` has no end of values", declared.name.text);
                    let error = Diagnostic::error(code::INFINITE, message)
                        .at(declared.ty.span, format!("any `{name}`"));
                    return self.reject(error.help("say from where to where: `in low .. high`"));
                }
            },
        };
        let domain = match domain {
            Domain::Values(values) if !axis => Domain::Values(self.by_odds(values, declared)?),
            domain => domain,
        };
        if let Domain::Values(values) = &domain {
            self.listed += values.len();
            if self.listed > LISTED_MAX {
                let message = format!("the parameters list more than {LISTED_MAX} values together");
                let error =
                    Diagnostic::error(code::TOO_MUCH, message).at(declared.span, "here the limit is passed");
                let help = "list fewer values, give them smaller odds, or draw a quantity from a range";
                return self.reject(error.help(help));
            }
        }
        if axis && matches!(domain, Domain::Range(..)) {
            let name = self.references.type_name(ty);
            let message = format!("`each` over `{}` has no end of rows", declared.name.text);
            let error = Diagnostic::error(code::INFINITE, message)
                .at(declared.ty.span, format!("a range of `{name}`"));
            return self.reject(error.help("list the values, `in [1 m, 2 m]`, or draw one with `any`"));
        }
        Some(domain)
    }

    /// The values to draw from, each repeated as often as its odds say.
    fn by_odds(&mut self, values: Vec<Value>, declared: &ast::ActionParam) -> Option<Vec<Value>> {
        let odds = |value: &Value| match value {
            Value::Variant(of, variant) => self.enums[of.0].odds[*variant] as usize,
            Value::Bool(_) | Value::Number(_) => 1,
        };
        let drawn: Vec<Value> =
            values.iter().flat_map(|value| core::iter::repeat_n(*value, odds(value))).collect();
        if drawn.is_empty() && !values.is_empty() {
            let message = format!("nothing is left to draw for `{}`", declared.name.text);
            let error =
                Diagnostic::error(code::EMPTY, message).at(declared.span, "the odds of all its values are 0");
            return self.reject(error.help("give at least one of them odds above 0"));
        }
        Some(drawn)
    }

    fn domain(&mut self, within: &ast::Expr, ty: Type) -> Option<Domain> {
        let place = Place::default();
        match &within.kind {
            ast::ExprKind::Range { low, high } => {
                if !is_number(ty) {
                    self.look_at(within, &place, Some(ty));
                    let name = self.references.type_name(ty);
                    let error = Diagnostic::error(code::TYPE_MISMATCH, format!("`{name}` has no ranges"));
                    return self.reject(error.at(within.span, "a range of numbers"));
                }
                let (low, high) = (self.typed(low, &place, ty), self.typed(high, &place, ty));
                let (low, high) = (low?, high?);
                let (low, high) = (self.fold_number(&low), self.fold_number(&high));
                let (low, high) = (low?, high?);
                if low > high {
                    let error = Diagnostic::error(code::EMPTY, "the range is empty")
                        .at(within.span, "its low end lies above its high end");
                    return self.reject(error.help("write the low end first"));
                }
                if ty == Type::Int {
                    self.whole_values(low, high, within.span)
                } else {
                    Some(Domain::Range(low, high))
                }
            }
            ast::ExprKind::List(items) => {
                let values = all_of(items.iter().map(|item| {
                    let item = self.typed(item, &place, ty)?;
                    literal(&self.fold(&item)?)
                }))?;
                if values.is_empty() {
                    let error = Diagnostic::error(code::EMPTY, "the list is empty");
                    return self.reject(error.at(within.span, "no value is left"));
                }
                Some(Domain::Values(values))
            }
            _ => {
                self.look_at(within, &place, Some(ty));
                let error = Diagnostic::error(code::TYPE_MISMATCH, "`in` needs a range or a list here");
                self.reject(with_range(error.at(within.span, "neither"), within))
            }
        }
    }

    fn whole_values(&mut self, low: Rational, high: Rational, span: Span) -> Option<Domain> {
        if is_beyond_states(low) || is_beyond_states(high) {
            let error = Diagnostic::error(code::NUMBER, "no `Int` is so large");
            return self.reject(error.at(span, NUMBER_MAX));
        }
        match (low.to_i64(), high.to_i64()) {
            (Some(low), Some(high)) if high.checked_sub(low).is_some_and(|count| count < VALUES_MAX) => {
                Some(Domain::Values((low..=high).map(|value| Value::Number(value as f64)).collect()))
            }
            _ => {
                let message = format!("the range holds more than {VALUES_MAX} numbers");
                self.reject(Diagnostic::error(code::TOO_MANY_ROWS, message).at(span, "too many"))
            }
        }
    }

    /// What an effect does; several things if it is a row of road users.
    fn effect(&mut self, effect: &ast::Effect, place: &Place<'_>) -> Option<Vec<EffectDef>> {
        match &effect.kind {
            ast::EffectKind::Set { state, key, value } => {
                let Some(index) = self.state_named(state) else {
                    key.iter().chain([value]).for_each(|expr| self.look_at(expr, place, None));
                    return None;
                };
                let (key_of, ty) = (self.states[index].key, self.states[index].ty);
                let key = match (key, key_of) {
                    (None, _) => Some(None),
                    (Some(key), Some(of)) => self.typed(key, place, Type::Enum(of)).map(Some),
                    (Some(key), None) => {
                        self.look_at(key, place, None);
                        let message = format!("`{}` is not a map", state.text);
                        let error = Diagnostic::error(code::TYPE_MISMATCH, message);
                        self.reject(error.at(key.span, "takes no key"))
                    }
                };
                let Some(key) = key else {
                    self.look_at(value, place, Some(ty));
                    return None;
                };
                let value = self.typed(value, place, ty)?;
                Some(vec![EffectDef::Set(Box::new(SetDef { state: index, key, value, span: effect.span }))])
            }
            ast::EffectKind::Order { who, fields } if who.text == LIGHT.0 => {
                Some(vec![EffectDef::Light(Box::new(self.light(fields, place, effect.span)?))])
            }
            ast::EffectKind::Order { who, fields } => {
                let order = self.order(who, fields, place, effect.span)?;
                Some(vec![EffectDef::Order(Box::new(order))])
            }
            ast::EffectKind::Spawn { body, bearers, place: side, distance, of, apart, cover, fields } => {
                let behind = side.is_behind();
                let on = side.trajectory().map(|trajectory| self.trajectory_word(trajectory, place));
                let is_taken = |name: &&ast::Name| place.locals.iter().any(|(local, _)| *local == name.text);
                if let Some(name) = bearers.iter().find(is_taken) {
                    let message = format!("`{}` is a parameter, and no new name", name.text);
                    let error =
                        Diagnostic::error(code::DUPLICATE, message).at(name.span, "a parameter already");
                    self.report(error.help("give what appears a name of its own"));
                }
                let of = of.as_ref().map(|of| self.named_road_user(of, place));
                let cover = cover.as_ref().map(|cover| self.body_word(cover, place));
                let count = self.count_of_row(fields, apart.is_some(), place);
                let apart = apart.as_ref().map(|apart| self.apart(apart, bearers, place));
                let is_on_map = matches!(side, ast::Place::On(_));
                let has_place = (behind, of.is_some() || on.is_some());
                let spawn = self.spawn(body, has_place, distance, fields, place, effect.span)?;
                let ways = on.as_ref().and_then(Option::as_ref).map(|on| (is_on_map, possible(on)));
                self.check_trajectory(on.is_some(), ways, of.is_some(), &spawn.verb, effect.span);
                let count = count?;
                let (of, cover, trajectory) = (as_written(of)?, as_written(cover)?, as_written(on)?);
                self.check_cover(cover.as_ref(), &spawn.verb, effect.span);
                if of.is_some() && possible(&spawn.verb).contains(&Verb::CrossRoad) {
                    let message = "`CrossRoad` begins where it meets the ego vehicle in time, beside nobody";
                    let error =
                        Diagnostic::error(code::IMPOSSIBLE_SPAWN, message).at(effect.span, "spawned here");
                    self.report(error.help(
                        "leave `of` out; several that cross one after the other are a row: `as [first, second] ahead 60 m apart 10 m`",
                    ));
                }
                let spawn = SpawnDef { cover, of, trajectory, ..spawn };
                let bearer = |name: &ast::Name| self.bearers.iter().position(|one| *one == name.text);
                let one = |spawn: SpawnDef| EffectDef::Spawn(Box::new(spawn));
                match (apart, bearers.as_slice()) {
                    (None, []) => Some(vec![one(spawn)]),
                    (None, [name]) => Some(vec![one(SpawnDef { bearer: bearer(name), ..spawn })]),
                    (None, [_, second, ..]) => {
                        let error = Diagnostic::error(
                            code::MISSING_FIELD,
                            "the row does not say how far apart it is",
                        );
                        self.reject(
                            error.at(second.span, "another one").help(
                                "write the gap between them after the distance: `ahead 50 m apart 15 m`",
                            ),
                        )
                    }
                    (Some(apart), names) => {
                        let apart = apart?;
                        let nth = |(nth, name)| {
                            let row = || InRow {
                                nth,
                                apart: apart.clone(),
                                count: count.clone(),
                                named: names.len(),
                            };
                            let row = (nth > 0).then(row);
                            one(SpawnDef { bearer: bearer(name), row, ..spawn.clone() })
                        };
                        Some(names.iter().enumerate().map(nth).collect())
                    }
                }
            }
        }
    }

    /// What the ego vehicle's next traffic light is told.
    fn light(&mut self, fields: &[ast::Field], place: &Place<'_>, span: Span) -> Option<LightDef> {
        self.note_fields::<LightField>(fields, place);
        let fields = self.fields_known::<LightField>(fields);
        let colour = match field(&fields, LightField::Colour) {
            Some(value) => self.word::<LightColour>("colour of a light", value, place),
            None => {
                let message = "the order does not say what the light is to show".to_owned();
                self.missing_field(LightField::Colour, span, message)
            }
        };
        let at = field(&fields, LightField::At)
            .map(|value| self.typed(value, place, Type::Quantity(Dimension::LENGTH)));
        Some(LightDef { colour: colour?, at: as_written(at)? })
    }

    /// How many of a row appear; `Some(None)` where nothing is said.
    fn count_of_row(
        &mut self,
        fields: &[ast::Field],
        is_row: bool,
        place: &Place<'_>,
    ) -> Option<Option<Expr>> {
        let Some(field) = fields.iter().find(|field| field.name.text == SpawnField::Count.name()) else {
            return Some(None);
        };
        if !is_row {
            let error = Diagnostic::error(code::NOT_HERE, "`count` belongs to a row of several road users");
            let help =
                "name them all, and say how far apart they are: `as [first, second] ahead 50 m apart 15 m`";
            return self.reject(error.at(field.name.span, "there is no row").help(help));
        }
        self.typed(&field.value, place, Type::Int).map(Some)
    }

    /// The gap between the road users of a row, which are named.
    fn apart(&mut self, apart: &ast::Expr, names: &[ast::Name], place: &Place<'_>) -> Option<Expr> {
        let found = self.typed(apart, place, Type::Quantity(Dimension::LENGTH));
        self.once("road user", names.iter());
        if names.len() < 2 {
            let error = Diagnostic::error(code::NOT_HERE, "`apart` belongs to a row of several road users");
            return self
                .reject(error.at(apart.span, "there is only one").help("name them all: `as [last, first]`"));
        }
        found
    }

    fn spawn(
        &mut self,
        body: &ast::Expr,
        (behind, is_beside): (bool, bool),
        distance: &ast::Expr,
        fields: &[ast::Field],
        place: &Place<'_>,
        span: Span,
    ) -> Option<SpawnDef> {
        self.note_fields::<SpawnField>(fields, place);
        let fields = self.fields_known(fields);
        let find = |wanted: SpawnField| field(&fields, wanted);
        let lacks = |what: &str| format!("the spawn does not say {what}");
        let body_word = self.body_word(body, place);
        let distance = self.typed(distance, place, Type::Quantity(Dimension::LENGTH));
        let verb = match find(SpawnField::Does) {
            Some(value) => self.word::<Verb>("verb", value, place),
            None => self.missing_field(SpawnField::Does, span, lacks("what it does")),
        };
        let verb_words: Vec<Verb> = verb.as_ref().map(possible).unwrap_or_default();
        let needs = |verbs: &[Verb]| verb_words.iter().any(|verb| verbs.contains(verb));
        let lane = match find(SpawnField::Lane) {
            Some(value) => self.word::<LaneChoice>("lane", value, place),
            None if needs(&[Verb::DriveAhead, Verb::DriveBehind, Verb::Overtake]) => {
                self.missing_field(SpawnField::Lane, span, lacks("its lane"))
            }
            None => Some(WordExpr::Fixed(LaneChoice::Current)),
        };
        let side = match find(SpawnField::Side) {
            Some(value) => self.word::<Side>("side", value, place),
            None if needs(&[Verb::CrossRoad, Verb::Walk]) => {
                self.missing_field(SpawnField::Side, span, lacks("where it comes from"))
            }
            None => Some(WordExpr::Fixed(Side::Right)),
        };
        let then = match find(SpawnField::Then) {
            Some(value) => self.then(value, place),
            None => Some((WordExpr::Fixed(Then::Keep), None)),
        };
        let colour = match find(SpawnField::Colour) {
            Some(value) => self.word::<Colour>("colour", value, place),
            None => Some(WordExpr::Fixed(Colour::Black)),
        };
        let speed_type = Type::Quantity(Dimension::SPEED);
        let speed = match find(SpawnField::Speed) {
            Some(value) => self.typed(value, place, speed_type),
            None if verb_words == [Verb::Stand] => {
                Some(Expr { kind: ExprKind::Number(Rational::ZERO), ty: speed_type, span })
            }
            None => self.missing_field(SpawnField::Speed, span, lacks("how fast it is")),
        };
        let offset = match find(SpawnField::Offset) {
            Some(value) => self.typed(value, place, Type::Quantity(Dimension::LENGTH)).map(Some),
            None => Some(None),
        };
        let ignores = match find(SpawnField::Ignores) {
            Some(value) => self.ignored_rules(value, place),
            None => Some(Vec::new()),
        };
        let siren = match find(SpawnField::Siren) {
            Some(value) => self.typed(value, place, Type::Bool).map(Some),
            None => Some(None),
        };
        let lights = match find(SpawnField::Lights) {
            Some(value) => self.word::<ShownLights>("kind of lights", value, place).map(Some),
            None => Some(None),
        };
        let turn = match find(SpawnField::Turn) {
            Some(value) => self.word::<Turning>("turn", value, place).map(Some),
            None => Some(None),
        };
        let meet = match find(SpawnField::Meet) {
            Some(value) => self.typed(value, place, Type::Quantity(Dimension::RATIO)).map(Some),
            None => Some(None),
        };
        let early = match find(SpawnField::Early) {
            Some(value) => self.typed(value, place, Type::Quantity(Dimension::DURATION)).map(Some),
            None => Some(None),
        };
        let waits = match find(SpawnField::Waits) {
            Some(value) => self.typed(value, place, Type::Quantity(Dimension::DURATION)).map(Some),
            None => Some(None),
        };
        let (body, verb, (then, manoeuvre)) = (body_word?, verb?, then?);
        if !is_beside {
            self.check_side(&verb, behind, span);
        }
        self.check_verb(&body, &verb, span);
        if let Some(lights) = field(&fields, SpawnField::Lights)
            && let Some(body) = possible(&body).into_iter().find(|body| !body.like.is_vehicle())
            && possible(&verb).contains(&Verb::Follow)
        {
            let message = format!("a `{}` has no lights", self.body_name(body));
            let error = Diagnostic::error(code::IMPOSSIBLE_SPAWN, message).at(lights.span, "without effect");
            self.report(error.help("leave `lights` out"));
        }
        self.check_fields(&fields, &verb, manoeuvre.as_ref(), span);
        Some(SpawnDef {
            body,
            colour: colour?,
            verb,
            lane: lane?,
            side: side?,
            then,
            speed: speed?,
            distance: distance?,
            behind,
            of: None,
            trajectory: None,
            cover: None,
            offset: offset?,
            ignores: ignores?,
            meet: meet?,
            waits: waits?,
            early: early?,
            siren: siren?,
            turn: turn?,
            lights: lights?,
            bearer: None,
            row: None,
            manoeuvre,
            span,
        })
    }

    /// Reports who follows a trajectory without one, who has one and does something else, and a place that is none on a way: a
    /// station counts `at` one of a map, a distance `ahead` or `behind` on one beside the ego vehicle's route. `ways` are those
    /// that the trajectory may be, and whether the place is a station.
    fn check_trajectory(
        &mut self,
        is_on: bool,
        ways: Option<(bool, Vec<usize>)>,
        is_beside: bool,
        verb: &WordExpr<Verb>,
        span: Span,
    ) {
        let (at_station, ways) = ways.unwrap_or_default();
        let other = ways.iter().map(|way| &self.trajectories[*way]);
        let other = other.clone().find(|way| way.is_beside_route() == at_station).map(|way| way.name.clone());
        let odd = possible(verb).into_iter().find(|verb| (*verb == Verb::Follow) != is_on);
        let (message, help) = match (odd, other) {
            (Some(Verb::Follow), _) => (
                "`Follow` needs a trajectory".to_owned(),
                "write where it begins: `on NAME at 12 m`, or `on NAME ahead 40 m` where that lies beside the route",
            ),
            (Some(verb), _) => (
                format!("`{}` does not begin on a trajectory", verb.name()),
                "write `does: Follow`, or `ahead` and a distance",
            ),
            (None, Some(name)) if at_station => (
                format!("`{name}` lies beside the ego vehicle's route, wherever it begins"),
                "say where: `on NAME ahead 40 m`, or `behind`",
            ),
            (None, Some(name)) => (
                format!("`{name}` lies on a map"),
                "say the station at which it begins there, `on NAME at 12 m`, or leave the `road` of the trajectory out",
            ),
            (None, None) if at_station && is_beside => (
                "the place is said twice".to_owned(),
                "leave `of` out: a station on a trajectory is beside nobody",
            ),
            (None, None) => return,
        };
        let error = Diagnostic::error(code::IMPOSSIBLE_SPAWN, message).at(span, "spawned here");
        self.report(error.help(help));
    }

    /// Reports fields that mean nothing to a verb.
    fn check_fields(
        &mut self,
        fields: &[(SpawnField, &ast::Expr)],
        verb: &WordExpr<Verb>,
        manoeuvre: Option<&ManoeuvreCall>,
        span: Span,
    ) {
        let has = |is_so: fn(&CommandDef) -> bool| {
            manoeuvre.is_some_and(|call| self.has_command(call.manoeuvre, is_so))
        };
        let keeps_to_ego = has(|command| command.keep.is_some() && command.to.is_none());
        let keeps = has(|command| command.keep.is_some());
        let changes_lanes = has(|command| command.lane.is_some());
        let told = manoeuvre.map_or(Told::NOTHING, |call| self.told(call.manoeuvre));
        let goes_back = has(CommandDef::goes_back);
        let meets_nowhere = has(|command| command.early.is_some() && command.reach.is_none());
        self.check_place_fields(fields, &possible(verb));
        for verb in possible(verb) {
            let on_foot = verb.is_on_foot();
            let other_way = matches!(verb, Verb::DriveOpposite | Verb::CrossRoad);
            let says = |wanted: SpawnField| field(fields, wanted).is_some();
            let follows = verb == Verb::Follow;
            let (what, help) = match () {
                () if verb == Verb::Stand && manoeuvre.is_some() => (
                    "does no manoeuvre",
                    "leave `then` out, or let it `Walk`, with `speed: 0 m/s` until it is told",
                ),
                () if told.lacked_by(verb).is_some() && verb == Verb::Walk => (
                    "is told a `speed` alone",
                    "the other fields of its manoeuvre are not for who crosses the road; leave them out",
                ),
                () if told.lacked_by(verb).is_some() && on_foot => (
                    "is told a `speed`, an `offset` and an `aside` alone",
                    "the other fields of its manoeuvre are for vehicles; leave them out",
                ),
                () if told.lacked_by(verb).is_some() && follows => (
                    "has no driver",
                    "give its manoeuvre a `speed`, `rate`, `offset`, `aside`, `early`, `at`, `reach` and `steady` alone",
                ),
                () if told.lacked_by(verb).is_some() => (
                    "follows no trajectory",
                    "`reach` and `steady` are for `Follow`; leave them out of its manoeuvre",
                ),
                () if follows && meets_nowhere => (
                    "is `early` at a place of its trajectory",
                    "say in its manoeuvre where, `reach: 30 m`, and where the ego vehicle is then, `at: …`",
                ),
                () if follows && says(SpawnField::Ignores) => {
                    ("minds nobody", "it follows its trajectory whatever comes; leave `ignores` out")
                }
                () if follows && (says(SpawnField::Siren) || says(SpawnField::Turn)) => {
                    ("has no driver", "leave `siren` and `turn` out")
                }
                () if follows && (says(SpawnField::Lane) || says(SpawnField::Side)) => {
                    ("begins on its trajectory", "leave `lane` and `side` out")
                }
                () if !on_foot && !follows && goes_back => {
                    ("does not drive backwards", "give its manoeuvre no speed below 0 m/s")
                }
                () if on_foot && says(SpawnField::Ignores) => {
                    ("ignores nothing", "rules of the road are for vehicles; leave `ignores` out")
                }
                () if on_foot && says(SpawnField::Siren) => ("has no siren", "leave `siren` out"),
                () if on_foot && says(SpawnField::Lights) => ("has no lights", "leave `lights` out"),
                () if on_foot && says(SpawnField::Turn) => ("drives through no junction", "leave `turn` out"),
                () if verb == Verb::Walk && says(SpawnField::Offset) => {
                    ("begins at the kerb", "leave `offset` out")
                }
                () if verb != Verb::Walk && says(SpawnField::Meet) => {
                    ("is met at no point of the ego vehicle", "`meet` is for `Walk`; leave it out")
                }
                () if verb != Verb::Walk && says(SpawnField::Waits) => {
                    ("waits at no kerb", "`waits` is for `Walk`; leave it out")
                }
                () if verb != Verb::CrossRoad && says(SpawnField::Early) => (
                    "does not meet the ego vehicle at a junction",
                    "`early` is for `CrossRoad`, and for manoeuvres; leave it out",
                ),
                () if says(SpawnField::Meet) && says(SpawnField::Waits) => {
                    ("sets out after a time or for a meeting", "leave `waits` or `meet` out")
                }
                () if keeps_to_ego && other_way || keeps && verb == Verb::CrossRoad => (
                    "does not drive in the ego vehicle's direction",
                    "a gap is kept ahead of it or behind it; write `early` in its manoeuvre",
                ),
                () if other_way && changes_lanes => (
                    "drives in no lane of the ego vehicle's direction",
                    "in its manoeuvre, write `offset` for `lane`",
                ),
                () => continue,
            };
            let message = format!("`{}` {what}", verb.name());
            let error = Diagnostic::error(code::IMPOSSIBLE_SPAWN, message).at(span, "spawned here");
            self.report(error.help(help));
            return;
        }
    }

    /// Reports a `lane` and a `side` that mean nothing to any of the verbs.
    fn check_place_fields(&mut self, fields: &[(SpawnField, &ast::Expr)], verbs: &[Verb]) {
        let [ahead, behind, overtake] = [Verb::DriveAhead, Verb::DriveBehind, Verb::Overtake];
        let [cross, walk, stand] = [Verb::CrossRoad, Verb::Walk, Verb::Stand];
        for (wanted, of) in
            [(SpawnField::Lane, [ahead, behind, overtake]), (SpawnField::Side, [cross, walk, stand])]
        {
            let Some(value) = field(fields, wanted) else { continue };
            // Of a trajectory it is said elsewhere.
            let means_nothing = verbs.iter().all(|verb| !of.contains(verb) && *verb != Verb::Follow);
            if let Some(verb) = verbs.first().filter(|_| means_nothing) {
                let message = format!("a `{}` means nothing to `{}`", wanted.name(), verb.name());
                let error =
                    Diagnostic::error(code::IMPOSSIBLE_SPAWN, message).at(value.span, "without effect");
                let names: Vec<&str> = of.iter().map(|verb| verb.name()).collect();
                self.report(error.help(format!("leave it out; it is for {}", listed(&names))));
            }
        }
    }

    /// The `then` of a spawn: a word, or a manoeuvre.
    fn then(
        &mut self,
        value: &ast::Expr,
        place: &Place<'_>,
    ) -> Option<(WordExpr<Then>, Option<ManoeuvreCall>)> {
        match self.manoeuvre_call(value, place) {
            Some(call) => Some((WordExpr::Fixed(Then::Keep), Some(call?))),
            None if matches!(&value.kind, ast::ExprKind::Name(name) if self.manoeuvre_names.get(name).is_some()) =>
            {
                self.look_at(value, place, None);
                let error = Diagnostic::error(code::TYPE_MISMATCH, "a manoeuvre is given by a call");
                let help = "write what it is given behind its name: `then: brake(4 m/s^2)`, `then: swerve()`";
                self.reject(error.at(value.span, "only its name").help(help))
            }
            None => Some((self.word::<Then>("word for `then`", value, place)?, None)),
        }
    }

    /// Reports a cover that is no vehicle, and one for a road user that does not walk.
    fn check_cover(&mut self, cover: Option<&WordExpr<BodyWord>>, verb: &WordExpr<Verb>, span: Span) {
        let Some(cover) = cover else { return };
        if let Some(body) = possible(cover).into_iter().find(|body| !body.like.is_vehicle()) {
            let message = format!("a `{}` hides nobody", self.body_name(body));
            let error = Diagnostic::error(code::IMPOSSIBLE_SPAWN, message).at(span, "spawned here");
            self.report(error.help("write a vehicle after `from behind`"));
        }
        if let Some(verb) = possible(verb).into_iter().find(|verb| *verb != Verb::Walk) {
            let message = format!("`{}` does not begin behind a parked vehicle", verb.name());
            let error = Diagnostic::error(code::IMPOSSIBLE_SPAWN, message).at(span, "spawned here");
            self.report(error.help("`from behind` is for a pedestrian that does `Walk`"));
        }
    }

    /// Reports a vehicle that walks, and a pedestrian that drives.
    fn check_verb(&mut self, body: &WordExpr<BodyWord>, verb: &WordExpr<Verb>, span: Span) {
        let verbs = possible(verb);
        let clash = possible(body)
            .into_iter()
            .find_map(|body| verbs.iter().find(|verb| !body.like.can(**verb)).map(|verb| (body, *verb)));
        if let Some((body, verb)) = clash {
            let message = format!("a `{}` cannot `{}`", self.body_name(body), verb.name());
            let error = Diagnostic::error(code::IMPOSSIBLE_SPAWN, message).at(span, "spawned here");
            self.report(
                error.help(
                    "`Stand` and those with `Walk` are for a `Pedestrian` or an `Animal`, all other verbs for vehicles; an \
                     `Object` does `Stand` or `Follow`",
                ),
            );
        }
    }

    /// Reports a wrong `ahead` or `behind` of the ego vehicle: only some verbs begin behind it.
    fn check_side(&mut self, verb: &WordExpr<Verb>, behind: bool, span: Span) {
        for verb in possible(verb) {
            if verb.begins_behind() != behind {
                let (is, should) = if behind { ("behind", "ahead") } else { ("ahead of", "behind") };
                let message = format!("`{}` does not begin {is} the ego vehicle", verb.name());
                let error = Diagnostic::error(code::IMPOSSIBLE_SPAWN, message).at(span, "spawned here");
                self.report(error.help(format!("write `{should}`")));
                return;
            }
        }
    }

    pub(super) fn word<W: Word>(
        &mut self,
        kind: &str,
        expr: &ast::Expr,
        place: &Place<'_>,
    ) -> Option<WordExpr<W>> {
        let known = |_: &Checker, name: &str, span| {
            W::from_name(name).ok_or_else(|| unknown_word::<W>(kind, name, span))
        };
        let note = |checker: &mut Checker, span, name: &str| checker.references.word_named::<W>(span, name);
        self.word_or_enum(kind, expr, place, known, note)
    }

    /// A word: either the word itself, which is then noted, or an expression of an enum whose variants are such words.
    pub(super) fn word_or_enum<T>(
        &mut self,
        kind: &str,
        expr: &ast::Expr,
        place: &Place<'_>,
        known: impl Fn(&Checker, &str, Span) -> Result<T, Diagnostic>,
        note: impl Fn(&mut Checker, Span, &str),
    ) -> Option<WordExpr<T>> {
        if let ast::ExprKind::Name(name) = &expr.kind
            && self.is_bare_variant(expr, place)
        {
            let word = known(self, name, expr.span).map_err(|error| {
                let locals = place.locals.iter().map(|(local, _)| local.as_str());
                nearest(name, locals).map_or(error, |near| {
                    let error = Diagnostic::error(code::UNKNOWN, format!("unknown name `{name}`"));
                    error.at(expr.span, "not declared").meant(expr.span, near)
                })
            });
            let word = self.take(word)?;
            note(self, expr.span, name);
            return Some(WordExpr::Fixed(word));
        }
        let expr = self.expr(expr, place, None)?;
        let words = self.words_of(kind, expr.ty, expr.span, known)?;
        Some(WordExpr::Of(expr, words))
    }

    pub(super) fn declare_groups(&mut self, items: &[&ast::Item]) {
        for (item, declared) in each(items, ItemKind::as_group) {
            let taken = self.group_places.contains_key(&declared.name.text);
            if taken || self.action_names.get(&declared.name.text).is_some() {
                let message = format!("the name `{}` is taken", declared.name.text);
                let error = Diagnostic::error(code::DUPLICATE, message).at(declared.name.span, "again here");
                self.report(error.help("groups and actions share their names"));
                self.doubles.insert(item.span);
                continue;
            }
            let actions = self.all_targets(&declared.members);
            self.members += actions.len();
            if self.members > MEMBERS_MAX {
                let message = format!("the groups name more than {MEMBERS_MAX} actions together");
                let error = Diagnostic::error(code::TOO_MUCH, message);
                let error = error.at(declared.name.span, "here the limit is passed");
                self.report(error.help("make fewer groups, or smaller ones; `actions` names all actions"));
                return;
            }
            let name = declared.name.text.clone();
            self.group_places.insert(name.clone(), self.groups.len());
            self.groups.push(GroupDef { name, docs: docs(item), actions });
        }
    }

    /// `on … also` adds its effects to each of its actions, after those that the action has.
    pub(super) fn declare_also(&mut self, items: &[&ast::Item]) {
        for (_, declared) in each(items, ItemKind::as_also) {
            for (action, effect) in self.also(declared) {
                self.actions[action].iter_mut().for_each(|known| known.effects.push(effect.clone()));
            }
            if self.has_compiled_too_much(declared.on.first().map_or(Span::NONE, |name| name.span)) {
                return;
            }
        }
    }

    /// The effects that are added, each with its action.
    pub(super) fn also(&mut self, declared: &ast::Also) -> Vec<(usize, EffectDef)> {
        let mut actions = self.all_targets(&declared.on);
        actions.sort_unstable();
        let mut added = Vec::new();
        for action in actions {
            // A broken action was reported where it is declared.
            let Some(definition) = &self.actions[action] else { continue };
            let locals = locals(definition);
            let owner = Symbol::Action(definition.name.clone());
            let place = Place { locals: &locals, owner: Some(&owner), states: true, ..Place::default() };
            for effect in &declared.effects {
                for effect in self.effect(effect, &place).into_iter().flatten() {
                    self.compiled += operations_of(&effect);
                    added.push((action, effect));
                }
            }
            if self.compiled > COMPILED_MAX {
                break;
            }
        }
        added
    }

    pub(super) fn declare_each_step(&mut self, items: &[&ast::Item]) {
        for (_, effects) in each(items, ItemKind::as_each_step) {
            let sets = self.sets(effects);
            self.each_step.extend(sets);
        }
    }

    /// The effects of every step.
    pub(super) fn sets(&mut self, effects: &[ast::Effect]) -> Vec<SetDef> {
        let place = Place { states: true, site: Site::StepBegins, ..Place::default() };
        let found = effects.iter().filter_map(|effect| self.effect(effect, &place)).flatten();
        let sets = found.filter_map(|effect| match effect {
            EffectDef::Set(set) => Some(*set),
            EffectDef::Spawn(_) | EffectDef::Order(_) | EffectDef::Light(_) => None,
        });
        sets.collect()
    }

    /// Whether more than [`COMPILED_MAX`] operations were compiled for single actions; reports that once.
    pub(super) fn has_compiled_too_much(&mut self, span: Span) -> bool {
        let is_passed = self.compiled > COMPILED_MAX;
        if is_passed && !self.diagnostics.iter().any(|one| one.code == code::TOO_MUCH) {
            let message = "the rules and `on … also` of many actions are too much to check";
            let error = Diagnostic::error(code::TOO_MUCH, message).at(span, "here the limit is passed");
            self.report(error.note(format!("written out for each action, it has more than {COMPILED_MAX} operations")).help(
                "let rules bind fewer actions by `on`, make one action with an `each` parameter of several, or shorten conditions",
            ));
        }
        is_passed
    }

    /// The actions that some names mean, each once, in the order of the names.
    pub(super) fn all_targets(&mut self, names: &[ast::Name]) -> Vec<usize> {
        let (mut found, mut asked) = (Vec::new(), BTreeSet::new());
        let mut seen = vec![false; self.actions.len()];
        for name in names {
            // This name was met before, so its actions are in the list.
            if asked.contains(name.text.as_str()) {
                self.references.uses_target(name.span, &name.text);
                continue;
            }
            let actions = self.targets(name);
            if !actions.is_empty() {
                asked.insert(name.text.as_str());
            }
            for action in actions {
                if !core::mem::replace(&mut seen[action], true) {
                    found.push(action);
                }
            }
        }
        found
    }

    /// Whether a name stands for any action.
    pub(super) fn is_target(&self, name: &str) -> bool {
        let is_filled = |group: &usize| !self.groups[*group].actions.is_empty();
        self.action_names.get(name).is_some()
            || self.group_places.get(name).is_some_and(is_filled)
            || name == SpaceClaim::Actions.name() && !self.actions.is_empty()
    }

    /// The indices of the actions that a name means: one action, or the members of a group.
    pub(super) fn targets(&mut self, name: &ast::Name) -> Vec<usize> {
        self.references.uses_target(name.span, &name.text);
        if let Some(action) = self.action_names.get(&name.text) {
            return vec![action];
        }
        if let Some(group) = self.group_places.get(&name.text) {
            return self.groups[*group].actions.clone();
        }
        if name.text == SpaceClaim::Actions.name() {
            self.references.word(name.span, SpaceClaim::Actions);
            return (0..self.actions.len()).collect();
        }
        let groups = self.groups.iter().map(|group| group.name.as_str());
        let error = self.unknown(
            "action",
            &name.text,
            name.span,
            self.action_names.all().chain(groups).chain([SpaceClaim::Actions.name()]),
        );
        self.report(error);
        Vec::new()
    }

    /// Counts the rows of every action. Reports a table that would be too long, before it is made.
    pub(super) fn count_rows(&mut self, rules: &[RuleDef], roads: usize) {
        let mut total = 0_u64;
        // A count of 0 means that an axis is broken, which is reported where it is declared.
        let size = |action: &Option<ActionDef>| action.as_ref().map(product_size).filter(|count| *count > 0);
        self.row_counts = self.actions.iter().map(size).collect();
        for (action, count) in self.actions.iter().zip(&self.row_counts) {
            let (Some(action), Some(count)) = (action, *count) else { continue };
            total = total.saturating_add(count);
            if count > ROWS_MAX {
                let message = format!("`{}` multiplies to {count} rows", action.name);
                let axes = action.parameters.iter().filter(|parameter| parameter.axis);
                let axes: Vec<String> = axes.map(|parameter| parameter.name.to_string()).collect();
                let error = Diagnostic::error(code::TOO_MANY_ROWS, message)
                    .at(action.span, format!("the product of {}", listed(&axes)));
                self.report(error.help(format!("at most {ROWS_MAX} are possible; draw some with `any`")));
                return;
            }
        }
        if total > ROWS_MAX {
            let error =
                Diagnostic::error(code::TOO_MANY_ROWS, format!("the actions multiply to {total} rows"));
            self.report(error.help(format!("at most {ROWS_MAX} are possible")));
            return;
        }
        // Each row is proved on each road under each rule that binds it.
        let binding = rules_by_action(rules, self.actions.len());
        for (action, bound) in self.actions.iter().zip(&binding) {
            let Some(action) = action.as_ref().filter(|_| bound.len() > RULES_MAX) else { continue };
            let message = format!("{} rules bind `{}`", bound.len(), action.name);
            let error = Diagnostic::error(code::TOO_MUCH, message)
                .at(action.span, format!("at most {RULES_MAX} may bind an action"))
                .help("join rules by `and`, say them by `match` or a state, or make several actions of it");
            self.report(error);
            return;
        }
        let counts = self.row_counts.iter().zip(&binding);
        let work: u64 = counts
            .map(|(count, rules)| count.unwrap_or(0) * (1 + rules.len() as u64) * roads.max(1) as u64)
            .sum();
        if work > PROOFS_MAX {
            let message = format!("rows, rules and roads multiply to {work} proofs");
            let error = Diagnostic::error(code::TOO_MANY_ROWS, message);
            self.report(error.help(format!(
                "at most {PROOFS_MAX} are possible; draw some parameters with `any`, or bind fewer actions"
            )));
        }
    }
}

/// The operations of an effect. A spawn and an order count as one, because the rules about it cost far more.
fn operations_of(effect: &EffectDef) -> usize {
    match effect {
        EffectDef::Set(set) => 1 + set.key.iter().chain([&set.value]).map(Expr::operations).sum::<usize>(),
        EffectDef::Spawn(_) | EffectDef::Order(_) | EffectDef::Light(_) => 1,
    }
}

/// Every word that the expression can have as its value.
pub(super) fn possible<W: Copy>(word: &WordExpr<W>) -> Vec<W> {
    match word {
        WordExpr::Fixed(word) => vec![*word],
        WordExpr::Of(_, words) => words.clone(),
    }
}
