//! Questions about a moment: the facts of the ego vehicle and its surroundings, and those of another road user. Rules,
//! policies and the paper's state variables read the same ones.

use avastra_base::geometry::Vec2;
use avastra_lang::model::vocabulary::{Light, Part, Parts, Priority, Turn};
use avastra_lang::model::{
    CROSSWALK_GAP_M_MAX, JUNCTION_AHEAD_M_MAX, LIGHT_AHEAD_M, LightTimes, MomentFacts, NpcFacts, OnRoute,
    SINCE_S_MAX, TIME_S_MAX, junction_ahead,
};

use crate::state::driver::Driver;
use crate::state::ego::VehicleParameters;
use crate::state::obstacle::Obstacle;
use crate::state::road_user::Motion;
use crate::state::sensed::SignalColour;
use crate::state::time::DT_S;
use crate::state::world::World;
use crate::view::around::Around;
use crate::view::watched::own_lane;

/// Distance that stands for "no road user around", m, as in the published package.
const NO_ROAD_USER_M: f64 = 100.0;

impl World {
    /// The facts of this moment.
    pub fn moment_facts(&self) -> MomentFacts {
        self.alone().moment_facts()
    }

    /// These parts of the facts of this moment; the others are unknown.
    pub fn moment_facts_of(&self, parts: Parts) -> MomentFacts {
        self.alone().moment_facts_of(parts)
    }

    /// Time until the next traffic light on the route changes its colour, s, in steps of half a second and at most
    /// `most_s`. `None` without a light within reach.
    pub fn light_changes_in_s(&self, most_s: f64) -> Option<f64> {
        const STEP_S: f64 = 0.5;
        let around = self.alone();
        let signal = around.on_route().signal?;
        let colour = |later_s: f64| {
            around.signals.colour(&around.scene.map, signal, around.tick + (later_s / DT_S).round() as u64)
        };
        let now = colour(0.0);
        let mut steps = (1..=(most_s / STEP_S) as u32).map(|step| f64::from(step) * STEP_S);
        Some(steps.find(|&later_s| colour(later_s) != now).unwrap_or(most_s))
    }

    /// Distance along the route to the next place where another lane crosses or joins it, m.
    pub fn conflict_ahead_m(&self) -> Option<f64> {
        let from_m = self.ego_station_m();
        let mut ahead = self.scene().route.conflicts.iter().map(|conflict| conflict.station_m - from_m);
        ahead.find(|&ahead_m| ahead_m >= 0.0)
    }
}

