//! A driver: where it is, what it was told, what it saw at its last look, and what it remembers.

use std::sync::Arc;

use avastra_base::geometry::{Chord, Pose, Vec2, unit_vector};
use avastra_lang::model::body::BodyParameters;
use avastra_lang::model::field::{Fields, IgnoredRules, Said};
use avastra_lang::model::vocabulary::{Side, Turning};
use avastra_road::LaneIndex;

use crate::action::LaneChangeRules;
use crate::scene::Scene;
use crate::scene::way::{Way, body_at};
use crate::state::change::{Aside, Change, PlannedChange, Towards, beside, left_of};
use crate::state::obstacle::{Moved, Obstacle};
use crate::state::pursuit::Pursuit;
use crate::state::time::DT_S;
use crate::state::trace::traced;

/// Time at rest for others after which a driver leaves the world, s. Ours: less than the 24 s without
/// progress that end an episode of the shipped space.
pub const GIVE_UP_S: f64 = 20.0;

/// IDM: time gap, s. Ours.
pub const TIME_GAP_S: f64 = 1.2;

/// How fast a driver wants to drive, and how it treats the ego vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cruise {
    /// At the speed that an action asked for, m/s, and without yielding to the ego vehicle at junctions.
    Commanded(f64),
    /// At a part of each lane's limit, yielding to all others: ambient traffic.
    Limit(f64),
}

#[derive(Debug, Clone)]
pub struct Driver {
    /// The way that it follows now.
    pub way: Arc<Way>,
    /// Station on the way: on a straight one, that of the outline's centre (see [`body_at`]).
    pub station_m: f64,
    pub speed_mps: f64,
    pub cruise_mps: f64,
    /// How fast it goes over to `cruise_mps`, m/s², if it was ordered so.
    pub ordered_mps2: Option<f64>,
    /// That it keeps behind a leader, s.
    pub time_gap_s: f64,
    /// Part of the limits that it drives at; `None` if its speed was asked for.
    pub limit_part: Option<f64>,
    pub yields_to_ego: bool,
    /// 1 to 3 in a profile that has it; 0 before the first look.
    pub aggression: u32,
    pub leader: Option<Leader>,
    /// Station at which it waits for others, or will.
    pub hold_m: Option<f64>,
    /// After a wait it goes on up to this station, whatever comes.
    pub insists_to_m: f64,
    /// It has stood at the stop sign's line at this station, and at those before.
    pub stopped_to_m: f64,
    /// Ticks at rest because of others.
    pub waited_ticks: u32,
    pub change: Option<Change>,
    /// Its lateral order, if it has one.
    pub aside: Option<Box<Aside>>,
    /// The rules of the road that it was told to ignore.
    pub ignores: IgnoredRules,
    /// Whether it is an emergency vehicle under way: it passes lights and signs, and all others wait for it.
    pub has_siren: bool,
    /// Its order relative to the ego vehicle or another road user. The order sets the speed, in place of `cruise_mps`.
    pub pursuit: Option<Box<Pursuit>>,
    /// By how much it missed the moment of its last `early`, s; below 0 if it was too soon.
    pub late_s: Option<f64>,
    /// Where it was told to go at the next junction.
    pub turn: Option<MeantTurn>,
    pub last_change: Option<Side>,
    /// In reverse order: the next manoeuvre is last.
    pub plan: Vec<PlannedChange>,
    /// Rules of the space on its lane changes, those of orders among them.
    pub lane_changes: Vec<Arc<LaneChangeRules>>,
    /// How often it drew where to go, so that each draw has its own stream.
    pub draws: u32,
}

/// The road user in front, or a line to stop at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leader {
    pub gap_m: f64,
    /// Along the own way; negative if it comes nearer.
    pub speed_mps: f64,
    /// Whether it heads across the way or against it.
    pub crosswise: bool,
}

impl Leader {
    /// A place at which to stand.
    pub fn line(gap_m: f64) -> Leader {
        Leader { gap_m, speed_mps: 0.0, crosswise: false }
    }
}

