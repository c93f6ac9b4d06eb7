//! `avastra shrink`: the smallest scenario that still makes the same crash or breach.

use std::path::{Path, PathBuf};

use avastra_base::outside::Shown;
use avastra_campaign::emit;
use avastra_campaign::episode::{EpisodeLog, Outcome, Script, Setup};
use avastra_campaign::oracle::{self, Found, Judgement, Worth, mixed_text};
use avastra_campaign::run::{self, Asked, EpisodeSummary, Stage};
use avastra_drivers::Selected;
use avastra_lang::model::vocabulary::Word;
use avastra_lang::model::{Claim, Space};

use super::arguments::{FilesArguments, ShrinkArguments};
use super::error::Failure;
use super::files::{folder, make, without_links, write_answers, write_result};
use super::findings::needs_program;
use super::findings::{is_reproducible, spot_check};
use super::load;
use super::look;
use super::output::{Output, plural};
use super::parallel::each_file;
use super::replay::refutation;
use super::run_directory;

/// The folder of the shrunk scenarios, beside the scenarios. A run's findings stay apart from files made of them.
pub const FOLDER: &str = "shrunk";

/// The end of a shrunk scenario's name.
const SUFFIX: &str = "_shrunk";

/// A finding that comes sooner or later by more than this is told to come at another time, s.
const MOVED_S: f64 = 0.5;

/// The name of the scenario that was found, by that of the shrunk one.
pub fn found_name(shrunk: &str) -> &str {
    shrunk.strip_suffix(SUFFIX).unwrap_or(shrunk)
}

/// Writes each file's scenario as small as possible, and checks every claim of what it wrote. Of a run's directory it takes the
/// worst finding of each kind.
pub fn shrink(output: &Output, arguments: &ShrinkArguments) -> Result<(), Failure> {
    let files = arguments.many.files.iter().map(|path| match path.join("run.yaml").is_file() {
        true => run_directory::worst_of_each_kind(path),
        false => Ok(vec![path.clone()]),
    });
    let files = files.collect::<Result<Vec<_>, Failure>>()?.concat();
    let many = FilesArguments { files, jobs: arguments.many.jobs };
    if let Some(path) = arguments.output.as_ref().filter(|_| many.files.len() > 1) {
        let path = path.shown();
        return Err(Failure::usage(format!(
            "`--out {path}` is for one file: of several, each is written to a folder `{FOLDER}`"
        )));
    }
    let asked = load::asked(arguments.against.ads.as_deref())?;
    let shrunk =
        each_file(output, &many, asked.external.as_ref(), |file| smaller(output, file, arguments, &asked))?;
    let done = &shrunk.done;
    for small in done {
        output.tell(&small.in_words());
        output.tell(&format!("  {}", small.worth_in_words()));
        if !small.gone.is_empty() {
            output.tell(&format!("  gone: {}", small.gone.join(", ")));
        }
        if shrunk.is_single() {
            small.actions_left.iter().for_each(|action| output.tell(&format!("  {action}")));
        }
    }
    let kept = done.iter().filter(|small| small.refuted == 0).count();
    let before = median(done.iter().map(|small| small.before));
    let after = median(done.iter().map(|small| small.after));
    if !shrunk.is_single() {
        output.say(&format!(
            "\n{}: median {} with {} became {} with {}; every claim of {kept} holds",
            plural(done.len(), "scenario"),
            counted(before.0, "step"),
            counted(before.1, "action"),
            counted(after.0, "step"),
            counted(after.1, "action"),
        ));
    }
    spot_check(asked.external.as_ref(), done.iter().map(|small| small.path.as_path()));
    let is_reproducible = is_reproducible(output, asked.external.as_ref());
    output.result(serde_json::json!({
        "median_steps_before": before.0, "median_actions_before": before.1,
        "median_steps": after.0, "median_actions": after.1, "kept": kept,
        "scenarios": done.iter().map(Small::in_json).collect::<Vec<_>>(),
        "reproducible": is_reproducible, "failed": shrunk.failed_in_json(),
    }));
    let refuted = done.iter().map(|small| small.refuted).sum();
    shrunk.complete("shrunk")?;
    refutation(refuted)
}

