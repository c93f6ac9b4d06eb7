//! `avastra run`: plays episodes and writes their crashes as scenarios.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use avastra_base::outside::Shown;
use avastra_campaign::emit;
use avastra_campaign::episode::EpisodeLog;
use avastra_campaign::oracle;
use avastra_campaign::run::{
    Budget, Conditions, DEFAULT_ADS, Database, DatabaseError, EpisodeSummary, FoundIn, Numbered,
    PolicyReference, Run, RunSettings, Totals, TrafficRecord, play,
};
use avastra_drivers::ModularConfig;
use avastra_drivers::external;
use avastra_drivers::external::{Conversation, Problem, Program};
use avastra_lang::model::{Policy, Space};
use avastra_search::agent::{Face, Kind, by_name};
use avastra_world::action::{ActionTable, Draw};

use super::arguments::{FailOn, RunArguments};
use super::campaign::{self, Campaign, Cut, Item, Outside, Share, settled};
use super::clock::now;
use super::conditions::profile_text;
use super::error::Failure;
use super::files::write_answers;
use super::findings::{cut_off, failures_text, is_reproducible, thinking_text};
use super::interrupt::stop_on_interrupt;
use super::never::Never;
use super::output::{Output, plural};
use super::parallel::jobs;
use super::policy::acting;
use super::progress::Progress;
use super::run_directory::{Player, Resumed};
use super::summary::{critical_text, groups_text, next_text, refusals_text, requirements_text, totals_text};
use super::{compile, conditions, load, merge, protocol, run_directory, shard};

/// Episodes on each road, if a command line gives no number.
const EPISODES: u32 = 100;

/// Episodes that are played twice with a program that says it is deterministic. One alone may come out the same by chance.
const SPOT_CHECKS: usize = 3;

/// Episodes that a run keeps if it found nothing, so that there is something to look at.
const KEPT_OF_NOTHING: u32 = 3;

/// A run with its directory, and how its policy was trained otherwise, in words.
type Begun = ((Run, Directory), Option<String>);

type Directory = run_directory::Directory<RunSettings>;

impl Campaign for RunSettings {
    const KIND: campaign::Kind = campaign::Kind {
        what: "run",
        command: "run",
        file: "run",
        is_in: |directory| run_directory::is_training(directory) == Some(false),
        keeps_space: true,
        merge: Some(merge::merged::<RunSettings>),
        foreign: run_directory::foreign_in::<RunSettings>,
    };
    type Database = Database;

    fn outside(&mut self) -> Outside<'_> {
        let RunSettings { conditions: Conditions { space, space_digest, external, .. }, policy, .. } = self;
        Outside { space, space_digest, external, policy: Some(policy) }
    }
}

impl Cut for RunSettings {
    fn work(&self) -> Vec<Item> {
        let episodes = self.all_episodes() as i64;
        (0..episodes).map(|number| Item { cost: 1, units: number..number + 1 }).collect()
    }

    /// With a budget, those of the block under way, or of the next one.
    fn to_play(&self, mut lacking: Vec<usize>, database: &Database) -> Result<Vec<usize>, DatabaseError> {
        let (Some(budget), Some(&first)) = (&self.budget, lacking.first()) else { return Ok(lacking) };
        let block = self.block();
        if first.is_multiple_of(block) && first > 0 && database.is_spent(self, budget)? {
            return Ok(Vec::new());
        }
        lacking.retain(|number| number / block == first / block);
        Ok(lacking)
    }

    fn numbered(&self, database: &Database) -> Result<Vec<Numbered>, DatabaseError> {
        Ok(database.episodes()?.into_iter().map(|number| (number as i64, number as i64)).collect())
    }

    fn is_one_piece(&self) -> bool {
        self.budget.is_some()
    }

    fn conclude(output: &Output, directory: &Path) -> Result<(), Failure> {
        let (begun, _) = resumed(output, directory, true)?;
        play_all(output, begun, None, None).map(drop)
    }
}

