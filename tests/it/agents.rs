//! Every agent of the registry in whole episodes: they replay, they do not depend on the number of
//! workers, and a search that was interrupted ends like one that was not.

use std::sync::atomic::AtomicBool;

use avastra::agent::{Entry, Kind, Settings};
use avastra::run::{Conditions, EpisodeSummary, Run, RunSettings};
use avastra::train::{TrainSettings, TrainedEpisode, Training};
use avastra::{agent, run};

use crate::world::{assert_replays, run};

/// A run of an agent that can act at once, two episodes on one road.
fn run_of(entry: &Entry, seed: u64) -> Run {
    let usual = run(2, seed, &[]);
    let roads = vec!["corner".to_owned()];
    let conditions = Conditions { roads, ..usual.settings().conditions.clone() };
    let settings = RunSettings { agent: entry.name.to_owned(), conditions, ..usual.settings().clone() };
    Run::new(usual.table().clone(), settings).expect("it can act at once")
}

/// A training of a few episodes on two roads, with a network of a few neurons where there is one.
fn training(entry: &Entry, checkpoint: Option<(usize, &[u8])>) -> Option<Training> {
    let text = match entry.kind {
        Kind::Ready(_) | Kind::OneRow(_) => return None,
        Kind::Learning(_) => "learning_starts: 30\nupdates_per_step: 1\nhidden_units: [8]\nbatch_len: 8\n",
        Kind::Searching(_) => "",
    };
    let usual = run(1, 1, &[]);
    let hyperparameters = Settings::from_yaml(entry, None, text)?.expect("the settings are sound");
    let roads = vec!["corner".to_owned(), "residential".to_owned()];
    let settings = TrainSettings {
        conditions: Conditions { roads, ..Conditions::of(usual.space()) },
        agent: entry.name.to_owned(),
        episodes: 24,
        hours: None,
        evaluation: 15,
        seed: 3,
        hyperparameters,
    };
    let table = usual.table().clone();
    let training = match checkpoint {
        None => Training::new(table, settings),
        Some((episodes, bytes)) => Training::resumed(table, settings, (episodes, 0.0), bytes),
    };
    Some(training.expect("the settings name what exists"))
}

#[test]
fn an_agent_that_acts_at_once_replays_and_does_not_depend_on_the_workers() {
    for entry in agent::REGISTRY.iter().filter(|entry| matches!(entry.kind, Kind::Ready(_) | Kind::OneRow(_)))
    {
        let run = run_of(entry, 5);
        let judged = |jobs| {
            let mut episodes: Vec<EpisodeSummary> = Vec::new();
            let stop = AtomicBool::new(false);
            let done = run::play(&run, &[0, 1], jobs, &stop, &mut |summary, log| {
                assert_replays(&run, summary.episode, &log);
                episodes.push(summary);
                Ok::<(), ()>(())
            });
            done.expect("nothing fails");
            episodes.sort_by_key(|summary| summary.episode);
            episodes
        };
        let alone = judged(1);
        assert_eq!(alone, judged(2), "{}", entry.name);
    }
}

#[test]
fn what_is_trained_goes_on_from_a_checkpoint_to_the_same_episodes() {
    for entry in agent::REGISTRY {
        let Some(mut whole) = training(entry, None) else { continue };
        for _ in 0..14 {
            whole.episode().expect("it learns");
        }
        let checkpoint = whole.agent().save();
        let mut resumed = training(entry, Some((14, &checkpoint))).expect("it is trained");
        while !whole.is_done() {
            let (one, other): (TrainedEpisode, TrainedEpisode) =
                (whole.episode().expect("it learns"), resumed.episode().expect("it learns"));
            let name = entry.name;
            assert_eq!(one.log, other.log, "{name}");
            assert_eq!((one.sum, one.simulated_s), (other.sum, other.simulated_s), "{name}");
            assert!(one.simulated_s > 0.0 && one.simulated_s <= one.log.duration_s, "{name}");
        }
        assert_eq!(whole.agent().save(), resumed.agent().save(), "{}", entry.name);
    }
}
