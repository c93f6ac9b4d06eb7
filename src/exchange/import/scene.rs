//! Everybody with a way, a speed and what they do: what the scenario of the language says.

use std::cell::RefCell;
use std::rc::Rc;

use avastra_base::geometry::{Path, Vec2, wrap_angle};
use avastra_campaign::emit::lane_point;
use avastra_lang::model::OFFSET_M;
use avastra_lang::model::SPAWN_SPEED_MPS;
use avastra_road::{LEVEL_SLOPE_MAX, LIMIT_MPS_DEFAULT, LanePlace, Route};
use avastra_world::sim::VehicleParameters;

use super::action::{ActKind, Headway, Speed};
use super::body::Body;
use super::condition::{EGO_FRONT_M, is_called};
use super::ground::Ground;
use super::pace::too_fast;
use super::place::{Placed, Places, straight_on};
use super::position::Position;
use super::rows::small;
use super::said::{Figure, Said, number};
use super::source::{Mark, Source};
use super::story::{Entity, Event, Story};
use super::trigger::{Pair, When};
use super::ways::{Leg, is_led, moves};

/// Before the offset of a spawn.
pub const OFFSET: &str = ", offset: ";

/// A way along lanes begins at a multiple of this, so that places that differ a little are on one way, m.
const BEGINS_M: f64 = 500.0;

/// A way that is shorter shows nothing, m.
const WAY_M_MIN: f64 = 20.0;

/// The straight way of somebody who is not in a lane, m: short if it stands.
const STRAIGHT_M: f64 = 300.0;
const STANDING_M: f64 = 10.0;

/// Farther beside the ego vehicle's route, or another way, one drives on another road, m.
const OFF_ROUTE_M: f64 = 12.0;

/// Two ways that lie beside each other for so long are of one road, m.
const SAME_ROAD_M: f64 = 100.0;

/// Words of the language, and of `pace::KEEPING`, that name no road user and no parameter.
pub const TAKEN: [&str; 20] = [
    "ego",
    "npc",
    "road",
    "nearest",
    "road_users",
    "step",
    "in",
    "and",
    "or",
    "not",
    "true",
    "false",
    "match",
    "where",
    "each",
    "any",
    "keeping",
    "pulled",
    "bounded",
    "up_to",
];

/// The ego vehicle's way, and all the others.
#[derive(Debug)]
pub struct Scene {
    /// As the language writes places.
    pub start: String,
    pub goal: String,
    pub ego_mps: Figure,
    /// What counts on lanes of which the map states no limit.
    pub limit_mps: Option<Figure>,
    pub others: Vec<Other>,
}

/// A road user as a spawn of the language.
#[derive(Debug)]
pub struct Other {
    pub bearer: String,
    pub body: Body,
    /// The fields of its trajectory, without the road.
    pub trajectory: String,
    /// `SPAWN at 12 m { does: Follow, speed: 8 m/s`, from the station on.
    pub spawn: Said,
    /// Empty if it keeps its speed.
    pub phases: Vec<Said>,
}

/// Somebody on a way.
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

/// The ego vehicle's way with everybody who has a place.
pub struct Cast<'a> {
    pub story: &'a Story,
    pub map: Rc<Ground>,
    pub route: Rc<Route>,
    pub places: RefCell<Places<'a>>,
    pub moving: Vec<Moving<'a>>,
}

