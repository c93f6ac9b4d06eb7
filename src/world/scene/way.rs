//! Ways: the chain of lanes that a vehicle follows, as one path with its stop lines and the speeds
//! that its bends allow. Made once and shared; a world's snapshot copies none of it.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use avastra_base::geometry::{Bounds, Chord, Path, Pose, Vec2};
use avastra_base::rng;
use avastra_base::rng::Rng;
use avastra_lang::model::vocabulary::Turning;
use avastra_road::{Heights, Lane, LaneIndex, RoadMap, SignKind, StopLine, Turn};

use super::junction::{Area, ConflictAreas};
use avastra_lang::model::body::BodyParameters;

/// Objects farther away than this are not sensed at all, m. It is the clear-day range for cars of the LiDAR and the
/// camera that driving systems are given. Beyond the end of a way it is asked that far whether other lanes go on there.
pub const RANGE_M: f64 = 120.0;

/// Lateral acceleration that other drivers accept in a bend, m/s²: upper end of comfort.
const LATERAL_MPS2: f64 = 3.0;

/// Deceleration with which other drivers slow down for a bend, m/s².
const BEND_BRAKING_MPS2: f64 = 2.0;

/// A way reaches at least this far beyond the lanes it was asked for, if the road does, m.
const REACH_M: f64 = 400.0;

/// A way that is prolonged keeps at least so much behind a vehicle, m. It is more than the longest body has behind its
/// centre, so that no rear axle leaves its bend.
const BEHIND_M: f64 = 15.0;

/// Step and room of the search for lanes beyond the end of a way, m. A way that goes on beside a lane is not free.
/// Ours.
const BEYOND_STEP_M: f64 = 6.0;
const BEYOND_ROOM_M: f64 = 4.5;

/// Number of ways that are kept for a map; each takes some 40 kB.
const WAYS_MAX: usize = 256;

/// A map, where its lanes are in each other's way, and the ways on it that were asked for.
#[derive(Debug)]
pub(crate) struct Roads {
    pub map: Arc<RoadMap>,
    pub areas: ConflictAreas,
    ways: Ways,
}

impl Roads {
    pub fn new(map: Arc<RoadMap>) -> Roads {
        Roads { areas: ConflictAreas::new(&map), ways: Ways::default(), map }
    }
}

/// A chain of lanes as a vehicle follows it.
#[derive(Debug, Clone)]
pub(crate) struct Way {
    pub path: Path,
    lanes: Vec<WayLane>,
    heights: Heights,
    /// Tells quickly of most lanes that they are not on the way.
    pub lane_set: LaneSet,
    /// By rising station.
    pub stop_lines: Vec<StopLine>,
    /// Lines of stop signs, by rising station, m.
    pub stop_signs_m: Vec<f64>,
    /// Where others may cross or join, by rising station on the way.
    pub areas: Vec<Area>,
    /// Highest speed at each vertex of `path`, m/s.
    speeds_mps_max: Vec<f64>,
    /// Whether lanes go on where it ends.
    open: bool,
    /// Where a vehicle that does not turn off must stop, m. A closed way goes on straight beyond its end, as a road
    /// does beyond the edge of a map, but not into other lanes.
    pub end_m: Option<f64>,
}

/// Some lanes: one bit for each, its index modulo 64.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LaneSet(u64);

impl LaneSet {
    pub fn with(self, lane: LaneIndex) -> LaneSet {
        LaneSet(self.0 | 1 << (lane.0 % 64))
    }

    /// Whether a lane may be in both: `false` is certain.
    pub fn may_meet(self, other: LaneSet) -> bool {
        self.0 & other.0 != 0
    }
}

/// Lanes that begin farther ahead than this do not matter yet, m.
const AHEAD_M: f64 = 150.0;

#[derive(Debug, Clone, Copy)]
struct WayLane {
    lane: LaneIndex,
    from_m: f64,
}

impl Way {
    /// The way through `lanes`, which must follow each other, and on along successors drawn from
    /// `rng`. `None` without lanes.
    pub fn along(roads: &Roads, lanes: &[LaneIndex], rng: &mut Rng) -> Option<Arc<Way>> {
        Way::turning(roads, lanes, None, rng).map(|(way, _)| way)
    }

