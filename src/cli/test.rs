//! `avastra test`: emitted scenarios as a regression suite for a driving system.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::action::ActionTable;
use crate::ads::external::{Failure as AdsFailure, FailureKind};
use crate::check::{Loaded, normal};
use crate::files;
use crate::model::{Claim, Scenario, code};
use crate::oracle;
use crate::oracle::Regression;
use crate::run;
use crate::run::{Asked, RunError, Stage};
use crate::syntax::ast::FileId;
use crate::syntax::{Diagnostic, apply_fixes};

use super::arguments::TestArguments;
use super::error::Failure;
use super::files::{write, write_answers, write_named};
use super::findings::{doubts, spot_check};
use super::load;
use super::load::Emitted;
use super::output::Output;
use super::output::plural;
use super::review::{Change, Review, review};

/// The result for one scenario.
struct Case {
    file: PathBuf,
    scenario: String,
    road: String,
    outcome: Outcome,
    elapsed_s: f64,
}

enum Outcome {
    Played(Regression),
    /// Another crash than the scenario's, which `--allow-changed` lets pass.
    Allowed(Regression),
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
    let asked = load::against(&arguments.against)?;
    if let Some(name) = &arguments.against.ads {
        run::driving_system(name)?;
    }
    let mut suite =
        Suite { output, arguments, asked, outdated: Vec::new(), reviewed: Vec::new(), accepted: 0 };
    let mut cases = Vec::new();
    for file in suite_files(&arguments.paths)? {
        let Some(case) = suite.play(&file)? else { continue };
        let (word, reason) = case.outcome.in_words();
        let reason = if reason.is_empty() { String::new() } else { format!(": {reason}") };
        output.tell(&format!("{word:<12}{}{reason}", case.file.display()));
        cases.push(case);
    }
    let named: Vec<String> = arguments.paths.iter().map(|path| path.display().to_string()).collect();
    let named = named.join(" ");
    if cases.is_empty() {
        return Err(Failure::usage(format!("no scenario in `{named}`")));
    }
    suite.tell_outdated();
    if let Some(path) = &arguments.junit {
        // A folder that is misspelt is not made.
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        if folder.is_some_and(|folder| !folder.is_dir()) {
            return Err(Failure::file("write", path, "its folder does not exist"));
        }
        write_named(path, &junit(&named, &cases))?;
    }
    let count = |is: &dyn Fn(&Outcome) -> bool| cases.iter().filter(|case| is(&case.outcome)).count();
    let fails = count(&|outcome| {
        matches!(outcome, Outcome::Played(Regression::StillFails { .. } | Regression::FailsAgain(_)))
    });
    let fixed = count(&|outcome| matches!(outcome, Outcome::Played(Regression::Fixed)));
    let changed = count(&Outcome::is_changed);
    let ads_failed = count(&|outcome| matches!(outcome, Outcome::Played(Regression::AdsFailed(_))));
    let errors = count(&|outcome| matches!(outcome, Outcome::NotPlayed { .. }));
    let in_source = count(&|outcome| matches!(outcome, Outcome::NotPlayed { in_source: true, .. }));
    if arguments.accept {
        output.say(&format!("{} written anew", plural(suite.accepted, "scenario")));
    }
    output.say(&format!(
        "{}: {fails} still fail, {fixed} fixed, {changed} changed, {errors} not played",
        plural(cases.len(), "scenario")
    ));
    let driven = cases.iter().filter(|case| {
        matches!(&case.outcome, Outcome::Played(found) | Outcome::Allowed(found)
            if !matches!(found, Regression::AdsFailed(_) | Regression::FailsAgain(_)))
    });
    spot_check(suite.asked.external.as_ref(), driven.map(|case| case.file.as_path()));
    let doubts = doubts(suite.asked.external.as_ref());
    doubts.iter().for_each(|doubt| output.warn(doubt));
    if ads_failed > 0 {
        output.say(&format!("in {ads_failed} more the driving system itself failed"));
    }
    let listed: Vec<serde_json::Value> = cases
        .iter()
        .map(|case| {
            let (outcome, reason) = case.outcome.in_words();
            serde_json::json!({ "file": case.file, "scenario": case.scenario,
                                "outcome": outcome, "reason": reason })
        })
        .collect();
    output.result(
        serde_json::json!({ "still_fails": fails, "fixed": fixed, "changed": changed, "errors": errors, "ads_failed": ads_failed, "reproducible": doubts.is_empty(),
                                      "accepted": suite.accepted, "reviewed": suite.reviewed, "scenarios": listed }),
    );
    let failing = count(&Outcome::is_failure);
    if errors > 0 {
        return Err(Failure::NotPlayed { scenarios: errors, in_source: in_source > 0 });
    }
    if failing > 0 { Err(Failure::Failing { scenarios: failing }) } else { Ok(()) }
}

