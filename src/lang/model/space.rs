//! The checked space: what may happen around the car. If a [`Space`] exists, it is sound: every name
//! resolves, every type fits, every rule can be enforced.

use std::path::PathBuf;
use std::sync::Arc;

use crate::model::body::{BodyParameters, BodyWord};
use crate::model::command::{CommandDef, Moves, Told};
use crate::model::eval::evaluate;
use crate::model::expr::{Expr, ExprKind, FnDef, Who, WordExpr};
use crate::model::facts::{Facts, RoadFacts};
use crate::model::field::{Fields, Term};
use crate::model::interval::Interval;
use crate::model::meaning::Meaning;
use crate::model::rules::{Bound, Clause};
use crate::model::trajectory::{Laid, TrajectoryDef};
use crate::model::value::{EnumIndex, Type, Value};
use crate::model::vocabulary::{
    Body, Colour, Field, LaneChoice, Level, LightColour, Phenomenon, Side, Then, TimeOfDay, Verb, Word,
};
use crate::syntax::ast::Span;
use avastra_base::units::{
    Dimension, Rational, Unit, decimal, quantity, quantity_in, quantity_short, unit_of_all,
};
use avastra_road::{LanePlace, RoadMap, Route};

/// Name of the verdict that decides which collisions count. Every space has it: the checker adds the
/// paper's where the author declares none.
pub const COUNTED: &str = "counted";

/// A whole space.
#[derive(Debug, Clone)]
pub struct Space {
    /// Path of the root file, as given.
    pub path: PathBuf,
    /// The meaning of all declarations, maps included: see [`Use::digest`](crate::syntax::ast::Use).
    pub meaning: Meaning,
    /// Documentation of the root file.
    pub docs: Vec<String>,
    pub enums: Vec<EnumDef>,
    pub states: Vec<StateDef>,
    pub bodies: Vec<BodyDef>,
    pub trajectories: Vec<TrajectoryDef>,
    /// Names that spawns give to road users, each once.
    pub bearers: Vec<String>,
    pub manoeuvres: Vec<ManoeuvreDef>,
    pub functions: Vec<FnDef>,
    pub actions: Vec<ActionDef>,
    pub groups: Vec<GroupDef>,
    /// The effects at the end of every step, after the effects of its action.
    pub each_step: Vec<SetDef>,
    pub rules: Vec<RuleDef>,
    /// The requirements on the ego vehicle, in the order of declaration.
    pub requirements: Vec<RequirementDef>,
    pub episode: EpisodeDef,
    /// The first case that applies gives the reward.
    pub reward: Vec<RewardCase>,
    /// In the order of declaration; one of them is [`COUNTED`].
    pub verdicts: Vec<VerdictDef>,
    /// The roads of `episode.roads`, in that order; every declared road if there is no `episode`.
    pub roads: Vec<Road>,
    /// The action table: actions as declared, axes left to right, the last varying fastest.
    pub rows: Vec<Row>,
    /// For each action: the bounds that `where`s and rules set for each of its drawn numbers.
    pub bounds: Vec<Vec<Bound>>,
    /// For each action: its `where`s and rules, with the parameters that decide each.
    pub clauses: Vec<Vec<Clause>>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct EnumDef {
    pub name: String,
    pub docs: Vec<String>,
    pub variants: Vec<String>,
    /// Whether `<` compares its variants.
    pub ordered: bool,
    /// How often each variant is drawn, relative to the others; 1 unless `odds` names it.
    pub odds: Vec<u32>,
    pub span: Span,
}

/// A state variable.
#[derive(Debug, Clone, PartialEq)]
pub struct StateDef {
    pub name: String,
    pub docs: Vec<String>,
    /// The enum of its keys, if it is a map.
    pub key: Option<EnumIndex>,
    /// Type of a cell.
    pub ty: Type,
    /// Position of its first cell in [`Memory`](super::Memory).
    pub first_cell: usize,
    /// 1, or the number of keys.
    pub cells: usize,
    /// How each of its cells begins.
    pub initial: Vec<Initial>,
    /// The meaning of the state in the world.
    pub meaning: StateMeaning,
    pub span: Span,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Initial {
    /// The cell is drawn at reset.
    Any,
    /// A constant.
    Value(Expr),
}

/// The meaning of a state variable in the world. The lists give the engine's word for each variant.
#[derive(Debug, Clone, PartialEq)]
pub enum StateMeaning {
    /// Nothing: only the space's rules and effects use it.
    Private,
    /// The state `time`: the time of day for each variant.
    Time(Vec<TimeOfDay>),
    /// The state `sky`: the phenomenon for each key, the level for each variant.
    Sky(Vec<Phenomenon>, Vec<Level>),
}

/// One row. Its number is the index of the network's output.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    pub index: usize,
    /// Index in `Space::actions`.
    pub action: usize,
    /// Names and values of the `each` parameters, as declared.
    pub axes: Vec<(Arc<str>, Value)>,
    /// `drive_ahead(lane: Left, mode: Near, then: Change)`.
    pub label: String,
    /// Indices in `Space::rules` of the rules that bind the row, optional ones included.
    pub rules: Arc<[usize]>,
    /// The proofs about the row on each road of `Space::roads` under the default rules.
    pub roads: Vec<Reach>,
}

/// Whether a row can run on a road.
#[derive(Debug, Clone, PartialEq)]
pub enum Reach {
    /// The row is not proved dead. Holds the ranges that the rules leave to its drawn numbers, SI.
    Open(Vec<(Arc<str>, Interval)>),
    /// The rules forbid every draw.
    Dead { rules: Vec<usize>, reason: String },
}

impl Reach {
    /// The ranges that the rules leave to the drawn numbers; `None` if the row is dead.
    pub fn ranges(&self) -> Option<&[(Arc<str>, Interval)]> {
        match self {
            Reach::Open(ranges) => Some(ranges),
            Reach::Dead { .. } => None,
        }
    }
}

/// A body of the author's own.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyDef {
    pub name: String,
    pub docs: Vec<String>,
    pub like: Body,
    pub shape: BodyParameters,
    pub span: Span,
}

