//! `avastra study`: agents compared, with statistics.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::time::Instant;

use avastra_base::outside::Shown;
use avastra_campaign::run::{Conditions, DatabaseError, Numbered, RunError, TrafficRecord};
use avastra_campaign::study::{
    CellRecord, Event, FailedCell, Job, Spent, Study, StudyDatabase, StudyError, StudyFile, StudyResults,
    StudySettings, play_jobs,
};
use avastra_drivers::external::Program;
use avastra_exchange::report;
use avastra_lang::syntax::listed;
use avastra_world::action::ActionTable;

use super::arguments::{StudyArguments, StudyCommand};
use super::campaign::{Campaign, Cut, Item, Kind, Outside, Share, costs, missing, settled};
use super::cell_times::Times;
use super::clock::now;
use super::error::Failure;
use super::files::{remove, write};
use super::findings::kinds_text;
use super::interrupt::stop_on_interrupt;
use super::output::{Output, for_shell, plural};
use super::parallel::jobs;
use super::run_directory::Resumed;
use super::{load, merge, results, run_directory, shard};

type Directory = run_directory::Directory<StudySettings>;

impl Campaign for StudySettings {
    const KIND: Kind = Kind {
        what: "study",
        command: "study",
        file: "study",
        is_in: |directory| directory.join("study.yaml").is_file(),
        keeps_space: false,
        merge: Some(merge::merged::<StudySettings>),
        foreign: run_directory::foreign_in::<StudySettings>,
    };
    type Database = StudyDatabase;

    fn outside(&mut self) -> Outside<'_> {
        let Conditions { space, space_digest, external, .. } = &mut self.conditions;
        Outside { space, space_digest, external, policy: None }
    }
}

impl Cut for StudySettings {
    fn work(&self) -> Vec<Item> {
        let mut next = 1;
        let job = |job: Job| {
            let first = next;
            next += job.roads.len() as i64;
            Item { cost: self.episodes(&job), units: first..next }
        };
        self.jobs().into_iter().map(job).collect()
    }

    fn numbered(&self, database: &StudyDatabase) -> Result<Vec<Numbered>, DatabaseError> {
        database.places(self)
    }

    fn take_beside([from, to]: [&Path; 2]) -> Result<(), Failure> {
        let mut times = Times::read(to);
        times.extend(Times::read(from));
        times.write(to)
    }

    fn conclude(output: &Output, directory: &Path) -> Result<(), Failure> {
        play_all(output, resumed(output, directory, true)?, &[], None)
    }
}

/// Plays what a study still lacks and prints its result, or writes the results of a folder of studies.
pub fn study(output: &Output, arguments: &StudyArguments) -> Result<(), Failure> {
    if let Some(StudyCommand::Results(arguments)) = &arguments.command {
        return results::results(output, arguments);
    }
    let (begun, reused) = match &arguments.resume {
        Some(path) => {
            let resumed = resumed(output, path, false)?;
            let reused = played_elsewhere(&arguments.reuse, &resumed.0)?;
            (resumed, reused)
        }
        None => {
            let file = arguments.file.as_ref().expect("clap asks for it where there is no `--resume`");
            let (out, shard) = (arguments.out.as_deref(), shard::asked(output, arguments.shard.shard)?);
            let (_, table, settings) = wanted(output, file, arguments.ads.as_deref())?;
            let settings = if arguments.quick { settings.quick() } else { settings };
            let study = Study::new(table, settings.started_unless(arguments.shard.dry_run))
                .map_err(|error| Failure::file("use", file, error))?;
            if arguments.shard.dry_run {
                // The driving system is not started, so its earlier cells cannot be compared, but they can be read.
                arguments.reuse.iter().try_for_each(|directory| read(directory).map(drop))?;
                let costs = costs(&study.settings().work());
                let episodes = plural(costs.iter().sum::<u64>() as usize, "episode");
                let what = format!("{} trainings or repetitions, {episodes} together", costs.len());
                return shard::planned(output, out, study.settings(), (&heading(&study), &what), shard);
            }
            // A driving system that was not started has no name to compare.
            let reused = played_elsewhere(&arguments.reuse, &study)?;
            let held = run_directory::create_empty(out)?;
            shard::keep(&held.path, shard)?;
            let settings = study.settings().clone();
            let attached = settings.conditions.external.clone();
            let directory = Directory::begin(held, settings, &study.table().space().path, attached)?;
            ((study, directory), reused)
        }
    };
    play_all(output, begun, &reused, arguments.jobs)
}

