//! `avastra road`: a map in words, as JSON or as a picture, and a route through it.
//!
//! Reads OpenDRIVE files and the roads that a space declares. JSON is for comparing maps with other readers: it
//! holds every lane with its links and its centre at every metre.

use std::path::Path;
use std::sync::Arc;

use serde_json::{Value, json};

use avastra_base::outside::{Shown, in_line};
use avastra_exchange::report::draw;
use avastra_road::{Lane, LaneIndex, LaneKey, LanePlace, Neighbour, RoadMap, Route, Side, SignKind};

use super::arguments::RoadArguments;
use super::error::Failure;
use super::files::write_named;
use super::load;
use super::output::{Output, plural};

/// Distance between two printed poses of a lane, m.
const SPACING_M: f64 = 1.0;

/// Prints a map and, if asked for, a route.
pub fn road(output: &Output, arguments: &RoadArguments) -> Result<(), Failure> {
    let (map, route) = read(output, arguments)?;
    let crossings = map.crossings_without_junction();
    let warnings: Vec<String> = map.warnings.iter().cloned().chain(crossings).collect();
    let picture = arguments.svg.as_ref().map(|path| (path, draw(&map, route.as_ref())));
    match &picture {
        Some((path, svg)) if path.as_path() == Path::new("-") => output.document(svg.trim_end()),
        Some((path, svg)) => {
            write_named(path, svg)?;
            output.say(words(&map, route.as_ref(), &warnings).trim_end());
        }
        None => output.say(words(&map, route.as_ref(), &warnings).trim_end()),
    }
    if !output.is_json() {
        return Ok(());
    }
    let on_stdout = picture.filter(|(path, _)| path.as_path() == Path::new("-"));
    let lanes = (0..map.lanes.len()).map(|index| lane_json(&map, LaneIndex(index)));
    let junctions = (0..map.junctions.len()).map(|index| junction_json(&map, index));
    let signals = (0..map.signals.len()).map(|index| signal_json(&map, index));
    output.result(json!({
        "file": arguments.file,
        "name": map.name,
        "pose_fields": ["station_m", "s_m", "x_m", "y_m", "heading_rad", "width_m"],
        "lanes": lanes.collect::<Vec<_>>(),
        "junctions": junctions.collect::<Vec<_>>(),
        "signals": signals.collect::<Vec<_>>(),
        "crosswalks": map.crosswalks.iter().map(|crosswalk| json!({
            "id": crosswalk.id,
            "outline_m": crosswalk.outline.iter().map(|corner| [corner.x, corner.y]).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
        "route": route.as_ref().map(|route| route_json(&map, route)),
        "warnings": warnings,
        "svg": on_stdout.map(|(_, svg)| svg),
    }));
    Ok(())
}

/// The map, and the route between the places given or that of the space's road.
fn read(output: &Output, arguments: &RoadArguments) -> Result<(Arc<RoadMap>, Option<Route>), Failure> {
    let path = &arguments.file;
    let (map, route) = if load::is_source(path) {
        let loaded = load::load(output, path)?;
        let roads = loaded.space.as_ref().map_or(&[][..], |space| &space.roads);
        let named = |name: &String| roads.iter().find(|road| road.name == *name);
        let road = arguments.road.as_ref().map_or(roads.first(), named).ok_or_else(|| {
            let names: Vec<_> = roads.iter().map(|road| format!("`{}`", road.name)).collect();
            let (path, names) = (path.shown(), names.join(", "));
            Failure::usage(if names.is_empty() {
                format!("`{path}` declares no road")
            } else {
                format!("no such road in `{path}`; there are {names}")
            })
        })?;
        (Arc::clone(&road.map), Some(road.route.clone()))
    } else {
        if arguments.road.is_some() {
            return Err(Failure::usage("`--road` names a road of a space; this file is a map"));
        }
        let text = load::text(path)?;
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let map = RoadMap::from_opendrive(&stem, &text);
        (Arc::new(map.map_err(|error| Failure::file("read", path, error))?), None)
    };
    let (Some(from), Some(to)) = (&arguments.from, &arguments.to) else { return Ok((map, route)) };
    let route = Route::find(&map, place(&map, from)?, place(&map, to)?).map_err(Failure::usage)?;
    Ok((map, Some(route)))
}

/// A place written as `ROAD/LANE@S`.
fn place(map: &RoadMap, text: &str) -> Result<LanePlace, Failure> {
    let parts = text.rsplit_once('@').and_then(|(lane, s_m)| {
        let (road, lane) = lane.rsplit_once('/')?;
        Some((road, lane.parse().ok()?, s_m.parse::<f64>().ok().filter(|s_m| s_m.is_finite())?))
    });
    let (road, lane, s_m) = parts.ok_or_else(|| {
        Failure::usage(format!("`{text}` is no place; write ROAD/LANE@S, for example `1/-1@12.5`"))
    })?;
    map.place(road, lane, s_m).map_err(Failure::usage)
}

/// `warnings` say what is odd about the map.
fn words(map: &RoadMap, route: Option<&Route>, warnings: &[String]) -> String {
    let roads: std::collections::BTreeSet<&str> =
        map.lanes.iter().map(|lane| lane.key.road.as_str()).collect();
    let length_m: f64 = map.lanes.iter().map(|lane| lane.centre.length_m()).sum();
    let mut lines = vec![format!(
        "map `{}`: {} with {} of {length_m:.1} m in all, {}, {}, {}",
        in_line(&map.name),
        plural(roads.len(), "road"),
        plural(map.lanes.len(), "driving lane"),
        plural(map.junctions.len(), "junction"),
        plural(map.signals.len(), "signal"),
        plural(map.crosswalks.len(), "crosswalk"),
    )];
    lines.extend((0..map.lanes.len()).map(|index| lane_words(map, LaneIndex(index))));
    for (index, junction) in map.junctions.iter().enumerate() {
        let ways = map.connections(index);
        let ways: Vec<String> =
            ways.iter().map(|way| format!("{} to {}", name(map, way.from), name(map, way.to))).collect();
        let title = in_line(if junction.name.is_empty() { &junction.id } else { &junction.name });
        let groups = plural(junction.groups, "signal group");
        lines.push(format!("junction `{title}`: {groups}; {}", listed(&ways)));
    }
    for (index, lane) in map.lanes.iter().enumerate() {
        lines.extend(lane.sign_lines.iter().map(|line| {
            let what = if line.kind == SignKind::Stop { "stop sign" } else { "yield sign" };
            format!("{what} at {:.1} m of {}", line.station_m, name(map, LaneIndex(index)))
        }));
    }
    for signal in &map.signals {
        let (x, y) = (signal.position.x, signal.position.y);
        lines.push(format!(
            "signal `{}` at {x:.1}, {y:.1}: group {}; stops {}",
            in_line(&signal.id),
            signal.group,
            listed(&names(map, &signal.lanes))
        ));
    }
    lines.extend(route.map(|route| route_words(map, route)));
    lines.extend(warnings.iter().map(|warning| format!("warning: {}", in_line(warning))));
    lines.join("\n")
}

fn lane_words(map: &RoadMap, index: LaneIndex) -> String {
    let lane = map.lane(index);
    let narrowest_m = lane.widths_m.iter().copied().fold(f64::INFINITY, f64::min);
    let widest_m = lane.widths_m.iter().copied().fold(0.0, f64::max);
    let width = if widest_m - narrowest_m < 0.05 {
        format!("{widest_m:.1} m wide")
    } else {
        format!("{narrowest_m:.1} to {widest_m:.1} m wide")
    };
    let mut parts = vec![
        format!("{:.1} m long", lane.centre.length_m()),
        width,
        format!("{:.0} km/h", lane.speed_limit_mps * 3.6),
        format!("leads to {}", listed(&names(map, &lane.successors))),
    ];
    if lane.for_buses {
        parts.push("for buses".to_owned());
    }
    for (side, title) in [(Side::Left, "left"), (Side::Right, "right")] {
        let Some(Neighbour { lane: beside, same_direction, gap_m }) = lane.neighbour(side) else { continue };
        let way = if same_direction { "same way" } else { "oncoming" };
        let gap = if gap_m > 0.0 { format!(", {gap_m:.1} m between") } else { String::new() };
        let changes: Vec<String> = lane
            .changes_m(side)
            .iter()
            .map(|(from_m, to_m)| format!(", change from {from_m:.0} to {to_m:.0} m"))
            .collect();
        parts.push(format!("{title} {} ({way}{gap}{})", name(map, beside), changes.concat()));
    }
    format!("lane {}: {}", name(map, index), parts.join(", "))
}

fn route_words(map: &RoadMap, route: &Route) -> String {
    let lanes: Vec<LaneIndex> = route.lanes.iter().map(|part| part.lane).collect();
    let stops: Vec<String> = route.stop_lines.iter().map(|line| format!("{:.1} m", line.station_m)).collect();
    let crosswalks: Vec<String> =
        route.crosswalks_m.iter().map(|(from_m, to_m)| format!("{from_m:.1} to {to_m:.1} m")).collect();
    let mut lines = vec![
        format!("route: {:.1} m to the goal, along {}", route.goal_m, names(map, &lanes).join(", ")),
        format!("  stop lines at {}; crosswalks from {}", listed(&stops), listed(&crosswalks)),
        format!("  {}", plural(route.conflicts.len(), "conflict")),
    ];
    lines.extend(route.slowest(map).map(|part| {
        let limit_kmh = map.lane(part.lane).speed_limit_mps * 3.6;
        let (lane, from_m, to_m) = (name(map, part.lane), part.enter_m.max(0.0), part.to_m);
        format!(
            "  road.limit is {limit_kmh:.0} km/h: lane {lane} from {from_m:.1} to {to_m:.1} m; more elsewhere"
        )
    }));
    lines.extend(route.sign_lines.iter().map(|line| {
        let does = if line.kind == SignKind::Stop { "stops" } else { "gives way" };
        format!("  {does} at a sign at {:.1} m", line.station_m)
    }));
    lines.extend(route.changes.iter().map(|change| {
        let side = if change.lateral_m > 0.0 { "left" } else { "right" };
        format!(
            "  lane change by {:.1} m to the {side}, from {:.1} to {:.1} m, at the latest done at {:.1} m",
            change.lateral_m.abs(),
            change.begin_m,
            change.end_m,
            change.latest_m
        )
    }));
    lines.join("\n")
}

fn lane_json(map: &RoadMap, index: LaneIndex) -> Value {
    let lane = map.lane(index);
    let beside = |side| {
        lane.neighbour(side).map(|neighbour| {
            json!({
                "lane": key(map, neighbour.lane),
                "same_direction": neighbour.same_direction,
                "gap_m": neighbour.gap_m,
                "changes_m": lane.changes_m(side),
            })
        })
    };
    json!({
        "key": key(map, index),
        "length_m": lane.centre.length_m(),
        "speed_limit_mps": lane.speed_limit_mps,
        "junction": lane.junction.map(|junction| &map.junctions[junction].id),
        "predecessors": keys(map, &lane.predecessors),
        "successors": keys(map, &lane.successors),
        "left": beside(Side::Left),
        "right": beside(Side::Right),
        "stop_lines": lane.stop_lines.iter().map(|line| stop_line_json(map, line.station_m, line.signal)).collect::<Vec<_>>(),
        "sign_lines": lane.sign_lines.iter().map(|line| sign_line_json(line.station_m, line.kind)).collect::<Vec<_>>(),
        "poses": poses(lane),
    })
}

/// See `pose_fields` of the result.
fn poses(lane: &Lane) -> Vec<[f64; 6]> {
    let steps = (lane.centre.length_m() / SPACING_M).floor() as u32;
    let stations_m = (0..=steps).map(|i| f64::from(i) * SPACING_M).chain([lane.centre.length_m()]);
    let pose = |station_m: f64| {
        let pose = lane.centre.pose_at(station_m);
        let (x_m, y_m) = (pose.position.x, pose.position.y);
        let s_m = lane.road_station_m(station_m);
        [station_m, s_m, x_m, y_m, pose.heading_rad, lane.width_at(station_m)]
    };
    stations_m.map(pose).collect()
}

fn junction_json(map: &RoadMap, index: usize) -> Value {
    let junction = &map.junctions[index];
    let ways = map.connections(index).into_iter();
    let connections = ways.map(
        |way| json!({ "from": key(map, way.from), "lanes": keys(map, &way.lanes), "to": key(map, way.to) }),
    );
    json!({
        "id": junction.id,
        "name": junction.name,
        "groups": junction.groups,
        "connections": connections.collect::<Vec<_>>(),
    })
}

fn signal_json(map: &RoadMap, index: usize) -> Value {
    let signal = &map.signals[index];
    json!({
        "id": signal.id,
        "x_m": signal.position.x,
        "y_m": signal.position.y,
        "junction": signal.junction.map(|junction| &map.junctions[junction].id),
        "group": signal.group,
        "for_vehicles": signal.for_vehicles,
        "lanes": keys(map, &signal.lanes),
    })
}

/// `signal` is an index.
fn stop_line_json(map: &RoadMap, station_m: f64, signal: usize) -> Value {
    json!({ "station_m": station_m, "signal": map.signals[signal].id })
}

fn route_json(map: &RoadMap, route: &Route) -> Value {
    json!({
        "goal_m": route.goal_m,
        "length_m": route.path.length_m(),
        "lanes": route.lanes.iter().map(|part| json!({
            "lane": key(map, part.lane),
            "from_m": part.from_m,
            "enter_m": part.enter_m,
            "to_m": part.to_m,
        })).collect::<Vec<_>>(),
        "changes": route.changes,
        "stop_lines": route.stop_lines.iter().map(|line| stop_line_json(map, line.station_m, line.signal)).collect::<Vec<_>>(),
        "sign_lines": route.sign_lines.iter().map(|line| sign_line_json(line.station_m, line.kind)).collect::<Vec<_>>(),
        "crosswalks_m": route.crosswalks_m,
        "conflicts": route.conflicts.iter().map(|conflict| json!({
            "station_m": conflict.station_m,
            "lane": key(map, conflict.lane),
            "lane_station_m": conflict.lane_station_m,
            "angle_rad": conflict.angle_rad,
        })).collect::<Vec<_>>(),
    })
}

fn sign_line_json(station_m: f64, kind: SignKind) -> Value {
    json!({"station_m": station_m, "kind": if kind == SignKind::Stop { "stop" } else { "yield" }})
}

fn key(map: &RoadMap, lane: LaneIndex) -> &LaneKey {
    &map.lane(lane).key
}

fn keys<'a>(map: &'a RoadMap, lanes: &[LaneIndex]) -> Vec<&'a LaneKey> {
    lanes.iter().map(|lane| key(map, *lane)).collect()
}

/// Road and lane, and the lane section from the second on.
fn name(map: &RoadMap, lane: LaneIndex) -> String {
    let key = &map.lane(lane).key;
    let section = if key.section > 0 { format!(" (section {})", key.section) } else { String::new() };
    format!("{}/{}{section}", in_line(&key.road), key.lane)
}

fn names(map: &RoadMap, lanes: &[LaneIndex]) -> Vec<String> {
    lanes.iter().map(|lane| name(map, *lane)).collect()
}

fn listed(items: &[String]) -> String {
    if items.is_empty() { "nothing".to_owned() } else { items.join(", ") }
}
