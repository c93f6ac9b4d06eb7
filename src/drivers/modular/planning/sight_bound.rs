//! Speed bounded by what can be seen: the vehicle must be able to stop within the distance that it can see
//! to be clear ("assured clear distance ahead").
//!
//! *Ahead.* Stopping sight distance, as AASHTO's Green Book has it: d = v·t + v²/(2a). `d` is the range in which the
//! perception surely sees a pedestrian in this weather and light; `a` is the hardest braking of a plan. Where a
//! high vehicle beside the way hides the edge of a crosswalk, nothing is assured there, and the vehicle comes no
//! faster than to an unprotected turn.
//!
//! *Along lanes that go first.* Where another lane crosses or joins the way and goes first, a vehicle is taken to come
//! on it at its speed limit, just where it cannot be seen: beyond the range in which vehicles are surely seen, or
//! behind a vehicle that hides the lane. Before the place at which it can no longer stop short of that lane, the ego
//! vehicle may be only so fast that it could yield to such a vehicle, or would be gone before it. Where no speed is
//! slow enough, as in thick fog, it creeps to the edge of that lane, from where it sees farthest, and can stop until
//! then. To reckon with hidden road users is rule 4 of RSS (Shalev-Shwartz et al. 2017): be cautious where the view is
//! limited. IEEE 2846 asks for an assumption about their greatest speed. That it is the speed limit is ours.
//!
//! Left out: crests, as the maps are flat, and what buildings hide, as the maps have none.

use crate::kit::Guide;
use crate::status::Reason;
use avastra_base::geometry::{Frame, OrientedBox, Pose, Vec2};
use avastra_base::kinematics;
use avastra_road::{LaneIndex, RoadMap};
use avastra_world::sim::{Conditions, Scene, VehicleParameters};

use super::super::config::{PerceptionConfig, PlanningConfig};
use super::super::perception::surely_seen_m;
use super::super::prediction::Forecast;
use super::rights::{Meeting, RouteRights};
use super::speed::Constraint;
use super::stages::CROSSING_ROOM_M;
use super::trajectory::Point;

/// A vehicle so high hides a pedestrian, m: the height of one.
const HIGH_M: f64 = 1.75;
/// A vehicle so high hides a car, m: a low one.
const CAR_M: f64 = 1.4;
/// Slower vehicles beside the way are taken to stand, m/s. Ours.
const SLOW_MPS: f64 = 2.0;
/// A vehicle hides a place that it stands so near before, m, if it is so near beside the way, m: in the next
/// lane or at the kerb. Ours.
const BEFORE_M: f64 = 15.0;
const BESIDE_M: f64 = 5.0;
/// Places farther ahead do not matter yet, m.
const LOOK_M: f64 = 60.0;
/// A lane that goes first is looked along so far, in steps of, m: farther than vehicles are surely seen.
const ALONG_M: f64 = 80.0;
const STEP_M: f64 = 4.0;
/// A vehicle so near to one of these steps is on the lane, and decided about itself, m: half a step, and 1.5 m beside.
const ON_LANE_M: f64 = 2.5;
/// Speeds are tried in steps of, m/s.
const TRY_MPS: f64 = 0.5;

#[derive(Debug, Clone, Default)]
pub struct SightBound {
    /// Crosswalks, from and to, m.
    crosswalks_m: Vec<(f64, f64)>,
    prior: Vec<PriorLane>,
    /// The sensors as the planner is told of them, without planted faults.
    sensors: PerceptionConfig,
    /// Whether the road is a motorway: nobody is expected on foot there (Vienna Convention on Road Traffic, article 25).
    is_motorway: bool,
    /// The conditions that the ranges were worked out for, and these.
    known: Option<(Conditions, Seen)>,
}

/// The sure range of the sensors, and the speed that it allows.
#[derive(Debug, Clone, Copy)]
struct Seen {
    /// The speed that this allows, m/s.
    allowed_mps: f64,
    /// How far vehicles are seen, m.
    vehicle_m: f64,
}

