//! Other drivers: along their way by the Intelligent Driver Model.
//!
//! IDM after Treiber, Hennecke and Helbing (2000), with the brakes of the body on the grip of the
//! road and a kinematic floor, because IDM alone assumes brakes without limit. They stop for red
//! lights, slow down for bends, follow whoever is in front of them, let others go first at junctions
//! (see `manners`) and look before they change lanes (see `change`); what they do to the ego vehicle otherwise is the
//! scenario's business. Leaders and occasions are looked for ten times a second: reaction time.

use std::sync::Arc;

use crate::geometry::{OrientedBox, Path, Pose, Vec2};
use crate::model::vocabulary::Side;
use crate::rng;
use crate::rng::{Rng, Stream};

use crate::sim::body::BodyParameters;
use crate::sim::following::Following;
use crate::sim::mover::{Around, Moved};
use crate::sim::scene::Scene;
use crate::sim::sense::{FRAME_TICKS, SignalColour};
use crate::sim::way::{Way, beside};
use crate::sim::world::{DT_S, Obstacle};

use super::change::{Change, Manoeuvre};
use super::manners::{GIVE_UP_S, STANDS_MPS};

/// IDM: comfortable deceleration, m/s².
pub(super) const COMFORT_MPS2: f64 = 2.0;
/// IDM: gap at standstill, m.
pub(super) const GAP_M_MIN: f64 = 2.0;
/// IDM: time gap, s.
const TIME_GAP_S: f64 = 1.2;
/// What they look ahead beyond the way on which they could stop gently, m.
pub(super) const LOOK_AHEAD_M: f64 = 25.0;
/// Room beside the outline that they want to be free, m.
pub(super) const SIDE_ROOM_M: f64 = 0.2;
/// A yellow light that takes harder braking is passed, m/s².
const YELLOW_BRAKING_MPS2: f64 = 3.0;
/// Who is slower than this when a wait ends sets out anew, m/s.
const SETS_OUT_MPS: f64 = 1.0;
/// Who stands at more than this angle to the way stands across it or against it (cosine of 45°).
const CROSSWISE_COS_MAX: f64 = core::f64::consts::FRAC_1_SQRT_2;

/// How fast somebody wants to drive, and who they are to the ego vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::sim) enum Cruise {
    /// At the speed that an action asked for, m/s, and without yielding to the ego vehicle at junctions.
    Commanded(f64),
    /// At a part of each lane's limit, and with manners towards everybody: ambient traffic.
    Limit(f64),
}

#[derive(Debug, Clone)]
pub(in crate::sim) struct Driver {
    pub(super) way: Arc<Way>,
    /// Of the outline's centre.
    pub(super) station_m: f64,
    pub speed_mps: f64,
    pub(super) cruise_mps: f64,
    /// Part of the limits that it drives at; `None` if its speed was asked for.
    limit_part: Option<f64>,
    pub(super) yields_to_ego: bool,
    pub(super) leader: Option<Leader>,
    /// Station at which it waits for others, or will.
    pub(super) hold_m: Option<f64>,
    /// Up to this station it goes on after a wait, whoever comes.
    pub(super) insists_to_m: f64,
    /// Ticks at rest because of others.
    pub(super) waited_ticks: u32,
    pub(super) change: Option<Change>,
    pub(super) last_change: Option<Side>,
    /// In reverse order: the next one is last.
    pub(super) plan: Vec<Manoeuvre>,
    /// How often it drew where to go, so that each draw has its own stream.
    draws: u32,
}

/// Whoever is in front.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Leader {
    pub gap_m: f64,
    /// Along the own way; negative if it comes nearer.
    pub speed_mps: f64,
    /// Whether it heads across the way or against it.
    pub crosswise: bool,
}

