//! `avastra export --to openscenario` of a space: what its rows let happen at the start, as templates with lists of their values.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use avastra_base::outside::Shown;
use avastra_campaign::run::{Arena, driving_system};
use avastra_exchange::export::{self, SpaceFiles};
use avastra_lang::syntax::ast::{FileId, ItemKind};
use avastra_lang::syntax::parse;

use super::arguments::{ExportArguments, ExportFormat};
use super::conditions::roads_or_all;
use super::error::Failure;
use super::export::{FOLDER, map_name};
use super::files::{copy_map, folder, make, target, write};
use super::load;
use super::output::{Output, plural};

/// Rows that are left out for one reason are named up to so many.
const NAMED_MAX: usize = 3;

/// Whether all files are spaces to be exported: they declare no scenario and no policy.
pub fn is_asked(arguments: &ExportArguments) -> bool {
    arguments.to == ExportFormat::Openscenario && arguments.many.files.iter().all(|file| is_space(file))
}

fn is_space(file: &Path) -> bool {
    let Ok(text) = load::text(file) else { return false };
    let (tree, _) = parse(FileId::default(), &text);
    let mut items = tree.items.iter();
    !tree.items.is_empty()
        && !items.any(|item| matches!(item.kind, ItemKind::Scenario(_) | ItemKind::Policy(_)))
}

/// Writes the files of spaces.
pub fn export_spaces(output: &Output, arguments: &ExportArguments) -> Result<(), Failure> {
    if arguments.natural || arguments.profile.is_some() || arguments.ego.is_some() {
        return Err(Failure::usage(
            "`--natural`, `--profile` and `--ego` are for scenarios: a space has no recording",
        ));
    }
    let (mut files, mut written, mut left_out) = (BTreeSet::new(), 0, Vec::new());
    for file in &arguments.many.files {
        let found = one(output, arguments, file, &mut files)?;
        let rows: usize = found.templates.iter().map(|template| template.rows).sum();
        written += rows;
        output.say(&format!(
            "{}: {} of {} on their roads in {}",
            file.shown(),
            rows,
            plural(rows + found.left_out.values().map(Vec::len).sum::<usize>(), "row"),
            plural(found.templates.len(), "template")
        ));
        for (reason, rows) in &found.left_out {
            let named = rows.iter().take(NAMED_MAX).map(|row| format!("`{row}`")).collect::<Vec<_>>();
            let more = rows.len().saturating_sub(NAMED_MAX);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            output.say(&format!("  left out: {reason}: {}{more}", named.join(", ")));
        }
        left_out.push(serde_json::json!({ "file": file, "rows": found.left_out }));
    }
    output.result(serde_json::json!({ "files": files, "rows": written, "left_out": left_out }));
    match written {
        0 => Err(Failure::usage("nothing of it can be said in OpenSCENARIO: the reasons stand above")),
        _ => Ok(()),
    }
}

fn one(
    output: &Output,
    arguments: &ExportArguments,
    file: &Path,
    files: &mut BTreeSet<PathBuf>,
) -> Result<SpaceFiles, Failure> {
    let table = load::table(output, file)?;
    let roads = roads_or_all(&[], table.space());
    // The arena's driving system never drives: the files are for testing another one.
    let ads = driving_system("modular")?;
    let arena = Arena::new(table, &roads, ads, &[], &[])?;
    let place = target(file, arguments.out.as_ref(), FOLDER, "xosc")?;
    let stem = place.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let mut maps: BTreeMap<String, PathBuf> = BTreeMap::new();
    for road in &arena.table().space().roads {
        let name = map_name(&road.map_path)?.to_owned();
        if let Some(other) =
            maps.insert(name.clone(), road.map_path.clone()).filter(|other| *other != road.map_path)
        {
            let (other, own) = (other.shown(), road.map_path.shown());
            return Err(Failure::usage(format!(
                "the maps `{other}` and `{own}` would both be written as `{name}`"
            )));
        }
    }
    let named = |name: &str| format!("{stem}_{name}.xosc");
    let list = |name: &str| format!("{stem}_{name}_variations.xosc");
    let map_file = |path: &PathBuf| map_name(path).unwrap_or_default().to_owned();
    let found = export::space(&arena, &named, &map_file);
    if found.templates.is_empty() {
        return Ok(found);
    }
    let into = place.parent().unwrap_or(Path::new(""));
    let mut own = BTreeSet::new();
    for template in &found.templates {
        let listed = template.variations.as_ref().map(|_| list(&template.name));
        for name in [Some(named(&template.name)), listed].into_iter().flatten() {
            let path = into.join(&name);
            if files.contains(&path) || !own.insert(path) {
                return Err(Failure::usage(format!(
                    "two files would be written as `{name}`: export the spaces to two folders, or rename an action"
                )));
            }
        }
    }
    match &arguments.out {
        Some(named) => make(named)?,
        None => drop(folder(into.parent().unwrap_or(Path::new("")), FOLDER)?),
    }
    for template in &found.templates {
        let map = into.join(map_file(&template.map_path));
        copy_map(&template.map_path, &map)?;
        files.insert(map);
        let path = into.join(named(&template.name));
        write(&path, &template.text)?;
        files.insert(path);
        if let Some(variations) = &template.variations {
            let path = into.join(list(&template.name));
            write(&path, variations)?;
            files.insert(path);
        }
    }
    Ok(found)
}
