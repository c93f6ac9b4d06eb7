//! Facts that requirements may ask for beside those of the moment. Some must be watched from tick to tick, and some
//! cost too much to be looked up where no requirement needs them.

use std::collections::VecDeque;

use avastra_base::geometry::{Beside, Path, Projection, Vec2, unit_vector};
use avastra_base::kinematics::STANDING_MPS;
use avastra_lang::model::vocabulary::{Crossing, Part, Parts};
use avastra_lang::model::{LEAD_GAP_M_MAX, LIGHT_AHEAD_M, NpcFacts, TickFacts};
use avastra_road::SignKind;

use crate::scene::{Scene, WAY_STEP_M, WayPoints};
use crate::state::ego::VehicleParameters;
use crate::state::obstacle::Obstacle;
use crate::state::sensed::SignalColour;
use crate::state::time::{DT_S, FRAME_TICKS};
use crate::state::world::World;
use crate::view::around::Around;

/// A road user in the ego vehicle's way is nearer to a point than this and half of both outlines, m. It is half a step,
/// half the width of the ego vehicle on any heading, and what a bend adds.
const WAY_ASIDE_M: f64 = 9.0;
/// Ticks of a second.
const TICKS_PER_S: usize = (1.0 / DT_S) as usize;
/// A vehicle that is farther beyond a line has run its light, m: most junctions are no wider.
const OVER_RED_M_MAX: f64 = 30.0;
/// Stands for no red light and for no oncoming lane near, m.
const FAR_M: f64 = -100.0;

/// The ego vehicle's drive up to now, as far as requirements ask for it.
#[derive(Debug, Clone, Default)]
pub struct Watched {
    /// The road user ahead, the tick since when it is that one, and where it was on the route.
    lead: Option<(u32, u64, f64)>,
    red_runs: u32,
    crosses: Crossing,
    /// The stop line that its front passed at red and its light, while that is red.
    red_line_m: Option<(f64, usize)>,
    /// The accelerations of the last second, the latest last, m/s².
    accelerations: VecDeque<f64>,
}

impl Watched {
    /// Looks at the world after a tick, for these parts; the other facts are unknown. To be called at every tick.
    pub fn look(&mut self, world: &World, parts: Parts) -> TickFacts {
        let around = world.alone();
        let mut facts = TickFacts {
            visibility_m: around.visibility_m,
            lateral_mps2: around.ego.speed_mps * around.ego.yaw_rate_radps,
            ..TickFacts::default()
        };
        if parts.has(Part::Lead) {
            let lead = self.lead(world, &around);
            let since_s = |tick: u64| (world.ticks() - tick) as f64 * DT_S;
            facts.lead_gap_m = lead.as_ref().map_or(LEAD_GAP_M_MAX, |lead| lead.gap_m);
            facts.lead_speed_mps = lead.map_or(0.0, |lead| lead.speed_mps);
            facts.lead_since_s = self.lead.map_or(0.0, |(_, tick, _)| since_s(tick));
        }
        if parts.has(Part::OverRed) {
            facts.over_red_m = self.over_red_m(world, &around);
        }
        if parts.has(Part::OverStop) {
            facts.over_stop_m = over_stop_m(&around);
        }
        if parts.has(Part::OverLine) {
            facts.over_line_m = over_line_m(&around);
        }
        if parts.has(Part::OverCrosswalk) {
            facts.over_crosswalk_m = over_crosswalk_m(&around);
        }
        if parts.has(Part::OverOncoming) {
            facts.over_oncoming_m = over_oncoming_m(&around);
        }
        if parts.has(Part::Lane) {
            (facts.lane_offset_m, facts.over_lane_m) = (lane_offset_m(&around), over_lane_m(&around));
        }
        if parts.has(Part::EgoOffRoad) {
            facts.off_road_m = around.scene.map.lane_room_m(around.ego_outline.pose.position);
        }
        if parts.has(Part::Crosses) {
            facts.crosses = self.crosses(&around);
        }
        if parts.has(Part::Jerk) {
            facts.jerk_mps3 = self.jerk_mps3(around.ego.acceleration_mps2);
        }
        facts
    }

