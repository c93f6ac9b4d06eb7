//! The parts of the modular driving system put together, and when each of them runs.
//!
//! Localisation and control run every tick (50 Hz; Apollo: 100), perception, tracking, prediction and
//! planning once a frame (10 Hz).

use std::sync::Arc;

use crate::driver::Ads;
use crate::kit::Helm;
use crate::status::{GHOST_ID_MIN, PerceivedObject, Reason, Status};
use avastra_base::geometry::{Pose, Vec2};
use avastra_world::sim::{Control, Scene, Sensed};

use super::config::ModularConfig;
use super::control::Controller;
use super::emergency::Emergency;
use super::foresight::Foresight;
use super::junctions::Junctions;
use super::localization::Localization;
use super::perception::{LightReader, Perception, sees_empty};
use super::planning::{Outlook, Planner};
use super::prediction::Prediction;
use super::tracking::Tracking;
use super::watchdog::Watchdog;

/// The driving system under test.
#[derive(Debug, Clone)]
pub struct Modular {
    junctions: Arc<Junctions>,
    localization: Localization,
    perception: Perception,
    lights: LightReader,
    tracking: Tracking,
    prediction: Prediction,
    planner: Planner,
    controller: Controller,
    emergency: Emergency,
    watchdog: Watchdog,
    /// Hardest braking that the brakes give, m/s².
    brake_mps2_max: f64,
    /// Its station is where it believes it is on the route.
    helm: Helm,
    status: Status,
}

impl Modular {
    /// With these settings, and a recording of the future for a perfect prediction; the seed feeds its sensor errors.
    pub fn new(
        scene: &Arc<Scene>,
        config: &ModularConfig,
        seed: u64,
        foresight: Option<Arc<Foresight>>,
    ) -> Modular {
        let mut config = *config;
        config.perception = config.perception.on(scene);
        config.planning.cruise_mps = scene.set_mps.unwrap_or(config.planning.cruise_mps);
        let config = &config;
        let junctions = Arc::new(Junctions::of(scene));
        let weak = &config.weaknesses;
        let latency_frames = config.perception.latency_frames;
        Modular {
            localization: Localization::new(&config.localization, seed),
            perception: Perception::new(&config.perception, weak.late_unstable_tracks, seed),
            lights: LightReader::new(&config.perception, scene),
            tracking: Tracking::new(&config.tracking, weak.late_unstable_tracks, latency_frames),
            prediction: Prediction::new(&config.prediction, weak.lane_bound_prediction, scene, foresight),
            planner: Planner::new(config, scene, &junctions),
            controller: Controller::new(&config.control),
            emergency: Emergency::new(&config.emergency),
            watchdog: Watchdog::new(&config.latency),
            brake_mps2_max: config.control.actuators.brake_mps2_max,
            junctions,
            helm: Helm::default(),
            status: Status::default(),
        }
    }

    /// Perception, tracking, prediction and planning.
    fn cycle(&mut self, sensed: &Sensed, localized: &Pose) {
        let station_m = self.helm.station_m();
        if let Some(since_s) = self.watchdog.looks(sensed.time_s) {
            self.tracking.resume(since_s);
            self.tracking.delay(self.watchdog.config.load_frames(sensed.objects.len()));
            let near_m = self.tracking.hold_m();
            let may_be_taken = |place: Vec2| {
                (place - localized.position).norm() <= near_m && !sees_empty(place, sensed, localized)
            };
            let detections = self.perception.look(sensed, localized);
            self.status.detected.clear();
            self.status.detected.extend(detections.iter().map(|detection| detection.truth));
            self.tracking.update(detections, may_be_taken);
        }
        let lights = self.lights.look(sensed, station_m);
        let (tracks, age_s) = (self.tracking.published(), self.tracking.age_s() + self.watchdog.perception_s);
        self.prediction.see_lights(lights);
        self.prediction.update(tracks, age_s, sensed.time_s, localized.position);
        if let Some(since_s) = self.watchdog.plans(sensed.time_s) {
            self.planner.plan(&Outlook {
                localized,
                station_m,
                speed_mps: sensed.ego.speed_mps,
                since_s: if self.helm.is_first() { 0.0 } else { since_s },
                forecasts: self.prediction.forecasts(),
                lights,
                conditions: &sensed.conditions,
            });
        }
        let (guide, lateral) = (self.planner.guide(), &self.planner.lateral);
        self.emergency.look(tracks, age_s, guide, lateral, station_m, &sensed.ego);
        self.report();
    }