    /// As [`Way::along`], but turns as asked at the first junction after `lanes`. Also returns the lane in which it
    /// turns there, if the last of `lanes` leads there.
    pub fn turning(
        roads: &Roads,
        lanes: &[LaneIndex],
        to: Option<Turning>,
        rng: &mut Rng,
    ) -> Option<(Arc<Way>, Option<LaneIndex>)> {
        let map = &roads.map;
        let mut chain = lanes.to_vec();
        let mut last = *lanes.last()?;
        let (mut to, mut turns_in) = (to, None);
        let mut beyond_m = 0.0;
        while beyond_m < REACH_M {
            let all = &map.lane(last).successors;
            let wanted = to.filter(|to| turns(map, last, *to).next().is_some());
            let may = |next: &&LaneIndex| match wanted {
                Some(to) => turns(map, last, to).any(|turn| turn == **next),
                None => is_open(map, last, **next),
            };
            let count = all.iter().filter(may).count();
            let next = match (all.len(), count) {
                (0, _) => break,
                (all_of_them, 0) => all.get(rng::below(rng, all_of_them as u32) as usize),
                _ => all.iter().filter(may).nth(rng::below(rng, count as u32) as usize),
            };
            let next = *next.expect("one was counted");
            if enters_junction(map, last, next) {
                turns_in = turns_in.or(wanted.map(|_| next));
                to = None;
            }
            last = next;
            beyond_m += map.lane(last).centre.length_m();
            chain.push(last);
        }
        Some((roads.ways.through(roads, chain)?, turns_in))
    }

    fn through(roads: &Roads, chain: &[LaneIndex]) -> Option<Way> {
        let map = &roads.map;
        let path = Path::join(chain.iter().map(|lane| &map.lane(*lane).centre))?;
        let mut lanes: Vec<WayLane> = Vec::new();
        let mut stop_lines = Vec::new();
        let mut stop_signs_m = Vec::new();
        let mut areas = Vec::new();
        let mut end: Option<(f64, Vec2)> = None;
        for index in chain {
            let lane = map.lane(*index);
            let centre = &lane.centre;
            // Where lanes do not quite meet, the path bridges them.
            let from_m = end.map_or(0.0, |(to_m, tip)| to_m + (centre.points()[0].position - tip).norm());
            lanes.push(WayLane { lane: *index, from_m });
            let lines = lane.stop_lines.iter();
            stop_lines.extend(lines.map(|line| StopLine { station_m: from_m + line.station_m, ..*line }));
            let stops = lane.sign_lines.iter().filter(|line| line.kind == SignKind::Stop);
            stop_signs_m.extend(stops.map(|line| from_m + line.station_m));
            let on_lane = roads.areas.of(*index).iter();
            areas.extend(on_lane.map(|area| Area {
                from_m: from_m + area.from_m,
                to_m: from_m + area.to_m,
                ..*area
            }));
            let tip = centre.points()[centre.points().len() - 1].position;
            end = Some((from_m + centre.length_m(), tip));
        }
        let open = chain.last().is_some_and(|last| !map.lane(*last).successors.is_empty());
        let speeds_mps_max = bend_speeds_mps(&path);
        let end_m = if open { None } else { free_end_m(map, &path) };
        let lane_set = lanes.iter().fold(LaneSet::default(), |set, part| set.with(part.lane));
        areas.sort_by(|a, b| a.from_m.total_cmp(&b.from_m).then(a.other.cmp(&b.other)));
        let heights = Heights::chained(lanes.iter().map(|part| (part.from_m, map.lane(part.lane))));
        Some(Way {
            path,
            lanes,
            heights,
            lane_set,
            stop_lines,
            stop_signs_m,
            areas,
            speeds_mps_max,
            open,
            end_m,
        })
    }

    /// Height of the road at a station, m.
    pub fn height_at(&self, station_m: f64) -> f64 {
        self.heights.at(station_m)
    }

