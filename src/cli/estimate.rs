//! `avastra estimate`: how often would it crash; with `--than`, which of two crashes more often.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use avastra_base::outside::Shown;
use avastra_base::statistics::Interval;
use avastra_campaign::estimate::{
    Comparison, ComparisonResults, Estimate, EstimateDatabase, EstimateResults, EstimateSettings, EventKind,
    FRAME, Found, Mass, Met, Method, PILOT, Part, Pilot, Plan, Played, Probability, Stopping, compared,
    pilot, play_parts,
};
use avastra_campaign::run::{DatabaseError, Run, RunError, RunSettings, Shard, Units};
use avastra_world::action::ActionTable;

use super::arguments::EstimateArguments;
use super::campaign::{Campaign, Cut, Item, Kind, Outside, Share, as_they_are, missing};
use super::conditions::profile_text;
use super::error::Failure;
use super::files::{remove, write};
use super::findings::{is_reproducible, thinking_text};
use super::interrupt::stop_on_interrupt;
use super::output::{Output, for_shell, plural};
use super::parallel::jobs;
use super::progress::{Progress, Working};
use super::run_directory::{Player, Resumed, written};
use super::summary::{critical_text, cut_short, next_text};
use super::{conditions, load, merge, run_directory, shard};

/// Episodes of a part, if a command line gives no number.
const EPISODES: u32 = 50;

/// Episodes on each road in which two driving systems are compared, if a command line gives no number.
const EPISODES_OF_TWO: u32 = 250;

type Directory = run_directory::Directory<EstimateSettings>;

impl Campaign for EstimateSettings {
    const KIND: Kind = Kind {
        what: "estimate",
        command: "estimate",
        file: "estimate",
        is_in: |directory| directory.join("estimate.yaml").is_file(),
        keeps_space: true,
        merge: Some(merge::merged::<EstimateSettings>),
        foreign: run_directory::foreign_in::<EstimateSettings>,
    };
    type Database = EstimateDatabase;

    fn outside(&mut self) -> Outside<'_> {
        self.run.outside()
    }
}

impl Cut for EstimateSettings {
    fn work(&self) -> Vec<Item> {
        let cost = u64::from(self.run.episodes);
        let place = |part| self.place(part);
        self.all_parts().into_iter().map(place).map(|part| Item { cost, units: part..part + 1 }).collect()
    }

    fn conclude(output: &Output, directory: &Path) -> Result<(), Failure> {
        play_all(output, resumed(output, directory, true)?, None)
    }
}

/// Plays what an estimate still lacks and prints its result, or compares two driving systems.
pub fn estimate(output: &Output, arguments: &EstimateArguments) -> Result<(), Failure> {
    if let (Some(file), Some(than)) = (&arguments.file, &arguments.than) {
        return compare(output, arguments, file, [&arguments.under_test.ads, than]);
    }
    let begun = match &arguments.resume {
        Some(path) => resumed(output, path, false)?,
        None => {
            let (estimate, shard) = wanted(output, arguments)?;
            let (settings, out) = (estimate.settings(), arguments.out.as_deref());
            if arguments.shard.dry_run {
                let texts = (&*heading(&estimate), &*planned_text(settings, settings.all_parts().len()));
                return shard::planned(output, out, settings, texts, shard);
            }
            let (space, attached) = (&estimate.run().space().path, estimate.run().arena().attached());
            let (held, _) = run_directory::create(out, shard, space, false)?;
            let directory = Directory::begin(held, settings.clone(), space, attached)?;
            (estimate, directory)
        }
    };
    play_all(output, begun, arguments.jobs)
}

