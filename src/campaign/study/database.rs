//! `study.db`: the cells of a study, in SQLite. The cells of one job are one transaction. They are numbered as they come, and
//! by their place in the study when it is settled.

use std::collections::{BTreeMap, BTreeSet};

use rusqlite::types::Type as Kind;
use rusqlite::{Connection, Row, params};

use crate::run::{DatabaseError, Layout, Numbered, Units, insert_row, of_columns, query_all};

use crate::study::record::{CellRecord, CollisionRecord, EpisodeRecord, FailureClass, TrainedRecord};
use crate::study::settings::StudySettings;

/// Versions begin at 1001, so that a `run.db` is never taken for a `study.db`.
pub(crate) const LAYOUT: Layout = Layout {
    version: 1008,
    schema: || SCHEMA.to_owned(),
    unit: "cell",
    tables: &["cell", "trained", "evaluated", "collision", "kind"],
    naming: None,
    local: &[],
    apart: &[],
    sound: &[
        ("trained", "simulated_s BETWEEN 0 AND 1e9 AND abs(return) <= 1e12"),
        (
            "evaluated",
            "min(duration_s, distance_m, red_runs, speeding_s, astray_s) >= 0
           AND max(duration_s, distance_m, red_runs, speeding_s, astray_s) <= 1e9",
        ),
        ("collision", "time_s BETWEEN 0 AND 1e9"),
    ],
};

/// Seeds are text: SQLite's integers have a sign.
const SCHEMA: &str = "
CREATE TABLE cell (
  cell INTEGER PRIMARY KEY, agent TEXT NOT NULL, road TEXT NOT NULL, number INTEGER NOT NULL,
  training_seed TEXT, UNIQUE (agent, road, number)
) STRICT;
CREATE TABLE trained (
  cell INTEGER NOT NULL REFERENCES cell, episode INTEGER NOT NULL, ended TEXT NOT NULL, return REAL NOT NULL,
  collisions INTEGER NOT NULL, counted INTEGER NOT NULL, epsilon REAL NOT NULL, loss REAL,
  simulated_s REAL NOT NULL, PRIMARY KEY (cell, episode)
) STRICT;
CREATE TABLE evaluated (
  cell INTEGER NOT NULL REFERENCES cell, episode INTEGER NOT NULL, seed TEXT NOT NULL, number INTEGER NOT NULL,
  ended TEXT NOT NULL, duration_s REAL NOT NULL, distance_m REAL NOT NULL, red_runs INTEGER NOT NULL,
  speeding_s REAL NOT NULL, astray_s REAL NOT NULL, trace TEXT NOT NULL, PRIMARY KEY (cell, episode)
) STRICT;
CREATE TABLE collision (
  cell INTEGER NOT NULL REFERENCES cell, episode INTEGER NOT NULL, number INTEGER NOT NULL, time_s REAL NOT NULL,
  counted INTEGER NOT NULL, repeated INTEGER NOT NULL, sudden INTEGER NOT NULL, struck INTEGER NOT NULL,
  avoidability TEXT NOT NULL, kind TEXT NOT NULL, manoeuvre TEXT NOT NULL, approach TEXT NOT NULL,
  side TEXT NOT NULL, cause TEXT, priority TEXT NOT NULL, PRIMARY KEY (cell, episode, number)
) STRICT;
CREATE TABLE kind (cell INTEGER NOT NULL REFERENCES cell, kind TEXT NOT NULL, PRIMARY KEY (cell, kind)) STRICT;
";

/// An open study database.
pub struct StudyDatabase {
    connection: Connection,
}

impl Units for StudyDatabase {
    const LAYOUT: &'static Layout = &LAYOUT;

    fn connection(&self) -> &Connection {
        &self.connection
    }

    fn from_connection(connection: Connection) -> StudyDatabase {
        StudyDatabase { connection }
    }
}

