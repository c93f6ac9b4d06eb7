//! `avastra ads check`: whether a driving system follows the protocol and is deterministic, and how fast it is.
//!
//! The check drives whole episodes with random actions around the ego vehicle, because a driving system that answers one
//! step well may fail at the hundredth. Each failure is named with its stage and what to do about it.

use std::sync::Arc;

use serde::Serialize;

use crate::cli::arguments::AdsCheckArguments;
use crate::cli::clock::now;
use crate::cli::error::Failure;
use crate::cli::files::{Scratch, make_way, write_new};
use crate::cli::findings::{cut_off, thinking_text};
use crate::cli::load;
use crate::cli::new::SHIPPED;
use crate::cli::output::Output;
use avastra_campaign::episode::{self, Choice, EpisodeLog};
use avastra_campaign::run::{Arena, choose};
use avastra_drivers::Selected;
use avastra_drivers::external::{ExternalSettings, Failure as Finding, Problem, Program, odd_orders};
use avastra_search::agent::{self, Kind};
use avastra_world::action::ActionTable;
use avastra_world::sim::World;

use super::drive::{Drives, drive};

/// The space that is driven if none is named: one of avastra's own, under the law.
const SPACE: (&str, &str) = ("drive.ava", "language 1\nuse \"avastra45.ava\"\nuse \"law.ava\"\n");
/// Length of each of the four episodes, in steps of an agent (6 s), at most.
const STEPS: usize = 5;
/// Steps of the episode that is broken off for a reset.
const BROKEN_OFF_STEPS: usize = 2;
/// Lines of standard error that are shown.
pub(super) const STDERR_LINES: usize = 12;

/// The result of one check.
#[derive(Debug, Serialize)]
pub(super) struct Part {
    /// In a word: `start`, `episode`, `reset`, `process`, `orders`, `close`; of drives `alone`, `traffic`.
    pub stage: &'static str,
    pub passed: bool,
    /// The finding, in words.
    pub found: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failure: Option<Finding>,
}

/// Figures of the first episode.
#[derive(Debug, Clone, Copy, Serialize)]
struct Speed {
    questions: usize,
    round_trips_per_s: f64,
    /// Part of the episode's time that the driving system took, in `[0, 1]`.
    share: f64,
}

/// Runs all checks; the first that fails ends them.
pub fn check(output: &Output, arguments: &AdsCheckArguments) -> Result<(), Failure> {
    let given = load::driver(&arguments.ads)?;
    let settings = load::external(given.profile, given.command)?.ok_or_else(|| {
        let is = match given.profile {
            Some(_) => "has no `ads` block, so it is a profile of `modular`",
            None => "is a driving system of avastra",
        };
        Failure::usage(format!("`{}` {is}: check one of your own", arguments.ads))
    })?;
    let (table, _scratch) = match &arguments.space {
        Some(path) => (load::table(output, path)?, None),
        None => {
            let (table, scratch) = own_space(output)?;
            (table, Some(scratch))
        }
    };
    let road = match &arguments.road {
        Some(road) => road.clone(),
        None => table.space().roads[0].name.clone(),
    };
    let mut checks =
        Checks { output, seed: arguments.seed, parts: Vec::new(), speed: None, is_deterministic: true };
    checks.all(table.clone(), &road, settings.clone())?;
    let drives = match arguments.drive {
        Some(times) if checks.parts.iter().all(|part| part.passed) => {
            checks.drives(table, &arguments.road, settings, times)?
        }
        _ => Vec::new(),
    };
    let Checks { parts, speed, .. } = checks;
    let failed = parts.iter().filter(|part| !part.passed).count();
    output.say(match failed {
        0 => "\nit can be put under test",
        _ => "\nit cannot be put under test as it is",
    });
    output.result(serde_json::json!({ "checks": parts, "speed": speed, "drives": drives }));
    if failed > 0 { Err(Failure::Unfit { checks: failed }) } else { Ok(()) }
}

