//! `avastra train`: trains an agent to find crashes, and writes it as a policy.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use avastra_base::outside::Shown;
use avastra_campaign::emit;
use avastra_campaign::episode::{EpisodeLog, Script};
use avastra_campaign::oracle;
use avastra_campaign::oracle::MIXED;
use avastra_campaign::run::{
    Budget, Conditions, Database, EpisodeSummary, Shard, Stage, TrafficRecord, Units,
};
use avastra_campaign::train::{Evaluation, TrainSettings, TrainedEpisode, Training, evaluate, rounded};
use avastra_drivers::external::Attached;
use avastra_lang::model::policy::{PolicyClaims, PolicyOrigin};
use avastra_lang::model::{Policy, Space, digest_text};
use avastra_lang::syntax::listed;
use avastra_search::agent::{self, Kind, QPolicy, Settings};
use avastra_world::action::Draw;

use super::arguments::TrainArguments;
use super::campaign::{self, Campaign, Outside, as_they_are};
use super::conditions::{profile_text, roads_or_all};
use super::error::Failure;
use super::files::{folder, write};
use super::findings::{cut_off, failures_text, is_reproducible, kinds_text, thinking_text, unfinished};
use super::interrupt::stop_on_interrupt;
use super::load::UnderTest;
use super::output::{Output, for_shell, plural};
use super::policy::distil::{self, rules_text};
use super::progress::{TrainingProgress, Working};
use super::run_directory::{Player, Resumed};
use super::summary::{groups_text, requirements_text};
use super::{load, run_directory};

/// Episodes between two checkpoints: at most so many are played again after a kill.
const CHECKPOINT_EPISODES: usize = 25;

type Directory = run_directory::Directory<TrainSettings>;

impl Campaign for TrainSettings {
    const KIND: campaign::Kind = campaign::Kind {
        what: "training",
        command: "train",
        file: "run",
        is_in: |directory| run_directory::is_training(directory) == Some(true),
        keeps_space: true,
        // Each episode is chosen with what was learned before.
        merge: None,
        foreign: run_directory::foreign_in::<TrainSettings>,
    };
    type Database = Database;

    fn outside(&mut self) -> Outside<'_> {
        let Conditions { space, space_digest, external, .. } = &mut self.conditions;
        Outside { space, space_digest, external, policy: None }
    }
}

/// Trains to the end, or until Ctrl-C; then says how to go on.
pub fn train(output: &Output, arguments: &TrainArguments) -> Result<(), Failure> {
    let (mut training, mut directory) = match &arguments.resume {
        Some(path) => resumed(output, path)?,
        None => begun(output, arguments)?,
    };
    let settings = training.settings().clone();
    output.tell(&heading(&training, &directory.path));
    let stop = stop_on_interrupt();
    let mut progress = match settings.hours {
        None => TrainingProgress::new(output, u64::from(settings.episodes), training.episodes() as u64),
        Some(hours) => TrainingProgress::of_hours(output, hours, training.simulated_s()),
    };
    while !training.is_done() && !stop.load(Ordering::Relaxed) {
        let trained = training.episode().map_err(|why| Failure::file("go on with", &directory.path, why))?;
        // No driving system is left to drive the other episodes. This one is kept with a checkpoint.
        if training.arena().program().is_some_and(|program| program.given_up().is_some()) {
            stop.store(true, Ordering::Relaxed);
        }
        keep(&training, &mut directory, &trained, &stop)?;
        progress.episode(&trained);
    }
    drop(progress);
    if !training.is_done() {
        return Err(unfinished("train", directory.path, training.arena().program()));
    }
    finish(output, &training, directory)
}

/// A new training, from the command line.
fn begun(output: &Output, arguments: &TrainArguments) -> Result<(Training, Directory), Failure> {
    let file = arguments.file.as_ref().expect("clap asks for it where there is no `--resume`");
    let table = load::table(output, file)?;
    let hyperparameters = settings(arguments)?;
    let space = table.space();
    let UnderTest { ads, profile, external } = load::named(&arguments.under_test.ads)?;
    let traffic = arguments.traffic.as_deref().map(load::traffic).transpose()?;
    let conditions = Conditions {
        roads: roads_or_all(&arguments.road, space),
        ads,
        // Without a file nothing is recorded.
        profile: profile.filter(|_| load::profile_path(&arguments.under_test.ads).is_some()),
        external,
        traffic: traffic.as_ref().and_then(TrafficRecord::new),
        without: arguments.rules.without.clone(),
        with: arguments.rules.with.clone(),
        ..Conditions::of(space)
    };
    let settings = TrainSettings {
        conditions,
        agent: arguments.agent.clone(),
        episodes: arguments
            .hours
            .map_or(arguments.episodes, |hours| Budget { hours, until: None }.episodes(1)),
        hours: arguments.hours,
        evaluation: arguments.evaluate,
        seed: arguments.seed,
        hyperparameters,
    };
    let mut training = Training::new(table, settings)?;
    let (out, space) = (arguments.out.as_deref(), &training.table().space().path);
    let (held, copy) = run_directory::create(out, Shard::WHOLE, space, arguments.self_contained)?;
    if arguments.self_contained {
        training = Training::new(load::table(output, &copy)?, training.settings().clone())?;
    }
    let (space, attached) = (&training.table().space().path, training.arena().attached());
    let directory = Directory::begin(held, training.settings().clone(), space, attached)?;
    Ok((training, directory))
}