impl Scene {
    /// Finds every place. `None` if something is refused.
    pub fn of(source: &mut Source, story: &Story) -> Option<Scene> {
        let (mark, path) = &story.map;
        let map = match source.library.map(path) {
            Ok(map) => map,
            Err(reason) => return source.refuse(mark, format!("`{path}`: {reason}")),
        };
        let mut places = Places::new(Rc::clone(&map), story);
        let (start, goal) = ego_way(source, story, &mut places)?;
        let route = match map.route(start, goal) {
            Ok(route) => route,
            Err(error) => {
                return source.refuse(&story.ego.mark, format!("the way of the ego vehicle: {error}"));
            }
        };
        if route.steepest(&map) > LEVEL_SLOPE_MAX {
            source.note("slopes of the map are not driven: everything drives as on the flat");
        }
        if route.obstacles(&map).next().is_some() {
            source.note("solid objects of the map stand on the way of the ego vehicle: whatever drives passes through them");
        }
        let ego_mps = speed(source, story, &story.ego, 0)?;
        source.note(
            "the ego vehicle is avastra's own: 4.70 m long and 2.06 m wide, with its rear axle where the file's has its own",
        );
        let mut cast = Cast { story, map, route, places: RefCell::new(places), moving: Vec::new() };
        for entity in &story.others {
            if source.is_torn(&entity.name) {
                continue;
            }
            let found = source.about(&entity.name, |source| cast.on_a_way(source, entity));
            cast.moving.extend(found);
        }
        cast.join_ways(source);
        let mut others = Vec::new();
        for moving in &cast.moving {
            let Some(phases) = cast.phases(source, moving) else {
                // Nobody is left out in silence.
                if !source.is_refused() {
                    source.refuse::<()>(&moving.entity.mark, "what it does cannot be said");
                }
                continue;
            };
            others.push(Other {
                bearer: moving.bearer.clone(),
                body: moving.entity.body.clone(),
                trajectory: moving.trajectory.clone(),
                spawn: moving.spawn(),
                phases,
            });
        }
        if !others.is_empty() {
            source.note("others follow their ways exactly, as the file's player moves them, and mind nobody");
        }
        let (start, goal) = (lane_point(&cast.map, start), lane_point(&cast.map, goal));
        let lanes = || cast.route.lanes.iter().map(|part| cast.map.lane(part.lane));
        let is_open = lanes().any(|lane| !lane.states_limit);
        if lanes().any(|lane| lane.states_limit && lane.speed_limit_mps < ego_mps - 0.01) {
            source.note(
                "the map's speed limit is below the ego vehicle's speed: driving systems slow down to it",
            );
        }
        let (ego_mps, most) = (Figure::new(ego_mps, "m/s"), ego_mps.max(LIMIT_MPS_DEFAULT));
        let limit_mps = story.limit_mps.or(is_open.then_some(most));
        let limit_mps = limit_mps.map(|limit_mps| Figure::new(limit_mps, "m/s"));
        (!source.is_refused()).then_some(Scene { start, goal, ego_mps, limit_mps, others })
    }
}

