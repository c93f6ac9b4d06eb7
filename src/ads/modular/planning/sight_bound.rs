//! Speed bounded by what can be seen: the vehicle must be able to stop within the distance that it can see
//! to be clear ("assured clear distance ahead").
//!
//! Stopping sight distance, as AASHTO's Green Book has it: d = v·t + v²/(2a). `d` is the range in which the
//! perception surely sees a pedestrian in this weather and light; `a` is the hardest braking of a plan. Where a
//! high vehicle beside the way hides the edge of a crosswalk or of a junction without lights, nothing is assured
//! there, and the vehicle comes no faster than to an unprotected turn.
//! Left out: crests, as the maps are flat, and what buildings hide, as the maps have none.

use crate::ads::guide::Guide;
use crate::ads::status::Reason;
use crate::sim::{Conditions, Scene, VehicleParameters};

use super::super::config::{PerceptionConfig, PlanningConfig};
use super::super::junctions::Junctions;
use super::super::perception::surely_seen_m;
use super::super::prediction::Forecast;
use super::speed::Constraint;
use super::trajectory::Point;

/// A vehicle so high hides a pedestrian, m: the height of one.
const HIGH_M: f64 = 1.75;
/// Slower vehicles beside the way are taken to stand, m/s. Ours.
const SLOW_MPS: f64 = 2.0;
/// A vehicle hides a place that it stands so near before, m, if it is so near beside the way, m: in the next
/// lane or at the kerb. Ours.
const BEFORE_M: f64 = 15.0;
const BESIDE_M: f64 = 5.0;
/// Places farther ahead do not matter yet, m.
const LOOK_M: f64 = 60.0;

#[derive(Debug, Clone, Default)]
pub struct SightBound {
    /// Where the vehicle must expect what it cannot see: crosswalks and junctions without lights, from and
    /// to, m.
    places_m: Vec<(f64, f64)>,
    /// The conditions that the range was worked out for, and the speed that it allows, m/s.
    known: Option<(Conditions, f64)>,
}

impl SightBound {
    pub fn new(scene: &Scene, junctions: &Junctions) -> SightBound {
        let lit = |enter_m: f64| {
            let mut lines = scene.route.stop_lines.iter();
            lines.any(|line| (enter_m - 40.0..enter_m + 10.0).contains(&line.station_m))
        };
        let dark = junctions.between(0.0, f64::INFINITY).filter(|(enter_m, _)| !lit(*enter_m));
        let places_m = scene.route.crosswalks_m.iter().copied().chain(dark).collect();
        SightBound { places_m, known: None }
    }

    /// Adds the limits that the view sets here and ahead.
    pub fn constrain(
        &mut self,
        config: &PlanningConfig,
        guide: &Guide,
        start: &Point,
        conditions: &Conditions,
        forecasts: &[Forecast],
        constraints: &mut Vec<Constraint>,
    ) {
        if !config.sight_bounds_speed {
            return;
        }
        let allowed_mps = self.allowed_mps(config, conditions);
        if allowed_mps < config.cruise_mps {
            let (from_m, to_m) = (f64::NEG_INFINITY, f64::INFINITY);
            constraints.push(Constraint::limit(Reason::Sight, from_m, to_m, allowed_mps));
        }
        let front_m = VehicleParameters::MKZ.front_m(start.station_m);
        for &(from_m, to_m) in &self.places_m {
            if to_m < front_m || from_m > front_m + LOOK_M {
                continue;
            }
            if forecasts.iter().any(|forecast| hides(guide, forecast, from_m)) {
                let slowing_m = start.speed_mps * start.speed_mps / (2.0 * config.comfortable_mps2);
                let begin_m = from_m - slowing_m;
                constraints.push(Constraint::limit(Reason::Sight, begin_m, to_m, config.approach_mps));
            }
        }
    }

    fn allowed_mps(&mut self, config: &PlanningConfig, conditions: &Conditions) -> f64 {
        // Water and friction change with the speed; they do not matter here.
        let same = |known: &Conditions| {
            (known.light, known.rain_mmph, known.visibility_m)
                == (conditions.light, conditions.rain_mmph, conditions.visibility_m)
        };
        match &self.known {
            Some((known, allowed_mps)) if same(known) => *allowed_mps,
            _ => {
                // What the planner is told of its sensors, not what a planted fault makes of them.
                let seen_m = surely_seen_m(&PerceptionConfig::default(), conditions);
                let allowed_mps = stoppable_mps(config, seen_m);
                self.known = Some((*conditions, allowed_mps));
                allowed_mps
            }
        }
    }
}

/// Greatest speed from which the vehicle stops within a distance: v·t + v²/(2a) = d, solved for v.
fn stoppable_mps(config: &PlanningConfig, distance_m: f64) -> f64 {
    let (time_s, decel_mps2) = (config.sight_reaction_s, config.deceleration_mps2_max);
    decel_mps2 * ((time_s * time_s + 2.0 * distance_m / decel_mps2).sqrt() - time_s)
}

/// Whether a road user stands beside the way so that what comes onto it at a station cannot be seen.
fn hides(guide: &Guide, forecast: &Forecast, station_m: f64) -> bool {
    if forecast.height_m < HIGH_M || !forecast.body.is_vehicle() || forecast.velocity_mps.norm() > SLOW_MPS {
        return false;
    }
    let reach_m = forecast.length_m / 2.0;
    let at = guide.project(forecast.positions[0], station_m - BEFORE_M - reach_m, station_m + reach_m);
    let half_m = (VehicleParameters::MKZ.width_m + forecast.width_m) / 2.0;
    let beside_m = at.offset_m.abs() - half_m;
    let front_m = at.station_m + reach_m;
    (station_m - BEFORE_M..station_m + forecast.length_m).contains(&front_m)
        && (0.0..BESIDE_M).contains(&beside_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ads::testing::{CLEAR_DAY, straight};

    #[test]
    fn it_can_stop_within_what_it_sees() {
        let config = PlanningConfig::default();
        for distance_m in [5.0, 16.0, 60.0] {
            let speed_mps = stoppable_mps(&config, distance_m);
            let stopping_m = speed_mps * config.sight_reaction_s
                + speed_mps * speed_mps / (2.0 * config.deceleration_mps2_max);
            assert!((stopping_m - distance_m).abs() < 1e-9);
        }
    }

    #[test]
    fn fog_and_night_slow_it_down_and_the_clear_day_does_not() {
        let config = PlanningConfig::default();
        let scene = straight();
        let mut sight = SightBound::new(&scene, &Junctions::of(&scene));
        let clear_mps = sight.allowed_mps(&config, &CLEAR_DAY);
        let fog_mps = sight.allowed_mps(&config, &Conditions { visibility_m: 50.0, ..CLEAR_DAY });
        let night_mps = sight.allowed_mps(&config, &Conditions { light: 0.0, ..CLEAR_DAY });
        assert!(clear_mps > config.cruise_mps, "{clear_mps}");
        assert!((5.0..9.0).contains(&fog_mps), "{fog_mps}");
        assert!((8.0..clear_mps).contains(&night_mps), "{night_mps}");
    }
}
