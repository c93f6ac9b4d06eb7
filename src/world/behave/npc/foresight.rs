//! Outlines that would meet in a tight turn.
//!
//! Leaders are looked for in a corridor as wide as the vehicle, and conflict areas are between lanes. A bus in a bend,
//! however, sweeps more than its lane. So inside junctions drivers look two seconds ahead: where both would be if they
//! went on as they do, and stop before the outlines meet. They look at vehicles whose centre is ahead of their own, and
//! at slower ones, into which their tail could swing. Commanded vehicles do not look at the ego vehicle in this way.

use core::cell::LazyCell;

use crate::scene::way::body_at;
use crate::state::driver::{Driver, Leader};
use crate::state::obstacle::Obstacle;
use crate::view::around::View;
use avastra_base::geometry::{OrientedBox, Pose, distance_m};
use avastra_road::is_apart;

/// Moments ahead that are looked at, s.
const MOMENTS_S: [f64; 5] = [0.4, 0.8, 1.2, 1.6, 2.0];
/// Speed that a vehicle at rest assumes for itself, m/s.
const CREEP_MPS: f64 = 1.0;
/// Outlines are kept this far apart, m.
const ROOM_M: f64 = 0.3;
/// Vehicles farther away do not matter, m: two school buses and a car's length.
const NEAR_M: f64 = 16.0;
/// Room left before the place where they would meet, m.
const STOP_M: f64 = 1.0;

impl Driver {
    /// A vehicle that the own outline would soon meet, as a leader that stands there.
    pub fn foresee(&self, view: &View) -> Option<Leader> {
        let View { this, size, around } = *view;
        let half_m = size.length_m / 2.0;
        let turns = |station_m: f64| around.scene.map.lane(self.way.lane_at(station_m).0).junction.is_some();
        if self.change.is_some() || !(turns(self.station_m + half_m) || turns(self.station_m - half_m)) {
            return None;
        }
        let here = &this.outline.pose;
        let matters = |outline: &OrientedBox, elevation_m: f64, speed_mps: f64| {
            let away = outline.pose.position - here.position;
            away.norm_squared() < NEAR_M * NEAR_M
                && !is_apart(this.elevation_m, elevation_m)
                && (this.forward.dot(&away) > 0.0 || speed_mps < self.speed_mps)
        };
        // The own poses at those moments, worked out only if there is a vehicle to meet.
        let speed_mps = self.speed_mps.max(CREEP_MPS);
        let own = LazyCell::new(|| {
            MOMENTS_S.map(|time_s| {
                self.beside_way(body_at(&self.way.path, self.station_m + speed_mps * time_s, size).0)
            })
        });
        let mut free_m = f64::INFINITY;
        let foresees_ego = self.yields_to_ego && !around.traffic.takes_right;
        if foresees_ego && matters(around.ego_outline, around.ego_elevation_m, around.ego.speed_mps) {
            let ego = |time_s| Pose {
                position: around.ego_outline.pose.position + around.ego_velocity_mps * time_s,
                ..around.ego_outline.pose
            };
            free_m = free_m.min(free_way_m(this, &own, speed_mps, around.ego_outline, ego));
        }
        for (obstacle, body, driver) in around.drivers() {
            if driver.change.is_some() || !matters(&obstacle.outline, obstacle.elevation_m, driver.speed_mps)
            {
                continue;
            }
            let other = |time_s| {
                let station_m = driver.station_m + driver.speed_mps * time_s;
                driver.beside_way(body_at(&driver.way.path, station_m, body).0)
            };
            free_m = free_m.min(free_way_m(this, &own, speed_mps, &obstacle.outline, other));
        }
        free_m.is_finite().then_some(Leader { gap_m: free_m + STOP_M, speed_mps: 0.0, crosswise: true })
    }
}

/// How far `this` gets at a speed, through the poses `own`, before its outline would meet another, m;
/// infinite if it would not.
fn free_way_m(
    this: &Obstacle,
    own: &[Pose; MOMENTS_S.len()],
    speed_mps: f64,
    outline: &OrientedBox,
    other_at: impl Fn(f64) -> Pose,
) -> f64 {
    let near_m = this.outline.radius_m() + outline.radius_m() + ROOM_M;
    let mut free_m = 0.0;
    for (time_s, pose) in MOMENTS_S.into_iter().zip(own) {
        let other = OrientedBox { pose: other_at(time_s), ..*outline };
        let apart = other.pose.position - pose.position;
        if apart.norm_squared() < near_m * near_m {
            let own = OrientedBox { pose: *pose, ..this.outline };
            if distance_m(&own, &other) < ROOM_M {
                return free_m;
            }
        }
        free_m = speed_mps * time_s;
    }
    f64::INFINITY
}