impl StudyDatabase {
    /// Adds all cells of a job that are not there yet, or nothing.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn add(&mut self, cells: &[CellRecord]) -> Result<(), DatabaseError> {
        let transaction = self.connection.transaction()?;
        for record in cells {
            let seed = record.training_seed.map(|seed| seed.to_string());
            let CellRecord { agent, road, number, .. } = record;
            let known = "SELECT 1 FROM cell WHERE agent = ? AND road = ? AND number = ?";
            if transaction.prepare_cached(known)?.exists(params![agent, road, number])? {
                continue;
            }
            let insert = "INSERT INTO cell (agent, road, number, training_seed) VALUES (?, ?, ?, ?)";
            transaction.execute(insert, params![agent, road, number, seed])?;
            let cell = transaction.last_insert_rowid();
            for (index, episode) in record.trained.iter().enumerate() {
                let values = params![
                    cell,
                    index as i64,
                    episode.ended,
                    episode.sum,
                    episode.collisions,
                    episode.counted,
                    episode.exploration_epsilon,
                    episode.loss,
                    episode.simulated_s,
                ];
                insert_row(&transaction, "trained", values)?;
            }
            for (index, episode) in record.episodes.iter().enumerate() {
                add_episode(&transaction, cell, index as i64, episode)?;
            }
            for kind in &record.kinds {
                insert_row(&transaction, "kind", params![cell, kind])?;
            }
            LAYOUT.seal(&transaction, cell)?;
        }
        transaction.commit()?;
        Ok(())
    }

    /// The numbers of all cells, each with its number in a settled file, which is its place in the study.
    ///
    /// # Errors
    /// If the file cannot be read, or has a cell that is none of the study's.
    pub fn places(&self, settings: &StudySettings) -> Result<Vec<Numbered>, DatabaseError> {
        let places: BTreeMap<(&str, &str, u32), i64> = settings.cells().zip(1..).collect();
        let query = "SELECT cell, agent, road, number FROM cell ORDER BY cell";
        let cells = query_all(&self.connection, query, |row| {
            Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?))
        })?;
        let placed = |(cell, agent, road, number): (i64, String, String, u32)| {
            let place = places.get(&(agent.as_str(), road.as_str(), number)).copied();
            let what = || {
                format!("it has a cell of `{agent}` on `{road}`, number {number}, which is not in the study")
            };
            place.map(|place| (cell, place)).ok_or_else(|| DatabaseError::Damaged { what: what() })
        };
        cells.into_iter().map(placed).collect()
    }

    /// All cells so far, in the order in which they ended.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn cells(&self) -> Result<Vec<CellRecord>, DatabaseError> {
        let mut cells: BTreeMap<i64, CellRecord> = self
            .by_cell("SELECT cell, agent, road, number, training_seed FROM cell", |row| {
                Ok(CellRecord {
                    agent: row.get(1)?,
                    road: row.get(2)?,
                    number: row.get(3)?,
                    training_seed: row
                        .get::<_, Option<String>>(4)?
                        .map(|seed| seed_of(4, &seed))
                        .transpose()?,
                    trained: Vec::new(),
                    episodes: Vec::new(),
                    kinds: BTreeSet::new(),
                    spent: None,
                })
            })?
            .into_iter()
            .collect();
        let trained = self.by_cell(
            "SELECT cell, ended, return, collisions, counted, epsilon, loss, simulated_s FROM trained ORDER BY cell, episode",
            trained_episode,
        )?;
        for (cell, episode) in trained {
            cells.entry(cell).and_modify(|cell| cell.trained.push(episode));
        }
        for (cell, kind) in self.by_cell("SELECT cell, kind FROM kind", |row| row.get(1))? {
            if let Some(cell) = cells.get_mut(&cell) {
                cell.kinds.insert(kind);
            }
        }
        let evaluated = self.by_cell(
            "SELECT cell, seed, number, ended, duration_s, distance_m, red_runs, speeding_s, astray_s, trace
             FROM evaluated ORDER BY cell, episode",
            evaluated_episode,
        )?;
        for (cell, episode) in evaluated {
            cells.entry(cell).and_modify(|cell| cell.episodes.push(episode));
        }
        let collisions = self.by_cell(
            "SELECT cell, episode, time_s, counted, repeated, sudden, struck, avoidability, kind, manoeuvre,
                    approach, side, cause, priority
             FROM collision ORDER BY cell, episode, number",
            |row| Ok((row.get::<_, u32>(1)? as usize, collision(row)?)),
        )?;
        for (cell, (episode, collision)) in collisions {
            let episode = cells.get_mut(&cell).and_then(|cell| cell.episodes.get_mut(episode));
            if let Some(episode) = episode {
                episode.collisions.push(collision);
            }
        }
        Ok(cells.into_values().collect())
    }

    /// The rows of a query, each with the cell in its first column.
    fn by_cell<T>(
        &self,
        query: &str,
        read: impl Fn(&Row) -> Result<T, rusqlite::Error>,
    ) -> Result<Vec<(i64, T)>, DatabaseError> {
        query_all(&self.connection, query, |row| Ok((row.get(0)?, read(row)?)))
    }
}

