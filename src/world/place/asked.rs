//! A request for a road user at a moment, and the steps that the verbs share to make it appear.

use std::sync::Arc;

use avastra_lang::model::vocabulary::Verb;
use avastra_road::LaneIndex;

use crate::action::SpawnRequest;
use crate::place::arrival::Arrivals;
use crate::scene::way::Way;
use crate::state::change::PlannedChange;
use crate::state::driver::{Cruise, Driver};
use crate::state::ego::VehicleParameters;
use crate::state::obstacle::Moved;
use crate::state::road_user::{Motion, Mover, RoadUser};
use crate::view::around::Around;
use avastra_lang::model::body::BodyParameters;

/// Least gap between a newcomer and any other road user, m.
pub const ROOM_M: f64 = 0.5;

/// A road user on a trajectory stands exactly where it was put: Euro NCAP parks cars 0.2 m apart.
pub const GUIDED_ROOM_M: f64 = 0.05;

/// A request at a moment: which road user shall appear, of which size, and with which id.
pub struct Asked<'a> {
    pub around: &'a Around<'a>,
    pub arrivals: &'a Arrivals,
    pub request: &'a SpawnRequest,
    pub size: BodyParameters,
    pub id: u32,
}

/// The road users that a request makes appear.
pub struct Newcomers {
    pub asked: RoadUser,
    /// The vehicle that is parked with it; its id follows.
    pub cover: Option<RoadUser>,
}

/// A driver at the speed that was asked for. If it was asked to turn, it does so in `turns_in`, if a way leads there already.
pub fn commanded(
    asked: &Asked,
    way: Arc<Way>,
    turns_in: Option<LaneIndex>,
    station_m: f64,
    plan: Vec<PlannedChange>,
) -> Driver {
    let cruise = Cruise::Commanded(asked.request.speed_mps);
    let mut driver = Driver::new(asked.around.scene, way, station_m, cruise, plan);
    asked.request.told.turn().iter().for_each(|to| driver.mean_to_turn(*to, turns_in));
    driver
}

/// The newcomer, if there is room for it.
pub fn finish(asked: &Asked, motion: Motion, moved: Moved) -> Result<RoadUser, String> {
    let Asked { around, request, size, id, .. } = *asked;
    let SpawnRequest { body, colour, verb, told, .. } = *request;
    let mut newcomer = RoadUser::new(around, id, body, colour, verb, Mover::new(size, motion), moved);
    newcomer.obstacle.lights = told.lights().unwrap_or(newcomer.obstacle.lights);
    let room_m = if verb == Verb::Follow { GUIDED_ROOM_M } else { ROOM_M };
    match newcomer.who_is_there(around, room_m) {
        None => Ok(newcomer),
        Some(other) if core::ptr::eq(other.outline, around.ego().outline) => {
            Err("the ego vehicle is there".into())
        }
        Some(other) => {
            let mut obstacles = around.obstacles();
            let it = obstacles.find(|obstacle| core::ptr::eq(&raw const obstacle.outline, other.outline));
            let it = it.expect("all but the ego vehicle are obstacles");
            Err(format!("npc#{} is nearer than {room_m:.1} m", it.id))
        }
    }
}

/// Station on the route of a centre that lies `distance_m` before the ego vehicle's front.
pub fn ahead_m(&Asked { around, request, size, .. }: &Asked) -> Result<f64, String> {
    let front_m = VehicleParameters::MKZ.front_m(around.ego_station_m);
    let station_m = front_m + request.distance_m + size.length_m / 2.0;
    if station_m > around.scene.route.path.length_m() {
        return Err("the route ends before that distance".into());
    }
    Ok(station_m)
}
