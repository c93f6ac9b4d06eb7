//! `diagnose --moment`: from when on a finding was all but certain.

use std::path::Path;

use avastra_base::outside::Shown;
use avastra_campaign::episode::EpisodeLog;
use avastra_campaign::oracle;
use avastra_campaign::oracle::{Branched, Found, NoReturn};
use avastra_campaign::run::Asked;
use avastra_lang::model::Space;

use super::super::arguments::DiagnoseArguments;
use super::super::error::Failure;
use super::super::files::write_again;
use super::super::findings::needs_program;
use super::super::look;
use super::super::output::Output;
use super::super::parallel::each_file;
use super::super::rewritten::with_moments;
use super::{Case, result};

/// With `--moment`, from when on each finding was all but certain.
pub fn moments(output: &Output, arguments: &DiagnoseArguments, asked: &Asked) -> Result<(), Failure> {
    let found = each_file(output, &arguments.many, asked.external.as_ref(), |file| {
        let (table, scenario) = look::unchanged(output, file)?;
        let Case { stage, ads, log, found } = Case::of(&table, &scenario, asked)?;
        if !oracle::can_replay(&ads) {
            return Err(needs_program(&scenario.name, "branch"));
        }
        let risen = oracle::no_return(&stage.setup(&ads), &log, found, oracle::REPLAYS);
        if arguments.write {
            write(file, table.space(), &log, found, &risen)?;
        }
        Ok((file.clone(), scenario.name.clone(), found.noun(), risen))
    })?;
    for (file, _, noun, risen) in &found.done {
        output.say(&format!("{}: {}", file.shown(), moment_text(noun, risen)));
        if found.is_single() {
            let line =
                |at: &Branched| format!("  {:>6.1} s  {:<12} {}", at.time_s, bar(at.share()), at.again);
            output.say(&risen.moments.iter().map(line).collect::<Vec<_>>().join("\n"));
        }
    }
    let scenarios = found.done.iter().map(|(file, scenario, _, risen)| {
        let mut told = serde_json::json!({ "file": file, "scenario": scenario });
        let risen = serde_json::to_value(risen).expect("it is plain data");
        if let (Some(told), Some(risen)) = (told.as_object_mut(), risen.as_object()) {
            told.extend(risen.clone());
        }
        told
    });
    output.result(result(None, scenarios.collect(), found.failed_in_json()));
    found.complete("explained")
}

/// Writes the moments that say most into the scenario's file, in place of those that it has.
fn write(
    file: &Path,
    space: &Space,
    log: &EpisodeLog,
    found: Found,
    risen: &NoReturn,
) -> Result<(), Failure> {
    let (of, with, whom) = match found {
        Found::Collision(index) => {
            let number = log.collisions[index].contact.obstacle;
            (String::new(), format!(" with npc#{number}"), number.to_string())
        }
        Found::Breach(index) => {
            let name = space.requirements[log.breaches[index].requirement].name.clone();
            (format!("{name}."), String::new(), name)
        }
    };
    // A claim is checked in at most twice as many branches as it counts.
    let told = risen.telling().into_iter().filter(|at| at.again.replays > 0 && at.failed <= at.again.replays);
    let claim = |Branched { time_s, again, .. }: &Branched| {
        format!("{of}recurrence == {} / {}{with} at {time_s:.1} s", again.recurred, again.replays)
    };
    let claims: Vec<String> = told.map(claim).collect();
    let text = std::fs::read_to_string(file).map_err(Failure::usage)?;
    let text = with_moments(&text, &whom, &claims).ok_or_else(|| {
        Failure::usage(format!(
            "{} claims nothing of the {}: nothing was written",
            file.shown(),
            found.noun()
        ))
    })?;
    write_again(file, &text)
}

/// When a finding became certain, in words.
fn moment_text(noun: &str, risen: &NoReturn) -> String {
    let percent = |at: &Branched| format!("{:.0} %", 100.0 * at.share());
    let NoReturn { found_s, moments, rises_s, avoidable_until_s } = risen;
    let rise = match (rises_s, risen.ends()) {
        (Some(_), [Some(low), Some(high)]) => format!(
            "until {:.1} s there was the {noun} in {} of the branches, from {:.1} s on in {}",
            low.time_s,
            percent(low),
            high.time_s,
            percent(high)
        ),
        (Some(rises_s), _) => {
            format!("from {rises_s:.1} s on there was the {noun} in more than three quarters of the branches")
        }
        (None, _) if moments.iter().all(Branched::is_likely) => format!(
            "at each moment of the last {:.0} s there was the {noun} in most branches: it was certain before",
            found_s - moments[0].time_s
        ),
        (None, _) if moments.iter().all(|at| at.again.replays == 0) => {
            "the driving system failed in every branch".to_owned()
        }
        (None, _) if moments.iter().any(|at| at.again.replays == 0) => {
            "nothing can be said: at some moments the driving system failed in every branch".to_owned()
        }
        (None, _) => format!("up to the last moment many branches had no {noun}: chance made it"),
    };
    let avoidable = avoidable_until_s.map_or(String::new(), |until_s| {
        format!("; a careful driver who takes over avoids it until {until_s:.1} s")
    });
    let failed: u32 = moments.iter().map(|at| at.failed).sum();
    let failed = match failed {
        0 => String::new(),
        _ => format!("; the driving system failed in {failed} other branches, which say nothing"),
    };
    format!("{noun} at {found_s:.2} s; {rise}{avoidable}{failed}")
}

/// A share as a bar of ten signs.
fn bar(share: f64) -> String {
    let full = (10.0 * share).round() as usize;
    format!("{}{}", "█".repeat(full), "·".repeat(10 - full))
}