impl Around<'_> {
    /// The facts of this moment. A road user that looks around does not count itself: see [`with_itself`].
    pub fn moment_facts(&self) -> MomentFacts {
        self.moment_facts_of(Parts::ALL)
    }

    fn moment_facts_of(&self, parts: Parts) -> MomentFacts {
        let mut facts = MomentFacts {
            ego_speed_mps: self.ego.speed_mps,
            ego_acceleration_mps2: self.ego.acceleration_mps2,
            ego_offset_m: self.ego_offset_m,
            ego_front_m: VehicleParameters::MKZ.front_m(self.ego_station_m),
            ego_rear_m: VehicleParameters::MKZ.rear_m(self.ego_station_m),
            // The number nearest to the exact time, so that `elapsed >= 0.7 s` holds at 0.7 s.
            elapsed_s: (self.tick as f64 * DT_S * 1000.0).round() / 1000.0,
            ..MomentFacts::default()
        };
        if parts.has(Part::Route) {
            let OnRoute { limit_mps, junction_ahead_m, junction_end_m, route_left_m, signal, road, turn } =
                self.on_route();
            (facts.ego_limit_mps, facts.ego_junction_ahead_m) = (limit_mps, junction_ahead_m);
            facts.ego_junction_end_m = junction_end_m;
            facts.ego_lane_width_m = 2.0 * self.scene.half_width_m(self.ego_station_m);
            facts.ego_light_times = self.light_times(signal);
            facts.ego_turn = turn;
            (facts.ego_route_left_m, facts.ego_light, facts.ego_road) =
                (route_left_m, self.light(signal), road);
        } else if parts.has(Part::Limit) {
            let lane = self.scene.route.lane_at(self.ego_station_m).lane;
            facts.ego_limit_mps = self.scene.map.lane(lane).speed_limit_mps;
        }
        if parts.has(Part::Crosswalks) {
            facts.ego_crosswalk_ahead_m = self.crosswalk_ahead_m();
        }
        if parts.has(Part::Users) {
            let mut nearest: Option<&Obstacle> = None;
            facts.road_users = 0.0;
            for obstacle in self.obstacles_on_level() {
                facts.road_users += 1.0;
                if nearest.is_none_or(|nearest| obstacle.distance_m < nearest.distance_m) {
                    nearest = Some(obstacle);
                }
            }
            facts.nearest_gap_m = nearest.map_or(NO_ROAD_USER_M, |obstacle| obstacle.distance_m);
            facts.nearest_speed_mps = nearest.map_or(0.0, |obstacle| obstacle.velocity_mps.norm());
        }
        if parts.has(Part::RuleBreakers) {
            let breaks = |(obstacle, _, driver): &(&Obstacle, _, &Driver)| {
                !obstacle.is_apart && !driver.ignores.is_empty()
            };
            facts.rule_breakers = self.drivers().filter(breaks).count() as f64;
        }
        facts
    }

    /// Along the route to the next crosswalk, m: 0 on one, [`JUNCTION_AHEAD_M_MAX`] if there is none nearer.
    fn crosswalk_ahead_m(&self) -> f64 {
        let from_m = self.ego_station_m;
        let mut ahead = self.scene.route.crosswalks_m.iter().filter(|(_, end_m)| *end_m >= from_m);
        let begin_m = ahead.next().map_or(f64::INFINITY, |(begin_m, _)| *begin_m);
        (begin_m - from_m).clamp(0.0, JUNCTION_AHEAD_M_MAX)
    }

    /// From a point to the next crosswalk on the route, m: at most [`CROSSWALK_GAP_M_MAX`].
    fn next_crosswalk_gap_m(&self, point: Vec2) -> f64 {
        let next = self.scene.route.crosswalks_m.iter().position(|(_, end_m)| *end_m >= self.ego_station_m);
        next.map_or(CROSSWALK_GAP_M_MAX, |nth| self.scene.route_crosswalk_gap_m(nth, point))
    }

    /// The junction that the ego vehicle is in, or the next one of its route, by index.
    fn next_junction(&self) -> Option<usize> {
        let lanes = &self.scene.route.lanes;
        let first = lanes.partition_point(|lane| lane.enter_m <= self.ego_station_m).max(1) - 1;
        lanes[first..].iter().find_map(|lane| self.scene.map.lane(lane.lane).junction)
    }

    /// The facts that follow from the ego vehicle's station.
    fn on_route(&self) -> OnRoute {
        OnRoute::at(&self.scene.map, &self.scene.route, self.ego_station_m)
    }

    fn light_times(&self, signal: Option<usize>) -> LightTimes {
        signal.map_or(LightTimes::NO_LIGHT, |signal| {
            let (since, left) = self.signals.around(&self.scene.map, signal, self.tick);
            let at_most = |ticks: u64| (ticks as f64 * DT_S).min(SINCE_S_MAX);
            LightTimes { since_s: at_most(since), left_s: at_most(left) }
        })
    }

    /// The colour of a traffic light; `None` without one.
    fn light(&self, signal: Option<usize>) -> Light {
        match signal.map(|signal| self.colours[signal]) {
            None => Light::None,
            Some(SignalColour::Red) => Light::Red,
            Some(SignalColour::Yellow) => Light::Yellow,
            Some(SignalColour::Green) => Light::Green,
        }
    }
}

/// The same moment with one road user more: the one that looked around, and did not count itself.
pub fn with_itself(moment: MomentFacts, this: &Obstacle, driver: &Driver) -> MomentFacts {
    if this.is_apart {
        return moment;
    }
    let is_nearest = moment.road_users == 0.0 || this.distance_m < moment.nearest_gap_m;
    let (nearest_gap_m, nearest_speed_mps) = match is_nearest {
        true => (this.distance_m, this.velocity_mps.norm()),
        false => (moment.nearest_gap_m, moment.nearest_speed_mps),
    };
    MomentFacts {
        road_users: moment.road_users + 1.0,
        rule_breakers: moment.rule_breakers + f64::from(!driver.ignores.is_empty()),
        nearest_gap_m,
        nearest_speed_mps,
        ..moment
    }
}

