//! Phases of a junction: groups of lights whose traffic does not cross share a place in its cycle.
//!
//! A file says which lights switch together, and not which may be green at once. CARLA's maps give every light a
//! separate controller. Ways from opposite arms share a phase, as everywhere in towns: who turns across oncoming
//! traffic gives way to it.

use std::collections::{BTreeMap, BTreeSet};

use avastra_base::geometry::wrap_angle;

use super::crossing::crossings;
use super::map::{LaneIndex, RoadMap, StopLine};

/// Two ways whose beginnings differ by more than this come from opposite arms.
const OPPOSITE_RAD_MIN: f64 = 135.0 * core::f64::consts::PI / 180.0;

/// Gives the groups of every junction their phases: each group the first phase in which it crosses no other.
/// A junction in which nothing crosses keeps the groups of its file.
pub fn share_phases(map: &mut RoadMap) {
    // One pass over lanes and signals serves all junctions.
    let mut stopping: Vec<BTreeSet<usize>> = vec![BTreeSet::new(); map.junctions.len()];
    for line in map.lanes.iter().flat_map(|lane| &lane.stop_lines) {
        let signal = &map.signals[line.signal];
        if let Some(junction) = signal.junction {
            stopping[junction].insert(signal.group);
        }
    }
    let mut signals: Vec<Vec<usize>> = vec![Vec::new(); map.junctions.len()];
    for (index, signal) in map.signals.iter().enumerate() {
        if let Some(junction) = signal.junction {
            signals[junction].push(index);
        }
    }
    for (index, groups) in stopping.into_iter().enumerate() {
        if map.junctions[index].groups < 2 {
            continue;
        }
        let ways = ways_by_group(map, index, groups);
        let mut phases: Vec<Vec<LaneIndex>> = Vec::new();
        let mut phase_of = BTreeMap::new();
        for (group, lanes) in &ways {
            let free = phases.iter().position(|phase| !any_conflict(map, phase, lanes));
            let phase = free.unwrap_or(phases.len());
            if free.is_none() {
                phases.push(Vec::new());
            }
            phases[phase].extend(lanes);
            phase_of.insert(*group, phase);
        }
        if phases.len() < 2 {
            // Its lights then stop traffic for something that the map does not hold, such as people on foot.
            continue;
        }
        for signal in &signals[index] {
            let signal = &mut map.signals[*signal];
            // A group that holds no way stops no vehicle, whenever it is red.
            signal.group = phase_of.get(&signal.group).copied().unwrap_or(0);
        }
        map.junctions[index].groups = phases.len();
    }
}

/// The ways through a junction that each group of its lights holds. `groups` are those with a stop line on some lane.
fn ways_by_group(map: &RoadMap, junction: usize, groups: BTreeSet<usize>) -> BTreeMap<usize, Vec<LaneIndex>> {
    let mut ways: BTreeMap<usize, Vec<LaneIndex>> =
        groups.into_iter().map(|group| (group, Vec::new())).collect();
    let here = |line: &StopLine| {
        let signal = &map.signals[line.signal];
        (signal.junction == Some(junction)).then_some(signal.group)
    };
    for lane in &map.junctions[junction].lanes {
        if let Some(group) = map.stop_line_of(*lane).as_ref().and_then(here) {
            ways.entry(group).or_default().push(*lane);
        }
    }
    ways
}

/// Whether a group may not join a phase. Lanes that lead to no way through the junction may lead anywhere.
fn any_conflict(map: &RoadMap, phase: &[LaneIndex], lanes: &[LaneIndex]) -> bool {
    phase.is_empty() || lanes.is_empty() || phase.iter().any(|a| lanes.iter().any(|b| conflict(map, *a, *b)))
}

/// Whether two ways may not be green together: they cross or join, and do not come from opposite arms.
fn conflict(map: &RoadMap, a: LaneIndex, b: LaneIndex) -> bool {
    let (a, b) = (map.lane(a), map.lane(b));
    let begin_rad = a.centre.pose_at(0.0).heading_rad - b.centre.pose_at(0.0).heading_rad;
    if wrap_angle(begin_rad).abs() > OPPOSITE_RAD_MIN {
        return false;
    }
    let share = |of_a: &[LaneIndex], of_b: &[LaneIndex]| of_a.iter().any(|lane| of_b.contains(lane));
    if share(&a.predecessors, &b.predecessors) {
        return false;
    }
    let meet = |(a_m, b_m): &(f64, f64)| !a.is_apart_at(*a_m, b, *b_m);
    share(&a.successors, &b.successors) || crossings(&a.centre, &b.centre).iter().any(meet)
}
