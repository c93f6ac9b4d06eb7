//! What a page says of a whole run, training or study, beside its scenarios.

use serde_json::{Value, json};

use crate::action::ActionTable;
use crate::run::{Database, DatabaseError};

/// Of a run or a training: totals, groups of like failures, rows on roads, refusals, and the curve of learning.
/// `settings` is the text of its `run.yaml`.
///
/// # Errors
/// If the database cannot be read.
pub fn of_run(
    database: &Database,
    table: Option<&ActionTable>,
    settings: &str,
) -> Result<Value, DatabaseError> {
    let rows = table.map(|table| table.rows().iter().map(|row| row.label.as_str()).collect::<Vec<_>>());
    let learning = database.learning()?;
    Ok(json!({
        "kind": if learning.is_empty() { "run" } else { "training" },
        "settings": settings, "totals": database.totals()?, "groups": database.groups()?,
        "refusals": database.refusals()?, "failures": database.failures()?,
        "rows": rows, "coverage": database.coverage()?, "learning": learning,
    }))
}

/// Of a study: its results, as its `results.json` has them.
pub fn of_study(results: Value, settings: &str) -> Value {
    json!({ "kind": "study", "settings": settings, "study": results })
}
