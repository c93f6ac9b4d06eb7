//! How often a finding happens again under other chance.
//!
//! One seed's crash is a candidate. The same scenario is played with other errors of the driving system's sensors. The other
//! road users look at the world at other moments, so that they react by up to 0.1 s sooner or later. All else stays.
//! (`variation` changes the scenario, too.) A driving system of ours whose sensors have no noise (all but `modular`) meets other
//! reactions alone. One that is not deterministic meets its own chance, too, which no replay can tell from the noise.

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

/// The remark on a recurrence where the driving system need not repeat itself.
pub const MIXED: &str = "the program is not deterministic, so this mixes its chance with the noise";

impl Recurrence {
    /// Whether it recurs: the 95 % interval of the share lies above one half. The share itself is too noisy: findings that
    /// recurred in 11 of 20 recurred in 31 to 49 of 100.
    pub fn recurs(self) -> bool {
        self.interval()[0] > 0.5
    }

    /// Whether it recurs, in a word. `is_mixed`: a driving system that is not deterministic is never cleared.
    pub fn word(self, is_mixed: bool) -> &'static str {
        match self.interval() {
            _ if self.recurs() => "recurs",
            [_, high] if high < 0.5 && !is_mixed => "rarely recurs",
            _ => "may recur",
        }
    }

    /// The 95 % interval of the share, after Wilson.
    pub fn interval(self) -> [f64; 2] {
        proportion(self.recurred, self.replays).1
    }

    /// For the reader: `recurs in 14 of 20 (0.48 to 0.85)`.
    pub fn in_words(self) -> String {
        format!("recurs in {self}")
    }
}

/// The text after a recurrence where chance of the program is mixed in; nothing elsewhere.
pub fn mixed_text(is_mixed: bool) -> String {
    if is_mixed { format!("; {MIXED}") } else { String::new() }
}

/// With the 95 % interval of the share, after Wilson: `14 of 20 (0.48 to 0.85)`.
impl fmt::Display for Recurrence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [low, high] = self.interval();
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
        let script = with_a_step_more(script);
        Replayed { setup, log, again: (1..=replays).map(|number| replay(setup, &script, number)).collect() }
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

/// Whether a finding happens again in at least `needed` of so many replays, and how many were played to know it.
pub(super) fn recurs_in(
    setup: &Setup,
    script: &Script,
    (log, found): (&EpisodeLog, Found),
    needed: u32,
    replays: u32,
) -> (bool, u32) {
    let (case, script) = (Case::new(setup, log, found), with_a_step_more(script));
    let mut recurred = 0;
    for number in 1..=replays {
        if recurred >= needed || recurred + (replays + 1 - number) < needed {
            return (recurred >= needed, number - 1);
        }
        recurred += u32::from(case.is_again(&replay(setup, &script, number)));
    }
    (recurred >= needed, replays)
}

fn with_a_step_more(script: &Script) -> Script {
    let mut script = script.clone();
    script.steps.push(None);
    script
}

/// The nth play of a script under other chance.
fn replay(setup: &Setup, script: &Script, number: u32) -> EpisodeLog {
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
    fn a_finding_recurs_if_its_interval_lies_above_one_half() {
        let of = |recurred, replays| Recurrence { recurred, replays };
        assert!(of(15, 20).recurs() && !of(14, 20).recurs());
        assert!(of(4, 4).recurs() && !of(3, 3).recurs());
        assert_eq!(of(14, 20).to_string(), "14 of 20 (0.48 to 0.85)");
        assert_eq!(
            [15, 14, 6, 5].map(|count| of(count, 20).word(false)),
            ["recurs", "may recur", "may recur", "rarely recurs"]
        );
        // The chance of the program itself clears nothing.
        assert_eq!(of(1, 20).word(true), "may recur");
        let told = of(5, 20).in_words() + &mixed_text(true);
        assert_eq!(told, format!("recurs in 5 of 20 (0.11 to 0.47); {MIXED}"));
        assert_eq!(mixed_text(false), "");
    }
}
