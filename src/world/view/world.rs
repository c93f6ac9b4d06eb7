//! Facts about a world, or about the world around one road user.

use avastra_base::geometry::Pose;
use avastra_lang::model::NpcFacts;
use avastra_lang::model::vocabulary::Body;
use avastra_road::RouteLaneChange;

use crate::state::ego::VehicleParameters;
use crate::state::obstacle::Obstacle;
use crate::state::road_user::RoadUser;
use crate::state::sensed::{Sensed, SensedObject};
use crate::state::world::World;
use crate::view::moment::npc_facts;

/// An obstacle farther ahead than this on the route does not block the ego vehicle, m: a queue of five cars.
const QUEUE_M: f64 = 40.0;

/// An ego vehicle farther than this from its way and from every lane of the map has left the map, m. One that went astray beside
/// a street is nearer.
const OFF_MAP_M: f64 = 20.0;

impl World {
    /// Facts about the road user with an id, if it is there.
    pub fn npc_facts(&self, id: u32) -> Option<NpcFacts> {
        let user = self.user(id)?;
        let facts = npc_facts(&self.alone(), &user.obstacle, &user.mover.motion);
        let (priority, crashed) = (user.mover.rights.now(self.ticks), user.mover.has_crashed());
        Some(NpcFacts { priority, crashed, ..facts })
    }

    /// Facts about the latest bearer of a name, if one is there.
    pub fn bearer_facts(&self, who: usize) -> Option<NpcFacts> {
        self.npc_facts(self.users[self.bearer(who)?].obstacle.id)
    }

    /// The sensors' output now, in newly allocated buffers.
    pub fn sensed(&self) -> Sensed {
        let mut sensed = Sensed {
            time_s: 0.0,
            ego: self.ego.motion,
            objects: Vec::new(),
            signals: Vec::new(),
            conditions: self.conditions,
        };
        self.sense(&mut sensed);
        sensed
    }

    /// Fills `into` with what the sensors see now; its buffers are reused.
    ///
    /// Everything is of this tick, except lines of sight, which are worked out ten times a second.
    pub fn sense(&self, into: &mut Sensed) {
        into.time_s = self.time_s();
        into.ego = self.ego.motion;
        into.conditions = self.conditions;
        into.signals.clear();
        into.signals.extend_from_slice(&self.colours.now);
        into.objects.clear();
        let range_m = self.scene.range_m;
        for RoadUser { obstacle, mover } in self.users.iter().filter(|user| !user.obstacle.is_apart) {
            let away = obstacle.outline.pose.position - self.ego.outline.pose.position;
            if away.norm_squared() > range_m * range_m {
                continue;
            }
            into.objects.push(SensedObject {
                id: obstacle.id,
                body: obstacle.body,
                pose: obstacle.outline.pose,
                velocity_mps: obstacle.velocity_mps,
                length_m: mover.size.length_m,
                width_m: mover.size.width_m,
                height_m: mover.size.height_m,
                visible_fraction: mover.visible_fraction,
                distance_m: obstacle.distance_m,
                is_unlit: mover.is_unlit() || obstacle.body == Body::Object,
                has_siren: mover.has_siren(),
                lights: obstacle.lights,
            });
        }
    }

    /// Whether something stands in the ego vehicle's way that will not go: a wreck, or a driver that waits for
    /// others that wait for it. Vehicles that stand between them belong to the same queue. After a contact the ego
    /// vehicle itself is a wreck.
    pub fn is_blocked(&self) -> bool {
        let front_m = self.ego_front_m();
        let stands_in_way = |user: &RoadUser| user.mover.is_stuck(&user.obstacle) && !user.obstacle.is_apart;
        !self.ego.motion.touched
            && self.users.iter().filter(|user| stands_in_way(user)).any(|user| {
                let Obstacle { outline, forward, .. } = &user.obstacle;
                let beside = self.scene.route.path.project_from(outline.pose.position, front_m);
                let (length_m, width_m) = (2.0 * outline.half_length_m, 2.0 * outline.half_width_m);
                let taken = beside.and_then(|beside| {
                    beside.taken(*forward, length_m, width_m, self.ego.outline.half_width_m)
                });
                taken.is_some_and(|span| span.to_m > front_m && span.from_m < front_m + QUEUE_M)
            })
    }

    /// Whether the ego vehicle is over a line of its lane: in a lane change, or astray.
    pub fn is_between_lanes(&self) -> bool {
        let half_m = self.scene.half_width_m(self.ego_station_m);
        self.ego_offset_m.abs() + VehicleParameters::MKZ.width_m / 2.0 > half_m
    }

    /// Whether the ego vehicle has left its lane without a contact: the middle of its rear axle is beside it. During a
    /// lane change it is in one of two lanes.
    pub fn is_astray(&self) -> bool {
        let (route, station_m) = (&self.scene.route, self.ego_station_m);
        let half_m = self.scene.half_width_m(station_m);
        let changes = |change: &RouteLaneChange| (change.begin_m..change.latest_m).contains(&station_m);
        !self.ego.motion.touched && self.ego_offset_m.abs() > half_m && !route.changes.iter().any(changes)
    }

    /// Whether the ego vehicle has driven off the map. Its front bumper is beyond the end of its way (the end of the
    /// lanes, or 60 m past the goal), or no lane is near it. Nothing can happen there, because road users appear beside
    /// the way.
    pub fn left_the_map(&self) -> bool {
        let (map, path) = (&self.scene.map, &self.scene.route.path);
        let Pose { position, heading_rad } = self.ego.motion.rear_axle;
        let aside_m = (position - path.position_at(self.ego_station_m)).norm();
        let is_near_road = aside_m <= OFF_MAP_M || map.nearest(position, heading_rad, OFF_MAP_M).is_some();
        !is_near_road || self.ego_front_m() >= path.length_m()
    }
}
