//! The rows of the action table, and what can be proved of each on each road.
//!
//! A row is dead on a road if intervals prove that no draw satisfies the rules there. Every other row is
//! open. An open row may still fail: what lies around the car is not known here.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::model::effort;
use crate::model::expr::{Expr, ExprKind};
use crate::model::rules::{self, Bound, Demand, RowRules, allowed, rules_by_action};
use crate::model::vocabulary::{Field, Word};
use crate::model::{
    ActionDef, Domain, Facts, Interval, Memory, Parameter, Reach, Road, Row, RuleBody, RulesInForce, Space,
    Type, Value, code, evaluate, locals,
};
use crate::prove::enclose::{Known, Values, enclose};
use crate::prove::lists::{distinct, product, rule_names};
use crate::prove::moment::{Case, may_hold_together, newcomers, ranges_named};
use crate::syntax::{Diagnostic, listed};
use avastra_base::units::{Unit, unit_as_written};

/// Each row allows all proofs together this many more steps for each road, counting up to `ROADS_MAX` roads. A row under a
/// few rules takes fewer, so the longest table can be checked.
const STEPS_A_ROW: u64 = 100;
const ROADS_MAX: u64 = 4;

/// The steps to come are foreseen each time that so many more rows of an action are proved.
const ROWS_OF_A_SAMPLE: u64 = 256;

/// Rounds of narrowing: a bound may depend on another one, rarely on two.
const ROUNDS: usize = 3;

/// The number of rows of an action before its `where`s remove any.
pub(crate) fn product_size(action: &ActionDef) -> u64 {
    let sizes = action.parameters.iter().filter(|parameter| parameter.axis).map(|axis| match &axis.domain {
        Domain::Values(values) => values.len() as u64,
        Domain::Range(..) => u64::MAX,
    });
    sizes.fold(1, u64::saturating_mul)
}

/// All rows, in order.
pub(crate) fn rows(space: &Space) -> Vec<Row> {
    let in_force = RulesInForce::by_default(space);
    let binding = rules_by_action(&space.rules, space.actions.len());
    let granted = STEPS_A_ROW * ROADS_MAX.min(space.roads.len() as u64);
    let mut rows = Vec::new();
    for ((index, action), bound) in space.actions.iter().enumerate().zip(binding) {
        let bound: Arc<[usize]> = bound.into();
        let units: Vec<Option<&Unit>> =
            action.parameters.iter().filter(|parameter| parameter.axis).map(Parameter::unit).collect();
        let deciding = deciding_axes(space, index);
        let are_all = deciding.len() == units.len();
        let key_of =
            |values: &[Value]| -> Vec<u64> { deciding.iter().map(|local| values[*local].bits()).collect() };
        let products = products(space, action);
        let count = products.len() as u64;
        let mut pace = Pace { proved: 0, spent: 0, count };
        if !are_all {
            pace.count = products.iter().map(|values| key_of(values)).collect::<BTreeSet<_>>().len() as u64;
        }
        // A row that runs everywhere, for each combination of the values that decide it.
        let mut open: BTreeMap<Vec<u64>, usize> = BTreeMap::new();
        for (left, values) in (0..count).rev().zip(products) {
            if effort::is_spent() {
                return rows;
            }
            let axes: Vec<(Arc<str>, Value)> = action
                .parameters
                .iter()
                .zip(&values)
                .filter(|(parameter, _)| parameter.axis)
                .map(|(parameter, value)| (parameter.name.clone(), *value))
                .collect();
            let shown = axes.iter().zip(action.parameters.iter().filter(|p| p.axis)).zip(&units);
            let shown: Vec<String> = shown
                .map(|(((name, value), p), unit)| format!("{name}: {}", space.show_listed(*value, p, *unit)))
                .collect();
            let label = format!("{}({})", action.name, shown.join(", "));
            let rules = bound.clone();
            let mut row = Row { index: rows.len(), action: index, axes, label, rules, roads: Vec::new() };
            if let Some(fewer) = without_other_keys(space, &row) {
                row.rules = fewer;
            }
            effort::grant(granted);
            let key = key_of(&values);
            let roads: Vec<Reach> = match open.get(&key) {
                Some(alike) => rows[*alike].roads.clone(),
                None => {
                    let rules = RowRules { space, row: &row, road: None, in_force: &in_force };
                    let reach = |road: &Road| RowRules { road: Some(&road.facts), ..rules }.reach();
                    let (roads, steps) = effort::counted(|| space.roads.iter().map(reach).collect());
                    pace.note(steps, granted * left);
                    roads
                }
            };
            // The reason why a row is dead may name that row.
            if !are_all && roads.iter().all(|reach| matches!(reach, Reach::Open(_))) {
                open.entry(key).or_insert(row.index);
            }
            rows.push(Row { roads, ..row });
        }
    }
    rows
}

