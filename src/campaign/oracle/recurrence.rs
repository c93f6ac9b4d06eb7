//! How often a finding happens again under other chance.
//!
//! One seed's crash is a candidate. The same scenario is played with other errors of the driving system's sensors. The other
//! road users look at the world at other moments, so that they react by up to 0.1 s sooner or later. All else stays.
//! (`variation` changes the scenario, too.) A driving system of ours whose sensors have no noise (all but `modular`) meets other
//! reactions alone. One that is not deterministic meets its own chance, too, which no replay can tell from the noise.

use core::cell::RefCell;
use core::fmt;

use crate::episode;
use crate::episode::{EpisodeLog, Moment, Script, Setup};
use avastra_base::rng;
use avastra_base::rng::Stream;
use avastra_base::statistics::{sequential, sequential_excludes};
use avastra_drivers::Selected;
use avastra_world::sim::Start;

use super::case::{Case, Fate, Found};

/// A test ends without an answer if the chance of one is not higher than this. It only ends sooner: no answer becomes wrong by it.
const HOPELESS: f64 = 0.02;

/// Most replays of a finding by default.
pub const REPLAYS: u32 = 20;

/// How often a finding happened again. The test is sequential: it looks after each replay, and its 95 % intervals hold
/// whenever it stops.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
pub struct Recurrence {
    pub recurred: u32,
    pub replays: u32,
}

/// The remark on a recurrence where the driving system need not repeat itself.
pub const MIXED: &str = "the program is not deterministic, so this mixes its chance with the noise";

impl Recurrence {
    /// Whether it recurs: the 95 % interval of the share lies above one half. The share itself is too noisy: findings that
    /// recurred in 11 of 20 recurred in 31 to 49 of 100.
    pub fn recurs(self) -> bool {
        self.is_above(0.5)
    }

    fn is_rare(self) -> bool {
        self.is_below(0.5)
    }

    /// Whether the whole interval lies above a rate in `(0, 1)`.
    pub fn is_above(self, rate: f64) -> bool {
        f64::from(self.recurred) > rate * f64::from(self.replays) && self.excludes(rate)
    }

    /// Whether the whole interval lies below a rate in `(0, 1)`.
    pub fn is_below(self, rate: f64) -> bool {
        f64::from(self.recurred) < rate * f64::from(self.replays) && self.excludes(rate)
    }

    /// How many more replays without the finding would put it below a rate in `(0, 1)`; `None` above 100,000.
    pub fn clean_until_below(self, rate: f64) -> Option<u32> {
        let with_clean = |clean: u32| Recurrence { replays: self.replays + clean, ..self };
        (0..=100_000).find(|clean| with_clean(*clean).is_below(rate))
    }

    fn excludes(self, rate: f64) -> bool {
        sequential_excludes(self.recurred, self.replays, rate)
    }

    /// Whether there is an answer, or further replays, up to `most` in all, hardly give one. So few that no answer is possible are
    /// all played.
    pub fn is_settled(self, most: u32) -> bool {
        let left = most.saturating_sub(self.replays);
        let is_known = left == 0 || self.recurs() || self.is_rare();
        is_known || can_tell(most) && self.chance_of_an_answer(left) <= HOPELESS
    }

    /// The chance that there is an answer after the last of so many replays more, with a uniform prior on the share.
    fn chance_of_an_answer(self, left: u32) -> f64 {
        let [again, clean] = [self.recurred, self.replays - self.recurred].map(f64::from);
        let (mut weight, mut all, mut answered) = (1.0, 0.0, 0.0);
        for more in 0..=left {
            let then = Recurrence { recurred: self.recurred + more, replays: self.replays + left };
            all += weight;
            answered += if then.recurs() || then.is_rare() { weight } else { 0.0 };
            // The next weight of a beta-binomial distribution.
            let (more, rest) = (f64::from(more), f64::from(left - more));
            weight *= rest / (more + 1.0) * (again + 1.0 + more) / (clean + rest);
        }
        answered / all
    }

    /// With one replay more.
    #[must_use]
    pub fn and(self, has_recurred: bool) -> Recurrence {
        Recurrence { recurred: self.recurred + u32::from(has_recurred), replays: self.replays + 1 }
    }

    /// Whether it recurs, in a word. `is_mixed`: a driving system that is not deterministic is never cleared.
    pub fn word(self, is_mixed: bool) -> &'static str {
        match () {
            () if self.recurs() => "recurs",
            () if self.is_rare() && !is_mixed => "rarely recurs",
            () => "may recur",
        }
    }

    /// The 95 % interval of the share, whenever the test stops.
    pub fn interval(self) -> [f64; 2] {
        sequential(self.recurred, self.replays)
    }

    /// For the reader: `recurs in 14 of 20 (0.36 to 0.93)`.
    pub fn in_words(self) -> String {
        format!("recurs in {self}")
    }
}