/// The facts of a road user. One on foot has those of the ego vehicle's route beside it.
pub fn npc_facts(around: &Around, obstacle: &Obstacle, motion: &Motion) -> NpcFacts {
    let scene = around.scene;
    match motion {
        Motion::Drive(driver) => driver_facts(around, obstacle, driver),
        Motion::Walk(_) | Motion::Stroll(_) | Motion::Guide(_) | Motion::Stand => {
            let station_m = scene.route.path.project(obstacle.outline.pose.position).station_m;
            let beside = OnRoute::at(&scene.map, &scene.route, station_m);
            let junction = (beside.junction_ahead_m, Turn::None);
            let facts = facts(around, obstacle, beside.limit_mps, junction, Light::None);
            let station_m = if let Motion::Guide(guided) = motion { guided.station_m() } else { 0.0 };
            NpcFacts { station_m, ..facts }
        }
    }
}

/// The facts of a road user that drives.
pub fn driver_facts(around: &Around, obstacle: &Obstacle, driver: &Driver) -> NpcFacts {
    let (scene, way, station_m) = (around.scene, &driver.way, driver.station_m);
    // Lane by lane: the first begins behind the station, the others follow each other.
    let mut begin_m = station_m;
    let ahead = way.lanes_from(station_m).map(|(lane, on_lane_m)| {
        let from_m = begin_m;
        begin_m += scene.map.lane(lane).centre.length_m() - on_lane_m;
        (lane, from_m)
    });
    let junction = junction_ahead(&scene.map, ahead, station_m);
    let reach = station_m..=station_m + LIGHT_AHEAD_M;
    let line = way.stop_lines.iter().find(|line| reach.contains(&line.station_m));
    let signal = line.map(|line| line.signal);
    let light = around.light(signal);
    let end_m = way.end_m.map_or(f64::INFINITY, |end_m| end_m - station_m - obstacle.outline.half_length_m);
    let facts = facts(around, obstacle, way.limit_mps(&scene.map, station_m), junction, light);
    let junction = scene.map.lane(way.lane_at(station_m).0).junction;
    let in_next_junction = junction.is_some() && junction == around.next_junction();
    let ways_m = driver.ways_to_crossing(2.0 * obstacle.outline.half_length_m, around);
    let (crossing_ahead_m, ego_crossing_ahead_m) =
        ways_m.unwrap_or((JUNCTION_AHEAD_M_MAX, JUNCTION_AHEAD_M_MAX));
    NpcFacts {
        has_siren: driver.has_siren,
        in_next_junction,
        crossing_ahead_m: crossing_ahead_m.min(JUNCTION_AHEAD_M_MAX),
        ego_crossing_ahead_m,
        lane_left_m: end_m.min(JUNCTION_AHEAD_M_MAX),
        light_times: around.light_times(signal),
        ..facts
    }
}

