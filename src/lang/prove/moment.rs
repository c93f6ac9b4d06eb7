//! Whether facts of the moment can meet conditions together: `ego.light == Red and ego.light == Green` holds at no
//! moment, nor does `ego.speed >= 200 m/s`.
//!
//! The range of a fact is cut into pieces where a condition compares it with something known. If in every combination of
//! pieces some condition fails, no moment meets them all. [`Case::is_possible`] knows which facts exclude each other,
//! [`newcomers`] the facts of newcomers. The stretches of a road hold its facts; the ego vehicle is on one of them. All
//! other facts are taken to be independent, so a combination that is possible here may still never come.

use core::ops::RangeInclusive;

use crate::model::expr::{Comparison, Expr, ExprKind};
use crate::model::rules::RowRules;
use crate::model::vocabulary::{Fact, Field, Known as From, Light, RoadKind, Verb, Word, WordFact};
use crate::model::{
    ActionDef, End, EpisodeDef, Interval, LIMIT_PART_MAX, NEAR_JUNCTION_M, RoadFacts, Row, RuleBody,
    RulesInForce, SPAWN_SPEED_MPS, SPEED_MPS_MAX, Space, SpawnDef, Stretch, Type, WordExpr, code, effort,
};
use crate::prove::enclose::{Known, bits, enclose, fact_range};
use crate::prove::sums::oppose;
use crate::syntax::Diagnostic;
use avastra_base::units::Rational;

/// The most combinations of pieces for one question; facts beyond it stay whole.
const CASES_MAX: usize = 2_048;

/// Steps that a combination of pieces takes beside the evaluation of conditions, and those for each operation of a
/// condition whose facts are looked for.
const CASE_STEPS: usize = 8;
const PARTS_STEPS: usize = 2;

