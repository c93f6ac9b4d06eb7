//! All entities with their ways, speeds and actions: the content of the scenario in the language.

use std::cell::RefCell;
use std::rc::Rc;

use avastra_base::geometry::{Path, wrap_angle};
use avastra_campaign::emit::lane_point;
use avastra_lang::model::OFFSET_M;
use avastra_road::{LEVEL_SLOPE_MAX, LIMIT_MPS_DEFAULT, LanePlace};

use super::action::{ActKind, Headway};
use super::body::Body;
use super::cast::{Cast, EGO_FRONT_M, Moving, speed};
use super::place::{Placed, Places, straight_on};
use super::rows::small;
use super::said::{Figure, Said, points_text};
use super::source::{Mark, Source};
use super::story::{Entity, Event, Story};
use super::ways::{is_led, moves};

/// Before the offset of a spawn.
pub const OFFSET: &str = ", offset: ";

/// A way along lanes begins at a multiple of this, so that places that differ a little are on one way, m.
const BEGINS_M: f64 = 500.0;

/// A way that is shorter shows nothing, m.
const WAY_M_MIN: f64 = 20.0;

/// The straight way of an entity that is not in a lane, m: short if it stands.
const STRAIGHT_M: f64 = 300.0;
const STANDING_M: f64 = 10.0;

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
    /// The limit on lanes for which the map states none.
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
                // No entity is left out in silence.
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
            source.note("other road users follow their ways exactly, as the file's player moves them, and react to nothing");
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
    /// The entity on the way that it goes.
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
}

/// The name of an entity in the language.
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
