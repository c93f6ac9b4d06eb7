//! Ranges of which the rules leave less than half. Most are meant; some are a mistake in the rule.

use crate::model::expr::Comparison;
use crate::model::rules::RowRules;
use crate::model::{Domain, End, Interval, Parameter, RulesInForce, Space, code, effort};
use crate::prove::lists::{OpenRow, open_rows, rule_names};
use crate::syntax::{Diagnostic, listed};
use avastra_base::units::Rational;

/// One remark for each range that rules cut below half, with all roads on which the same rules leave the same.
pub(super) fn report(space: &Space) -> Vec<Diagnostic> {
    let in_force = RulesInForce::by_default(space);
    let mut found: Vec<Cut<'_>> = Vec::new();
    for OpenRow { row, road, ranges } in open_rows(space, &space.rows).take_while(|_| !effort::is_spent()) {
        effort::spend(ranges.len() * (1 + found.len()));
        for (name, kept) in ranges {
            let action = &space.actions[row.action];
            let parameter = action.parameters.iter().find(|parameter| parameter.name == *name);
            let Some(parameter) = parameter else { continue };
            let Some(percent) = kept_percent(&parameter.domain, kept) else { continue };
            let rules = cutting_rules(space, &in_force, row.action, parameter);
            if rules.is_empty() {
                continue;
            }
            let is_alike = |known: &&mut Cut<'_>| {
                (known.kept, &known.rules) == (*kept, &rules)
                    && known.parameter.name == parameter.name
                    && known.parameter.domain == parameter.domain
            };
            match found.iter_mut().find(is_alike) {
                Some(known) if known.roads.contains(&road.name.as_str()) => {}
                Some(known) => known.roads.push(&road.name),
                None => found.push(Cut { parameter, kept: *kept, percent, rules, roads: vec![&road.name] }),
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
    roads: Vec<&'a str>,
}

impl Cut<'_> {
    fn remark(self, space: &Space) -> Diagnostic {
        let message = format!(
            "{} {} {:.0} % of the range of `{}` on {}",
            rule_names(space, &self.rules),
            if self.rules.len() == 1 { "leaves" } else { "leave" },
            self.percent,
            self.parameter.name,
            listed(&self.roads),
        );
        let remark = Diagnostic::remark(code::CUT, message).at(
            self.parameter.span,
            format!("{} is left", self.kept.shown(self.parameter.ty, self.parameter.unit())),
        );
        self.rules
            .iter()
            .fold(remark, |remark, rule| remark.beside(space.rules[*rule].span, "by this rule"))
            .help("if you intended this, change nothing; otherwise narrow the range or relax the rule")
    }
}

/// How much of a range is left, in percent; `None` if it is half or more, or a single value.
fn kept_percent(domain: &Domain, kept: &Interval) -> Option<f64> {
    let share = kept_share(domain, kept)?;
    let half = Rational::new(1, 2).expect("2 is not 0");
    // A single value comes from an equality, so it is meant.
    (share > Rational::ZERO && share < half).then(|| share.to_f64() * 100.0)
}

/// The share of a range that is left; `None` if the domain is a list or a single number.
fn kept_share(domain: &Domain, kept: &Interval) -> Option<Rational> {
    let (Domain::Range(low, high), End::At(from, _), End::At(to, _)) = (domain, kept.low, kept.high) else {
        return None;
    };
    to.checked_sub(from)?.checked_div(high.checked_sub(*low)?)
}

/// The rules in force that bound the parameter; none if any rule sets it by an equality.
fn cutting_rules(space: &Space, in_force: &RulesInForce, action: usize, parameter: &Parameter) -> Vec<usize> {
    effort::spend(space.bounds[action].len());
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

/// How much of the range of a parameter a rule takes away by itself on a road, in percent: the least
/// and the most among the rows that it binds.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Removal {
    pub parameter: String,
    pub road: String,
    pub percent_min: f64,
    pub percent_max: f64,
}

/// The parts that a rule alone removes from the ranges of the rows that it binds; empty if the rule bounds no range.
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
                // If the rule leaves no value at all, nothing of the range is left: a point has no width.
                let nothing = Interval::point(Rational::ZERO);
                let kept = settled.as_ref().map_or(nothing, |settled| settled[bound.local].interval());
                let Some(share) = kept_share(&parameter.domain, &kept) else { continue };
                let percent = 100.0 - share.to_f64() * 100.0;
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
