//! Rules: the actions that each rule binds, and its condition compiled for each of these actions.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::check::checker::{Checker, Doers};
use crate::check::expression::{Place, enum_of};
use crate::check::mistakes::Report;
use crate::check::names::docs;
use crate::check::names::unknown;
use crate::check::references::Symbol;
use crate::check::spawn::possible;
use crate::model::expr::{Expr, ExprKind};
use crate::model::rules::states_read;
use crate::model::vocabulary::{CHANGE, Field, Known, Site, Then, Verb};
use crate::model::{
    ActionDef, EnumIndex, Initial, RuleBinding, RuleBody, RuleDef, SetDef, SpawnDef, Type, WordExpr, code,
};
use crate::syntax::ast::ItemKind;
use crate::syntax::{Diagnostic, ast, listed};

/// Operations that a condition with a mistake counts as, because checking it takes time for each action, too.
const OPERATIONS_BROKEN: usize = 8;

impl Checker {
    pub(super) fn doers(&self) -> Doers {
        let mut doers = Doers { setters: vec![Vec::new(); self.states.len()], spawners: Vec::new() };
        for (index, action) in self.actions.iter().enumerate() {
            let Some(action) = action else { continue };
            action.sets().for_each(|set| doers.setters[set.state].push(index));
            doers.spawners.extend(action.spawns().map(|_| index));
        }
        doers
    }

    pub(super) fn rules(&mut self, items: &[&ast::Item]) -> Vec<RuleDef> {
        let doers = self.doers();
        let mut rules = Vec::new();
        for (item, declared) in self.declared("rule", items, ItemKind::as_rule).1 {
            let Some(body) = self.rule(declared, &doers) else { continue };
            let (name, span) = (declared.name.text.clone(), declared.name.span);
            let start = self.start_condition(&declared.body);
            rules.push(RuleDef { name, docs: docs(item), optional: declared.optional, body, start, span });
        }
        rules
    }

    pub(super) fn rule(&mut self, declared: &ast::Rule, doers: &Doers) -> Option<RuleBody> {
        match &declared.body {
            ast::RuleBody::Holds { on, during, condition } => {
                self.holds(declared, on, during.as_ref(), condition, doers)
            }
            ast::RuleBody::Moves { state, key, moves } => {
                self.moves(declared, state, key.as_ref(), moves, doers)
            }
        }
    }

    fn holds(
        &mut self,
        rule: &ast::Rule,
        on: &[ast::Name],
        during: Option<&ast::Name>,
        condition: &ast::Expr,
        doers: &Doers,
    ) -> Option<RuleBody> {
        if self.has_compiled_too_much(rule.name.span) {
            return None;
        }
        match during {
            Some(during) if during.text == CHANGE.0 => {
                self.references.note(during.span, Symbol::Engine(CHANGE.0, CHANGE.1), false);
            }
            Some(during) => return self.on_phases(rule, on, during, condition),
            None => {}
        }
        let site = Place {
            states: during.is_none(),
            site: during.map_or(Site::Rule, |_| Site::Change),
            ..Place::RULE
        };
        let mut targets = self.all_targets(on);
        for name in on.iter().filter(|name| !self.is_target(&name.text)).collect::<Vec<_>>() {
            self.look_at_condition(condition, &name.text);
        }
        if on.is_empty() {
            targets = match during {
                None => self.targets_of_global(rule, condition, doers)?,
                Some(_) => {
                    let may_change = |action: &usize| {
                        self.actions[*action].as_ref().is_some_and(|action| self.changes_lanes(action))
                    };
                    (0..self.actions.len()).filter(may_change).collect()
                }
            };
        }
        targets.sort_unstable();
        let lacking = self.lacking_parameters(&rule.name, &targets, condition);
        let mut bindings = Vec::new();
        for action in targets {
            // A broken action was reported where it is declared.
            let sound = self.actions[action].clone().filter(|_| !lacking.contains(&action));
            let Some(definition) = sound else {
                let name = self.action_names.name(action).unwrap_or_default().to_owned();
                self.look_at_condition(condition, &name);
                continue;
            };
            let is_whole = !self.half_broken.contains(&action);
            let found = self.binding((rule, during), condition, (&definition, is_whole), site);
            self.spent.compiled += condition_size(found.as_ref());
            bindings.extend(found.map(|condition| RuleBinding { action, condition }));
            if self.has_compiled_too_much(rule.name.span) {
                return None;
            }
        }
        if bindings.is_empty() && self.start_condition(&rule.body).is_none() {
            let help = "a rule without `on` binds the actions that spawn, or that set a state it names";
            self.binds_nothing(rule, help);
        }
        Some(if during.is_some() { RuleBody::During(bindings) } else { RuleBody::Holds(bindings) })
    }

