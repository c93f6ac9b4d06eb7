//! Measures of danger beside ProC: TTC, THW, DRAC, required deceleration, RSS, PET.
//!
//! Definitions after Westhofen et al., "Criticality Metrics for Automated Driving" (2022), and for RSS
//! Shalev-Shwartz, Shammah and Shashua (2017). They are computed ten times a second, from the true world
//! and not from what a driving system believes, as if road users kept velocity and heading.

use avastra_base::geometry::{Bounds, OrientedBox, Pose, Sweep, Vec2, distance_m, first_contact, wrap_angle};
use avastra_base::kinematics::STANDING_MPS;
use avastra_drivers::Rss;
use avastra_world::sim::{FRAME_S, FRAME_TICKS, Obstacle, World};

/// Contacts later than this are not looked for, s.
const TTC_S_MAX: f64 = 8.0;
/// Encroachments farther apart in time than this are not looked for, s. Above 2 s is normal traffic.
const PET_S_MAX: f64 = 5.0;
/// Places of the ego vehicle that are looked at together, 0.8 s.
const PIECE: usize = 8;
/// Ways that differ less in heading than this do not cross, rad: 30°.
const CROSSING_RAD: f64 = core::f64::consts::PI / 6.0;

/// The most critical values over some time, of all road users around the ego vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct Criticality {
    /// Least time to collision, s: until the outlines would touch. `None` if they never would within
    /// 8 s.
    pub ttc_s: Option<f64>,
    /// Least time headway, s: the gap to a vehicle ahead in the ego vehicle's way, over the ego vehicle's speed.
    pub thw_s: Option<f64>,
    /// Greatest deceleration rate to avoid a crash, m/s²: `(v1 - v2)² / 2d` towards a slower vehicle ahead.
    pub drac_mps2: f64,
    /// Greatest deceleration that would stop the ego vehicle before an expected contact, m/s²:
    /// `v / 2 TTC`. Unlike DRAC it includes crossing and oncoming road users.
    pub required_mps2: f64,
    /// Time in which both distances to a road user were unsafe by RSS, s.
    pub rss_unsafe_s: f64,
}

impl Criticality {
    /// The most critical values of two periods.
    pub fn and(&self, other: &Criticality) -> Criticality {
        Criticality {
            ttc_s: least(self.ttc_s, other.ttc_s),
            thw_s: least(self.thw_s, other.thw_s),
            drac_mps2: self.drac_mps2.max(other.drac_mps2),
            required_mps2: self.required_mps2.max(other.required_mps2),
            rss_unsafe_s: self.rss_unsafe_s + other.rss_unsafe_s,
        }
    }

    /// Updates the values from the world of this moment, at one tick of five. Obstacles that have been hit
    /// already (`is_hit`) are left out.
    pub fn note(&mut self, world: &World, is_hit: &dyn Fn(u32) -> bool) {
        if !world.ticks().is_multiple_of(FRAME_TICKS) {
            return;
        }
        let speed_mps = world.ego().speed_mps;
        let mut is_unsafe = false;
        for obstacle in world.obstacles_on_level().filter(|obstacle| !is_hit(obstacle.id)) {
            let seen = Seen::of(world, obstacle);
            if let Some(ttc_s) = time_to_collision_s(world, obstacle) {
                self.ttc_s = least(self.ttc_s, Some(ttc_s));
                if ttc_s > 0.0 {
                    self.required_mps2 = self.required_mps2.max(speed_mps / (2.0 * ttc_s));
                }
            }
            if seen.is_ahead() {
                if speed_mps > STANDING_MPS {
                    self.thw_s = least(self.thw_s, Some(seen.gap_m / speed_mps));
                }
                self.drac_mps2 =
                    self.drac_mps2.max(deceleration_to_avoid_mps2(speed_mps, seen.along_mps, seen.gap_m));
            }
            is_unsafe |= seen.is_unsafe(speed_mps, &Rss::default());
        }
        if is_unsafe {
            self.rss_unsafe_s += FRAME_S;
        }
    }
}

fn least(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    a.into_iter().chain(b).reduce(f64::min)
}

/// Deceleration (m/s²) with which a follower comes down to the leader's speed just before the two touch;
/// 0 if the follower is not faster.
pub fn deceleration_to_avoid_mps2(follower_mps: f64, leader_mps: f64, gap_m: f64) -> f64 {
    let closing_mps = (follower_mps - leader_mps).max(0.0);
    if closing_mps == 0.0 {
        return 0.0;
    }
    // A gap of 0 would ask for an infinite deceleration, so a gap is at least a millimetre.
    closing_mps * closing_mps / (2.0 * gap_m.max(1e-3))
}

/// Time until the outlines touch if both keep velocity and heading, s; `None` beyond 8 s.
pub fn time_to_collision_s(world: &World, obstacle: &Obstacle) -> Option<f64> {
    let ego = world.ego_outline();
    let ego_velocity_mps = ego.pose.forward() * world.ego().speed_mps;
    let relative_mps = obstacle.velocity_mps - ego_velocity_mps;
    if obstacle.distance_m > relative_mps.norm() * TTC_S_MAX {
        return None;
    }
    touch_s((ego, ego_velocity_mps), (obstacle.outline, obstacle.velocity_mps))
}

