//! `avastra test`: emitted scenarios as a regression suite for a driving system.

use std::cell::Cell;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use avastra_base::outside::{Shown, in_markup};
use avastra_campaign::episode::{Breach, EpisodeLog, Script};
use avastra_campaign::files;
use avastra_campaign::oracle::{self, Found, REPLAYS, Recurrence, Regression, Replayed, mixed_text};
use avastra_campaign::run::{self, Asked, RunError, Stage};
use avastra_drivers::external::{Failure as AdsFailure, FailureKind};
use avastra_drivers::{EXTERNAL, Selected};
use avastra_lang::check::{Loaded, normal};
use avastra_lang::model::{Claim, REPLAYS_MAX, Scenario};
use avastra_lang::syntax::ast::FileId;
use avastra_lang::syntax::{Diagnostic, Sources};
use avastra_world::action::ActionTable;

use super::arguments::{FilesArguments, TestArguments};
use super::clock::now;
use super::error::Failure;
use super::files::{without_links, write_again, write_anew, write_named};
use super::findings::{is_reproducible, spot_check};
use super::load::{self, Emitted, answers_path};
use super::look::{as_it_is_now, is_outdated, meaning_text};
use super::output::{Output, plural};
use super::parallel::each_file_in_turn;
use super::review::{Change, Now, Review, review};
use super::run_directory;
use super::run_directory::what_was_begun;

/// The result for one scenario.
struct Case {
    file: PathBuf,
    scenario: String,
    road: String,
    outcome: Outcome,
    by: By,
    /// How often it failed in plays under other noise, if there were any, and in how many more the driving system itself failed.
    again: Option<Recurrence>,
    ads_failed: u32,
    /// The rate of failures below which it is fixed.
    below: f64,
    elapsed_s: f64,
}

/// By what a scenario was played.
#[derive(Debug, Clone, Default)]
struct By {
    /// From recorded answers: no program was asked.
    is_recorded: bool,
    /// Name of the driving system that it was found with, if another one played it.
    found_with: Option<String>,
    /// Whether the driving system under test need not repeat itself.
    is_mixed: bool,
}

enum Outcome {
    Played(Regression),
    /// Another crash than the scenario's, which `--allow-changed` lets pass.
    Allowed(Regression),
    /// A requirement that it was found with is not kept again.
    Breached {
        requirement: String,
        time_s: f64,
    },
    /// A review finds no crash of it any more, and why.
    Gone(String),
    /// Why the scenario could not be played, and whether that is a mistake in a source.
    NotPlayed {
        reason: String,
        in_source: bool,
    },
}

