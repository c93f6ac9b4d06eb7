//! The common parts of `run.db` and `study.db`: layout, settings, and seals, by which a resumed run sees that nothing
//! was changed behind its back.
//!
//! The settings stand in the database as they were when it was begun. Every episode (or cell) has a seal: a digest of
//! these settings and of all its rows, written in the same transaction. So rows that were played with other settings count
//! as changed. SQLite's own check finds torn pages, a seal finds values that were changed. Neither protects against a
//! forger who writes seals, too. A file from elsewhere may hold a view in place of a table, or a condition on its rows, which
//! could run for ever when it is read or checked. So what it declares must be, to the letter, what this version declares, before
//! anything is read.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use rusqlite::types::ValueRef;
use rusqlite::{Connection, OpenFlags, OptionalExtension, Row, ToSql, params};
use serde_json::{Map, Value};
use sha2::{Digest, Sha256};

use crate::files;
use crate::files::NotPlain;
use avastra_base::outside::{Shown, in_line};
use avastra_lang::model::digest_text;
use avastra_lang::syntax::read_yaml;

/// Tables that every layout has.
const TABLES: &str = "
CREATE TABLE begun (only INTEGER PRIMARY KEY CHECK (only = 1), settings TEXT NOT NULL) STRICT;
CREATE TABLE seal (unit INTEGER PRIMARY KEY, digest TEXT NOT NULL) STRICT;
";

/// Why a run database cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum DatabaseError {
    #[error(
        "it has layout {found}, and this version of avastra reads {wanted}: the version that wrote it still reads it; to go \
         on with this one, begin a new one beside it"
    )]
    Layout { found: i64, wanted: i64 },
    #[error("it is the database of {found}, and one of {wanted} is wanted here")]
    OtherKind { found: &'static str, wanted: &'static str },
    #[error("it has no table `{name}`: there are {known}")]
    NoTable { name: String, known: String },
    #[error("it is empty: `--resume` plays all again")]
    Empty,
    #[error("it names an episode {found}")]
    Episode { found: i64 },
    #[error("its checkpoint is damaged: begin a new training")]
    Checkpoint,
    #[error("the settings were edited since it was begun: {what}; undo that, or begin a new one")]
    Settings { what: String },
    #[error("its rows of {unit} {number} were changed since they were written")]
    Rows { unit: &'static str, number: i64 },
    #[error("its results were changed since they were written: `avastra train --resume` writes them again")]
    Results,
    #[error("it is damaged ({what}): begin a new one")]
    Damaged { what: String },
    #[error(
        "its {unit} {number} is another than that of the directories before: one of them was not played alike"
    )]
    Differs { unit: &'static str, number: i64 },
    #[error("{0}: begin a new one")]
    Name(#[from] NotPlain),
    #[error(
        "it is in SQLite's journal mode WAL, which avastra does not use: SQLite would write into files beside it even to read it; \
         if it is your own, `sqlite3 FILE 'PRAGMA journal_mode = DELETE'` takes it back"
    )]
    Journal,
    #[error("`{}` beside it: {error}", path.shown())]
    Beside { path: PathBuf, error: std::io::Error },
    #[error(transparent)]
    File(#[from] std::io::Error),
    #[error(transparent)]
    Sqlite(rusqlite::Error),
}

impl DatabaseError {
    /// Whether the file was damaged or changed, so that its episodes must be played again. Other errors lose nothing.
    pub fn is_torn(&self) -> bool {
        matches!(self, DatabaseError::Damaged { .. } | DatabaseError::Rows { .. })
    }
}

impl From<rusqlite::Error> for DatabaseError {
    fn from(error: rusqlite::Error) -> DatabaseError {
        use rusqlite::Error::{
            FromSqlConversionFailure, IntegralValueOutOfRange, InvalidColumnType, Utf8Error,
        };
        use rusqlite::ErrorCode::{DatabaseCorrupt, NotADatabase};
        // The tables have types: a value of another one, or a text that is none, was not written there.
        let is_no_value = matches!(
            error,
            FromSqlConversionFailure(..)
                | IntegralValueOutOfRange(..)
                | InvalidColumnType(..)
                | Utf8Error(..)
        );
        match error.sqlite_error_code() {
            Some(DatabaseCorrupt | NotADatabase) => DatabaseError::Damaged { what: error.to_string() },
            _ if is_no_value => DatabaseError::Damaged { what: error.to_string() },
            _ => DatabaseError::Sqlite(error),
        }
    }
}

