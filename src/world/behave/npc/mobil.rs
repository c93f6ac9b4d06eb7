//! Lane changes for a driver's own gain: the model MOBIL.
//!
//! After Kesting, Treiber and Helbing (2007). A driver changes lanes if its own gain in acceleration plus a part
//! (`politeness`) of both followers' gain or loss is more than a threshold. The threshold is lower to the right than
//! to the left. Accelerations are those of the Intelligent Driver Model before and after the change. A driver takes
//! followers for drivers like itself. Only ambient vehicles change lanes so; commanded ones do what their verb says.
//! For both a change must be safe (`change`). MOBIL's criterion, that no follower has to brake harder than `b_safe`,
//! is kept by that kinematic check. The reason: the model's own braking behind a vehicle that has just cut in comes
//! from the wanted gap rather than from danger (Kesting, Treiber and Helbing 2010).

use avastra_base::geometry::Path;
use avastra_lang::model::vocabulary::Side;
use avastra_road::{LaneIndex, is_apart};

use crate::behave::npc::figures::{SIDE_ROOM_M, following};
use crate::scene::traffic::TrafficProfile;
use crate::state::driver::{Driver, TIME_GAP_S};
use crate::view::around::View;

use crate::scene::lanes::{lane_beside, may_use};

/// Ticks between two considerations: a second.
const CONSIDER_TICKS: u64 = 50;
/// Slower drivers keep their lane, m/s: they are in a queue, or about to stop. Ours.
const CONSIDER_MPS_MIN: f64 = 3.0;
/// Others farther away along a lane do not count, m. Ours: beyond it the model's gap terms are small.
const REACH_M: f64 = 100.0;

/// Another road user ahead or behind in a lane.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Other {
    gap_m: f64,
    speed_mps: f64,
}

/// The nearest in one lane.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Lane {
    ahead: Option<Other>,
    behind: Option<Other>,
}

impl Driver {
    /// The side to which MOBIL advises a change now.
    pub fn wants_side(&self, view: &View) -> Option<Side> {
        let View { this, size, around } = *view;
        let profile = around.traffic;
        let is_due = around.is_due(this.id, CONSIDER_TICKS);
        if !profile.mobil || !self.is_ambient() || !is_due || self.speed_mps < CONSIDER_MPS_MIN {
            return None;
        }
        let (here, _) = self.way.lane_at(self.station_m);
        let own = self.lane_of(&self.way.path, |at_m| self.way.height_at(at_m), self.station_m, view);
        let driver = Idm { acceleration_mps2: size.acceleration_mps2_max, wish_mps: self.cruise_mps };
        let mut best: Option<(f64, Side)> = None;
        for side in [Side::Right, Side::Left] {
            let may_use = |lane: &LaneIndex| may_use(around.scene, *lane, this.body, self.ignores);
            let Some(target) = lane_beside(around.scene, here, side).filter(may_use) else { continue };
            let target = around.scene.map.lane(target);
            let station_m = target.centre.project(this.outline.pose.position).station_m;
            let height_m = |at_m| target.height_at(at_m);
            let beside = self.lane_of(&target.centre, height_m, station_m, view);
            let gain_mps2 =
                gain_mps2(&driver, self.speed_mps, size.length_m, own, beside, profile.politeness);
            let excess_mps2 = gain_mps2 - threshold_mps2(profile, side);
            if excess_mps2 > best.map_or(0.0, |(most, _)| most) {
                best = Some((excess_mps2, side));
            }
        }
        best.map(|(_, side)| side)
    }

    /// The nearest others in a lane, of which `height_m` gives the heights, in which the own centre would be at a
    /// station.
    fn lane_of(&self, path: &Path, height_m: impl Fn(f64) -> f64, station_m: f64, view: &View) -> Lane {
        let View { this, size, around } = *view;
        let mut lane = Lane::default();
        for crate::view::around::Other { outline, forward: heading, velocity_mps, elevation_m } in
            around.others()
        {
            let away = outline.pose.position - this.outline.pose.position;
            if away.norm_squared() > REACH_M * REACH_M {
                continue;
            }
            let Some(other) = path.project_from(outline.pose.position, station_m + this.forward.dot(&away))
            else {
                continue;
            };
            let (half_length_m, half_width_m) = outline.half_extent_m(heading, other.forward);
            let aside_m = other.offset_m.abs() - half_width_m - size.width_m / 2.0;
            if aside_m > SIDE_ROOM_M || is_apart(height_m(other.station_m), elevation_m) {
                continue;
            }
            let ahead_m = other.station_m - station_m;
            let gap_m = ahead_m.abs() - half_length_m - size.length_m / 2.0;
            let slot = if ahead_m >= 0.0 { &mut lane.ahead } else { &mut lane.behind };
            if slot.is_none_or(|nearest| gap_m < nearest.gap_m) {
                *slot = Some(Other { gap_m, speed_mps: velocity_mps.dot(&other.forward) });
            }
        }
        lane
    }
}

/// A driver of the Intelligent Driver Model.
struct Idm {
    acceleration_mps2: f64,
    wish_mps: f64,
}

impl Idm {
    /// Acceleration at a speed behind a leader, m/s².
    fn acceleration_mps2(&self, speed_mps: f64, leader: Option<Other>) -> f64 {
        let model = following(self.acceleration_mps2, TIME_GAP_S);
        let free_mps2 = model.free_mps2(speed_mps, self.wish_mps.max(speed_mps).max(0.1));
        let Some(leader) = leader else { return free_mps2 };
        free_mps2 - model.interaction_mps2(speed_mps, leader.speed_mps, leader.gap_m)
    }
}

