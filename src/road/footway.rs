//! Ways across a road on foot: from kerb to kerb, over all lanes between.
//!
//! The carriageway is what driving lanes cover, inside junctions too, and the strips for parking, cycles and trams.
//! A way ends where the ground is free for as long as a refuge island is wide: at the other kerb, or on a median. It
//! never leads through a junction, except over a crosswalk, nor through anything solid. Parked vehicles are not on the map.

use avastra_base::geometry::{OrientedBox, Vec2};

use super::crossing::{edges, holds};
use super::map::{RoadMap, Strip, StripKind};

/// The least free width on which a person can stand between lanes, m: AASHTO's narrowest refuge island, 6 feet.
const REFUGE_M: f64 = 1.8;
/// Distance from the edge of the carriageway at which people stand, m: half their width and the 0.5 m that the
/// German guideline RASt 06 keeps free beside a carriageway.
const KERB_M: f64 = 0.75;
/// A walkway that begins within this distance behind the edge is where people stand, m. Ours.
const VERGE_M: f64 = 4.0;
/// A kerb farther than this from the place asked about is not looked for, m.
const HALF_ROAD_M: f64 = 40.0;
/// How far people walk on behind the other kerb, if there is room, m. Ours.
const BEYOND_M: f64 = 8.0;
/// Least distance of a person's centre from lanes and from anything solid, m.
const ROOM_M: f64 = 0.5;
/// Lanes farther from a point than this count as this far, m.
const REACH_M: f64 = 3.0;
/// Least step along a way, m; narrower gaps between lanes are not noticed.
const CHECK_M: f64 = 0.25;
/// Distance between the points of a parked vehicle's sides that are checked, m.
const PARKED_CHECK_M: f64 = 1.0;

/// One end of a way on foot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kerb {
    /// Where a person stands.
    pub place: Vec2,
    /// From the place asked about to `place`, m.
    pub way_m: f64,
    /// From the place asked about to the outer edge of the last driving lane, m.
    pub edge_m: f64,
    /// How far the ground is free straight on behind `place`, m; at most 8.
    pub beyond_m: f64,
}

/// A way across the road on foot. It is straight and leads through the place asked about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FootWay {
    pub left: Kerb,
    pub right: Kerb,
}

/// Distances of a point to the nearest surfaces, m: negative on them, at most [`REACH_M`].
struct Ground {
    street_m: f64,
    junction_m: f64,
    paved_m: f64,
}

impl Ground {
    fn room_m(&self) -> f64 {
        self.street_m.min(self.junction_m).min(self.paved_m)
    }
}