/// Where the ego vehicle begins, and where it is to arrive.
fn ego_way(source: &mut Source, story: &Story, places: &mut Places) -> Option<(LanePlace, LanePlace)> {
    let ego = &story.ego;
    let placed = places.of(source, &ego.mark, &ego.name)?;
    let mark = ego.position.as_ref().map_or(&ego.mark, |position| &position.mark);
    let way = match &ego.way {
        Some(way) => Some((way, way.shape.drawn(source, places, Some(placed.pose))?)),
        None => None,
    };
    let placed = match &way {
        Some((way, drawn)) => {
            let begins = drawn.path.pose_at(way.from_m);
            let turned_rad = wrap_angle(begins.heading_rad - placed.pose.heading_rad).abs();
            let reason = "the ego vehicle drives backwards, which no driving system here does";
            source.refuse_if(turned_rad > core::f64::consts::FRAC_PI_2, &way.shape.mark, reason)?;
            places.in_plane(begins)
        }
        None => placed,
    };
    let Some(start) = placed.lane else {
        return source.refuse(mark, "the ego vehicle begins in no driving lane");
    };
    if placed.turned_rad.abs() > 1.0 {
        return source.refuse(mark, "the ego vehicle does not look along the lane that is there");
    }
    if placed.turned_rad.abs() > 0.05 {
        source.note("the ego vehicle begins along its lane");
    }
    if start.offset_m.abs() > 0.05 {
        source.note("the ego vehicle begins in the middle of its lane");
    }
    let start = LanePlace { offset_m: 0.0, ..start };
    let goal = match (&way, &ego.route) {
        (Some((_, drawn)), _) => {
            let path = &drawn.path;
            let steps = (path.length_m() / 2.0) as usize;
            let back = (0..=steps).map(|step| path.length_m() - step as f64 * 2.0);
            let found = back.into_iter().find_map(|at_m| {
                let placed = places.in_plane(path.pose_at(at_m));
                placed.lane.filter(|_| placed.turned_rad.abs() < 0.5)
            });
            let reason = "the way of the ego vehicle leads beside the lanes";
            match found {
                Some(goal) => LanePlace { offset_m: 0.0, ..goal },
                None => return source.refuse(mark, reason),
            }
        }
        (None, Some((mark, route))) => {
            let route = places.route(source, mark, route)?;
            *route.last()?
        }
        (None, None) => {
            let (goals, way_m) = straight_on(&places.map, start);
            source.refuse_if(way_m < WAY_M_MIN, mark, format!("the road ends {way_m:.0} m after it"))?;
            *goals.last()?
        }
    };
    Some((start, goal))
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

    /// Refuses a place that is relative to somebody who may be elsewhere later on.
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

    /// What an entity is called in a phase of the actor.
    pub fn called(&self, source: &mut Source, mark: &Mark, actor: &Moving, name: &str) -> Option<String> {
        match () {
            () if self.is_ego(name) => Some("ego".to_owned()),
            () if name == actor.entity.name => Some("npc".to_owned()),
            () => Some(self.moving(source, mark, name)?.bearer.clone()),
        }
    }

    /// Where somebody begins.
    pub fn begins(&self, source: &mut Source, mark: &Mark, name: &str) -> Option<Vec2> {
        if self.is_ego(name) {
            return Some(self.route.path.position_at(0.0));
        }
        self.moving(source, mark, name).map(|moving| moving.placed.pose.position)
    }

    /// How fast somebody is when the scenario begins, m/s.
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

    /// Whether somebody begins on another road than the ego vehicle's route.
    pub fn is_far_off(&self, source: &mut Source, mark: &Mark, name: &str) -> Option<bool> {
        if self.is_ego(name) {
            return Some(false);
        }
        let pose = self.moving(source, mark, name)?.placed.pose;
        let beside = self.route.path.project(pose.position);
        let is_beside = beside.station_m > 0.0 && beside.station_m < self.route.path.length_m();
        Some(is_beside && beside.offset_m.abs() > OFF_ROUTE_M)
    }

    /// The way between the reference points of two is the station of `front` less that of `back` and this, m; with it by how much it is
    /// longer than the one between their outlines. `None` if they follow different roads.
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

    /// The names of all in the file who are there, the ego vehicle first.
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

    /// From the reference point of somebody's body in the file to its front, m.
    pub fn front_m(&self, name: &str) -> f64 {
        self.story.entity(name).map_or(0.0, |entity| entity.body.middle_m + entity.body.length_m / 2.0)
    }

    /// What of the way between the reference points of two lies in their outlines, m.
    pub fn overhangs_m(&self, source: &mut Source, mark: &Mark, back: &str, front: &str) -> Option<f64> {
        Some(self.overhang_m(source, mark, front, false)? + self.overhang_m(source, mark, back, true)?)
    }

    /// How far an end of somebody's outline lies beyond its reference point along the ego vehicle's route, m.
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
        let pose = self.moving(source, mark, name)?.placed.pose;
        let beside = self.route.path.project(pose.position).station_m;
        let turned_rad = wrap_angle(pose.heading_rad - self.route.path.heading_at(beside));
        Some(turned_rad.abs() < core::f64::consts::FRAC_PI_2)
    }

    /// Whether somebody begins across the ego vehicle's route, rather than along it.
    pub fn goes_across(&self, source: &mut Source, mark: &Mark, name: &str) -> Option<bool> {
        if self.is_ego(name) {
            return Some(false);
        }
        let pose = self.moving(source, mark, name)?.placed.pose;
        let beside = self.route.path.project(pose.position).station_m;
        let turned_rad = wrap_angle(pose.heading_rad - self.route.path.heading_at(beside));
        Some(libm::cos(turned_rad).abs() < libm::cos(core::f64::consts::FRAC_PI_4))
    }

    /// Somebody on the way that it goes.
    fn on_a_way(&self, source: &mut Source, entity: &'a Entity) -> Option<Moving<'a>> {
        let mut placed = self.places.borrow_mut().of(source, &entity.mark, &entity.name)?;
        let mps = speed(source, self.story, entity, 0)?;
        let at_once = |event: &&Event| event.when.is_empty();
        let later = entity.events.iter().filter(at_once).flat_map(|event| &event.acts);
        let mut headway = later.filter_map(|act| match &act.kind {
            ActKind::Ahead(of, headway) => Some((&act.mark, of, headway)),
            _ => None,
        });
        let first = entity.headway.as_ref().map(|(mark, of, headway)| (mark, of, headway));
        if let Some((mark, of, headway)) = headway.next_back().or(first) {
            source.refuse_if(!self.is_ego(of), mark, "only a distance to the ego vehicle is read")?;
            placed = self.ahead_of_ego(source, mark, entity, headway, placed)?;
        }
        let taken = self.moving.iter().map(|moving| moving.bearer.clone()).collect::<Vec<_>>();
        let bearer = name_of(&entity.name, &taken);
        let moving = |path, trajectory, at_m, offset_m| Moving {
            entity,
            bearer: bearer.clone(),
            placed,
            path,
            trajectory,
            at_m,
            offset_m,
            mps,
            legs: Vec::new(),
        };
        // Its trajectory takes the place of this way, unless it has to drive there first.
        let is_met = |event: &Event| event.acts.iter().any(|act| matches!(act.kind, ActKind::Meet(_)));
        if is_led(entity) && (entity.way.is_some() || !entity.events.iter().any(is_met)) {
            let points = placed.ahead(STRAIGHT_M);
            return Some(moving(Rc::new(Path::through(&points)?), points_text(&points), 0.0, 0.0));
        }
        let is_short = mps == 0.0 && !entity.events.iter().any(moves);
        let looks_along = if is_short { placed.stands_along() } else { placed.is_along() };
        if looks_along && !placed.stands_along() {
            source.note(format!("`{}` looks along its lane from the beginning", entity.name));
        }
        if let Some(lane) = placed.lane.filter(|lane| looks_along && OFFSET_M.contains(&lane.offset_m)) {
            let begin_m = (lane.station_m / BEGINS_M).floor() * BEGINS_M;
            let begin = LanePlace { lane: lane.lane, station_m: begin_m, offset_m: 0.0 };
            let mut ways = vec![begin];
            match &entity.route {
                Some((mark, route)) => {
                    let route = self.places.borrow_mut().route(source, mark, route)?;
                    let after =
                        |place: &LanePlace| place.lane != lane.lane || place.station_m > lane.station_m;
                    ways.extend(route.into_iter().filter(after));
                    // A route's end is no end of the way, unless the map's is there.
                    let (end, last) = (ways.len(), ways[ways.len() - 1]);
                    let is_on =
                        |place: &LanePlace| place.lane != last.lane || place.station_m > last.station_m;
                    ways.extend(straight_on(&self.map, last).0.into_iter().filter(is_on));
                    if end > 1 && self.map.way(&ways).is_err() {
                        source.note(format!("the way of `{}` ends with its route", entity.name));
                        ways.truncate(end);
                    }
                }
                None => ways.extend(straight_on(&self.map, begin).0),
            }
            let last = ways[ways.len() - 1];
            let is_long = ways.len() > 2 || last.lane != begin.lane || last.station_m > begin_m + 1.0;
            if is_long
                && let Some(path) = self.places.borrow().laid(source, &entity.mark, &ways)
                && path.length_m() > lane.station_m - begin_m
            {
                let text: Vec<String> = ways.iter().map(|place| lane_point(&self.map, *place)).collect();
                let text = format!("lanes: [{}]", text.join(", "));
                return Some(moving(path, text, lane.station_m - begin_m, lane.offset_m));
            }
        }
        if !is_short && !entity.events.is_empty() && entity.route.is_some() {
            return source.refuse(&entity.mark, "its route leads beside the lanes");
        }
        let against = placed.lane.filter(|_| !is_short && placed.is_against());
        let points = match against {
            Some(lane) => self.places.borrow().against(lane),
            None => placed.ahead(if is_short { STANDING_M } else { STRAIGHT_M }).to_vec(),
        };
        let points = if points.len() < 2 { placed.ahead(STANDING_M).to_vec() } else { points };
        if against.is_none() && !is_short && !is_led(entity) {
            source
                .note(format!("`{}` looks along no lane, and goes {STRAIGHT_M} m straight on", entity.name));
        }
        let path = Rc::new(Path::through(&points)?);
        Some(moving(path, points_text(&points), 0.0, 0.0))
    }

    /// Its place so far ahead of the ego vehicle.
    fn ahead_of_ego(
        &self,
        source: &mut Source,
        mark: &Mark,
        entity: &Entity,
        headway: &Headway,
        placed: Placed,
    ) -> Option<Placed> {
        let (ego, body) = (&self.story.ego, &entity.body);
        let gap_m = match headway {
            Headway::Way(way_m) => *way_m,
            Headway::Time(time_s) => time_s * speed(source, self.story, ego, 0)?,
        };
        let ahead_m = EGO_FRONT_M + gap_m + body.length_m / 2.0 - body.middle_m;
        let Some(lane) = placed.lane.filter(|_| placed.is_along()) else {
            return source
                .refuse(mark, "a distance to the ego vehicle is read of a vehicle in a lane ahead of it");
        };
        let here_m = self.station_m(placed.pose.position);
        source.refuse_if(
            here_m <= 0.0,
            mark,
            "a distance to the ego vehicle is read of a vehicle ahead of it",
        )?;
        let station_m = lane.station_m + ahead_m - here_m;
        let length_m = self.map.lane(lane.lane).centre.length_m();
        let reason = "its lane does not reach so far";
        source.refuse_if(!(0.0..=length_m).contains(&station_m), mark, reason)?;
        Some(self.places.borrow().on_lane(LanePlace { station_m, ..lane }))
    }
}

