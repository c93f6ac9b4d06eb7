//! Which rules a scenario's steps break. The conditions are those that are enforced when actions are drawn; here
//! a mistake is reported before the scenario is replayed, with its cause and a legal alternative.
//!
//! Rules that ask the world can be judged only by the replay.

use std::collections::BTreeSet;

use crate::model::expr::{Comparison, Expr, ExprKind};
use crate::model::rules::{Breach, Candidate, RowRules, cells_read};
use crate::model::vocabulary::{Fact, LaneChoice, Word};
use crate::model::{Memory, Road, Row, RuleDef, RulesInForce, Space, Value, code};
use crate::prove::{next_rows, shortest_way};
use crate::syntax::ast::Span;
use crate::syntax::{Diagnostic, ast, listed};
use avastra_base::units::{quantity_if_short, unit};

/// Largest number of legal rows that are listed for one step.
const ROWS_SHOWN: usize = 6;

/// One step, and the states before it.
pub(super) struct Moment<'a> {
    pub step: &'a ast::Step,
    pub row: &'a Row,
    /// Values of all parameters of the row's action.
    pub locals: &'a [Value],
    pub after: &'a Memory,
    /// The memory at the start, then after each step with its number.
    pub history: &'a [(u64, Memory)],
    /// Index in `Space::roads`; `None` if the road is unknown.
    pub road: Option<usize>,
}

/// One error for each rule in force that the step breaks. The answers of the world are not known here, so a rule that asks
/// the world holds.
pub(super) fn breaches(space: &Space, moment: &Moment<'_>, in_force: &RulesInForce) -> Vec<Diagnostic> {
    let road = moment.road.map(|road| &space.roads[road].facts);
    let rules = RowRules { space, row: moment.row, road, in_force };
    let (_, before) = moment.history.last().expect("it begins with the start");
    let candidate = Candidate { values: moment.locals, before, after: moment.after, world: None };
    // Conditions on states that depend on the moment are judged when the scenario is played.
    let of_the_moment = space.cells_of_the_moment();
    let error = |breach: Breach<'_>| {
        if !of_the_moment.is_empty() && is_about(space, &breach, &of_the_moment) {
            return None;
        }
        if let Breach::Number { .. } = breach {
            let message = format!("step {} leaves a state without a value", moment.step.number.digits);
            let error = Diagnostic::error(code::BROKEN_RULE, message);
            return Some(error.at(moment.step.span, rules.words(breach, candidate)));
        }
        let rule = &space.rules[breach.rule()?];
        let message = format!("step {} breaks rule `{}`", moment.step.number.digits, rule.name);
        let error = Diagnostic::error(code::BROKEN_RULE, message);
        match breach {
            Breach::Condition { .. } => broken_condition(rules, breach, candidate, moment, error),
            Breach::Move { state, cell, from, to, .. } => {
                let error = error.at(moment.step.span, rules.words(breach, candidate));
                Some(forbidden_move(space, rule, (state, cell, from, to), moment, error))
            }
            Breach::Where(..) | Breach::Number { .. } | Breach::Spawn { .. } => None,
        }
    };
    rules.breaches(candidate).filter_map(error).collect()
}

/// Whether a breach is about one of these cells.
fn is_about(space: &Space, breach: &Breach<'_>, cells: &BTreeSet<usize>) -> bool {
    match breach {
        Breach::Where(_, condition)
        | Breach::Condition { condition, .. }
        | Breach::Spawn { condition, .. } => {
            cells_read(condition, &space.states).iter().any(|cell| cells.contains(cell))
        }
        Breach::Move { cell, .. } | Breach::Number { cell } => cells.contains(cell),
    }
}

/// The error for a start that breaks a rule in force; `at` is where it is declared.
pub(super) fn broken_start(
    space: &Space,
    start: &Memory,
    road: &Road,
    in_force: &RulesInForce,
    at: Span,
) -> Option<Diagnostic> {
    let rule = &space.rules[space.broken_start(start, &road.facts, in_force)?];
    let message = format!("the start breaks rule `{}`", rule.name);
    let error = Diagnostic::error(code::BROKEN_RULE, message).at(at, format!("begins so on `{}`", road.name));
    let error = error.beside(rule.span, "does not allow it");
    Some(error.help("begin with other states, or switch the rule off: `origin { without: [RULE] }`"))
}

