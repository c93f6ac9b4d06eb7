//! Errors of the sensing modules, measured in the seconds before a collision.
//!
//! The scenario is played once more by its own driving system. Ten times a second what a module gave is compared
//! with the truth, and the worst of it with what the module's specification leaves room for: the baseline's
//! settings, or a bound that is ours where there is none.
//!
//! | module | measured | bound |
//! |---|---|---|
//! | localisation | error of the position, m | three standard deviations, and the way in its latency |
//! | perception | longest time in which the obstacle was in sight and not detected, s | 95 % of runs of misses |
//! | tracking | longest time in which it was detected and not known, s | publication and latency |
//! | prediction | error of the most probable future after a second, m | half a lane, ours |
//!
//! Draws within the specification exceed these bounds now and then: that a module was so far off in these seconds
//! says that it had bad luck, or that its specification allows too much. Left out: planning, control and emergency
//! braking, whose output has no truth to compare with, and latency, which is a constant of the settings.

use crate::ads::{Ads, ModularConfig, Module, in_sight};
use crate::episode;
use crate::geometry::Vec2;
use crate::sim::{DT_S, FRAME_S, FRAME_TICKS, Obstacle, Sensed, World};

use super::crash::Crash;

/// Errors are measured in so long before the collision, s: longer than publication and braking to rest.
const WINDOW_S: f64 = 5.0;
/// Place in a forecast of the position after [`AHEAD_S`]: forecasts have a position every 0.5 s.
const AHEAD_INDEX: usize = 1;
const AHEAD_S: f64 = 1.0;
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
    /// What the specification leaves room for.
    pub bound: f64,
}

impl Measure {
    /// How often the bound goes into the worst error.
    pub fn excess(&self) -> f64 {
        self.worst / self.bound.max(1e-9)
    }
}

/// Measures the sensing modules in the seconds before a collision; `baseline` is their specification.
pub(super) fn measure(crash: &Crash, baseline: &ModularConfig) -> Vec<Measure> {
    let contact = &crash.collision.contact;
    let mut gauge = Gauge::new(contact.obstacle, contact.time_s);
    episode::run(
        crash.setup,
        &mut |moment| crash.script.choose(crash.setup.table, moment),
        &mut |world, ads, _| gauge.look(world, ads),
    );
    gauge.measures(baseline)
}

/// What was seen of one obstacle so far.
struct Gauge {
    obstacle: u32,
    contact_s: f64,
    /// The world as it was when the driving system looked last: a tick before it tells.
    before: Option<Before>,
    localization_m: f64,
    undetected: Spell,
    unknown: Spell,
    forecast_m: f64,
    /// Forecasts that have not come due: when, and where the obstacle should be then.
    forecasts: Vec<(f64, Vec2)>,
    detected_before: bool,
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
    fn new(obstacle: u32, contact_s: f64) -> Gauge {
        Gauge {
            obstacle,
            contact_s,
            before: None,
            localization_m: 0.0,
            undetected: Spell::default(),
            unknown: Spell::default(),
            forecast_m: 0.0,
            forecasts: Vec::new(),
            detected_before: false,
        }
    }

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
        self.forecasts.retain(|&(due_s, expected)| {
            let is_due = time_s >= due_s - 1e-6;
            if is_due {
                self.forecast_m = self.forecast_m.max((expected - truth).norm());
            }
            !is_due
        });
        let predicted = perceived.and_then(|perceived| perceived.predicted.get(AHEAD_INDEX));
        self.forecasts.extend(predicted.map(|expected| (time_s + AHEAD_S, *expected)));
    }

    fn measures(self, baseline: &ModularConfig) -> Vec<Measure> {
        let ModularConfig { localization, perception, tracking, .. } = baseline;
        // Both axes, in streets; 20 m/s is faster than any road of a town allows.
        let sigma_m = localization.position_sigma_m * localization.street_factor * core::f64::consts::SQRT_2;
        let publication = f64::from(tracking.frames_to_publish + perception.latency_frames) * FRAME_S;
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
                publication,
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
        let mut gauge = Gauge::new(1, 10.0);
        (0..15).for_each(|_| gauge.undetected.note(true));
        let found = gauge.measures(&ModularConfig::default());
        let of = |module: Module| found.iter().find(|found| found.module == module).unwrap().excess();
        assert!((of(Module::Perception) - 1.25).abs() < 1e-9, "{found:?}");
        assert_eq!(of(Module::Tracking), 0.0);
    }
}
