//! `estimate.db`: the pilot, the parts and the events of an estimate, in SQLite, one transaction for each part.

use rusqlite::{Connection, OptionalExtension, params};

use crate::files::PlainName;
use crate::run::{DatabaseError, Layout, Units, WrittenScenario, insert_row, query_all};

use crate::estimate::part::{Event, Part, PartRecord, Played};
use crate::estimate::plan::{Cell, Pilot, Seen, Situation};
use crate::estimate::ready::Estimate;

/// Versions begin at 2001, so that it is never taken for another database.
pub(crate) const LAYOUT: Layout = Layout {
    version: 2004,
    schema: || SCHEMA.to_owned(),
    unit: "part",
    tables: &["part", "event", "scenario", "pilot", "seen"],
    naming: None,
    // A scenario names its space by a path from the file.
    local: &["scenario"],
    apart: &[],
    sound: &[
        (
            "part",
            "min(probability, episodes, driven_m, duration_s, events, squares, largest, simulated_s) >= 0
           AND max(episodes, driven_m, duration_s, events, simulated_s) <= 1e9
           AND max(probability, squares, largest) <= 1e300",
        ),
        ("event", "weight BETWEEN 0 AND 1e300"),
        ("pilot", "min(whole_s, tried_s, tried) >= 0 AND max(whole_s, tried_s, tried) <= 1e9"),
    ],
};

/// The part number of the pilot's observations, which no estimate has.
pub const PILOT: i64 = -1;

/// `levels` is 0 always: a method that is gone counted them, and a table without the column would have another layout.
const SCHEMA: &str = "
CREATE TABLE part (
  part INTEGER PRIMARY KEY, road INTEGER NOT NULL, number INTEGER NOT NULL, probability REAL NOT NULL,
  episodes INTEGER NOT NULL, driven_m REAL NOT NULL, duration_s REAL NOT NULL, events INTEGER NOT NULL,
  squares REAL NOT NULL, largest REAL NOT NULL, simulated_s REAL NOT NULL, levels INTEGER NOT NULL,
  UNIQUE (road, number)
) STRICT;
CREATE TABLE event (
  part INTEGER NOT NULL REFERENCES part, event INTEGER NOT NULL, episode INTEGER NOT NULL, step INTEGER NOT NULL,
  action_row INTEGER, weight REAL NOT NULL, PRIMARY KEY (part, event)
) STRICT;
CREATE TABLE scenario (
  part INTEGER NOT NULL REFERENCES part, event INTEGER NOT NULL, name TEXT NOT NULL, text TEXT NOT NULL,
  PRIMARY KEY (part, event)
) STRICT;
CREATE TABLE pilot (
  part INTEGER PRIMARY KEY, whole_s REAL NOT NULL, tried_s REAL NOT NULL, tried INTEGER NOT NULL
) STRICT;
CREATE TABLE seen (
  part INTEGER NOT NULL REFERENCES pilot, action_row INTEGER NOT NULL, road INTEGER NOT NULL,
  situation INTEGER NOT NULL, trials INTEGER NOT NULL, events INTEGER NOT NULL, moments INTEGER NOT NULL,
  chance REAL NOT NULL, PRIMARY KEY (part, action_row, road, situation)
) STRICT;
";

/// An open database of an estimate.
pub struct EstimateDatabase {
    connection: Connection,
}

impl Units for EstimateDatabase {
    const LAYOUT: &'static Layout = &LAYOUT;

    fn connection(&self) -> &Connection {
        &self.connection
    }

    fn from_connection(connection: Connection) -> EstimateDatabase {
        EstimateDatabase { connection }
    }

    fn scenarios(&self) -> Result<Vec<WrittenScenario>, DatabaseError> {
        let query = "SELECT part, name, text FROM scenario ORDER BY part, event";
        let rows = query_all(&self.connection, query, |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))?;
        let named = |(unit, name, text): (i64, String, String)| {
            Ok(WrittenScenario { unit, name: PlainName::scenario(name)?, text })
        };
        rows.into_iter().map(named).collect()
    }

    fn called(number: i64) -> String {
        // The pilot is stored as a part with a reserved number.
        if number == PILOT { "the pilot".to_owned() } else { format!("part {number}") }
    }
}

