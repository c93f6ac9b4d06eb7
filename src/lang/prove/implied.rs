//! Rules that change nothing: they always hold, on every road or on those of the space, or they follow from other rules.

use crate::model::expr::{Expr, ExprKind};
use crate::model::rules::{Demand, RowRules};
use crate::model::{Road, Row, RuleBody, RulesInForce, Space, code, effort};
use crate::prove::enclose::{Known, Values, enclose};
use crate::prove::lists::{distinct, rule_names};
use crate::prove::moment::always_holds;
use crate::syntax::{Diagnostic, listed};

/// Limit on rows times rules for the whole report; rules beyond it are not looked at.
const WORK_MAX: usize = 1_000_000;

/// The most starts of an episode that are looked at for one rule.
const STARTS_MAX: usize = 1_000;

/// The most combinations of words and truths that a condition is tried with.
const SPLITS_MAX: usize = 64;

/// One warning for each rule that can never refuse anything, on any road and with any memory. If two rules
/// follow from each other, the later one is named. A rule that by itself refuses nothing on the roads of the space may be
/// meant for others: that is a remark.
pub(super) fn report(space: &Space) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    let mut work = WORK_MAX;
    let mut kept = RulesInForce::by_default(space);
    for rule in (0..space.rules.len()).rev().take_while(|_| !effort::is_spent()) {
        let others = kept.except(rule);
        if !follows(space, rule, &others, &mut work) {
            if is_idle_on_the_roads(space, rule, &mut work) {
                diagnostics.push(remark(space, rule));
            }
            continue;
        }
        let mut reasons = others.clone();
        for other in others.all().take_while(|_| !effort::is_spent()) {
            let fewer = reasons.except(other);
            if follows(space, rule, &fewer, &mut work) {
                reasons = fewer;
            }
        }
        kept = others;
        diagnostics.push(warning(space, rule, &reasons.all().collect::<Vec<_>>()));
    }
    diagnostics
}

fn warning(space: &Space, rule: usize, reasons: &[usize]) -> Diagnostic {
    let definition = &space.rules[rule];
    if reasons.is_empty() {
        let message = format!("rule `{}` can never refuse anything", definition.name);
        let label = match space.each_step.is_empty() {
            true => "holds for every value that its actions can have",
            false => "holds for every value that its actions can have, and after all that `each step` sets",
        };
        return Diagnostic::warning(code::NEVER_ACTS, message)
            .at(definition.span, label)
            .help("remove it, or say what it should forbid");
    }
    let message = format!("rule `{}` follows from {}", definition.name, rule_names(space, reasons));
    let warning = Diagnostic::warning(code::IMPLIED, message).at(definition.span, "forbids nothing more");
    let warning = reasons
        .iter()
        .fold(warning, |warning, rule| warning.beside(space.rules[*rule].span, "forbids it already"));
    warning.help("remove it, or make it the stricter one")
}

fn remark(space: &Space, rule: usize) -> Diagnostic {
    let definition = &space.rules[rule];
    let roads: Vec<&str> = space.roads.iter().map(|road| road.name.as_str()).collect();
    let message = format!("rule `{}` refuses nothing on {}", definition.name, listed(&roads));
    Diagnostic::remark(code::NEVER_ACTS, message)
        .at(definition.span, "holds there for every value that its actions can have")
        .help(
            "if it is meant for other roads, change nothing; otherwise look at its bound: `80 * x` is not `80 % * x`",
        )
}

/// The rows that a rule binds.
fn bound_rows(space: &Space, rule: usize) -> Vec<&Row> {
    let actions = space.rules[rule].body.actions();
    let of_actions: Vec<&Row> = actions.into_iter().flat_map(|action| space.rows_of(action)).collect();
    effort::spend(of_actions.len());
    // A rule about one key does not bind the rows that set another.
    of_actions.into_iter().filter(|row| row.rules.binary_search(&rule).is_ok()).collect()
}

/// Whether the rule by itself holds on each road of the space, for every row that it binds and every value; also `false`
/// if the work left does not suffice.
fn is_idle_on_the_roads(space: &Space, rule: usize, work: &mut usize) -> bool {
    let (bound, none) = (bound_rows(space, rule), RulesInForce::none(space));
    let Some(left) = work.checked_sub(bound.len() * space.roads.len()) else { return false };
    *work = left;
    if bound.is_empty() || space.roads.is_empty() || matches!(space.rules[rule].body, RuleBody::Moves { .. })
    {
        return false;
    }
    let holds_on = |road: &Road| {
        let on_road = |row| RowRules { space, row, road: Some(&road.facts), in_force: &none };
        bound.iter().copied().all(|row| holds(on_road(row), rule, work))
    };
    space.roads.iter().all(holds_on) && start_holds(space, rule, &none)
}

