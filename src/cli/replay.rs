//! `avastra replay`: plays emitted scenarios and policies again and checks every claim.

use std::path::{Path, PathBuf};

use avastra_base::outside::Shown;
use avastra_campaign::episode::{Breach, Collision, EpisodeLog, Script};
use avastra_campaign::oracle;
use avastra_campaign::oracle::{Found, Recurrence, Replayed as PlayedAgain, mixed_text};
use avastra_campaign::run::{Asked, Gauges, Stage};
use avastra_drivers::Selected;
use avastra_drivers::external::EVIDENCE;
use avastra_lang::check::Loaded;
use avastra_lang::model::vocabulary::Word;
use avastra_lang::model::{Avoidability, Policy, RequirementDef, Scenario, Space};
use avastra_world::action::ActionTable;

use super::arguments::ReplayArguments;
use super::error::Failure;
use super::files::{must_end_in, write_named};
use super::findings::needs_program;
use super::load;
use super::look::{self, Changed, Looked};
use super::output::{Output, for_shell, plural};
use super::parallel::each_file;
use super::policy::claims;

/// The result for a file.
enum Replayed {
    Scenario(Box<Played>),
    /// With the claims that do not hold.
    Policy(PathBuf, Box<Policy>, Vec<String>),
}

/// Replays the scenario, or the evaluation of the policy, of every file; of scenarios against another driving system it only
/// tells what happens.
pub fn replay(output: &Output, arguments: &ReplayArguments) -> Result<(), Failure> {
    let asked = load::asked(arguments.against.ads.as_deref())?;
    if let Some(record) = &arguments.record {
        can_record(record)?;
        if arguments.many.files.len() != 1 {
            return Err(Failure::usage("`--record` writes the questions of one scenario: name one file"));
        }
    }
    let played = each_file(output, &arguments.many, asked.external.as_ref(), |path| {
        let loaded = load::read_and_check(path)?;
        if load::is_policy(&loaded) {
            return replay_policy(output, path, loaded, (&asked, arguments));
        }
        let Looked { table, scenario, changed } = look::scenario_in(output, path, loaded)?;
        let (ads, is_recorded) = asked.selected_for(&scenario)?;
        let in_file = |played: Played| Replayed::Scenario(Box::new(played));
        if is_recorded {
            return play((&table, &scenario), path, (&ads, None), changed.as_ref(), arguments).map(in_file);
        }
        let profile = arguments.against.ads.as_deref().and_then(load::profile_path);
        let name = match (profile, ads.program()) {
            (_, Some(program)) => program.attached().name(),
            (Some(path), None) => format!("{} with {}", ads.name(), path.shown()),
            (None, None) => ads.name().to_owned(),
        };
        play((&table, &scenario), path, (&ads, Some(name)), changed.as_ref(), arguments).map(in_file)
    })?;
    let (mut scenarios, mut policies, mut refuted) = (Vec::new(), Vec::new(), 0);
    for found in &played.done {
        match found {
            Replayed::Scenario(played) => scenarios.push(played.as_ref()),
            Replayed::Policy(path, policy, wrong) => {
                refuted += wrong.len();
                claims::report(output, path, policy, wrong);
                policies.push(serde_json::json!({ "file": path, "policy": policy.name, "refuted": wrong }));
            }
        }
    }
    let tally = tell(output, &scenarios);
    refuted += tally.refuted;
    output.result(serde_json::json!({
        "confirmed": tally.confirmed, "refuted": refuted, "untried": tally.untried, "policies": policies,
        "scenarios": scenarios.iter().map(|played| &played.result).collect::<Vec<_>>(),
        "failed": played.failed_in_json(),
    }));
    let findings = scenarios.iter().filter(|played| played.has_ads_failed).count();
    played.complete("replayed")?;
    refutation(refuted)?;
    if findings > 0 { Err(Failure::Ads { findings }) } else { Ok(()) }
}

/// Refuses a file that evidence must not replace: only a new one, or older evidence.
fn can_record(path: &Path) -> Result<(), Failure> {
    must_end_in(path, "jsonl")?;
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    if folder.is_some_and(|folder| !folder.is_dir()) {
        return Err(Failure::file("write", path, "its folder does not exist"));
    }
    let is_evidence = |text: &str| text.lines().next().is_some_and(|head| head.contains(EVIDENCE));
    match load::read(path) {
        Ok(there) if !there.is_empty() && !is_evidence(&there) => Err(Failure::usage(format!(
            "`{}` is there and holds something else: choose another name for what is written",
            path.shown()
        ))),
        _ => Ok(()),
    }
}