/// The kind of database that a layout's number belongs to: each kind has a separate thousand of numbers.
fn kind(version: i64) -> Option<&'static str> {
    match version {
        1..1000 => Some("a run or a training"),
        1000..2000 => Some("a study"),
        2000..3000 => Some("an estimate"),
        _ => None,
    }
}

/// The treatment of a file that has nothing in it.
#[derive(Clone, Copy)]
pub(super) enum IfEmpty {
    /// Its tables are made.
    Begin,
    /// It is refused: a caller that only reads writes nothing.
    Refuse,
}

/// The layout of a database.
pub struct Layout {
    /// Raised whenever a column changes.
    pub version: i64,
    /// The statements that make the tables of a new file.
    pub schema: fn() -> String,
    /// Name of the unit that is added as a whole, which is also the name of its key column: `episode`, `cell`. The
    /// first of the tables has one row for each unit.
    pub unit: &'static str,
    /// The tables with its rows.
    pub tables: &'static [&'static str],
    /// A table whose rows name rows of another by a column with that one's name. The named rows are sealed with them.
    pub naming: Option<(&'static str, &'static str)>,
    /// The tables whose rows depend on where the directory is.
    pub local: &'static [&'static str],
    /// Tables whose rows belong to no unit. They are kept when the database is settled, and no merge takes them.
    pub apart: &'static [&'static str],
    /// Conditions on the numbers of each row, by table. A unit that breaks one counts as changed: seals need no key, and
    /// such a number would spoil every sum.
    pub sound: &'static [(&'static str, &'static str)],
}

impl Layout {
    /// Opens a database, making its tables if the file is new. `settings` are the ones that it is begun with, as
    /// YAML; an older file must have been begun with the same, and be whole.
    ///
    /// # Errors
    /// If the file cannot be opened, is a link, has another layout or other settings, or was damaged or changed.
    pub fn open(&self, path: &Path, settings: &str) -> Result<Connection, DatabaseError> {
        let (connection, damaged) = self.open_damaged(path, settings, IfEmpty::Begin)?;
        match damaged.first() {
            Some(&number) => Err(DatabaseError::Rows { unit: self.unit, number }),
            None => Ok(connection),
        }
    }

    /// As [`Layout::open`], but units whose rows were changed are no error: their numbers come beside the connection.
    ///
    /// # Errors
    /// As [`Layout::open`], but for changed rows. If the file is empty and is to be refused then.
    pub(super) fn open_damaged(
        &self,
        path: &Path,
        settings: &str,
        if_empty: IfEmpty,
    ) -> Result<(Connection, Vec<i64>), DatabaseError> {
        let flags = match if_empty {
            IfEmpty::Begin => OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_CREATE,
            // Not read-only: SQLite must be able to undo what a kill left half written. No file is made.
            IfEmpty::Refuse => OpenFlags::SQLITE_OPEN_READ_WRITE,
        };
        let mut connection = open_file(path, flags)?;
        match (self.is_in(&connection)?, if_empty) {
            (true, _) => {
                self.check_tables(&connection)?;
                self.check(&connection, settings)?;
            }
            (false, IfEmpty::Refuse) => return Err(DatabaseError::Empty),
            (false, IfEmpty::Begin) => {
                let transaction = connection.transaction()?;
                transaction.execute_batch(TABLES)?;
                transaction.execute_batch(&(self.schema)())?;
                transaction.execute("INSERT INTO begun VALUES (1, ?)", [settings])?;
                transaction.pragma_update(None, "user_version", self.version)?;
                transaction.commit()?;
            }
        }
        let damaged = self.damaged(&connection)?;
        Ok((connection, damaged))
    }

    /// Whether a file has this layout; false if nothing is in it.
    ///
    /// # Errors
    /// If it has another layout.
    pub(super) fn is_in(&self, connection: &Connection) -> Result<bool, DatabaseError> {
        let found: i64 = connection.pragma_query_value(None, "user_version", |row| row.get(0))?;
        // A file with tables is not new, whatever number it has.
        let tables = "SELECT count(*) FROM sqlite_schema";
        let is_empty =
            || connection.query_row(tables, [], |row| row.get::<_, i64>(0)).map(|tables| tables == 0);
        match found {
            found if found == self.version => Ok(true),
            0 if is_empty()? => Ok(false),
            found => Err(match (kind(found), kind(self.version)) {
                (Some(found), Some(wanted)) if found != wanted => DatabaseError::OtherKind { found, wanted },
                _ => DatabaseError::Layout { found, wanted: self.version },
            }),
        }
    }

