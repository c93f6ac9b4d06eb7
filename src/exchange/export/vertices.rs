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
    use super::*;
    use avastra_base::geometry::Vec2;
    use avastra_campaign::episode::Touch;

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
        let mut actor = Actor::ego();
        // It appears late: ticks are not places in the list.
        actor.samples.extend((100..700_u32).map(|tick| Sample {
            tick: tick.into(),
            pose: Pose::new(0.2 * f64::from(tick), 0.0, 0.0),
            velocity_mps: Vec2::new(10.0, 0.0),
        }));
        let way = vertices(&actor, 0.0, &BTreeSet::from([400, 401]));
        let ticks: Vec<f64> = way.iter().map(|vertex| (vertex.time_s / DT_S).round() - 100.0).collect();
        assert_eq!(ticks, [0.0, 250.0, 300.0, 301.0, 551.0, 599.0]);
    }
}