/// How many rows of an action are proved, in how many steps, and how many proofs there will be if no row is dead.
struct Pace {
    proved: u64,
    spent: u64,
    count: u64,
}

impl Pace {
    /// Counts a proof. From time to time it gives up if the other proofs would take more steps than there are and than
    /// the other rows bring, which are `granted`.
    fn note(&mut self, steps: u64, granted: u64) {
        self.proved += 1;
        self.spent += steps;
        if self.proved.is_multiple_of(ROWS_OF_A_SAMPLE) {
            // The proofs after this one take at least half as many steps.
            let needed = self.spent * 3 / 2 / self.proved * self.count.saturating_sub(self.proved);
            effort::foresee(needed.saturating_sub(granted));
        }
    }
}

/// The axes, by their places among the parameters, that decide what [`RowRules::reach`] says of a row.
fn deciding_axes(space: &Space, action: usize) -> Vec<usize> {
    let definition = &space.actions[action];
    let of_spawns = definition.spawns().flat_map(|spawn| {
        let verb = spawn.verb.expr();
        let count = spawn.row.as_ref().and_then(|row| row.count.as_ref());
        let offset = spawn.told.expr(Field::Offset);
        let exprs = [&spawn.speed, &spawn.distance].into_iter().chain(offset).chain(verb).chain(count);
        exprs.flat_map(rules::locals)
    });
    let of_spawns: Vec<usize> = of_spawns.collect();
    let decides = |local: &usize| {
        let is_named = space.clauses[action].iter().any(|clause| clause.needs(*local));
        definition.parameters[*local].axis && (is_named || of_spawns.contains(local))
    };
    (0..definition.parameters.len()).filter(decides).collect()
}

/// All values that an expression of the row's action may have by the parameters' own ranges and
/// conditions, whatever the road, the rules and the memory; `None` if they leave no value.
pub(crate) fn spawn_figures(space: &Space, row: &Row, expr: &Expr) -> Option<Interval> {
    let rules = RowRules { space, row, road: None, in_force: &RulesInForce::none(space) };
    let locals = rules.settle()?;
    let after = space.cells_after(row.action, &locals, &space.cells_unknown());
    Some(enclose(expr, &rules.known(&locals, &after)).interval())
}

/// The rules that bind the row, without those about a key that the row does not set; `None` if it loses none.
fn without_other_keys(space: &Space, row: &Row) -> Option<Arc<[usize]>> {
    let is_of_key = |rule: &usize| match &space.rules[*rule].body {
        RuleBody::Moves { state, .. } => space.states[*state].key.is_some(),
        RuleBody::Holds(_) | RuleBody::During(_) | RuleBody::Phases { .. } => false,
    };
    if !row.rules.iter().any(is_of_key) {
        return None;
    }
    let set = space.cells_set(row.action, &declared(space, row));
    let is_other = |rule: &usize| match &space.rules[*rule].body {
        RuleBody::Moves { cell, .. } => is_of_key(rule) && !set.contains(cell),
        RuleBody::Holds(_) | RuleBody::During(_) | RuleBody::Phases { .. } => false,
    };
    let kept: Arc<[usize]> = row.rules.iter().filter(|rule| !is_other(rule)).copied().collect();
    (kept.len() < row.rules.len()).then_some(kept)
}