    /// The lane at a station, clamped to the ends, and the station on it.
    pub fn lane_at(&self, station_m: f64) -> (LaneIndex, f64) {
        let after = self.lanes.partition_point(|lane| lane.from_m <= station_m).max(1);
        let found = self.lanes[after - 1];
        (found.lane, station_m - found.from_m)
    }

    /// The lanes from a station on, each with the station on it from which the way goes on.
    pub fn lanes_from(&self, station_m: f64) -> impl Iterator<Item = (LaneIndex, f64)> {
        let first = self.lanes.partition_point(|lane| lane.from_m <= station_m).max(1) - 1;
        self.lanes[first..].iter().map(move |part| (part.lane, (station_m - part.from_m).max(0.0)))
    }

    /// Station at which a lane begins, if the way takes it.
    pub fn lane_begin_m(&self, lane: LaneIndex) -> Option<f64> {
        self.lanes.iter().find(|part| part.lane == lane).map(|part| part.from_m)
    }

    /// Whether the way may take a lane: `false` is certain.
    pub fn may_take(&self, lane: LaneIndex) -> bool {
        self.lane_set.may_meet(LaneSet::default().with(lane))
    }

    /// Station at which a lane begins, if the way takes it and a rear at `rear_m` has not left it yet.
    pub fn lane_ahead_m(&self, lane: LaneIndex, rear_m: f64) -> Option<f64> {
        if !self.may_take(lane) {
            return None;
        }
        let first = self.lanes.partition_point(|part| part.from_m <= rear_m).max(1) - 1;
        let mut ahead = self.lanes[first..].iter().take_while(|part| part.from_m < rear_m + AHEAD_M);
        ahead.find(|part| part.lane == lane).map(|part| part.from_m)
    }

    /// Highest speed at a station: what the bend there and the bends ahead allow, m/s.
    pub fn speed_mps_max(&self, station_m: f64) -> f64 {
        self.speeds_mps_max[self.path.vertex_after(station_m)]
    }

    /// Speed limit of the lane at a station, m/s.
    pub fn limit_mps(&self, map: &RoadMap, station_m: f64) -> f64 {
        map.lane(self.lane_at(station_m).0).speed_limit_mps
    }

    /// The lane in which it goes there at the first junction that begins beyond a front.
    pub fn next_turn(&self, map: &RoadMap, front_m: f64, to: Turning) -> Option<LaneIndex> {
        let (_, after) = self.next_junction(map, front_m)?;
        leads_through(map, after.lane, to).then_some(after.lane)
    }

    /// Whether the last lane before that junction leads there, and a vehicle of this speed can slow down enough for the
    /// bend. It must brake as gently as drivers do before bends.
    ///
    /// # Errors
    /// That it does not, in words.
    pub fn can_turn(&self, map: &RoadMap, front_m: f64, speed_mps: f64, to: Turning) -> Result<(), String> {
        let (before, after) = self.next_junction(map, front_m).ok_or("no junction lies near ahead of it")?;
        let way_m = after.from_m - front_m;
        let is_slow_enough = |lane: LaneIndex| {
            let sharpest = map.lane(lane).centre.points().iter().map(|point| point.curvature_per_m.abs());
            let bend_mps2 = LATERAL_MPS2 / sharpest.fold(1e-4, f64::max);
            speed_mps * speed_mps <= bend_mps2 + 2.0 * BEND_BRAKING_MPS2 * way_m
        };
        let mut lanes = turns(map, before.lane, to).peekable();
        if lanes.peek().is_none() {
            return Err(format!("its lane does not lead {} at the next junction", in_words(to)));
        }
        if lanes.any(is_slow_enough) { Ok(()) } else { Err("it is too fast to turn there".to_owned()) }
    }

    /// The lanes before and after the edge of the first junction that begins beyond a front.
    fn next_junction(&self, map: &RoadMap, front_m: f64) -> Option<(WayLane, WayLane)> {
        let ahead = self.lanes.partition_point(|part| part.from_m <= front_m).max(1) - 1;
        let mut pairs = self.lanes[ahead..].windows(2).map(|pair| (pair[0], pair[1]));
        pairs.find(|(before, after)| enters_junction(map, before.lane, after.lane))
    }

