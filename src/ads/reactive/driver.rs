//! The driver: looks ten times a second, and commands pedals and wheel every tick.

use std::sync::Arc;

use crate::ads::driver::Ads;
use crate::ads::guide::{Guide, SpeedRules};
use crate::ads::sight::Sight;
use crate::ads::status::{Manoeuvre, Reason, Status};
use crate::ads::stops::{Signs, Stop, lights};
use crate::road::RouteLaneChange;
use crate::sim::{Control, DT_S, FRAME_S, FRAME_TICKS, Scene, Sensed, VehicleParameters, pedals_for};

use super::assistance::{Pedals, Target, is_free, line_mps2};
use super::stanley;

/// Speed on a free road and in bends: those of the other drivers here, so that all can be compared.
const RULES: SpeedRules =
    SpeedRules { cruise_mps: 11.18, lateral_acceleration_mps2_max: 2.0, slowdown_mps2: 1.5 };
/// Factor of a camera's range for pedestrians in full darkness: low beams show dark clothing at 25 to 40 m of 80.
const NIGHT_FACTOR: f64 = 0.4;
/// A lane must have been free for so long, s. Ours: longer than a new object takes to be known.
const FREE_S: f64 = 1.0;
/// Acceleration that holds the vehicle at rest, and the speed at which it rests, m/s² and m/s.
const HOLD_MPS2: f64 = -3.0;
const REST_MPS: f64 = 0.1;

/// The driving system.
#[derive(Debug, Clone)]
pub struct Reactive {
    scene: Arc<Scene>,
    guide: Arc<Guide>,
    /// Where each lane change of the route begins, m; infinite while its lane was not free.
    begins_m: Vec<f64>,
    /// For how long the lane of the next change has been free, s.
    free_s: f64,
    sight: Sight,
    signs: Signs,
    /// What it reacts to, of the last look.
    targets: Vec<Target>,
    stop: Option<Stop>,
    pedals: Pedals,
    ticks: u64,
    station_m: Option<f64>,
    steer_rad: f64,
    status: Status,
}

impl Reactive {
    pub fn new(scene: &Arc<Scene>) -> Reactive {
        let begins_m = vec![f64::INFINITY; scene.route.changes.len()];
        Reactive {
            scene: Arc::clone(scene),
            guide: Arc::new(Guide::with_changes(scene, &RULES, &begins_m)),
            begins_m,
            free_s: 0.0,
            sight: Sight::new(NIGHT_FACTOR),
            signs: Signs::default(),
            targets: Vec::new(),
            stop: None,
            pedals: Pedals::default(),
            ticks: 0,
            station_m: None,
            steer_rad: 0.0,
            status: Status::default(),
        }
    }

    fn look(&mut self, sensed: &Sensed, station_m: f64) {
        self.sight.look(sensed);
        self.change_lanes(station_m, sensed.ego.speed_mps);
        let front_m = VehicleParameters::MKZ.front_m(station_m);
        let seen = |object| Target::seen(&self.guide, object, &sensed.ego, front_m);
        self.targets.clear();
        self.targets.extend(self.sight.known().iter().filter_map(seen));
        let sign = self.signs.next_stop(&self.scene, front_m, sensed.ego.speed_mps);
        let stops = lights(&self.scene, sensed, front_m).chain(sign).chain(self.wait());
        self.stop = stops.min_by(|a, b| a.station_m.total_cmp(&b.station_m));
        self.sight.report(&mut self.status.perceived);
        self.status.localized = Some(sensed.ego.rear_axle);
    }

    /// The lane change that comes next, and its number.
    fn next_change(&self) -> Option<(usize, &RouteLaneChange)> {
        let index = self.begins_m.iter().position(|begin_m| begin_m.is_infinite())?;
        Some((index, &self.scene.route.changes[index]))
    }