/// Largest value that `odds actions` may give: with all rows that a table may have, the sum still fits.
pub const ACTION_ODDS_MAX: u32 = 10_000;

#[derive(Debug, Clone, PartialEq)]
pub struct ActionDef {
    pub name: String,
    pub docs: Vec<String>,
    /// `each` and `any` parameters, in the order of declaration: the locals of the action's expressions.
    pub parameters: Vec<Parameter>,
    /// Its own, then those that `on … also` adds.
    pub effects: Vec<EffectDef>,
    /// How often each of its rows is drawn by chance, relative to other rows: a whole number from 0 to
    /// [`ACTION_ODDS_MAX`], in states and at moments. `None` if the space has no `odds actions`.
    pub odds: Option<Expr>,
    pub span: Span,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    pub name: Arc<str>,
    pub ty: Type,
    /// True for `each` (an axis of the table), false for `any` (drawn).
    pub axis: bool,
    pub domain: Domain,
    /// The `where` condition, which may name the parameters before this one.
    pub condition: Option<Expr>,
    pub span: Span,
}

impl Parameter {
    /// The unit in which people read its listed values or the ends of its range, if it is not SI's.
    pub fn unit(&self) -> Option<&'static Unit> {
        let Type::Quantity(dimension) = self.ty else { return None };
        let numbers: Vec<f64> = match &self.domain {
            Domain::Values(values) => values.iter().map(|value| value.number()).collect(),
            Domain::Range(low, high) => vec![low.to_f64(), high.to_f64()],
        };
        unit_of_all(&numbers, dimension)
    }
}

impl ActionDef {
    /// The parameters that are drawn.
    pub fn drawn(&self) -> impl Iterator<Item = &Parameter> {
        self.parameters.iter().filter(|parameter| !parameter.axis)
    }

