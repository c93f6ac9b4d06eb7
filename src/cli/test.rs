//! `avastra test`: emitted scenarios as a regression suite for a driving system.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::action::ActionTable;
use crate::ads::ModularConfig;
use crate::model::Scenario;
use crate::oracle;
use crate::oracle::Regression;
use crate::run;
use crate::run::{RunError, Stage};

use super::arguments::TestArguments;
use super::error::Failure;
use super::files::write;
use super::load;
use super::load::Emitted;
use super::output::Output;
use super::output::plural;

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
    /// Why the scenario could not be played.
    NotPlayed(String),
}

/// Plays every scenario of a directory against a driving system.
pub fn test(output: &Output, arguments: &TestArguments) -> Result<(), Failure> {
    let profile = arguments.ads_config.as_deref().map(load::profile).transpose()?;
    if let Some(name) = &arguments.ads {
        run::driving_system(name)?;
    }
    let mut cases = Vec::new();
    let critical = arguments.directory.join("critical");
    let directory = if critical.is_dir() { &critical } else { &arguments.directory };
    for file in load::sources_in(directory)? {
        let Some(case) = play(output, arguments, profile.as_ref(), &file)? else { continue };
        let (word, reason) = case.outcome.in_words();
        let reason = if reason.is_empty() { String::new() } else { format!(": {reason}") };
        output.tell(&format!("{word:<12}{}{reason}", case.file.display()));
        cases.push(case);
    }
    if cases.is_empty() {
        return Err(Failure::usage(format!("no scenario in `{}`", arguments.directory.display())));
    }
    if let Some(path) = &arguments.junit {
        write(path, &junit(&arguments.directory, &cases))?;
    }
    let count = |is: &dyn Fn(&Outcome) -> bool| cases.iter().filter(|case| is(&case.outcome)).count();
    let fails = count(&|outcome| matches!(outcome, Outcome::Played(Regression::StillFails { .. })));
    let fixed = count(&|outcome| matches!(outcome, Outcome::Played(Regression::Fixed)));
    let changed = count(&Outcome::is_changed);
    let errors = count(&|outcome| matches!(outcome, Outcome::NotPlayed(_)));
    output.say(&format!(
        "{}: {fails} still fail, {fixed} fixed, {changed} changed, {errors} not played",
        plural(cases.len(), "scenario")
    ));
    let listed: Vec<serde_json::Value> = cases
        .iter()
        .map(|case| {
            let (outcome, reason) = case.outcome.in_words();
            serde_json::json!({ "file": case.file, "scenario": case.scenario,
                                "outcome": outcome, "reason": reason })
        })
        .collect();
    output.result(
        "test",
        serde_json::json!({ "still_fails": fails, "fixed": fixed, "changed": changed,
                            "errors": errors, "scenarios": listed }),
    );
    let failing = count(&Outcome::is_failure);
    if errors > 0 {
        return Err(Failure::usage(format!("{} could not be played", plural(errors, "scenario"))));
    }
    if failing > 0 { Err(Failure::Failing { scenarios: failing }) } else { Ok(()) }
}

/// Plays one file; `None` if it holds no scenario.
fn play(
    output: &Output,
    arguments: &TestArguments,
    profile: Option<&ModularConfig>,
    file: &Path,
) -> Result<Option<Case>, Failure> {
    #[allow(clippy::disallowed_methods, reason = "this is cli, and the time goes nowhere but the report")]
    let started = Instant::now();
    let (scenario, road, outcome) = match load::emitted(output, file) {
        Ok(Emitted::Policy(..)) => return Ok(None),
        Ok(Emitted::Scenario(table, scenario)) => {
            let road = table.space().roads[scenario.road].name.clone();
            let outcome = compare(arguments, profile, &table, &scenario);
            (scenario.name, road, outcome.unwrap_or_else(|error| Outcome::NotPlayed(error.to_string())))
        }
        Err(failure) => {
            let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            (name, String::new(), Outcome::NotPlayed(failure.to_string()))
        }
    };
    Ok(Some(Case {
        file: file.to_owned(),
        scenario,
        road,
        outcome,
        elapsed_s: started.elapsed().as_secs_f64(),
    }))
}

