//! The route's lane changes: when one begins, and where it must be waited for.
//!
//! The vehicle stays in its lane until the target lane is clear by the rule of Apollo's lane change
//! decider (`IsClearToChangeLane`), and stops where a short change is just possible. A change that has
//! begun is broken off while most of the vehicle is still in its lane, if the other is no longer clear.

use std::sync::Arc;

use crate::kit::{Guide, RouteChanges};
use crate::status::Reason;
use avastra_base::geometry::{Beside, smooth_step};
use avastra_road::RouteLaneChange;
use avastra_world::sim::{Scene, VehicleParameters};

use super::super::config::PlanningConfig;
use super::super::prediction::Forecast;
use super::speed::Constraint;

/// Vehicles farther away along the road do not matter, m: the greatest gap that is asked for in a town.
const LOOK_M: f64 = 200.0;

/// A change of which a greater part is done is carried through: the outline is half over the line. Ours.
const BREAK_OFF_PART: f64 = 0.35;
/// A change is broken off when less than this part of the gaps is left that it began with. Ours.
const BREAK_OFF_GAPS: f64 = 0.5;
/// A station before every road, m: a change that begins there is over everywhere.
const LONG_AGO_M: f64 = -1e6;

#[derive(Debug, Clone)]
pub struct LaneChanges {
    /// Which changes have begun.
    pub route: RouteChanges,
}

impl LaneChanges {
    pub fn new(config: &PlanningConfig, scene: &Arc<Scene>) -> LaneChanges {
        LaneChanges { route: RouteChanges::new(scene, config.speed_rules()) }
    }

    /// Begins the next change if it is due and its lane is clear.
    pub fn seek(&mut self, config: &PlanningConfig, station_m: f64, speed_mps: f64, forecasts: &[Forecast]) {
        self.route.seek(station_m, speed_mps, |guide, change| {
            is_clear(config, guide, &|_| change.lateral_m, station_m, speed_mps, forecasts)
        });
    }

    /// Breaks off the change that is under way if it must and can be. Returns how far beside the source lane the
    /// path is, m, and its slope.
    pub fn break_off(
        &mut self,
        config: &PlanningConfig,
        station_m: f64,
        speed_mps: f64,
        forecasts: &[Forecast],
    ) -> Option<(f64, f64)> {
        let is_early = |&(_, change, begin_m): &(usize, &RouteLaneChange, f64)| {
            let part = (station_m - begin_m) / change.length_from_m(begin_m);
            begin_m <= station_m && smooth_step(part).value < BREAK_OFF_PART
        };
        let (index, change, begin_m) = self.route.begun().find(is_early)?;
        let gaps = PlanningConfig {
            change_gap_m: BREAK_OFF_GAPS * config.change_gap_m,
            change_time_s: BREAK_OFF_GAPS * config.change_time_s,
            change_oncoming_gap_m: BREAK_OFF_GAPS * config.change_oncoming_gap_m,
            change_oncoming_time_s: BREAK_OFF_GAPS * config.change_oncoming_time_s,
            ..*config
        };
        // The guide leads over already: what is left of the way to the target lane differs from place to place.
        let left_m = |at_m: f64| {
            change.postponed_offset_m(at_m, LONG_AGO_M) - change.postponed_offset_m(at_m, begin_m)
        };
        if is_clear(&gaps, self.route.guide(), &left_m, station_m, speed_mps, forecasts) {
            return None;
        }
        let done_m = |at_m: f64| change.postponed_offset_m(at_m, begin_m) - change.source_offset_m(at_m);
        let found = (done_m(station_m), done_m(station_m + 0.5) - done_m(station_m - 0.5));
        self.route.take_back(index);
        Some(found)
    }

    /// A stop where the next change is just possible.
    pub fn constrain(&self, constraints: &mut Vec<Constraint>) {
        constraints.extend(self.route.wait_m().map(|stop_m| Constraint::line(Reason::LaneChange, stop_m)));
    }
}

