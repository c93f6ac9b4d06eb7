//! Errors of the modules that give planning its picture, measured in the seconds before a collision.
//!
//! The scenario is played once more by its own driving system. Ten times a second a module's output is compared with its
//! own input, so that the errors of one module do not count for the next. The worst error is compared with a bound that
//! follows from the module's specification: the baseline's settings, or a figure of ours where there are none.
//!
//! | module | measured | held against | bound |
//! |---|---|---|---|
//! | localisation | error of the position, m | the true position | three standard deviations, and the way in its latency |
//! | perception | longest time without a detection of the obstacle, s | whether it was in sight | 95 % of runs of misses |
//! | tracking | longest time in which it was not known, s | whether it was detected | publication, and the time that looks take |
//! | prediction | error of the most probable future after a second, m | see [`Forecast::error_m`] | half a lane, ours |
//!
//! Draws within the specification exceed these bounds now and then. An excess in these seconds says that the module had
//! bad luck, or that its specification allows too much. Left out: planning, control and emergency braking, whose output has
//! no truth to compare with, and latency, which is a constant of the settings.

use crate::episode;
use avastra_base::geometry::Vec2;
use avastra_drivers::{Ads, ModularConfig, Module, in_sight};
use avastra_world::sim::{DT_S, FRAME_S, FRAME_TICKS, Obstacle, Sensed, World};

use super::case::{Case, What};

/// Errors are measured in this time before the collision, s: longer than publication and braking to rest.
const WINDOW_S: f64 = 5.0;
/// Place in a forecast of the position after [`AHEAD_S`]: forecasts have a position every 0.5 s.
const AHEAD_INDEX: usize = 1;
const AHEAD_S: f64 = 1.0;
/// A change of the given velocity within this time may be taken for an acceleration, s.
const CHANGE_S: f64 = 0.5;
/// Error of a forecast after a second that is within a prediction's specification, m: half a lane. Ours.
const FORECAST_M: f64 = 1.75;
/// Misses in a run of which 95 % are shorter, as a multiple of the mean: runs have an exponential distribution.
const LONG_RUN: f64 = 3.0;

/// The worst error of a module before a collision.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Measure {
    pub module: Module,
    /// In words, for example `longest time not detected, s`.
    pub what: &'static str,
    pub worst: f64,
    /// The largest error that the specification leaves room for.
    pub bound: f64,
}

impl Measure {
    /// How often the bound goes into the worst error.
    pub fn excess(&self) -> f64 {
        self.worst / self.bound.max(1e-9)
    }
}

/// Measures the modules in the seconds before a collision of a driving system with the profile `own`; `baseline` is
/// their specification. Nothing is measured before a breach, because most of this is about one obstacle.
pub(super) fn measure(case: &Case, own: &ModularConfig, baseline: &ModularConfig) -> Vec<Measure> {
    let What::Collision { collision, .. } = case.what else { return Vec::new() };
    let contact = &collision.contact;
    let mut gauge = Gauge { obstacle: contact.obstacle, contact_s: contact.time_s, ..Gauge::default() };
    episode::run_watched(case.setup, &mut |moment| case.script.choose(moment), &mut |world, ads, _| {
        gauge.look(world, ads)
    });
    gauge.measures(own, baseline)
}

/// The observations of one obstacle so far.
#[derive(Default)]
struct Gauge {
    obstacle: u32,
    contact_s: f64,
    /// The world as it was when the driving system looked last: a tick before it tells.
    before: Option<Before>,
    localization_m: f64,
    undetected: Spell,
    unknown: Spell,
    forecast_m: f64,
    /// Forecasts that have not come due.
    forecasts: Vec<Forecast>,
    /// Errors of the velocity that prediction was given last, and when, s.
    velocity_errors_mps: Vec<(f64, Vec2)>,
    detected_before: bool,
    /// Most objects within reach of the sensors.
    objects: usize,
}

/// A forecast of the obstacle, and what prediction was given for it.
#[derive(Debug, Clone, Copy)]
struct Forecast {
    /// When it comes due, s.
    due_s: f64,
    /// The way of [`AHEAD_S`] that it forecasts.
    way: Vec2,
    /// The true place and velocity when it was made.
    position: Vec2,
    velocity_mps: Vec2,
    /// The velocity that prediction was given, less the true one.
    velocity_error_mps: Vec2,
    /// Acceleration that a change of `velocity_error_mps` would look like, magnitude, m/s².
    change_mps2: f64,
}

