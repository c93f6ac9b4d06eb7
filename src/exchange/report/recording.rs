//! A scenario played again and kept tick by tick, for the page.
//!
//! The truth ([`Recorder`]) and the commands of the driving system (`mind`) are kept at every tick. Its perception is
//! kept every 0.1 s, its plans and predictions every 0.2 s, because it thinks no faster. All are kept in columns
//! (`columns`) with the steps below.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Value, json};

use avastra_base::geometry::{Pose, wrap_angle};
use avastra_campaign::emit;
use avastra_campaign::episode;
use avastra_campaign::episode::{
    Actor, Breach, End, EpisodeLog, Held, MarginSeries, Moment, Outcome, Phase, Recorder, Sample, Script, Sky,
};
use avastra_campaign::oracle;
use avastra_campaign::oracle::{ClaimResult, Recurrence, ReferenceDrive, Regression};
use avastra_campaign::run;
use avastra_campaign::run::{Gauges, RunError, Stage, refusal_in_words};
use avastra_drivers::Selected;
use avastra_lang::model::vocabulary::{ShownLights, Word};
use avastra_lang::model::{Claim, Figure, Obstacle, RequirementDef, Scenario};
use avastra_world::action::{ActionTable, Offer};
use avastra_world::sim::{DT_S, FRAME_TICKS, SignalColour};

use super::columns::Columns;
use super::ground::ground;
use super::mind::Mind;
use super::words;

/// Two crashes nearer than this in time are one, as the page tells times, s.
const SAME_S: f64 = 0.005;

/// Steps of the columns; half a step is how far a number may be off.
const PLACE_M: f64 = 0.01;
/// Step of margins, SI.
const MARGIN_STEP: f64 = 0.01;
const HEADING_RAD: f64 = 0.001;
pub(super) const SPEED_MPS: f64 = 0.01;
pub(super) const ACCELERATION_MPS2: f64 = 0.02;
pub(super) const STEERING_RAD: f64 = 0.002;
pub(super) const PERCENT: f64 = 1.0;
pub(super) const PROBABILITY: f64 = 0.001;
pub(super) const SKETCH_M: f64 = 0.1;

/// Ticks between two moments at which plans and predictions are kept.
pub(super) const THOUGHT_TICKS: u64 = 2 * FRAME_TICKS;

/// The accuracy of the numbers, which the page must state.
pub fn quantisation() -> Value {
    json!({
        "place_m": PLACE_M / 2.0, "heading_rad": HEADING_RAD / 2.0, "speed_mps": SPEED_MPS / 2.0,
        "acceleration_mps2": ACCELERATION_MPS2 / 2.0, "probability": PROBABILITY / 2.0, "sketch_m": SKETCH_M / 2.0,
        "tick_s": DT_S, "perceived_s": DT_S * FRAME_TICKS as f64, "thought_s": DT_S * THOUGHT_TICKS as f64,
    })
}

/// A scenario that was played.
pub struct Recording {
    log: EpisodeLog,
    /// Index of the collision that it is about: the first that counts, or the first.
    main: Option<usize>,
    /// Whether that collision counts.
    main_counts: bool,
    /// Whether the replay is the recorded episode, to the bit; `None` if the file does not say.
    pub is_same: Option<bool>,
    /// Claims of its file that the replay refutes.
    pub refuted: Vec<ClaimResult>,
    /// Facts for the list of scenarios.
    pub summary: Value,
    /// Everything, packed.
    pub packed: String,
    /// The shape of its road, packed.
    pub ground: String,
}

/// Plays a scenario with the driving system that it was recorded with, and keeps everything. `source` is the text of its
/// file. Causes, recurrence and minimality, which only further plays could show, are not checked.
///
/// # Errors
/// If it cannot be played any more, as [`Stage::new`] tells.
pub fn record(
    table: &ActionTable,
    scenario: &Scenario,
    ads: &Selected,
    source: &str,
) -> Result<Recording, RunError> {
    let asked = |claim: &Claim| {
        !matches!(claim, Claim::Cause { .. } | Claim::Recurrence { .. } | Claim::Minimal { .. })
    };
    played(&Stage::new(table, scenario)?, (table, scenario), ads, source, asked)
}

