//! A planned drive along the route: where, how fast, and why.

pub use crate::kit::Point;
use crate::status::Reason;
use avastra_base::geometry::larger;
use avastra_world::sim::VehicleParameters;

use super::claim::Claim;

/// Time between points of a trajectory, s.
pub const POINT_S: f64 = 0.1;
/// Points of a trajectory: 8 s.
pub const POINTS: usize = 81;

/// A plan of 8 s, every 0.1 s.
#[derive(Debug, Clone)]
pub struct Trajectory {
    pub points: [Point; POINTS],
    /// The constraint that decides its beginning.
    pub reason: Reason,
}

impl Default for Trajectory {
    fn default() -> Trajectory {
        Trajectory { points: [Point::default(); POINTS], reason: Reason::Start }
    }
}

impl Trajectory {
    /// The point a time (s) after the beginning, interpolated; the last one afterwards.
    pub fn at(&self, time_s: f64) -> Point {
        let place = larger(time_s / POINT_S, 0.0);
        let index = place as u32 as usize;
        if index >= POINTS - 1 {
            return self.points[POINTS - 1];
        }
        let fraction = place - f64::from(index as u32);
        self.points[index].mixed(&self.points[index + 1], fraction)
    }

    /// Constant braking to rest.
    pub fn braking(start: Point, decel_mps2: f64, reason: Reason) -> Trajectory {
        let mut trajectory = Trajectory { reason, ..Trajectory::default() };
        let mut point = Point { acceleration_mps2: -decel_mps2, ..start };
        for slot in &mut trajectory.points {
            *slot = point;
            point = point.after(-decel_mps2);
        }
        trajectory
    }

    /// When this plan first comes into the part of the way that a claim takes: s from now, and the station
    /// of the claim's near end then. The plan is widened by `buffer_s` to both sides in time.
    ///
    /// A road user that comes onto the way behind the vehicle and drives along it keeps its distance itself.
    pub fn meets(&self, claim: &Claim, buffer_s: f64) -> Option<(f64, f64)> {
        let vehicle = VehicleParameters::MKZ;
        let rear_m = vehicle.rear_m(self.at((claim.entry_s() - buffer_s).max(0.0)).station_m);
        if claim.goes_along() && claim.spans[claim.first].to_m < rear_m {
            return None;
        }
        claim.steps().find_map(|(time_s, span)| {
            let from_m = vehicle.rear_m(self.at((time_s - buffer_s).max(0.0)).station_m);
            let to_m = vehicle.front_m(self.at(time_s + buffer_s).station_m);
            (span.from_m <= to_m && span.to_m >= from_m).then_some((time_s, span.from_m))
        })
    }
}

impl Point {
    /// One point on, at an acceleration; there is no driving backwards.
    pub fn after(&self, acceleration_mps2: f64) -> Point {
        let speed_mps = larger(self.speed_mps + acceleration_mps2 * POINT_S, 0.0);
        Point {
            station_m: self.station_m + (self.speed_mps + speed_mps) / 2.0 * POINT_S,
            speed_mps,
            acceleration_mps2: if speed_mps > 0.0 {
                acceleration_mps2
            } else {
                larger(acceleration_mps2, 0.0)
            },
        }
    }
}
