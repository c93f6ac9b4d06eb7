//! The lanes beside a lane, whichever road of the file they belong to. Carriageways of one street are often
//! separate roads, with a median between them that no road describes.
//!
//! Opposing lanes are found by geometry, not by links. Lane changes stay within a road and keep to markings
//! (see [`Lane::changes_left_m`]). Ways through a junction are by links.
//!
//! [`Lane::changes_left_m`]: super::map::Lane::changes_left_m

use core::f64::consts::PI;
use core::ops::RangeInclusive;

use avastra_base::geometry::wrap_angle;

use super::map::{LaneIndex, RoadMap};

/// Lanes are parallel if their headings, or one and the reverse of the other, are this near, rad.
const PARALLEL_RAD: f64 = 0.35;

/// A parallel lane counts as abreast only if its nearest point is within this distance along the road, m.
const ABREAST_M: f64 = 1.0;

/// Lanes of one direction whose centres are nearer to each other than this are parts of one lane, m.
const FOLLOWS_M: f64 = 0.1;

/// The widest median, m: an opposing lane farther away belongs to another street.
const MEDIAN_M_MAX: f64 = 40.0;

/// Opposing lanes are looked for as near as this first, m.
const NEAR_M: f64 = 10.0;

/// How much farther is looked than is asked for, m: one lane may stand for another beside it, but no ten in a row do.
const BESIDE_M: f64 = 1.0;

/// A lane beside a place on another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Abreast {
    pub lane: LaneIndex,
    /// Station on this lane, m.
    pub station_m: f64,
    /// From the centre of the lane asked about to the centre of this one, m, positive to the left.
    pub lateral_m: f64,
    pub width_m: f64,
    pub same_direction: bool,
}

/// The nearest lane that leads the other way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Opposing {
    pub lane: LaneIndex,
    /// Station on the opposing lane, in that lane's own driving direction, m.
    pub station_m: f64,
    /// From centre to centre, m, positive to the left.
    pub lateral_m: f64,
    /// Width of the median between the opposing lane and the nearest lane in our direction, m; 0 if they share
    /// a line.
    pub median_m: f64,
}

impl RoadMap {
    /// All lanes parallel to a lane at one of its stations, with an edge within `reach_m` of its centre, from
    /// left to right. The lane itself is left out, and so are lanes of another level. For a lane outside
    /// junctions, so are the lanes inside junctions.
    pub fn abreast(&self, lane: LaneIndex, station_m: f64, reach_m: f64) -> Vec<Abreast> {
        let beside = -reach_m..=reach_m;
        let directions = [true, false].map(|same| self.abreast_towards(lane, station_m, &beside, same));
        let mut found = directions.concat();
        found.sort_by(|a, b| b.lateral_m.total_cmp(&a.lateral_m).then(a.lane.cmp(&b.lane)));
        found
    }

    /// The lanes as in [`RoadMap::abreast`] that lead in our direction, or those that lead the other way, by rising
    /// index, with an edge or a part within these distances to the left. A few others may be among them.
    fn abreast_towards(
        &self,
        lane: LaneIndex,
        station_m: f64,
        aside_m: &RangeInclusive<f64>,
        same: bool,
    ) -> Vec<Abreast> {
        let own = self.lane(lane);
        let pose = own.centre.pose_at(station_m);
        let mut found: Vec<Abreast> = Vec::new();
        // The edge of a lane is at most half the width of the widest lane away from the lane's centre.
        let half_m = self.grid.half_width_m();
        let centres_m = aside_m.start() - half_m..=aside_m.end() + half_m;
        let heading_rad = pose.heading_rad + if same { 0.0 } else { PI };
        let toward = (heading_rad, PARALLEL_RAD);
        for index in self.grid.beside(&pose, toward, ABREAST_M, centres_m) {
            let other = self.lane(index);
            let is_inside = other.junction.is_some() && own.junction.is_none();
            if index == lane || is_inside {
                continue;
            }
            let projection = other.centre.project(pose.position);
            if own.is_apart_at(station_m, other, projection.station_m) {
                continue;
            }
            let there = other.centre.pose_at(projection.station_m);
            let turn_rad = wrap_angle(there.heading_rad - pose.heading_rad).abs();
            let is_wanted = if same { turn_rad < PARALLEL_RAD } else { turn_rad >= PI - PARALLEL_RAD };
            if !is_wanted {
                continue;
            }
            let offset = pose.to_local(there.position);
            let width_m = other.width_at(projection.station_m);
            let (right_m, left_m) = (offset.y - width_m / 2.0, offset.y + width_m / 2.0);
            if offset.x.abs() > ABREAST_M || right_m > *aside_m.end() || left_m < *aside_m.start() {
                continue;
            }
            let (station_m, lateral_m) = (projection.station_m, offset.y);
            let abreast = Abreast { lane: index, station_m, lateral_m, width_m, same_direction: same };
            // Where two lane sections meet, a lane and its successor are both abreast: one of them is enough.
            if !found.iter().any(|known| (known.lateral_m - lateral_m).abs() < FOLLOWS_M) {
                found.push(abreast);
            }
        }
        found
    }

