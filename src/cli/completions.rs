//! `avastra completions`: what a shell needs to complete the command line.

use super::arguments::CompletionsArguments;
use super::error::Failure;
use super::help;
use super::output::Output;

/// Prints a script for the shell; `avastra completions bash > FILE` and source it.
pub fn completions(output: &Output, arguments: &CompletionsArguments) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut help::command(), "avastra", &mut script);
    let script = String::from_utf8(script).expect("scripts are text");
    output.say(script.trim_end());
    output.result(serde_json::json!({ "shell": arguments.shell.to_string(), "script": script }));
    Ok(())
}
