//! `avastra diff`: what a change of a space means for its table, its rules and its draws.

use avastra_lang::check::{Difference, differences};

use super::arguments::DiffArguments;
use super::error::Failure;
use super::load;
use super::output::Output;

/// Prints every difference from the first space to the second.
pub fn diff(output: &Output, arguments: &DiffArguments) -> Result<(), Failure> {
    let old = load::load(output, &arguments.old)?;
    let new = load::load(output, &arguments.new)?;
    let found = differences(&old, &new).ok_or_else(|| Failure::usage("both files must be sound spaces"))?;
    for Difference { change, subject, detail } in &found {
        let detail = if detail.is_empty() { String::new() } else { format!(": {detail}") };
        output.say(&format!("{change} {subject}{detail}"));
    }
    if found.is_empty() {
        output.say("the two spaces mean the same");
    }
    output.result(serde_json::json!({ "differences": found }));
    Ok(())
}
