//! A scenario played again and kept tick by tick, for the page.
//!
//! What is true and what the driving system commands is kept at every tick; what it perceives every 0.1 s, and what it
//! plans and predicts every 0.2 s, because it thinks no faster. All of it in columns (`columns`) with the steps below.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Value, json};

use crate::action::{ActionTable, Offer};
use crate::ads::{Ads, GHOST_ID_MIN, PerceivedObject, Selected, Status};
use crate::emit;
use crate::episode;
use crate::episode::{EpisodeLog, Held, Moment, Outcome, Script};
use crate::geometry::{Pose, Vec2, wrap_angle};
use crate::mdp::ProcKind;
use crate::model::vocabulary::{Phenomenon, Word};
use crate::model::{Claim, Scenario, digest_text};
use crate::oracle;
use crate::oracle::ReferenceDrive;
use crate::run;
use crate::run::{Gauges, RunError, Shape, Stage, refusal_in_words};
use crate::sim::{Contact, DT_S, FRAME_TICKS, Obstacle, VehicleParameters, World};

use super::columns::Columns;
use super::ground::ground;

/// Steps of the columns; half a step is how far a number may be off.
const PLACE_M: f64 = 0.01;
const HEADING_RAD: f64 = 0.001;
const SPEED_MPS: f64 = 0.01;
const ACCELERATION_MPS2: f64 = 0.02;
const STEERING_RAD: f64 = 0.002;
const PERCENT: f64 = 1.0;
const PROBABILITY: f64 = 0.001;
const SKETCH_M: f64 = 0.1;

/// Ticks between two moments at which plans and predictions are kept.
const THOUGHT_TICKS: u64 = 2 * FRAME_TICKS;
/// Of a plan every fifth point is kept (0.5 s), of a prediction every second (1 s), up to so many.
const PLAN_STRIDE: usize = 5;
const PREDICTION_STRIDE: usize = 2;
const PREDICTION_POINTS: usize = 5;

/// What the page must state of the numbers in it.
pub fn quantisation() -> Value {
    json!({
        "place_m": PLACE_M / 2.0, "heading_rad": HEADING_RAD / 2.0, "speed_mps": SPEED_MPS / 2.0,
        "acceleration_mps2": ACCELERATION_MPS2 / 2.0, "probability": PROBABILITY / 2.0, "sketch_m": SKETCH_M / 2.0,
        "tick_s": DT_S, "perceived_s": DT_S * FRAME_TICKS as f64, "thought_s": DT_S * THOUGHT_TICKS as f64,
    })
}

/// A scenario that was played.
pub struct Recording {
    /// Facts for the list of scenarios.
    pub summary: Value,
    /// Everything, packed.
    pub packed: String,
    /// The shape of its road, packed.
    pub ground: String,
}

