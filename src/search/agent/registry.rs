//! Every agent by name. A new agent is a file and one entry here; the conformance
//! tests run through all of them.

use serde_json::{Map, Value};

use crate::mdp::Observation;
use avastra_base::rng::Rng;

use super::acting::{Agent, Mask};
use super::checked::{SettingsError, changed};
use super::presets::Preset;
use super::search::{BanditSettings, ConstantSettings};
use super::settings::Settings;
use super::{one_row, presets, random, space_filling};

/// An agent that can be asked for by name.
pub struct Entry {
    pub name: &'static str,
    pub summary: &'static str,
    pub kind: Kind,
}

/// How an agent is made.
pub enum Kind {
    /// It can act at once: a fresh one for each episode.
    Ready(fn() -> Box<dyn Agent>),
    /// It plays a row of the table, behind others that it needs: a fresh one for each episode and row.
    OneRow(fn(usize, Vec<usize>) -> Box<dyn Agent>),
    /// It must be trained: its presets, the default first. See [`super::Learner`].
    Learning(&'static [Preset]),
    /// It searches over many episodes, and what it found can act: how its settings are made from changes by name.
    /// See [`super::Trainable`].
    Searching(fn(Map<String, Value>) -> Result<Settings, SettingsError>),
}

/// Every agent of avastra.
pub const REGISTRY: &[Entry] = &[
    Entry {
        name: "none",
        summary: "nothing happens but ordinary traffic, if there is any",
        kind: Kind::Ready(|| Box::new(Idle)),
    },
    Entry {
        name: "random",
        summary: "by chance among the rows that the rules allow at the moment: each action as likely, weather and time in 15 % of the steps, unless the space gives odds",
        kind: Kind::Ready(|| Box::new(random::MaskedRandom::default())),
    },
    Entry {
        name: "random-raw",
        summary: "uniform over all rows, as the published random search; an illegal choice is a step lost",
        kind: Kind::Ready(|| Box::new(random::RawRandom)),
    },
    Entry {
        name: "space-filling",
        summary: "random, but spread evenly over the rows and their drawn values: a Latin hypercube in each episode",
        kind: Kind::Ready(|| Box::new(space_filling::SpaceFilling::default())),
    },
    Entry {
        name: "every-row",
        summary: "each row once on each road on which its rules let it run, in an episode of its own, behind the rows that make its road users appear: a protocol",
        kind: Kind::OneRow(|row, before| Box::new(one_row::OneRow::new(row, before))),
    },
    Entry {
        name: "ddqn",
        summary: "the paper's agent: Double DQN with prioritised replay",
        kind: Kind::Learning(presets::DDQN),
    },
    Entry {
        name: "deep_collision",
        summary: "DeepCollision's agent: plain DQN over 12 variables",
        kind: Kind::Learning(presets::DEEP_COLLISION),
    },
    Entry {
        name: "constant",
        summary: "a fixed list of rows, those first that crashed most in training: the first legal one acts",
        kind: Kind::Searching(|changes| {
            changed(&ConstantSettings::default(), changes).map(Settings::Constant)
        }),
    },
    Entry {
        name: "bandit",
        summary: "the row after which most crashes came in such a situation; it plans nothing",
        kind: Kind::Searching(|changes| changed(&BanditSettings::default(), changes).map(Settings::Bandit)),
    },
];

/// Never chooses anything.
struct Idle;

impl Agent for Idle {
    fn choose(&mut self, _: &Observation, _: &mut dyn Mask, _: &mut Rng) -> Option<usize> {
        None
    }

    fn looks_at_mask(&self) -> bool {
        false
    }
}

/// The agent of that name.
pub fn by_name(name: &str) -> Option<&'static Entry> {
    REGISTRY.iter().find(|entry| entry.name == name)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::agent::trainable::Configured;
    use crate::agent::{Experience, Rows, Trainable, Trajectory};
    use avastra_base::rng::{Stream, child_seed, stream};
    use ndarray::Array1;

    const ROWS: usize = 5;

    /// Fresh agents of an entry, one for each of its presets, and whether each obeys the mask.
    fn fresh(entry: &Entry, seed: u64) -> Vec<(Box<dyn Agent>, bool)> {
        let rows = || Arc::new(Rows { allowed: vec![true; ROWS], environment: vec![false; ROWS] });
        match entry.kind {
            Kind::Ready(build) => vec![(build(), entry.name != "random-raw")],
            Kind::OneRow(build) => vec![(build(1, Vec::new()), true)],
            Kind::Learning(presets) => {
                let learner = |preset: &Preset| -> (Box<dyn Agent>, bool) {
                    let settings = (preset.settings)();
                    let obeys = settings.choice.masks_choice;
                    (Box::new(settings.build(rows(), seed)), obeys)
                };
                presets.iter().map(learner).collect()
            }
            Kind::Searching(read) => {
                vec![(read(Map::new()).unwrap().build(rows(), seed), true)]
            }
        }
    }

