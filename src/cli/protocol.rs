//! The table of a protocol run: each row, with its values and how it ended, in words, as CSV and as JUnit XML.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use avastra_base::outside::{in_csv, in_markup};
use avastra_campaign::run::{Ending, ProtocolTest, Tally};

use super::error::Failure;
use super::files::write;

/// Tests that are listed one by one.
const LISTED_MAX: usize = 24;

/// The names of the files in a run directory.
const CSV: &str = "protocol.csv";
const JUNIT: &str = "protocol.xml";

/// Writes the table in both forms; where they are.
pub fn write_both(directory: &Path, space: &Path, tests: &[ProtocolTest]) -> Result<[PathBuf; 2], Failure> {
    let [table, cases] = [CSV, JUNIT].map(|name| directory.join(name));
    write(&table, &csv(tests))?;
    write(&cases, &junit(&space.file_stem().unwrap_or_default().to_string_lossy(), tests))?;
    Ok([table, cases])
}

/// How the tests ended: `167 avoided, 3 mitigated`.
pub fn counts_text(tests: &[ProtocolTest]) -> String {
    let tally = Tally::of(tests);
    let mut counts: Vec<String> = Ending::ALL
        .iter()
        .zip(tally.endings)
        .filter(|(_, count)| *count > 0)
        .map(|(ending, count)| format!("{count} {}", ending.in_words()))
        .collect();
    let not_played = tests.iter().filter(|test| test.ending.is_none()).count();
    if not_played > 0 {
        counts.push(format!("{not_played} without an action"));
    }
    if tally.breached > 0 {
        counts.push(format!("{} with a breach", tally.breached));
    }
    counts.join(", ")
}

/// The counts, and the tests if they are few; otherwise those that failed, as far as there is room.
pub fn in_words(tests: &[ProtocolTest]) -> String {
    let mut text = format!("\nprotocol: {}", counts_text(tests));
    let shown: Vec<&ProtocolTest> = match tests.len() <= LISTED_MAX {
        true => tests.iter().collect(),
        false => tests.iter().filter(|test| test.is_failed() || test.ending.is_none()).collect(),
    };
    for test in shown.iter().take(LISTED_MAX) {
        let _ = write!(text, "\n  {} on {}: {}", test.label(), test.road, ended(test));
    }
    if shown.len() > LISTED_MAX {
        let _ = write!(text, "\n  … and {} more", shown.len() - LISTED_MAX);
    }
    text
}

/// How a test ended, with its figures.
fn ended(test: &ProtocolTest) -> String {
    let kmh = |mps: f64| format!("{:.1} km/h", mps * 3.6);
    let Some(ending) = test.ending else {
        return test.refused.as_ref().map_or("nothing happened".to_owned(), |why| format!("refused: {why}"));
    };
    let mut text = ending.in_words().to_owned();
    // An ego vehicle that stands is still hit at the speed of the other.
    if let Some(relative) = test.relative_mps {
        let _ = write!(text, " at {} against each other", kmh(relative));
    }
    if let (Some(impact), Some(lost)) = (test.impact_mps, test.reduction_mps()) {
        let _ = write!(text, ", the ego vehicle at {}, {} less than before", kmh(impact), kmh(lost));
    }
    if let Some(precrash) = &test.precrash {
        let _ = write!(text, ": {precrash}");
    }
    if !test.breached.is_empty() {
        let _ = write!(text, "; breached: {}", test.breached.join(", "));
    }
    if test.others_crashed && ending != Ending::OthersCrashed {
        text.push_str("; other road users crashed into each other");
    }
    text
}