    /// The road user ahead. A new one is looked for ten times a second, as drivers look around.
    fn lead(&mut self, world: &World, around: &Around) -> Option<Lead> {
        let known = self.lead.filter(|_| !world.ticks().is_multiple_of(FRAME_TICKS));
        let still = known.and_then(|(id, _, station_m)| {
            in_the_way(around, around.obstacles_on_level().find(|obstacle| obstacle.id == id)?, station_m)
        });
        let looks = world.ticks().is_multiple_of(FRAME_TICKS) || known.is_some();
        let lead = still.or_else(|| looks.then(|| next_ahead(around)).flatten());
        self.lead = lead.as_ref().map(|&Lead { id, station_m, .. }| match self.lead {
            Some((known, since, _)) if known == id => (id, since, station_m),
            _ => (id, world.ticks(), station_m),
        });
        lead
    }

    /// The facts of a road user near, with what of these parts is watched.
    pub fn of_near(&self, world: &World, id: u32, npc: NpcFacts, parts: Parts) -> NpcFacts {
        let leads = self.lead.is_some_and(|(lead, ..)| lead == id);
        let place = world.obstacle(id).map(|obstacle| obstacle.outline.pose.position);
        let Some(place) = place.filter(|_| parts.has(Part::LanesLeft) || parts.has(Part::OffRoad)) else {
            return NpcFacts { leads, ..npc };
        };
        let around = world.alone();
        let lanes_left = || {
            let (station_m, offset_m, _) = around.beside_route(place);
            let number = around.scene.lane_number(station_m, offset_m);
            let strip = around.scene.strip(station_m, number);
            let is_in_it = strip.is_some_and(|(right_m, left_m)| (right_m..=left_m).contains(&offset_m));
            if is_in_it { f64::from(number - own_lane(&around)) } else { NO_LANE }
        };
        NpcFacts {
            leads,
            lanes_left: if parts.has(Part::LanesLeft) { lanes_left() } else { f64::NAN },
            off_road_m: if parts.has(Part::OffRoad) { around.scene.map.lane_room_m(place) } else { f64::NAN },
            ..npc
        }
    }

    /// To which side a line of a lane is crossed.
    fn crosses(&mut self, around: &Around) -> Crossing {
        let Scene { map, route, .. } = around.scene;
        let is_in_junction = map.lane(route.lane_at(around.ego_station_m).lane).junction.is_some();
        let own = own_lane(around);
        let beside = around.ego_outline.corners().map(|corner| {
            let (station_m, offset_m, _) = around.beside_route(corner);
            // Where its lane ends, it crosses nothing.
            let strip = around.scene.strip(station_m, own);
            let (right_m, left_m) = strip.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
            (offset_m < right_m, offset_m > left_m)
        });
        let now = if is_in_junction {
            Crossing::None
        } else if beside.iter().any(|(_, is_left)| *is_left) {
            Crossing::Left
        } else if beside.iter().any(|(is_right, _)| *is_right) {
            Crossing::Right
        } else {
            Crossing::None
        };
        // Once the rear axle is in the next lane, the same line lies on the other side: the first side stays.
        let goes_on = now != Crossing::None && self.crosses != Crossing::None;
        self.crosses = if goes_on { self.crosses } else { now };
        self.crosses
    }

    /// The change of the acceleration over the last second, m/s³.
    fn jerk_mps3(&mut self, acceleration_mps2: f64) -> f64 {
        self.accelerations.push_back(acceleration_mps2);
        if self.accelerations.len() <= TICKS_PER_S {
            return 0.0;
        }
        let before = self.accelerations.pop_front();
        before.map_or(0.0, |before_mps2| acceleration_mps2 - before_mps2)
    }