fn add_episode(
    connection: &Connection,
    cell: i64,
    index: i64,
    episode: &EpisodeRecord,
) -> Result<(), rusqlite::Error> {
    let values = params![
        cell,
        index,
        episode.seed.to_string(),
        episode.number,
        episode.ended,
        episode.duration_s,
        episode.distance_m,
        episode.red_runs,
        episode.speeding_s,
        episode.astray_s,
        episode.trace,
    ];
    insert_row(connection, "evaluated", values)?;
    for (number, found) in episode.collisions.iter().enumerate() {
        let FailureClass { kind, manoeuvre, approach, side, cause } = &found.failure;
        let values = params![
            cell,
            index,
            number as i64,
            found.time_s,
            found.counted,
            found.repeated,
            found.sudden,
            found.struck,
            found.avoidability,
            kind,
            manoeuvre,
            approach,
            side,
            cause,
            found.priority,
        ];
        insert_row(connection, "collision", values)?;
    }
    Ok(())
}

fn trained_episode(row: &Row) -> Result<TrainedRecord, rusqlite::Error> {
    Ok(of_columns!(
        row,
        1,
        TrainedRecord { ended, sum, collisions, counted, exploration_epsilon, loss, simulated_s }
    ))
}

/// An episode without its collisions: they are in a table of their own.
fn evaluated_episode(row: &Row) -> Result<EpisodeRecord, rusqlite::Error> {
    Ok(EpisodeRecord {
        seed: seed_of(1, &row.get::<_, String>(1)?)?,
        number: row.get(2)?,
        ended: row.get(3)?,
        duration_s: row.get(4)?,
        distance_m: row.get(5)?,
        red_runs: row.get(6)?,
        speeding_s: row.get(7)?,
        astray_s: row.get(8)?,
        trace: row.get(9)?,
        collisions: Vec::new(),
    })
}

fn collision(row: &Row) -> Result<CollisionRecord, rusqlite::Error> {
    Ok(CollisionRecord {
        time_s: row.get(2)?,
        counted: row.get(3)?,
        repeated: row.get(4)?,
        sudden: row.get(5)?,
        struck: row.get(6)?,
        avoidability: row.get(7)?,
        failure: FailureClass {
            kind: row.get(8)?,
            manoeuvre: row.get(9)?,
            approach: row.get(10)?,
            side: row.get(11)?,
            cause: row.get(12)?,
        },
        priority: row.get(13)?,
    })
}

/// A seed in a column of text: SQLite's integers have a sign.
fn seed_of(column: usize, text: &str) -> Result<u64, rusqlite::Error> {
    text.parse()
        .map_err(|error| rusqlite::Error::FromSqlConversionFailure(column, Kind::Text, Box::new(error)))
}