impl Moving<'_> {
    /// Where it appears, and its first fields.
    fn spawn(&self) -> Said {
        let at = Said::default().number((self.at_m + self.more_m()).max(0.0), "m");
        let said = at.and(" { does: Follow, speed: ").number(self.mps, "m/s");
        said.and(OFFSET).number(self.offset_m, "m")
    }

    /// Where a place of the file lies on its way, m.
    pub fn reach_m(&self, source: &mut Source, cast: &Cast, position: &Position) -> Option<f64> {
        let point = cast.place(source, position)?.pose.position;
        Some(self.station_m(point))
    }

    /// The station of somebody whose reference point in the file is there, m. On foot the language means the middle.
    pub fn station_m(&self, point: Vec2) -> f64 {
        self.path.project(point).station_m + self.more_m()
    }

    /// From the file's reference point to the one that a station of the language means, m.
    pub fn more_m(&self) -> f64 {
        if self.entity.body.is_on_foot() { self.entity.body.middle_m } else { 0.0 }
    }
}

pub fn points_text(points: &[Vec2]) -> String {
    let point = |point: &Vec2| format!("{{ x: {} m, y: {} m }}", number(point.x), number(point.y));
    let points: Vec<String> = points.iter().map(point).collect();
    format!("points: [{}]", points.join(", "))
}

/// What an entity is called in the language.
fn name_of(name: &str, taken: &[String]) -> String {
    let own = small(name);
    let own = if TAKEN.contains(&own.as_str()) { format!("{own}_1") } else { own };
    let mut found = own.clone();
    let mut nth = 2;
    while taken.contains(&found) {
        found = format!("{own}_{nth}");
        nth += 1;
    }
    found
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
