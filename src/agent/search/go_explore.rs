//! Go-Explore (Ecoffet et al., Nature 2021) over the deterministic world: return to a promising moment,
//! then explore from there.
//!
//! Moments are told apart by coarse cells. A moment is returned to by a snapshot, which costs nothing,
//! or, after a kill, by playing its choices again. From there rows are chosen as by a [bandit](super::Bandit), whose
//! record is also what the search leaves behind to act by, on starts that it has never seen; the original trains a
//! policy by imitation at this point. So the bandit alone is its baseline: returning has to add something.

use std::collections::BTreeSet;
use std::sync::Arc;

use ndarray::ArrayView1;

use crate::agent::q_policy::Rows;
use crate::agent::registry::Agent;
use crate::agent::settings::{Configured, SettingsError, require, unit, within};
use crate::agent::trainable::{Beginning, Trainable};
use crate::agent::trajectory::{Lesson, Trajectory};
use crate::mdp::Observation;
use crate::rng;
use crate::rng::{Rng, Stream};

use super::bandit::{BanditSettings, Recorded};
use super::genes::{Gene, Genes};
use super::situation::{cell, situation};
use super::worth::Worth;

/// Settings of [`GoExplore`]; all ours.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GoExploreSettings {
    /// Share of the episodes that begin at a new start, in `[0, 1]`.
    pub fresh_share: f64,
    /// Cells that are kept for each road, at most 100000.
    pub cells_max: usize,
    /// How rows are chosen from there.
    pub choices: BanditSettings,
}

impl Default for GoExploreSettings {
    fn default() -> GoExploreSettings {
        GoExploreSettings { fresh_share: 0.5, cells_max: 2000, choices: BanditSettings::default() }
    }
}

impl Configured for GoExploreSettings {
    type Trained = GoExplore;

    fn check(&self) -> Result<(), SettingsError> {
        require([
            unit("fresh_share", self.fresh_share),
            within("cells_max", self.cells_max, 0..=100_000, "up to 100000"),
        ])?;
        self.choices.check()
    }

    fn build(&self, rows: Arc<Rows>, _: u64) -> GoExplore {
        GoExplore::new(self, rows.allowed.len())
    }

    fn restore(&self, rows: Arc<Rows>, bytes: &[u8]) -> Option<GoExplore> {
        let rows = rows.allowed.len();
        let saved: SavedGoExplore = serde_json::from_slice(bytes).ok()?;
        let genes = || saved.cells.iter().flat_map(|cell| &cell.genes).flatten();
        let fits = saved.worth.is_of(rows) && genes().all(|gene| (gene.row as usize) < rows);
        fits.then(|| GoExplore { saved, ..GoExplore::new(self, rows) })
    }
}

/// The search.
pub struct GoExplore {
    settings: GoExploreSettings,
    saved: SavedGoExplore,
    // The episode under way.
    road: usize,
    /// A seed that no episode had before.
    fresh: u64,
    beginning: Beginning,
    /// Choices since the start of the episode, including those that are repeated.
    genes: Genes,
    step: usize,
    /// The new choices.
    made: Vec<Made>,
    keepsakes: Vec<(usize, usize)>,
}

/// A new choice: its step, the kinds of moment it was made in, and the row.
struct Made {
    step: usize,
    cell: u32,
    situation: u32,
    row: u32,
}

/// What the search keeps from episode to episode.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
struct SavedGoExplore {
    steps: u64,
    cells: Vec<Cell>,
    worth: Worth,
}

/// A moment to return to.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
struct Cell {
    road: usize,
    cell: u32,
    seed: u64,
    /// The choices that lead there.
    genes: Genes,
    /// Episodes that went on from here, and those of them with a collision that counted.
    visits: u32,
    crashes: u32,
}

impl Cell {
    /// How much the search is drawn to it: the share of visits with a crash, squared, with one crash in
    /// three visits added, so that a cell without visits has a chance. Ours.
    fn promise(&self) -> f64 {
        let share = (f64::from(self.crashes) + 1.0) / (f64::from(self.visits) + 3.0);
        share * share
    }
}

impl GoExplore {
    /// A search over so many rows.
    pub fn new(settings: &GoExploreSettings, rows: usize) -> GoExplore {
        GoExplore {
            settings: settings.clone(),
            saved: SavedGoExplore { steps: 0, cells: Vec::new(), worth: Worth::new(rows) },
            road: 0,
            fresh: 0,
            beginning: Beginning { seed: 0, from: None },
            genes: Genes::new(),
            step: 0,
            made: Vec::new(),
            keepsakes: Vec::new(),
        }
    }

    /// The number of first steps whose choices are repeated.
    fn depth(&self) -> usize {
        self.beginning.from.map_or(0, |(_, step)| step)
    }

