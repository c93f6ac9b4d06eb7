//! The checker: declarations in, a sound [`Space`] or diagnostics out.
//!
//! It goes on after a mistake, so that one run shows all mistakes. A broken declaration becomes `None`, and no diagnostic
//! is reported for anything that depends on it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;

use crate::check::mistakes::Report;
use crate::check::names::{Names, unknown};
use crate::check::references::{References, Symbol};
use crate::check::{style, unused};
use crate::model::command::Told;
use crate::model::effort;
use crate::model::expr::{Expr, ExprKind};
use crate::model::rules::{bounds, clauses, rules_by_action};
use crate::model::vocabulary::{ROAD_USER, TYPES};
use crate::model::{
    ActionDef, BodyDef, EnumDef, FnDef, GroupDef, ManoeuvreDef, Meaning, SetDef, Space, StateDef,
    TrajectoryDef, Type, Value, code,
};
use crate::prove;
use crate::prove::{Known, RunsIn, enclose, product_size};
use crate::syntax::ast::{FileId, ItemKind, Span};
use crate::syntax::{Diagnostic, ast};
use avastra_base::units::{Dimension, Rational};
use avastra_road::{LanePlace, RoadError, RoadMap, Route};

/// The most diagnostics of a file: more are of no use, and each is found in the text by its place.
pub(super) const DIAGNOSTICS_MAX: usize = 1_000;

/// The most steps of all proofs about a space: about half a second of an optimised build.
const STEPS_MAX: u64 = 20_000_000;

/// A function's parameters, its result type, and the span of its header.
pub(super) type Signature = (Vec<(String, Type)>, Type, Span);

/// Loads maps. Its implementation knows the folder of the file that names a map.
pub(crate) trait Maps {
    /// The map and its path, or in words why it cannot be used.
    fn map(&mut self, name: &ast::Text) -> Result<(PathBuf, Arc<RoadMap>), String>;

    /// The route between two places of a map.
    fn route(&mut self, map: &Arc<RoadMap>, start: LanePlace, goal: LanePlace) -> Result<Route, RoadError>;
}

/// The actions by what they do.
pub(super) struct Doers {
    /// By state: those that set it.
    pub setters: Vec<Vec<usize>>,
    pub spawners: Vec<usize>,
}

/// The requirements of a space. All names are known from the first one on: one that asks about another is told why it
/// cannot.
pub(super) struct Required {
    pub names: Names,
    /// Those that were checked and have no mistake, each with the dimension of its margin.
    pub margins: Vec<(String, Option<Dimension>)>,
}

/// Names that are known before any declaration is checked.
#[derive(Default)]
pub(super) struct Announced {
    /// The names of all functions: constants are checked before them and cannot call them.
    pub functions: BTreeSet<String>,
    /// The names of all declared roads, driven or not.
    pub roads: Vec<String>,
}

/// How much a short text has made so far. Anything too large is refused before it takes long.
#[derive(Default)]
pub(super) struct Spent {
    /// Values that parameters list.
    pub listed: usize,
    /// Actions that groups name.
    pub members: usize,
    /// Operations that were compiled for single actions, in conditions of rules and in what `on … also` adds.
    pub compiled: usize,
}