/// The agent's settings: the preset that is asked for, as the configuration file changes it.
fn settings(arguments: &TrainArguments) -> Result<Settings, Failure> {
    let trained =
        agent::REGISTRY.iter().filter(|entry| !matches!(entry.kind, Kind::Ready(_) | Kind::OneRow(_)));
    let entry = agent::by_name(&arguments.agent).ok_or_else(|| {
        let known = listed(&trained.map(|entry| entry.name).collect::<Vec<_>>());
        Failure::usage(format!("no agent `{}` that learns: there are {known}", arguments.agent))
    })?;
    let text = arguments.config.as_deref().map(load::text).transpose()?.unwrap_or_default();
    let settings = Settings::from_yaml(entry, arguments.preset.as_deref(), &text).ok_or_else(|| {
        let name = entry.name;
        Failure::usage(format!("`{name}` has nothing to learn: `avastra run --agent {name}` plays it"))
    })?;
    settings.map_err(|error| match &arguments.config {
        Some(path) => Failure::file("take", path, error),
        // The preset alone can be wrong.
        None => Failure::usage(format!("cannot take `--preset`: {error}")),
    })
}

/// The rest of an interrupted training.
fn resumed(output: &Output, path: &Path) -> Result<(Training, Directory), Failure> {
    let Resumed { settings, text, table, held } =
        run_directory::resume::<TrainSettings>(output, path, false)?;
    let mut directory = Directory::open(held, &text)?;
    let checkpoint = directory
        .database
        .return_to_checkpoint(settings.judging())
        .map_err(|error| Failure::file("resume", path, error))?;
    let training = match checkpoint {
        None => Training::new(table, settings)?,
        Some(checkpoint) => {
            let so_far = (checkpoint.episodes, directory.read(Database::trained_s)?);
            Training::resumed(table, settings, so_far, &checkpoint.learner)?
        }
    };
    // Only scenarios up to the checkpoint are restored; later episodes are played again.
    directory.restore(output)?;
    Ok((training, directory))
}

/// Writes what an episode found as a scenario, and commits it. A checkpoint goes with it every so often, at the end, and when
/// the user stops.
fn keep(
    training: &Training,
    directory: &mut Directory,
    trained: &TrainedEpisode,
    stop: &AtomicBool,
) -> Result<(), Failure> {
    let settings = training.settings();
    let TrainSettings { agent, conditions, .. } = settings;
    let player = Player { command: "train", table: training.table(), agent, conditions };
    directory.write_failure(&player, (&trained.log, &trained.summary))?;
    let scenario = is_written(training, &trained.log, &trained.summary)
        .then(|| directory.write_critical(&player, (&training.log_of_space(&trained.log), &trained.summary)));
    let scenario = scenario.transpose()?;
    let is_due = training.episodes().is_multiple_of(CHECKPOINT_EPISODES)
        || training.is_done()
        || stop.load(Ordering::Relaxed);
    let checkpoint = is_due.then(|| training.agent().save());
    let table = training.table();
    let in_words = |draw: &Draw| emit::action_text(table, draw);
    directory.write(|database| {
        let checkpoint = checkpoint.as_deref();
        database.add_trained(trained, checkpoint, table.space(), in_words, scenario.as_deref())
    })
}

/// Whether an episode becomes a scenario. Where a training sets its observation period, none does, because a replay would use the
/// period of the space.
fn is_written(training: &Training, log: &EpisodeLog, summary: &EpisodeSummary) -> bool {
    let is_critical = summary.counted() > 0 || !log.breaches.is_empty();
    is_critical && training.settings().hyperparameters.observation_period_s().is_none()
}

