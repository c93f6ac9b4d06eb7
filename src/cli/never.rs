//! The rows of the table that never happened in a run. The agent never asked for them, or they were never legal, never
//! chosen or never executed. The reasons stand beside them.

use std::collections::BTreeMap;

use avastra_base::folded;
use avastra_campaign::run::RowCount;
use avastra_world::action::ActionTable;

use super::output::{COLUMNS, plural};

/// Reasons that are listed, those of most rows; `--verbose` lists every row.
const REASONS_MAX: usize = 4;
/// Rows that are listed for a reason.
const ROWS_MAX: usize = 6;

/// The rows that never happened.
#[derive(serde::Serialize)]
pub struct Never {
    /// Rows of the table.
    rows: usize,
    /// Steps of all episodes.
    steps: i64,
    asked: Vec<RowFate>,
    legal: Vec<RowFate>,
    chosen: Vec<RowFate>,
    realised: Vec<RowFate>,
}

#[derive(Clone, serde::Serialize)]
struct RowFate {
    row: usize,
    label: String,
    #[serde(flatten)]
    count: RowCount,
}

impl Never {
    /// From what became of each row of the table, in so many steps.
    pub fn new(table: &ActionTable, counts: &BTreeMap<i64, RowCount>, steps: i64) -> Never {
        let mut never = Never {
            rows: table.rows().len(),
            steps,
            asked: Vec::new(),
            legal: Vec::new(),
            chosen: Vec::new(),
            realised: Vec::new(),
        };
        if never.steps == 0 {
            return never;
        }
        for row in table.rows() {
            let count = counts.get(&(row.index as i64)).cloned().unwrap_or_default();
            let list = match &count {
                RowCount { chosen: 0, legal: 0, refused, .. } if refused.is_empty() => &mut never.asked,
                RowCount { chosen: 0, legal: 0, .. } => &mut never.legal,
                RowCount { chosen: 0, .. } => &mut never.chosen,
                RowCount { realised: 0, .. } => &mut never.realised,
                _ => continue,
            };
            list.push(RowFate { row: row.index, label: row.label.clone(), count });
        }
        never
    }

    /// Counts and the reasons of most rows; with `all`, every row with every reason.
    pub fn in_words(&self, all: bool) -> String {
        if self.steps == 0 {
            return "no step was played".to_owned();
        }
        let never: usize =
            [&self.asked, &self.legal, &self.chosen, &self.realised].iter().map(|rows| rows.len()).sum();
        if never == 0 {
            return format!("each of the {} was carried out", plural(self.rows, "row"));
        }
        let mut lines = vec![format!(
            "{never} of {} never happened, in {}:",
            plural(self.rows, "row"),
            plural(self.steps as usize, "step")
        )];
        let lists = [
            (&self.asked, "never asked for", "the agent chose others".to_owned()),
            (&self.legal, "never legal", self.reasons(&self.legal)),
            (&self.chosen, "legal, but never chosen", "the agent chose others".to_owned()),
            (&self.realised, "chosen, but never carried out", self.reasons(&self.realised)),
        ];
        for (rows, what, reasons) in lists {
            if rows.is_empty() {
                continue;
            }
            lines.push(format!("  {} {what}", rows.len()));
            match all {
                true => lines.extend(rows.iter().flat_map(RowFate::lines)),
                false if rows.iter().all(|row| row.count.refused.is_empty()) || what.starts_with("legal") => {
                    lines.extend(indented(4, &format!("{} ({reasons})", named(rows.iter()))));
                }
                false => lines.push(reasons),
            }
        }
        if lines.iter().any(|line| line.contains('…')) {
            lines.push("  `…` stands for figures that differ from step to step".to_owned());
        }
        if !all {
            lines.push("  `--verbose` lists every row".to_owned());
        }
        lines.join("\n")
    }

    /// The rows by what stood most in the way of each.
    fn reasons(&self, rows: &[RowFate]) -> String {
        let mut by_reason: BTreeMap<&str, (i64, Vec<&RowFate>)> = BTreeMap::new();
        for row in rows {
            let Some(first) = row.count.refused.first() else { continue };
            let (times, members) = by_reason.entry(&first.reason).or_default();
            *times = (*times).max(first.times);
            members.push(row);
        }
        let mut reasons: Vec<_> = by_reason.into_iter().collect();
        reasons
            .sort_by_key(|(reason, (times, members))| (core::cmp::Reverse((members.len(), *times)), *reason));
        let left = reasons.len().saturating_sub(REASONS_MAX);
        let mut lines = Vec::new();
        for (reason, (times, members)) in reasons.into_iter().take(REASONS_MAX) {
            let times = match members.as_slice() {
                [only] => format!("{times} of {}", plural(only.asked() as usize, "time")),
                _ => format!("up to {}", plural(times as usize, "time")),
            };
            lines.extend(indented(4, &format!("{}: {reason} ({times})", named(members.into_iter()))));
        }
        if left > 0 {
            lines.push(format!("    and {}", plural(left, "other reason")));
        }
        lines.join("\n")
    }
}

impl RowFate {
    /// Steps in which the agent asked for it.
    fn asked(&self) -> i64 {
        self.count.legal + self.count.refused.iter().map(|refusal| refusal.times).sum::<i64>()
    }

    /// The row with all that refused it.
    fn lines(&self) -> Vec<String> {
        let mut lines = indented(4, &format!("row {}, {}", self.row, self.label));
        let counts = &self.count;
        if counts.legal > 0 {
            lines.push(format!("      legal in {}", plural(counts.legal as usize, "step")));
        }
        for refusal in &counts.refused {
            lines.extend(indented(6, &format!("{} × {}", refusal.times, refusal.reason)));
        }
        lines
    }
}

/// `rows 3, 4, 5 and 2 others`, or the only row with its label.
fn named<'a>(rows: impl ExactSizeIterator<Item = &'a RowFate>) -> String {
    let rows: Vec<&RowFate> = rows.collect();
    if let [only] = rows.as_slice() {
        return format!("row {}, {}", only.row, only.label);
    }
    let shown: Vec<String> = rows.iter().take(ROWS_MAX).map(|row| row.row.to_string()).collect();
    let others = match rows.len().saturating_sub(ROWS_MAX) {
        0 => String::new(),
        left => format!(" and {}", plural(left, "other")),
    };
    format!("rows {}{others}", shown.join(", "))
}

/// A text in lines that fit, the first of them as far to the right as asked and the others farther.
fn indented(columns: usize, text: &str) -> Vec<String> {
    let lines = folded(text, COLUMNS - columns - 2);
    let indent =
        |(index, line): (usize, String)| format!("{:width$}{line}", "", width = columns + 2 * index.min(1));
    lines.into_iter().enumerate().map(indent).collect()
}
