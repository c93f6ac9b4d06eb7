//! Databases written anew, so that their bytes follow from their rows alone.
//!
//! SQLite puts a row where there is room when it arrives. So the same rows make other bytes when threads end in another
//! order, when a kill came between, or when they were played as shards. When all is played, a database is *settled*: its
//! units are written into a new file in the order of their numbers, which takes the place of the old one. A merge of shards
//! takes over units from other files in the same way.

use std::collections::BTreeSet;
use std::path::Path;

use rusqlite::{Connection, OpenFlags, params};
use sha2::{Digest, Sha256};

use crate::files::{PlainName, Temporary};
use crate::run::sealed::{
    DatabaseError, IfEmpty, Layout, add_rows, check_declared, check_settings, declared, open_file, path_of,
    query_all,
};

/// A unit to take over: its number in the other file, and the number that it gets here.
pub type Numbered = (i64, i64);

/// A scenario that was written of a unit: the name and the text of its file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WrittenScenario {
    pub unit: i64,
    pub name: PlainName,
    pub text: String,
}

/// A database of units that know nothing of each other.
pub trait Units: Sized {
    #[doc(hidden)]
    const LAYOUT: &'static Layout;
    #[doc(hidden)]
    fn connection(&self) -> &Connection;
    #[doc(hidden)]
    fn from_connection(connection: Connection) -> Self;

    /// The scenarios that were written, in the order of their units; none where none are kept.
    ///
    /// # Errors
    /// If the file cannot be read, or the name of a scenario is none.
    fn scenarios(&self) -> Result<Vec<WrittenScenario>, DatabaseError> {
        Ok(Vec::new())
    }

    /// Whether scenarios are kept.
    fn keeps_scenarios() -> bool {
        Self::LAYOUT.tables.contains(&"scenario")
    }

    /// The name of a unit in a message.
    fn called(number: i64) -> String {
        format!("{} {number}", Self::LAYOUT.unit)
    }

    /// Opens the file, making the tables if it is new. `settings` is the text of the settings that it is begun with.
    ///
    /// # Errors
    /// If the file cannot be opened, has another layout or other settings, or was damaged or changed.
    fn open(path: &Path, settings: &str) -> Result<Self, DatabaseError> {
        Ok(Self::from_connection(Self::LAYOUT.open(path, settings)?))
    }

    /// As [`Units::open`], but units whose rows were changed are deleted; their numbers come beside the database.
    ///
    /// # Errors
    /// As [`Units::open`], but for changed rows.
    fn open_and_drop(path: &Path, settings: &str) -> Result<(Self, Vec<i64>), DatabaseError> {
        let (mut connection, damaged) = Self::LAYOUT.open_damaged(path, settings, IfEmpty::Begin)?;
        let transaction = connection.transaction()?;
        Self::LAYOUT.delete(&transaction, &damaged)?;
        Self::LAYOUT.delete_unnamed(&transaction)?;
        transaction.commit()?;
        Ok((Self::from_connection(connection), damaged))
    }

    /// As [`Units::open`], but units whose rows were changed are as if they were not there; the file stays as it is. Their
    /// numbers come beside the database.
    ///
    /// # Errors
    /// As [`Units::open`], but for changed rows. If the file is not there or is empty.
    fn open_without_damaged(path: &Path, settings: &str) -> Result<(Self, Vec<i64>), DatabaseError> {
        let (connection, damaged) = Self::LAYOUT.open_damaged(path, settings, IfEmpty::Refuse)?;
        if !damaged.is_empty() {
            Self::LAYOUT.hide(&connection, &damaged)?;
        }
        Ok((Self::from_connection(connection), damaged))
    }

