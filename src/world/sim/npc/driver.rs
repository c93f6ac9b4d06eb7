//! Other drivers: along their way by the Intelligent Driver Model.
//!
//! IDM after Treiber, Hennecke and Helbing (2000), with the brakes of the body on the grip of the
//! road and a kinematic floor, because IDM alone assumes brakes without limit. Ten times a second,
//! which is their reaction time, drivers look for a leader (`leader`, `foresight`), for a reason to wait
//! at a junction (`manners`) and for the occasion of their next lane change (`change`); in every tick
//! they slow down for bends, stop at red lights and stop signs (`stop_line`) and follow. What else they do to the ego
//! vehicle is the scenario's business.

use std::sync::Arc;

use crate::action::LaneChangeRules;
use avastra_base::kinematics::STANDING_MPS;
use avastra_base::rng;
use avastra_base::rng::{Rng, Stream};
use avastra_lang::model::command::IgnoredRules;
use avastra_lang::model::vocabulary::{Side, TrafficRule};

use crate::scene::Scene;
use crate::scene::way::{Way, body_at};
use crate::sim::around::Around;
use crate::sim::body::BodyParameters;
use crate::sim::road_user::{Moved, Obstacle};
use crate::state::time::DT_S;
use crate::state::time::FRAME_TICKS;
use crate::state::trace::Trace;

use super::aside::Aside;
use super::change::{BrokenOff, Change, PlannedChange};
use super::leader::{Leader, TIME_GAP_S, following};
use super::manners::GIVE_UP_S;
use super::pursuit::Pursuit;
use super::turn::MeantTurn;

/// What slows down a vehicle without brakes, m/s²: the engine's drag. Ours.
const DRAG_MPS2: f64 = 0.5;
/// IDM: comfortable deceleration, m/s². Ours.
pub(super) const COMFORT_MPS2: f64 = 2.0;
/// IDM: gap at standstill, m: that of its authors.
pub(super) const GAP_M_MIN: f64 = 2.0;
/// How far drivers look ahead beyond the way on which they could stop gently, m.
pub(super) const LOOK_AHEAD_M: f64 = 25.0;
/// Room that drivers want free beside the outline, m.
pub(super) const SIDE_ROOM_M: f64 = 0.2;
/// A wished speed below this is reached exactly, m/s, because the model's acceleration would oscillate around it. A vehicle
/// that is asked to stand has a wish of 0.
const CRAWL_MPS: f64 = 0.1;
/// A driver slower than this when a wait ends sets out anew, m/s.
const SETS_OUT_MPS: f64 = 1.0;

/// How fast a driver wants to drive, and how it treats the ego vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::sim) enum Cruise {
    /// At the speed that an action asked for, m/s, and without yielding to the ego vehicle at junctions.
    Commanded(f64),
    /// At a part of each lane's limit, yielding to all others: ambient traffic.
    Limit(f64),
}

#[derive(Debug, Clone)]
pub(in crate::sim) struct Driver {
    /// The way that it follows now.
    pub way: Arc<Way>,
    /// Station on the way: on a straight one, that of the outline's centre (see [`body_at`]).
    pub station_m: f64,
    pub speed_mps: f64,
    pub(super) cruise_mps: f64,
    /// How fast it goes over to `cruise_mps`, m/s², if it was ordered so.
    pub(super) ordered_mps2: Option<f64>,
    /// That it keeps behind a leader, s.
    pub(super) time_gap_s: f64,
    /// Part of the limits that it drives at; `None` if its speed was asked for.
    limit_part: Option<f64>,
    pub(super) yields_to_ego: bool,
    /// 1 to 3 in a profile that has it; 0 before the first look.
    pub(super) aggression: u32,
    pub(super) leader: Option<Leader>,
    /// Station at which it waits for others, or will.
    pub(super) hold_m: Option<f64>,
    /// After a wait it goes on up to this station, whatever comes.
    pub(super) insists_to_m: f64,
    /// It has stood at the stop sign's line at this station, and at those before.
    pub(super) stopped_to_m: f64,
    /// Ticks at rest because of others.
    pub(super) waited_ticks: u32,
    pub(super) change: Option<Change>,
    /// What it was told to do to the side, if it was told something.
    pub(super) aside: Option<Box<Aside>>,
    /// The rules of the road that it was told to ignore.
    pub ignores: IgnoredRules,
    /// Whether it is an emergency vehicle under way: it passes lights and signs, and all others wait for it.
    pub has_siren: bool,
    /// What it was told to do beside the ego vehicle. It says the speed, in place of `cruise_mps`.
    pub(super) pursuit: Option<Box<Pursuit>>,
    /// By how much it missed the moment of its last `early`, s; below 0 if it was too soon.
    pub late_s: Option<f64>,
    /// Where it was told to go at the next junction.
    pub(super) turn: Option<MeantTurn>,
    pub(super) last_change: Option<Side>,
    /// In reverse order: the next manoeuvre is last.
    pub(super) plan: Vec<PlannedChange>,
    /// Rules of the space on its lane changes, those of orders among them.
    pub lane_changes: Vec<Arc<LaneChangeRules>>,
    /// How often it drew where to go, so that each draw has its own stream.
    draws: u32,
}

/// What a driver decides by: itself as others see it, its body, and the world around it.
pub(in crate::sim) struct View<'a> {
    pub this: &'a Obstacle,
    pub size: &'a BodyParameters,
    pub around: &'a Around<'a>,
}

