//! Actions and groups: parameters with their domains, effects with the engine's words.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::check::checker::{Checker, each, literal};
use crate::check::declaration::unknown_word;
use crate::check::expression::{NUMBER_MAX, Place, is_beyond_states, is_number};
use crate::check::mistakes::{Report, all_of, as_written, field};
use crate::check::names::docs;
use crate::check::operator::with_range;
use crate::check::references::{PARAMETERS_MAX, Symbol};
use crate::check::rule::locals;
use crate::model::expr::Expr;
use crate::model::field::WordKind;
use crate::model::rules::rules_by_action;
use crate::model::vocabulary::{LIGHT, LightColour, LightField, Site, SpaceClaim, Word};
use crate::model::{
    ActionDef, Domain, EffectDef, GroupDef, LightDef, Parameter, RuleDef, SetDef, Type, Value, WordExpr, code,
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
            self.actions.push(action.map(Arc::new));
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
        let spawns = declared.effects.iter().filter_map(ast::Effect::spawn);
        let spawns: usize = spawns.map(|spawn| spawn.bearers.len().max(1)).sum();
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
            odds: None,
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
            self.spent.listed += values.len();
            if self.spent.listed > LISTED_MAX {
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

    /// Compiles an effect; gives several if it spawns a row of road users.
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
            ast::EffectKind::Spawn(spawn) => self.spawns(spawn, place, effect.span),
        }
    }

    /// Reads an order to the ego vehicle's next traffic light.
    fn light(&mut self, fields: &[ast::Field], place: &Place<'_>, span: Span) -> Option<LightDef> {
        self.note_fields(fields, LightField::ALL, place);
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

    /// A word of the engine.
    pub(super) fn word<W: Word>(
        &mut self,
        kind: &'static str,
        expr: &ast::Expr,
        place: &Place<'_>,
    ) -> Option<WordExpr<W>> {
        let word = |place: u8| W::ALL[usize::from(place)];
        Some(match self.word_among(WordKind::of::<W>(kind), expr, place)? {
            WordExpr::Fixed(one) => WordExpr::Fixed(word(one)),
            WordExpr::Of(expr, words) => WordExpr::Of(expr, words.into_iter().map(word).collect()),
        })
    }

    /// A word of the engine of that kind, by its place among those.
    pub(super) fn word_among(
        &mut self,
        kind: WordKind,
        expr: &ast::Expr,
        place: &Place<'_>,
    ) -> Option<WordExpr<u8>> {
        let words = (kind.words)();
        let named = |name: &str| (0..).zip(&words).find(|(_, (word, _))| *word == name);
        let known = |_: &Checker, name: &str, span| {
            let names = words.iter().map(|(word, _)| *word);
            named(name).map(|(nth, _)| nth).ok_or_else(|| unknown_word(kind.called, name, names, span))
        };
        let note = |checker: &mut Checker, span, name: &str| {
            named(name).iter().for_each(|(_, word)| checker.references.engine(span, **word));
        };
        self.word_or_enum(kind.called, expr, place, known, note)
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
            self.spent.members += actions.len();
            if self.spent.members > MEMBERS_MAX {
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
                let known = self.actions[action].as_mut().map(Arc::make_mut);
                known.into_iter().for_each(|known| known.effects.push(effect.clone()));
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
                    self.spent.compiled += operations_of(&effect);
                    added.push((action, effect));
                }
            }
            if self.spent.compiled > COMPILED_MAX {
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
        let is_passed = self.spent.compiled > COMPILED_MAX;
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
        let size =
            |action: &Option<Arc<ActionDef>>| action.as_deref().map(product_size).filter(|count| *count > 0);
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
