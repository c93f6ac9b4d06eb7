//! What drivers are told to do to the side: to change to a lane seen from the ego vehicle, and to drive beside the middle
//! of their lane. Both begin in the tick in which they are told, if the road and others leave the place.

use avastra_base::geometry::{Pose, SmoothStep, Vec2, smooth_step, unit_vector};
use avastra_lang::model::command::{Command, Manners};
use avastra_lang::model::vocabulary::{LaneChoice, Side};
use avastra_road::LaneIndex;

use crate::sim::around::Around;
use crate::sim::lanes::{chosen_lane, lane_beside};
use crate::sim::moment::{driver_facts, with_itself};
use crate::sim::road_user::Obstacle;
use crate::sim::trace::Trace;

use super::change::{Whose, duration_s, per_m};
use super::driver::{Driver, View};

/// Lanes of one street that are looked through for the one that is meant.
const LANES_MAX: usize = 8;

/// Where a driver was told to be, and where it is.
#[derive(Debug, Clone, Default)]
pub(super) struct Aside {
    /// The lane that it has still to change to.
    lane: Option<LaneChoice>,
    /// m to the left of the middle of its lane.
    wanted_m: f64,
    now_m: f64,
    /// Greatest speed on the way there, m/s; without it as in lane changes of its own.
    told_mps: Option<f64>,
    shift: Option<Shift>,
}

/// A move to another place beside the middle of the lane.
#[derive(Debug, Clone, Copy)]
struct Shift {
    from_m: f64,
    to_m: f64,
    /// In `[0, 1)`.
    progress: f64,
    duration_s: f64,
}

impl Aside {
    /// How far to the left of the middle it will be when it has driven on, m.
    #[inline]
    pub fn after_m(&self, way_m: f64, speed_mps: f64) -> f64 {
        match &self.shift {
            None => self.now_m,
            Some(Shift { from_m, to_m, progress, duration_s }) => {
                let progress = progress + per_m(speed_mps, *duration_s) * way_m.max(0.0);
                from_m + (to_m - from_m) * smooth_step(progress).value
            }
        }
    }

    /// The pose of a body whose way leads it to `pose`.
    #[inline]
    pub fn beside(&self, pose: Pose) -> Pose {
        if self.now_m == 0.0 { pose } else { beside(pose, self.now_m) }
    }

    pub fn trace(&self, trace: &mut Trace) {
        // Nothing is fed for what was told nothing, as before there were commands.
        if self.lane.is_none() && self.wanted_m == 0.0 && self.now_m == 0.0 && self.shift.is_none() {
            return;
        }
        trace.word(self.lane.map_or(0, |lane| lane as u64 + 1));
        trace.numbers([self.wanted_m, self.now_m, self.told_mps.unwrap_or(0.0)]);
        if let Some(Shift { from_m, to_m, progress, duration_s }) = self.shift {
            trace.numbers([from_m, to_m, progress, duration_s]);
        }
    }
}

impl Driver {
    /// It begins so far to the left of the middle of its lane, m, and ignores these rules of the road.
    pub fn begin_at(&mut self, left_m: f64, ignores: Manners) {
        self.aside = Aside { wanted_m: left_m, now_m: left_m, ..Aside::default() };
        self.ignores = ignores;
    }

    /// From now on it does what it is told, as soon as it can. What it was told before and has not begun is dropped; a lane
    /// change or a move to the side that is under way is finished first.
    pub fn order(&mut self, command: &Command) {
        if let Some(speed_mps) = command.speed_mps {
            (self.cruise_mps, self.ordered_mps2) = (speed_mps, command.rate_mps2);
        }
        self.ignores = command.ignores.unwrap_or(self.ignores);
        self.aside.lane = command.lane;
        if command.goes_aside() {
            self.plan.clear();
            self.aside.told_mps = command.aside_mps;
            self.aside.wanted_m = command.offset_m.unwrap_or(self.aside.wanted_m);
        }
    }

    /// Where the middle of its lane is beside it.
    pub(super) fn middle(&self, this: &Obstacle) -> Vec2 {
        let Aside { now_m, .. } = self.aside;
        let position = this.outline.pose.position;
        if now_m == 0.0 { position } else { position - left_of(self.lane_heading_rad()) * now_m }
    }

