//! What `--help` says beyond each option's own line: examples for every command, what the names of a closed set mean,
//! and the exit status.
//!
//! The examples are read back by a test with the parser that they teach; `tests/it/help.rs` runs them.

use clap::builder::{PossibleValue, StringValueParser, TypedValueParser};
use clap::error::Error;
use clap::{Arg, Command, CommandFactory};

use avastra_base::folded;
use avastra_drivers as ads;
use avastra_drivers::external::PROTOCOL;
use avastra_lang::syntax::LANGUAGE;
use avastra_search::agent::{self, Kind};
use avastra_world::sim::{ENGINE, TrafficProfile};

use super::arguments::Arguments;
use super::output::{COLUMNS, SCHEMA};

const STATUS: &str = "\
Exit status:
  0    all is well
  1    wrong usage, or a file that cannot be read, used or written
  2    mistakes in a source file; for `fmt --check`, a file is not formatted;
       for `--resume`, another driving system than the one begun with
  3    a claim is refuted
  4    what `run --fail-on` names was found, or a `test` fails
  5    a driving system of your own failed (`ads check`, `study`, `estimate`,
       `replay`, `run --fail-on`; `run` and `train` if it drove no
       episode to its end, or could not be reached any more)
       Of several, the first in this order holds: 1 and 2 before 3, 4, 5.
  130  Ctrl-C or SIGTERM (143: a second SIGTERM). `run`, `train`, `study` and `estimate DIR` save
       what was done, and `--resume` goes on

`avastra COMMAND --help` has examples. `avastra explain` lists every diagnostic,
`avastra explain json` describes what `--format json` prints.";