    /// Its own `set`s and those that `on … also` adds, in the order in which they happen; those of every step come after
    /// them: [`Space::sets`].
    pub(crate) fn sets(&self) -> impl Iterator<Item = &SetDef> {
        self.effects.iter().filter_map(|effect| match effect {
            EffectDef::Set(set) => Some(&**set),
            EffectDef::Spawn(_) | EffectDef::Order(_) | EffectDef::Light(_) => None,
        })
    }

    /// Its spawns, in the order in which they happen.
    pub fn spawns(&self) -> impl Iterator<Item = &SpawnDef> {
        self.effects.iter().filter_map(|effect| match effect {
            EffectDef::Spawn(spawn) => Some(&**spawn),
            EffectDef::Set(_) | EffectDef::Order(_) | EffectDef::Light(_) => None,
        })
    }

    /// The spawn of the road user with this name.
    pub(crate) fn spawn_of(&self, bearer: usize) -> Option<&SpawnDef> {
        self.spawns().find(|spawn| spawn.bearer == Some(bearer))
    }

    /// The manoeuvres that it gives to road users, in the order of its effects.
    pub fn manoeuvres(&self) -> impl Iterator<Item = usize> {
        self.effects.iter().filter_map(EffectDef::manoeuvre).map(|call| call.manoeuvre)
    }

    /// Its orders to named road users.
    pub(crate) fn orders(&self) -> impl Iterator<Item = &OrderDef> {
        self.effects.iter().filter_map(|effect| match effect {
            EffectDef::Order(order) => Some(&**order),
            EffectDef::Set(_) | EffectDef::Spawn(_) | EffectDef::Light(_) => None,
        })
    }

    /// Its orders to the ego vehicle's next traffic light.
    pub(crate) fn light_orders(&self) -> impl Iterator<Item = &LightDef> {
        self.effects.iter().filter_map(|effect| match effect {
            EffectDef::Light(light) => Some(&**light),
            EffectDef::Set(_) | EffectDef::Spawn(_) | EffectDef::Order(_) => None,
        })
    }

    /// The values of the parameters that are drawn, given those of all, as declared.
    pub fn drawn_of(&self, values: &[Value]) -> Vec<(Arc<str>, Value)> {
        let drawn = self.parameters.iter().zip(values).filter(|(parameter, _)| !parameter.axis);
        drawn.map(|(parameter, value)| (parameter.name.clone(), *value)).collect()
    }

    /// The drawn parameters with a range, by index; the others have a list of values.
    pub fn drawn_numbers(&self) -> impl Iterator<Item = usize> {
        let is_open = |(_, parameter): &(usize, &Parameter)| {
            !parameter.axis && matches!(parameter.domain, Domain::Range(..))
        };
        self.parameters.iter().enumerate().filter(is_open).map(|(index, _)| index)
    }
}

/// The values that a parameter may have.
#[derive(Debug, Clone, PartialEq)]
pub enum Domain {
    /// A list, of which one value is drawn; a value that it holds twice is twice as likely.
    Values(Vec<Value>),
    /// A range, both ends included, SI.
    Range(Rational, Rational),
}

impl Domain {
    /// Whether the value is one of these.
    pub fn holds(&self, value: Value) -> bool {
        match self {
            Domain::Values(values) => values.contains(&value),
            Domain::Range(low, high) => (low.to_f64()..=high.to_f64()).contains(&value.number()),
        }
    }

