//! The command line: every command, with what is asked of each in a file for its kind.

mod drive;
mod external;
mod language;
mod learn;
mod scenarios;

use clap::{Args, Parser, Subcommand, ValueEnum};

pub use drive::{
    CompareArguments, ConditionArguments, EstimateArguments, EventArgument, FaceArgument, MergeArguments,
    MethodArgument, RunArguments, UnderTestArguments,
};
pub use external::{AdsArguments, AdsCheckArguments, AdsCommand, Misbehaviour, ToyAnswer, ToyArguments};
pub use language::{
    CheckArguments, CompileArguments, CompletionsArguments, DiffArguments, DocArguments, Dump,
    EditorFilesArguments, ExplainArguments, FmtArguments, NewArguments, TableArguments, WhyArguments,
};
pub use learn::{
    DistillArguments, ExplainPolicyArguments, ExportWeightsArguments, ResultsArguments, StudyArguments,
    TrainArguments,
};
pub use scenarios::{
    AgainstArguments, DiagnoseArguments, ExportArguments, ExportEgo, ExportFormat, ExportProfile,
    FilesArguments, ImportArguments, PackArguments, RenderArguments, ReplayArguments, ReportArguments,
    RoadArguments, ShrinkArguments, TestArguments, VerifyArguments,
};

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

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Check files and list every mistake.
    Check(CheckArguments),
    /// Write the typed action table of a space, with masks per road.
    Compile(CompileArguments),
    /// Print the action table.
    Table(TableArguments),
    /// Say whether a row is legal here, and which rule says no.
    Why(WhyArguments),
    /// Format files in the one style.
    Fmt(FmtArguments),
    /// Say what a code like AV0101 means, or list all.
    Explain(ExplainArguments),
    /// Say how two spaces differ in rows, rules and draws.
    Diff(DiffArguments),
    /// Print a space as Markdown.
    Doc(DocArguments),
    /// Write a small space with its road, to begin with.
    New(NewArguments),
    /// Print a script by which a shell completes this command line.
    Completions(CompletionsArguments),
    /// Serve an editor: mistakes as you type, and all else that it asks for, over stdin and stdout.
    Lsp,
    /// Write the parts of the VS Code extension that follow from the language.
    #[command(hide = true)]
    EditorFiles(EditorFilesArguments),
    /// Play episodes and write the crashes back as scenarios.
    Run(RunArguments),
    /// Train an agent and write what it learned as a policy.
    Train(TrainArguments),
    /// Distil readable rules from a policy's network once more, with other settings.
    Distill(DistillArguments),
    /// Say which rows a policy favours and when, what it expects of them, and which variables matter to it.
    ExplainPolicy(ExplainPolicyArguments),
    /// Write the weights of a policy's network as safetensors, for other tools.
    ExportWeights(ExportWeightsArguments),
    /// Compare agents over roads and independent trainings, with statistics.
    Study(StudyArguments),
    /// Write what a folder of studies found as one Markdown file, beside published figures.
    Results(ResultsArguments),
    /// Say how often a crash would happen: its probability in an episode and its rate, with intervals.
    Estimate(EstimateArguments),
    /// Bring the shards of a run, a study or an estimate together.
    Merge(MergeArguments),
    /// Play two driving systems in the same episodes and say which one crashes more often.
    Compare(CompareArguments),
    /// Run emitted scenarios again and check every claim they make; against another driving system, only say what happens.
    Replay(ReplayArguments),
    /// Check every claim of emitted scenarios and policies.
    Verify(VerifyArguments),
    /// Say which module of the driving system an emitted scenario's crash is the fault of.
    Diagnose(DiagnoseArguments),
    /// Find the smallest scenario that still makes the same crash.
    Shrink(ShrinkArguments),
    /// Copy scenarios and policies with all that they use into a folder that can be moved.
    Pack(PackArguments),
    /// Play emitted scenarios as a regression suite for a driving system.
    Test(TestArguments),
    /// Write emitted scenarios as files of other tools: OpenSCENARIO, CommonRoad, tables.
    Export(ExportArguments),
    /// Make scenarios of OpenSCENARIO files of others: what can be said in the language, else why not.
    Import(ImportArguments),
    /// Write one page of HTML to look at: of a run, a training, a study or scenarios, with replays.
    Report(ReportArguments),
    /// Draw moments of an emitted scenario as SVG.
    Render(RenderArguments),
    /// Print or draw a map, and a route through it.
    Road(RoadArguments),
    /// Attach a driving system of your own: check it, print the schema of the messages, play with a toy.
    Ads(AdsArguments),
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::Arguments;

    /// What may be said anew when a directory is gone on with: it changes no result.
    const ANEW: [&str; 5] = ["resume", "jobs", "reuse", "fail_on_collision", "help"];

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