/// Plays the parts that a directory still lacks, and says what all of them came to.
fn play_all(
    output: &Output,
    (estimate, mut directory): (Estimate, Directory),
    asked_jobs: Option<u32>,
) -> Result<(), Failure> {
    let path = directory.path.clone();
    let stop = stop_on_interrupt();
    directory.restore(output)?;
    let share = Share::of(&path, estimate.settings())?;
    output.tell(&format!("{}, into {}", heading(&estimate), path.shown()));
    conditions::ambient_text(estimate.run()).iter().for_each(|text| output.tell(text));
    let jobs = jobs(asked_jobs, estimate.run().arena().program())?;
    let Some(pilot) = piloted(output, &estimate, &mut directory, jobs, &stop)? else {
        return share.end(output, directory, false, None);
    };
    let plan = Plan::of(&pilot, 0.0);

    let labels: Vec<String> = estimate.run().table().rows().iter().map(|row| row.label.clone()).collect();
    let all = estimate.settings().all_parts();
    let lacking = share.lacking(estimate.settings(), &directory)?;
    let mut progress = share.progress(output, estimate.settings().event.noun(), &lacking);
    // A shard cannot know when all shards together are precise enough. It plays all of its parts, and the looks are taken
    // by the merge.
    let looks = match share.shard.is_whole() {
        true => estimate.settings().looks(),
        false => vec![estimate.settings().parts],
    };
    let mut results = None;
    for look in looks {
        let at = |items: &[usize]| -> Vec<Part> {
            items.iter().map(|&part| all[part]).filter(|part| part.number < look).collect()
        };
        let (wanted, todo) = (at(&share.own), at(&share.lacking(estimate.settings(), &directory)?));
        if !todo.is_empty() {
            directory.refuse_to_play(is_started(&estimate))?;
        }
        play_parts(&estimate, &todo, &plan, jobs, &stop, &mut |played| {
            // Such a part says nothing, and is not kept: with a repaired system the estimate can go on.
            if played.record.failed > 0 {
                output.say("no estimate: the driving system failed; `avastra run` with it says how");
                return Err(Failure::Ads { findings: played.record.failed as usize });
            }
            let scenarios = write_scenarios(&estimate, &path, &played)?;
            for number in 0..played.record.episodes {
                progress.episode(usize::from(number < played.record.events));
            }
            directory.write(|database| database.add(&estimate, &played, &scenarios))
        })?;
        let looked =
            directory.read(|database| at_look(estimate.settings(), database, &pilot, &labels, look))?;
        let is_unfinished = looked.parts.len() < wanted.len();
        let is_over = is_unfinished || looked.is_enough;
        results = Some((looked.results, looked.parts, is_unfinished));
        if is_over {
            break;
        }
    }
    drop(progress);

    let (results, kept, is_unfinished) = results.expect("every estimate looks once");
    if !is_unfinished {
        directory = settled_with(estimate.settings(), directory, &kept)?;
    }
    let text = serde_json::to_string_pretty(&results).expect("results have string keys only");
    write(&path.join("results.json"), &format!("{text}\n"))?;
    output.say(&estimate_text(&results, is_unfinished, share.shard));
    if !results.missed_goals.is_empty() {
        output.warn(&format!(
            "the estimate missed its goals: {}; more parts come nearer (`--parts`)",
            results.missed_goals.join("; ")
        ));
    }
    thinking_text(estimate.run().arena().program()).iter().for_each(|text| output.say(text));
    let critical = directory.critical(output)?;
    output.say(&critical_text(&path, &critical, &[]));
    if !critical.is_empty() {
        output.say(&next_text(&path, &critical, false, &[]));
    }
    let is_reproducible = is_reproducible(output, estimate.run().arena().program());
    output.result(serde_json::json!({
        "directory": path, "results": results, "critical": critical, "reproducible": is_reproducible,
    }));
    share.end(output, directory, !is_unfinished, None)
}

/// An estimate's results up to a look.
struct Looked {
    results: EstimateResults,
    /// The parts that it is made of.
    parts: Vec<Part>,
    /// Whether its stopping rules are met.
    is_enough: bool,
}

/// The results of the parts up to a look. Parts beyond it may have been played before a kill, with other stopping rules or in
/// shards; they do not count.
fn at_look(
    settings: &EstimateSettings,
    database: &EstimateDatabase,
    pilot: &Pilot,
    labels: &[String],
    look: u32,
) -> Result<Looked, DatabaseError> {
    let (mut records, mut events) = (database.parts()?, database.events()?);
    let is_known = |part: &Part| part.road < settings.run.conditions.roads.len();
    if !records.iter().all(|record| is_known(&record.part))
        || events.iter().any(|(_, event)| event.row.is_some_and(|row| row >= labels.len()))
    {
        let what = "it has roads or rows that the estimate has not".to_owned();
        return Err(DatabaseError::Damaged { what });
    }
    records.retain(|record| record.part.number < look);
    events.retain(|(part, _)| part.number < look);
    let pilot_s = pilot.whole_s + pilot.tried_s;
    let results =
        EstimateResults::new(settings, Found { records: &records, events: &events, pilot_s, labels });
    let is_enough = results.together.as_ref().is_some_and(|found| settings.is_enough(found));
    Ok(Looked { results, parts: records.iter().map(|record| record.part).collect(), is_enough })
}