    /// Whether so little is left from a station that the way should be prolonged.
    pub fn ends_soon(&self, station_m: f64) -> bool {
        self.open && self.path.length_m() - station_m < REACH_M / 2.0
    }

    /// A longer way that begins with the lane [`BEHIND_M`] behind `station_m`, and that station on the new way.
    pub fn prolonged(&self, roads: &Roads, station_m: f64, rng: &mut Rng) -> Option<(Arc<Way>, f64)> {
        let first = self.first_kept(station_m);
        let rest: Vec<LaneIndex> = self.lanes[first..].iter().map(|part| part.lane).collect();
        Some((Way::along(roads, &rest, rng)?, station_m - self.lanes[first].from_m))
    }

    /// As [`Way::prolonged`], but laid anew from the first junction beyond a front on, where it turns as asked. Also
    /// returns the lane in which it does.
    pub fn turned(
        &self,
        roads: &Roads,
        (station_m, front_m): (f64, f64),
        to: Turning,
        rng: &mut Rng,
    ) -> Option<(Arc<Way>, f64, Option<LaneIndex>)> {
        let first = self.first_kept(station_m);
        let (_, edge) = self.next_junction(&roads.map, front_m)?;
        let kept = self.lanes[first..].iter().take_while(|part| part.from_m < edge.from_m);
        let kept: Vec<LaneIndex> = kept.map(|part| part.lane).collect();
        let (way, lane) = Way::turning(roads, &kept, Some(to), rng)?;
        Some((way, station_m - self.lanes[first].from_m, lane))
    }

    /// The index of the lane [`BEHIND_M`] behind a station.
    fn first_kept(&self, station_m: f64) -> usize {
        self.lanes.partition_point(|part| part.from_m <= station_m - BEHIND_M).max(1) - 1
    }
}

/// Whether a vehicle may go on from one lane to the next: no vehicle turns into a bus lane, unless nothing else is
/// left.
fn is_open(map: &RoadMap, from: LaneIndex, next: LaneIndex) -> bool {
    map.lane(from).for_buses || !map.lane(next).for_buses
}

/// Whether a lane leads there through a junction.
pub(crate) fn leads_through(map: &RoadMap, lane: LaneIndex, to: Turning) -> bool {
    let lane = map.lane(lane);
    let turn = match to {
        Turning::Left => Turn::Left,
        Turning::Straight => Turn::Straight,
        Turning::Right => Turn::Right,
    };
    lane.junction.is_some() && lane.turn == turn
}

fn enters_junction(map: &RoadMap, from: LaneIndex, next: LaneIndex) -> bool {
    map.lane(next).junction.is_some() && map.lane(next).junction != map.lane(from).junction
}

/// The lanes of a junction that follow a lane before it and lead there.
fn turns(map: &RoadMap, from: LaneIndex, to: Turning) -> impl Iterator<Item = LaneIndex> {
    let next = map.lane(from).successors.iter().copied();
    let none_is_open = !next.clone().any(|next| is_open(map, from, next));
    next.filter(move |next| {
        enters_junction(map, from, *next)
            && leads_through(map, *next, to)
            && (none_is_open || is_open(map, from, *next))
    })
}

/// The direction of a turn, as in "does not lead to the left".
pub(crate) fn in_words(to: Turning) -> &'static str {
    match to {
        Turning::Left => "to the left",
        Turning::Straight => "straight on",
        Turning::Right => "to the right",
    }
}

/// The pose of the outline's centre of a body that has driven to a station of a way, and its wheelbase. Both axles are
/// on the way.
///
/// The station is that of the rear axle plus the distance from there to the centre, so on a straight way it is the
/// centre's. In a bend the body is a chord of the way. Its middle cuts the bend, and its tail swings out less than if
/// the body turned about its centre. A real rear axle cuts a bend farther; its driver swings out before to stay in the
/// lane, which is not modelled.
pub(crate) fn body_at(path: &Path, station_m: f64, body: &BodyParameters) -> (Pose, Chord) {
    let rear_m = station_m - body.rear_axle_m;
    let wheelbase = path.chord(rear_m, rear_m + body.wheelbase_m);
    let Chord { begin, forward, heading_rad, .. } = wheelbase;
    (Pose { position: begin + forward * body.rear_axle_m, heading_rad }, wheelbase)
}