/// The crash of a scenario with the driving system that it was found with, and with the one under test.
fn compare(
    arguments: &TestArguments,
    profile: Option<&ModularConfig>,
    table: &ActionTable,
    scenario: &Scenario,
) -> Result<Outcome, RunError> {
    let recorded = run::recorded(scenario)?;
    let (ads, _) = run::selected_for(arguments.ads.as_deref(), profile, scenario)?;
    let stage = Stage::new(table, scenario)?;
    let (log, _, first) = stage.first_counted(&recorded);
    Ok(match first {
        Some(index) => Outcome::Played(oracle::regression(&stage.setup(&recorded), &log, index, &ads)),
        None => {
            let reason = "it has no counted collision with the driving system that it was found with";
            Outcome::NotPlayed(reason.to_owned())
        }
    })
}

impl Outcome {
    fn is_failure(&self) -> bool {
        matches!(self, Outcome::Played(found) if found.is_failure())
    }

    /// It says nothing about the driving system.
    fn is_skipped(&self) -> bool {
        matches!(self, Outcome::Played(Regression::NeverMet | Regression::Struck))
    }

    fn is_changed(&self) -> bool {
        matches!(self, Outcome::Played(Regression::OtherCrash)) || self.is_skipped()
    }

    /// One of four words, and why.
    fn in_words(&self) -> (&'static str, String) {
        match self {
            Outcome::Played(Regression::StillFails { time_s }) => {
                ("still fails", format!("the same obstacle is hit at {time_s:.2} s"))
            }
            Outcome::Played(Regression::Fixed) => ("fixed", String::new()),
            Outcome::Played(Regression::OtherCrash) => ("changed", "another obstacle is hit".to_owned()),
            Outcome::Played(Regression::Struck) => {
                ("changed", "the same obstacle runs into the ego vehicle".to_owned())
            }
            Outcome::Played(Regression::NeverMet) => ("changed", "the obstacle never appears".to_owned()),
            Outcome::NotPlayed(reason) => ("error", reason.clone()),
        }
    }
}

/// The results as JUnit XML, by the schema of Jenkins' xUnit plugin.
fn junit(directory: &Path, cases: &[Case]) -> String {
    let count = |is: fn(&Outcome) -> bool| cases.iter().filter(|case| is(&case.outcome)).count();
    let counts = format!(
        "tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"{}\" time=\"{:.3}\"",
        cases.len(),
        count(Outcome::is_failure),
        count(|outcome| matches!(outcome, Outcome::NotPlayed(_))),
        count(Outcome::is_skipped),
        cases.iter().map(|case| case.elapsed_s).sum::<f64>()
    );
    let name = escaped(&directory.display().to_string());
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"avastra\" {counts}>\n  \
         <testsuite name=\"{name}\" {counts}>\n"
    );
    for case in cases {
        let (word, reason) = case.outcome.in_words();
        let reason = escaped(&reason);
        let element = match &case.outcome {
            Outcome::NotPlayed(_) => Some("error"),
            outcome if outcome.is_failure() => Some("failure"),
            outcome if outcome.is_skipped() => Some("skipped"),
            Outcome::Played(_) => None,
        };
        let inside = element.map_or_else(String::new, |element| {
            format!("\n      <{element} type=\"{word}\" message=\"{reason}\"/>\n    ")
        });
        writeln!(
            text,
            "    <testcase classname=\"{}\" name=\"{}\" time=\"{:.3}\">{inside}</testcase>",
            escaped(&case.road),
            escaped(&case.scenario),
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
            file: PathBuf::from("a.ava"),
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
            case("e <&> \"\u{1}\"", Outcome::NotPlayed("cannot read `x` & \"y\"\nat all".to_owned())),
        ];
        let text = junit(Path::new("runs/<1>"), &cases);
        let document = roxmltree::Document::parse(&text).expect(&text);
        let suite = document.root_element().first_element_child().unwrap();
        let counts = ["tests", "failures", "errors", "skipped"].map(|name| suite.attribute(name).unwrap());
        assert_eq!(counts, ["5", "2", "1", "1"]);
        assert_eq!(suite.attribute("name"), Some("runs/<1>"));
        let inside = |name: &str| suite.descendants().filter(|node| node.has_tag_name(name)).count();
        assert_eq!(["testcase", "failure", "error", "skipped"].map(inside), [5, 2, 1, 1]);
    }
}