/// The values of all parameters for each row of an action; those that are drawn hold a placeholder.
fn products(space: &Space, action: &ActionDef) -> Vec<Vec<Value>> {
    let mut rows: Vec<Vec<Value>> = vec![Vec::new()];
    for parameter in &action.parameters {
        effort::spend(rows.len());
        if effort::is_spent() {
            return Vec::new();
        }
        let values = match (&parameter.domain, parameter.axis) {
            (Domain::Values(values), true) => values.as_slice(),
            _ => &[Value::Bool(false)],
        };
        rows = product(&rows, values, Vec::push);
        if let Some(condition) = parameter.condition.as_ref().filter(|_| parameter.axis) {
            let none = Memory::default();
            rows.retain(|locals| evaluate(condition, &space.functions, &Facts::new(locals, &none)).truth());
        }
    }
    rows
}

impl Space {
    /// Whether rules in force by default on the row read states that the moment decides.
    pub fn depends_on_moment(&self, row: &Row) -> bool {
        let in_force = RulesInForce::by_default(self);
        RowRules { space: self, row, road: None, in_force: &in_force }
            .reads_any_of(&self.cells_of_the_moment())
    }
}

impl<'a> RowRules<'a> {
    pub(crate) fn reach(self) -> Reach {
        if let Some(ranges) = self.ranges() {
            return Reach::Open(ranges);
        }
        let rules = self.conflict(&|fewer| fewer.settle().is_none());
        Reach::Dead { reason: self.reason(&rules), rules }
    }

    /// The ranges that the rules in force leave to the drawn numbers; `None` if they leave no values.
    pub(crate) fn ranges(self) -> Option<Vec<(Arc<str>, Interval)>> {
        let parameters = self.space.actions[self.row.action].parameters.iter();
        let drawn = parameters.zip(self.settle()?).filter(|(parameter, _)| !parameter.axis);
        let ranges = drawn.filter_map(|(parameter, values)| match values {
            Values::Number(interval) => Some((parameter.name.clone(), interval)),
            Values::Truth { .. } | Values::Variants(_) => None,
        });
        Some(ranges.collect())
    }