/// When two outlines that keep their velocities and headings touch, s; `None` beyond 8 s.
fn touch_s(one: (OrientedBox, Vec2), other: (OrientedBox, Vec2)) -> Option<f64> {
    let sweep = |(start, velocity_mps): (OrientedBox, Vec2)| {
        let position = start.pose.position + velocity_mps * TTC_S_MAX;
        Sweep { start, end: Pose { position, heading_rad: start.pose.heading_rad } }
    };
    Some(first_contact(&sweep(one), &sweep(other))?.fraction * TTC_S_MAX)
}

/// An obstacle in the frame of the ego vehicle.
struct Seen {
    /// Gap between the outlines along the ego vehicle's heading, m; negative if they are beside each other.
    gap_m: f64,
    /// Gap between the outlines across the ego vehicle's heading, m.
    side_gap_m: f64,
    /// The obstacle's speed along the ego vehicle's heading, m/s.
    along_mps: f64,
    /// The obstacle's speed across that heading, towards the ego vehicle, m/s.
    towards_mps: f64,
    is_in_front: bool,
}

impl Seen {
    fn of(world: &World, obstacle: &Obstacle) -> Seen {
        let (ego, other) = (world.ego_outline(), &obstacle.outline);
        let place = ego.pose.to_local(other.pose.position);
        let turn_rad = other.pose.heading_rad - ego.pose.heading_rad;
        let (sin, cos) = (libm::sin(turn_rad).abs(), libm::cos(turn_rad).abs());
        let half_ahead_m = other.half_length_m * cos + other.half_width_m * sin;
        let half_left_m = other.half_length_m * sin + other.half_width_m * cos;
        let across_mps = ego.pose.left().dot(&obstacle.velocity_mps);
        Seen {
            gap_m: place.x.abs() - ego.half_length_m - half_ahead_m,
            side_gap_m: place.y.abs() - ego.half_width_m - half_left_m,
            along_mps: ego.pose.forward().dot(&obstacle.velocity_mps),
            towards_mps: if place.y > 0.0 { -across_mps } else { across_mps },
            is_in_front: place.x > 0.0,
        }
    }

    /// Whether the ego vehicle follows the obstacle: it is straight ahead and does not come towards it.
    fn is_ahead(&self) -> bool {
        self.is_in_front && self.gap_m > 0.0 && self.side_gap_m < 0.0 && self.along_mps >= 0.0
    }

    /// Whether both distances are unsafe by RSS and the ego vehicle must respond: an obstacle beside or behind
    /// must respond itself.
    fn is_unsafe(&self, speed_mps: f64, rss: &Rss) -> bool {
        let safe_m = if self.along_mps >= 0.0 {
            rss.longitudinal_m(speed_mps, self.along_mps)
        } else {
            rss.oncoming_m(speed_mps, -self.along_mps)
        };
        self.is_in_front
            && self.gap_m > 0.0
            && self.gap_m < safe_m
            && self.side_gap_m < rss.lateral_m(self.towards_mps)
    }
}

/// The least post-encroachment time of an episode: from when one road user leaves a place where ways cross until the other
/// comes. Requirements ask at every tick how long ago a road user left the place (`sim::Encroachment`). Here the world is
/// looked at every 0.1 s, and only ways that cross count.
#[derive(Debug, Clone, Default)]
pub struct LeastEncroachment {
    /// Outline of the ego vehicle every 0.1 s.
    ego: Vec<OrientedBox>,
    others: Vec<Trail>,
}

/// The outlines of an obstacle, every 0.1 s. One that was on another level in between has a trail before and one after.
#[derive(Debug, Clone)]
struct Trail {
    id: u32,
    begin: usize,
    outlines: Vec<OrientedBox>,
}

impl LeastEncroachment {
    /// Records the world of this moment, at one tick of five.
    pub fn note(&mut self, world: &World) {
        if !world.ticks().is_multiple_of(FRAME_TICKS) {
            return;
        }
        let frame = self.ego.len();
        self.ego.push(world.ego_outline());
        for obstacle in world.obstacles_on_level() {
            self.lengthen(obstacle.id, frame, obstacle.outline);
        }
    }

    fn lengthen(&mut self, id: u32, frame: usize, outline: OrientedBox) {
        let goes_on = |trail: &&mut Trail| trail.id == id && trail.begin + trail.outlines.len() == frame;
        match self.others.iter_mut().find(goes_on) {
            Some(trail) => trail.outlines.push(outline),
            None => self.others.push(Trail { id, begin: frame, outlines: vec![outline] }),
        }
    }

