//! `avastra report`: one page of HTML for a run, a training, a study, an estimate or single scenarios.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde_json::Value;

use avastra_base::outside::Shown;
use avastra_campaign::run::{
    Asked, Database, DatabaseError, FoundIn, HeatMap, ProtocolTest, RunSettings, Tally, Units, heat_maps,
    main_maps, parameters, recorded, scenario_name,
};
use avastra_campaign::study::StudyResults;
use avastra_campaign::train::TrainSettings;
use avastra_exchange::report::{self, Page, Scene, record, record_another};
use avastra_lang::check::normal;
use avastra_lang::syntax::{listed, read_yaml};
use avastra_world::action::ActionTable;

use super::arguments::{FilesArguments, ReportArguments};
use super::campaign::{KINDS, lacks, missing};
use super::error::Failure;
use super::files::{must_end_in, place, write_result};
use super::load;
use super::look::{self, Looked};
use super::output::{Output, for_shell, plural};
use super::parallel::{PerFile, each_file};
use super::replay::refutation;
use super::study::Sound;
use super::{estimate, protocol, run_directory, shrink, study};

/// Name of the page in a directory.
const NAME: &str = "report.html";

/// The folders of a run directory that hold scenarios.
const FOLDERS: [&str; 4] = ["critical", "failures", run_directory::KEPT, shrink::FOLDER];

/// Writes the page of a directory or of files. A scenario that does not play as its file claims is shown, said so of before
/// all else, and fails the command.
pub fn report(output: &Output, arguments: &ReportArguments) -> Result<(), Failure> {
    let path = place(arguments.output.as_ref(), default_path(&arguments.paths))?;
    must_end_in(&path, "html")?;
    let asked = arguments.ads.as_deref().map(|text| load::asked(Some(text))).transpose()?;
    let is_folder = matches!(arguments.paths.as_slice(), [directory] if directory.is_dir());
    let found = match arguments.paths.as_slice() {
        [directory] if directory.is_dir() => of_directory(output, directory, &arguments.by)?,
        files => of_files(files)?,
    };
    let is_run = is_folder && arguments.paths[0].join("run.yaml").is_file();
    if !arguments.by.is_empty() && !is_run {
        return Err(Failure::usage("`--by` draws heat maps of what a run drew: name the folder of a run"));
    }
    let (files, left_out) = chosen(&found, arguments.most as usize);
    let many = FilesArguments { files, jobs: arguments.jobs };
    let program = asked.as_ref().and_then(|asked| asked.external.as_ref());
    let mut played = match many.files.is_empty() {
        true => None,
        false => Some(each_file(output, &many, program, |file| scene(output, file, asked.as_ref()))?),
    };
    let mut remarks = found.remarks;
    if left_out > 0 {
        remarks.push(format!(
            "{} left out: {}; `--most N` shows more",
            plural(left_out, "scenario"),
            match found.worst.is_empty() {
                true => "those that are shown come first by name, and the worst may be missing",
                false =>
                    "the worst comes first, then one of each kind of failure, then the others, worst first",
            }
        ));
    }
    let failed = played.as_ref().map_or_else(Vec::new, PerFile::failed_in_json);
    for failed in &failed {
        let file = failed["file"].as_str().unwrap_or_default();
        let mistake =
            look::first_mistake(Path::new(file)).map_or_else(String::new, |found| format!(": {found}"));
        remarks.push(format!(
            "{file} cannot be played: {}{mistake}",
            failed["error"].as_str().unwrap_or_default()
        ));
    }
    if found.overview.is_null() && played.as_ref().is_none_or(|played| played.done.is_empty()) {
        match played {
            // The page of a folder then lists the files that could not be played, and why.
            Some(_) if is_folder => {}
            Some(played) => return played.complete("played"),
            None => return Err(Failure::usage(format!("`{}` holds nothing to report", found.title))),
        }
    }
    let mut scenes = played.as_mut().map_or_else(Vec::new, |played| std::mem::take(&mut played.done));
    name_apart(&mut scenes);
    let banner = |scene: &Scene| Some((scene.file.clone(), scene.changed.clone()?));
    for banner in look::together(scenes.iter().filter_map(banner)) {
        output.warn(&banner);
        remarks.push(banner);
    }
    let refuted = scenes.iter().map(|scene| scene.recording.refuted.len()).sum();
    for Scene { file, recording, .. } in scenes.iter().filter(|scene| !scene.recording.refuted.is_empty()) {
        let first = &recording.refuted[0];
        output.warn(&format!(
            "{file} does not play as it claims: claimed {}, found {}",
            first.claim, first.found
        ));
    }
    let changes = changes(&scenes);
    let (scenarios, title) = (scenes.len(), found.title.clone());
    let copies = scenes.iter().filter(|scene| scene.shrunk_from.is_some()).count();
    let compared_with = arguments.ads.clone();
    let html = Page { title, overview: found.overview, remarks, scenes, compared_with }.html();
    write_result(arguments.output.as_ref(), &path, &html)?;
    output.say(&format!(
        "{}: {}{}, {:.1} MB; open it with a browser",
        path.shown(),
        plural(scenarios, "scenario"),
        if copies > 0 { format!(", {copies} of them shrunk from another") } else { String::new() },
        html.len() as f64 / 1e6
    ));
    if let Some(other) = &arguments.ads {
        let told: Vec<String> =
            changes.iter().map(|(kind, count)| format!("{count} {}", kind.replace('_', " "))).collect();
        output.say(&format!("with {other}: {}", told.join(", ")));
    }
    output.result(serde_json::json!({
        "page": path, "scenarios": scenarios, "shrunk": copies, "left_out": left_out, "bytes": html.len(), "refuted": refuted,
        "compared": arguments.ads.as_ref().map(|_| changes), "failed": failed,
    }));
    played.map_or(Ok(()), |played| played.complete("played"))?;
    refutation(refuted)
}