    /// A rule on the moments at which phases of a manoeuvre begin.
    fn on_phases(
        &mut self,
        rule: &ast::Rule,
        on: &[ast::Name],
        during: &ast::Name,
        condition: &ast::Expr,
    ) -> Option<RuleBody> {
        let owner = Symbol::Manoeuvre(during.text.clone());
        self.references.uses(during.span, owner.clone());
        let Some(manoeuvre) = self.manoeuvre_names.get(&during.text) else {
            self.look_at_condition(condition, &during.text);
            let names = self.manoeuvre_names.all().chain([CHANGE.0]);
            let error = unknown("manoeuvre", &during.text, during.span, names);
            return self.reject(error);
        };
        let locals = self.references.locals(&owner);
        let definition = self.manoeuvres[manoeuvre].as_ref();
        let locals = definition.map_or(locals, |definition| definition.parameters.clone());
        let place = Place { locals: &locals, owner: Some(&owner), site: Site::Phase, ..Place::default() };
        let found = self.typed(condition, &place, Type::Bool);
        self.spent.compiled += condition_size(found.as_ref());
        // All that come to it.
        let before: Vec<usize> =
            (0..self.manoeuvres.len()).filter(|given| self.reached(*given).contains(&manoeuvre)).collect();
        let gives = |action: &Arc<ActionDef>| action.manoeuvres().any(|given| before.contains(&given));
        let mut actions = match on.is_empty() {
            true => (0..self.actions.len()).collect(),
            false => self.all_targets(on),
        };
        actions.sort_unstable();
        // If an action is broken, its own message already says why it gives the manoeuvre to no road user.
        let is_whole = |action: &&usize| !self.half_broken.contains(action);
        let mut whole = actions.iter().filter(is_whole).filter_map(|action| self.actions[*action].as_ref());
        if !on.is_empty()
            && let Some(action) = whole.find(|action| !gives(action))
        {
            let message = format!("nobody does `{}` because of `{}`", during.text, action.name);
            let error = Diagnostic::error(code::NO_SPAWN, message).at(rule.name.span, "never asked");
            let error = error.beside(action.span, "gives it to nobody");
            return self.reject(error.help("bind actions with `then` and this manoeuvre"));
        }
        actions.retain(|action| self.actions[*action].as_ref().is_some_and(gives));
        if actions.is_empty() {
            self.binds_nothing(rule, "give the manoeuvre to somebody: `then: …` in a spawn or an order");
        }
        Some(RuleBody::Phases { manoeuvre, condition: found?, actions })
    }

    /// The condition of a rule, compiled for one of its actions; `None` if the rule cannot bind this action.
    fn binding(
        &mut self,
        (rule, during): (&ast::Rule, Option<&ast::Name>),
        condition: &ast::Expr,
        (definition, is_whole): (&ActionDef, bool),
        site: Place<'_>,
    ) -> Option<Expr> {
        let locals = locals(definition);
        let owner = Symbol::Action(definition.name.clone());
        let place = Place { locals: &locals, owner: Some(&owner), ..site };
        let condition = self.typed(condition, &place, Type::Bool)?;
        if during.is_some() && !self.changes_lanes(definition) && is_whole {
            let message = format!("no road user of `{}` changes lanes", definition.name);
            let error = Diagnostic::error(code::NO_SPAWN, message).at(rule.name.span, "never asked");
            let help = "bind actions that let somebody change lanes: by `then`, by `lane` in an order or a phase, or by `Overtake` in its own lane";
            return self.reject(error.beside(definition.span, "changes no lanes").help(help));
        }
        self.warn_of_later(rule, definition, &condition, during);
        let asks_a_spawn = during.is_none() && condition.known() == Known::Spawn;
        if asks_a_spawn && definition.spawns().next().is_none() && is_whole {
            let message =
                format!("`{}` asks about a spawn, and `{}` has none", rule.name.text, definition.name);
            let error = Diagnostic::error(code::NO_SPAWN, message).at(condition.span, "needs a spawn");
            return self.reject(
                error.beside(definition.span, "spawns nothing").help("name other actions after `on`"),
            );
        }
        Some(condition)
    }