/// Plays the jobs that a directory still lacks, and says what all of them came to.
fn play_all(
    output: &Output,
    (study, mut directory): (Study, Directory),
    reused: &[Reused],
    asked_jobs: Option<u32>,
) -> Result<(), Failure> {
    let path = directory.path.clone();
    let stop = stop_on_interrupt();
    let share = Share::of(&path, study.settings())?;
    let all = study.settings().jobs();
    output.tell(&format!("{}, into {}", heading(&study), path.shown()));
    let mut times = Times::read(&path);
    for Reused { directory: other, played } in reused {
        let lacking = share.lacking(study.settings(), &directory)?;
        let lacking: Vec<&Job> = lacking.into_iter().map(|job| &all[job]).collect();
        let new: Vec<_> = played.iter().filter(|(job, _)| lacking.contains(&job)).collect();
        for (_, cells) in &new {
            times.add(cells);
            directory.write(|database| database.add(cells))?;
        }
        times.write(&path)?;
        let count = plural(new.iter().map(|(_, cells)| cells.len()).sum(), "cell");
        output.tell(&format!("{count} taken over from {}", other.shown()));
    }
    let left = share.lacking(study.settings(), &directory)?;
    let todo: Vec<Job> = left.iter().map(|&job| all[job].clone()).collect();

    // Each job has its own process or connection. The probe only checks that they are available.
    let external = study.settings().conditions.external.as_ref().filter(|_| !todo.is_empty());
    directory.refuse_to_play(external.is_none_or(|attached| !attached.is_recorded))?;
    let probe = external.map(|attached| Program::new(attached.settings.clone()));
    let jobs = jobs(asked_jobs, probe.as_ref())?;
    drop(probe);
    let mut progress = share.progress(output, "counted", &left);
    play_jobs(&study, &todo, jobs, &stop, &spent, &mut |event| match event {
        Event::Episode { counted } => {
            progress.episode(counted);
            Ok(())
        }
        Event::Done(cells) => {
            times.add(&cells);
            directory.write(|database| database.add(&cells))?;
            times.write(&path)
        }
        Event::Diverged { agent, number, why } => {
            Err(Failure::file("go on with", &path, format!("agent `{agent}`, training {number}: {why}")))
        }
    })?;
    drop(progress);
    let is_over = share.lacking(study.settings(), &directory)?.is_empty();
    if is_over {
        times.write(&path)?;
        directory = settled(study.settings(), directory)?;
    }

    let cells = times.on(directory.read(StudyDatabase::cells)?);
    let failed = FailedCell::among(&cells);
    let timing = timing(&cells);
    if !failed.is_empty() {
        // An interruption may have left some of the cells before.
        remove(&path.join("results.json"))?;
        let findings = FailedCell::findings(&failed);
        output.say(&failed_text(&path, &failed));
        output.result(serde_json::json!({ "directory": path, "failures": failed, "timing": timing }));
        return Err(Failure::Ads { findings });
    }
    let results = StudyResults::new(study.settings(), &cells);
    let text = serde_json::to_string_pretty(&results).expect("results have string keys only");
    write(&path.join("results.json"), &format!("{text}\n"))?;
    output.say(&report::study(&results));
    output.say(&timing_text(&path, &timing));
    output.result(
        serde_json::json!({ "directory": path, "results": results, "failures": failed, "timing": timing }),
    );
    share.end(output, directory, is_over, None)
}

/// Another study's directory, with the jobs that it has played of this one.
struct Reused {
    directory: PathBuf,
    played: Vec<(Job, Vec<CellRecord>)>,
}

fn played_elsewhere(directories: &[PathBuf], study: &Study) -> Result<Vec<Reused>, Failure> {
    let reused = directories.iter().map(|directory| {
        let (settings, cells) = read(directory)?;
        let refuse = |reason: String| Failure::file("reuse", directory, reason);
        let played = study.settings().played_elsewhere(&settings, &cells);
        let played = played.map_err(|fields| {
            let verb = if fields.len() == 1 { "is" } else { "are" };
            refuse(format!("it plays otherwise: its {} {verb} another", listed(&fields)))
        })?;
        if played.is_empty() {
            let reason = "it has played no agent with the same settings on the same road";
            return Err(refuse(reason.to_owned()));
        }
        Ok(Reused { directory: directory.clone(), played })
    });
    reused.collect()
}