/// A lane that crosses or joins the way and goes first.
#[derive(Debug, Clone)]
struct PriorLane {
    /// Where it meets the way, m.
    station_m: f64,
    /// The highest limit on it, m/s.
    limit_mps: f64,
    /// Its middle from there on against its direction, every [`STEP_M`].
    upstream: Vec<Vec2>,
}

impl SightBound {
    pub fn new(scene: &Scene, rights: &RouteRights) -> SightBound {
        let prior = rights.to_wait_for().map(|meeting| PriorLane::of(&scene.map, meeting)).collect();
        SightBound {
            crosswalks_m: scene.route.crosswalks_m.clone(),
            prior,
            sensors: PerceptionConfig::default().on(scene),
            is_motorway: scene.is_motorway,
            known: None,
        }
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
        let seen = self.seen(config, conditions);
        if seen.allowed_mps < config.cruise_mps {
            let (from_m, to_m) = (f64::NEG_INFINITY, f64::INFINITY);
            constraints.push(Constraint::limit(Reason::Sight, from_m, to_m, seen.allowed_mps));
        }
        let front_m = VehicleParameters::MKZ.front_m(start.station_m);
        let slowing_m = |speed_mps: f64| {
            let lost_m2ps2 = start.speed_mps * start.speed_mps - speed_mps * speed_mps;
            lost_m2ps2.max(0.0) / (2.0 * config.comfortable_mps2)
        };
        for &(from_m, to_m) in &self.crosswalks_m {
            if to_m < front_m || from_m > front_m + LOOK_M {
                continue;
            }
            if forecasts.iter().any(|forecast| hides(guide, forecast, from_m)) {
                let begin_m = from_m - slowing_m(0.0);
                constraints.push(Constraint::limit(Reason::Sight, begin_m, to_m, config.approach_mps));
            }
        }
        for lane in &self.prior {
            let edge_m = lane.station_m - CROSSING_ROOM_M;
            if edge_m < front_m || edge_m > front_m + LOOK_M {
                continue;
            }
            // Lines of sight begin on the roof.
            let eye = guide.position_at(start.station_m + VehicleParameters::MKZ.rear_axle_to_centre_m());
            let hidden_m = lane.hidden_from_m(eye, forecasts);
            let cap_mps = guide.speed_mps_max(lane.station_m).min(config.cruise_mps);
            if let Some(speed_mps) = lane.bound_mps(config, seen.vehicle_m, hidden_m, front_m, cap_mps) {
                let begin_m = edge_m - stopping_m(config, speed_mps) - slowing_m(speed_mps);
                constraints.push(Constraint::limit(Reason::Sight, begin_m, edge_m, speed_mps));
            }
        }
    }

    fn seen(&mut self, config: &PlanningConfig, conditions: &Conditions) -> Seen {
        // Water and friction change with the speed; they do not matter here.
        let same = |known: &Conditions| {
            (known.light, known.rain_mmph, known.visibility_m)
                == (conditions.light, conditions.rain_mmph, conditions.visibility_m)
        };
        match &self.known {
            Some((known, seen)) if same(known) => *seen,
            _ => {
                let (pedestrian_m, vehicle_m) = surely_seen_m(&self.sensors, conditions);
                let clear_m = if self.is_motorway { vehicle_m } else { pedestrian_m };
                let seen = Seen { allowed_mps: stoppable_mps(config, clear_m), vehicle_m };
                self.known = Some((*conditions, seen));
                seen
            }
        }
    }
}

impl PriorLane {
    fn of(map: &RoadMap, meeting: &Meeting) -> PriorLane {
        let (mut lane, mut at_m) = (meeting.lane, meeting.lane_station_m);
        let limit = |lane: LaneIndex| map.lane(lane).speed_limit_mps;
        let mut limit_mps = limit(lane);
        let mut upstream = Vec::new();
        for _ in 0..=(ALONG_M / STEP_M) as usize {
            while at_m < 0.0 {
                // If several lanes lead to it, the first will do.
                let Some(&before) = map.lane(lane).predecessors.first() else { break };
                lane = before;
                at_m += map.lane(lane).centre.length_m();
                limit_mps = limit_mps.max(limit(lane));
            }
            if at_m < 0.0 {
                break;
            }
            upstream.push(map.lane(lane).centre.pose_at(at_m).position);
            at_m -= STEP_M;
        }
        PriorLane { station_m: meeting.station_m, limit_mps, upstream }
    }