    /// Warns of a rule that ties a later lane change to the moment of the draw.
    fn warn_of_later(
        &mut self,
        rule: &ast::Rule,
        action: &ActionDef,
        condition: &Expr,
        during: Option<&ast::Name>,
    ) {
        if during.is_some() || !condition.asks_about_moment() {
            return;
        }
        let names = |expr: &Expr, local: usize| {
            expr.any(|kind| matches!(kind, ExprKind::Local(named) if *named == local))
        };
        let decides = |local: usize| {
            action.spawns().any(|spawn| matches!(&spawn.then, WordExpr::Of(then, _) if names(then, local)))
        };
        let mut locals = 0..action.parameters.len();
        let Some(local) = locals.find(|local| decides(*local) && names(condition, *local)) else { return };
        let parameter = &action.parameters[local].name;
        let message = format!("`{}` judges the draw, and the lane change comes later", rule.name.text);
        let warning = Diagnostic::warning(code::LATER, message)
            .at(condition.span, format!("`{parameter}` is carried out some time after this moment"));
        self.report(warning.help(format!("write `rule {} on … during change: …`", rule.name.text)));
    }

    /// The condition for the start of an episode, of a rule without `on` that asks only about states and the road.
    fn start_condition(&mut self, body: &ast::RuleBody) -> Option<Expr> {
        let ast::RuleBody::Holds { on, during, condition } = body else { return None };
        if !on.is_empty() || during.is_some() {
            return None;
        }
        let compiled = self.quietly(|checker| checker.typed(condition, &Place::RULE, Type::Bool))?;
        (compiled.reads_memory() && compiled.is_known_at_start()).then_some(compiled)
    }

    /// Reports a rule that binds no action, unless a broken declaration may be why.
    fn binds_nothing(&mut self, rule: &ast::Rule, help: &str) {
        if !self.has_errors() {
            let message = format!("`{}` binds no action", rule.name.text);
            let error = Diagnostic::error(code::BINDS_NOTHING, message);
            self.report(error.at(rule.name.span, "would never be enforced").help(help));
        }
    }

    /// Looks at a rule's condition for an action that it cannot bind.
    fn look_at_condition(&mut self, condition: &ast::Expr, action: &str) {
        let owner = Symbol::Action(action.to_owned());
        let locals = self.references.locals(&owner);
        let place = Place { locals: &locals, owner: Some(&owner), ..Place::RULE };
        self.look_at(condition, &place, Some(Type::Bool));
    }

    /// The actions that a rule without `on` binds. These are the actions that could break it: those that spawn,
    /// if the rule asks about spawns, and those that set a state which it reads. A rule that does neither, or asks for
    /// the time, binds all actions.
    fn targets_of_global(
        &mut self,
        rule: &ast::Rule,
        condition: &ast::Expr,
        doers: &Doers,
    ) -> Option<Vec<usize>> {
        let named = names_in(condition);
        let names_some = named.iter().any(|name| self.parameter_names.contains(&name.text));
        let parameter = self.actions.iter().flatten().filter(|_| names_some).find_map(|action| {
            let found = action.parameters.iter().find(|p| named.iter().any(|name| name.text == *p.name))?;
            Some((found.name.clone(), action.name.clone()))
        });
        let is_state = |name: &str| self.state_places.contains_key(name);
        if let Some((parameter, action)) = parameter.filter(|(name, _)| !is_state(name)) {
            self.look_at(condition, &Place::RULE, Some(Type::Bool));
            let named_at = named.iter().find(|name| name.text == *parameter).map(|name| name.span)?;
            let message = format!("`{}` names the parameter `{parameter}` but no action", rule.name.text);
            let error = Diagnostic::error(code::LACKING_PARAMETER, message)
                .at(named_at, "a parameter of which action?");
            return self.reject(error.help(format!("write `rule {} on {action}: …`", rule.name.text)));
        }
        let compiled = self.typed(condition, &Place::RULE, Type::Bool)?;
        let read: BTreeSet<usize> = states_read(&compiled, &self.states).into_iter().collect();
        let (known, reads_memory) = (compiled.known(), compiled.reads_memory());
        let each_step = known != Known::Spawn && self.each_step.iter().any(|set| read.contains(&set.state));
        // A condition that time may break has to be kept by every action.
        let timed = compiled.is_known_at_start() && compiled.asks_the_world();
        let open = each_step || timed || known != Known::Spawn && !reads_memory;
        let mut bound: BTreeSet<usize> = match open {
            true => (0..self.actions.len()).collect(),
            false => self.half_broken.clone(),
        };
        match known {
            Known::Spawn => bound.extend(&doers.spawners),
            // Where nothing spawns, nothing asks about a spawn.
            _ => bound.extend(read.iter().flat_map(|state| &doers.setters[*state])),
        }
        Some(bound.into_iter().filter(|index| self.actions[*index].is_some()).collect())
    }