/// Plays the episodes of a new run, or those that an interrupted one still lacks.
pub fn run(output: &Output, arguments: &RunArguments) -> Result<(), Failure> {
    let begun = match &arguments.resume {
        Some(path) => {
            let begun = resumed(output, path, false)?;
            let (run, _) = &begun.0;
            can_fail_on(&arguments.fail_on, run.space(), run.settings().replays)?;
            Some(begun)
        }
        None => begun(output, arguments)?,
    };
    let Some(((run, directory), elsewhere)) = begun else { return Ok(()) };
    output.tell(&format!("{}, into {}", heading(&run), directory.path.shown()));
    conditions::ambient_text(&run).iter().for_each(|text| output.tell(text));
    elsewhere.iter().for_each(|text| output.warn(text));
    let (found, failed_replays) = play_all(output, (run, directory), elsewhere, arguments.jobs)?;
    failed_on((&found, failed_replays), &arguments.fail_on)
}

/// Refuses to fail on what a run cannot find.
fn can_fail_on(fail_on: &[FailOn], space: &Space, replays: u32) -> Result<(), Failure> {
    let why = match () {
        () if fail_on.contains(&FailOn::Recurring) && !oracle::can_tell(replays) => {
            "`--fail-on recurring` needs at least 7 replays, because fewer are never certain: begin a run with `--repeat 20`"
        }
        () if fail_on.contains(&FailOn::Breach) && space.requirements.is_empty() => {
            "`--fail-on breach` needs a requirement, and the space has none: add `use \"law.ava\"`, or a `require`"
        }
        () if fail_on.contains(&FailOn::Stalled) && space.episode.stalled_steps.is_none() => {
            "`--fail-on stalled` needs episodes that stop so: write `stop: arrived or stalled >= 4` in `episode`"
        }
        () => return Ok(()),
    };
    Err(Failure::usage(why))
}

/// The failure of a run of which the user asked to fail on something that was found.
fn failed_on((found, failed_replays): (&Totals, u64), fail_on: &[FailOn]) -> Result<(), Failure> {
    let asks = |what| fail_on.contains(&what);
    let counted = |count: i64, what: &str| plural(count as usize, what);
    let what = match () {
        () if asks(FailOn::Collision) && found.counted > 0 => {
            let recurring = match found.replayed {
                0 => String::new(),
                _ => format!(", {} of them recur under other noise", found.counted_recurring),
            };
            Some(format!("{} found{recurring}", counted(found.counted, "counted collision")))
        }
        () if asks(FailOn::Breach) && found.episodes_with_breach > 0 => {
            Some(format!("requirements were breached in {}", counted(found.episodes_with_breach, "episode")))
        }
        () if asks(FailOn::Recurring) && found.recurring > 0 => Some(format!(
            "{} {} under other noise",
            counted(found.recurring, "finding"),
            if found.recurring == 1 { "recurs" } else { "recur" }
        )),
        () if asks(FailOn::Stalled) && found.stuck > 0 => {
            Some(format!("the ego vehicle got stuck in {}", counted(found.stuck, "episode")))
        }
        () => None,
    };
    if let Some(what) = what {
        return Err(Failure::Found { what });
    }
    // If no episode was driven to its end, nothing was tested, so the command fails without `--fail-on`, too.
    if found.failed > 0 && (!fail_on.is_empty() || found.failed == found.episodes) {
        return Err(Failure::Ads { findings: found.failed as usize });
    }
    // A finding whose replays failed may recur.
    if failed_replays > 0 && asks(FailOn::Recurring) {
        return Err(Failure::Replays { failed: failed_replays as usize });
    }
    Ok(())
}

/// How often a program failed beside the episodes in which it did, and the last time.
fn failed_replays(
    program: Option<&Arc<Program>>,
    failed_episodes: u64,
) -> Option<(u64, Arc<external::Failure>)> {
    let (failed, last) = program?.failed();
    Some((failed.checked_sub(failed_episodes).filter(|times| *times > 0)?, last?))
}