/// Another driving system in the same scenario, and what becomes of its crash, in a word of the page's.
///
/// # Errors
/// As [`record`].
pub fn record_another(
    (table, scenario): (&ActionTable, &Scenario),
    (first, ads): (&Recording, &Selected),
    other: &Selected,
    source: &str,
) -> Result<(Recording, Value), RunError> {
    let stage = Stage::new(table, scenario)?;
    // The claims of the file are about the recorded driving system.
    let recording = played(&stage, (table, scenario), other, source, |_| false)?;
    let change = match (first.main, recording.main, recording.log.end) {
        (Some(index), _, _) => {
            let at_s = first.log.collisions[index].contact.time_s;
            match oracle::regression(&stage.setup(ads), &first.log, index, other) {
                Regression::NotCounted { .. } if first.main_counts => json!({ "kind": "not_counted" }),
                Regression::StillFails { time_s } | Regression::NotCounted { time_s } => {
                    match (time_s - at_s).abs() < SAME_S {
                        true => json!({ "kind": "same" }),
                        false => json!({ "kind": "other_time", "later_s": time_s - at_s }),
                    }
                }
                Regression::Fixed { .. } => json!({ "kind": "gone" }),
                Regression::OtherCrash => json!({ "kind": "other_crash" }),
                Regression::NeverMet => {
                    json!({ "kind": "never_met", "why": refused_there(&first.log, index, &recording.log) })
                }
                Regression::AdsFailed(_) | Regression::FailsAgain(_) => json!({ "kind": "failed" }),
            }
        }
        (None, Some(_), _) => json!({ "kind": "new" }),
        (None, None, End::Failed(_)) => json!({ "kind": "failed" }),
        (None, None, _) => json!({ "kind": "none" }),
    };
    Ok((recording, change))
}

/// Why the obstacle of a collision did not appear in another drive: mostly, a rule that the scenario's author wrote
/// refuses the spawn at the other speed. `None` if that drive was over before.
fn refused_there(log: &EpisodeLog, index: usize, other: &EpisodeLog) -> Option<String> {
    let obstacle = log.collisions[index].contact.obstacle;
    let appears =
        |outcome: &Outcome| matches!(outcome, Outcome::Done { spawned, .. } if spawned.contains(&obstacle));
    let step = log.steps.iter().position(|step| appears(&step.outcome))?;
    match &other.steps.get(step)?.outcome {
        Outcome::Refused { rule: Some(rule), reason, .. } => {
            Some(format!("rule `{rule}` refuses it there: {reason}"))
        }
        Outcome::Refused { rule: None, reason, .. } => Some(format!("it is refused there: {reason}")),
        Outcome::Done { .. } | Outcome::Passed => None,
    }
}