    /// A random cell of the road, drawn in proportion to its promise.
    fn promising(&self, rng: &mut Rng) -> Option<usize> {
        let here = || self.saved.cells.iter().enumerate().filter(|(_, cell)| cell.road == self.road);
        let total: f64 = here().map(|(_, cell)| cell.promise()).sum();
        let mut mass = rng::unit(rng) * total;
        for (index, cell) in here() {
            mass -= cell.promise();
            if mass < 0.0 {
                return Some(index);
            }
        }
        here().next_back().map(|(index, _)| index)
    }

    /// Keeps the moments of the episode that are of a new kind, up to the first collision: an episode that
    /// went on from a later moment would count that collision again.
    fn remember(&mut self, episode: &Trajectory) {
        let here = self.saved.cells.iter().filter(|cell| cell.road == self.road);
        let mut known: BTreeSet<u32> = here.map(|cell| cell.cell).collect();
        for (made, experience) in self.made.iter().zip(&episode.steps) {
            if made.step > 0 && known.len() < self.settings.cells_max && known.insert(made.cell) {
                self.keepsakes.push((self.saved.cells.len(), made.step));
                self.saved.cells.push(Cell {
                    road: self.road,
                    cell: made.cell,
                    seed: self.beginning.seed,
                    genes: self.genes[..made.step].to_vec(),
                    visits: 0,
                    crashes: 0,
                });
            }
            if experience.collided {
                break;
            }
        }
    }
}

impl Agent for GoExplore {
    fn begin(&mut self) {
        self.genes.truncate(self.depth());
        self.made.clear();
        self.step = 0;
    }

    fn draw_seed(&mut self, step: usize) -> Option<u64> {
        self.step = step;
        let again = self.genes.get(step).copied().flatten().filter(|_| step < self.depth());
        Some(again.map_or(self.fresh, |gene| gene.draw_seed))
    }

    fn choose(&mut self, observation: &Observation, legal: ArrayView1<bool>, _: &mut Rng) -> Option<usize> {
        if self.step < self.depth() {
            return self.genes[self.step].map(|gene| gene.row as usize);
        }
        // Each step has its own stream, so that it does not matter whether earlier steps were played again.
        let mut rng = rng::stream(self.fresh, Stream::Search, 1 + self.step as u64);
        let here = situation(observation);
        let row = self.settings.choices.explore(&self.saved.worth, here, legal, &mut rng)?;
        self.saved.steps += 1;
        if self.genes.len() <= self.step {
            self.genes.resize(self.step + 1, None);
        }
        self.genes[self.step] = Some(Gene { row: row as u32, draw_seed: self.fresh });
        self.made.push(Made { step: self.step, cell: cell(observation), situation: here, row: row as u32 });
        Some(row)
    }
}

impl Trainable for GoExplore {
    fn beginning(&mut self, road: usize, fresh: u64) -> Beginning {
        self.road = road;
        self.fresh = fresh;
        let mut rng = rng::stream(fresh, Stream::Search, 0);
        let begins_anew = rng::unit(&mut rng) < self.settings.fresh_share;
        let cell = if begins_anew { None } else { self.promising(&mut rng) };
        self.beginning = match cell {
            None => Beginning { seed: fresh, from: None },
            Some(index) => {
                let cell = &self.saved.cells[index];
                self.genes.clone_from(&cell.genes);
                Beginning { seed: cell.seed, from: Some((index, cell.genes.len())) }
            }
        };
        self.beginning
    }

    fn learn(&mut self, episode: &Trajectory, _: &mut Rng) -> Lesson {
        assert_eq!(self.made.len(), episode.steps.len(), "each new choice is an experience");
        let made = self.made.iter().map(|made| (made.situation, made.row as usize));
        self.settings.choices.note(&mut self.saved.worth, made, episode);
        if let Some((index, _)) = self.beginning.from {
            let cell = &mut self.saved.cells[index];
            cell.visits += 1;
            cell.crashes += u32::from(episode.steps.iter().any(|step| !step.crashes.is_empty()));
        }
        self.keepsakes.clear();
        self.remember(episode);
        Lesson::default()
    }

    fn keepsakes(&mut self) -> Vec<(usize, usize)> {
        core::mem::take(&mut self.keepsakes)
    }

    fn steps(&self) -> u64 {
        self.saved.steps
    }

    fn exploration_epsilon(&self) -> f64 {
        1.0 - self.settings.choices.record_share
    }

    fn actor(&self) -> Box<dyn Agent> {
        Box::new(Recorded { settings: self.settings.choices.clone(), worth: self.saved.worth.clone() })
    }

    fn save(&self) -> Vec<u8> {
        serde_json::to_vec(&self.saved).expect("a search is plain data")
    }
}