/// Plays the episodes that a directory still lacks, and says what all of them came to. `elsewhere`: how the policy was trained
/// otherwise, for the result.
fn play_all(
    output: &Output,
    (run, mut directory): (Run, Directory),
    elsewhere: Option<String>,
    asked_jobs: Option<u32>,
) -> Result<(Totals, u64), Failure> {
    let program = run.arena().program();
    let share = Share::of(&directory.path, run.settings())?;
    // Items are episodes, by their numbers.
    let mut todo = share.lacking(run.settings(), &directory)?;
    if !todo.is_empty() {
        directory.refuse_to_play(program.is_none_or(|program| program.can_start()))?;
    }

    let stop = stop_on_interrupt();
    let started = now();
    let jobs = jobs(asked_jobs, program)?;
    let mut progress = match &run.settings().budget {
        None => share.progress(output, "counted", &todo),
        Some(budget) => {
            let simulated_s =
                3600.0 * directory.read(|database| database.left(Some(run.settings())))?.simulated_h;
            Progress::of_hours(output, "counted", budget.hours, simulated_s)
        }
    };
    let mut played = 0;
    let mut driven: Vec<(usize, Arc<Conversation>)> = Vec::new();
    let mut failed_episodes = 0;
    while !todo.is_empty() && !stop.load(Ordering::Relaxed) {
        play(&run, &todo, jobs, &stop, &mut |summary, log| {
            // An episode that was not driven is not kept, so that `--resume` plays it.
            if log.failure.as_ref().is_some_and(|failure| failure.problem == Problem::GivenUp) {
                stop.store(true, Ordering::Relaxed);
                return Ok(());
            }
            failed_episodes += u64::from(log.failure.is_some());
            keep(&run, &mut directory, &summary, &log)?;
            played += 1;
            progress.episode_of(summary.counted(), log.duration_s);
            if driven.len() < SPOT_CHECKS && log.failure.is_none() {
                driven.extend(log.conversation.clone().map(|conversation| (summary.episode, conversation)));
            }
            Ok::<_, Failure>(())
        })?;
        todo = share.lacking(run.settings(), &directory)?;
    }
    drop(progress);
    let is_over = todo.is_empty();
    if is_over {
        directory = settled(run.settings(), directory)?;
    }

    // Before anything is said of what recurs: a program that is not deterministic mixes its chance with the noise.
    for (number, first) in driven.iter().filter(|_| !stop.load(Ordering::Relaxed)) {
        program.iter().for_each(|program| {
            program.spot_check(first, || run.episode(*number).conversation);
        });
    }

    let totals = directory.read(Database::totals)?;
    let refusals = directory.read(Database::refusals)?;
    let is_mixed = program.is_some_and(|program| !program.is_deterministic());
    let not_arrived = directory.read(Database::not_arrived)?;
    output.say(&totals_text(&totals, &not_arrived, started.elapsed().as_secs_f64(), played, is_mixed));
    if totals.replayed > 0 && !oracle::can_tell(run.settings().replays) {
        output.say("fewer than 7 replays never show that a finding recurs: `--repeat 20`");
    }
    let failed_replays = failed_replays(program, failed_episodes);
    if let Some((times, last)) = &failed_replays {
        let (times, unknown) = (plural(*times as usize, "replay"), totals.findings - totals.replayed);
        let unknown = match unknown {
            0 => String::new(),
            _ => format!(" Of {}, nothing says whether they recur.", plural(unknown as usize, "finding")),
        };
        output.warn(&format!(
            "the driving system failed in {times}, which say nothing.{unknown} The last failure: {}",
            last.in_words()
        ));
    }
    if !refusals.is_empty() {
        output.say(&refusals_text(&refusals));
    }
    if totals.stuck * 2 > totals.episodes {
        output.warn(&format!(
            "the ego vehicle got stuck in {} of {}: what does not drive avoids every collision",
            totals.stuck,
            plural(totals.episodes as usize, "episode")
        ));
    }
    let groups = directory.read(Database::groups)?;
    let found = directory.read(Database::found)?;
    if !groups.is_empty() {
        output.say(&groups_text(&groups));
    }
    let requirements = directory.read(Database::requirements)?;
    if !requirements.is_empty() {
        output.say(&requirements_text(&requirements));
    }
    let left = directory.read(|database| database.left(Some(run.settings())))?;
    output.say(&left.in_words());
    if let Some(Budget { hours, until }) = run.settings().budget.filter(|_| is_over) {
        if until.is_some() && left.next_hour.is_none() {
            output.warn("`--until` could not end it: nothing is known of the next hour, because a finding was not played again or an \
                         episode was not driven to its end");
        } else if left.simulated_h < hours && until.is_none() {
            output.warn(&format!(
                "only {:.1} h of {hours} h were simulated: the episodes are too short",
                left.simulated_h
            ));
        }
    }
    let is_protocol = run.settings().rows > 0;
    let tests = match is_protocol {
        true => directory.read(|database| database.tests(Some(run.space())))?,
        false => Vec::new(),
    };
    let tables = match is_protocol && is_over {
        true => protocol::write_both(&directory.path, &run.space().path, &tests)?.to_vec(),
        false => Vec::new(),
    };
    if is_protocol {
        output.say(&protocol::in_words(&tests));
    }
    if let [table, cases] = tables.as_slice() {
        output.say(&format!("each row: {}, {}", table.shown(), cases.shown()));
    }
    let counts = directory.read(Database::rows)?;
    let never = Never::new(run.table(), &counts, directory.read(Database::steps)?);
    // A protocol says of each row what came of it.
    if !is_protocol {
        output.say(&never.in_words(output.verbose));
    }
    let critical = worst_first(directory.critical(output)?, &found);
    output.say(&critical_text(&directory.path, &critical, &found));
    let kept = match is_over {
        true => keep_near(&run, &directory, critical.is_empty() && !is_protocol)?,
        false => Vec::new(),
    };
    if !kept.is_empty() {
        let kept = plural(kept.len(), "episode");
        output.say(&format!(
            "{kept} without a finding in {}/kept:\n  first those with a collision that does not count, then those that did not\n  arrive, then the nearest misses",
            directory.path.shown()
        ));
    }
    // A protocol is complete, and failures say themselves what to do.
    if is_over && (!critical.is_empty() || !kept.is_empty() || !is_protocol && totals.failed == 0) {
        let recurs = left.kinds.iter().any(|kind| kind.worst.is_some());
        output.say(&next_text(&directory.path, &critical, recurs, &kept));
    }
    let failures = directory.read(Database::failures)?;
    if !failures.is_empty() {
        let place = format!("; each is in {}/failures", directory.path.shown());
        output.say(&failures_text(&failures, &place));
    }
    thinking_text(program).iter().for_each(|text| output.say(text));
    let is_reproducible = is_reproducible(output, program);
    cut_off(program).iter().for_each(|note| output.warn(note));
    output.result(serde_json::json!({
        "directory": directory.path, "trained_elsewhere": elsewhere, "totals": totals, "refusals": refusals, "groups": groups,
        "requirements": requirements, "left": left, "never": never, "critical": critical, "found": found, "kept": kept, "failures": failures, "thinking": program.and_then(|program| program.thinking()), "tests": tests, "tables": tables, "reproducible": is_reproducible,
        "failed_replays": failed_replays.as_ref().map_or(0, |(times, _)| *times),
    }));
    share.end(output, directory, is_over, program)?;
    Ok((totals, failed_replays.map_or(0, |(times, _)| times)))
}