/// Adds the history of the state up to the step, and the shortest legal way to the value that the step sets.
fn forbidden_move(
    space: &Space,
    rule: &RuleDef,
    (state, cell, from, to): (usize, usize, Value, Value),
    moment: &Moment<'_>,
    error: Diagnostic,
) -> Diagnostic {
    let state = &space.states[state];
    let shown = |memory: &Memory| space.show(memory.cells()[cell], state.ty);
    let mut timeline = vec![format!("{} at the start", shown(&moment.history[0].1))];
    for pair in moment.history.windows(2) {
        let (before, (number, after)) = (&pair[0].1, &pair[1]);
        if shown(before) != shown(after) {
            timeline.push(format!("{} from step {number}", shown(after)));
        }
    }
    let error = error.beside(rule.span, "does not allow it").note(format!(
        "`{}` is {}",
        space.cell_name(cell),
        timeline.join(", ")
    ));
    let legal = next_rows(space, rule, from);
    let labels: Vec<&str> = legal.iter().take(ROWS_SHOWN).map(|row| row.label.as_str()).collect();
    let error = match labels.as_slice() {
        [] => error,
        labels => error.note(format!("the rule allows {} here", listed(labels))),
    };
    let way = shortest_way(space, rule, from, to);
    match way.as_slice() {
        [] => error.help(format!(
            "no steps lead from {} to {}",
            space.show(from, state.ty),
            space.show(to, state.ty)
        )),
        way => {
            let steps: Vec<String> = way.iter().map(|row| format!("`{}`", row.label)).collect();
            error.help(format!("the shortest legal way there is {}", steps.join(", then ")))
        }
    }
}

/// Points at the values that break the condition, and adds the nearest legal value.
fn broken_condition(
    rules: RowRules<'_>,
    breach: Breach<'_>,
    candidate: Candidate<'_>,
    moment: &Moment<'_>,
    error: Diagnostic,
) -> Option<Diagnostic> {
    let Breach::Condition { rule, condition } = breach else { return None };
    // Without a known road its facts are not known either.
    let road = rules.road?;
    let space = rules.space;
    let mut error = error.beside(space.rules[rule].span, "does not allow it");
    let mut nearest = None;
    let mut is_placed = false;
    for (bound, limit) in rules.broken_bounds(rule, candidate, None) {
        let parameter = &space.actions[moment.row.action].parameters[bound.local];
        let field = moment.step.drawn.iter().find(|field| *field.name.text == *parameter.name);
        let Some(field) = field.filter(|_| !parameter.axis) else { continue };
        let shown = in_unit_of(&field.value, limit).unwrap_or_else(|| space.show(limit, parameter.ty));
        error = error.at(
            field.value.span,
            format!("`{}` must be {} {shown} on `{}`", parameter.name, bound.op.symbol(), road.name),
        );
        is_placed = true;
        let reaches =
            matches!(bound.op, Comparison::Equal | Comparison::LessEqual | Comparison::GreaterEqual);
        if reaches && parameter.domain.holds(limit) && nearest.is_none() {
            nearest = Some((field, shown));
        }
    }
    if !is_placed {
        let label = format!("{} on `{}`", rules.words(breach, candidate), road.name);
        error = error.at(moment.step.span, label);
    }
    if let Some(place) = road.limited_at.as_ref().filter(|_| is_placed && asks_for_limit(condition)) {
        error = error
            .note(format!("`road.limit` is that of {place}; `npc.limit` is that of the newcomer's lane"));
    }
    if condition.any(|kind| matches!(kind, ExprKind::InLanes(..))) {
        let there: Vec<&str> =
            LaneChoice::ALL.iter().filter(|lane| road.has_lane(**lane)).map(|lane| lane.name()).collect();
        error = error.note(format!("the way through `{}` has the lanes {}", road.name, listed(&there)));
    }
    Some(match nearest {
        Some((field, shown)) => error.help(format!("the nearest legal value is {shown}")).fix(
            format!("write `{shown}`"),
            field.value.span,
            shown,
        ),
        None => error,
    })
}

/// A limit in the unit of the number that breaks it, if it is short in that.
fn in_unit_of(broken: &ast::Expr, limit: Value) -> Option<String> {
    let ast::ExprKind::Number(number) = &broken.kind else { return None };
    quantity_if_short(limit.number(), unit(&number.unit.as_ref()?.text)?)
}

fn asks_for_limit(condition: &Expr) -> bool {
    condition.any(|kind| matches!(kind, ExprKind::Fact(Fact::RoadLimit)))
}
