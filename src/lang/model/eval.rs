//! The one evaluator of expressions: it computes rules, functions and verdicts in `f64`.
//!
//! Evaluation cannot fail: the checker has resolved names and types, functions cannot recurse, and what has no
//! value (a division by 0, a number too large) is NaN, which satisfies no comparison but `!=`.

use crate::model::effort;
use crate::model::expr::{Arithmetic, Comparison, Expr, ExprKind, Who};
use crate::model::space::{BodyWord, COUNTED, FnDef, RoadFacts, Space, WordExpr};
use crate::model::value::{Memory, Value};
use crate::model::vocabulary::{
    Crossing, LaneChoice, Light, NearWord, NumberWord, PastWord, Priority, RoadKind, Turn, Word, WordFact,
};

/// Numbers that differ by at most this part of the larger one are equal, and their difference is 0, unless both are whole.
/// This tolerates the digits that an author rounds away and those of binary fractions, but no measurable distance.
const EQUAL_PART: f64 = 1e-9;

/// Below this, an f64 without a fraction was not rounded to be so.
const EXACT: f64 = (1_u64 << 52) as f64;

/// A call of a function with at most this many parameters allocates nothing.
const FEW: usize = 4;

/// The facts that an expression may read. Facts that are not known at its place in the file keep their
/// defaults.
#[derive(Debug, Clone, Copy)]
pub struct Facts<'a> {
    /// The parameters of the action or function around it.
    pub locals: &'a [Value],
    pub memory: &'a Memory,
    pub road: Option<&'a RoadFacts>,
    pub world: Option<&'a WorldFacts>,
    /// The spawn that the expression is about.
    pub spawn: Option<SpawnFacts>,
    pub outcome: OutcomeFacts,
    /// Of each requirement the smallest margin of the step, NaN for one that was not asked.
    pub margins: &'a [f64],
}

/// What rules may ask the world at a draw ([`Known::World`] and later).
///
/// [`Known::World`]: crate::model::vocabulary::Known::World
#[derive(Debug, Clone, Default)]
pub struct WorldFacts {
    pub moment: MomentFacts,
    /// Number of the step.
    pub step: u64,
    /// Each spawn of the action for which the world has found a place.
    pub spawns: Vec<SpawnFacts>,
    /// Those that are asked for by number and are there.
    pub road_users: Vec<(u32, NpcFacts)>,
    /// Those that are asked for by name and are there.
    pub bearers: Vec<(usize, NpcFacts)>,
    /// Those near, if a requirement asks of them.
    pub near: Vec<NearFacts>,
    /// What requirements alone may ask.
    pub tick: TickFacts,
    /// When each action last happened, s since the episode began; empty if nothing asks for that.
    pub happened_s: Vec<f64>,
}

/// A road user near the ego vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearFacts {
    pub id: u32,
    pub body: BodyWord,
    pub npc: NpcFacts,
}

impl NearFacts {
    /// Whether it has one of these bodies; any will do where there is none.
    pub fn is_of(&self, bodies: &[BodyWord]) -> bool {
        bodies.is_empty() || bodies.iter().any(|named| self.body.is(*named))
    }
}

/// Stands for a road user ahead that is farther away, and for none at all, m.
pub const LEAD_GAP_M_MAX: f64 = 1000.0;

/// What is watched over time for requirements ([`Known::Tick`]).
///
/// [`Known::Tick`]: crate::model::vocabulary::Known::Tick
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TickFacts {
    /// To the next road user ahead in the ego vehicle's way, and its speed along the route.
    pub lead_gap_m: f64,
    pub lead_speed_mps: f64,
    pub lead_since_s: f64,
    pub over_red_m: f64,
    pub over_stop_m: f64,
    pub over_line_m: f64,
    pub over_crosswalk_m: f64,
    pub crosses: Crossing,
    pub lane_offset_m: f64,
    pub over_oncoming_m: f64,
    pub over_lane_m: f64,
    /// How far its middle is beside all lanes, m.
    pub off_road_m: f64,
    pub visibility_m: f64,
    pub jerk_mps3: f64,
    pub lateral_mps2: f64,
}