/// Apollo's rule: the gap in front and behind is at least 10 m and 3 s at the difference of the speeds,
/// to oncoming traffic 50 m and 5 s at their sum. `lateral_m` is how far beside the guide the target lane is.
fn is_clear(
    config: &PlanningConfig,
    guide: &Guide,
    lateral_m: &dyn Fn(f64) -> f64,
    station_m: f64,
    speed_mps: f64,
    forecasts: &[Forecast],
) -> bool {
    let half_way_m = VehicleParameters::MKZ.width_m / 2.0 + config.lateral_buffer_m;
    let (rear_m, front_m) =
        (VehicleParameters::MKZ.rear_m(station_m), VehicleParameters::MKZ.front_m(station_m));
    forecasts.iter().all(|forecast| {
        let at = guide.project(forecast.positions[0], station_m - LOOK_M, station_m + LOOK_M);
        let in_target = Beside { offset_m: at.offset_m - lateral_m(at.station_m), ..at };
        let taken = in_target.taken(forecast.forward, forecast.length_m, forecast.width_m, half_way_m);
        let Some(span) = taken else { return true };
        let along_mps = forecast.velocity_mps.dot(&at.forward);
        let oncoming = at.forward.dot(&forecast.forward) < 0.0 && along_mps < 0.0;
        let (ahead_m, behind_m) = if oncoming {
            let time_s = config.change_oncoming_time_s;
            (config.change_oncoming_gap_m.max(time_s * (speed_mps - along_mps)), 0.0)
        } else {
            let (gap_m, time_s) = (config.change_gap_m, config.change_time_s);
            (gap_m.max(time_s * (speed_mps - along_mps)), gap_m.max(time_s * (along_mps - speed_mps)))
        };
        span.from_m - front_m > ahead_m || rear_m - span.to_m > behind_m
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modular::prediction::forecasts_of;
    use crate::modular::tracking::Track;
    use crate::testing::two_lanes;
    use avastra_base::geometry::{Pose, Vec2};
    use avastra_lang::model::vocabulary::Body;

    /// Whether the left-hand lane is clear for a vehicle at 10 m/s whose rear axle is at 100 m.
    fn clear(gap_ahead_m: Option<f64>, gap_behind_m: Option<f64>, other_mps: f64) -> bool {
        let scene = two_lanes(300.0);
        let config = PlanningConfig::default();
        let changes = LaneChanges::new(&config, &scene);
        let half_m = 4.7 / 2.0;
        let front = gap_ahead_m.map(|gap_m| VehicleParameters::MKZ.front_m(100.0) + gap_m + half_m);
        let rear = gap_behind_m.map(|gap_m| VehicleParameters::MKZ.rear_m(100.0) - gap_m - half_m);
        let heading_rad = if other_mps < 0.0 { core::f64::consts::PI } else { 0.0 };
        let car = |(x_m, id): (f64, u32)| {
            let pose = Pose::new(x_m, -1.75, heading_rad);
            Track::for_tests(id, Body::Sedan, pose, Vec2::new(other_mps, 0.0))
        };
        let tracks: Vec<Track> = front.into_iter().chain(rear).zip(1..).map(car).collect();
        let forecasts = forecasts_of(&scene, &tracks, Vec2::zeros());
        is_clear(&config, changes.route.guide(), &|_| 3.5, 100.0, 10.0, &forecasts)
    }

    #[test]
    fn the_gap_is_ten_metres_or_three_seconds_of_the_difference() {
        assert!(clear(None, None, 0.0));
        for (gap_m, other_mps, expected) in [
            (9.5, 10.0, false),
            (10.5, 10.0, true),
            (14.5, 5.0, false),
            (15.5, 5.0, true),
            (10.5, 15.0, true),
        ] {
            assert_eq!(clear(Some(gap_m), None, other_mps), expected, "{gap_m} m ahead at {other_mps}");
        }
        for (gap_m, other_mps, expected) in
            [(9.5, 10.0, false), (10.5, 5.0, true), (14.5, 15.0, false), (15.5, 15.0, true)]
        {
            assert_eq!(clear(None, Some(gap_m), other_mps), expected, "{gap_m} m behind at {other_mps}");
        }
        // Oncoming: 5 s at the sum of the speeds.
        assert!(!clear(Some(95.0), None, -10.0) && clear(Some(105.0), None, -10.0));
    }
}
