//! Files for a program that has avastra built in (`python/native`): spaces and driving systems, read as the commands read
//! them.

use std::path::{Path, PathBuf};

use avastra_base::outside::Shown;
use avastra_campaign::run::Run;
use avastra_lang::syntax::{DiagnosticRecord, Style, record, render};
use avastra_world::action::ActionTable;

use super::arguments::{ConditionArguments, RuleArguments};
use super::conditions::settings;
use super::load;

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
    let mut loaded = load::read_and_check(path).map_err(|error| Unusable::File(error.to_string()))?;
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
