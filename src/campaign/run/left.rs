//! What a run has found, kind by kind, and what is left: the chance that an hour more shows a kind that it has not seen.
//!
//! A *kind* is a pre-crash type without its road, with the modules at fault if these were looked for, or a requirement. A wreck
//! of another crash and the type "other" are not kinds. A kind is seen in an episode if a finding of it there recurs.

use std::collections::BTreeMap;

use avastra_base::statistics::unseen;

use crate::episode::PreCrash;
use crate::oracle::{Recurrence, can_tell};
use crate::run::database::{Database, from_columns};
use crate::run::findings::scenario_name;
use crate::run::groups::cause_text;
use crate::run::sealed::{DatabaseError, query_all};
use crate::run::settings::{Budget, RunSettings};

/// What a run has found, kind by kind, and what is left.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Left {
    pub simulated_h: f64,
    /// The kinds that recur, in the order in which they were seen first.
    pub kinds: Vec<SeenKind>,
    /// The chance that an hour more of the same shows another kind; `None` if nothing can be said, because findings were not played
    /// again, or because the episodes are not drawn by chance.
    pub next_hour: Option<NextHour>,
}

/// A kind that recurs.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct SeenKind {
    pub kind: String,
    /// Episodes in which a finding of it recurs.
    pub episodes: u64,
    /// Simulated time until the end of the first of them, h, if the roads are driven by turns.
    pub first_h: f64,
    /// The scenario of the first.
    pub scenario: String,
    /// The scenario that is about the most severe finding of it that recurs: a collision by its harm, a breach by its margin.
    /// `None` if each scenario with such a finding is about another one.
    pub worst: Option<String>,
}

/// The chance that an hour shows a new kind, with a 90 % interval.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct NextHour {
    pub chance: f64,
    pub low: f64,
    pub high: f64,
}

impl NextHour {
    /// From the numbers of kinds that were seen in one episode, and in two, in so many hours.
    pub(super) fn after(hours: f64, once: u64, twice: u64) -> NextHour {
        // New kinds come as a Poisson process.
        let chance = |expected: f64| -libm::expm1(-expected / hours);
        let interval = unseen(once, twice);
        let high = interval.high.map_or(1.0, chance);
        NextHour { chance: chance(once as f64), low: chance(interval.low), high }
    }
}

impl Left {
    /// For the terminal: how many kinds recur.
    pub fn kinds_text(&self) -> String {
        let hours = self.simulated_h;
        match self.kinds.len() {
            0 => format!("no kind of failure recurs in {hours:.1} h"),
            1 => format!("1 kind of failure recurs in {hours:.1} h"),
            kinds => format!("{kinds} kinds of failure recur in {hours:.1} h"),
        }
    }

    /// For the terminal: how many kinds recur, since when, and the chance of a new one.
    pub fn in_words(&self) -> String {
        let since = match self.kinds.as_slice() {
            [] => String::new(),
            [only] => format!(", first seen after {:.1} h", only.first_h),
            [.., newest] => format!(", the newest first seen after {:.1} h", newest.first_h),
        };
        let kinds = self.kinds_text() + &since;
        let Some(NextHour { chance, high, .. }) = self.next_hour else { return kinds };
        // What is "at most" is rounded up.
        let high = (100.0 * high).ceil() / 100.0;
        format!(
            "{kinds}\nthe chance that an hour more shows a new kind is at most {high:.2} (best guess {chance:.2})"
        )
    }
}

