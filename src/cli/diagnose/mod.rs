//! `avastra diagnose`: what the collision or breach of a scenario hangs on.

mod modules;
mod moment;
mod outside;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use avastra_base::outside::Shown;
use avastra_campaign::episode::EpisodeLog;
use avastra_campaign::oracle;
use avastra_campaign::oracle::{Diagnosis, Found, Swaps};
use avastra_campaign::run::{Asked, Stage};
use avastra_drivers::{ModularConfig, Selected};
use avastra_lang::model::Scenario;
use avastra_lang::model::vocabulary::Word;
use avastra_world::action::ActionTable;
use avastra_world::sim::Contact;

use super::arguments::DiagnoseArguments;
use super::error::Failure;
use super::findings::needs_program;
use super::load;
use super::look;
use super::output::{Output, plural};
use super::parallel::each_file;

/// Says what every file's finding hangs on: its first counted collision, or else the first breach that it claims. With `--moment`,
/// from when on it was certain.
pub fn diagnose(output: &Output, arguments: &DiagnoseArguments) -> Result<(), Failure> {
    let asked = load::asked(arguments.against.ads.as_deref())?;
    if arguments.moment {
        return moment::moments(output, arguments, &asked);
    }
    let baseline = arguments.baseline.as_deref().map(load::profile).transpose()?;
    let found = each_file(output, &arguments.many, asked.external.as_ref(), |file| {
        explain(output, arguments, &asked, baseline.as_ref(), file)
    })?;
    match found.done.as_slice() {
        [only] if found.is_single() => {
            output.tell(&only.heading);
            output.say(&only.why.whole_text());
        }
        several => several.iter().for_each(|found| {
            output.tell(&format!("{}: {}", found.file.shown(), found.why.sentence()));
        }),
    }
    let mut causes: BTreeMap<String, usize> = BTreeMap::new();
    found.done.iter().for_each(|found| *causes.entry(found.why.cause()).or_default() += 1);
    let mut causes: Vec<(String, usize)> = causes.into_iter().collect();
    causes.sort_by_key(|(_, count)| core::cmp::Reverse(*count));
    if !found.is_single() && !causes.is_empty() {
        output.say(&format!("\n{}, by cause:", plural(found.done.len(), "finding")));
        causes.iter().for_each(|(cause, count)| output.say(&format!("{count:>6}  {cause}")));
    }
    let scenarios = found.done.iter().map(Explained::in_json).collect();
    output.result(result(Some(&causes), scenarios, found.failed_in_json()));
    found.complete("explained")
}

/// The result in JSON; there are no causes of moments.
fn result(
    causes: Option<&[(String, usize)]>,
    scenarios: Vec<serde_json::Value>,
    failed: Vec<serde_json::Value>,
) -> serde_json::Value {
    let told = |causes: &[(String, usize)]| -> Vec<serde_json::Value> {
        causes.iter().map(|(cause, count)| serde_json::json!({ "cause": cause, "count": count })).collect()
    };
    serde_json::json!({ "causes": causes.map(told), "scenarios": scenarios, "failed": failed })
}

/// A scenario that was played, with what it is about.
struct Case<'a> {
    stage: Stage<'a>,
    ads: Selected,
    /// Whether that is the driving system that the scenario records.
    is_recorded: bool,
    log: EpisodeLog,
    found: Found,
}

impl Case<'_> {
    fn of<'a>(table: &'a ActionTable, scenario: &'a Scenario, asked: &Asked) -> Result<Case<'a>, Failure> {
        let (ads, is_recorded) = asked.selected_for(scenario)?;
        let stage = Stage::new(table, scenario)?;
        let (log, _, found) = stage.first_found(&ads);
        if let (None, Some(failure)) = (found, &log.failure) {
            let said = failure.in_words();
            return Err(Failure::usage(format!("`{}`: {said}; {}", scenario.name, failure.problem.advice())));
        }
        let Some(found) = found else {
            let count = plural(log.collisions.len(), "collision");
            let loose = ads.program().filter(|program| !program.is_deterministic());
            let hint = loose.map_or("", |_| "; it is not deterministic, so another play may have it");
            return Err(Failure::usage(format!(
                "`{}` {} with this driving system ({count} in all){hint}",
                scenario.name,
                stage.lack_in_words()
            )));
        };
        Ok(Case { stage, ads, is_recorded, log, found })
    }
}

