//! What a run emits replays to the bit, reads back to the same value, and depends on nothing but the seed.

use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;

use avastra::episode::{EpisodeLog, Outcome, Script};
use avastra::oracle::Replays;
use avastra::run::{EpisodeSummary, Run, play};
use avastra::{emit, oracle};

use crate::cases::expect_snapshot;
use crate::world::{assert_replays, loaded, run, run_of, run_with_flicker, space_at, under};

const EPISODES: u32 = 12;

#[test]
fn every_log_replays_to_the_bit() {
    let run = run(EPISODES, 7, &[]);
    for number in 0..run.episodes() {
        assert_replays(&run, number, &run.episode(number));
    }
}

#[test]
fn ambient_traffic_replays_to_the_bit() {
    let quiet = run(4, 7, &[]);
    let busy = under(&quiet, |conditions| conditions.ambient = 6);
    for number in 0..busy.episodes() {
        let log = busy.episode(number);
        assert_eq!(log.start.ambient, 6);
        assert_ne!(log.trace(), quiet.episode(number).trace());
        assert_replays(&busy, number, &log);
    }
}

#[test]
fn half_an_action_is_none() {
    let run = run_of(space_at("tests/cases/spaces/two_at_one_place.ava"), 3, 1, &[]);
    for number in 0..run.episodes() {
        let log = run.episode(number);
        assert!(log.steps.iter().all(|step| matches!(step.outcome, Outcome::Refused { .. })));
        // Neither the first of the two spawns nor the night remains.
        assert!(log.steps.iter().all(|step| step.state[1] == 14.0 && step.state[3] == 0.0));
        assert_replays(&run, number, &log);
    }
}

#[test]
fn the_number_of_workers_changes_nothing() {
    let run = run(EPISODES, 11, &[]);
    assert_eq!(judged(&run, 1), judged(&run, 2));
}

#[test]
fn emitted_scenarios_keep_every_claim() {
    let run = run_with_flicker(20, 3);
    let mut emitted = 0;
    for (number, (summary, log)) in judged(&run, 2) {
        if summary.counted() == 0 {
            continue;
        }
        emitted += 1;
        let text = text(&run, &summary, &log);
        let formatted = avastra::syntax::format(Default::default(), &text).expect("what is emitted parses");
        assert_eq!(formatted, text, "emitted text is formatted text");
        if emitted <= 2 {
            expect_snapshot("emitted", &format!("scenario_{emitted}"), &text);
        }
        // Its `use` is relative to `scenarios/`.
        let loaded = loaded("scenarios/emitted.ava", &text);
        assert!(loaded.diagnostics.is_empty(), "{text}\n{:?}", loaded.diagnostics);
        let scenario = loaded.scenario.as_ref().expect("it has a scenario");
        let script = Script::of_scenario(scenario);
        let again = run.play(number, &mut |moment| script.choose(moment), &mut |_, _, _| {});
        let judgements = oracle::judge(&run.setup(number), &script, &again);
        let replays = Replays {
            cause: &|_| Ok(Vec::new()),
            breached: &|| None,
            recurrence: &|_, _, _| Err(oracle::NoTries),
            spare_steps: &|_| Ok(Vec::new()),
        };
        for verdict in oracle::verify(run.space(), scenario, &again, &judgements, &replays) {
            assert_eq!(verdict.confirmed, Some(true), "{verdict:?}\n{text}");
        }
    }
    assert!(emitted >= 2, "sixty episodes of random search find crashes; these found {emitted}");
}

fn text(run: &Run, summary: &EpisodeSummary, log: &EpisodeLog) -> String {
    let source = emit::Provenance {
        command: "run",
        name: &format!("{}_{:04}", log.road, summary.episode),
        space_path: "avastra45.ava",
        episode: summary.episode,
        agent: &run.settings().agent,
        without: &[],
        with: &[],
    };
    let about = summary.first_found(log).expect("it has a finding");
    avastra::syntax::print(&emit::scenario(run.table(), (log, summary), about, &source))
}

fn judged(run: &Run, jobs: usize) -> BTreeMap<usize, (EpisodeSummary, EpisodeLog)> {
    let numbers: Vec<usize> = (0..run.episodes()).collect();
    let mut episodes = BTreeMap::new();
    play::<()>(run, &numbers, jobs, &AtomicBool::new(false), &mut |summary, log| {
        episodes.insert(summary.episode, (summary, log));
        Ok(())
    })
    .expect("nothing here fails");
    episodes
}