/// A new run in a new directory. A dry run only says what would be played.
fn begun(output: &Output, arguments: &RunArguments) -> Result<Option<Begun>, Failure> {
    let (out, face) = (arguments.out.as_deref(), arguments.face);
    // With its own table.
    let policy = arguments.policy.as_ref().map(|path| load::policy(output, path)).transpose()?;
    let table = match (&arguments.file, &policy) {
        (Some(file), _) => load::table(output, file)?,
        (None, Some((table, _))) => table.clone(),
        (None, None) => compile::last(output)?,
    };
    let space = table.space();
    can_fail_on(&arguments.fail_on, space, arguments.replays)?;
    let shard = shard::asked(output, arguments.shard.shard)?;
    let agent = policy.as_ref().map_or(&arguments.conditions.agent, |(_, policy)| &policy.name);
    let under_test = match (&arguments.ads, &policy) {
        (Some(named), _) => load::named(named)?,
        (None, Some((_, policy))) => conditions::trained_against(policy)?,
        (None, None) => load::named(DEFAULT_ADS)?,
    };
    let is_protocol = by_name(agent).is_some_and(|entry| matches!(entry.kind, Kind::OneRow(_)));
    let episodes = arguments.episodes.unwrap_or(if is_protocol { 1 } else { EPISODES });
    let mut settings = conditions::settings(space, &arguments.conditions, agent, under_test, episodes)?;
    if let Some((_, policy)) = &policy {
        conditions::as_trained(&mut settings.conditions, &arguments.conditions, policy, space)?;
    }
    let settings = RunSettings {
        causes: arguments.causes,
        replays: arguments.replays,
        keep: arguments.keep,
        ..settings
    };
    let settings = match arguments.hours {
        None => settings,
        Some(hours) if shard.is_whole() => {
            let budget = Budget { hours, until: arguments.until };
            if let Some(until) = arguments.until.filter(|_| hours > 0.0 && !budget.can_end_sooner()) {
                output.warn(&format!(
                    "{hours} h are too few for `--until {until}`: even if nothing is found, the chance is below that only later"
                ));
            }
            settings.within(budget)
        }
        Some(_) => {
            return Err(Failure::usage(
                "a run with `--hours` is one piece: give each machine a `--seed` of its own, or `--episodes` and shards",
            ));
        }
    };
    let settings = settings.started_unless(arguments.shard.dry_run);
    let run = ready(table, settings, policy.as_ref(), face)?;
    if arguments.shard.dry_run {
        conditions::ambient_text(&run).iter().for_each(|text| output.tell(text));
        let texts = (&*heading(&run), &*plural(run.episodes(), "episode"));
        return shard::planned(output, out, run.settings(), texts, shard).map(|()| None);
    }
    let (held, copy) = run_directory::create(out, shard, &run.space().path, arguments.self_contained)?;
    let run = if arguments.self_contained {
        ready(load::table(output, &copy)?, run.settings().clone(), policy.as_ref(), face)?
    } else {
        run
    };
    let reference = match (&arguments.policy, &policy) {
        (Some(file), Some((_, policy))) => Some(PolicyReference {
            file: load::relative(&held.path, file)?,
            digest: policy.digest.clone(),
            face,
        }),
        _ => None,
    };
    let settings = RunSettings { policy: reference, ..run.settings().clone() };
    let directory = Directory::begin(held, settings, &run.space().path, run.arena().attached())?;
    let elsewhere = policy.as_ref().and_then(|(_, policy)| trained_elsewhere(policy, &run));
    Ok(Some(((run, directory), elsewhere)))
}

