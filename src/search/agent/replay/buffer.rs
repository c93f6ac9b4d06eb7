//! Proportional prioritised replay (Schaul et al., 2016), and with exponent 0 the plain kind.

use crate::agent::checked::{SettingsError, count, positive, require, unit};
use crate::agent::checkpoint::{Reader, Writer};
use avastra_base::rng;
use avastra_base::rng::Rng;

use super::sum_tree::SumTree;

/// A transition to learn from: a state, the row chosen in it, and the outcome.
#[derive(Debug, Clone, PartialEq)]
pub struct Transition {
    /// Features of the state, shape `(inputs,)`.
    pub inputs: Vec<f32>,
    pub row: u32,
    /// Discounted sum of the rewards on the way to the next state.
    pub reward: f32,
    /// Factor for the value of the next state: 0 if there is none.
    pub discount: f32,
    pub next_inputs: Vec<f32>,
    /// Rows that may be chosen in the next state, shape `(rows,)`.
    pub next_legal: Vec<bool>,
}

/// Settings of [`Replay`]: how many transitions are kept, and how they are drawn.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ReplaySettings {
    /// Transitions that the replay keeps.
    pub replay_capacity: usize,
    /// α of prioritised replay, in `[0, 1]`; 0 draws uniformly.
    pub priority_exponent: f64,
    /// Added to the size of each TD error, so that no priority is 0; above 0.
    pub priority_floor: f64,
    /// Priority of the first transition, before there is any TD error; above 0.
    pub priority_first: f64,
    /// β at the first update, in `[0, 1]`.
    pub importance_begin: f64,
    /// β after `importance_updates` updates and from then on.
    pub importance_end: f64,
    /// Updates over which β goes from `importance_begin` to `importance_end`.
    pub importance_updates: u64,
}

impl ReplaySettings {
    /// # Errors
    /// If a value is out of range.
    pub fn check(&self) -> Result<(), SettingsError> {
        require([
            unit("priority_exponent", self.priority_exponent),
            unit("importance_begin", self.importance_begin),
            unit("importance_end", self.importance_end),
            positive("priority_floor", self.priority_floor),
            positive("priority_first", self.priority_first),
            count("replay_capacity", self.replay_capacity as u64, 1_000_000),
            count("importance_updates", self.importance_updates, 1_000_000_000),
        ])
    }

    /// β after `updates` updates.
    fn importance_exponent(&self, updates: u64) -> f64 {
        let share = (updates as f64 / self.importance_updates as f64).min(1.0);
        self.importance_begin + (self.importance_end - self.importance_begin) * share
    }
}

/// The most recent transitions, up to a capacity.
#[derive(Debug, Clone, PartialEq)]
pub struct Replay {
    settings: ReplaySettings,
    transitions: Vec<Transition>,
    /// Where the next transition goes once the buffer is full.
    next: usize,
    tree: SumTree,
    /// Largest priority so far: what a newcomer gets, so that it is looked at soon.
    priority_max: f64,
}

impl Replay {
    pub fn new(settings: ReplaySettings) -> Replay {
        Replay {
            settings,
            transitions: Vec::new(),
            next: 0,
            tree: SumTree::new(settings.replay_capacity),
            priority_max: settings.priority_first,
        }
    }

    pub(in crate::agent) fn save(&self, bytes: &mut Writer) {
        bytes.u64(self.len() as u64);
        bytes.u64(self.next as u64);
        bytes.f64s(&[self.priority_max]);
        for (at, transition) in self.transitions.iter().enumerate() {
            bytes.f64s(&[self.tree.get(at)]);
            bytes.f32s(&transition.inputs);
            bytes.u64(u64::from(transition.row));
            bytes.f32s(&[transition.reward, transition.discount]);
            bytes.f32s(&transition.next_inputs);
            bytes.flags(&transition.next_legal);
        }
    }