/// Why a finding happened.
enum Why {
    /// By the modules of the driving system.
    Modules(Box<Diagnosis>),
    /// As it shows from outside.
    Outside(Swaps),
}

impl Why {
    fn whole_text(&self) -> String {
        match self {
            Why::Modules(diagnosis) => modules::whole_text(diagnosis),
            Why::Outside(swaps) => outside::whole_text(swaps),
        }
    }

    fn sentence(&self) -> String {
        match self {
            Why::Modules(diagnosis) => modules::sentence(diagnosis),
            Why::Outside(swaps) => outside::sentence(swaps),
        }
    }

    /// In a word or two, to count by.
    fn cause(&self) -> String {
        match self {
            Why::Modules(diagnosis) => modules::cause(diagnosis),
            Why::Outside(swaps) => outside::cause(swaps),
        }
    }
}

/// What one file's finding hangs on.
struct Explained {
    file: PathBuf,
    scenario: String,
    ads: &'static str,
    /// The finding, in words and in JSON.
    heading: String,
    what: serde_json::Value,
    why: Why,
}

impl Explained {
    fn in_json(&self) -> serde_json::Value {
        let (diagnosis, swaps) = match &self.why {
            Why::Modules(diagnosis) => (Some(diagnosis), None),
            Why::Outside(swaps) => (None, Some(swaps)),
        };
        let mut told = serde_json::json!({
            "file": self.file, "scenario": self.scenario, "ads": self.ads, "diagnosis": diagnosis, "swaps": swaps,
        });
        if let (Some(told), Some(what)) = (told.as_object_mut(), self.what.as_object()) {
            told.extend(what.clone());
        }
        told
    }
}

fn explain(
    output: &Output,
    arguments: &DiagnoseArguments,
    asked: &Asked,
    baseline: Option<&ModularConfig>,
    file: &Path,
) -> Result<Explained, Failure> {
    let (table, scenario) = look::unchanged(output, file)?;
    let Case { stage, ads, log, found, .. } = Case::of(&table, &scenario, asked)?;
    let setup = stage.setup(&ads);
    let why = if arguments.outside || ads.profile().is_none() && baseline.is_none() {
        if !oracle::can_replay(&ads) {
            return Err(needs_program(&scenario.name, "change"));
        }
        if let Some(program) = ads.program().filter(|program| !program.is_deterministic()) {
            return Err(Failure::usage(format!(
                "`{}` is not deterministic, so a drive that differs says nothing about what was changed; \
                 `diagnose --moment` works for it",
                program.attached().name()
            )));
        }
        if let (Some(program), Some(first)) = (ads.program(), &log.conversation) {
            program.spot_check(first, || stage.play(&ads, &mut |_, _, _| {}).conversation);
            if let Some(otherwise) = program.otherwise() {
                return Err(Failure::usage(format!(
                    "`{}` says that it is deterministic, but {otherwise}; so a drive that differs says nothing",
                    program.attached().name()
                )));
            }
        }
        Why::Outside(oracle::swaps(&setup, &log, found))
    } else {
        let baseline = baseline.copied().unwrap_or_default();
        let diagnosis = oracle::diagnose(&setup, &log, found, &baseline).map_err(Failure::usage)?;
        Why::Modules(Box::new(diagnosis))
    };
    let (heading, what) = told(&table, &log, found);
    let (file, scenario) = (file.to_owned(), scenario.name.clone());
    Ok(Explained { file, scenario, ads: ads.name(), heading, what, why })
}

/// The finding, in words and in JSON.
fn told(table: &ActionTable, log: &EpisodeLog, found: Found) -> (String, serde_json::Value) {
    match found {
        Found::Collision(index) => {
            let collision = &log.collisions[index];
            let Contact { obstacle, time_s, ruling, .. } = collision.contact;
            let priority = ruling.priority;
            let body = table.space().body_name(collision.body);
            let (verb, first) = (collision.verb.name(), ruling.describe());
            let heading = format!("{body} npc#{obstacle} ({verb}) is hit at {time_s:.2} s; {first}");
            let priority = priority.name();
            (heading, serde_json::json!({ "obstacle": obstacle, "time_s": time_s, "priority": priority }))
        }
        Found::Breach(index) => {
            let breach = &log.breaches[index];
            let (name, time_s) = (&table.space().requirements[breach.requirement].name, breach.time_s);
            let heading = format!("`{name}` is not kept at {time_s:.2} s");
            (heading, serde_json::json!({ "requirement": name, "time_s": time_s }))
        }
    }
}