fn played(
    stage: &Stage<'_>,
    (table, scenario): (&ActionTable, &Scenario),
    ads: &Selected,
    source: &str,
    asked: impl Fn(&Claim) -> bool,
) -> Result<Recording, RunError> {
    let setup = stage.setup(ads);
    let script = Script::of_scenario(scenario);
    let mut recorder = Recorder::default();
    let mut mind = Mind::default();
    let mut gauges = Gauges::default();
    let mut offers = Vec::new();
    let mut choose = |moment: &Moment<'_>| {
        if moment.step < script.steps.len() {
            offers.push(offered(&table.offers(moment.situation)));
        }
        script.choose(moment)
    };
    let log = episode::run_with_margins(&setup, &mut choose, &mut |world, ads, contacts| {
        recorder.note(world, ads, contacts);
        mind.note(world, ads, contacts);
        gauges.note(world, contacts);
    });
    let judged = oracle::judge_with_drives(&setup, &script, &log);
    let judgements: Vec<_> = judged.iter().map(|(judgement, _)| judgement.clone()).collect();
    let counted: BTreeSet<usize> = oracle::counted(table.space(), &log, &judgements).into_iter().collect();
    let mut columns = Columns::default();
    let collisions: Vec<Value> = judged
        .iter()
        .enumerate()
        .map(|(index, (judgement, drives))| {
            let ways: Vec<Value> = drives.iter().map(|drive| way(&mut columns, drive)).collect();
            let told = (judgement, counted.contains(&index));
            collision(table, scenario, (&log, index), told, ways)
        })
        .collect();
    let refuted = stage.refuted(ads, &log, &judgements, asked);
    let is_same = stage.is_as_recorded(&log);
    let summary = json!({
        "name": scenario.name, "road": log.road, "ads": ads.name(), "duration_s": log.duration_s, "end": log.end.name(),
        "steps": log.steps.len(), "actions": log.steps.iter().filter(|step| matches!(step.outcome, Outcome::Done { .. })).count(),
        "collisions": collisions.iter().map(without_ways).collect::<Vec<_>>(),
        "refuted": refuted, "same": is_same, "breaches": breaches(table, scenario, &log),
        "crashes": crashes(table, &log), "failure": log.failure.as_ref().map(avastra_drivers::external::Failure::in_words),
    });
    let steps: Vec<Value> =
        log.steps.iter().enumerate().map(|(index, _)| step(table, &log, index, offers.get(index))).collect();
    let header = json!({
        "summary": summary, "origin": origin(table, scenario, ads), "source": source, "rows": table.rows().iter().map(|row| &row.label).collect::<Vec<_>>(),
        "step_s": table.space().episode.step_s, "collisions": collisions, "steps": steps,
        "held": log.held.iter().map(|held| json!([held.from_s, held.text(), held.restraint()])).collect::<Vec<_>>(),
        "ego": ego(&recorder.ego, &mind, &mut columns), "obstacles": obstacles(table, &log, &recorder, &mut columns),
        "tracks": mind.tracks(&mut columns), "plans": mind.plans(&mut columns),
        "margins": margins(table, &log, &log.series, &mut columns),
        "signals": signals(&recorder), "skies": recorder.skies.iter().map(sky).collect::<Vec<_>>(),
    });
    let main = counted.first().copied().or((!log.collisions.is_empty()).then_some(0));
    let packed = columns.pack(&header);
    let main_counts = !counted.is_empty();
    let ground = ground(&setup.scene);
    Ok(Recording { log, main, main_counts, is_same, refuted, summary, packed, ground })
}

/// A longer profile is not printed.
const PROFILE_BYTES_MAX: usize = 60;

/// Where a scenario comes from: name and text of each.
fn origin(table: &ActionTable, scenario: &Scenario, ads: &Selected) -> Vec<(&'static str, String)> {
    let origin = &scenario.origin;
    let space = table.space().path.file_name().map(|name| name.to_string_lossy().into_owned());
    let is_its = origin.ads.as_deref() == Some(ads.name());
    let driver = match origin.profile.as_ref().filter(|_| is_its) {
        None => ads.name().to_owned(),
        Some(profile) if profile.len() <= PROFILE_BYTES_MAX => format!("{} {profile}", ads.name()),
        // The page shows the source, in which it stands.
        Some(_) => format!("{}, with its profile", ads.name()),
    };
    let known = [
        ("space", space),
        ("driving system", Some(driver)),
        ("seed", origin.seed.map(|seed| seed.to_string())),
        ("episode", origin.episode.map(|episode| episode.to_string())),
        ("chosen by", origin.policy.clone()),
    ];
    known.into_iter().filter_map(|(name, text)| Some((name, text?))).collect()
}

/// The rows of a step: those that are legal, and the others by what refuses them.
fn offered(offers: &[Offer]) -> Value {
    let mut legal = Vec::new();
    let mut masked: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for (row, offer) in offers.iter().enumerate() {
        match offer {
            Ok(_) => legal.push(row),
            Err(refusal) => {
                let words = refusal_in_words(refusal.rule.as_deref(), &refusal.reason);
                masked.entry(words).or_default().push(row);
            }
        }
    }
    json!({ "legal": legal, "masked": masked.into_iter().collect::<Vec<_>>() })
}

