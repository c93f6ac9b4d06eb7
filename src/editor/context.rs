//! The completions that fit at a place. `syntax::unfinished` puts its own name into the tree there, and these are the kinds
//! of names that fit. If no name fits, they are the keywords that the grammar expects.

use avastra_base::units::Dimension;
use avastra_lang::check::{Declaration, References, Symbol};
use avastra_lang::model::Type;
use avastra_lang::model::vocabulary::{
    BREACHED, BodyClass, CHANGE, EpisodeField, Fact, Field as ToldField, KEPT, Known, LIGHT, LightField,
    MARGIN, PointField, RECURRENCE, ROAD_USER, RoadField, SINCE, ScenarioClaim, Site, SpaceClaim, StartField,
    StopReason, THERE, TrajectoryField, WAIT, Word, parts_of, parts_of_named, things,
};
use avastra_lang::syntax::ast::{
    Action, ActionParam, Arm, BinaryOp, Call, Clause, ClauseKind, Effect, EffectKind, Expr, ExprKind, Field,
    Initial, ItemKind, Name, Phase, Policy, Rule, RuleBody, Scenario, Spawn, State, Step,
    Type as WrittenType, TypeKind,
};
use avastra_lang::syntax::{HERE, Unfinished, unfinished};

use super::words::{self, Entry};

/// A kind of thing that can be written at a place.
#[derive(Debug, Clone, PartialEq)]
pub enum Kind {
    Declarations,
    /// Words of the language or the engine.
    Words(Vec<Entry>),
    Keyword(&'static str),
    Types,
    Enums,
    /// The bodies of the engine, and those that are declared.
    Bodies,
    Units,
    Actions,
    Groups,
    Trajectories,
    Manoeuvres,
    /// Names that spawns give.
    RoadUsers,
    States,
    Roads,
    Rules,
    Verdicts,
    Requirements,
    Functions,
    Constants,
    /// The parts of an expression; the variants of this type come first.
    Value(Option<Type>),
    Operators,
    /// Variants of an enum.
    Variants(String),
    /// A parameter, its type, and whether this is the wanted type.
    Local(String, Option<Type>, bool),
    /// Parameters of an action: the axes if `true`, else the drawn ones.
    Parameters(String, bool),
    /// Files with this extension, and the path that is written so far.
    Files(&'static str, String),
}

/// The kinds that fit at a byte, and the start of the word that a proposal would replace.
pub fn wanted(references: &References, text: &str, byte: usize) -> (Vec<Kind>, usize) {
    let found = unfinished(text, byte);
    let start = found.start;
    let line_start = text[..start].rfind('\n').map_or(0, |newline| newline + 1);
    let fresh_line = text[line_start..start].trim().is_empty();
    let mut kinds = match &found.tree {
        Some(tree) => {
            let written = text.get(start..byte).unwrap_or_default();
            Place::new(references, tree, written).kinds(tree).unwrap_or_default()
        }
        None => keywords(&found, fresh_line),
    };
    // A declaration may begin on every line without indentation, whatever the author has left open above it.
    if start == line_start || found.begins_declaration && fresh_line {
        kinds.insert(0, Kind::Declarations);
    }
    (kinds, start)
}

/// Bodies where several may be listed.
fn bodies_together() -> Vec<Kind> {
    vec![Kind::Bodies, Kind::Words(words::of::<BodyClass>())]
}

/// The completions where no name may stand.
fn keywords(found: &Unfinished, fresh_line: bool) -> Vec<Kind> {
    let mut kinds: Vec<Kind> = found.keywords.iter().map(|word| Kind::Keyword(word)).collect();
    // A scenario's first part is `road`. Its other parts are shown too, so that an author sees what there is.
    if found.keywords.contains(&"origin") && found.keywords.contains(&"road") {
        kinds.extend(["start", "steps", "expect"].map(Kind::Keyword));
    }
    if found.continues_expression && (!fresh_line || kinds.is_empty()) {
        kinds.push(Kind::Operators);
    }
    kinds
}

/// The kinds of names that the declaration after `override` and a keyword may replace.
fn replaceable(item: &ItemKind) -> Vec<Kind> {
    match item {
        ItemKind::Enum(_) | ItemKind::Odds(_) => vec![Kind::Enums],
        ItemKind::State(_) => vec![Kind::States],
        ItemKind::Let(_) => vec![Kind::Constants],
        ItemKind::Fn(_) => vec![Kind::Functions],
        ItemKind::Manoeuvre(_) => vec![Kind::Manoeuvres],
        ItemKind::Action(_) => vec![Kind::Actions],
        ItemKind::Group(_) => vec![Kind::Groups],
        ItemKind::Rule(_) => vec![Kind::Rules],
        ItemKind::Require(_) => vec![Kind::Requirements],
        ItemKind::Trajectory(_) => vec![Kind::Trajectories],
        ItemKind::Road(_) => vec![Kind::Roads],
        ItemKind::Verdict(_) => vec![Kind::Verdicts],
        _ => Vec::new(),
    }
}

fn is_here(name: &Name) -> bool {
    name.text == HERE
}

fn is_named_here(expr: &Expr) -> bool {
    matches!(&expr.kind, ExprKind::Name(name) if name == HERE)
}

fn any_here(names: &[Name]) -> bool {
    names.iter().any(is_here)
}

/// The name that an expression is.
fn name_of(expr: &Expr) -> Option<&str> {
    match &expr.kind {
        ExprKind::Name(name) => Some(name),
        _ => None,
    }
}

/// The fields that a block does not have yet.
fn unused<W: Word>(fields: &[Field], of: &[W]) -> Vec<Kind> {
    let is_left = |word: &&W| fields.iter().all(|field| field.name.text != word.name());
    vec![Kind::Words(of.iter().filter(is_left).map(|word| (word.name(), word.meaning())).collect())]
}

/// The subject of the expressions in a declaration.
#[derive(Debug, Clone, Copy, PartialEq)]
enum About {
    Value,
    Rule,
    /// A reward, a verdict, a requirement, what every step does, or the odds of actions.
    Facts(Site),
    /// A claim about the space.
    Space,
    /// A claim about a scenario.
    Scenario,
}

/// A declaration with [`HERE`] in it.
struct Place<'a> {
    references: &'a References,
    /// The written part of the text literal at the place.
    written: &'a str,
    about: About,
    /// The parameters that an expression can name.
    locals: Vec<(String, Option<Type>)>,
}

impl<'a> Place<'a> {
    fn new(references: &'a References, item: &ItemKind, written: &'a str) -> Place<'a> {
        let about = match item.plain() {
            ItemKind::Rule(_) | ItemKind::Manoeuvre(_) => About::Rule,
            ItemKind::Reward(_) => About::Facts(Site::Reward),
            ItemKind::Verdict(_) => About::Facts(Site::Verdict),
            ItemKind::Require(of) if of.on.is_empty() => About::Facts(Site::Requirement),
            ItemKind::Require(_) => About::Facts(Site::RequirementOn),
            ItemKind::EachStep(_) => About::Facts(Site::StepBegins),
            ItemKind::Odds(of) if of.name.text == SpaceClaim::Actions.name() => {
                About::Facts(Site::StepBegins)
            }
            ItemKind::Expect(_) => About::Space,
            ItemKind::Scenario(_) => About::Scenario,
            _ => About::Value,
        };
        let mut place = Place { references, written, about, locals: Vec::new() };
        place.locals = place.locals_of(item.plain());
        place
    }