/// The settings of a study's directory and its cells, finished or not.
///
/// # Errors
/// If it is no such directory, or something in it was changed.
pub fn read(directory: &Path) -> Result<(StudySettings, Vec<CellRecord>), Failure> {
    match read_sound(directory)? {
        Sound { settings, cells, changed: None, .. } => Ok((settings, cells)),
        Sound { changed: Some(remark), .. } => {
            let directory = for_shell(directory);
            Err(Failure::usage(format!("{remark}; go on with `avastra study --resume {directory}`")))
        }
    }
}

/// The sound part of a study's directory.
pub struct Sound {
    pub settings: StudySettings,
    pub cells: Vec<CellRecord>,
    /// Says which cells were changed; they are left out.
    pub changed: Option<String>,
    /// Says how many cells are missing.
    pub missing: Option<String>,
}

/// As [`read`], but cells that were changed are left out.
pub fn read_sound(directory: &Path) -> Result<Sound, Failure> {
    let (path, file) = (directory.join("study.yaml"), directory.join("study.db"));
    if !path.is_file() {
        return Err(Failure::usage(format!(
            "`{}` is no study's directory: `avastra study FILE --out {}` makes one",
            directory.shown(),
            for_shell(directory)
        )));
    }
    if let Some(how) = run_directory::lost(&file) {
        let (file, directory) = (file.shown(), for_shell(directory));
        return Err(Failure::usage(format!(
            "`{file}` is {how}: go on with `avastra study --resume {directory}`"
        )));
    }
    let text = load::text(&path)?;
    let settings: StudySettings = run_directory::settings_in(directory, &text)?;
    let unread = |error| Failure::file("read", &file, error);
    let (database, changed) = run_directory::open_to_read::<StudyDatabase>(&file, &text)?;
    let missing = missing(directory, &settings, &database, |_| true)?;
    let cells = Times::read(directory).on(database.cells().map_err(unread)?);
    if !FailedCell::among(&cells).is_empty() {
        return Err(Failure::file("use", &file, "the driving system failed in it, so there are no results"));
    }
    Ok(Sound { settings, cells, changed, missing })
}

/// The cells that the driving system failed in, and what to do.
fn failed_text(directory: &Path, cells: &[FailedCell]) -> String {
    let mut text =
        "\nno statistics, because the driving system did not drive every episode to its end:".to_owned();
    for cell in cells {
        let FailedCell { agent, road, number, trained, evaluated } = cell;
        text.push_str(&format!("\n  {agent} on {road}, number {number}:"));
        let places = [(trained, "in training"), (evaluated, "when played")];
        let places = places.iter().filter(|(kinds, _)| !kinds.is_empty());
        let places = places.map(|(kinds, place)| format!(" {} {place}", kinds_text(kinds)));
        text.push_str(&places.collect::<Vec<_>>().join(","));
    }
    text.push_str(&format!(
        "\nwhat was played stands in {}; when the driving system is repaired (`avastra ads check`), begin the study \
         again in a new folder",
        directory.join("study.db").shown()
    ));
    text
}

/// The content of a study's file, and the full settings that it asks for.
pub fn wanted(
    output: &Output,
    path: &Path,
    ads: Option<&str>,
) -> Result<(StudyFile, ActionTable, StudySettings), Failure> {
    let refuse = |reason: String| Failure::file("use", path, reason);
    let mut file = StudyFile::from_yaml(&load::text(path)?).map_err(refuse)?;
    let beside = |name: &str| path.parent().unwrap_or(Path::new("")).join(name);
    let table = load::table(output, &beside(&file.space))?;
    let under_test = match ads {
        Some(text) => {
            let under_test = load::named(text)?;
            file.ads.clone_from(&under_test.ads);
            under_test
        }
        None => load::under_test(&file.ads, file.ads_config.as_deref().map(beside).as_deref(), None)?,
    };
    let read = |name: &str| load::read(&beside(name)).map_err(|error| error.to_string());
    let traffic = file.traffic.as_ref().map(|wanted| {
        // A file lies beside the study's.
        if load::is_yaml(wanted) { beside(wanted).to_string_lossy().into_owned() } else { wanted.clone() }
    });
    let traffic =
        traffic.as_deref().map(load::traffic).transpose().map_err(|error| refuse(error.to_string()))?;
    let traffic = traffic.as_ref().and_then(TrafficRecord::new);
    let settings =
        StudySettings::new(file.clone(), &table, (under_test.profile, under_test.external), traffic, &read);
    let settings = settings.map_err(|error| refuse(error.to_string()))?;
    Ok((file, table, settings))
}