    /// Rules that forbid something together, of which none can be spared; `forbid` says whether some still do.
    pub(crate) fn conflict(self, forbid: &dyn Fn(RowRules<'_>) -> bool) -> Vec<usize> {
        let mut conflict = self.in_force.clone();
        for rule in self.in_force.on_row(self.row) {
            if effort::is_spent() {
                break;
            }
            let fewer = conflict.except(rule);
            if forbid(RowRules { in_force: &fewer, ..self }) {
                conflict = fewer;
            }
        }
        conflict.on_row(self.row).collect()
    }

    /// All values that the parameters may have under the rules in force; `None` if the rules leave none.
    pub(crate) fn settle(self) -> Option<Vec<Values>> {
        self.narrow(declared(self.space, self.row), &self.space.cells_unknown(), None)
    }

    /// As [`RowRules::settle`], begun with these values of the parameters and cells, and with what is known of the
    /// moment.
    pub(crate) fn narrow(
        self,
        mut locals: Vec<Values>,
        before: &[Values],
        moment: Option<&Case>,
    ) -> Option<Vec<Values>> {
        if effort::is_spent() {
            return None;
        }
        for _ in 0..ROUNDS {
            let was = locals.clone();
            let after = self.space.cells_after(self.row.action, &locals, before);
            for bound in self.bounds() {
                let known = self.known(&locals, &after);
                if bound.guards.iter().any(|guard| enclose(guard, &known).may_fail()) {
                    continue;
                }
                let limit = enclose(&bound.limit, &known).interval();
                let narrowed = locals[bound.local].interval().intersect(&allowed(bound.op, &limit));
                if narrowed.is_empty() {
                    return None;
                }
                locals[bound.local] = Values::Number(narrowed);
            }
            // A round that changes nothing is the last.
            if locals == was {
                break;
            }
        }
        let after = self.space.cells_after(self.row.action, &locals, before);
        let may_move = self.demands().all(|(_, demand)| match demand {
            Demand::Holds(_) => true,
            Demand::Moves { cell, allowed, .. } => match after[cell] {
                Values::Variants(set) => {
                    effort::spend(allowed.len());
                    (0..allowed.len()).any(|to| set >> to & 1 == 1 && allowed.iter().any(|from| from[to]))
                }
                Values::Truth { .. } | Values::Number(_) => true,
            },
        });
        let known = Known { case: moment, ..self.known(&locals, &after) };
        let newcomers = || newcomers(&self.space.actions[self.row.action], &known, false);
        let possible =
            may_move && may_hold_together(&self.conditions(), &known, &self.space.episode, newcomers);
        possible.then_some(locals)
    }

    /// Whether a rule in force on the row reads one of these cells, or orders its changes.
    pub(crate) fn reads_any_of(self, cells: &BTreeSet<usize>) -> bool {
        if cells.is_empty() {
            return false;
        }
        let reads = |condition: &Expr| {
            rules::cells_read(condition, &self.space.states).iter().any(|cell| cells.contains(cell))
        };
        let moves =
            |demand: &Demand<'_>| matches!(demand, Demand::Moves { cell, .. } if cells.contains(cell));
        self.conditions().into_iter().any(reads) || self.demands().any(|(_, demand)| moves(&demand))
    }

    /// The conditions of a draw: those of rules, and the `where`s that ask about the moment. The others are bounds, or
    /// are left to solving.
    pub(crate) fn conditions(self) -> Vec<&'a Expr> {
        let parameters = &self.space.actions[self.row.action].parameters;
        let wheres = parameters.iter().filter_map(|parameter| parameter.condition.as_ref());
        let of_rules = self.demands().filter_map(|(_, demand)| demand.condition());
        of_rules.chain(wheres.filter(|condition| condition.asks_the_world())).collect()
    }