    /// The nearest lane of the opposite direction beside a lane at one of its stations: on the side of opposing
    /// traffic (left, unless traffic keeps left), across a median of at most 40 m, on the same road or on
    /// another.
    pub fn opposing(&self, lane: LaneIndex, station_m: f64) -> Option<Opposing> {
        let own = self.lane(lane);
        let side = if own.keeps_left { -1.0 } else { 1.0 };
        let aside_m = |beside: &Abreast| side * beside.lateral_m;
        let within = |reach_m: f64| if own.keeps_left { -reach_m..=BESIDE_M } else { -BESIDE_M..=reach_m };
        let nearest_within = |reach_m: f64| {
            let opposite = self.abreast_towards(lane, station_m, &within(reach_m), false);
            let aside = opposite.into_iter().filter(|beside| aside_m(beside) > 0.0);
            aside.min_by(|a, b| aside_m(a).total_cmp(&aside_m(b)))
        };
        // Most are next to our own lane. Else twice the width of a median, because lanes of our own direction may lie
        // between.
        let near = nearest_within(NEAR_M + BESIDE_M).filter(|beside| aside_m(beside) < NEAR_M);
        let nearest = near.or_else(|| nearest_within(2.0 * MEDIAN_M_MAX))?;
        // No farther than the opposing lane; a little more, because one lane may stand for another beside it.
        let same = self.abreast_towards(lane, station_m, &within(aside_m(&nearest) + FOLLOWS_M), true);
        let ours = same.iter().filter(|beside| aside_m(beside) > 0.0 && aside_m(beside) < aside_m(&nearest));
        let edge_m = ours
            .map(|beside| aside_m(beside) + beside.width_m / 2.0)
            .fold(own.width_at(station_m) / 2.0, f64::max);
        let gap_m = aside_m(&nearest) - nearest.width_m / 2.0 - edge_m;
        let (lane, station_m, lateral_m) = (nearest.lane, nearest.station_m, nearest.lateral_m);
        // Rounding leaves tiny gaps between lanes that share a line.
        let median_m = if gap_m > 1e-3 { gap_m } else { 0.0 };
        (median_m <= MEDIAN_M_MAX).then_some(Opposing { lane, station_m, lateral_m, median_m })
    }

    /// The ways through a junction, by rising index of the lanes they come from and use.
    pub fn connections(&self, junction: usize) -> Vec<Connection> {
        self.ways_through(junction).expect("a map in which they are too many is refused")
    }

    /// As [`RoadMap::connections`]; `None` if there are too many, which is possible only if lanes inside lead into each other.
    pub(super) fn ways_through(&self, junction: usize) -> Option<Vec<Connection>> {
        let inside = |lane: LaneIndex| self.lane(lane).junction == Some(junction);
        let mut lanes_left = WAY_LANES_MAX;
        let mut found = Vec::new();
        for first in self.junctions[junction].lanes.iter().copied() {
            for from in self.lane(first).predecessors.iter().copied().filter(|from| !inside(*from)) {
                let mut open = vec![vec![first]];
                while let Some(lanes) = open.pop() {
                    lanes_left = lanes_left.checked_sub(lanes.len())?;
                    for next in self.lane(lanes[lanes.len() - 1]).successors.iter().copied() {
                        if !inside(next) {
                            found.push(Connection { from, lanes: lanes.clone(), to: next });
                        } else if !lanes.contains(&next) {
                            open.push(lanes.iter().copied().chain([next]).collect());
                        }
                    }
                }
            }
        }
        found.sort();
        Some(found)
    }
}

/// Limit on the lanes of all ways through a junction together, each counted for every way that uses it.
const WAY_LANES_MAX: usize = 100_000;

/// A way through a junction.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Connection {
    pub from: LaneIndex,
    /// The lanes inside the junction: one, or several where a connecting road has several lane sections.
    pub lanes: Vec<LaneIndex>,
    pub to: LaneIndex,
}