    /// The kinds that fit; `None` if nothing is known of the place.
    fn kinds(&self, item: &ItemKind) -> Option<Vec<Kind>> {
        let bool = Some(Type::Bool);
        match item {
            ItemKind::Override(inner) if inner.name().is_some_and(is_here) => Some(replaceable(inner)),
            ItemKind::Override(inner) => self.kinds(inner),
            ItemKind::Use(of) if of.path.value == HERE => {
                Some(vec![Kind::Files("ava", self.written.to_owned())])
            }
            ItemKind::Use(of) => any_here(&of.without)
                .then(|| vec![Kind::Actions, Kind::Groups, Kind::Rules, Kind::Requirements]),
            ItemKind::Odds(of) if is_here(&of.name) => Some(vec![Kind::Enums]),
            ItemKind::Odds(of) => {
                let rows = of.name.text == SpaceClaim::Actions.name();
                let actions = || vec![Kind::Actions, Kind::Groups];
                let variants = || vec![Kind::Variants(of.name.text.clone())];
                self.arms(&of.arms, || if rows { actions() } else { variants() }, None)
            }
            ItemKind::State(of) => self.in_state(of),
            ItemKind::Let(of) => self.within(&of.value, None, None),
            ItemKind::Fn(of) => {
                let mut types = of.params.iter().map(|param| &param.ty).chain([&of.result]);
                let result = self.written_type(&of.result);
                types.find_map(|ty| self.in_type(ty)).or_else(|| self.within(&of.body, result, result))
            }
            ItemKind::Manoeuvre(of) => {
                let ty = of.params.iter().find_map(|param| self.in_type(&param.ty));
                let repeat = || of.repeat.as_ref().and_then(|times| self.within(times, None, None));
                ty.or_else(repeat).or_else(|| of.phases.iter().find_map(|phase| self.in_phase(phase)))
            }
            ItemKind::Action(of) => self.in_action(of),
            ItemKind::Group(of) => any_here(&of.members).then(|| vec![Kind::Actions, Kind::Groups]),
            ItemKind::Also(of) if any_here(&of.on) => Some(vec![Kind::Actions, Kind::Groups]),
            ItemKind::Also(of) => self.in_effects(&of.effects),
            ItemKind::EachStep(effects) => self.in_effects(effects),
            ItemKind::Rule(of) => self.in_rule(of),
            ItemKind::Body(of) => self.units(&of.fields),
            ItemKind::Trajectory(of) => self.in_trajectory(&of.fields),
            ItemKind::Road(of) => self.in_road(&of.fields),
            ItemKind::Episode(fields) => self.in_episode(fields),
            ItemKind::Reward(cases) => cases.iter().find_map(|case| {
                let condition = case.condition.as_ref().and_then(|when| self.within(when, None, None));
                condition.or_else(|| self.within(&case.value, None, None))
            }),
            ItemKind::Require(of) if any_here(&of.on) => Some(bodies_together()),
            ItemKind::Require(of) => of.parts().find_map(|part| self.within(part, None, None)),
            ItemKind::Verdict(of) => self.within(&of.condition, None, None),
            ItemKind::Expect(of) => self.within(&of.claim, bool, bool),
            ItemKind::Scenario(of) => self.in_scenario(of),
            ItemKind::Policy(of) => self.in_policy(of),
            ItemKind::Language(_) | ItemKind::Enum(_) => None,
        }
    }