fn facts(
    around: &Around,
    obstacle: &Obstacle,
    limit_mps: f64,
    (junction_ahead_m, turn): (f64, Turn),
    light: Light,
) -> NpcFacts {
    let (station_m, offset_m, along) = around.beside_route(obstacle.outline.pose.position);
    let (half_length_m, half_width_m) = obstacle.outline.half_extent_m(obstacle.forward, along);
    let (front_m, rear_m) = (station_m + half_length_m, station_m - half_length_m);
    let ego = VehicleParameters::MKZ;
    let (ego_front_m, ego_rear_m) = (ego.front_m(around.ego_station_m), ego.rear_m(around.ego_station_m));
    // The way between the two, and the speeds of the one behind and of the one before, along the route.
    let (ego_mps, other_mps) = (around.ego.speed_mps, along.dot(&obstacle.velocity_mps));
    let (between_m, behind_mps, before_mps) = match rear_m >= ego_front_m {
        true => (rear_m - ego_front_m, ego_mps, other_mps),
        false => (ego_rear_m - front_m, other_mps, ego_mps),
    };
    let takes_s = |speed_mps: f64| match between_m <= 0.0 {
        true => 0.0,
        false if speed_mps > 0.0 => (between_m / speed_mps).min(TIME_S_MAX),
        false => TIME_S_MAX,
    };
    // The ego vehicle is across the route where it is itself, which in a bend is another direction.
    let (_, ego_along) = around.scene.route.path.along(around.ego_station_m);
    let (_, ego_half_width_m) = around.ego_outline.half_extent_m(around.ego_forward, ego_along);
    let across_mps = along.perp(&obstacle.velocity_mps);
    // Where the ego vehicle's lane has ended, the route's is meant.
    let scene = around.scene;
    let strip = scene.strip(station_m, own_lane(around));
    let strip = strip.or_else(|| scene.strip(station_m, scene.route_lane_number(station_m)));
    let (right_m, left_m) = strip.expect("the route has a lane everywhere");
    let lengthwise = Closing {
        from_m: rear_m - ego_front_m,
        to_m: front_m - ego_rear_m,
        by_mps: other_mps - ego_along.dot(&around.ego_velocity_mps),
    };
    let (aside_m, both_m) = (offset_m - around.ego_offset_m, half_width_m + ego_half_width_m);
    let sideways = Closing {
        from_m: aside_m - both_m,
        to_m: aside_m + both_m,
        by_mps: across_mps - ego_along.perp(&around.ego_velocity_mps),
    };
    NpcFacts {
        along_mps: other_mps,
        across_mps,
        aside_m: aside_m.abs() - both_m,
        in_lane_m: (left_m - offset_m).min(offset_m - right_m) + half_width_m,
        crosswalk_gap_m: around.scene.crosswalk_gap_m(obstacle.outline.pose.position),
        speed_mps: obstacle.velocity_mps.norm(),
        acceleration_mps2: obstacle.acceleration_mps2,
        crossing_ahead_m: JUNCTION_AHEAD_M_MAX,
        ego_crossing_ahead_m: JUNCTION_AHEAD_M_MAX,
        lane_left_m: JUNCTION_AHEAD_M_MAX,
        gap_m: obstacle.distance_m,
        junction_ahead_m,
        limit_mps,
        light,
        light_times: LightTimes::NO_LIGHT,
        priority: Priority::None,
        next_crosswalk_gap_m: around.next_crosswalk_gap_m(obstacle.outline.pose.position),
        contact_in_s: contact_in_s(lengthwise, sideways),
        pet_s: TIME_S_MAX,
        station_m: 0.0,
        has_siren: false,
        crashed: false,
        in_next_junction: false,
        leads: false,
        lanes_left: f64::NAN,
        off_road_m: f64::NAN,
        turn,
        front_m,
        rear_m,
        offset_m,
        ttc_s: takes_s(behind_mps - before_mps),
        headway_s: takes_s(behind_mps),
    }
}

/// Where another stretch lies beside the ego vehicle's in one direction. They overlap while one of its ends is below 0
/// and the other above it.
#[derive(Debug, Clone, Copy)]
struct Closing {
    from_m: f64,
    to_m: f64,
    by_mps: f64,
}

impl Closing {
    /// From when until when they overlap, s; an empty time if never.
    fn overlap_s(self) -> (f64, f64) {
        let Closing { from_m, to_m, by_mps } = self;
        match by_mps {
            by_mps if by_mps > 0.0 => (-to_m / by_mps, -from_m / by_mps),
            by_mps if by_mps < 0.0 => (-from_m / by_mps, -to_m / by_mps),
            _ if from_m < 0.0 && to_m > 0.0 => (f64::NEG_INFINITY, f64::INFINITY),
            _ => (f64::INFINITY, f64::NEG_INFINITY),
        }
    }
}