fn step(table: &ActionTable, log: &EpisodeLog, index: usize, offers: Option<&Value>) -> Value {
    let step = &log.steps[index];
    let outcome = match &step.outcome {
        Outcome::Done { draw, spawned, delay_ticks } => json!({
            "kind": "done", "row": draw.row, "text": emit::action_text(table, draw), "made": spawned,
            "at_s": step.time_s + f64::from(*delay_ticks) * DT_S,
        }),
        Outcome::Passed => json!({ "kind": "passed" }),
        Outcome::Refused { row, rule, reason } => {
            json!({ "kind": "refused", "row": row, "rule": rule, "reason": reason })
        }
    };
    json!({ "at_s": step.time_s, "outcome": outcome, "proc": rounded(step.proc), "reward": rounded(step.reward), "offers": offers })
}

fn collision(
    table: &ActionTable,
    scenario: &Scenario,
    (log, index): (&EpisodeLog, usize),
    (judgement, counted): (&oracle::Judgement, bool),
    ways: Vec<Value>,
) -> Value {
    let found = &log.collisions[index];
    let contact = &found.contact;
    let severity = oracle::severity(found);
    let facts = oracle::facts(log, index, judgement);
    let cause = scenario.claims.iter().find_map(|claim| match claim {
        Claim::Cause { modules, obstacle }
            if obstacle.is_none_or(|named| named.number == contact.obstacle) =>
        {
            Some(modules)
        }
        _ => None,
    });
    let is_meant = |requirement: Option<&str>, obstacle: Option<Obstacle>| {
        requirement.is_none() && obstacle.is_none_or(|named| named.number == contact.obstacle)
    };
    json!({
        "at_s": contact.time_s, "obstacle": contact.obstacle, "body": table.space().body_name(found.body),
        "kind": run::kind(found.body.like.name()), "shape": found.shape.name(), "precrash": found.kind.name(),
        "precrash_number": found.kind.number(), "verb": found.verb.name(),
        "x_m": contact.point.x, "y_m": contact.point.y, "counted": counted, "unmet": oracle::unmet(table.space(), log, index, judgement), "class": judgement.class.name(),
        "onset_s": judgement.onset_s, "avoided_by": judgement.avoided_by, "letter": judgement.r157_letter,
        "evasion": judgement.evasion, "priority": contact.ruling.priority.name(), "ruling": contact.ruling.describe(), "side": severity.side, "approach": severity.approach,
        "ego_mps": contact.ego_speed_mps, "closing_mps": severity.closing_speed_mps, "delta_v_mps": severity.delta_v_mps,
        "other_delta_v_mps": severity.obstacle_delta_v_mps, "harm": severity.harm.name(), "harm_share": rounded(severity.harm_share),
        "recurrence": recurrence((scenario, log), is_meant), "moments": moments(scenario, contact.time_s, is_meant), "sudden": facts.sudden, "struck": facts.struck, "cause": cause,
        "held": log.held_at(contact.time_s).map(Held::text), "ways": ways,
    })
}

/// Crashes of road users into each other.
fn crashes(table: &ActionTable, log: &EpisodeLog) -> Vec<Value> {
    let told = log.incidents.iter().zip(log.incidents_in_words(table.space()));
    told.map(|(incident, text)| {
        json!({
            "at_s": incident.time_s, "x_m": incident.point.x, "y_m": incident.point.y,
            "obstacle": incident.obstacle, "other": incident.other, "text": text,
        })
    })
    .collect()
}

/// The requirements that the ego vehicle breached, and which careful drivers would have kept each, as the file claims.
fn breaches(table: &ActionTable, scenario: &Scenario, log: &EpisodeLog) -> Vec<Value> {
    let told = |breach: &Breach| {
        let RequirementDef { name, docs, formula, margin, .. } =
            &table.space().requirements[breach.requirement];
        let kept_by = scenario.claims.iter().find_map(|claim| match claim {
            Claim::Kept { requirement, by } if requirement == name => Some(by),
            _ => None,
        });
        let unit = margin.map(|dimension| dimension.si_unit());
        json!({
            "requirement": name, "obstacle": breach.obstacle, "docs": docs.join(" "), "formula": formula, "at_s": breach.time_s, "until_s": breach.until_s,
            "margin": breach.margin.map(rounded), "unit": unit, "kept_by": kept_by,
            "recurrence": recurrence((scenario, log), |requirement, _| requirement == Some(name)),
            "moments": moments(scenario, breach.time_s, |requirement, _| requirement == Some(name)),
        })
    };
    log.breaches.iter().map(told).collect()
}

