//! Where drivers were told to go at the next junction.

use avastra_lang::model::vocabulary::Turning;

use crate::state::driver::{Driver, MeantTurn};
use crate::view::around::{Around, View};
use avastra_lang::model::body::BodyParameters;

impl Driver {
    /// Whether it can go there at the next junction from the lane that it is in, or changes to.
    ///
    /// # Errors
    /// That it cannot, in words.
    pub fn can_turn(&self, to: Turning, around: &Around, size: &BodyParameters) -> Result<(), String> {
        let (way, station_m) = match &self.change {
            Some(change) => (&change.to, change.to_station_m),
            None => (&self.way, self.station_m),
        };
        way.can_turn(&around.scene.map, station_m + size.length_m / 2.0, self.speed_mps, to)
    }

    /// Lays its way to where it was told to go, as soon as its lane leads there. Forgets what is behind it.
    pub fn heed_turn(&mut self, view: &View) {
        let View { this, size, around } = *view;
        let Some(MeantTurn { to, lane }) = self.turn else { return };
        // One that comes into its way by a lane change has that way still before it.
        if self.change.is_some() || self.plans_way() {
            return;
        }
        if let Some(lane) = lane {
            let rear_m = self.station_m - size.length_m / 2.0;
            if !self.way.lanes_from(rear_m).any(|(ahead, _)| ahead == lane) {
                self.turn = None;
            }
            return;
        }
        let (map, front_m) = (&around.scene.map, self.station_m + size.length_m / 2.0);
        if self.way.can_turn(map, front_m, self.speed_mps, to).is_err() {
            return;
        }
        let mut lane = self.way.next_turn(map, front_m, to);
        if lane.is_none() {
            let mut rng = self.draw(this.id, around);
            let turned = self.way.turned(&around.scene.roads, (self.station_m, front_m), to, &mut rng);
            if let Some((way, station_m, turns_in)) = turned {
                self.go_on_along(way, station_m);
                // It was let go on another way.
                self.insists_to_m = f64::NEG_INFINITY;
                lane = turns_in;
            }
        }
        self.mean_to_turn(to, lane);
    }

    /// Where a new way in another lane has to lead at its first junction: nowhere if it is in its junction, or beyond it.
    pub fn turn_to_lay(&self, size: &BodyParameters) -> Option<Turning> {
        let front_m = self.station_m + size.length_m / 2.0;
        let is_before = |lane| self.way.lane_begin_m(lane).is_none_or(|begin_m| begin_m > front_m);
        self.turn.filter(|turn| turn.lane.is_none_or(is_before)).map(|turn| turn.to)
    }
}