/// Whether the rule holds for every row that it binds and every value that `others` leave; also `false` if
/// the work left does not suffice.
fn follows(space: &Space, rule: usize, others: &RulesInForce, work: &mut usize) -> bool {
    let bound = bound_rows(space, rule);
    let Some(left) = work.checked_sub(bound.len() * (1 + others.all().count())) else { return false };
    *work = left;
    if bound.is_empty() && space.rules[rule].start.is_none() {
        return false;
    }
    match &space.rules[rule].body {
        RuleBody::Moves { cell, allowed, .. } => {
            let all = allowed.iter().flatten().all(|allowed| *allowed);
            all || others.all().any(|other| match &space.rules[other].body {
                RuleBody::Moves { cell: same, allowed: stricter, .. } => {
                    let pairs = stricter.iter().flatten().zip(allowed.iter().flatten());
                    same == cell && pairs.into_iter().all(|(stricter, allowed)| *allowed || !*stricter)
                }
                RuleBody::Holds(_) | RuleBody::During(_) | RuleBody::Phases { .. } => false,
            })
        }
        // Nothing is known about the moment at which a phase begins.
        RuleBody::Phases { .. } => false,
        RuleBody::During(_) | RuleBody::Holds(_) => {
            let on_any = |row| RowRules { space, row, road: None, in_force: others };
            bound.into_iter().all(|row| holds(on_any(row), rule, work)) && start_holds(space, rule, others)
        }
    }
}

/// Whether every start that the other rules leave obeys the rule; `false` if there are too many to look at.
fn start_holds(space: &Space, rule: usize, others: &RulesInForce) -> bool {
    if space.rules[rule].start.is_none() {
        return true;
    }
    if space.start_count() > STARTS_MAX {
        return false;
    }
    let alone = RulesInForce::only(space, rule);
    space.roads.iter().all(|road| {
        let (memories, are_all) = space.initial_memories(road, others, STARTS_MAX);
        are_all && memories.iter().all(|memory| space.broken_start(memory, &road.facts, &alone).is_none())
    })
}

/// Whether the rule holds for a row and every value that the other rules leave.
fn holds(others: RowRules<'_>, rule: usize, work: &mut usize) -> bool {
    let RowRules { space, row, .. } = others;
    let body = &space.rules[rule].body;
    let demanded = body.demand(row.action).and_then(Demand::condition);
    let Some(condition) = demanded.or_else(|| body.during(row.action)) else { return false };
    // If the other rules leave the row no value, the row says nothing about this rule.
    let Some(locals) = others.settle() else { return false };
    let after = space.cells_after(row.action, &locals, &space.cells_unknown());
    let known = others.known(&locals, &after);
    always_holds(condition, &known, &space.episode) || always_holds_split(condition, &known, work)
}

/// Whether the condition holds in each combination of the words and truths that it names. With all their values at once,
/// interval analysis does not see that `time == Night or time != Night` always holds. Also `false` if there are too many
/// combinations, or the work left does not suffice.
fn always_holds_split(condition: &Expr, known: &Known<'_>, work: &mut usize) -> bool {
    let mut named = distinct(condition.filter_map(|kind| match kind {
        ExprKind::Local(local) => Some(Named::Local(*local)),
        ExprKind::Cell(cell) => Some(Named::Cell(*cell)),
        _ => None,
    }));
    named.retain(|name| name.values(known).len() > 1);
    let counts = named.iter().map(|name| name.values(known).len());
    let combinations = counts.fold(1_usize, usize::saturating_mul);
    if named.is_empty() || combinations > SPLITS_MAX {
        return false;
    }
    let Some(left) = work.checked_sub(combinations) else { return false };
    *work = left;
    holds_in_each(condition, known, &named)
}

fn holds_in_each(condition: &Expr, known: &Known<'_>, named: &[Named]) -> bool {
    let Some((name, later)) = named.split_first() else { return !enclose(condition, known).may_fail() };
    name.values(known).into_iter().all(|value| {
        let (mut locals, mut cells) = (known.locals.to_vec(), known.cells.to_vec());
        match *name {
            Named::Local(local) => locals[local] = value,
            Named::Cell(cell) => cells[cell] = value,
        }
        holds_in_each(condition, &Known { locals: &locals, cells: &cells, ..*known }, later)
    })
}

/// A parameter of the row, or a cell of the memory.
#[derive(Clone, Copy, PartialEq)]
enum Named {
    Local(usize),
    Cell(usize),
}

impl Named {
    /// Its words or truths, one by one; numbers stay together.
    fn values(self, known: &Known<'_>) -> Vec<Values> {
        match self {
            Named::Local(local) => known.locals[local].each(),
            Named::Cell(cell) => known.cells[cell].each(),
        }
    }
}