/// A piece for each of some facts.
#[derive(Debug, Clone, Default)]
pub(crate) struct Case {
    numbers: Vec<(Fact, Interval)>,
    words: Vec<(WordFact, &'static str)>,
    /// The words that some facts do not have.
    not_words: Vec<(WordFact, &'static str)>,
}

impl Case {
    /// A moment of which the steps alone are known: one of their beginnings, or, of whole steps, any moment within them.
    pub fn of_steps(episode: &EpisodeDef, steps: RangeInclusive<u64>, are_whole: bool) -> Case {
        let at = |step: u64| Rational::from_rounded(episode.time_s(step));
        let (first, last) = (*steps.start(), *steps.end());
        let elapsed = match (at(first), at(last + u64::from(are_whole))) {
            (Some(from), Some(to)) => Interval::closed(from, to),
            _ => Interval::NOT_NEGATIVE,
        };
        let number = |step: u64| Rational::integer(i64::try_from(step).unwrap_or(i64::MAX));
        let steps = Interval::closed(number(first), number(last));
        Case { numbers: vec![(Fact::Elapsed, elapsed), (Fact::StepNumber, steps)], ..Case::default() }
    }

    /// From here on a fact is such a number: of several entries the first holds.
    pub fn set_number(&mut self, fact: Fact, piece: Interval) {
        self.numbers.insert(0, (fact, piece));
    }

    pub fn number(&self, fact: Fact) -> Option<Interval> {
        self.numbers.iter().find(|(known, _)| *known == fact).map(|(_, piece)| *piece)
    }

    /// The facts of a moment that a stretch of a route gives.
    fn of_stretch(stretch: &Stretch) -> Case {
        let Stretch { limit_mps, junction_ahead_m, route_left_m, has_light, road, turn } = stretch;
        let numbers = vec![
            (Fact::EgoLimit, measured(*limit_mps, *limit_mps)),
            (Fact::EgoJunctionAhead, measured(*junction_ahead_m.start(), *junction_ahead_m.end())),
            (Fact::EgoRouteLeft, measured(*route_left_m.start(), *route_left_m.end())),
        ];
        let no_light = (WordFact::EgoLight, Light::None.name());
        let (lights, not_words) =
            if *has_light { (None, vec![no_light]) } else { (Some(no_light), Vec::new()) };
        let words = lights
            .into_iter()
            .chain([(WordFact::EgoRoad, road.name()), (WordFact::EgoTurn, turn.name())])
            .collect();
        Case { numbers, words, not_words }
    }

    /// The facts of both together; no fact may be known to both.
    fn and(&self, other: &Case) -> Case {
        let mut both = self.clone();
        both.numbers.extend(&other.numbers);
        both.words.extend(&other.words);
        both.not_words.extend(&other.not_words);
        both
    }

    /// Whether the facts may have these values at one moment, by what the engine says of each two of them.
    fn is_possible(&self, episode: &EpisodeDef) -> bool {
        let of = |fact: Fact| self.number(fact);
        let both = |a: Fact, b: Fact| Some((of(a)?, of(b)?));
        let is_zero = |piece: &Interval| piece.single() == Some(Rational::ZERO);
        // An action of a scenario may happen within its step.
        let in_time = both(Fact::StepNumber, Fact::Elapsed).is_none_or(|(step, elapsed)| {
            let Some(step_s) = Rational::from_rounded(episode.step_s) else { return true };
            let from = step.mul(&Interval::point(step_s));
            let within = Interval { low: End::At(Rational::ZERO, true), high: End::At(step_s, false) };
            !from.add(&within).intersect(&elapsed).is_empty()
        });
        let on_road =
            match (self.word(WordFact::EgoRoad).and_then(RoadKind::from_name), of(Fact::EgoJunctionAhead)) {
                (Some(RoadKind::InJunction), Some(ahead)) => ahead.contains(Rational::ZERO),
                (Some(RoadKind::NearJunction), Some(ahead)) => {
                    !ahead.intersect(&at_most(NEAR_JUNCTION_M)).is_empty()
                }
                _ => true,
            };
        let is_alone = of(Fact::RoadUsers).is_some_and(|count| is_zero(&count));
        let at_default =
            |fact: Fact, value: i64| of(fact).is_none_or(|piece| piece.contains(Rational::integer(value)));
        let alone =
            !is_alone || at_default(Fact::NearestGap, NO_ROAD_USER_M) && at_default(Fact::NearestSpeed, 0);
        // The gap of a spawn is that to the vehicle which is parked with it, if that is nearer.
        let gaps = both(Fact::SpawnGap, Fact::NpcGap).is_none_or(|(spawn, npc)| !npc.is_below(&spawn));
        in_time && on_road && alone && gaps
    }

    pub fn word(&self, fact: WordFact) -> Option<&'static str> {
        self.words.iter().find(|(known, _)| *known == fact).map(|(_, word)| *word)
    }
}

/// `nearest.gap` without a road user, m.
const NO_ROAD_USER_M: i64 = 100;

/// The facts of each newcomer of an action before it appears, added to the facts of the moment. An action without newcomers
/// has the facts of the moment alone. The world lets nothing appear faster than it was asked to be. Where `lands` is set, a
/// newcomer also appears at the asked distance, if its verb means a place on the route. That is so where the road is
/// straight and free.
pub(super) fn newcomers(action: &ActionDef, known: &Known<'_>, lands: bool) -> Vec<Case> {
    // Nothing is known of a newcomer that may be missing.
    let surely_appears = |spawn: &&SpawnDef| {
        spawn.row.as_ref().is_none_or(|row| {
            let least = |count: &Expr| enclose(count, known).interval().low;
            row.count.as_ref().is_none_or(|count| match least(count) {
                End::At(least, _) => least.to_f64() > row.nth as f64,
                End::Unbounded => false,
            })
        })
    };
    let newcomers: Vec<Case> =
        action.spawns().filter(surely_appears).map(|spawn| newcomer(spawn, known, lands)).collect();
    match newcomers.is_empty() {
        true => vec![known.case.cloned().unwrap_or_default()],
        false => newcomers,
    }
}

fn newcomer(spawn: &SpawnDef, known: &Known<'_>, lands: bool) -> Case {
    let verbs = match &spawn.verb {
        WordExpr::Fixed(verb) => vec![*verb],
        WordExpr::Of(expr, words) => {
            bits(enclose(expr, known).variants()).map(|variant| words[variant]).collect()
        }
    };
    let Case { mut numbers, words, not_words } = known.case.cloned().unwrap_or_default();
    let asked = enclose(&spawn.speed, known).interval().intersect(&at_most(*SPAWN_SPEED_MPS.end()));
    // A road user that crosses on foot waits at first, and one with `Stand` stands for good.
    let speed = match verbs.iter().all(|verb| matches!(verb, Verb::Walk | Verb::Stand)) {
        true => Interval::point(Rational::ZERO),
        false => Interval { low: End::At(Rational::ZERO, true), high: asked.high },
    };
    if !speed.is_empty() {
        numbers.push((Fact::NpcSpeed, speed));
    }
    let distance = enclose(&spawn.distance, known).interval();
    let is_ahead = matches!(distance.low, End::At(low, _) if low >= Rational::ZERO);
    let is_on_route =
        |verb: &Verb| !verb.walks_along() && !matches!(verb, Verb::Walk | Verb::CrossRoad | Verb::Follow);
    // Those of a row but the first begin farther away than it says.
    if lands
        && spawn.row.is_none()
        && spawn.of.is_none()
        && !spawn.told.says(Field::Offset)
        && is_ahead
        && verbs.iter().all(is_on_route)
        && !distance.is_empty()
    {
        numbers.extend([(Fact::NpcGap, distance), (Fact::SpawnGap, distance)]);
    }
    Case { numbers, words, not_words }
}

/// Whether the conditions may all hold at one moment of a draw, for each of these newcomers.
pub(super) fn may_hold_together(
    conditions: &[&Expr],
    known: &Known<'_>,
    episode: &EpisodeDef,
    newcomers: impl FnOnce() -> Vec<Case>,
) -> bool {
    let may_all_hold = |conditions: &[&Expr], known: &Known<'_>| {
        conditions.iter().all(|condition| enclose(condition, known).may_hold())
    };
    if !may_all_hold(conditions, known) {
        return false;
    }
    let asking: Vec<&Expr> = conditions.iter().copied().filter(|c| c.known() > From::Road).collect();
    if asking.is_empty() {
        return true;
    }
    let asked = Asked::of(&asking, known);
    let newcomers = newcomers();
    let is_met = |case: &Case| may_all_hold(&asking, &Known { case: Some(case), ..*known });
    let meets = |within: &Case| asked.any_case(within, known, episode, &is_met);
    let meets_all = |place: &Case| newcomers.iter().all(|newcomer| meets(&newcomer.and(place)));
    !oppose(&asking, known, false) && places(&asking, known).any(|place| meets_all(&place))
}

