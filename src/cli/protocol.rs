//! The table of a protocol run: each row, with its values and how it ended, in words, as CSV and as JUnit XML.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use avastra_campaign::run::{Ending, Tally, Trial};

use super::error::Failure;
use super::files::write;
use super::test::escaped;

/// Trials that are listed one by one.
const LISTED_MAX: usize = 24;

/// The names of the files in a run directory.
const CSV: &str = "protocol.csv";
const JUNIT: &str = "protocol.xml";

/// Writes the table in both forms; where they are.
pub fn write_both(directory: &Path, trials: &[Trial]) -> Result<[PathBuf; 2], Failure> {
    let [table, cases] = [CSV, JUNIT].map(|name| directory.join(name));
    write(&table, &csv(trials))?;
    write(&cases, &junit(&directory.display().to_string(), trials))?;
    Ok([table, cases])
}

/// The counts, and the trials if they are few; otherwise those that failed, as far as there is room.
pub fn in_words(trials: &[Trial]) -> String {
    let tally = Tally::of(trials);
    let counts: Vec<String> = Ending::ALL
        .iter()
        .zip(tally.endings)
        .filter(|(_, count)| *count > 0)
        .map(|(ending, count)| format!("{count} {}", ending.in_words()))
        .collect();
    let not_played = trials.iter().filter(|trial| trial.ending.is_none()).count();
    let mut text = format!("\nprotocol: {}", counts.join(", "));
    if not_played > 0 {
        let _ = write!(text, ", {not_played} without an action");
    }
    let shown: Vec<&Trial> = match trials.len() <= LISTED_MAX {
        true => trials.iter().collect(),
        false => trials.iter().filter(|trial| trial.is_failed() || trial.ending.is_none()).collect(),
    };
    for trial in shown.iter().take(LISTED_MAX) {
        let _ = write!(text, "\n  {} on {}: {}", trial.label(), trial.road, ended(trial));
    }
    if shown.len() > LISTED_MAX {
        let _ = write!(text, "\n  … and {} more", shown.len() - LISTED_MAX);
    }
    text
}

/// How a trial ended, with its figures.
fn ended(trial: &Trial) -> String {
    let kmh = |mps: f64| format!("{:.1} km/h", mps * 3.6);
    let Some(ending) = trial.ending else {
        return trial.refused.as_ref().map_or("nothing happened".to_owned(), |why| format!("refused: {why}"));
    };
    let mut text = ending.in_words().to_owned();
    if let (Some(impact), Some(lost)) = (trial.impact_mps, trial.reduction_mps()) {
        let _ = write!(text, " at {}, {} less than before", kmh(impact), kmh(lost));
    }
    if !trial.breached.is_empty() {
        let _ = write!(text, "; breached: {}", trial.breached.join(", "));
    }
    text
}

/// One line for each trial: road, action, values, and what came of it. Parameters that an action lacks are empty.
fn csv(trials: &[Trial]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for (name, _) in trials.iter().flat_map(|trial| &trial.values) {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    let mut text = format!(
        "episode,road,action,{}ending,before_kmh,impact_kmh,reduction_kmh,relative_kmh,ttc_s,counted,breached,refused\n",
        names.iter().map(|name| format!("{name},")).collect::<String>()
    );
    let figure = |value: Option<f64>, factor: f64| {
        value.map_or(String::new(), |value| format!("{:.3}", value * factor))
    };
    let quoted = |text: &str| match text.contains([',', '"', '\n']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_owned(),
    };
    for trial in trials {
        let value = |name: &&str| {
            let found = trial.values.iter().find(|(known, _)| known == name);
            format!("{},", found.map_or(String::new(), |(_, value)| quoted(value)))
        };
        let _ = writeln!(
            text,
            "{},{},{},{}{},{},{},{},{},{},{},{},{}",
            trial.episode,
            trial.road,
            trial.action.as_deref().unwrap_or_default(),
            names.iter().map(value).collect::<String>(),
            trial.ending.map_or("", Ending::in_words),
            figure(trial.before_mps, 3.6),
            figure(trial.impact_mps, 3.6),
            figure(trial.reduction_mps(), 3.6),
            figure(trial.relative_mps, 3.6),
            figure(trial.ttc_s, 1.0),
            trial.counted,
            trial.breached.join(" "),
            quoted(trial.refused.as_deref().unwrap_or_default()),
        );
    }
    text
}

/// The trials as JUnit XML: a contact or a breach is a failure, an action that did not happen is skipped.
fn junit(suite: &str, trials: &[Trial]) -> String {
    let failed = trials.iter().filter(|trial| trial.is_failed()).count();
    let skipped = trials.iter().filter(|trial| trial.ending.is_none()).count();
    let counts =
        format!("tests=\"{}\" failures=\"{failed}\" errors=\"0\" skipped=\"{skipped}\"", trials.len());
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"avastra\" {counts}>\n  <testsuite name=\"{}\" {counts}>\n",
        escaped(suite)
    );
    for trial in trials {
        let element = match trial.ending {
            None => Some("skipped"),
            Some(_) if trial.is_failed() => Some("failure"),
            Some(_) => None,
        };
        let inside = element.map_or_else(String::new, |element| {
            format!("\n      <{element} message=\"{}\"/>\n    ", escaped(&ended(trial)))
        });
        let name = escaped(&format!("{} [episode {}]", trial.label(), trial.episode));
        let _ = writeln!(
            text,
            "    <testcase classname=\"{}\" name=\"{name}\">{inside}</testcase>",
            escaped(&trial.road)
        );
    }
    text + "  </testsuite>\n</testsuites>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trial_is_a_line_of_each_table() {
        let trial = Trial {
            episode: 3,
            road: "at_30".to_owned(),
            action: Some("begin".to_owned()),
            values: vec![("speed".to_owned(), "30".to_owned()), ("of".to_owned(), "a, b".to_owned())],
            ending: Some(Ending::Mitigated),
            before_mps: Some(10.0),
            impact_mps: Some(5.0),
            relative_mps: Some(5.0),
            ttc_s: Some(0.0),
            counted: true,
            breached: vec!["keeps_gap".to_owned()],
            refused: None,
        };
        let missed = Trial {
            action: None,
            values: Vec::new(),
            ending: None,
            refused: Some("no room".to_owned()),
            ..trial.clone()
        };
        let trials = [trial, missed];
        let table = csv(&trials);
        let lines: Vec<&str> = table.lines().collect();
        assert_eq!(lines[0].matches(',').count(), 13);
        assert_eq!(
            lines[1],
            "3,at_30,begin,30,\"a, b\",mitigated,36.000,18.000,18.000,18.000,0.000,true,keeps_gap,"
        );
        let cases = junit("runs/<1>", &trials);
        roxmltree::Document::parse(&cases).expect("it is well-formed");
        assert!(cases.contains("failures=\"1\"") && cases.contains("skipped=\"1\""), "{cases}");
        assert!(
            cases.contains("mitigated at 18.0 km/h, 18.0 km/h less than before; breached: keeps_gap"),
            "{cases}"
        );
        assert!(in_words(&trials).contains("1 mitigated, 1 without an action"));
    }
}
