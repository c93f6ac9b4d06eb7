//! `estimate.db`: the parts of an estimate, in SQLite, one transaction each.

use std::path::Path;

use rusqlite::{Connection, params};

use crate::run::{DatabaseError, Layout};

use crate::estimate::part::{Part, PartRecord};
use crate::estimate::ready::Estimate;

/// Versions begin at 2001, so that it is never taken for another database.
const LAYOUT: Layout = Layout { version: 2001, unit: "part", tables: &["part"], naming: None };

const SCHEMA: &str = "
CREATE TABLE part (
  part INTEGER PRIMARY KEY, road INTEGER NOT NULL, number INTEGER NOT NULL, probability REAL NOT NULL,
  episodes INTEGER NOT NULL, driven_m REAL NOT NULL, duration_s REAL NOT NULL, events INTEGER NOT NULL,
  simulated_s REAL NOT NULL, levels INTEGER NOT NULL, UNIQUE (road, number)
) STRICT;
";

/// An open database of an estimate.
pub struct EstimateDatabase {
    connection: Connection,
}

impl EstimateDatabase {
    /// Opens the file, making the table if it is new. `settings` is the text of `estimate.yaml`.
    ///
    /// # Errors
    /// If the file cannot be opened, has another layout or other settings, or was damaged or changed.
    pub fn open(path: &Path, settings: &str) -> Result<EstimateDatabase, DatabaseError> {
        Ok(EstimateDatabase { connection: LAYOUT.open(path, SCHEMA, settings)? })
    }

    /// Adds a part.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn add(&mut self, estimate: &Estimate, record: &PartRecord) -> Result<(), DatabaseError> {
        let Part { road, number } = record.part;
        // By its place among all parts, so that the file does not depend on the order in which parts end.
        let place = i64::from(number) * estimate.settings().run.roads.len() as i64 + road as i64;
        let transaction = self.connection.transaction()?;
        transaction.execute(
            "INSERT INTO part VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
            params![
                place,
                road as i64,
                number,
                record.probability,
                record.episodes,
                record.driven_m,
                record.duration_s,
                record.events,
                record.simulated_s,
                record.levels,
            ],
        )?;
        LAYOUT.seal(&transaction, place)?;
        transaction.commit()?;
        Ok(())
    }

    /// All parts so far, in order.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn parts(&self) -> Result<Vec<PartRecord>, DatabaseError> {
        let mut query = self.connection.prepare(
            "SELECT road, number, probability, episodes, driven_m, duration_s, events, simulated_s, levels
             FROM part ORDER BY part",
        )?;
        let records = query.query_map([], |row| {
            Ok(PartRecord {
                part: Part { road: row.get::<_, i64>(0)? as usize, number: row.get(1)? },
                probability: row.get(2)?,
                episodes: row.get(3)?,
                driven_m: row.get(4)?,
                duration_s: row.get(5)?,
                events: row.get(6)?,
                simulated_s: row.get(7)?,
                levels: row.get(8)?,
                failed: 0,
            })
        })?;
        Ok(records.collect::<Result<_, _>>()?)
    }
}