/// The contents of an estimate's directory, finished or not.
pub struct Contents {
    /// The text of its settings.
    pub settings: String,
    /// `None` if no sound part is there.
    pub results: Option<EstimateResults>,
    /// Says which rows were changed; their parts count for nothing.
    pub damaged: Option<String>,
    /// Remarks for its page: files that were changed or are gone, and a space that cannot be read.
    pub remarks: Vec<String>,
}

/// Reads the directory of an estimate, and plays nothing.
pub fn read(directory: &Path) -> Result<Contents, Failure> {
    let (path, file) = (directory.join("estimate.yaml"), directory.join("estimate.db"));
    let text = load::text(&path)?;
    if run_directory::lost(&file).is_some() {
        return Ok(Contents { settings: text, results: None, damaged: None, remarks: Vec::new() });
    }
    let settings: EstimateSettings = run_directory::settings_in(directory, &text)?;
    let unread = |error| Failure::file("read", &file, error);
    let (database, damaged) = run_directory::open_to_read::<EstimateDatabase>(&file, &text)?;
    let scenarios = database.scenarios().map_err(unread)?;
    let written = written(directory, scenarios);
    let mut remarks = run_directory::remarks_on(&written);
    if damaged.is_none() {
        remarks.extend(run_directory::foreign_text(&EstimateSettings::KIND, directory, &written));
    }
    remarks.extend(run_directory::remark_on_copy(directory));
    let table = load::table(&Output::silent(), &directory.join(&settings.run.conditions.space)).ok();
    let is_it =
        |table: &ActionTable| table.space().meaning.is_sealed_by(&settings.run.conditions.space_digest);
    let labels: Vec<String> = match table.filter(is_it) {
        Some(table) => table.rows().iter().map(|row| row.label.clone()).collect(),
        None => {
            let remark =
                "the space of the estimate cannot be read or has changed: its rows have numbers only";
            remarks.push(remark.to_owned());
            let rows = database.events().map_err(unread)?.into_iter().filter_map(|(_, event)| event.row);
            let last = rows.filter(|&row| row < ROWS_MAX).max();
            (0..=last.unwrap_or(0)).map(|row| format!("row {row}")).collect()
        }
    };
    let kept = database.pilot().map_err(unread)?;
    if settings.method == Method::Probe && kept.is_none() && damaged.is_none() {
        let directory = for_shell(directory);
        let remark = format!("the pilot is missing: `avastra estimate --resume {directory}` plays it");
        remarks.push(remark);
    }
    let pilot = kept.unwrap_or_default();
    let all = database.parts().map_err(unread)?.len();
    let mut results = None;
    // Parts of each road that it must have before it is over. A shard must have all of its parts.
    let mut wanted = settings.parts;
    let is_shard = !shard::kept(directory)?.is_whole();
    let mut looks = settings.looks().into_iter();
    while let Some(look) = looks.next() {
        let looked = at_look(&settings, &database, &pilot, &labels, look).map_err(unread)?;
        let is_whole = looked.parts.len() == look as usize * settings.run.conditions.roads.len();
        // A look may lack parts, because they are damaged or another shard's. Then later parts were played, too, so go on.
        let is_last = looked.parts.len() == all || (is_whole && looked.is_enough);
        results = Some(looked.results);
        if is_last {
            let next = if is_whole && !looked.is_enough { looks.next() } else { None };
            wanted = if is_shard { settings.parts } else { next.unwrap_or(look) };
            break;
        }
    }
    let end = settings.place(Part { road: 0, number: wanted });
    remarks.extend(missing(directory, &settings, &database, |part| part < end)?);
    Ok(Contents { settings: text, results: results.filter(|_| all > 0), damaged, remarks })
}

/// No table has more rows than this.
const ROWS_MAX: usize = 1_000_000;