    /// The ends of a range in SI; infinite for a list.
    pub fn ends(&self) -> (f64, f64) {
        match self {
            Domain::Values(_) => (f64::NEG_INFINITY, f64::INFINITY),
            Domain::Range(low, high) => (low.to_f64(), high.to_f64()),
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub enum EffectDef {
    Set(Box<SetDef>),
    Spawn(Box<SpawnDef>),
    Order(Box<OrderDef>),
    Light(Box<LightDef>),
}

impl EffectDef {
    /// The manoeuvre that a road user is given.
    pub fn manoeuvre(&self) -> Option<&ManoeuvreCall> {
        match self {
            EffectDef::Set(_) | EffectDef::Light(_) => None,
            EffectDef::Spawn(spawn) => spawn.manoeuvre.as_ref(),
            EffectDef::Order(order) => order.manoeuvre.as_ref(),
        }
    }
}

/// How a state changes: all its cells, or only the cell of a key.
#[derive(Debug, Clone, PartialEq)]
pub struct SetDef {
    /// Index in `Space::states`.
    pub state: usize,
    pub key: Option<Expr>,
    pub value: Expr,
    pub span: Span,
}

impl SetDef {
    /// Its key, if it has one, and its value.
    pub(crate) fn parts(&self) -> impl Iterator<Item = &Expr> {
        self.key.iter().chain([&self.value])
    }

    pub(crate) fn asks_the_world(&self) -> bool {
        self.parts().any(Expr::asks_the_world)
    }
}

/// How a spawn request is made from an action's parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct SpawnDef {
    pub body: WordExpr<BodyWord>,
    pub colour: WordExpr<Colour>,
    pub verb: WordExpr<Verb>,
    pub lane: WordExpr<LaneChoice>,
    pub side: WordExpr<Side>,
    pub then: WordExpr<Then>,
    /// m/s.
    pub speed: Expr,
    /// m.
    pub distance: Expr,
    /// Whether the file says `behind`; the verb decides which place that is.
    pub behind: bool,
    /// The road user from which the distance is measured, in place of the ego vehicle.
    pub of: Option<Who>,
    /// The trajectory that it follows, by index in `Space::trajectories`. The distance is then its station there; for a
    /// trajectory beside the route, it says where that begins.
    pub trajectory: Option<WordExpr<usize>>,
    /// The parked vehicle from behind which a pedestrian steps.
    pub cover: Option<WordExpr<BodyWord>>,
    /// The other fields that it is told.
    pub told: Fields<Term>,
    /// The name that it bears from then on, by index in `Space::bearers`.
    pub bearer: Option<usize>,
    /// Its place in a row of road users; `None` for one that is alone or the first.
    pub row: Option<InRow>,
    /// The manoeuvre that it begins when it appears.
    pub manoeuvre: Option<ManoeuvreCall>,
    pub span: Span,
}

/// The behaviour of a road user, phase by phase.
#[derive(Debug, Clone, PartialEq)]
pub struct ManoeuvreDef {
    pub name: String,
    pub docs: Vec<String>,
    /// The locals of its expressions.
    pub parameters: Vec<(String, Type)>,
    /// How often it goes through its phases; once without it.
    pub repeat: Option<Expr>,
    pub phases: Vec<PhaseDef>,
}

impl ManoeuvreDef {
    /// The manoeuvres to which its phases hand over.
    pub fn next(&self) -> impl Iterator<Item = usize> {
        self.phases.iter().filter_map(|phase| phase.then.as_ref()).map(|call| call.manoeuvre)
    }
}

/// A manoeuvre, and all to which it hands over, itself first. None hands over to itself; `of` gives one by its index.
pub fn reached<'a>(manoeuvre: usize, of: impl Fn(usize) -> Option<&'a ManoeuvreDef>) -> Vec<usize> {
    let mut found = vec![manoeuvre];
    let mut looked = 0;
    while let Some(next) = found.get(looked).copied() {
        looked += 1;
        for next in of(next).into_iter().flat_map(ManoeuvreDef::next) {
            if !found.contains(&next) {
                found.push(next);
            }
        }
    }
    found
}

/// The fields told by all manoeuvres that this one may lead to.
pub fn told<'a>(manoeuvre: usize, of: impl Fn(usize) -> Option<&'a ManoeuvreDef>) -> Told {
    let all = reached(manoeuvre, &of);
    let phases = all.iter().filter_map(|one| of(*one)).flat_map(|one| &one.phases);
    phases.fold(Told::NOTHING, |told, phase| told.and(phase.command.told()))
}