/// Plays what was learned, and keeps its findings. Its episodes are numbered on from those of the training.
fn evaluated(training: &Training, directory: &mut Directory) -> Result<Evaluation, Failure> {
    let TrainSettings { agent, conditions, evaluation, seed, .. } = training.settings();
    let player = Player { command: "train", table: training.table(), agent, conditions };
    let in_words = |draw: &Draw| emit::action_text(training.table(), draw);
    let mut kept = Ok(());
    // After a kill they may be there already. Then only their figures are lacking.
    let is_kept = directory.read(Database::evaluated)? >= training.settings().judging();
    let mut keep = |mut summary: EpisodeSummary, log: &EpisodeLog| -> Result<(), Failure> {
        summary.episode += training.episodes();
        let scenario = is_written(training, log, &summary)
            .then(|| directory.write_critical(&player, (log, &summary)))
            .transpose()?;
        directory.write_failure(&player, (log, &summary))?;
        let space = training.table().space();
        directory.write(|database| database.add(&summary, log, space, in_words, scenario.as_deref()))
    };
    let test = (u64::from(*evaluation), *seed);
    let evaluation = evaluate(training.arena(), &|| training.agent().actor(), test, &mut |summary, log| {
        if kept.is_ok() && !is_kept {
            kept = keep(summary, log);
        }
    });
    kept.map(|()| evaluation)
}

/// Evaluates the policy, writes it, and prints the result of the training.
fn finish(output: &Output, training: &Training, mut directory: Directory) -> Result<(), Failure> {
    let settings = training.settings();
    let totals = directory.read(Database::totals)?;
    let failures = directory.read(Database::failures)?;
    let working = Working::new(output, "playing what it learned");
    let evaluation = evaluated(training, &mut directory)?;
    drop(working);
    let kept = training.agent().policy().map(|acting| {
        let distilling = "distilling rules from the network";
        let _working = (evaluation.episodes > 0).then(|| {
            output.tell(distilling);
            Working::new(output, distilling)
        });
        let policy = policy(training, acting, &evaluation);
        let path = write_policy(&policy, training.table().space(), &directory.path)?;
        Ok::<_, Failure>((path, policy))
    });
    let kept = kept.transpose()?;
    let simulated_h = directory.read(Database::trained_s)? / 3600.0;
    output.say(&format!(
        "\n{} in {simulated_h:.1} h of simulated time: {}, {} counted in {}",
        plural(totals.episodes as usize, "episode"),
        plural(totals.collisions as usize, "collision"),
        totals.counted,
        plural(totals.episodes_with_counted as usize, "episode"),
    ));
    let learned = directory.read(Database::learned)?;
    if let Some((epsilon, updates)) = learned.filter(|_| kept.is_some()) {
        output.say(&format!(
            "{updates} updates of the network; at the end it chose at random in {:.0} % of the steps",
            100.0 * epsilon
        ));
        if updates == 0 {
            output.warn(
                "the network was never updated, so what it chooses is chance: train for more episodes, or lower `learning_starts`",
            );
        }
    }
    if evaluation.episodes > 0 {
        output.say(&format!(
            "what it learned, on {} of its own: {} counted in {}",
            plural(settings.judging(), "episode"),
            plural(evaluation.counted as usize, "collision"),
            plural(evaluation.colliding as usize, "episode"),
        ));
    }
    find_recurrence(output, training, &mut directory)?;
    let groups = directory.read(Database::groups)?;
    if !groups.is_empty() {
        output.say(&groups_text(&groups));
        if training.arena().program().is_some_and(|program| !program.is_deterministic()) {
            output.say(&format!("of how often they recur: {MIXED}"));
        }
    }
    let left = directory.read(|database| database.left(None))?;
    if oracle::can_replay(training.arena().ads()) && settings.hyperparameters.observation_period_s().is_none()
    {
        output.say(&left.kinds_text());
    }
    let requirements = directory.read(Database::requirements)?;
    if !requirements.is_empty() {
        output.say(&requirements_text(&requirements));
    }
    let critical = directory.critical(output)?;
    let rules = kept.as_ref().and_then(|(_, policy)| policy.claims.as_ref()?.rules.as_ref());
    match &kept {
        Some((path, policy)) => {
            if let Some(rules) = rules {
                output.say(&rules_text(policy.rules.len(), evaluation.return_mean, rules));
            }
            output.say(&format!("{}\nplay it with: avastra run --policy {}", path.shown(), for_shell(path)))
        }
        None => output.say(&search_text(&directory.path, &critical)),
    }
    if !failures.is_empty() {
        let place = format!(" in the training; each is in {}/failures", directory.path.shown());
        output.say(&failures_text(&failures, &place));
    }
    if !evaluation.failures.is_empty() {
        let kinds = kinds_text(&evaluation.failures);
        output.say(&format!("\nthe driving system failed in the episodes of what it learned: {kinds}"));
    }
    let failed = totals.failed as usize + failed(&evaluation);
    let all = totals.episodes as usize + settings.judging();
    if failed > 0 {
        output.warn(&format!(
            "the driving system failed in {} of {}, which ended there: that these have few collisions says nothing; \
             `avastra ads check` looks at the driving system alone",
            failed,
            plural(all, "episode"),
        ));
    }
    thinking_text(training.arena().program()).iter().for_each(|text| output.say(text));
    let is_reproducible = is_reproducible(output, training.arena().program());
    cut_off(training.arena().program()).iter().for_each(|note| output.warn(note));
    let evaluation = serde_json::json!({
        "episodes": settings.judging(), "collisions": evaluation.collisions,
        "counted": evaluation.counted, "colliding": evaluation.colliding,
        "simulated_h": evaluation.simulated_s / 3600.0, "return": evaluation.return_mean,
        "failures": evaluation.failures,
    });
    let results = serde_json::json!({ "simulated_h": simulated_h, "rules": rules, "evaluation": evaluation });
    let text = serde_json::to_string_pretty(&results).expect("results have string keys only");
    directory.write(|database| database.keep_results(&text))?;
    // A kill leaves free pages behind where episodes are played again, so the bytes would tell of it.
    let units = directory.read(as_they_are)?;
    let directory = directory.settle(&units)?;
    write(&directory.path.join("results.json"), &format!("{text}\n"))?;
    output.result(serde_json::json!({
        "reproducible": is_reproducible,
        "directory": directory.path, "totals": totals, "groups": groups, "requirements": requirements, "left": left, "policy": kept.as_ref().map(|(path, _)| path),
        "rules": rules, "simulated_h": simulated_h, "failures": failures, "evaluation": evaluation,
    }));
    // If no episode was driven to its end, nothing was learned, so the command fails.
    if failed > 0 && failed == all { Err(Failure::Ads { findings: failed }) } else { Ok(()) }
}