    pub(crate) fn known<'k>(&'k self, locals: &'k [Values], cells: &'k [Values]) -> Known<'k> {
        Known { functions: &self.space.functions, locals, cells, road: self.road, case: None }
    }

    /// The limits that the rules of a conflict want, in words.
    fn reason(self, rules: &[usize]) -> String {
        let parameters = &self.space.actions[self.row.action].parameters;
        let locals = declared(self.space, self.row);
        let before = self.space.cells_unknown();
        let after = self.space.cells_after(self.row.action, &locals, &before);
        let known = self.known(&locals, &after);
        let mut parts = Vec::new();
        let mut without_figures = Vec::new();
        for rule in rules {
            let name = &self.space.rules[*rule].name;
            let mut wanted = Vec::new();
            for bound in self.bounds().filter(|bound| bound.rule == Some(*rule)) {
                let parameter = &parameters[bound.local];
                let limit = allowed(bound.op, &enclose(&bound.limit, &known).interval());
                // A limit that is written down is told in its own unit.
                let unit = parameter.unit().or_else(|| unit_of_literal(&bound.limit));
                wanted.push((parameter, (limit, unit), locals[bound.local].interval()));
            }
            // Two limits that print alike would show no conflict.
            let ends: Vec<_> =
                wanted.iter().flat_map(|(_, (limit, _), declared)| [*limit, *declared]).collect();
            let decimals = Interval::decimals_of(&ends);
            let figure = |(parameter, (limit, unit), declared): &(&Parameter, Limit, Interval)| {
                let is = if declared.single().is_some() { "it is" } else { "its range is" };
                let limit = limit.shown_to(decimals, parameter.ty, *unit);
                let declared = declared.shown_to(decimals, parameter.ty, parameter.unit());
                format!("`{}` wants {limit}, {is} {declared}", parameter.name)
            };
            let figures: Vec<String> = wanted.iter().map(figure).collect();
            match figures.as_slice() {
                [] => without_figures.push(name.as_str()),
                figures => parts.push(format!("rule `{name}`: {}", figures.join("; "))),
            }
        }
        match (parts.as_slice(), without_figures.as_slice()) {
            (_, []) => {}
            ([], [only]) => parts.push(self.without_figures(only)),
            _ => parts.push(format!("{} cannot hold together", rule_names(self.space, rules))),
        }
        let conditions: Vec<&Expr> = rules
            .iter()
            .filter_map(|rule| self.space.rules[*rule].body.demand(self.row.action)?.condition())
            .collect();
        let newcomers = newcomers(&self.space.actions[self.row.action], &known, false);
        for (fact, range) in ranges_named(&conditions, &known, &self.space.episode, &newcomers) {
            parts.push(format!(
                "`{}` is within {}",
                fact.name(),
                range.shown(fact.ty(), range.unit(fact.ty()))
            ));
        }
        match parts.as_slice() {
            [] => "its own ranges and conditions leave no value".to_owned(),
            parts => match self.road {
                Some(road) => format!("{} (road `{}`)", parts.join("; "), road.name),
                None => parts.join("; "),
            },
        }
    }

    /// The words for a rule that bounds no number.
    fn without_figures(self, name: &str) -> String {
        match self.row.axes.is_empty() {
            true => format!("rule `{name}` never holds"),
            // Other rows of the action may obey the rule.
            false => format!("rule `{name}` cannot hold in `{}`", self.row.label),
        }
    }
}

/// The values that a bound allows, and the unit of the message.
type Limit = (Interval, Option<&'static Unit>);

/// The unit in which a limit is written that is a number; `None` for SI's, and for what is computed.
fn unit_of_literal(limit: &Expr) -> Option<&'static Unit> {
    match (&limit.kind, limit.ty) {
        (ExprKind::Number(value), Type::Quantity(dimension)) => unit_as_written(value.to_f64(), dimension),
        _ => None,
    }
}

/// The values that the parameters of a row may have before any rule.
pub(crate) fn declared(space: &Space, row: &Row) -> Vec<Values> {
    let action = &space.actions[row.action];
    effort::spend(action.parameters.len());
    let all = |(parameter, value): (&Parameter, Value)| match &parameter.domain {
        _ if parameter.axis => Values::point(value),
        Domain::Range(low, high) => Values::Number(Interval::closed(*low, *high)),
        Domain::Values(values) => {
            effort::spend(values.len());
            let points = values.iter().map(|value| Values::point(*value));
            points.reduce(Values::union).unwrap_or(Values::UNKNOWN_TRUTH)
        }
    };
    action.parameters.iter().zip(locals(action, row, &[])).map(all).collect()
}

/// Diagnostics about rows: actions that have none, dead rows, masked rows.
pub(crate) fn report(space: &Space) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    let mut gone: Vec<Gone<'_>> = Vec::new();
    let mut masked = Vec::new();
    for (index, action) in space.actions.iter().enumerate() {
        let rows: Vec<&Row> = space.rows_of(index).iter().collect();
        if rows.is_empty() {
            let conditions = action.parameters.iter().filter(|p| p.axis && p.condition.is_some());
            let error = Diagnostic::error(code::EMPTY, format!("`{}` has no rows", action.name))
                .at(action.span, "its conditions leave no value");
            diagnostics.push(conditions.fold(error, |error, p| error.beside(p.span, "by this `where`")));
        }
        let (dead, left): (Vec<&Row>, Vec<&Row>) = rows.iter().copied().partition(|row| is_gone(row));
        gone.extend(Gone::of(action, dead, left.is_empty()));
        masked.extend(report_masked(space, action, &left));
    }
    // Actions that the same rules leave no row share an error.
    let mut together: Vec<Vec<Gone<'_>>> = Vec::new();
    for one in gone {
        match together.iter_mut().find(|many| !one.rules.is_empty() && many[0].rules == one.rules) {
            Some(many) => many.push(one),
            None => together.push(vec![one]),
        }
    }
    diagnostics.extend(together.iter().map(|gone| match gone.as_slice() {
        [one] => one.error(space),
        many => error_of_many(space, many),
    }));
    diagnostics.extend(masked);
    diagnostics
}

