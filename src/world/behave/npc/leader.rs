//! Leaders: which road user a driver follows, and the acceleration that the gap to it allows.
//!
//! A leader is ahead on the own way and within a corridor as wide as the vehicle. Road users that would come into the
//! way beside that corridor are found in `foresight`.

use avastra_base::geometry::Pose;
use avastra_base::kinematics::{STANDING_MPS, needed_mps2};
use avastra_lang::model::vocabulary::TrafficRule;
use avastra_road::is_apart;

use crate::behave::npc::figures::{COMFORT_MPS2, GAP_M_MIN, LOOK_AHEAD_M, SIDE_ROOM_M, following};
use crate::scene::way::Way;
use crate::state::driver::{Driver, Leader};
use crate::view::around::{Around, Other, View};
use avastra_lang::model::body::BodyParameters;

/// A vehicle at more than this angle to the way stands across it or against it (cosine of 45°).
const CROSSWISE_COS_MAX: f64 = core::f64::consts::FRAC_1_SQRT_2;

impl Driver {
    /// Gap to another road user on its way, m, and the other's speed along the way. `None` if the other is
    /// not ahead in its corridor.
    pub fn gap_to(&self, size: &BodyParameters, other: Other) -> Option<(f64, f64)> {
        let here = self.way.path.pose_at(self.station_m);
        self.in_corridor((&self.way, self.station_m, None), &here, size, other)
            .map(|leader| (leader.gap_m, leader.speed_mps))
    }

    /// The nearest leader on the own way, or on the way to which it is changing.
    pub fn find_leader(&self, view: &View) -> Option<Leader> {
        let View { this, size, around } = *view;
        let here = &this.outline.pose;
        let forward = this.forward;
        let reach_m = LOOK_AHEAD_M
            + self.speed_mps * (self.time_gap_s + self.speed_mps / (2.0 * COMFORT_MPS2))
            + size.length_m / 2.0;
        let mut nearest: Option<Leader> = None;
        // A gap kept by order is not the gap of following.
        let kept = self.kept(around).map(|(kept, _)| kept.outline);
        for other in self.minded(around) {
            let outline = other.outline;
            if kept.is_some_and(|kept| core::ptr::eq(kept, outline)) {
                continue;
            }
            let delta = outline.pose.position - here.position;
            let reach_m = reach_m + outline.half_length_m;
            if delta.norm_squared() > reach_m * reach_m || forward.dot(&delta) < 0.0 {
                continue;
            }
            let on_own_way = self
                .in_corridor((&self.way, self.station_m, None), here, size, other)
                .filter(|leader| !self.evades(leader, size, other));
            let on_next_way = self.change.as_ref().and_then(|change| {
                self.in_corridor((&change.to, change.to_station_m, Some(change.ends_m)), here, size, other)
            });
            for leader in on_own_way.into_iter().chain(on_next_way) {
                if nearest.is_none_or(|found| leader.gap_m < found.gap_m) {
                    nearest = Some(leader);
                }
            }
        }
        nearest
    }

    /// All others that it minds. The ego vehicle is the first of all.
    #[inline]
    pub fn minded<'a>(&self, around: &'a Around) -> impl Iterator<Item = Other<'a>> {
        let minds = |rule: TrafficRule| !self.ignores.contains(rule);
        let (minds_ego, minds_others) = (minds(TrafficRule::Ego), minds(TrafficRule::Others));
        let ego = minds_ego.then(|| around.ego()).into_iter();
        ego.chain(around.obstacles().take_while(move |_| minds_others).map(Other::from))
    }

    /// Whether a lane change under way leads past a road user that stands in the lane it leaves. When the front reaches
    /// the road user, the vehicle has then already moved beside it. A road user that moves is a leader until the end of
    /// the change.
    fn evades(&self, leader: &Leader, size: &BodyParameters, other: Other) -> bool {
        let Some(change) = self.change.as_ref().filter(|_| other.velocity_mps.norm() < STANDING_MPS) else {
            return false;
        };
        let there_m = self.station_m + leader.gap_m + size.length_m / 2.0;
        let Some(beside) = self.way.path.project_from(other.outline.pose.position, there_m) else {
            return false;
        };
        let target = change.to.path.position_at(change.to_station_m);
        let over_m = self.way.path.pose_at(self.station_m).to_local(target).y;
        let part = change.done_after(leader.gap_m.max(0.0), self.speed_mps);
        let moved_m = (over_m + change.ends_m - self.aside_m()) * part;
        let (_, half_width_m) = other.outline.half_extent_m(other.forward, beside.forward);
        (beside.offset_m - self.aside_m() - moved_m).abs() - half_width_m - size.width_m / 2.0 > SIDE_ROOM_M
    }

    /// Acceleration behind a leader, m/s²: IDM's, or the braking that still avoids the leader if that is harder.
    pub fn follow_mps2(&self, size: &BodyParameters, leader: &Leader, free_mps2: f64) -> f64 {
        let closing_mps = self.speed_mps - leader.speed_mps;
        let model = following(size.acceleration_mps2_max, self.time_gap_s);
        let idm_mps2 = free_mps2 - model.interaction_mps2(self.speed_mps, leader.speed_mps, leader.gap_m);
        if closing_mps <= 0.0 {
            return idm_mps2;
        }
        let needed_mps2 = needed_mps2(closing_mps, (leader.gap_m - GAP_M_MIN / 2.0).max(0.1));
        if needed_mps2 > COMFORT_MPS2 { idm_mps2.min(-needed_mps2) } else { idm_mps2 }
    }

    /// Another road user as its leader, were it at `station_m` of a way, if that one is ahead and in its corridor.
    fn in_corridor(
        &self,
        (way, station_m, ends_m): (&Way, f64, Option<f64>),
        here: &Pose,
        size: &BodyParameters,
        Other { outline, forward, velocity_mps, elevation_m }: Other,
    ) -> Option<Leader> {
        let straight_m = (outline.pose.position - here.position).norm();
        let other = way.path.project_from(outline.pose.position, station_m + straight_m)?;
        let (half_length_m, half_width_m) = outline.half_extent_m(forward, other.forward);
        let gap_m = other.station_m - station_m - half_length_m - size.length_m / 2.0;
        let own_m = ends_m.unwrap_or_else(|| self.aside_after_m(gap_m));
        let aside_m = (other.offset_m - own_m).abs() - half_width_m - size.width_m / 2.0;
        let is_aside = other.station_m < station_m || aside_m > SIDE_ROOM_M;
        if is_aside || is_apart(way.height_at(other.station_m), elevation_m) {
            return None;
        }
        Some(Leader {
            gap_m,
            speed_mps: velocity_mps.dot(&other.forward),
            crosswise: forward.dot(&other.forward) < CROSSWISE_COS_MAX,
        })
    }
}