    fn over_red_m(&mut self, world: &World, around: &Around) -> f64 {
        let ego = VehicleParameters::MKZ;
        let front_m = ego.front_m(around.ego_station_m);
        let lines = &around.scene.route.stop_lines;
        if world.red_runs() > self.red_runs {
            self.red_runs = world.red_runs();
            let passed = lines.iter().rfind(|line| line.station_m <= front_m);
            self.red_line_m = passed.map(|line| (line.station_m, line.signal));
        }
        let is_red = |signal: usize| around.colours[signal] == SignalColour::Red;
        // It grows with every metre at red: one that stops behind the line has gone less far wrong than one that drives through.
        self.red_line_m =
            self.red_line_m.filter(|(line_m, signal)| front_m - line_m < OVER_RED_M_MAX && is_red(*signal));
        if let Some((line_m, _)) = self.red_line_m {
            return front_m - line_m;
        }
        let reach = front_m..=front_m + LIGHT_AHEAD_M;
        let next = lines.iter().find(|line| reach.contains(&line.station_m));
        let red = next.filter(|line| is_red(line.signal));
        red.map_or(FAR_M, |line| front_m - line.station_m)
    }
}

/// Stands for a road user that is in no lane beside the route.
const NO_LANE: f64 = 100.0;

struct Lead {
    id: u32,
    station_m: f64,
    gap_m: f64,
    speed_mps: f64,
}

/// The next road user ahead whose outline reaches into the ego vehicle's way, and which does not come towards it.
fn next_ahead(around: &Around) -> Option<Lead> {
    let WayPoints { first_m: from_m, points, least, greatest } =
        around.scene.points_ahead(around.ego_station_m);
    let ahead = around.obstacles_on_level().filter_map(|obstacle| {
        let outline = &obstacle.outline;
        // A road user in the way is no farther from one of the points.
        let reach_m = outline.half_length_m + outline.half_width_m + around.ego_offset_m.abs() + WAY_ASIDE_M;
        let place = outline.pose.position;
        let is_within =
            |at: f64, least: f64, greatest: f64| (least - reach_m..=greatest + reach_m).contains(&at);
        if !is_within(place.x, least.x, greatest.x) || !is_within(place.y, least.y, greatest.y) {
            return None;
        }
        let away_m2 = |point: &Vec2| (place - point).norm_squared();
        let near = points.iter().map(away_m2).enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
        let (nth, _) = near.filter(|(_, away_m2)| *away_m2 <= reach_m * reach_m)?;
        in_the_way(around, obstacle, from_m + nth as f64 * WAY_STEP_M)
    });
    ahead.min_by(|a, b| a.gap_m.total_cmp(&b.gap_m))
}

/// A road user about at a station of the route, if it is ahead in the ego vehicle's way.
fn in_the_way(around: &Around, obstacle: &Obstacle, guess_m: f64) -> Option<Lead> {
    let front_m = VehicleParameters::MKZ.front_m(around.ego_station_m);
    let Obstacle { id, outline, forward, velocity_mps, .. } = obstacle;
    let beside = beside(&around.scene.route.path, outline.pose.position, guess_m)?;
    let (half_length_m, half_width_m) = outline.half_extent_m(*forward, beside.forward);
    let aside_m = (beside.offset_m - around.ego_offset_m).abs();
    let speed_mps = beside.forward.dot(velocity_mps);
    let is_ahead = beside.station_m > front_m
        && aside_m < half_width_m + ego_half_width_m(around, beside.forward)
        && speed_mps > -STANDING_MPS;
    let gap_m = (beside.station_m - half_length_m - front_m).max(0.0);
    is_ahead.then_some(Lead { id: *id, station_m: beside.station_m, gap_m, speed_mps })
}

/// Where a place about at a station lies beside a path; `None` for one that is far aside.
fn beside(path: &Path, place: Vec2, guess_m: f64) -> Option<Beside> {
    // Outside of a bend a place may lie between the ends of two tangents, which then lead back and forth.
    path.project_from(place, guess_m).or_else(|| {
        let Projection { station_m, offset_m, distance_m } =
            path.project_near(place, guess_m, 2.0 * WAY_STEP_M);
        let (_, forward) = path.along(station_m);
        (distance_m <= WAY_ASIDE_M).then_some(Beside { station_m, offset_m, forward })
    })
}

/// Half the width of the ego vehicle across a direction, m.
fn ego_half_width_m(around: &Around, along: Vec2) -> f64 {
    around.ego_outline.half_extent_m(around.ego_forward, along).1
}