/// The rest of an interrupted study. With `is_played`, nothing of it is left to play, and no program is started.
fn resumed(output: &Output, path: &Path, is_played: bool) -> Result<(Study, Directory), Failure> {
    let Resumed { settings, text, table, held } = run_directory::resume(output, path, is_played)?;
    let study = Study::new(table, settings).map_err(|error| match error {
        StudyError::Agent { error: error @ RunError::OtherProgram { .. }, .. } => error.into(),
        error => Failure::usage(error),
    })?;
    Ok((study, Directory::open_to_go_on(output, held, &text)?))
}

fn heading(study: &Study) -> String {
    let settings = study.settings();
    let labels: Vec<&str> = settings.agents.iter().map(|agent| agent.label.as_str()).collect();
    format!(
        "{}: {} against {} on {}, {} a seed, {}, first seed {}",
        study.table().space().path.shown(),
        labels.join(", "),
        study.ads_name(),
        settings.conditions.roads.join(", "),
        plural(settings.evaluation.episodes as usize, "episode"),
        plural(settings.evaluation.seeds as usize, "seed"),
        settings.first_seed
    )
}

/// Time that the calling thread has spent so far.
fn spent() -> Spent {
    let now = now();
    // On Linux, the first word of this file is the thread's time on a processor, ns.
    let schedule = load::read(Path::new("/proc/thread-self/schedstat")).ok();
    let on_cpu_ns = schedule.and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
    Spent { wall_s: now.duration_since(*BEGAN).as_secs_f64(), cpu_s: on_cpu_ns.map(|ns| ns / 1e9) }
}

static BEGAN: LazyLock<Instant> = LazyLock::new(now);

/// Mean times of an agent's cells, over those whose times are known.
#[derive(serde::Serialize)]
struct Timing {
    agent: String,
    cells: usize,
    wall_s: Option<f64>,
    cpu_s: Option<f64>,
    /// Cells whose times are known.
    #[serde(skip)]
    timed: usize,
}

fn timing(cells: &[CellRecord]) -> Vec<Timing> {
    let mut labels: Vec<&str> = cells.iter().map(|cell| cell.agent.as_str()).collect();
    labels.sort_unstable();
    labels.dedup();
    let of = |label: &str| {
        let own: Vec<Option<Spent>> =
            cells.iter().filter(|cell| cell.agent == label).map(|cell| cell.spent).collect();
        let known: Vec<Spent> = own.iter().copied().flatten().collect();
        let mean = |sum_s: f64| (!known.is_empty()).then(|| sum_s / known.len() as f64);
        Timing {
            agent: label.to_owned(),
            cells: own.len(),
            wall_s: mean(known.iter().map(|spent| spent.wall_s).sum()),
            cpu_s: known.iter().map(|spent| spent.cpu_s).sum::<Option<f64>>().and_then(mean),
            timed: known.len(),
        }
    };
    labels.into_iter().map(of).collect()
}

fn timing_text(directory: &Path, timing: &[Timing]) -> String {
    let mut text = format!("\nall figures: {}", directory.join("results.json").shown());
    for Timing { agent, cells, wall_s, cpu_s, timed } in timing {
        let cells = plural(*cells, "cell");
        let Some(wall_s) = wall_s else {
            text.push_str(&format!("\n{agent}: {cells}, no times are known"));
            continue;
        };
        let cpu = cpu_s.map_or(String::new(), |cpu_s| format!(", {cpu_s:.1} s of a processor"));
        let timed = plural(*timed, "cell");
        let only = if timed == cells { String::new() } else { format!(", by the times of {timed}") };
        text.push_str(&format!("\n{agent}: {cells} of {wall_s:.1} s{cpu} on average{only}"));
    }
    text
}