/// The content of a path.
#[derive(Default)]
struct Found {
    title: String,
    overview: Value,
    files: Vec<PathBuf>,
    /// Names of the scenarios that show a kind of failure each.
    examples: Vec<String>,
    /// Names of the scenarios with a collision, the worst first; empty if nothing tells.
    worst: Vec<String>,
    remarks: Vec<String>,
}

/// Scenarios, each once.
fn of_files(paths: &[PathBuf]) -> Result<Found, Failure> {
    if let Some(folder) = paths.iter().find(|path| path.is_dir()) {
        let folder = folder.shown();
        return Err(Failure::usage(format!(
            "`{folder}` is a folder: a page is about one folder, or about scenarios; name it alone"
        )));
    }
    let mut known = BTreeSet::new();
    let files = paths.iter().filter(|path| known.insert(normal(path))).cloned().collect();
    Ok(Found { title: title(paths), files, ..Found::default() })
}

/// A run, a training, a study, an estimate, or a folder of scenarios.
fn of_directory(output: &Output, directory: &Path, by: &[String]) -> Result<Found, Failure> {
    let mut found = Found { title: title(&[directory.to_owned()]), ..Found::default() };
    for folder in FOLDERS {
        let folder = directory.join(folder);
        if folder.is_dir() {
            found.files.extend(load::sources_in(&folder)?);
        }
    }
    let settings = |command: &str| directory.join(command).with_extension("yaml");
    let mut remarks = Vec::new();
    if settings("run").is_file() {
        remarks = of_run(output, directory, &load::text(&settings("run"))?, by, &mut found)?;
    } else if settings("study").is_file() {
        if run_directory::lost(&directory.join("study.db")).is_some() {
            return Err(without_results(directory, "study", None));
        }
        let Sound { settings: of_study, cells, changed, missing } = study::read_sound(directory)?;
        if cells.is_empty() {
            return Err(without_results(directory, "study", changed));
        }
        remarks.extend(changed.into_iter().chain(missing));
        let results = in_json(&StudyResults::new(&of_study, &cells));
        found.overview = report::of_study(&results, &load::text(&settings("study"))?);
    } else if settings("estimate").is_file() {
        let contents = estimate::read(directory)?;
        let Some(results) = contents.results else {
            return Err(without_results(directory, "estimate", contents.damaged));
        };
        remarks.extend(contents.damaged);
        remarks.extend(contents.remarks);
        found.overview = report::of_estimate(&in_json(&results), &contents.settings);
    } else {
        remarks.extend(without_settings(directory));
        if found.files.is_empty() {
            found.files = load::sources_in(directory)?;
        }
    }
    remarks.iter().for_each(|remark| output.warn(remark));
    found.remarks.extend(remarks);
    Ok(found)
}