/// How far the ego vehicle's front is beyond the beginning of the first of these stretches of the route whose end its
/// rear has not passed, m. Below 0 it is the way to it.
fn over_m(around: &Around, stretches: impl Iterator<Item = (f64, f64)>) -> f64 {
    let ego = VehicleParameters::MKZ;
    let (front_m, rear_m) = (ego.front_m(around.ego_station_m), ego.rear_m(around.ego_station_m));
    let next = { stretches }.find(|(_, end_m)| rear_m < *end_m);
    next.map_or(FAR_M, |(begin_m, _)| (front_m - begin_m).max(FAR_M))
}

/// As `over_m`, for the lines of stop signs.
fn over_stop_m(around: &Around) -> f64 {
    let lines = around.scene.route.sign_lines.iter().filter(|line| line.kind == SignKind::Stop);
    over_m(around, lines.map(|line| (line.station_m, line.station_m)))
}

/// As `over_m`, for the stop lines of lights.
fn over_line_m(around: &Around) -> f64 {
    over_m(around, around.scene.route.stop_lines.iter().map(|line| (line.station_m, line.station_m)))
}

/// As `over_m`, for crosswalks, from edge to edge.
fn over_crosswalk_m(around: &Around) -> f64 {
    over_m(around, around.scene.route.crosswalks_m.iter().copied())
}

/// The number of the lane that holds the ego vehicle's rear axle; beyond all lanes, of the outermost one.
pub fn own_lane(around: &Around) -> i32 {
    around.scene.lane_number(around.ego_station_m, around.ego_offset_m)
}

/// How far the ego vehicle's rear axle is to the left of the middle of its route's lane, m.
fn lane_offset_m(around: &Around) -> f64 {
    let Scene { map, route, .. } = around.scene;
    let lane = map.lane(route.lane_at(around.ego_station_m).lane);
    lane.centre.project(around.ego.rear_axle.position).offset_m
}

/// How far the ego vehicle's outline reaches into an oncoming lane, m.
fn over_oncoming_m(around: &Around) -> f64 {
    let Some(edge) = around.scene.oncoming_at(around.ego_station_m) else { return FAR_M };
    let towards_m = if edge.is_left { around.ego_offset_m } else { -around.ego_offset_m };
    (towards_m + ego_half_width_m(around, edge.along) - edge.away_m).max(FAR_M)
}