/// Settles the database with these parts alone; what was found in others goes, too.
fn settled_with(
    settings: &EstimateSettings,
    directory: Directory,
    parts: &[Part],
) -> Result<Directory, Failure> {
    let wanted: BTreeSet<i64> = parts.iter().map(|part| settings.place(*part)).chain([PILOT]).collect();
    let mut scenarios = directory.read(Units::scenarios)?;
    scenarios.retain(|scenario| !wanted.contains(&scenario.unit));
    for (scenario, _) in written(&directory.path, scenarios) {
        remove(&load::answers_path(&scenario))?;
        remove(&scenario)?;
    }
    let mut kept = directory.read(as_they_are)?;
    kept.retain(|(number, _)| wanted.contains(number));
    directory.settle(&kept)
}

/// Whether its driving system can drive other episodes than those that were played.
fn is_started(estimate: &Estimate) -> bool {
    estimate.run().arena().program().is_none_or(|program| program.can_start())
}

/// The results of an estimate's pilot: kept, or played now. `None` if it was stopped; empty for a method without a pilot.
fn piloted(
    output: &Output,
    estimate: &Estimate,
    directory: &mut Directory,
    jobs: usize,
    stop: &AtomicBool,
) -> Result<Option<Pilot>, Failure> {
    if estimate.settings().method != Method::Probe {
        return Ok(Some(Pilot::default()));
    }
    let kept = directory.read(EstimateDatabase::pilot)?;
    if kept.is_some() {
        return Ok(kept);
    }
    directory.refuse_to_play(is_started(estimate))?;
    let found = {
        let _working = Working::new(output, "a pilot learns which rows are dangerous");
        pilot(estimate, jobs, stop)
    };
    if let Some(pilot) = &found {
        directory.write(|database| database.keep_pilot(pilot))?;
    }
    Ok(found)
}

/// Writes the events of a part as scenarios, where the space's verdict counts them. Returns the name and text of each
/// event's file, if it has one.
fn write_scenarios(
    estimate: &Estimate,
    directory: &Path,
    played: &Played,
) -> Result<Vec<Option<(String, String)>>, Failure> {
    let RunSettings { agent, conditions, .. } = &estimate.settings().run;
    let player = Player { command: "estimate", table: estimate.run().table(), agent, conditions };
    let critical = directory.join("critical");
    let write_one = |met: &Met| {
        // A breach gets a scenario only if the estimate asks for breaches.
        let breach = estimate.settings().event.first_breach(estimate.run().table().space(), &met.log);
        if met.summary.counted() == 0 && breach.is_none() {
            return Ok(None);
        }
        let about = breach.or_else(|| met.summary.first_found(&met.log)).expect("it has a finding");
        // An episode and the trials beside it have one number, and differ by step and row.
        let tried = match met.event.row {
            Some(row) if estimate.settings().method == Method::Probe => {
                format!("_{:02}_{row:02}", met.event.step)
            }
            _ => String::new(),
        };
        let name = format!("{}_{:04}{tried}.ava", met.log.road, met.summary.episode);
        let text = player.write_scenario(&critical.join(&name), (&met.log, &met.summary), about)?;
        Ok(Some((name, text)))
    };
    played.met.iter().map(write_one).collect()
}

/// The estimate and the shard that the command line asks for.
fn wanted(output: &Output, arguments: &EstimateArguments) -> Result<(Estimate, Shard), Failure> {
    let file = arguments.file.as_ref().expect("clap asks for it where there is no `--resume`");
    let table = load::table(output, file)?;
    let shard = shard::asked(output, arguments.shard.shard)?;
    let under_test = load::named(&arguments.under_test.ads)?;
    let (conditions, episodes) = (&arguments.conditions, arguments.episodes.unwrap_or(EPISODES));
    let settings = EstimateSettings {
        event: EventKind::from(arguments.event.clone()),
        method: arguments.method,
        parts: arguments.parts,
        stopping: Stopping { precision: arguments.precision, hours: arguments.hours },
        run: conditions::settings(table.space(), conditions, &conditions.agent, under_test, episodes)?,
    };
    let settings = settings.started_unless(arguments.shard.dry_run);
    Ok((Estimate::new(table, settings)?, shard))
}

/// The rest of an interrupted estimate. With `is_played`, nothing of it is left to play, and no program is started.
fn resumed(output: &Output, path: &Path, is_played: bool) -> Result<(Estimate, Directory), Failure> {
    let Resumed { settings, text, table, held } = run_directory::resume(output, path, is_played)?;
    let estimate = Estimate::new(table, settings)?;
    Ok((estimate, Directory::open_to_go_on(output, held, &text)?))
}

