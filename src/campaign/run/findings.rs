//! The findings of a run, by how sure and how bad they are.

use core::cmp::Ordering;
use std::collections::BTreeSet;

use crate::oracle::Recurrence;
use crate::run::database::{Database, from_columns};
use crate::run::sealed::{DatabaseError, query_all};

/// The value of [`FoundIn::finding`] where it is no requirement.
pub const COLLISION: &str = "collision";

/// An episode with a collision or a breach.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct FoundIn {
    pub road: String,
    pub episode: i64,
    /// Whether it has a counted collision or a breach. If so, the rest is about one of those.
    pub critical: bool,
    /// The subject of the other fields: [`COLLISION`], or the requirement that was breached. A finding that recurs comes
    /// before others, a collision before a breach, and a hard finding before a light one.
    pub finding: String,
    /// How often it recurs, if that was tried.
    pub recurrence: Option<Recurrence>,
    /// The harm of a collision to people, in the words of `oracle::Harm`; `None` for a breach.
    pub harm: Option<String>,
    /// As `oracle::Severity::harm_share`; 0 of a breach.
    pub harm_share: f64,
}

/// The name of the scenario that an episode becomes, and of its file.
pub fn scenario_name(road: &str, episode: i64) -> String {
    format!("{road}_{episode:04}")
}

impl FoundIn {
    /// The name of its scenario.
    pub fn name(&self) -> String {
        scenario_name(&self.road, self.episode)
    }

    /// In the terminal's list of scenarios: whose recurrence it is, and how bad it is.
    pub fn in_words(&self) -> String {
        match (&self.harm, self.recurrence) {
            (Some(harm), Some(recurrence)) => format!("{}, {harm}", recurrence.in_words()),
            (Some(harm), None) => harm.clone(),
            (None, Some(recurrence)) => format!("`{}` {}", self.finding, recurrence.in_words()),
            (None, None) => format!("`{}`", self.finding),
        }
    }

    /// The surest and worst first.
    fn order(&self, other: &FoundIn) -> Ordering {
        // A finding that was not tried is not known to be a matter of chance.
        let key = |of: &FoundIn| {
            (!of.critical, !of.recurrence.is_none_or(Recurrence::recurs), of.finding != COLLISION)
        };
        key(self).cmp(&key(other)).then(other.harm_share.total_cmp(&self.harm_share))
    }
}

/// How episodes end that do not arrive, though the driving system works.
const NOT_ARRIVED: &str = "('stalled', 'blocked', 'astray', 'left_the_map', 'limit')";

/// An episode in which nothing was found, and how near it came to that.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Near {
    pub road: String,
    pub episode: i64,
    /// How the drive ended if it did not arrive: `stalled`, `blocked`, `astray`, `left_the_map` or `limit`.
    pub not_arrived: Option<String>,
    /// The first collision, which does not count, if there was one.
    pub collision: Option<Uncounted>,
    /// The requirement that came nearest to a breach there, with its margin and its unit; `None` if nothing was near.
    pub requirement: Option<(String, f64, String)>,
    /// The shortest time to a collision with a road user ahead, at the speeds of the moment, s.
    pub ttc_s: Option<f64>,
}

/// A collision that does not count.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Uncounted {
    pub body: String,
    /// The number of the road user.
    pub obstacle: i64,
    pub time_s: f64,
    /// The clauses of the verdict that it does not meet.
    pub unmet: String,
}

impl Near {
    /// For the reader of its scenario.
    pub fn in_words(&self) -> String {
        if let Some(Uncounted { body, obstacle, time_s, unmet }) = &self.collision {
            let unmet = unmet.replace("; ", "`, `");
            return format!(
                "A collision with {body}#{obstacle} at {time_s:.2} s does not count. Not met: `{unmet}`."
            );
        }
        if let Some(ended) = &self.not_arrived {
            return format!("The ego vehicle does not arrive: `{ended}`.");
        }
        match (&self.requirement, self.ttc_s) {
            (Some((name, margin, unit)), _) => {
                format!("Nothing is found here: `{name}` is kept by {margin:.2} {unit}.").replace(" .", ".")
            }
            (None, Some(ttc_s)) => {
                format!("Nothing is found here: the time to a collision is at least {ttc_s:.2} s.")
            }
            (None, None) => "Nothing is found here.".to_owned(),
        }
    }
}