/// Plays the evaluation of a policy again, against the driving system that it was trained against.
fn replay_policy(
    output: &Output,
    path: &Path,
    loaded: Loaded,
    (asked, arguments): (&Asked, &ReplayArguments),
) -> Result<Replayed, Failure> {
    let (table, policy) = load::policy_in(output, path, loaded)?;
    if arguments.record.is_some() || arguments.repeat > 0 {
        let path = path.shown();
        return Err(Failure::usage(format!(
            "`{path}` is a policy: `--record` and `--repeat` are for scenarios"
        )));
    }
    if !asked.is_nothing() {
        let (path, word) = (path.shown(), for_shell(path));
        return Err(Failure::usage(format!(
            "`{path}` claims what happens with the driving system that it was trained against: `avastra run --policy {word}` \
             plays it with another one"
        )));
    }
    let wrong = claims::judge(&table, &policy)?;
    Ok(Replayed::Policy(path.to_owned(), Box::new(policy), wrong))
}

/// How many claims hold, how many do not, and how many could not be tried.
#[derive(Default)]
struct Tally {
    confirmed: usize,
    refuted: usize,
    untried: usize,
}

/// Says what came of each replay, and the sums of several.
fn tell(output: &Output, played: &[&Played]) -> Tally {
    let mut tally = Tally::default();
    let (mut files, mut refuted_files) = (0, 0);
    let banner = |played: &&Played| Some((played.path.shown().to_string(), played.banner.clone()?));
    look::together(played.iter().filter_map(banner)).iter().for_each(|banner| output.warn(banner));
    for played in played {
        files += 1;
        let Some(verdicts) = &played.claims else {
            output.say(&format!("{} against {}", played.path.shown(), played.told));
            continue;
        };
        let wrong = verdicts.iter().filter(|verdict| verdict.is_refuted()).count();
        let untried = verdicts.iter().filter(|verdict| verdict.confirmed.is_none()).count();
        tally.refuted += wrong;
        tally.untried += untried;
        tally.confirmed += verdicts.len() - wrong - untried;
        refuted_files += usize::from(wrong > 0);
        report(output, &played.path, &played.name, verdicts);
        if !played.told.is_empty() {
            output.tell(&played.told);
        }
    }
    if files > 1 && tally.confirmed + tally.refuted > 0 {
        let untried = match tally.untried {
            0 => String::new(),
            untried => format!(", {untried} not tried"),
        };
        output.say(&format!(
            "\n{}: {} confirmed, {} refuted in {refuted_files} of them{untried}",
            plural(files, "scenario"),
            plural(tally.confirmed, "claim"),
            tally.refuted
        ));
    }
    tally
}

pub fn refutation(refuted: usize) -> Result<(), Failure> {
    if refuted > 0 { Err(Failure::Refuted { claims: refuted }) } else { Ok(()) }
}

/// The result of replaying one scenario.
struct Played {
    path: PathBuf,
    /// The name of the scenario.
    name: String,
    /// Its claims, if it was played as it was recorded.
    claims: Option<Vec<oracle::ClaimResult>>,
    /// The banner about changes since the file was written, if there are any.
    banner: Option<String>,
    /// The outcome, in words.
    told: String,
    /// Another driving system than the recorded one failed.
    has_ads_failed: bool,
    /// All of it, for JSON.
    result: serde_json::Value,
}

