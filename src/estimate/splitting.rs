//! Adaptive multilevel splitting (Cérou and Guyader 2007, with the treatment of ties of Bréhier et al., Annals of
//! Applied Probability 26, 2016, which keeps it unbiased).
//!
//! Episodes are played to their end, each with a score: the least time to collision that it came to, in levels. Those
//! of the lowest scores are given up, and each is replaced by a branch of one that came further: a copy up to the
//! moment at which that first came further, and from there with other seeds, so that sensors, drivers and actions fall
//! out otherwise. Each round multiplies the estimate by the share that survived. When a collision is at the top
//! of enough episodes, the share of them with the event ends the product.
//!
//! A branch is the episode of a setup with [`Fork`]s, and so can be played again and judged like any other.

use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::ads::Ads;
use crate::episode;
use crate::episode::{EpisodeLog, Fork, Moment, Play, Setup};
use crate::mdp::{Criticality, TTC_S_MAX};
use crate::rng;
use crate::rng::{Rng, Stream};
use crate::run::choose;
use crate::sim::{Contact, DT_S, World};

use crate::estimate::part::{Part, PartRecord, Played};
use crate::estimate::ready::Estimate;

/// Share of the episodes that are given up in a round, at least. Ours.
const GIVEN_UP: f64 = 0.2;
/// Levels between no expected contact within [`TTC_S_MAX`] and a contact.
const LEVELS: u32 = 64;
/// The level of a contact.
const TOP: u32 = LEVELS + 1;

/// An episode with what is needed to branch off it.
#[derive(Clone)]
struct Path {
    /// Number of the episode that it began as.
    number: u32,
    forks: Vec<Fork>,
    log: Rc<EpisodeLog>,
    /// Each level above all before it, with the tick at which it was reached.
    rises: Vec<(u32, u64)>,
    /// The moments at which actions were chosen, with their ticks.
    moments: Vec<(u64, Rc<Play>)>,
}

impl Path {
    /// The highest level that it reached.
    fn score(&self) -> u32 {
        self.rises.last().map_or(0, |(level, _)| *level)
    }

    /// The first tick above a level, if it came above it.
    fn above(&self, level: u32) -> Option<u64> {
        self.rises.iter().find(|(reached, _)| *reached > level).map(|(_, tick)| *tick)
    }
}

/// One run of the method; `None` if it was stopped.
pub fn split(estimate: &Estimate, part: Part, stop: &AtomicBool) -> Option<Played> {
    let mut record = PartRecord::new(part);
    let mut rng = rng::stream(estimate.seed(part), Stream::Estimate, 0);
    let wanted = estimate.settings().run.episodes;
    let mut paths = Vec::new();
    for number in 0..wanted {
        if stop.load(Ordering::Relaxed) {
            return None;
        }
        let path = play(estimate, part, number, Vec::new(), None, &mut record);
        record.note_whole(&path.log);
        paths.push(path);
    }
    let mut grow = |parent: &Path, level: u32, rng: &mut Rng| {
        let goes_on = !stop.load(Ordering::Relaxed);
        goes_on.then(|| branch(estimate, part, parent, level, rng, &mut record))
    };
    let (probability, levels) = rounds(&mut paths, &Path::score, &mut rng, &mut grow)?;
    record.levels = levels;
    // After extinction nothing has the event, and the estimate is 0.
    if probability > 0.0 {
        let happened = |path: &&Path| {
            path.score() == TOP
                && estimate
                    .event(&setup(estimate, part, path.number, path.forks.clone()), &path.log)
                    .is_some()
        };
        record.events = paths.iter().filter(happened).count() as u32;
    }
    record.probability = probability * f64::from(record.events) / f64::from(wanted);
    Some(Played { record, met: Vec::new() })
}

/// Gives the lowest paths up and replaces them by branches of the others, round by round, until enough are at the top: the
/// product of the shares that survived, which is 0 after extinction, and the number of rounds. `grow` branches off a parent that came above
/// a level, there; where it gives nothing, there is no result.
fn rounds<P>(
    paths: &mut [P],
    score: &dyn Fn(&P) -> u32,
    rng: &mut Rng,
    grow: &mut dyn FnMut(&P, u32, &mut Rng) -> Option<P>,
) -> Option<(f64, u32)> {
    let (mut probability, mut rounds) = (1.0, 0);
    loop {
        let scores: Vec<u32> = paths.iter().map(score).collect();
        let level = level_to_leave(&scores);
        if level >= TOP {
            return Some((probability, rounds));
        }
        let (gone, alive): (Vec<usize>, Vec<usize>) =
            (0..paths.len()).partition(|&index| scores[index] <= level);
        probability *= alive.len() as f64 / paths.len() as f64;
        rounds += 1;
        if alive.is_empty() {
            return Some((0.0, rounds));
        }
        for index in gone {
            let parent = &paths[alive[rng::below(rng, alive.len() as u32) as usize]];
            paths[index] = grow(parent, level, rng)?;
        }
    }
}

/// The lowest level up to which enough episodes stayed.
fn level_to_leave(scores: &[u32]) -> u32 {
    let mut scores = scores.to_vec();
    scores.sort_unstable();
    scores[(GIVEN_UP * scores.len() as f64).ceil() as usize - 1]
}

/// A copy of an episode up to the moment at which it first came above a level, and from there by other seeds.
fn branch(
    estimate: &Estimate,
    part: Part,
    parent: &Path,
    level: u32,
    rng: &mut Rng,
    record: &mut PartRecord,
) -> Path {
    let tick = parent.above(level).expect("the parent came above the level");
    let mut forks: Vec<Fork> = parent.forks.iter().copied().filter(|fork| fork.tick < tick).collect();
    forks.push(Fork { tick, seed: seed(rng) });
    play(estimate, part, parent.number, forks, Some((parent, tick)), record)
}