impl Driver {
    /// A driver with its centre at a station of a way, at its cruising speed or what the bend there
    /// allows.
    ///
    /// `plan` is in order; `draws` tells how many draws went into it.
    pub fn new(
        scene: &Scene,
        way: Arc<Way>,
        station_m: f64,
        cruise: Cruise,
        mut plan: Vec<Manoeuvre>,
        draws: u32,
    ) -> Driver {
        plan.reverse();
        let (cruise_mps, limit_part) = match cruise {
            Cruise::Commanded(speed_mps) => (speed_mps, None),
            Cruise::Limit(part) => (part * way.limit_mps(scene, station_m), Some(part)),
        };
        Driver {
            speed_mps: cruise_mps.min(way.speed_mps_max(station_m)),
            way,
            station_m,
            cruise_mps,
            limit_part,
            yields_to_ego: limit_part.is_some(),
            leader: None,
            hold_m: None,
            insists_to_m: f64::NEG_INFINITY,
            waited_ticks: 0,
            change: None,
            last_change: None,
            plan,
            draws,
        }
    }

    /// The way it follows now.
    pub fn way(&self) -> &Way {
        &self.way
    }

    /// Where it is before its first tick.
    pub fn moved(&self) -> Moved {
        along(self.way.path.pose_at(self.station_m), self.speed_mps)
    }

    /// Gap to another outline on its way, m, if that is ahead and in its corridor; and the other's
    /// speed along the way.
    pub fn gap_to(
        &self,
        size: &BodyParameters,
        other: &OrientedBox,
        velocity_mps: Vec2,
    ) -> Option<(f64, f64)> {
        let here = self.way.path.pose_at(self.station_m);
        let other = (other, other.pose.forward(), velocity_mps);
        in_corridor(&self.way.path, self.station_m, &here, size, other)
            .map(|leader| (leader.gap_m, leader.speed_mps))
    }

    pub fn step(
        &mut self,
        this: &Obstacle,
        size: &BodyParameters,
        touched: bool,
        around: &Around,
    ) -> Option<Moved> {
        if !touched && (around.tick + u64::from(this.id)).is_multiple_of(FRAME_TICKS) {
            self.look(this, size, around);
        }
        let braking_mps2 = around.braking_mps2(size, self.speed_mps);
        let wanted_mps2 = if touched { -braking_mps2 } else { self.wanted_mps2(size, around, braking_mps2) };
        let acceleration_mps2 = wanted_mps2.clamp(-braking_mps2, size.acceleration_mps2_max);
        let speed_mps = (self.speed_mps + acceleration_mps2 * DT_S).max(0.0);
        let way_m = (self.speed_mps + speed_mps) / 2.0 * DT_S;
        self.speed_mps = speed_mps;
        self.station_m += way_m;
        if self.gives_up() {
            return None;
        }
        if let Some(leader) = &mut self.leader {
            leader.gap_m += leader.speed_mps * DT_S - way_m;
        }
        // A lane that ends under a lane change goes on straight until the change is done.
        if self.change.is_none() && self.station_m >= self.way.path.length_m() {
            return None;
        }
        Some(self.advance_change(way_m, this.outline.pose.position))
    }

    /// Counts a tick at rest because of others; whether that was the last straw.
    fn gives_up(&mut self) -> bool {
        let blocked = self.leader.is_some_and(|leader| leader.crosswise && leader.gap_m < GAP_M_MIN + 3.0);
        if self.speed_mps >= STANDS_MPS {
            self.waited_ticks = 0;
        } else if self.hold_m.is_some() || blocked {
            self.waited_ticks += 1;
        }
        f64::from(self.waited_ticks) * DT_S >= GIVE_UP_S
    }

    /// Feeds every bit that later ticks depend on to `sink`; ways follow from the draws.
    pub fn trace(&self, sink: &mut dyn FnMut(u64)) {
        for value in [self.station_m, self.speed_mps, self.cruise_mps] {
            sink(value.to_bits());
        }
        let leader = self.leader.unwrap_or(Leader { gap_m: -1.0, speed_mps: 0.0, crosswise: false });
        sink(leader.gap_m.to_bits());
        sink(leader.speed_mps.to_bits());
        sink(u64::from(leader.crosswise));
        sink(self.hold_m.unwrap_or(f64::INFINITY).to_bits());
        sink(self.insists_to_m.to_bits());
        sink(u64::from(self.waited_ticks));
        if let Some(change) = &self.change {
            for value in [change.to_station_m, change.progress, change.duration_s] {
                sink(value.to_bits());
            }
        }
        sink(self.last_change.map_or(0, |side| side as u64 + 1));
        sink(self.plan.len() as u64);
        sink(u64::from(self.draws));
    }

