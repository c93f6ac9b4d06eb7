//! Requirements that nothing can breach, or everything does: most are a mistake in a unit or a sign.

use crate::model::expr::Expr;
use crate::model::{RoadFacts, Space, code};
use crate::prove::moment::{Case, may_hold_together};
use crate::prove::{Known, enclose};
use crate::syntax::Diagnostic;

/// One warning for each requirement whose condition holds at every moment on every road, or that is never asked. Another
/// for each requirement whose condition cannot hold where it is asked, so that every driving system breaches it.
pub(super) fn report(space: &Space) -> Vec<Diagnostic> {
    let cells = space.cells_unknown();
    let mut diagnostics = Vec::new();
    for required in &space.requirements {
        let on_all = |holds: &dyn Fn(&Known<'_>) -> bool| {
            !space.roads.is_empty()
                && space.roads.iter().all(|road| {
                    let functions = &space.functions;
                    // A file of laws may ask for stop signs where there is none.
                    let road = &RoadFacts { has_stop_sign: true, ..road.facts.clone() };
                    let road = Some(road);
                    holds(&Known { functions, locals: &[], cells: &cells, road, case: None })
                })
        };
        let never = |condition: &&Expr| on_all(&|known| !enclose(condition, known).may_hold());
        let hold = |conditions: &[&Expr], known: &Known<'_>| {
            may_hold_together(conditions, known, &space.episode, || vec![Case::default()])
        };
        let when: Vec<&Expr> = required.when.iter().collect();
        let with_condition = [&when[..], &[&required.condition]].concat();
        let is_opposed = || {
            // A condition that is asked later, or somewhere else, may hold there.
            required.until.is_none()
                && required.after.is_none()
                && required.unless.is_none()
                && on_all(&|known| !hold(&with_condition, known))
                // A file of laws may ask for lights where there are none: `run` says that it was never asked.
                && !on_all(&|known| !hold(&when, known))
        };
        let (message, span, why) = match required.when.iter().chain(&required.after).find(never) {
            Some(never) => ("is asked at no moment", never.span, "never holds"),
            None if on_all(&|known| !enclose(&required.condition, known).may_fail()) => {
                ("can never be breached", required.condition.span, "always holds")
            }
            None if is_opposed() => {
                ("is breached whenever it is asked", required.condition.span, "never holds there")
            }
            None => continue,
        };
        let message = format!("`{}` {message}", required.name);
        let warning = Diagnostic::warning(code::ALWAYS_KEPT, message).at(span, why);
        diagnostics.push(warning.help("look at its units and at the direction of its comparison"));
    }
    diagnostics
}

/// Whether a requirement can be asked at no moment on a road, because its `when` or its `after` holds at none there.
pub fn is_never_asked(space: &Space, requirement: usize, road: &RoadFacts) -> bool {
    let cells = space.cells_unknown();
    let known =
        Known { functions: &space.functions, locals: &[], cells: &cells, road: Some(road), case: None };
    let required = &space.requirements[requirement];
    required.when.iter().chain(&required.after).any(|condition| !enclose(condition, &known).may_hold())
}
