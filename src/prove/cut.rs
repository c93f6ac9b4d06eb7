//! Ranges of which the rules leave less than half, and listed values that they never leave. Most are meant; some are a
//! mistake in the rule.

use crate::model::expr::Comparison;
use crate::model::rules::RowRules;
use crate::model::{
    Domain, End, Interval, Parameter, Reach, Road, Row, RulesInForce, Space, Type, Value, code,
};
use crate::prove::enclose::Values;
use crate::prove::reach::declared;
use crate::syntax::{Diagnostic, listed};
use crate::units::Rational;

/// Values that a remark names; more are counted.
const NAMED_MAX: usize = 5;

pub(super) fn report(space: &Space) -> Vec<Diagnostic> {
    let in_force = RulesInForce::by_default(space);
    let mut remarks = cuts(space, &in_force);
    remarks.extend(never_drawn(space, &in_force));
    remarks
}

/// One remark for each range on each road that rules cut below half. Cuts with the same parameter, rules
/// and remaining range are reported once.
fn cuts(space: &Space, in_force: &RulesInForce) -> Vec<Diagnostic> {
    let mut found: Vec<Cut<'_>> = Vec::new();
    for row in &space.rows {
        for (road, reach) in space.roads.iter().zip(&row.roads) {
            let Reach::Open(ranges) = reach else { continue };
            for (name, kept) in ranges {
                let action = &space.actions[row.action];
                let parameter = action.parameters.iter().find(|parameter| parameter.name == *name);
                let Some(parameter) = parameter else { continue };
                let Some(percent) = kept_percent(&parameter.domain, kept) else { continue };
                let rules = cutting_rules(space, in_force, row.action, parameter);
                if rules.is_empty() {
                    continue;
                }
                let cut = Cut { parameter, kept: *kept, percent, rules, road: &road.name };
                let alike = |known: &&mut Cut<'_>| {
                    known.parameter.name == cut.parameter.name
                        && (known.road, known.kept, &known.rules) == (cut.road, cut.kept, &cut.rules)
                        && known.parameter.domain == cut.parameter.domain
                };
                if found.iter_mut().find(alike).is_none() {
                    found.push(cut);
                }
            }
        }
    }
    found.into_iter().map(|cut| cut.remark(space)).collect()
}

struct Cut<'a> {
    parameter: &'a Parameter,
    kept: Interval,
    /// Share of the declared range that is left.
    percent: f64,
    rules: Vec<usize>,
    road: &'a str,
}

impl Cut<'_> {
    fn remark(self, space: &Space) -> Diagnostic {
        let Type::Quantity(dimension) = self.parameter.ty else {
            unreachable!("whole numbers are lists of values")
        };
        let names: Vec<&str> = self.rules.iter().map(|rule| space.rules[*rule].name.as_str()).collect();
        let message = format!(
            "{} {} {:.0} % of the range of `{}` on `{}`",
            listed(&names),
            if names.len() == 1 { "leaves" } else { "leave" },
            self.percent,
            self.parameter.name,
            self.road,
        );
        let remark = Diagnostic::remark(code::CUT, message)
            .at(self.parameter.span, format!("{} {} is left", self.kept, dimension.si_unit()));
        self.rules
            .iter()
            .fold(remark, |remark, rule| remark.beside(space.rules[*rule].span, "by this rule"))
            .help("if that is meant, all is well; else narrow the range or loosen the rule")
    }
}

/// How much of a range is left, in percent; `None` if it is half or more, or a single value.
fn kept_percent(domain: &Domain, kept: &Interval) -> Option<f64> {
    let (Domain::Range(low, high), End::At(from, _), End::At(to, _)) = (domain, kept.low, kept.high) else {
        return None;
    };
    let (whole, left) = (high.checked_sub(*low)?, to.checked_sub(from)?);
    let share = left.checked_div(whole)?;
    let half = Rational::new(1, 2).expect("2 is not 0");
    // A single value comes from an equality, so it is meant.
    (share > Rational::ZERO && share < half).then(|| share.to_f64() * 100.0)
}

/// The rules in force that bound the parameter; none if any rule sets it by an equality.
fn cutting_rules(space: &Space, in_force: &RulesInForce, action: usize, parameter: &Parameter) -> Vec<usize> {
    let local = space.actions[action].parameters.iter().position(|known| known.name == parameter.name);
    let on_it = || space.bounds[action].iter().filter(|bound| Some(bound.local) == local);
    if on_it().any(|bound| bound.op == Comparison::Equal) {
        return Vec::new();
    }
    let mut rules: Vec<usize> =
        on_it().filter_map(|bound| bound.rule).filter(|rule| in_force.contains(*rule)).collect();
    rules.sort_unstable();
    rules.dedup();
    rules
}