/// Plays every scenario of a suite against a driving system.
pub fn test(output: &Output, arguments: &TestArguments) -> Result<(), Failure> {
    let files = suite_files(&arguments.paths)?;
    if arguments.accept {
        files.iter().try_for_each(|file| without_links(file))?;
    }
    let remarks = arguments.paths.iter().filter_map(|path| run_directory::remark_on_copy(path));
    remarks.for_each(|remark| output.warn(&remark));
    let asked = load::asked(arguments.against.ads.as_deref())?;
    let suite = Suite { arguments, asked };
    for path in &arguments.paths {
        let foreign = what_was_begun(path).and_then(|kind| (kind.foreign)(path));
        foreign.iter().for_each(|text| output.warn(text));
    }
    let many = FilesArguments { files, jobs: arguments.jobs };
    let program = suite.asked.external.as_ref();
    let mut tell = |found: &Option<(Case, Notes)>| found.iter().for_each(|found| tell(output, found));
    let mut played = each_file_in_turn(output, &many, program, |file| Ok(suite.play(file)), &mut tell)?;
    let (mut cases, mut outdated, mut reviewed) = (Vec::new(), Vec::new(), Vec::new());
    let mut accepted = 0;
    for (case, notes) in std::mem::take(&mut played.done).into_iter().flatten() {
        cases.push(case);
        outdated.extend(notes.outdated);
        reviewed.extend(notes.reviewed);
        accepted += usize::from(notes.is_accepted);
    }
    played.complete("played")?;
    let named: Vec<String> = arguments.paths.iter().map(|path| path.shown().to_string()).collect();
    let named = named.join(" ");
    if cases.is_empty() {
        return Err(Failure::usage(format!("no scenario in `{named}`")));
    }
    tell_outdated(output, &outdated);
    let driven = cases.iter().filter(|case| {
        matches!(&case.outcome, Outcome::Played(found) | Outcome::Allowed(found)
            if !matches!(found, Regression::AdsFailed(_) | Regression::FailsAgain(_)))
    });
    let program = suite.asked.external.as_ref();
    spot_check(program, driven.map(|case| case.file.as_path()));
    // It may say that it is deterministic, and be found to be otherwise just now.
    if program.is_some_and(|program| !program.is_deterministic()) {
        play_again(output, &suite, &mut cases)?;
    }
    if let Some(path) = &arguments.junit {
        // A folder that is misspelt is not made.
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        if folder.is_some_and(|folder| !folder.is_dir()) {
            return Err(Failure::file("write", path, "its folder does not exist"));
        }
        write_named(path, &junit(&named, &cases))?;
    }
    let count = |word: &str| cases.iter().filter(|case| case.in_words().0 == word).count();
    let (fails, fixed, ads_failed, errors) =
        (count("still fails"), count("fixed"), count("ads failed"), count("error"));
    let passed = count(PASSED);
    let recorded = cases.iter().filter(|case| case.by.is_recorded).count();
    let is_changed = |case: &&Case| matches!(case.in_words().0, "changed" | "gone");
    let changed = cases.iter().filter(is_changed).count();
    let changed_fails = cases.iter().filter(is_changed).filter(|case| case.is_failure()).count();
    if arguments.accept {
        output.say(&format!("{} written anew", plural(accepted, "scenario")));
    }
    output.say(&format!(
        "{}: {fails} still fail, {fixed} fixed, {passed} {PASSED}, {changed} changed{}, {errors} not played",
        plural(cases.len(), "scenario"),
        if changed_fails > 0 { format!(" ({changed_fails} of them fail)") } else { String::new() },
    ));
    if let Some(text) = needed_text(&cases) {
        output.say(&text);
    }
    if recorded > 0 {
        output.warn(&format!(
            "{} of {}: played from recorded answers, and no program was asked; that says nothing of the program as it is \
             now, which `--ads` gives",
            recorded,
            plural(cases.len(), "scenario")
        ));
    }
    let is_unmet = |case: &&Case| matches!(case.outcome, Outcome::Played(Regression::NeverMet));
    let unmet = cases.iter().filter(is_unmet).count();
    if unmet > 0 {
        output.warn(&format!(
            "{unmet} of {}: the obstacle never appears, so nothing was tested there; `replay` shows why",
            plural(cases.len(), "scenario")
        ));
    }
    let others = cases.iter().filter_map(|case| case.by.found_with.as_deref());
    let found_with: BTreeSet<&str> = others.clone().collect();
    if !found_with.is_empty() {
        let found_with: Vec<String> = found_with.into_iter().map(|name| format!("`{name}`")).collect();
        output.warn(&format!(
            "{} of {}: found with another driving system ({}), so that the one under test passes does not say that \
             anything was mended",
            others.count(),
            plural(cases.len(), "scenario"),
            found_with.join(", ")
        ));
    }
    let is_reproducible = is_reproducible(output, program);
    if ads_failed > 0 {
        output.say(&format!("in {ads_failed} more the driving system itself failed"));
    }
    let listed: Vec<serde_json::Value> = cases
        .iter()
        .map(|case| {
            let (outcome, reason) = case.in_words();
            serde_json::json!({ "file": case.file, "scenario": case.scenario,
                                "outcome": outcome, "reason": reason, "recorded": case.by.is_recorded,
                                "found_with": case.by.found_with,
                                "again": case.again, "ads_failed": case.ads_failed })
        })
        .collect();
    output.result(
        serde_json::json!({ "still_fails": fails, "fixed": fixed, "passed": passed, "recorded": recorded, "changed": changed, "errors": errors, "ads_failed": ads_failed, "reproducible": is_reproducible,
                                      "accepted": accepted, "reviewed": reviewed, "scenarios": listed }),
    );
    if errors > 0 {
        let in_source = |case: &Case| matches!(case.outcome, Outcome::NotPlayed { in_source: true, .. });
        return Err(Failure::NotPlayed { scenarios: errors, in_source: cases.iter().any(in_source) });
    }
    match cases.iter().filter(|case| case.is_failure()).count() {
        0 => Ok(()),
        scenarios => Err(Failure::Failing { scenarios }),
    }
}