    /// Reports a name that is a parameter of some actions but not of every bound action. Gives the bound actions
    /// that lack it.
    pub(super) fn lacking_parameters(
        &mut self,
        rule: &ast::Name,
        targets: &[usize],
        condition: &ast::Expr,
    ) -> BTreeSet<usize> {
        let mut lacking = BTreeSet::new();
        for name in names_in(condition) {
            let is_parameter =
                |action: &ActionDef| action.parameters.iter().any(|parameter| *parameter.name == *name.text);
            let known_elsewhere = self.state_places.contains_key(&name.text)
                || self.constant_places.contains_key(&name.text)
                || !self.references.owners(&name.text).is_empty();
            if known_elsewhere || !self.parameter_names.contains(&name.text) {
                continue;
            }
            let without: Vec<usize> = targets
                .iter()
                .copied()
                .filter(|action| self.actions[*action].as_ref().is_some_and(|action| !is_parameter(action)))
                .collect();
            if without.is_empty() {
                continue;
            }
            let names: Vec<&str> =
                without.iter().filter_map(|a| self.actions[*a].as_ref()).map(|a| a.name.as_str()).collect();
            let verb = if names.len() == 1 { "has" } else { "have" };
            let message =
                format!("rule `{}` names `{}`, which {} {verb} not", rule.text, name.text, listed(&names));
            let error = Diagnostic::error(code::LACKING_PARAMETER, message)
                .at(name.span, "not a parameter of every action it binds");
            self.report(
                error.beside(rule.span, "").help("bind only actions that have it, or give it to the others"),
            );
            lacking.extend(without);
        }
        lacking
    }

    fn moves(
        &mut self,
        rule: &ast::Rule,
        state: &ast::Name,
        key: Option<&ast::Name>,
        moves: &[ast::Move],
        doers: &Doers,
    ) -> Option<RuleBody> {
        let index = self.state_named(state);
        let definition = index.map(|index| self.states[index].clone());
        let of = enum_of(definition.as_ref().map(|state| state.ty));
        let keys = definition.as_ref().and_then(|state| state.key);
        key.into_iter().for_each(|key| self.references.variant(key, keys.map(|of| of.0)));
        if of.is_none() {
            let named = moves.iter().flat_map(|line| line.to.iter().chain([&line.from]));
            named.for_each(|name| self.references.variant(name, None));
        }
        let (index, definition) = (index?, definition?);
        let Some(of) = of else {
            let message = format!("transitions are for states of an enum, and `{}` is none", state.text);
            let error = Diagnostic::error(code::TYPE_MISMATCH, message);
            return self.reject(
                error.at(state.span, "its values must be those of an enum").beside(definition.span, ""),
            );
        };
        let position = match (key, keys) {
            (None, None) => 0,
            (Some(key), Some(keys)) => self.variant(key, keys.0)?,
            (None, Some(keys)) => {
                let example = self.enums[keys.0].variants.first().cloned().unwrap_or_default();
                let error = Diagnostic::error(code::TYPE_MISMATCH, format!("`{}` is a map", state.text));
                let error = error.at(state.span, "a key is missing").beside(definition.span, "");
                return self.reject(error.help(format!("write `{}[{example}]`", state.text)));
            }
            (Some(key), None) => {
                let message = format!("`{}` is not a map", state.text);
                let error = Diagnostic::error(code::TYPE_MISMATCH, message);
                return self.reject(error.at(key.span, "takes no key").beside(definition.span, ""));
            }
        };
        let variants = self.enums[of].variants.clone();
        let mut allowed = vec![vec![false; variants.len()]; variants.len()];
        let mut sound = true;
        for line in moves {
            let from = self.variant(&line.from, of);
            let to: Vec<Option<usize>> = line.to.iter().map(|to| self.variant(to, of)).collect();
            for to in to {
                match (from, to) {
                    (Some(from), Some(to)) => allowed[from][to] = true,
                    _ => sound = false,
                }
            }
        }
        if !sound {
            return None;
        }
        let begins = |variant: usize| match definition.initial.get(position) {
            Some(Initial::Value(initial)) => initial.kind == ExprKind::Variant(EnumIndex(of), variant),
            Some(Initial::Any) | None => true,
        };
        self.check_graph(rule, &variants, &allowed, &begins);
        let may_set = |set: &SetDef| match set.key.as_ref().map(|key| &key.kind) {
            Some(ExprKind::Variant(_, other)) => set.state == index && *other == position,
            _ => set.state == index,
        };
        let is_sound = |action: &usize| self.actions[*action].is_some();
        let sets =
            |action: &usize| self.actions[*action].as_ref().is_some_and(|action| action.sets().any(may_set));
        let actions: BTreeSet<usize> = match self.each_step.iter().any(may_set) {
            true => (0..self.actions.len()).filter(is_sound).collect(),
            false => doers.setters[index].iter().copied().filter(sets).collect(),
        };
        let actions: Vec<usize> = actions.into_iter().collect();
        if actions.is_empty() {
            let key = key.map_or(String::new(), |key| format!("[{}]", key.text));
            let what = format!("`{}{key}`", definition.name);
            self.binds_nothing(rule, &format!("no action sets {what}: give one the effect"));
        }
        Some(RuleBody::Moves { state: index, cell: definition.first_cell + position, allowed, actions })
    }