/// Whether so many replays can tell that a finding recurs: fewer than 7 cannot.
pub fn can_tell(replays: u32) -> bool {
    Recurrence { recurred: replays, replays }.recurs()
}

/// The text after a recurrence where chance of the program is mixed in; nothing elsewhere.
pub fn mixed_text(is_mixed: bool) -> String {
    if is_mixed { format!("; {MIXED}") } else { String::new() }
}

/// With the 95 % interval of the share: `14 of 20 (0.36 to 0.93)`.
impl fmt::Display for Recurrence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [low, high] = self.interval();
        write!(f, "{} of {} ({low:.2} to {high:.2})", self.recurred, self.replays)
    }
}

/// The scenario of an episode, played under other chance. A play is made when it is first asked for.
pub struct Replayed<'a> {
    setup: &'a Setup,
    log: &'a EpisodeLog,
    script: Script,
    again: RefCell<Vec<EpisodeLog>>,
}

impl<'a> Replayed<'a> {
    /// Of `script`, which led to `log`. One step without an action comes after it, so that what only happens later is still
    /// seen.
    pub fn new(setup: &'a Setup, script: &Script, log: &'a EpisodeLog) -> Replayed<'a> {
        Replayed { setup, log, script: with_a_step_more(script), again: RefCell::default() }
    }

    /// How often a finding of the log happened again in the first `replays`. A collision does if the ego vehicle hits the same
    /// obstacle (and is at fault, if it was), a breach if the requirement is breached. An obstacle that never appears, because
    /// a rule refuses it there, counts as no collision. A replay in which the driving system fails counts only if the finding
    /// happened before: another one is played for it, with at most twice as many in all, or [`REPLAYS`].
    pub fn recurrence(&self, found: Found, replays: u32) -> Recurrence {
        self.until(found, (2 * replays).max(REPLAYS), |so_far| so_far.replays == replays)
    }

    /// The same in as many replays as are needed to know whether it recurs. At most `most` are played, failed ones included.
    pub fn tested(&self, found: Found, most: u32) -> Recurrence {
        self.until(found, most, |so_far| so_far.is_settled(most))
    }

    /// Whether a finding happens again in at least `needed` of so many replays. The replays stop once that is known.
    pub fn is_again_in(&self, found: Found, needed: u32, replays: u32) -> bool {
        let is_known = |so_far: Recurrence| {
            so_far.recurred >= needed || so_far.recurred + (replays - so_far.replays) < needed
        };
        self.until(found, replays, is_known).recurred >= needed
    }

    /// How many replays were played.
    pub fn plays(&self) -> u32 {
        self.again.borrow().len() as u32
    }

    /// Plays until it is enough, `most` times at most. `fails` says of a play whether it failed, `None` if it says nothing.
    pub fn failing(
        &self,
        fails: impl Fn(&EpisodeLog) -> Option<bool>,
        is_enough: impl Fn(Recurrence) -> bool,
        most: u32,
    ) -> Recurrence {
        counted(most, is_enough, |number| self.nth(number, &fails)).0
    }

    /// Whether one of several findings of the log happens again in a play; `None` if the obstacle of none appears there.
    pub fn is_again(&self, findings: &[Found], play: &EpisodeLog) -> Option<bool> {
        let fates = findings.iter().map(|found| {
            let case = Case::new(self.setup, self.log, *found);
            (case.is_again(play), case.fate(play))
        });
        let fates: Vec<(bool, Fate)> = fates.collect();
        let is_absent = fates.iter().all(|(_, fate)| *fate == Fate::Absent);
        (!is_absent).then(|| fates.iter().any(|(is_again, _)| *is_again))
    }

    fn until(&self, found: Found, most: u32, is_enough: impl Fn(Recurrence) -> bool) -> Recurrence {
        let case = Case::new(self.setup, self.log, found);
        counted(most, is_enough, |number| self.nth(number, |play| case.tells(play))).0
    }

    /// Looks at the nth play, from 1.
    fn nth<T>(&self, number: u32, look: impl FnOnce(&EpisodeLog) -> T) -> T {
        let mut again = self.again.borrow_mut();
        while again.len() < number as usize {
            let next = replay(self.setup, &self.script, again.len() as u32 + 1);
            again.push(next);
        }
        look(&again[number as usize - 1])
    }
}

