//! The share of crashes that each documented weakness causes: how many vanish when it alone is off.
//!
//! Each crash is played again in two ways: the mended system takes over when the obstacle appears, as for
//! a cause (see `cause`), so that it meets the same hazard; and it drives from the start, and then may be
//! elsewhere by that time. If the play ends in another crash, or the obstacle never appears, the crash does
//! not count as vanished.

use crate::ads::{ModularConfig, Weaknesses};
use crate::episode::{EpisodeLog, Setup};
use crate::statistics::proportion;

use super::cause::{Inquiry, NoModules};
use super::crash::{Crash, Fate};

/// A crash with one documented weakness switched off.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct WithoutMechanism {
    pub mechanism: &'static str,
    /// Switched off from the moment on at which the obstacle appears.
    pub from_onset: Fate,
    /// Switched off from the start.
    pub from_start: Fate,
}

/// The nth collision of a log that was played from `setup`, without each of the weaknesses that are
/// switched on.
///
/// # Errors
/// If the driving system has no modules.
pub fn mechanisms(setup: &Setup, log: &EpisodeLog, index: usize) -> Result<Vec<WithoutMechanism>, NoModules> {
    let crash = Crash::new(setup, log, index);
    let inquiry = Inquiry::new(&crash)?;
    let each = inquiry.profile.weaknesses.each_off().into_iter();
    let found = each.map(|(mechanism, weaknesses)| {
        let mended = ModularConfig { weaknesses, ..inquiry.profile };
        let ads = setup.ads.clone().with_profile(mended).expect("it has a profile already");
        let from_start = crash.fate(&crash.play(&ads));
        WithoutMechanism { mechanism, from_onset: inquiry.fate(&mended), from_start }
    });
    Ok(found.collect())
}

/// How many of many crashes vanish without one weakness.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct MechanismShare {
    pub mechanism: &'static str,
    /// Crashes of a system that has it.
    pub crashes: u32,
    pub from_onset: Share,
    pub from_start: Share,
}

/// How many crashes vanish.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Share {
    pub vanished: u32,
    /// Plays that crash into another road user instead.
    pub other: u32,
    /// Plays in which the obstacle never appears.
    pub absent: u32,
    /// Share of the crashes that vanish; 0 if there are none.
    pub share: f64,
    /// 95 % interval of the share, after Wilson.
    pub low: f64,
    pub high: f64,
}

/// The shares of all weaknesses over many crashes.
pub fn mechanism_shares(crashes: &[Vec<WithoutMechanism>]) -> Vec<MechanismShare> {
    let share_of = |mechanism| {
        let found: Vec<&WithoutMechanism> =
            crashes.iter().flatten().filter(|found| found.mechanism == mechanism).collect();
        MechanismShare {
            mechanism,
            crashes: found.len() as u32,
            from_onset: share(found.iter().map(|found| found.from_onset)),
            from_start: share(found.iter().map(|found| found.from_start)),
        }
    };
    Weaknesses::NAMES.iter().copied().map(share_of).collect()
}

fn share(fates: impl Iterator<Item = Fate> + Clone) -> Share {
    let count = |wanted: Fate| fates.clone().filter(|fate| *fate == wanted).count() as u32;
    let (crashes, vanished) = (fates.clone().count() as u32, count(Fate::Vanished));
    let (share, [low, high]) = proportion(vanished, crashes);
    Share { vanished, other: count(Fate::Other), absent: count(Fate::Absent), share, low, high }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::wilson;

    #[test]
    fn a_share_counts_what_vanishes_among_all_crashes_of_a_system_that_has_the_weakness() {
        let without =
            |mechanism, from_onset, from_start| WithoutMechanism { mechanism, from_onset, from_start };
        let [a, b] = [Weaknesses::NAMES[0], Weaknesses::NAMES[1]];
        let shares = mechanism_shares(&[
            vec![without(a, Fate::Vanished, Fate::Absent), without(b, Fate::Crash, Fate::Other)],
            vec![without(a, Fate::Crash, Fate::Vanished)],
            vec![without(a, Fate::Other, Fate::Vanished)],
            vec![without(a, Fate::Vanished, Fate::Crash)],
        ]);
        assert_eq!(shares.len(), Weaknesses::NAMES.len());
        assert_eq!((shares[0].mechanism, shares[0].crashes), (a, 4));
        assert_eq!((shares[0].from_onset.vanished, shares[0].from_onset.share), (2, 0.5));
        assert_eq!((shares[0].from_onset.low, shares[0].from_onset.high), wilson(2, 4));
        assert_eq!((shares[0].from_start.absent, shares[0].from_onset.other), (1, 1));
        assert_eq!((shares[1].crashes, shares[1].from_start.other, shares[1].from_start.share), (1, 1, 0.0));
        assert_eq!((shares[2].crashes, shares[2].from_onset.low, shares[2].from_onset.high), (0, 0.0, 1.0));
    }
}
