//! Ambient traffic: vehicles that no action commanded and that only drive on.
//!
//! An episode that asks for it keeps a number of them around the ego vehicle. At the start they are there already.
//! Later ones appear on streets beyond the range of the ego vehicle's sensors. They leave when they are [`BEHIND_M`]
//! beyond that range behind it, or [`AROUND_M`] anywhere. Place, body, colour and speed are drawn from a separate
//! stream, with one index for each attempt. So commanded traffic draws the same with and without them. They drive at 80
//! to 100 % of each lane's limit, change lanes where they gain by it (`npc::mobil`), and turn as drawn. They yield
//! (`npc::manners`), to the ego vehicle, too. They count neither towards the ten obstacles of the published package nor
//! among `npc#1`, `npc#2`, …: their ids begin above `state::ambient::COMMANDED_MAX`.

use avastra_base::geometry::OrientedBox;
use avastra_base::rng;
use avastra_base::rng::{Rng, Stream};
use avastra_lang::model::body;
use avastra_lang::model::field::IgnoredRules;
use avastra_lang::model::vocabulary::{Body, BodyClass, Colour, Verb, Word};
use avastra_road::is_apart;

use crate::scene::lanes::may_use;
use crate::scene::way::Way;
use crate::state::ambient::Ambient;
use crate::state::driver::{Cruise, Driver};
use crate::state::obstacle::Obstacle;
use crate::state::road_user::{Motion, Mover, RoadUser};
use crate::view::around::Around;

/// Ticks between two checks whether vehicles are missing: half a second.
pub const RENEWAL_TICKS: u64 = 25;

/// Ambient vehicles leave when they are so far beyond the range of the ego vehicle's sensors, m; behind it sooner.
const AROUND_M: f64 = 80.0;
const BEHIND_M: f64 = 20.0;
/// Least distance to the ego vehicle at the start of an episode, m: two seconds at 50 km/h and the way to brake. For a
/// faster ego vehicle it is the way of two seconds.
const START_ROOM_M: f64 = 45.0;
const START_ROOM_S: f64 = 2.0;
/// Least gap between a newcomer and any other road user, m.
const ROOM_M: f64 = 20.0;
/// Least distance of a newcomer to the end of a street, where a signal may be red, m. It is the way to brake from 50
/// km/h at 3 m/s², rounded down.
const STREET_END_M: f64 = 30.0;
/// Draws before an attempt is given up: at the start, when all are to find a place, and later.
const START_DRAWS_MAX: usize = 256;
const DRAWS_MAX: usize = 64;

impl Ambient {
    /// One attempt at a newcomer. `begins`: before the first tick, when the ego vehicle has seen nothing.
    pub fn attempt(&mut self, around: &Around, begins: bool) -> Option<RoadUser> {
        let mut rng = rng::stream(around.seed, Stream::Ambient, self.attempts);
        self.attempts += 1;
        let range_m = around.scene.range_m;
        let nearest_m = if begins { START_ROOM_M.max(START_ROOM_S * around.ego.speed_mps) } else { range_m };
        let draws = if begins { START_DRAWS_MAX } else { DRAWS_MAX };
        let id = self.next_id;
        let placed = (0..draws).find_map(|_| draw(around, nearest_m, id, &mut rng))?;
        self.next_id += 1;
        Some(placed)
    }
}

/// Whether an ambient vehicle is so far away that it can leave unseen.
pub fn is_gone(obstacle: &Obstacle, ego: &OrientedBox, range_m: f64) -> bool {
    let there = ego.pose.to_local(obstacle.outline.pose.position);
    let away_m2 = there.norm_squared();
    let (behind_m, around_m) = (range_m + BEHIND_M, range_m + AROUND_M);
    away_m2 > around_m * around_m || there.x < 0.0 && away_m2 > behind_m * behind_m
}

/// A vehicle somewhere on a street, if it may appear there.
fn draw(around: &Around, nearest_m: f64, id: u32, rng: &mut Rng) -> Option<RoadUser> {
    let (lane, station_m) = around.scene.street_at(rng::unit(rng))?;
    let bodies =
        || Body::ALL.iter().filter(|body| BodyClass::Vehicle.holds(**body) && !body.has_two_wheels());
    let body = *bodies().nth(rng::below(rng, bodies().count() as u32) as usize)?;
    if !may_use(around.scene, lane, body, IgnoredRules::default()) {
        return None;
    }
    let colour = Colour::ALL[rng::below(rng, Colour::ALL.len() as u32) as usize];
    let cruise =
        Cruise::Limit(rng::between(rng, around.traffic.limit_part_min, around.traffic.limit_part_max));
    let size = body::parameters(body);
    let centre = &around.scene.map.lane(lane).centre;
    let around_m = around.scene.range_m + AROUND_M;
    let here = centre.position_at(station_m);
    let away = here - around.ego_outline.pose.position;
    let height_m = around.scene.map.lane(lane).height_at(station_m);
    // Asked before its way is laid, which takes longer. `has_room` then asks for the gap.
    let is_taken = |other: &Obstacle| {
        let away = other.outline.pose.position - here;
        away.norm_squared() < ROOM_M * ROOM_M && !is_apart(height_m, other.elevation_m)
    };
    if !(nearest_m * nearest_m..around_m * around_m).contains(&away.norm_squared())
        || !(size.length_m..centre.length_m() - STREET_END_M).contains(&station_m)
        || around.obstacles().any(is_taken)
    {
        return None;
    }
    let way = Way::along(&around.scene.roads, &[lane], rng)?;
    let driver = Driver::new(around.scene, way, station_m, cruise, Vec::new());
    let moved = driver.moved(&size);
    let mover = Mover::new(size, Motion::Drive(driver));
    let newcomer = RoadUser::new(around, id, body, colour, Verb::DriveAhead, mover, moved);
    newcomer.has_room(around, ROOM_M).then_some(newcomer)
}