/// Says that the settings of a campaign are gone, where its database or something else in their place tells of one.
fn without_settings(directory: &Path) -> Option<String> {
    KINDS.into_iter().find_map(|kind| {
        let settings = kind.settings(directory);
        let how = if settings.exists() { "no file" } else { "missing" };
        let is_one = settings.exists() || kind.database(directory).is_file();
        is_one.then(|| format!("`{}` is {how}: only scenarios are shown", settings.shown()))
    })
}

/// The failure of a directory without results. `damaged` says which of its rows were changed, if any were.
fn without_results(directory: &Path, command: &str, damaged: Option<String>) -> Failure {
    let resume = format!("`avastra {command} --resume {}`", for_shell(directory));
    let directory = directory.shown();
    Failure::usage(match damaged {
        None => format!("`{directory}` has no results yet: finish it with {resume}"),
        Some(damaged) => format!("`{directory}` has no results: {damaged}; {resume} plays them again"),
    })
}

fn in_json(results: &impl serde::Serialize) -> Value {
    serde_json::to_value(results).expect("results have string keys only")
}

/// Adds the results in the database of a run or training, and returns remarks for the page. `settings` is the text of its
/// `run.yaml`.
fn of_run(
    output: &Output,
    directory: &Path,
    settings: &str,
    asked: &[String],
    found: &mut Found,
) -> Result<Vec<String>, Failure> {
    let path = directory.join("run.db");
    if let Some(how) = run_directory::lost(&path) {
        return Ok(vec![format!("`{}` is {how}: only scenarios are shown", path.shown())]);
    }
    let unread = |error| Failure::file("read", &path, error);
    let (database, changed) = run_directory::open_to_read::<Database>(&path, settings)?;
    let is_changed = changed.is_some();
    let mut remarks: Vec<String> = changed.into_iter().collect();
    remarks.extend(match run_directory::is_training(directory) {
        Some(true) if !is_changed => missing_of_training(directory, settings, &database)?,
        Some(false) => match read_yaml::<RunSettings>(settings) {
            Ok(run) => missing(directory, &run, &database, |_| true)?
                .map(|text| if run.budget.is_some() { unfinished_text("run", directory) } else { text }),
            // The work that settings of another version ask for is not known.
            Err(_) => None,
        },
        _ => None,
    });
    let written = run_directory::written(directory, database.scenarios().map_err(unread)?);
    remarks.extend(run_directory::remarks_on(&written));
    if let Some(kind) = run_directory::what_was_begun(directory).filter(|_| !is_changed) {
        remarks.extend(run_directory::foreign_text(&kind, directory, &written));
    }
    remarks.extend(run_directory::remark_on_copy(directory));
    let space = run_directory::begun_in(settings).and_then(|(begun, _)| Some(directory.join(begun.space?)));
    // A page of what was found is worth having without the names of the rows.
    let table: Option<ActionTable> = space.and_then(|space| load::table(output, &space).ok());
    if table.is_none() {
        found.remarks.push("the space of the run cannot be read: its rows have numbers only".to_owned());
    }
    let is_training = run_directory::is_training(directory) == Some(true);
    // A training that is not finished has not been judged yet, and a run never is.
    let results = match database.results() {
        Err(DatabaseError::Results) | Ok(Some(_)) if !is_training => {
            let path = path.shown();
            remarks.push(format!("`{path}` has results, which only a training has: they count for nothing"));
            None
        }
        Err(error @ DatabaseError::Results) => {
            remarks.push(unread(error).to_string());
            None
        }
        results => results.map_err(unread)?,
    };
    let results: Option<Value> = results.and_then(|text| serde_json::from_str(&text).ok());
    let is_protocol = read_yaml::<RunSettings>(settings).is_ok_and(|run| run.rows > 0);
    let space = table.as_ref().filter(|_| is_protocol).map(|table| &**table.space());
    let tests = database.tests(space).map_err(unread)?;
    let heat = maps(asked, &tests, is_protocol)?.into_iter();
    let heat: Vec<HeatMap> = match &table {
        Some(table) => heat.map(|map| map.told_by(table.space())).collect(),
        None => heat.collect(),
    };
    let (table, results) = (table.as_ref(), results.as_ref());
    found.overview = report::of_run(&database, table, settings, results, &heat).map_err(unread)?;
    if is_protocol {
        found.overview["protocol"] =
            serde_json::json!({ "text": protocol::counts_text(&tests), "tally": Tally::of(&tests) });
    }
    let groups = database.groups().map_err(unread)?;
    found.examples = groups.iter().map(|group| scenario_name(&group.road, group.episode)).collect();
    found.worst = database.found().map_err(unread)?.iter().map(FoundIn::name).collect();
    Ok(remarks)
}

