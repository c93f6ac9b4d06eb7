//! Other drivers: along their way by the Intelligent Driver Model.
//!
//! IDM after Treiber, Hennecke and Helbing (2000). Because IDM alone assumes brakes without limit, the brakes of the
//! body on the grip of the road and a kinematic floor are added. Ten times a second, which is their reaction time,
//! drivers look for a leader (`leader`, `foresight`). They also look for a reason to wait at a junction (`manners`) and
//! for the occasion of their next lane change (`change`). In every tick they slow down for bends, stop at red lights
//! and stop signs (`stop_line`) and follow. Everything else they do to the ego vehicle is the scenario's business.

use avastra_base::geometry::smaller;
use avastra_base::kinematics::STANDING_MPS;
use avastra_base::rng::Rng;
use avastra_lang::model::vocabulary::TrafficRule;

use crate::behave::npc::figures::{COMFORT_MPS2, GAP_M_MIN, following};
use crate::state::driver::{Driver, Leader};
use crate::state::obstacle::{Moved, choices};
use crate::state::time::{DT_S, FRAME_TICKS};
use crate::view::around::{Around, View};

/// Deceleration of a vehicle without brakes, m/s²: the engine's drag. Ours.
const DRAG_MPS2: f64 = 0.5;
/// A wished speed below this is reached exactly, m/s, because the model's acceleration would oscillate around it. A vehicle
/// that is asked to stand has a wish of 0.
const CRAWL_MPS: f64 = 0.1;
/// A driver slower than this when a wait ends sets out anew, m/s.
const SETS_OUT_MPS: f64 = 1.0;

impl Driver {
    /// One tick; `None` if it leaves the world, which it does only while the ego vehicle does not see it
    /// (`in_sight`). One that has `touched` the ego vehicle only brakes.
    pub fn step(&mut self, view: &View, touched: bool, in_sight: bool) -> Option<Moved> {
        let View { this, size, around } = *view;
        let looks = !touched && around.is_due(this.id, FRAME_TICKS);
        if looks {
            self.look(view);
        }
        if !touched {
            self.begin_aside(view);
        }
        let braking_mps2 = around.braking_mps2(size, self.speed_mps);
        let acceleration_mps2 = if touched {
            -braking_mps2
        } else {
            let brakes = !self.ignores.contains(TrafficRule::Brakes);
            let most_mps2 = if brakes { braking_mps2 } else { DRAG_MPS2 };
            self.wanted_mps2(view, braking_mps2).clamp(-most_mps2, size.acceleration_mps2_max)
        };
        let speed_mps = (self.speed_mps + acceleration_mps2 * DT_S).max(0.0);
        let way_m = (self.speed_mps + speed_mps) / 2.0 * DT_S;
        self.speed_mps = speed_mps;
        self.station_m += way_m;
        if self.gives_up() && !in_sight {
            return None;
        }
        if let Some(leader) = &mut self.leader {
            leader.gap_m += leader.speed_mps * DT_S - way_m;
        }
        // A lane that ends under a lane change goes on straight until the change is done. So does one that
        // ends at the edge of the map while the vehicle is in sight.
        if self.change.is_none() && self.station_m >= self.way.path.length_m() && !in_sight {
            return None;
        }
        // A vehicle that stands keeps its place to the bit, even if its way was laid anew.
        if way_m == 0.0 && self.change.is_none() {
            return Some(Moved::at_rest(this));
        }
        Some(self.advance_change(way_m, this.outline.pose.position, size))
    }

    /// Prolongs the way, begins a lane change that is due, and finds what to follow and what to wait for.
    fn look(&mut self, view: &View) {
        let View { this, size, around } = *view;
        self.heed_turn(view);
        if self.way.ends_soon(self.station_m) {
            let mut rng = self.draw(this.id, around);
            if let Some((way, station_m)) = self.way.prolonged(&around.scene.roads, self.station_m, &mut rng)
            {
                self.go_on_along(way, station_m);
            }
        }
        self.note_stop(size);
        self.yields_to_ego = self.is_ambient() && around.traffic.yields_to_ego;
        if let Some(part) = self.limit_part {
            self.cruise_mps = part * self.way.limit_mps(&around.scene.map, self.station_m);
        }
        if self.change.is_none() {
            self.begin_change(view);
        }
        self.leader = if around.traffic.rays {
            self.take_temper(this.id, around);
            self.ray_leader(view)
        } else {
            let beside = self.foresee(view);
            let leader = self.find_leader(view);
            let nearer = |a: &Leader, b: &Leader| a.gap_m.total_cmp(&b.gap_m);
            leader.into_iter().chain(beside).min_by(nearer)
        };
        let held = self.hold_m.is_some();
        self.hold_m = self.find_hold_m(view);
        if held && self.hold_m.is_none() && self.speed_mps < SETS_OUT_MPS {
            self.insists_to_m = self.junction_end_m(size);
        }
    }