/// The most requirements whose margins are drawn, if none is breached.
const DRAWN_MAX: usize = 6;

/// The margins of what was breached; if nothing was, of what was asked: each in stretches of ticks in which it was asked.
fn margins(table: &ActionTable, log: &EpisodeLog, all: &[MarginSeries], columns: &mut Columns) -> Vec<Value> {
    let is_breached = |one: &&MarginSeries| log.breaches.iter().any(|of| of.requirement == one.requirement);
    let asked = all.iter().filter(|one| one.margins.iter().any(Option::is_some));
    let breached: Vec<&MarginSeries> = asked.clone().filter(is_breached).collect();
    let drawn = if breached.is_empty() { asked.take(DRAWN_MAX).collect() } else { breached };
    let told = |one: &MarginSeries| {
        let RequirementDef { name, margin, .. } = &table.space().requirements[one.requirement];
        let mut from = 0;
        let mut parts = Vec::new();
        for part in one.margins.chunk_by(|one, next| one.is_some() == next.is_some()) {
            if part[0].is_some() {
                // The first tick is the one after the start.
                parts.push(json!([from + 1, columns.add(MARGIN_STEP, part.iter().copied().flatten())]));
            }
            from += part.len();
        }
        json!({ "requirement": name, "unit": margin.map(|dimension| dimension.si_unit()), "parts": parts })
    };
    drawn.into_iter().map(told).collect()
}

/// How often a finding recurs, as the file claims of the one that is meant.
fn recurrence(
    (scenario, log): (&Scenario, &EpisodeLog),
    is_meant: impl Fn(Option<&str>, Option<Obstacle>) -> bool,
) -> Option<Value> {
    let (_, found) = recurrences(scenario, is_meant).find(|(from, _)| from.is_none())?;
    let program = log.conversation.as_deref().map(|conversation| &conversation.attached);
    let mixed = program.filter(|attached| !attached.is_deterministic()).map(|_| oracle::MIXED);
    Some(json!({
        "recurred": found.recurred, "replays": found.replays, "text": found.to_string(), "recurs": found.recurs(),
        "word": found.word(mixed.is_some()), "mixed": mixed,
    }))
}

/// How often a finding recurs from moments before it on, as the file claims, by rising time.
fn moments(
    scenario: &Scenario,
    found_s: f64,
    is_meant: impl Fn(Option<&str>, Option<Obstacle>) -> bool,
) -> Vec<Value> {
    let timed = |(from, again): (Option<Figure>, Recurrence)| Some((from?.si(), again));
    let all = recurrences(scenario, is_meant).filter_map(timed);
    let mut all: Vec<(f64, Recurrence)> = all.filter(|(from_s, _)| *from_s < found_s).collect();
    all.sort_by(|(one_s, _), (other_s, _)| one_s.total_cmp(other_s));
    let told = |(from_s, again): (f64, Recurrence)| {
        let Recurrence { recurred, replays } = again;
        json!({ "at_s": from_s, "recurred": recurred, "replays": replays, "is_likely": oracle::is_likely(again) })
    };
    all.into_iter().map(told).collect()
}

/// All that the file claims of the recurrence of the finding that is meant: from the start, or from a moment on.
fn recurrences<'a>(
    scenario: &'a Scenario,
    is_meant: impl Fn(Option<&str>, Option<Obstacle>) -> bool + 'a,
) -> impl Iterator<Item = (Option<Figure>, Recurrence)> + 'a {
    scenario.claims.iter().filter_map(move |claim| match claim {
        Claim::Recurrence { requirement, obstacle, from, recurred, replays }
            if is_meant(requirement.as_deref(), *obstacle) =>
        {
            Some((*from, Recurrence { recurred: *recurred, replays: *replays }))
        }
        _ => None,
    })
}

fn without_ways(collision: &Value) -> Value {
    let mut facts = collision.clone();
    if let Some(facts) = facts.as_object_mut() {
        facts.remove("ways");
    }
    facts
}