/// The result for one file. Sizes are numbers of steps, and of steps with an action.
struct Small {
    file: PathBuf,
    path: PathBuf,
    scenario: String,
    before: (usize, usize),
    after: (usize, usize),
    /// The actions that are left.
    actions_left: Vec<String>,
    /// The qualities that shrinking keeps or trades, before and after.
    worth: [Worth; 2],
    /// Other findings of the file that are gone.
    gone: Vec<String>,
    /// The requirement that is breached still, if the finding is a breach.
    requirement: Option<String>,
    /// Whether the driving system need not repeat itself.
    is_mixed: bool,
    plays: u32,
    /// Claims of the written file that do not hold.
    refuted: usize,
}

impl Small {
    fn in_words(&self) -> String {
        format!(
            "{}: {} with {} became {} with {} ({} played)",
            self.path.shown(),
            plural(self.before.0, "step"),
            plural(self.before.1, "action"),
            plural(self.after.0, "step"),
            plural(self.after.1, "action"),
            plural(self.plays as usize, "episode")
        )
    }

    /// The qualities that are the same as before, and the ones that changed.
    fn worth_in_words(&self) -> String {
        let [before, after] = &self.worth;
        let first = |priority: &str| match priority {
            "none" => "no priority",
            "ego" => "ego first",
            _ => "the other first",
        };
        let harm = after.harm.map(|harm| format!("{harm} harm"));
        let kept = [
            self.requirement.as_ref().map(|name| format!("`{name}` is breached")),
            after.kind.map(str::to_owned),
            harm,
            after.priority.map(|priority| first(priority).to_owned()),
        ];
        let kept: Vec<String> = kept.into_iter().flatten().collect();
        let impact = before
            .impact_mps
            .zip(after.impact_mps)
            .map(|(before, after)| format!("impact {:.1} → {:.1} km/h", 3.6 * before, 3.6 * after));
        let margin = before.margin.zip(after.margin);
        let moved = (before.time_s - after.time_s).abs() > MOVED_S;
        let again = match (before.recurrence, after.recurrence) {
            (Some(before), Some(after)) => {
                format!("recurs in {before} → {after}{}", mixed_text(self.is_mixed))
            }
            _ => "how often it recurs was not tried: `--repeat 20` tries it".to_owned(),
        };
        let told = [
            Some(format!("kept: {}", kept.join(", "))),
            impact,
            margin.map(|(before, after)| format!("margin {before:.2} → {after:.2}")),
            moved.then(|| format!("at {:.1} → {:.1} s", before.time_s, after.time_s)),
            Some(again),
        ];
        told.into_iter().flatten().collect::<Vec<_>>().join("; ")
    }

    fn in_json(&self) -> serde_json::Value {
        let [before, after] = &self.worth;
        serde_json::json!({
            "worth_before": before, "worth": after,
            "file": self.file, "output": self.path, "scenario": self.scenario,
            "requirement": self.requirement, "gone": self.gone,
            "steps_before": self.before.0, "actions_before": self.before.1,
            "steps": self.after.0, "actions": self.after.1,
            "plays": self.plays, "refuted": self.refuted,
        })
    }
}

/// The path of the shrunk scenario of a file, in the folder `shrunk`. The folder is made beside the file, or beside the
/// folder `critical` of a run.
fn apart(file: &Path) -> Result<PathBuf, Failure> {
    let beside = file.parent().unwrap_or(Path::new(""));
    let beside = if beside.ends_with("critical") { beside.parent().unwrap_or(beside) } else { beside };
    let path = beside.join(FOLDER).join(file.file_name().unwrap_or_default());
    without_links(&path)?;
    folder(beside, FOLDER)?;
    Ok(path)
}