    /// Refuses a file unless it declares what this layout declares, see [`check_declared`].
    pub(super) fn check_tables(&self, connection: &Connection) -> Result<(), DatabaseError> {
        let pattern = Connection::open_in_memory()?;
        pattern.execute_batch(TABLES)?;
        pattern.execute_batch(&(self.schema)())?;
        check_declared(connection, "main", &declared(&pattern, "main")?)
    }

    /// Checks that its pages are sound and its settings those that it was begun with.
    fn check(&self, connection: &Connection, settings: &str) -> Result<(), DatabaseError> {
        let state: String = connection.pragma_query_value(None, "quick_check", |row| row.get(0))?;
        if state != "ok" {
            return Err(DatabaseError::Damaged { what: state });
        }
        check_settings(connection, settings)
    }

    /// The numbers of the units whose rows were changed, rising. A unit that has rows in any table and no seal counts as
    /// changed, and so does one with a number that no play gives.
    fn damaged(&self, connection: &Connection) -> Result<Vec<i64>, DatabaseError> {
        let unit = self.unit;
        let mut unsound = BTreeSet::new();
        for (table, condition) in self.sound {
            // A missing number makes the condition neither true nor false.
            let query = format!("SELECT {unit} FROM {table} WHERE ({condition}) IS NOT TRUE");
            unsound.extend(query_all(connection, &query, |row| row.get::<_, i64>(0))?);
        }
        let mut held = BTreeSet::new();
        for table in self.tables {
            let query = format!("SELECT DISTINCT {unit} FROM {table}");
            held.extend(query_all(connection, &query, |row| row.get::<_, i64>(0))?);
        }
        let sealed = query_all(connection, "SELECT unit FROM seal", |row| row.get::<_, i64>(0))?;
        let settings = settings_digest(connection)?;
        // A seal of nothing is cheap to forge: such units cost no query.
        let mut damaged: Vec<i64> = sealed.into_iter().filter(|number| !held.contains(number)).collect();
        for number in held {
            let mut seal = connection.prepare_cached("SELECT digest FROM seal WHERE unit = ?")?;
            let seal: Option<String> = seal.query_row([number], |row| row.get(0)).optional()?;
            if unsound.contains(&number) || seal != Some(self.digest(connection, &settings, number)?) {
                damaged.push(number);
            }
        }
        damaged.sort_unstable();
        Ok(damaged)
    }

    /// Hides units from all later queries over this connection. The file stays as it is: SQLite takes a plain table name for the
    /// temporary view.
    pub(super) fn hide(&self, connection: &Connection, numbers: &[i64]) -> Result<(), rusqlite::Error> {
        name_units(connection, numbers)?;
        for (table, unit) in self.tables_of_units() {
            connection.execute_batch(&format!(
                "CREATE TEMP VIEW {table} AS SELECT * FROM main.{table} WHERE {unit} NOT IN (SELECT unit FROM temp.named)"
            ))?;
        }
        Ok(())
    }

    /// Each table that has rows of units, with its column of their numbers.
    fn tables_of_units(&self) -> impl DoubleEndedIterator<Item = (&'static str, &'static str)> {
        self.tables.iter().map(|table| (*table, self.unit)).chain([("seal", "unit")])
    }

    /// Seals the rows of a unit; called in the transaction that adds them.
    pub fn seal(&self, connection: &Connection, number: i64) -> Result<(), rusqlite::Error> {
        let digest = self.digest(connection, &settings_digest(connection)?, number)?;
        insert_row(connection, "seal", params![number, digest])
    }

    /// Seals the rows of a unit that is sealed already; called in the transaction that changes them.
    pub(super) fn seal_anew(&self, connection: &Connection, number: i64) -> Result<(), rusqlite::Error> {
        connection.prepare_cached("DELETE FROM seal WHERE unit = ?")?.execute([number])?;
        self.seal(connection, number)
    }

    /// Deletes the rows of units: all at once, because a million seals are cheap to forge.
    pub(super) fn delete(&self, connection: &Connection, numbers: &[i64]) -> Result<(), rusqlite::Error> {
        name_units(connection, numbers)?;
        for (table, unit) in self.tables_of_units().rev() {
            let named = format!("DELETE FROM {table} WHERE {unit} IN (SELECT unit FROM temp.named)");
            connection.execute(&named, [])?;
        }
        connection.execute_batch("DROP TABLE temp.named")
    }