/// Lines to type behind `avastra`, each with what it does; those of a command begin with it.
const EXAMPLES: &str = "\
check scenarios/avastra45.ava # list every mistake
check --strict --fix mine.ava # make the changes on offer; fail on warnings
check --audit scenarios/avastra45.ava # where each rule is enforced
check --dump actions --format json scenarios/avastra45.ava # the table, for tools
compile scenarios/avastra45.ava # write build/avastra45.table.yaml
compile scenarios/avastra45.ava -o table.yaml
table scenarios/avastra45.ava # the rows, numbered
table scenarios/avastra45.ava --road corner # what one road allows
table scenarios/avastra45.ava --row 12 # which rule says no?
table scenarios/avastra45.ava --row 0 --state 'time: Night'
table scenarios/avastra45.ava --markdown # the space, to read
table scenarios/avastra45.ava --try --tries 2 # drive each row and judge it
fmt mine.ava roads.ava # rewrite both
fmt --check scenarios/avastra45.ava # for a continuous build
fmt - # from stdin to stdout, for an editor
explain # all codes
explain AV0401 # one code, with an example
diff scenarios/avastra45.ava scenarios/deepcollision52.ava # rows, rules and draws that differ
new mine # write mine/space.ava, mine/roads.ava and a map
new town --map roads/corner.xodr # on routes through the junctions of your own map
completions bash > ~/.local/share/bash-completion/completions/avastra
completions zsh > ~/.zfunc/_avastra
lsp # an editor starts it; editors/vscode is an extension
run scenarios/avastra45.ava --episodes 20 # 20 episodes on each road
run scenarios/avastra45.ava --ads scenarios/ads/degraded.yaml # dirty sensors
run scenarios/avastra45.ava --ads reactive --traffic released
run scenarios/avastra45.ava --road corner --without npc_gap # with one rule switched off
run --policy policies/corner.ava # let a learned policy choose
run scenarios/avastra45.ava --ads './my_planner --fast' # a driving system of your own
run --resume runs/0001 # go on after Ctrl-C
run scenarios/avastra45.ava --shard 3/8 --out shards/3 # an eighth of it, for `merge`
train scenarios/avastra45.ava --road corner --episodes 750
train scenarios/avastra45.ava --agent bandit # a search in place of a learner
train --resume runs/0001 # go on after Ctrl-C
policy explain policies/corner.ava
policy explain policies/corner.ava --state 'ego_speed: 12 m/s, time: Night'
policy distil policies/corner.ava --leaves 8 -o short.ava # at most 8 readable rules
policy weights policies/corner.ava -o corner.safetensors
study scenarios/studies/rq1.yaml # compare agents; takes hours
study scenarios/studies/rq1.yaml --quick # see that it works
study --resume runs/0001 # go on after Ctrl-C
study scenarios/studies/rq1.yaml --shard 3/8 --out shards/3 # an eighth of it, for `merge`
study results # write RESULTS.md from scenarios/studies
study results --add runs/0001 --commit 8c11ccf # keep what a study found, and write it
estimate scenarios/avastra45.ava --ads scenarios/ads/degraded.yaml # by counting
estimate scenarios/avastra45.ava --road corner --method probe # rare crashes: try dangerous rows out
estimate scenarios/avastra45.ava --precision 0.2 --parts 400 # until it is precise enough
estimate scenarios/avastra45.ava --than scenarios/ads/degraded.yaml # what do dirty sensors cost?
estimate scenarios/avastra45.ava --ads idm --than cc --event collision
estimate --resume runs/0001 # go on after Ctrl-C
merge shards/* --out runs/whole # the directory that one machine would have made
merge shards/* --missing # which shards are to be played again
replay runs/0001/critical/*.ava # check every claim
replay policies/corner.ava # play the evaluation of a policy again
replay runs/0001/critical/corner_0004.ava --ads idm # the same scene, another driver
diagnose runs/0001/critical/corner_0004.ava # what the crash hangs on
diagnose --moment runs/0001/critical/corner_0004.ava # from when on it was certain
diagnose runs/0001/critical/*.ava # how often each cause is at fault
shrink runs/0001/critical/*.ava # write the smallest that still crash
triage runs/0001 --known known.yaml --add # begin a file of known failures
triage runs/0002 --known known.yaml # what is known, new and gone
test runs/0001 # do its scenarios still crash?
test runs/0001 --ads scenarios/ads/cautious.yaml --junit out.xml
test runs/0001 --review # what has changed for each of them, in meaning
test runs/0001 --accept # and take it over
export --to openscenario runs/0001/critical/*.ava # with their maps, for any player
export --to openscenario --ego none --out suite runs/0001/critical/*.ava
export --to openscenario --profile carla runs/0001/critical/*.ava # for CARLA's ScenarioRunner
export --to commonroad runs/0001/critical/corner_0004.ava # with a planning problem
export --to csv runs/0001/critical/corner_0004.ava # where everyone was at every tick
export --to ava runs/0001/critical/*.ava --out suite # a folder that can be moved
import cut_in.xosc # write imported/cut_in.ava and its map, or say what cannot be said
import --set ego_speed=10 cut_in.xosc # with another value of a parameter
import --ego Host --out catalogue suite/*.xosc
report runs/0001 # write runs/0001/report.html
report runs/0001/critical/corner_0004.ava -o crash.html # one scenario
report runs/0001 --ads scenarios/ads/default.yaml # two driving systems on one clock
report runs/0001 --ads cc # beside UN R157's careful driver
render runs/0001/critical/corner_0004.ava --strip # the seconds up to the crash
render runs/0001/critical/corner_0004.ava --at 12.5 -o moment.svg
ads check --ads './my_planner --fast' # does it follow the protocol?
ads check --drive --ads ./my_planner # does it keep the law alone on the road, is its adapter sound?
ads check --ads tcp:127.0.0.1:5555 # one that listens on a socket
ads schema # JSON Schema of every message
ads check --ads 'avastra ads toy --misbehave nan' # what a finding looks like
road scenarios/roads/corner.xodr # describe a map in words
road scenarios/avastra45.ava --road corner --svg corner.svg # draw it";

/// The commands in groups, in the order in which a newcomer meets them.
const GROUPS: &[(&str, &[&str])] = &[
    ("Write", &["new", "check", "fmt", "table", "compile", "road", "diff", "explain"]),
    ("Run", &["run", "train", "policy", "study", "estimate", "merge"]),
    ("Understand", &["replay", "report", "render", "diagnose", "shrink", "triage"]),
    ("Regress", &["test"]),
    ("Exchange", &["export", "import", "ads"]),
    ("Tools", &["lsp", "completions"]),
];

/// Commands and options that were, and what is typed now.
const MOVED: &[(&str, &str)] = &[
    ("verify", "replay"),
    ("compare", "estimate FILE --ads DRIVER --than DRIVER"),
    ("results", "study results"),
    ("distill", "policy distil"),
    ("explain-policy", "policy explain"),
    ("export-weights", "policy weights"),
    ("why", "table FILE --row N"),
    ("doc", "table FILE --markdown"),
    ("pack", "export --to ava"),
    ("--ads-config", "--ads FILE"),
    ("--ads-cmd", "--ads 'COMMAND'"),
    ("--compare", "--ads DRIVER"),
    ("--replays", "--repeat N"),
    ("--likelihood", "diagnose --moment"),
    ("--mechanisms", "diagnose FILES"),
    ("--fail-on-collision", "--fail-on collision"),
    ("--fail-on-breach", "--fail-on breach"),
];

/// What is typed now in place of a command or an option that was.
pub fn moved(word: &str) -> Option<&'static str> {
    MOVED.iter().find(|(was, _)| *was == word).map(|(_, is)| *is)
}

/// The groups, with a line for each command.
fn grouped(command: &Command) -> String {
    let mut text = String::new();
    for (heading, names) in GROUPS {
        text.push_str(&format!("{heading}:\n"));
        for name in *names {
            let about = command.find_subcommand(name).and_then(Command::get_about);
            let about = about.map(ToString::to_string).unwrap_or_default();
            text.push_str(&format!("  {name:<13}{about}\n"));
        }
        text.push('\n');
    }
    text
}

/// The whole command line, with all that `--help` says.
pub fn command() -> Command {
    let mut command = Arguments::command().after_help(STATUS).long_version(versions());
    let groups = grouped(&command);
    command = command.help_template(format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{groups}Every command:\n{{options}}{{after-help}}"
    ));
    for name in taught() {
        let notes = match name {
            "run" => format!("\n\n{}\n\n{}", agents(is_ready), driving_systems()),
            "train" => format!("\n\n{}\n\n{ONE_THREAD}", agents(is_trained)),
            _ => String::new(),
        };
        let text = format!("{}{notes}", examples_text(name));
        command = command.mut_subcommand(name, |command| command.after_help(text));
    }
    command
}

/// The versions of all that other programs may depend on.
fn versions() -> String {
    let layouts = avastra_campaign::layouts().map(|(name, version)| format!("{name} {version}"));
    format!(
        "{}\nlanguage {LANGUAGE}\nengine {ENGINE} (the same engine plays the same episodes)\nprotocol {PROTOCOL}\n\
         JSON schema {SCHEMA}\ndatabases {}",
        env!("CARGO_PKG_VERSION"),
        layouts.join(", ")
    )
}

const ONE_THREAD: &str = "\
A training has no `--jobs`: each of its episodes is chosen with what was learned from
the one before. Train other seeds beside it, or let `avastra study` do so.";

/// Where what a name means begins.
const NAMED_AT: usize = 18;

/// Where the explanations begin; an example that is longer has its own in the next line.
const EXPLAINED_AT: usize = 44;

/// The commands that have examples.
fn taught() -> Vec<&'static str> {
    let mut names: Vec<&str> = EXAMPLES.lines().filter_map(|line| line.split(' ').next()).collect();
    names.dedup();
    names
}

fn examples_text(command: &str) -> String {
    let mut text = "Examples:".to_owned();
    for line in EXAMPLES.lines().filter(|line| line.split(' ').next() == Some(command)) {
        let (line, what) = line.split_once(" # ").unwrap_or((line, ""));
        let line = format!("  avastra {line}");
        match what {
            "" => text.push_str(&format!("\n{line}")),
            what if line.len() + 2 <= EXPLAINED_AT => text.push_str(&format!("\n{line:EXPLAINED_AT$}{what}")),
            what => text.push_str(&format!("\n{line}\n{:EXPLAINED_AT$}{what}", "")),
        }
    }
    text
}

fn is_ready(entry: &agent::Entry) -> bool {
    matches!(entry.kind, Kind::Ready(_) | Kind::OneRow(_))
}

fn is_trained(entry: &agent::Entry) -> bool {
    !is_ready(entry)
}

fn agents(wanted: fn(&agent::Entry) -> bool) -> String {
    let agents = agent::REGISTRY.iter().filter(|entry| wanted(entry));
    named("Agents:", agents.map(|entry| (entry.name, entry.summary)))
}

fn driving_systems() -> String {
    named("Driving systems:", ads::REGISTRY.iter().map(|entry| (entry.name, entry.summary)))
}

fn named<'a>(heading: &str, entries: impl Iterator<Item = (&'a str, &'a str)>) -> String {
    let mut text = heading.to_owned();
    for (name, summary) in entries {
        let summary = folded(summary, COLUMNS - NAMED_AT);
        text.push_str(&format!("\n  {name:<width$}{}", summary[0], width = NAMED_AT - 2));
        summary[1..].iter().for_each(|line| text.push_str(&format!("\n{:NAMED_AT$}{line}", "")));
    }
    text
}

/// A name from a closed set. Help and completions list the set; a name outside it is refused by the command that
/// takes it, in words that say more than clap's.
#[derive(Clone)]
pub struct Named(fn() -> Vec<&'static str>);

impl Named {
    pub const ADS: Named = Named(|| ads::REGISTRY.iter().map(|entry| entry.name).collect());
    /// Agents that can act at once.
    pub const AGENT: Named =
        Named(|| agent::REGISTRY.iter().filter(|entry| is_ready(entry)).map(|entry| entry.name).collect());
    /// Agents that are trained.
    pub const TRAINED: Named =
        Named(|| agent::REGISTRY.iter().filter(|entry| is_trained(entry)).map(|entry| entry.name).collect());
    /// The presets of all agents.
    pub const PRESET: Named = Named(|| {
        let mut names: Vec<&str> = Vec::new();
        for entry in agent::REGISTRY {
            let Kind::Learning(presets) = entry.kind else { continue };
            for preset in presets {
                if !names.contains(&preset.name) {
                    names.push(preset.name);
                }
            }
        }
        names
    });
    /// The traffic profiles that avastra comes with.
    pub const TRAFFIC: Named = Named(TrafficProfile::shipped_names);
}

impl TypedValueParser for Named {
    type Value = String;

    fn parse_ref(
        &self,
        command: &Command,
        argument: Option<&Arg>,
        value: &std::ffi::OsStr,
    ) -> Result<String, Error> {
        StringValueParser::new().parse_ref(command, argument, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new((self.0)().into_iter().map(PossibleValue::new)))
    }
}

#[cfg(test)]
mod tests {
    use avastra_lang::syntax::read_yaml;

    use super::*;

    /// The words of a line as a shell would take it, as far as the examples go: quotes, and output sent elsewhere.
    fn words(line: &str) -> Vec<String> {
        let line = line.split(" > ").next().unwrap_or(line);
        let mut words = Vec::new();
        for (index, part) in line.split('\'').enumerate() {
            match index % 2 {
                0 => words.extend(part.split_whitespace().map(str::to_owned)),
                _ => words.push(part.to_owned()),
            }
        }
        words
    }

    #[test]
    fn every_command_has_examples_that_parse() {
        let shown: Vec<String> = command()
            .get_subcommands()
            .filter(|command| !command.is_hide_set())
            .map(|command| command.get_name().to_owned())
            .collect();
        let taught = taught();
        let missing: Vec<&String> = shown.iter().filter(|name| !taught.contains(&name.as_str())).collect();
        assert!(missing.is_empty(), "no example for {missing:?}");
        for line in EXAMPLES.lines() {
            let typed = line.split(" # ").next().unwrap_or(line);
            let all = std::iter::once("avastra".to_owned()).chain(words(typed));
            command().try_get_matches_from(all).unwrap_or_else(|error| panic!("{line}: {error}"));
        }
    }

    #[test]
    fn every_command_is_in_one_group_and_none_is_one_that_was() {
        let command = command();
        let shown = command.get_subcommands().filter(|command| !command.is_hide_set());
        let mut shown: Vec<&str> = shown.map(Command::get_name).collect();
        let mut grouped: Vec<&str> = GROUPS.iter().flat_map(|(_, names)| *names).copied().collect();
        shown.sort_unstable();
        grouped.sort_unstable();
        assert_eq!(grouped, shown);
        assert!(MOVED.iter().all(|(was, _)| !shown.contains(was)));
    }

    /// Every line of a script that calls avastra, comments included, parses once its variables have values.
    fn parse_calls(script: &str, values: &[(&str, &str)]) -> usize {
        let calls = script.lines().map(|line| line.trim_start_matches(['#', ' ']));
        let calls: Vec<&str> = calls.filter(|line| line.starts_with("avastra ")).collect();
        for call in &calls {
            let call = call.split(" # ").next().unwrap_or(call).replace('"', "");
            let call =
                values.iter().fold(call, |call, (name, value)| call.replace(&format!("${name}"), value));
            assert!(!call.contains('$'), "{call}");
            let all = words(&call);
            command().try_get_matches_from(all).unwrap_or_else(|error| panic!("{call}: {error}"));
        }
        calls.len()
    }

    #[test]
    fn the_slurm_script_calls_what_there_is() {
        let script = include_str!("../../examples/cluster/slurm.sh");
        let (_, count) = script.split_once("#SBATCH --array=1-").expect("it is an array");
        let count = count.lines().next().expect("there is a number");
        assert!(script.contains(&format!("\nSHARDS={count}\n")), "one number of shards");
        let values = [("SLURM_ARRAY_TASK_ID", "7"), ("SHARDS", count), ("out", "shards/7")];
        assert_eq!(parse_calls(script, &values), 3);
        assert!(
            script.contains("--array=\"$(avastra merge shards/* --missing)\""),
            "killed ones are played again"
        );
    }

    #[test]
    fn the_kubernetes_job_calls_what_there_is() {
        let text = include_str!("../../examples/cluster/kubernetes.yaml");
        let job: serde_json::Value = read_yaml(text).expect("it is YAML");
        assert_eq!((&job["apiVersion"], &job["kind"]), (&"batch/v1".into(), &"Job".into()));
        assert_eq!(job["spec"]["completionMode"], "Indexed");
        let pod = &job["spec"]["template"]["spec"];
        // An Indexed Job takes no other policy with `backoffLimitPerIndex`.
        assert_eq!(pod["restartPolicy"], "Never");
        let container = &pod["containers"][0];
        let count = job["spec"]["completions"].to_string();
        let set = container["env"].as_array().expect("a list");
        let set = set.iter().find(|variable| variable["name"] == "JOB_COMPLETIONS").expect("it is set");
        assert_eq!(set["value"], count.as_str());
        let script = container["args"][0].as_str().expect("a script");
        let values = [("out", "/shards/7")];
        assert_eq!(
            parse_calls(script, &values) + parse_calls(text.split("apiVersion").next().unwrap(), &[]),
            3
        );
        let image = include_str!("../../examples/cluster/Containerfile");
        let name = container["image"].as_str().expect("a name");
        assert!(image.contains(name) && name.ends_with(env!("CARGO_PKG_VERSION")), "{name}");
        assert!(image.contains(&format!("rust:{}", env!("CARGO_PKG_RUST_VERSION"))), "{image}");
    }

    #[test]
    fn help_fits_80_columns_with_an_option_in_a_line_or_two() {
        let help = |words: &[&str]| {
            let error = command().term_width(80).try_get_matches_from(words).expect_err("help is asked for");
            error.to_string()
        };
        let names = taught().into_iter().map(|name| vec!["avastra", name]);
        for words in names.chain([vec!["avastra"]]) {
            let text = help(&[&words[..], &["--help"]].concat());
            assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
            assert_eq!(text, help(&[&words[..], &["-h"]].concat()));
            assert!(text.contains("  -v, --verbose "), "{text}");
        }
    }
}