/// The ways that were asked for on a map so far, by their lanes. Every row asks for its ways at every
/// step, and few of them differ.
#[derive(Debug, Default)]
pub(crate) struct Ways(Mutex<BTreeMap<Vec<LaneIndex>, Arc<Way>>>);

impl Ways {
    fn through(&self, roads: &Roads, chain: Vec<LaneIndex>) -> Option<Arc<Way>> {
        // Even if a thread panicked while it held the lock, the ways in here are whole.
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(way) = known.get(&chain) {
            return Some(Arc::clone(way));
        }
        let way = Arc::new(Way::through(roads, &chain)?);
        if known.len() >= WAYS_MAX {
            known.clear();
        }
        known.insert(chain, Arc::clone(&way));
        Some(way)
    }
}

/// A path is continued straight on beyond its end: this is how far beyond the end it comes too near to a lane, m.
/// `None` if it does not within the sensors' range. The first metres do not count, because lanes side by side end
/// together.
fn free_end_m(map: &RoadMap, path: &Path) -> Option<f64> {
    let beyond = |beyond_m: f64| path.position_at(path.length_m() + beyond_m);
    // Few lanes are near at all. The room is a little larger here, so that rounding leaves none out.
    let straight_on = Bounds::around(&[beyond(0.0), beyond(RANGE_M)]).grown(BEYOND_ROOM_M + 0.01);
    let near: Vec<(&Lane, Bounds)> = map
        .lanes
        .iter()
        .map(|lane| (lane, lane.centre.bounds()))
        .filter(|(_, bounds)| bounds.meets(&straight_on))
        .collect();
    let stations =
        (1..).map(|step| f64::from(step) * BEYOND_STEP_M).take_while(|beyond_m| *beyond_m <= RANGE_M);
    let is_taken = |beyond_m: &f64| {
        let point = beyond(*beyond_m);
        near.iter().any(|(lane, bounds)| {
            bounds.distance_m2_min(point) < BEYOND_ROOM_M * BEYOND_ROOM_M
                && lane.centre.project(point).distance_m < BEYOND_ROOM_M
        })
    };
    let mut taken = stations.filter(is_taken);
    taken.next().map(|beyond_m| {
        path.length_m() + if beyond_m > 2.0 * BEYOND_STEP_M { beyond_m - BEYOND_STEP_M } else { 0.0 }
    })
}

/// The speed of the bend at each vertex, lowered so that braking for the next ones stays gentle.
///
/// `ads::kit::Guide` has a separate pass over even samples of the route, with a driving system's limits. The two are
/// not one function because their vertices lie elsewhere, so results would change.
fn bend_speeds_mps(path: &Path) -> Vec<f64> {
    let points = path.points();
    let mut speeds: Vec<f64> =
        points.iter().map(|p| (LATERAL_MPS2 / p.curvature_per_m.abs().max(1e-4)).sqrt()).collect();
    for i in (0..points.len() - 1).rev() {
        let way_m = points[i + 1].station_m - points[i].station_m;
        let braked_mps = (speeds[i + 1] * speeds[i + 1] + 2.0 * BEND_BRAKING_MPS2 * way_m).sqrt();
        speeds[i] = speeds[i].min(braked_mps);
    }
    speeds
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::testing;

    #[test]
    fn a_way_that_ends_at_the_edge_of_the_map_goes_on_straight() {
        let scene = testing::crossing();
        let way = |road: &str, lane: i32| {
            let lane = scene.map.place(road, lane, 100.0).expect("it is there").lane;
            Way::along(&scene.roads, &[lane], &mut rng::stream(1, rng::Stream::Traffic, 0))
                .expect("it is a lane")
        };
        let out = way("6", -1);
        assert!(!out.open && out.end_m.is_none());
        // The second lane of the crossing street ends before the junction: whoever is in it must stop.
        let bay = way("4", -2);
        let end_m = bay.end_m.expect("lanes lie beyond");
        assert!((end_m - bay.path.length_m()).abs() < 2.0 * BEYOND_STEP_M, "{end_m}");
    }
}