    fn in_type(&self, ty: &WrittenType) -> Option<Vec<Kind>> {
        match &ty.kind {
            TypeKind::Named(name) => is_here(name).then(|| vec![Kind::Types]),
            TypeKind::Map { value, .. } => is_here(value).then(|| vec![Kind::Enums]),
        }
    }

    fn in_state(&self, state: &State) -> Option<Vec<Kind>> {
        let ty = self.written_type(&state.ty);
        let initial = |value: &Expr| self.word_or_value(Kind::Keyword("any"), value, ty);
        self.in_type(&state.ty).or_else(|| match &state.initial {
            Initial::Any => None,
            Initial::Value(value) => initial(value),
            Initial::Keys(keys) => keys.iter().find_map(|key| match (&key.key, &state.ty.kind) {
                (Some(name), TypeKind::Map { key: of, .. }) if is_here(name) => {
                    Some(vec![Kind::Variants(of.text.clone()), Kind::Keyword("_")])
                }
                _ => key.value.as_ref().and_then(initial),
            }),
        })
    }

    fn in_action(&self, action: &Action) -> Option<Vec<Kind>> {
        let parameter = |param: &ActionParam| {
            let ty = self.written_type(&param.ty);
            let mut values = param.within.iter().chain(&param.condition);
            self.in_type(&param.ty).or_else(|| values.find_map(|value| self.within(value, ty, ty)))
        };
        action.params.iter().find_map(parameter).or_else(|| self.in_effects(&action.effects))
    }

