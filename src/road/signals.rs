//! Traffic lights with their groups and stop lines, signs that say who gives way, crosswalks, and solid things.

use std::collections::BTreeMap;

use crate::geometry::{Bounds, Pose, Vec2};

use super::graph::Builder;
use super::map::{
    Crosswalk, LaneIndex, Precedence, RoadError, RoadMap, Sign, SignKind, SignLine, Signal, Solid, StopLine,
};
use super::opendrive::{
    Meaning, ObjectKind, Orientation, Outline, RoadElement, RoadLink, SignalElement, wrong,
};

/// Signal heads of one group that are nearer to each other than this share a stop line, m.
const SHARED_LINE_M: f64 = 1.0;

/// Adds all lights and signs: lights with a stop line on each lane they hold for.
pub fn add_signals(builder: &mut Builder) -> Result<(), RoadError> {
    let document = builder.document;
    let groups = groups(builder)?;
    let mut arms = Arms::default();
    let mut found = BTreeMap::new();
    for (road_index, road) in document.roads.iter().enumerate() {
        for signal in road.signals.iter().filter(|signal| !signal.reference) {
            let position = position(road, signal.s_m, signal.t_m);
            let id = signal.id.clone();
            let place = match signal.meaning {
                Meaning::Sign(kind) => {
                    builder.map.signs.push(Sign { id, kind, position, lanes: Vec::new() });
                    Found::Sign(builder.map.signs.len() - 1)
                }
                Meaning::Light | Meaning::OtherLight => {
                    let switched = groups.get(signal.id.as_str()).copied();
                    let place = switched.or_else(|| arms.group(builder, road_index, signal));
                    builder.map.signals.push(Signal {
                        id,
                        position,
                        junction: place.map(|(junction, _)| junction),
                        group: place.map_or(0, |(_, group)| group),
                    });
                    Found::Light(builder.map.signals.len() - 1)
                }
            };
            if found.insert(signal.id.as_str(), place).is_some() {
                return Err(wrong(signal.line, format!("a second signal has the id `{}`", signal.id)));
            }
        }
    }
    for controller in &document.controllers {
        let is_light = |id: &String| matches!(found.get(id.as_str()), Some(Found::Light(_)));
        let missing: Vec<_> = controller.signals.iter().filter(|(id, _)| !is_light(id)).collect();
        if let Some((first, line)) = missing.first() {
            let message = format!(
                "controller `{}` switches {} signals that are no lights, `{first}` the first of them",
                controller.id,
                missing.len()
            );
            builder.warn(*line, message);
        }
    }
    for (road_index, road) in document.roads.iter().enumerate() {
        for signal in road.signals.iter().filter(|signal| signal.meaning != Meaning::OtherLight) {
            // A reference may also point to a sign that was left out.
            match found.get(signal.id.as_str()) {
                Some(Found::Light(index)) => add_stop_lines(builder, road_index, signal, *index),
                Some(Found::Sign(index)) => {
                    let lanes = lanes_of(builder, road_index, signal);
                    builder.map.signs[*index].lanes.extend(lanes);
                }
                None => {}
            }
        }
    }
    arms.warn(builder);
    Ok(())
}

/// Notes on every lane the signs that hold for it, and on the lanes inside junctions what follows from them.
pub fn set_precedence(map: &mut RoadMap) {
    for sign in &map.signs {
        for &(index, station_m) in sign.lanes.iter().filter(|_| sign.kind != SignKind::PriorityRoad) {
            let lane = &mut map.lanes[index.0];
            if lane.stop_lines.is_empty() {
                lane.sign_lines.push(SignLine { station_m, kind: sign.kind });
                lane.sign_lines.sort_by(|a, b| a.station_m.total_cmp(&b.station_m));
            }
        }
    }
    let on_priority_road = |lane: LaneIndex| {
        let mut signs = map.signs.iter().filter(|sign| sign.kind == SignKind::PriorityRoad);
        signs.any(|sign| sign.lanes.iter().any(|(held, _)| *held == lane))
    };
    let precedence = |lane: LaneIndex| {
        if map.stop_line_of(lane).is_some() {
            Precedence::Equal
        } else if map.approach(lane).any(|lane| !map.lane(lane).sign_lines.is_empty()) {
            Precedence::Yield
        } else if map.approach(lane).any(on_priority_road) {
            Precedence::Priority
        } else {
            Precedence::Equal
        }
    };
    let inside = map.junctions.iter().flat_map(|junction| junction.lanes.iter().copied());
    let found: Vec<_> = inside.map(|lane| (lane, precedence(lane))).collect();
    for (lane, precedence) in found {
        map.lanes[lane.0].precedence = precedence;
    }
}