/// Plays again what has not failed, as often as a driving system that is not deterministic needs. Until now it was believed to be.
fn play_again(output: &Output, suite: &Suite, cases: &mut [Case]) -> Result<(), Failure> {
    let is_open = |case: &&Case| !case.by.is_mixed && !case.is_failure() && case.outcome.was_played();
    let files: Vec<PathBuf> = cases.iter().filter(is_open).map(|case| case.file.clone()).collect();
    if !files.is_empty() {
        let scenarios = plural(files.len(), "scenario");
        output.warn(&format!(
            "the driving system is not deterministic, though it says so: {scenarios} played again"
        ));
        let many = FilesArguments { files, jobs: suite.arguments.jobs };
        let mut tell = |found: &Option<(Case, Notes)>| found.iter().for_each(|found| tell(output, found));
        let program = suite.asked.external.as_ref();
        let mut again = each_file_in_turn(output, &many, program, |file| Ok(suite.play(file)), &mut tell)?;
        for (case, _) in std::mem::take(&mut again.done).into_iter().flatten() {
            if let Some(known) = cases.iter_mut().find(|known| known.file == case.file) {
                *known = case;
            }
        }
        again.complete("played")?;
    }
    for case in cases {
        case.by.is_mixed = true;
    }
    Ok(())
}

/// What would tell a pass from a fix, if anything passed.
fn needed_text(cases: &[Case]) -> Option<String> {
    let passed = cases.iter().filter(|case| case.in_words().0 == PASSED && !case.by.is_recorded);
    let needed = |case: &Case| case.again.unwrap_or_default().clean_until_below(case.below);
    let (most, below) = passed.filter_map(|case| Some((needed(case)?, case.below))).max_by_key(|of| of.0)?;
    let played = cases.iter().filter_map(|case| case.again).map(|again| again.replays).max().unwrap_or(0);
    let how = match most + played {
        all if all <= REPLAYS_MAX => format!("(`--repeat {all}`)"),
        _ => format!("(more than the {REPLAYS_MAX} of `--repeat`: ask for a higher rate with `--below`)"),
    };
    let replays = plural(most as usize, "clean replay");
    Some(format!(
        "a pass is no proof: {replays} more under other noise would show that less than {} fail\n{how}",
        percent(below)
    ))
}

/// A rate in per cent, with as many digits as it needs.
fn percent(rate: f64) -> String {
    let percent = format!("{:.1}", 100.0 * rate);
    format!("{} %", percent.trim_end_matches(".0"))
}

/// Prints what came of a file.
fn tell(output: &Output, (case, notes): &(Case, Notes)) {
    notes.told.iter().for_each(|(sources, diagnostics)| output.diagnostics(sources, diagnostics));
    notes.said.iter().for_each(|line| output.say(line));
    let (word, reason) = case.in_words();
    let reason = if reason.is_empty() { String::new() } else { format!(": {reason}") };
    output.tell(&format!("{word:<12}{}{reason}", case.file.shown()));
}

/// The files of a suite, each once: files as named, those of directories, and those that a run found.
fn suite_files(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut files: Vec<PathBuf> = Vec::new();
    for path in paths {
        let of_run = ["critical", "failures"].map(|folder| path.join(folder));
        // `--accept` writes into these folders.
        for folder in &of_run {
            files::own_folder(folder).map_err(|error| Failure::file("use", folder, error))?;
        }
        let found = match path {
            _ if of_run[0].is_dir() => {
                let folders = of_run.iter().filter(|folder| folder.is_dir());
                folders.map(|folder| load::sources_in(folder)).collect::<Result<Vec<_>, _>>()?.concat()
            }
            path if path.is_dir() => load::sources_in(path)?,
            path => vec![path.clone()],
        };
        for file in found {
            if !files.iter().any(|known| normal(known) == normal(&file)) {
                files.push(file);
            }
        }
    }
    Ok(files)
}

struct Suite<'a> {
    arguments: &'a TestArguments,
    asked: Asked,
}

/// Diagnostics, and the texts that they point into.
type Told = (Sources, Vec<Diagnostic>);

/// The output about a file besides its result. Files are played on threads, and printed in their order.
#[derive(Default)]
struct Notes {
    told: Vec<Told>,
    /// The lines of a review, and its result for JSON.
    said: Vec<String>,
    reviewed: Option<serde_json::Value>,
    /// The mistakes of a scenario that uses a space which means something else now.
    outdated: Option<Told>,
    /// Whether `--accept` wrote the scenario anew.
    is_accepted: bool,
}

