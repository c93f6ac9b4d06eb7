//! Lateral orders to drivers: to change to a lane seen from the ego vehicle, and to drive at an offset from the middle
//! of their lane. A lane change begins when markings, rules and vehicles beside it allow it. A move within the lane
//! begins at once, without regard to others.

use avastra_base::geometry::{Pose, SmoothStep, smooth_step};
use avastra_lang::model::command::{AsideBy, Command};
use avastra_lang::model::field::IgnoredRules;
use avastra_lang::model::vocabulary::{LaneChoice, Side};
use avastra_road::LaneIndex;

use crate::behave::npc::change::{Whose, duration_s};
use crate::scene::lanes::{chosen_lane, lane_beside, may_use};
use crate::state::change::{Aside, Shift, beside, per_m};
use crate::state::driver::Driver;
use crate::state::obstacle::Obstacle;
use crate::state::pursuit::Pursuit;
use crate::view::around::{Around, View};

/// Lanes of one street that are looked through for the one that is meant.
const LANES_MAX: usize = 8;

impl Driver {
    /// From now on it does what it is told, as soon as it can. A command that says where to the side replaces all of the last
    /// one that has not begun; what is under way is finished first.
    pub fn order(&mut self, command: &Command, to: Option<u32>) {
        if let Some(pursuit) = Pursuit::told(command, to) {
            self.late_s = None;
            (self.pursuit, self.ordered_mps2) = (Some(Box::new(pursuit)), command.rate_mps2());
        } else if let Some(speed_mps) = command.speed_mps() {
            (self.cruise_mps, self.ordered_mps2) = (speed_mps, command.rate_mps2());
            self.pursuit = None;
        }
        self.time_gap_s = command.time_gap_s().unwrap_or(self.time_gap_s);
        self.heed(command);
        command.turn().iter().for_each(|to| self.mean_to_turn(*to, None));
        if command.goes_aside() {
            self.plan.clear();
            let aside = self.aside.get_or_insert_default();
            let begun_m = self.change.as_ref().map_or(aside.now_m, |change| change.ends_m);
            let heads_for_m = aside.shift.map_or(begun_m, |shift| shift.to_m);
            aside.wanted_m = command.offset_m().unwrap_or(heads_for_m);
            (aside.lane, aside.told) = (command.lane(), command.aside());
            aside.was_told_midway = command.lane().is_some() && self.change.is_some();
        }
    }

    /// Begins the lateral order that has not begun. The change to the last lane on the way to the wanted one ends at
    /// the ordered offset.
    #[inline]
    pub fn begin_aside(&mut self, view: &View) {
        let Some(aside) = self.aside.as_deref_mut() else { return };
        let was_told_midway = core::mem::take(&mut aside.was_told_midway);
        let Aside { lane, wanted_m, now_m, told, shift, .. } = aside.clone();
        if was_told_midway && lane.is_some_and(|lane| self.is_leaving(lane, view)) {
            self.break_off(told, view.around);
        }
        if self.change.is_some() || shift.is_some() {
            return;
        }
        if let Some(lane) = lane
            && !self.go_over(lane, told, view)
        {
            return;
        }
        if wanted_m != now_m {
            let duration_s =
                duration_s((wanted_m - now_m).abs(), self.speed_mps, Whose::Told(told), view.around);
            let shift = Shift { from_m: now_m, to_m: wanted_m, progress: 0.0, duration_s };
            self.aside.get_or_insert_default().shift = Some(shift);
        }
    }

    /// Whether the lane that is meant is the one that the change under way leaves.
    fn is_leaving(&self, lane: LaneChoice, View { this, around, .. }: &View) -> bool {
        let meant = chosen_lane(around.scene, around.beside_route(this.outline.pose.position).0, lane);
        meant.is_ok_and(|meant| meant == self.way.lane_at(self.station_m).0)
    }

    /// Begins a change to the next lane on the way to the wanted one, if the road and others leave room for it.
    /// Returns whether the vehicle is in the wanted lane already.
    fn go_over(&mut self, lane: LaneChoice, told: Option<AsideBy>, view: &View) -> bool {
        let View { this, around, .. } = *view;
        // An error: in a junction, or where that lane has not begun yet.
        let Ok(side) = self.side_of(lane, this, self.ignores, around) else { return false };
        let Some(side) = side else {
            self.aside.get_or_insert_default().lane = None;
            return true;
        };
        let whose = Whose::Told(told);
        if !self.may_change(view) {
            return false;
        }
        // The change into the last lane on the way to the one that is meant ends at the place that it was told.
        let meant = chosen_lane(around.scene, around.beside_route(this.outline.pose.position).0, lane);
        let (here, _) = self.way.lane_at(self.station_m);
        let is_last = meant.ok() == lane_beside(around.scene, here, side);
        let wanted_m = self.aside.as_ref().map_or(0.0, |aside| aside.wanted_m);
        let ends_m = if is_last { wanted_m } else { self.aside_m() };
        if let Some(begun) = self.change_to(side, ends_m, whose, view) {
            self.set_out(begun, ends_m, whose, view);
        }
        false
    }

    /// The side on which the lane that is meant lies from the one that it is in; `None` if that is the one.
    ///
    /// # Errors
    /// That the lane does not lie beside its own, or is for buses, in words.
    pub fn side_of(
        &self,
        lane: LaneChoice,
        this: &Obstacle,
        ignores: IgnoredRules,
        around: &Around,
    ) -> Result<Option<Side>, String> {
        let meant = chosen_lane(around.scene, around.beside_route(this.outline.pose.position).0, lane)?;
        let (here, _) = self.way.lane_at(self.station_m);
        let lies = |side: Side| {
            let next = |lane: &LaneIndex| lane_beside(around.scene, *lane, side);
            core::iter::successors(next(&here), next).take(LANES_MAX).any(|lane| lane == meant)
        };
        match () {
            () if here == meant => Ok(None),
            () if !may_use(around.scene, meant, this.body, ignores) => Err("that lane is for buses".into()),
            () if lies(Side::Left) => Ok(Some(Side::Left)),
            () if lies(Side::Right) => Ok(Some(Side::Right)),
            () => Err("that lane does not lie beside its own".into()),
        }
    }

    /// The pose of a body whose way leads it to `pose`, with the move to the side moved on by `way_m` of way.
    #[inline]
    pub fn moved_aside(&mut self, pose: Pose, way_m: f64) -> Pose {
        let Some(aside) = &mut self.aside else { return pose };
        let Some(shift) = &mut aside.shift else { return self.beside_way(pose) };
        let per_m = per_m(self.speed_mps, shift.duration_s);
        shift.progress += per_m * way_m;
        let over_m = shift.to_m - shift.from_m;
        if shift.progress >= 1.0 {
            aside.now_m = shift.to_m;
            aside.shift = None;
            return self.beside_way(pose);
        }
        let SmoothStep { value, slope, .. } = smooth_step(shift.progress);
        aside.now_m = shift.from_m + over_m * value;
        let pose = beside(pose, aside.now_m);
        Pose { heading_rad: pose.heading_rad + libm::atan(over_m * slope * per_m), ..pose }
    }
}
