//! `avastra test`: emitted scenarios as a regression suite for a driving system.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::ads::ModularConfig;
use crate::oracle;
use crate::oracle::Regression;
use crate::run;
use crate::run::Stage;

use super::arguments::TestArguments;
use super::error::Failure;
use super::load;
use super::load::Emitted;
use super::output::Output;
use super::progress::plural;
use super::replay::driver;
use super::run_directory::write;

/// The result for one scenario.
struct Case {
    file: PathBuf,
    scenario: String,
    road: String,
    /// The outcome, or why the scenario could not be played.
    outcome: Result<Regression, String>,
    elapsed_s: f64,
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
        let (word, reason) = in_words(&case.outcome);
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
    let count = |wanted: &str| cases.iter().filter(|case| in_words(&case.outcome).0 == wanted).count();
    let [fails, fixed, changed, errors] = ["still fails", "fixed", "changed", "error"].map(count);
    output.say(&format!(
        "{}: {fails} still fail, {fixed} fixed, {changed} changed, {errors} not played",
        plural(cases.len(), "scenario")
    ));
    let listed: Vec<serde_json::Value> = cases
        .iter()
        .map(|case| {
            let (outcome, reason) = in_words(&case.outcome);
            serde_json::json!({ "file": case.file, "scenario": case.scenario,
                                "outcome": outcome, "reason": reason })
        })
        .collect();
    output.result(
        "test",
        serde_json::json!({ "still_fails": fails, "fixed": fixed, "changed": changed,
                            "errors": errors, "scenarios": listed }),
    );
    let failing =
        cases.iter().filter(|case| matches!(&case.outcome, Ok(found) if found.is_failure())).count();
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
    let mut case = Case {
        file: file.to_owned(),
        scenario: file.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        road: String::new(),
        outcome: Err(String::new()),
        elapsed_s: 0.0,
    };
    match load::emitted(output, file) {
        Ok(Emitted::Policy(..)) => return Ok(None),
        Ok(Emitted::Scenario) => case.outcome = compare(output, arguments, profile, file, &mut case),
        Err(failure) => case.outcome = Err(failure.to_string()),
    }
    case.elapsed_s = started.elapsed().as_secs_f64();
    Ok(Some(case))
}

/// The crash of a scenario with the driving system that it was found with, and with the one under test.
fn compare(
    output: &Output,
    arguments: &TestArguments,
    profile: Option<&ModularConfig>,
    file: &Path,
    case: &mut Case,
) -> Result<Regression, String> {
    let (table, scenario) = load::scenario(output, file).map_err(|failure| failure.to_string())?;
    case.scenario.clone_from(&scenario.name);
    case.road.clone_from(&table.space().roads[scenario.road].name);
    let recorded = run::recorded(&scenario).map_err(|error| error.to_string())?;
    let (ads, _) = driver(arguments.ads.as_deref(), profile, &scenario).map_err(|error| error.to_string())?;
    let stage = Stage::new(&table, &scenario).map_err(|error| error.to_string())?;
    let log = stage.play(&recorded, &mut |_, _, _| {});
    let judgements = stage.judge(&recorded, &log);
    let counted = oracle::counted(table.space(), &log, &judgements);
    let Some(&index) = counted.first() else {
        return Err("it has no counted collision with the driving system that it was found with".to_owned());
    };
    Ok(oracle::regression(&stage.setup(&recorded), &log, index, &ads))
}

/// The outcome in one of four words, and why.
fn in_words(outcome: &Result<Regression, String>) -> (&'static str, String) {
    match outcome {
        Ok(Regression::StillFails { time_s }) => {
            ("still fails", format!("the same obstacle is hit at {time_s:.2} s"))
        }
        Ok(Regression::Fixed) => ("fixed", String::new()),
        Ok(Regression::OtherCrash) => ("changed", "another obstacle is hit".to_owned()),
        Ok(Regression::Struck) => ("changed", "the same obstacle runs into the ego vehicle".to_owned()),
        Ok(Regression::NeverMet) => ("changed", "the obstacle never appears".to_owned()),
        Err(reason) => ("error", reason.clone()),
    }
}

/// The results as JUnit XML, by the schema of Jenkins' xUnit plugin.
fn junit(directory: &Path, cases: &[Case]) -> String {
    let is_failure = |case: &&Case| matches!(&case.outcome, Ok(found) if found.is_failure());
    let is_skipped = |case: &&Case| matches!(&case.outcome, Ok(Regression::NeverMet | Regression::Struck));
    let counts = format!(
        "tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"{}\" time=\"{:.3}\"",
        cases.len(),
        cases.iter().filter(is_failure).count(),
        cases.iter().filter(|case| case.outcome.is_err()).count(),
        cases.iter().filter(is_skipped).count(),
        cases.iter().map(|case| case.elapsed_s).sum::<f64>()
    );
    let name = escaped(&directory.display().to_string());
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"avastra\" {counts}>\n  \
         <testsuite name=\"{name}\" {counts}>\n"
    );
    for case in cases {
        let (word, reason) = in_words(&case.outcome);
        let reason = escaped(&reason);
        let inside = match &case.outcome {
            Err(_) => format!("\n      <error type=\"{word}\" message=\"{reason}\"/>\n    "),
            Ok(found) if found.is_failure() => {
                format!("\n      <failure type=\"{word}\" message=\"{reason}\"/>\n    ")
            }
            Ok(Regression::NeverMet | Regression::Struck) => {
                format!("\n      <skipped type=\"{word}\" message=\"{reason}\"/>\n    ")
            }
            Ok(_) => String::new(),
        };
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
            case("a", Ok(Regression::StillFails { time_s: 14.221 })),
            case("b", Ok(Regression::Fixed)),
            case("c", Ok(Regression::OtherCrash)),
            case("d", Ok(Regression::NeverMet)),
            case("e <&> \"\u{1}\"", Err("cannot read `x` & \"y\"\nat all".to_owned())),
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
