//! Listed values that rules forbid in every row on every road. Most are meant; some are a mistake in the rule.

use core::cell::Cell;

use crate::model::rules::RowRules;
use crate::model::{Domain, Parameter, RulesInForce, Space, Value, code};
use crate::prove::enclose::Values;
use crate::prove::lists::{OpenRow, distinct, open_rows, rule_names};
use crate::prove::reach::declared;
use crate::syntax::{Diagnostic, enumerated};

/// A remark names this many values and one more; of longer lists the others are counted.
const NAMED_MAX: usize = 5;

/// Rows that are looked at with one value and some rules, for all values of a space together. An editor checks at every
/// keystroke, so what would take longer is passed over.
const TRIALS_MAX: usize = 2000;

/// Longer lists are passed over, too.
const VALUES_MAX: usize = 200;

/// So are lists whose values, times the rows and roads where they may be drawn, are more than this.
const LOOKS_MAX: usize = 20_000;

/// One remark for each drawn parameter and each set of rules that keeps some of its values from ever being drawn.
pub(super) fn report(space: &Space) -> Vec<Diagnostic> {
    let search = Search {
        space,
        default: RulesInForce::by_default(space),
        none: RulesInForce::none(space),
        cells: space.cells_unknown(),
        left: Cell::new(TRIALS_MAX),
    };
    let mut remarks = Vec::new();
    for (index, action) in space.actions.iter().enumerate() {
        let open: Vec<OpenRow<'_>> = open_rows(space, space.rows_of(index)).collect();
        for (local, parameter) in action.parameters.iter().enumerate().filter(|(_, one)| !one.axis) {
            let Domain::Values(values) = &parameter.domain else { continue };
            if values.len() > VALUES_MAX || values.len() * open.len() > LOOKS_MAX {
                continue;
            }
            let mut sets: Vec<(Vec<usize>, Vec<Value>)> = Vec::new();
            for value in distinct(values.iter().copied()) {
                let Some(rules) = search.forbidding(&open, (local, parameter), value) else { continue };
                match sets.iter_mut().find(|(known, _)| *known == rules) {
                    Some((_, values)) => values.push(value),
                    None => sets.push((rules, vec![value])),
                }
            }
            // Without trials some values may be missing.
            if search.left.get() == 0 {
                return remarks;
            }
            remarks.extend(sets.iter().map(|(rules, values)| remark(space, parameter, values, rules)));
        }
    }
    remarks
}

struct Search<'a> {
    space: &'a Space,
    default: RulesInForce,
    none: RulesInForce,
    cells: Vec<Values>,
    /// Trials that are left.
    left: Cell<usize>,
}

impl Search<'_> {
    /// The rules that forbid a value wherever the action's own conditions leave it; `None` if it is drawn somewhere,
    /// or if they leave it nowhere.
    fn forbidding(
        &self,
        open: &[OpenRow<'_>],
        (local, parameter): (usize, &Parameter),
        value: Value,
    ) -> Option<Vec<usize>> {
        let within = |place: &OpenRow<'_>| {
            let range = place.ranges.iter().find(|(name, _)| *name == parameter.name);
            match (range, Values::point(value)) {
                (Some((_, range)), Values::Number(point)) => !range.intersect(&point).is_empty(),
                _ => true,
            }
        };
        let default = |place| self.rules_on(place, &self.default);
        if open.iter().any(|place| within(place) && self.leaves(default(place), local, value)) {
            return None;
        }
        let own = open.iter().filter(|place| self.leaves(self.rules_on(place, &self.none), local, value));
        let mut rules: Vec<usize> = own
            .flat_map(|place| default(place).conflict(&|fewer| !self.leaves(fewer, local, value)))
            .collect();
        rules.sort_unstable();
        rules.dedup();
        (!rules.is_empty()).then_some(rules)
    }

    fn rules_on<'a>(&'a self, place: &'a OpenRow<'_>, in_force: &'a RulesInForce) -> RowRules<'a> {
        RowRules { space: self.space, row: place.row, road: Some(&place.road.facts), in_force }
    }

    /// Whether the rules leave a value to a row; so they do once there are no trials left.
    fn leaves(&self, rules: RowRules<'_>, local: usize, value: Value) -> bool {
        let Some(left) = self.left.get().checked_sub(1) else { return true };
        self.left.set(left);
        let mut locals = declared(self.space, rules.row);
        locals[local] = Values::point(value);
        rules.narrow(locals, &self.cells, None).is_some()
    }
}

fn remark(space: &Space, parameter: &Parameter, values: &[Value], rules: &[usize]) -> Diagnostic {
    let unit = parameter.unit();
    let mut shown: Vec<String> =
        values.iter().map(|value| format!("`{}`", space.show_listed(*value, parameter, unit))).collect();
    if shown.len() > NAMED_MAX + 1 {
        shown.truncate(NAMED_MAX);
        shown.push(format!("{} others", values.len() - NAMED_MAX));
    }
    let shown = enumerated(&shown, "or");
    let verb = if rules.len() == 1 { "lets" } else { "let" };
    let message = format!("{} never {verb} `{}` be {shown}", rule_names(space, rules), parameter.name);
    let remark = Diagnostic::remark(code::CUT, message).at(parameter.span, "");
    rules.iter().fold(remark, |remark, rule| remark.beside(space.rules[*rule].span, "by this rule")).help(
        "if you intended this, change nothing; otherwise list the values that you want (`in [..]`), or relax the rule",
    )
}