impl Database {
    /// What a run with these settings has found so far, and what is left; without settings, of a training, whose episodes depend on
    /// each other.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn left(&self, settings: Option<&RunSettings>) -> Result<Left, DatabaseError> {
        let query = "SELECT episode, road, duration_s FROM episode";
        let mut episodes = query_all(&self.connection, query, |row| {
            Ok((row.get::<_, i64>(0)?, row.get::<_, String>(1)?, row.get::<_, f64>(2)?))
        })?;
        let place = |episode: i64| settings.map_or((episode as usize, 0), |run| run.turn(episode as usize));
        episodes.sort_unstable_by_key(|(episode, ..)| place(*episode));
        let found = self.kinds_by_episode()?;
        let mut kinds: BTreeMap<&str, (SeenKind, f64)> = BTreeMap::new();
        let mut simulated_s = 0.0;
        for (episode, road, duration_s) in &episodes {
            simulated_s += duration_s;
            let scenario = scenario_name(road, *episode);
            for (kind, severity) in found.seen.get(episode).into_iter().flatten() {
                let (seen, most) = kinds.entry(kind).or_insert_with(|| {
                    let (kind, scenario, first_h) = (kind.clone(), scenario.clone(), simulated_s / 3600.0);
                    (SeenKind { kind, episodes: 0, first_h, scenario, worst: None }, f64::NEG_INFINITY)
                });
                seen.episodes += 1;
                if let Some(severity) = severity.filter(|severity| severity > most) {
                    (seen.worst, *most) = (Some(scenario.clone()), severity);
                }
            }
        }
        let mut kinds: Vec<SeenKind> = kinds.into_values().map(|(kind, _)| kind).collect();
        kinds.sort_by(|one, other| one.first_h.total_cmp(&other.first_h));
        let seen_in = |episodes: u64| kinds.iter().filter(|kind| kind.episodes == episodes).count() as u64;
        let simulated_h = simulated_s / 3600.0;
        let is_told = settings.is_some_and(|run| {
            let on = |road: &String| episodes.iter().filter(|(_, one, _)| one == road).count();
            let counts: Vec<usize> = run.conditions.roads.iter().map(on).collect();
            // An hour more drives all roads alike: what was driven of one alone says nothing of it.
            let is_even =
                counts.iter().max().zip(counts.iter().min()).is_some_and(|(most, least)| most - least <= 1);
            run.rows == 0 && can_tell(run.replays) && is_even
        });
        // An episode in which the driving system failed was not driven to its end.
        let has_failed = !self.failures()?.is_empty();
        let is_known = is_told && !found.is_untried && !has_failed && simulated_h > 0.0;
        let next_hour = is_known.then(|| NextHour::after(simulated_h, seen_in(1), seen_in(2)));
        Ok(Left { simulated_h, kinds, next_hour })
    }

    /// Whether a run has played for as long as its settings say.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn is_spent(&self, settings: &RunSettings, budget: &Budget) -> Result<bool, DatabaseError> {
        let left = self.left(Some(settings))?;
        let is_enough = |until: f64| left.next_hour.is_some_and(|next| next.high <= until);
        Ok(left.simulated_h >= budget.hours || budget.until.is_some_and(is_enough))
    }

    /// The kinds of findings that recur, by episode.
    fn kinds_by_episode(&self) -> Result<Found, DatabaseError> {
        // A scenario is about the first of these.
        let query = "SELECT episode, precrash_number, precrash, cause, recurred, replays, harm_share, 0 AS is_breach, number
             FROM collision WHERE counted
             UNION ALL SELECT episode, NULL, requirement, NULL, max(recurred), max(replays), -min(coalesce(margin, 0.0)), 1, min(number)
             FROM breach GROUP BY episode, requirement
             ORDER BY episode, is_breach, number";
        let rows = query_all(&self.connection, query, |row| {
            let (number, name): (Option<u32>, String) = (row.get(1)?, row.get(2)?);
            let cause: Option<String> = row.get(3)?;
            let recurrence = from_columns(row.get(4)?, row.get(5)?);
            Ok((row.get(0)?, kind_name(number, &name, cause.as_deref()), recurrence, row.get::<_, f64>(6)?))
        })?;
        let mut found = Found::default();
        let mut last: Option<i64> = None;
        for (episode, kind, recurrence, severity) in rows {
            found.is_untried |= recurrence.is_none();
            let is_first = last != Some(episode);
            last = Some(episode);
            if let Some(kind) = kind.filter(|_| recurrence.is_some_and(Recurrence::recurs)) {
                let seen = found.seen.entry(episode).or_default().entry(kind).or_default();
                *seen = is_first.then_some(severity).or(*seen);
            }
        }
        Ok(found)
    }
}

/// The name of a kind: of a pre-crash type, which has a number, with the modules at fault if they were looked for; of a
/// requirement, which has none. `None` of what is not a kind.
pub(crate) fn kind_name(number: Option<u32>, name: &str, cause: Option<&str>) -> Option<String> {
    let is_kind = number != PreCrash::Other.number() && name != PreCrash::Wreck.name();
    is_kind.then(|| kind_text(number, name, cause))
}

/// As [`kind_name`], also of what is not a kind.
pub(super) fn kind_text(number: Option<u32>, name: &str, cause: Option<&str>) -> String {
    let number = number.map_or(String::new(), |number| format!("{number} "));
    format!("{number}{name}{}", cause_text(cause))
}

/// What recurs in which episode.
#[derive(Default)]
struct Found {
    /// The kinds of an episode, each with its severity if the scenario is about it.
    seen: BTreeMap<i64, BTreeMap<String, Option<f64>>>,
    /// Whether a finding was never played again.
    is_untried: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_chance_of_a_new_kind_falls_with_the_hours() {
        let two_digits =
            |NextHour { chance, low, high }| [chance, low, high].map(|of: f64| (100.0 * of).round());
        assert_eq!(two_digits(NextHour::after(1.0, 3, 1)), [95.0, 0.0, 100.0]);
        assert_eq!(two_digits(NextHour::after(20.0, 3, 1)), [14.0, 0.0, 36.0]);
        assert_eq!(two_digits(NextHour::after(20.0, 0, 0)), [0.0, 0.0, 14.0]);
        assert_eq!(two_digits(NextHour::after(300.0, 0, 0)), [0.0, 0.0, 1.0]);
    }
}
