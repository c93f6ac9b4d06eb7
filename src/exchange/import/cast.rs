//! All entities with a way, as the other parts of an import ask about them.

use std::cell::RefCell;
use std::rc::Rc;

use avastra_base::geometry::{Path, Vec2, wrap_angle};
use avastra_lang::model::SPAWN_SPEED_MPS;
use avastra_road::{LanePlace, Route};
use avastra_world::sim::VehicleParameters;

use super::action::{Speed, Way};
use super::ground::Ground;
use super::place::{Placed, Places};
use super::position::Position;
use super::source::{Mark, Source};
use super::story::{Entity, Event, Story};
use super::trigger::{Pair, When};

/// From the ego vehicle's rear axle to its front in avastra, m: what the language's `ego.front` is ahead of a file's reference point.
pub const EGO_FRONT_M: f64 = VehicleParameters::MKZ.rear_axle_to_front_m;

/// Farther beside the ego vehicle's route, or another way, one drives on another road, m.
const OFF_ROUTE_M: f64 = 12.0;

/// Two ways that lie beside each other for so long are of one road, m.
const SAME_ROAD_M: f64 = 100.0;

/// A trajectory as a part of an entity's way.
#[derive(Debug)]
pub struct Leg<'a> {
    pub way: &'a Way,
    /// Where it ends on the whole way, m.
    pub end_m: f64,
    /// When places of the whole way are reached, m and s.
    pub timed: Vec<(f64, f64)>,
    /// The lane in which it ends.
    pub lane: Option<LanePlace>,
}

/// An entity on a way.
pub struct Moving<'a> {
    pub entity: &'a Entity,
    pub bearer: String,
    pub placed: Placed,
    pub path: Rc<Path>,
    /// The fields of its trajectory.
    pub trajectory: String,
    /// Where it begins on the way, m, and to the left of it.
    pub at_m: f64,
    pub offset_m: f64,
    pub mps: f64,
    /// The trajectories of the file on its way.
    pub legs: Vec<Leg<'a>>,
}

/// The ego vehicle's way with all entities that have a place.
pub struct Cast<'a> {
    pub story: &'a Story,
    pub map: Rc<Ground>,
    pub route: Rc<Route>,
    pub places: RefCell<Places<'a>>,
    pub moving: Vec<Moving<'a>>,
}

impl<'a> Cast<'a> {
    pub fn is_ego(&self, name: &str) -> bool {
        self.story.ego.name == name
    }