/// Where a driver was told to go at the next junction, until that is behind it.
#[derive(Debug, Clone, Copy)]
pub struct MeantTurn {
    pub to: Turning,
    /// The lane in the junction in which its way leads there. `None` as long as its lane does not lead there.
    pub lane: Option<LaneIndex>,
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
        let (on_way, Chord { forward, .. }) = body_at(&self.way.path, self.station_m, size);
        Moved {
            pose: self.beside_way(on_way),
            forward,
            lane_heading_rad: self.lane_heading_rad(),
            velocity_mps: forward * self.speed_mps,
        }
    }

    /// Heading of the way where it is, rad.
    pub fn lane_heading_rad(&self) -> f64 {
        self.way.path.heading_at(self.station_m)
    }

    /// Takes another way that begins like its own, and on which it is at this station.
    pub fn go_on_along(&mut self, way: Arc<Way>, station_m: f64) {
        self.insists_to_m += station_m - self.station_m;
        self.stopped_to_m += station_m - self.station_m;
        (self.way, self.station_m) = (way, station_m);
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
    pub fn is_ambient(&self) -> bool {
        self.limit_part.is_some()
    }

    /// Whether it keeps the gap, or was at the place, that it was told.
    pub fn has_met(&self) -> bool {
        self.pursuit.as_ref().is_none_or(|pursuit| pursuit.is_met)
    }

    /// From now on it means to go there at the next junction: in `lane` if its way leads there already.
    pub fn mean_to_turn(&mut self, to: Turning, lane: Option<LaneIndex>) {
        self.turn = Some(MeantTurn { to, lane });
    }

    /// Whether nothing is left of what it was told for the next junction.
    pub fn has_turned(&self) -> bool {
        self.turn.is_none()
    }

    /// It begins so far to the left of the middle of its lane, m, and ignores these rules of the road.
    pub fn begin_at(&mut self, left_m: f64) {
        let aside = || Box::new(Aside { wanted_m: left_m, now_m: left_m, ..Aside::default() });
        self.aside = (left_m != 0.0).then(aside);
    }

    /// Takes on the properties that its spawn or an order tells.
    pub fn heed(&mut self, told: &Fields<Said>) {
        self.ignores = told.ignores().unwrap_or(self.ignores);
        self.has_siren = told.siren().unwrap_or(self.has_siren);
    }

    /// How far to the left of the middle of its lane it is, m.
    #[inline]
    pub fn aside_m(&self) -> f64 {
        self.aside.as_ref().map_or(0.0, |aside| aside.now_m)
    }

    /// How far to the left of the middle of its lane it will be when it has driven on, m.
    #[inline]
    pub fn aside_after_m(&self, way_m: f64) -> f64 {
        self.aside.as_ref().map_or(0.0, |aside| aside.after_m(way_m, self.speed_mps))
    }

    /// The pose of a body whose way leads it to `pose`.
    #[inline]
    pub fn beside_way(&self, pose: Pose) -> Pose {
        beside(pose, self.aside_m())
    }

    /// Where the middle of its lane is beside it.
    pub fn middle(&self, this: &Obstacle) -> Vec2 {
        let now_m = self.aside_m();
        let position = this.outline.pose.position;
        if now_m == 0.0 { position } else { position - left_of(self.lane_heading_rad()) * now_m }
    }

    /// Whether it moves to another place beside the middle of its lane.
    pub fn is_moving_aside(&self) -> bool {
        self.aside.as_ref().is_some_and(|aside| aside.shift.is_some())
    }

    /// Whether it is where it was told to be.
    pub fn is_aside_as_told(&self) -> bool {
        let is_there =
            |aside: &Aside| aside.lane.is_none() && aside.shift.is_none() && aside.wanted_m == aside.now_m;
        self.change.is_none() && self.aside.as_deref().is_none_or(is_there)
    }

    /// It has come so far to the left of the middle of its lane.
    pub fn is_now_aside(&mut self, left_m: f64) {
        self.aside.iter_mut().for_each(|aside| aside.now_m = left_m);
    }

    /// Whether it has still to come into a way that was laid for it.
    pub fn plans_way(&self) -> bool {
        self.plan.iter().any(|next| matches!(next.towards, Towards::Way(_)))
    }

    /// Has another way, beside whose middle it is.
    pub fn comes_into(&mut self, way: Arc<Way>, station_m: f64, left_m: f64) {
        (self.way, self.station_m, self.hold_m) = (way, station_m, None);
        (self.insists_to_m, self.stopped_to_m) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        self.is_now_aside(left_m);
    }

    /// How far to the side it gets, m, if the middle of its lane moves `over`, and it ends `ends_m` to the left of
    /// that.
    pub fn over_m(&self, over: Vec2, ends_m: f64) -> f64 {
        let now_m = self.aside_m();
        if ends_m == now_m {
            return over.norm();
        }
        (unit_vector(self.lane_heading_rad()).perp(&over) + ends_m - now_m).abs()
    }
}

traced! {
    Driver {
        station_m, speed_mps, cruise_mps, ordered_mps2, time_gap_s, aggression, leader, hold_m, insists_to_m, stopped_to_m,
        waited_ticks, change, aside, ignores => ignores.bits(), has_siren, pursuit, turn, last_change,
        // The plan was drawn as the vehicle appeared: the part that is left of it tells the rest.
        plan => plan.len(), draws, limit_part, yields_to_ego
    } but {
        // It follows from where it appeared and from what it drew, changed and was told since.
        way,
        // Rules permit what is then seen in `change`.
        lane_changes,
        // No tick reads it.
        late_s
    };
    Leader { gap_m, speed_mps, crosswise };
    MeantTurn { to, lane };
}