/// Plays two driving systems in the same episodes.
fn compare(
    output: &Output,
    arguments: &EstimateArguments,
    file: &Path,
    sides: [&String; 2],
) -> Result<(), Failure> {
    let table = load::table(output, file)?;
    let side = |named: &str| {
        let (conditions, under_test) = (&arguments.conditions, load::named(named)?);
        let episodes = arguments.episodes.unwrap_or(EPISODES_OF_TWO);
        let settings =
            conditions::settings(table.space(), conditions, &conditions.agent, under_test, episodes)?;
        Ok::<_, Failure>(Run::new(table.clone(), settings)?)
    };
    let (first, second) = (side(sides[0])?, side(sides[1])?);
    if first.settings().rows > 0 {
        return Err(RunError::OneRow { name: arguments.conditions.agent.clone() }.into());
    }
    let event = EventKind::from(arguments.event.clone());
    event.check(table.space(), first.arena().rules()).map_err(Failure::usage)?;
    let comparison = Comparison { first, second, event };
    let numbers: Vec<usize> = (0..comparison.pairs()).collect();
    output.tell(&format!(
        "{}: {} and {} in the same {}",
        file.shown(),
        sides[0],
        sides[1],
        plural(numbers.len(), "episode")
    ));
    conditions::ambient_text(&comparison.first).iter().for_each(|text| output.tell(text));
    // Nothing is kept of a comparison, so Ctrl-C ends it at once.
    let stop = AtomicBool::new(false);
    let mut progress = Progress::new(output, comparison.event.noun(), numbers.len() as u64, 0);
    let mut pairs = Vec::new();
    // Whichever has a program serves so many at a time.
    let program = comparison.first.arena().program().or(comparison.second.arena().program());
    let jobs = jobs(arguments.jobs, program)?;
    compared(&comparison, &numbers, jobs, &stop, &mut |pair| {
        progress.episode(usize::from(pair.first.happened) + usize::from(pair.second.happened));
        pairs.push(pair);
        Ok::<_, Failure>(())
    })?;
    drop(progress);
    let failed =
        pairs.iter().map(|pair| usize::from(pair.first.failed) + usize::from(pair.second.failed)).sum();
    if failed > 0 {
        output.say("no comparison: a driving system failed; `avastra run` with it says how");
        return Err(Failure::Ads { findings: failed });
    }
    let results =
        ComparisonResults::new(comparison.event.clone(), &pairs).expect("there is at least one episode");
    output.say(&comparison_text(&results, sides));
    let sides_repeat =
        [&comparison.first, &comparison.second].map(|run| is_reproducible(output, run.arena().program()));
    let is_reproducible = sides_repeat == [true; 2];
    output.result(serde_json::json!({ "sides": sides, "results": results, "reproducible": is_reproducible }));
    Ok(())
}

fn heading(estimate: &Estimate) -> String {
    let settings = estimate.settings();
    let method = match settings.method {
        Method::Count => "by counting",
        Method::Probe => "by trying rows out",
    };
    format!(
        "{}: how often {} under {} against {}{}, {method}, {} of {} on {}, seed {}",
        estimate.run().space().path.shown(),
        settings.event.in_words(),
        settings.run.agent,
        estimate.run().arena().ads_name(),
        profile_text(settings.run.conditions.profile.as_ref()),
        plural(settings.parts as usize, "part"),
        plural(settings.run.episodes as usize, "episode"),
        settings.run.conditions.roads.join(", "),
        settings.run.seed
    )
}

fn planned_text(settings: &EstimateSettings, parts: usize) -> String {
    let stops = settings.stopping.precision.is_some() || settings.stopping.hours.is_some();
    let most = if stops { "at most " } else { "" };
    let pilot = if settings.method == Method::Probe { ", and a pilot in each shard" } else { "" };
    let episodes = plural(settings.run.episodes as usize, "episode");
    format!("{most}{} of {episodes}{pilot}", plural(parts, "part"))
}

