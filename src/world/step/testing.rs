//! Traffic put where a test of another module wants it.

use crate::scene::way::Way;
use crate::state::driver::{Cruise, Driver};
use crate::state::obstacle::choices;
use crate::state::road_user::{Motion, Mover, RoadUser};
use crate::state::world::World;
use avastra_lang::model::body::parameters;
use avastra_lang::model::vocabulary::{Body, Colour, Verb};
use avastra_road::LaneIndex;

impl World {
    /// Puts a sedan on a lane of a road, at a station of its way, with a speed that it keeps where it can. Its way
    /// leads through the other road. It does not yield to the ego vehicle.
    pub fn put(&mut self, road: &str, lane: i32, through: &str, station_m: f64, speed_mps: f64) {
        let map = &self.scene.map;
        let first = map.place(road, lane, 100.0).expect("the lane is there").lane;
        let next = map.lane(first).successors.iter().copied();
        let next = next.filter(|lane| map.lane(*lane).key.road == through);
        let lanes: Vec<LaneIndex> = [first].into_iter().chain(next).collect();
        let mut rng = choices(self.seed, self.next_id, 0);
        let way = Way::along(&self.scene.roads, &lanes, &mut rng).expect("the lanes follow each other");
        let size = parameters(Body::Sedan);
        let driver = Driver::new(&self.scene, way, station_m, Cruise::Commanded(speed_mps), Vec::new());
        let moved = driver.moved(&size);
        let mover = Mover::new(size, Motion::Drive(driver));
        let around = self.alone();
        let verb = Verb::CrossRoad;
        let user = RoadUser::new(&around, self.next_id, Body::Sedan, Colour::Red, verb, mover, moved);
        self.users.push(user);
        self.next_id += 1;
    }

    /// The latest to appear.
    #[cfg(test)]
    pub(crate) fn latest(&self) -> &RoadUser {
        self.users.last().expect("somebody is there")
    }

    /// The latest to appear is an emergency vehicle under way from now on.
    pub fn sound_siren(&mut self) {
        let latest = self.users.last_mut().expect("somebody is there");
        let Motion::Drive(driver) = &mut latest.mover.motion else { panic!("it is driven") };
        driver.has_siren = true;
    }
}
