//! `diagnose --moment`: from when on a finding was all but certain.

use std::path::{Path, PathBuf};

use avastra_base::outside::Shown;
use avastra_campaign::episode::EpisodeLog;
use avastra_campaign::oracle;
use avastra_campaign::oracle::{Branched, Found, NoReturn};
use avastra_campaign::run::Asked;
use avastra_lang::model::{Scenario, Space};

use super::super::arguments::DiagnoseArguments;
use super::super::error::Failure;
use super::super::files::write_again;
use super::super::findings::needs_program;
use super::super::load::read;
use super::super::look;
use super::super::output::{Output, plural};
use super::super::parallel::each_file;
use super::super::rewritten::with_moments;
use super::{Case, result};

/// With `--moment`, from when on each finding was all but certain.
pub fn moments(output: &Output, arguments: &DiagnoseArguments, asked: &Asked) -> Result<(), Failure> {
    let found = each_file(output, &arguments.many, asked.external.as_ref(), |file| {
        let (table, scenario) = look::unchanged(output, file)?;
        let Case { stage, ads, is_recorded, log, found } = Case::of(&table, &scenario, asked)?;
        if !oracle::can_replay(&ads) {
            return Err(needs_program(&scenario.name, "branch"));
        }
        if arguments.write {
            may_be_written(&scenario, is_recorded)?;
        }
        let risen = oracle::no_return(&stage.setup(&ads), &log, found, oracle::REPLAYS);
        let written = if arguments.write { write(file, table.space(), &log, found, &risen)? } else { 0 };
        Ok(Moments {
            file: file.clone(),
            scenario: scenario.name.clone(),
            name: in_words(table.space(), &log, found),
            noun: found.noun(),
            risen,
            written,
        })
    })?;
    for Moments { file, name, noun, risen, written, .. } in &found.done {
        let written = match written {
            _ if !arguments.write => String::new(),
            0 => "; nothing written, because the driving system failed in most branches".to_owned(),
            _ => format!("; {} written", plural(*written, "moment")),
        };
        output.say(&format!("{}: {}{written}", file.shown(), moment_text(name, noun, risen)));
        if found.is_single() {
            let line =
                |at: &Branched| format!("  {:>6.1} s  {:<12} {}", at.time_s, bar(at.share()), at.again);
            output.say(&risen.moments.iter().map(line).collect::<Vec<_>>().join("\n"));
        }
    }
    let scenarios = found.done.iter().map(|Moments { file, scenario, risen, written, .. }| {
        let written = arguments.write.then_some(written);
        let mut told = serde_json::json!({ "file": file, "scenario": scenario, "written": written });
        let risen = serde_json::to_value(risen).expect("it is plain data");
        if let (Some(told), Some(risen)) = (told.as_object_mut(), risen.as_object()) {
            told.extend(risen.clone());
        }
        told
    });
    output.result(result(None, scenarios.collect(), found.failed_in_json()));
    found.complete("explained")
}

/// The moments of a scenario's finding.
struct Moments {
    file: PathBuf,
    scenario: String,
    /// `crash with npc#1`.
    name: String,
    noun: &'static str,
    risen: NoReturn,
    /// How many were written into the file.
    written: usize,
}

/// Refuses what would make false claims, before any branch is played.
fn may_be_written(scenario: &Scenario, is_recorded: bool) -> Result<(), Failure> {
    let name = &scenario.name;
    match () {
        () if !is_recorded => Err(Failure::usage(format!(
            "`{name}` records another driving system, and its claims are about that: leave `--ads` or `--write` out"
        ))),
        () if scenario.claims.is_empty() => Err(Failure::usage(format!(
            "`{name}` claims nothing: write `expect collision` into it, and the moments go below"
        ))),
        () => Ok(()),
    }
}

/// Writes the moments that say most into the scenario's file, in place of those that it has, and says how many.
fn write(
    file: &Path,
    space: &Space,
    log: &EpisodeLog,
    found: Found,
    risen: &NoReturn,
) -> Result<usize, Failure> {
    let (of, with, whom) = match found {
        Found::Collision(index) => {
            let number = log.collisions[index].contact.obstacle;
            (String::new(), format!(" with npc#{number}"), number.to_string())
        }
        Found::Breach(index) => {
            let name = &space.requirements[log.breaches[index].requirement].name;
            (format!("{name}."), String::new(), name.clone())
        }
    };
    // A claim is checked in at most twice as many branches as it counts.
    let told = risen.telling().into_iter().filter(|at| at.again.replays > 0 && at.failed <= at.again.replays);
    let claim = |Branched { time_s, again, .. }: &Branched| {
        format!("{of}recurrence == {} / {}{with} at {time_s:.1} s", again.recurred, again.replays)
    };
    let claims: Vec<String> = told.map(claim).collect();
    if !claims.is_empty() {
        let text = read(file).map_err(|error| Failure::file("read", file, error))?;
        let text = with_moments(&text, &whom, &claims)
            .ok_or_else(|| Failure::file("change", file, "it was changed meanwhile"))?;
        write_again(file, &text)?;
    }
    Ok(claims.len())
}

/// A finding with the road user or the requirement.
fn in_words(space: &Space, log: &EpisodeLog, found: Found) -> String {
    match found {
        Found::Collision(index) => {
            format!("{} with npc#{}", found.noun(), log.collisions[index].contact.obstacle)
        }
        Found::Breach(index) => {
            format!("{} of `{}`", found.noun(), space.requirements[log.breaches[index].requirement].name)
        }
    }
}

/// When a finding became certain, in words.
fn moment_text(name: &str, noun: &str, risen: &NoReturn) -> String {
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
    format!("{name} at {found_s:.2} s; {rise}{avoidable}{failed}")
}

/// A share as a bar of ten signs.
fn bar(share: f64) -> String {
    let full = (10.0 * share).round() as usize;
    format!("{}{}", "█".repeat(full), "·".repeat(10 - full))
}