/// Counts plays, from the first on, until it is enough, `most` at most; and how many were played. `tells` says of the nth whether the
/// finding happened again, `None` if it says nothing.
pub(super) fn counted(
    most: u32,
    is_enough: impl Fn(Recurrence) -> bool,
    tells: impl Fn(u32) -> Option<bool>,
) -> (Recurrence, u32) {
    let (mut so_far, mut number) = (Recurrence::default(), 0);
    while number < most && !is_enough(so_far) {
        number += 1;
        so_far = tells(number).map_or(so_far, |is_again| so_far.and(is_again));
    }
    (so_far, number)
}

fn with_a_step_more(script: &Script) -> Script {
    let mut script = script.clone();
    script.steps.push(None);
    script
}

/// The start of an episode in which the other road users look at the world at other moments from a time on, s.
pub(super) fn other_reactions(setup: &Setup, number: u32, from_s: f64) -> Start {
    Start {
        // Never 0, which is the usual order.
        reactions: rng::child_seed(setup.seed, Stream::Noise, u64::from(number)) | 1,
        reactions_from_s: from_s,
        ..setup.start
    }
}

/// The nth play of a script under other chance.
fn replay(setup: &Setup, script: &Script, number: u32) -> EpisodeLog {
    let setup = Setup {
        ads: setup.ads.clone().with_other_noise(number),
        start: other_reactions(setup, number, 0.0),
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
        assert!(of(17, 20).recurs() && !of(16, 20).recurs());
        assert!(can_tell(7) && !can_tell(6) && !can_tell(0));
        assert_eq!(of(14, 20).to_string(), "14 of 20 (0.36 to 0.93)");
        assert_eq!(
            [17, 16, 4, 3].map(|count| of(count, 20).word(false)),
            ["recurs", "may recur", "may recur", "rarely recurs"]
        );
        // The chance of the program itself clears nothing.
        assert_eq!(of(1, 20).word(true), "may recur");
        let told = of(5, 20).in_words() + &mixed_text(true);
        assert_eq!(told, format!("recurs in 5 of 20 (0.05 to 0.59); {MIXED}"));
        assert_eq!(mixed_text(false), "");
        assert!(!of(3, 5).is_settled(6) && of(3, 6).is_settled(6) && of(5, 10).is_settled(20));
    }

    #[test]
    fn fifty_three_clean_replays_put_a_rate_below_a_tenth() {
        let of = |recurred, replays| Recurrence { recurred, replays };
        assert_eq!(of(0, 0).clean_until_below(0.1), Some(53));
        assert_eq!(of(0, 20).clean_until_below(0.1), Some(33));
        assert!(of(0, 53).is_below(0.1) && !of(0, 52).is_below(0.1));
        assert_eq!(of(1, 1).clean_until_below(0.1), Some(82));
        assert!(of(3, 3).is_above(0.1) && !of(1, 1).is_above(0.1));
    }

    /// The exact outcome of the test of a coin: the chances of `recurs` and `rarely recurs`, and the mean number of replays.
    fn tested(share: f64) -> [f64; 3] {
        let (mut running, mut found) = (vec![(Recurrence::default(), 1.0)], [0.0; 3]);
        while let Some((so_far, probability)) = running.pop() {
            if so_far.is_settled(REPLAYS) {
                found[0] += if so_far.recurs() { probability } else { 0.0 };
                found[1] += if so_far.is_rare() { probability } else { 0.0 };
                found[2] += probability * f64::from(so_far.replays);
                continue;
            }
            for (has_recurred, chance) in [(true, share), (false, 1.0 - share)] {
                let next = so_far.and(has_recurred);
                match running.iter_mut().find(|(known, _)| *known == next) {
                    Some((_, known)) => *known += probability * chance,
                    None => running.insert(0, (next, probability * chance)),
                }
            }
        }
        found
    }

    #[test]
    fn a_coin_is_hardly_ever_misjudged_and_takes_half_of_the_replays() {
        let [recurs, is_rare, at_half] = tested(0.5);
        assert!(recurs < 0.025 && is_rare < 0.025, "{recurs} {is_rare}");
        let [recurs, is_rare, at_fifth] = tested(0.2);
        assert!(recurs < 1e-4 && is_rare > 0.5, "{recurs} {is_rare}");
        let [recurs, is_rare, at_twentieth] = tested(0.05);
        assert!(recurs < 1e-8 && is_rare > 0.98, "{recurs} {is_rare}");
        let mean = (at_half + at_fifth + at_twentieth) / 3.0;
        assert!(mean < 0.5 * f64::from(REPLAYS), "{at_half} {at_fifth} {at_twentieth}");
    }
}
