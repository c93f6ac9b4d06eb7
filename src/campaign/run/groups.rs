//! Groups of similar failures: what a run found, by what happened and not by how often.
//!
//! Two counted collisions are similar if they are of one pre-crash type (`episode::PreCrash`) and the same modules are at
//! fault, if these were looked for. Angles, bodies and sides are details of the example.

use std::collections::{BTreeMap, BTreeSet};

use avastra_lang::model::vocabulary::{Body, Word};

use crate::oracle::Recurrence;

use crate::run::database::{Database, from_columns};
use crate::run::sealed::{DatabaseError, query_all};

/// Similar counted collisions.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Group {
    /// The pre-crash type, and its number among NHTSA's 37; a wreck has none.
    pub precrash: String,
    pub precrash_number: Option<u32>,
    /// Modules at fault, if they were looked for; empty if none was found.
    pub cause: Option<String>,
    pub count: usize,
    /// Collisions of it whose scenario was played again under other chance, and those of them that recur.
    pub tried: usize,
    pub recurring: usize,
    /// The group's example: one that recurs, if there is any, or else one that was tried; of these the episode with the
    /// shortest scenario, the first among equals.
    pub episode: i64,
    /// The recurrence of the example.
    pub recurrence: Option<Recurrence>,
    pub road: String,
    /// The obstacle of the example (`pedestrian`, `animal`, `object`, `two-wheeler`, `car` or `large vehicle`), and its
    /// verb, for example `CrossRoad`.
    pub kind: String,
    pub manoeuvre: String,
    /// How the obstacle moved, in the words of `oracle::Severity`, and where the ego vehicle was hit.
    pub approach: String,
    pub side: String,
    /// Which of the two had priority: `ego`, `other` or `none`.
    pub priority: String,
    /// The shape of the ego vehicle's way to the collision: `straight`, `left turn` and so on.
    pub shape: String,
}

impl Database {
    /// The groups of counted collisions so far, the largest first.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn groups(&self) -> Result<Vec<Group>, DatabaseError> {
        let mut statement = self.connection.prepare(
            "SELECT body, verb, approach, side, shape, cause, collision.episode, road, collision.step,
                    priority, precrash, precrash_number, recurred, replays
             FROM collision JOIN episode ON episode.episode = collision.episode
             WHERE collision.counted ORDER BY collision.episode, number",
        )?;
        let rows = statement.query_map([], |row| {
            let group = Group {
                precrash: row.get(10)?,
                precrash_number: row.get(11)?,
                kind: kind(&row.get::<_, String>(0)?).to_owned(),
                manoeuvre: row.get(1)?,
                approach: row.get(2)?,
                side: row.get(3)?,
                shape: row.get(4)?,
                cause: row.get(5)?,
                count: 0,
                tried: 0,
                recurring: 0,
                recurrence: from_columns(row.get(12)?, row.get(13)?),
                episode: row.get(6)?,
                road: row.get(7)?,
                priority: row.get(9)?,
            };
            Ok((group, row.get::<_, i64>(8)?))
        })?;
        let mut found: BTreeMap<_, (Group, i64)> = BTreeMap::new();
        // The smaller, the better an example.
        let rank = |of: &Group, step: i64| (!of.recurs(), of.recurrence.is_none(), step);
        for row in rows {
            let (group, step) = row?;
            let key = (group.precrash_number, group.precrash.clone(), group.cause.clone());
            let (known, of_known) = found.entry(key).or_insert_with(|| (group.clone(), step));
            let count = known.count + 1;
            let tried = known.tried + usize::from(group.recurrence.is_some());
            let recurring = known.recurring + usize::from(group.recurs());
            if rank(&group, step) < rank(known, *of_known) {
                (*known, *of_known) = (group, step);
            }
            (known.count, known.tried, known.recurring) = (count, tried, recurring);
        }
        let mut groups: Vec<Group> = found.into_values().map(|(group, _)| group).collect();
        groups.sort_by_key(|group| core::cmp::Reverse(group.count));
        Ok(groups)
    }

    /// The episodes to be played again next, from each group and each requirement of which nothing recurs so far: the
    /// untried episode with the shortest scenario or the worst breach. Only an episode with a scenario can be played.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn to_try(&self, is_known: impl Fn(i64) -> bool) -> Result<BTreeSet<i64>, DatabaseError> {
        let query = "WITH finding AS (
               SELECT precrash || '/' || coalesce(precrash_number, '') || '/' || coalesce(cause, '') AS kind,
                      episode, step AS place, recurred, replays
               FROM collision WHERE counted
               UNION ALL SELECT 'requirement ' || requirement, episode, coalesce(margin, 0), recurred, replays
               FROM breach)
             SELECT kind, episode, recurred, replays FROM finding JOIN scenario USING (episode)
             ORDER BY kind, place, episode";
        let mut kinds: BTreeMap<String, Vec<(i64, Option<Recurrence>)>> = BTreeMap::new();
        let all = query_all(&self.connection, query, |row| {
            Ok((row.get(0)?, (row.get(1)?, from_columns(row.get(2)?, row.get(3)?))))
        })?;
        all.into_iter().for_each(|(kind, one)| kinds.entry(kind).or_default().push(one));
        kinds.retain(|_, all| !all.iter().any(|(_, of)| of.is_some_and(Recurrence::recurs)));
        let next = |all: &Vec<(i64, Option<Recurrence>)>| {
            all.iter().find(|(episode, of)| of.is_none() && !is_known(*episode)).map(|(episode, _)| *episode)
        };
        Ok(kinds.values().filter_map(next).collect())
    }
}

impl Group {
    /// Whether its example recurs.
    fn recurs(&self) -> bool {
        self.recurrence.is_some_and(Recurrence::recurs)
    }
}

/// The modules at fault, behind the name of a kind; nothing if they were not looked for.
pub fn cause_text(cause: Option<&str>) -> String {
    match cause {
        None => String::new(),
        Some("") => ", no cause found".to_owned(),
        Some(modules) => format!(", {}", modules.replace(' ', " and ")),
    }
}

/// The word of [`kind`] for a pedestrian.
pub(crate) const PEDESTRIAN: &str = "pedestrian";

/// The kind of an obstacle by the name of its body.
pub fn kind(body: &str) -> &'static str {
    match Body::from_name(body) {
        Some(Body::Pedestrian) => PEDESTRIAN,
        Some(Body::Motorcycle | Body::Bicycle) => "two-wheeler",
        Some(Body::BoxTruck | Body::SchoolBus) => "large vehicle",
        Some(Body::Animal) => "animal",
        Some(Body::Object) => "object",
        Some(Body::Jeep | Body::Sedan | Body::SUV | Body::Hatchback) | None => "car",
    }
}