    fn in_effects(&self, effects: &[Effect]) -> Option<Vec<Kind>> {
        effects.iter().find_map(|effect| match &effect.kind {
            EffectKind::Set { state, .. } if is_here(state) => Some(vec![Kind::States]),
            EffectKind::Set { state, key, value } => {
                let known = self.state(&state.text);
                let of_key = known.and_then(|state| state.key).map(Type::Enum);
                let key = key.as_ref().and_then(|key| self.within(key, of_key, None));
                key.or_else(|| self.within(value, known.and_then(|state| state.ty), None))
            }
            EffectKind::Order { who, .. } if is_here(who) => {
                Some(self.road_users().into_iter().chain([Kind::Words(vec![LIGHT])]).collect())
            }
            EffectKind::Order { who, fields } if who.text == LIGHT.0 => fields.iter().find_map(|field| {
                if is_here(&field.name) {
                    return Some(unused(fields, LightField::ALL));
                }
                let words = Kind::Words(words::light_words(&field.name.text));
                self.word_or_value(words, &field.value, None)
            }),
            EffectKind::Order { fields, .. } => fields.iter().find_map(|field| match is_here(&field.name) {
                true => Some(unused(fields, &ToldField::of_orders())),
                false => self.in_command(field),
            }),
            EffectKind::Spawn(spawn) if spawn.of.as_ref().is_some_and(is_here) => Some(self.road_users()),
            EffectKind::Spawn(spawn) => {
                let Spawn { body, place, distance, apart, cover, fields, .. } = &**spawn;
                let mut bodies = [Some(body), cover.as_ref()].into_iter().flatten();
                bodies
                    .find_map(|body| self.word_or_value(Kind::Bodies, body, None))
                    .or_else(|| self.word_or_value(Kind::Trajectories, place.trajectory()?, None))
                    .or_else(|| self.within(distance, None, None))
                    .or_else(|| self.within(apart.as_ref()?, None, None))
                    .or_else(|| self.in_spawn(fields))
            }
        })
    }

    /// The names of road users, and the parameters that hold one.
    fn road_users(&self) -> Vec<Kind> {
        let given = self.locals.iter().filter(|(_, ty)| self.is_road_user(*ty));
        let given = given.map(|(name, ty)| Kind::Local(name.clone(), *ty, true));
        given.chain([Kind::RoadUsers]).collect()
    }

    fn is_road_user(&self, ty: Option<Type>) -> bool {
        ty.and_then(|ty| self.references.enum_of(ty)).is_some_and(|of| of.name == ROAD_USER.0)
    }

    fn in_phase(&self, phase: &Phase) -> Option<Vec<Kind>> {
        let clauses = [
            (&phase.once, Some(Type::Bool)),
            (&phase.held, None),
            (&phase.within, None),
            (&phase.after, None),
            (&phase.only_if, Some(Type::Bool)),
        ];
        let clause = |(clause, ty): (&Option<Expr>, Option<Type>)| self.within(clause.as_ref()?, ty, ty);
        let of_field = |field: &Field| match is_here(&field.name) {
            true => Some(unused(&phase.fields, &ToldField::of_orders())),
            false => self.in_command(field),
        };
        clauses.into_iter().find_map(clause).or_else(|| phase.fields.iter().find_map(of_field))
    }

    /// In the value of a field of an order or a phase.
    fn in_command(&self, field: &Field) -> Option<Vec<Kind>> {
        match ToldField::from_name(&field.name.text) {
            Some(ToldField::Then) => self.word_or_value(Kind::Manoeuvres, &field.value, None),
            Some(ToldField::To) => self.word_or_value(Kind::RoadUsers, &field.value, None),
            _ => {
                let words = Kind::Words(words::engine_words(&field.name.text));
                self.word_or_value(words, &field.value, None)
            }
        }
    }

    fn in_spawn(&self, fields: &[Field]) -> Option<Vec<Kind>> {
        fields.iter().find_map(|field| {
            if is_here(&field.name) {
                return Some(unused(fields, &ToldField::of_spawns()));
            }
            let words = Kind::Words(words::engine_words(&field.name.text));
            self.word_or_value(words, &field.value, None)
        })
    }

    fn in_rule(&self, rule: &Rule) -> Option<Vec<Kind>> {
        match &rule.body {
            RuleBody::Holds { on, .. } if any_here(on) => {
                Some(vec![Kind::Actions, Kind::Groups, Kind::States])
            }
            RuleBody::Holds { during: Some(during), .. } if is_here(during) => {
                Some(vec![Kind::Words(vec![CHANGE]), Kind::Manoeuvres])
            }
            RuleBody::Holds { condition, .. } => self.within(condition, Some(Type::Bool), Some(Type::Bool)),
            RuleBody::Moves { state, key, moves } => {
                let state = self.state(&state.text)?;
                if key.as_ref().is_some_and(is_here) {
                    return self.variants(Type::Enum(state.key?)).map(|kind| vec![kind]);
                }
                let is_moved = moves.iter().any(|step| is_here(&step.from) || any_here(&step.to));
                let ty = state.ty.filter(|_| is_moved && state.key.is_some() == key.is_some())?;
                self.variants(ty).map(|kind| vec![kind])
            }
        }
    }

