//! The tables of a run database as columns, for programs that calculate with them.

use std::path::Path;

use rusqlite::OpenFlags;
use rusqlite::types::ValueRef;

use crate::run::database::LAYOUT;
use crate::run::sealed::{DatabaseError, open_file};

/// A column of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    pub name: String,
    pub values: Values,
}

/// The values of a column, one for each row.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// A missing value is NaN.
    Real(Vec<f64>),
    /// A missing value is -1; no column has negative numbers.
    Integer(Vec<i64>),
    Text(Vec<Option<String>>),
}

/// The columns of a table of `run.db` (`episode`, `step`, `collision`, `learning`, …), rows by rising key. The file is read
/// and not changed. Columns of bytes (`checkpoint.learner`) are left out: they are no values to calculate with.
///
/// # Errors
/// If the file cannot be read, has another layout, or has no such table.
pub fn columns(path: &Path, table: &str) -> Result<Vec<Column>, DatabaseError> {
    let connection = open_file(path, OpenFlags::SQLITE_OPEN_READ_ONLY)?;
    if !LAYOUT.is_in(&connection)? {
        return Err(DatabaseError::Empty);
    }
    LAYOUT.check_tables(&connection)?;
    let mut described = connection
        .prepare("SELECT name, type, pk FROM pragma_table_info(?) WHERE type <> 'BLOB' ORDER BY cid")?;
    let described: Vec<(String, String, i64)> = described
        .query_map([table], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))?
        .collect::<Result<_, _>>()?;
    if described.is_empty() {
        let known: Vec<String> = LAYOUT.tables.iter().map(|name| format!("`{name}`")).collect();
        return Err(DatabaseError::NoTable { name: table.to_owned(), known: known.join(", ") });
    }
    let mut columns: Vec<Column> = described
        .iter()
        .map(|(name, kind, _)| Column {
            name: name.clone(),
            values: match kind.as_str() {
                "REAL" => Values::Real(Vec::new()),
                "INTEGER" => Values::Integer(Vec::new()),
                _ => Values::Text(Vec::new()),
            },
        })
        .collect();
    let mut keys: Vec<(i64, &str)> =
        described.iter().filter(|(_, _, key)| *key > 0).map(|(name, _, key)| (*key, name.as_str())).collect();
    keys.sort_unstable();
    let keys: Vec<String> = keys.into_iter().map(|(_, name)| quoted(name)).collect();
    let names: Vec<String> = columns.iter().map(|column| quoted(&column.name)).collect();
    let (names, keys) = (names.join(", "), keys.join(", "));
    let mut query = connection.prepare(&format!("SELECT {names} FROM {} ORDER BY {keys}", quoted(table)))?;
    let mut rows = query.query([])?;
    while let Some(row) = rows.next()? {
        for (index, column) in columns.iter_mut().enumerate() {
            column.values.push(row.get_ref(index)?)?;
        }
    }
    Ok(columns)
}

fn quoted(name: &str) -> String {
    format!("\"{}\"", name.replace('"', "\"\""))
}

impl Values {
    fn push(&mut self, value: ValueRef) -> Result<(), DatabaseError> {
        match (self, value) {
            (Values::Real(values), ValueRef::Null) => values.push(f64::NAN),
            (Values::Real(values), ValueRef::Real(value)) => values.push(value),
            (Values::Integer(values), ValueRef::Null) => values.push(-1),
            (Values::Integer(values), ValueRef::Integer(value)) => values.push(value),
            (Values::Text(values), ValueRef::Null) => values.push(None),
            (Values::Text(values), ValueRef::Text(bytes)) => {
                values.push(Some(String::from_utf8_lossy(bytes).into_owned()));
            }
            // The tables that avastra makes are strict, so no other type gets in: another program made this one.
            _ => {
                return Err(DatabaseError::Damaged {
                    what: "a value is not of its column's type".to_owned(),
                });
            }
        }
        Ok(())
    }
}