    /// Whom to follow, whether the occasion for the next lane change is there, where the way goes on.
    fn look(&mut self, this: &Obstacle, size: &BodyParameters, around: &Around) {
        if self.way.ends_soon(self.station_m) {
            let mut rng = self.draw(this.id, around);
            if let Some((way, station_m)) = self.way.prolonged(around.scene, self.station_m, &mut rng) {
                self.insists_to_m += station_m - self.station_m;
                (self.way, self.station_m) = (way, station_m);
            }
        }
        if let Some(part) = self.limit_part {
            self.cruise_mps = part * self.way.limit_mps(around.scene, self.station_m);
        }
        if self.change.is_none() {
            self.begin_change(this, size, around);
        }
        let beside = self.foresee(this, size, around);
        let leader = self.find_leader(this, size, around);
        let nearer = |a: &Leader, b: &Leader| a.gap_m.total_cmp(&b.gap_m);
        self.leader = leader.into_iter().chain(beside).min_by(nearer);
        let held = self.hold_m.is_some();
        self.hold_m = self.find_hold_m(this, size, around);
        if held && self.hold_m.is_none() && self.speed_mps < SETS_OUT_MPS {
            self.insists_to_m = self.junction_end_m(size);
        }
    }

    fn find_leader(&self, this: &Obstacle, size: &BodyParameters, around: &Around) -> Option<Leader> {
        let here = &this.outline.pose;
        let forward = this.forward;
        let reach_m = LOOK_AHEAD_M
            + self.speed_mps * (TIME_GAP_S + self.speed_mps / (2.0 * COMFORT_MPS2))
            + size.length_m / 2.0;
        let mut nearest: Option<Leader> = None;
        for other in around.others_along(this.id) {
            let outline = other.0;
            let delta = outline.pose.position - here.position;
            let reach_m = reach_m + outline.half_length_m;
            if delta.norm_squared() > reach_m * reach_m || forward.dot(&delta) < 0.0 {
                continue;
            }
            let on_own_way = in_corridor(&self.way.path, self.station_m, here, size, other);
            let on_next_way = self
                .change
                .as_ref()
                .and_then(|change| in_corridor(&change.to.path, change.to_station_m, here, size, other));
            for leader in on_own_way.into_iter().chain(on_next_way) {
                if nearest.is_none_or(|found| leader.gap_m < found.gap_m) {
                    nearest = Some(leader);
                }
            }
        }
        nearest
    }

    fn wanted_mps2(&self, size: &BodyParameters, around: &Around, braking_mps2: f64) -> f64 {
        let mut bend_mps = self.way.speed_mps_max(self.station_m);
        if let Some(change) = &self.change {
            bend_mps = bend_mps.min(change.to.speed_mps_max(change.to_station_m));
        }
        let wish_mps = self.cruise_mps.min(bend_mps).max(0.1);
        let ratio = self.speed_mps / wish_mps;
        // To be too fast is no emergency.
        let free_mps2 =
            (size.acceleration_mps2_max * (1.0 - ratio * ratio * ratio * ratio)).max(-COMFORT_MPS2);
        let mut wanted_mps2 = free_mps2;
        if let Some(leader) = &self.leader {
            wanted_mps2 = wanted_mps2.min(self.follow_mps2(size, leader, free_mps2));
        }
        if let Some(gap_m) = self.stop_gap_m(size, around, braking_mps2) {
            let line = Leader { gap_m, speed_mps: 0.0, crosswise: false };
            wanted_mps2 = wanted_mps2.min(self.follow_mps2(size, &line, free_mps2));
        }
        if let Some(hold_m) = self.hold_m {
            let gap_m = hold_m - self.station_m - size.length_m / 2.0;
            let line = Leader { gap_m, speed_mps: 0.0, crosswise: false };
            wanted_mps2 = wanted_mps2.min(self.follow_mps2(size, &line, free_mps2));
        }
        wanted_mps2
    }