    fn in_road(&self, fields: &[Field]) -> Option<Vec<Kind>> {
        fields
            .iter()
            .find_map(|field| match (field.name.text.as_str(), &field.value.kind) {
                (HERE, _) => Some(unused(fields, RoadField::ALL)),
                ("map", ExprKind::Text(path)) if path == HERE => {
                    Some(vec![Kind::Files("xodr", self.written.to_owned())])
                }
                ("start" | "goal", ExprKind::Name(name)) if name == HERE => Some(vec![Kind::Keyword("lane")]),
                _ => None,
            })
            .or_else(|| self.units(fields))
    }

    fn in_trajectory(&self, fields: &[Field]) -> Option<Vec<Kind>> {
        let in_point = |point: &Expr| match &point.kind {
            ExprKind::Name(name) if name == HERE => Some(vec![Kind::Keyword("lane")]),
            ExprKind::Record(fields) => fields.iter().find_map(|field| match &field.value.kind {
                _ if is_here(&field.name) => Some(unused(fields, PointField::ALL)),
                ExprKind::Name(name) if name == HERE && field.name.text == PointField::At.name() => {
                    Some(vec![Kind::Keyword("lane")])
                }
                _ => self.units(core::slice::from_ref(field)),
            }),
            _ => None,
        };
        fields.iter().find_map(|field| match &field.value.kind {
            _ if is_here(&field.name) => Some(unused(fields, TrajectoryField::ALL)),
            ExprKind::Name(name) if name == HERE && field.name.text == TrajectoryField::Road.name() => {
                Some(vec![Kind::Roads])
            }
            ExprKind::List(points) => points.iter().find_map(in_point),
            _ => None,
        })
    }

    fn in_episode(&self, fields: &[Field]) -> Option<Vec<Kind>> {
        let of_field = |field: &Field| match (field.name.text.as_str(), &field.value.kind) {
            (HERE, _) => Some(unused(fields, EpisodeField::ALL)),
            (_, ExprKind::List(items)) if items.iter().any(is_named_here) => Some(vec![Kind::Roads]),
            ("stop", _) if self.holds_here(&field.value) => {
                Some(vec![Kind::Words(words::of::<StopReason>())])
            }
            _ => None,
        };
        self.units(fields).or_else(|| fields.iter().find_map(of_field))
    }

    fn in_scenario(&self, scenario: &Scenario) -> Option<Vec<Kind>> {
        if is_here(&scenario.road) {
            return Some(vec![Kind::Roads]);
        }
        let claim = || {
            scenario.expects.iter().find_map(|expect| {
                let clause = || expect.clauses.iter().find_map(|clause| self.in_clause(clause));
                self.within(&expect.claim, None, None).or_else(clause)
            })
        };
        scenario
            .start
            .iter()
            .find_map(|field| self.in_start(field))
            .or_else(|| scenario.steps.iter().find_map(|step| self.in_step(step)))
            .or_else(claim)
    }

    fn in_start(&self, field: &Field) -> Option<Vec<Kind>> {
        if is_here(&field.name) {
            return Some(vec![Kind::States, Kind::Words(words::of::<StartField>())]);
        }
        let state = self.state(&field.name.text);
        let ty = state.and_then(|state| state.ty);
        let ExprKind::Record(keys) = &field.value.kind else { return self.plain_value(&field.value, ty) };
        keys.iter().find_map(|entry| match is_here(&entry.name) {
            true => Some(self.variants(Type::Enum(state?.key?)).into_iter().collect()),
            false => self.plain_value(&entry.value, ty),
        })
    }

    fn in_step(&self, step: &Step) -> Option<Vec<Kind>> {
        if is_here(&step.action.name) {
            return Some(vec![Kind::Actions, Kind::Words(vec![WAIT])]);
        }
        let called = &step.action.name.text;
        let drawn = |field: &Field| match is_here(&field.name) {
            true => Some(vec![Kind::Parameters(called.clone(), false)]),
            false => self.plain_value(&field.value, self.parameter_type(called, &field.name.text)),
        };
        let moment = Place { about: About::Facts(Site::Trigger), locals: Vec::new(), ..*self };
        let (bool, time) = (Some(Type::Bool), Some(Type::Quantity(Dimension::DURATION)));
        let mut times = step.held.iter().chain(&step.after);
        self.in_row(&step.action)
            .or_else(|| step.drawn.iter().find_map(drawn))
            .or_else(|| moment.within(step.once.as_ref()?, bool, bool))
            .or_else(|| times.find_map(|expr| self.plain_value(expr, time)))
    }