/// The facts of the road at the moments that conditions ask about: a case for each stretch of the route, or one without
/// known facts.
fn places<'a>(asking: &[&Expr], known: &Known<'a>) -> impl Iterator<Item = Case> + use<'a> {
    let is_of_place = |kind: &ExprKind| {
        matches!(
            kind,
            ExprKind::Fact(Fact::EgoLimit | Fact::EgoJunctionAhead | Fact::EgoRouteLeft)
                | ExprKind::IsWord(WordFact::EgoRoad | WordFact::EgoLight | WordFact::EgoTurn, _)
        )
    };
    let asks = asking.iter().any(|condition| condition.any(is_of_place));
    let stretches = known.road.filter(|_| asks).map_or(&[][..], |road| &road.stretches);
    let anywhere = stretches.is_empty().then(Case::default);
    anywhere.into_iter().chain(stretches.iter().map(Case::of_stretch))
}

/// Whether the condition can fail at no moment, given what is known.
pub(super) fn always_holds(condition: &Expr, known: &Known<'_>, episode: &EpisodeDef) -> bool {
    let holds = |known: &Known<'_>| !enclose(condition, known).may_fail();
    let fails = |case: &Case| !holds(&Known { case: Some(case), ..*known });
    holds(known) || !Asked::of(&[condition], known).any_case(&Case::default(), known, episode, &fails)
}

/// One warning for each rule that lets no lane change begin, at any moment.
pub(super) fn report(space: &Space) -> Vec<Diagnostic> {
    let in_force = RulesInForce::by_default(space);
    let mut diagnostics = Vec::new();
    for (rule, definition) in space.rules.iter().enumerate() {
        if !in_force.contains(rule) || !matches!(definition.body, RuleBody::During(_)) {
            continue;
        }
        let mut bound =
            definition.body.actions().into_iter().flat_map(|action| space.rows_of(action)).peekable();
        if effort::is_spent() || bound.peek().is_none() {
            continue;
        }
        let never = |row: &Row| {
            let rules = RowRules { space, row, road: None, in_force: &in_force };
            let (Some(locals), Some(condition)) = (rules.settle(), definition.body.during(row.action)) else {
                return true;
            };
            let cells = space.cells_unknown();
            !may_hold_together(&[condition], &rules.known(&locals, &cells), &space.episode, || {
                vec![Case::default()]
            })
        };
        if bound.all(never) {
            let message = format!("rule `{}` lets no lane change begin", definition.name);
            let warning =
                Diagnostic::warning(code::NO_CHANGE, message).at(definition.span, "holds at no moment");
            let help = "say when lane changes may begin; to have none, tell nobody to change lanes";
            diagnostics.push(warning.help(help));
        }
    }
    diagnostics
}

