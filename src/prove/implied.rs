//! Rules that change nothing: they always hold, or they follow from other rules.

use crate::model::rules::{Demand, RowRules};
use crate::model::{Row, RuleBody, RulesInForce, Space, code, effort};
use crate::prove::moment::always_holds;
use crate::syntax::{Diagnostic, listed};

/// Limit on rows times rules for the whole report; rules beyond it are not looked at.
const WORK_MAX: usize = 1_000_000;

/// The most starts of an episode that are looked at for one rule.
const STARTS_MAX: usize = 1_000;

/// One warning for each rule that can never refuse anything, on any road and with any memory. If two rules
/// follow from each other, the later one is named.
pub(super) fn report(space: &Space) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    let mut work = WORK_MAX;
    let mut kept = RulesInForce::by_default(space);
    for rule in (0..space.rules.len()).rev() {
        if effort::is_spent() {
            break;
        }
        let others = kept.except(rule);
        if !follows(space, rule, &others, &mut work) {
            continue;
        }
        let mut reasons = others.clone();
        for other in others.all() {
            if effort::is_spent() {
                break;
            }
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
    let names: Vec<&str> = reasons.iter().map(|rule| space.rules[*rule].name.as_str()).collect();
    let message = format!("rule `{}` follows from {}", definition.name, listed(&names));
    let warning = Diagnostic::warning(code::IMPLIED, message).at(definition.span, "forbids nothing more");
    let warning = reasons
        .iter()
        .fold(warning, |warning, rule| warning.beside(space.rules[*rule].span, "forbids it already"));
    warning.help("remove it, or make it the stricter one")
}

/// Whether the rule holds for every row that it binds and every value that `others` leave; also `false` if
/// the work left does not suffice.
fn follows(space: &Space, rule: usize, others: &RulesInForce, work: &mut usize) -> bool {
    let actions = space.rules[rule].body.actions();
    let bound_rows = || actions.iter().flat_map(|action| space.rows_of(*action));
    // A row that sets another key than the rule is about is not bound.
    let bound = || bound_rows().filter(|row| row.rules.binary_search(&rule).is_ok());
    effort::spend(bound_rows().count());
    let count = bound().count();
    let Some(left) = work.checked_sub(count * (1 + others.all().count())) else { return false };
    *work = left;
    if count == 0 && space.rules[rule].start.is_none() {
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
                RuleBody::Holds(_) | RuleBody::During(_) => false,
            })
        }
        RuleBody::During(_) | RuleBody::Holds(_) => {
            bound().all(|row| holds(space, row, rule, others)) && start_holds(space, rule, others)
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

fn holds(space: &Space, row: &Row, rule: usize, others: &RulesInForce) -> bool {
    let body = &space.rules[rule].body;
    let demanded = body.demand(row.action).and_then(Demand::condition);
    let Some(condition) = demanded.or_else(|| body.during(row.action)) else { return false };
    let rules = RowRules { space, row, road: None, in_force: others };
    // If the other rules leave the row no value, the row says nothing about this rule.
    let Some(locals) = rules.settle() else { return false };
    let after = space.cells_after(row.action, &locals, &space.cells_unknown());
    always_holds(condition, &rules.known(&locals, &after), &space.episode)
}
