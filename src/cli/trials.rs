//! `avastra table --try`: carries out every row on every road, and judges it.

use std::path::Path;

use avastra_campaign::emit::{self, Provenance};
use avastra_campaign::run::{Arena, driving_system};
use avastra_campaign::trial::{Cell, TrialSettings, Trials};
use avastra_exchange::report;
use avastra_lang::syntax;
use avastra_world::action::ActionTable;

use super::arguments::TableArguments;
use super::compile::TableResult;
use super::conditions::roads_or_all;
use super::error::Failure;
use super::files::{make, write};
use super::load;
use super::output::Output;
use super::progress::Pieces;

/// Undisturbed drives of each road, from whose steps the tries set out. Ours.
const DRIVES: u32 = 8;

/// Tries the rows of a table and prints the results.
pub fn trials(output: &Output, arguments: &TableArguments, table: ActionTable) -> Result<(), Failure> {
    let roads = roads_or_all(arguments.road.as_slice(), table.space());
    let wanted = &arguments.trials;
    let given = load::driver(&wanted.ads)?;
    if let Some(command) = given.command {
        let message = format!("`{command}` cannot try rows: name a driving system of avastra");
        return Err(Failure::usage(message));
    }
    let mut ads = driving_system(given.ads)?;
    if let Some(path) = given.profile {
        ads = ads.with_profile(load::profile(path)?).expect("the default driving system has settings");
    }
    let arena = Arena::new(table, &roads, ads, &arguments.why.with, &arguments.why.without)?;
    let settings = TrialSettings { drives: DRIVES, tries: wanted.tries, seed: wanted.seed };
    let trials = Trials::new(&arena, settings);
    let progress = Pieces::new(output, "rows on roads", arena.roads() * arena.table().rows().len());
    let cells = trials.cells(&|| progress.one());
    drop(progress);
    if let Some(directory) = &wanted.out {
        for (index, cell) in cells.iter().enumerate() {
            emit_sample(&trials, &arena, index % arena.roads(), cell, arguments, directory)?;
        }
    }
    output.say(report::trials(&cells).trim_end());
    let has_before = cells.iter().any(|cell| cell.after.is_some());
    let but = if has_before { ", but for who must be there" } else { "" };
    output.tell(&format!("each row was tried alone{but}: the roads held no other traffic"));
    output.result(TableResult { table: arena.table().file(), trials: Some(settings), cells: Some(cells) });
    Ok(())
}

/// Writes a try as a scenario: the first one that failed, or the first.
fn emit_sample(
    trials: &Trials,
    arena: &Arena,
    road: usize,
    cell: &Cell,
    arguments: &TableArguments,
    directory: &Path,
) -> Result<(), Failure> {
    let sample = cell.samples.iter().find(|sample| sample.failure.is_some()).or(cell.samples.first());
    let Some(sample) = sample else { return Ok(()) };
    let log = trials.again(road, cell, sample);
    let name = format!("row{:02}_{}", cell.row, cell.road);
    let path = directory.join(format!("{name}.ava"));
    make(directory)?;
    let source = Provenance {
        command: "table --try",
        name: &name,
        space_path: &load::relative(directory, &arguments.file)?,
        episode: 0,
        agent: "trial",
        without: &arguments.why.without,
        with: &arguments.why.with,
    };
    let fate = sample.failure.as_deref().unwrap_or("it does what the row says");
    let headline = format!("{} in step {}: {fate}.", cell.label, sample.step);
    write(&path, &syntax::print(&emit::unclaimed(arena.table(), &log, &headline, &source)))
}
