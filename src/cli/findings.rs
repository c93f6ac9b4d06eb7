//! The messages about an external driving system that failed, or that need not be deterministic.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use avastra_campaign::run::{FailureCount, Stage};
use avastra_drivers::Selected;
use avastra_drivers::external::message::EXTREME_MPS2;
use avastra_drivers::external::{ExternalSettings, FailureKind, Program, Thinking};

use super::error::Failure;
use super::load;
use super::output::{Output, plural};
use super::summary::cut_short;

/// How often a driving system that says it is deterministic is asked again. Where it answers otherwise in half of its plays, all of these
/// agree in 3 % of checks.
const SPOT_CHECKS: usize = 5;
/// Most tries of a spot check, because the driving system may fail in some.
const SPOT_CHECKS_MAX: usize = 3 * SPOT_CHECKS;

/// Warns of each reason that an external driving system gives why the same command need not lead to the same run. Returns
/// whether there is none.
pub fn is_reproducible(output: &Output, program: Option<&Arc<Program>>) -> bool {
    let Some(program) = program else { return true };
    let attached = program.attached();
    let loose = (!attached.is_deterministic()).then(|| {
        format!(
            "{} says that it is not deterministic: the same seed need not lead to the same episodes again; scenarios \
             replay from the recorded answers",
            attached.name()
        )
    });
    let otherwise = program.otherwise().map(|found| {
        format!(
            "{} says that it is deterministic and is not: asked an episode again, {found}; the same seed need not lead to \
             the same episodes again, and scenarios replay from the recorded answers",
            attached.name()
        )
    });
    let missed = (program.missed() > 0).then(|| {
        let waited_s = program.missed() as f64 * program.settings().timeouts.step_s;
        format!(
            "{} were not answered in time ({waited_s:.0} s of waiting), and the answers before held on: what was driven \
             then depends on this machine",
            plural(program.missed() as usize, "step")
        )
    });
    let doubts: Vec<String> = loose.into_iter().chain(otherwise).chain(missed).collect();
    doubts.iter().for_each(|doubt| output.warn(doubt));
    doubts.is_empty()
}

/// How long the driving system thought about its answers, if it was asked.
pub fn thinking_text(program: Option<&Arc<Program>>) -> Option<String> {
    let program = program?;
    let Thinking { answers, median_s, most_of_99_s, most_s, beyond_period, late } = program.thinking()?;
    let ms = |time_s: f64| format!("{:.1} ms", 1000.0 * time_s);
    let ExternalSettings { period_s, timeouts, .. } = program.settings();
    let late = match late {
        0 => String::new(),
        late => format!("; {late} came after the limit of {} s and were waited for", timeouts.step_s),
    };
    Some(format!(
        "the driving system thought {} at the median, {} in 99 of 100 of {}, {} at most; {:.1} % took longer than the \
         period of {period_s} s{late}",
        ms(median_s),
        ms(most_of_99_s),
        plural(answers as usize, "answer"),
        ms(most_s),
        100.0 * beyond_period,
    ))
}

/// A note on answers that asked for more than any vehicle can do, if there were any.
pub fn cut_off(program: Option<&Arc<Program>>) -> Option<String> {
    let answers = program?.extreme_answers() as usize;
    (answers > 0).then(|| {
        format!(
            "{} asked for an acceleration beyond {EXTREME_MPS2} m/s² and got what the vehicle can do",
            plural(answers, "answer")
        )
    })
}

/// Plays these scenarios again with a driving system that says it is deterministic, [`SPOT_CHECKS`] times in all. With other answers it
/// is not [reproducible](is_reproducible).
pub fn spot_check<'a>(program: Option<&Arc<Program>>, files: impl Iterator<Item = &'a Path> + Clone) {
    let Some(program) = program else { return };
    let ads = Selected::external(Arc::clone(program));
    // The diagnostics of these files were printed when they were read first.
    let silent = Output::silent();
    let mut left = SPOT_CHECKS;
    for file in files.cycle().take(SPOT_CHECKS_MAX) {
        if left == 0 || !program.is_deterministic() {
            return;
        }
        let Ok((table, scenario)) = load::scenario(&silent, file) else { continue };
        let Ok(stage) = Stage::new(&table, &scenario) else { continue };
        // The program has answered all of this already, so it is not asked.
        let Some(first) = stage.play(&ads, &mut |_, _, _| {}).conversation else { continue };
        let is_asked = program.spot_check(&first, || stage.play(&ads, &mut |_, _, _| {}).conversation);
        left -= usize::from(is_asked);
    }
}

/// The failure of a command that needs a driving system of which only the recorded answers are there.
pub fn needs_program(scenario: &str, each: &str) -> Failure {
    Failure::usage(format!(
        "`{scenario}` was made against an external driving system, which must drive each {each}: give it with `--ads`"
    ))
}

/// Why a command stops before all is played: Ctrl-C, or a driving system that was given up.
pub fn unfinished(command: &'static str, directory: PathBuf, program: Option<&Arc<Program>>) -> Failure {
    match program.and_then(|program| program.given_up()) {
        Some(last) => Failure::Unreached { command, directory, reason: last.in_words() },
        None => Failure::Interrupted { command, directory },
    }
}

/// Findings about an external driving system, by what is wrong and when; `place` says where they happened or stand.
pub fn failures_text(failures: &[FailureCount], place: &str) -> String {
    let line = |failure: &FailureCount| {
        let FailureCount { kind, problem, times, detail, scenario, .. } = failure;
        format!("{times} × {kind} ({problem}): {detail}; for example {scenario}")
    };
    let all: i64 = failures.iter().map(|failure| failure.times).sum();
    let head = format!("\nthe driving system failed {}{place}:", plural(all as usize, "time"));
    cut_short(head, failures, line, |more| format!("and {more} others"))
}

/// Numbers of failures by kind: `2 × ads_crash`.
pub fn kinds_text<N: core::fmt::Display>(kinds: &BTreeMap<FailureKind, N>) -> String {
    let kinds = kinds.iter().map(|(kind, times)| format!("{times} × {}", kind.name()));
    kinds.collect::<Vec<_>>().join(", ")
}
