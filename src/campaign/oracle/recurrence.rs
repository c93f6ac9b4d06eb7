//! How often a finding happens again under other chance.
//!
//! One seed's crash is a candidate. The same scenario is played with other errors of the driving system's sensors, and with
//! others who look at the world at other moments, so that they react by up to 0.1 s sooner or later; all else stays.
//! (`variation` changes the scenario, too.) A finding that is bound to one draw of the noise is a fluke. A driving system
//! of ours whose sensors have no noise (all but `modular`) meets other reactions alone.

use core::fmt;

use crate::episode;
use crate::episode::{EpisodeLog, Moment, Script, Setup};
use avastra_base::rng;
use avastra_base::rng::Stream;
use avastra_base::statistics::proportion;
use avastra_drivers::Selected;
use avastra_world::sim::Start;

use super::case::{Case, Found};

/// How often a finding happened again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Recurrence {
    pub recurred: u32,
    /// At least 1.
    pub replays: u32,
}

impl Recurrence {
    /// Whether it happens again in no more than half of the replays.
    pub fn is_fluke(self) -> bool {
        2 * self.recurred <= self.replays
    }
}

/// With the 95 % interval of the share, after Wilson: `14 of 20 (0.48 to 0.85)`.
impl fmt::Display for Recurrence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (_, [low, high]) = proportion(self.recurred, self.replays);
        write!(f, "{} of {} ({low:.2} to {high:.2})", self.recurred, self.replays)
    }
}

/// An episode, and plays of its scenario under other chance.
pub struct Replayed<'a> {
    setup: &'a Setup,
    log: &'a EpisodeLog,
    again: Vec<EpisodeLog>,
}

impl<'a> Replayed<'a> {
    /// Plays `script`, which led to `log`, so many times more. One step without an action comes after it, so that what only
    /// happens later is still seen.
    pub fn new(setup: &'a Setup, script: &Script, log: &'a EpisodeLog, replays: u32) -> Replayed<'a> {
        let mut script = script.clone();
        script.steps.push(None);
        let play = |number| {
            let setup = Setup {
                ads: setup.ads.clone().with_other_noise(number),
                start: Start {
                    // Never 0, which is the usual order.
                    reactions: rng::child_seed(setup.seed, Stream::Noise, u64::from(number)) | 1,
                    ..setup.start
                },
                ..setup.clone()
            };
            let mut choose = |moment: &Moment| script.choose(moment);
            episode::run(&setup, &mut choose)
        };
        Replayed { setup, log, again: (1..=replays).map(play).collect() }
    }

    /// How often a finding of the log happened again in the first `replays`, of which there must be so many. A collision does
    /// if the ego vehicle hits the same obstacle (and is at fault, if it was), a breach if the requirement is breached. An
    /// obstacle that never appears, because a rule refuses it there, counts as no collision.
    pub fn recurrence(&self, found: Found, replays: u32) -> Recurrence {
        let case = Case::new(self.setup, self.log, found);
        let recurred = self.again[..replays as usize].iter().filter(|log| case.is_again(log)).count();
        Recurrence { recurred: recurred as u32, replays }
    }
}

/// Whether a driving system can be asked for other drives. One outside this program that is known by its recorded answers
/// alone cannot, nor one that was given up.
pub fn can_replay(ads: &Selected) -> bool {
    ads.program().is_none_or(|program| program.can_start() && program.given_up().is_none())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_the_replays_is_a_fluke() {
        assert!(Recurrence { recurred: 10, replays: 20 }.is_fluke());
        assert!(!Recurrence { recurred: 11, replays: 20 }.is_fluke());
        assert_eq!(Recurrence { recurred: 14, replays: 20 }.to_string(), "14 of 20 (0.48 to 0.85)");
    }
}