    /// Within `with`, `at` or `by` of a claim.
    fn in_clause(&self, clause: &Clause) -> Option<Vec<Kind>> {
        match (&clause.kind, &clause.value.kind) {
            (ClauseKind::By, ExprKind::List(drivers)) if drivers.iter().any(is_named_here) => {
                Some(vec![Kind::Words(words::drivers())])
            }
            _ => self.plain_value(&clause.value, None),
        }
    }

    /// Within the arguments of an action: `drive_ahead(lane: Left)`.
    fn in_row(&self, call: &Call) -> Option<Vec<Kind>> {
        call.args.iter().find_map(|arg| match &arg.name {
            Some(name) => self.plain_value(&arg.value, self.parameter_type(&call.name.text, &name.text)),
            None => is_named_here(&arg.value).then(|| vec![Kind::Parameters(call.name.text.clone(), true)]),
        })
    }

    fn in_policy(&self, policy: &Policy) -> Option<Vec<Kind>> {
        let bool = Some(Type::Bool);
        policy.rules.iter().find_map(|line| {
            let condition = line.condition.as_ref().and_then(|when| self.within(when, bool, bool));
            condition.or_else(|| {
                line.actions.iter().find_map(|call| match is_here(&call.name) {
                    true => Some(vec![Kind::Actions]),
                    false => self.in_row(call),
                })
            })
        })
    }

    /// Within a value in whose place these words may stand, too.
    fn word_or_value(&self, words: Kind, value: &Expr, ty: Option<Type>) -> Option<Vec<Kind>> {
        let kinds = self.within(value, ty, ty)?;
        Some(if is_named_here(value) { [vec![words], kinds].concat() } else { kinds })
    }

    /// Within a value that is about nothing else, as in a start.
    fn plain_value(&self, expr: &Expr, ty: Option<Type>) -> Option<Vec<Kind>> {
        let plain = Place { about: About::Value, locals: Vec::new(), ..*self };
        plain.within(expr, ty, ty)
    }

    /// The units, if the place is behind a number of a block.
    fn units(&self, fields: &[Field]) -> Option<Vec<Kind>> {
        let mut open: Vec<&Expr> = fields.iter().map(|field| &field.value).collect();
        while let Some(expr) = open.pop() {
            if matches!(&expr.kind, ExprKind::Number(number) if number.unit.as_ref().is_some_and(is_here)) {
                return Some(vec![Kind::Units, Kind::Operators]);
            }
            open.extend(expr.parts());
        }
        None
    }

    fn holds_here(&self, expr: &Expr) -> bool {
        is_named_here(expr) || expr.parts().into_iter().any(|part| self.holds_here(part))
    }

    /// Within an expression; `None` if the place is elsewhere. `whole` is the type that the expression should have,
    /// `part` the one that is assumed of its operands where nothing better is known.
    fn within(&self, expr: &Expr, whole: Option<Type>, part: Option<Type>) -> Option<Vec<Kind>> {
        match &expr.kind {
            ExprKind::Name(name) => (name == HERE).then(|| self.value(whole)),
            ExprKind::Number(number) => {
                number.unit.as_ref().is_some_and(is_here).then(|| vec![Kind::Units, Kind::Operators])
            }
            ExprKind::Field { base, field } if is_here(field) => {
                let name = name_of(base)?;
                let is_named = self.references.declaration(&Symbol::RoadUser(name.to_owned())).is_some()
                    || self.locals.iter().any(|(local, ty)| local == name && self.is_road_user(*ty));
                // Some facts are for requirements alone.
                let is_known = |part: &str| {
                    let fact = Fact::from_name(&format!("{name}.{part}"));
                    matches!(self.about, About::Facts(site) if site.is_requirement())
                        || fact.is_none_or(|fact| !matches!(fact.known(), Known::Tick | Known::Near))
                };
                let parts = match things().contains(&name) {
                    true => parts_of(name).into_iter().filter(|(part, _)| is_known(part)).collect(),
                    false if is_named => parts_of_named().into_iter().chain([THERE]).collect(),
                    false if self.declared(Symbol::Requirement, name).is_some() => match self.about {
                        About::Facts(Site::Reward) => vec![BREACHED, MARGIN],
                        About::Facts(_) => vec![BREACHED],
                        _ => vec![BREACHED, KEPT, RECURRENCE],
                    },
                    false => return Some(Vec::new()),
                };
                Some(vec![Kind::Words(parts)])
            }
            ExprKind::Unary { operand, .. } => self.within(operand, whole, part),
            ExprKind::Binary { op, left, right, .. } => self
                .within(left, part, part)
                .or_else(|| self.compared(*op, left, right))
                .or_else(|| self.within(right, self.compared_type(*op, left, right).or(part), part)),
            ExprKind::Index { base, index } => {
                let key = name_of(base).and_then(|state| self.state(state)?.key).map(Type::Enum);
                self.within(base, part, part).or_else(|| self.within(index, key.or(part), part))
            }
            ExprKind::Call(call) => self.in_call(call, part),
            ExprKind::List(items) => items.iter().find_map(|item| self.within(item, whole, part)),
            ExprKind::Match { subject, arms } => {
                let variants = || self.type_of(subject).and_then(|ty| self.variants(ty));
                self.within(subject, None, None)
                    .or_else(|| self.arms(arms, || variants().into_iter().collect(), whole))
            }
            ExprKind::Range { .. } | ExprKind::Field { .. } | ExprKind::Record(_) => {
                expr.parts().into_iter().find_map(|inner| self.within(inner, whole, part))
            }
            ExprKind::Text(_)
            | ExprKind::Bool(_)
            | ExprKind::LanePoint { .. }
            | ExprKind::Numbered { .. } => None,
        }
    }

