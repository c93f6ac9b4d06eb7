//! The outcome of every row on every road, as text.

use avastra_campaign::trial::{Cell, Outcome};
use avastra_world::action::Count;

/// One line a row, and under it one for each road. `cells` are by row, then by road.
pub fn trials(cells: &[Cell]) -> String {
    let width = cells.iter().map(|cell| cell.road.chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    let mut last = None;
    for cell in cells {
        if last != Some(cell.row) {
            text.push_str(&format!("{:>4}  {}\n", cell.row, cell.label));
            last = Some(cell.row);
        }
        let after = cell.after.as_ref().map_or_else(String::new, |row| format!("after {row}: "));
        text.push_str(&format!("      {:width$}  {after}{}\n", cell.road, fate(cell)));
    }
    text
}

/// `realised (6 of 6 tries), legal at 40 of 96 moments; …`.
fn fate(cell: &Cell) -> String {
    let Cell { realised, tried, legal, moments, .. } = cell;
    let head = match cell.outcome {
        Outcome::Masked => return format!("masked: {}", reasons(&cell.refusals)),
        Outcome::Realised => format!("realised ({realised} of {tried} tries)"),
        Outcome::Partly => {
            format!("realised ({realised} of {tried} tries), else {}", reasons(&cell.failures))
        }
        Outcome::NotRealised => {
            format!("not realised (0 of {tried} tries): {}", reasons(&cell.failures))
        }
    };
    let mut text = format!("{head}; legal at {legal} of {moments} moments");
    if !cell.refusals.is_empty() {
        text.push_str(&format!(", masked else: {}", reasons(&cell.refusals)));
    }
    if !cell.unfair.is_empty() {
        text.push_str(&format!("; UNFAIR: {}", reasons(&cell.unfair)));
    }
    text
}

/// The most frequent first.
fn reasons(counts: &[Count]) -> String {
    let mut counts: Vec<&Count> = counts.iter().collect();
    counts.sort_by_key(|count| core::cmp::Reverse(count.count));
    let reasons: Vec<String> =
        counts.iter().map(|count| format!("{} ({})", count.reason, count.count)).collect();
    reasons.join(", ")
}