/// The incentive of a change for a driver at a speed, m/s²: its own gain, and the followers' by politeness.
fn gain_mps2(driver: &Idm, speed_mps: f64, length_m: f64, own: Lane, beside: Lane, politeness: f64) -> f64 {
    let this = |gap_m| Some(Other { gap_m, speed_mps });
    let of = |leader| driver.acceleration_mps2(speed_mps, leader);
    // The gain of a follower when another vehicle becomes its leader.
    let gain = |follower: Option<Other>, before: Option<Other>, after: Option<Other>| {
        follower.map_or(0.0, |follower| {
            let of = |leader| driver.acceleration_mps2(follower.speed_mps, leader);
            of(after) - of(before)
        })
    };
    let past = |follower: Option<Other>, leader: Option<Other>| {
        let room_m = follower.map_or(0.0, |follower| follower.gap_m) + length_m;
        leader.map(|leader| Other { gap_m: leader.gap_m + room_m, ..leader })
    };
    let old = gain(own.behind, own.behind.and_then(|old| this(old.gap_m)), past(own.behind, own.ahead));
    let new =
        gain(beside.behind, past(beside.behind, beside.ahead), beside.behind.and_then(|new| this(new.gap_m)));
    of(beside.ahead) - of(own.ahead) + politeness * (new + old)
}

/// The gain that a change to a side must exceed, m/s².
fn threshold_mps2(profile: &TrafficProfile, side: Side) -> f64 {
    match side {
        Side::Left => profile.change_gain_mps2 + profile.right_bias_mps2,
        Side::Right => profile.change_gain_mps2 - profile.right_bias_mps2,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const DRIVER: Idm = Idm { acceleration_mps2: 2.0, wish_mps: 14.0 };

    /// The published sums, written out: vehicles on two lines as (front, rear, speed), the own one at 0.
    fn naive_gain_mps2(speed_mps: f64, length_m: f64, own: Lane, beside: Lane, politeness: f64) -> f64 {
        let ahead = |other: Other| (other.gap_m, other.speed_mps);
        let accelerate = |front_m: f64, speed_mps: f64, leader: Option<(f64, f64)>| {
            let ratio = speed_mps / speed_mps.max(14.0);
            let free = 2.0 * (1.0 - ratio * ratio * ratio * ratio);
            let Some((rear_m, leader_mps)) = leader else { return free };
            let wanted_m = 2.0
                + (1.2 * speed_mps + speed_mps * (speed_mps - leader_mps) / (2.0 * (2.0_f64 * 2.0).sqrt()))
                    .max(0.0);
            let closeness = wanted_m / (rear_m - front_m).max(0.1);
            free - 2.0 * closeness * closeness
        };
        // The own front is at 0 and its rear at -length.
        let me = (-length_m, speed_mps);
        let mut sum = accelerate(0.0, speed_mps, beside.ahead.map(ahead))
            - accelerate(0.0, speed_mps, own.ahead.map(ahead));
        if let Some(old) = own.behind {
            let front_m = -length_m - old.gap_m;
            let after = accelerate(front_m, old.speed_mps, own.ahead.map(ahead));
            sum += politeness * (after - accelerate(front_m, old.speed_mps, Some(me)));
        }
        if let Some(new) = beside.behind {
            let front_m = -length_m - new.gap_m;
            let before = accelerate(front_m, new.speed_mps, beside.ahead.map(ahead));
            sum += politeness * (accelerate(front_m, new.speed_mps, Some(me)) - before);
        }
        sum
    }

    fn other() -> impl Strategy<Value = Option<Other>> {
        prop::option::of((0.5..80.0, 0.0..16.0).prop_map(|(gap_m, speed_mps)| Other { gap_m, speed_mps }))
    }

    fn lane() -> impl Strategy<Value = Lane> {
        (other(), other()).prop_map(|(ahead, behind)| Lane { ahead, behind })
    }

    proptest! {
        #[test]
        fn gains_are_the_published_sums(own in lane(), beside in lane(), speed_mps in 0.0..16.0, politeness in 0.0..1.0) {
            let found = gain_mps2(&DRIVER, speed_mps, 4.8, own, beside, politeness);
            let naive = naive_gain_mps2(speed_mps, 4.8, own, beside, politeness);
            prop_assert!((found - naive).abs() < 1e-9 * (1.0 + naive.abs()), "{found} {naive}");
        }
    }

    #[test]
    fn a_slow_leader_is_left_but_not_at_the_cost_of_a_follower() {
        let slow = Lane { ahead: Some(Other { gap_m: 20.0, speed_mps: 6.0 }), behind: None };
        let profile = TrafficProfile::default();
        let worth = |beside| gain_mps2(&DRIVER, 12.0, 4.8, slow, beside, profile.politeness);
        assert!(worth(Lane::default()) > threshold_mps2(&profile, Side::Left));
        let fast = Some(Other { gap_m: 4.0, speed_mps: 14.0 });
        assert!(worth(Lane { ahead: None, behind: fast }) < 0.0);
        // On empty lanes nothing is gained, on either side.
        let nothing = gain_mps2(&DRIVER, 12.0, 4.8, Lane::default(), Lane::default(), 0.3);
        assert!(nothing < threshold_mps2(&profile, Side::Right));
    }
}