/// A phase begins when `once` has held for long enough, and `after` some more time. It ends when the road user has done what
/// it is told, or when the `once` of the next phase holds.
#[derive(Debug, Clone, PartialEq)]
pub struct PhaseDef {
    pub once: Option<Expr>,
    /// How long `once` must have held, s.
    pub held: Option<Expr>,
    /// How long it waits for `once` to hold, s; then the manoeuvre ends.
    pub within: Option<Expr>,
    /// s.
    pub after: Option<Expr>,
    /// Whether it comes at all, asked when it would begin.
    pub only_if: Option<Expr>,
    pub command: CommandDef,
    /// The manoeuvre that the road user does from then on, in place of the phases that are left.
    pub then: Option<ManoeuvreCall>,
}

impl PhaseDef {
    /// Whether it comes, and goes on until something else is told.
    pub fn never_ends(&self) -> bool {
        let is_true = |expr: &Expr| matches!(expr.kind, ExprKind::Bool(true));
        self.only_if.is_none() && self.command.expr(Field::Continuous).is_some_and(is_true)
    }
}

/// A manoeuvre by its index in `Space::manoeuvres`, and the values that it is given.
#[derive(Debug, Clone, PartialEq)]
pub struct ManoeuvreCall {
    pub manoeuvre: usize,
    pub arguments: Vec<Expr>,
}

/// The place of a road user in a row.
#[derive(Debug, Clone, PartialEq)]
pub struct InRow {
    /// Behind so many others, at least one: the first, nearest to the ego vehicle, is where its spawn says.
    pub nth: usize,
    /// The gap between them, m.
    pub apart: Expr,
    /// How many of the row appear; without it all.
    pub count: Option<Expr>,
    /// How many have names.
    pub named: usize,
}

impl SpawnDef {
    /// Whether it appears: of a row only so many may.
    pub fn appears(&self, functions: &[FnDef], facts: &Facts<'_>) -> bool {
        let count = |row: &InRow| Some(evaluate(row.count.as_ref()?, functions, facts).number());
        self.row.as_ref().is_none_or(|row| count(row).is_none_or(|count| (row.nth as f64) < count))
    }

    /// How much farther away it is than the first of its row, m; `length_m` is that of its body.
    pub fn behind_first_m(&self, length_m: f64, functions: &[FnDef], facts: &Facts<'_>) -> f64 {
        let more_m =
            |row: &InRow| row.nth as f64 * (length_m + evaluate(&row.apart, functions, facts).number());
        self.row.as_ref().map_or(0.0, more_m)
    }
}

/// An order to the ego vehicle's next traffic light.
#[derive(Debug, Clone, PartialEq)]
pub struct LightDef {
    pub colour: WordExpr<LightColour>,
    /// How far the ego vehicle's front is before its line then, m; without it at once.
    pub at: Option<Expr>,
}

/// An order to the latest bearer of a name.
#[derive(Debug, Clone, PartialEq)]
pub struct OrderDef {
    pub who: Who,
    /// Empty for an order of a manoeuvre alone.
    pub command: CommandDef,
    pub manoeuvre: Option<ManoeuvreCall>,
    /// How who bears the name moves; of several the one with the most speeds.
    pub moves: Moves,
    pub span: Span,
}