impl Notes {
    /// The scenario or policy of a file. Its diagnostics are noted.
    fn emitted(&mut self, file: &Path, loaded: Loaded) -> Result<Emitted, Failure> {
        if !loaded.diagnostics.is_empty() {
            self.told.push((loaded.sources.clone(), loaded.diagnostics.clone()));
        }
        load::emitted_in(file, load::without_mistakes(loaded)?)
    }
}

impl Suite<'_> {
    /// Plays one file; `None` if it holds no scenario.
    fn play(&self, file: &Path) -> Option<(Case, Notes)> {
        let started = now();
        let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let mut notes = Notes::default();
        let (scenario, road, outcome, by, (again, ads_failed)) = match self.open(file, &mut notes) {
            Ok((Emitted::Policy(..), _)) => return None,
            Ok((Emitted::Scenario(table, scenario), reviewed)) => {
                let road = table.space().roads[scenario.road].name.clone();
                let not_played =
                    |error: RunError| Outcome::NotPlayed { reason: error.to_string(), in_source: false };
                let compared = || self.compare(&table, &scenario).unwrap_or_else(not_played);
                let by = self.by(&scenario);
                let outcome = reviewed.unwrap_or_else(compared);
                let again = match self.most_again(&by, &outcome) {
                    0 => (None, 0),
                    most => self
                        .again(&table, &scenario, most)
                        .map_or((None, 0), |(again, failed)| (Some(again), failed)),
                };
                (scenario.name, road, outcome, by, again)
            }
            Err(failure) => {
                let in_source = matches!(failure, Failure::Source { .. } | Failure::Outdated);
                let outcome = Outcome::NotPlayed { reason: failure.to_string(), in_source };
                (name, String::new(), outcome, By::default(), (None, 0))
            }
        };
        let (file, below) = (file.to_owned(), self.arguments.below);
        let elapsed_s = started.elapsed().as_secs_f64();
        Some((Case { file, scenario, road, outcome, by, again, ads_failed, below, elapsed_s }, notes))
    }

    /// By what a scenario is played.
    fn by(&self, scenario: &Scenario) -> By {
        let name = |ads: &Selected| match ads.program() {
            // Its version is meant to change.
            Some(program) => program.attached().title(),
            None => ads.name().to_owned(),
        };
        let played = self.asked.selected_for(scenario).ok().map(|(ads, _)| name(&ads));
        let found = run::found_with(scenario);
        let program = self.asked.external.as_ref();
        By {
            is_recorded: self.asked.is_nothing() && scenario.origin.ads.as_deref() == Some(EXTERNAL),
            found_with: played.filter(|played| *played != found).map(|_| found),
            is_mixed: program.is_some_and(|program| !program.is_deterministic()),
        }
    }

    /// How often at most a scenario is played again under other noise.
    fn most_again(&self, by: &By, outcome: &Outcome) -> u32 {
        let is_open = matches!(
            outcome,
            Outcome::Played(
                Regression::Fixed { .. } | Regression::StillFails { .. } | Regression::FailsAgain(_)
            ) | Outcome::Breached { .. }
        );
        match self.arguments.repeat {
            _ if !is_open => 0,
            Some(most) => most,
            // One play of a driving system with chance in it says little, unless it fails.
            None if by.is_mixed && !outcome.is_failure() => REPLAYS,
            None => 0,
        }
    }

    /// Plays a scenario under other noise until it is certain whether it fails less often than asked. Any of its findings is a
    /// failure. A play in which the driving system itself failed says nothing of them, and is counted apart. `None` if the driving
    /// system cannot be asked.
    fn again(&self, table: &ActionTable, scenario: &Scenario, most: u32) -> Option<(Recurrence, u32)> {
        let recorded = run::recorded(scenario).ok()?;
        let (ads, _) = self.asked.selected_for(scenario).ok()?;
        let stage = Stage::new(table, scenario).ok()?;
        let log = stage.play(&recorded, &mut |_, _, _| {});
        let counted = stage.counted(&recorded, &log);
        let is_own = |index: &usize| scenario.crashes_with(log.collisions[*index].contact.obstacle);
        let collisions = counted.into_iter().filter(is_own).map(Found::Collision);
        let breaches = scenario.breached().filter_map(|requirement| {
            let is_meant =
                |breach: &Breach| table.space().requirements[breach.requirement].name == *requirement;
            log.breaches.iter().position(is_meant).map(Found::Breach)
        });
        let findings: Vec<Found> = collisions.chain(breaches).collect();
        if !oracle::can_replay(&ads) {
            return None;
        }
        let setup = stage.setup(&ads);
        let replayed = Replayed::new(&setup, &Script::of_scenario(scenario), &log);
        let below = self.arguments.below;
        let ads_failed = Cell::new(0);
        let claimed = claimed_failure(scenario);
        let fails = |play: &EpisodeLog| match play.failure.as_ref().map(AdsFailure::kind) {
            Some(kind) if Some(kind) == claimed => Some(true),
            Some(_) => {
                ads_failed.set(ads_failed.get() + 1);
                None
            }
            // A scenario of a failure of the driving system, which has not failed.
            None if findings.is_empty() => Some(false),
            None => replayed.is_again(&findings, play),
        };
        let is_certain = |so_far: Recurrence| so_far.is_below(below) || so_far.is_above(below);
        let found = replayed.failing(fails, is_certain, most);
        // A driving system that was given up meanwhile drove only some of them.
        oracle::can_replay(&ads).then_some((found, ads_failed.get()))
    }

    /// Reads a file. One whose space has changed is noted, or reviewed; then it may be known already what comes of it.
    fn open(&self, file: &Path, notes: &mut Notes) -> Result<(Emitted, Option<Outcome>), Failure> {
        let loaded = load::read_and_check(file)?;
        if self.arguments.accept || self.arguments.review {
            return self.review(file, &loaded, notes);
        }
        if !is_outdated(&loaded) {
            return Ok((notes.emitted(file, loaded)?, None));
        }
        notes.outdated = Some((loaded.sources, loaded.diagnostics));
        Err(Failure::Outdated)
    }

    /// Plays a scenario as things are now, says what differs in meaning, and takes it over if asked. A scenario stays as
    /// it is if its finding is gone or if it cannot be played.
    fn review(
        &self,
        file: &Path,
        loaded: &Loaded,
        notes: &mut Notes,
    ) -> Result<(Emitted, Option<Outcome>), Failure> {
        let (before, mut spaces) = (loaded.sources.text(FileId::default()), Vec::new());
        let (text, checked) = match is_outdated(loaded) {
            false => (before.to_owned(), load::check_text(file, before)?),
            true => {
                spaces.push(meaning_text(loaded));
                as_it_is_now(file, loaded)?
            }
        };
        let emitted = notes.emitted(file, checked)?;
        let Emitted::Scenario(table, scenario) = &emitted else { return Ok((emitted, None)) };
        let Review { change, mut differences, illegal, now } = review(table, scenario, &self.asked, &text)?;
        differences.splice(0..0, spaces);
        notes.said.push(format!("{}: {}", file.shown(), change.in_words()));
        notes.said.extend(differences.iter().map(|difference| format!("    {difference}")));
        notes.reviewed = Some(serde_json::json!({
            "file": file, "scenario": scenario.name, "change": change.in_words(), "differences": differences,
        }));
        let Some(Now { text, answers }) = now else {
            let why = illegal.unwrap_or_else(|| {
                "no collision of it counts any more, and it breaches nothing that it did".to_owned()
            });
            let gone = Outcome::Gone(format!("{why}; it is kept as it was"));
            return Ok((emitted, (change == Change::Gone).then_some(gone)));
        };
        // The file does not claim the other crash until it is accepted.
        if change == Change::OtherObstacle && !self.arguments.accept {
            let other = self.asked.is_nothing().then(|| self.outcome(Regression::OtherCrash));
            return Ok((emitted, other));
        }
        if text == before {
            return Ok((emitted, None));
        }
        let mut emitted = notes.emitted(file, load::check_text(file, &text)?)?;
        if let (Emitted::Scenario(_, scenario), Some(answers)) = (&mut emitted, &answers) {
            // The file beside it has the answers of the text before.
            scenario.origin.recorded_answers = Some(Arc::clone(answers));
        }
        if self.arguments.accept {
            if let Some(answers) = &answers {
                write_anew(&answers_path(file), &**answers)?;
            }
            match self.arguments.paths.iter().any(|path| path == file) {
                true => write_again(file, &text)?,
                false => write_anew(file, &text)?,
            }
            notes.is_accepted = true;
        }
        Ok((emitted, None))
    }

    /// The crash of a scenario with the driving system that it was found with, and with the one under test.
    fn compare(&self, table: &ActionTable, scenario: &Scenario) -> Result<Outcome, RunError> {
        let recorded = run::recorded(scenario)?;
        let (ads, _) = self.asked.selected_for(scenario)?;
        let stage = Stage::new(table, scenario)?;
        if let Some(kind) = claimed_failure(scenario) {
            let log = stage.play(&ads, &mut |_, _, _| {});
            return Ok(Outcome::Played(match log.failure.as_ref().map(AdsFailure::kind) {
                None => Regression::Fixed { others_crash_s: log.others_crash_s() },
                Some(found) if found == kind => Regression::FailsAgain(kind),
                Some(found) => Regression::AdsFailed(found),
            }));
        }
        let log = stage.play(&recorded, &mut |_, _, _| {});
        let counted = stage.counted(&recorded, &log);
        let breached_by = |log: &EpisodeLog| {
            scenario.breached().find_map(|requirement| {
                let time_s = log.breach_of(table.space(), requirement)?.time_s;
                Some(Outcome::Breached { requirement: requirement.to_owned(), time_s })
            })
        };
        let is_breached = breached_by(&log).is_some();
        let breached_again = || match self.asked.is_nothing() {
            true => (breached_by(&log), Regression::OtherCrash),
            false => {
                let again = stage.play(&ads, &mut |_, _, _| {});
                let otherwise = match again.failure.as_ref().map(AdsFailure::kind) {
                    Some(kind) => Regression::AdsFailed(kind),
                    None if !stage.counted(&ads, &again).is_empty() => Regression::OtherCrash,
                    None => Regression::Fixed { others_crash_s: again.others_crash_s() },
                };
                (breached_by(&again), otherwise)
            }
        };
        if is_breached && (counted.is_empty() || scenario.is_about_a_breach()) {
            let (breached, otherwise) = breached_again();
            return Ok(breached.unwrap_or_else(|| self.outcome(otherwise)));
        }
        if counted.is_empty() {
            let reason =
                "it has no counted collision or breach with the driving system that it was found with";
            return Ok(Outcome::NotPlayed { reason: reason.to_owned(), in_source: false });
        }
        let is_own = |index: &usize| scenario.crashes_with(log.collisions[*index].contact.obstacle);
        let own: Vec<usize> = counted.into_iter().filter(is_own).collect();
        let found = match own.first() {
            // A second play with the same driving system would be the same, to the bit.
            Some(index) if self.asked.is_nothing() => {
                Regression::StillFails { time_s: log.collisions[*index].contact.time_s }
            }
            // Each by itself: an ego vehicle that avoids the first one may run into the next.
            Some(_) => {
                let setup = stage.setup(&recorded);
                let all = own.iter().map(|index| oracle::regression(&setup, &log, *index, &ads));
                // If several are equally bad, the first.
                let worse = |worst: Regression, next: Regression| {
                    if next.rank() > worst.rank() { next } else { worst }
                };
                all.reduce(worse).expect("there is one at least")
            }
            // Already with the driving system that it was found with.
            None => Regression::OtherCrash,
        };
        let again = match found {
            Regression::Fixed { .. } | Regression::NeverMet if is_breached => breached_again().0,
            _ => None,
        };
        Ok(again.unwrap_or_else(|| self.outcome(found)))
    }

    fn outcome(&self, found: Regression) -> Outcome {
        let is_allowed = self.arguments.allow_changed && found.is_other_crash();
        if is_allowed { Outcome::Allowed(found) } else { Outcome::Played(found) }
    }
}