    /// A buffer as it was saved, of transitions with so many inputs and rows; `None` if it has no room for them, the bytes end
    /// too soon, or a priority or a row is none.
    pub(in crate::agent) fn restored(
        settings: ReplaySettings,
        (inputs, rows): (usize, usize),
        bytes: &mut Reader<'_>,
    ) -> Option<Replay> {
        let (count, next) = (bytes.u64()?, bytes.u64()?);
        let is_priority = |value: &f64| *value > 0.0 && value.is_finite();
        let priority_max = Some(bytes.f64s(1)?[0]).filter(is_priority)?;
        let is_place = |next: &usize| *next < settings.replay_capacity;
        let next = usize::try_from(next).ok().filter(is_place)?;
        let count = usize::try_from(count).ok().filter(|count| *count <= settings.replay_capacity)?;
        // Until it is full, the next one stands behind the last.
        if count < settings.replay_capacity && next != count {
            return None;
        }
        let mut replay = Replay { next, priority_max, ..Replay::new(settings) };
        for index in 0..count {
            let priority = Some(bytes.f64s(1)?[0]).filter(is_priority)?;
            let sight = bytes.f32s(inputs)?;
            let row = u32::try_from(bytes.u64()?).ok().filter(|row| (*row as usize) < rows)?;
            let figures = bytes.f32s(2)?;
            let next_inputs = bytes.f32s(inputs)?;
            let next_legal = bytes.flags(rows)?;
            let (reward, discount) = (figures[0], figures[1]);
            let transition = Transition { inputs: sight, row, reward, discount, next_inputs, next_legal };
            replay.transitions.push(transition);
            replay.tree.set(index, priority);
        }
        Some(replay)
    }

    pub fn len(&self) -> usize {
        self.transitions.len()
    }

    /// The last transitions, at most `count`, the newest first.
    pub fn latest(&self, count: usize) -> impl Iterator<Item = &Transition> {
        let capacity = self.settings.replay_capacity;
        let newest = self.next + capacity - 1;
        (0..count.min(self.len())).map(move |back| &self.transitions[(newest - back) % capacity])
    }

    pub fn get(&self, index: usize) -> &Transition {
        &self.transitions[index]
    }

    /// Keeps a transition, in place of the oldest if there is no more room.
    pub fn push(&mut self, transition: Transition) {
        let index = if self.transitions.len() < self.settings.replay_capacity {
            self.transitions.push(transition);
            self.transitions.len() - 1
        } else {
            self.transitions[self.next] = transition;
            self.next
        };
        self.tree.set(index, self.priority_max);
        self.next = (index + 1) % self.settings.replay_capacity;
    }

    /// Draws a batch, one from each of `count` equal parts of the whole mass, with replacement: the index of each
    /// transition and its importance weight, in `(0, 1]`, the largest being 1.
    ///
    /// β, which depends on the updates so far, makes up for the uneven draw: 0 not at all, 1 in full. The buffer must
    /// not be empty.
    pub fn sample(&self, count: usize, updates: u64, rng: &mut Rng) -> Vec<(usize, f32)> {
        let importance_exponent = self.settings.importance_exponent(updates);
        let part = self.tree.total() / count as f64;
        let draw = |nth: usize| {
            let index = self.tree.find(part * (nth as f64 + rng::unit(rng)));
            let probability = self.tree.get(index) / self.tree.total();
            (index, libm::pow(self.len() as f64 * probability, -importance_exponent))
        };
        let drawn: Vec<(usize, f64)> = (0..count).map(draw).collect();
        let weight_max = drawn.iter().map(|(_, weight)| *weight).fold(0.0, f64::max);
        drawn.into_iter().map(|(index, weight)| (index, (weight / weight_max) as f32)).collect()
    }