/// Whether a row can run on no road.
fn is_gone(row: &Row) -> bool {
    !row.roads.is_empty() && row.roads.iter().all(|reach| matches!(reach, Reach::Dead { .. }))
}

/// The rows of an action that can run on no road.
struct Gone<'a> {
    action: &'a ActionDef,
    rows: Vec<&'a Row>,
    /// Whether the action has no others.
    are_all: bool,
    /// The rules that leave the first of them no value, and why.
    rules: &'a [usize],
    reason: &'a str,
}

impl<'a> Gone<'a> {
    fn of(action: &'a ActionDef, rows: Vec<&'a Row>, are_all: bool) -> Option<Gone<'a>> {
        let Some(Reach::Dead { rules, reason }) = rows.first()?.roads.first() else { return None };
        Some(Gone { action, rows, are_all, rules, reason })
    }

    fn what(&self) -> String {
        match self.are_all {
            true => format!("`{}`", self.action.name),
            false => format!("{} of `{}`", numbers(&self.rows), self.action.name),
        }
    }

    fn error(&self, space: &Space) -> Diagnostic {
        let Gone { action, rows, rules, reason, .. } = self;
        let message = format!("{} can never run on {}", self.what(), any_road(space));
        let error =
            Diagnostic::error(code::DEAD, message).at(action.span, numbers(rows)).note(*reason).help(HELP);
        let error =
            rules.iter().fold(error, |error, rule| error.beside(space.rules[*rule].span, "by this rule"));
        let bounded = &space.bounds[rows[0].action];
        let is_bounded = |local: usize| {
            let of_conflict = |bound: &Bound| bound.rule.is_some_and(|rule| rules.contains(&rule));
            bounded.iter().any(|bound| bound.local == local && of_conflict(bound))
        };
        let ranges = action.parameters.iter().enumerate().filter(|(local, _)| is_bounded(*local));
        ranges.fold(error, |error, (_, parameter)| match &parameter.domain {
            Domain::Range(low, high) => {
                let ends = [low, high].map(|end| Value::Number(end.to_f64()));
                let range = space.show_all(&ends, parameter.ty).join(" .. ");
                error.beside(parameter.span, format!("`{}` is {range}", parameter.name))
            }
            Domain::Values(_) => error,
        })
    }
}

const HELP: &str = "widen a range, change a rule, or remove the rows with `where`";

/// The most actions that an error about many names, and the most reasons that it gives.
const ACTIONS_MAX: usize = 4;
const REASONS_MAX: usize = 3;