/// Says of examples of each distinct failure, and of each requirement, how often they recur, in their scenarios and in the
/// database. A training finds the same failure over and over, so its examples are played again only until one recurs. A
/// failure is said not to recur only if all of its examples were tried.
fn find_recurrence(output: &Output, training: &Training, directory: &mut Directory) -> Result<(), Failure> {
    let TrainSettings { agent, conditions, .. } = training.settings();
    let player = Player { command: "train", table: training.table(), agent, conditions };
    let _working = Working::new(output, "playing what it found again");
    // A scenario that is written anew meanwhile is done, and not looked at again.
    let written = directory.read(Units::scenarios)?;
    let mut done = BTreeSet::new();
    while oracle::can_replay(training.arena().ads()) {
        let next = directory.read(|database| database.to_try(|episode| done.contains(&episode)))?;
        if next.is_empty() {
            break;
        }
        let examples = written.iter().filter(|one| next.contains(&one.unit)).cloned();
        let files = run_directory::written(&directory.path, examples.collect());
        done.extend(next);
        // A scenario that the user edited or removed is left so.
        for (path, _) in files.iter().filter(|file| !run_directory::is_edited(file) && file.0.is_file()) {
            let (table, scenario) = load::scenario(&Output::silent(), path)?;
            let (stage, ads) = (Stage::new(&table, &scenario)?, training.arena().ads());
            let (setup, log) = (stage.setup(ads), stage.play(ads, &mut |_, _, _| {}));
            let episode = scenario.origin.episode.unwrap_or(0) as usize;
            let mut summary = EpisodeSummary::judged(&setup, episode, &log);
            summary.find_keepers(&setup, &log);
            summary.find_recurrence(&setup, &Script::of_scenario(&scenario), &log, oracle::REPLAYS);
            directory.rewrite_critical(&player, (&log, &summary), |database, text| {
                database.add_recurrence(&summary, table.space(), text)
            })?;
        }
    }
    Ok(())
}

/// Where to find what a search found, which has no policy file.
fn search_text(directory: &Path, critical: &[PathBuf]) -> String {
    match critical.len() {
        0 => "a search has no policy file; no scenario was written".to_owned(),
        found => {
            let critical = directory.join("critical");
            format!("a search has no policy file: {} in {}", plural(found, "scenario"), critical.shown())
        }
    }
}