    /// The road user of a name.
    pub fn moving(&self, source: &mut Source, mark: &Mark, name: &str) -> Option<&Moving<'a>> {
        let found = self.moving.iter().find(|moving| moving.entity.name == name);
        if found.is_none() && !source.is_torn(name) {
            return source.refuse(mark, format!("no entity is called `{name}`"));
        }
        found
    }

    /// The last event that something of a name holds, with whom it is of.
    pub fn last_event(&self, kind: &str, name: &str) -> Option<(&Moving<'a>, &'a Event)> {
        self.moving.iter().find_map(|moving| {
            let mut events = moving.entity.events.iter().rev();
            events.find(|event| is_called(event, kind, name)).map(|event| (moving, event))
        })
    }

    /// Whether something waits, by way of what it waits for, for itself.
    pub fn waits_for_itself(&self, kind: &str, name: &str) -> bool {
        let Some((_, event)) = self.last_event(kind, name) else { return false };
        let (mut waiting, mut seen): (Vec<&Event>, Vec<&Event>) = (vec![event], Vec::new());
        while let Some(next) = waiting.pop() {
            for condition in next.when.iter().flatten() {
                let (When::Ended { kind, name } | When::Begun { kind, name }) = &condition.kind else {
                    continue;
                };
                let Some((_, before)) = self.last_event(kind, name) else { continue };
                if core::ptr::eq(before, event) {
                    return true;
                }
                if !seen.iter().any(|known| core::ptr::eq(*known, before)) {
                    seen.push(before);
                    waiting.push(before);
                }
            }
        }
        false
    }

    pub fn place(&self, source: &mut Source, position: &Position) -> Option<Placed> {
        self.places.borrow_mut().placed(source, position)
    }

    /// Refuses a place that is relative to an entity that may be elsewhere later on.
    pub fn stays(&self, source: &mut Source, place: &Position) -> Option<()> {
        let Some(name) = place.relative_to() else { return Some(()) };
        let moves = match self.moving.iter().find(|moving| moving.entity.name == name) {
            Some(moving) => {
                moving.mps != 0.0 || moving.entity.way.is_some() || !moving.entity.events.is_empty()
            }
            None => true,
        };
        let reason = format!("it is relative to `{name}`, which may be elsewhere by then");
        source.refuse_if(moves, &place.mark, reason)
    }

    /// The name of an entity in a phase of the actor.
    pub fn called(&self, source: &mut Source, mark: &Mark, actor: &Moving, name: &str) -> Option<String> {
        match () {
            () if self.is_ego(name) => Some("ego".to_owned()),
            () if name == actor.entity.name => Some("npc".to_owned()),
            () => Some(self.moving(source, mark, name)?.bearer.clone()),
        }
    }

    /// Where an entity begins.
    pub fn begins(&self, source: &mut Source, mark: &Mark, name: &str) -> Option<Vec2> {
        if self.is_ego(name) {
            return Some(self.route.path.position_at(0.0));
        }
        self.moving(source, mark, name).map(|moving| moving.placed.pose.position)
    }

    /// The speed of an entity when the scenario begins, m/s.
    pub fn begins_mps(&self, source: &mut Source, mark: &Mark, name: &str) -> Option<f64> {
        match self.is_ego(name) {
            true => speed(source, self.story, &self.story.ego, 0),
            false => self.moving(source, mark, name).map(|moving| moving.mps),
        }
    }

    /// Where a point lies along the ego vehicle's route, m; below 0 behind its start.
    pub fn station_m(&self, point: Vec2) -> f64 {
        let projected = self.route.path.project(point);
        let begin = self.route.path.pose_at(0.0);
        if projected.station_m > 0.0 { projected.station_m } else { begin.to_local(point).x.min(0.0) }
    }

    /// Whether an entity begins on another road than the ego vehicle's route.
    pub fn is_far_off(&self, source: &mut Source, mark: &Mark, name: &str) -> Option<bool> {
        if self.is_ego(name) {
            return Some(false);
        }
        let pose = self.moving(source, mark, name)?.placed.pose;
        let beside = self.route.path.project(pose.position);
        let is_beside = beside.station_m > 0.0 && beside.station_m < self.route.path.length_m();
        Some(is_beside && beside.offset_m.abs() > OFF_ROUTE_M)
    }

    /// The distance between two reference points is the station of `front`, less that of `back`, plus this, m. The second
    /// value is by how much it is longer than the distance between their outlines. `None` if they follow different roads.
    pub fn stations_apart_m(&self, back: &str, front: &str) -> Option<(f64, f64)> {
        let of = |name: &str| self.moving.iter().find(|moving| moving.entity.name == name);
        let (back, front) = (of(back)?, of(front)?);
        let beside = |point: Vec2| {
            let at = back.path.project(point);
            (at.offset_m.abs() < OFF_ROUTE_M).then_some(at.station_m)
        };
        let later_m = (front.at_m + SAME_ROAD_M).min(front.path.length_m());
        let here_m = beside(front.path.position_at(front.at_m))?;
        let there_m = beside(front.path.position_at(later_m))?;
        let goes_on_m = (there_m - here_m) - (later_m - front.at_m);
        let [behind, ahead] = [&back.entity.body, &front.entity.body];
        let overhangs_m = behind.length_m / 2.0 + behind.middle_m + ahead.length_m / 2.0 - ahead.middle_m;
        (goes_on_m.abs() < 0.1 * SAME_ROAD_M).then_some((here_m - front.at_m, overhangs_m))
    }

    /// The names of all present entities of the file, the ego vehicle first.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        let others = self.moving.iter().map(|moving| moving.entity.name.as_str());
        core::iter::once(self.story.ego.name.as_str()).chain(others)
    }

    /// Half the widths of two together, m.
    pub fn half_widths_m(&self, pair: &Pair) -> f64 {
        let width_m = |name: &str| match self.is_ego(name) {
            true => VehicleParameters::MKZ.width_m,
            false => self.story.entity(name).map_or(0.0, |entity| entity.body.width_m),
        };
        (width_m(&pair.of) + width_m(&pair.to)) / 2.0
    }

    /// From the reference point of an entity's body in the file to its front, m.
    pub fn front_m(&self, name: &str) -> f64 {
        self.story.entity(name).map_or(0.0, |entity| entity.body.middle_m + entity.body.length_m / 2.0)
    }

    /// The part of the distance between two reference points that lies in the outlines, m.
    pub fn overhangs_m(&self, source: &mut Source, mark: &Mark, back: &str, front: &str) -> Option<f64> {
        Some(self.overhang_m(source, mark, front, false)? + self.overhang_m(source, mark, back, true)?)
    }

    /// How far an end of an entity's outline lies beyond its reference point along the ego vehicle's route, m.
    fn overhang_m(&self, source: &mut Source, mark: &Mark, name: &str, is_front: bool) -> Option<f64> {
        if self.is_ego(name) {
            let rear_m = VehicleParameters::MKZ.length_m - EGO_FRONT_M;
            return Some(if is_front { EGO_FRONT_M } else { rear_m });
        }
        let looks_ahead = self.looks_ahead(source, mark, name)?;
        let body = &self.moving(source, mark, name)?.entity.body;
        let middle_m = if looks_ahead == is_front { body.middle_m } else { -body.middle_m };
        Some(body.length_m / 2.0 + middle_m)
    }

    /// Whether a road user begins in the direction of the ego vehicle's route.
    pub fn looks_ahead(&self, source: &mut Source, mark: &Mark, name: &str) -> Option<bool> {
        if self.is_ego(name) {
            return Some(true);
        }
        Some(self.turned_rad(source, mark, name)?.abs() < core::f64::consts::FRAC_PI_2)
    }

    /// Whether an entity begins across the ego vehicle's route, rather than along it.
    pub fn goes_across(&self, source: &mut Source, mark: &Mark, name: &str) -> Option<bool> {
        if self.is_ego(name) {
            return Some(false);
        }
        let turned_rad = self.turned_rad(source, mark, name)?;
        Some(libm::cos(turned_rad).abs() < libm::cos(core::f64::consts::FRAC_PI_4))
    }

    /// The heading in which a road user begins, from that of the ego vehicle's route beside it, rad.
    fn turned_rad(&self, source: &mut Source, mark: &Mark, name: &str) -> Option<f64> {
        let pose = self.moving(source, mark, name)?.placed.pose;
        let beside = self.route.path.project(pose.position).station_m;
        Some(wrap_angle(pose.heading_rad - self.route.path.heading_at(beside)))
    }
}

