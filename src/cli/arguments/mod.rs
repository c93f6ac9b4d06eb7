//! The command line: every command, with what is asked of each in a file for its kind.

mod drive;
mod external;
mod language;
mod learn;
mod scenarios;

use clap::{Args, Parser, Subcommand, ValueEnum};

pub use drive::{ConditionArguments, EstimateArguments, FailOn, MergeArguments, RunArguments};
pub use external::{AdsArguments, AdsCheckArguments, AdsCommand, Misbehaviour, ToyAnswer, ToyArguments};
pub use language::{
    CheckArguments, CompileArguments, CompletionsArguments, DiffArguments, Dump, EditorFilesArguments,
    ExplainArguments, FmtArguments, NewArguments, RuleArguments, TableArguments,
};
pub use learn::{
    DistilArguments, ExplainPolicyArguments, PolicyArguments, PolicyCommand, ResultsArguments,
    StudyArguments, StudyCommand, TrainArguments, WeightsArguments,
};
pub use scenarios::{
    DiagnoseArguments, ExportArguments, ExportEgo, ExportFormat, ExportProfile, FilesArguments,
    ImportArguments, RenderArguments, ReplayArguments, ReportArguments, RoadArguments, ShrinkArguments,
    TestArguments, TriageArguments,
};

/// Reads the seed of an argument.
fn seed(text: &str) -> Result<u64, &'static str> {
    text.parse().map_err(|_| "give a whole number from 0")
}

/// Finds out which of the things that may happen around a self-driving car make it crash.
#[derive(Debug, Parser)]
#[command(name = "avastra", version, max_term_width = 100)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
    #[command(flatten)]
    pub output: OutputArguments,
}

// Values have no help of their own, here and below: with any, clap prints every option in three lines.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Every command")]
pub struct OutputArguments {
    /// How to print; `sarif` is for diagnostics, of `check` and `compile`.
    #[arg(long, global = true, value_enum, default_value_t = Format::Human)]
    pub format: Format,
    /// When to use colour.
    #[arg(long, global = true, value_enum, default_value_t = When::Auto, value_name = "WHEN")]
    pub color: When,
    /// Print results and errors only.
    #[arg(long, short, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Print all: whole lists, and notes about used files.
    #[arg(long, short, global = true)]
    pub verbose: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Format {
    Human,
    Plain,
    Json,
    Sarif,
    /// Not at all; no command line asks for it.
    #[value(skip)]
    Silent,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum When {
    Auto,
    Always,
    Never,
}

/// The commands, in the order in which a newcomer meets them; `help` puts them in groups, each in one line.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Write a small space with its road, to begin with.
    New(NewArguments),
    /// Check files and list every mistake.
    Check(CheckArguments),
    /// Format files in the one style.
    Fmt(FmtArguments),
    /// Print the action table, say why a row is not legal, try rows out.
    Table(TableArguments),
    /// Write the typed action table of a space, with masks per road.
    Compile(CompileArguments),
    /// Print or draw a map, and a route through it.
    Road(RoadArguments),
    /// Say how two spaces differ in rows, rules and draws.
    Diff(DiffArguments),
    /// Say what a code like AV0101 means, or list all.
    Explain(ExplainArguments),
    /// Play episodes and write the crashes back as scenarios.
    Run(RunArguments),
    /// Train an agent and write what it learned as a policy.
    Train(TrainArguments),
    /// Explain a policy, distil its rules, or write its weights.
    Policy(PolicyArguments),
    /// Compare agents over roads and trainings, with statistics.
    Study(StudyArguments),
    /// Say how often a crash would happen, or which of two crashes more.
    Estimate(EstimateArguments),
    /// Bring the shards of a run, a study or an estimate together.
    Merge(MergeArguments),
    /// Play scenarios and policies again and check every claim.
    Replay(ReplayArguments),
    /// Write one page of HTML to look at, with replays.
    Report(ReportArguments),
    /// Draw moments of an emitted scenario as SVG.
    Render(RenderArguments),
    /// Say what a crash or a breach hangs on.
    Diagnose(DiagnoseArguments),
    /// Find the smallest scenario that still makes the same crash.
    Shrink(ShrinkArguments),
    /// Sort what runs found into known, new and gone failures.
    Triage(TriageArguments),
    /// Play emitted scenarios as a regression suite.
    Test(TestArguments),
    /// Write scenarios for other tools, or as a folder that can be moved.
    Export(ExportArguments),
    /// Make spaces of OpenSCENARIO files, or say what cannot be said.
    Import(ImportArguments),
    /// Check a driving system of your own; print the protocol's schema.
    Ads(AdsArguments),
    /// Serve an editor over stdin and stdout.
    Lsp,
    /// Print a script by which a shell completes this command line.
    Completions(CompletionsArguments),
    /// Write the parts of the VS Code extension that follow from the language.
    #[command(hide = true)]
    EditorFiles(EditorFilesArguments),
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::Arguments;

    /// What may be said anew when a directory is gone on with: it changes no result.
    const ANEW: [&str; 5] = ["resume", "jobs", "reuse", "fail_on", "help"];

    #[test]
    fn a_directory_that_is_gone_on_with_keeps_its_settings() {
        let mut command = Arguments::command();
        command.build();
        let mut resumed = Vec::new();
        for command in command.get_subcommands() {
            let Some(resume) = command.get_arguments().find(|argument| argument.get_id() == "resume") else {
                continue;
            };
            resumed.push(command.get_name());
            let refused = command.get_arg_conflicts_with(resume);
            for argument in command.get_arguments().filter(|argument| !argument.is_global_set()) {
                let is_refused = refused.iter().any(|other| other.get_id() == argument.get_id());
                let id = argument.get_id().as_str();
                assert_eq!(is_refused, !ANEW.contains(&id), "`{} --resume` and `{id}`", command.get_name());
            }
        }
        assert_eq!(resumed, ["run", "train", "study", "estimate"]);
    }
}