/// Plays a scenario with a driving system and keeps everything. `source` is the text of its file.
///
/// # Errors
/// If it cannot be played any more, as [`Stage::new`] tells.
pub fn record(
    table: &ActionTable,
    scenario: &Scenario,
    ads: &Selected,
    source: &str,
) -> Result<Recording, RunError> {
    let stage = Stage::new(table, scenario)?;
    let setup = stage.setup(ads);
    let script = Script::of_scenario(scenario);
    let mut recorder = Recorder::default();
    let mut gauges = Gauges::default();
    let mut offers = Vec::new();
    let mut choose = |moment: &Moment<'_>| {
        if moment.step < script.steps.len() {
            offers.push(offered(&table.offers(moment.situation)));
        }
        script.choose(table, moment)
    };
    let log = episode::run(&setup, &mut choose, &mut |world, ads, contacts| {
        recorder.note(world, ads, contacts);
        gauges.note(world, contacts);
    });
    let judged = oracle::judge_with_drives(&setup, &script, &log, stage.avoidability());
    let judgements: Vec<_> = judged.iter().map(|(judgement, _)| judgement.clone()).collect();
    let counted: BTreeSet<usize> = oracle::counted(table.space(), &log, &judgements).into_iter().collect();
    let mut columns = Columns::default();
    let collisions: Vec<Value> = judged
        .iter()
        .enumerate()
        .map(|(index, (judgement, drives))| {
            let ways: Vec<Value> = drives.iter().map(|drive| way(&mut columns, drive)).collect();
            let shape = gauges.shapes().get(index).copied().flatten().map(Shape::name);
            let told = (judgement, counted.contains(&index), shape);
            collision(table, scenario, (&log, index), told, ways)
        })
        .collect();
    let summary = json!({
        "name": scenario.name, "road": log.road, "ads": ads.name(), "duration_s": log.duration_s, "end": log.end.name(),
        "steps": log.steps.len(), "actions": log.steps.iter().filter(|step| matches!(step.outcome, Outcome::Done { .. })).count(),
        "collisions": collisions.iter().map(without_ways).collect::<Vec<_>>(),
        "same": is_same(scenario, &log),
    });
    let steps: Vec<Value> =
        log.steps.iter().enumerate().map(|(index, _)| step(table, &log, index, offers.get(index))).collect();
    let header = json!({
        "summary": summary, "docs": scenario.docs, "source": source, "rows": table.rows().iter().map(|row| &row.label).collect::<Vec<_>>(),
        "step_s": table.space().episode.step_s, "collisions": collisions, "steps": steps,
        "held": log.held.iter().map(|held| json!([held.from_s, held.text()])).collect::<Vec<_>>(),
        "ego": recorder.ego(&mut columns), "obstacles": recorder.obstacles(table, &log, &mut columns),
        "tracks": recorder.tracks(&mut columns), "plans": recorder.plans(&mut columns),
        "signals": recorder.signals, "skies": recorder.skies, "drawn": [VehicleParameters::MKZ.length_m, VehicleParameters::MKZ.width_m],
    });
    Ok(Recording { summary, packed: columns.pack(&header), ground: ground(&setup.scene) })
}

/// Whether the replay is the recorded episode, to the bit; `None` if the scenario does not say.
fn is_same(scenario: &Scenario, log: &EpisodeLog) -> Option<bool> {
    scenario.claims.iter().find_map(|claim| match claim {
        Claim::Trace(digest) => Some(*digest == digest_text(&log.trace())),
        _ => None,
    })
}