    /// How far from the meeting the lane is hidden from an eye by vehicles beside it, m; infinite if it is not.
    fn hidden_from_m(&self, eye: Vec2, forecasts: &[Forecast]) -> f64 {
        let mut hidden_m = f64::INFINITY;
        for forecast in forecasts.iter().filter(|forecast| forecast.height_m >= CAR_M) {
            let position = forecast.positions[0];
            let near = |point: &Vec2| (point - position).norm_squared() < ON_LANE_M * ON_LANE_M;
            let reach_m = ALONG_M + forecast.length_m;
            if (position - eye).norm_squared() > reach_m * reach_m || self.upstream.iter().any(near) {
                continue;
            }
            let pose = Pose { position, heading_rad: forecast.heading_rad };
            let outline = OrientedBox::new(pose, forecast.length_m, forecast.width_m);
            let frame = Frame::along(&outline, forecast.forward);
            let is_hidden = |point: &Vec2| {
                let to = point - eye;
                let distance_m = to.norm().max(1e-6);
                frame.ray_hit_m(eye, to / distance_m, distance_m).is_some()
            };
            if let Some(index) = self.upstream.iter().position(is_hidden) {
                hidden_m = hidden_m.min(index as f64 * STEP_M);
            }
        }
        hidden_m
    }

    /// The speed up to the lane's edge at which the vehicle can yield to what it cannot see yet, or be gone before it
    /// comes; `None` if `cap_mps` is no faster.
    fn bound_mps(
        &self,
        config: &PlanningConfig,
        seen_m: f64,
        hidden_m: f64,
        front_m: f64,
        cap_mps: f64,
    ) -> Option<f64> {
        let edge_m = self.station_m - CROSSING_ROOM_M;
        let clear_m = self.station_m + CROSSING_ROOM_M + VehicleParameters::MKZ.length_m;
        let is_safe = |speed_mps: f64| {
            // From here on it can no longer stop before the lane.
            let at_m = (edge_m - stopping_m(config, speed_mps)).max(front_m);
            let comes_m = hidden_m.min(seen_m - (self.station_m - at_m));
            let gone_s = time_to_drive_s(config, speed_mps, cap_mps, clear_m - at_m);
            gone_s + config.conflict_buffer_s <= comes_m / self.limit_mps
        };
        if is_safe(cap_mps) {
            return None;
        }
        let slower = core::iter::successors(Some(cap_mps - TRY_MPS), |speed_mps| Some(speed_mps - TRY_MPS));
        let mut tried = slower.take_while(|speed_mps| *speed_mps > config.approach_mps);
        Some(tried.find(|speed_mps| is_safe(*speed_mps)).unwrap_or(config.approach_mps))
    }
}

/// Greatest speed from which the vehicle stops within a distance: v·t + v²/(2a) = d, solved for v.
fn stoppable_mps(config: &PlanningConfig, distance_m: f64) -> f64 {
    let (time_s, decel_mps2) = (config.sight_reaction_s, config.deceleration_mps2_max);
    decel_mps2 * ((time_s * time_s + 2.0 * distance_m / decel_mps2).sqrt() - time_s)
}

/// The way in which the vehicle stops, m.
fn stopping_m(config: &PlanningConfig, speed_mps: f64) -> f64 {
    kinematics::stopping_m(speed_mps, config.sight_reaction_s, config.deceleration_mps2_max)
}