#[derive(Debug, Clone, PartialEq)]
pub struct GroupDef {
    pub name: String,
    pub docs: Vec<String>,
    /// Indices of actions.
    pub actions: Vec<usize>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct RuleDef {
    pub name: String,
    pub docs: Vec<String>,
    /// Off unless `--with` names it.
    pub optional: bool,
    pub body: RuleBody,
    /// Its condition for the states with which an episode begins; `None` if it says nothing about them.
    pub start: Option<Expr>,
    pub span: Span,
}

#[derive(Debug, Clone, PartialEq)]
pub enum RuleBody {
    /// A condition, compiled once for every action that it binds. States in it have their values
    /// after the action.
    Holds(Vec<RuleBinding>),
    /// A condition under which a commanded lane change may begin; states are not known then.
    During(Vec<RuleBinding>),
    /// A condition under which a phase of a manoeuvre may begin; its locals are the manoeuvre's parameters. The rule binds
    /// the actions that give the manoeuvre to a road user.
    Phases { manoeuvre: usize, condition: Expr, actions: Vec<usize> },
    /// `allowed[from][to]` for a plain state, or for one key of a map; `cell` is its position in the memory. The rule
    /// binds the actions that may set it.
    Moves { state: usize, cell: usize, allowed: Vec<Vec<bool>>, actions: Vec<usize> },
}

#[derive(Debug, Clone, PartialEq)]
pub struct RuleBinding {
    pub action: usize,
    pub condition: Expr,
}

/// A requirement on the ego vehicle, judged at every tick.
#[derive(Debug, Clone, PartialEq)]
pub struct RequirementDef {
    pub name: String,
    pub docs: Vec<String>,
    /// Its text, in one line of the language, for readers of the results.
    pub formula: String,
    /// Off unless `--with` names it.
    pub optional: bool,
    /// The bodies of the road users that it is about: it is asked of each that is near, by itself. Empty if it is about the
    /// ego vehicle alone.
    pub on: Vec<BodyWord>,
    /// Where this does not hold, nothing is asked.
    pub when: Option<Expr>,
    /// If there is one, what began to be asked by `when` is asked until this holds.
    pub until: Option<Expr>,
    /// If there is one, the condition is asked only after it begins to hold, once each time.
    pub after: Option<Expr>,
    pub condition: Expr,
    /// Where this holds, the condition is excused.
    pub unless: Option<Expr>,
    /// The requirement is breached at a tick if the condition failed at every tick of so many before it, and at it. With
    /// `after`: if it failed at the tick of that, and at every tick of so many after it.
    pub within_ticks: u32,
    /// The road users that it names, by index in `Space::bearers`.
    pub bearers: Vec<usize>,
    /// Those of them without which it is not asked: it does not ask whether they are there.
    pub needed: Vec<usize>,
    /// The dimension of its margin; `None` if the condition has none.
    pub margin: Option<Dimension>,
    pub span: Span,
}

impl RequirementDef {
    /// Its conditions, in the order of the text.
    pub fn conditions(&self) -> impl Iterator<Item = &Expr> {
        self.when.iter().chain(&self.until).chain(&self.after).chain([&self.condition]).chain(&self.unless)
    }
}

/// How episodes run.
#[derive(Debug, Clone, PartialEq)]
pub struct EpisodeDef {
    /// The observation period (OTP), s. Default: the paper's 6 s.
    pub step_s: f64,
    /// Whether arrival at the goal ends an episode. Default: yes.
    pub stop_arrived: bool,
    /// Steps without progress that end an episode. Default: none does.
    pub stalled_steps: Option<u32>,
    /// Steps after which an episode is cut off. Default: 20.
    pub step_limit: u32,
}

impl EpisodeDef {
    /// When a step begins, s: the number nearest to the exact time, so that `elapsed >= 0.7 s` holds at 0.7 s.
    pub(crate) fn time_s(&self, step: u64) -> f64 {
        (step as f64 * self.step_s * 1000.0).round() / 1000.0
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct RewardCase {
    /// `None` for `_`.
    pub condition: Option<Expr>,
    pub value: Expr,
}

#[derive(Debug, Clone, PartialEq)]
pub struct VerdictDef {
    pub name: String,
    pub docs: Vec<String>,
    pub condition: Expr,
    /// The conditions that `and` joins, as they were written.
    pub clauses: Vec<String>,
}

/// A road with its map and the ego vehicle's way through it.
#[derive(Debug, Clone)]
pub struct Road {
    pub name: String,
    pub docs: Vec<String>,
    /// The map's path as resolved from the file that names it.
    pub map_path: PathBuf,
    pub map: Arc<RoadMap>,
    pub start: LanePlace,
    pub goal: LanePlace,
    pub route: Route,
    /// Speed of the ego vehicle as an episode begins, m/s.
    pub ego_mps: f64,
    /// The speed that it wants on a free road, m/s; `None`: its driver's own.
    pub set_mps: Option<f64>,
    /// When in the signals' cycle an episode begins, s; `None`: by chance.
    pub signal_phase_s: Option<f64>,
    pub signal_program: SignalProgram,
    /// Where each trajectory of the space lies; `None` for one on another map.
    pub trajectories: Vec<Option<Laid>>,
    pub facts: RoadFacts,
}

/// How long the lights of a road show what, s; `None`: as the engine's.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SignalProgram {
    pub green_s: Option<f64>,
    pub yellow_s: Option<f64>,
    pub all_red_s: Option<f64>,
}

impl Space {
    /// The names of the road users that a row depends on and does not spawn itself. The row orders them, keeps a gap to
    /// them, spawns beside them, or its rules ask about them.
    pub fn about(&self, row: &Row) -> Vec<usize> {
        let action = &self.actions[row.action];
        let named = action.effects.iter().flat_map(|effect| match effect {
            EffectDef::Order(order) => [Some(order.who), order.command.to()],
            EffectDef::Spawn(spawn) => [spawn.of, None],
            EffectDef::Set(_) | EffectDef::Light(_) => [None, None],
        });
        let named = named.flatten().filter_map(|who| row.bearer(who, action));
        let asked = self.clauses[row.action].iter().flat_map(|clause| clause.bearers.iter().copied());
        let mut about = Vec::new();
        for who in named.chain(asked) {
            if !about.contains(&who) && action.spawn_of(who).is_none() {
                about.push(who);
            }
        }
        about
    }