/// The declarations that are checked so far, and their diagnostics. A list of what comes later in [`space`] is empty.
#[derive(Default)]
pub(super) struct Checker {
    pub(super) announced: Announced,
    pub(super) enum_names: Names,
    pub(super) enums: Vec<EnumDef>,
    pub(super) states: Vec<StateDef>,
    /// Positions in `states`, by name.
    pub(super) state_places: BTreeMap<String, usize>,
    pub(super) bodies: Vec<BodyDef>,
    pub(super) trajectories: Vec<TrajectoryDef>,
    /// Names that the spawns of all actions give.
    pub(super) bearers: Vec<String>,
    /// The fields that the road users of each name can be told at most.
    pub(super) obeys: BTreeMap<String, Told>,
    pub(super) manoeuvre_names: Names,
    /// `None` stands for a broken one.
    pub(super) manoeuvres: Vec<Option<ManoeuvreDef>>,
    /// Each constant is folded to a literal; `None` stands for a broken one.
    pub(super) constants: Vec<(String, Option<Expr>)>,
    /// Positions in `constants`, by name.
    pub(super) constant_places: BTreeMap<String, usize>,
    pub(super) function_names: Names,
    /// `None` stands for a function with a broken header.
    pub(super) signatures: Vec<Option<Signature>>,
    pub(super) functions: Vec<FnDef>,
    pub(super) action_names: Names,
    pub(super) actions: Vec<Option<Arc<ActionDef>>>,
    /// The parameters of all actions.
    pub(super) parameter_names: BTreeSet<String>,
    /// Indices of actions with a broken effect: no rule reports that such an action lacks an effect.
    pub(super) half_broken: BTreeSet<usize>,
    pub(super) groups: Vec<GroupDef>,
    /// Positions in `groups`, by name.
    pub(super) group_places: BTreeMap<String, usize>,
    /// The effects of every step.
    pub(super) each_step: Vec<SetDef>,
    /// `None` until they are checked.
    pub(super) required: Option<Required>,
    /// Number of rows of each action; `None` if an axis is broken.
    pub(super) row_counts: Vec<Option<u64>>,
    /// The claims that rows run, as far as that was shown.
    pub(super) claims: Vec<Claim>,
    /// Declarations that are not checked, because another has their name.
    pub(super) doubles: BTreeSet<Span>,
    /// The meaning of each name, in all files.
    pub(super) references: References,
    pub(super) spent: Spent,
    pub(super) diagnostics: Vec<Diagnostic>,
    /// Whether diagnostics are dropped for now.
    pub(super) is_quiet: bool,
}

/// A claim that rows can run.
#[derive(Debug, Clone)]
pub struct Claim {
    pub span: Span,
    pub rows: Vec<usize>,
}

/// The findings about rows, before the places in the world are looked up.
#[derive(Debug, Clone, Default)]
pub struct Runs {
    pub claims: Vec<Claim>,
    pub runs_in: RunsIn,
}

/// The result of checking the declarations of a space.
pub(super) struct Checked {
    /// `None` if it is not sound.
    pub space: Option<Space>,
    pub runs: Runs,
    pub diagnostics: Vec<Diagnostic>,
    pub references: References,
}

/// The facts that the reader of files knows about the root of a space.
pub(super) struct Root {
    /// Claims and unused declarations are looked for in this file alone. A used file is checked for them
    /// when it is the root itself.
    pub file: FileId,
    pub path: PathBuf,
    pub meaning: Meaning,
    pub docs: Vec<String>,
}

