//! The command line: the one place that reads files, the clock and the environment, and exits.

mod ads;
mod arguments;
mod campaign;
mod cell_times;
mod clock;
mod check;
mod compile;
mod completions;
mod conditions;
mod diagnose;
mod diff;
mod doc;
mod editor_files;
pub mod embedded;
mod error;
mod estimate;
mod explain;
mod export;
mod export_space;
mod files;
mod findings;
mod fmt;
mod help;
mod import;
mod interrupt;
mod load;
mod look;
mod lsp;
mod merge;
mod mistyped;
mod never;
mod new;
mod output;
mod pack;
mod parallel;
mod policy;
mod progress;
mod protocol;
mod render;
mod replay;
mod report;
mod results;
mod review;
mod rewritten;
mod road;
mod run;
mod run_directory;
mod sarif;
mod schema;
mod shard;
mod shrink;
mod study;
mod summary;
mod test;
mod train;
mod triage;
mod trials;
mod why;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::{ArgMatches, FromArgMatches};

use arguments::{Arguments, Command, Format};
use error::Failure;
use output::Output;

/// The words of the command that was asked for: `run`, `policy explain`.
fn words_of(found: &ArgMatches) -> String {
    let mut words = Vec::new();
    let mut next = found.subcommand();
    while let Some((word, within)) = next {
        words.push(word);
        next = within.subcommand();
    }
    words.join(" ")
}

/// Ends a process whose command line cannot be carried out.
fn refused(failure: &Failure) -> u8 {
    match output::asks_for_json() {
        true => output::usage_in_json(failure),
        false => output::remark(&format!("error: {failure}")),
    }
    failure.status()
}

/// Runs the command that the process was started with.
pub fn main() -> ExitCode {
    ExitCode::from(main_of(std::env::args_os().collect()))
}

/// Runs the command of a command line, whose first word is the program's name, and returns its exit status.
///
/// # Panics
/// If it was called before in this process.
pub fn main_of(words: Vec<OsString>) -> u8 {
    let words = output::begin(words);
    // File names end up in files and in JSON, which are text. So this is said before anything is played.
    if let Some(argument) = words.iter().find(|argument| argument.to_str().is_none()) {
        return refused(&Failure::usage(format!("{argument:?} is not UTF-8: rename the file")));
    }
    let found = match help::command().try_get_matches_from(words) {
        Ok(found) => found,
        Err(error) => {
            let error = mistyped::with_nearest_command(error);
            // Help and version are not failures; every other message of clap's is a usage error.
            if error.use_stderr() && output::asks_for_json() {
                let reason = error.to_string();
                return refused(&Failure::usage(reason.trim_end().trim_start_matches("error: ")));
            }
            let is_lost = error.print().or_else(output::unless_closed).is_err();
            if !error.use_stderr() {
                return u8::from(is_lost);
            }
            return Failure::usage(error.kind().to_string()).status();
        }
    };
    let arguments = Arguments::from_arg_matches(&found).expect("clap has parsed them");
    let name = words_of(&found);
    let has_diagnostics = matches!(arguments.command, Command::Check(_) | Command::Compile(_));
    if arguments.output.format == Format::Sarif && !has_diagnostics {
        return refused(&Failure::usage(format!(
            "`--format sarif` is for diagnostics, which `check` and `compile` print: use `--format json` with `{name}`"
        )));
    }
    // An editor's server speaks its protocol on stdout, whatever is asked for.
    let output = match arguments.command {
        Command::Lsp => Output::of(Format::Plain),
        _ => Output::new(&arguments.output),
    };
    interrupt::listen();
    let result = match &arguments.command {
        Command::Check(arguments) => check::check(&output, arguments),
        Command::Compile(arguments) => compile::compile(&output, arguments),
        Command::Table(arguments) => compile::table(&output, arguments),
        Command::Fmt(arguments) => fmt::fmt(&output, arguments),
        Command::Explain(arguments) => explain::explain(&output, arguments),
        Command::Diff(arguments) => diff::diff(&output, arguments),
        Command::New(arguments) => new::new(&output, arguments),
        Command::Completions(arguments) => completions::completions(&output, arguments),
        Command::Lsp => lsp::serve(),
        Command::EditorFiles(arguments) => editor_files::editor_files(&output, arguments),
        Command::Run(arguments) => run::run(&output, arguments),
        Command::Train(arguments) => train::train(&output, arguments),
        Command::Policy(arguments) => policy::policy(&output, arguments),
        Command::Study(arguments) => study::study(&output, arguments),
        Command::Estimate(arguments) => estimate::estimate(&output, arguments),
        Command::Merge(arguments) => merge::merge(&output, arguments),
        Command::Replay(arguments) => replay::replay(&output, arguments),
        Command::Diagnose(arguments) => diagnose::diagnose(&output, arguments),
        Command::Shrink(arguments) => shrink::shrink(&output, arguments),
        Command::Triage(arguments) => triage::triage(&output, arguments),
        Command::Export(arguments) => export::export(&output, arguments),
        Command::Import(arguments) => import::import(&output, arguments),
        Command::Test(arguments) => test::test(&output, arguments),
        Command::Report(arguments) => report::report(&output, arguments),
        Command::Render(arguments) => render::render(&output, arguments),
        Command::Road(arguments) => road::road(&output, arguments),
        Command::Ads(arguments) => ads::ads(&output, arguments),
    };
    output.finish(&name, result.as_ref().err());
    let arrived = output.arrived();
    if let Err(lost) = &arrived {
        output::remark(&format!("error: {lost}"));
    }
    // A result that could not be printed counts as a failure.
    arrived.and(result).map_or_else(|failure| failure.status(), |()| 0)
}