impl Driver {
    /// A driver with its centre at a station of a way, at its cruising speed or what the bend there
    /// allows. `plan` is in order.
    pub fn new(
        scene: &Scene,
        way: Arc<Way>,
        station_m: f64,
        cruise: Cruise,
        mut plan: Vec<PlannedChange>,
    ) -> Driver {
        plan.reverse();
        let (cruise_mps, limit_part) = match cruise {
            Cruise::Commanded(speed_mps) => (speed_mps, None),
            Cruise::Limit(part) => (part * way.limit_mps(&scene.map, station_m), Some(part)),
        };
        Driver {
            speed_mps: cruise_mps.min(way.speed_mps_max(station_m)),
            way,
            station_m,
            cruise_mps,
            ordered_mps2: None,
            time_gap_s: TIME_GAP_S,
            limit_part,
            yields_to_ego: false,
            aggression: 0,
            leader: None,
            hold_m: None,
            insists_to_m: f64::NEG_INFINITY,
            stopped_to_m: f64::NEG_INFINITY,
            waited_ticks: 0,
            change: None,
            aside: None,
            ignores: IgnoredRules::default(),
            has_siren: false,
            pursuit: None,
            late_s: None,
            turn: None,
            last_change: None,
            plan,
            lane_changes: Vec::new(),
            // That of its way.
            draws: 1,
        }
    }

    pub fn is_changing_lanes(&self) -> bool {
        self.change.is_some()
    }

    /// Where it is before its first tick.
    pub fn moved(&self, size: &BodyParameters) -> Moved {
        let pose = self.beside_way(body_at(&self.way.path, self.station_m, size));
        let forward = pose.forward();
        Moved {
            pose,
            forward,
            lane_heading_rad: self.lane_heading_rad(),
            velocity_mps: forward * self.speed_mps,
        }
    }

    /// Heading of the way where it is, rad.
    pub(super) fn lane_heading_rad(&self) -> f64 {
        self.way.path.heading_at(self.station_m)
    }

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

    /// Takes another way that begins like its own, and on which it is at this station.
    pub(super) fn go_on_along(&mut self, way: Arc<Way>, station_m: f64) {
        self.insists_to_m += station_m - self.station_m;
        self.stopped_to_m += station_m - self.station_m;
        (self.way, self.station_m) = (way, station_m);
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
        let line_ahead_m = line_ahead_m.into_iter().flatten().fold(f64::INFINITY, f64::min);
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

    /// Whether it has waited for others so long that it would leave if it were not seen.
    pub fn has_given_up(&self) -> bool {
        f64::from(self.waited_ticks) * DT_S >= GIVE_UP_S
    }

    /// Whether it was asked to stand, and does.
    pub fn is_parked(&self) -> bool {
        self.cruise_mps == 0.0 && self.speed_mps == 0.0 && self.pursuit.is_none()
    }

    /// Whether no action commanded it.
    pub(super) fn is_ambient(&self) -> bool {
        self.limit_part.is_some()
    }

    /// The stream of its next draw of where to go.
    pub(super) fn draw(&mut self, id: u32, around: &Around) -> Rng {
        self.draws += 1;
        choices(around.seed, id, self.draws - 1)
    }

    /// Feeds every bit that later ticks depend on to `trace`; ways follow from the draws
    /// and from what it was told for the next junction.
    pub fn trace(&self, trace: &mut Trace) {
        let Driver {
            station_m,
            speed_mps,
            cruise_mps,
            ordered_mps2,
            time_gap_s,
            aggression,
            leader,
            hold_m,
            insists_to_m,
            stopped_to_m,
            waited_ticks,
            change,
            aside,
            ignores,
            has_siren,
            pursuit,
            turn,
            last_change,
            plan,
            draws,
            limit_part,
            yields_to_ego,
            // The way follows from where it appeared and from what it drew, changed and was told since.
            way: _,
            // Rules permit what is then seen in `change`.
            lane_changes: _,
            // No tick reads it.
            late_s: _,
        } = self;
        trace.flags([
            leader.is_some(),
            hold_m.is_some(),
            ordered_mps2.is_some(),
            change.is_some(),
            aside.is_some(),
            pursuit.is_some(),
            turn.is_some(),
            last_change.is_some(),
            limit_part.is_some(),
            *has_siren,
            *yields_to_ego,
        ]);
        trace.numbers([*station_m, *speed_mps, *cruise_mps, *time_gap_s, *insists_to_m, *stopped_to_m]);
        trace.words([*waited_ticks, *aggression, *draws].map(u64::from));
        // What is planned was drawn as it appeared: how much of it is left tells the rest.
        trace.words([u64::from(ignores.bits()), plan.len() as u64]);
        if let Some(Leader { gap_m, speed_mps, crosswise }) = *leader {
            trace.numbers([gap_m, speed_mps]);
            trace.flags([crosswise]);
        }
        trace.numbers(hold_m.iter().chain(ordered_mps2).chain(limit_part).copied());
        // The way that it leads to follows from the lane that it leaves and the side.
        if let Some(Change { to: _, to_station_m, progress, duration_s, ends_m, broken_off }) = change {
            trace.numbers([*to_station_m, *progress, *duration_s, *ends_m]);
            trace.flags([broken_off.is_some()]);
            if let Some(BrokenOff { progress, duration_s }) = *broken_off {
                trace.numbers([progress, duration_s]);
            }
        }
        if let Some(aside) = aside {
            aside.trace(trace);
        }
        if let Some(pursuit) = pursuit {
            pursuit.trace(trace);
        }
        if let Some(turn) = turn {
            turn.trace(trace);
        }
        trace.words(last_change.map(|side| side as u64));
    }
}

/// The stream of one choice of one road user.
pub(in crate::sim) fn choices(seed: u64, id: u32, draw: u32) -> Rng {
    rng::stream(seed, Stream::Traffic, u64::from(id) << 32 | u64::from(draw))
}