    /// Position of a variant of an enum.
    pub(super) fn variant(&mut self, name: &ast::Name, of: usize) -> Option<usize> {
        self.references.variant(name, Some(of));
        let names = || self.enums[of].variants.iter().map(String::as_str);
        let found = names().position(|variant| variant == name.text);
        let error = found.is_none().then(|| unknown("variant", &name.text, name.span, names()));
        error.into_iter().for_each(|error| self.report(error));
        found
    }

    /// Whether a road user of an action may be told to change lanes.
    fn changes_lanes(&self, action: &ActionDef) -> bool {
        let by_spawn = |spawn: &SpawnDef| {
            possible(&spawn.then).contains(&Then::Change) || possible(&spawn.verb).contains(&Verb::Overtake)
        };
        action.spawns().any(by_spawn)
            || action.orders().any(|order| order.command.says(Field::Lane))
            || action
                .manoeuvres()
                .any(|manoeuvre| self.has_command(manoeuvre, |command| command.says(Field::Lane)))
    }

    /// Reports a value from which no move is allowed, and a value to which no other value may move and with which no
    /// episode begins.
    fn check_graph(
        &mut self,
        rule: &ast::Rule,
        variants: &[String],
        allowed: &[Vec<bool>],
        begins: &dyn Fn(usize) -> bool,
    ) {
        let rows = |test: &dyn Fn(usize) -> bool| -> Vec<&str> {
            (0..variants.len()).filter(|v| test(*v)).map(|v| variants[v].as_str()).collect()
        };
        let stuck = rows(&|from| !allowed[from].contains(&true));
        if !stuck.is_empty() {
            let message = format!("rule `{}` says nothing of {}", rule.name.text, listed(&stuck));
            let error = Diagnostic::error(code::DEADLOCK, message)
                .at(rule.name.span, "from there no move is allowed, not even to stay");
            let (from, to) = (stuck[0], first_other(variants, stuck[0]));
            self.report(error.help(match from == to {
                true => format!("add `{from} -> {from}`"),
                // Staying is named last, because the author of `Free -> Braked` hardly wants braking without end.
                false => format!(
                    "add a move to go on with, for example `{from} -> {to}`; `{from} -> {from}` would let what sets \
                     it happen again and again"
                ),
            }));
        }
        let is_led_to = |to: usize| (0..variants.len()).any(|from| from != to && allowed[from][to]);
        let unreachable = rows(&|to| !is_led_to(to) && !begins(to));
        if !unreachable.is_empty() && variants.len() > 1 {
            let message = format!("rule `{}` never leads to {}", rule.name.text, listed(&unreachable));
            let warning = Diagnostic::warning(code::UNREACHABLE, message)
                .at(rule.name.span, "no episode begins there either");
            let (from, to) = (first_other(variants, unreachable[0]), unreachable[0]);
            self.report(warning.help(format!("add a move to it, for example `{from} -> {to}`")));
        }
    }
}

/// The operations of a condition, or what stands for those of one with a mistake.
fn condition_size(condition: Option<&Expr>) -> usize {
    condition.map_or(OPERATIONS_BROKEN, Expr::operations)
}

/// Another variant than `value`, if there is one.
fn first_other<'a>(variants: &'a [String], value: &'a str) -> &'a str {
    variants.iter().map(String::as_str).find(|other| *other != value).unwrap_or(value)
}

/// The parameters of an action, as an expression sees them.
pub fn locals(action: &ActionDef) -> Vec<(String, Type)> {
    action.parameters.iter().map(|parameter| (parameter.name.to_string(), parameter.ty)).collect()
}

/// Every bare name in an expression, in order.
pub(super) fn names_in(expr: &ast::Expr) -> Vec<ast::Name> {
    match &expr.kind {
        ast::ExprKind::Name(name) => vec![ast::Name::new(name.clone(), expr.span)],
        // The base of a field is the word `road`, not a variable.
        ast::ExprKind::Field { .. } => Vec::new(),
        _ => expr.parts().into_iter().flat_map(names_in).collect(),
    }
}