    /// The error that these settings are not those with which a file was begun; `None` if they are, or if the file cannot be
    /// read.
    fn edited(path: &Path, settings: &str) -> Option<DatabaseError> {
        let connection = open_file(path, OpenFlags::SQLITE_OPEN_READ_WRITE).ok()?;
        let is_ours = Self::LAYOUT.is_in(&connection).ok()? && Self::LAYOUT.check_tables(&connection).is_ok();
        let error = is_ours.then(|| check_settings(&connection, settings))?.err()?;
        matches!(error, DatabaseError::Settings { .. }).then_some(error)
    }

    /// The numbers of all units, in order.
    ///
    /// # Errors
    /// If the file cannot be read.
    fn numbers(&self) -> Result<BTreeSet<i64>, DatabaseError> {
        let numbers = query_all(self.connection(), "SELECT unit FROM seal", |row| row.get::<_, i64>(0))?;
        Ok(numbers.into_iter().collect())
    }

    /// Takes units over from another file of this kind, all or none. A unit that is here already must be equal.
    /// `moved` has their scenarios, each with the text that it gets here.
    ///
    /// # Errors
    /// If one of the files cannot be used, or a unit that both have differs.
    fn take(
        &mut self,
        other: &Path,
        units: &[Numbered],
        moved: &[(WrittenScenario, String)],
    ) -> Result<(), DatabaseError> {
        Self::LAYOUT.take(self.connection(), other, units, &|connection| {
            for (WrittenScenario { unit, text, .. }, new) in moved {
                // A unit may have several scenarios; what they are called by differs from table to table.
                let update =
                    format!("UPDATE scenario SET text = ? WHERE {} = ? AND text = ?", Self::LAYOUT.unit);
                connection.prepare_cached(&update)?.execute(params![new, unit, text])?;
            }
            Ok(())
        })
    }

    /// Writes the file, which is at `path`, anew with these units, in the order of their new numbers, and with what belongs
    /// to no unit.
    ///
    /// # Errors
    /// If a file cannot be written.
    fn settle(self, path: &Path, units: &[Numbered]) -> Result<Self, DatabaseError> {
        let query = "SELECT settings FROM begun";
        let settings: String = self.connection().query_row(query, [], |row| row.get(0))?;
        // The last connection to a file removes its journal.
        drop(self);
        let (temporary, file) = Temporary::beside(path)?;
        // SQLite opens it by its name, and takes an empty file for a new database.
        drop(file);
        let settled = Self::open(temporary.path(), &settings)?;
        Self::LAYOUT.take(settled.connection(), path, units, &take_apart(Self::LAYOUT))?;
        drop(settled);
        temporary.take_place_of(path)?;
        Ok(Self::from_connection(open_file(path, OpenFlags::SQLITE_OPEN_READ_WRITE)?))
    }
}

/// Takes the rows over that belong to no unit, while the other file is attached.
fn take_apart(layout: &'static Layout) -> impl Fn(&Connection) -> Result<(), rusqlite::Error> {
    move |connection| {
        for table in layout.apart {
            let columns = columns(connection, table)?;
            let names: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
            let names = names.join(", ");
            let rows = format!("INSERT INTO main.{table} ({names}) SELECT {names} FROM other.{table}");
            connection.execute(&rows, [])?;
        }
        Ok(())
    }
}

/// A column of a table, and its place in the table's key, from 1; 0 if it is not in it.
struct Column {
    name: String,
    key: i64,
}

impl Layout {
    fn take(
        &self,
        connection: &Connection,
        other: &Path,
        units: &[Numbered],
        adjust: &dyn Fn(&Connection) -> Result<(), rusqlite::Error>,
    ) -> Result<(), DatabaseError> {
        // Not made absolute: the folder that one works in may have a name that is no text.
        connection.execute("ATTACH DATABASE ? AS other", [path_of(other)?.to_string_lossy()])?;
        let taken = declared(connection, "main")
            .and_then(|wanted| check_declared(connection, "other", &wanted))
            .and_then(|()| self.take_attached(connection, units, adjust));
        // Without a transaction under way, detaching fails only if something before it failed.
        let detached = connection.execute_batch("DETACH DATABASE other");
        taken?;
        Ok(detached?)
    }

