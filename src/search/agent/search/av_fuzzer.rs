//! AV-Fuzzer's genetic search (Li et al., ISSRE 2020; constants after its published code), for our
//! actions.
//!
//! There an individual is two other vehicles, each with a speed and a manoeuvre for each of five time
//! slices, on one start. Here it is a script: a row with its draws for each step. The part of one
//! vehicle, which crossover swaps whole, is one step, because everything that a vehicle does lies in the
//! row that makes it appear; a new speed is a new draw. A row that is not legal when its turn comes is
//! replaced for good by a random legal one. Each restart of the search also takes a new start: the
//! published search knows one start, and would say nothing about others.

use std::sync::Arc;

use ndarray::ArrayView1;

use crate::agent::q_policy::Rows;
use crate::agent::random::any;
use crate::agent::registry::Agent;
use crate::agent::settings::{Configured, SettingsError, require, unit, within};
use crate::agent::trainable::{Diverged, Trainable};
use crate::agent::trajectory::{Lesson, Trajectory};
use crate::mdp::Observation;
use avastra_base::rng;
use avastra_base::rng::{Rng, Stream};

use super::genes::{Gene, seed, start_of};
use super::population::{Individual, Population};
use super::scripts::{Found, Scripts, keep};

/// Settings of [`AvFuzzer`]. `default()` is as published; "ours" marks what our actions ask for.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AvFuzzerSettings {
    /// Individuals of a generation, from 2 to 1000.
    pub population: usize,
    /// Probability that a try at crossover swaps, in `[0, 1]`.
    pub crossover_probability: f64,
    /// Probability that an individual is changed in a generation, in `[0, 1]`.
    pub mutation_probability: f64,
    /// The search restarts if a generation's best is not above the mean best of this many generations; at
    /// least 1.
    pub restart_generations: usize,
    /// Random scripts from which a restart takes those that are least like all before; from `population`
    /// to 100000.
    pub restart_candidates: usize,
    /// Generations after a restart before the local search may begin.
    pub local_after_generations: usize,
    /// Generations of the local search around the best individual; 0: none.
    pub local_generations: usize,
    /// How many times as likely a change is in the local search, from 0 to 100.
    pub local_mutation_factor: f64,
    /// Steps of a script, from 1 to 1000; it begins anew after its end. Ours: the space's limit.
    pub script_steps: usize,
    /// Scripts for each start that are kept to act by, from 1 to 1000. Ours.
    pub kept_scripts: usize,
}

impl Default for AvFuzzerSettings {
    fn default() -> AvFuzzerSettings {
        AvFuzzerSettings {
            population: 4,
            crossover_probability: 0.4,
            mutation_probability: 0.4,
            restart_generations: 5,
            restart_candidates: 1000,
            local_after_generations: 2,
            local_generations: 5,
            local_mutation_factor: 1.5,
            script_steps: 20,
            kept_scripts: 10,
        }
    }
}

impl Configured for AvFuzzerSettings {
    type Trained = AvFuzzer;

    fn check(&self) -> Result<(), SettingsError> {
        require([
            within("population", self.population, 2..=1000, "from 2 to 1000"),
            unit("crossover_probability", self.crossover_probability),
            unit("mutation_probability", self.mutation_probability),
            within("local_mutation_factor", self.local_mutation_factor, 0.0..=100.0, "from 0 to 100"),
            within("restart_generations", self.restart_generations, 1..=100_000, "from 1 to 100000"),
            within(
                "restart_candidates",
                self.restart_candidates,
                self.population..=100_000,
                "from `population` to 100000",
            ),
            within("script_steps", self.script_steps, 1..=1000, "from 1 to 1000"),
            within("kept_scripts", self.kept_scripts, 1..=1000, "from 1 to 1000"),
        ])
    }

    fn build(&self, rows: Arc<Rows>, _: u64) -> AvFuzzer {
        AvFuzzer::new(self, rows.allowed.len())
    }

