//! How long pedestrians have stood: weakness (f) ignores those who have done so for some time.

use super::super::perception::FRAME_S;
use super::super::prediction::Forecast;

#[derive(Debug, Clone, Default)]
pub struct Standing {
    known: Vec<Stood>,
}

#[derive(Debug, Clone, Copy)]
struct Stood {
    id: u32,
    time_s: f64,
    seen: bool,
}

impl Standing {
    /// One cycle later.
    pub fn update(&mut self, forecasts: &[Forecast]) {
        self.known.iter_mut().for_each(|stood| stood.seen = false);
        for forecast in forecasts.iter().filter(|forecast| !forecast.body.is_vehicle() && !forecast.moving) {
            match self.known.iter_mut().find(|stood| stood.id == forecast.id) {
                Some(stood) => {
                    stood.time_s += FRAME_S;
                    stood.seen = true;
                }
                None => self.known.push(Stood { id: forecast.id, time_s: 0.0, seen: true }),
            }
        }
        self.known.retain(|stood| stood.seen);
    }

    /// For how long a pedestrian has stood, s; 0 for anybody who moves.
    pub fn time_s(&self, id: u32) -> f64 {
        self.known.iter().find(|stood| stood.id == id).map_or(0.0, |stood| stood.time_s)
    }
}