    /// Id of the object that a track shows, for those who look on.
    fn truth_of(&self, id: u32) -> u32 {
        self.prediction.forecasts().iter().find(|forecast| forecast.id == id).map_or(id, |found| found.truth)
    }

    /// Writes perceptions and plan into the status; its buffers are reused.
    fn report(&mut self) {
        let forecasts = self.prediction.forecasts();
        // Only the most probable hypothesis of an object is reported; it comes first.
        let first = |index: &usize| *index == 0 || forecasts[index - 1].id != forecasts[*index].id;
        let reported = || (0..forecasts.len()).filter(first).map(move |index| &forecasts[index]);
        self.status.perceive(reported().map(|forecast| PerceivedObject {
            id: (forecast.truth < GHOST_ID_MIN).then_some(forecast.truth),
            track: forecast.id,
            body: forecast.body,
            pose: Pose { position: forecast.positions[0], heading_rad: forecast.heading_rad },
            velocity_mps: forecast.velocity_mps,
            length_m: forecast.length_m,
            width_m: forecast.width_m,
            height_m: forecast.height_m,
            predicted: Vec::new(),
        }));
        for (object, forecast) in self.status.perceived.iter_mut().zip(reported()) {
            debug_assert!(forecast.probability > 0.0, "a future that cannot happen is no hypothesis");
            object.predicted.extend_from_slice(&forecast.positions[1..]);
        }
        let (guide, lateral) = (self.planner.guide(), &self.planner.lateral);
        self.status.planned.clear();
        self.status.planned.extend(self.planner.trajectory.points.iter().map(|point| {
            let offset_m = lateral.aside(point.station_m).offset_m;
            // Most plans lie on the guide, and a place beside it takes trigonometry.
            if offset_m == 0.0 {
                guide.position_at(point.station_m)
            } else {
                guide.pose_at(point.station_m).offset(0.0, offset_m).position
            }
        }));
        self.status.reason = self.planner.trajectory.reason.renumbered(|id| self.truth_of(id));
        self.status.manoeuvre = self.planner.manoeuvre.renumbered(|id| self.truth_of(id));
    }
}

impl Ads for Modular {
    fn drive(&mut self, sensed: &Sensed) -> Control {
        let localizes = self.watchdog.localizes(sensed.time_s);
        let localized = match self.status.localized {
            Some(last) if !localizes => last,
            _ => self.localization.locate(sensed, !self.junctions.inside(self.helm.station_m())),
        };
        let station_m = self.helm.locate(self.planner.guide(), localized.position).station_m;
        if self.helm.looks() {
            self.cycle(sensed, &localized);
        }
        let since_s = self.watchdog.trajectory_s;
        let control = self.controller.follow(&self.planner, since_s, &localized, station_m, &sensed.ego);
        let control = self.emergency.brake(control, sensed.ego.speed_mps, self.brake_mps2_max);
        if let Some(id) = self.emergency.braking_for() {
            self.status.reason = Reason::Emergency(self.truth_of(id));
        }
        let control = if sensed.ego.touched && self.emergency.stops_after_contact() {
            self.status.reason = Reason::Contact;
            self.emergency.after_contact(control, self.brake_mps2_max)
        } else if self.watchdog.is_degraded() {
            self.status.reason = Reason::Degraded;
            self.watchdog.brake(control)
        } else {
            control
        };
        self.status.localized = Some(localized);
        self.helm.command(control, &sensed.ego, &mut self.status)
    }

    fn status(&self) -> &Status {
        &self.status
    }
}