    /// Sets a priority by a new TD error.
    pub fn update(&mut self, index: usize, td_error: f64) {
        let priority =
            libm::pow(td_error.abs() + self.settings.priority_floor, self.settings.priority_exponent);
        self.priority_max = self.priority_max.max(priority);
        self.tree.set(index, priority);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use avastra_base::rng::{Stream, stream};

    fn transition(reward: f32) -> Transition {
        let (inputs, next_inputs) = (vec![0.0], vec![0.0]);
        Transition { inputs, row: 0, reward, discount: 0.9, next_inputs, next_legal: vec![true] }
    }

    /// A buffer for five; β goes from 0 to 1 in two updates.
    fn empty(priority_exponent: f64) -> Replay {
        Replay::new(ReplaySettings {
            replay_capacity: 5,
            priority_exponent,
            priority_floor: 0.1,
            priority_first: 1.0,
            importance_begin: 0.0,
            importance_end: 1.0,
            importance_updates: 2,
        })
    }

    fn filled(exponent: f64) -> Replay {
        let mut replay = empty(exponent);
        for reward in 0..5 {
            replay.push(transition(reward as f32));
            replay.update(reward, reward as f64);
        }
        replay
    }

    #[test]
    fn it_draws_and_weighs_by_the_formula() {
        for exponent in [0.0, 0.6, 1.0] {
            let (replay, mut rng) = (filled(exponent), stream(3, Stream::Replay, 0));
            let mass = |index: usize| libm::pow(index as f64 + 0.1, exponent);
            let total: f64 = (0..5).map(mass).sum();
            let mut drawn = [0_u32; 5];
            for _ in 0..2000 {
                let samples = replay.sample(10, 1, &mut rng);
                let weight = |index: usize| libm::pow(5.0 * mass(index) / total, -0.5);
                let most = samples.iter().map(|&(index, _)| weight(index)).fold(0.0, f64::max);
                for (index, found) in samples {
                    drawn[index] += 1;
                    assert!((f64::from(found) - weight(index) / most).abs() < 1e-6);
                }
            }
            for (index, &count) in drawn.iter().enumerate() {
                let (found, expected) = (f64::from(count) / 20_000.0, mass(index) / total);
                assert!((found - expected).abs() < 0.01, "{exponent} {index}: {found} {expected}");
            }
        }
    }

    #[test]
    fn the_oldest_gives_way_and_newcomers_come_first() {
        let mut replay = filled(1.0);
        replay.push(transition(9.0));
        assert_eq!((replay.len(), replay.get(0).reward), (5, 9.0));
        assert_eq!(replay.tree.get(0), 4.1);
        replay.push(transition(8.0));
        assert_eq!((replay.get(0).reward, replay.get(1).reward), (9.0, 8.0));
        let latest = |replay: &Replay, count| replay.latest(count).map(|one| one.reward).collect::<Vec<_>>();
        assert_eq!(latest(&replay, 3), [8.0, 9.0, 4.0]);
        assert_eq!(latest(&replay, 9), [8.0, 9.0, 4.0, 3.0, 2.0]);
        let mut short = empty(1.0);
        short.push(transition(7.0));
        assert_eq!(latest(&short, 3), [7.0]);
    }

    fn saved(replay: &Replay) -> Vec<u8> {
        let mut bytes = Writer::new();
        replay.save(&mut bytes);
        bytes.into_bytes()
    }

    fn restored(bytes: &[u8]) -> Option<Replay> {
        Replay::restored(empty(0.6).settings, (1, 1), &mut Reader::new(bytes)?)
    }

    #[test]
    fn it_goes_on_as_the_one_that_was_saved_also_where_it_has_begun_anew() {
        for pushed in 0..12 {
            let mut replay = empty(0.6);
            for number in 0..pushed {
                replay.push(transition(number as f32));
                replay.update(number % 5, f64::from(number as u32));
            }
            let mut again = restored(&saved(&replay)).expect("it was saved");
            for replay in [&mut replay, &mut again] {
                replay.push(transition(-1.0));
            }
            assert_eq!(saved(&replay), saved(&again), "after {pushed}");
            let drawn = |replay: &Replay| replay.sample(8, 1, &mut stream(1, Stream::Replay, 0));
            assert_eq!(drawn(&replay), drawn(&again), "after {pushed}");
        }
    }

    #[test]
    fn bytes_that_end_too_soon_or_hold_no_priority_or_row_are_no_replay() {
        let whole = saved(&filled(0.6));
        assert!(restored(&whole).is_some());
        assert!((0..whole.len()).all(|length| restored(&whole[..length]).is_none()));
        let place =
            |wanted: [u8; 8]| whole.windows(8).position(|window| window == wanted).expect("it was saved");
        let (one, largest) = (filled(0.6).tree.get(2), filled(0.6).priority_max);
        let with = |at: usize, value: [u8; 8]| {
            let mut bytes = whole.clone();
            bytes[at..at + 8].copy_from_slice(&value);
            bytes
        };
        for priority in [one, largest] {
            for broken in [f64::NAN, f64::INFINITY, -1.0, 0.0] {
                let bytes = with(place(priority.to_le_bytes()), broken.to_le_bytes());
                assert!(restored(&bytes).is_none(), "{broken} for {priority}");
            }
        }
        // Where the next one goes, behind the number of transitions: a full replay has begun anew somewhere, one that is not
        // full nowhere.
        let next = Writer::new().into_bytes().len() + 8;
        assert!(restored(&with(next, 4_u64.to_le_bytes())).is_some());
        assert!(restored(&with(next, 5_u64.to_le_bytes())).is_none());
        let mut short = empty(0.6);
        short.push(transition(1.0));
        let mut bytes = saved(&short);
        assert!(restored(&bytes).is_some());
        bytes[next..next + 8].copy_from_slice(&3_u64.to_le_bytes());
        assert!(restored(&bytes).is_none());
        // Behind the first priority and the inputs stands the row, of which there is one.
        let row = place(filled(0.6).tree.get(0).to_le_bytes()) + 8 + 4;
        assert!(restored(&with(row, 0_u64.to_le_bytes())).is_some());
        assert!(restored(&with(row, 1_u64.to_le_bytes())).is_none());
    }
}