/// One line for each test: road, action, values, and what came of it. Parameters that an action lacks are empty.
fn csv(tests: &[ProtocolTest]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for (name, _) in tests.iter().flat_map(|test| &test.values) {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    let mut text = format!(
        "episode,road,action,{}ending,before_kmh,impact_kmh,reduction_kmh,relative_kmh,precrash,ttc_s,counted,breached,refused,others_crashed\n",
        names.iter().map(|name| format!("{name},")).collect::<String>()
    );
    let figure = |value: Option<f64>, factor: f64| {
        value.map_or(String::new(), |value| format!("{:.3}", value * factor))
    };
    for test in tests {
        let value = |name: &&str| {
            let found = test.values.iter().find(|(known, _)| known == name);
            format!("{},", in_csv(found.map_or("", |(_, value)| value)))
        };
        let _ = writeln!(
            text,
            "{},{},{},{}{},{},{},{},{},{},{},{},{},{},{}",
            test.episode,
            test.road,
            test.action.as_deref().unwrap_or_default(),
            names.iter().map(value).collect::<String>(),
            test.ending.map_or("", Ending::in_words),
            figure(test.before_mps, 3.6),
            figure(test.impact_mps, 3.6),
            figure(test.reduction_mps(), 3.6),
            figure(test.relative_mps, 3.6),
            in_csv(test.precrash.as_deref().unwrap_or_default()),
            figure(test.ttc_s, 1.0),
            test.counted,
            test.breached.join(" "),
            in_csv(test.refused.as_deref().unwrap_or_default()),
            test.others_crashed,
        );
    }
    text
}

/// The tests as JUnit XML. A contact or a breach is a failure, and a driving system that failed is an error. An action that
/// did not happen is skipped. A test whose road users crashed into each other before it could show anything is skipped, too.
fn junit(suite: &str, tests: &[ProtocolTest]) -> String {
    let is_error = |test: &&ProtocolTest| test.ending == Some(Ending::Failed) && test.breached.is_empty();
    let errors = tests.iter().filter(is_error).count();
    let failed = tests.iter().filter(|test| test.is_failed()).count() - errors;
    let is_skipped = |test: &ProtocolTest| {
        !test.is_failed() && test.ending.is_none_or(|ending| ending == Ending::OthersCrashed)
    };
    let skipped = tests.iter().filter(|test| is_skipped(test)).count();
    let counts =
        format!("tests=\"{}\" failures=\"{failed}\" errors=\"{errors}\" skipped=\"{skipped}\"", tests.len());
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"avastra\" {counts}>\n  <testsuite name=\"{}\" {counts}>\n",
        in_markup(suite)
    );
    let mut seen: BTreeMap<(&str, String), usize> = BTreeMap::new();
    for test in tests {
        let element = match test {
            _ if is_skipped(test) => Some("skipped"),
            _ if is_error(&test) => Some("error"),
            _ if test.is_failed() => Some("failure"),
            _ => None,
        };
        let inside = element.map_or_else(String::new, |element| {
            format!("\n      <{element} message=\"{}\"/>\n    ", in_markup(&ended(test)))
        });
        // Repetitions of a row on its road are told apart by their order.
        let label = test.label();
        let nth = seen.entry((test.road.as_str(), label.clone())).or_insert(0);
        *nth += 1;
        let name = if *nth == 1 { label } else { format!("{label} [{nth}]") };
        let name = in_markup(&name);
        let _ = writeln!(
            text,
            "    <testcase classname=\"{}\" name=\"{name}\">{inside}</testcase>",
            in_markup(&test.road)
        );
    }
    text + "  </testsuite>\n</testsuites>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_test_is_a_line_of_each_table() {
        let test = ProtocolTest {
            episode: 3,
            road: "at_30".to_owned(),
            action: Some("begin".to_owned()),
            values: vec![("speed".to_owned(), "30".to_owned()), ("of".to_owned(), "a, b".to_owned())],
            ending: Some(Ending::Mitigated),
            before_mps: Some(10.0),
            impact_mps: Some(5.0),
            relative_mps: Some(5.0),
            precrash: Some("24 lead vehicle moving at lower constant speed".to_owned()),
            ttc_s: Some(0.0),
            counted: true,
            breached: vec!["keeps_gap".to_owned()],
            refused: None,
            others_crashed: true,
        };
        let missed = ProtocolTest {
            action: None,
            values: Vec::new(),
            ending: None,
            refused: Some("no room".to_owned()),
            others_crashed: false,
            ..test.clone()
        };
        let wrecked = ProtocolTest {
            ending: Some(Ending::OthersCrashed),
            impact_mps: None,
            breached: Vec::new(),
            ..test.clone()
        };
        let died = ProtocolTest { ending: Some(Ending::Failed), others_crashed: false, ..wrecked.clone() };
        assert!(died.is_failed());
        let cases = junit("runs/1", &[died.clone(), test.clone()]);
        assert!(
            cases.contains("failures=\"1\" errors=\"1\"") && cases.contains("<error message=\"driving"),
            "{cases}"
        );
        assert!(csv(&[died]).contains(",driving system failed,"));
        let tests = [test, missed, wrecked];
        let table = csv(&tests);
        let lines: Vec<&str> = table.lines().collect();
        assert_eq!(lines[0].matches(',').count(), 15);
        assert_eq!(
            lines[1],
            "3,at_30,begin,30,\"a, b\",mitigated,36.000,18.000,18.000,18.000,24 lead vehicle moving at lower constant speed,0.000,true,keeps_gap,,true"
        );
        let cases = junit("runs/<1>", &tests);
        roxmltree::Document::parse(&cases).expect("it is well-formed");
        assert!(cases.contains("failures=\"1\"") && cases.contains("skipped=\"2\""), "{cases}");
        assert!(
            cases.contains("18.0 km/h less than before: 24 lead vehicle moving at lower constant speed; breached: keeps_gap; other road users crashed into each other"),
            "{cases}"
        );
        assert!(in_words(&tests).contains("1 mitigated, 1 others crashed, 1 without an action"));
        // An ego vehicle that stands, and is hit at 70 km/h, is not hit at 0 km/h.
        let [mut stands, ..] = tests;
        (stands.impact_mps, stands.before_mps, stands.relative_mps) =
            (Some(0.0), Some(70.0 / 3.6), Some(70.0 / 3.6));
        assert!(
            ended(&stands).starts_with(
                "mitigated at 70.0 km/h against each other, the ego vehicle at 0.0 km/h, 70.0 km/h less than before"
            ),
            "{}",
            ended(&stands)
        );
    }
}
