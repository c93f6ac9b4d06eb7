//! Two vehicles whose ways cross or join in a junction.

use avastra_base::kinematics::STANDING_MPS;
use avastra_lang::model::vocabulary::Priority;
use avastra_road::LaneIndex;

use crate::behave::right_of_way::order::{by_lights, by_order};
use crate::behave::right_of_way::passed::by_stops;
use crate::behave::right_of_way::room::{ABRUPT_MPS2, APPROACH_M, allowed_mps, can_stop, room_before_m};
use crate::behave::right_of_way::side::Beside;
use crate::behave::right_of_way::vehicle::Vehicle;
use crate::scene::junction::RouteArea;
use crate::state::ego::VehicleParameters;
use crate::state::passed::Passed;
use crate::state::ruling::{Mover, Rule, Ruling};
use crate::view::around::Around;

/// Vehicles that leave a conflict area this long before the other comes are not in its way, s. Ours.
const CLEAR_S: f64 = 0.5;
/// No conflict area is longer, m: lanes of large junctions that join at a small angle.
const AREA_M: f64 = 60.0;
/// A vehicle that stood no farther before a junction stood there to give way, m. Ours.
const SETS_OUT_M: f64 = 10.0;

/// One vehicle on its way through a conflict area.
#[derive(Debug, Clone, Copy)]
pub struct Passage {
    pub lane: LaneIndex,
    /// From its front to the beginning of the area, m; negative inside.
    pub in_m: f64,
    /// From its rear to the end of the area, m; negative beyond.
    pub out_m: f64,
    pub speed_mps: f64,
}

impl Passage {
    fn is_inside(&self) -> bool {
        self.in_m <= 0.0 && self.out_m > 0.0
    }

    /// Whether this vehicle, still on its way to the area, need not brake for the other, which is in it, or can brake
    /// gently.
    fn has_time_for(&self, other: &Passage) -> bool {
        let clear_s = other.out_m / other.speed_mps.max(0.5) + CLEAR_S;
        let comes_s = self.in_m / self.speed_mps.max(0.5);
        self.in_m > 0.0 && (clear_s < comes_s || can_stop(self.speed_mps, self.in_m, ABRUPT_MPS2))
    }
}

/// The ego vehicle and another in a conflict area, or one of them in it and the other before it.
#[derive(Debug, Clone, Copy)]
pub struct Crossing {
    pub ego: Passage,
    pub other: Passage,
}

impl Crossing {
    /// Where the two are in each other's way soonest.
    pub fn of(vehicle: &Vehicle, around: &Around) -> Option<Crossing> {
        let car = VehicleParameters::MKZ;
        let (front_m, rear_m) = (car.front_m(around.ego_station_m), car.rear_m(around.ego_station_m));
        let mut best: Option<Crossing> = None;
        for RouteArea { lane, area } in areas_ahead(around, front_m + APPROACH_M) {
            let Some((in_m, out_m)) = vehicle.through(area, around) else { continue };
            let ego = Passage {
                lane: *lane,
                in_m: area.from_m - front_m,
                out_m: area.to_m - rear_m,
                speed_mps: around.ego.speed_mps,
            };
            let other = Passage { lane: area.other, in_m, out_m, speed_mps: vehicle.speed_mps };
            let found = Crossing { ego, other };
            if (ego.is_inside() || other.is_inside())
                && ego.out_m > 0.0
                && other.out_m > 0.0
                && other.in_m < APPROACH_M
                && best.is_none_or(|best| found.away_m() < best.away_m())
            {
                best = Some(found);
            }
        }
        best
    }

    /// How far the later of the two still is from the area, m.
    fn away_m(&self) -> f64 {
        self.ego.in_m.max(self.other.in_m)
    }

    /// Whether the one of the two that is in the area stands across the other's strip.
    pub fn is_blocked(&self, first: Mover, vehicle: &Vehicle, around: &Around) -> bool {
        match first {
            Mover::Ego => Beside::of(vehicle, around).is_some_and(|beside| beside.aside_m < 0.0),
            Mover::Other | Mover::Both => room_before_m(vehicle.this, around).is_some(),
        }
    }

