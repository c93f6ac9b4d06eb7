//! Two vehicles that come to a junction side by side, of which one turns off across the other's way (articles 11 and 16).
//!
//! A vehicle that turns off gives way to a vehicle that goes straight on beside it, on the road or on a separate path.
//! Where it turns across the road, the other may not overtake it on that side: in its lane, or in one for oncoming
//! traffic.

use avastra_base::geometry::{Path, Pose, Vec2, wrap_angle};
use avastra_road::{RoadMap, Route, RouteLane};

use crate::state::obstacle::SIDEWAYS_MPS;
use crate::state::ruling::Rule;

/// A vehicle whose heading differs by more turns, rad (30°): off the road, round, or across its lane. Ours.
pub const TURNS_RAD: f64 = core::f64::consts::FRAC_PI_6;
/// So far before a junction its lanes lie side by side, and vehicles are at the junction, m. Ours.
pub const BEFORE_M: f64 = 5.0;
/// One that comes less far to the side comes behind, m. Ours: cyclists ride farther beside the middle of a lane.
const BESIDE_M: f64 = 1.0;
/// A vehicle that looks so far to the side has begun to turn off, rad (6°). Ours.
const BEGUN_RAD: f64 = core::f64::consts::PI / 30.0;

/// The ego vehicle at a junction, and another vehicle near it.
pub struct Pair<'a> {
    pub map: &'a RoadMap,
    pub route: &'a Route,
    /// A lane of the route in the junction.
    pub inside: RouteLane,
    pub ego: Moving,
    /// Station of the rear axle of the ego vehicle, m.
    pub ego_station_m: f64,
    pub other: Moving,
    /// The way of the other, and the station of its middle on it, m.
    pub way: (&'a Path, f64),
}

/// Where a vehicle is, and how it moves.
pub struct Moving {
    pub pose: Pose,
    pub velocity_mps: Vec2,
}

/// The motion of a vehicle in the junction.
struct Turn {
    /// How far it turns there, rad to the left.
    turn_rad: f64,
    /// Where it came from: m to the left of the route's entry.
    from_m: f64,
    /// Speed to the left of the direction in which both came, m/s, and how far it looks to the left of it, rad.
    left_mps: f64,
    looks_rad: f64,
}

impl Pair<'_> {
    /// The manoeuvres that the other need not expect, the ego vehicle's and the other's; `None` if neither turns off
    /// across the other's way.
    pub fn does(&self) -> Option<[Option<Rule>; 2]> {
        let (from_m, to_m) = self.junction_m();
        let entry = self.route.path.pose_at(from_m);
        let (way, middle_m) = self.way;
        // The other may not have come to the junction yet.
        let ahead_m = entry.forward().dot(&(entry.position - self.other.pose.position));
        let enters_m = way.project_near(entry.position, middle_m + ahead_m, BEFORE_M).station_m;
        let came = way.pose_at(enters_m);
        if wrap_angle(came.heading_rad - entry.heading_rad).abs() > TURNS_RAD {
            return None;
        }
        let beside_m = |path: &Path, station_m: f64, body: &Moving| {
            path.pose_at(station_m).to_local(body.pose.position).y
        };
        let turn = |turn_rad: f64, from_m: f64, body: &Moving| Turn {
            turn_rad,
            from_m,
            left_mps: entry.left().dot(&body.velocity_mps),
            looks_rad: wrap_angle(body.pose.heading_rad - entry.heading_rad),
        };
        let ego_from_m = beside_m(&self.route.path, self.ego_station_m, &self.ego);
        let other_from_m = entry.to_local(came.position).y + beside_m(way, middle_m, &self.other);
        let length_m = to_m - from_m;
        let ego = turn(turns_rad(&self.route.path, from_m, length_m), ego_from_m, &self.ego);
        let other = turn(turns_rad(way, enters_m, length_m), other_from_m, &self.other);
        let [ego_turns, other_turns] = [ego.crosses(&other), other.crosses(&ego)];
        let rule = |turner: &Turn, passer: &Turn| match self.is_overtaken(&entry, turner, passer) {
            true => Rule::Overtaking,
            false => Rule::TurningOff,
        };
        match (ego_turns, other_turns) {
            (true, true) => Some([Some(Rule::TurningOff), Some(Rule::TurningOff)]),
            (true, false) => Some(match rule(&ego, &other) {
                Rule::Overtaking => [None, Some(Rule::Overtaking)],
                rule => [Some(rule), None],
            }),
            (false, true) => Some(match rule(&other, &ego) {
                Rule::Overtaking => [Some(Rule::Overtaking), None],
                rule => [None, Some(rule)],
            }),
            (false, false) => None,
        }
    }

    /// From where to where the route is in the junction, m: its lanes there may follow one another.
    fn junction_m(&self) -> (f64, f64) {
        let is_inside = |part: &&RouteLane| self.map.lane(part.lane).junction.is_some();
        let lanes = &self.route.lanes;
        let at = lanes.partition_point(|part| part.enter_m <= self.inside.enter_m).max(1) - 1;
        let first = lanes[..=at].iter().rev().take_while(is_inside).last();
        let last = lanes[at..].iter().take_while(is_inside).last();
        (first.unwrap_or(&self.inside).from_m, last.unwrap_or(&self.inside).to_m)
    }

    /// Whether the passer overtakes a vehicle that turns across the road, where the passer has no separate lane or way.
    fn is_overtaken(&self, entry: &Pose, turner: &Turn, passer: &Turn) -> bool {
        let turns_across = (turner.turn_rad > 0.0) != self.map.lane(self.inside.lane).keeps_left;
        let lane = |from_m: f64| {
            let at = entry.offset(-BEFORE_M, from_m).position;
            self.map.nearest(at, entry.heading_rad, 0.0).map(|place| (place.lane, at))
        };
        turns_across
            && lane(passer.from_m).is_some_and(|(own, at)| {
                self.map.runs_against(at, entry.heading_rad)
                    || lane(turner.from_m).is_some_and(|(lane, _)| lane == own)
            })
    }
}