/// The paper's space, which is in the program, and the folder that it is written to. A planner may open the OpenDRIVE
/// file of its map, so the file must lie on disk as long as the planner is checked.
fn own_space(output: &Output) -> Result<(ActionTable, Scratch), Failure> {
    let scratch = Scratch::new("ads-check")?;
    for (name, text) in SHIPPED.into_iter().chain([SPACE]) {
        let file = scratch.path.join(name);
        make_way(&scratch.path, &file)?;
        write_new(&file, text)?;
    }
    Ok((load::table(output, &scratch.path.join(SPACE.0))?, scratch))
}

pub(super) struct Checks<'a> {
    output: &'a Output,
    pub seed: u64,
    parts: Vec<Part>,
    speed: Option<Speed>,
    /// Whether the driving system says that it is deterministic.
    is_deterministic: bool,
}

impl Checks<'_> {
    fn all(&mut self, table: ActionTable, road: &str, settings: ExternalSettings) -> Result<(), Failure> {
        let program = Program::new(settings);
        let began = now();
        let identity = match program.start() {
            Ok(identity) => identity,
            Err(failure) => {
                self.fail("start", "it does not come up", failure);
                return Ok(());
            }
        };
        let kind = identity.answer.name();
        let loose = if identity.deterministic { "" } else { ", says that it is not deterministic" };
        self.pass(
            "start",
            format!(
                "{}, answers with `{kind}`{loose}, ready after {:.2} s",
                identity.text(),
                began.elapsed().as_secs_f64()
            ),
        );
        self.is_deterministic = identity.deterministic;

        let arena =
            Arena::new(table, &[road.to_owned()], Selected::external(Arc::clone(&program)), &[], &[])?;
        let began = now();
        let first = self.drive(&arena, 0, STEPS);
        let asked_s = began.elapsed().as_secs_f64();
        if let Some(failure) = &first.failure {
            self.fail("episode", "it fails in an episode", failure.clone());
            return Ok(());
        }
        // Now all answers are known: the same again is what avastra itself takes.
        let began = now();
        self.drive(&arena, 0, STEPS);
        let own_s = began.elapsed().as_secs_f64();
        let questions = first.conversation.as_ref().map_or(0, |conversation| conversation.exchanges.len());
        let taken_s = (asked_s - own_s).max(1e-9);
        let share = taken_s / asked_s.max(1e-9);
        let round_trips_per_s = questions as f64 / taken_s;
        self.speed = Some(Speed { questions, round_trips_per_s, share });
        self.pass(
            "episode",
            format!(
                "{questions} questions on `{road}`, {:.0} m driven, end `{}`, {}; {round_trips_per_s:.0} round trips/s, {:.0} % of the episode's time{}",
                first.distance_m,
                first.end.name(),
                crate::cli::output::plural(first.collisions.len(), "collision"),
                100.0 * share,
                cut_off(Some(&program)).map_or_else(String::new, |note| format!("; {note}"))
            ),
        );

        // Another episode is broken off, and then the first one comes again, in the same process.
        program.forget();
        let between = self.drive(&arena, 1, BROKEN_OFF_STEPS);
        let again = self.drive(&arena, 0, STEPS);
        let failure = between.failure.as_ref().or(again.failure.as_ref());
        if !self.same("reset", "after a reset, the same episode", &first, &again, failure) {
            return Ok(());
        }
        program.forget();
        let ended = program.close();
        let fresh = self.drive(&arena, 0, STEPS);
        if !self.same(
            "process",
            "in a fresh process, the same episode",
            &first,
            &fresh,
            fresh.failure.as_ref(),
        ) {
            return Ok(());
        }
        // The first order needs a process that has seen nothing yet.
        let ended = program.close().and(ended);
        let setup = arena.setup(0, self.seed);
        let sensed = World::new(Arc::clone(&setup.scene), &setup.start).sensed();
        match odd_orders(&program, &setup.scene, &sensed, self.seed) {
            Ok(tried) => self.pass("orders", format!("it takes {}", tried.join(", "))),
            Err((what, failure)) => {
                self.fail("orders", &format!("it does not take {what}"), *failure);
                return Ok(());
            }
        }
        let ended = program.close().and(ended);
        match ended {
            Ok(()) if program.settings().command.is_socket() => {
                self.pass("close", "the connection is closed".to_owned());
            }
            Ok(()) => self.pass("close", "it ends by itself, with status 0".to_owned()),
            Err(how) => {
                let found = format!(
                    "after `close`, {how}: leave the loop at `close` or at the end of the input, and end with status 0"
                );
                self.note("FAILS", Part { stage: "close", passed: false, found, failure: None });
            }
        }
        Ok(())
    }

    /// Drives the road that is asked for, or all, in a fresh process.
    fn drives(
        &mut self,
        table: ActionTable,
        road: &Option<String>,
        settings: ExternalSettings,
        times: u32,
    ) -> Result<Vec<Drives>, Failure> {
        let roads = match road {
            Some(road) => vec![road.clone()],
            None => table.space().roads.iter().map(|road| road.name.clone()).collect(),
        };
        let program = Program::new(settings);
        if let Err(failure) = program.start() {
            self.fail("alone", "it does not come up again", failure);
            return Ok(Vec::new());
        }
        let arena = Arena::new(table, &roads, Selected::external(Arc::clone(&program)), &[], &[])?;
        let drives = drive(self, &arena, program.settings(), times);
        if let Some(text) = thinking_text(Some(&program)) {
            self.output.say(&format!("      time     {text}"));
        }
        program.close().ok();
        Ok(drives)
    }

    /// An episode with random actions, broken off after so many steps.
    fn drive(&self, arena: &Arena, number: u64, steps: usize) -> EpisodeLog {
        let setup = arena.setup(0, self.seed.wrapping_add(number));
        let Kind::Ready(build) = agent::by_name("random").expect("it is in the registry").kind else {
            unreachable!("it learns nothing")
        };
        let mut agent = build();
        let mut choose = |moment: &episode::Moment| {
            if moment.step >= steps { Choice::Stop } else { choose(agent.as_mut(), moment) }
        };
        episode::run(&setup, &mut choose)
    }

    /// Whether an episode went as before.
    fn same(
        &mut self,
        stage: &'static str,
        what: &str,
        first: &EpisodeLog,
        again: &EpisodeLog,
        failure: Option<&Finding>,
    ) -> bool {
        if let Some(failure) = failure {
            self.fail(stage, "it fails", failure.clone());
            return false;
        }
        let conversations = first.conversation.as_deref().zip(again.conversation.as_deref());
        let Some((step, how)) = conversations.and_then(|(first, again)| first.difference(again)) else {
            self.pass(stage, format!("{what} gets the same answers"));
            return true;
        };
        if !self.is_deterministic {
            self.pass(stage, format!("{what} gets other answers from step {step} on, as it says it may"));
            return true;
        }
        let advice = Problem::OtherAnswer.advice();
        let found = format!("{what} gets other answers: {how}; {advice}");
        self.note("FAILS", Part { stage, passed: false, found, failure: None });
        false
    }

    fn pass(&mut self, stage: &'static str, found: String) {
        self.note("ok", Part { stage, passed: true, found, failure: None });
    }

    fn fail(&mut self, stage: &'static str, what: &str, failure: Finding) {
        let mut found = format!("{what}: {}\n{}", failure.in_words(), failure.problem.advice());
        for line in failure.stderr_lines(STDERR_LINES) {
            found.push_str(&format!("\n| {line}"));
        }
        self.note("FAILS", Part { stage, passed: false, found, failure: Some(failure) });
    }

    /// Prints a result under a word: `ok`, `look` or `FAILS`. Further lines stand below the first.
    pub(super) fn note(&mut self, word: &str, part: Part) {
        let found = part.found.replace('\n', &format!("\n{:15}", ""));
        self.output.say(&format!("{word:<6}{:<9}{found}", part.stage));
        self.parts.push(part);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_maps_that_a_planner_is_told_of_exist_as_long_as_it_is_checked() {
        let (table, scratch) = own_space(&Output::silent()).expect("our own space is sound");
        for road in &table.space().roads {
            let file = road.map.file.as_ref().expect("the map was read from a file");
            assert!(file.is_file(), "{}", file.display());
        }
        let folder = scratch.path.clone();
        drop(scratch);
        assert!(!folder.exists(), "nothing is left behind");
    }
}