/// Episodes of an evaluation that ended because the driving system failed.
fn failed(evaluation: &Evaluation) -> usize {
    evaluation.failures.values().sum::<u64>() as usize
}

/// The policy to be written, with the rules distilled from it and the claims of both.
fn policy(training: &Training, acting: &QPolicy, evaluation: &Evaluation) -> Policy {
    let settings = training.settings();
    let name = match settings.conditions.roads.as_slice() {
        [road] => format!("{road}_{}_{}", settings.agent, settings.seed),
        _ => format!("{}_{}", settings.agent, settings.seed),
    };
    let network = acting.network();
    let policy = Policy {
        name,
        docs: vec![headline(training, evaluation)],
        origin: origin(
            &settings.conditions,
            training.arena().attached().as_ref(),
            &settings.agent,
            (settings.seed, training.episodes() as u64),
        ),
        layers: network.shape().layers.clone(),
        dueling: network.shape().dueling,
        hyperparameters: acting.settings().record(),
        parameters: network.parameters().to_vec(),
        claims: (evaluation.episodes > 0).then(|| PolicyClaims {
            episodes: evaluation.episodes,
            seed: evaluation.seed,
            collisions: evaluation.collisions,
            counted: evaluation.counted,
            colliding: evaluation.colliding,
            return_mean: rounded(evaluation.return_mean),
            trace: digest_text(&evaluation.trace),
            rules: None,
        }),
        rules: Vec::new(),
        digest: String::new(),
    };
    distil::with_rules(training.arena(), acting, policy)
}

/// Who was trained, against what and for how long: a seed and a number of episodes.
pub fn origin(
    conditions: &Conditions,
    attached: Option<&Attached>,
    agent: &str,
    (seed, episodes): (u64, u64),
) -> PolicyOrigin {
    let profile = conditions.profile.as_ref();
    let (line, digest) = profile.map(|profile| (profile.settings.to_line(), profile.digest.clone())).unzip();
    PolicyOrigin {
        agent: agent.to_owned(),
        seed,
        episodes,
        roads: conditions.roads.clone(),
        ads: conditions.ads.clone(),
        profile: line.filter(|line| !line.is_empty()).or_else(|| attached.map(Attached::to_line)),
        profile_digest: digest.or_else(|| attached.map(Attached::digest)),
        traffic: conditions.traffic.as_ref().map(TrafficRecord::in_words),
        engine: conditions.engine.clone(),
        avastra: conditions.avastra.clone(),
        with: conditions.with.clone(),
        without: conditions.without.clone(),
    }
}

/// Writes `policy/NAME.ava`.
fn write_policy(policy: &Policy, space: &Space, directory: &Path) -> Result<PathBuf, Failure> {
    let folder = folder(directory, "policy")?;
    let space_path = load::relative(&folder, &space.path)?;
    let path = folder.join(format!("{}.ava", policy.name));
    write(&path, &emit::policy_text(policy, space, &space_path, "train"))?;
    Ok(path)
}

/// The policy's headline: what it is, in a sentence.
fn headline(training: &Training, evaluation: &Evaluation) -> String {
    let settings = training.settings();
    let trained = format!(
        "{} ({}) after {} on {}",
        settings.agent,
        settings.hyperparameters.preset(),
        plural(training.episodes(), "episode"),
        settings.conditions.roads.join(", "),
    );
    if evaluation.episodes == 0 {
        return format!("{trained}.");
    }
    let failed = match failed(evaluation) {
        0 => String::new(),
        failed => format!(" The driving system failed in {failed} of them."),
    };
    format!(
        "{trained}: {} in {} of its own.{failed}",
        plural(evaluation.counted as usize, "counted collision"),
        plural(settings.judging(), "episode"),
    )
}

fn heading(training: &Training, directory: &Path) -> String {
    let settings = training.settings();
    let network = training.agent().policy().map_or(String::new(), |policy| {
        let network = policy.network();
        let widths: Vec<String> = network.shape().layers.iter().map(ToString::to_string).collect();
        format!(", network {}, {} parameters", widths.join("-"), network.parameters().len())
    });
    format!(
        "{}: {} ({}{network}) against {}{}, {} on {}, seed {}, into {}",
        training.table().space().path.shown(),
        settings.agent,
        settings.hyperparameters.preset(),
        training.arena().ads_name(),
        profile_text(settings.conditions.profile.as_ref()),
        match settings.hours {
            Some(hours) => format!("{hours} h of simulated time"),
            None => plural(settings.episodes as usize, "episode"),
        },
        settings.conditions.roads.join(", "),
        settings.seed,
        directory.shown()
    )
}