/// The files of a suite, each once: files as named, those of directories, and those that a run found.
fn suite_files(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut files: Vec<PathBuf> = Vec::new();
    for path in paths {
        let of_run = ["critical", "failures"].map(|folder| path.join(folder));
        // What is accepted is written there.
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
    output: &'a Output,
    arguments: &'a TestArguments,
    asked: Asked,
    /// Scenarios that use a space which means something else now.
    outdated: Vec<Loaded>,
    /// What differs in meaning, of each scenario that was reviewed.
    reviewed: Vec<serde_json::Value>,
    /// Number of scenarios that `--accept` wrote anew.
    accepted: usize,
}

impl Suite<'_> {
    /// Plays one file; `None` if it holds no scenario.
    fn play(&mut self, file: &Path) -> Result<Option<Case>, Failure> {
        #[allow(clippy::disallowed_methods, reason = "this is cli, and the time goes nowhere but the report")]
        let started = Instant::now();
        let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let (scenario, road, outcome) = match self.open(file) {
            Ok((Emitted::Policy(..), _)) => return Ok(None),
            Ok((Emitted::Scenario(table, scenario), reviewed)) => {
                let road = table.space().roads[scenario.road].name.clone();
                let not_played =
                    |error: RunError| Outcome::NotPlayed { reason: error.to_string(), in_source: false };
                let compared = || self.compare(&table, &scenario).unwrap_or_else(not_played);
                let outcome = reviewed.unwrap_or_else(compared);
                (scenario.name, road, outcome)
            }
            Err(failure) => {
                let in_source = matches!(failure, Failure::Source { .. } | Failure::Outdated);
                (name, String::new(), Outcome::NotPlayed { reason: failure.to_string(), in_source })
            }
        };
        let elapsed_s = started.elapsed().as_secs_f64();
        Ok(Some(Case { file: file.to_owned(), scenario, road, outcome, elapsed_s }))
    }

    /// Reads a file. One whose space has changed is noted, or reviewed; then it may be known already what comes of it.
    fn open(&mut self, file: &Path) -> Result<(Emitted, Option<Outcome>), Failure> {
        let loaded = load::read_and_check(file)?;
        if self.arguments.accept || self.arguments.review {
            return self.review(file, &loaded);
        }
        if !is_outdated(&loaded) {
            return Ok((load::emitted_in(self.output, file, loaded)?, None));
        }
        self.outdated.push(loaded);
        Err(Failure::Outdated)
    }

    /// Plays a scenario as things are now, says what differs in meaning, and takes it over if asked. What is gone or cannot
    /// be played stays as it is.
    fn review(&mut self, file: &Path, loaded: &Loaded) -> Result<(Emitted, Option<Outcome>), Failure> {
        let root = FileId::default();
        let (before, mut spaces) = (loaded.sources.text(root), Vec::new());
        let text = match is_outdated(loaded) {
            false => before.to_owned(),
            true => {
                spaces.push(meaning_text(loaded));
                apply_fixes(root, before, &loaded.diagnostics).0
            }
        };
        let mut checked = load::check_text(file, &text)?;
        for mistake in checked.diagnostics.iter_mut().filter(|_| !spaces.is_empty()) {
            mistake.notes.push("the space has changed since the scenario was written".to_owned());
        }
        let emitted = load::emitted_in(self.output, file, checked)?;
        let Emitted::Scenario(table, scenario) = &emitted else { return Ok((emitted, None)) };
        let Review { change, mut differences, illegal, now } = review(table, scenario, &self.asked, &text)?;
        differences.splice(0..0, spaces);
        self.output.say(&format!("{}: {}", file.display(), change.in_words()));
        differences.iter().for_each(|difference| self.output.say(&format!("    {difference}")));
        self.reviewed.push(serde_json::json!({
            "file": file, "scenario": scenario.name, "change": change.in_words(), "differences": differences,
        }));
        let Some((text, log)) = now else {
            let why = illegal.unwrap_or_else(|| "no collision of it counts any more".to_owned());
            let gone = Outcome::Gone(format!("{why}; it is kept as it was"));
            return Ok((emitted, (change == Change::Gone).then_some(gone)));
        };
        // What would be claimed of the other crash is not what the file claims until it is taken over.
        if change == Change::OtherObstacle && !self.arguments.accept {
            let other = self.asked.is_nothing().then(|| self.outcome(Regression::OtherCrash));
            return Ok((emitted, other));
        }
        if text == before {
            return Ok((emitted, None));
        }
        let emitted = load::emitted_in(self.output, file, load::check_text(file, &text)?)?;
        if self.arguments.accept {
            write_answers(file, &log)?;
            write(file, &text)?;
            self.accepted += 1;
        }
        Ok((emitted, None))
    }

    /// One diagnostic for all scenarios of which the same is to be said.
    fn tell_outdated(&self) {
        let mut told: Vec<(&Loaded, &Diagnostic, usize)> = Vec::new();
        for loaded in &self.outdated {
            for diagnostic in &loaded.diagnostics {
                match told.iter_mut().find(|(_, other, _)| other.notes == diagnostic.notes) {
                    Some((_, _, times)) => *times += 1,
                    None => told.push((loaded, diagnostic, 1)),
                }
            }
        }
        for (loaded, diagnostic, times) in told {
            let mut diagnostic = diagnostic.clone();
            if times > 1 {
                let others = plural(times - 1, "other scenario");
                diagnostic = diagnostic.note(format!("the same holds for {others} of the suite"));
            }
            self.output.diagnostics(&loaded.sources, &[diagnostic]);
        }
    }

    /// The crash of a scenario with the driving system that it was found with, and with the one under test.
    fn compare(&self, table: &ActionTable, scenario: &Scenario) -> Result<Outcome, RunError> {
        let recorded = run::recorded(scenario)?;
        let (ads, _) = self.asked.selected_for(scenario)?;
        let stage = Stage::new(table, scenario)?;
        if let Some(kind) = claimed_failure(scenario) {
            let log = stage.play(&ads, &mut |_, _, _| {});
            return Ok(Outcome::Played(match log.failure.as_ref().map(AdsFailure::kind) {
                None => Regression::Fixed,
                Some(found) if found == kind => Regression::FailsAgain(kind),
                Some(found) => Regression::AdsFailed(found),
            }));
        }
        let (log, judgements, first) = stage.first_counted(&recorded);
        if first.is_none() {
            let reason = "it has no counted collision with the driving system that it was found with";
            return Ok(Outcome::NotPlayed { reason: reason.to_owned(), in_source: false });
        }
        let counted = oracle::counted(table.space(), &log, &judgements);
        let is_own = |index: &usize| scenario.crashes_with(log.collisions[*index].contact.obstacle);
        let found = match counted.into_iter().find(is_own) {
            Some(index) => oracle::regression(&stage.setup(&recorded), &log, index, &ads),
            // Already with the driving system that it was found with.
            None => Regression::OtherCrash,
        };
        Ok(self.outcome(found))
    }

    fn outcome(&self, found: Regression) -> Outcome {
        let is_allowed = self.arguments.allow_changed && found.is_other_crash();
        if is_allowed { Outcome::Allowed(found) } else { Outcome::Played(found) }
    }
}