    #[test]
    fn every_agent_but_none_chooses_a_row_and_repeats_itself() {
        let legal = Array1::from_vec(vec![false, true, false, true, true]);
        for entry in REGISTRY {
            let choices = |seed| -> Vec<Vec<Option<usize>>> {
                let choices = |(mut agent, obeys): (Box<dyn Agent>, bool)| {
                    let mut rng = stream(seed, Stream::Exploration, 0);
                    agent.begin(seed);
                    let observation = Observation::zeros();
                    let choose = |step| {
                        agent.draw_shares(step, seed);
                        agent.choose(&observation, &mut legal.to_vec(), &mut rng)
                    };
                    let chosen: Vec<Option<usize>> = (0..50).map(choose).collect();
                    let fits = |row: &usize| *row < ROWS && (legal[*row] || !obeys);
                    assert!(chosen.iter().flatten().all(fits), "{}", entry.name);
                    chosen
                };
                fresh(entry, seed).into_iter().map(choices).collect()
            };
            assert_eq!(choices(1), choices(1), "{}", entry.name);
            if entry.name == "none" {
                assert!(choices(1).iter().flatten().all(Option::is_none));
                continue;
            }
            if entry.name == "every-row" {
                assert_eq!(choices(1)[0].iter().flatten().collect::<Vec<_>>(), [&1], "once");
                continue;
            }
            assert!(choices(1).iter().flatten().all(Option::is_some), "{}", entry.name);
            // A constant row may be the same for two seeds, but not for all.
            let others: Vec<Vec<Vec<Option<usize>>>> = (2..10).map(choices).collect();
            for (preset, one) in choices(1).iter().enumerate() {
                assert!(others.iter().any(|other| other[preset] != *one), "{}", entry.name);
            }
        }
    }

    /// An episode in which the first choice makes an obstacle appear that is hit for good in the last.
    fn episode(rows: &[usize]) -> Trajectory {
        let experience = |(at, &row): (usize, &usize)| {
            if at + 1 < rows.len() {
                return Experience::plain(row, -1.0, ROWS);
            }
            Experience { hits: vec![0], crashes: vec![Some(0)], ..Experience::plain(row, 7.5, ROWS) }
        };
        Trajectory { ..Trajectory::plain(rows.iter().enumerate().map(experience).collect(), ROWS) }
    }

    #[test]
    fn every_trained_agent_goes_on_after_a_kill_as_if_there_had_been_none() {
        let rows = || Arc::new(Rows { allowed: vec![true; ROWS], environment: vec![false; ROWS] });
        for entry in REGISTRY {
            let text = match entry.kind {
                // So small that everything which a checkpoint holds is in use.
                Kind::Learning(_) => {
                    "learning_starts: 32\nreplay_capacity: 60\nrandom_decay: 0.05\nhidden_units: [16]\naverage_decay: 0.9"
                }
                Kind::Ready(_) | Kind::OneRow(_) | Kind::Searching(_) => "",
            };
            let Some(settings) = Settings::from_yaml(entry, None, text) else { continue };
            let settings = settings.unwrap();
            let play = |agent: &mut Box<dyn Trainable>, number: u64| {
                let seed = child_seed(9, Stream::Episode, number);
                agent.begin(seed);
                let mut chosen = Vec::new();
                for step in 0..6 {
                    let mut rng = stream(seed, Stream::Exploration, step as u64);
                    let legal = Array1::from_elem(ROWS, true);
                    chosen.push(agent.choose(&Observation::zeros(), &mut legal.to_vec(), &mut rng).unwrap());
                }
                let mut rng = stream(9, Stream::Replay, number);
                agent.learn(&episode(&chosen), &mut rng).unwrap();
            };
            let mut whole = settings.build(rows(), 9);
            for number in 0..40 {
                play(&mut whole, number);
            }
            let bytes = whole.save();
            let mut restored = settings.restore(rows(), &bytes).expect("the bytes are its own");
            assert_eq!(restored.save(), bytes, "{}", entry.name);
            for number in 40..60 {
                play(&mut whole, number);
                play(&mut restored, number);
            }
            assert_eq!(whole.save(), restored.save(), "{}", entry.name);
            for damaged in [&bytes[1..], &bytes[..bytes.len() - 1]] {
                assert!(settings.restore(rows(), damaged).is_none(), "{}", entry.name);
            }
        }
    }
}