/// Prints each diagnostic once, however many scenarios have it.
fn tell_outdated(output: &Output, outdated: &[Told]) {
    let mut told: Vec<(&Sources, &Diagnostic, usize)> = Vec::new();
    for (sources, diagnostics) in outdated {
        for diagnostic in diagnostics {
            match told.iter_mut().find(|(_, other, _)| other.notes == diagnostic.notes) {
                Some((_, _, times)) => *times += 1,
                None => told.push((sources, diagnostic, 1)),
            }
        }
    }
    for (sources, diagnostic, times) in told {
        let mut diagnostic = diagnostic.clone();
        if times > 1 {
            let others = plural(times - 1, "other scenario");
            diagnostic = diagnostic.note(format!("the same holds for {others} of the suite"));
        }
        output.diagnostics(sources, &[diagnostic]);
    }
}

/// How an external driving system fails at the end of a scenario, if the scenario claims so.
fn claimed_failure(scenario: &Scenario) -> Option<FailureKind> {
    let end = scenario.claims.iter().find_map(|claim| match claim {
        Claim::End(end) => Some(end),
        _ => None,
    })?;
    FailureKind::ALL.into_iter().find(|kind| kind.name() == end)
}

/// The word for a test in which nothing failed, but which cannot show that anything was fixed.
const PASSED: &str = "passed";