impl Forecast {
    /// Error of the forecast that its input does not excuse, m; the obstacle is now at `position`.
    ///
    /// - The place at which the obstacle was believed to be does not matter: ways are compared, not places.
    /// - The way may contain the error of the given velocity, or any part of it along some direction, because
    ///   prediction may believe its input or know better, for example from the lane. All such ways end on a sphere whose
    ///   poles are the way without that error and the way with all of it; ways that end inside count as right, too. An
    ///   acceleration that only a change of that error suggests is excused in the same way.
    /// - No prediction can know later decisions of the obstacle, so its way at constant velocity is as good as its true
    ///   one.
    fn error_m(&self, position: Vec2) -> f64 {
        let excused = self.velocity_error_mps * (AHEAD_S / 2.0);
        let change_m = self.change_mps2 * AHEAD_S * AHEAD_S / 2.0;
        let error_m = |way: Vec2| ((self.way - way - excused).norm() - excused.norm() - change_m).max(0.0);
        error_m(position - self.position).min(error_m(self.velocity_mps * AHEAD_S))
    }
}

struct Before {
    ego: Vec2,
    obstacle: Option<Obstacle>,
    sensed: Sensed,
}

/// The longest time for which something lasted without a break.
#[derive(Default)]
struct Spell {
    now_s: f64,
    longest_s: f64,
}

impl Spell {
    fn note(&mut self, lasts: bool) {
        self.now_s = if lasts { self.now_s + FRAME_S } else { 0.0 };
        self.longest_s = self.longest_s.max(self.now_s);
    }
}

impl Gauge {
    /// After a tick of the world.
    fn look(&mut self, world: &World, ads: &dyn Ads) {
        let now_s = world.time_s();
        if now_s > self.contact_s {
            return;
        }
        if let Some(before) = self.before.take().filter(|_| world.ticks().is_multiple_of(FRAME_TICKS)) {
            self.compare(&before, now_s - DT_S, ads);
        }
        if (world.ticks() + 1).is_multiple_of(FRAME_TICKS) {
            let obstacle = world.obstacle(self.obstacle).copied();
            let ego = world.ego().rear_axle.position;
            self.before = Some(Before { ego, obstacle, sensed: world.sensed() });
        }
    }

    /// Compares the truth at a moment with what the driving system then believed.
    fn compare(&mut self, before: &Before, time_s: f64, ads: &dyn Ads) {
        let status = ads.status();
        let Some(obstacle) = before.obstacle else { return };
        let detected = status.detected.contains(&self.obstacle);
        self.detected_before |= detected;
        let truth = obstacle.outline.pose.position;
        let perceived = status.perceived.iter().find(|perceived| perceived.id == Some(self.obstacle));
        if time_s < self.contact_s - WINDOW_S {
            return;
        }
        if let Some(localized) = status.localized {
            self.localization_m = self.localization_m.max((localized.position - before.ego).norm());
        }
        let seen = before.sensed.objects.iter().find(|object| object.id == self.obstacle);
        // Before the first detection the sensors' range decides, not a run of misses.
        let is_visible = seen.is_some_and(|object| in_sight(object, &before.sensed.conditions));
        self.undetected.note(is_visible && self.detected_before && !detected);
        self.unknown.note(detected && perceived.is_none());
        self.objects = self.objects.max(before.sensed.objects.len());
        self.forecasts.retain(|forecast| {
            let is_due = time_s >= forecast.due_s - 1e-6;
            if is_due {
                self.forecast_m = self.forecast_m.max(forecast.error_m(truth));
            }
            !is_due
        });
        let Some(perceived) = perceived else { return };
        let velocity_error_mps = perceived.velocity_mps - obstacle.velocity_mps;
        self.velocity_errors_mps.retain(|(then_s, _)| time_s - then_s <= CHANGE_S + 1e-6);
        let changes_mps = self.velocity_errors_mps.iter().map(|(_, then)| (velocity_error_mps - then).norm());
        let change_mps2 = changes_mps.fold(0.0, f64::max) / CHANGE_S;
        self.velocity_errors_mps.push((time_s, velocity_error_mps));
        self.forecasts.extend(perceived.predicted.get(AHEAD_INDEX).map(|expected| Forecast {
            due_s: time_s + AHEAD_S,
            way: expected - perceived.pose.position,
            position: truth,
            velocity_mps: obstacle.velocity_mps,
            velocity_error_mps,
            change_mps2,
        }));
    }