    fn take_attached(
        &self,
        connection: &Connection,
        units: &[Numbered],
        adjust: &dyn Fn(&Connection) -> Result<(), rusqlite::Error>,
    ) -> Result<(), DatabaseError> {
        let transaction = connection.unchecked_transaction()?;
        let mut new = Vec::new();
        for &(old, number) in units {
            let mut seal = transaction.prepare_cached("SELECT 1 FROM main.seal WHERE unit = ?")?;
            if !seal.exists([number])? {
                new.push((old, number));
            } else if self.content(&transaction, "other", old)?
                != self.content(&transaction, "main", number)?
            {
                return Err(DatabaseError::Differs { unit: self.unit, number });
            }
        }
        transaction.execute_batch(
            "CREATE TEMP TABLE IF NOT EXISTS taking (old INTEGER PRIMARY KEY, number INTEGER NOT NULL UNIQUE) STRICT;
             DELETE FROM taking;",
        )?;
        let mut taking = transaction.prepare("INSERT INTO taking VALUES (?, ?)")?;
        for (old, number) in &new {
            taking.execute([old, number])?;
        }
        drop(taking);
        for table in self.tables {
            if let Some((_, named)) = self.naming.filter(|(by, _)| by == table) {
                transaction.execute_batch(&format!(
                    "INSERT OR IGNORE INTO main.{named} SELECT * FROM other.{named} WHERE {named} IN
                       (SELECT {named} FROM other.{table} JOIN taking ON old = {unit}) ORDER BY {named}",
                    unit = self.unit
                ))?;
            }
            let columns = columns(&transaction, table)?;
            let named: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
            let taken: Vec<String> =
                named
                    .iter()
                    .map(|name| {
                        if *name == self.unit { "taking.number".to_owned() } else { format!("there.{name}") }
                    })
                    .collect();
            let mut keys: Vec<&Column> = columns.iter().filter(|column| column.key > 0).collect();
            keys.sort_by_key(|column| column.key);
            let rest = keys.iter().filter(|column| column.name != self.unit);
            let order: Vec<String> = rest.map(|column| format!(", there.{}", column.name)).collect();
            // The columns by name: two files of one layout need not have them in one order.
            transaction.execute_batch(&format!(
                "INSERT INTO main.{table} ({}) SELECT {} FROM taking JOIN other.{table} AS there ON there.{} = taking.old
                 ORDER BY taking.number{}",
                named.join(", "),
                taken.join(", "),
                self.unit,
                order.concat()
            ))?;
        }
        adjust(&transaction)?;
        new.sort_unstable_by_key(|(_, number)| *number);
        for (_, number) in new {
            self.seal(&transaction, number)?;
        }
        transaction.execute_batch("DELETE FROM taking")?;
        transaction.commit()?;
        Ok(())
    }

    /// The digest of what a unit holds in one of the attached files, without its number, and without what depends on where
    /// its directory is.
    fn content(&self, connection: &Connection, file: &str, number: i64) -> Result<[u8; 32], DatabaseError> {
        let mut whole = Sha256::new();
        for table in self.tables.iter().filter(|table| !self.local.contains(table)) {
            let columns = columns(connection, table)?;
            let names = columns.iter().map(|column| column.name.as_str());
            let names: Vec<&str> = names.filter(|name| *name != self.unit).collect();
            let query = format!("SELECT {} FROM {file}.{table} WHERE {} = ?", names.join(", "), self.unit);
            add_rows(&mut whole, connection, table, &query, number)?;
        }
        Ok(whole.finalize().into())
    }
}

/// The columns of a table.
fn columns(connection: &Connection, table: &str) -> Result<Vec<Column>, rusqlite::Error> {
    let mut query = connection.prepare_cached("SELECT name, pk FROM pragma_table_info(?, 'main')")?;
    let columns = query.query_map([table], |row| Ok(Column { name: row.get(0)?, key: row.get(1)? }))?;
    columns.collect()
}