    /// Deletes the rows that no unit names. An edited one would stand in the way of what it was before: both have one key.
    pub(super) fn delete_unnamed(&self, connection: &Connection) -> Result<(), rusqlite::Error> {
        if let Some((by, named)) = self.naming {
            let unnamed = format!("DELETE FROM {named} WHERE {named} NOT IN (SELECT {named} FROM {by})");
            connection.execute(&unnamed, [])?;
        }
        Ok(())
    }

    /// Deletes the rows of all units from a number on.
    pub fn delete_from(&self, connection: &Connection, first: i64) -> Result<(), rusqlite::Error> {
        for (table, unit) in self.tables_of_units().rev() {
            connection.execute(&format!("DELETE FROM {table} WHERE {unit} >= ?"), [first])?;
        }
        Ok(())
    }

    /// The digest of the settings, given by their own digest, and of all rows of a unit.
    fn digest(
        &self,
        connection: &Connection,
        settings: &[u8; 32],
        number: i64,
    ) -> Result<String, rusqlite::Error> {
        let mut whole = Sha256::new();
        whole.update(settings);
        for table in self.tables {
            let named = self.naming.filter(|(by, _)| by == table);
            let join =
                named.map_or(String::new(), |(_, named)| format!(" LEFT JOIN {named} USING ({named})"));
            let query = format!("SELECT * FROM {table}{join} WHERE {} = ?", self.unit);
            add_rows(&mut whole, connection, table, &query, number)?;
        }
        Ok(digest_text(&whole.finalize().into()))
    }
}

/// Puts numbers of units into the table `temp.named`.
fn name_units(connection: &Connection, numbers: &[i64]) -> Result<(), rusqlite::Error> {
    connection.execute_batch("CREATE TEMP TABLE named (unit INTEGER PRIMARY KEY) STRICT")?;
    let mut insert = connection.prepare("INSERT INTO temp.named VALUES (?)")?;
    for number in numbers {
        insert.execute([number])?;
    }
    Ok(())
}

/// Refuses settings other than those that a database was begun with.
pub(super) fn check_settings(connection: &Connection, settings: &str) -> Result<(), DatabaseError> {
    let begun: String = connection.query_row("SELECT settings FROM begun", [], |row| row.get(0))?;
    differences(&begun, settings).map_or(Ok(()), |what| Err(DatabaseError::Settings { what }))
}

/// The digest of the settings that a database was begun with.
pub(crate) fn settings_digest(connection: &Connection) -> Result<[u8; 32], rusqlite::Error> {
    let settings: String = connection.query_row("SELECT settings FROM begun", [], |row| row.get(0))?;
    Ok(Sha256::digest(settings.as_bytes()).into())
}

/// Opens a file of SQLite. Every file is opened here, or attached by [`path_of`]; `tests/it/layers.rs` keeps it so.
///
/// # Errors
/// If SQLite cannot open it, or as [`path_of`].
pub(super) fn open_file(path: &Path, flags: OpenFlags) -> Result<Connection, DatabaseError> {
    let path = path_of(path)?;
    Ok(Connection::open_with_flags(path, flags | OpenFlags::SQLITE_OPEN_NO_MUTEX)?)
}

/// The path of a database as SQLite is to be given it.
///
/// # Errors
/// If the file or its journal is no regular file: SQLite follows links and waits for pipes. If the journal has further
/// names. If the file is in the journal mode WAL, or a `-wal` file lies beside it.
pub(super) fn path_of(path: &Path) -> Result<PathBuf, DatabaseError> {
    let beside = |ending: &str| {
        let mut name = path.as_os_str().to_owned();
        name.push(ending);
        PathBuf::from(name)
    };
    files::own_file(path)?;
    let journal = beside("-journal");
    let named = |error| DatabaseError::Beside { path: journal.clone(), error };
    files::own_file(&journal).and_then(|()| files::without_further_names(&journal)).map_err(named)?;
    // Whatever the head says, SQLite takes such a file for the journal, and writes into `FILE-shm`.
    if beside("-wal").symlink_metadata().is_ok() {
        return Err(DatabaseError::Journal);
    }
    check_journal(path)?;
    // SQLite takes a name that begins with `file:` for a URI, whatever the flags: it is built so.
    Ok(Path::new(".").join(path))
}