    /// IDM's interaction, and at least the braking that still avoids the leader.
    fn follow_mps2(&self, size: &BodyParameters, leader: &Leader, free_mps2: f64) -> f64 {
        let closing_mps = self.speed_mps - leader.speed_mps;
        let following = Following {
            gap_m_min: GAP_M_MIN,
            time_gap_s: TIME_GAP_S,
            acceleration_mps2: size.acceleration_mps2_max,
            comfortable_mps2: COMFORT_MPS2,
        };
        let crowding = following.wanted_gap_m(self.speed_mps, leader.speed_mps) / leader.gap_m.max(0.1);
        let idm_mps2 = free_mps2 - size.acceleration_mps2_max * crowding * crowding;
        if closing_mps <= 0.0 {
            return idm_mps2;
        }
        let needed_mps2 = closing_mps * closing_mps / (2.0 * (leader.gap_m - GAP_M_MIN / 2.0).max(0.1));
        if needed_mps2 > COMFORT_MPS2 { idm_mps2.min(-needed_mps2) } else { idm_mps2 }
    }

    /// Gap from the front to the stop line at which it has to stop now, m.
    pub(super) fn stop_gap_m(
        &self,
        size: &BodyParameters,
        around: &Around,
        braking_mps2: f64,
    ) -> Option<f64> {
        let front_m = self.station_m + size.length_m / 2.0;
        let line = self.way.stop_lines.iter().find(|line| line.station_m > front_m)?;
        let gap_m = line.station_m - front_m;
        let energy_m2ps2 = self.speed_mps * self.speed_mps / 2.0;
        if gap_m > LOOK_AHEAD_M + energy_m2ps2 / COMFORT_MPS2 {
            return None;
        }
        // Who cannot stop before the line any more does not stop behind it either.
        let stops = match around.signals.colour(&around.scene.map, line.signal, around.tick) {
            SignalColour::Green => false,
            SignalColour::Yellow => gap_m * YELLOW_BRAKING_MPS2 > energy_m2ps2,
            SignalColour::Red => gap_m * braking_mps2 > energy_m2ps2,
        };
        stops.then_some(gap_m)
    }

    pub(super) fn draw(&mut self, id: u32, around: &Around) -> Rng {
        self.draws += 1;
        choices(around.seed, id, self.draws - 1)
    }
}

/// At a pose of a lane, along it.
pub(super) fn along(pose: Pose, speed_mps: f64) -> Moved {
    let forward = pose.forward();
    Moved { pose, forward, lane_heading_rad: pose.heading_rad, velocity_mps: forward * speed_mps }
}

/// The stream of one choice of one road user.
pub(in crate::sim) fn choices(seed: u64, id: u32, draw: u32) -> Rng {
    rng::stream(seed, Stream::Traffic, u64::from(id) << 32 | u64::from(draw))
}

/// An outline, with its heading as a unit vector and its velocity, as the leader of somebody at a
/// station, if it is ahead and in the corridor.
fn in_corridor(
    path: &Path,
    station_m: f64,
    here: &Pose,
    size: &BodyParameters,
    (outline, heading, velocity_mps): (&OrientedBox, Vec2, Vec2),
) -> Option<Leader> {
    let straight_m = (outline.pose.position - here.position).norm();
    let other = beside(path, outline.pose.position, station_m + straight_m)?;
    let (half_length_m, half_width_m) = extent_m(outline, heading, other.forward);
    let aside_m = other.offset_m.abs() - half_width_m - size.width_m / 2.0;
    if other.station_m < station_m || aside_m > SIDE_ROOM_M {
        return None;
    }
    Some(Leader {
        gap_m: other.station_m - station_m - half_length_m - size.length_m / 2.0,
        speed_mps: velocity_mps.dot(&other.forward),
        crosswise: heading.dot(&other.forward) < CROSSWISE_COS_MAX,
    })
}

/// Half extents of an outline that is turned to `heading` along and across another unit vector, m.
pub(super) fn extent_m(outline: &OrientedBox, heading: Vec2, along: Vec2) -> (f64, f64) {
    let (cosine, sine) = (along.dot(&heading).abs(), along.perp(&heading).abs());
    (
        outline.half_length_m * cosine + outline.half_width_m * sine,
        outline.half_length_m * sine + outline.half_width_m * cosine,
    )
}