impl EstimateDatabase {
    /// Adds a part. `scenarios` has name and text of the file that was written of each of its events, if one was.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn add(
        &mut self,
        estimate: &Estimate,
        played: &Played,
        scenarios: &[Option<(String, String)>],
    ) -> Result<(), DatabaseError> {
        let record = &played.record;
        let Part { road, number } = record.part;
        let place = estimate.settings().place(record.part);
        let transaction = self.connection.transaction()?;
        let values = params![
            place,
            road as i64,
            number,
            record.probability,
            record.episodes,
            record.driven_m,
            record.duration_s,
            record.events,
            record.weight_squares,
            record.weight_max,
            record.simulated_s,
            0,
        ];
        insert_row(&transaction, "part", values)?;
        for (index, (met, scenario)) in played.met.iter().zip(scenarios).enumerate() {
            let Event { episode, step, row, weight } = met.event;
            let row = row.map(|row| row as i64);
            let values = params![place, index as i64, episode, step as i64, row, weight];
            insert_row(&transaction, "event", values)?;
            if let Some((name, text)) = scenario {
                insert_row(&transaction, "scenario", params![place, index as i64, name, text])?;
            }
        }
        LAYOUT.seal(&transaction, place)?;
        transaction.commit()?;
        Ok(())
    }

    /// Keeps what a pilot saw.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn keep_pilot(&mut self, pilot: &Pilot) -> Result<(), DatabaseError> {
        let transaction = self.connection.transaction()?;
        let Pilot { cells, whole_s, tried_s, tried } = pilot;
        insert_row(&transaction, "pilot", params![PILOT, whole_s, tried_s, tried])?;
        for (Cell { row, road, situation }, seen) in cells {
            let Seen { trials, events, moments, chance } = seen;
            let (row, road, situation) = (*row as i64, *road as i64, situation.0);
            let values = params![PILOT, row, road, situation, trials, events, moments, chance];
            insert_row(&transaction, "seen", values)?;
        }
        LAYOUT.seal(&transaction, PILOT)?;
        transaction.commit()?;
        Ok(())
    }

    /// The pilot's observations, if there was a pilot.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn pilot(&self) -> Result<Option<Pilot>, DatabaseError> {
        let totals = self
            .connection
            .query_row("SELECT whole_s, tried_s, tried FROM pilot", [], |row| {
                Ok(Pilot {
                    whole_s: row.get(0)?,
                    tried_s: row.get(1)?,
                    tried: row.get(2)?,
                    ..Pilot::default()
                })
            })
            .optional()?;
        let Some(mut pilot) = totals else { return Ok(None) };
        let query =
            "SELECT action_row, road, situation, trials, events, moments, chance FROM seen ORDER BY 1, 2, 3";
        let cells = query_all(&self.connection, query, |row| {
            let cell = Cell {
                row: row.get::<_, i64>(0)? as usize,
                road: row.get::<_, i64>(1)? as usize,
                situation: Situation(row.get(2)?),
            };
            let seen =
                Seen { trials: row.get(3)?, events: row.get(4)?, moments: row.get(5)?, chance: row.get(6)? };
            Ok((cell, seen))
        })?;
        pilot.cells = cells.into_iter().collect();
        Ok(Some(pilot))
    }

    /// All parts so far, in order.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn parts(&self) -> Result<Vec<PartRecord>, DatabaseError> {
        let query =
            "SELECT road, number, probability, episodes, driven_m, duration_s, events, squares, largest,
                            simulated_s FROM part ORDER BY part";
        query_all(&self.connection, query, |row| {
            Ok(PartRecord {
                part: Part { road: row.get::<_, i64>(0)? as usize, number: row.get(1)? },
                probability: row.get(2)?,
                episodes: row.get(3)?,
                driven_m: row.get(4)?,
                duration_s: row.get(5)?,
                events: row.get(6)?,
                weight_squares: row.get(7)?,
                weight_max: row.get(8)?,
                simulated_s: row.get(9)?,
                failed: 0,
            })
        })
    }

    /// All events so far, each with its part, in order.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn events(&self) -> Result<Vec<(Part, Event)>, DatabaseError> {
        let query = "SELECT road, number, episode, step, action_row, weight FROM event JOIN part USING (part)
             ORDER BY part, event";
        query_all(&self.connection, query, |row| {
            let part = Part { road: row.get::<_, i64>(0)? as usize, number: row.get(1)? };
            let event = Event {
                episode: row.get(2)?,
                step: row.get::<_, i64>(3)? as usize,
                row: row.get::<_, Option<i64>>(4)?.map(|row| row as usize),
                weight: row.get(5)?,
            };
            Ok((part, event))
        })
    }
}
