//! The parts of the modular driving system put together, and when each of them runs.
//!
//! Localisation and control run every tick (50 Hz; Apollo: 100), perception, prediction and planning
//! once a frame (10 Hz).

use std::sync::Arc;

use crate::ads::driver::Ads;
use crate::ads::guide::Guide;
use crate::ads::status::PerceivedObject;
use crate::ads::status::PlannedPoint;
use crate::ads::status::Status;
use crate::geometry::Pose;
use crate::sim::Control;
use crate::sim::DT_S;
use crate::sim::FRAME_TICKS;
use crate::sim::Scene;
use crate::sim::Sensed;
use crate::sim::SignalColour;

use super::config::ModularConfig;
use super::control::Controller;
use super::localization::Localization;
use super::perception::FRAME_S;
use super::perception::Perception;
use super::planning::Planner;
use super::prediction::Prediction;

/// The driving system under test.
#[derive(Debug, Clone)]
pub struct Modular {
    guide: Arc<Guide>,
    localization: Localization,
    perception: Perception,
    prediction: Prediction,
    planner: Planner,
    controller: Controller,
    latency_frames: u32,
    ticks: u64,
    /// Where it believes to be on the route, m.
    station_m: f64,
    steer_rad: f64,
    status: Status,
}

impl Modular {
    pub fn new(scene: &Arc<Scene>, config: &ModularConfig, seed: u64) -> Modular {
        let guide = Arc::new(Guide::new(scene, &config.planning.speed_rules()));
        Modular {
            localization: Localization::new(&config.localization, seed),
            perception: Perception::new(&config.perception, seed),
            prediction: Prediction::new(&config.prediction, scene),
            planner: Planner::new(&config.planning, scene, &guide),
            controller: Controller::new(&config.control),
            latency_frames: config.perception.latency_frames,
            guide,
            ticks: 0,
            station_m: 0.0,
            steer_rad: 0.0,
            status: Status::default(),
        }
    }

    /// Perception, prediction and planning.
    fn cycle(&mut self, sensed: &Sensed, localized: &Pose) {
        // With latency, a frame is used one cycle after it was taken.
        if self.latency_frames == 0 {
            self.perception.look(sensed, localized);
        }
        let age_s = f64::from(self.latency_frames) * FRAME_S;
        self.prediction.update(self.perception.published(), age_s, localized.position);
        let since_s = if self.ticks == 0 { 0.0 } else { FRAME_S };
        let signals: &[SignalColour] = &sensed.signals;
        self.planner.plan(
            localized,
            self.station_m,
            sensed.ego.speed_mps,
            since_s,
            self.prediction.forecasts(),
            signals,
        );
        if self.latency_frames > 0 {
            self.perception.look(sensed, localized);
        }
        self.report();
    }

    /// Writes perceptions and plan into the status; its buffers are reused.
    fn report(&mut self) {
        let forecasts = self.prediction.forecasts();
        let perceived = &mut self.status.perceived;
        perceived.truncate(forecasts.len());
        for (index, forecast) in forecasts.iter().enumerate() {
            let pose = Pose { position: forecast.positions[0], heading_rad: forecast.heading_rad };
            let mut predicted =
                perceived.get_mut(index).map_or_else(Vec::new, |o| core::mem::take(&mut o.predicted));
            predicted.clear();
            predicted.extend_from_slice(&forecast.positions[1..]);
            let object = PerceivedObject {
                id: Some(forecast.id),
                body: forecast.body,
                pose,
                velocity_mps: forecast.velocity_mps,
                length_m: forecast.length_m,
                width_m: forecast.width_m,
                height_m: forecast.height_m,
                predicted,
            };
            match perceived.get_mut(index) {
                Some(slot) => *slot = object,
                None => perceived.push(object),
            }
        }
        let guide = &self.guide;
        self.status.planned.clear();
        self.status.planned.extend(
            self.planner.trajectory().points.iter().map(|point| PlannedPoint {
                pose: guide.pose_at(point.station_m),
                speed_mps: point.speed_mps,
            }),
        );
        self.status.reason = self.planner.reason();
    }
}

impl Ads for Modular {
    fn drive(&mut self, sensed: &Sensed) -> Control {
        let localized = self.localization.locate(sensed);
        let near_m = (self.ticks > 0).then_some(self.station_m);
        self.station_m = self.guide.locate(localized.position, near_m).station_m;
        let in_cycle = self.ticks % FRAME_TICKS;
        if in_cycle == 0 {
            self.cycle(sensed, &localized);
        }
        let control = self.controller.follow(
            self.planner.trajectory(),
            in_cycle as f64 * DT_S,
            &self.guide,
            &localized,
            self.station_m,
            &sensed.ego,
        );
        self.status.localized = Some(localized);
        self.status.control = control;
        self.status.steer_rate_radps =
            if self.ticks == 0 { 0.0 } else { (sensed.ego.steer_rad - self.steer_rad) / DT_S };
        self.steer_rad = sensed.ego.steer_rad;
        self.ticks += 1;
        control
    }

    fn status(&self) -> &Status {
        &self.status
    }

    fn clone_box(&self) -> Box<dyn Ads> {
        Box::new(self.clone())
    }
}