/// The rest of an interrupted run. With `is_played`, nothing of it is left to play, and no program is started.
fn resumed(output: &Output, path: &Path, is_played: bool) -> Result<Begun, Failure> {
    let resumed = run_directory::resume::<RunSettings>(output, path, is_played)?;
    let Resumed { settings, text, table, held } = resumed;
    let policy = match &settings.policy {
        None => None,
        Some(reference) => {
            let (own, policy) = load::policy(output, &path.join(&reference.file))?;
            if policy.digest != reference.digest {
                let name = &policy.name;
                return Err(Failure::usage(format!(
                    "the policy `{name}` has changed since the run was begun: begin a new one"
                )));
            }
            Some((own, policy))
        }
    };
    let face = settings.policy.as_ref().map_or(Face::Network, |reference| reference.face);
    let run = ready(table, settings, policy.as_ref(), face)?;
    let elsewhere = policy.as_ref().and_then(|(_, policy)| trained_elsewhere(policy, &run));
    let directory = Directory::open_to_go_on(output, held, &text)?;
    if !is_played {
        for (episode, path) in directory.restore(output)? {
            // The database has the text of a scenario, but not the answers beside it: the program is asked for them again.
            if run.arena().program().is_some() {
                write_answers(&path, &run.episode(episode as usize))?;
            }
        }
    }
    Ok(((run, directory), elsewhere))
}