fn way(columns: &mut Columns, drive: &ReferenceDrive) -> Value {
    let poses: Vec<Pose> = drive.places.iter().map(|place| place.pose).collect();
    json!({
        "name": drive.name, "avoids": drive.avoids, "from_s": drive.places.first().map(|place| place.time_s),
        "every_s": DT_S * FRAME_TICKS as f64, "places": places(columns, &poses),
        "speed_mps": columns.add(SPEED_MPS, drive.places.iter().map(|place| place.speed_mps)),
    })
}

/// The ego vehicle, from outside and from inside.
fn ego(actor: &Actor, mind: &Mind, columns: &mut Columns) -> Value {
    let mut told = mind.commands(columns);
    told["places"] = json!(places(columns, &poses(actor)));
    told["speed_mps"] = json!(columns.add(SPEED_MPS, actor.samples.iter().map(Sample::speed_mps)));
    told["brake_lights"] = json!(actor.brake_lights);
    told["length_m"] = json!(actor.shape.length_m);
    told["width_m"] = json!(actor.shape.width_m);
    told
}

fn obstacles(
    table: &ActionTable,
    log: &EpisodeLog,
    recorder: &Recorder,
    columns: &mut Columns,
) -> Vec<Value> {
    let own = log.own_bodies();
    let mut told = |actor: &Actor| {
        let first = actor.first.as_ref()?;
        let body = own.get(&actor.id).map_or(actor.body.name(), |own| &table.space().bodies[*own].name);
        let mut one = json!({
            "id": actor.id, "body": body, "like": actor.body.name(), "colour": first.colour.name(), "verb": first.verb.name(),
            "ambient": first.is_ambient(), "from_tick": actor.first_tick(), "length_m": actor.shape.length_m,
            "width_m": actor.shape.width_m, "places": places(columns, &poses(actor)),
            "speed_mps": columns.add(SPEED_MPS, actor.samples.iter().map(Sample::speed_mps)),
            "brake_lights": actor.brake_lights,
        });
        if !actor.lights.is_empty() {
            let named = |(tick, lights): &(u64, ShownLights)| (*tick, lights.name());
            one["lights"] = json!(actor.lights.iter().map(named).collect::<Vec<_>>());
        }
        if !actor.phases.is_empty() {
            let phase = |phase: &Phase| {
                let name = &table.space().manoeuvres[phase.manoeuvre].name;
                (phase.tick as f64 * DT_S, format!("{name}, phase {}", phase.number))
            };
            one["phases"] = json!(actor.phases.iter().map(phase).collect::<Vec<_>>());
        }
        Some(one)
    };
    recorder.others.iter().filter_map(&mut told).collect()
}

/// By number of the signal, each change: tick and colour.
fn signals(recorder: &Recorder) -> BTreeMap<usize, Vec<(u64, &'static str)>> {
    let changes = |changes: &[(u64, SignalColour)]| {
        changes.iter().map(|(tick, colour)| (*tick, colour.name())).collect()
    };
    recorder.lights.iter().map(|lights| (lights.signal, changes(&lights.changes))).collect()
}

/// The time from which the sky is so, s, and how it is.
fn sky(sky: &Sky) -> Value {
    json!([sky.time_s, words::sky(sky.time_of_day, sky.levels)])
}

fn poses(actor: &Actor) -> Vec<Pose> {
    actor.samples.iter().map(|sample| sample.pose).collect()
}

/// Columns of x and y (m) and of the heading (rad).
pub(super) fn places(columns: &mut Columns, poses: &[Pose]) -> [usize; 3] {
    let [x, y] = columns.add_points(PLACE_M, poses.iter().map(|pose| pose.position));
    [x, y, columns.add(HEADING_RAD, unwound(poses))]
}

/// Headings without jumps by a whole turn.
fn unwound(poses: &[Pose]) -> Vec<f64> {
    let mut before: Option<f64> = None;
    let next = |pose: &Pose| {
        let heading = before.map_or(pose.heading_rad, |last| last + wrap_angle(pose.heading_rad - last));
        before = Some(heading);
        heading
    };
    poses.iter().map(next).collect()
}

pub(super) fn rounded(value: f64) -> f64 {
    (value * 1000.0).round() / 1000.0
}