    /// The lowest acceleration that the cruising speed, bends, the leader, a light or a wait demands.
    fn wanted_mps2(&mut self, view: &View, braking_mps2: f64) -> f64 {
        let View { size, around, .. } = *view;
        let mut bend_mps = self.way.speed_mps_max(self.station_m);
        if let Some(change) = &self.change {
            bend_mps = bend_mps.min(change.to.speed_mps_max(change.to_station_m));
        }
        let pursued_mps2 = if self.pursuit.is_some() { self.pursue_mps2(view, bend_mps) } else { None };
        let wish_mps = self.cruise_mps.min(bend_mps);
        let front_m = self.station_m + size.length_m / 2.0;
        let end_m = if self.change.is_none() { self.way.end_m } else { None };
        let line_ahead_m = [
            self.stop_gap_m(size, around, braking_mps2),
            self.sign_gap_m(size, braking_mps2),
            end_m.map(|end_m| end_m - front_m),
            self.hold_m.map(|hold_m| hold_m - front_m),
        ];
        let line_ahead_m = line_ahead_m.into_iter().flatten().fold(f64::INFINITY, smaller);
        let is_free = self.leader.is_none() && line_ahead_m == f64::INFINITY;
        let is_told = self.ordered_mps2.is_some() || pursued_mps2.is_some();
        if around.traffic.rays && !(is_free && is_told) {
            return self.tending_mps2(size, around, wish_mps, line_ahead_m);
        }
        // To be too fast is no emergency.
        let free_mps2 = if let Some(pursued_mps2) = pursued_mps2 {
            let braking_mps2 = self.ordered_mps2.unwrap_or(COMFORT_MPS2).max(COMFORT_MPS2);
            pursued_mps2.clamp(-braking_mps2, self.ordered_mps2.unwrap_or(size.acceleration_mps2_max))
        } else if let Some(rate_mps2) = self.ordered_mps2 {
            let braking_mps2 =
                if bend_mps < self.cruise_mps { rate_mps2.max(COMFORT_MPS2) } else { rate_mps2 };
            ((wish_mps - self.speed_mps) / DT_S).clamp(-braking_mps2, rate_mps2)
        } else if wish_mps < CRAWL_MPS {
            ((wish_mps - self.speed_mps) / DT_S).clamp(-COMFORT_MPS2, size.acceleration_mps2_max)
        } else {
            following(size.acceleration_mps2_max, self.time_gap_s)
                .free_mps2(self.speed_mps, wish_mps)
                .max(-COMFORT_MPS2)
        };
        let mut wanted_mps2 = free_mps2;
        if let Some(leader) = &self.leader {
            wanted_mps2 = wanted_mps2.min(self.follow_mps2(size, leader, free_mps2));
        }
        if let Some(braking_mps2) = self.braking_for_kept_mps2(size, around) {
            wanted_mps2 = wanted_mps2.min(-braking_mps2);
        }
        if line_ahead_m < f64::INFINITY {
            wanted_mps2 = wanted_mps2.min(self.follow_mps2(size, &Leader::line(line_ahead_m), free_mps2));
        }
        wanted_mps2
    }

    /// Counts a tick at rest because of others; `true` if it has waited so long that it would leave.
    fn gives_up(&mut self) -> bool {
        let blocked = self.leader.is_some_and(|leader| leader.crosswise && leader.gap_m < GAP_M_MIN + 3.0);
        if self.speed_mps >= STANDING_MPS {
            self.waited_ticks = 0;
        } else if self.hold_m.is_some() || blocked {
            self.waited_ticks += 1;
        }
        self.has_given_up()
    }

    /// The stream of its next draw of where to go.
    pub fn draw(&mut self, id: u32, around: &Around) -> Rng {
        self.draws += 1;
        choices(around.seed, id, self.draws - 1)
    }
}