/// A run of the agent that the settings name, or of the given policy, whose table must have the same rows.
fn ready(
    table: ActionTable,
    settings: RunSettings,
    policy: Option<&(ActionTable, Policy)>,
    face: Face,
) -> Result<Run, Failure> {
    let Some((own, policy)) = policy else {
        return Ok(Run::new(table, settings)?);
    };
    let labels =
        |table: &ActionTable| -> Vec<String> { table.rows().iter().map(|row| row.label.clone()).collect() };
    if labels(own) != labels(&table) {
        let (name, path) = (&policy.name, table.space().path.shown());
        return Err(Failure::usage(format!(
            "`{name}` was trained for another action table than that of `{path}`"
        )));
    }
    let acting = acting(&table, policy, face)?;
    let (period_s, step_s) = (acting.settings().payment.observation_period_s, table.space().episode.step_s);
    if let Some(period_s) = period_s.filter(|&period_s| period_s != step_s) {
        return Err(Failure::usage(format!(
            "`{}` was trained with steps of {period_s} s, the space has {step_s} s: write `step: {period_s} s` there",
            policy.name
        )));
    }
    Ok(Run::with_policy(table, settings, acting)?)
}

/// Writes what an episode found. The scenario comes first, so every episode in the database has its file.
fn keep(
    run: &Run,
    directory: &mut Directory,
    summary: &EpisodeSummary,
    log: &EpisodeLog,
) -> Result<(), Failure> {
    let RunSettings { agent, conditions, .. } = run.settings();
    let player = Player { command: "run", table: run.table(), agent, conditions };
    let is_critical = summary.counted() > 0 || !log.breaches.is_empty();
    let scenario = is_critical.then(|| directory.write_critical(&player, (log, summary))).transpose()?;
    directory.write_failure(&player, (log, summary))?;
    let table = run.table();
    let in_words = |draw: &Draw| emit::action_text(table, draw);
    directory.write(|database| database.add(summary, log, table.space(), in_words, scenario.as_deref()))
}

/// Writes the episodes without a finding that are to be kept. `is_empty`: the run found nothing.
/// An attached driving system that cannot be started drives none of them again.
fn keep_near(run: &Run, directory: &Directory, is_empty: bool) -> Result<Vec<PathBuf>, Failure> {
    let RunSettings { agent, conditions, keep, .. } = run.settings();
    // Unasked, a program of the user's own is not driven again.
    let keeps_some = is_empty && run.arena().program().is_none();
    let keep = keep.unwrap_or(if keeps_some { KEPT_OF_NOTHING } else { 0 });
    if keep == 0 || !oracle::can_replay(run.arena().ads()) {
        return Ok(Vec::new());
    }
    let player = Player { command: "run", table: run.table(), agent, conditions };
    let near = directory.read(|database| database.near(keep as usize))?;
    near.iter()
        .map(|near| {
            let episode = near.episode as usize;
            directory.write_kept(&player, episode, near, &run.episode(episode))
        })
        .collect()
}