/// Shrinks the scenario of a file into another, for which the user may have named a path.
fn smaller(
    output: &Output,
    file: &Path,
    arguments: &ShrinkArguments,
    asked: &Asked,
) -> Result<Small, Failure> {
    let named = arguments.output.as_ref();
    let (table, scenario) = look::unchanged(output, file)?;
    let (ads, _) = asked.selected_for(&scenario)?;
    if ads.program().is_some_and(|program| !program.can_start()) {
        return Err(needs_program(&scenario.name, "try"));
    }
    let stage = Stage::new(&table, &scenario)?;
    let (log, judgements, found) = stage.first_found(&ads);
    let Some(found) = found else {
        let name = &scenario.name;
        let missing = stage.lack_in_words();
        let message = match ads.program().filter(|program| !program.is_deterministic()) {
            None => format!("`{name}` {missing}"),
            Some(program) => format!(
                "`{name}` {missing} in this play: {} is not deterministic, so another play may have it",
                program.attached().name()
            ),
        };
        return Err(Failure::usage(message));
    };
    let replays = arguments.repeat.unwrap_or_else(|| stage.most_replays());
    let shrunk = oracle::shrink(&stage.setup(&ads), &log, found, &judgements, replays);

    let path = named.map_or_else(|| apart(file), |path| Ok(path.clone()))?;
    let path = path.as_path();
    let folder = path.parent().unwrap_or(Path::new(""));
    make(folder)?;
    let origin = &scenario.origin;
    let name = format!("{}{SUFFIX}", found_name(&scenario.name));
    let source = emit::Provenance {
        command: "shrink",
        name: &name,
        space_path: &load::relative(folder, &table.space().path)?,
        episode: origin.episode.unwrap_or(0) as usize,
        agent: origin.policy.as_deref().unwrap_or("none"),
        without: &origin.without,
        with: &origin.with,
    };
    let setup = Setup { start: shrunk.start, memory: shrunk.memory, ..stage.setup(&ads) };
    let spare = match shrunk.found {
        Found::Collision(index) => {
            oracle::spare_steps(&setup, &shrunk.log, index, &shrunk.judgements, replays)
        }
        Found::Breach(_) => Vec::new(),
    };
    let gone = gone([
        other_findings(table.space(), &log, &judgements, found),
        other_findings(table.space(), &shrunk.log, &shrunk.judgements, shrunk.found),
    ]);
    let mut summary = EpisodeSummary::new(table.space(), source.episode, &shrunk.log, shrunk.judgements);
    summary.find_keepers(&setup, &shrunk.log);
    summary.find_recurrence(&setup, &shrunk.script, &shrunk.log, replays);
    if let Found::Collision(index) = shrunk.found {
        summary.collisions[index].minimal = spare.is_empty();
    }
    if scenario.claims.iter().any(|claim| matches!(claim, Claim::Cause { .. })) {
        summary.find_causes(&setup, &shrunk.log).map_err(Failure::usage)?;
    }
    let text =
        avastra_lang::syntax::print(&emit::scenario(&table, (&shrunk.log, &summary), shrunk.found, &source));
    write_result(named, path, &text)?;
    write_answers(path, &shrunk.log)?;
    let recurrence = summary.recurrence_of(&shrunk.log, shrunk.found);
    let worth = [
        Worth::new(&log, found, shrunk.recurrence_before),
        Worth::new(&shrunk.log, shrunk.found, recurrence),
    ];
    let actions = shrunk.log.steps.iter().filter_map(|step| match &step.outcome {
        Outcome::Done { draw, .. } => Some(emit::action_text(&table, draw)),
        Outcome::Passed | Outcome::Refused { .. } => None,
    });
    let requirement = match shrunk.found {
        Found::Breach(index) => {
            let breach = &shrunk.log.breaches[index];
            Some(table.space().requirements[breach.requirement].name.to_string())
        }
        Found::Collision(_) => None,
    };
    Ok(Small {
        file: file.to_owned(),
        path: path.to_owned(),
        scenario: name.clone(),
        before: size(&Script::of_log(&log)),
        after: size(&shrunk.script),
        actions_left: actions.collect(),
        worth,
        gone,
        requirement,
        is_mixed: ads.program().is_some_and(|program| !program.is_deterministic()),
        plays: shrunk.plays,
        refuted: refuted(output, path, &ads)?,
    })
}