    /// The names that alone fit beside what stands left of a comparison, or in the list behind `in`.
    fn compared(&self, op: BinaryOp, left: &Expr, right: &Expr) -> Option<Vec<Kind>> {
        let is_compared = match (op, &right.kind) {
            (BinaryOp::In, ExprKind::List(items)) => items.iter().any(is_named_here),
            (BinaryOp::Compare(comparison), _) => !comparison.orders() && is_named_here(right),
            _ => false,
        };
        match (self.about, name_of(left).filter(|_| is_compared)?) {
            (About::Rule, "road") => Some(vec![Kind::Roads]),
            (About::Facts(_), "hit" | "near") => Some(bodies_together()),
            (About::Scenario, claim) => {
                let words = words::claim_words(claim).iter().map(|word| (*word, ""));
                Some(vec![Kind::Words(words.collect())])
            }
            _ => None,
        }
    }

    /// The type that a comparison or a list behind `in` asks for.
    fn compared_type(&self, op: BinaryOp, left: &Expr, right: &Expr) -> Option<Type> {
        let compares = match op {
            BinaryOp::Compare(_) => is_named_here(right),
            BinaryOp::In => matches!(right.kind, ExprKind::List(_)),
            BinaryOp::Implies | BinaryOp::Or | BinaryOp::And | BinaryOp::Arithmetic(_) => false,
        };
        self.type_of(left).filter(|_| compares)
    }

    fn in_call(&self, call: &Call, part: Option<Type>) -> Option<Vec<Kind>> {
        if self.about == About::Space {
            let is_about = call.args.iter().any(|arg| is_named_here(&arg.value));
            let claims = || Kind::Words(words::of::<SpaceClaim>());
            return is_about.then(|| vec![claims(), Kind::Actions, Kind::Groups]);
        }
        if call.name.text == SINCE.0 && call.args.iter().any(|arg| is_named_here(&arg.value)) {
            return Some(vec![Kind::Actions, Kind::Groups]);
        }
        let function = self.declared(Symbol::Function, &call.name.text);
        call.args.iter().enumerate().find_map(|(index, arg)| {
            let parts = function.map_or(&[][..], |function| &function.parts);
            let symbol = match &arg.name {
                Some(name) => parts.iter().find(|part| part.word() == Some(&name.text)),
                None => parts.get(index),
            };
            let ty = symbol.and_then(|symbol| self.references.declaration(symbol)?.ty);
            self.within(&arg.value, ty.or(part), part)
        })
    }

    /// Within the arms of a `match` or of odds, whose patterns are of these kinds.
    fn arms(&self, arms: &[Arm], patterns: impl Fn() -> Vec<Kind>, whole: Option<Type>) -> Option<Vec<Kind>> {
        arms.iter().find_map(|arm| match any_here(&arm.patterns) {
            true => Some([patterns(), vec![Kind::Keyword("_")]].concat()),
            false => self.within(&arm.value, whole, whole),
        })
    }

