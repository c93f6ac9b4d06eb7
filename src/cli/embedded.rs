//! Files for a program that has avastra built in (`python/native`): spaces and driving systems, read as the commands read
//! them.

use std::path::{Path, PathBuf};

use avastra_base::outside::Shown;
use avastra_campaign::emit;
use avastra_campaign::episode::{EpisodeLog, Script, Setup};
use avastra_campaign::run::{EpisodeSummary, Run};
use avastra_lang::check::Loaded;
use avastra_lang::model::policy::WEIGHT_MAX;
use avastra_lang::model::{Policy, Space};
use avastra_lang::syntax::{DiagnosticRecord, Style, record, render};
use avastra_search::agent::{LearnerSettings, QPolicy, Settings, by_name};
use avastra_world::action::ActionTable;

use super::arguments::{ConditionArguments, RuleArguments};
use super::conditions::settings;
use super::error::Failure;
use super::files::write_named;
use super::load;
use super::run_directory::Player;
use super::train::origin;

/// What emits files here, as their first line names it.
const PYTHON: &str = "(Python)";

/// A space that was read, and what there is to say of it.
pub struct Compiled {
    pub table: ActionTable,
    /// Warnings and remarks.
    pub diagnostics: Vec<Said>,
}

/// A diagnostic, as data and as drawn for people.
#[derive(Debug, Clone)]
pub struct Said {
    pub record: DiagnosticRecord,
    pub text: String,
}

/// Why there is no space.
#[derive(Debug, Clone)]
pub enum Unusable {
    /// The source has mistakes; warnings stand among them.
    Mistakes(Vec<Said>),
    /// The file cannot be read, or has no space.
    File(String),
}

/// Reads a space file and checks it with all that it uses.
///
/// # Errors
/// If it cannot be read, has mistakes, or declares no action.
pub fn compile(path: &Path) -> Result<Compiled, Unusable> {
    load::forget();
    compiled(path, load::read_and_check(path))
}

/// Does the same for a text, as if it were the file at a path.
///
/// # Errors
/// As [`compile`].
pub fn compile_text(path: &Path, text: &str) -> Result<Compiled, Unusable> {
    load::forget();
    compiled(path, load::check_text(path, text))
}

fn compiled(path: &Path, loaded: Result<Loaded, Failure>) -> Result<Compiled, Unusable> {
    let mut loaded = loaded.map_err(|error| Unusable::File(error.to_string()))?;
    let said = |diagnostic| Said {
        record: record(diagnostic, &loaded.sources),
        text: render(diagnostic, &loaded.sources, Style::Plain),
    };
    let diagnostics: Vec<Said> = loaded.diagnostics.iter().map(said).collect();
    if loaded.diagnostics.iter().any(avastra_lang::syntax::Diagnostic::is_error) {
        return Err(Unusable::Mistakes(diagnostics));
    }
    let is_emitted = loaded.scenario.is_some() || loaded.policy.is_some();
    match loaded.space.take().filter(|space| !is_emitted && !space.actions.is_empty()) {
        Some(space) => Ok(Compiled { table: ActionTable::new(space), diagnostics }),
        None => Err(Unusable::File(format!("`{}` is no space: it declares no action", path.shown()))),
    }
}

/// Writes an episode as a scenario file: what was found in it, or else the whole of it. With replays, the file says how often each
/// finding recurs.
///
/// # Errors
/// In words: the space's file is not there or means something else, or the scenario cannot be written.
pub fn save(run: &Run, setup: &Setup, log: &EpisodeLog, path: &Path, replays: u32) -> Result<(), String> {
    is_named_and_there(run.table().space(), path)?;
    let mut summary = EpisodeSummary::judged(setup, 0, log);
    summary.find_keepers(setup, log);
    summary.find_recurrence(setup, &Script::of_log(log), log, replays);
    let conditions = &run.settings().conditions;
    let player = Player { command: PYTHON, table: run.table(), agent: "python", conditions };
    player.write_named(&resolved(path), (log, &summary)).map_err(|error| error.to_string())
}

/// The settings that `avastra train` has by default.
pub fn preset() -> LearnerSettings {
    match by_name("ddqn").and_then(|entry| Settings::from_yaml(entry, None, "")) {
        Some(Ok(Settings::Learning(settings))) => *settings,
        _ => unreachable!("ddqn learns, and its preset is sound"),
    }
}

/// A network that another program trained on the scaled observation.
#[derive(Debug, Clone)]
pub struct Trained {
    /// Between two layers, what is below 0 becomes 0.
    pub layers: Vec<Layer>,
    /// Whether it chooses among legal rows alone. If not, an illegal choice loses its step.
    pub is_masked: bool,
    /// Who trained it, in a few words: the origin's agent.
    pub by: String,
    pub seed: u64,
    pub episodes: u64,
}

/// A layer of a network.
#[derive(Debug, Clone)]
pub struct Layer {
    pub inputs: usize,
    /// For each output, the weights of all inputs.
    pub weights: Vec<f32>,
    /// One for each output.
    pub biases: Vec<f32>,
}