    fn restore(&self, rows: Arc<Rows>, bytes: &[u8]) -> Option<AvFuzzer> {
        let rows = rows.allowed.len();
        let saved: SavedAvFuzzer = serde_json::from_slice(bytes).ok()?;
        let fits = saved.hunts.iter().flatten().all(|hunt| {
            let populations = [Some(&hunt.population), hunt.local.as_ref().map(|(population, _)| population)];
            let size = self.population;
            let is_sound = |population: &Population| population.is_sound(size, self.script_steps, rows);
            populations.into_iter().flatten().all(is_sound)
                && !hunt.queue.is_empty()
                && hunt.queue.iter().all(|&index| index < size)
        });
        let can_act =
            |found: &Found| !found.rows.is_empty() && found.rows.iter().all(|&row| (row as usize) < rows);
        let fits = fits && saved.best.iter().all(can_act);
        fits.then(|| AvFuzzer { saved, ..AvFuzzer::new(self, rows) })
    }
}

/// The search, one for each road.
pub struct AvFuzzer {
    settings: AvFuzzerSettings,
    rows: usize,
    saved: SavedAvFuzzer,
    // The episode under way.
    road: usize,
    step: usize,
    started_at: Option<[f32; 2]>,
}

/// What the search keeps from episode to episode.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
struct SavedAvFuzzer {
    steps: u64,
    hunts: Vec<Option<Hunt>>,
    best: Vec<Found>,
}

/// The search on one road.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
struct Hunt {
    start_seed: u64,
    population: Population,
    /// Individuals that are still to be played, the last first.
    queue: Vec<usize>,
    generation: usize,
    last_restart: usize,
    /// Fitness of the best of each generation since the restart.
    bests: Vec<f64>,
    best_since_restart: f64,
    /// The search around the best, while it is under way, and its generation.
    local: Option<(Population, usize)>,
    /// Rows of the scripts of former generations.
    former: Vec<Vec<u32>>,
}

impl Hunt {
    fn new(settings: &AvFuzzerSettings, rows: usize, start_seed: u64) -> Hunt {
        let mut rng = rng::stream(start_seed, Stream::Search, 0);
        let population = Population::random(settings.population, settings.script_steps, rows, &mut rng);
        Hunt {
            start_seed,
            queue: population.all(),
            population,
            generation: 0,
            last_restart: 0,
            bests: Vec::new(),
            best_since_restart: 0.0,
            local: None,
            former: Vec::new(),
        }
    }

    fn played(&mut self) -> &mut Individual {
        let index = *self.queue.last().expect("there is always an individual to play");
        let population = self.local.as_mut().map_or(&mut self.population, |(population, _)| population);
        &mut population.individuals[index]
    }

    /// Goes on to the next generation that has an individual to play.
    fn advance(&mut self, settings: &AvFuzzerSettings, rows: usize, rng: &mut Rng) {
        while self.queue.is_empty() {
            self.queue = match self.local.take() {
                Some((population, generation)) => {
                    self.search_around(population, generation, settings, rows, rng)
                }
                None => self.generation(settings, rows, rng),
            };
        }
    }

    /// A generation of the main search has been played: what is to be played next.
    fn generation(&mut self, settings: &AvFuzzerSettings, rows: usize, rng: &mut Rng) -> Vec<usize> {
        let best = self.population.best().clone();
        self.former.extend(self.population.individuals.iter().map(Individual::rows));
        self.bests.push(best.fitness);
        self.generation += 1;
        let recent = &self.bests[self.bests.len().saturating_sub(settings.restart_generations)..];
        let mean = recent.iter().sum::<f64>() / recent.len() as f64;
        if self.generation >= self.last_restart + settings.restart_generations && mean >= best.fitness {
            return self.restart(settings, rows, rng);
        }
        let is_better = best.fitness > self.best_since_restart;
        self.best_since_restart = self.best_since_restart.max(best.fitness);
        if is_better
            && settings.local_generations > 0
            && self.generation > self.last_restart + settings.local_after_generations
        {
            let around = Population::around(&best, settings.population, rows, rng);
            let queue = around.all();
            self.local = Some((around, 0));
            return queue;
        }
        self.population.breed(settings.crossover_probability, settings.mutation_probability, rows, rng)
    }

