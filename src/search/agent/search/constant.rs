//! The most trivial search: a fixed list of rows, of which the first legal one acts, whatever the moment. Every
//! other agent has to beat its result.
//!
//! In training each episode is led by one row, tried by Thompson sampling (1933) over the counted collisions of the
//! episodes in which it acted. Where the leader is not legal, the next of the list acts, and so the leader also gets
//! the collisions of what stands in for it.

use std::sync::Arc;

use crate::agent::acting::{Agent, Mask};
use crate::agent::checked::{Checked, SettingsError, positive, require, within};
use crate::agent::choice::Rows;
use crate::agent::trainable::{Configured, Diverged, Trainable};
use crate::agent::trajectory::{Lesson, Trajectory};
use crate::mdp::Observation;
use avastra_base::rng;
use avastra_base::rng::{Rng, Stream};

use super::worth::{Doubt, Tally};

/// Settings of [`Constant`]; all ours.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ConstantSettings {
    /// The standard deviation that the counted collisions of one episode are taken to have, at least 0: how much a
    /// row that led few episodes is doubted. In training doubtful rows are tried, afterwards they are avoided.
    pub doubt: f64,
    /// Episodes after which a row's own mean counts as much as that of all rows, above 0.
    pub prior_episodes: f64,
}

impl Default for ConstantSettings {
    fn default() -> ConstantSettings {
        ConstantSettings { doubt: 1.0, prior_episodes: 2.0 }
    }
}

impl Checked for ConstantSettings {
    fn check(&self) -> Result<(), SettingsError> {
        require([
            within("doubt", self.doubt, 0.0..=100.0, "from 0 to 100"),
            positive("prior_episodes", self.prior_episodes),
        ])
    }
}

impl Configured for ConstantSettings {
    type Trained = Constant;

    fn build(&self, rows: Arc<Rows>, _: u64) -> Constant {
        Constant::new(self, rows.allowed.len())
    }

    fn restore(&self, rows: Arc<Rows>, bytes: &[u8]) -> Option<Constant> {
        let rows = rows.allowed.len();
        let saved: SavedConstant = serde_json::from_slice(bytes).ok()?;
        (saved.led.len() == rows).then(|| Constant { saved, ..Constant::new(self, rows) })
    }
}

/// The search.
pub struct Constant {
    settings: ConstantSettings,
    saved: SavedConstant,
    /// Rows in the order in which they lead the episode under way.
    order: Vec<usize>,
    /// Whether its leader has acted.
    has_led: bool,
}

/// The state that the search keeps from episode to episode.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
struct SavedConstant {
    steps: u64,
    all: Tally,
    /// By row: counted collisions of the episodes that it led, and in which it was legal at least once.
    led: Vec<Tally>,
}

impl Constant {
    /// A search over so many rows.
    pub fn new(settings: &ConstantSettings, rows: usize) -> Constant {
        let saved = SavedConstant { steps: 0, all: Tally::default(), led: vec![Tally::default(); rows] };
        Constant { settings: settings.clone(), saved, order: (0..rows).collect(), has_led: false }
    }

    /// All rows, those of the highest expected number of counted collisions first.
    fn ordered(&self, doubt: Doubt, rng: &mut Rng) -> Vec<usize> {
        let weight = self.settings.prior_episodes;
        let of_all = self.saved.all.mean(0.0, 1.0);
        let value = |tally: &Tally| tally.mean(of_all, weight) + doubt.shift(tally, weight, rng);
        let values: Vec<f64> = self.saved.led.iter().map(value).collect();
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|&one, &other| values[other].total_cmp(&values[one]));
        order
    }
}

/// The first row of a list that is legal.
fn first_legal(order: &[usize], legal: &mut dyn Mask) -> Option<usize> {
    order.iter().copied().find(|&row| legal.is_legal(row))
}

impl Agent for Constant {
    fn begin(&mut self, seed: u64) {
        let mut rng = rng::stream(seed, Stream::Search, 0);
        self.order = self.ordered(Doubt::Try(self.settings.doubt), &mut rng);
        self.has_led = false;
    }

    fn choose(&mut self, _: &Observation, legal: &mut dyn Mask, _: &mut Rng) -> Option<usize> {
        let row = first_legal(&self.order, legal)?;
        self.has_led |= Some(&row) == self.order.first();
        self.saved.steps += 1;
        Some(row)
    }
}

impl Trainable for Constant {
    fn learn(&mut self, episode: &Trajectory, _: &mut Rng) -> Result<Lesson, Diverged> {
        let counted = episode.steps.iter().map(|step| step.crashes.len()).sum::<usize>() as f64;
        self.saved.all.note(counted);
        if let Some(&leader) = self.order.first().filter(|_| self.has_led) {
            self.saved.led[leader].note(counted);
        }
        Ok(Lesson::default())
    }

    fn steps(&self) -> u64 {
        self.saved.steps
    }

    fn exploration_epsilon(&self) -> f64 {
        0.0
    }

    fn actor(&self) -> Box<dyn Agent> {
        // Rows are avoided without chance, so any stream will do.
        let mut rng = rng::stream(0, Stream::Search, 0);
        Box::new(List(self.ordered(Doubt::Avoid(self.settings.doubt), &mut rng)))
    }

    fn save(&self) -> Vec<u8> {
        serde_json::to_vec(&self.saved).expect("a search is plain data")
    }
}

/// Acts by the list.
struct List(Vec<usize>);

impl Agent for List {
    fn choose(&mut self, _: &Observation, legal: &mut dyn Mask, _: &mut Rng) -> Option<usize> {
        first_legal(&self.0, legal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::agent::Experience;
    use ndarray::Array1;

    /// An episode of two steps with so many counted collisions.
    fn episode(counted: usize) -> Trajectory {
        let quiet = Experience::plain(0, 0.0, 4);
        let crashed = Experience { crashes: vec![None; counted], ..quiet.clone() };
        Trajectory::plain(vec![quiet, crashed], 4)
    }

    #[test]
    fn the_row_that_crashes_most_comes_to_lead() {
        let mut search = Constant::new(&ConstantSettings::default(), 4);
        let mut rng = rng::stream(1, Stream::Replay, 0);
        let all = Array1::from_elem(4, true);
        let mut led = [0; 4];
        for number in 0..200 {
            search.begin(number);
            let leader = search.choose(&Observation::zeros(), &mut all.to_vec(), &mut rng).unwrap();
            led[leader] += 1;
            // Row 2 crashes in every second episode, row 0 in every fourth, the others never.
            let crashes = match leader {
                2 => number % 2 == 0,
                0 => number % 4 == 0,
                _ => false,
            };
            search.learn(&episode(usize::from(crashes)), &mut rng).unwrap();
        }
        assert!(led.iter().all(|&episodes| episodes > 0) && led[2] > 80, "{led:?}");
        let mut actor = search.actor();
        let mut choose =
            |legal: [bool; 4]| actor.choose(&Observation::zeros(), &mut legal.to_vec(), &mut rng);
        assert_eq!(choose([true; 4]), Some(2));
        assert_eq!(choose([true, true, false, true]), Some(0));
        assert_eq!(choose([false; 4]), None);
    }
}
