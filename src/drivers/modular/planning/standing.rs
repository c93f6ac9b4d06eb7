//! How long pedestrians have stood: weakness `creeps_to_standing_pedestrian` creeps towards those who have stood for
//! some time.
//!
//! Tracked speeds are too noisy to tell that a pedestrian stands; staying in one place tells it.

use avastra_base::geometry::Vec2;
use avastra_world::sim::FRAME_S;

use super::super::prediction::Forecast;

/// A pedestrian who stays this near to a place stands there, m. Ours.
const PLACE_M: f64 = 0.5;

#[derive(Debug, Clone, Default)]
pub struct Standing {
    known: Vec<Stood>,
}

#[derive(Debug, Clone, Copy)]
struct Stood {
    id: u32,
    place: Vec2,
    time_s: f64,
    seen: bool,
}

impl Standing {
    /// Once a cycle: counts on for pedestrians who have stayed, and forgets those who are gone.
    pub fn update(&mut self, forecasts: &[Forecast]) {
        self.known.iter_mut().for_each(|stood| stood.seen = false);
        for walker in forecasts.iter().filter(|forecast| !forecast.body.is_vehicle()) {
            let position = walker.positions[0];
            let fresh = Stood { id: walker.id, place: position, time_s: 0.0, seen: true };
            match self.known.iter_mut().find(|stood| stood.id == walker.id) {
                // A pedestrian may have several futures, but is in one place.
                Some(stood) if stood.seen => {}
                Some(stood) if (position - stood.place).norm() > PLACE_M => *stood = fresh,
                Some(stood) => {
                    stood.time_s += FRAME_S;
                    stood.seen = true;
                }
                None => self.known.push(fresh),
            }
        }
        self.known.retain(|stood| stood.seen);
    }

    /// For how long a pedestrian has been in one place, s.
    pub fn time_s(&self, id: u32) -> f64 {
        self.known.iter().find(|stood| stood.id == id).map_or(0.0, |stood| stood.time_s)
    }
}
