//! Whether facts of the moment can meet conditions together: `ego.light == Red and ego.light == Green` holds at no
//! moment, nor does `ego.speed >= 200 m/s`.
//!
//! What a fact may be is cut into pieces where a condition compares it with something known. If in every combination
//! of pieces some condition fails, no moment meets them all. Facts are taken to be independent of each other, so a
//! combination that is possible here may still never come.

use crate::model::expr::{Comparison, Expr, ExprKind};
use crate::model::rules::RowRules;
use crate::model::vocabulary::{Fact, Known as From, WordFact};
use crate::model::{
    End, EpisodeDef, Interval, Row, RuleBody, RulesInForce, SPAWN_SPEED_MPS, Space, Type, code,
};
use crate::prove::enclose::{Known, enclose, fact_range};
use crate::syntax::Diagnostic;
use crate::units::Rational;

/// The most combinations of pieces for one question; facts beyond it stay whole.
const CASES_MAX: usize = 2_048;

/// A piece for each of some facts.
#[derive(Debug, Clone, Default)]
pub(crate) struct Case {
    numbers: Vec<(Fact, Interval)>,
    words: Vec<(WordFact, &'static str)>,
}

impl Case {
    pub fn number(&self, fact: Fact) -> Option<Interval> {
        self.numbers.iter().find(|(known, _)| *known == fact).map(|(_, piece)| *piece)
    }

    pub fn word(&self, fact: WordFact) -> Option<&'static str> {
        self.words.iter().find(|(known, _)| *known == fact).map(|(_, word)| *word)
    }
}

/// Whether the conditions may all hold at one moment of a draw.
pub(super) fn may_hold_together(conditions: &[&Expr], known: &Known<'_>, episode: &EpisodeDef) -> bool {
    let may_all_hold = |conditions: &[&Expr], known: &Known<'_>| {
        conditions.iter().all(|condition| enclose(condition, known).may_hold())
    };
    let asking: Vec<&Expr> = conditions.iter().copied().filter(|c| c.known() > From::Road).collect();
    let is_met = |case: &Case| may_all_hold(&asking, &Known { case: Some(case), ..*known });
    may_all_hold(conditions, known)
        && (asking.is_empty() || cases(&asking, known, episode).iter().any(is_met))
}

/// Whether the condition can fail at no moment, given what is known.
pub(super) fn always_holds(condition: &Expr, known: &Known<'_>, episode: &EpisodeDef) -> bool {
    let holds = |known: &Known<'_>| !enclose(condition, known).may_fail();
    holds(known)
        || cases(&[condition], known, episode).iter().all(|case| holds(&Known { case: Some(case), ..*known }))
}

/// One warning for each rule that lets no lane change begin, at any moment.
pub(super) fn report(space: &Space) -> Vec<Diagnostic> {
    let in_force = RulesInForce::by_default(space);
    let mut diagnostics = Vec::new();
    for (rule, definition) in space.rules.iter().enumerate() {
        let mut bound = space.rows.iter().filter(|row| row.rules.contains(&rule)).peekable();
        if !in_force.contains(rule)
            || !matches!(definition.body, RuleBody::During(_))
            || bound.peek().is_none()
        {
            continue;
        }
        let never = |row: &Row| {
            let rules = RowRules { space, row, road: None, in_force: &in_force };
            let (Some(locals), Some(condition)) = (rules.settle(), definition.body.during(row.action)) else {
                return true;
            };
            let cells = space.cells_unknown();
            !may_hold_together(&[condition], &rules.known(&locals, &cells), &space.episode)
        };
        if bound.all(never) {
            let message = format!("rule `{}` lets no lane change begin", definition.name);
            let warning =
                Diagnostic::warning(code::NO_CHANGE, message).at(definition.span, "holds at no moment");
            let help = "say when lane changes may begin; to have none, write `then: Keep` in the spawn";
            diagnostics.push(warning.help(help));
        }
    }
    diagnostics
}

/// The facts of the moment that conditions name and that are bounded, each with its range, in words.
pub(super) fn ranges_named(conditions: &[&Expr], episode: &EpisodeDef) -> Vec<(Fact, Interval)> {
    let named = facts_named(conditions).0.into_iter();
    named.map(|fact| (fact, range(fact, episode))).filter(|(_, range)| range.high != End::Unbounded).collect()
}

/// Every combination of pieces.
fn cases(conditions: &[&Expr], known: &Known<'_>, episode: &EpisodeDef) -> Vec<Case> {
    let (numbers, words) = facts_named(conditions);
    let mut cases = vec![Case::default()];
    for fact in words {
        let named = fact.words();
        if cases.len() * named.len() > CASES_MAX {
            continue;
        }
        let with = |case: &Case| {
            let case = case.clone();
            let one = |(word, _): &(&'static str, &'static str)| {
                let mut case = case.clone();
                case.words.push((fact, *word));
                case
            };
            named.iter().map(one).collect::<Vec<_>>()
        };
        cases = cases.iter().flat_map(with).collect();
    }
    for fact in numbers {
        let whole = range(fact, episode);
        let mut pieces = pieces(&whole, cuts(fact, conditions, known));
        if cases.len() * pieces.len() > CASES_MAX {
            pieces = vec![whole];
        }
        let with = |case: &Case| {
            let case = case.clone();
            let one = |piece: &Interval| {
                let mut case = case.clone();
                case.numbers.push((fact, *piece));
                case
            };
            pieces.iter().map(one).collect::<Vec<_>>()
        };
        cases = cases.iter().flat_map(with).collect();
    }
    cases
}

/// The facts of the moment and of the newcomer that conditions name.
fn facts_named(conditions: &[&Expr]) -> (Vec<Fact>, Vec<WordFact>) {
    let (mut numbers, mut words) = (Vec::new(), Vec::new());
    for condition in conditions {
        condition.walk(&mut |part| match part.kind {
            ExprKind::Fact(fact)
                if matches!(fact.known(), From::World | From::Spawn) && !numbers.contains(&fact) =>
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

/// What a fact may be at a draw.
fn range(fact: Fact, episode: &EpisodeDef) -> Interval {
    let at_most = |high: f64| match Rational::from_f64(high) {
        Some(high) => Interval::closed(Rational::ZERO, high),
        None => Interval::NOT_NEGATIVE,
    };
    match fact {
        Fact::Elapsed => at_most(episode.step_s * f64::from(episode.step_limit)),
        Fact::StepNumber => at_most(f64::from(episode.step_limit.saturating_sub(1))),
        // A commanded road user is at most as fast as it was asked to be.
        Fact::NpcSpeed => at_most(*SPAWN_SPEED_MPS.end()),
        _ => fact_range(fact).unwrap_or(Interval::ALL),
    }
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
fn pieces(whole: &Interval, cuts: Vec<Rational>) -> Vec<Interval> {
    let mut pieces = Vec::new();
    let mut low = End::Unbounded;
    for cut in cuts {
        pieces.push(Interval { low, high: End::At(cut, false) });
        pieces.push(Interval::point(cut));
        low = End::At(cut, false);
    }
    pieces.push(Interval { low, high: End::Unbounded });
    pieces.iter().map(|piece| piece.intersect(whole)).filter(|piece| !piece.is_empty()).collect()
}