/// The heat maps of a run: by the parameters that are asked for, or the main ones of a protocol.
fn maps(asked: &[String], tests: &[ProtocolTest], is_protocol: bool) -> Result<Vec<HeatMap>, Failure> {
    if asked.is_empty() {
        return Ok(if is_protocol { main_maps(tests) } else { Vec::new() });
    }
    let mut found = Vec::new();
    for text in asked {
        let (down, across) = text.split_once(',').unwrap_or((text, ""));
        let maps = heat_maps(tests, down.trim(), across.trim());
        if maps.is_empty() || down.trim().is_empty() {
            let known = listed(&parameters(tests).iter().map(String::as_str).collect::<Vec<_>>());
            let message = format!(
                "`--by {text}`: no action that was carried out has these parameters: name one or two of {known}"
            );
            return Err(Failure::usage(message));
        }
        found.extend(maps);
    }
    Ok(found)
}

/// Says that what a command began is not played to the end, where nothing tells how much is left.
fn unfinished_text(command: &str, directory: &Path) -> String {
    let directory = for_shell(directory);
    format!("it is not played to the end: `avastra {command} --resume {directory}` goes on with it")
}

/// Says how many episodes a training lacks. If later ones are there, they learned from it, so it cannot be gone on with.
fn missing_of_training(
    directory: &Path,
    settings: &str,
    database: &Database,
) -> Result<Option<String>, Failure> {
    let Ok(training) = read_yaml::<TrainSettings>(settings) else { return Ok(None) };
    let unread = |error| Failure::file("read", &directory.join("run.db"), error);
    // A training by time has as many episodes as it took; it is done if it has results.
    let is_done = matches!(database.results(), Ok(Some(_)) | Err(DatabaseError::Results));
    let there = database.episodes().map_err(unread)?;
    let wanted =
        if training.hours.is_some() { there.len() } else { training.episodes as usize + training.judging() };
    let lacking = wanted.saturating_sub(there.len());
    let is_gap = there.last().is_some_and(|&last| last >= there.len());
    Ok(match is_gap {
        true => Some(format!(
            "{lacking} of {} missing, and later ones learned from what is missing: begin a new training",
            plural(wanted, "episode")
        )),
        false if lacking == 0 && !is_done => Some(unfinished_text("train", directory)),
        false => lacks::<TrainSettings>(directory, lacking, wanted),
    })
}