/// The facts of the moment and of newcomers that conditions name and that are bounded, each with its range.
pub(super) fn ranges_named(
    conditions: &[&Expr],
    known: &Known<'_>,
    episode: &EpisodeDef,
    newcomers: &[Case],
) -> Vec<(Fact, Interval)> {
    let range = |fact: Fact| range(fact, known.road, episode);
    let of = |fact: Fact| {
        let ranges = newcomers.iter().map(|newcomer| newcomer.number(fact).unwrap_or_else(|| range(fact)));
        ranges.reduce(|a, b| a.hull(&b)).unwrap_or_else(|| range(fact))
    };
    let named = facts_named(conditions).0.into_iter();
    named.map(|fact| (fact, of(fact))).filter(|(_, range)| range.high != End::Unbounded).collect()
}

/// The facts that conditions ask for. The numbers have the places at which the conditions cut them.
struct Asked {
    words: Vec<WordFact>,
    numbers: Vec<(Fact, Vec<Rational>)>,
}

impl Asked {
    fn of(conditions: &[&Expr], known: &Known<'_>) -> Asked {
        let (numbers, words) = facts_named(conditions);
        effort::spend(PARTS_STEPS * conditions.iter().map(|condition| condition.operations()).sum::<usize>());
        let numbers = numbers.into_iter().map(|fact| (fact, cuts(fact, conditions, known))).collect();
        Asked { words, numbers }
    }

    /// Whether a possible combination of pieces, within what is known of a newcomer, is as `is_wanted` asks.
    fn any_case(
        &self,
        newcomer: &Case,
        known: &Known<'_>,
        episode: &EpisodeDef,
        is_wanted: &dyn Fn(&Case) -> bool,
    ) -> bool {
        let mut combinations = 1;
        let mut words: Vec<(WordFact, Vec<&'static str>)> = Vec::new();
        for fact in &self.words {
            let is_possible = |word: &&'static str| {
                newcomer.word(*fact).is_none_or(|known| known == *word)
                    && !newcomer.not_words.contains(&(*fact, *word))
            };
            let possible: Vec<&'static str> =
                fact.words().into_iter().map(|(word, _)| word).filter(is_possible).collect();
            if combinations * possible.len() <= CASES_MAX {
                combinations *= possible.len();
                words.push((*fact, possible));
            }
        }
        let mut numbers: Vec<(Fact, Vec<Interval>)> = Vec::new();
        for (fact, cuts) in &self.numbers {
            let whole = newcomer.number(*fact).unwrap_or_else(|| range(*fact, known.road, episode));
            let mut pieces = pieces(&whole, cuts);
            pieces.retain(|piece| fact.ty() != Type::Int || piece.has_integer());
            if combinations * pieces.len() > CASES_MAX {
                pieces = vec![whole];
            }
            combinations *= pieces.len();
            numbers.push((*fact, pieces));
        }
        effort::spend(CASE_STEPS);
        let is_met = |case: &Case| {
            effort::spend(CASE_STEPS);
            case.is_possible(episode) && is_wanted(case)
        };
        any_combination(&words, &numbers, &mut Case::default(), &is_met)
    }
}

