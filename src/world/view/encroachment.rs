//! Post-encroachment time (Allen, Shin and Cooper 1978): how long after one of two left a place the other is there.

use std::collections::VecDeque;

use avastra_base::geometry::{OrientedBox, distance_m};
use avastra_lang::model::TIME_S_MAX;

use crate::state::time::DT_S;
use crate::state::world::World;

/// How far back it is looked, ticks: 5 s.
const PAST_TICKS: usize = 250;

/// Where the ego vehicle and the others were in the last seconds.
#[derive(Debug, Clone, Default)]
pub struct Encroachment {
    ego: Trail,
    others: Vec<(u32, Trail)>,
}

/// Outlines, tick by tick, the latest first.
type Trail = VecDeque<OrientedBox>;

impl Encroachment {
    /// Notes the places of the ego vehicle and of all road users. To be called at every tick.
    pub fn note(&mut self, world: &World) {
        add(&mut self.ego, &world.ego_outline());
        self.others.retain(|(id, _)| world.obstacle(*id).is_some());
        for obstacle in world.obstacles() {
            let known = self.others.iter().position(|(id, _)| *id == obstacle.id);
            let index = known.unwrap_or_else(|| {
                self.others.push((obstacle.id, Trail::new()));
                self.others.len() - 1
            });
            add(&mut self.others[index].1, &obstacle.outline);
        }
    }

    /// Time since the ego vehicle or this road user left the place where the other one is now, s; [`TIME_S_MAX`] if
    /// neither was there lately.
    pub fn pet_s(&self, id: u32) -> f64 {
        let trail = self.others.iter().find(|(known, _)| *known == id).map(|(_, trail)| trail);
        let Some(((ego, other), trail)) =
            trail.and_then(|trail| Some(((self.ego.front()?, trail.front()?), trail)))
        else {
            return TIME_S_MAX;
        };
        let ago = (1..self.ego.len()).find(|&ago| {
            overlap(&self.ego[ago], other) || trail.get(ago).is_some_and(|before| overlap(before, ego))
        });
        ago.map_or(TIME_S_MAX, |ago| ago as f64 * DT_S)
    }
}

fn add(trail: &mut Trail, outline: &OrientedBox) {
    if trail.len() > PAST_TICKS {
        trail.pop_back();
    }
    trail.push_front(*outline);
}

fn overlap(one: &OrientedBox, other: &OrientedBox) -> bool {
    let reach_m = one.radius_m() + other.radius_m();
    let is_near = (one.pose.position - other.pose.position).norm_squared() <= reach_m * reach_m;
    is_near && distance_m(one, other) <= 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use avastra_base::geometry::{Pose, Vec2};

    fn at(x_m: f64, y_m: f64, heading_rad: f64) -> OrientedBox {
        let pose = Pose { position: Vec2::new(x_m, y_m), heading_rad };
        OrientedBox { pose, half_length_m: 2.0, half_width_m: 1.0 }
    }

    /// One comes from the west, the other from the south, both at 10 m/s; the second crosses so much later.
    fn crossing(later_s: f64) -> Vec<f64> {
        let mut watched = Encroachment { ego: Trail::new(), others: vec![(1, Trail::new())] };
        let ticks = (0..400).map(|tick| f64::from(tick) * DT_S);
        let pet = ticks.map(|time_s| {
            add(&mut watched.ego, &at(10.0 * (time_s - 2.0), 0.0, 0.0));
            let other = at(0.0, 10.0 * (time_s - 2.0 - later_s), core::f64::consts::FRAC_PI_2);
            add(&mut watched.others[0].1, &other);
            watched.pet_s(1)
        });
        pet.collect()
    }

    #[test]
    fn who_crosses_behind_another_is_there_later_by_so_much() {
        for later_s in [1.0, 2.0, 3.5] {
            let least_s = crossing(later_s).into_iter().fold(TIME_S_MAX, f64::min);
            // The first one's rear leaves the second one's strip 0.3 s after its middle passed. The second one's front
            // enters 0.3 s before its own middle.
            let wanted_s = later_s - 0.6;
            assert!((least_s - wanted_s).abs() <= 1.01 * DT_S, "{least_s} s in place of {wanted_s} s");
        }
        assert!(crossing(6.0).into_iter().all(|pet_s| pet_s == TIME_S_MAX), "it is not remembered so long");
    }

    #[test]
    fn nobody_was_where_a_stranger_is() {
        assert_eq!(Encroachment::default().pet_s(1), TIME_S_MAX);
    }
}