/// Plays a scenario. With a name for the driving system it is another one than the recorded: no claim is checked. `changed`
/// are the changes since the file was written.
fn play(
    (table, scenario): (&ActionTable, &Scenario),
    path: &Path,
    (ads, other): (&Selected, Option<String>),
    changed: Option<&Changed>,
    ReplayArguments { repeat, record, .. }: &ReplayArguments,
) -> Result<Played, Failure> {
    let stage = Stage::new(table, scenario)?;
    let mut gauges = Gauges::default();
    let log = stage.play(ads, &mut |world, _, contacts| gauges.note(world, contacts));
    let (criticality, pet_s) = gauges.of_steps(&log);
    let severities: Vec<oracle::Severity> = log.collisions.iter().map(oracle::severity).collect();
    let priorities: Vec<&str> =
        log.collisions.iter().map(|collision| collision.contact.ruling.priority.name()).collect();
    let program = ads.program().filter(|program| program.can_start());
    let claims = other.is_none().then(|| {
        let mut claims = stage.verify(ads, &log);
        let Some(program) = program.filter(|_| claims.iter().any(oracle::ClaimResult::is_refuted)) else {
            return claims;
        };
        // One that says it is deterministic may not be: it is asked once more before the claims are blamed.
        if let Some(first) = &log.conversation {
            program.spot_check(first, || stage.play(ads, &mut |_, _, _| {}).conversation);
        }
        if program.is_deterministic() {
            return claims;
        }
        for claim in claims.iter_mut().filter(|claim| claim.is_refuted()) {
            // A driving system that is not deterministic cannot refute a claim by answering otherwise.
            let name = program.attached().name();
            claim.confirmed = None;
            claim.found = format!("{} this time, but {name} is not deterministic", claim.found);
        }
        claims
    });
    let doubted = program.filter(|program| !program.is_deterministic());
    let judgements = other.is_some().then(|| stage.judge(ads, &log));
    let counted =
        judgements.as_ref().map(|judgements| oracle::counted(table.space(), &log, judgements).len());
    let told = match (&other, &judgements) {
        (Some(name), Some(judgements)) => {
            let collisions = plural(log.collisions.len(), "collision");
            let avoidable =
                judgements.iter().filter(|judged| judged.class == Avoidability::Avoidable).count();
            let failed = log.failure.as_ref().map_or_else(String::new, |failure| {
                format!("; it failed at {}, {}: {}", failure.stage, failure.kind().name(), failure.detail)
            });
            let refused = log.refused().map(|(step, reason)| format!("\n  step {step} is refused: {reason}"));
            let refused: String = refused.collect();
            let crashes = log.incidents_in_words(table.space());
            let crashes: String = crashes.iter().map(|crash| format!("\n  {crash}")).collect();
            let breaches = breaches_text(table.space(), scenario, &log);
            format!(
                "{name}: {collisions}, {} counted, {avoidable} avoidable{breaches}{failed}{refused}{crashes}",
                counted.unwrap_or(0)
            )
        }
        _ => {
            let lines = log.collisions.iter().zip(&severities);
            let lines =
                lines.map(|(collision, severity)| severity_text(table.space(), &log, collision, severity));
            let crashes = log.incidents_in_words(table.space());
            let crashes = crashes.into_iter().map(|crash| format!("  {crash}"));
            let failure =
                log.failure.as_ref().map(|failure| format!("  it ends with {}", failure.in_words()));
            // Where nothing is claimed, nothing else says what became of the episode.
            let is_bare = scenario.claims.is_empty();
            let end = is_bare.then(|| format!("  ended: {}", log.end.name()));
            lines.chain(crashes).chain(failure).chain(end).collect::<Vec<_>>().join("\n")
        }
    };
    if *repeat > 0 && !oracle::can_replay(ads) {
        return Err(needs_program(&scenario.name, "replay"));
    }
    let again = recurrences((table, scenario), &stage, (ads, &log), *repeat);
    let is_mixed = mixed_text(doubted.is_some());
    let again_text = again.iter().map(|again| format!("\n  {}{is_mixed}", again.in_words()));
    let told = told + &again_text.collect::<String>();
    let told = told.trim_start_matches('\n').to_owned();
    let crashes: Vec<_> = log.incidents.iter().map(|crash| {
        serde_json::json!({ "at_s": crash.time_s, "obstacle": crash.obstacle, "other": crash.other })
    }).collect();
    if let Some(record) = record {
        let Some(conversation) = &log.conversation else {
            return Err(Failure::usage(format!(
                "`--record`: `{}` is a driving system of avastra, which is told nothing by messages",
                ads.name()
            )));
        };
        write_named(record, &conversation.evidence(&scenario.name))?;
    }
    let is_same = if other.is_none() { stage.is_as_recorded(&log) } else { None };
    let banner = changed.map(|changed| changed.banner(is_same));
    let breach = |found: &Breach| {
        let RequirementDef { name, margin, .. } = &table.space().requirements[found.requirement];
        serde_json::json!({
            "requirement": name, "obstacle": found.obstacle, "at_s": found.time_s, "until_s": found.until_s,
            "margin": found.margin, "unit": margin.map(|dimension| dimension.si_unit()),
        })
    };
    let result = serde_json::json!({
        "file": path, "changed": banner, "scenario": scenario.name, "ads": other.as_deref().unwrap_or(ads.name()),
        "claims": claims, "end": log.end.name(), "collisions": log.collisions.len(), "counted": counted, "judgements": judgements,
        "reproducible": doubted.is_none(), "failure": log.failure.as_ref().map(|failure| failure.in_words()),
        "held": log.held.iter().map(|held| serde_json::json!({ "from_s": held.from_s, "by": held.text() })).collect::<Vec<_>>(),
        "breaches": log.breaches.iter().map(breach).collect::<Vec<_>>(), "crashes": crashes, "severities": severities, "priorities": priorities, "criticality": criticality, "pet_s": pet_s,
        "recurrence": again,
    });
    let has_ads_failed = other.is_some() && log.failure.is_some();
    let (path, name) = (path.to_owned(), scenario.name.clone());
    Ok(Played { path, name, claims, banner, told, has_ads_failed, result })
}