/// How far the ego vehicle's outline reaches beyond the lines of its route's lane, at its rear axle, m. Where the route may
/// change lanes, it is the outer lines of both lanes that count.
fn over_lane_m(around: &Around) -> f64 {
    let Scene { map, route, .. } = around.scene;
    let station_m = around.ego_station_m;
    let lane = map.lane(route.lane_at(station_m).lane);
    if lane.junction.is_some() {
        return FAR_M;
    }
    let beside = lane.centre.project(around.ego.rear_axle.position);
    let along = unit_vector(lane.centre.heading_at(beside.station_m));
    let room_m = lane.width_at(beside.station_m) / 2.0 - ego_half_width_m(around, along);
    let change = route.changes.iter().find(|change| (change.begin_m..=change.latest_m).contains(&station_m));
    let beyond_m = match change {
        None => beside.offset_m.abs(),
        Some(change) => {
            let from_m = change.source_offset_m(station_m);
            let to_m = change.postponed_offset_m(station_m, f64::NEG_INFINITY);
            let offset_m = around.ego_offset_m;
            (offset_m - from_m.max(to_m)).max(from_m.min(to_m) - offset_m)
        }
    };
    (beyond_m - room_m).max(FAR_M)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::{Control, Start, testing};
    use std::sync::Arc;

    #[test]
    fn what_is_ahead_is_watched() {
        let mut world = testing::world(&testing::straight());
        let mut watched = Watched::default();
        let alone = watched.look(&world, Parts::ALL);
        assert_eq!((alone.lead_gap_m, alone.lead_speed_mps, alone.lead_since_s), (LEAD_GAP_M_MAX, 0.0, 0.0));
        let request = testing::request(avastra_lang::model::vocabulary::Verb::DriveAhead, 30.0, 4.0);
        world.apply(&crate::action::Effect::Spawn(request)).expect("there is room");
        let first = watched.look(&world, Parts::ALL);
        assert!((first.lead_gap_m - 30.0).abs() < 1e-6, "{first:?}");
        assert_eq!(first.lead_speed_mps, 4.0);
        for _ in 0..50 {
            world.tick(&Control { throttle_pct: 10.0, ..Control::default() });
            watched.look(&world, Parts::ALL);
        }
        let later = watched.look(&world, Parts::ALL);
        assert!((later.lead_since_s - 1.0).abs() < 1e-9, "{later:?}");
        let rear_m = world.npc_facts(1).expect("it is there").rear_m;
        assert!((later.lead_gap_m - (rear_m - world.moment_facts().ego_front_m)).abs() < 1e-9);
    }

    #[test]
    fn every_place_beside_a_bend_is_found() {
        for scene in [testing::corner(), testing::straight()] {
            let path = &scene.route.path;
            let stations = (0..(path.length_m() * 10.0) as usize).map(|nth| nth as f64 / 10.0);
            for (station_m, offset_m) in
                stations.flat_map(|station_m| [-2.0, -0.7, 0.7, 2.0].map(|left| (station_m, left)))
            {
                let place = path.pose_at(station_m).offset(0.0, offset_m).position;
                for guess_m in [station_m - 9.0, station_m + 9.0] {
                    let found = beside(path, place, guess_m).expect("it is near");
                    assert!(
                        (found.offset_m - offset_m).abs() < 0.1,
                        "{offset_m} m at {station_m} m: {found:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_line_is_crossed_from_the_first_corner_to_the_last() {
        for scene in [testing::straight(), testing::changing()] {
            crosses_lines(&scene);
        }
    }

    fn crosses_lines(scene: &Arc<Scene>) {
        let mut world = testing::world(scene);
        let mut watched = Watched::default();
        // Two lanes ahead, and two of the others, of 3.5 m each.
        let lines_m = [-7.0, -3.5, 0.0, 3.5, 7.0];
        let (mut before, mut told) = (Crossing::None, Vec::new());
        for tick in 0..900 {
            let steer_rad = [-0.1, 0.1, 0.1, -0.1, 0.1, -0.1].get(tick / 80).copied().unwrap_or(0.0);
            world.tick(&Control { throttle_pct: 25.0, steer_rad, ..Control::default() });
            let now = watched.look(&world, Parts::ALL).crosses;
            let corners = world.ego_outline().corners().map(|corner| corner.y);
            let (least_m, most_m) = corners
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), y| (least.min(*y), most.max(*y)));
            let crossed = lines_m
                .into_iter()
                .find(|line_m| (least_m..most_m).contains(line_m) || *line_m == 7.0 && least_m > 7.0);
            // Across a slanting route a line is known to some centimetres.
            if lines_m.iter().any(|line_m| [least_m, most_m].iter().any(|m| (m - line_m).abs() < 0.05)) {
                before = now;
                continue;
            }
            assert_eq!(now != Crossing::None, crossed.is_some(), "{least_m} to {most_m}");
            if before == Crossing::None
                && let Some(line_m) = crossed
            {
                let is_left = line_m > world.ego().rear_axle.position.y;
                assert_eq!(now, if is_left { Crossing::Left } else { Crossing::Right });
            }
            assert!(before == Crossing::None || now == Crossing::None || before == now);
            told.push(now);
            before = now;
        }
        told.dedup();
        assert!(
            told.len() > 3 && told.contains(&Crossing::Left) && told.contains(&Crossing::Right),
            "{told:?}"
        );
    }

    #[test]
    fn a_crosswalk_is_passed_from_its_near_edge_to_its_far_one() {
        let mut world = testing::world(&testing::zebra());
        let mut watched = Watched::default();
        let [(begin_m, end_m)] = world.scene().route.crosswalks_m[..] else { panic!("it has one") };
        let mut most_m: f64 = -100.0;
        for _ in 0..1500 {
            world.tick(&Control { throttle_pct: 30.0, ..Control::default() });
            let moment = world.moment_facts();
            let wanted_m = if moment.ego_rear_m < end_m { moment.ego_front_m - begin_m } else { -100.0 };
            let found_m = watched.look(&world, Parts::ALL).over_crosswalk_m;
            assert!((found_m - wanted_m.max(-100.0)).abs() < 1e-9, "{found_m} in place of {wanted_m}");
            most_m = most_m.max(found_m);
        }
        assert!(most_m > 6.0, "it has passed: {most_m}");
    }

    #[test]
    fn who_leaves_its_lane_is_over_its_line_by_the_way_of_its_corner() {
        let mut world = testing::world(&testing::straight());
        let mut watched = Watched::default();
        let lane = world.scene().route.lane_at(0.0).lane;
        let half_lane_m = world.scene().map.lane(lane).width_at(0.0) / 2.0;
        let in_the_middle = watched.look(&world, Parts::ALL).over_lane_m;
        let half_width_m = VehicleParameters::MKZ.width_m / 2.0;
        assert!((in_the_middle - (half_width_m - half_lane_m)).abs() < 1e-9, "{in_the_middle}");
        let mut before_m = in_the_middle;
        for _ in 0..200 {
            world.tick(&Control { throttle_pct: 20.0, steer_rad: 0.02, ..Control::default() });
            let over_m = watched.look(&world, Parts::ALL).over_lane_m;
            assert!(over_m >= before_m - 1e-9, "it drives to the left all the time");
            before_m = over_m;
        }
        let offset_m = world.moment_facts().ego_offset_m;
        assert!(before_m > 0.0 && before_m >= offset_m + half_width_m - half_lane_m - 1e-6, "{before_m}");
    }

    #[test]
    fn a_stop_sign_is_passed_from_the_front_to_the_rear() {
        let mut world = testing::world(&testing::crossing_of("206", "274"));
        let mut watched = Watched::default();
        let line_m = world.scene().route.sign_lines[0].station_m;
        let mut straddled = 0;
        for _ in 0..3000 {
            world.tick(&Control { throttle_pct: 30.0, ..Control::default() });
            let found_m = watched.look(&world, Parts::ALL).over_stop_m;
            let facts = world.moment_facts();
            let expected_m = if facts.ego_rear_m >= line_m { FAR_M } else { facts.ego_front_m - line_m };
            assert!((found_m - expected_m.max(FAR_M)).abs() < 1e-9, "{found_m} in place of {expected_m}");
            straddled += u32::from(found_m > 0.0);
        }
        assert!(straddled >= 5, "it drives over the line");
    }

    #[test]
    fn a_red_light_that_was_passed_counts_as_long_as_it_is_red() {
        let (mut reds, mut most_m) = (0, 0.0_f64);
        for phase in 0..12 {
            let start = Start { signal_phase_s: f64::from(phase) * 5.0, ..testing::start() };
            let mut world = World::new(testing::crossing(), &start);
            let mut watched = Watched::default();
            let line_m = world.scene().route.stop_lines[0].station_m;
            let mut before_m = f64::NEG_INFINITY;
            let mut straddled = 0;
            for _ in 0..1500 {
                world.tick(&Control { throttle_pct: 30.0, ..Control::default() });
                let found_m = watched.look(&world, Parts::ALL).over_red_m;
                let facts = world.moment_facts();
                if found_m > 0.0 {
                    straddled += 1;
                    assert!((facts.ego_front_m - line_m - found_m).abs() < 1e-9 && found_m < OVER_RED_M_MAX);
                    assert_eq!(world.signal(world.scene().route.stop_lines[0].signal), SignalColour::Red);
                    most_m = most_m.max(found_m);
                }
                assert!(found_m >= FAR_M && (found_m <= 0.0 || found_m > before_m || before_m <= 0.0));
                before_m = found_m;
            }
            assert_eq!(straddled > 0, world.red_runs() == 1, "{straddled} ticks");
            reds += world.red_runs();
        }
        assert!((2..=10).contains(&reds), "it passes red and green lights: {reds}");
        assert!(
            most_m > VehicleParameters::MKZ.length_m,
            "one that drives through is far over the line: {most_m}"
        );
    }
}