impl RoadMap {
    /// The way on foot across the road through a point of a lane; `left` is the unit vector to one side.
    ///
    /// # Errors
    /// Why people do not cross there, in words that complete "cannot spawn: …".
    pub fn foot_way(&self, middle: Vec2, left: Vec2) -> Result<FootWay, &'static str> {
        let over_crosswalk = self.crosswalk_at(middle).is_some();
        Ok(FootWay {
            left: self.kerb(middle, left, over_crosswalk)?,
            right: self.kerb(middle, -left, over_crosswalk)?,
        })
    }

    /// The direction in which the crosswalk that holds a point leads over the road, a unit vector. It is that of the
    /// longest side of its outline.
    pub fn crosswalk_at(&self, point: Vec2) -> Option<Vec2> {
        let crosswalk = self.crosswalks.iter().find(|crosswalk| holds(&crosswalk.outline, point))?;
        let sides = edges(&crosswalk.outline).map(|(a, b)| b - a);
        let longest = sides.max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()))?;
        let length_m = longest.norm();
        (length_m > 1e-6).then(|| longest / length_m)
    }

    /// Distance from a point to one of the map's crosswalks, m: 0 on it.
    pub fn crosswalk_gap_m(&self, crosswalk: usize, point: Vec2) -> f64 {
        let outline = &self.crosswalks[crosswalk].outline;
        if holds(outline, point) {
            return 0.0;
        }
        edges(outline).map(|(a, b)| distance_m2(point, *a, *b)).fold(f64::INFINITY, f64::min).sqrt()
    }

    /// Distance from a point to the nearest driving lane, m: negative on it, at most 3.
    pub fn lane_room_m(&self, point: Vec2) -> f64 {
        self.grid.least_room_m(&self.lanes, point, REACH_M)
    }

    /// Whether a vehicle could stand there beside the driving lanes: off them and off crosswalks, and in nothing
    /// solid. Points along its sides are checked; every lane is wider than the gaps between them.
    pub fn is_free_to_park(&self, outline: &OrientedBox) -> bool {
        let steps = (2.0 * outline.half_length_m / PARKED_CHECK_M).ceil().max(1.0) as u32;
        [1.0, -1.0].into_iter().all(|side| {
            (0..=steps).all(|step| {
                let part = 2.0 * f64::from(step) / f64::from(steps) - 1.0;
                let point =
                    outline.pose.offset(outline.half_length_m * part, outline.half_width_m * side).position;
                self.lane_room_m(point) >= 0.0
                    && self.crosswalk_at(point).is_none()
                    && !self.is_solid(point, PARKED_CHECK_M / 2.0)
            })
        })
    }

    /// Whether anything solid is within `room_m` of a point.
    pub fn is_solid(&self, point: Vec2, room_m: f64) -> bool {
        self.solids.iter().any(|solid| {
            solid.bounds.distance_m2_min(point) <= room_m * room_m
                && (holds(&solid.outline, point)
                    || edges(&solid.outline).any(|(a, b)| distance_m2(point, *a, *b) < room_m * room_m))
        })
    }

    /// The end of a way that leads from a point in a direction.
    fn kerb(&self, from: Vec2, along: Vec2, over_crosswalk: bool) -> Result<Kerb, &'static str> {
        let (mut at_m, mut paved_m, mut edge_m) = (0.0, 0.0, 0.0);
        let (mut on_road, mut on_lane) = (true, true);
        loop {
            let ground = self.ground(from + along * at_m);
            let room_m = ground.room_m();
            if room_m > 0.0 {
                if on_road {
                    // The last step may have led beyond the edge.
                    paved_m = at_m - room_m;
                    edge_m = if on_lane { paved_m } else { edge_m };
                }
                on_road = false;
                if at_m - paved_m >= REFUGE_M {
                    break;
                }
                at_m += room_m.max(CHECK_M);
            } else {
                if ground.junction_m <= 0.0 && ground.street_m > 0.0 && !over_crosswalk {
                    return Err("a junction is there");
                }
                let lane_m = ground.street_m.min(ground.junction_m);
                if on_lane && lane_m > 0.0 {
                    edge_m = at_m - lane_m;
                }
                (on_road, on_lane) = (true, lane_m <= 0.0);
                at_m += (-room_m).max(CHECK_M);
            }
            if at_m > HALF_ROAD_M {
                return Err("the road has no kerb there");
            }
        }
        let is_walkway =
            |at_m: &f64| self.strip_room_m(StripKind::Walkway, from + along * (paved_m + at_m)) <= 0.0;
        let behind_m = (1..).map(|step| f64::from(step) * CHECK_M).take_while(|at_m| *at_m <= VERGE_M);
        let way_m = paved_m + behind_m.clone().find(is_walkway).unwrap_or(0.0).max(KERB_M);
        let place = from + along * way_m;
        let is_free = |point: Vec2| self.ground(point).room_m() >= ROOM_M && !self.is_solid(point, ROOM_M);
        if !is_free(place) {
            return Err("there is no room at the kerb");
        }
        let mut checked_m = 0.0;
        while checked_m < way_m {
            if self.is_solid(from + along * checked_m, ROOM_M) {
                return Err("something solid stands in the way");
            }
            checked_m += CHECK_M;
        }
        Ok(Kerb { place, way_m, edge_m, beyond_m: self.free_m(place, along) })
    }

    /// How far the ground is free of lanes and of anything solid from a free place on, m; at most [`BEYOND_M`].
    fn free_m(&self, place: Vec2, along: Vec2) -> f64 {
        let (mut free_m, mut known_m) = (0.0, 0.0);
        while free_m < BEYOND_M {
            let next_m = free_m + CHECK_M;
            let point = place + along * next_m;
            if next_m > known_m {
                let room_m = self.ground(point).room_m() - ROOM_M;
                if room_m < 0.0 {
                    break;
                }
                known_m = next_m + room_m;
            }
            if self.is_solid(point, ROOM_M) {
                break;
            }
            free_m = next_m;
        }
        free_m
    }

    fn ground(&self, point: Vec2) -> Ground {
        let mut ground = Ground { street_m: REACH_M, junction_m: REACH_M, paved_m: REACH_M };
        for (index, projection) in self.grid.near(&self.lanes, point, REACH_M) {
            let lane = self.lane(index);
            let room_m = projection.distance_m - lane.width_at(projection.station_m) / 2.0;
            let nearest_m =
                if lane.junction.is_some() { &mut ground.junction_m } else { &mut ground.street_m };
            *nearest_m = nearest_m.min(room_m);
        }
        ground.paved_m = self.strip_room_m(StripKind::Paved, point);
        ground
    }

    /// Distance from a point to the nearest strip of a kind, m: negative on it, at most [`REACH_M`].
    fn strip_room_m(&self, kind: StripKind, point: Vec2) -> f64 {
        let strips = self.strips.iter().filter(|strip| strip.kind == kind);
        strips.fold(REACH_M, |nearest_m, strip| nearest_m.min(strip.room_m(point)))
    }
}