/// Checks the declarations of all files of a space, imports first. The declarations `aside` do not stand: only their
/// names are noted. Without maps there is no space.
pub(super) fn space(
    root: Root,
    items: &[&ast::Item],
    aside: &[&ast::Item],
    references: References,
    maps: Option<&mut dyn Maps>,
) -> Checked {
    let announced = Announced {
        functions: each(items, ItemKind::as_fn).map(|(_, function)| function.name.text.clone()).collect(),
        roads: each(items, ItemKind::as_road).map(|(_, road)| road.name.text.clone()).collect(),
    };
    let mut checker = Checker { announced, references, ..Checker::default() };
    checker.declare_enums(items);
    checker.references.set_enums(checker.enums.clone());
    checker.declare_constants(items);
    checker.declare_odds(items);
    checker.declare_bodies(items);
    checker.declare_trajectories(items);
    checker.declare_functions(items);
    checker.declare_states(items);
    checker.declare_bearers(items);
    checker.declare_road_users(items);
    checker.declare_manoeuvres(items);
    checker.declare_actions(items);
    checker.declare_groups(items);
    checker.declare_action_odds(items);
    checker.declare_also(items);
    checker.declare_each_step(items);
    let rules = checker.rules(items);
    let requirements = checker.requirements(items, &rules);
    let reward = checker.reward(items);
    let verdicts = checker.verdicts(items);
    let (episode, road_names) = checker.episode(items);
    let has_maps = maps.is_some();
    let roads = maps.map_or_else(Vec::new, |maps| checker.roads(items, road_names, maps));
    checker.count_rows(&rules, roads.len());
    checker.note_the_rest(items, aside);

    let own: Vec<&ast::Item> = items.iter().copied().filter(|item| item.span.file == root.file).collect();

    // A broken declaration is missing from its list, so the indices of the others would be wrong.
    if checker.has_errors() || !has_maps {
        checker.look_at_expects(&own);
        return checker.finish(None, RunsIn::default());
    }
    let actions = core::mem::take(&mut checker.actions).into_iter().flatten();
    let actions: Vec<ActionDef> = actions.map(Arc::unwrap_or_clone).collect();
    let space = Space {
        path: root.path,
        meaning: root.meaning,
        docs: root.docs,
        enums: core::mem::take(&mut checker.enums),
        states: core::mem::take(&mut checker.states),
        bodies: core::mem::take(&mut checker.bodies),
        trajectories: core::mem::take(&mut checker.trajectories),
        bearers: core::mem::take(&mut checker.bearers),
        manoeuvres: core::mem::take(&mut checker.manoeuvres).into_iter().flatten().collect(),
        functions: core::mem::take(&mut checker.functions),
        actions,
        groups: core::mem::take(&mut checker.groups),
        each_step: core::mem::take(&mut checker.each_step),
        rules,
        requirements,
        episode,
        reward,
        verdicts,
        roads,
        rows: Vec::new(),
        bounds: Vec::new(),
        clauses: Vec::new(),
    };
    let is_told = checker.diagnostics.len();
    let ((space, runs_in), sufficed) = effort::within(STEPS_MAX, || checker.proved(space, &own, items));
    if !sufficed {
        // Findings of proofs that were cut short would mislead.
        checker.diagnostics.truncate(is_told);
        checker.claims.clear();
        checker.report(too_much(&space));
        return checker.finish(None, RunsIn::default());
    }
    let is_sound = !checker.has_errors();
    checker.finish(is_sound.then_some(space), runs_in)
}

/// The error for a space whose proofs take too many steps, with the numbers that multiply.
fn too_much(space: &Space) -> Diagnostic {
    let Space { rows, rules, states, roads, actions, .. } = space;
    let cells: usize = states.iter().map(|state| state.cells).sum();
    let error = Diagnostic::error(code::TOO_MUCH, "this space takes too many steps to check");
    let binding = rules_by_action(rules, actions.len());
    let bound =
        |action: &usize| product_size(&actions[*action]).saturating_mul(1 + binding[*action].len() as u64);
    let error = match (0..actions.len()).max_by_key(bound) {
        Some(action) => {
            error.at(actions[action].span, "most of them are for the rows and rules of this action")
        }
        None => error,
    };
    let rows = rows.len();
    error
        .note(format!(
            "it has {} actions with {rows} rows, {} rules, {} roads, and states of {cells} values; these numbers multiply",
            actions.len(),
            rules.len(),
            roads.len(),
        ))
        .help(
            "make the largest of them smaller: draw parameters with `any` rather than `each`, bind rules to fewer actions \
             by `on`, shorten their conditions, or give fewer values to states that begin as `any`",
        )
}

impl Report for Checker {
    fn report(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }
}

impl Checker {
    /// The space with its rows. Proves and reports everything about a space whose names and types are right.
    fn proved(&mut self, mut space: Space, own: &[&ast::Item], items: &[&ast::Item]) -> (Space, RunsIn) {
        space.bounds = bounds(&space.actions, &space.rules);
        space.clauses = clauses(&space);
        space.rows = prove::rows(&space);
        let (realisable, runs_in) = prove::realise(&space);
        prove::mark_dead(&mut space, &realisable);
        self.expects(own, &space, &realisable);
        self.diagnostics.extend(unused::report(own, items));
        self.diagnostics.extend(style::report(own));
        self.diagnostics.extend(prove::report(&space, &realisable));
        (space, runs_in)
    }

