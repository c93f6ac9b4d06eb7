//! Another vehicle, as right of way looks at it: what it does, whichever word told it.

use avastra_base::geometry::Path;

use crate::scene::junction::Area;
use crate::state::driver::Driver;
use crate::state::obstacle::Obstacle;
use crate::state::road_user::Motion;
use crate::view::around::Around;

/// A path goes along a lane if it is no farther from its middle, m, and no more askew, as a cosine (30°). Ours.
pub const ON_LANE_M: f64 = 1.5;
pub const ALONG_COS: f64 = 0.866;

/// Another vehicle, as right of way looks at it: what it does, whichever word told it.
pub struct Vehicle<'a> {
    pub this: &'a Obstacle,
    pub speed_mps: f64,
    pub is_changing_lanes: bool,
    pub has_siren: bool,
    pub way: Course<'a>,
}

/// Where a vehicle goes.
pub enum Course<'a> {
    Lanes(&'a Driver),
    /// A path that keeps to no lanes, and the station of the vehicle's middle on it, m.
    Path(&'a Path, f64),
    Nowhere,
}

impl Course<'_> {
    /// The path that it follows, and the station of its middle on it, m; `None` if it follows none.
    pub fn path(&self) -> Option<(&Path, f64)> {
        match self {
            Course::Lanes(driver) => Some((&driver.way.path, driver.station_m)),
            Course::Path(path, station_m) => Some((path, *station_m)),
            Course::Nowhere => None,
        }
    }
}

impl<'a> Vehicle<'a> {
    /// `None` of what is no vehicle.
    pub fn of(this: &'a Obstacle, motion: &'a Motion) -> Option<Vehicle<'a>> {
        if !this.body.is_vehicle() {
            return None;
        }
        let speed_mps = this.velocity_mps.norm();
        let plain =
            Vehicle { this, speed_mps, is_changing_lanes: false, has_siren: false, way: Course::Nowhere };
        Some(match motion {
            Motion::Drive(driver) => Vehicle {
                speed_mps: driver.speed_mps,
                is_changing_lanes: driver.is_changing_lanes(),
                has_siren: driver.has_siren,
                way: Course::Lanes(driver),
                ..plain
            },
            Motion::Guide(guided) if guided.speed_mps >= 0.0 => {
                let (path, middle_m) = guided.way();
                Vehicle { way: Course::Path(path, middle_m), ..plain }
            }
            Motion::Guide(_) | Motion::Walk(_) | Motion::Stroll(_) | Motion::Stand => plain,
        })
    }

    /// Whether its front is in a junction, or at most `within_m` before one.
    pub fn is_entering(&self, within_m: f64, around: &Around) -> bool {
        let outline = &self.this.outline;
        let reach_m = outline.half_length_m + within_m;
        let front = outline.pose.offset(reach_m, 0.0);
        let map = &around.scene.map;
        let lane = match self.way {
            Course::Lanes(driver) => Some(driver.way.lane_at(driver.station_m + reach_m).0),
            Course::Path(..) | Course::Nowhere => {
                map.nearest(front.position, front.heading_rad, 0.0).map(|place| place.lane)
            }
        };
        lane.is_some_and(|lane| map.lane(lane).junction.is_some())
    }

    /// From the front to the beginning of its stretch of a conflict area, and from the rear to that stretch's end, m.
    /// `None` if it does not go through the area.
    pub fn through(&self, area: &Area, around: &Around) -> Option<(f64, f64)> {
        let half_m = self.this.outline.half_length_m;
        let (station_m, begin_m) = match self.way {
            Course::Lanes(driver) => {
                let station_m = driver.station_m;
                (station_m, driver.way.lane_ahead_m(area.other, station_m - half_m)?)
            }
            Course::Path(path, station_m) => {
                let lane = &around.scene.map.lane(area.other).centre;
                // A path that does not follow this lane goes through the area in another way, which no rule is about.
                let along = |on_lane_m: f64| {
                    let pose = lane.pose_at(on_lane_m);
                    let found = path.project(pose.position);
                    let turned = path.pose_at(found.station_m).forward().dot(&pose.forward());
                    (found.distance_m < ON_LANE_M && turned > ALONG_COS)
                        .then_some(found.station_m - on_lane_m)
                };
                let middle_m = (area.other_from_m + area.other_to_m) / 2.0;
                let begin_m = along(middle_m)?;
                along(area.other_from_m)?;
                along(area.other_to_m)?;
                // It comes along the lane, or begins on it: one from another arm may end along it.
                let begin = path.project(lane.points()[0].position);
                if begin.station_m > 0.0 && begin.distance_m > ON_LANE_M {
                    return None;
                }
                (station_m, begin_m)
            }
            Course::Nowhere => return None,
        };
        let in_m = begin_m + area.other_from_m - station_m - half_m;
        Some((in_m, begin_m + area.other_to_m - station_m + half_m))
    }
}
