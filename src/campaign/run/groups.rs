//! Groups of similar failures: what a run found, by what happened and not by how often.
//!
//! Two counted collisions are alike if they are of one pre-crash type (`episode::PreCrash`) and the same modules are at
//! fault, if these were looked for. Angles, bodies and sides are details of the example.

use std::collections::BTreeMap;

use avastra_lang::model::vocabulary::{Body, Word};

use crate::run::database::Database;
use crate::run::sealed::DatabaseError;

/// Counted collisions that are alike.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Group {
    /// The pre-crash type, and its number among NHTSA's 37; a wreck has none.
    pub precrash: String,
    pub precrash_number: Option<u32>,
    /// Modules at fault, if they were looked for; empty if none was found.
    pub cause: Option<String>,
    pub count: usize,
    /// The group's example: the episode with the shortest scenario, the first among equals.
    pub episode: i64,
    pub road: String,
    /// Of the example: what was hit (`pedestrian`, `animal`, `object`, `two-wheeler`, `car` or `large vehicle`), and its verb, for example
    /// `CrossRoad`.
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
                    priority, precrash, precrash_number
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
                episode: row.get(6)?,
                road: row.get(7)?,
                priority: row.get(9)?,
            };
            Ok((group, row.get::<_, i64>(8)?))
        })?;
        let mut found: BTreeMap<_, (Group, i64)> = BTreeMap::new();
        for row in rows {
            let (group, step) = row?;
            let key = (group.precrash_number, group.precrash.clone(), group.cause.clone());
            let (known, shortest) = found.entry(key).or_insert_with(|| (group.clone(), step));
            known.count += 1;
            if step < *shortest {
                (*known, *shortest) = (Group { count: known.count, ..group }, step);
            }
        }
        let mut groups: Vec<Group> = found.into_values().map(|(group, _)| group).collect();
        groups.sort_by_key(|group| core::cmp::Reverse(group.count));
        Ok(groups)
    }
}

/// What [`kind`] calls a pedestrian.
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
