//! Requirements that nothing can breach: most are a mistake in a unit or a sign.

use crate::model::{Space, code};
use crate::prove::{Known, enclose};
use crate::syntax::Diagnostic;

/// One warning for each requirement whose condition holds at every moment on every road, or whose `when` at none.
pub(super) fn report(space: &Space) -> Vec<Diagnostic> {
    let cells = space.cells_unknown();
    let mut diagnostics = Vec::new();
    for required in &space.requirements {
        let on_all = |holds: &dyn Fn(&Known<'_>) -> bool| {
            !space.roads.is_empty()
                && space.roads.iter().all(|road| {
                    let functions = &space.functions;
                    let road = Some(&road.facts);
                    holds(&Known { functions, locals: &[], cells: &cells, road, case: None })
                })
        };
        let never_asked =
            required.when.as_ref().filter(|when| on_all(&|known| !enclose(when, known).may_hold()));
        let (message, span, why) = match never_asked {
            Some(when) => ("is asked at no moment", when.span, "never holds"),
            None if on_all(&|known| !enclose(&required.condition, known).may_fail()) => {
                ("can never be breached", required.condition.span, "always holds")
            }
            None => continue,
        };
        let message = format!("`{}` {message}", required.name);
        let warning = Diagnostic::warning(code::ALWAYS_KEPT, message).at(span, why);
        diagnostics.push(warning.help("look at its units and at the direction of its comparison"));
    }
    diagnostics
}