    /// The kinds that make a value, first those of the wanted type.
    fn value(&self, wanted: Option<Type>) -> Vec<Kind> {
        // A condition may begin with a value of any type.
        let is_open = wanted.is_none_or(|wanted| wanted == Type::Bool);
        let local =
            |(name, ty): &(String, Option<Type>)| Kind::Local(name.clone(), *ty, is_open || *ty == wanted);
        let mut kinds: Vec<Kind> = self.locals.iter().map(local).collect();
        kinds.push(Kind::Value(wanted));
        match self.about {
            About::Value => kinds,
            About::Rule => {
                kinds.push(Kind::Words(words::facts(Site::Rule)));
                kinds.extend(things().into_iter().map(Kind::Keyword));
                kinds
            }
            About::Facts(site @ (Site::StepBegins | Site::Requirement | Site::RequirementOn)) => {
                kinds.push(Kind::Words(words::facts(site)));
                kinds.extend(things().into_iter().map(Kind::Keyword));
                kinds
            }
            About::Facts(site) => [vec![Kind::Words(words::facts(site))], kinds].concat(),
            About::Space => vec![Kind::Words(words::of::<SpaceClaim>())],
            About::Scenario => {
                let facts = [words::facts(Site::Verdict), words::of::<ScenarioClaim>()].concat();
                vec![Kind::Words(facts), Kind::Verdicts, Kind::Requirements]
            }
        }
    }

    fn type_of(&self, expr: &Expr) -> Option<Type> {
        match &expr.kind {
            ExprKind::Name(name) => {
                let local = self.locals.iter().find(|(local, _)| local == name);
                let constant = || self.declared(Symbol::Constant, name).and_then(|constant| constant.ty);
                let state = || self.state(name).filter(|state| state.key.is_none())?.ty;
                local.and_then(|(_, ty)| *ty).or_else(constant).or_else(state)
            }
            ExprKind::Index { base, .. } => self.state(name_of(base)?)?.ty,
            ExprKind::Call(call) => self.declared(Symbol::Function, &call.name.text)?.ty,
            ExprKind::Binary { op: BinaryOp::Arithmetic(_), right, .. } => self.type_of(right),
            _ => None,
        }
    }

    /// The type that is written; of a map, the type of its values.
    fn written_type(&self, ty: &WrittenType) -> Option<Type> {
        match &ty.kind {
            TypeKind::Named(name) | TypeKind::Map { value: name, .. } => {
                self.references.type_named(&name.text)
            }
        }
    }

    fn state(&self, name: &str) -> Option<&'a Declaration> {
        self.declared(Symbol::State, name)
    }

    fn declared(&self, symbol: fn(String) -> Symbol, name: &str) -> Option<&'a Declaration> {
        self.references.declaration(&symbol(name.to_owned()))
    }

    fn parameter_type(&self, action: &str, name: &str) -> Option<Type> {
        self.references.declaration(&Symbol::Parameter(action.to_owned(), name.to_owned()))?.ty
    }

    /// The variants of an enum.
    fn variants(&self, ty: Type) -> Option<Kind> {
        self.references.enum_of(ty).map(|of| Kind::Variants(of.name.clone()))
    }

    fn locals_of(&self, item: &ItemKind) -> Vec<(String, Option<Type>)> {
        let mut found: Vec<(String, Option<Type>)> = Vec::new();
        let written = |name: &Name, ty: &WrittenType| (name.text.clone(), self.written_type(ty));
        match item {
            ItemKind::Fn(of) => found.extend(of.params.iter().map(|param| written(&param.name, &param.ty))),
            ItemKind::Manoeuvre(of) => {
                found.extend(of.params.iter().map(|param| written(&param.name, &param.ty)))
            }
            ItemKind::Action(of) => {
                found.extend(of.params.iter().map(|param| written(&param.name, &param.ty)))
            }
            ItemKind::Rule(Rule { body: RuleBody::Holds { on, .. }, .. }) => {
                for (name, ty) in on.iter().flat_map(|target| self.parameters_of(&target.text)) {
                    if !found.iter().any(|(known, _)| *known == name) {
                        found.push((name, ty));
                    }
                }
            }
            _ => {}
        }
        found
    }

    /// Parameters of an action, or of the actions of a group.
    fn parameters_of(&self, target: &str) -> Vec<(String, Option<Type>)> {
        let actions = self.references.actions(target);
        let actions = actions.iter().filter_map(|action| self.references.declaration(action));
        let parameter = |symbol: &Symbol| match symbol {
            Symbol::Parameter(_, name) => Some((name.clone(), self.references.declaration(symbol)?.ty)),
            _ => None,
        };
        actions.flat_map(|action| &action.parts).filter_map(parameter).collect()
    }
}
