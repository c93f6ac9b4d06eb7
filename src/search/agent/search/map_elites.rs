//! MAP-Elites (Mouret and Clune, 2015): of every kind of collision the best script, and new scripts by changing one
//! of those. It looks for collisions of many kinds, where a search for the fittest ends with one.
//!
//! A kind is a cell of mechanism (what the obstacle did), priority (whose it was) and geometry (which side of the ego
//! vehicle met it); an episode belongs to the kind of its first collision that counts, else of its first one, else to
//! a cell of its own: "nothing". A script is a row with its draws for each step, as AV-Fuzzer's here. It is changed
//! where it was played: the world is deterministic, so that a change of one step leaves what came before it.

use std::collections::BTreeMap;
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

use super::genes::start_of;
use super::population::Individual;
use super::scripts::{Found, Scripts};

/// Settings of [`MapElites`]; all ours.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MapElitesSettings {
    /// Share of the episodes that play a random script on a start that no episode had, in `[0, 1]`; the others
    /// change an elite.
    pub fresh_share: f64,
    /// Most steps of an elite that are changed for a new script, from 1 to 100; how many is drawn evenly.
    pub changes_max: u32,
    /// Steps of a script, from 1 to 1000; it begins anew after its end.
    pub elite_steps: usize,
}

impl Default for MapElitesSettings {
    fn default() -> MapElitesSettings {
        MapElitesSettings { fresh_share: 0.25, changes_max: 2, elite_steps: 20 }
    }
}

impl Configured for MapElitesSettings {
    type Trained = MapElites;

    fn check(&self) -> Result<(), SettingsError> {
        require([
            unit("fresh_share", self.fresh_share),
            within("changes_max", self.changes_max, 1..=100, "from 1 to 100"),
            within("elite_steps", self.elite_steps, 1..=1000, "from 1 to 1000"),
        ])
    }

    fn build(&self, rows: Arc<Rows>, _: u64) -> MapElites {
        MapElites::new(self, rows.allowed.len())
    }

    fn restore(&self, rows: Arc<Rows>, bytes: &[u8]) -> Option<MapElites> {
        let rows = rows.allowed.len();
        let saved: SavedMapElites = serde_json::from_slice(bytes).ok()?;
        let fits = |elite: &Elite| elite.script.is_sound(self.elite_steps, rows);
        let fits = saved.elites.iter().flat_map(BTreeMap::values).all(fits);
        fits.then(|| MapElites { saved, ..MapElites::new(self, rows) })
    }
}

/// The search.
pub struct MapElites {
    settings: MapElitesSettings,
    rows: usize,
    saved: SavedMapElites,
    // The episode under way.
    road: usize,
    seed: u64,
    script: Individual,
    step: usize,
    started_at: Option<[f32; 2]>,
}

/// What the search keeps from episode to episode.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
struct SavedMapElites {
    steps: u64,
    /// By road, then by kind of collision.
    elites: Vec<BTreeMap<String, Elite>>,
}

/// The best script of a cell.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
struct Elite {
    /// Seed of the episode's start.
    seed: u64,
    start: [f32; 2],
    script: Individual,
    /// Collisions that counted.
    crashes: usize,
}

impl Elite {
    /// Whether it is better than another of its cell: more collisions count, or else an obstacle came closer.
    fn beats(&self, other: &Elite) -> bool {
        (self.crashes, self.script.fitness) > (other.crashes, other.script.fitness)
    }
}

impl MapElites {
    /// A search over scripts of so many rows.
    pub fn new(settings: &MapElitesSettings, rows: usize) -> MapElites {
        MapElites {
            settings: settings.clone(),
            rows,
            saved: SavedMapElites::default(),
            road: 0,
            seed: 0,
            script: Individual { genes: Vec::new(), fitness: 0.0 },
            step: 0,
            started_at: None,
        }
    }
}

impl Agent for MapElites {
    fn begin(&mut self) {
        self.step = 0;
        self.started_at = None;
    }

    fn draw_seed(&mut self, step: usize) -> Option<u64> {
        self.step = step;
        self.script.gene(step).map(|gene| gene.draw_seed)
    }

    fn choose(&mut self, observation: &Observation, legal: ArrayView1<bool>, rng: &mut Rng) -> Option<usize> {
        self.saved.steps += 1;
        self.started_at.get_or_insert(start_of(observation));
        match self.script.gene(self.step) {
            Some(gene) => gene.legal_row(self.step, legal),
            None => any(legal, rng),
        }
    }
}