/// One error for several actions that the same rules leave no row.
fn error_of_many(space: &Space, gone: &[Gone<'_>]) -> Diagnostic {
    let rules = gone[0].rules;
    let leave = if rules.len() == 1 { "leaves" } else { "leave" };
    let mut named: Vec<String> = gone.iter().take(ACTIONS_MAX).map(Gone::what).collect();
    if gone.len() > ACTIONS_MAX {
        named.push(format!("{} other actions", gone.len() - ACTIONS_MAX));
    }
    let (last, others) = named.split_last().expect("many are more than none");
    let what = format!("{} and {last}", others.join(", "));
    let message = format!("{what} can never run on {}", any_road(space));
    let error = Diagnostic::error(code::DEAD, message).at(
        space.rules[rules[0]].span,
        format!("{} {leave} {} actions no value", rule_names(space, rules), gone.len()),
    );
    let error =
        rules[1..].iter().fold(error, |error, rule| error.beside(space.rules[*rule].span, "and this rule"));
    let shown = gone.iter().take(ACTIONS_MAX);
    let error = shown.fold(error, |error, one| error.beside(one.action.span, numbers(&one.rows)));
    let reasons = distinct(gone.iter().map(|one| one.reason)).into_iter();
    let error = reasons.take(REASONS_MAX).fold(error, |error, reason| error.note(reason));
    error.help(HELP)
}

fn any_road(space: &Space) -> String {
    match space.roads.as_slice() {
        [road] => format!("`{}`", road.name),
        _ => "any road".to_owned(),
    }
}

/// More roads on which an action is masked are told in one remark.
const REMARKS_MAX: usize = 4;

/// Rows that are masked on some roads for one reason.
struct Masked<'a> {
    rows: Vec<&'a Row>,
    rules: &'a [usize],
    reason: &'a str,
    roads: Vec<&'a str>,
}

/// One remark for all roads on which the same rules mask the same rows of an action, if these rows run on others. For more
/// than [`REMARKS_MAX`] roads, one remark stands for all.
fn report_masked(space: &Space, action: &ActionDef, left: &[&Row]) -> Vec<Diagnostic> {
    let mut found: Vec<Masked> = Vec::new();
    for (index, road) in space.roads.iter().enumerate() {
        let is_masked = |row: &&Row| matches!(row.roads[index], Reach::Dead { .. });
        let rows: Vec<&Row> = left.iter().copied().filter(is_masked).collect();
        let Some(Reach::Dead { rules, reason }) = rows.first().map(|row| &row.roads[index]) else {
            continue;
        };
        let numbers_of = |rows: &[&Row]| rows.iter().map(|row| row.index).collect::<Vec<_>>();
        let alike =
            found.iter_mut().find(|one| one.rules == *rules && numbers_of(&one.rows) == numbers_of(&rows));
        match alike {
            Some(one) => one.roads.push(&road.name),
            None => found.push(Masked { rows, rules, reason, roads: vec![&road.name] }),
        }
    }
    let on: usize = found.iter().map(|one| one.roads.len()).sum();
    let of = space.roads.len();
    let said = |roads: &[&str], rules: &[usize]| {
        format!("`{}` is masked on {} by {}", action.name, listed(roads), rule_names(space, rules))
    };
    if on <= REMARKS_MAX {
        let remark = |Masked { rows, rules, reason, roads }: Masked| {
            let also =
                if roads.len() > 1 { format!("on `{}`: {reason}", roads[0]) } else { reason.to_owned() };
            Diagnostic::remark(code::MASKED, said(&roads, rules)).at(action.span, numbers(&rows)).note(also)
        };
        return found.into_iter().map(remark).collect();
    }
    let message =
        format!("rows of `{}` are masked on {on} of the {of} roads, and run on another", action.name);
    let first = said(&found[0].roads[..1], found[0].rules);
    let is_masked = |row: &&Row| row.roads.iter().any(|reach| matches!(reach, Reach::Dead { .. }));
    let masked: Vec<&Row> = left.iter().copied().filter(is_masked).collect();
    let remark = Diagnostic::remark(code::MASKED, message).at(action.span, numbers(&masked));
    vec![remark.note(format!("for one, {first}; `avastra table FILE --row N` says where a row runs"))]
}

/// `row 15`, `rows 15..27`, `rows 3, 7 and 9`.
pub(crate) fn numbers(rows: &[&Row]) -> String {
    let indices: Vec<usize> = rows.iter().map(|row| row.index).collect();
    match indices.as_slice() {
        [only] => format!("row {only}"),
        [first, .., last] if last - first + 1 == indices.len() => format!("rows {first}..{last}"),
        indices => format!("rows {}", indices.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
    }
}