    pub(super) fn has_errors(&self) -> bool {
        self.diagnostics.iter().any(Diagnostic::is_error)
    }

    /// Puts the diagnostics into the order of the text.
    fn finish(mut self, space: Option<Space>, runs_in: RunsIn) -> Checked {
        self.diagnostics.sort_by_key(Diagnostic::place);
        let runs = Runs { claims: self.claims, runs_in };
        Checked { space, runs, diagnostics: self.diagnostics, references: self.references }
    }

    /// Looks at what is broken already, for its names alone: no mistake is reported.
    pub(super) fn quietly<T>(&mut self, look: impl FnOnce(&mut Self) -> T) -> T {
        let reported = self.diagnostics.len();
        let was_quiet = core::mem::replace(&mut self.is_quiet, true);
        let found = look(self);
        self.is_quiet = was_quiet;
        self.diagnostics.truncate(reported);
        found
    }

    /// The diagnostic for a name that is not declared. Candidates are looked at only if the diagnostic will be printed,
    /// because there may be as many candidates as unknown names.
    pub(super) fn unknown<'a>(
        &self,
        kind: &str,
        name: &str,
        span: Span,
        candidates: impl IntoIterator<Item = &'a str>,
    ) -> Diagnostic {
        let is_read = !self.is_quiet && self.diagnostics.len() < DIAGNOSTICS_MAX;
        unknown(kind, name, span, candidates.into_iter().take(if is_read { usize::MAX } else { 0 }))
    }

    /// Notes the names of all that the checks before did not see.
    fn note_the_rest(&mut self, items: &[&ast::Item], aside: &[&ast::Item]) {
        let is_double = |item: &&&ast::Item| self.doubles.contains(&item.span);
        let doubles: Vec<&ast::Item> = items.iter().filter(is_double).copied().collect();
        let doers = self.doers();
        for item in doubles.iter().chain(aside) {
            self.quietly(|checker| checker.look_at_item(item, &doers));
        }
        for item in items.iter().chain(aside) {
            match item.kind.plain() {
                ItemKind::Road(block) => self.note_road(block),
                ItemKind::Trajectory(block) => self.note_trajectory(block),
                ItemKind::Expect(expect) => self.note_claim(&expect.claim),
                _ => {}
            }
        }
    }

    /// Looks at a declaration that does not stand: it is overridden, left out, or the second of its name.
    fn look_at_item(&mut self, item: &ast::Item, doers: &Doers) {
        match item.kind.plain() {
            ItemKind::Odds(declared) if self.is_of_actions(declared) => drop(self.action_odds(declared)),
            ItemKind::Odds(declared) => drop(self.odds(declared)),
            ItemKind::State(declared) => drop(self.state(item, declared)),
            ItemKind::Body(declared) => drop(self.body(item, declared)),
            ItemKind::Let(declared) => drop(self.constant(declared)),
            ItemKind::Fn(declared) => {
                let signature = self.signature(declared);
                self.function(declared, signature);
            }
            ItemKind::Manoeuvre(declared) => drop(self.manoeuvre(item, declared)),
            ItemKind::Action(declared) => drop(self.action(item, declared)),
            ItemKind::Group(declared) => declared.members.iter().for_each(|name| drop(self.targets(name))),
            ItemKind::Also(declared) => drop(self.also(declared)),
            ItemKind::EachStep(effects) => drop(self.sets(effects)),
            ItemKind::Rule(declared) => drop(self.rule(declared, doers)),
            ItemKind::Require(declared) => drop(self.requirement(item, declared)),
            ItemKind::Episode(fields) => drop(self.settings(fields)),
            ItemKind::Reward(cases) => drop(self.cases(item, cases)),
            ItemKind::Verdict(declared) => drop(self.verdict(declared)),
            ItemKind::Language(_)
            | ItemKind::Use(_)
            | ItemKind::Enum(_)
            | ItemKind::Trajectory(_)
            | ItemKind::Road(_)
            | ItemKind::Expect(_)
            | ItemKind::Scenario(_)
            | ItemKind::Policy(_)
            | ItemKind::Override(_) => {}
        }
    }

    /// The declarations of one kind, by name. Reports a second declaration of a name and leaves it out.
    pub(super) fn declared<'a, T>(
        &mut self,
        kind: &str,
        items: &'a [&'a ast::Item],
        pick: impl Fn(&'a ItemKind) -> Option<&'a T> + 'a,
    ) -> (Names, Vec<(&'a ast::Item, &'a T)>) {
        let mut names = Names::default();
        let mut first = Vec::new();
        for (item, declared) in each(items, pick) {
            let name = item.kind.name().expect("only declarations with a name are asked for");
            match self.take(names.declare(kind, name)) {
                Some(()) => first.push((item, declared)),
                None => drop(self.doubles.insert(item.span)),
            }
        }
        (names, first)
    }

    /// The type with this name.
    pub(super) fn named_type(&mut self, name: &ast::Name) -> Option<Type> {
        let found = self.references.type_named(&name.text);
        match found {
            _ if name.text == ROAD_USER.0 => {
                self.references.note(name.span, Symbol::Engine(ROAD_USER.0, ROAD_USER.1), false);
            }
            None | Some(Type::Enum(_)) => self.references.uses(name.span, Symbol::Enum(name.text.clone())),
            Some(_) => self.references.note(name.span, Symbol::Type(name.text.clone()), false),
        }
        found.or_else(|| {
            let error = match name.text == ROAD_USER.0 {
                true => Diagnostic::error(
                    code::NOT_HERE,
                    "only parameters of actions and manoeuvres name road users",
                )
                .at(name.span, "not in this place"),
                false => {
                    let candidates = TYPES.iter().map(|(word, ..)| *word).chain(self.enum_names.all());
                    self.unknown("type", &name.text, name.span, candidates)
                }
            };
            self.reject(error)
        })
    }

    pub(super) fn plain_type(&mut self, ty: &ast::Type) -> Option<Type> {
        match &ty.kind {
            ast::TypeKind::Named(name) => self.named_type(name),
            ast::TypeKind::Map { .. } => {
                let error = Diagnostic::error(code::TYPE_MISMATCH, "only a state can be a map");
                self.reject(error.at(ty.span, "a map"))
            }
        }
    }

    /// The value of an expression that consists of constants, functions and literals.
    pub(super) fn fold(&mut self, expr: &Expr) -> Option<ExprKind> {
        let calls = expr.any(|kind| matches!(kind, ExprKind::Call(..)));
        if calls && self.functions.len() != self.signatures.len() {
            // The broken function was reported where it is declared.
            return None;
        }
        let known = Known { functions: &self.functions, locals: &[], cells: &[], road: None, case: None };
        enclose(expr, &known).literal(expr.ty).or_else(|| {
            let error = Diagnostic::error(code::NUMBER, "the value cannot be computed exactly");
            self.reject(error.at(expr.span, "too large, or a division by 0"))
        })
    }

    /// The value of such an expression, if it is a number.
    pub(super) fn fold_number(&mut self, expr: &Expr) -> Option<Rational> {
        match self.fold(expr)? {
            ExprKind::Number(value) => Some(value),
            _ => None,
        }
    }
}

/// The value at run time of a literal.
pub(super) fn literal(kind: &ExprKind) -> Option<Value> {
    match kind {
        ExprKind::Bool(truth) => Some(Value::Bool(*truth)),
        ExprKind::Number(number) => Some(Value::Number(number.to_f64())),
        ExprKind::Variant(of, index) => Some(Value::Variant(*of, *index)),
        _ => None,
    }
}

/// The declarations of one kind, with their documentation.
pub(super) fn each<'a, T: 'a>(
    items: &'a [&'a ast::Item],
    pick: impl Fn(&'a ItemKind) -> Option<&'a T> + 'a,
) -> impl Iterator<Item = (&'a ast::Item, &'a T)> {
    items.iter().filter_map(move |item| pick(&item.kind).map(|found| (*item, found)))
}
