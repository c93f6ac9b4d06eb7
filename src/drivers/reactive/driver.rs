//! The driver: looks ten times a second, and commands pedals and wheel every tick.

use std::sync::Arc;

use crate::driver::Ads;
use crate::kit::{Helm, RouteChanges, Sight, Signs, SpeedRules, Stop, held_mps2, lights};
use crate::status::{Manoeuvre, PerceivedObject, Reason, Status};
use avastra_world::sim::{Control, DT_S, FRAME_S, Scene, Sensed, VehicleParameters};

use super::assistance::{Pedals, Target, is_free, line_mps2};
use super::stanley;

/// Factor of a camera's range for pedestrians in full darkness: low beams show dark clothing at 25 to 40 m of 80.
const NIGHT_FACTOR: f64 = 0.4;
/// A lane must have been free for so long, s. Ours: longer than a new object takes to be known.
const FREE_S: f64 = 1.0;
/// A standing vehicle does not creep for less, m/s². Ours.
const START_MPS2: f64 = 0.1;

/// The driving system.
#[derive(Debug, Clone)]
pub struct Reactive {
    scene: Arc<Scene>,
    changes: RouteChanges,
    /// For how long the lane of the next change has been free, s.
    free_s: f64,
    sight: Sight,
    signs: Signs,
    /// The targets of the last look that it reacts to.
    targets: Vec<Target>,
    stop: Option<Stop>,
    pedals: Pedals,
    helm: Helm,
    status: Status,
}

impl Reactive {
    pub fn new(scene: &Arc<Scene>) -> Reactive {
        Reactive {
            scene: Arc::clone(scene),
            changes: RouteChanges::new(scene, SpeedRules::on(scene)),
            free_s: 0.0,
            sight: Sight::new(scene, NIGHT_FACTOR),
            signs: Signs::default(),
            targets: Vec::new(),
            stop: None,
            pedals: Pedals::default(),
            helm: Helm::default(),
            status: Status::default(),
        }
    }

    fn look(&mut self, sensed: &Sensed, station_m: f64) {
        self.sight.look(sensed);
        self.change_lanes(station_m, sensed.ego.speed_mps);
        let front_m = VehicleParameters::MKZ.front_m(station_m);
        let seen = |object| Target::seen(self.changes.guide(), object, &sensed.ego, front_m);
        self.targets.clear();
        self.targets.extend(self.sight.known().iter().filter_map(seen));
        let sign = self.signs.next_stop(&self.scene, front_m, sensed.ego.speed_mps);
        let wait = self.changes.wait_m().map(|station_m| Stop { station_m, reason: Reason::LaneChange });
        let stops = lights(&self.scene, sensed, front_m).chain(sign).chain(wait);
        self.stop = stops.min_by(|a, b| a.station_m.total_cmp(&b.station_m));
        self.status.perceive(self.sight.known().iter().map(PerceivedObject::as_it_is));
        self.status.localized = Some(sensed.ego.rear_axle);
    }

    /// Begins the next lane change once it is due and its lane is free; it is then carried through.
    fn change_lanes(&mut self, station_m: f64, speed_mps: f64) {
        self.status.manoeuvre = match self.changes.due(station_m).map(|change| change.lateral_m) {
            None if self.changes.is_under_way(station_m) => Manoeuvre::LaneChange,
            None => Manoeuvre::LaneFollow,
            Some(lateral_m) => {
                let front_m = VehicleParameters::MKZ.front_m(station_m);
                let is_free =
                    is_free(self.changes.guide(), self.sight.known(), lateral_m, front_m, speed_mps);
                self.free_s = if is_free { self.free_s + FRAME_S } else { 0.0 };
                if self.free_s > FREE_S {
                    self.changes.begin(station_m);
                }
                Manoeuvre::AwaitGap
            }
        };
    }

    /// The acceleration for this tick, m/s².
    fn acceleration_mps2(&mut self, speed_mps: f64, station_m: f64) -> f64 {
        let allowed_mps = self.changes.guide().allowed_mps(station_m, speed_mps);
        let (mut acceleration_mps2, mut reason) = self.pedals.step(speed_mps, allowed_mps, &self.targets);
        let front_m = VehicleParameters::MKZ.front_m(station_m);
        let line_mps2 =
            self.stop.and_then(|stop| Some((line_mps2(speed_mps, stop.station_m - front_m)?, stop)));
        if let Some((line_mps2, stop)) = line_mps2.filter(|(line_mps2, _)| *line_mps2 < acceleration_mps2) {
            (acceleration_mps2, reason) = (line_mps2, stop.reason);
        }
        self.status.reason = reason;
        // At rest, the cruise control goes on by itself as soon as its law asks for it.
        held_mps2(speed_mps, acceleration_mps2, START_MPS2)
    }
}

impl Ads for Reactive {
    fn drive(&mut self, sensed: &Sensed) -> Control {
        let ego = &sensed.ego;
        let station_m = self.helm.locate(self.changes.guide(), ego.rear_axle.position).station_m;
        if self.helm.looks() {
            self.look(sensed, station_m);
        }
        let acceleration_mps2 = self.acceleration_mps2(ego.speed_mps, station_m);
        // Between looks the gaps close as the speeds have it.
        for target in &mut self.targets {
            target.gap_m += (target.along_mps - ego.speed_mps) * DT_S;
        }
        let steer_rad = stanley::steer_rad(self.changes.guide(), station_m, ego);
        self.helm.command(Control::towards(acceleration_mps2, steer_rad), ego, &mut self.status)
    }

    fn status(&self) -> &Status {
        &self.status
    }
}
