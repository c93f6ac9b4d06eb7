//! A contextual bandit: each choice by what such choices have led to in such a situation ([`Worth`]). It plans nothing
//! and returns to nothing; a choice before the one that made the obstacle appear shares in the crash.

use std::sync::Arc;

use crate::agent::acting::{Agent, Mask};
use crate::agent::checked::{Checked, SettingsError, positive, require, unit, within};
use crate::agent::choice::Rows;
use crate::agent::random::any;
use crate::agent::trainable::{Configured, Diverged, Trainable};
use crate::agent::trajectory::{Lesson, Trajectory};
use crate::mdp::Observation;
use avastra_base::rng;
use avastra_base::rng::Rng;

use super::situation::situation;
use super::worth::{Doubt, Worth, worths};

/// Settings of [`Bandit`]; all ours.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BanditSettings {
    /// Share of the choices that follow the record of what has led to crashes, in `[0, 1]`.
    pub record_share: f64,
    /// How much a short record is doubted: the standard deviation that the worth of one choice is taken to
    /// have, at least 0. In the search doubtful rows are tried, afterwards they are avoided.
    pub doubt: f64,
    /// Worth of a choice a step before the choice that made the obstacle appear, in `[0, 1]`; two steps
    /// before, its square.
    pub credit_discount: f64,
    /// Choices after which a situation's own record counts as much as that of all situations, above 0.
    pub prior_choices: f64,
    /// Share of random choices when the record acts in the end, in `[0, 1]`.
    pub evaluation_epsilon: f64,
}

impl Default for BanditSettings {
    fn default() -> BanditSettings {
        BanditSettings {
            record_share: 0.75,
            doubt: 0.3,
            credit_discount: 0.5,
            prior_choices: 10.0,
            evaluation_epsilon: 0.05,
        }
    }
}

impl Checked for BanditSettings {
    fn check(&self) -> Result<(), SettingsError> {
        require([
            unit("record_share", self.record_share),
            unit("credit_discount", self.credit_discount),
            unit("evaluation_epsilon", self.evaluation_epsilon),
            within("doubt", self.doubt, 0.0..=100.0, "from 0 to 100"),
            positive("prior_choices", self.prior_choices),
        ])
    }
}

impl Configured for BanditSettings {
    type Trained = Bandit;

    fn build(&self, rows: Arc<Rows>, _: u64) -> Bandit {
        Bandit::new(self, rows.allowed.len())
    }

    fn restore(&self, rows: Arc<Rows>, bytes: &[u8]) -> Option<Bandit> {
        let rows = rows.allowed.len();
        let saved: SavedBandit = serde_json::from_slice(bytes).ok()?;
        saved.worth.is_of(rows).then(|| Bandit { saved, ..Bandit::new(self, rows) })
    }
}

/// The bandit.
pub struct Bandit {
    settings: BanditSettings,
    saved: SavedBandit,
    /// The situation and the row of each choice of the episode under way.
    made: Vec<(u32, usize)>,
}

/// The state that the bandit keeps from episode to episode.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
struct SavedBandit {
    steps: u64,
    worth: Worth,
}

impl Bandit {
    /// A bandit over so many rows.
    pub fn new(settings: &BanditSettings, rows: usize) -> Bandit {
        let saved = SavedBandit { steps: 0, worth: Worth::new(rows) };
        Bandit { settings: settings.clone(), saved, made: Vec::new() }
    }
}

impl Agent for Bandit {
    fn begin(&mut self, _: u64) {
        self.made.clear();
    }

    /// By the record for its share of the choices, else any legal row.
    fn choose(&mut self, observation: &Observation, legal: &mut dyn Mask, rng: &mut Rng) -> Option<usize> {
        let legal = legal.all()?;
        let here = situation(observation);
        let BanditSettings { record_share, prior_choices, doubt, .. } = self.settings;
        let row = if rng::unit(rng) < record_share {
            self.saved.worth.best(here, legal.view(), prior_choices, Doubt::Try(doubt), rng)
        } else {
            any(&legal, rng)
        }?;
        self.saved.steps += 1;
        self.made.push((here, row));
        Some(row)
    }
}

impl Trainable for Bandit {
    fn learn(&mut self, episode: &Trajectory, _: &mut Rng) -> Result<Lesson, Diverged> {
        assert_eq!(self.made.len(), episode.steps.len(), "each choice is an experience");
        for (&(here, row), value) in self.made.iter().zip(worths(episode, self.settings.credit_discount)) {
            self.saved.worth.note(here, row, value);
        }
        Ok(Lesson::default())
    }

    fn steps(&self) -> u64 {
        self.saved.steps
    }

    fn exploration_epsilon(&self) -> f64 {
        1.0 - self.settings.record_share
    }

    fn actor(&self) -> Box<dyn Agent> {
        Box::new(Recorded { settings: self.settings.clone(), worth: self.saved.worth.clone() })
    }

    fn save(&self) -> Vec<u8> {
        serde_json::to_vec(&self.saved).expect("a bandit is plain data")
    }
}

/// Acts by the record alone.
struct Recorded {
    settings: BanditSettings,
    worth: Worth,
}

impl Agent for Recorded {
    fn choose(&mut self, observation: &Observation, legal: &mut dyn Mask, rng: &mut Rng) -> Option<usize> {
        let legal = legal.all()?;
        let BanditSettings { evaluation_epsilon, prior_choices, doubt, .. } = self.settings;
        if rng::unit(rng) < evaluation_epsilon {
            return any(&legal, rng);
        }
        self.worth.best(situation(observation), legal.view(), prior_choices, Doubt::Avoid(doubt), rng)
    }
}
