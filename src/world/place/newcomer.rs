//! A road user that is not there yet: what others will see of it, and whether it has room.

use crate::state::obstacle::{Moved, Obstacle};
use crate::state::road_user::{Mover, RoadUser};
use crate::view::around::{Around, Other};
use avastra_base::geometry::{OrientedBox, distance_m};
use avastra_lang::model::vocabulary::{Body, Colour, ShownLights, Verb};
use avastra_road::is_apart;

/// Whatever walks or stands is beside this stretch of the ego vehicle's route, before and behind it, m.
const ON_FOOT_M: f64 = 200.0;

impl RoadUser {
    /// A newcomer where `moved` says.
    pub fn new(
        around: &Around,
        id: u32,
        body: Body,
        colour: Colour,
        verb: Verb,
        mover: Mover,
        moved: Moved,
    ) -> RoadUser {
        let outline = OrientedBox::new(moved.pose, mover.size.length_m, mover.size.width_m);
        let obstacle = Obstacle {
            id,
            body,
            colour,
            verb,
            outline,
            forward: moved.forward,
            height_m: mover.size.height_m,
            lane_heading_rad: moved.lane_heading_rad,
            velocity_mps: moved.velocity_mps,
            acceleration_mps2: 0.0,
            elevation_m: mover.elevation_m().unwrap_or_else(|| {
                let route = &around.scene.route;
                let beside = route.path.project_near(moved.pose.position, around.ego_station_m, ON_FOOT_M);
                route.height_at(&around.scene.map, beside.station_m)
            }),
            is_apart: false,
            distance_m: distance_m(around.ego_outline, &outline),
            spawned_tick: around.tick,
            lights: ShownLights::Off,
        };
        let mut newcomer = RoadUser { obstacle, mover };
        newcomer.obstacle.is_apart = around.is_apart_from_ego(&newcomer);
        newcomer
    }

    /// Whether every other road user, the ego vehicle included, is at least `room_m` away.
    pub fn has_room(&self, around: &Around, room_m: f64) -> bool {
        self.who_is_there(around, room_m).is_none()
    }

    /// The first one that leaves it no such room; the ego vehicle before all others.
    pub fn who_is_there<'a>(&self, around: &'a Around, room_m: f64) -> Option<Other<'a>> {
        let this = &self.obstacle;
        around.others().find(|other| {
            distance_m(&this.outline, other.outline) < room_m
                && !is_apart(this.elevation_m, other.elevation_m)
        })
    }
}