/// The longest time that `since` tells, s: also of actions that never happened.
pub const SINCE_S_MAX: f64 = 1000.0;

/// What can be asked about the ego vehicle and its surroundings at a moment.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MomentFacts {
    pub ego_speed_mps: f64,
    pub ego_acceleration_mps2: f64,
    /// Limit of the route's lane at the ego vehicle.
    pub ego_limit_mps: f64,
    /// Along the route to the next junction: 0 inside one, at most [`JUNCTION_AHEAD_M_MAX`].
    pub ego_junction_ahead_m: f64,
    /// The same to the end of that junction.
    pub ego_junction_end_m: f64,
    pub ego_crosswalk_ahead_m: f64,
    /// Of the route's lane at the ego vehicle.
    pub ego_lane_width_m: f64,
    pub ego_route_left_m: f64,
    /// Positive to the left of the route.
    pub ego_offset_m: f64,
    /// Stations of its bumpers on the route.
    pub ego_front_m: f64,
    pub ego_rear_m: f64,
    pub ego_light: Light,
    pub ego_light_times: LightTimes,
    pub ego_road: RoadKind,
    /// Where the route goes at the next junction.
    pub ego_turn: Turn,
    pub road_users: u32,
    /// Those that were told to ignore a rule of the road.
    pub rule_breakers: u32,
    /// Between the outlines.
    pub nearest_gap_m: f64,
    pub nearest_speed_mps: f64,
    pub elapsed_s: f64,
}

/// Since when a light has its colour and until when, s: [`SINCE_S_MAX`] without a light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightTimes {
    pub since_s: f64,
    pub left_s: f64,
}

impl Default for LightTimes {
    fn default() -> LightTimes {
        LightTimes { since_s: SINCE_S_MAX, left_s: SINCE_S_MAX }
    }
}

/// Stands for a junction that is farther away, and for none at all, m.
pub const JUNCTION_AHEAD_M_MAX: f64 = 1000.0;

/// What can be asked about a road user other than the ego vehicle at a moment.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NpcFacts {
    pub speed_mps: f64,
    /// Along its heading, negative when it brakes.
    pub acceleration_mps2: f64,
    /// To the ego vehicle, between the outlines.
    pub gap_m: f64,
    /// Along its way to the next junction, as in [`MomentFacts`].
    pub junction_ahead_m: f64,
    /// From its front, and from the ego vehicle's, to where their ways cross next.
    pub crossing_ahead_m: f64,
    pub ego_crossing_ahead_m: f64,
    /// From its front to the end of its lane, at most [`JUNCTION_AHEAD_M_MAX`].
    pub lane_left_m: f64,
    /// Limit of the lane that it is in.
    pub limit_mps: f64,
    /// The next light on its way; none for who is on foot.
    pub light: Light,
    pub light_times: LightTimes,
    /// Which of it and the ego vehicle goes first, since one of them came into the other's way.
    pub priority: Priority,
    /// Stations of its ends on the ego vehicle's route.
    pub front_m: f64,
    pub rear_m: f64,
    /// How far its middle is to the left of that route.
    pub offset_m: f64,
    /// Until the stretches of the route beside the two meet, at most [`TIME_S_MAX`].
    pub ttc_s: f64,
    /// Way between the two, by the speed of the one behind, at most [`TIME_S_MAX`].
    pub headway_s: f64,
    /// Its speed along that route, and to the left across it.
    pub along_mps: f64,
    pub across_mps: f64,
    /// The room between the two across the route; below 0 they overlap.
    pub aside_m: f64,
    /// How far it reaches into the ego vehicle's lane there; below 0 what is missing.
    pub in_lane_m: f64,
    /// From its middle to the nearest crosswalk, at most [`CROSSWALK_GAP_M_MAX`].
    pub crosswalk_gap_m: f64,
    /// The same of the crosswalk that is the next one on the ego vehicle's route.
    pub next_crosswalk_gap_m: f64,
    /// Until the two touch, if both go on along and across the route as now, at most [`TIME_S_MAX`].
    pub contact_in_s: f64,
    /// Since one of the two left the place where the other is, at most [`TIME_S_MAX`]. Known only to who watches.
    pub pet_s: f64,
    /// Where it is along the trajectory that it follows; 0 if it follows none.
    pub station_m: f64,
    pub has_siren: bool,
    /// Whether it and another one than the ego vehicle have crashed into each other. Known only of who is there.
    pub crashed: bool,
    /// Whether it is the one ahead of the ego vehicle, in which lane to the left of that one's it is, and how far off the road, m:
    /// known only to who watches.
    pub leads: bool,
    pub lanes_left: i32,
    pub off_road_m: f64,
    /// Whether it drives in the junction that is the next one of the ego vehicle's route.
    pub in_next_junction: bool,
    /// Where it means to go at the next junction; nowhere for who is on foot.
    pub turn: Turn,
}