    /// The least post-encroachment time with any obstacle, s; `None` above 5 s. Obstacles that the ego
    /// vehicle has hit (`is_hit`) are left out: both were at one place at one time.
    pub fn least_s(&self, is_hit: &dyn Fn(u32) -> bool) -> Option<f64> {
        let most = (PET_S_MAX / FRAME_S) as usize;
        let mut least = most + 1;
        let position = |ego: &OrientedBox| ego.pose.position;
        let around = |piece: &[OrientedBox]| Bounds::around(&piece.iter().map(position).collect::<Vec<_>>());
        let pieces: Vec<Bounds> = self.ego.chunks(PIECE).map(around).collect();
        for trail in self.others.iter().filter(|trail| !is_hit(trail.id)) {
            let reach_m = self.ego[0].radius_m() + trail.outlines[0].radius_m();
            for (index, other) in trail.outlines.iter().enumerate() {
                let frame = trail.begin + index;
                let from = (frame + 1).saturating_sub(least);
                let until = (frame + least).min(self.ego.len());
                // Nearly all pairs are far apart, and a run has a hundred for each place of each road user.
                let is_near =
                    |piece: &usize| pieces[*piece].distance_m2_min(other.pose.position) < reach_m * reach_m;
                for piece in (from / PIECE..until.div_ceil(PIECE)).filter(is_near) {
                    for place in (piece * PIECE).max(from)..((piece + 1) * PIECE).min(until) {
                        if crosses(&self.ego[place], other, reach_m) {
                            least = least.min(place.abs_diff(frame));
                        }
                    }
                }
            }
        }
        (least <= most).then_some(least as f64 * FRAME_S)
    }
}

/// Whether two outlines overlap, with headings that cross. Farther apart than `reach_m` they do not.
fn crosses(ego: &OrientedBox, other: &OrientedBox, reach_m: f64) -> bool {
    let apart_m = ego.pose.position - other.pose.position;
    if apart_m.norm_squared() >= reach_m * reach_m {
        return false;
    }
    let turn_rad = wrap_angle(ego.pose.heading_rad - other.pose.heading_rad).abs();
    (CROSSING_RAD..=core::f64::consts::PI - CROSSING_RAD).contains(&turn_rad) && distance_m(ego, other) <= 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deceleration_is_by_the_formula() {
        // 10 m/s faster, 20 m apart: 100 / 40.
        assert_eq!(deceleration_to_avoid_mps2(15.0, 5.0, 20.0), 2.5);
        assert_eq!(deceleration_to_avoid_mps2(5.0, 15.0, 20.0), 0.0);
        assert!(deceleration_to_avoid_mps2(15.0, 5.0, 0.0).is_finite());
    }

    #[test]
    fn the_time_to_a_collision_is_that_of_the_outlines() {
        let outline = |x_m, y_m, heading_rad| OrientedBox::new(Pose::new(x_m, y_m, heading_rad), 4.0, 2.0);
        let ego = (outline(0.0, 0.0, 0.0), Vec2::new(10.0, 0.0));
        let met_s = |x_m, y_m, heading_rad, x_mps, y_mps| {
            touch_s(ego, (outline(x_m, y_m, heading_rad), Vec2::new(x_mps, y_mps)))
        };
        let is_near = |found: Option<f64>, wanted_s: f64| found.is_some_and(|s| (s - wanted_s).abs() < 1e-6);
        // 20 m between the bumpers; one that stands, one that comes, one that drives away.
        assert!(is_near(met_s(24.0, 0.0, 0.0, 0.0, 0.0), 2.0));
        assert!(is_near(met_s(24.0, 0.0, 0.0, -10.0, 0.0), 1.0));
        assert_eq!(met_s(24.0, 0.0, 0.0, 10.0, 0.0), None);
        // From the right: its front is 22 m before the ego vehicle's side, which is still there then.
        assert!(is_near(met_s(20.0, -25.0, core::f64::consts::FRAC_PI_2, 0.0, 10.0), 2.2));
        // A metre beside the ego vehicle's way, and beyond 8 s.
        assert_eq!(met_s(24.0, 3.0, 0.0, 0.0, 0.0), None);
        assert_eq!(met_s(90.0, 0.0, 0.0, 0.0, 0.0), None);
    }

    #[test]
    fn the_time_between_two_at_a_crossing_is_found() {
        // The ego vehicle leaves the crossing to the right at 10 m/s; a vehicle comes up from below later.
        let mut encroachment = LeastEncroachment::default();
        let outline = |x_m, y_m, heading_rad| OrientedBox::new(Pose::new(x_m, y_m, heading_rad), 4.0, 2.0);
        let upwards_rad = core::f64::consts::FRAC_PI_2;
        for frame in 0..80 {
            let driven_m = f64::from(frame);
            encroachment.ego.push(outline(driven_m - 20.0, 0.0, 0.0));
            // For a while it is below the ego vehicle's road.
            if !(10..20).contains(&frame) {
                encroachment.lengthen(3, frame as usize, outline(0.0, driven_m - 50.0, upwards_rad));
            }
        }
        // The rear leaves x = 1 m in frame 23; the front reaches y = -1 m in frame 47.
        let found_s = encroachment.least_s(&|_| false).unwrap();
        assert!((found_s - 2.4).abs() < 0.11, "{found_s}");
        assert_eq!(encroachment.least_s(&|id| id == 3), None);
    }
}
