//! The possible ways of pedestrians near a carriageway. A pedestrian who walks towards it crosses it, one who walks
//! along it stays beside it, and one who stands at the kerb and faces it may set out, which gets less probable the
//! longer the wait. Apollo's `SEMANTIC_LSTM` learns this from maps; the rule and its figures are ours.

use avastra_base::geometry::{Vec2, unit_vector};
use avastra_road::{LanePlace, RoadMap};
use avastra_world::sim::FRAME_S;

use super::{FRAME_REACH_M, Forecast, STEP_S};

/// A pedestrian is at the kerb up to this far from the nearest lane's edge, m.
const KERB_M: f64 = 2.0;
/// Faces the carriageway within 60° of the way across: cosine.
const FACING_COSINE: f64 = 0.5;
/// Slower than this across the way, a pedestrian walks along it, m/s.
const ACROSS_MPS: f64 = 0.3;
/// Chance of setting out within the next seconds, at a crosswalk and elsewhere.
const SETS_OUT_AT_CROSSWALK: f64 = 0.5;
const SETS_OUT: f64 = 0.3;
/// A crosswalk so near is one that the pedestrian may use, m.
const CROSSWALK_M: f64 = 3.0;
/// Someone who has waited for long is likely to wait on: the chance halves in this time, s.
const WAITED_S: f64 = 3.0;
/// Less probable is not followed.
const PROBABILITY_MIN: f64 = 0.05;
/// A pedestrian who sets out does so after this time, s, at this speed, m/s: the mean of walkers.
const SETS_OUT_AFTER_S: f64 = 0.5;
const WALK_MPS: f64 = 1.3;

/// The memory of a pedestrian from frame to frame.
#[derive(Debug, Clone, Copy, Default)]
pub struct Walker {
    /// How long it has stood, s.
    stood_s: f64,
    /// The lane that it was on, as long as it is on that.
    on: Option<LanePlace>,
}

impl Walker {
    /// Adds the hypotheses of the next frame, if there may be `several`; `forecast` is the one that keeps its velocity.
    pub fn predict(
        &mut self,
        map: &RoadMap,
        mut forecast: Forecast,
        several: bool,
        forecasts: &mut Vec<Forecast>,
    ) {
        self.stood_s = if forecast.moving { 0.0 } else { self.stood_s + FRAME_S };
        let sets_out = self.sets_out(map, &mut forecast, several);
        if let Some(sets_out) = &sets_out {
            forecast.probability = 1.0 - sets_out.probability;
        }
        forecasts.push(forecast);
        forecasts.extend(sets_out);
    }

    /// The hypothesis that a pedestrian who stands at the kerb sets out. One who walks along the carriageway is made to stay
    /// beside it.
    fn sets_out(&mut self, map: &RoadMap, forecast: &mut Forecast, several: bool) -> Option<Forecast> {
        let position = forecast.positions[0];
        let waiting = libm::exp2(-self.stood_s / WAITED_S);
        let chance_max = SETS_OUT.max(SETS_OUT_AT_CROSSWALK) * waiting;
        if !forecast.moving && (!several || chance_max < PROBABILITY_MIN) {
            return None;
        }
        // On the carriageway there is nothing to wait for.
        self.on = self.on.and_then(|place| still_on(map, place, position));
        if self.on.is_some() {
            return None;
        }
        let place = map.nearest(position, forecast.heading_rad, KERB_M)?;
        let lane = map.lane(place.lane);
        if place.offset_m.abs() <= lane.width_at(place.station_m) / 2.0 {
            self.on = Some(place);
            return None;
        }
        let along = lane.centre.pose_at(place.station_m).forward();
        let across = Vec2::new(along.y, -along.x) * place.offset_m.signum();
        if forecast.moving {
            let velocity_mps = forecast.velocity_mps;
            if velocity_mps.dot(&across).abs() < ACROSS_MPS {
                walk(forecast, along * velocity_mps.dot(&along), 0.0);
            }
            return None;
        }
        let facing = unit_vector(forecast.heading_rad).dot(&across) >= FACING_COSINE;
        let chance = if is_near_crosswalk(map, position) { SETS_OUT_AT_CROSSWALK } else { SETS_OUT };
        let chance = chance * waiting;
        if !facing || chance < PROBABILITY_MIN {
            return None;
        }
        let velocity_mps = across * WALK_MPS;
        let mut sets_out = Forecast { probability: chance, moving: true, velocity_mps, ..forecast.clone() };
        walk(&mut sets_out, velocity_mps, SETS_OUT_AFTER_S);
        Some(sets_out)
    }
}

/// The same lane, if a position near is on it.
fn still_on(map: &RoadMap, place: LanePlace, position: Vec2) -> Option<LanePlace> {
    let lane = map.lane(place.lane);
    let found = lane.centre.project_near(position, place.station_m, FRAME_REACH_M);
    let is_on = found.distance_m <= lane.width_at(found.station_m) / 2.0;
    is_on.then_some(LanePlace { station_m: found.station_m, offset_m: found.offset_m, ..place })
}

/// Walks at a velocity from a moment on.
fn walk(forecast: &mut Forecast, velocity_mps: Vec2, after_s: f64) {
    let position = forecast.positions[0];
    for (step, slot) in forecast.positions.iter_mut().enumerate() {
        *slot = position + velocity_mps * (step as f64 * STEP_S - after_s).max(0.0);
    }
}

/// Whether a crosswalk begins or lies within reach: its corners are asked, and its middle.
fn is_near_crosswalk(map: &RoadMap, position: Vec2) -> bool {
    map.crosswalks.iter().any(|crosswalk| {
        let corners = &crosswalk.outline;
        corners.iter().enumerate().any(|(index, corner)| {
            let next = &corners[(index + 1) % corners.len()];
            let edge = next - corner;
            let fraction = ((position - corner).dot(&edge) / edge.norm_squared().max(1e-9)).clamp(0.0, 1.0);
            (corner + edge * fraction - position).norm() <= CROSSWALK_M
        })
    })
}
