//! Perception and speed control of drivers of the profile `released`, LGSVL's vehicles.
//!
//! Three rays run straight ahead from the front, from its middle and its corners, whatever the way does. An obstacle
//! that they meet within a stop distance makes the driver stop. The stop distance grows with the speed and falls with a
//! driver's aggression, 1 to 3. The speed tends to its target at a fixed rate. Figures from `NPCLaneFollowBehaviour` of
//! LGSVL's simulator 2021.3; they stand in `scene::traffic`.
//!
//! That rate is a wish of 23 to 57 m/s², which LGSVL's vehicles got because they have no tyres. Here brakes and tyres
//! bound it (`Driver::step`). So that its drivers are no worse for it, they stop from as far away as the brakes need,
//! where that is more than the published distance.

use avastra_base::geometry::{Frame, Vec2};
use avastra_base::kinematics::braking_m;
use avastra_base::rng;
use avastra_road::{Turn, is_apart};

use crate::state::driver::{Driver, Leader};
use crate::state::obstacle::choices;
use crate::state::time::DT_S;
use crate::view::around::{Around, Other, View};
use avastra_lang::model::body::BodyParameters;

/// Aggression of the least gentle driver. LGSVL.
const AGGRESSION_MAX: u32 = 3;
/// The limit for which stop distances are given, m/s: 25 mph. LGSVL.
const LIMIT_MPS: f64 = 11.176;
/// From this distance to a line on, the wanted speed falls to 0 at 1 m before it, m. LGSVL.
const LINE_M: f64 = 15.0;
const LINE_M_MIN: f64 = 1.0;
/// Within this distance before a junction the longer stop distance holds, m. LGSVL.
const BEFORE_JUNCTION_M: f64 = 10.0;
/// The stream of the draw of the aggression: no driver draws so often where to go.
const AGGRESSION_DRAW: u32 = u32::MAX;

impl Driver {
    /// Draws the aggression, once.
    pub fn take_temper(&mut self, id: u32, around: &Around) {
        if self.aggression == 0 {
            let mut rng = choices(around.seed, id, AGGRESSION_DRAW);
            self.aggression = 1 + rng::below(&mut rng, AGGRESSION_MAX);
        }
    }

    /// The obstacle that the rays meet within the stop distance.
    pub fn ray_leader(&self, view: &View) -> Option<Leader> {
        let View { this, size, around } = *view;
        let profile = around.traffic;
        let stop_m = self.stop_distance_m(size, around);
        let left = Vec2::new(-this.forward.y, this.forward.x);
        let front = this.outline.pose.position + this.forward * (size.length_m / 2.0);
        let corner = left * (size.width_m / 2.0);
        let rays = [
            (front, profile.ray_m.min(stop_m)),
            (front + corner, profile.ray_m.min(stop_m) / 2.0),
            (front - corner, profile.ray_m.min(stop_m) / 2.0),
        ];
        let mut nearest: Option<Leader> = None;
        for Other { outline, forward, velocity_mps, elevation_m } in self.minded(around) {
            let reach_m = stop_m + this.outline.radius_m() + outline.radius_m();
            let away = outline.pose.position - this.outline.pose.position;
            if away.norm_squared() > reach_m * reach_m || is_apart(this.elevation_m, elevation_m) {
                continue;
            }
            let frame = Frame::along(outline, forward);
            for (origin, reach_m) in rays {
                let Some(gap_m) = frame.ray_hit_m(origin, this.forward, reach_m) else { continue };
                if nearest.is_none_or(|found| gap_m < found.gap_m) {
                    let speed_mps = velocity_mps.dot(&this.forward);
                    nearest = Some(Leader { gap_m, speed_mps, crosswise: false });
                }
            }
        }
        nearest
    }

    /// Distance within which what a ray meets makes it stop, m.
    fn stop_distance_m(&self, size: &BodyParameters, around: &Around) -> f64 {
        let (profile, map) = (around.traffic, &around.scene.map);
        let front_m = self.station_m + size.length_m / 2.0;
        let lane = map.lane(self.way.lane_at(self.station_m).0);
        let ahead = map.lane(self.way.lane_at(front_m + BEFORE_JUNCTION_M).0);
        let goes_straight = if lane.junction.is_some() {
            lane.turn == Turn::Straight
        } else {
            ahead.junction.is_some() && ahead.turn == Turn::Straight
        };
        let most_m = if goes_straight { profile.stop_junction_m } else { profile.stop_m };
        // Cut to whole metres, as there: 20, 10 and 6 m straight through junctions.
        let at_25_mph_m = (most_m / f64::from(self.aggression.max(1))).floor();
        let at_limit_m = at_25_mph_m * lane.speed_limit_mps / LIMIT_MPS;
        let part = (self.speed_mps / lane.speed_limit_mps).clamp(0.0, 1.0);
        let published_m = profile.stop_m_min + (at_limit_m - profile.stop_m_min) * part;
        let braking_mps2 = around.braking_mps2(size, self.speed_mps);
        published_m.max(LINE_M_MIN + braking_m(self.speed_mps, braking_mps2))
    }

    /// Acceleration towards the wanted speed, m/s²: up to `wish_mps`, less before the line that is `line_m` away,
    /// none if a ray meets something.
    pub fn tending_mps2(&self, size: &BodyParameters, around: &Around, wish_mps: f64, line_m: f64) -> f64 {
        // A speed that falls in proportion to the way left asks for twice the mean braking at its begin.
        let from_m = LINE_M.max(wish_mps * wish_mps / around.braking_mps2(size, wish_mps));
        let target_mps = if self.leader.is_some() || line_m < LINE_M_MIN {
            0.0
        } else {
            wish_mps * (line_m / from_m).min(1.0)
        };
        let rate_ps = around.traffic.stop_rate_ps * f64::from(1 + self.aggression.max(1));
        // No speed passes its target within a tick.
        (rate_ps.min(1.0 / DT_S) * (target_mps - self.speed_mps)).min(size.acceleration_mps2_max)
    }
}
