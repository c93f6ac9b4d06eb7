//! Crossing traffic: a rendezvous with the ego vehicle at a conflict of its route, on a leg whose signal will be
//! green; or a vehicle that stands at the line of a crossing leg.

use avastra_lang::model::vocabulary::{Side, Then, TrafficRule};
use avastra_road::{Conflict, LaneIndex, StopLine};

use crate::behave::npc::change::can_change;
use crate::place::arrival::TIMING_M;
use crate::place::asked::{Asked, commanded};
use crate::scene::lanes::lane_beside;
use crate::scene::way::{Way, in_words, leads_through};
use crate::state::change::{PlannedChange, Towards, When};
use crate::state::driver::Driver;
use crate::state::ego::VehicleParameters;
use crate::state::obstacle::choices;
use crate::state::sensed::SignalColour;
use crate::state::time::DT_S;
use crate::view::around::Around;

/// How far beyond the asked distance a crossing may lie, m.
const CROSSING_M: f64 = 60.0;
/// A vehicle with an arrival before the ego vehicle comes from no farther away than this time, s.
const ARRIVAL_S_MAX: f64 = 120.0;
/// A vehicle that stands at a line stands this far before it, m.
const BEFORE_LINE_M: f64 = 1.0;
/// A stop line within this distance behind a newcomer counts as passed when it appears, m.
const BEYOND_LINE_M: f64 = 30.0;
/// How long a vehicle stands at a stop sign, s, and its braking before it, m/s². Ours, and that of the drivers' model.
const STANDS_S: f64 = 1.0;
const STOPS_MPS2: f64 = 2.0;

pub fn cross_road(asked: &Asked) -> Result<Driver, String> {
    let Asked { around, arrivals, request, .. } = *asked;
    let front_m = VehicleParameters::MKZ.front_m(around.ego_station_m);
    let mut reason = None;
    for conflict in &around.scene.route.conflicts {
        let distance_m = conflict.station_m - front_m;
        let from_right = conflict.angle_rad > 0.0;
        if !(request.distance_m..=request.distance_m + CROSSING_M).contains(&distance_m)
            || from_right != (request.side == Side::Right)
            || request.told.turn().is_some_and(|to| !leads_through(&around.scene.map, conflict.lane, to))
        {
            continue;
        }
        if request.speed_mps == 0.0 {
            match standing(asked, conflict) {
                Ok(driver) => return Ok(driver),
                Err(why) => reason = Some(why),
            }
            continue;
        }
        let arrival_s = match request.told.early_s() {
            None => arrivals.after_s(around, distance_m),
            // Infinite while the ego vehicle stands.
            Some(early_s) => match distance_m / around.ego.speed_mps - early_s {
                arrival_s if (0.0..=ARRIVAL_S_MAX).contains(&arrival_s) => arrival_s,
                _ => {
                    reason =
                        Some("the ego vehicle, at its present speed, is not there at that time".to_owned());
                    continue;
                }
            },
        };
        match rendezvous(asked, conflict, arrival_s) {
            Ok(driver) => return Ok(driver),
            Err(why) => reason = Some(why),
        }
    }
    Err(reason.unwrap_or_else(|| {
        let side = match request.side {
            Side::Left => "left",
            Side::Right => "right",
        };
        let going = request.told.turn().map_or(String::new(), |to| format!(" that leads {}", in_words(to)));
        format!("no crossing leg from the {side}{going} within {CROSSING_M} m")
    }))
}

/// A driver that stands at the line before a junction, or where the junction begins, on a way through a conflict.
fn standing(asked: &Asked, conflict: &Conflict) -> Result<Driver, String> {
    let Asked { around, request, size, id, .. } = *asked;
    if request.told.early_s().is_some() {
        return Err(
            "it stands at its line, so it does not come `early`: leave that out, or give it a speed".into()
        );
    }
    if request.then == Then::Change {
        return Err("it stands at its line, and changes no lane: leave `then: Change` out".into());
    }
    let lanes = lanes_to(around, conflict, BEYOND_LINE_M + request.behind_first_m + size.length_m);
    let mut rng = choices(around.seed, id, 0);
    let way = Way::along(&around.scene.roads, &lanes, &mut rng).ok_or("that lane leads nowhere")?;
    let enters_m = way.lane_begin_m(conflict.lane).expect("the way was made through this lane");
    let before = enters_m - BEYOND_LINE_M..=enters_m;
    let lines = way.stop_lines.iter().map(|line| line.station_m).chain(way.stop_signs_m.iter().copied());
    let line_m = lines.filter(|line_m| before.contains(line_m)).fold(f64::NEG_INFINITY, f64::max);
    let line_m = if line_m.is_finite() { line_m } else { enters_m };
    let station_m = line_m - BEFORE_LINE_M - request.behind_first_m - size.length_m / 2.0;
    if station_m < size.length_m / 2.0 {
        return Err("the crossing road is too short".into());
    }
    Ok(commanded(asked, way, Some(conflict.lane), station_m, Vec::new()))
}

/// The lanes that lead to a conflict, itself the last, at least so long before it.
fn lanes_to(around: &Around, conflict: &Conflict, needed_m: f64) -> Vec<LaneIndex> {
    let map = &around.scene.map;
    let mut lanes = vec![conflict.lane];
    let mut upstream_m = conflict.lane_station_m;
    let on_route = |lane: LaneIndex| around.scene.route.lanes.iter().any(|part| part.lane == lane);
    while upstream_m < needed_m {
        let before = &map.lane(lanes[0]).predecessors;
        let Some(previous) = before.iter().copied().find(|lane| !on_route(*lane)) else { break };
        upstream_m += map.lane(previous).centre.length_m();
        lanes.insert(0, previous);
    }
    lanes
}

