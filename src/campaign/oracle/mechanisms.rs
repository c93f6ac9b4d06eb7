//! The share of crashes that each documented weakness causes: how many vanish when it alone is off.
//!
//! As for a cause (see `cause`), the mended system takes over when the obstacle appears, so that it meets the same
//! hazard. If the play ends in another crash, the crash does not count as vanished.
//! **Chance.** Any change to a near crash may save it: other sensor noise alone, with nothing mended, makes some
//! crashes vanish. That is the placebo. So each crash is also played with [`NOISES`] other noises, once with nothing
//! mended and once without each weakness. A weakness causes only what vanishes *beyond* the placebo of the same noises.
//! Left out: the mended system from the start. By the time of the hazard it is elsewhere, so it meets another hazard or
//! none.

use crate::episode::{EpisodeLog, Setup};
use avastra_base::statistics;
use avastra_base::statistics::{Estimate, proportion};
use avastra_drivers::{ModularConfig, Weaknesses};

use super::case::{Case, Fate, Found};
use super::cause::{Inquiry, NoModules};

/// Number of replays with other sensor noise, of each crash and each weakness.
const NOISES: u32 = 8;

/// The fate of a crash without each documented weakness that is switched on.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Mechanisms {
    /// Share of the replays with other sensor noise alone in which the crash vanishes.
    pub placebo: f64,
    pub without: Vec<WithoutMechanism>,
}

/// A crash with one documented weakness switched off.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct WithoutMechanism {
    pub mechanism: &'static str,
    pub fate: Fate,
    /// Share of the replays with other sensor noise in which the crash vanishes; to compare with the placebo.
    pub vanished: f64,
}

/// A finding of a log that was played from `setup`, without each of the weaknesses that are
/// switched on.
///
/// # Errors
/// If the driving system has no modules.
pub fn mechanisms(setup: &Setup, log: &EpisodeLog, found: Found) -> Result<Mechanisms, NoModules> {
    let case = Case::new(setup, log, found);
    let inquiry = Inquiry::new(&case)?;
    let vanished = |profile: &ModularConfig| {
        let vanished = (1..=NOISES).filter(|noise| inquiry.vanishes(profile, *noise)).count();
        vanished as f64 / f64::from(NOISES)
    };
    let each = inquiry.profile.weaknesses.each_off().into_iter();
    let without = each.map(|(mechanism, weaknesses)| {
        let mended = ModularConfig { weaknesses, ..inquiry.profile };
        WithoutMechanism { mechanism, fate: inquiry.fate(&mended), vanished: vanished(&mended) }
    });
    Ok(Mechanisms { without: without.collect(), placebo: vanished(&inquiry.profile) })
}

/// How many of many crashes vanish without one weakness.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct MechanismShare {
    pub mechanism: &'static str,
    /// Crashes of a system that has it.
    pub crashes: u32,
    /// With the noise of the crash.
    pub as_it_was: Share,
    /// Mean share with other noise, and what is left of it without the placebo; `None` without crashes.
    pub other_noise: Option<Estimate>,
    pub beyond_chance: Option<Estimate>,
}

/// How many crashes vanish.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Share {
    pub vanished: u32,
    /// Plays that crash into another road user instead.
    pub other: u32,
    /// Share of the crashes that vanish; 0 if there are none.
    pub share: f64,
    /// 95 % interval of the share, after Wilson.
    pub low: f64,
    pub high: f64,
}

/// The shares of all weaknesses over many crashes.
pub fn mechanism_shares(crashes: &[Mechanisms]) -> Vec<MechanismShare> {
    let share_of = |mechanism| {
        let found: Vec<(&WithoutMechanism, f64)> = crashes
            .iter()
            .flat_map(|crash| crash.without.iter().map(|without| (without, crash.placebo)))
            .filter(|(without, _)| without.mechanism == mechanism)
            .collect();
        let vanished: Vec<f64> = found.iter().map(|(without, _)| without.vanished).collect();
        let beyond: Vec<f64> = found.iter().map(|(without, placebo)| without.vanished - placebo).collect();
        MechanismShare {
            mechanism,
            crashes: found.len() as u32,
            as_it_was: share(found.iter().map(|(without, _)| without.fate)),
            other_noise: statistics::mean(&vanished),
            beyond_chance: statistics::mean(&beyond),
        }
    };
    Weaknesses::NAMES.iter().copied().map(share_of).collect()
}

/// The mean placebo of many crashes; `None` without any.
pub fn placebo(crashes: &[Mechanisms]) -> Option<Estimate> {
    statistics::mean(&crashes.iter().map(|crash| crash.placebo).collect::<Vec<f64>>())
}

fn share(fates: impl Iterator<Item = Fate> + Clone) -> Share {
    let count = |wanted: Fate| fates.clone().filter(|fate| *fate == wanted).count() as u32;
    let (crashes, vanished) = (fates.clone().count() as u32, count(Fate::Vanished));
    let (share, [low, high]) = proportion(vanished, crashes);
    Share { vanished, other: count(Fate::Other), share, low, high }
}

#[cfg(test)]
mod tests {
    use super::*;
    use avastra_base::statistics::wilson;

    #[test]
    fn a_share_counts_what_vanishes_among_all_crashes_of_a_system_that_has_the_weakness() {
        let without = |mechanism, fate, vanished| WithoutMechanism { mechanism, fate, vanished };
        let [a, b] = [Weaknesses::NAMES[0], Weaknesses::NAMES[1]];
        let crashes = [
            Mechanisms {
                placebo: 0.5,
                without: vec![without(a, Fate::Vanished, 0.75), without(b, Fate::Same, 0.5)],
            },
            Mechanisms { placebo: 0.25, without: vec![without(a, Fate::Vanished, 1.0)] },
            Mechanisms { placebo: 0.0, without: vec![without(a, Fate::Other, 0.0)] },
        ];
        let shares = mechanism_shares(&crashes);
        assert_eq!(shares.len(), Weaknesses::NAMES.len());
        assert_eq!((shares[0].mechanism, shares[0].crashes), (a, 3));
        let as_it_was = shares[0].as_it_was;
        assert_eq!((as_it_was.vanished, as_it_was.other), (2, 1));
        assert_eq!((as_it_was.low, as_it_was.high), wilson(2, 3));
        let beyond = shares[0].beyond_chance.as_ref().expect("there are crashes");
        assert_eq!(beyond.values, [0.25, 0.75, 0.0]);
        assert_eq!(shares[1].beyond_chance.as_ref().map(|beyond| beyond.mean), Some(0.0));
        assert_eq!((shares[2].crashes, shares[2].other_noise.is_none()), (0, true));
        assert_eq!(placebo(&crashes).map(|placebo| placebo.mean), Some(0.25));
        assert_eq!(placebo(&[]), None);
    }
}
