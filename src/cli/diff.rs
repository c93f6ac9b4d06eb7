//! `avastra diff`: what a change of a space means for its table, its rules and its draws.

use core::fmt::Write;

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
    let mut text = String::new();
    for difference in &found {
        let Difference { change, subject, detail } = difference;
        // Writing to a String cannot fail.
        let _ = write!(text, "{change} {subject}");
        let _ = if detail.is_empty() { writeln!(text) } else { writeln!(text, ": {detail}") };
    }
    output.say(if text.is_empty() { "the two spaces mean the same" } else { text.trim_end() });
    output.result(serde_json::json!({ "differences": found }));
    Ok(())
}