/// What of the space means something else, in words: the first note of the diagnostic, unless that gives the digest alone.
fn meaning_text(loaded: &Loaded) -> String {
    let notes = loaded.diagnostics.iter().filter(|found| found.code == code::DIGEST);
    let notes: Vec<String> = notes.filter_map(|found| found.notes.split_last()?.1.first().cloned()).collect();
    let what = if notes.is_empty() { String::new() } else { format!(": {}", notes.join("; ")) };
    format!("the space means something else by now{what}")
}

/// How an external driving system fails at the end of a scenario, if the scenario claims so.
fn claimed_failure(scenario: &Scenario) -> Option<FailureKind> {
    let end = scenario.claims.iter().find_map(|claim| match claim {
        Claim::End(end) => Some(end),
        _ => None,
    })?;
    FailureKind::ALL.into_iter().find(|kind| kind.name() == end)
}

/// Whether the only mistakes of a scenario are digests, which it may accept.
fn is_outdated(loaded: &Loaded) -> bool {
    let mut errors = loaded.diagnostics.iter().filter(|found| found.is_error()).peekable();
    errors.peek().is_some() && errors.all(|found| found.code == code::DIGEST && !found.fixes.is_empty())
}

impl Outcome {
    /// Whether the driving system still crashes, or is itself what fails.
    fn is_failure(&self) -> bool {
        match self {
            Outcome::Played(
                Regression::StillFails { .. } | Regression::AdsFailed(_) | Regression::FailsAgain(_),
            ) => true,
            Outcome::Played(found) => found.is_other_crash(),
            Outcome::Allowed(_) | Outcome::Gone(_) | Outcome::NotPlayed { .. } => false,
        }
    }