    /// `passed`: the lines that the ego vehicle and the other passed.
    pub fn ruling(&self, passed: [&Passed; 2], has_siren: bool, around: &Around) -> Ruling {
        let (by_rule, rule) = match has_siren {
            true => (Priority::Other, Rule::Siren),
            false => by_rules([self.ego.lane, self.other.lane], passed, around),
        };
        let (ego_first, is_open) = match (self.ego.is_inside(), self.other.is_inside()) {
            (true, true) => (false, false),
            (ego_first, _) => (ego_first, true),
        };
        let ruling = |priority, rule, mover| Ruling { priority, rule, mover, time_s: around.time_s() };
        let ego = Passage { speed_mps: allowed_mps(self.ego.speed_mps, around), ..self.ego };
        // The first has left the second, which goes before it, room to brake gently: it has given way. An ego vehicle that
        // passed its light or its sign has not, however early it came; of another one that did, both are to blame.
        let is_violation = matches!(rule, Rule::Light | Rule::BothLights | Rule::StopSign);
        match by_rule {
            Priority::Other
                if is_open && ego_first && !is_violation && self.other.has_time_for(&self.ego) =>
            {
                ruling(Priority::Ego, Rule::Clearing, Mover::Ego)
            }
            Priority::Ego if is_open && !ego_first && ego.has_time_for(&self.other) => {
                let priority = if is_violation { Priority::None } else { Priority::Other };
                ruling(priority, Rule::Clearing, Mover::Other)
            }
            _ if !is_open => ruling(by_rule, rule, Mover::Both),
            _ => ruling(by_rule, rule, if ego_first { Mover::Ego } else { Mover::Other }),
        }
    }
}

/// The conflict areas of the route that the ego vehicle's rear has not passed, up to those that begin before `to_m`.
fn areas_ahead<'a>(around: &Around<'a>, to_m: f64) -> impl Iterator<Item = &'a RouteArea> {
    let rear_m = VehicleParameters::MKZ.rear_m(around.ego_station_m);
    // By rising begin: those that begin too far behind or ahead are left out at once.
    let areas = &around.scene.route_areas;
    let first = areas.partition_point(|found| found.area.from_m < rear_m - AREA_M);
    let last = areas.partition_point(|found| found.area.from_m < to_m);
    areas[first..last.max(first)].iter().filter(move |found| found.area.to_m > rear_m)
}

/// The priority on two lanes of a junction, the ego vehicle's and the other's, by the lines that they passed and by the
/// order of the lanes.
fn by_rules(lanes: [LaneIndex; 2], passed: [&Passed; 2], around: &Around) -> (Priority, Rule) {
    let map = &around.scene.map;
    let [ego_red, other_red] = [0, 1].map(|nth| passed[nth].ran_light(lanes[nth], around));
    by_lights(ego_red, other_red)
        .or_else(|| by_stops(lanes, passed, map))
        .unwrap_or_else(|| by_order(map, lanes[0], lanes[1]))
}

/// Whether a vehicle drives into a junction across the route of the ego vehicle, which goes first there.
pub fn cuts_across(vehicle: &Vehicle, passed: [&Passed; 2], around: &Around) -> bool {
    // One that has stood before the junction and sets out shows its intention before it is in it.
    let within_m = if passed[1].has_just_stood(around) { SETS_OUT_M } else { 0.0 };
    if vehicle.speed_mps < STANDING_MPS || vehicle.has_siren || !vehicle.is_entering(within_m, around) {
        return false;
    }
    let to_m = VehicleParameters::MKZ.rear_m(around.ego_station_m) + APPROACH_M;
    areas_ahead(around, to_m).any(|RouteArea { lane, area }| {
        vehicle.through(area, around).is_some_and(|(_, out_m)| out_m > 0.0)
            && by_rules([*lane, area.other], passed, around).0 == Priority::Ego
    })
}

#[cfg(test)]
mod tests {
    use avastra_base::geometry::Path;

    use super::*;
    use crate::behave::right_of_way::vehicle::Course;
    use crate::sim::World;
    use crate::sim::testing::{self, Heading};

    fn passage(in_m: f64, out_m: f64, speed_mps: f64) -> Passage {
        Passage { lane: LaneIndex(0), in_m, out_m, speed_mps }
    }

    #[test]
    fn there_is_time_if_the_first_has_cleared_the_area_or_gentle_braking_suffices() {
        let inside = passage(-1.0, 6.0, 3.0);
        // At 10 m/s: 4 m of reaction and 16.7 m of braking.
        assert!(passage(20.7, 30.0, 10.0).has_time_for(&inside));
        assert!(!passage(20.6, 30.0, 10.0).has_time_for(&inside));
        // One that has 1 m to go at 4 m/s is out 0.25 s later, and then there is a margin.
        let soon = passage(-5.0, 1.0, 4.0);
        let clear_s = 0.25 + CLEAR_S;
        assert!(passage(10.0 * clear_s + 0.1, 30.0, 10.0).has_time_for(&soon));
        assert!(!passage(10.0 * clear_s - 0.1, 30.0, 10.0).has_time_for(&soon));
        // One that stands counts as 0.5 m/s, and so does the one that comes.
        assert!(!passage(20.0, 30.0, 10.0).has_time_for(&passage(-1.0, 1.0, 0.0)));
        assert!(passage(0.5 * clear_s, 30.0, 0.0).has_time_for(&soon), "it can stop at once");
        assert!(!passage(0.0, 6.0, 0.0).has_time_for(&soon), "it is in the area itself");
    }