/// Says of a policy that plays where, or against whom, it has not learned, how it was trained.
fn trained_elsewhere(policy: &Policy, run: &Run) -> Option<String> {
    let (origin, now) = (&policy.origin, &run.settings().conditions);
    let mut told = Vec::new();
    let roads: Vec<&str> =
        now.roads.iter().filter(|road| !origin.roads.contains(road)).map(String::as_str).collect();
    if !roads.is_empty() {
        told.push(format!("on {}, and plays on {}", origin.roads.join(", "), roads.join(", ")));
    }
    // A profile that is not recorded is the default.
    let usual = || (origin.ads == DEFAULT_ADS).then(|| ModularConfig::default().digest());
    let trained = origin.profile_digest.clone().or_else(usual);
    let profile = now.profile.as_ref().map(|profile| profile.digest.clone());
    let plays = run.arena().attached().map(|attached| attached.digest()).or(profile).or_else(usual);
    if now.ads != origin.ads {
        told.push(format!("against {}, and plays against {}", origin.ads, run.arena().ads_name()));
    } else if trained != plays {
        let how =
            |line: Option<&str>| line.map_or("its default profile".to_owned(), |line| format!("`{line}`"));
        let line = now.profile.as_ref().map(|profile| profile.settings.to_line());
        let line =
            line.filter(|line| !line.is_empty()).or_else(|| run.arena().attached().map(|of| of.to_line()));
        let (before, after) = (how(origin.profile.as_deref()), how(line.as_deref()));
        told.push(format!("against {} with {before}, and plays against it with {after}", origin.ads));
    }
    let traffic = now.traffic.as_ref().map(TrafficRecord::in_words);
    if traffic != origin.traffic {
        let usual = || "the usual".to_owned();
        let (before, after) = (origin.traffic.clone().unwrap_or_else(usual), traffic.unwrap_or_else(usual));
        told.push(format!("with traffic {before}, and plays with {after}"));
    }
    if now.ambient > 0 {
        let vehicles = plural(now.ambient as usize, "vehicle");
        told.push(format!("without ambient traffic, and plays among {vehicles} of it"));
    }
    for (how, none, before, now) in [
        ("with", "with no optional rule", &origin.with, &now.with),
        ("without", "with every standard rule", &origin.without, &now.without),
    ] {
        if before != now {
            let rules = |names: &[String]| match names {
                [] => none.to_owned(),
                names => format!("{how} `{}`", names.join("`, `")),
            };
            told.push(format!("{}, and plays {}", rules(before), rules(now)));
        }
    }
    (!told.is_empty()).then(|| {
        format!("`{}` was trained {}: what it learned need not hold there", policy.name, told.join("; "))
    })
}

fn heading(run: &Run) -> String {
    let settings = run.settings();
    let Conditions { roads, profile, ambient, traffic, .. } = &settings.conditions;
    let ambient = match *ambient {
        0 => String::new(),
        wanted => format!(", {} of ambient traffic", plural(wanted as usize, "vehicle")),
    };
    let traffic = traffic.as_ref().map_or(String::new(), |record| format!(", traffic {}", record.in_words()));
    let ads = run.arena().ads_name();
    format!(
        "{}: {} against {}{}, {} on {}{ambient}{traffic}, seed {}",
        run.space().path.shown(),
        settings.agent,
        ads,
        profile_text(profile.as_ref()),
        match settings.budget {
            Some(Budget { hours, .. }) => format!("{hours} h of simulated time"),
            None if settings.rows > 0 => plural(run.episodes(), "episode"),
            None => plural(settings.episodes as usize, "episode"),
        },
        roads.join(", "),
        settings.seed
    )
}

/// Files of scenarios in the order of what was found in them.
fn worst_first(mut files: Vec<PathBuf>, found: &[FoundIn]) -> Vec<PathBuf> {
    files.sort_by_cached_key(|file| {
        found.iter().position(|of| file.file_stem().is_some_and(|stem| *stem == *of.name()))
    });
    files
}