    /// It says nothing about the driving system, or nothing that counts.
    fn is_skipped(&self) -> bool {
        matches!(self, Outcome::Played(Regression::NeverMet) | Outcome::Allowed(_) | Outcome::Gone(_))
    }

    fn is_changed(&self) -> bool {
        self.is_skipped() || matches!(self, Outcome::Played(found) if found.is_other_crash())
    }

    /// One of six words, and why.
    fn in_words(&self) -> (&'static str, String) {
        let (found, more) = match self {
            Outcome::Played(found) => (found, ""),
            Outcome::Allowed(found) => (found, ", which is allowed"),
            Outcome::Gone(reason) => return ("gone", reason.clone()),
            Outcome::NotPlayed { reason, .. } => return ("error", reason.clone()),
        };
        match found {
            Regression::StillFails { time_s } => {
                ("still fails", format!("the same obstacle is hit at {time_s:.2} s"))
            }
            Regression::FailsAgain(kind) => ("still fails", format!("{} again", kind.name())),
            Regression::Fixed => ("fixed", String::new()),
            Regression::OtherCrash => ("changed", format!("another obstacle is hit{more}")),
            Regression::Struck => ("changed", format!("the same obstacle runs into the ego vehicle{more}")),
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
    let count = |is: fn(&Outcome) -> bool| cases.iter().filter(|case| is(&case.outcome)).count();
    let counts = format!(
        "tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"{}\" time=\"{:.3}\"",
        cases.len(),
        count(Outcome::is_failure),
        count(|outcome| matches!(outcome, Outcome::NotPlayed { .. })),
        count(Outcome::is_skipped),
        cases.iter().map(|case| case.elapsed_s).sum::<f64>()
    );
    let name = escaped(suite);
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"avastra\" {counts}>\n  \
         <testsuite name=\"{name}\" {counts}>\n"
    );
    for case in cases {
        let (word, reason) = case.outcome.in_words();
        let reason = escaped(&reason);
        let element = match &case.outcome {
            Outcome::NotPlayed { .. } => Some("error"),
            outcome if outcome.is_failure() => Some("failure"),
            outcome if outcome.is_skipped() => Some("skipped"),
            Outcome::Played(_) | Outcome::Allowed(_) | Outcome::Gone(_) => None,
        };
        let inside = element.map_or_else(String::new, |element| {
            format!("\n      <{element} type=\"{word}\" message=\"{reason}\"/>\n    ")
        });
        let is_alone = cases.iter().filter(|other| other.scenario == case.scenario).count() == 1;
        let name = if is_alone {
            case.scenario.clone()
        } else {
            format!("{} ({})", case.scenario, case.file.display())
        };
        writeln!(
            text,
            "    <testcase classname=\"{}\" name=\"{}\" time=\"{:.3}\">{inside}</testcase>",
            escaped(&case.road),
            escaped(&name),
            case.elapsed_s
        )
        .expect("a string takes everything");
    }
    text.push_str("  </testsuite>\n</testsuites>\n");
    text
}

/// Text as it may stand in an XML attribute; what XML cannot hold at all becomes U+FFFD.
fn escaped(text: &str) -> String {
    let mut escaped = String::new();
    for letter in text.chars() {
        match letter {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\n' | '\t' | '\r' => escaped.push(' '),
            letter if letter.is_control() || matches!(letter, '\u{fffe}' | '\u{ffff}') => {
                escaped.push('\u{fffd}');
            }
            letter => escaped.push(letter),
        }
    }
    escaped
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
            elapsed_s: 0.25,
        };
        let cases = [
            case("a", Outcome::Played(Regression::StillFails { time_s: 14.221 })),
            case("b", Outcome::Played(Regression::Fixed)),
            case("c", Outcome::Played(Regression::OtherCrash)),
            case("d", Outcome::Played(Regression::NeverMet)),
            case("f", Outcome::Played(Regression::Struck)),
            Case { file: PathBuf::from("other/f.ava"), ..case("f", Outcome::Allowed(Regression::Struck)) },
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
        assert_eq!(counts, ["8", "3", "1", "3"]);
        assert_eq!(suite.attribute("name"), Some("runs/<1>"));
        let cases = suite.children().filter(|node| node.has_tag_name("testcase"));
        let names: Vec<&str> = cases.filter_map(|case| case.attribute("name")).collect();
        assert_eq!(names[4..6], ["f (f.ava)", "f (other/f.ava)"]);
        let inside = |name: &str| suite.descendants().filter(|node| node.has_tag_name(name)).count();
        assert_eq!(["testcase", "failure", "error", "skipped"].map(inside), [8, 3, 1, 3]);
    }
}
