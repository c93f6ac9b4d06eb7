//! Proposes routes on a map for which the author has chosen none: through junctions, each with something that the
//! others lack.

use std::collections::BTreeSet;

use super::abreast::Connection;
use super::map::{LaneIndex, LanePlace, RoadMap, SignKind, Turn};
use super::route::Route;

/// How far before a junction a route begins, and how far behind it it ends, if the lanes are that long, m.
const BEFORE_M: f64 = 120.0;
const AFTER_M: f64 = 80.0;

/// A way to or from a junction that is shorter shows too little, m.
const LEAST_M: f64 = 15.0;

/// Starts and goals keep this far from the ends of lanes, m.
const EDGE_M: f64 = 1.0;

/// Ways through junctions that are looked at on a large map: evenly many of all.
const WAYS_MAX: usize = 400;

/// A start and a goal with the reason for them.
#[derive(Debug, Clone)]
pub struct Proposal {
    pub start: LanePlace,
    pub goal: LanePlace,
    /// A few words: `left at 12`.
    pub title: String,
    /// The features of the route.
    pub reason: String,
}

/// The features that a route exercises. Routes are chosen for what those before lack.
type Traits = BTreeSet<(&'static str, &'static str)>;

struct Candidate {
    proposal: Proposal,
    traits: Traits,
    conflicts: usize,
}

/// At most `most` routes, the one with the most to meet first; without junctions the longest way straight on.
pub fn propose(map: &RoadMap, most: usize) -> Vec<Proposal> {
    let ways: Vec<(usize, Connection)> = (0..map.junctions.len())
        .flat_map(|junction| map.connections(junction).into_iter().map(move |way| (junction, way)))
        .collect();
    let every = ways.len().div_ceil(WAYS_MAX).max(1);
    let mut candidates: Vec<Candidate> =
        ways.iter().step_by(every).filter_map(|(junction, way)| through(map, *junction, way)).collect();
    let mut met = Traits::new();
    let mut chosen = Vec::new();
    while chosen.len() < most {
        let worth = |candidate: &Candidate| (candidate.traits.difference(&met).count(), candidate.conflicts);
        // The first of equals, so that the order of the map decides.
        let best = (0..candidates.len()).rev().max_by_key(|index| worth(&candidates[*index]));
        let Some(best) = best.filter(|best| worth(&candidates[*best]).0 > 0) else { break };
        let candidate = candidates.remove(best);
        met.extend(candidate.traits);
        chosen.push(candidate.proposal);
    }
    if chosen.is_empty() { straight(map).into_iter().collect() } else { chosen }
}

/// The route that takes a way through a junction.
fn through(map: &RoadMap, junction: usize, way: &Connection) -> Option<Candidate> {
    let at = &map.junctions[junction];
    if at.idle_lights > 0 {
        return None;
    }
    let start = back(map, way.from);
    let goal = on(map, way.to);
    let route = Route::find(map, start, goal).ok()?;
    let passes = |lane: &LaneIndex| route.lanes.iter().any(|part| part.lane == *lane);
    let inside_m: f64 = way.lanes.iter().map(|lane| map.lane(*lane).centre.length_m()).sum();
    if !way.lanes.iter().all(passes) || route.goal_m < inside_m + 2.0 * LEAST_M || route.leap(map).is_some() {
        return None;
    }
    let turn = match map.lane(way.lanes[0]).turn {
        Turn::Straight => "straight on",
        Turn::Left => "left",
        Turn::Right => "right",
        Turn::UTurn => "back",
    };
    let stops = route.sign_lines.iter().any(|line| line.kind == SignKind::Stop);
    let control = match (route.stop_lines.is_empty(), route.sign_lines.is_empty()) {
        (false, _) => "traffic lights",
        (true, false) if stops => "a stop sign",
        (true, false) => "a yield sign",
        (true, true) => "no lights or signs",
    };
    let mut traits = Traits::from([("turn", turn), ("control", control)]);
    let mut parts = vec![format!("{turn} at junction `{}` with {control}", at.id)];
    let mut has = |word: &'static str, count: usize, one: &str, many: &str| {
        if count > 0 {
            traits.insert(("has", word));
            parts.push(format!("{count} {}", if count == 1 { one } else { many }));
        }
    };
    has("conflicts", route.conflicts.len(), "way that crosses or joins it", "ways that cross or join it");
    has("crosswalks", route.crosswalks_m.len(), "crosswalk", "crosswalks");
    has("changes", route.changes.len(), "lane change", "lane changes");
    parts.push(format!("{:.0} m", route.goal_m));
    let proposal = Proposal { start, goal, title: format!("{turn} at {}", at.id), reason: parts.join(", ") };
    Some(Candidate { proposal, traits, conflicts: route.conflicts.len() })
}

/// A place before the end of a lane, in it or in those that lead to it without a junction.
fn back(map: &RoadMap, lane: LaneIndex) -> LanePlace {
    let (lane, left_m) = followed(map, lane, BEFORE_M, |lane| &map.lane(lane).predecessors);
    let length_m = map.lane(lane).centre.length_m();
    LanePlace { lane, station_m: (length_m - left_m).max(EDGE_M.min(length_m / 2.0)), offset_m: 0.0 }
}

/// A place behind the beginning of a lane, in it or in those that it leads to without a junction.
fn on(map: &RoadMap, lane: LaneIndex) -> LanePlace {
    let (lane, left_m) = followed(map, lane, AFTER_M, |lane| &map.lane(lane).successors);
    let length_m = map.lane(lane).centre.length_m();
    LanePlace { lane, station_m: left_m.min((length_m - EDGE_M).max(length_m / 2.0)), offset_m: 0.0 }
}

/// The lane in which a way of `left_m` ends, and what of it is left there: more than the lane is long if nothing follows.
/// No lane is taken twice.
fn followed<'a>(
    map: &RoadMap,
    mut lane: LaneIndex,
    mut left_m: f64,
    next: impl Fn(LaneIndex) -> &'a [LaneIndex],
) -> (LaneIndex, f64) {
    let mut passed = vec![lane];
    loop {
        let length_m = map.lane(lane).centre.length_m();
        let is_open = |next: &LaneIndex| map.lane(*next).junction.is_none() && !passed.contains(next);
        match next(lane).iter().copied().filter(is_open).min() {
            Some(next) if left_m > length_m => {
                left_m -= length_m;
                passed.push(next);
                lane = next;
            }
            _ => return (lane, left_m),
        }
    }
}

/// The longest lane outside junctions, from end to end.
fn straight(map: &RoadMap) -> Option<Proposal> {
    let lanes = (0..map.lanes.len()).map(LaneIndex).filter(|lane| map.lane(*lane).junction.is_none());
    let length_m = |lane: &LaneIndex| map.lane(*lane).centre.length_m();
    let lane = lanes.max_by(|a, b| length_m(a).total_cmp(&length_m(b)).then(b.cmp(a)))?;
    let long_m = length_m(&lane);
    let place = |station_m| LanePlace { lane, station_m, offset_m: 0.0 };
    let (start, goal) = (place(EDGE_M.min(long_m / 4.0)), place((long_m - EDGE_M).max(long_m / 2.0)));
    Route::find(map, start, goal).ok()?;
    let reason = format!("no way through a junction can be driven; this is the longest lane, {long_m:.0} m");
    Some(Proposal { start, goal, title: "straight on".to_owned(), reason })
}
