//! Traffic lights with their groups and stop lines, and crosswalks.

use std::collections::BTreeMap;

use crate::geometry::Pose;
use crate::geometry::Vec2;

use super::graph::Builder;
use super::graph::wrong;
use super::map::Crosswalk;
use super::map::RoadError;
use super::map::Signal;
use super::map::StopLine;
use super::opendrive::Orientation;
use super::opendrive::Outline;
use super::opendrive::RoadElement;
use super::opendrive::SignalElement;

/// Heads of one group nearer than this share a stop line, m.
const SHARED_LINE_M: f64 = 1.0;

/// Adds all lights, with a stop line on each lane they hold for.
pub fn add_signals(builder: &mut Builder) -> Result<(), RoadError> {
    let document = builder.document;
    let groups = groups(builder)?;
    let mut indices = BTreeMap::new();
    for road in &document.roads {
        for signal in road.signals.iter().filter(|signal| !signal.reference) {
            let place = groups.get(signal.id.as_str()).copied();
            if place.is_none() {
                let message =
                    format!("signal `{}` has no controller in any junction; it is its own group", signal.id);
                builder.warn(signal.line, message);
            }
            if indices.insert(signal.id.as_str(), builder.map.signals.len()).is_some() {
                return Err(wrong(signal.line, format!("a second signal has the id `{}`", signal.id)));
            }
            builder.map.signals.push(Signal {
                id: signal.id.clone(),
                position: position(road, signal.s_m, signal.t_m),
                junction: place.map(|(junction, _)| junction),
                group: place.map_or(0, |(_, group)| group),
            });
        }
    }
    for controller in &document.controllers {
        for (signal, line) in &controller.signals {
            if !indices.contains_key(signal.as_str()) {
                let message =
                    format!("controller `{}` switches signal `{signal}`, which is no light", controller.id);
                builder.warn(*line, message);
            }
        }
    }
    for (road_index, road) in document.roads.iter().enumerate() {
        for signal in road.signals.iter().filter(|signal| !signal.pedestrian) {
            // A reference may also point to a sign, which was left out.
            if let Some(index) = indices.get(signal.id.as_str()) {
                add_stop_lines(builder, road_index, signal, *index);
            }
        }
    }
    Ok(())
}

/// Junction and group of each signal that a junction's controller switches.
fn groups<'a>(builder: &Builder<'a>) -> Result<BTreeMap<&'a str, (usize, usize)>, RoadError> {
    let document = builder.document;
    let mut groups = BTreeMap::new();
    for (junction_index, junction) in document.junctions.iter().enumerate() {
        for (group, (id, line)) in junction.controllers.iter().enumerate() {
            let controller =
                document.controllers.iter().find(|controller| controller.id == *id).ok_or_else(|| {
                    wrong(
                        *line,
                        format!("junction `{}` names controller `{id}`, which does not exist", junction.id),
                    )
                })?;
            for (signal, _) in &controller.signals {
                groups.insert(signal.as_str(), (junction_index, group));
            }
        }
    }
    Ok(groups)
}

fn add_stop_lines(builder: &mut Builder, road_index: usize, signal: &SignalElement, index: usize) {
    let road = &builder.document.roads[road_index];
    let section_index = road.section_at(signal.s_m);
    for lane in &road.sections[section_index].lanes {
        let orientation_fits = match signal.orientation {
            Orientation::Along => road.runs_along(lane.id),
            Orientation::Against => !road.runs_along(lane.id),
            Orientation::Both => true,
        };
        let valid = signal.validity.is_empty()
            || signal.validity.iter().any(|(from, to)| (*from..=*to).contains(&lane.id));
        if !orientation_fits || !valid {
            continue;
        }
        let Some(lane_index) = builder.lane_index(road_index, section_index, lane.id) else { continue };
        let station_m = builder.map.lane(lane_index).station_of(signal.s_m);
        let same_light = |other: &StopLine| {
            let (a, b) = (&builder.map.signals[other.signal], &builder.map.signals[index]);
            let same_group = a.junction.is_some() && (a.junction, a.group) == (b.junction, b.group);
            same_group && (other.station_m - station_m).abs() < SHARED_LINE_M
        };
        if !builder.map.lane(lane_index).stop_lines.iter().any(same_light) {
            builder.map.lanes[lane_index.0].stop_lines.push(StopLine { station_m, signal: index });
        }
    }
}

/// Adds all crosswalks, with their corners in the plane.
pub fn add_crosswalks(builder: &mut Builder) {
    for road in &builder.document.roads {
        for object in &road.objects {
            let outline = match &object.outline {
                Outline::Local(corners) => {
                    let heading_rad = road.reference.at(object.s_m).heading_rad + object.heading_rad;
                    let pose = Pose { position: position(road, object.s_m, object.t_m), heading_rad };
                    corners.iter().map(|(u, v)| pose.to_world(Vec2::new(*u, *v))).collect()
                }
                Outline::Road(corners) => corners.iter().map(|(s, t)| position(road, *s, *t)).collect(),
            };
            builder.map.crosswalks.push(Crosswalk { id: object.id.clone(), outline });
        }
    }
}

fn position(road: &RoadElement, s_m: f64, t_m: f64) -> Vec2 {
    let reference = road.reference.at(s_m);
    Pose { position: reference.position, heading_rad: reference.heading_rad }.offset(0.0, t_m).position
}
