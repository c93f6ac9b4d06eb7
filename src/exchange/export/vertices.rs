//! A recorded way with as few vertices as it needs.

use std::collections::BTreeSet;

use avastra_base::geometry::{OrientedBox, Pose, distance_m, wrap_angle};
use avastra_campaign::episode::{Actor, Recorder, Sample};
use avastra_world::sim::DT_S;

/// A player that goes straight from vertex to vertex at constant speed is nowhere farther than this from the recorded
/// place, m.
const STRAY_M: f64 = 0.01;
/// Nor turned farther from the recorded heading, rad: 2 cm at the front of a bus.
const STRAY_RAD: f64 = 0.002;
/// Where the ego vehicle and another come this near to each other, their ways have a vertex at each tick, m: a centimetre decides there
/// whether and when they touch.
const CLOSE_M: f64 = 0.1;
/// The longest time between two vertices, in ticks: 5 s. It bounds the search.
const STRIDE_TICKS_MAX: usize = 250;

/// Where a road user is at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vertex {
    pub time_s: f64,
    pub pose: Pose,
}

/// The ticks in which a road user moves close to the ego vehicle, or the ego vehicle to any other, up to the end of the one in
/// which they touch.
pub fn close_ticks(seen: &Recorder, actor: &Actor) -> BTreeSet<u64> {
    let others = seen.others.iter().filter(|other| actor.id == 0 || other.id == actor.id);
    others.flat_map(|other| close_to_ego(seen, other)).collect()
}

fn close_to_ego(seen: &Recorder, other: &Actor) -> Vec<u64> {
    let touched = seen.touches.iter().find(|touch| touch.id == other.id).map(|touch| touch.tick);
    let sample = |actor: &Actor, tick: u64| -> Option<Sample> {
        let at = usize::try_from(tick.checked_sub(actor.first_tick())?).ok()?;
        actor.samples.get(at).copied()
    };
    let outline =
        |actor: &Actor, pose: Pose| OrientedBox::new(pose, actor.shape.length_m, actor.shape.width_m);
    let is_close = |tick: &u64| {
        let (Some(ego), Some(own)) = (sample(&seen.ego, *tick), sample(other, *tick)) else { return false };
        let moves = ego.velocity_mps.norm_squared() + own.velocity_mps.norm_squared() > 0.0;
        let (ego, own) = (outline(&seen.ego, ego.pose), outline(other, own.pose));
        let reach_m = ego.radius_m() + own.radius_m() + CLOSE_M;
        (Some(*tick) == touched || moves)
            && (ego.pose.position - own.pose.position).norm_squared() <= reach_m * reach_m
            && distance_m(&ego, &own) <= CLOSE_M
    };
    (other.first_tick()..=touched.unwrap_or_else(|| other.last_tick())).filter(is_close).collect()
}

/// The way of a point of a road user that lies `ahead_m` before the middle of its outline. First and last sample are
/// always there, and those of the ticks in `wanted`.
pub fn vertices(actor: &Actor, ahead_m: f64, wanted: &BTreeSet<u64>) -> Vec<Vertex> {
    let all: Vec<Vertex> = actor
        .samples
        .iter()
        .map(|sample| Vertex { time_s: sample.tick as f64 * DT_S, pose: sample.pose.offset(ahead_m, 0.0) })
        .collect();
    let mut kept: Vec<Vertex> = all.first().copied().into_iter().collect();
    let mut from = 0;
    while from + 1 < all.len() {
        let farthest = (from + STRIDE_TICKS_MAX).min(all.len() - 1);
        let is_wanted = |at: usize| wanted.contains(&actor.samples[at].tick);
        let fits = |to: &usize| {
            (from + 1..*to)
                .all(|between| !is_wanted(between) && is_near(&all[between], &all[from], &all[*to]))
        };
        from = (from + 2..=farthest).take_while(fits).last().unwrap_or(from + 1);
        kept.push(all[from]);
    }
    kept
}