/// Whether a finding of a play recurs.
#[derive(serde::Serialize)]
struct Again {
    /// Number of the road user that is hit.
    #[serde(skip_serializing_if = "Option::is_none")]
    obstacle: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    requirement: Option<String>,
    #[serde(flatten)]
    recurrence: Recurrence,
}

impl Again {
    fn in_words(&self) -> String {
        let what = match (&self.requirement, self.obstacle) {
            (Some(requirement), _) => format!("`{requirement}`"),
            (None, obstacle) => format!("the collision with npc#{}", obstacle.unwrap_or_default()),
        };
        format!("{what} {}", self.recurrence.in_words())
    }
}

/// Plays a scenario up to `repeat` times more, for each counted collision and each requirement that is breached in a log of it.
/// Nothing if the driving system cannot be asked.
fn recurrences(
    (table, scenario): (&ActionTable, &Scenario),
    stage: &Stage,
    (ads, log): (&Selected, &EpisodeLog),
    repeat: u32,
) -> Vec<Again> {
    if repeat == 0 || !oracle::can_replay(ads) {
        return Vec::new();
    }
    let setup = stage.setup(ads);
    let again = PlayedAgain::new(&setup, &Script::of_scenario(scenario), log);
    let tested = |found| again.tested(found, repeat);
    let collisions = stage.counted(ads, log).into_iter().map(|index| Again {
        obstacle: Some(log.collisions[index].contact.obstacle),
        requirement: None,
        recurrence: tested(Found::Collision(index)),
    });
    let breaches = log.first_breaches().filter_map(|breach| {
        Some(Again {
            obstacle: None,
            requirement: Some(table.space().requirements[breach.requirement].name.to_string()),
            recurrence: tested(Found::Breach(log.first_breach(breach.requirement)?)),
        })
    });
    collisions.chain(breaches).collect()
}

/// The requirements that another driving system breaches, and the claimed breaches that it avoids.
fn breaches_text(space: &Space, scenario: &Scenario, log: &EpisodeLog) -> String {
    let name = |breach: &Breach| space.requirements[breach.requirement].name.as_str();
    let breached =
        log.first_breaches().map(|breach| format!("; breaches {} at {:.2} s", name(breach), breach.time_s));
    let is_kept = |requirement: &&str| log.breach_of(space, requirement).is_none();
    let kept = scenario.breached().filter(is_kept).map(|requirement| format!("; keeps {requirement}"));
    breached.chain(kept).collect()
}

/// How hard a collision was, in a line.
fn severity_text(
    space: &Space,
    log: &EpisodeLog,
    collision: &Collision,
    severity: &oracle::Severity,
) -> String {
    let held = log.held_at(collision.contact.time_s);
    let held = held.map_or_else(String::new, |held| format!("; its speed was limited by: {}", held.text()));
    format!(
        "  {} npc#{} ({}) hit at {:.2} s by the ego vehicle's {}: closing at {:.1} m/s, delta-v {:.1} m/s, the other's {:.1} m/s; {}{held}",
        space.body_name(collision.body),
        collision.contact.obstacle,
        severity.approach,
        collision.contact.time_s,
        severity.side,
        severity.closing_speed_mps,
        severity.delta_v_mps,
        severity.obstacle_delta_v_mps,
        collision.contact.ruling.describe()
    )
}

fn report(output: &Output, path: &Path, name: &str, verdicts: &[oracle::ClaimResult]) {
    let wrong: Vec<&oracle::ClaimResult> = verdicts.iter().filter(|verdict| verdict.is_refuted()).collect();
    let untried: Vec<&oracle::ClaimResult> =
        verdicts.iter().filter(|verdict| verdict.confirmed.is_none()).collect();
    if verdicts.is_empty() {
        output.say(&format!("{}: {} makes no claim", path.shown(), name));
        return;
    }
    if wrong.is_empty() {
        let claims = plural(verdicts.len() - untried.len(), "claim");
        output.tell(&format!("{}: {} holds, {claims} confirmed", path.shown(), name));
    } else {
        output.say(&format!("{}: {} is refuted", path.shown(), name));
    }
    for verdict in wrong {
        output.say(&format!("  claimed {}\n  found   {}", verdict.claim, verdict.found));
    }
    for verdict in untried {
        output.tell(&format!("  {}: {}", verdict.claim, verdict.found));
    }
}
