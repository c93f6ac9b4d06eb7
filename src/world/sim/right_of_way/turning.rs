//! Two vehicles that come to a junction side by side, of which one turns off across the other's way (articles 11 and 16).
//!
//! A vehicle that turns off lets pass who goes straight on beside it, on the road or on a way of their own. Where it turns
//! across the road, nobody passes it on that side who has no lane there.

use avastra_base::geometry::{Path, Pose, Vec2, wrap_angle};
use avastra_road::{RoadMap, Route, RouteLane};

use super::ruling::Rule;

/// A vehicle whose heading differs by more turns, rad (30°): off the road, round, or across its lane. Ours.
pub(super) const TURNS_RAD: f64 = core::f64::consts::FRAC_PI_6;
/// A vehicle that moves faster than this to its side comes into another lane, m/s. Ours: less than any lane
/// change, more than any wandering.
pub(in crate::sim) const SIDEWAYS_MPS: f64 = 0.15;
/// So far before a junction its lanes lie side by side, m. Ours.
const BEFORE_M: f64 = 5.0;

/// The ego vehicle in a junction, and another vehicle near it.
pub(super) struct Pair<'a> {
    pub map: &'a RoadMap,
    pub route: &'a Route,
    /// The lane of the route in the junction.
    pub inside: RouteLane,
    pub ego: Body,
    pub other: Body,
    /// The way of the other, and the station of its middle on it, m.
    pub way: (&'a Path, f64),
}

/// Where the middle of a vehicle is, and how it moves.
pub(super) struct Body {
    pub position: Vec2,
    pub velocity_mps: Vec2,
}

impl Pair<'_> {
    /// What each does that the other need not expect, the ego vehicle and the other; `None` if neither turns off across the
    /// other's way.
    pub fn does(&self) -> Option<[Option<Rule>; 2]> {
        let entry = self.route.path.pose_at(self.inside.from_m);
        let turned_rad =
            |path: &Path, station_m: f64| wrap_angle(path.pose_at(station_m).heading_rad - entry.heading_rad);
        let (way, middle_m) = self.way;
        let length_m = self.inside.to_m - self.inside.from_m;
        if turned_rad(way, middle_m - length_m).abs() > TURNS_RAD {
            return None;
        }
        let ego_rad = turned_rad(&self.route.path, self.inside.to_m);
        let other_rad = turned_rad(way, middle_m + length_m);
        let [ego_m, other_m] = [&self.ego, &self.other].map(|body| entry.to_local(body.position).y);
        // How much farther to the left the ego vehicle turns. The other has to be on that side.
        let farther_rad = wrap_angle(ego_rad - other_rad);
        if farther_rad.abs() < TURNS_RAD || farther_rad * (other_m - ego_m) <= 0.0 {
            return None;
        }
        let ego_turns = ego_rad.abs() > other_rad.abs();
        let way_from_m = entry.to_local(way.pose_at(middle_m - length_m).position).y;
        let (turner, turner_rad, turner_m, passer_m) = match ego_turns {
            true => (&self.ego, ego_rad, 0.0, other_m),
            false => (&self.other, other_rad, way_from_m, ego_m),
        };
        let towards = if ego_turns { farther_rad.signum() } else { -farther_rad.signum() };
        if towards * entry.left().dot(&turner.velocity_mps) <= SIDEWAYS_MPS {
            return None;
        }
        let is_overtaken = self.turns_across(turner_rad) && !self.has_own_lane(&entry, turner_m, passer_m);
        let (rule, is_of_ego) = match is_overtaken {
            true => (Rule::Overtaking, !ego_turns),
            false => (Rule::Turning, ego_turns),
        };
        Some(if is_of_ego { [Some(rule), None] } else { [None, Some(rule)] })
    }

    /// Whether a turn leads across the oncoming traffic.
    fn turns_across(&self, turn_rad: f64) -> bool {
        (turn_rad > 0.0) != self.map.lane(self.inside.lane).keeps_left
    }

    /// Whether the passer has a lane of its own beside that of the turner, before the junction. Both: m to the left of the entry.
    fn has_own_lane(&self, entry: &Pose, turner_m: f64, passer_m: f64) -> bool {
        let lane = |left_m: f64| {
            let at = entry.offset(-BEFORE_M, left_m).position;
            let place = self.map.nearest(at, entry.heading_rad, 0.0)?;
            (!self.map.runs_against(at, entry.heading_rad)).then_some(place.lane)
        };
        lane(passer_m).is_some_and(|own| lane(turner_m) != Some(own))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::ego::VehicleParameters;
    use crate::sim::right_of_way::crossing::{Course, Vehicle};
    use crate::sim::right_of_way::side::turns_off;
    use crate::sim::testing::{self, Heading};
    use crate::sim::tests::hold;

    /// What the two do when the ego vehicle's front is 8 m inside the junction. The other is on a way through these places, at a
    /// station of it, and goes along it at 5 m/s.
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
        assert_eq!(told(Heading::Straight, &turns(2.0, -20.0), 78.0), Some([None, Some(Rule::Turning)]));
        assert_eq!(told(Heading::Straight, &turns(2.0, 20.0), 78.0), None);
        assert_eq!(told(Heading::Straight, &along(1.5), 75.0), None, "neither turns");
        // One that has not begun to turn does nothing yet, and one that comes from the side is not beside it.
        assert_eq!(told(Heading::Straight, &turns(2.0, -20.0), 70.0), None);
        assert_eq!(told(Heading::Straight, &[[0.0, -40.0], [0.0, 40.0]], 30.0), None);
    }
}