/// Whether a vertex lies near enough to the straight way from one vertex to another.
fn is_near(vertex: &Vertex, from: &Vertex, to: &Vertex) -> bool {
    let part = (vertex.time_s - from.time_s) / (to.time_s - from.time_s);
    let place = from.pose.position + (to.pose.position - from.pose.position) * part;
    let turn_rad = wrap_angle(to.pose.heading_rad - from.pose.heading_rad);
    let heading_rad = from.pose.heading_rad + turn_rad * part;
    (place - vertex.pose.position).norm() <= STRAY_M
        && wrap_angle(heading_rad - vertex.pose.heading_rad).abs() <= STRAY_RAD
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use avastra_base::geometry::Vec2;
    use avastra_campaign::episode::{Sample, Touch};

    /// The ego vehicle where it is after each tick of a speed (m/s) and a turn (rad/s), which change evenly from one of
    /// these to the next in `TICKS_BETWEEN` ticks.
    fn driven(moments: &[(f64, f64)]) -> Actor {
        const TICKS_BETWEEN: usize = 60;
        let mut actor = Actor::ego();
        let mut pose = Pose::new(10.0, -20.0, 3.0);
        for pair in moments.windows(2) {
            for step in 0..TICKS_BETWEEN {
                let part = step as f64 / TICKS_BETWEEN as f64;
                let speed_mps = pair[0].0 + (pair[1].0 - pair[0].0) * part;
                let turn_radps = pair[0].1 + (pair[1].1 - pair[0].1) * part;
                let velocity_mps = pose.forward() * speed_mps;
                // It appears late: ticks are not places in the list.
                let tick = 100 + actor.samples.len() as u64;
                actor.samples.push(Sample { tick, pose, velocity_mps });
                let next = pose.position + velocity_mps * DT_S;
                pose = Pose::new(next.x, next.y, wrap_angle(pose.heading_rad + turn_radps * DT_S));
            }
        }
        actor
    }

    proptest! {
        #[test]
        fn a_thinned_way_stays_near_the_recorded_one(
            moments in prop::collection::vec((0.0..30.0_f64, -0.6..0.6_f64), 2..12),
            ahead_m in -3.0..3.0_f64,
        ) {
            let actor = driven(&moments);
            let way = vertices(&actor, ahead_m, &BTreeSet::new());
            prop_assert!(way.is_sorted_by(|a, b| a.time_s < b.time_s));
            let ends = [actor.samples[0], actor.samples[actor.samples.len() - 1]];
            prop_assert_eq!([way[0].time_s, way[way.len() - 1].time_s], ends.map(|end| end.tick as f64 * DT_S));
            for sample in &actor.samples {
                let time_s = sample.tick as f64 * DT_S;
                let next = way.partition_point(|vertex| vertex.time_s < time_s).max(1);
                let [from, to] = [way[next - 1], way[next]];
                let part = (time_s - from.time_s) / (to.time_s - from.time_s);
                let wanted = sample.pose.offset(ahead_m, 0.0);
                let place = from.pose.position * (1.0 - part) + to.pose.position * part;
                prop_assert!((place - wanted.position).norm() <= STRAY_M + 1e-9, "{} s", time_s);
                let heading_rad = from.pose.heading_rad
                    + part * wrap_angle(to.pose.heading_rad - from.pose.heading_rad);
                prop_assert!(wrap_angle(heading_rad - wanted.heading_rad).abs() <= STRAY_RAD + 1e-9, "{} s", time_s);
            }
        }
    }

    /// One at rest and one that comes at 0.02 m a tick from 0.21 m away: near from the sixth tick on, in contact at the end of
    /// the eleventh.
    #[test]
    fn ticks_near_a_contact_are_kept_up_to_it() {
        let mut seen = Recorder::default();
        let mut other = Actor::ego();
        other.id = 3;
        let length_m = seen.ego.shape.length_m;
        for tick in 0..30_u64 {
            let x_m = -length_m - 0.21 + 0.02 * tick as f64;
            seen.ego.samples.push(Sample {
                tick,
                pose: Pose::new(0.0, 0.0, 0.0),
                velocity_mps: Vec2::zeros(),
            });
            let velocity_mps = Vec2::new(1.0, 0.0);
            other.samples.push(Sample { tick, pose: Pose::new(x_m, 0.0, 0.0), velocity_mps });
        }
        seen.others.push(other);
        seen.touches.push(Touch { tick: 11, id: 3 });
        let ego = close_ticks(&seen, &seen.ego);
        assert_eq!(ego, (6..=11).collect());
        assert_eq!(close_ticks(&seen, &seen.others[0]), ego);
    }

    #[test]
    fn a_straight_way_needs_few_vertices() {
        let way = vertices(&driven(&[(10.0, 0.0); 11]), 0.0, &BTreeSet::from([400, 401]));
        let ticks: Vec<f64> = way.iter().map(|vertex| (vertex.time_s / DT_S).round() - 100.0).collect();
        assert_eq!(ticks, [0.0, 250.0, 300.0, 301.0, 551.0, 599.0]);
    }
}
