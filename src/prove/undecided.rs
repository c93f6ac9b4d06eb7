//! Rows that are neither proved dead nor found to run.

use std::cell::Cell;

use crate::model::{Reach, Row, Space, code};
use crate::prove::reach::numbers;
use crate::prove::witness::witness_within;
use crate::syntax::{Diagnostic, listed};

/// The most boxes of ranges that the search for witnesses looks at; most rows need one for each road.
const BOXES_MAX: usize = 20_000;

/// One warning for each action and road with such rows.
pub(super) fn report(space: &Space) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    let boxes_left = Cell::new(BOXES_MAX);
    for (action, definition) in space.actions.iter().enumerate() {
        for (index, road) in space.roads.iter().enumerate() {
            let mut unknown: Vec<&Row> = Vec::new();
            for row in space.rows.iter().filter(|row| row.action == action) {
                if matches!(row.roads[index], Reach::Dead { .. }) || boxes_left.get() == 0 {
                    continue;
                }
                // A search that ran out of boxes shows nothing.
                if witness_within(space, row, road, &boxes_left).is_none() && boxes_left.get() > 0 {
                    unknown.push(row);
                }
            }
            let Some(first) = unknown.first() else { continue };
            let message = format!("whether `{}` can run on `{}` is not known", definition.name, road.name);
            let rules: Vec<&str> = first.rules.iter().map(|rule| space.rules[*rule].name.as_str()).collect();
            let warning =
                Diagnostic::warning(code::UNDECIDED, message).at(definition.span, numbers(&unknown));
            let warning = match rules.is_empty() {
                true => {
                    warning.note("no values were found with which it runs, and no proof that there are none")
                }
                false => warning.note(format!(
                    "no values were found that obey {}, and no proof that there are none",
                    listed(&rules)
                )),
            };
            diagnostics
                .push(warning.help("bound its parameters by simpler comparisons, one parameter a side"));
        }
    }
    diagnostics
}