fn seed(rng: &mut Rng) -> u64 {
    use rand::Rng as _;
    rng.next_u64()
}

fn setup(estimate: &Estimate, part: Part, number: u32, forks: Vec<Fork>) -> Setup<'_> {
    Setup { forks, ..estimate.setup(part, number) }
}

/// Plays an episode to its end; with a parent from its last choice before a tick.
fn play(
    estimate: &Estimate,
    part: Part,
    number: u32,
    forks: Vec<Fork>,
    parent: Option<(&Path, u64)>,
    record: &mut PartRecord,
) -> Path {
    let setup = setup(estimate, part, number, forks);
    let mut moments: Vec<(u64, Rc<Play>)> = Vec::new();
    let mut score = Score::default();
    if let Some((parent, tick)) = parent {
        // At a fork's own tick the choice is made anew.
        moments.extend(parent.moments.iter().filter(|(at, _)| *at <= tick).cloned());
        let (from, _) = moments.last().expect("an episode begins with a choice");
        score.rises = parent.rises.iter().copied().filter(|(_, reached)| reached <= from).collect();
    }
    let from = moments.pop();
    let first_tick = from.as_ref().map_or(0, |(tick, _)| *tick);
    let mut agent = estimate.run().agent();
    agent.begin();
    let mut choices = |moment: &Moment| {
        moments.push((moment.ticks(), Rc::new(moment.snapshot())));
        choose(agent.as_mut(), moment).0
    };
    let log = episode::run_from(
        &setup,
        from.map(|(_, snapshot)| Play::clone(&snapshot)),
        &mut choices,
        &mut |world: &World, _: &dyn Ads, contacts: &[Contact]| score.note(world, contacts),
        &mut |_| {},
    );
    record.simulated_s += (log.ticks - first_tick) as f64 * DT_S + agent.branched_s();
    let forks = setup.forks;
    Path { number, forks, log: Rc::new(log), rises: score.rises, moments }
}

/// How far an episode came.
#[derive(Default)]
struct Score {
    rises: Vec<(u32, u64)>,
}

impl Score {
    /// Takes in a tick.
    fn note(&mut self, world: &World, contacts: &[Contact]) {
        let best = self.rises.last().map_or(0, |(level, _)| *level);
        if best == TOP {
            return;
        }
        let level = if contacts.is_empty() { level(world) } else { TOP };
        if level > best {
            self.rises.push((level, world.ticks()));
        }
    }
}

/// The level of a moment: the sooner a contact is to be expected, the higher.
fn level(world: &World) -> u32 {
    let mut now = Criticality::default();
    now.note(world, &|_| false);
    now.ttc_s.map_or(0, |ttc_s| 1 + ((1.0 - ttc_s / TTC_S_MAX) * f64::from(LEVELS - 1)) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::variance_of_mean;

    /// How far a climber comes who leaves each level with this probability, from a level on.
    fn climb(from: u32, onwards: f64, rng: &mut Rng) -> u32 {
        let mut level = from;
        while level < TOP && rng::unit(rng) < onwards {
            level += 1;
        }
        level
    }

    /// What the rounds say of climbers: the probability that one comes to the top.
    fn estimated(climbers: usize, onwards: f64, rng: &mut Rng) -> (f64, u32) {
        let mut heights: Vec<u32> = (0..climbers).map(|_| climb(0, onwards, rng)).collect();
        let mut grow = |parent: &u32, level: u32, rng: &mut Rng| {
            assert!(*parent > level, "a parent came above the level that is left");
            Some(climb(level + 1, onwards, rng))
        };
        let (probability, rounds) = rounds(&mut heights, &|height| *height, rng, &mut grow).unwrap();
        let at_top = heights.iter().filter(|&&height| height == TOP).count();
        (probability * at_top as f64 / climbers as f64, rounds)
    }

    #[test]
    fn rounds_have_no_bias_and_ties_do_not_matter() {
        // A probability of a thousandth, by levels of which each is left by nine of ten: most scores are shared.
        let onwards: f64 = 0.9;
        let truth = libm::pow(onwards, f64::from(TOP));
        let mut rng = rng::stream(3, Stream::Estimate, 0);
        let found: Vec<f64> = (0..2000).map(|_| estimated(20, onwards, &mut rng).0).collect();
        let mean = found.iter().sum::<f64>() / found.len() as f64;
        let error = variance_of_mean(&found).sqrt();
        assert!((mean - truth).abs() < 4.0 * error, "{mean} against {truth}, give or take {error}");
        // Far better than counting twenty climbers, whose variance is that of a rare event.
        assert!(error * error * 2000.0 < truth / 20.0 / 10.0, "{error}");
    }

    #[test]
    fn rounds_end_at_the_top_and_at_extinction() {
        let mut rng = rng::stream(1, Stream::Estimate, 0);
        assert_eq!(estimated(20, 1.0, &mut rng), (1.0, 0), "all are at the top at once");
        let (probability, rounds) = estimated(20, 0.0, &mut rng);
        assert_eq!((probability, rounds), (0.0, 1), "nobody leaves the ground");
        let mut heights = vec![0, 1, 2];
        let stopped = super::rounds(&mut heights, &|height| *height, &mut rng, &mut |_, _, _| None);
        assert_eq!(stopped, None);
    }
}