/// Time for a way from a speed on, as fast as a plan accelerates, up to another speed, s.
fn time_to_drive_s(config: &PlanningConfig, speed_mps: f64, cap_mps: f64, way_m: f64) -> f64 {
    let (gain_mps2, cap_mps) = (config.acceleration_mps2_max, cap_mps.max(speed_mps));
    let until_cap_m = (cap_mps * cap_mps - speed_mps * speed_mps) / (2.0 * gain_mps2);
    if way_m <= until_cap_m {
        return ((speed_mps * speed_mps + 2.0 * gain_mps2 * way_m).sqrt() - speed_mps) / gain_mps2;
    }
    (cap_mps - speed_mps) / gain_mps2 + (way_m - until_cap_m) / cap_mps
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
    use crate::modular::prediction::forecasts_of;
    use crate::modular::tracking::Track;
    use crate::testing::{CLEAR_DAY, straight};
    use avastra_lang::model::vocabulary::Body;

    #[test]
    fn it_can_stop_within_what_it_sees() {
        let config = PlanningConfig::default();
        for distance_m in [5.0, 16.0, 60.0] {
            let speed_mps = stoppable_mps(&config, distance_m);
            assert!((stopping_m(&config, speed_mps) - distance_m).abs() < 1e-9);
        }
    }

    #[test]
    fn fog_and_night_slow_it_down_and_the_clear_day_does_not() {
        let config = PlanningConfig::default();
        let mut sight = SightBound::new(&straight(), &RouteRights::default());
        let clear = sight.seen(&config, &CLEAR_DAY);
        let fog = sight.seen(&config, &Conditions { visibility_m: 50.0, ..CLEAR_DAY });
        let night = sight.seen(&config, &Conditions { light: 0.0, ..CLEAR_DAY });
        assert!(clear.allowed_mps > config.cruise_mps, "{clear:?}");
        assert!((5.0..9.0).contains(&fog.allowed_mps), "{fog:?}");
        assert!((8.0..clear.allowed_mps).contains(&night.allowed_mps), "{night:?}");
        assert!(fog.vehicle_m < 25.0 && clear.vehicle_m > 50.0, "{fog:?} {clear:?}");
    }

    /// Oncoming traffic on a lane that meets the way at 100 m.
    fn oncoming() -> PriorLane {
        let upstream = (0..=20).map(|index| Vec2::new(100.0 + STEP_M * f64::from(index), 2.0)).collect();
        PriorLane { station_m: 100.0, limit_mps: 11.18, upstream }
    }

    #[test]
    fn a_turn_is_committed_to_only_as_fast_as_what_comes_unseen_can_be_yielded_to() {
        let config = PlanningConfig::default();
        let edge_m = 100.0 - CROSSING_ROOM_M;
        let bound = |seen_m, hidden_m, ahead_m: f64| {
            oncoming().bound_mps(&config, seen_m, hidden_m, edge_m - ahead_m, 8.0)
        };
        assert_eq!(bound(200.0, f64::INFINITY, 40.0), None, "all is seen");
        let day = bound(54.0, f64::INFINITY, 40.0).expect("is slower");
        assert!((config.approach_mps..6.0).contains(&day) && day > config.approach_mps, "{day}");
        assert_eq!(bound(20.0, f64::INFINITY, 40.0), Some(config.approach_mps), "thick fog");
        assert_eq!(bound(200.0, 16.0, 40.0), Some(config.approach_mps), "is hidden");
    }

    #[test]
    fn a_vehicle_beside_a_lane_hides_it_and_one_on_it_does_not() {
        let scene = straight();
        let at = |x_m: f64, y_m: f64| {
            let track = Track::for_tests(1, Body::SchoolBus, Pose::new(x_m, y_m, 0.0), Vec2::zeros());
            let forecasts = forecasts_of(&scene, &[track], Vec2::zeros());
            oncoming().hidden_from_m(Vec2::new(96.0, -2.0), &forecasts)
        };
        assert!(at(112.0, -0.5) < 80.0, "waits to turn left opposite");
        assert!(at(112.0, 2.0).is_infinite(), "comes itself");
        assert!(at(112.0, -9.0).is_infinite(), "stands elsewhere");
    }
}