impl Case {
    /// One of seven words, and why.
    fn in_words(&self) -> (&'static str, String) {
        let (word, reason) = self.outcome.in_words();
        let By { is_recorded, found_with, is_mixed } = &self.by;
        let is_clean = matches!(self.outcome, Outcome::Played(Regression::Fixed { .. }));
        let is_below = self.again.is_some_and(|again| again.is_below(self.below));
        let word = match is_clean {
            // No program was asked, so only avastra can have changed.
            true if *is_recorded => "changed",
            true if self.again.is_some_and(|again| again.recurred > 0) => "still fails",
            true if self.ads_failed > 0 => "ads failed",
            // That another driving system passes mends nothing.
            true if found_with.is_some() || !is_below => PASSED,
            _ => word,
        };
        let found_with = found_with.as_ref().filter(|_| word == PASSED);
        let again = self.again.map(|again| {
            let percent = percent(self.below);
            let less = if is_below { format!(", so in less than {percent}") } else { String::new() };
            format!("fails in {again} under other noise{less}{}", mixed_text(*is_mixed))
        });
        let ads_failed = (self.ads_failed > 0).then(|| {
            format!("the driving system itself failed in {} more", plural(self.ads_failed as usize, "play"))
        });
        let more = [
            (!reason.is_empty()).then_some(reason),
            found_with.map(|found| format!("found with `{found}`")),
            again,
            ads_failed,
            (*is_recorded && self.outcome.was_played())
                .then(|| "by its recorded answers, no program was asked".to_owned()),
        ];
        (word, more.into_iter().flatten().collect::<Vec<_>>().join("; "))
    }