fn estimate_text(results: &EstimateResults, is_unfinished: bool, shard: Shard) -> String {
    let mut text = String::new();
    if !shard.is_whole() {
        text.push_str(&format!("shard {shard}: {} of {} parts\n", results.parts, results.parts_wanted));
    } else if is_unfinished {
        text.push_str(&format!("unfinished: {} of {} parts\n", results.parts, results.parts_wanted));
    } else if results.parts < results.parts_wanted {
        text.push_str(&format!("enough after {} of {} parts\n", results.parts, results.parts_wanted));
    }
    text.push_str(&format!("\nepisodes with {}; in brackets: 95 % intervals\n", results.event.in_words()));
    for road in &results.roads {
        text.push_str(&format!("  {}: {}\n", road.road, probability_text(&road.estimate)));
    }
    match &results.together {
        Some(all) if results.roads.len() > 1 => {
            text.push_str(&format!("  all roads: {}\n", probability_text(all)));
        }
        _ => {}
    }
    text.push_str(&format!("{FRAME}\n"));
    if let Some(all) = &results.together {
        if let Some(events) = all.effective_events {
            text.push_str(&format!("events met: as good as {events:.1} of one weight\n"));
        }
        if let Some(gain) = all.gain {
            let (factor, how) = if gain >= 1.0 { (gain, "less") } else { (1.0 / gain, "more") };
            text.push_str(&format!(
                "roughly {factor:.1} times {how} simulated time than counting for an interval as narrow\n"
            ));
        }
    }
    if !results.mass.is_empty() {
        let line = |mass: &Mass| {
            let row = mass.row.as_deref().unwrap_or("what no action made appear");
            format!(
                "{:>4.1} %  {}: {row} ({})",
                100.0 * mass.share,
                mass.road,
                plural(mass.events as usize, "event")
            )
        };
        let more = |more| format!("and {more} others");
        text.push_str(&cut_short("where the probability lies:".to_owned(), &results.mass, line, more));
    }
    text.trim_end().to_owned()
}

fn probability_text(found: &Probability) -> String {
    let rate = |rate: Option<f64>, interval: Option<Interval>, of: &str| {
        let both = rate.zip(interval);
        both.map_or(String::new(), |(rate, interval)| format!(", {} in {of}", bracketed(rate, interval)))
    };
    format!(
        "{}{}{} ({} over {:.1} km, {:.2} h simulated)",
        bracketed(found.probability, found.interval),
        rate(found.per_1000_km, found.per_1000_km_interval, "1000 km"),
        rate(found.per_hour, found.per_hour_interval, "an hour"),
        plural(found.episodes as usize, "episode"),
        found.driven_km,
        found.simulated_h
    )
}

/// `0.00123 [0.0004, 0.0021]`.
fn bracketed(value: f64, Interval { low, high }: Interval) -> String {
    format!("{} [{}, {}]", figures(value), figures(low), high.map_or("∞".to_owned(), figures))
}

/// Three significant figures.
fn figures(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = (2 - libm::log10(value.abs()).floor() as i32).clamp(0, 12) as usize;
    if value.abs() < 1e-4 { format!("{value:.2e}") } else { format!("{value:.digits$}") }
}

fn comparison_text(results: &ComparisonResults, [first, second]: [&String; 2]) -> String {
    let [of_first, of_second] = results.probability;
    let [interval_first, interval_second] = results.intervals;
    let [km_first, km_second] = results.driven_km;
    let mut text = format!(
        "\nepisodes with {} of {}; in brackets: 95 % intervals\n",
        results.event.in_words(),
        results.episodes
    );
    text.push_str(&format!("  {first}: {} over {km_first:.1} km\n", bracketed(of_first, interval_first)));
    text.push_str(&format!("  {second}: {} over {km_second:.1} km\n", bracketed(of_second, interval_second)));
    text.push_str(&format!(
        "the same in both: {} with, {} without; {first} alone: {}, {second} alone: {}\n",
        results.both,
        results.episodes - results.both - results.first_only - results.second_only,
        results.first_only,
        results.second_only
    ));
    text.push_str(&format!(
        "difference: {}, sign test p {}\n",
        bracketed(results.difference, results.difference_interval),
        if results.p < 1e-4 { "< 0.0001".to_owned() } else { format!("= {:.4}", results.p) }
    ));
    text.push_str(&match results.told_apart_km {
        Some(km) => {
            format!("told apart after {km:.0} km of both together (looked at after each pair: no test)")
        }
        None => "not told apart".to_owned(),
    });
    text
}