    /// Whether a lane change is under way at a station.
    fn is_changing(&self, station_m: f64) -> bool {
        self.scene.route.changes.iter().zip(&self.begins_m).any(|(change, begin_m)| {
            (*begin_m..begin_m + change.length_from_m(*begin_m)).contains(&station_m)
        })
    }

    /// Begins the next lane change once it is due and its lane is free; it is then carried through.
    fn change_lanes(&mut self, station_m: f64, speed_mps: f64) {
        let due = self.next_change().filter(|(_, change)| station_m >= change.begin_m);
        self.status.manoeuvre = match due.map(|(index, change)| (index, change.lateral_m)) {
            _ if self.is_changing(station_m) => Manoeuvre::LaneChange,
            None => Manoeuvre::LaneFollow,
            Some((index, lateral_m)) => {
                let front_m = VehicleParameters::MKZ.front_m(station_m);
                let is_free = is_free(&self.guide, self.sight.known(), lateral_m, front_m, speed_mps);
                self.free_s = if is_free { self.free_s + FRAME_S } else { 0.0 };
                if self.free_s > FREE_S {
                    self.begins_m[index] = station_m;
                    self.guide = Arc::new(Guide::with_changes(&self.scene, &RULES, &self.begins_m));
                }
                Manoeuvre::AwaitGap
            }
        };
    }

    /// Where it must wait for the next lane change: a short one is still possible there.
    fn wait(&self) -> Option<Stop> {
        let (_, change) = self.next_change()?;
        let station_m = VehicleParameters::MKZ.front_m(change.latest_m - RouteLaneChange::LENGTH_M_MIN);
        Some(Stop { station_m, reason: Reason::LaneChange })
    }

    /// The acceleration for this tick, m/s².
    fn acceleration_mps2(&mut self, speed_mps: f64, station_m: f64) -> f64 {
        let guide = &self.guide;
        let allowed_mps =
            guide.speed_mps_max(station_m).min(guide.speed_mps_max(station_m + 0.6 * speed_mps));
        let (mut acceleration_mps2, mut reason) = self.pedals.step(speed_mps, allowed_mps, &self.targets);
        let front_m = VehicleParameters::MKZ.front_m(station_m);
        let line_mps2 =
            self.stop.and_then(|stop| Some((line_mps2(speed_mps, stop.station_m - front_m)?, stop)));
        if let Some((line_mps2, stop)) = line_mps2.filter(|(line_mps2, _)| *line_mps2 < acceleration_mps2) {
            (acceleration_mps2, reason) = (line_mps2, stop.reason);
        }
        self.status.reason = reason;
        // At rest, the cruise control goes on by itself as soon as its law asks for it.
        if speed_mps < REST_MPS && acceleration_mps2 <= START_MPS2 { HOLD_MPS2 } else { acceleration_mps2 }
    }
}

/// A standing vehicle does not creep for less, m/s². Ours.
const START_MPS2: f64 = 0.1;

impl Ads for Reactive {
    fn drive(&mut self, sensed: &Sensed) -> Control {
        let ego = &sensed.ego;
        if self.station_m.is_none() {
            self.steer_rad = ego.steer_rad;
        }
        let station_m = self.guide.locate(ego.rear_axle.position, self.station_m).station_m;
        self.station_m = Some(station_m);
        if self.ticks.is_multiple_of(FRAME_TICKS) {
            self.look(sensed, station_m);
        }
        let (throttle_pct, brake_pct) = pedals_for(self.acceleration_mps2(ego.speed_mps, station_m));
        // Between looks the gaps close as the speeds have it.
        for target in &mut self.targets {
            target.gap_m += (target.along_mps - ego.speed_mps) * DT_S;
        }
        let control =
            Control { throttle_pct, brake_pct, steer_rad: stanley::steer_rad(&self.guide, station_m, ego) };
        self.status.control = control;
        self.status.steer_rate_radps = (ego.steer_rad - self.steer_rad) / DT_S;
        self.steer_rad = ego.steer_rad;
        self.ticks += 1;
        control
    }

    fn status(&self) -> &Status {
        &self.status
    }
}
