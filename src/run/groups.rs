//! Failures that are alike: what a run found, told apart by what happened instead of how often.
//!
//! Two counted collisions are alike if the kind of obstacle, what it was told to do, how it came, where
//! the ego vehicle was hit, the shape of its way there (see `shape`) and the modules at fault are the
//! same, the last two only where they were looked for.

use std::collections::BTreeMap;

use crate::model::vocabulary::{Body, Word};

use crate::run::database::{Database, DatabaseError};

/// Counted collisions that are alike.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Group {
    /// `pedestrian`, `car` or `large vehicle`.
    pub kind: String,
    /// What it was told to do, for example `CrossRoad`.
    pub manoeuvre: String,
    /// How it moved, as `oracle::Severity` has it.
    pub approach: String,
    /// Where the ego vehicle was hit.
    pub side: String,
    /// The shape of the ego vehicle's way there, if it was watched: `straight`, `left turn` and so on.
    pub shape: Option<String>,
    /// Modules at fault, if they were looked for; empty if none was found.
    pub cause: Option<String>,
    pub count: usize,
    /// The episode that stands for all: the one whose scenario is shortest, the first among equals.
    pub episode: i64,
    pub road: String,
}

impl Database {
    /// The counted collisions so far by what happened, the most frequent first.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn groups(&self) -> Result<Vec<Group>, DatabaseError> {
        let mut statement = self.connection.prepare(
            "SELECT body, verb, approach, side, shape, cause, collision.episode, road, collision.step
             FROM collision JOIN episode ON episode.episode = collision.episode
             WHERE collision.counted ORDER BY collision.episode, number",
        )?;
        let rows = statement.query_map([], |row| {
            let group = Group {
                kind: kind(&row.get::<_, String>(0)?).to_owned(),
                manoeuvre: row.get(1)?,
                approach: row.get(2)?,
                side: row.get(3)?,
                shape: row.get(4)?,
                cause: row.get(5)?,
                count: 1,
                episode: row.get(6)?,
                road: row.get(7)?,
            };
            Ok((group, row.get::<_, i64>(8)?))
        })?;
        let mut found: BTreeMap<_, (Group, i64)> = BTreeMap::new();
        for row in rows {
            let (group, step) = row?;
            let key = [&group.kind, &group.manoeuvre, &group.approach, &group.side].map(Clone::clone);
            match found.entry((key, group.shape.clone(), group.cause.clone())) {
                std::collections::btree_map::Entry::Vacant(entry) => {
                    entry.insert((group, step));
                }
                std::collections::btree_map::Entry::Occupied(mut entry) => {
                    let (known, shortest) = entry.get_mut();
                    let count = known.count + 1;
                    if step < *shortest {
                        (*known, *shortest) = (group, step);
                    }
                    known.count = count;
                }
            }
        }
        let mut groups: Vec<Group> = found.into_values().map(|(group, _)| group).collect();
        groups.sort_by_key(|group| core::cmp::Reverse(group.count));
        Ok(groups)
    }
}

/// The kind of an obstacle by the name of its body.
pub(crate) fn kind(body: &str) -> &'static str {
    match Body::from_name(body) {
        Some(Body::Pedestrian) => "pedestrian",
        Some(Body::BoxTruck | Body::SchoolBus) => "large vehicle",
        Some(Body::Jeep | Body::Sedan | Body::SUV | Body::Hatchback) | None => "car",
    }
}