/// The first bytes of every file of SQLite.
const MAGIC: &[u8] = b"SQLite format 3\0";

/// Refuses a file in the journal mode WAL. In that mode, whoever opens the file writes into `FILE-shm`, which may be a further name
/// of a file of the user.
fn check_journal(path: &Path) -> Result<(), DatabaseError> {
    let head = files::first_bytes(path, 20)?;
    // The versions that writing and reading need: 1 with a rollback journal, 2 with WAL.
    match head.strip_prefix(MAGIC) {
        Some([_, _, write, read]) if (*write, *read) != (1, 1) => Err(DatabaseError::Journal),
        _ => Ok(()),
    }
}

/// The declarations of a file: the name and the kind of each table and index, the table that it belongs to, and its text.
type Declared = Vec<(String, String, String, Option<String>)>;

/// The declarations of an attached file, sorted.
pub(super) fn declared(connection: &Connection, file: &str) -> Result<Declared, DatabaseError> {
    let query = format!("SELECT name, type, tbl_name, sql FROM {file}.sqlite_schema ORDER BY 1, 2, 3, 4");
    query_all(connection, &query, |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?)))
}

/// Refuses an attached file unless it declares what is wanted, to the letter. A view, a trigger, a computed column, an index or a
/// condition of another would be evaluated when the file is read or checked.
pub(super) fn check_declared(
    connection: &Connection,
    file: &str,
    wanted: &Declared,
) -> Result<(), DatabaseError> {
    let found = declared(connection, file)?;
    let what = match (
        found.iter().find(|one| !wanted.contains(one)),
        wanted.iter().find(|one| !found.contains(one)),
    ) {
        (Some((name, ..)), _) => format!("`{}` is no table that avastra makes", in_line(name)),
        (None, Some((name, ..))) => format!("`{name}` is not there"),
        (None, None) if found.len() > wanted.len() => "a table is declared twice".to_owned(),
        (None, None) => return Ok(()),
    };
    Err(DatabaseError::Damaged { what })
}

/// Adds a row with a value for each column of a table.
pub(crate) fn insert_row(
    connection: &Connection,
    table: &str,
    values: &[&dyn ToSql],
) -> Result<(), rusqlite::Error> {
    let places = vec!["?"; values.len()].join(", ");
    connection.prepare_cached(&format!("INSERT INTO {table} VALUES ({places})"))?.execute(values)?;
    Ok(())
}

/// A struct of the columns of a row, from one on: `of_columns!(row, 0, Totals { episodes, collisions })`. The fields stand in the
/// order of the columns.
macro_rules! of_columns {
    ($row:expr, $first:literal, $of:ident { $($field:ident),+ $(,)? }) => {{
        let mut column: usize = $first;
        let mut next = || {
            column += 1;
            column - 1
        };
        $of { $($field: $row.get::<usize, _>(next())?),+ }
    }};
}
pub(crate) use of_columns;

/// All rows of a query, each as `read` gives it.
pub(crate) fn query_all<T>(
    connection: &Connection,
    query: &str,
    read: impl FnMut(&Row) -> Result<T, rusqlite::Error>,
) -> Result<Vec<T>, DatabaseError> {
    let mut statement = connection.prepare(query)?;
    let rows = statement.query_map([], read)?;
    Ok(rows.collect::<Result<_, _>>()?)
}

/// Adds the rows of a unit in a table to a digest. SQLite need not give them in one order, so each has a digest, and these
/// are sorted.
pub(super) fn add_rows(
    whole: &mut Sha256,
    connection: &Connection,
    table: &str,
    query: &str,
    number: i64,
) -> Result<(), rusqlite::Error> {
    let mut statement = connection.prepare_cached(query)?;
    let columns = statement.column_count();
    let mut digests: Vec<[u8; 32]> = Vec::new();
    let mut rows = statement.query([number])?;
    while let Some(row) = rows.next()? {
        digests.push(row_digest(row, columns)?);
    }
    digests.sort_unstable();
    whole.update(table.as_bytes());
    whole.update((digests.len() as u64).to_le_bytes());
    digests.iter().for_each(|digest| whole.update(digest));
    Ok(())
}