impl Strip {
    /// Distance of a point, m: negative on the strip.
    fn room_m(&self, point: Vec2) -> f64 {
        let widest_m = self.widths_m.iter().copied().fold(0.0, f64::max);
        let reach_m = REACH_M + widest_m / 2.0;
        if self.bounds.distance_m2_min(point) > reach_m * reach_m {
            return REACH_M;
        }
        let beside = self.centre.project(point);
        let (index, fraction) = self.centre.locate(beside.station_m);
        let (from_m, to_m) = (self.widths_m[index], self.widths_m[index + 1]);
        beside.distance_m - (from_m + (to_m - from_m) * fraction.clamp(0.0, 1.0)) / 2.0
    }
}

/// Squared distance of a point to the segment between two others, m².
fn distance_m2(point: Vec2, a: Vec2, b: Vec2) -> f64 {
    let side = b - a;
    let part = ((point - a).dot(&side) / side.norm_squared().max(1e-12)).clamp(0.0, 1.0);
    (point - a - side * part).norm_squared()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The nearest edge is found without looking at lanes that are farther away.
    #[test]
    fn the_nearest_lane_edge_is_that_of_a_look_at_all_lanes() {
        let (mut on, mut off) = (0, 0);
        for name in ["crossroad", "corner"] {
            let path = format!("{}/../../scenarios/roads/{name}.xodr", env!("CARGO_MANIFEST_DIR"));
            let map = RoadMap::from_opendrive(name, &std::fs::read_to_string(path).unwrap()).unwrap();
            for nth in 0..4000_u32 {
                let lane = &map.lanes[nth as usize % map.lanes.len()].centre;
                let part = |factor: f64| (f64::from(nth) * factor).fract();
                let pose = lane.pose_at(part(0.618) * lane.length_m());
                let point = pose.offset(0.0, 24.0 * part(0.414) - 12.0).position;
                let ground = map.ground(point);
                let room_m = map.lane_room_m(point);
                assert_eq!(room_m, ground.street_m.min(ground.junction_m), "{point:?} on {name}");
                on += u32::from(room_m < 0.0);
                off += u32::from(room_m > 0.0 && room_m < REACH_M);
            }
        }
        assert!(on > 1000 && off > 500, "{on} on lanes, {off} beside them");
    }
}