impl Turn {
    /// Whether it turns off to the side on which another came that turns less or the other way, and has begun to.
    fn crosses(&self, other: &Turn) -> bool {
        let side = self.turn_rad.signum();
        let farther_rad = side * (self.turn_rad - other.turn_rad);
        self.turn_rad.abs() > TURNS_RAD
            && farther_rad > TURNS_RAD
            && side * (other.from_m - self.from_m) > BESIDE_M
            // One that has stopped in its turn turns off all the same.
            && (side * self.left_mps > SIDEWAYS_MPS || side * self.looks_rad > BEGUN_RAD)
    }
}

/// How far a path turns on a stretch beyond what it turned before, rad to the left: a vehicle that goes on round a
/// circle does not turn.
fn turns_rad(path: &Path, from_m: f64, length_m: f64) -> f64 {
    path.turned_rad(from_m, from_m + length_m) - path.turned_rad(from_m - length_m, from_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::behave::right_of_way::side::turns_off;
    use crate::behave::right_of_way::vehicle::{Course, Vehicle};
    use crate::sim::testing::{self, Heading};
    use crate::sim::tests::hold;
    use crate::state::ego::VehicleParameters;

    /// The manoeuvres of the two when the ego vehicle's front is 8 m inside the junction. The other is on a way through
    /// these places, at a station of it, and goes along it at 5 m/s.
    fn told(heading: Heading, way: &[[f64; 2]], station_m: f64) -> Option<[Option<Rule>; 2]> {
        let scene = testing::oncoming(heading);
        let mut world = testing::world(&scene);
        while VehicleParameters::MKZ.front_m(world.ego_station_m()) < 108.0 {
            assert_eq!(world.tick(&hold(&world, 5.0)), []);
        }
        world.put("3", 1, "2", 20.0, 5.0);
        let places: Vec<Vec2> = way.iter().map(|[x_m, y_m]| Vec2::new(*x_m, *y_m)).collect();
        let path = Path::through(&places).expect("a way");
        let pose = path.pose_at(station_m);
        let mut this = world.latest().obstacle;
        this.outline.pose = pose;
        this.forward = pose.forward();
        this.velocity_mps = pose.forward() * 5.0;
        let way = Course::Path(&path, station_m);
        let vehicle =
            Vehicle { this: &this, speed_mps: 5.0, is_changing_lanes: false, has_siren: false, way };
        turns_off(&vehicle, &world.alone())
    }

    #[test]
    fn who_turns_off_lets_pass_but_nobody_overtakes_where_it_turns_to() {
        let along = |y_m: f64| [[-80.0, y_m], [80.0, y_m]];
        // The ego vehicle turns left from y = -1.75: one passes it on the other side of the road, one on the right.
        assert_eq!(told(Heading::Left, &along(1.5), 75.0), Some([None, Some(Rule::Overtaking)]));
        assert_eq!(told(Heading::Left, &along(-5.0), 75.0), None);
        // On a separate way beside the road, it passes.
        assert_eq!(told(Heading::Left, &along(5.0), 75.0), Some([Some(Rule::TurningOff), None]));
        // A vehicle that also turns left is in no other's way.
        let also = [[-80.0, 1.5], [-6.0, 1.5], [-3.0, 4.0], [-2.0, 40.0]];
        assert_eq!(told(Heading::Left, &also, 60.0), None);
        // It goes straight on, and one beside it turns off: right across its way, or left and away.
        let turns = |from_m: f64, to_m: f64| {
            [
                [-80.0, from_m],
                [-6.0, from_m],
                [-3.0, from_m + to_m / 8.0],
                [0.0, from_m + to_m / 2.0],
                [1.0, to_m],
            ]
        };
        assert_eq!(told(Heading::Straight, &turns(2.0, -20.0), 78.0), Some([None, Some(Rule::TurningOff)]));
        assert_eq!(told(Heading::Straight, &turns(2.0, 20.0), 78.0), None);
        assert_eq!(told(Heading::Straight, &along(1.5), 75.0), None, "neither turns");
        // One that has not begun to turn does nothing yet, and one that comes from the side is not beside it.
        assert_eq!(told(Heading::Straight, &turns(2.0, -20.0), 70.0), None);
        assert_eq!(told(Heading::Straight, &[[0.0, -40.0], [0.0, 40.0]], 30.0), None);
    }
}