/// The digest of a row: a tag for each value and, where the length is not fixed, the length.
fn row_digest(row: &Row, columns: usize) -> Result<[u8; 32], rusqlite::Error> {
    let mut hash = Sha256::new();
    for column in 0..columns {
        match row.get_ref(column)? {
            ValueRef::Null => hash.update([0]),
            ValueRef::Integer(value) => {
                hash.update([1]);
                hash.update(value.to_le_bytes());
            }
            ValueRef::Real(value) => {
                hash.update([2]);
                hash.update(value.to_le_bytes());
            }
            ValueRef::Text(bytes) | ValueRef::Blob(bytes) => {
                hash.update([3]);
                hash.update((bytes.len() as u64).to_le_bytes());
                hash.update(bytes);
            }
        }
    }
    Ok(hash.finalize().into())
}

/// Settings that are named as different.
const NAMED_MAX: usize = 8;

/// The settings that differ, each by its path with what it was; `None` if there is none.
pub fn differences(begun: &str, now: &str) -> Option<String> {
    let read = |text: &str| read_yaml::<Map<String, Value>>(text).unwrap_or_default();
    let mut differ = Vec::new();
    fields_that_differ("", &read(begun), &read(now), &mut differ);
    let more = differ.len().saturating_sub(NAMED_MAX);
    differ.truncate(NAMED_MAX);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    (!differ.is_empty()).then(|| differ.join(", ") + &more)
}

fn fields_that_differ(
    prefix: &str,
    begun: &Map<String, Value>,
    now: &Map<String, Value>,
    differ: &mut Vec<String>,
) {
    let mut keys: Vec<&String> = begun.keys().chain(now.keys()).collect();
    keys.sort();
    keys.dedup();
    keys.retain(|key| begun.get(*key) != now.get(*key));
    // The values that a digest covers say more than the digest.
    if keys.len() > 1 {
        keys.retain(|key| *key != "digest");
    }
    for key in keys {
        value_that_differs(&format!("{prefix}{key}"), begun.get(key), now.get(key), differ);
    }
}