/// What a signal of the file became: an index in the map's signals or in its signs.
enum Found {
    Light(usize),
    Sign(usize),
}

/// Groups for lights that no controller of a junction switches: one group for each arm, so that two crossing
/// streets are never green together.
#[derive(Default)]
struct Arms {
    /// Groups by junction, road, and whether the light holds for traffic along the reference line.
    groups: BTreeMap<(usize, usize, bool), usize>,
    lights: usize,
    lone: usize,
}

impl Arms {
    /// Junction and group of a light, by the junction to which the traffic that it stops drives.
    fn group(
        &mut self,
        builder: &mut Builder,
        road_index: usize,
        signal: &SignalElement,
    ) -> Option<(usize, usize)> {
        let road = &builder.document.roads[road_index];
        let along = match signal.orientation {
            Orientation::Along => true,
            Orientation::Against => false,
            // The light belongs to the nearer end of the road.
            Orientation::Both => signal.s_m > road.length_m / 2.0,
        };
        let ahead = if along { &road.successor } else { &road.predecessor };
        let junction = match ahead {
            Some(RoadLink::Junction { id, .. }) => builder.junctions.get(id.as_str()).copied(),
            _ => None,
        };
        let Some(junction) = junction else {
            self.lone += 1;
            return None;
        };
        self.lights += 1;
        let groups = &mut builder.map.junctions[junction].groups;
        let group = *self.groups.entry((junction, road_index, along)).or_insert_with(|| {
            *groups += 1;
            *groups - 1
        });
        Some((junction, group))
    }

    fn warn(&self, builder: &mut Builder) {
        let warnings = &mut builder.map.warnings;
        if self.lights > 0 {
            warnings.push(format!(
                "no junction's controller switches {} signals: each arm of their junctions is a group of its own",
                self.lights
            ));
        }
        if self.lone > 0 {
            warnings.push(format!(
                "{} signals belong to no junction and have no controller in one: each is its own group",
                self.lone
            ));
        }
    }
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
    for (lane_index, station_m) in lanes_of(builder, road_index, signal) {
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

/// The lanes that a signal holds for, with its station on them, m.
fn lanes_of(builder: &Builder, road_index: usize, signal: &SignalElement) -> Vec<(LaneIndex, f64)> {
    let road = &builder.document.roads[road_index];
    let section_index = road.section_at(signal.s_m);
    let held = road.sections[section_index].lanes.iter().filter(|lane| {
        let orientation_fits = match signal.orientation {
            Orientation::Along => road.runs_along(lane.id),
            Orientation::Against => !road.runs_along(lane.id),
            Orientation::Both => true,
        };
        let valid = signal.validity.is_empty()
            || signal.validity.iter().any(|(from, to)| (*from..=*to).contains(&lane.id));
        orientation_fits && valid
    });
    let indices = held.filter_map(|lane| builder.lane_index(road_index, section_index, lane.id));
    indices.map(|index| (index, builder.map.lane(index).station_of(signal.s_m))).collect()
}

/// Adds all crosswalks and solid things, with their corners in the plane.
pub fn add_objects(builder: &mut Builder) {
    for road in &builder.document.roads {
        for object in &road.objects {
            let outline: Vec<Vec2> = match &object.outline {
                Outline::Local(corners) => {
                    let heading_rad = road.reference.at(object.s_m).heading_rad + object.heading_rad;
                    let pose = Pose { position: position(road, object.s_m, object.t_m), heading_rad };
                    corners.iter().map(|(u, v)| pose.to_world(Vec2::new(*u, *v))).collect()
                }
                Outline::Road(corners) => corners.iter().map(|(s, t)| position(road, *s, *t)).collect(),
            };
            match object.kind {
                ObjectKind::Crosswalk => {
                    builder.map.crosswalks.push(Crosswalk { id: object.id.clone(), outline });
                }
                ObjectKind::Solid => {
                    let bounds = Bounds::around(&outline);
                    builder.map.solids.push(Solid { outline, bounds });
                }
            }
        }
    }
}

fn position(road: &RoadElement, s_m: f64, t_m: f64) -> Vec2 {
    let reference = road.reference.at(s_m);
    Pose { position: reference.position, heading_rad: reference.heading_rad }.offset(0.0, t_m).position
}
