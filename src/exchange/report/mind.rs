//! The driving system while a scenario is played: its pedals, and what it perceives, predicts and plans.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Value, json};

use avastra_base::geometry::{Pose, Vec2};
use avastra_drivers::{Ads, GHOST_ID_MIN, PerceivedObject, Status};
use avastra_lang::model::vocabulary::Word;
use avastra_search::mdp::ProcKind;
use avastra_world::sim::{Contact, FRAME_TICKS, World};

use super::columns::Columns;
use super::recording::{
    ACCELERATION_MPS2, PERCENT, PROBABILITY, SKETCH_M, SPEED_MPS, STEERING_RAD, THOUGHT_TICKS, places,
    rounded,
};

/// Every fifth point of a plan is kept (0.5 s apart), and every second one of a prediction (1 s apart), up to this many.
const PLAN_STRIDE: usize = 5;
const PREDICTION_STRIDE: usize = 2;
const PREDICTION_POINTS: usize = 5;

/// Watches the driving system, and how near it is to a collision.
#[derive(Default)]
pub struct Mind {
    commands: Vec<Command>,
    /// By the number of the track and the look at which it begins.
    tracks: BTreeMap<(u32, usize), Track>,
    open_tracks: BTreeMap<u32, usize>,
    looks: usize,
    plans: Vec<Vec<Vec2>>,
    hit: BTreeSet<u32>,
    /// The collision probability of the last frame.
    probability: f64,
}

/// At a tick.
struct Command {
    acceleration_mps2: f64,
    steer_rad: f64,
    throttle_pct: f64,
    brake_pct: f64,
    probability: f64,
}

/// An object as it is followed, in every look since it was found.
struct Track {
    object: PerceivedObject,
    poses: Vec<Pose>,
    speeds_mps: Vec<f64>,
    /// In each second look, relative to the object.
    predicted: Vec<Vec<Vec2>>,
}

impl Mind {
    /// To be called as a [`Watch`](avastra_campaign::episode::Watch) is.
    pub fn note(&mut self, world: &World, ads: &dyn Ads, contacts: &[Contact]) {
        self.hit.extend(contacts.iter().map(|contact| contact.obstacle));
        let danger = ProcKind::default().danger(world, &|id| self.hit.contains(&id));
        self.probability = danger.map_or(self.probability, |now| now.probability);
        let status = ads.status();
        let motion = world.ego();
        self.commands.push(Command {
            acceleration_mps2: motion.acceleration_mps2,
            steer_rad: motion.steer_rad,
            throttle_pct: status.control.throttle_pct,
            brake_pct: status.control.brake_pct,
            probability: if contacts.is_empty() { self.probability } else { 1.0 },
        });
        if world.ticks().is_multiple_of(FRAME_TICKS) {
            self.look(world.ticks(), status);
            self.looks += 1;
        }
    }

    fn look(&mut self, tick: u64, status: &Status) {
        let is_thought = tick.is_multiple_of(THOUGHT_TICKS);
        if is_thought {
            self.plans.push(status.planned.iter().step_by(PLAN_STRIDE).copied().collect());
        }
        let present: BTreeSet<u32> = status.perceived.iter().map(|object| object.track).collect();
        self.open_tracks.retain(|track, _| present.contains(track));
        let mut told = BTreeSet::new();
        for object in status.perceived.iter().filter(|object| told.insert(object.track)) {
            let begun = *self.open_tracks.entry(object.track).or_insert(self.looks);
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

    /// Columns of what is commanded at each tick, of what it leads to and of the collision probability of the last frame.
    pub fn commands(&self, columns: &mut Columns) -> Value {
        let mut add = |step: f64, of: fn(&Command) -> f64| columns.add(step, self.commands.iter().map(of));
        json!({
            "acceleration_mps2": add(ACCELERATION_MPS2, |command| command.acceleration_mps2),
            "steer_rad": add(STEERING_RAD, |command| command.steer_rad),
            "throttle_pct": add(PERCENT, |command| command.throttle_pct),
            "brake_pct": add(PERCENT, |command| command.brake_pct),
            "proc": add(PROBABILITY, |command| command.probability),
        })
    }

    /// The objects that it believed to be there.
    pub fn tracks(&self, columns: &mut Columns) -> Vec<Value> {
        let mut told = |((number, from), track): (&(u32, usize), &Track)| {
            let object = &track.object;
            json!({
                "track": if *number >= GHOST_ID_MIN { None } else { Some(*number) }, "of": object.id, "from_look": from,
                "body": object.body.name(), "length_m": rounded(object.length_m), "width_m": rounded(object.width_m),
                "places": places(columns, &track.poses), "speed_mps": columns.add(SPEED_MPS, track.speeds_mps.iter().copied()),
                "counts": columns.add(1.0, track.predicted.iter().map(|points| points.len() as f64)),
                "predicted_m": columns.add_points(SKETCH_M, track.predicted.iter().flatten().copied()),
            })
        };
        self.tracks.iter().map(&mut told).collect()
    }

    /// Where it wanted to go.
    pub fn plans(&self, columns: &mut Columns) -> Value {
        let counts = columns.add(1.0, self.plans.iter().map(|points| points.len() as f64));
        let [x, y] = columns.add_points(SKETCH_M, self.plans.iter().flatten().copied());
        json!({ "counts": counts, "x_m": x, "y_m": y })
    }
}