/// Writes a network as a policy that takes the row of the largest output. It has no claims and no rules: `policy distil` makes these.
///
/// # Errors
/// In words: the layers do not fit each other, the observation or the table, or the file cannot be written.
pub fn save_policy(run: &Run, path: &Path, trained: &Trained) -> Result<(), String> {
    let table = run.table();
    is_named_and_there(table.space(), path)?;
    let mut settings = preset();
    settings.network.dueling = false;
    let hidden = trained.layers.split_last().map_or(&[][..], |(_, hidden)| hidden);
    settings.network.hidden_units = hidden.iter().map(|layer| layer.biases.len()).collect();
    settings.choice.masks_choice = trained.is_masked;
    settings.exploration.evaluation_epsilon = 0.0;
    let wanted = QPolicy::shape(&settings, table.rows().len());
    let widths = |layers: &[usize]| layers.iter().map(ToString::to_string).collect::<Vec<_>>().join("-");
    let inputs = trained.layers.first().map_or(0, |layer| layer.inputs);
    let outputs = trained.layers.iter().map(|layer| layer.biases.len());
    let given: Vec<usize> = core::iter::once(inputs).chain(outputs).collect();
    let fits = |(index, layer): (usize, &Layer)| {
        layer.inputs == given[index] && layer.weights.len() == layer.inputs * layer.biases.len()
    };
    if let Some(number) = trained.layers.iter().enumerate().position(|layer| !fits(layer)) {
        return Err(format!("the weights of layer {number} do not fit its inputs or its biases"));
    }
    if given != wanted.layers {
        return Err(format!(
            "the network has {} units; here it needs {}: the scaled observation, hidden layers, and one output for each row",
            widths(&given),
            widths(&wanted.layers)
        ));
    }
    let ours = |Layer { inputs, weights, biases }: &Layer| {
        // Ours has the weights of all outputs for each input.
        let of_input = |input: usize| weights.iter().copied().skip(input).step_by(*inputs);
        (0..*inputs).flat_map(of_input).chain(biases.iter().copied()).collect::<Vec<f32>>()
    };
    let parameters: Vec<f32> = trained.layers.iter().flat_map(ours).collect();
    if !parameters.iter().all(|parameter| parameter.abs() <= WEIGHT_MAX) {
        return Err(format!("a weight is not finite, or beyond {WEIGHT_MAX}"));
    }
    let Trained { by, seed, episodes, .. } = trained;
    let conditions = &run.settings().conditions;
    let policy = Policy {
        name: emit::identifier(&path.file_stem().unwrap_or_default().to_string_lossy()),
        docs: vec![format!("{by}, trained elsewhere; nothing was evaluated.")],
        origin: origin(conditions, run.arena().attached().as_ref(), by, (*seed, *episodes)),
        layers: wanted.layers,
        dueling: false,
        hyperparameters: settings.record(),
        parameters,
        claims: None,
        rules: Vec::new(),
        digest: String::new(),
    };
    QPolicy::read(&policy, table).map_err(|error| error.to_string())?;
    let path = &resolved(path);
    let folder = path.parent().unwrap_or(Path::new("."));
    let space = table.space();
    let relative = load::relative(folder, &space.path).map_err(|error| error.to_string())?;
    let text = emit::policy_text(&policy, space, &relative, PYTHON);
    write_named(path, &text).map_err(|error| error.to_string())
}

/// Where a file really lies, if it is a link: what it names is relative to there.
fn resolved(path: &Path) -> PathBuf {
    std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
}

/// Whether a file may be written there that names the space's file.
fn is_named_and_there(space: &Space, path: &Path) -> Result<(), String> {
    if path.extension().is_none_or(|extension| extension != "ava") {
        return Err(format!("`{}` is no name of a file of the language: end it with `.ava`", path.shown()));
    }
    // Only what was emitted is replaced: not a space, nor a file that it uses.
    if path.exists() && !load::text(path).is_ok_and(|text| emit::is_emitted(&text)) {
        return Err(format!("`{}` is there, and avastra did not emit it: name another file", path.shown()));
    }
    if !space.path.exists() {
        return Err(format!(
            "`{}` is not there: what is saved names the file of its space; a relative path begins at the working directory",
            space.path.shown()
        ));
    }
    // What is written names the file of its space.
    let there = compile(&space.path).ok().map(|there| there.table.space().meaning.seal());
    if there == Some(space.meaning.seal()) {
        return Ok(());
    }
    Err(format!(
        "`{}` does not hold this space: write its text there first, because what is saved names the file of its space",
        space.path.shown()
    ))
}

/// The conditions of episodes, in the words of `avastra run`.
#[derive(Debug, Clone)]
pub struct Conditions {
    /// Empty: all of the space.
    pub roads: Vec<String>,
    pub ads: String,
    pub ads_config: Option<PathBuf>,
    pub ads_cmd: Option<String>,
    pub ambient: u32,
    pub traffic: Option<String>,
    pub with: Vec<String>,
    pub without: Vec<String>,
}

/// A run under these conditions, of which any number of episodes may be played. Its own agent is `random`.
///
/// # Errors
/// In words: what does not exist, cannot be read or does not fit together.
pub fn run(table: ActionTable, conditions: &Conditions) -> Result<Run, String> {
    let Conditions { roads, ads, ads_config, ads_cmd, ambient, traffic, with, without } = conditions;
    let ambient_max = avastra_lang::model::AMBIENT_MAX;
    if *ambient > ambient_max {
        return Err(format!("{ambient} vehicles of ambient traffic: at most {ambient_max} are possible"));
    }
    let arguments = ConditionArguments {
        road: roads.clone(),
        agent: "random".to_owned(),
        seed: 0,
        ambient: *ambient,
        traffic: traffic.clone(),
        rules: RuleArguments { without: without.clone(), with: with.clone() },
    };
    let settings = load::under_test(ads, ads_config.as_deref(), ads_cmd.as_deref())
        .and_then(|under_test| settings(table.space(), &arguments, &arguments.agent, under_test, 1))
        .map_err(|error| error.to_string())?;
    Run::new(table, settings).map_err(|error| error.to_string())
}