    /// A generation of the local search has been played: what is to be played next.
    fn search_around(
        &mut self,
        mut population: Population,
        generation: usize,
        settings: &AvFuzzerSettings,
        rows: usize,
        rng: &mut Rng,
    ) -> Vec<usize> {
        let (crossover, mutation) = (settings.crossover_probability, settings.mutation_probability);
        if generation + 1 >= settings.local_generations {
            let found = population.best().clone();
            let best = self.population.best_mut();
            if found.fitness > best.fitness {
                *best = found;
            }
            return self.population.breed(crossover, mutation, rows, rng);
        }
        let mutation = (mutation * settings.local_mutation_factor).min(1.0);
        let queue = population.breed(crossover, mutation, rows, rng);
        self.local = Some((population, generation + 1));
        queue
    }

    /// Begins anew with the random scripts that are least like all former ones.
    fn restart(&mut self, settings: &AvFuzzerSettings, rows: usize, rng: &mut Rng) -> Vec<usize> {
        let candidates = Population::random(settings.restart_candidates, settings.script_steps, rows, rng);
        self.population = candidates.least_like(&self.former, settings.population);
        self.start_seed = seed(rng);
        self.last_restart = self.generation;
        self.bests.clear();
        self.best_since_restart = 0.0;
        self.population.all()
    }
}

impl AvFuzzer {
    /// A search over scripts of so many rows.
    pub fn new(settings: &AvFuzzerSettings, rows: usize) -> AvFuzzer {
        let (settings, saved) = (settings.clone(), SavedAvFuzzer::default());
        AvFuzzer { settings, rows, saved, road: 0, step: 0, started_at: None }
    }

    fn hunt(&mut self) -> Option<&mut Hunt> {
        self.saved.hunts.get_mut(self.road)?.as_mut()
    }

    fn gene(&mut self) -> Option<&mut Gene> {
        let step = self.step;
        self.hunt()?.played().gene(step)
    }
}

impl Agent for AvFuzzer {
    fn begin(&mut self) {
        self.step = 0;
        self.started_at = None;
    }

    fn draw_seed(&mut self, step: usize) -> Option<u64> {
        self.step = step;
        self.gene().map(|gene| gene.draw_seed)
    }

    fn choose(&mut self, observation: &Observation, legal: ArrayView1<bool>, rng: &mut Rng) -> Option<usize> {
        self.saved.steps += 1;
        self.started_at.get_or_insert(start_of(observation));
        let step = self.step;
        match self.gene() {
            Some(gene) => gene.legal_row(step, legal),
            None => any(legal, rng),
        }
    }
}

impl Trainable for AvFuzzer {
    fn start_seed(&mut self, road: usize, fresh: u64) -> u64 {
        self.road = road;
        if self.saved.hunts.len() <= road {
            self.saved.hunts.resize(road + 1, None);
        }
        let (settings, rows) = (&self.settings, self.rows);
        let hunt = self.saved.hunts[road].get_or_insert_with(|| Hunt::new(settings, rows, fresh));
        hunt.start_seed
    }

    fn learn(&mut self, episode: &Trajectory, rng: &mut Rng) -> Result<Lesson, Diverged> {
        let crashes = episode.steps.iter().map(|step| step.crashes.len()).sum();
        let fitness = episode.closeness.fitness();
        let start = self.started_at.unwrap_or_default();
        let (settings, rows) = (self.settings.clone(), self.rows);
        let Some(hunt) = self.hunt() else { return Ok(Lesson::default()) };
        let individual = hunt.played();
        individual.fitness = fitness;
        let rows_played = individual.rows();
        hunt.queue.pop();
        hunt.advance(&settings, rows, rng);
        let found = Found { start, rows: rows_played, crashes, fitness };
        keep(&mut self.saved.best, found, settings.kept_scripts);
        Ok(Lesson::default())
    }

    fn steps(&self) -> u64 {
        self.saved.steps
    }

    fn actor(&self) -> Box<dyn Agent> {
        Box::new(Scripts::new(self.saved.best.clone()))
    }

    fn save(&self) -> Vec<u8> {
        serde_json::to_vec(&self.saved).expect("a search is plain data")
    }
}