/// A driver that reaches a conflict after `arrival_s`, when the ego vehicle does, if nothing is in its way.
fn rendezvous(asked: &Asked, conflict: &Conflict, arrival_s: f64) -> Result<Driver, String> {
    let Asked { around, request, size, id, .. } = *asked;
    let map = &around.scene.map;
    let needed_m = request.speed_mps * arrival_s + request.behind_first_m + size.length_m;
    let lanes = lanes_to(around, conflict, needed_m);
    let mut rng = choices(around.seed, id, 0);
    let way = Way::along(&around.scene.roads, &lanes, &mut rng).ok_or("that lane leads nowhere")?;
    let meeting_m = way.lane_begin_m(conflict.lane).expect("the way was made through this lane")
        + conflict.lane_station_m;
    let front_m = approach_m(asked, &way, meeting_m, arrival_s)?;
    let station_m = front_m - request.behind_first_m - size.length_m / 2.0;
    if station_m < size.length_m / 2.0 {
        return Err("the crossing road is too short".into());
    }
    if request.then == Then::Keep {
        return Ok(commanded(asked, way, Some(conflict.lane), station_m, Vec::new()));
    }
    // It starts beside its way and changes into it on the approach.
    let start = way.path.pose_at(station_m).position;
    let (leg, _) = way.lane_at(station_m);
    if map.lane(leg).junction.is_some() {
        return Err("too near to the junction for a lane change".into());
    }
    let mut reason = "no second lane in the crossing leg";
    let mut found = None;
    for (side, back) in [(Side::Right, Side::Left), (Side::Left, Side::Right)] {
        let Some(beside) = lane_beside(around.scene, leg, side) else { continue };
        let first = Way::along(&around.scene.roads, &[beside], &mut rng).ok_or("that lane leads nowhere")?;
        let station_m = map.lane(beside).centre.project(start).station_m;
        if can_change(around, &first, station_m, back, request) {
            found = Some((first, station_m));
            break;
        }
        reason = "no room to change lanes before the junction";
    }
    let (first, station_m) = found.ok_or(reason)?;
    let change = PlannedChange { when: When::Tick(around.tick), towards: Towards::Way(way) };
    Ok(commanded(asked, first, Some(conflict.lane), station_m, vec![change]))
}

/// Station at which a front has to start to be at the meeting point after `arrival_s`, m. It is found by
/// going back from there at the speed that each bend allows.
///
/// # Errors
/// If the way begins nearer, a signal on it will not be green, or a stop sign leaves no time.
fn approach_m(asked: &Asked, way: &Way, meeting_m: f64, arrival_s: f64) -> Result<f64, String> {
    let Asked { around, request, size, .. } = *asked;
    let mut front_m = meeting_m;
    let mut left_s = arrival_s;
    let mut passed_lines: Vec<(usize, f64)> = Vec::new();
    // Signs and lights at which it stops.
    let minds_signals = !request.has_siren() && !request.ignores().contains(TrafficRule::Signals);
    let signs_m: &[f64] = if minds_signals { &way.stop_signs_m } else { &[] };
    let lines: &[StopLine] = if minds_signals { &way.stop_lines } else { &[] };
    while left_s > 1e-9 {
        // A driver looks from the middle of its vehicle. A vehicle without a set arrival was placed by its front
        // before.
        let from_m = if request.told.early_s().is_some() { front_m - size.length_m / 2.0 } else { front_m };
        let speed_mps = request.speed_mps.min(way.speed_mps_max(from_m)).max(0.1);
        let step_m = TIMING_M.min(speed_mps * left_s);
        front_m -= step_m;
        left_s -= step_m / speed_mps;
        for line in lines {
            if (front_m..front_m + step_m).contains(&line.station_m) {
                passed_lines.push((line.signal, left_s.max(0.0)));
            }
        }
        if signs_m.iter().any(|line_m| (front_m..front_m + step_m).contains(line_m)) {
            left_s -= STANDS_S + speed_mps / 2.0 * (1.0 / STOPS_MPS2 + 1.0 / size.acceleration_mps2_max);
            if left_s < 0.0 {
                return Err("it would have to stop at a sign".into());
            }
        }
        if front_m < size.length_m {
            return Err("the crossing road is too short".into());
        }
    }
    // No vehicle appears just beyond a line at which it would have had to stop.
    let beyond = front_m - BEYOND_LINE_M..front_m;
    if signs_m.iter().any(|line_m| beyond.contains(line_m)) {
        return Err("it would have had to stop at a sign".into());
    }
    let behind = lines.iter().filter(|line| beyond.contains(&line.station_m));
    passed_lines.extend(behind.map(|line| (line.signal, 0.0)));
    let is_green = |(signal, after_s): &(usize, f64)| {
        let tick = around.tick + (after_s / DT_S) as u64;
        around.signals.colour(&around.scene.map, *signal, tick) == SignalColour::Green
    };
    if !passed_lines.iter().all(is_green) {
        return Err("its signal will not be green".into());
    }
    Ok(front_m)
}