/// Whether some choice of one word and one piece for each fact is met.
fn any_combination(
    words: &[(WordFact, Vec<&'static str>)],
    numbers: &[(Fact, Vec<Interval>)],
    case: &mut Case,
    is_met: &dyn Fn(&Case) -> bool,
) -> bool {
    if let [(fact, choices), words @ ..] = words {
        return choices.iter().any(|word| {
            case.words.push((*fact, *word));
            let is_found = any_combination(words, numbers, case, is_met);
            case.words.pop();
            is_found
        });
    }
    let [(fact, pieces), numbers @ ..] = numbers else { return is_met(case) };
    pieces.iter().any(|piece| {
        case.numbers.push((*fact, *piece));
        let is_found = any_combination(words, numbers, case, is_met);
        case.numbers.pop();
        is_found
    })
}

/// The facts of the moment and of the newcomer that conditions name.
fn facts_named(conditions: &[&Expr]) -> (Vec<Fact>, Vec<WordFact>) {
    let (mut numbers, mut words) = (Vec::new(), Vec::new());
    for condition in conditions {
        condition.walk(&mut |part| match part.kind {
            ExprKind::Fact(fact)
                if matches!(fact.known(), From::World | From::Spawn)
                    && fact.ty() != Type::Bool
                    && !numbers.contains(&fact) =>
            {
                numbers.push(fact);
            }
            ExprKind::IsWord(fact, _) if fact.known() == From::World && !words.contains(&fact) => {
                words.push(fact);
            }
            _ => {}
        });
    }
    (numbers, words)
}

/// The range of a fact at a draw, on a road if one is given.
fn range(fact: Fact, road: Option<&RoadFacts>, episode: &EpisodeDef) -> Interval {
    let all = fact_range(fact).unwrap_or(Interval::ALL);
    let along = |of: fn(&Stretch) -> (f64, f64)| {
        let ranges = road?.stretches.iter().map(of).map(|(low, high)| measured(low, high));
        ranges.reduce(|a, b| a.hull(&b))
    };
    let of_road = match fact {
        Fact::Elapsed => Some(at_most(episode.step_s * f64::from(episode.step_limit))),
        Fact::StepNumber => Some(at_most(f64::from(episode.step_limit.saturating_sub(1)))),
        Fact::NpcSpeed => Some(at_most(*SPAWN_SPEED_MPS.end())),
        Fact::EgoLimit => along(|stretch| (stretch.limit_mps, stretch.limit_mps)),
        Fact::EgoJunctionAhead => {
            along(|stretch| (*stretch.junction_ahead_m.start(), *stretch.junction_ahead_m.end()))
        }
        Fact::EgoRouteLeft => along(|stretch| (*stretch.route_left_m.start(), *stretch.route_left_m.end())),
        Fact::NpcLimit => road.map(|road| measured(road.map_limits_mps[0], road.map_limits_mps[1])),
        // A pushed road user is no faster than the one that pushes it.
        Fact::NearestSpeed => road.map(|road| {
            let ambient_mps = LIMIT_PART_MAX * road.map_limits_mps[1];
            measured(0.0, SPEED_MPS_MAX.max(ambient_mps))
        }),
        // So far it may come beside its route if it drives straight away from it.
        Fact::EgoOffset => {
            let way_m = SPEED_MPS_MAX * episode.step_s * f64::from(episode.step_limit);
            Some(measured(-way_m, way_m))
        }
        _ => None,
    };
    of_road.map_or(all, |range| range.intersect(&all))
}

/// A range of measured numbers, a little wider than it is, because authors round.
fn measured(low: f64, high: f64) -> Interval {
    let wider = |end: f64, by: f64| Rational::from_f64(end + by * (1e-6 + end.abs() * 1e-6));
    match (wider(low, -1.0), wider(high, 1.0)) {
        (Some(low), Some(high)) => Interval::closed(low, high),
        _ => Interval::ALL,
    }
}

/// From 0 to a number.
fn at_most(high: f64) -> Interval {
    Rational::from_f64(high).map_or(Interval::NOT_NEGATIVE, |high| Interval::closed(Rational::ZERO, high))
}

/// Where conditions compare a fact with something that no fact of the moment decides.
fn cuts(fact: Fact, conditions: &[&Expr], known: &Known<'_>) -> Vec<Rational> {
    let is_fact = |expr: &Expr| expr.kind == ExprKind::Fact(fact);
    let mut cuts = Vec::new();
    let mut cut_at = |expr: &Expr| {
        if expr.known() > From::Road {
            return;
        }
        let Interval { low, high } = enclose(expr, known).interval();
        for end in [low, high] {
            if let End::At(at, _) = end {
                cuts.push(at);
            }
        }
    };
    for condition in conditions {
        condition.walk(&mut |part| match &part.kind {
            // A measured number is `==` another if nearly so: no cut divides these. Whole numbers are what they are.
            ExprKind::Compare(Comparison::Equal | Comparison::NotEqual, ..) | ExprKind::InList(..)
                if fact.ty() != Type::Int => {}
            ExprKind::Compare(_, left, right) if is_fact(left) => cut_at(right),
            ExprKind::Compare(_, left, right) if is_fact(right) => cut_at(left),
            ExprKind::InRange(inner, low, high) if is_fact(inner) => {
                cut_at(low);
                cut_at(high);
            }
            ExprKind::InList(inner, list) if is_fact(inner) => list.iter().for_each(&mut cut_at),
            _ => {}
        });
    }
    cuts.sort_unstable();
    cuts.dedup();
    cuts
}

/// A range cut at these places: what lies between two of them, and each of them alone.
fn pieces(whole: &Interval, cuts: &[Rational]) -> Vec<Interval> {
    let mut pieces = Vec::new();
    let mut low = End::Unbounded;
    for cut in cuts {
        pieces.push(Interval { low, high: End::At(*cut, false) });
        pieces.push(Interval::point(*cut));
        low = End::At(*cut, false);
    }
    pieces.push(Interval { low, high: End::Unbounded });
    pieces.iter().map(|piece| piece.intersect(whole)).filter(|piece| !piece.is_empty()).collect()
}
