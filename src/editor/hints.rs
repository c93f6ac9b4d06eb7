//! Inlay hints. An editor shows the rows of an action behind its name. Behind a drawn range it shows the part that the
//! rules leave.
//!
//! Hints are shown only while the space is sound: row numbers from an earlier state could be wrong.

use avastra_lang::model::{Domain, Interval, Space};
use avastra_lang::syntax::ast::{Action, ActionParam, ItemKind, ParamMode, Span};

use super::hover::{find_action, ranges_left, row_numbers};
use super::position::Point;
use super::workspace::Analysis;

/// A remark that an editor shows within a line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hint {
    pub at: Point,
    pub label: String,
    pub tooltip: String,
}

/// The hints between two bytes of the document.
pub fn hints(analysis: &Analysis, from: usize, to: usize) -> Vec<Hint> {
    let Some(space) = analysis.space().filter(|_| analysis.is_sound()) else { return Vec::new() };
    let mut found = Vec::new();
    for item in &analysis.loaded.files[0].tree.items {
        let ItemKind::Action(action) = item.kind.plain() else { continue };
        if item.span.end < from || to < item.span.start {
            continue;
        }
        let Some((index, _)) = find_action(space, &action.name.text) else { continue };
        found.push(hint(
            analysis,
            action.name.span.end,
            &row_numbers(space, index),
            "rows of the action table",
        ));
        let drawn = action.params.iter().filter(|param| param.mode == ParamMode::Any);
        found.extend(drawn.filter_map(|param| range(analysis, space, action, param)));
    }
    found
}

/// The range that the rules leave on any road, if it is smaller than the written one. The tooltip lists it
/// road by road.
fn range(analysis: &Analysis, space: &Space, action: &Action, param: &ActionParam) -> Option<Hint> {
    let (of, left) = ranges_left(space, &action.name.text, &param.name.text)?;
    let Domain::Range(low, high) = &of.domain else { return None };
    let shown = |interval: &Interval| interval.shown(of.ty, of.unit());
    let all = left.iter().map(|(_, interval)| *interval).reduce(|all, interval| all.hull(&interval))?;
    if left.iter().all(|(_, interval)| *interval == Interval::closed(*low, *high)) {
        return None;
    }
    let tooltip: Vec<String> = left.iter().map(|(road, left)| format!("{road}: {}", shown(left))).collect();
    let tooltip = format!("after the rules\n{}", tooltip.join("\n"));
    Some(hint(analysis, param.span.end, &shown(&all), &tooltip))
}

fn hint(analysis: &Analysis, byte: usize, label: &str, tooltip: &str) -> Hint {
    let at = analysis.range(Span::new(Analysis::ROOT, byte, byte)).start;
    Hint { at, label: label.to_owned(), tooltip: tooltip.to_owned() }
}