    /// Whether it moves to another place beside the middle of its lane.
    pub(super) fn is_moving_aside(&self) -> bool {
        self.aside.shift.is_some()
    }

    /// Whether it is where it was told to be.
    pub fn is_aside_as_told(&self) -> bool {
        let Aside { lane, wanted_m, now_m, shift, .. } = &self.aside;
        lane.is_none() && self.change.is_none() && shift.is_none() && wanted_m == now_m
    }

    /// Begins what it was told to do to the side and has not begun: first the lane, then the place in it. Both at once would
    /// be faster to the side than it was told, and than the road grips.
    #[inline]
    pub(super) fn begin_aside(&mut self, view: &View) {
        if self.change.is_some() || self.aside.shift.is_some() {
            return;
        }
        if let Some(lane) = self.aside.lane {
            self.go_over(lane, view);
            if self.aside.lane.is_some() {
                return;
            }
        }
        let Aside { wanted_m, now_m, told_mps, .. } = self.aside;
        if wanted_m != now_m {
            let duration_s =
                duration_s((wanted_m - now_m).abs(), self.speed_mps, Whose::Told(told_mps), view.around);
            self.aside.shift = Some(Shift { from_m: now_m, to_m: wanted_m, progress: 0.0, duration_s });
        }
    }

    /// Begins a change to the next lane on the way to the one that is meant, if the road and others leave the place.
    fn go_over(&mut self, lane: LaneChoice, view: &View) {
        let View { this, around, .. } = *view;
        match self.side_of(lane, this.outline.pose.position, around) {
            Ok(None) => self.aside.lane = None,
            Ok(Some(side)) => {
                let allowed = self.lane_changes.as_ref().is_none_or(|rules| {
                    rules.allow(
                        with_itself(around.moment_facts(), this, self),
                        driver_facts(around, this, self),
                    )
                });
                let whose = Whose::Told(self.aside.told_mps);
                if allowed && let Some(begun) = self.change_to(side, whose, view) {
                    self.set_out(begun, whose, view);
                }
            }
            // In a junction, or where that lane has not begun yet.
            Err(_) => {}
        }
    }

    /// The side on which the lane that is meant lies from the one that it is in; `None` if that is the one.
    ///
    /// # Errors
    /// That the lane does not lie beside its own, in words.
    pub(in crate::sim) fn side_of(
        &self,
        lane: LaneChoice,
        position: Vec2,
        around: &Around,
    ) -> Result<Option<Side>, String> {
        let meant = chosen_lane(around, around.beside_route(position).0, lane)?;
        let (here, _) = self.way.lane_at(self.station_m);
        let lies = |side: Side| {
            let next = |lane: &LaneIndex| lane_beside(around, *lane, side);
            core::iter::successors(next(&here), next).take(LANES_MAX).any(|lane| lane == meant)
        };
        match () {
            () if here == meant => Ok(None),
            () if lies(Side::Left) => Ok(Some(Side::Left)),
            () if lies(Side::Right) => Ok(Some(Side::Right)),
            () => Err("that lane does not lie beside its own".into()),
        }
    }

    /// The pose of a body whose way leads it to `pose`, with the move to the side moved on by `way_m` of way.
    #[inline]
    pub(super) fn moved_aside(&mut self, pose: Pose, way_m: f64) -> Pose {
        let Some(shift) = &mut self.aside.shift else { return self.aside.beside(pose) };
        let per_m = per_m(self.speed_mps, shift.duration_s);
        shift.progress += per_m * way_m;
        let over_m = shift.to_m - shift.from_m;
        if shift.progress >= 1.0 {
            self.aside.now_m = shift.to_m;
            self.aside.shift = None;
            return self.aside.beside(pose);
        }
        let SmoothStep { value, slope, .. } = smooth_step(shift.progress);
        self.aside.now_m = shift.from_m + over_m * value;
        let pose = beside(pose, self.aside.now_m);
        Pose { heading_rad: pose.heading_rad + libm::atan(over_m * slope * per_m), ..pose }
    }
}

fn beside(pose: Pose, left_m: f64) -> Pose {
    Pose { position: pose.position + left_of(pose.heading_rad) * left_m, ..pose }
}

fn left_of(heading_rad: f64) -> Vec2 {
    let forward = unit_vector(heading_rad);
    Vec2::new(-forward.y, forward.x)
}
