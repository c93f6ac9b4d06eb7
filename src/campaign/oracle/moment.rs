//! The moment of no return: from when on a finding was all but certain.
//!
//! The episode is driven as it was up to a moment. From there on the errors of the driving system's sensors are others, and the
//! other road users look at the world at other moments, as in [`super::recurrence`]. The share of such branches in which the
//! finding happens again is a chance of the moment. Where it rises, something was seen, missed or decided.
//!
//! No driving system is rewound. The one under test drives up to the moment, while one with other errors watches, and takes over
//! there. So a program of the user's is branched like any other, from its start.
//!
//! Beside that, a careful driver takes over at each moment: until when would one have avoided the collision?

use crate::episode::{EpisodeLog, Script, Setup};
use avastra_world::sim::DT_S;

use super::avoidable::avoidable_until;
use super::case::{Case, Found};
use super::recurrence::{REPLAYS, Recurrence, counted, other_reactions};

/// Moments are looked at from this long before the finding on, s: as far as careful drivers are taken back.
const LOOK_BACK_S: f64 = 8.0;
/// Distance of the moments that are looked at first, s, and of those around the rise.
const COARSE_S: f64 = 1.0;
const FINE_S: f64 = 0.1;
/// So far on both sides of the rise all fine moments are looked at, s.
const AROUND_S: f64 = 0.5;
/// A finding is likely from a moment on if it happens in more than this share of its branches. Above one half, because many chances
/// stay near that for a long time.
const LIKELY: f64 = 0.75;
/// Factor on the number of branches for moments that decide where the rise is. With 20 branches, a slowly rising chance seemed to
/// rise up to 0.5 s away from where 400 put it.
const CLOSER: u32 = 5;
/// A chance at most this high counts as low, and one of at least its complement as high.
const LOW: f64 = 0.1;

/// How the chance of a finding rose.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct NoReturn {
    /// When it happened, s.
    pub found_s: f64,
    /// The moments that were looked at, by rising time, with the branches from each in which it happened again.
    pub moments: Vec<Branched>,
    /// The first moment from which on it happened in more than three quarters of the branches; `None` if it did from the first
    /// moment looked at, or up to the last one did not.
    pub rises_s: Option<f64>,
    /// The last moment at which a careful driver could have taken over and avoided it; `None` of a breach, and if none could.
    pub avoidable_until_s: Option<f64>,
}

/// The branches of one moment.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Branched {
    pub time_s: f64,
    #[serde(flatten)]
    pub again: Recurrence,
    /// Branches beside these in which the driving system failed before the finding: they say nothing.
    pub failed: u32,
}

impl Branched {
    /// Share of the branches in which the finding happened again.
    pub fn share(&self) -> f64 {
        f64::from(self.again.recurred) / f64::from(self.again.replays.max(1))
    }

    /// Whether it happened again in more than three quarters of the branches.
    pub fn is_likely(&self) -> bool {
        is_likely(self.again)
    }
}

/// Whether a finding is likely from a moment on, by how often it happened again in branches from there.
pub fn is_likely(again: Recurrence) -> bool {
    f64::from(again.recurred) > LIKELY * f64::from(again.replays)
}

impl NoReturn {
    /// The moments that say most, by rising time: the two [`NoReturn::ends`] and those on both sides of the rise; without a rise,
    /// the first and the last.
    pub fn telling(&self) -> Vec<&Branched> {
        let (all, ends) = (&self.moments, self.ends());
        let rise = all.iter().position(|at| Some(at.time_s) == self.rises_s);
        let is_meant = |index: usize| match rise {
            Some(rise) => index == rise || index + 1 == rise || ends.contains(&Some(&all[index])),
            None => index == 0 || index + 1 == all.len(),
        };
        (0..all.len()).filter(|index| is_meant(*index)).map(|index| &all[index]).collect()
    }

    /// The last moment with a low chance before the rise, and the first with a high one after it.
    pub fn ends(&self) -> [Option<&Branched>; 2] {
        let Some(rises_s) = self.rises_s else { return [None, None] };
        let before = self.moments.iter().take_while(|at| at.time_s < rises_s);
        let low = before.filter(|at| at.share() <= LOW).last();
        let mut after = self.moments.iter().skip_while(|at| at.time_s < rises_s);
        [low, after.find(|at| at.share() >= 1.0 - LOW)]
    }
}