/// The counted collisions and the breached requirements of a log beside one finding, in words.
fn other_findings(space: &Space, log: &EpisodeLog, judgements: &[Judgement], found: Found) -> Vec<String> {
    let others = |index: &usize| found != Found::Collision(*index);
    let collisions = oracle::counted(space, log, judgements).into_iter().filter(others).map(|index| {
        let collision = &log.collisions[index];
        let harm = oracle::severity(collision).harm.name();
        format!("collision with {} ({harm} harm)", collision.body.like.name())
    });
    let kept = match found {
        Found::Breach(index) => Some(log.breaches[index].requirement),
        Found::Collision(_) => None,
    };
    let breaches = log.first_breaches().filter(|breach| Some(breach.requirement) != kept);
    let breaches =
        breaches.map(|breach| format!("breach of `{}`", space.requirements[breach.requirement].name));
    collisions.chain(breaches).collect()
}

/// The findings that are there before and not after. A repeated finding counts each time.
fn gone([before, mut after]: [Vec<String>; 2]) -> Vec<String> {
    let is_gone = |finding: &String| match after.iter().position(|other| other == finding) {
        Some(at) => {
            after.swap_remove(at);
            false
        }
        None => true,
    };
    before.into_iter().filter(is_gone).collect()
}

/// The median of steps and of actions, each by itself.
fn median(sizes: impl Iterator<Item = (usize, usize)>) -> (f64, f64) {
    let (mut steps, mut actions): (Vec<usize>, Vec<usize>) = sizes.unzip();
    let middle = |values: &mut Vec<usize>| {
        values.sort_unstable();
        let half = values.len() / 2;
        match values.as_slice() {
            [] => 0.0,
            values if values.len() % 2 == 1 => values[half] as f64,
            values => (values[half - 1] + values[half]) as f64 / 2.0,
        }
    };
    (middle(&mut steps), middle(&mut actions))
}

/// A median with its noun.
fn counted(count: f64, noun: &str) -> String {
    if count == 1.0 { format!("1 {noun}") } else { format!("{count} {noun}s") }
}

/// Number of claims of a written file that do not hold. An external driving system plays the file by its recorded answers,
/// as in a replay without `--ads`. The driving system `given` plays whatever the answers do not cover.
fn refuted(output: &Output, path: &Path, given: &Selected) -> Result<usize, Failure> {
    let (table, scenario) = load::scenario(output, path)?;
    let recorded = run::recorded(&scenario)?;
    let stage = Stage::new(&table, &scenario)?;
    let log = stage.play(&recorded, &mut |_, _, _| {});
    let to_try = if given.program().is_some() { given } else { &recorded };
    let claims = stage.verify(to_try, &log);
    Ok(claims.iter().filter(|claim| claim.is_refuted()).count())
}

/// Steps, and how many of them do something.
fn size(script: &Script) -> (usize, usize) {
    (script.steps.len(), script.steps.iter().flatten().count())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_are_of_each_size_by_itself() {
        assert_eq!(median([(3, 1), (1, 1), (8, 2)].into_iter()), (3.0, 1.0));
        assert_eq!(median([(3, 1), (4, 2)].into_iter()), (3.5, 1.5));
        assert_eq!(median([].into_iter()), (0.0, 0.0));
    }
}