/// Stands for a crosswalk that is farther away, and for none at all, m.
pub const CROSSWALK_GAP_M_MAX: f64 = 100.0;

/// Stands for a time that is longer, and for one that does not come at all, s.
pub const TIME_S_MAX: f64 = 100.0;

/// What a rule may ask about a spawn before it happens.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SpawnFacts {
    /// Distance between the outlines of the ego vehicle and the newcomer, or the vehicle that is parked with it,
    /// whichever is nearer, m.
    pub spawn_gap_m: f64,
    /// Gap that a careful and competent driver would need there, m; 0 if the two do not approach.
    pub safety_gap_m: f64,
    /// The road user that would appear.
    pub npc: NpcFacts,
}

/// The facts that verdicts and rewards may read.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OutcomeFacts {
    /// The ego vehicle touched something.
    pub collision: bool,
    /// The ego vehicle had touched this obstacle before.
    pub repeated: bool,
    /// The obstacle appeared too late for any driver.
    pub sudden: bool,
    /// The obstacle ran into the side or rear of an ego vehicle that did not have to give way.
    pub struck: bool,
    /// Who had to give way. Known for collisions alone.
    pub priority: Priority,
    /// What was hit, if anything was.
    pub hit: Option<BodyWord>,
    /// What came nearest to a collision in the step, or was hit.
    pub near: Option<BodyWord>,
    /// A careful reference driver would not have touched the obstacle. Known for judged collisions alone.
    pub avoidable: bool,
    /// Collision probability of the step, in `[0, 1]`.
    pub proc: f64,
    /// Bit `i` is set if requirement `i` was breached in the step.
    pub breached: u64,
}

impl<'a> Facts<'a> {
    pub fn new(locals: &'a [Value], memory: &'a Memory) -> Facts<'a> {
        let outcome = OutcomeFacts::default();
        Facts { locals, memory, road: None, world: None, spawn: None, outcome, margins: &[] }
    }
}