    /// Whether the driving system still crashes, in this play or in one under other noise, or is itself what fails.
    fn is_failure(&self) -> bool {
        self.outcome.is_failure() || matches!(self.in_words().0, "still fails" | "ads failed")
    }
}

impl Outcome {
    fn was_played(&self) -> bool {
        !matches!(self, Outcome::Gone(_) | Outcome::NotPlayed { .. })
    }

    /// Whether the driving system still crashes, or is itself what fails.
    fn is_failure(&self) -> bool {
        match self {
            Outcome::Played(
                Regression::StillFails { .. } | Regression::AdsFailed(_) | Regression::FailsAgain(_),
            ) => true,
            Outcome::Breached { .. } => true,
            Outcome::Played(found) => found.is_other_crash(),
            Outcome::Allowed(_) | Outcome::Gone(_) | Outcome::NotPlayed { .. } => false,
        }
    }

    /// It says nothing about the driving system, or nothing that counts.
    fn is_skipped(&self) -> bool {
        matches!(self, Outcome::Played(Regression::NeverMet) | Outcome::Allowed(_) | Outcome::Gone(_))
    }

    /// One of six words, and why.
    fn in_words(&self) -> (&'static str, String) {
        let (found, more) = match self {
            Outcome::Played(found) => (found, ""),
            Outcome::Allowed(found) => (found, ", which is allowed"),
            Outcome::Breached { requirement, time_s } => {
                return ("still fails", format!("`{requirement}` is breached at {time_s:.2} s"));
            }
            Outcome::Gone(reason) => return ("gone", reason.clone()),
            Outcome::NotPlayed { reason, .. } => return ("error", reason.clone()),
        };
        match found {
            Regression::StillFails { time_s } => {
                ("still fails", format!("the same obstacle is hit at {time_s:.2} s"))
            }
            Regression::FailsAgain(kind) => ("still fails", format!("{} again", kind.name())),
            Regression::Fixed { others_crash_s } => {
                let crash = |time_s| format!("but other road users crash into each other at {time_s:.2} s");
                ("fixed", others_crash_s.map_or_else(String::new, crash))
            }
            Regression::OtherCrash => ("changed", format!("another obstacle is hit{more}")),
            Regression::NotCounted { time_s } => {
                let how = format!("the same obstacle is hit at {time_s:.2} s, and it does not count");
                ("changed", format!("{how}{more}"))
            }
            Regression::NeverMet => ("changed", "the obstacle never appears".to_owned()),
            Regression::AdsFailed(kind) => {
                ("ads failed", format!("{}: `avastra ads check` says more", kind.name()))
            }
        }
    }
}

