//! Heights of roads: they tell which roads pass over each other. Slopes change nothing else; everything drives as on
//! the flat.

use std::collections::{BTreeMap, BTreeSet};

use super::crossing::crossings_within;
use super::map::{Lane, RoadMap};

/// Surfaces farther apart than this lie on two levels, m. Ours: the highest body of the engine has 3.2 m, and the
/// lowest bridges over streets leave some 4 m below a deck of half a metre or more.
const LEVEL_M: f64 = 3.5;

/// Crossings nearer than this to the end of a lane are joints, m. Ours.
const JOINED_M: f64 = 3.0;

/// Limits on the search for crossings outside junctions: on the warnings, on the pairs of lanes that are compared, and on the
/// comparisons of segments. A city in which streets end at junctions is far within them.
const CROSSINGS_MAX: usize = 1000;
const PAIRS_MAX: usize = 5_000_000;
const CROSSING_STEPS_MAX: u64 = 50_000_000;

/// Added to distances because of rounding, m.
const SLACK_M: f64 = 1e-3;

/// Distance of two stations at which a lane's height is taken, m. In between it is linear: where a road goes from
/// level to a slope of 10 % within 100 m, that is 3 mm wrong.
const STEP_M: f64 = 5.0;

/// Whether two bodies or lanes at one place of the plane, with these heights (m), pass over each other.
pub fn is_apart(a_m: f64, b_m: f64) -> bool {
    (a_m - b_m).abs() > LEVEL_M
}

/// Heights along a path: station and height, m, by rising station. Without any, the height is 0 everywhere.
#[derive(Debug, Clone, Default)]
pub struct Heights(Vec<(f64, f64)>);

impl Heights {
    /// Takes the heights of a path of some length.
    pub(super) fn sampled(length_m: f64, height_m: impl Fn(f64) -> f64) -> Heights {
        let steps = (length_m / STEP_M).ceil().max(1.0);
        let at = |step: u32| length_m * f64::from(step) / steps;
        Heights::of((0..=steps as u32).map(|step| (at(step), height_m(at(step)))))
    }

    /// Most roads are level: one height says all of them. Everything that drives asks for its own in every tick.
    fn of(all: impl Iterator<Item = (f64, f64)>) -> Heights {
        let mut all: Vec<(f64, f64)> = all.collect();
        if all.iter().all(|(_, height_m)| *height_m == all[0].1) {
            all.truncate(1);
        }
        Heights(all)
    }

    /// The heights along lanes that follow each other, each with the station at which it begins.
    pub fn chained<'a>(lanes: impl Iterator<Item = (f64, &'a Lane)>) -> Heights {
        let of_lane = |(from_m, lane): (f64, &'a Lane)| {
            let heights = &lane.heights.0;
            // A level lane is level up to its end.
            let level = match heights[..] {
                [(_, level_m)] => Some((lane.centre.length_m(), level_m)),
                _ => None,
            };
            let all = heights.iter().copied().chain(level);
            all.map(move |(station_m, height_m)| (from_m + station_m, height_m))
        };
        Heights::of(lanes.flat_map(of_lane))
    }

    /// Height at a station, clamped to the ends, m.
    pub fn at(&self, station_m: f64) -> f64 {
        if let [(_, level_m)] = self.0[..] {
            return level_m;
        }
        let after = self.0.partition_point(|(at_m, _)| *at_m <= station_m);
        match (self.0.get(after.wrapping_sub(1)), self.0.get(after)) {
            (Some((from_m, from)), Some((to_m, to))) => {
                from + (to - from) * (station_m - from_m) / (to_m - from_m)
            }
            (Some((_, height_m)), None) | (None, Some((_, height_m))) => *height_m,
            (None, None) => 0.0,
        }
    }
}

impl Lane {
    /// Height of its road at a station, m.
    pub fn height_at(&self, station_m: f64) -> f64 {
        self.heights.at(station_m)
    }

    /// Whether this lane passes over or under another one: the heights at a station of each are on two levels.
    pub fn is_apart_at(&self, station_m: f64, other: &Lane, other_station_m: f64) -> bool {
        is_apart(self.height_at(station_m), other.height_at(other_station_m))
    }
}

impl RoadMap {
    /// Whether roads may pass over each other: the heights of all lanes are not of one level.
    pub(super) fn find_levels(&self) -> bool {
        let heights_m =
            || self.lanes.iter().flat_map(|lane| lane.heights.0.iter().map(|(_, height_m)| *height_m));
        let (lowest_m, highest_m) =
            (heights_m().fold(f64::INFINITY, f64::min), heights_m().fold(f64::NEG_INFINITY, f64::max));
        is_apart(lowest_m, highest_m)
    }

    /// A warning for each two roads that cross on one level and outside junctions: no vehicle gives way there, because
    /// only junctions say which one must. It is asked for where a map is looked at, not where it is driven.
    pub fn crossings_without_junction(&self) -> Vec<String> {
        let road_of = self.road_numbers();
        let street_of = |lane: usize| self.lanes[lane].junction.is_none().then(|| road_of[lane]);
        let (pairs, mut is_whole) = self.grid.sharing_cells(PAIRS_MAX, street_of);
        let mut steps = CROSSING_STEPS_MAX;
        let mut known: BTreeSet<[usize; 2]> = BTreeSet::new();
        let mut warnings = Vec::new();
        for (first, second) in pairs {
            let (a, b) = (&self.lanes[first], &self.lanes[second]);
            let roads = [road_of[first], road_of[second]];
            if known.contains(&roads) || !a.centre.bounds().grown(SLACK_M).meets(&b.centre.bounds()) {
                continue;
            }
            // Where roads are joined, their lanes may overlap a little.
            let is_inside =
                |lane: &Lane, at_m: f64| (JOINED_M..lane.centre.length_m() - JOINED_M).contains(&at_m);
            let crosses = crossings_within(&a.centre, &b.centre, &mut steps)
                .into_iter()
                .find(|(a_m, b_m)| is_inside(a, *a_m) && is_inside(b, *b_m) && !a.is_apart_at(*a_m, b, *b_m));
            if steps == 0 || (crosses.is_some() && warnings.len() == CROSSINGS_MAX) {
                is_whole = false;
                break;
            }
            let Some((at_m, _)) = crosses else { continue };
            known.insert(roads);
            let at = a.centre.position_at(at_m);
            warnings.push(format!(
                "roads `{}` and `{}` cross at {:.1}, {:.1} on one level without a junction: nobody gives way \
                 there; make it a junction, or give one of them its height",
                a.key.road, b.key.road, at.x, at.y
            ));
        }
        if !is_whole {
            warnings.push(
                "so many roads lie over each other that not all were compared: more may cross without a junction"
                    .to_owned(),
            );
        }
        warnings
    }

    /// For each lane the number of its road. Roads are numbered in the order of their first lanes.
    fn road_numbers(&self) -> Vec<usize> {
        let mut numbers: BTreeMap<&str, usize> = BTreeMap::new();
        let number = |road| {
            let next = numbers.len();
            *numbers.entry(road).or_insert(next)
        };
        self.lanes.iter().map(|lane| lane.key.road.as_str()).map(number).collect()
    }
}