/// The files to play, and how many are left out. The worst comes first, then one of each kind of failure, then the others,
/// worst first.
fn chosen(found: &Found, most: usize) -> (Vec<PathBuf>, usize) {
    let rank_of: BTreeMap<&str, usize> =
        found.worst.iter().enumerate().map(|(rank, name)| (name.as_str(), rank)).collect();
    let place = |file: &PathBuf| {
        let stem = file.file_stem().unwrap_or_default().to_string_lossy();
        let rank = rank_of.get(stem.as_ref()).copied().unwrap_or(usize::MAX);
        let is_first = rank == 0 || found.examples.iter().any(|example| *example == stem);
        (!is_first, rank)
    };
    let mut files = found.files.clone();
    files.sort_by_cached_key(place);
    let left_out = files.len().saturating_sub(most);
    files.truncate(most);
    (files, left_out)
}

fn scene(output: &Output, file: &Path, compared: Option<&Asked>) -> Result<Scene, Failure> {
    let Looked { table, scenario, changed } = look::scenario(output, file)?;
    let source = load::text(file)?;
    let ads = recorded(&scenario)?;
    let recording = record(&table, &scenario, &ads, &source)?;
    let another = |asked: &Asked| {
        let (other, _) = asked.selected_for(&scenario)?;
        record_another((&table, &scenario), (&recording, &ads), &other, &source)
    };
    let compared = compared.map(another).transpose()?;
    let changed = changed.map(|changed| changed.banner(recording.is_same));
    let is_shrunk = file.parent().is_some_and(|folder| folder.ends_with(shrink::FOLDER));
    let shrunk_from = is_shrunk.then(|| shrink::found_name(&scenario.name).to_owned());
    Ok(Scene { file: file.to_string_lossy().into_owned(), recording, compared, shrunk_from, changed })
}

/// How many crashes became what with the other driving system, by the page's words for it.
fn changes(scenes: &[Scene]) -> BTreeMap<String, usize> {
    let kinds = scenes.iter().filter_map(|scene| scene.compared.as_ref()?.1["kind"].as_str());
    let mut count = BTreeMap::new();
    kinds.for_each(|kind| *count.entry(kind.to_owned()).or_default() += 1);
    count
}

/// Shortens the names of the files to their last two parts, as `critical/corner_0004.ava`, or to as many as tell them apart.
fn name_apart(scenes: &mut [Scene]) {
    let files: Vec<Vec<String>> =
        scenes.iter().map(|scene| scene.file.split('/').map(str::to_owned).collect()).collect();
    let end = |file: &[String], most: usize| file[file.len().saturating_sub(most)..].join("/");
    let longest = files.iter().map(Vec::len).max().unwrap_or(0);
    let mut left: Vec<usize> = (0..files.len()).collect();
    for most in 2..=longest.max(2) {
        let mut count: BTreeMap<String, usize> = BTreeMap::new();
        left.iter().for_each(|&index| *count.entry(end(&files[index], most)).or_default() += 1);
        left.iter().for_each(|&index| scenes[index].file = end(&files[index], most));
        left.retain(|&index| count[&scenes[index].file] > 1);
    }
}

fn title(paths: &[PathBuf]) -> String {
    match paths {
        [path] => path.shown().to_string(),
        paths => plural(paths.len(), "scenario"),
    }
}

fn default_path(paths: &[PathBuf]) -> PathBuf {
    match paths {
        [path] if path.is_dir() => path.join(NAME),
        [path] => PathBuf::from(path.file_stem().unwrap_or_default()).with_extension("html"),
        _ => PathBuf::from(NAME),
    }
}