/// How the chance of a finding rose in a log that was played from `setup`. A moment has at most `most` branches, and five times
/// as many if it decides where the rise is.
pub fn no_return(setup: &Setup, log: &EpisodeLog, found: Found, most: u32) -> NoReturn {
    let case = Case::new(setup, log, found);
    let found_s = case.time_s();
    let mut looked = Looked { case: &case, moments: Vec::new() };
    let first_s = fine((found_s - LOOK_BACK_S).max(0.0));
    let last_s = fine(found_s - FINE_S).max(first_s);
    let coarse = ((last_s - first_s) / COARSE_S) as u32;
    let coarse: Vec<f64> =
        (0..=coarse).map(|number| fine(first_s + f64::from(number) * COARSE_S)).chain([last_s]).collect();
    // The chance may fall and rise again. The last rise leads to the finding.
    let last_unlikely = coarse.iter().rposition(|time_s| !looked.at(*time_s, CLOSER * most).is_likely());
    // Those before it are only shown.
    for time_s in &coarse {
        looked.at(*time_s, most);
    }
    let rise =
        last_unlikely.filter(|last| last + 1 < coarse.len()).map(|last| [coarse[last], coarse[last + 1]]);
    let rises_s = rise.map(|[mut low_s, mut high_s]| {
        while high_s - low_s > 1.5 * FINE_S {
            let middle_s = fine((low_s + high_s) / 2.0);
            let is_likely = looked.at(middle_s, CLOSER * most).is_likely();
            *(if is_likely { &mut high_s } else { &mut low_s }) = middle_s;
        }
        let around = (AROUND_S / FINE_S) as i32;
        for step in -around..=around {
            let time_s = fine(high_s + f64::from(step) * FINE_S);
            if (first_s..=last_s).contains(&time_s) {
                looked.at(time_s, most);
            }
        }
        high_s
    });
    // Where the driving system failed in every branch, nothing is known, so nothing is said of a rise.
    let rises_s = rises_s.filter(|_| looked.moments.iter().all(|at| at.again.replays > 0));
    let avoidable_until_s = match found {
        Found::Collision(index) => avoidable_until(setup, &Script::of_log(log), log, index),
        Found::Breach(_) => None,
    };
    let mut moments = looked.moments;
    moments.sort_by(|one, other| one.time_s.total_cmp(&other.time_s));
    NoReturn { found_s, moments, rises_s, avoidable_until_s }
}

/// A moment on the fine grid, s.
fn fine(time_s: f64) -> f64 {
    (time_s / FINE_S).round() * FINE_S
}

/// The moments of a finding that were looked at so far.
struct Looked<'a> {
    case: &'a Case<'a>,
    moments: Vec<Branched>,
}

impl Looked<'_> {
    /// The branches of a moment, played now if it has none yet. They stop when it is certain whether it is likely from there, and
    /// after `most`.
    fn at(&mut self, time_s: f64, most: u32) -> Branched {
        let is_known = |known: &&Branched| (known.time_s - time_s).abs() < FINE_S / 2.0;
        if let Some(known) = self.moments.iter().find(is_known) {
            return *known;
        }
        let is_settled = |again: Recurrence| again.is_below(LIKELY) || again.is_above(LIKELY);
        let tells = |number| self.case.tells(&branch(self.case, time_s, number));
        let (again, number) = counted(most, is_settled, tells);
        let branched = Branched { time_s, again, failed: number - again.replays };
        self.moments.push(branched);
        branched
    }
}

/// How often a finding of a log happens again in so many branches from a moment on. A branch in which the driving system failed
/// before it does not count: another one is played for it, with at most twice as many in all.
pub fn recurrence_from(
    setup: &Setup,
    log: &EpisodeLog,
    found: Found,
    from_s: f64,
    replays: u32,
) -> Recurrence {
    let case = Case::new(setup, log, found);
    counted(
        (2 * replays).max(REPLAYS),
        |again| again.replays == replays,
        |number| case.tells(&branch(&case, from_s, number)),
    )
    .0
}

/// The nth branch from a moment. The time is rounded to a tick, because a file's `6.0 s` and the computed one differ in the last bit.
fn branch(case: &Case, time_s: f64, number: u32) -> EpisodeLog {
    let time_s = (time_s / DT_S).round() * DT_S;
    let ads = &case.setup.ads;
    let setup = Setup { start: other_reactions(case.setup, number, time_s), ..case.setup.clone() };
    let successor = ads.clone().with_other_noise(number);
    Case { setup: &setup, script: case.script.clone(), what: case.what }
        .play(&ads.clone().until(time_s, successor))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_of_a_rise_lie_on_both_sides_of_it() {
        let at =
            |time_s, recurred| Branched { time_s, again: Recurrence { recurred, replays: 20 }, failed: 0 };
        let moments = vec![at(1.0, 0), at(2.0, 2), at(2.1, 6), at(2.2, 12), at(2.3, 19), at(3.0, 20)];
        let found = NoReturn { found_s: 3.1, moments, rises_s: Some(2.2), avoidable_until_s: None };
        let ends = found.ends().map(|end| end.map(|at| at.time_s));
        assert_eq!(ends, [Some(2.0), Some(2.3)]);
        let telling = |found: &NoReturn| found.telling().iter().map(|at| at.time_s).collect::<Vec<_>>();
        assert_eq!(telling(&found), [2.0, 2.1, 2.2, 2.3]);
        let flat = NoReturn { rises_s: None, ..found };
        assert_eq!(flat.ends(), [None, None]);
        assert_eq!(telling(&flat), [1.0, 3.0]);
    }
}