    fn measures(self, own: &ModularConfig, baseline: &ModularConfig) -> Vec<Measure> {
        let ModularConfig { localization, perception, tracking, .. } = baseline;
        // Both axes, in streets; 20 m/s is faster than any road of a town allows.
        let sigma_m = localization.position_sigma_m * localization.street_factor * core::f64::consts::SQRT_2;
        // The driving system's own latency makes the looks old that tracking is given, which is no fault of tracking.
        let latency_frames = own.perception.latency_frames as usize + own.latency.load_frames(self.objects);
        let publication_s = (tracking.frames_to_publish as usize + latency_frames) as f64 * FRAME_S;
        let of = |module, what, worst, bound| Measure { module, what, worst, bound };
        vec![
            of(
                Module::Localization,
                "error of its position, m",
                self.localization_m,
                3.0 * sigma_m * localization.rain_factor + 20.0 * localization.latency_s,
            ),
            of(
                Module::Perception,
                "longest time in sight and not detected, s",
                self.undetected.longest_s,
                LONG_RUN * perception.miss_run_s,
            ),
            of(
                Module::Tracking,
                "longest time detected and not known, s",
                self.unknown.longest_s,
                publication_s,
            ),
            of(Module::Prediction, "error of its forecast after a second, m", self.forecast_m, FORECAST_M),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_spell_counts_and_a_break_ends_it() {
        let mut spell = Spell::default();
        for lasts in [true, true, false, true, true, true, false, true] {
            spell.note(lasts);
        }
        assert!((spell.longest_s - 3.0 * FRAME_S).abs() < 1e-12 && (spell.now_s - FRAME_S).abs() < 1e-12);
    }

    #[test]
    fn an_error_is_judged_against_the_specification() {
        let mut gauge = Gauge::default();
        (0..15).for_each(|_| gauge.undetected.note(true));
        let default = ModularConfig::default();
        let found = gauge.measures(&default, &default);
        let of = |module: Module| found.iter().find(|found| found.module == module).unwrap().excess();
        assert!((of(Module::Perception) - 1.25).abs() < 1e-9, "{found:?}");
        assert_eq!(of(Module::Tracking), 0.0);
    }

    /// A forecast of a way along x, for an obstacle of one velocity that was taken to have another.
    fn forecast(way: Vec2, true_mps: Vec2, given_mps: Vec2) -> Forecast {
        Forecast {
            due_s: 1.0,
            way,
            position: Vec2::new(100.0, 50.0),
            velocity_mps: true_mps,
            velocity_error_mps: given_mps - true_mps,
            change_mps2: 0.0,
        }
    }

    #[test]
    fn a_wreck_that_was_taken_to_move_is_no_error_of_prediction() {
        let (still, given_mps) = (Vec2::zeros(), Vec2::new(3.77, 0.0));
        let there = Vec2::new(100.0, 50.0);
        // Prediction believed the velocity that it was given, none of it, or only its part along a lane.
        for way in [given_mps, still, Vec2::new(3.77 / 2.0, 3.77 / 2.0)] {
            assert!(forecast(way, still, given_mps).error_m(there) < 1e-9, "{way}");
        }
        // Nothing that it was given led it farther.
        assert!((forecast(given_mps * 2.0, still, given_mps).error_m(there) - 3.77).abs() < 1e-9);
        assert!((forecast(given_mps, still, still).error_m(there) - 3.77).abs() < 1e-9);
        // A velocity that was 0 half a second before looks like an acceleration.
        let hasty = Forecast { change_mps2: 3.77 * 2.0, ..forecast(given_mps * 2.0, still, given_mps) };
        assert!(hasty.error_m(there) < 1e-9);
    }

    #[test]
    fn a_frozen_forecast_is_an_error_of_prediction_unless_its_velocity_was_none() {
        let moves_mps = Vec2::new(8.0, 0.0);
        let there = Vec2::new(108.0, 50.0);
        assert!((forecast(Vec2::zeros(), moves_mps, moves_mps).error_m(there) - 8.0).abs() < 1e-9);
        assert!(
            forecast(Vec2::zeros(), moves_mps, Vec2::zeros()).error_m(there) < 1e-9,
            "tracking gave none"
        );
        // It brakes, which no prediction could know.
        let braked = Vec2::new(105.0, 50.0);
        assert!(forecast(moves_mps, moves_mps, moves_mps).error_m(braked) < 1e-9);
        assert!(
            forecast(Vec2::new(5.0, 0.0), moves_mps, moves_mps).error_m(braked) < 1e-9,
            "it was foreseen"
        );
    }
}