    #[test]
    fn inside_is_from_the_front_in_to_the_rear_out() {
        assert!(passage(0.0, 0.1, 5.0).is_inside() && passage(-9.0, 1.0, 5.0).is_inside());
        assert!(!passage(0.1, 9.0, 5.0).is_inside() && !passage(-9.0, 0.0, 5.0).is_inside());
    }

    #[test]
    fn the_later_of_the_two_says_how_soon_they_meet() {
        let away_m = |ego_m: f64, other_m: f64| {
            let (ego, other) = (passage(ego_m, 90.0, 5.0), passage(other_m, 90.0, 5.0));
            Crossing { ego, other }.away_m()
        };
        assert_eq!((away_m(-2.0, 7.0), away_m(12.0, 7.0)), (7.0, 12.0));
    }

    #[test]
    fn a_path_along_a_lane_goes_through_its_area_as_the_lane_does() {
        let scene = testing::crossing();
        let area = &scene.route_areas[0].area;
        let lane = &scene.map.lane(area.other).centre;
        let mut world = testing::world(&scene);
        world.put("4", -1, "5", 250.0, 5.0);
        let this = &world.latest().obstacle;
        let through = |path: &Path, station_m: f64| {
            let way = Course::Path(path, station_m);
            let vehicle = Vehicle { this, speed_mps: 5.0, is_changing_lanes: false, has_siren: false, way };
            vehicle.through(area, &world.alone())
        };
        let half_m = this.outline.half_length_m;
        let (in_m, out_m) = through(lane, 1.0).expect("it leads through the area");
        assert!((in_m - (area.other_from_m - 1.0 - half_m)).abs() < 1e-6, "{in_m}");
        assert!((out_m - (area.other_to_m - 1.0 + half_m)).abs() < 1e-6, "{out_m}");
        // The ego vehicle's own lane crosses it.
        let across = &scene.map.lane(scene.route_areas[0].lane).centre;
        assert_eq!(through(across, 1.0), None);
    }

    #[test]
    fn the_first_has_given_way_if_it_left_the_second_time_but_not_after_a_violation() {
        let scene = testing::oncoming(Heading::Straight);
        let map = &scene.map;
        let on = |road: &str| {
            LaneIndex(map.lanes.iter().position(|lane| lane.key.road == road).expect("it is there"))
        };
        let around_of = World::new(scene.clone(), &testing::start());
        let around = around_of.alone();
        let (straight, left) = (scene.route_areas[0].lane, on("8"));
        let passed = Passed::default();
        let told = |ego: Passage, other: Passage, has_siren: bool| {
            let of = Crossing { ego, other }.ruling([&passed, &passed], has_siren, &around);
            assert_eq!(of.time_s, 0.0);
            (of.priority, of.rule, of.mover)
        };
        let ego = |in_m: f64| Passage { lane: straight, ..passage(in_m, in_m + 10.0, 10.0) };
        let other = |in_m: f64| Passage { lane: left, ..passage(in_m, in_m + 10.0, 3.0) };
        // The other turns left before the ego vehicle, which goes straight on.
        assert_eq!(told(ego(15.0), other(-1.0), false), (Priority::Ego, Rule::Turning, Mover::Other));
        assert_eq!(told(ego(40.0), other(-1.0), false), (Priority::Other, Rule::Clearing, Mover::Other));
        assert_eq!(told(ego(-1.0), other(15.0), false), (Priority::Ego, Rule::Turning, Mover::Ego));
        assert_eq!(told(ego(-1.0), other(-1.0), false), (Priority::Ego, Rule::Turning, Mover::Both));
        // A siren goes before the ego vehicle, which clears the area for it if there is time.
        assert_eq!(told(ego(15.0), other(-1.0), true), (Priority::Other, Rule::Siren, Mover::Other));
        assert_eq!(told(ego(-1.0), other(30.0), true), (Priority::Ego, Rule::Clearing, Mover::Ego));
        assert_eq!(told(ego(-1.0), other(0.5), true), (Priority::Other, Rule::Siren, Mover::Ego));
        assert_eq!(told(ego(-1.0), other(-1.0), true), (Priority::Other, Rule::Siren, Mover::Both));
    }
}
