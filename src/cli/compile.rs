//! `avastra compile` and `avastra table`: the typed action table as a file and as text.

use std::path::{Path, PathBuf};

use avastra_base::outside::Shown;
use avastra_campaign::run::road_named;
use avastra_campaign::trial::{Cell, TrialSettings};
use avastra_world::action::{ActionTable, TableFile};

use super::arguments::{CompileArguments, TableArguments};
use super::error::Failure;
use super::files::{folder, write, write_result};
use super::output::{Output, plural};
use super::{doc, load, trials, why};

/// The folder for tables without `--out`.
const FOLDER: &str = "build";

/// The file that names the table for `avastra run` without a space.
const LAST: &str = "build/last";

/// Writes the table and remembers it as the last.
pub fn compile(output: &Output, arguments: &CompileArguments) -> Result<(), Failure> {
    let table = load::table(output, &arguments.file)?;
    let path = arguments.output.clone().unwrap_or_else(|| {
        let stem = arguments.file.file_stem().unwrap_or_default().to_string_lossy();
        Path::new(FOLDER).join(format!("{stem}.table.yaml"))
    });
    let text = table.yaml().map_err(|error| Failure::file("write", &path, error))?;
    folder(Path::new(""), FOLDER)?;
    write_result(arguments.output.as_ref(), &path, &text)?;
    write(Path::new(LAST), &format!("{}\n", path.shown()))?;
    output.tell(&format!("{}: {} -> {}", arguments.file.shown(), size(&table), path.shown()));
    output.result(serde_json::json!({ "table": path, "rows": table.rows().len() }));
    Ok(())
}

/// The table compiled last in this directory, checked against its sources.
pub fn last(output: &Output) -> Result<ActionTable, Failure> {
    let no_table = || {
        Failure::usage(
            "no compiled table here: run `avastra compile FILE` first, or name a space: `avastra run FILE`",
        )
    };
    let path = load::read(Path::new(LAST)).map_err(|_| no_table())?;
    let path = PathBuf::from(path.trim_end());
    let file: TableFile = load::parsed(&path, &load::text(&path)?)?;
    let table = load::table(output, Path::new(&file.space))?;
    if table.file() != file {
        return Err(Failure::usage(format!(
            "`{}` is older than its sources: run `avastra compile {}` again",
            path.shown(),
            file.space
        )));
    }
    Ok(table)
}

/// Prints the table.
pub fn table(output: &Output, arguments: &TableArguments) -> Result<(), Failure> {
    let table = load::table(output, &arguments.file)?;
    if let Some(road) = &arguments.road {
        road_named(table.space(), road)?;
    }
    if arguments.markdown {
        doc::doc(output, table.space());
        return Ok(());
    }
    if let Some(row) = arguments.why.row {
        return why::why(output, arguments, &table, row);
    }
    if arguments.r#try {
        return trials::trials(output, arguments, table);
    }
    output.say(table.text(arguments.road.as_deref()).trim_end());
    output.result(TableResult { table: table.file(), trials: None, cells: None });
    Ok(())
}

/// A table in JSON; with `--try`, what became of each row on each road.
#[derive(serde::Serialize)]
pub struct TableResult {
    #[serde(flatten)]
    pub table: TableFile,
    pub trials: Option<TrialSettings>,
    pub cells: Option<Vec<Cell>>,
}

/// `45 rows of 10 actions, 8 rules, 1 road`.
fn size(table: &ActionTable) -> String {
    let space = table.space();
    format!(
        "{} of {}, {}, {}",
        plural(table.rows().len(), "row"),
        plural(space.actions.len(), "action"),
        plural(space.rules.len(), "rule"),
        plural(space.roads.len(), "road"),
    )
}