/// One remark for each drawn parameter of whose values rules leave some to no row on no road.
fn never_drawn(space: &Space, in_force: &RulesInForce) -> Vec<Diagnostic> {
    let mut remarks = Vec::new();
    for (index, action) in space.actions.iter().enumerate() {
        let rows = space.rows.iter().filter(|row| row.action == index);
        let open: Vec<(&Row, &Road)> = rows
            .flat_map(|row| space.roads.iter().zip(&row.roads).map(move |(road, reach)| (row, road, reach)))
            .filter(|(.., reach)| matches!(reach, Reach::Open(_)))
            .map(|(row, road, _)| (row, road))
            .collect();
        for (local, parameter) in action.parameters.iter().enumerate().filter(|(_, drawn)| !drawn.axis) {
            let Domain::Values(values) = &parameter.domain else { continue };
            let leaves = |in_force: &RulesInForce, (row, road): (&Row, &Road), value: Value| {
                let mut locals = declared(space, row);
                locals[local] = Values::point(value);
                let rules = RowRules { space, row, road: Some(&road.facts), in_force };
                rules.narrow(locals, &space.cells_unknown(), None).is_some()
            };
            let anywhere =
                |in_force: &RulesInForce, value| open.iter().any(|place| leaves(in_force, *place, value));
            // What the action's own conditions forbid is said beside the value.
            let none = RulesInForce::none(space);
            let mut never: Vec<Value> = Vec::new();
            for value in
                values.iter().filter(|value| !anywhere(in_force, **value) && anywhere(&none, **value))
            {
                if !never.contains(value) {
                    never.push(*value);
                }
            }
            let Some(&first) = open.first().filter(|_| !never.is_empty()) else { continue };
            let mut guilty: Vec<usize> = Vec::new();
            for value in &never {
                // Every rule without which the value is still not left is dropped.
                let mut conflict = in_force.clone();
                for rule in in_force.on_row(first.0) {
                    let fewer = conflict.except(rule);
                    if !leaves(&fewer, first, *value) {
                        conflict = fewer;
                    }
                }
                guilty.extend(conflict.on_row(first.0));
            }
            guilty.sort_unstable();
            guilty.dedup();
            remarks.push(never_remark(space, parameter, &never, &guilty));
        }
    }
    remarks
}

fn never_remark(space: &Space, parameter: &Parameter, never: &[Value], rules: &[usize]) -> Diagnostic {
    let named = never.iter().take(NAMED_MAX).map(|value| format!("`{}`", space.show(*value, parameter.ty)));
    let mut values: Vec<String> = named.collect();
    if never.len() > NAMED_MAX {
        values.push(format!("{} others", never.len() - NAMED_MAX));
    }
    let names: Vec<&str> = rules.iter().map(|rule| space.rules[*rule].name.as_str()).collect();
    let message = format!(
        "{} never {} `{}` be {}",
        listed(&names),
        if names.len() == 1 { "lets" } else { "let" },
        parameter.name,
        values.join(", "),
    );
    let remark =
        Diagnostic::remark(code::CUT, message).at(parameter.span, "these values are in its list".to_owned());
    rules
        .iter()
        .fold(remark, |remark, rule| remark.beside(space.rules[*rule].span, "by this rule"))
        .help("if that is meant, all is well; else leave them out of the list or loosen the rule")
}

/// How much of the range of a parameter a rule takes away by itself on a road, in percent: the least
/// and the most among the rows that it binds.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Removal {
    pub parameter: String,
    pub road: String,
    pub percent_min: f64,
    pub percent_max: f64,
}

/// What a rule by itself removes from the ranges of the rows that it binds; empty if the rule bounds no
/// range.
pub fn removals(space: &Space, rule: usize) -> Vec<Removal> {
    let alone = RulesInForce::only(space, rule);
    let mut found: Vec<Removal> = Vec::new();
    for row in space.rows.iter().filter(|row| row.rules.contains(&rule)) {
        let action = &space.actions[row.action];
        for road in &space.roads {
            let rules = RowRules { space, row, road: Some(&road.facts), in_force: &alone };
            let settled = rules.settle();
            for bound in rules.bounds().filter(|bound| bound.rule.is_some()) {
                let parameter = &action.parameters[bound.local];
                let kept = settled.as_ref().map(|settled| settled[bound.local].interval());
                let Some(percent) = removed_percent(&parameter.domain, kept) else { continue };
                let same =
                    |known: &&mut Removal| known.parameter == *parameter.name && known.road == road.name;
                match found.iter_mut().find(same) {
                    Some(known) => {
                        known.percent_min = known.percent_min.min(percent);
                        known.percent_max = known.percent_max.max(percent);
                    }
                    None => found.push(Removal {
                        parameter: parameter.name.to_string(),
                        road: road.name.clone(),
                        percent_min: percent,
                        percent_max: percent,
                    }),
                }
            }
        }
    }
    found
}

/// How much of a range is removed, in percent; `None` if the domain is a list or a single number. `kept` is
/// `None` if nothing is left.
fn removed_percent(domain: &Domain, kept: Option<Interval>) -> Option<f64> {
    let Domain::Range(low, high) = domain else { return None };
    let whole = high.checked_sub(*low).filter(|whole| *whole > Rational::ZERO)?;
    let left = match kept.map(|kept| (kept.low, kept.high)) {
        Some((End::At(from, _), End::At(to, _))) => to.checked_sub(from)?,
        Some(_) => return None,
        None => Rational::ZERO,
    };
    Some(100.0 - left.checked_div(whole)?.to_f64() * 100.0)
}