    /// The rows that spawn a road user of this name; the rows that surely do so come first.
    pub fn makers(&self, bearer: usize) -> impl Iterator<Item = &Row> {
        let which =
            move |sure: bool| self.rows.iter().filter(move |row| self.makes(row, bearer) == Some(sure));
        which(true).chain(which(false))
    }

    /// Whether a row spawns a road user of this name, and if so, whether surely.
    fn makes(&self, row: &Row, bearer: usize) -> Option<bool> {
        let spawn = self.actions[row.action].spawn_of(bearer)?;
        Some(self.surely_appears(row, spawn))
    }

    /// Whether a spawn of a row happens whatever is drawn.
    fn surely_appears(&self, row: &Row, spawn: &SpawnDef) -> bool {
        let Some(InRow { nth, count: Some(count), .. }) = &spawn.row else { return true };
        let least = match count.kind {
            ExprKind::Number(number) => number.to_f64(),
            ExprKind::Local(local) => {
                let name = &self.actions[row.action].parameters[local].name;
                let axis = row.axes.iter().find(|(axis, _)| axis == name);
                axis.map_or(0.0, |(_, value)| value.number())
            }
            _ => 0.0,
        };
        (*nth as f64) < least
    }

    /// Rows that, one after another, spawn all road users that a row depends on. Each name has the first row that spawns
    /// it. Rows that this first row depends on come before it.
    pub fn rows_before(&self, row: &Row) -> Vec<usize> {
        let (mut before, mut seen) = (Vec::new(), vec![row.index]);
        self.add_makers(row, &mut before, &mut seen);
        before
    }

    /// All choices of such rows that differ in who makes the first of those road users appear.
    pub fn choices_before(&self, row: &Row) -> Vec<Vec<usize>> {
        let first = self.about(row).into_iter().next();
        let makers = first.into_iter().flat_map(|who| self.makers(who));
        let with = |maker: &Row| {
            let (mut before, mut seen) = (Vec::new(), vec![row.index]);
            self.add_row(maker, &mut before, &mut seen);
            self.add_makers(row, &mut before, &mut seen);
            before
        };
        makers.map(with).filter(|before| !before.is_empty()).collect()
    }