impl Moving<'_> {
    /// Where a place of the file lies on its way, m.
    pub fn reach_m(&self, source: &mut Source, cast: &Cast, position: &Position) -> Option<f64> {
        let point = cast.place(source, position)?.pose.position;
        Some(self.station_m(point))
    }

    /// The station of an entity whose reference point in the file is there, m. For a pedestrian or an animal the
    /// language means the middle.
    pub fn station_m(&self, point: Vec2) -> f64 {
        self.path.project(point).station_m + self.more_m()
    }

    /// From the file's reference point to the one that a station of the language means, m.
    pub fn more_m(&self) -> f64 {
        if self.entity.body.is_on_foot() { self.entity.body.middle_m } else { 0.0 }
    }
}

/// Whether an event, or something that holds it, has a name.
pub fn is_called(event: &Event, kind: &str, name: &str) -> bool {
    let last = name.rsplit("::").next().unwrap_or(name);
    event.names.iter().any(|(of, own)| *of == kind && own == last)
}

pub fn too_fast(mps: f64) -> String {
    format!("{mps:.1} m/s: nothing is faster than {} m/s", SPAWN_SPEED_MPS.end())
}

/// The speed with which an entity begins, m/s.
pub fn speed(source: &mut Source, story: &Story, entity: &Entity, depth: usize) -> Option<f64> {
    source.refuse_if(depth > story.others.len(), &entity.mark, "its speed is relative to itself")?;
    let Some((mark, wanted)) = &entity.speed else { return Some(0.0) };
    let of = |source: &mut Source, name: &str| match story.entity(name) {
        Some(entity) => speed(source, story, entity, depth + 1),
        None if source.is_torn(name) => None,
        None => source.refuse(mark, format!("no entity is called `{name}`")),
    };
    let mps = match wanted {
        Speed::Absolute(mps) => *mps,
        Speed::More(name, more_mps) => of(source, name)? + more_mps,
        Speed::Times(name, factor) => of(source, name)? * factor,
    };
    source.refuse_if(mps > *SPAWN_SPEED_MPS.end(), mark, too_fast(mps))?;
    source.refuse_if(mps < 0.0, mark, "no vehicle drives backwards")?;
    entity.body.drives(source, mark, mps)?;
    Some(mps)
}