/// The rows of a step: those that are legal, and the others by what refuses them.
fn offered(offers: &[Offer]) -> Value {
    let mut legal = Vec::new();
    let mut masked: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for (row, offer) in offers.iter().enumerate() {
        match offer {
            Offer::Legal(_) => legal.push(row),
            Offer::Refused(refusal) => {
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
    (judgement, counted, shape): (&oracle::Judgement, bool, Option<&str>),
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
    json!({
        "at_s": contact.time_s, "obstacle": contact.obstacle, "body": table.space().body_name(found.body),
        "kind": run::kind(found.body.like.name()), "shape": shape, "verb": found.verb.name(),
        "x": contact.point.x, "y": contact.point.y, "counted": counted, "class": judgement.class.name(),
        "onset_s": judgement.onset_s, "avoided_by": judgement.avoided_by, "letter": judgement.r157_letter,
        "evasion": judgement.evasion, "priority": contact.priority.name(), "side": severity.side, "approach": severity.approach,
        "ego_mps": contact.ego_speed_mps, "closing_mps": severity.closing_speed_mps, "delta_v_mps": severity.delta_v_mps,
        "other_delta_v_mps": severity.obstacle_delta_v_mps, "sudden": facts.sudden, "struck": facts.struck, "cause": cause,
        "held": log.held_at(contact.time_s).map(Held::text), "ways": ways,
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
        "speed": columns.add(SPEED_MPS, drive.places.iter().map(|place| place.speed_mps)),
    })
}

/// Columns of x, y and heading.
fn places(columns: &mut Columns, poses: &[Pose]) -> [usize; 3] {
    let x = columns.add(PLACE_M, poses.iter().map(|pose| pose.position.x));
    let y = columns.add(PLACE_M, poses.iter().map(|pose| pose.position.y));
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

fn rounded(value: f64) -> f64 {
    (value * 1000.0).round() / 1000.0
}

/// What is seen of an episode.
#[derive(Default)]
struct Recorder {
    ego: Vec<EgoMoment>,
    obstacles: BTreeMap<u32, Seen>,
    /// By the number of the track and the sample at which it begins.
    tracks: BTreeMap<(u32, usize), Track>,
    open_tracks: BTreeMap<u32, usize>,
    samples: usize,
    plans: Vec<Vec<Vec2>>,
    hit: BTreeSet<u32>,
    /// Number of a signal, then each change: tick and colour.
    signals: BTreeMap<usize, Vec<(u64, &'static str)>>,
    /// Tick from which the sky is so.
    skies: Vec<(u64, String)>,
}

struct EgoMoment {
    pose: Pose,
    speed_mps: f64,
    acceleration_mps2: f64,
    steer_rad: f64,
    throttle_pct: f64,
    brake_pct: f64,
    probability: f64,
}

/// An obstacle in every tick since it appeared.
struct Seen {
    first: Obstacle,
    from_tick: u64,
    poses: Vec<Pose>,
    speeds_mps: Vec<f64>,
}

/// An object as it is followed, in every sample since it was found.
struct Track {
    object: PerceivedObject,
    poses: Vec<Pose>,
    speeds_mps: Vec<f64>,
    /// In each second sample, relative to the object.
    predicted: Vec<Vec<Vec2>>,
}

impl Recorder {
    fn note(&mut self, world: &World, ads: &dyn Ads, contacts: &[Contact]) {
        self.hit.extend(contacts.iter().map(|contact| contact.obstacle));
        let danger = ProcKind::default().danger(world, &|id| self.hit.contains(&id));
        let status = ads.status();
        let motion = world.ego();
        self.ego.push(EgoMoment {
            pose: world.ego_outline().pose,
            speed_mps: motion.speed_mps,
            acceleration_mps2: motion.acceleration_mps2,
            steer_rad: motion.steer_rad,
            throttle_pct: status.control.throttle_pct,
            brake_pct: status.control.brake_pct,
            probability: if contacts.is_empty() { danger.probability } else { 1.0 },
        });
        for obstacle in world.obstacles() {
            self.obstacle(world.ticks(), obstacle);
        }
        self.lights(world);
        let sky = sky(world);
        if self.skies.last().is_none_or(|(_, before)| *before != sky) {
            self.skies.push((world.ticks(), sky));
        }
        if world.ticks().is_multiple_of(FRAME_TICKS) {
            self.thoughts(world.ticks(), status);
            self.samples += 1;
        }
    }

    fn obstacle(&mut self, tick: u64, obstacle: &Obstacle) {
        let seen = self.obstacles.entry(obstacle.id).or_insert_with(|| Seen {
            first: *obstacle,
            from_tick: tick,
            poses: Vec::new(),
            speeds_mps: Vec::new(),
        });
        seen.poses.push(obstacle.outline.pose);
        seen.speeds_mps.push(obstacle.velocity_mps.dot(&obstacle.forward));
    }

    fn lights(&mut self, world: &World) {
        let map = &world.scene().map;
        let drawn: BTreeSet<usize> =
            map.lanes.iter().flat_map(|lane| lane.stop_lines.iter().map(|line| line.signal)).collect();
        for signal in drawn {
            let colour = world.signal(signal).name();
            let changes = self.signals.entry(signal).or_default();
            if changes.last().is_none_or(|(_, before)| *before != colour) {
                changes.push((world.ticks(), colour));
            }
        }
    }

    fn thoughts(&mut self, tick: u64, status: &Status) {
        let is_thought = tick.is_multiple_of(THOUGHT_TICKS);
        if is_thought {
            self.plans.push(status.planned.iter().step_by(PLAN_STRIDE).copied().collect());
        }
        let present: BTreeSet<u32> = status.perceived.iter().map(|object| object.track).collect();
        self.open_tracks.retain(|track, _| present.contains(track));
        let mut told = BTreeSet::new();
        for object in status.perceived.iter().filter(|object| told.insert(object.track)) {
            let begun = *self.open_tracks.entry(object.track).or_insert(self.samples);
            let track = self.tracks.entry((object.track, begun)).or_insert_with(|| Track {
                object: object.clone(),
                poses: Vec::new(),
                speeds_mps: Vec::new(),
                predicted: Vec::new(),
            });
            track.poses.push(object.pose);
            track.speeds_mps.push(object.velocity_mps.dot(&object.pose.forward()));
            if is_thought {
                let points = object.predicted.iter().skip(PREDICTION_STRIDE - 1).step_by(PREDICTION_STRIDE);
                let relative = points.take(PREDICTION_POINTS).map(|point| point - object.pose.position);
                track.predicted.push(relative.collect());
            }
        }
    }

    fn ego(&self, columns: &mut Columns) -> Value {
        let poses: Vec<Pose> = self.ego.iter().map(|moment| moment.pose).collect();
        let mut add = |step: f64, of: fn(&EgoMoment) -> f64| columns.add(step, self.ego.iter().map(of));
        let (speed, acceleration) = (
            add(SPEED_MPS, |moment| moment.speed_mps),
            add(ACCELERATION_MPS2, |moment| moment.acceleration_mps2),
        );
        let (steer, throttle) =
            (add(STEERING_RAD, |moment| moment.steer_rad), add(PERCENT, |moment| moment.throttle_pct));
        let (brake, proc) =
            (add(PERCENT, |moment| moment.brake_pct), add(PROBABILITY, |moment| moment.probability));
        json!({
            "places": places(columns, &poses), "speed": speed, "acceleration": acceleration, "steer": steer,
            "throttle": throttle, "brake": brake, "proc": proc,
        })
    }

    fn obstacles(&self, table: &ActionTable, log: &EpisodeLog, columns: &mut Columns) -> Vec<Value> {
        let own = log.own_bodies();
        let mut told = |seen: &Seen| {
            let first = &seen.first;
            let body =
                own.get(&first.id).map_or(first.body.name(), |own| table.space().bodies[*own].name.as_str());
            json!({
                "id": first.id, "body": body, "like": first.body.name(), "colour": first.colour.name(), "verb": first.verb.name(),
                "ambient": first.is_ambient(), "from": seen.from_tick, "length": 2.0 * first.outline.half_length_m,
                "width": 2.0 * first.outline.half_width_m, "places": places(columns, &seen.poses),
                "speed": columns.add(SPEED_MPS, seen.speeds_mps.iter().copied()),
            })
        };
        self.obstacles.values().map(&mut told).collect()
    }

    fn tracks(&self, columns: &mut Columns) -> Vec<Value> {
        let mut told = |((number, from), track): (&(u32, usize), &Track)| {
            let object = &track.object;
            let points = || track.predicted.iter().flatten();
            json!({
                "track": if *number >= GHOST_ID_MIN { None } else { Some(*number) }, "of": object.id, "from": from,
                "body": object.body.name(), "length": rounded(object.length_m), "width": rounded(object.width_m),
                "places": places(columns, &track.poses), "speed": columns.add(SPEED_MPS, track.speeds_mps.iter().copied()),
                "counts": columns.add(1.0, track.predicted.iter().map(|points| points.len() as f64)),
                "predicted": [
                    columns.add(SKETCH_M, points().map(|point| point.x)), columns.add(SKETCH_M, points().map(|point| point.y)),
                ],
            })
        };
        self.tracks.iter().map(&mut told).collect()
    }

    fn plans(&self, columns: &mut Columns) -> Value {
        let points = || self.plans.iter().flatten();
        json!({
            "counts": columns.add(1.0, self.plans.iter().map(|points| points.len() as f64)),
            "x": columns.add(SKETCH_M, points().map(|point| point.x)), "y": columns.add(SKETCH_M, points().map(|point| point.y)),
        })
    }
}

/// Time of day and weather, in words.
fn sky(world: &World) -> String {
    let weather = Phenomenon::ALL.iter().zip(world.sky()).filter(|(_, level)| level.intensity() > 0.0).map(
        |(phenomenon, level)| format!("{} {}", level.name().to_lowercase(), phenomenon.name().to_lowercase()),
    );
    let weather: Vec<String> = weather.collect();
    let weather = if weather.is_empty() { "clear".to_owned() } else { weather.join(", ") };
    format!("{}, {weather}", world.time_of_day().name())
}