    fn add_makers(&self, row: &Row, before: &mut Vec<usize>, seen: &mut Vec<usize>) {
        for who in self.about(row) {
            let is_made = |made: &usize| self.makes(&self.rows[*made], who) == Some(true);
            if !before.iter().any(is_made) {
                self.makers(who).next().into_iter().for_each(|maker| self.add_row(maker, before, seen));
            }
        }
    }

    fn add_row(&self, maker: &Row, before: &mut Vec<usize>, seen: &mut Vec<usize>) {
        if !seen.contains(&maker.index) {
            seen.push(maker.index);
            self.add_makers(maker, before, seen);
            before.push(maker.index);
        }
    }

    /// All that a step sets, in the order in which it happens: by its action, by `on … also`, and by every step. Without
    /// an action only the last is left.
    pub(crate) fn sets(&self, action: Option<usize>) -> impl Iterator<Item = &SetDef> {
        let of_action = action.into_iter().flat_map(|action| self.actions[action].sets());
        of_action.chain(&self.each_step)
    }

    /// The rows of an action: rows are numbered in the order of the actions.
    pub fn rows_of(&self, action: usize) -> &[Row] {
        let first = self.rows.partition_point(|row| row.action < action);
        let end = self.rows.partition_point(|row| row.action <= action);
        &self.rows[first..end]
    }

    /// The part of a parameter's range on a road that the rules leave, over all rows of its action that can run there;
    /// `None` if none can, or the parameter has no range.
    pub fn range_on(&self, action: usize, parameter: &Parameter, road: usize) -> Option<Interval> {
        let ranges = self.rows_of(action).iter().filter_map(|row| row.roads[road].ranges()).flatten();
        let kept = ranges.filter(|(name, _)| *name == parameter.name).map(|(_, interval)| *interval);
        kept.reduce(|all, interval| all.hull(&interval))
    }

    /// A cell of the memory as the language spells it: `time`, `sky[Rain]`.
    pub fn cell_name(&self, cell: usize) -> String {
        let state = self.state_of(cell);
        let position = cell - state.first_cell;
        match state.key {
            None => state.name.clone(),
            Some(of) => format!("{}[{}]", state.name, self.enums[of.0].variants[position]),
        }
    }

    /// A body as its author calls it.
    pub fn body_name(&self, body: BodyWord) -> &str {
        body.own.map_or_else(|| body.like.name(), |own| &self.bodies[own].name)
    }

    /// A listed value of a parameter as people read it, in the unit that [`Parameter::unit`] gives.
    pub fn show_listed(&self, value: Value, parameter: &Parameter, unit: Option<&Unit>) -> String {
        match (value, parameter.ty) {
            (Value::Number(number), Type::Quantity(dimension)) => quantity_in(number, dimension, unit),
            _ => self.show(value, parameter.ty),
        }
    }

    /// Values of a type as people read them, quantities all in one unit.
    pub fn show_all(&self, values: &[Value], ty: Type) -> Vec<String> {
        let Type::Quantity(dimension) = ty else {
            return values.iter().map(|value| self.show(*value, ty)).collect();
        };
        let numbers: Vec<f64> = values.iter().map(|value| value.number()).collect();
        let unit = unit_of_all(&numbers, dimension);
        numbers.into_iter().map(|number| quantity_in(number, dimension, unit)).collect()
    }

    /// A value as the language spells it, a quantity in a unit in which it is short.
    pub fn show(&self, value: Value, ty: Type) -> String {
        match (value, ty) {
            (Value::Number(number), Type::Quantity(dimension)) => quantity_short(number, dimension),
            _ => self.show_in_si(value, ty),
        }
    }

    /// A value as the language spells it, in SI: for programs that read it.
    pub fn show_in_si(&self, value: Value, ty: Type) -> String {
        match (value, ty) {
            (Value::Bool(truth), _) => truth.to_string(),
            (Value::Variant(of, variant), _) => self.enums[of.0].variants[variant].clone(),
            (Value::Number(number), Type::Quantity(dimension)) => quantity(number, dimension),
            (Value::Number(number), _) => decimal(number, false),
        }
    }
}