/// The value of an expression.
pub fn evaluate(expr: &Expr, functions: &[FnDef], facts: &Facts<'_>) -> Value {
    effort::spend(1);
    let value = |expr: &Expr| evaluate(expr, functions, facts);
    match &expr.kind {
        ExprKind::Bool(truth) => Value::Bool(*truth),
        ExprKind::Number(number) => Value::Number(number.to_f64()),
        ExprKind::Variant(of, index) => Value::Variant(*of, *index),
        ExprKind::Local(index) => facts.locals[*index],
        ExprKind::Cell(cell) => facts.memory.cells[*cell],
        ExprKind::CellAt(first, key) => facts.memory.cells[first + value(key).variant()],
        ExprKind::Fact(fact) => fact.value(facts),
        ExprKind::OfRoadUser(id, fact) => {
            let mut users = facts.world.into_iter().flat_map(|world| &world.road_users);
            fact.value(&about(users.find(|(known, _)| known == id).map(|(_, npc)| *npc), facts))
        }
        ExprKind::OfBearer(who, fact) => fact.value(&about(bearer(who.bearer(facts.locals), facts), facts)),
        ExprKind::Since(actions, _) => Value::Number(facts.world.map_or(f64::NAN, |world| {
            let happened_s = |action: &usize| world.happened_s.get(*action).copied();
            let last_s = actions.iter().filter_map(happened_s).fold(f64::NEG_INFINITY, f64::max);
            // As near as `elapsed` to the exact time.
            ((world.moment.elapsed_s - last_s) * 1000.0).round().min(SINCE_S_MAX * 1000.0) / 1000.0
        })),
        // What was, only requirements remember.
        ExprKind::Past(_, PastWord::Change | PastWord::Total | PastWord::Times, _) => Value::Number(0.0),
        ExprKind::Past(condition, ..) => evaluate(condition, functions, facts),
        ExprKind::Near(word, bodies, condition) => {
            let near = facts.world.map_or(&[][..], |world| &world.near);
            let holds =
                |near: &NearFacts| evaluate(condition, functions, &about(Some(near.npc), facts)).truth();
            let mut meant = near.iter().filter(|near| near.is_of(bodies));
            match word {
                NearWord::Some => Value::Bool(meant.any(holds)),
                NearWord::Count => Value::Number(meant.filter(|near| holds(near)).count() as f64),
            }
        }
        ExprKind::Margin(requirement) => {
            Value::Number(facts.margins.get(*requirement).copied().unwrap_or(f64::NAN))
        }
        ExprKind::Breached(requirement) => Value::Bool(facts.outcome.breached >> requirement & 1 == 1),
        ExprKind::IsThere(who) => Value::Bool(bearer(who.bearer(facts.locals), facts).is_some()),
        ExprKind::Call(function, arguments) => {
            let body = &functions[*function].body;
            let mut few = [Value::Bool(false); FEW];
            match few.get_mut(..arguments.len()) {
                Some(locals) => {
                    locals.iter_mut().zip(arguments).for_each(|(local, argument)| *local = value(argument));
                    evaluate(body, functions, &Facts { locals, ..*facts })
                }
                None => {
                    let locals: Vec<Value> = arguments.iter().map(value).collect();
                    evaluate(body, functions, &Facts { locals: &locals, ..*facts })
                }
            }
        }
        ExprKind::OfNumbers(word, numbers) => {
            Value::Number(of_numbers(*word, numbers.iter().map(|expr| value(expr).number())))
        }
        ExprKind::Not(inner) => Value::Bool(!value(inner).truth()),
        ExprKind::Negate(inner) => Value::Number(-value(inner).number()),
        ExprKind::Arithmetic(op, left, right) => {
            Value::Number(arithmetic(*op, value(left).number(), value(right).number()))
        }
        ExprKind::Compare(op, left, right) => Value::Bool(compare(*op, value(left), value(right))),
        ExprKind::And(left, right) => Value::Bool(value(left).truth() && value(right).truth()),
        ExprKind::Or(left, right) => Value::Bool(value(left).truth() || value(right).truth()),
        ExprKind::Implies(left, right) => Value::Bool(!value(left).truth() || value(right).truth()),
        ExprKind::InRange(inner, low, high) => {
            let inner = value(inner);
            let above = compare(Comparison::GreaterEqual, inner, value(low));
            Value::Bool(above && compare(Comparison::LessEqual, inner, value(high)))
        }
        ExprKind::InList(inner, list) => {
            let inner = value(inner);
            Value::Bool(list.iter().any(|item| compare(Comparison::Equal, inner, value(item))))
        }
        ExprKind::InLanes(inner, lanes) => Value::Bool(has_lane(facts, lanes[value(inner).variant()])),
        ExprKind::OnRoad(names) => Value::Bool(facts.road.is_some_and(|road| names.contains(&road.name))),
        ExprKind::IsWord(fact, words) => {
            Value::Bool(word_of(*fact, facts).is_some_and(|word| words.iter().any(|one| one == word)))
        }
        ExprKind::IsWordOf(who, fact, words) => {
            let word = word_of_bearer(*who, *fact, facts);
            Value::Bool(word.is_some_and(|word| words.iter().any(|one| one == word)))
        }
        ExprKind::IsBody(fact, bodies) => {
            let found = if *fact == WordFact::Hit { facts.outcome.hit } else { facts.outcome.near };
            Value::Bool(found.is_some_and(|found| bodies.iter().any(|named| found.is(*named))))
        }
        ExprKind::Match { subject, arm_of, arms } => value(&arms[arm_of[value(subject).variant()]]),
    }
}