impl Trainable for MapElites {
    fn start_seed(&mut self, road: usize, fresh: u64) -> u64 {
        self.road = road;
        if self.saved.elites.len() <= road {
            self.saved.elites.resize(road + 1, BTreeMap::new());
        }
        let mut rng = rng::stream(fresh, Stream::Search, 0);
        let elites = &self.saved.elites[road];
        let chosen = match rng::unit(&mut rng) < self.settings.fresh_share {
            false if !elites.is_empty() => {
                elites.values().nth(rng::below(&mut rng, elites.len() as u32) as usize)
            }
            _ => None,
        };
        (self.seed, self.script) = match chosen {
            None => (fresh, Individual::random(self.settings.elite_steps, self.rows, &mut rng)),
            Some(elite) => {
                let mut script = elite.script.clone();
                for _ in 0..=rng::below(&mut rng, self.settings.changes_max) {
                    script.change(self.rows, &mut rng);
                }
                (elite.seed, script)
            }
        };
        self.seed
    }

    fn learn(&mut self, episode: &Trajectory, _: &mut Rng) -> Result<Lesson, Diverged> {
        let found = Elite {
            seed: self.seed,
            start: self.started_at.unwrap_or_default(),
            script: Individual { fitness: episode.closeness.fitness(), ..self.script.clone() },
            crashes: episode.steps.iter().map(|step| step.crashes.len()).sum(),
        };
        let kinds = &episode.collisions;
        let kind = kinds.iter().find(|collision| collision.counted).or(kinds.first());
        let cell = kind.map_or_else(|| "nothing".to_owned(), |collision| collision.kind.clone());
        let elites = &mut self.saved.elites[self.road];
        if elites.get(&cell).is_none_or(|elite| found.beats(elite)) {
            elites.insert(cell, found);
        }
        Ok(Lesson::default())
    }

    fn steps(&self) -> u64 {
        self.saved.steps
    }

    /// Plays the elites whose collisions counted, or all if there is none.
    fn actor(&self) -> Box<dyn Agent> {
        let elites = || self.saved.elites.iter().flat_map(BTreeMap::values);
        let any_counts = elites().any(|elite| elite.crashes > 0);
        let found = elites().filter(|elite| elite.crashes > 0 || !any_counts).map(|elite| Found {
            start: elite.start,
            rows: elite.script.rows(),
            crashes: elite.crashes,
            fitness: elite.script.fitness,
        });
        Box::new(Scripts::new(found.collect()))
    }

    fn save(&self) -> Vec<u8> {
        serde_json::to_vec(&self.saved).expect("a search is plain data")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::agent::trajectory::Collided;
    use crate::mdp::Closeness;

    /// An episode with these collisions, and an obstacle that came this close.
    fn episode(collisions: &[(&str, bool)], distance_m: f64) -> Trajectory {
        let collided = |&(kind, counted): &(&str, bool)| Collided { kind: kind.to_owned(), counted };
        Trajectory {
            closeness: Closeness { distance_m, margin_m: 0.0 },
            collisions: collisions.iter().map(collided).collect(),
            ..Trajectory::plain(Vec::new(), 4)
        }
    }

    #[test]
    fn each_kind_keeps_its_best() {
        let settings = MapElitesSettings { elite_steps: 3, fresh_share: 0.0, ..MapElitesSettings::default() };
        let mut search = MapElites::new(&settings, 4);
        let mut rng = rng::stream(1, Stream::Replay, 0);
        let mut play = |search: &mut MapElites, fresh, played: &Trajectory| {
            let seed = search.start_seed(0, fresh);
            search.learn(played, &mut rng).unwrap();
            (seed, search.script.rows())
        };
        // The first start is fresh, because nothing is known; from then on that episode is changed.
        let (first, _) = play(&mut search, 5, &episode(&[], 9.0));
        assert_eq!(first, 5);
        let cells = |search: &MapElites| -> Vec<(String, u64)> {
            let elites = search.saved.elites[0].iter();
            elites.map(|(kind, elite)| (kind.clone(), elite.script.fitness as u64)).collect()
        };
        let (second, _) = play(&mut search, 6, &episode(&[("walk", false), ("overtake", true)], 2.0));
        assert_eq!(second, 5);
        play(&mut search, 7, &episode(&[("walk", false)], 4.0));
        play(&mut search, 8, &episode(&[("walk", false)], 8.0));
        play(&mut search, 9, &episode(&[], 5.0));
        let found = [("nothing", 127), ("overtake", 129), ("walk", 128)];
        assert_eq!(cells(&search), found.map(|(kind, fitness)| (kind.to_owned(), fitness)));
    }

    #[test]
    fn a_changed_script_differs_in_few_steps_and_stays_where_it_was_played() {
        let settings = MapElitesSettings { fresh_share: 0.0, ..MapElitesSettings::default() };
        let mut search = MapElites::new(&settings, 45);
        let mut rng = rng::stream(1, Stream::Replay, 0);
        search.start_seed(0, 1);
        search.learn(&episode(&[], 9.0), &mut rng).unwrap();
        let elite = search.script.clone();
        for fresh in 2..50 {
            assert_eq!(search.start_seed(0, fresh), 1);
            let differ = search.script.genes.iter().zip(&elite.genes).filter(|(new, old)| new != old).count();
            assert!((1..=2).contains(&differ), "{differ} steps");
        }
    }
}
