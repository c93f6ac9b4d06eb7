//! Rows that were not found to run: those of which nothing is known, and those that would run only in states to
//! which no episode comes.

use crate::model::{Row, RulesInForce, Space, code};
use crate::prove::clock::never_enabled;
use crate::prove::reach::numbers;
use crate::prove::realise::{Realisable, Realised};
use crate::syntax::{Diagnostic, listed};

/// One error for each action with rows of which nothing is known, and one warning for each action with rows
/// that no episode enables.
pub(super) fn report(space: &Space, realisable: &Realisable) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    let told = never_enabled(space);
    let in_force = RulesInForce::by_default(space);
    let has_start = space.roads.iter().all(|road| space.memory_at_start(road, &in_force, 0).is_ok());
    for (action, definition) in space.actions.iter().enumerate() {
        let rows = || space.rows.iter().filter(move |row| row.action == action);
        // Roads on which the same rows are open share an error.
        let mut open: Vec<(Vec<&Row>, Vec<&str>)> = Vec::new();
        for (index, road) in space.roads.iter().enumerate() {
            let unknown: Vec<&Row> =
                rows().filter(|row| realisable[row.index][index] == Realised::Unknown).collect();
            match open.iter_mut().find(|(known, _)| *known == unknown) {
                _ if unknown.is_empty() => {}
                Some((_, roads)) => roads.push(&road.name),
                None => open.push((unknown, vec![&road.name])),
            }
        }
        for (unknown, roads) in &open {
            let message = format!("whether `{}` can run on {} is not known", definition.name, listed(roads));
            let obeyed = match names(space, unknown[0]).as_str() {
                "" => String::new(),
                names => format!(" that obey {names}"),
            };
            let error = Diagnostic::error(code::UNDECIDED, message)
                .at(definition.span, numbers(unknown))
                .note(format!("no values were found{obeyed}, and no proof that there are none"));
            diagnostics.push(error.help(
                "say it by sums, products and `match`, of at most six drawn numbers and with low powers",
            ));
        }
        // Where no episode begins, no state is reached.
        if !has_start {
            continue;
        }
        let is_unreached = |row: &&Row| {
            let found = &realisable[row.index];
            found.contains(&Realised::Unreached)
                && found.iter().all(|found| matches!(found, Realised::Unreached | Realised::Never))
                && !told.contains(&row.index)
        };
        let unreached: Vec<&Row> = rows().filter(is_unreached).collect();
        let Some(first) = unreached.first() else { continue };
        let message = format!("`{}` is never enabled", first.label);
        let warning = Diagnostic::warning(code::NEVER_ENABLED, message)
            .at(definition.span, numbers(&unreached))
            .note(format!("it would obey {} only in states to which no episode comes", names(space, first)))
            .help("begin in such a state, or add an action that leads to one");
        diagnostics.push(warning);
    }
    diagnostics
}

/// The rules on a row that are in force by default, in words.
fn names(space: &Space, row: &Row) -> String {
    let rules = row.rules.iter().map(|rule| &space.rules[*rule]).filter(|rule| !rule.optional);
    listed(&rules.map(|rule| rule.name.as_str()).collect::<Vec<_>>())
}