impl Database {
    /// Up to `most` episodes in which nothing was found, in this order:
    ///
    /// 1. those with a collision that does not count;
    /// 2. those that did not arrive;
    /// 3. of each requirement the one that came nearest to a breach, then of each the second, and so on;
    /// 4. those with the shortest time to a collision.
    ///
    /// # Errors
    /// If the database cannot be read.
    pub fn near(&self, most: usize) -> Result<Vec<Near>, DatabaseError> {
        // The rank is among the episodes of a requirement. An episode may be near a breach of several.
        let query = format!("WITH calm AS (
               SELECT episode, road, CASE WHEN ended IN {NOT_ARRIVED} THEN ended END AS not_arrived, (SELECT min(ttc_s) FROM step WHERE step.episode = episode.episode) AS ttc_s
               FROM episode
               WHERE counted = 0 AND episode NOT IN (SELECT episode FROM breach)
                 AND episode NOT IN (SELECT episode FROM failure)),
             hit AS (SELECT episode, body, obstacle, min(time_s) AS time_s, unmet FROM collision GROUP BY episode),
             near AS (
               SELECT episode, requirement, smallest, coalesce(unit, '') AS unit,
                      row_number() OVER (PARTITION BY requirement ORDER BY smallest, episode) AS rank
               FROM margin WHERE smallest IS NOT NULL AND episode IN (SELECT episode FROM calm))
             SELECT road, episode, requirement, smallest, unit, ttc_s, body, obstacle, time_s, unmet, not_arrived
             FROM calm LEFT JOIN near USING (episode) LEFT JOIN hit USING (episode)
             ORDER BY body IS NULL, not_arrived IS NULL, rank IS NULL, rank, requirement, ttc_s IS NULL, ttc_s, episode");
        let rows = query_all(&self.connection, &query, |row| {
            let (name, margin): (Option<String>, Option<f64>) = (row.get(2)?, row.get(3)?);
            let unit: Option<String> = row.get(4)?;
            let requirement = name.zip(margin).zip(unit).map(|((name, margin), unit)| (name, margin, unit));
            let collision = match row.get(6)? {
                Some(body) => {
                    let (obstacle, time_s, unmet) = (row.get(7)?, row.get(8)?, row.get(9)?);
                    Some(Uncounted { body, obstacle, time_s, unmet })
                }
                None => None,
            };
            let (road, episode, ttc_s, not_arrived) = (row.get(0)?, row.get(1)?, row.get(5)?, row.get(10)?);
            Ok(Near { road, episode, not_arrived, collision, requirement, ttc_s })
        })?;
        let mut found: Vec<Near> = Vec::new();
        for near in rows {
            if found.len() < most && found.iter().all(|known| known.episode != near.episode) {
                found.push(near);
            }
        }
        Ok(found)
    }

    /// The names of the episodes that did not arrive, in the order of the episodes.
    ///
    /// # Errors
    /// If the database cannot be read.
    pub fn not_arrived(&self) -> Result<Vec<String>, DatabaseError> {
        let query =
            format!("SELECT road, episode FROM episode WHERE ended IN {NOT_ARRIVED} ORDER BY episode");
        let names = query_all(&self.connection, &query, |row| {
            Ok(scenario_name(&row.get::<_, String>(0)?, row.get(1)?))
        })?;
        Ok(names)
    }

    /// Each episode with a collision or a breach: those that count first, then those that recur, then the worst.
    ///
    /// # Errors
    /// If the database cannot be read.
    pub fn found(&self) -> Result<Vec<FoundIn>, DatabaseError> {
        let query = "WITH finding AS (
               SELECT episode, number, NULL AS name, counted, recurred, replays, harm, harm_share FROM collision
               UNION ALL SELECT episode, number, requirement, 1, recurred, replays, NULL, 0.0 FROM breach)
             SELECT road, episode, finding.counted, recurred, replays, harm, harm_share, name
             FROM finding JOIN episode USING (episode) ORDER BY episode, name IS NOT NULL, number";
        let mut found = query_all(&self.connection, query, |row| {
            let name: Option<String> = row.get(7)?;
            Ok(FoundIn {
                road: row.get(0)?,
                episode: row.get(1)?,
                critical: row.get(2)?,
                finding: name.unwrap_or_else(|| COLLISION.to_owned()),
                recurrence: from_columns(row.get(3)?, row.get(4)?),
                harm: row.get(5)?,
                harm_share: row.get(6)?,
            })
        })?;
        // The first finding in that order stands for an episode with several.
        found.sort_by(FoundIn::order);
        let mut seen = BTreeSet::new();
        found.retain(|one| seen.insert(one.episode));
        Ok(found)
    }
}
