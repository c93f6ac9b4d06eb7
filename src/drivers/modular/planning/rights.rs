//! Right of way where other lanes meet the ego vehicle's route in junctions: whether a road user must let it go first.
//!
//! From the map alone: lights that are never green together, signs, and the order of the lanes
//! (`sim::right_of_way`). It is asked only about futures that an object may have: one that would break the ego
//! vehicle's right of way binds the plan only if it is the more probable one. A probable future binds the plan
//! whoever has priority: a driving system that insists on its right is no better than one that forgets it.

use avastra_lang::model::vocabulary::Priority;
use avastra_road::LaneIndex;
use avastra_world::sim::{Scene, SignalColour, right_of_way};

use super::super::config::PlanningConfig;
use super::claim::Claim;

/// Two places of the route this near are one crossing, m: half a vehicle and half a lane.
const NEAR_M: f64 = 6.0;
/// Courses that differ by less are one direction: cosine of 45°.
const SAME_COSINE: f64 = 0.7;

#[derive(Debug, Clone, Default)]
pub struct RouteRights {
    meetings: Vec<Meeting>,
}

/// A place where another lane crosses or joins the route.
#[derive(Debug, Clone, Copy)]
pub struct Meeting {
    pub station_m: f64,
    /// The other lane, and the station there, m.
    pub lane: LaneIndex,
    pub lane_station_m: f64,
    /// Cosine and sine of the angle between the other lane and the route.
    cosine: f64,
    sine: f64,
    ego_first: bool,
}

impl RouteRights {
    pub fn of(config: &PlanningConfig, scene: &Scene) -> RouteRights {
        let meetings = scene.route.conflicts.iter().map(|conflict| {
            let own = scene.route.lane_at(conflict.station_m).lane;
            let ego_first =
                never_green_together(scene, own, conflict.lane) || goes_first(scene, own, conflict.lane);
            Meeting {
                station_m: conflict.station_m,
                lane: conflict.lane,
                lane_station_m: conflict.lane_station_m,
                cosine: libm::cos(conflict.angle_rad),
                sine: libm::sin(conflict.angle_rad),
                ego_first: ego_first != config.priority_misread,
            }
        });
        RouteRights { meetings: meetings.collect() }
    }

    /// The places at which another lane goes first.
    pub fn to_wait_for(&self) -> impl Iterator<Item = &Meeting> {
        self.meetings.iter().filter(|meeting| !meeting.ego_first)
    }

    /// The first of them between two stations, m.
    pub fn first_to_wait_for_m(&self, from_m: f64, to_m: f64) -> Option<f64> {
        let mut stations = self.to_wait_for().map(|meeting| meeting.station_m);
        stations.find(|at_m| (from_m..=to_m).contains(at_m))
    }

    /// Whether what a road user would do on the way takes the ego vehicle's right of way.
    pub fn owes_way(&self, claim: &Claim) -> bool {
        let entry = claim.spans[claim.first];
        let mut near = self.meetings.iter().filter(|meeting| {
            let along = entry.from_m - NEAR_M..entry.to_m + NEAR_M;
            along.contains(&meeting.station_m)
                && meeting.cosine * claim.cosine + meeting.sine * claim.sine > SAME_COSINE
        });
        near.next().is_some_and(|first| first.ego_first && near.all(|meeting| meeting.ego_first))
    }
}

fn goes_first(scene: &Scene, own: LaneIndex, other: LaneIndex) -> bool {
    right_of_way(&scene.map, |_| SignalColour::Green, own, other) == Priority::Ego
}

/// Whether both lanes have a light, and the two are of different groups.
fn never_green_together(scene: &Scene, own: LaneIndex, other: LaneIndex) -> bool {
    let group = |lane: LaneIndex| {
        let line = scene.map.stop_line_of(lane)?;
        let signal = &scene.map.signals[line.signal];
        Some((signal.junction, signal.group))
    };
    group(own).is_some_and(|own| group(other).is_some_and(|other| own != other))
}