/// When two touch that go on as now, s.
fn contact_in_s(lengthwise: Closing, sideways: Closing) -> f64 {
    let ((from_s, to_s), (aside_from_s, aside_to_s)) = (lengthwise.overlap_s(), sideways.overlap_s());
    let (begin_s, end_s) = (from_s.max(aside_from_s), to_s.min(aside_to_s));
    if begin_s < end_s && end_s > 0.0 { begin_s.clamp(0.0, TIME_S_MAX) } else { TIME_S_MAX }
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::sync::Arc;

    use crate::action::{ActionTable, Draw, Situation};
    use crate::sim::{Control, DT_S, Scene, World, testing};
    use avastra_base::geometry::Vec2;
    use avastra_lang::check::{ReadError, load};
    use avastra_lang::model::vocabulary::{Light, RoadKind, Turn, Verb};
    use avastra_lang::model::{NpcFacts, Row, RulesInForce};

    #[test]
    fn a_moment_says_how_far_it_is_to_the_junction() {
        let world = testing::world(&testing::crossing());
        let facts = world.moment_facts();
        let route = &world.scene().route;
        let inside = route.lanes.iter().find(|lane| world.scene().map.lane(lane.lane).junction.is_some());
        let begin_m = inside.expect("the route crosses a junction").enter_m;
        assert_eq!(facts.ego_junction_ahead_m, begin_m);
        assert_eq!((facts.ego_road, facts.ego_light), (RoadKind::OneWay, Light::None));
        assert_eq!((facts.road_users, facts.nearest_gap_m), (0.0, 100.0));
        assert_eq!(facts.ego_turn, Turn::Straight);
        let (corner, mut turns) = (testing::corner(), Vec::new());
        let world = testing::world(&corner);
        for lane in &corner.route.lanes {
            let Some(_) = corner.map.lane(lane.lane).junction else { continue };
            // By the headings at both ends of the way through.
            let length_m = corner.map.lane(lane.lane).centre.length_m();
            let [from_rad, to_rad] =
                [0.0, length_m].map(|at_m| corner.map.lane(lane.lane).centre.heading_at(at_m));
            let by_rad = avastra_base::geometry::wrap_angle(to_rad - from_rad);
            turns.push(match by_rad {
                by_rad if by_rad > 0.5 => Turn::Left,
                by_rad if by_rad < -0.5 => Turn::Right,
                _ => Turn::Straight,
            });
        }
        assert_eq!(world.moment_facts().ego_turn, turns[0], "{turns:?}");
        assert!(turns[0] != Turn::Straight);
        let straight = testing::world(&testing::straight()).moment_facts();
        assert_eq!((straight.ego_junction_ahead_m, straight.ego_turn), (1000.0, Turn::None));
    }

    #[test]
    fn the_light_changes_when_it_is_said_to() {
        let mut world = testing::world(&testing::crossing());
        assert_eq!(world.light_changes_in_s(60.0), None, "it is out of reach");
        let conflict_m = world.conflict_ahead_m().expect("another street crosses");
        assert!(conflict_m > world.moment_facts().ego_junction_ahead_m, "{conflict_m}");
        let drive = Control { throttle_pct: 20.0, ..Control::default() };
        while world.light_changes_in_s(60.0).is_none() && world.time_s() < 60.0 {
            world.tick(&drive);
        }
        let (light, left_s) = (world.moment_facts().ego_light, world.light_changes_in_s(60.0));
        let left_s = left_s.expect("it is in reach by now");
        assert!((0.5..60.0).contains(&left_s), "{left_s}");
        assert_eq!(world.light_changes_in_s(0.5), Some(0.5));
        let end_s = world.time_s() + left_s;
        while world.time_s() + 0.5 * DT_S < end_s {
            // It looks ahead in steps of half a second.
            assert!(world.moment_facts().ego_light == light || end_s - world.time_s() <= 0.5);
            world.tick(&Control { brake_pct: 100.0, ..Control::default() });
        }
        assert_ne!(world.moment_facts().ego_light, light);
    }

    #[test]
    fn a_vehicle_ahead_is_nearer_to_the_junction() {
        use crate::action::Surroundings;
        let world = testing::world(&testing::crossing());
        let ego_m = world.moment_facts().ego_junction_ahead_m;
        let facts = world.survey(&testing::request(Verb::DriveAhead, 40.0, 8.0)).expect("there is room");
        // From the rear axle to the bumper, the gap, and half a vehicle.
        let ahead_m = ego_m - facts.npc.junction_ahead_m;
        assert!((40.0..50.0).contains(&ahead_m), "{ahead_m}");
        assert_eq!(facts.npc.speed_mps, 8.0);
    }

    #[test]
    fn where_others_are_and_go_is_told_along_and_across_the_route() {
        use crate::action::Effect;
        let mut world = testing::world(&testing::straight());
        // One ahead in the lane, one that comes towards the ego vehicle, and one on foot who crosses from the right.
        for (verb, distance_m, speed_mps) in
            [(Verb::DriveAhead, 30.0, 8.0), (Verb::DriveOpposite, 80.0, 6.0), (Verb::Walk, 40.0, 1.5)]
        {
            world
                .apply(&Effect::Spawn(testing::request(verb, distance_m, speed_mps)))
                .expect("there is room");
        }
        for _ in 0..400 {
            world.tick(&Control { brake_pct: 100.0, ..Control::default() });
            let ego_half_m = world.ego_outline().half_width_m;
            for id in 1..=3 {
                let (Some(npc), Some(obstacle)) = (world.npc_facts(id), world.obstacle(id)) else { continue };
                // The route leads along +x, at y = -1.75 m; its lane is 3.5 m wide.
                let velocity = obstacle.velocity_mps;
                assert!(
                    (npc.along_mps - velocity.x).abs() < 1e-9 && (npc.across_mps - velocity.y).abs() < 1e-9
                );
                let left_m = obstacle.outline.pose.position.y + 1.75;
                let (_, half_m) = obstacle.outline.half_extent_m(obstacle.forward, Vec2::x());
                assert!((npc.in_lane_m - (1.75 + half_m - left_m.abs())).abs() < 1e-6, "{npc:?}");
                let aside_m = (left_m - world.ego_offset_m()).abs() - half_m - ego_half_m;
                assert!((npc.aside_m - aside_m).abs() < 1e-6, "{npc:?} {aside_m}");
                assert_eq!(npc.crosswalk_gap_m, 100.0);
            }
        }
        let [ahead, oncoming] = [1, 2].map(|id| world.npc_facts(id).expect("it is there"));
        assert!(ahead.along_mps > 1.0 && ahead.in_lane_m > 0.0 && ahead.aside_m < 0.0, "{ahead:?}");
        assert!(
            oncoming.along_mps < -1.0 && oncoming.in_lane_m < 0.0 && oncoming.aside_m > 0.0,
            "{oncoming:?}"
        );
    }

    #[test]
    fn the_lane_of_the_ego_vehicle_is_the_one_that_it_is_in() {
        use crate::action::Effect;
        // Also where the route itself changes lanes.
        for scene in [testing::straight(), testing::changing()] {
            let mut world = testing::world(&scene);
            let request = testing::request(Verb::DriveAhead, 60.0, 8.0);
            world.apply(&Effect::Spawn(request)).expect("there is room");
            let (mut lanes, mut least_m) = (Vec::new(), f64::INFINITY);
            // Into the lane to the right and back again, and over the line to the left.
            for tick in 0..900 {
                let steer_rad = [-0.1, 0.1, 0.1, -0.1, 0.1, -0.1].get(tick / 80).copied().unwrap_or(0.0);
                world.tick(&Control { throttle_pct: 25.0, steer_rad, ..Control::default() });
                let (Some(npc), Some(obstacle)) = (world.npc_facts(1), world.obstacle(1)) else { break };
                // Four lanes of 3.5 m from y = -7 m on.
                let ego_m = world.ego().rear_axle.position.y;
                let nth = ((ego_m + 7.0) / 3.5).floor().clamp(0.0, 3.0);
                lanes.push(nth as i32);
                let half_m = obstacle.outline.half_extent_m(obstacle.forward, Vec2::x()).1;
                let away_m = (obstacle.outline.pose.position.y - (3.5 * nth - 5.25)).abs();
                let wanted_m = 1.75 + half_m - away_m;
                assert!((npc.in_lane_m - wanted_m).abs() < 0.03, "{npc:?} from {ego_m} m: {wanted_m}");
                least_m = least_m.min(npc.in_lane_m);
            }
            lanes.dedup();
            assert!(lanes.len() > 1 && least_m < 0.0, "{lanes:?} {least_m}");
        }
    }

    #[test]
    fn who_crosses_is_in_the_junction_and_says_where_it_goes() {
        use crate::action::Effect;
        use avastra_lang::model::vocabulary::Field;
        let mut world = testing::world(&testing::four_arms());
        let request = testing::request(Verb::CrossRoad, 60.0, 6.0);
        world.apply(&Effect::Spawn(testing::told(request, Field::Siren, true))).expect("there is room");
        let mut inside = 0;
        for _ in 0..1500 {
            world.tick(&Control { brake_pct: 100.0, ..Control::default() });
            let (Some(npc), Some(obstacle)) = (world.npc_facts(1), world.obstacle(1)) else { break };
            assert!(npc.has_siren);
            // The streets meet within 10 m of the origin; a vehicle is where its axles are.
            let away_m = obstacle.outline.pose.position.norm();
            assert!(npc.in_next_junction || away_m > 7.0, "{away_m} m");
            assert!(!npc.in_next_junction || away_m < 13.0, "{away_m} m");
            assert!(npc.turn == if npc.junction_ahead_m < 1000.0 { Turn::Straight } else { Turn::None });
            inside += usize::from(npc.in_next_junction);
        }
        assert!(inside > 10, "{inside} ticks");
    }

    #[test]
    fn a_contact_comes_when_outlines_meet_that_go_on_as_now() {
        use crate::action::Effect;
        let mut world = testing::world(&testing::straight());
        for (verb, distance_m, speed_mps) in
            [(Verb::DriveAhead, 30.0, 3.0), (Verb::DriveOpposite, 80.0, 6.0), (Verb::Walk, 40.0, 1.5)]
        {
            let effect = Effect::Spawn(testing::request(verb, distance_m, speed_mps));
            world.apply(&effect).expect("there is room");
        }
        let mut touches = 0;
        for tick in 0..400 {
            world.tick(&Control { throttle_pct: 25.0, ..Control::default() });
            for id in 1..=3 {
                let (Some(npc), Some(obstacle)) = (world.npc_facts(id), world.obstacle(id)) else { continue };
                if tick % 20 > 0 || obstacle.distance_m <= 0.0 {
                    continue;
                }
                let ego = world.ego_outline();
                let ego_mps = ego.pose.forward() * world.ego().speed_mps;
                // On a straight road that is along its lanes and across them.
                let touch_s = (0..2000).map(|nth| f64::from(nth) * 0.005).find(|later_s| {
                    let mut there = [ego, obstacle.outline];
                    there[0].pose.position += ego_mps * *later_s;
                    there[1].pose.position += obstacle.velocity_mps * *later_s;
                    avastra_base::geometry::distance_m(&there[0], &there[1]) <= 0.0
                });
                match touch_s {
                    Some(touch_s) => assert!((npc.contact_in_s - touch_s).abs() < 0.01, "{npc:?} {touch_s}"),
                    None => assert!(npc.contact_in_s > 9.9, "{npc:?}"),
                }
                touches += usize::from(touch_s.is_some());
            }
        }
        assert!(touches > 10, "{touches}");
    }

    /// A lane change that an action commands begins only while the rules `during change` hold; without them others
    /// begin too.
    #[test]
    fn lane_changes_begin_only_while_their_rules_hold() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../../tests/cases/wishes/no_cut_ins_near_junctions.ava");
        let read =
            |path: &Path| std::fs::read_to_string(path).map_err(|error| ReadError::new(error.to_string()));
        let space = load(&path, &read).expect("it can be read").space.expect("it is sound");
        let table = ActionTable::new(Arc::clone(&space));
        let rules = RulesInForce::by_default(&space);
        let is_changer =
            |row: &&Row| row.label.contains("then: Change") && !row.label.starts_with("cross_road");
        let (mut bound, mut wrong, mut free) = (0, 0, 0);
        for road in &space.roads {
            let scene = Arc::new(Scene::new(road.map.clone(), road.route.clone()));
            let world = World::new(scene, &testing::start());
            let memory = space.initial_memory(1);
            let situation = Situation {
                memory: &memory,
                road,
                rules: &rules,
                surroundings: &world,
                seed: 1,
                step: 0,
                happened_s: &[],
            };
            for row in space.rows.iter().filter(is_changer) {
                let Ok(draw) = table.offer(&situation, row.index) else { continue };
                assert!(draw.lane_changes.is_some(), "the rule binds it");
                for binds in [true, false] {
                    let mut world = world.clone();
                    let lane_changes = draw.lane_changes.clone().filter(|_| binds);
                    let draw = Draw { lane_changes, ..draw.clone() };
                    let (_, id) = world.carry_out(&draw).expect("it is legal")[0];
                    let Some(begin) = first_change(&mut world, id) else { continue };
                    let holds = begin.junction_ahead_m >= 40.0 && begin.gap_m >= 12.0;
                    assert!(!binds || holds, "{}: {begin:?}", row.label);
                    bound += usize::from(binds);
                    free += usize::from(!binds);
                    wrong += usize::from(!binds && !holds);
                }
            }
        }
        assert!(bound > 0 && free > bound && wrong > 0, "{bound} of {free}, {wrong}");
    }

    /// The facts of a driver when its first lane change began, within 20 s.
    fn first_change(world: &mut World, id: u32) -> Option<NpcFacts> {
        for _ in 0..1000 {
            let before = world.npc_facts(id)?;
            world.tick(&Control { throttle_pct: 20.0, ..Control::default() });
            let around = world.alone();
            let (.., driver) = around.drivers().find(|(obstacle, ..)| obstacle.id == id)?;
            if driver.is_changing_lanes() {
                return Some(before);
            }
        }
        None
    }
}