fn value_that_differs(path: &str, begun: Option<&Value>, now: Option<&Value>, differ: &mut Vec<String>) {
    match (begun, now) {
        (Some(Value::Object(begun)), Some(Value::Object(now))) => {
            fields_that_differ(&format!("{path}."), begun, now, differ);
        }
        (Some(Value::Array(begun)), Some(Value::Array(now))) => {
            let places = 0..begun.len().max(now.len());
            for at in places.filter(|&at| begun.get(at) != now.get(at)) {
                value_that_differs(&format!("{path}[{at}]"), begun.get(at), now.get(at), differ);
            }
        }
        // A whole block would be too long to read.
        (Some(Value::Object(_) | Value::Array(_)), _) => differ.push(format!("`{path}` was given")),
        (Some(value), _) => differ.push(format!("`{path}` was {value}")),
        (None, _) => differ.push(format!("`{path}` was not there")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: &str = "seed: 1\nroads: [corner]\n";
    const LAYOUT: Layout = Layout {
        version: 3,
        schema: || OWN.to_owned(),
        unit: "episode",
        tables: &["episode", "step"],
        naming: Some(("step", "reason")),
        local: &[],
        apart: &[],
        sound: &[("step", "x BETWEEN 0 AND 1e9")],
    };
    const OWN: &str = "CREATE TABLE episode (episode INTEGER PRIMARY KEY, name TEXT) STRICT;
                       CREATE TABLE reason (reason INTEGER PRIMARY KEY, text TEXT) STRICT;
                       CREATE TABLE step (episode INTEGER, step INTEGER, x REAL, reason INTEGER) STRICT;";

    fn begun(path: &Path) -> Connection {
        let mut connection = LAYOUT.open(path, SETTINGS).unwrap();
        connection.execute("INSERT INTO reason VALUES (1, 'no room')", []).unwrap();
        for number in 0..3_i64 {
            let transaction = connection.transaction().unwrap();
            transaction.execute("INSERT INTO episode VALUES (?, 'a')", [number]).unwrap();
            transaction.execute("INSERT INTO step VALUES (?, 0, 0.5, ?1 % 2)", [number]).unwrap();
            LAYOUT.seal(&transaction, number).unwrap();
            transaction.commit().unwrap();
        }
        connection
    }

    #[test]
    fn what_was_changed_is_said() {
        let changes = [
            ("UPDATE step SET x = 0.25 WHERE episode = 1", "episode 1"),
            ("UPDATE episode SET name = 'b' WHERE episode = 2", "episode 2"),
            ("DELETE FROM step WHERE episode = 0", "episode 0"),
            ("DELETE FROM episode WHERE episode = 1", "episode 1"),
            ("INSERT INTO episode VALUES (7, 'a')", "episode 7"),
            ("DELETE FROM seal WHERE unit = 2", "episode 2"),
            ("UPDATE reason SET text = 'no lane'", "episode 1"),
            ("INSERT INTO reason VALUES (0, 'a red light')", "episode 0"),
            ("INSERT INTO step VALUES (9, 0, 0.5, NULL)", "episode 9"),
        ];
        for (change, what) in changes {
            let scratch = tempfile::tempdir().unwrap();
            let path = scratch.path().join("run.db");
            let connection = begun(&path);
            LAYOUT.open(&path, SETTINGS).expect("nothing was changed");
            connection.execute_batch(change).unwrap();
            drop(connection);
            let refused = LAYOUT.open(&path, SETTINGS).unwrap_err().to_string();
            assert!(refused.contains(what), "{change}: {refused}");
        }
    }

    #[test]
    fn rows_belong_to_their_settings() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path().join("run.db");
        let other = SETTINGS.replace("seed: 1", "seed: 2");
        begun(&path).execute("UPDATE begun SET settings = ?", [&other]).unwrap();
        let refused = LAYOUT.open(&path, &other).unwrap_err();
        assert!(matches!(refused, DatabaseError::Rows { number: 0, .. }), "{refused}");
    }

    #[test]
    fn only_tables_that_avastra_makes_are_read() {
        let endless =
            "WITH RECURSIVE n(reason, text) AS (SELECT 1, 'a' UNION ALL SELECT reason + 1, 'a' FROM n)";
        let view = format!("DROP TABLE reason; CREATE VIEW reason AS {endless} SELECT reason, text FROM n");
        let slow = "CHECK (length(hex(zeroblob(100000000))) > 0)";
        let endless_check = format!(
            "CREATE TABLE other AS SELECT * FROM begun; DROP TABLE begun; CREATE TABLE begun (only INTEGER PRIMARY KEY CHECK \
             (only = 1), settings TEXT NOT NULL {slow}) STRICT; INSERT INTO begun SELECT * FROM other; DROP TABLE other"
        );
        let changes = [
            (view.as_str(), "`reason` is no table"),
            ("CREATE VIEW more AS SELECT 1", "`more` is no table"),
            ("CREATE TRIGGER t AFTER INSERT ON step BEGIN DELETE FROM episode; END", "`t` is no table"),
            ("CREATE INDEX i ON step (hex(x))", "`i` is no table"),
            ("CREATE VIRTUAL TABLE places USING rtree(id, a, b)", "`places` is no table"),
            ("ALTER TABLE reason ADD COLUMN more TEXT AS (hex(text))", "`reason` is no table"),
            ("DROP TABLE reason", "`reason` is not there"),
            ("ALTER TABLE step DROP COLUMN x", "`step` is no table"),
            ("CREATE TABLE more (x, CHECK (x > 0))", "`more` is no table"),
            (endless_check.as_str(), "`begun` is no table"),
            ("CREATE TABLE more (x COLLATE nocase DEFAULT (hex(1)))", "`more` is no table"),
            (
                "DROP TABLE seal; CREATE TABLE seal (unit INTEGER, digest TEXT NOT NULL) STRICT",
                "`seal` is no table",
            ),
        ];
        for (change, what) in changes {
            let scratch = tempfile::tempdir().unwrap();
            let path = scratch.path().join("run.db");
            begun(&path).execute_batch(change).unwrap();
            let refused = LAYOUT.open(&path, SETTINGS).unwrap_err();
            assert!(refused.is_torn() && refused.to_string().contains(what), "{change}: {refused}");
        }
    }

    #[test]
    fn a_file_in_another_journal_mode_is_refused() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path().join("run.db");
        let mode = |connection: &Connection, mode: &str| -> String {
            connection.query_row(&format!("PRAGMA journal_mode = {mode}"), [], |row| row.get(0)).unwrap()
        };
        assert_eq!(mode(&begun(&path), "WAL"), "wal");
        std::fs::write(scratch.path().join("run.db-shm"), "mine").unwrap();
        let refused = LAYOUT.open(&path, SETTINGS).unwrap_err();
        assert!(matches!(refused, DatabaseError::Journal), "{refused}");
        assert_eq!(std::fs::read(scratch.path().join("run.db-shm")).unwrap(), b"mine");
        assert_eq!(mode(&Connection::open(&path).unwrap(), "DELETE"), "delete");
        LAYOUT.open(&path, SETTINGS).expect("it is as it was");
    }

    #[test]
    fn numbers_that_no_play_gives_count_as_changed_rows() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path().join("run.db");
        drop(begun(&path));
        for number in ["-5", "1e12", "9e999", "NULL"] {
            let connection = Connection::open(&path).unwrap();
            let forged =
                format!("UPDATE step SET x = {number} WHERE episode = 1; DELETE FROM seal WHERE unit = 1");
            connection.execute_batch(&forged).unwrap();
            LAYOUT.seal(&connection, 1).unwrap();
            drop(connection);
            let refused = LAYOUT.open(&path, SETTINGS).unwrap_err();
            assert!(matches!(refused, DatabaseError::Rows { number: 1, .. }), "{number}: {refused}");
        }
    }

    #[test]
    fn a_torn_file_is_refused_or_holds_what_was_written() {
        let scratch = tempfile::tempdir().unwrap();
        let path = scratch.path().join("run.db");
        let rows = |connection: &Connection| -> String {
            let query = "SELECT group_concat(episode || name || (SELECT group_concat(x) FROM step
                         WHERE step.episode = episode.episode)) FROM episode";
            connection.query_row(query, [], |row| row.get(0)).unwrap()
        };
        let written = rows(&begun(&path));
        let whole = std::fs::read(&path).unwrap();
        let mut refused = 0;
        for at in (100..whole.len()).step_by(97) {
            let mut torn = whole.clone();
            torn[at] ^= 0x55;
            std::fs::write(&path, &torn).unwrap();
            // A byte that no row and no page needs may differ.
            match LAYOUT.open(&path, SETTINGS) {
                Ok(connection) => assert_eq!(rows(&connection), written, "byte {at}"),
                Err(_) => refused += 1,
            }
        }
        assert!(refused > 0, "pages are checked");
        for length in [300, whole.len() / 2, whole.len() / 4 * 3] {
            std::fs::write(&path, &whole[..length]).unwrap();
            let refused = LAYOUT.open(&path, SETTINGS).unwrap_err();
            assert!(refused.is_torn(), "{length} bytes: {refused}");
        }
        std::fs::write(&path, &whole).unwrap();
        let other = Layout { version: 4, ..LAYOUT };
        for refused in [other.open(&path, SETTINGS), LAYOUT.open(&path, "seed: 2")] {
            let refused = refused.unwrap_err();
            assert!(!refused.is_torn(), "{refused}");
        }
    }

    #[test]
    fn settings_are_told_apart_by_their_fields() {
        let profile = |range_m: u32, digest: &str| {
            format!(
                "seed: 1\nprofile:\n  digest: {digest}\n  settings: {{ sight: {{ range_m: {range_m} }}, plan: 1 }}\n"
            )
        };
        let found = |now: &str| differences(&profile(80, "a"), now);
        assert_eq!(found(&profile(80, "a")), None);
        assert_eq!(differences("a: [b]\nc: 1\n", "# a comment\nc: 1\na:\n  - b"), None);
        assert_eq!(found(&profile(60, "b")).unwrap(), "`profile.settings.sight.range_m` was 80");
        assert_eq!(found(&profile(80, "b")).unwrap(), "`profile.digest` was \"a\"");
        assert_eq!(found("seed: 2\n").unwrap(), "`profile` was given, `seed` was 1");
        let agents = |rate: f64, last: &str| {
            let agent = |rate: f64| format!("{{ agent: ddqn, training: {{ rate: {rate} }} }}");
            format!("agents: [{}, {}{last}]", agent(0.5), agent(rate))
        };
        let found = |now: &str| differences(&agents(0.5, ", { agent: none }, 3"), now).unwrap();
        let rate = "`agents[1].training.rate` was 0.5";
        assert_eq!(found(&agents(0.25, ", { agent: none }, 3")), rate);
        assert_eq!(found(&agents(0.25, "")), format!("{rate}, `agents[2]` was given, `agents[3]` was 3"));
        let one_more = "`agents[4]` was not there";
        assert_eq!(found(&agents(0.5, ", { agent: none }, 3, { agent: random }")), one_more);
        let (many, none) = ((0..11).map(|at| format!("k{at:02}: 1\n")).collect::<String>(), "");
        assert!(differences(none, &many).unwrap().ends_with("`k07` was not there and 3 more"));
    }
}
