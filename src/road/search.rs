//! The cheapest way through the lane graph, lane changes included.
//!
//! Dijkstra's method over places from which a vehicle may go on: the beginning of a lane, or the end of
//! a lane change into it.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use super::lane_change::{LENGTH_M_MIN, Stretch, comfortable_length_m};
use super::map::{LaneIndex, LanePlace, RoadMap, Side};

/// Cost of a lane change in addition to its length, m of detour. The figure is ours: a driver rather makes a
/// detour of one block than cut through traffic, but no longer one.
const CHANGE_M: f64 = 100.0;

/// Extra cost of a lane change that has only half of its comfortable length, m of detour.
const HURRIED_M: f64 = 200.0;

/// The next move of a way.
#[derive(Debug, Clone)]
pub enum Move {
    /// Drive on into a successor of the lane.
    Follow(LaneIndex),
    /// Change lanes over a length (m) from the beginning of the stretch on which it is permitted.
    Change { stretch: Stretch, length_m: f64 },
}

/// A place from which the search goes on.
struct Label {
    lane: LaneIndex,
    /// First station at which a vehicle can be in the lane, m.
    station_m: f64,
    /// Cost up to the beginning of the lane, mm: whole numbers, because a heap needs a total order.
    cost_mm: i64,
    /// Index of the label before, and how it leads here; `None` for the start.
    came: Option<(usize, Move)>,
}

/// The moves from start to goal; `None` if there is no way.
pub fn cheapest_way(map: &RoadMap, start: LanePlace, goal: LanePlace) -> Option<Vec<Move>> {
    let for_buses = [start.lane, goal.lane].into_iter().any(|lane| map.lane(lane).for_buses);
    let mut search =
        Search { map, for_buses, labels: Vec::new(), open: BinaryHeap::new(), settled: BTreeMap::new() };
    search.push(start.lane, start.station_m, -millimetres(start.station_m), None);
    while let Some(Reverse((_, _, index))) = search.open.pop() {
        let (lane, station_m) = (search.labels[index].lane, search.labels[index].station_m);
        // A more expensive way into a lane is useful only if it comes into the lane at an earlier station.
        if search.settled.get(&lane).is_some_and(|soonest_m| *soonest_m <= station_m) {
            continue;
        }
        search.settled.insert(lane, station_m);
        if lane == goal.lane && station_m <= goal.station_m {
            return Some(search.way_to(index));
        }
        search.follow(index);
        for side in [Side::Left, Side::Right] {
            search.change(index, side);
        }
    }
    None
}

struct Search<'a> {
    map: &'a RoadMap,
    /// Whether the way may lead over bus lanes: it does if it begins or ends on one.
    for_buses: bool,
    labels: Vec<Label>,
    /// The labels to go on from, ordered by cost, station (mm) and index.
    open: BinaryHeap<Reverse<(i64, i64, usize)>>,
    settled: BTreeMap<LaneIndex, f64>,
}

impl Search<'_> {
    fn push(&mut self, lane: LaneIndex, station_m: f64, cost_mm: i64, came: Option<(usize, Move)>) {
        if self.map.lane(lane).for_buses && !self.for_buses {
            return;
        }
        self.open.push(Reverse((cost_mm, millimetres(station_m), self.labels.len())));
        self.labels.push(Label { lane, station_m, cost_mm, came });
    }

    fn follow(&mut self, index: usize) {
        let map = self.map;
        let (lane, cost_mm) = (map.lane(self.labels[index].lane), self.labels[index].cost_mm);
        for next in &lane.successors {
            let cost_mm = cost_mm + millimetres(lane.centre.length_m());
            self.push(*next, 0.0, cost_mm, Some((index, Move::Follow(*next))));
        }
    }

    /// A change begins as early as permitted. A shortened one leaves room for the next change or for the goal.
    fn change(&mut self, index: usize, side: Side) {
        let map = self.map;
        let (lane, station_m) = (self.labels[index].lane, self.labels[index].station_m);
        for stretch in Stretch::from(map, lane, side, station_m) {
            let width_m = stretch.shift_m(map, stretch.place(0.0)).abs();
            let comfortable_m = comfortable_length_m(map.lane(lane).speed_limit_mps, width_m);
            let hurried_m = (comfortable_m / 2.0).max(LENGTH_M_MIN);
            for (length_m, penalty_m) in [(comfortable_m, CHANGE_M), (hurried_m, HURRIED_M)] {
                if length_m > stretch.length_m() {
                    continue;
                }
                let end = stretch.place(length_m);
                let passed_m: f64 = stretch.pairs[..end.pair]
                    .iter()
                    .map(|pair| map.lane(pair.source).centre.length_m())
                    .sum();
                let cost_mm = self.labels[index].cost_mm + millimetres(penalty_m + passed_m);
                let target = stretch.pairs[end.pair].target;
                let station_m = stretch.target_station_m(map, end);
                let change = Move::Change { stretch: stretch.clone(), length_m };
                self.push(target, station_m, cost_mm, Some((index, change)));
            }
        }
    }

    fn way_to(&self, goal: usize) -> Vec<Move> {
        let mut way = Vec::new();
        let mut index = goal;
        while let Some((before, step)) = &self.labels[index].came {
            way.push(step.clone());
            index = *before;
        }
        way.reverse();
        way
    }
}

fn millimetres(length_m: f64) -> i64 {
    (length_m * 1e3) as i64
}