/// The results as JUnit XML, by the schema of Jenkins' xUnit plugin. Scenarios of one name are told apart by their
/// files.
fn junit(suite: &str, cases: &[Case]) -> String {
    let count = |is: fn(&Case) -> bool| cases.iter().filter(|case| is(case)).count();
    let counts = format!(
        "tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"{}\" time=\"{:.3}\"",
        cases.len(),
        count(Case::is_failure),
        count(|case| matches!(case.outcome, Outcome::NotPlayed { .. })),
        count(|case| case.outcome.is_skipped()),
        cases.iter().map(|case| case.elapsed_s).sum::<f64>()
    );
    let name = in_markup(suite);
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"avastra\" {counts}>\n  \
         <testsuite name=\"{name}\" {counts}>\n"
    );
    for case in cases {
        let (word, reason) = case.in_words();
        let reason = in_markup(&reason);
        let element = match &case.outcome {
            Outcome::NotPlayed { .. } => Some("error"),
            _ if case.is_failure() => Some("failure"),
            outcome if outcome.is_skipped() => Some("skipped"),
            Outcome::Played(_) | Outcome::Breached { .. } | Outcome::Allowed(_) | Outcome::Gone(_) => None,
        };
        let inside = match element {
            Some(element) => format!("\n      <{element} type=\"{word}\" message=\"{reason}\"/>\n    "),
            None if reason.is_empty() => String::new(),
            None => format!("\n      <system-out>{word}: {reason}</system-out>\n    "),
        };
        let is_alone = cases.iter().filter(|other| other.scenario == case.scenario).count() == 1;
        let name = if is_alone {
            case.scenario.clone()
        } else {
            format!("{} ({})", case.scenario, case.file.shown())
        };
        text.push_str(&format!(
            "    <testcase classname=\"{}\" name=\"{}\" time=\"{:.3}\">{inside}</testcase>\n",
            in_markup(&case.road),
            in_markup(&name),
            case.elapsed_s
        ));
    }
    text.push_str("  </testsuite>\n</testsuites>\n");
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_outcome_is_well_formed_xml() {
        let case = |scenario: &str, outcome| Case {
            file: PathBuf::from(format!("{scenario}.ava")),
            scenario: scenario.to_owned(),
            road: "corner".to_owned(),
            outcome,
            by: By::default(),
            again: None,
            ads_failed: 0,
            below: 0.1,
            elapsed_s: 0.25,
        };
        let cases = [
            case("a", Outcome::Played(Regression::StillFails { time_s: 14.221 })),
            Case {
                again: Some(Recurrence { recurred: 0, replays: 53 }),
                ..case("b", Outcome::Played(Regression::Fixed { others_crash_s: None }))
            },
            Case {
                again: Some(Recurrence { recurred: 2, replays: 20 }),
                ..case("h", Outcome::Played(Regression::Fixed { others_crash_s: None }))
            },
            case("c", Outcome::Played(Regression::OtherCrash)),
            case("d", Outcome::Played(Regression::NeverMet)),
            case("f", Outcome::Played(Regression::NotCounted { time_s: 3.0 })),
            Case {
                file: PathBuf::from("other/f.ava"),
                ..case("f", Outcome::Allowed(Regression::NotCounted { time_s: 3.0 }))
            },
            case("g", Outcome::Gone("step 3 is not legal any more".to_owned())),
            case(
                "e <&> \"\u{1}\"",
                Outcome::NotPlayed { reason: "cannot read `x` & \"y\"\nat all".to_owned(), in_source: false },
            ),
        ];
        let text = junit("runs/<1>", &cases);
        let document = roxmltree::Document::parse(&text).expect(&text);
        let suite = document.root_element().first_element_child().unwrap();
        let counts = ["tests", "failures", "errors", "skipped"].map(|name| suite.attribute(name).unwrap());
        assert_eq!(counts, ["9", "4", "1", "3"]);
        assert_eq!(suite.attribute("name"), Some("runs/<1>"));
        let cases = suite.children().filter(|node| node.has_tag_name("testcase"));
        let names: Vec<&str> = cases.filter_map(|case| case.attribute("name")).collect();
        assert_eq!(names[5..7], ["f (f.ava)", "f (other/f.ava)"]);
        let inside = |name: &str| suite.descendants().filter(|node| node.has_tag_name(name)).count();
        assert_eq!(["testcase", "failure", "error", "skipped"].map(inside), [9, 4, 1, 3]);
    }
}