fn bearer(who: usize, facts: &Facts<'_>) -> Option<NpcFacts> {
    let mut bearers = facts.world.into_iter().flat_map(|world| &world.bearers);
    bearers.find(|(known, _)| *known == who).map(|(_, npc)| *npc)
}

/// The same facts, with this road user, if it is there, as the newcomer.
pub(crate) fn about<'a>(npc: Option<NpcFacts>, facts: &Facts<'a>) -> Facts<'a> {
    Facts { spawn: npc.map(|npc| SpawnFacts { npc, ..SpawnFacts::default() }), ..*facts }
}

/// The word that a fact is; `None` where it is not known.
pub(crate) fn word_of(fact: WordFact, facts: &Facts<'_>) -> Option<&'static str> {
    match fact {
        WordFact::EgoLight => facts.world.map(|world| world.moment.ego_light.name()),
        WordFact::EgoRoad => facts.world.map(|world| world.moment.ego_road.name()),
        WordFact::EgoCrosses => facts.world.map(|world| world.tick.crosses.name()),
        WordFact::EgoTurn => facts.world.map(|world| world.moment.ego_turn.name()),
        WordFact::NpcTurn => facts.spawn.map(|spawn| spawn.npc.turn.name()),
        WordFact::NpcLight => facts.spawn.map(|spawn| spawn.npc.light.name()),
        WordFact::NpcPriority => facts.spawn.map(|spawn| spawn.npc.priority.name()),
        WordFact::Priority => Some(facts.outcome.priority.name()),
        WordFact::Hit => facts.outcome.hit.map(|body| body.like.name()),
        WordFact::Near => facts.outcome.near.map(|body| body.like.name()),
    }
}

/// The word that a fact about the latest bearer of a name is; `None` where there is none.
pub(crate) fn word_of_bearer(who: Who, fact: WordFact, facts: &Facts<'_>) -> Option<&'static str> {
    word_of(fact, &about(bearer(who.bearer(facts.locals), facts), facts))
}

fn has_lane(facts: &Facts<'_>, lane: LaneChoice) -> bool {
    facts.road.is_some_and(|road| road.has_lane(lane))
}

/// What a word makes of numbers; NaN if one of them has no value.
pub(crate) fn of_numbers(word: NumberWord, numbers: impl Iterator<Item = f64>) -> f64 {
    let chosen = |a: f64, b: f64| match word {
        _ if a.is_nan() => a,
        NumberWord::Min if a <= b => a,
        NumberWord::Max if a >= b => a,
        NumberWord::Min | NumberWord::Max | NumberWord::Abs => b,
    };
    let sized = numbers.map(|number| if word == NumberWord::Abs { number.abs() } else { number });
    sized.reduce(chosen).unwrap_or(f64::NAN)
}

/// The result, or NaN if it has no value: an infinity would satisfy comparisons.
pub(crate) fn arithmetic(op: Arithmetic, left: f64, right: f64) -> f64 {
    let result = match op {
        Arithmetic::Add => sum(left, right),
        Arithmetic::Subtract => sum(left, -right),
        Arithmetic::Multiply => left * right,
        Arithmetic::Divide => left / right,
    };
    if result.is_finite() { result } else { f64::NAN }
}

/// The difference of equal numbers is 0, so that a countdown from 0.3 by 0.1 ends at 0, and not at -3e-17.
fn sum(left: f64, right: f64) -> f64 {
    let cancel = left.is_finite() && are_equal(left, -right);
    if cancel { 0.0 } else { left + right }
}

/// Compares numbers by size, variants by position, and truth values by equality.
pub(crate) fn compare(op: Comparison, left: Value, right: Value) -> bool {
    match (left, right) {
        (Value::Number(left), Value::Number(right)) => compare_numbers(op, left, right),
        (Value::Variant(_, left), Value::Variant(_, right)) => op.holds(left, right),
        (left, right) => op.holds(left.truth(), right.truth()),
    }
}

/// Whether numbers are equal, or differ by [`EQUAL_PART`] of the larger one at most: the language's numbers are exact, and
/// 0.1 + 0.2 is another f64 than 0.3. Whole numbers below [`EXACT`] are exact in both.
fn are_equal(left: f64, right: f64) -> bool {
    let apart = (left - right).abs();
    let largest = left.abs().max(right.abs());
    let are_exact = || left.fract() == 0.0 && right.fract() == 0.0 && largest < EXACT;
    // Without a road user the nearest gap is infinite, which is no number of ten digits.
    left == right || apart.is_finite() && apart <= EQUAL_PART * largest && !are_exact()
}

/// Compares with that tolerance. Of less, equal and greater exactly one holds, unless a number is NaN.
#[inline]
pub(crate) fn compare_numbers(op: Comparison, left: f64, right: f64) -> bool {
    // The tolerance is asked for only where it decides.
    let equal = || are_equal(left, right);
    match op {
        Comparison::Equal => equal(),
        Comparison::NotEqual => !equal(),
        Comparison::Less => left < right && !equal(),
        Comparison::Greater => left > right && !equal(),
        Comparison::LessEqual => left <= right || equal(),
        Comparison::GreaterEqual => left >= right || equal(),
    }
}

impl<W> WordExpr<W> {
    /// The expression that chooses the word, if it is not fixed.
    pub fn expr(&self) -> Option<&Expr> {
        match self {
            WordExpr::Fixed(_) => None,
            WordExpr::Of(expr, _) => Some(expr),
        }
    }
}

impl<W: Copy> WordExpr<W> {
    /// The word that the expression gives.
    pub fn word(&self, functions: &[FnDef], facts: &Facts<'_>) -> W {
        match self {
            WordExpr::Fixed(word) => *word,
            WordExpr::Of(expr, words) => words[evaluate(expr, functions, facts).variant()],
        }
    }
}

impl Space {
    /// Reward of a step: the value of the first case that applies; 0 if none does, or if it has no value (a division
    /// by 0), so that neither a database nor a network meets it. `memory` holds the states after the action of the step,
    /// `margins` the smallest one of each requirement in it (SI, NaN for one that was not asked).
    pub fn reward(&self, outcome: OutcomeFacts, memory: &Memory, margins: &[f64]) -> f64 {
        let facts = Facts { outcome, margins, ..Facts::new(&[], memory) };
        let applies = |condition: &Option<Expr>| {
            condition.as_ref().is_none_or(|c| evaluate(c, &self.functions, &facts).truth())
        };
        let case = self.reward.iter().find(|case| applies(&case.condition));
        let value = case.map(|case| evaluate(&case.value, &self.functions, &facts).number());
        value.filter(|value| value.is_finite()).unwrap_or(0.0)
    }

    /// The requirements whose margins rewards ask for, by bit.
    pub fn margins_paid(&self) -> u64 {
        let asked = self.reward.iter().flat_map(|case| case.condition.iter().chain([&case.value]));
        let of = |expr: &Expr| -> Vec<usize> {
            let margins = expr.filter_map(|kind| match kind {
                ExprKind::Margin(requirement) => Some(*requirement),
                _ => None,
            });
            margins.into_iter().collect()
        };
        asked.flat_map(of).fold(0, |set, requirement| set | 1 << requirement)
    }

    /// Whether a collision passes the verdict of that name; `None` if there is no such verdict. `memory` is as for
    /// [`Space::reward`].
    pub fn verdict(&self, name: &str, outcome: OutcomeFacts, memory: &Memory) -> Option<bool> {
        let facts = Facts { outcome, ..Facts::new(&[], memory) };
        let verdict = self.verdicts.iter().find(|verdict| verdict.name == name)?;
        Some(evaluate(&verdict.condition, &self.functions, &facts).truth())
    }

    /// The clauses of the verdict [`COUNTED`] that a collision does not meet, as they were written; empty if it counts.
    pub fn unmet(&self, outcome: OutcomeFacts, memory: &Memory) -> Vec<&str> {
        let facts = Facts { outcome, ..Facts::new(&[], memory) };
        let Some(verdict) = self.verdicts.iter().find(|verdict| verdict.name == COUNTED) else {
            return Vec::new();
        };
        let is_unmet = |clause: &&Expr| !evaluate(clause, &self.functions, &facts).truth();
        let clauses = verdict.condition.clauses();
        clauses
            .iter()
            .zip(&verdict.clauses)
            .filter(|(clause, _)| is_unmet(clause))
            .map(|(_, text)| text.as_str())
            .collect()
    }

    /// Whether a collision counts: the verdict [`COUNTED`].
    pub fn counts(&self, outcome: OutcomeFacts, memory: &Memory) -> bool {
        let counts = self.verdict(COUNTED, outcome, memory);
        counts.expect("the checker adds the verdict where the author has none")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_two_numbers_one_is_less_or_they_are_equal() {
        let all = [
            0.0,
            -0.0,
            0.3,
            0.1 + 0.2,
            0.3000001,
            -0.3,
            1e-12,
            2e-12,
            1e12,
            1e12 + 1.0,
            // On both sides of the bound, and on it.
            0.3 * (1.0 + 0.9 * EQUAL_PART),
            0.3 * (1.0 + 1.1 * EQUAL_PART),
            0.5 * (1.0 - EQUAL_PART),
            0.5,
            f64::INFINITY,
            f64::NEG_INFINITY,
        ];
        for (left, right) in all.into_iter().flat_map(|left| all.map(|right| (left, right))) {
            let holds = |op| compare_numbers(op, left, right);
            let found = [Comparison::Less, Comparison::Equal, Comparison::Greater].map(holds);
            assert_eq!(found.iter().filter(|one| **one).count(), 1, "{left} {right}");
            assert_eq!(holds(Comparison::LessEqual), !found[2], "{left} {right}");
            assert_eq!(holds(Comparison::GreaterEqual), !found[0], "{left} {right}");
            assert_eq!(holds(Comparison::NotEqual), !found[1], "{left} {right}");
        }
        // What has no value is in no order.
        let ordered = [Comparison::Less, Comparison::LessEqual, Comparison::Equal, Comparison::GreaterEqual];
        assert!(ordered.into_iter().all(|op| !compare_numbers(op, f64::NAN, 1.0)));
        assert!(compare_numbers(Comparison::NotEqual, f64::NAN, f64::NAN));
    }

    #[test]
    fn numbers_within_a_billionth_are_equal_unless_both_are_whole() {
        let billionth = |part: f64| (0.3, 0.3 * (1.0 + part * EQUAL_PART));
        let equal = [
            (0.3, 0.1 + 0.2),
            billionth(0.9),
            (0.0, -0.0),
            (1e300, 1e300),
            (1e9 + 0.5, 1e9),
            // Both are whole only because they are so large.
            ((0.1 + 0.2) * 3e16, 0.3 * 3e16),
        ];
        let apart = [billionth(1.1), (1e-12, 2e-12), (0.0, 1e-300), (1e12, 1e12 + 1.0)];
        let all = equal.map(|pair| (pair, true)).into_iter().chain(apart.map(|pair| (pair, false)));
        for ((left, right), expected) in all {
            assert_eq!(are_equal(left, right), expected, "{left} {right}");
            assert_eq!(are_equal(right, left), expected, "{right} {left}");
        }
        assert!(!are_equal(f64::INFINITY, 1.0) && !are_equal(f64::NAN, f64::NAN));
    }

    #[test]
    fn numbers_are_equal_where_their_difference_is_0() {
        let all = [0.0, 0.1, 0.3, 0.1 + 0.2, -0.3, 7.0, 7.000_000_001, 1e12, 1e12 + 1.0, 1e300, 5e-324];
        for (left, right) in all.into_iter().flat_map(|left| all.map(|right| (left, right))) {
            let is_zero = |op, right| arithmetic(op, left, right) == 0.0;
            assert_eq!(is_zero(Arithmetic::Subtract, right), are_equal(left, right), "{left} {right}");
            assert_eq!(is_zero(Arithmetic::Add, -right), are_equal(left, right), "{left} {right}");
        }
        let subtract = |left, right| arithmetic(Arithmetic::Subtract, left, right);
        assert_eq!(subtract(subtract(subtract(0.3, 0.1), 0.1), 0.1), 0.0);
        assert_eq!(subtract(1e12 + 1.0, 1e12), 1.0);
        assert!(subtract(f64::INFINITY, f64::INFINITY).is_nan());
    }
}
