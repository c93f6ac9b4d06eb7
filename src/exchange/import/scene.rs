//! Everybody with a way, a speed and what they do: what the scenario of the language says.

use std::cell::RefCell;
use std::rc::Rc;

use avastra_base::geometry::{Path, SMOOTH_STEP_SLOPE_MAX, Vec2, wrap_angle};
use avastra_campaign::emit::lane_point;
use avastra_lang::model::SPAWN_SPEED_MPS;
use avastra_lang::model::command::OFFSET_M;
use avastra_road::{LIMIT_MPS_DEFAULT, LanePlace, RoadMap, Route, Side};
use avastra_world::sim::VehicleParameters;

use super::action::{Act, ActKind, Aside, Dynamics, Headway, Meeting, Over, Speed, Steady, Target};
use super::body::Body;
use super::condition::{EGO_FRONT_M, Waiting, is_called};
use super::pace::{self, Change, too_fast};
use super::place::{Placed, Places, straight_on};
use super::position::Position;
use super::rows::small;
use super::said::{Figure, Piece, Said, number};
use super::source::{Mark, Source};
use super::story::{Entity, Event, Story};
use super::trigger::When;

/// Before the offset of a spawn.
pub const OFFSET: &str = ", offset: ";

/// A way along lanes begins at a multiple of this, so that places that differ a little are on one way, m.
const BEGINS_M: f64 = 500.0;

/// A way that is shorter shows nothing, m.
const WAY_M_MIN: f64 = 20.0;

/// The straight way of somebody who is not in a lane, m: short if it stands.
const STRAIGHT_M: f64 = 300.0;
const STANDING_M: f64 = 10.0;

/// A trajectory that begins during the story does so this near to where its entity stands, m.
const NEAR_M: f64 = 1.5;

/// The fields of an order that say how fast somebody drives.
const PACE: [&str; 6] = ["speed", "rate", "early", "at", "reach", "steady"];

/// The fastest that somebody is told to move aside, m/s.
const ASIDE_MPS_MAX: f64 = 10.0;

/// Words of the language that name no road user and no parameter.
pub const TAKEN: [&str; 16] = [
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
    pub path: Path,
    /// The fields of its trajectory.
    trajectory: String,
    /// Where it begins on the way, m, and to the left of it.
    pub at_m: f64,
    offset_m: f64,
    mps: f64,
    /// When places of its way are reached, m and s.
    timed: Vec<(f64, f64)>,
}

/// The ego vehicle's way with everybody who has a place.
pub struct Cast<'a> {
    story: &'a Story,
    map: Rc<RoadMap>,
    route: Route,
    places: RefCell<Places<'a>>,
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
        let route = match Route::find(&map, start, goal) {
            Ok(route) => route,
            Err(error) => {
                return source.refuse(&story.ego.mark, format!("the way of the ego vehicle: {error}"));
            }
        };
        let ego_mps = speed(source, story, &story.ego, 0)?;
        source.note(
            "the ego vehicle is avastra's own: 4.70 m long, with its rear axle where the file's has its own",
        );
        let mut cast = Cast { story, map, route, places: RefCell::new(places), moving: Vec::new() };
        for entity in &story.others {
            if source.is_torn(&entity.name) {
                continue;
            }
            let found = source.about(&entity.name, |source| cast.on_a_way(source, entity));
            cast.moving.extend(found);
        }
        let mut others = Vec::new();
        for moving in &cast.moving {
            if let Some(phases) = cast.phases(source, moving) {
                others.push(Other {
                    bearer: moving.bearer.clone(),
                    body: moving.entity.body.clone(),
                    trajectory: moving.trajectory.clone(),
                    spawn: moving.spawn(),
                    phases,
                });
            }
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
        let limit_mps = is_open.then(|| Figure::new(most, "m/s"));
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

    pub fn place(&self, source: &mut Source, position: &Position) -> Option<Placed> {
        self.places.borrow_mut().placed(source, position)
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

    /// How far an end of somebody's outline lies beyond its reference point along the ego vehicle's route, m.
    pub fn overhang_m(&self, source: &mut Source, mark: &Mark, name: &str, is_front: bool) -> Option<f64> {
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

    /// Somebody on the way that it goes.
    fn on_a_way(&self, source: &mut Source, entity: &'a Entity) -> Option<Moving<'a>> {
        let mut placed = self.places.borrow_mut().of(source, &entity.mark, &entity.name)?;
        let mps = speed(source, self.story, entity, 0)?;
        let at_once = |event: &&Event| event.when.is_empty();
        let later = entity.events.iter().filter(at_once).flat_map(|event| &event.acts);
        let mut headway = later.filter_map(|act| match &act.kind {
            ActKind::Ahead(headway) => Some((&act.mark, headway)),
            _ => None,
        });
        let headway = headway.next_back().or(entity.headway.as_ref().map(|(mark, headway)| (mark, headway)));
        if let Some((mark, headway)) = headway {
            placed = self.ahead_of_ego(source, mark, entity, headway, placed)?;
        }
        let taken = self.moving.iter().map(|moving| moving.bearer.clone()).collect::<Vec<_>>();
        let bearer = name_of(&entity.name, &taken);
        let follows = entity.events.iter().flat_map(|event| &event.acts).filter_map(|act| match &act.kind {
            ActKind::Follow(way) => Some(&**way),
            _ => None,
        });
        let mut follows: Vec<_> = follows.collect();
        if let Some(way) = &entity.way {
            follows.insert(0, way);
        }
        let moving = |path, trajectory, at_m, offset_m, timed| Moving {
            entity,
            bearer: bearer.clone(),
            placed,
            path,
            trajectory,
            at_m,
            offset_m,
            mps,
            timed,
        };
        if let Some(way) = follows.first() {
            if let Some(second) = follows.get(1) {
                return source.refuse(&second.shape.mark, "somebody follows one trajectory");
            }
            let drawn = way.shape.drawn(source, &mut self.places.borrow_mut(), Some(placed.pose))?;
            let is_first = entity.way.is_some();
            let (from_m, begins) = (way.from_m, drawn.path.pose_at(way.from_m));
            let away_m = (begins.position - placed.pose.position).norm();
            let turned_rad = wrap_angle(begins.heading_rad - placed.pose.heading_rad).abs();
            let stands = mps == 0.0 && !moves_before_its_way(&entity.events);
            let reason = "it drives already when its trajectory begins: where it is then is not known";
            source.refuse_if(!is_first && !stands, &way.shape.mark, reason)?;
            let reason = format!("its trajectory begins {away_m:.1} m away from where it stands");
            source.refuse_if(!is_first && away_m > NEAR_M, &way.shape.mark, reason)?;
            let is_turned = entity.position.is_some() && turned_rad > 2.0 && entity.body.like != "Pedestrian";
            source.refuse_if(is_turned, &way.shape.mark, "vehicles do not drive backwards")?;
            let timed = match way.timing {
                Some((more_s, times)) => {
                    drawn.timed.iter().map(|(at_m, time_s)| (*at_m, time_s * times + more_s)).collect()
                }
                None => Vec::new(),
            };
            let text = points_text(&drawn.points);
            return Some(moving(drawn.path, text, from_m, 0.0, timed));
        }
        let is_short = mps == 0.0 && !entity.events.iter().any(moves);
        if let Some(lane) = placed.lane.filter(|lane| placed.is_along() && OFFSET_M.contains(&lane.offset_m))
        {
            let begin_m = (lane.station_m / BEGINS_M).floor() * BEGINS_M;
            let begin = LanePlace { lane: lane.lane, station_m: begin_m, offset_m: 0.0 };
            let mut ways = vec![begin];
            match &entity.route {
                Some((mark, route)) => {
                    let route = self.places.borrow_mut().route(source, mark, route)?;
                    let after =
                        |place: &LanePlace| place.lane != lane.lane || place.station_m > lane.station_m;
                    ways.extend(route.into_iter().filter(after));
                    if ways.len() < 2 {
                        ways.extend(straight_on(&self.map, begin).0);
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
                return Some(moving(path, text, lane.station_m - begin_m, lane.offset_m, Vec::new()));
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
        if against.is_none() && !is_short {
            source
                .note(format!("`{}` looks along no lane, and goes {STRAIGHT_M} m straight on", entity.name));
        }
        let path = Path::through(&points)?;
        Some(moving(path, points_text(&points), 0.0, 0.0, Vec::new()))
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

    /// What somebody does, phase by phase.
    fn phases(&self, source: &mut Source, moving: &Moving<'a>) -> Option<Vec<Said>> {
        let entity = moving.entity;
        let mut events: Vec<&Event> = entity.events.iter().filter(|event| !event.acts.is_empty()).collect();
        events.retain(|event| !event.acts.iter().all(|act| matches!(act.kind, ActKind::Ahead(_))));
        if events.iter().all(|event| event.time_s().is_some()) {
            events.sort_by(|a, b| a.time_s().unwrap_or(0.0).total_cmp(&b.time_s().unwrap_or(0.0)));
        } else if events.iter().filter(|event| waits_by_itself(event)).count() > 1 {
            source.note(format!("what `{}` does is taken to come in the order of the file", entity.name));
        }
        let mut told =
            Told { mps: Some(moving.mps), offset_m: moving.offset_m, lane: moving.placed.lane, lane_m: 0.0 };
        told.lane_m = told.lane.map_or(0.0, |lane| self.aside_m(moving, lane));
        let mut phases = Vec::new();
        // After what takes several phases, whose `once` would come too late: the words before what may follow.
        let mut several: Option<Said> = None;
        if entity.way.as_ref().is_some_and(|way| way.timing.is_some()) {
            phases.extend(self.timed(source, moving, Said::default(), true)?);
            several = (phases.len() > 1).then(Said::default);
        }
        let (at_once, later): (Vec<&Event>, Vec<&Event>) =
            events.into_iter().partition(|event| event.when.is_empty());
        let mut groups: Vec<(Option<&Event>, Vec<&Act>)> = Vec::new();
        let first: Vec<&Act> = at_once.iter().flat_map(|event| &event.acts).collect();
        if !first.is_empty() {
            groups.push((None, first));
        }
        for event in later {
            // What begins at the same moment is one phase.
            let is_same = |(last, _): &&mut (Option<&Event>, Vec<&Act>)| {
                last.is_some_and(|last| same_moment(last, event))
            };
            match groups.last_mut().filter(is_same) {
                Some((_, acts)) => acts.extend(&event.acts),
                None => groups.push((Some(event), event.acts.iter().collect())),
            }
        }
        // Also one that only placed somebody, which took no time.
        let mut before: Vec<&Event> = entity.events.iter().filter(|event| event.when.is_empty()).collect();
        for (event, acts) in groups {
            let reason =
                "beside the times of a trajectory or of a profile only what waits for their end is read";
            let begins = match event {
                None => {
                    source.refuse_if(several.is_some(), &entity.mark, reason)?;
                    Said::default()
                }
                Some(event) => {
                    let waiting = Waiting { cast: self, actor: moving, before: before.clone() };
                    let begins = waiting.begins(source, &event.when)?;
                    if let Some(words) = several.take() {
                        source.refuse_if(!waiting.waits_for_the_end(&event.when), &event.mark, reason)?;
                        if !words.0.is_empty() {
                            phases.push(words.and("{}"));
                        }
                    }
                    if begins.is_after {
                        phases.push(Said::text("after 0 s {}"));
                    }
                    phases.extend(
                        begins.first.as_ref().map(|first| Said::text("once ").then(first.clone()).and(" {}")),
                    );
                    begins.said()
                }
            };
            if let Some(event) = event {
                before = entity.events.iter().filter(|other| same_moment(other, event)).collect();
            }
            let mut fields = Vec::new();
            let mut timed = Vec::new();
            for act in acts {
                match &act.kind {
                    ActKind::Follow(way) if way.timing.is_some() => {
                        timed = self.timed(source, moving, begins.clone(), way.is_absolute)?;
                        several = (timed.len() > 1).then(Said::default);
                    }
                    ActKind::Profile(entries) => {
                        let reason = "its trajectory has times, which say the speed already";
                        source.refuse_if(!moving.timed.is_empty(), &act.mark, reason)?;
                        let begins = begins.clone();
                        let (said, then) =
                            pace::profile(source, &act.mark, &entity.body, told.mps, entries, begins)?;
                        (timed, several) = (said, Some(then));
                        told.mps = entries.last().map(|entry| entry.mps);
                    }
                    _ => self.fields(source, moving, act, &mut told, &mut fields)?,
                }
            }
            if timed.is_empty() {
                phases.push(begins.and("{ ").then(Said::joined(fields, ", ")).and(" }"));
            } else if fields.is_empty() {
                phases.extend(timed);
            } else {
                let mark = &event.map_or(&entity.mark, |event| &event.mark);
                return source.refuse(*mark, reason);
            }
        }
        Some(phases)
    }

    /// The phases of one that is at places of its way at given times.
    fn timed(
        &self,
        source: &mut Source,
        moving: &Moving,
        begins: Said,
        is_absolute: bool,
    ) -> Option<Vec<Said>> {
        let mut phases = Vec::new();
        let Some((_, first_s)) = moving.timed.first() else { return Some(phases) };
        let mut begins = begins;
        if *first_s > 0.0 {
            begins = match is_absolute {
                true => Said::text("once elapsed >= ").number(*first_s, "s").and(" "),
                false => begins.and("after ").number(*first_s, "s").and(" "),
            };
        }
        let mut is_wait = false;
        for pair in moving.timed.windows(2) {
            let ((from_m, from_s), (to_m, to_s)) = (pair[0], pair[1]);
            let (way_m, time_s) = (to_m - from_m, to_s - from_s);
            if time_s <= 0.0 {
                continue;
            }
            let said = core::mem::take(&mut begins);
            let said = match (phases.is_empty(), is_wait) {
                (true, _) | (false, true) => said,
                (false, false) => {
                    Said::text("once npc.station >= ").number(from_m + moving.more_m(), "m").and(" ")
                }
            };
            let mps = way_m / time_s;
            source.refuse_if(mps > *SPAWN_SPEED_MPS.end(), &moving.entity.mark, too_fast(mps))?;
            phases.push(said.and("{ speed: ").number(mps, "m/s").and(" }"));
            is_wait = way_m < 1e-6;
            if is_wait {
                begins = Said::text("after ").number(time_s, "s").and(" ");
            }
        }
        Some(phases)
    }

    /// The fields of an order that an action is.
    fn fields(
        &self,
        source: &mut Source,
        moving: &Moving,
        act: &Act,
        told: &mut Told,
        fields: &mut Vec<Said>,
    ) -> Option<()> {
        let mark = &act.mark;
        match &act.kind {
            ActKind::Placed(_) => source.refuse(mark, "nobody is placed anew in the story"),
            ActKind::Ahead(_) => Some(()),
            ActKind::Route(_) => source.refuse(mark, "a route is taken from the beginning"),
            // It goes on with the speed that it has, which is 0: an event of its own tells it more.
            ActKind::Follow(_) | ActKind::Profile(_) => Some(()),
            ActKind::Speed(wanted, dynamics) => {
                self.speed_fields(source, moving, mark, wanted, *dynamics, told, fields)
            }
            ActKind::Lane(target, more_m, dynamics) => {
                let lane_m = self.lane_offset_m(source, moving, mark, target, told)?;
                let to_m = lane_m + self.left_m(moving, told, *more_m);
                let to = Said::default().number(to_m, "m");
                aside_fields(source, mark, to_m, to, *dynamics, told, fields)
            }
            ActKind::Offset(Aside::InLane(offset_m), dynamics) => {
                let to_m = told.lane_m + self.left_m(moving, told, *offset_m);
                let to = Said::default().number(to_m, "m");
                aside_fields(source, mark, to_m, to, *dynamics, told, fields)
            }
            ActKind::Offset(Aside::Of(name, more_m), dynamics) => {
                let (to_m, to) = self.beside(source, moving, mark, name, *more_m, told)?;
                aside_fields(source, mark, to_m, to, *dynamics, told, fields)
            }
            ActKind::Meet(meeting) => self.meeting_fields(source, moving, mark, meeting, told, fields),
        }
    }

    /// A way to the left in the road's direction as one to the left of somebody in a lane of it, on its way.
    fn left_m(&self, moving: &Moving, told: &Told, left_m: f64) -> f64 {
        let Some(place) = told.lane else { return left_m };
        let lane = self.map.lane(place.lane);
        let turned_rad =
            wrap_angle(moving.path.heading_at(moving.at_m) - lane.centre.heading_at(place.station_m));
        let goes_with_lane = turned_rad.abs() < core::f64::consts::FRAC_PI_2;
        if goes_with_lane == lane.is_along() { left_m } else { -left_m }
    }

    /// Where on its way, across, somebody is so much to the left of another one: as both begin, and as both are then.
    fn beside(
        &self,
        source: &mut Source,
        moving: &Moving,
        mark: &Mark,
        name: &str,
        more_m: f64,
        told: &Told,
    ) -> Option<(f64, Said)> {
        let other = self.begins(source, mark, name)?;
        let own = moving.placed.pose;
        let along = self.route.path.project(own.position);
        let turned_rad = wrap_angle(own.heading_rad - self.route.path.heading_at(along.station_m));
        let reason = "to be beside another one is read of those that drive along the ego vehicle's way";
        source.refuse_if(turned_rad.abs() > 1.0, mark, reason)?;
        let of = if self.is_ego(name) {
            "ego".to_owned()
        } else {
            self.moving(source, mark, name)?.bearer.clone()
        };
        let away_m = self.route.path.project(other).offset_m - along.offset_m;
        let said = Said::text(format!("{of}.offset - npc.offset + ")).number(told.offset_m + more_m, "m");
        Some((moving.offset_m + away_m + more_m, said))
    }

    #[expect(clippy::too_many_arguments, reason = "an action with where it stands and what it changes")]
    fn speed_fields(
        &self,
        source: &mut Source,
        moving: &Moving,
        mark: &Mark,
        wanted: &Speed,
        dynamics: Dynamics,
        told: &mut Told,
        fields: &mut Vec<Said>,
    ) -> Option<()> {
        if let (true, Speed::More(name, _) | Speed::Times(name, _)) = (dynamics.is_continuous, wanted) {
            let reason =
                "a speed that follows another's from moment to moment is read where that one keeps its own";
            source.refuse_if(self.is_ego(name) || !self.keeps_its_speed(name), mark, reason)?;
        }
        let who = |source: &mut Source, name: &str| match () {
            () if self.is_ego(name) => Some("ego".to_owned()),
            () if name == moving.entity.name => Some("npc".to_owned()),
            () => Some(self.moving(source, mark, name)?.bearer.clone()),
        };
        let (said, mps) = match wanted {
            Speed::Absolute(mps) => (Said::default().number(*mps, "m/s"), Some(*mps)),
            Speed::More(name, more) => {
                (Said::text(format!("{}.speed + ", who(source, name)?)).number(*more, "m/s"), None)
            }
            Speed::Times(name, times) => {
                (Said::text(format!("{}.speed * ", who(source, name)?)).number(*times, ""), None)
            }
        };
        if let Some(mps) = mps {
            source.refuse_if(mps < 0.0, mark, "nobody drives backwards")?;
            source.refuse_if(mps > *SPAWN_SPEED_MPS.end(), mark, too_fast(mps))?;
        }
        if matches!(dynamics.over, Over::Never) {
            source.note("a speed that changes by 0 m/s² stays as it is");
            return Some(());
        }
        if dynamics.peak > 1.0 && !matches!(dynamics.over, Over::AtOnce) {
            source.note("speeds change evenly, also where the file has a curve");
        }
        let rate = match (dynamics.over, told.mps, mps) {
            (Over::AtOnce | Over::Never, ..) => None,
            (Over::Rate(rate), ..) => Some(Said::default().number(rate.abs() / dynamics.peak, "m/s^2")),
            (Over::Time(time_s), Some(from), Some(to)) => {
                (from != to).then(|| Said::default().number((to - from).abs() / time_s, "m/s^2"))
            }
            (Over::Way(way_m), Some(from), Some(to)) => (from != to)
                .then(|| Said::default().number((to * to - from * from).abs() / (2.0 * way_m), "m/s^2")),
            (Over::Time(time_s), ..) => Some(
                Said::text("match npc.speed <= ")
                    .then(said.clone())
                    .and(" { true => (")
                    .then(said.clone())
                    .and(" - npc.speed) / ")
                    .number(time_s, "s")
                    .and(", false => (npc.speed - ")
                    .then(Said::text("(").then(said.clone()).and(")"))
                    .and(") / ")
                    .number(time_s, "s")
                    .and(" }"),
            ),
            (Over::Way(_), ..) => {
                return source.refuse(mark, "over a way a speed changes only from one that the file says");
            }
        };
        let change = Change::between(told.mps, mps);
        let rate = rate.map(|rate| match rate.0.as_slice() {
            [Piece::Number(figure)] => {
                let within = pace::rate_within_mps2(source, &moving.entity.body, change, figure.value());
                Said::default().number(within, "m/s^2")
            }
            _ => rate,
        });
        told.mps = mps;
        instead_of(fields, &PACE);
        fields.push(Said::text("speed: ").then(said));
        fields.extend(rate.map(|rate| Said::text("rate: ").then(rate)));
        Some(())
    }

    /// Whether somebody beside the ego vehicle drives at one speed from the beginning on.
    fn keeps_its_speed(&self, name: &str) -> bool {
        let changes =
            |act: &Act| matches!(act.kind, ActKind::Speed(..) | ActKind::Profile(_) | ActKind::Meet(_));
        let Some(entity) = self.story.entity(name) else { return false };
        let is_timed = entity.way.as_ref().is_some_and(|way| way.timing.is_some());
        !is_timed && !entity.events.iter().flat_map(|event| &event.acts).any(changes)
    }

    /// How far to the left of its way a lane lies, m.
    fn lane_offset_m(
        &self,
        source: &mut Source,
        moving: &Moving,
        mark: &Mark,
        target: &Target,
        told: &mut Told,
    ) -> Option<f64> {
        let Some(own) = told.lane else { return source.refuse(mark, "it drives in no lane") };
        let to = match target {
            Target::Beside(name, lanes) => {
                let of = match () {
                    () if *name == moving.entity.name => own,
                    () => {
                        let placed = self.places.borrow_mut().of(source, mark, name)?;
                        let Some(lane) = placed.lane else {
                            return source.refuse(mark, "that one is in no lane");
                        };
                        lane
                    }
                };
                // Beside this one, wherever the other one is along the road.
                self.lane_beside(own, of, *lanes)
            }
            Target::Lane(id) => {
                let lane = self.map.lane(own.lane);
                let s_m = lane.road_station_m(own.station_m);
                self.map.place(&lane.key.road, *id, s_m).ok()
            }
        };
        let Some(to) = to else { return source.refuse(mark, "no such lane is beside its own") };
        (told.lane, told.lane_m) = (Some(to), self.aside_m(moving, to));
        Some(told.lane_m)
    }

    /// How far to the left of somebody's way, where it begins, the middle of a lane lies, m.
    fn aside_m(&self, moving: &Moving, lane: LanePlace) -> f64 {
        let here = moving.path.pose_at(moving.at_m);
        let centre = &self.map.lane(lane.lane).centre;
        here.to_local(centre.position_at(centre.project(here.position).station_m)).y
    }

    /// The lane that is so many lanes to the left of another's, beside a place.
    fn lane_beside(&self, own: LanePlace, of: LanePlace, lanes: i32) -> Option<LanePlace> {
        let (own_key, of_key) = (&self.map.lane(own.lane).key, &self.map.lane(of.lane).key);
        if own_key.road == of_key.road {
            let s_m = self.map.lane(own.lane).road_station_m(own.station_m);
            let mut id = of_key.lane + lanes;
            // Lanes have no number 0.
            if (of_key.lane < 0) != (id < 0) || id == 0 {
                id += lanes.signum();
            }
            return self.map.place(&own_key.road, id, s_m).ok();
        }
        let mut lane = own.lane;
        let side = if lanes > 0 { Side::Left } else { Side::Right };
        for _ in 0..lanes.abs() {
            lane = self.map.lane(lane).neighbour(side)?.lane;
        }
        Some(LanePlace { lane, ..own })
    }

    fn meeting_fields(
        &self,
        source: &mut Source,
        moving: &Moving,
        mark: &Mark,
        meeting: &Meeting,
        told: &mut Told,
        fields: &mut Vec<Said>,
    ) -> Option<()> {
        let reason = "only the ego vehicle is met";
        source.refuse_if(!self.is_ego(&meeting.master), mark, reason)?;
        let ego = &self.story.ego.body;
        let point = self.place(source, &meeting.master_at)?.pose.position;
        // The file says where its reference point is; the language where the front is.
        let ego_m = self.station_m(point) + ego.middle_m + ego.length_m / 2.0;
        let reach_m = moving.reach_m(source, self, &meeting.own_at)?;
        instead_of(fields, &PACE);
        fields.push(Said::text("early: ").number(0.0, "s"));
        fields.push(Said::text("at: ").number(ego_m, "m"));
        fields.push(Said::text("reach: ").number(reach_m, "m"));
        let mps = match &meeting.speed {
            None => None,
            Some(Speed::Absolute(mps)) => Some(*mps),
            Some(Speed::More(_, more)) => Some(speed(source, self.story, &self.story.ego, 0)? + more),
            Some(Speed::Times(_, times)) => Some(speed(source, self.story, &self.story.ego, 0)? * times),
        };
        if let Some(mps) = mps {
            source.refuse_if(mps <= 0.0, mark, "it arrives with a speed above 0")?;
            source.refuse_if(mps > *SPAWN_SPEED_MPS.end(), mark, too_fast(mps))?;
            fields.push(Said::text("speed: ").number(mps, "m/s"));
            let steady_m = match meeting.steady {
                Steady::No => 0.0,
                Steady::Way(way_m) => way_m,
                Steady::Time(time_s) => time_s * mps,
            };
            if steady_m > 0.0 {
                fields.push(Said::text("steady: ").number(steady_m, "m"));
            }
        }
        told.mps = mps;
        Some(())
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
    fn more_m(&self) -> f64 {
        if self.entity.body.like == "Pedestrian" { self.entity.body.middle_m } else { 0.0 }
    }
}

/// What somebody was told so far.
struct Told {
    /// Its speed, if the file says it.
    mps: Option<f64>,
    offset_m: f64,
    lane: Option<LanePlace>,
    /// How far the middle of that lane is to the left of its way, m.
    lane_m: f64,
}

/// Of two actions that begin together the later one counts.
fn instead_of(fields: &mut Vec<Said>, names: &[&str]) {
    fields.retain(|field| !names.contains(&field.name().as_str()));
}

fn aside_fields(
    source: &mut Source,
    mark: &Mark,
    to_m: f64,
    to: Said,
    dynamics: Dynamics,
    told: &mut Told,
    fields: &mut Vec<Said>,
) -> Option<()> {
    if matches!(dynamics.over, Over::Never) {
        source.note("who moves aside at 0 m/s stays where it is");
        return Some(());
    }
    let by_m = (to_m - told.offset_m).abs();
    let (low_m, high_m) = (OFFSET_M.start(), OFFSET_M.end());
    let reason = format!("it moves to {to_m:.1} m beside its way: {low_m} to {high_m} m is possible");
    source.refuse_if(!OFFSET_M.contains(&to_m), mark, reason)?;
    told.offset_m = to_m;
    if by_m < 1e-6 {
        return Some(());
    }
    instead_of(fields, &["offset", "aside"]);
    fields.push(Said::text("offset: ").then(to));
    let slope = SMOOTH_STEP_SLOPE_MAX;
    let aside_mps = match dynamics.over {
        Over::AtOnce | Over::Never => ASIDE_MPS_MAX,
        Over::Time(time_s) => slope * by_m / time_s,
        // By the greatest acceleration, along a cosine: `T = π √(d / 2a)`.
        Over::Rate(mps) if mps < 0.0 => slope * by_m / (core::f64::consts::PI * (by_m / (2.0 * -mps)).sqrt()),
        Over::Rate(mps) => slope * mps / dynamics.peak,
        Over::Way(way_m) => {
            fields.push(Said::text("aside: npc.speed * ").number(slope * by_m / way_m, ""));
            return Some(());
        }
    };
    if aside_mps > ASIDE_MPS_MAX || matches!(dynamics.over, Over::AtOnce) {
        source.note(format!("nobody moves aside faster than {ASIDE_MPS_MAX} m/s"));
    }
    fields.push(Said::text("aside: ").number(aside_mps.clamp(0.1, ASIDE_MPS_MAX), "m/s"));
    Some(())
}

/// Whether somebody moves by an event.
fn moves(event: &Event) -> bool {
    let stays = |act: &Act| {
        matches!(act.kind, ActKind::Ahead(_) | ActKind::Follow(_) | ActKind::Speed(Speed::Absolute(0.0), _))
    };
    !event.acts.iter().all(stays)
}

/// Whether somebody moves by an event that comes before the one with which its trajectory begins.
fn moves_before_its_way(events: &[Event]) -> bool {
    let begins = |event: &Event| event.acts.iter().any(|act| matches!(act.kind, ActKind::Follow(_)));
    let Some(at) = events.iter().position(begins) else { return events.iter().any(moves) };
    events.iter().enumerate().any(|(nth, event)| {
        let is_earlier = match (event.time_s(), events[at].time_s()) {
            (Some(time_s), Some(begins_s)) => time_s < begins_s,
            _ => nth < at,
        };
        is_earlier && !same_moment(event, &events[at]) && moves(event)
    })
}

/// Whether an event waits for something that is neither a time nor the end of another.
fn waits_by_itself(event: &Event) -> bool {
    let is_own = |kind: &When| !matches!(kind, When::After(_) | When::Always | When::Ended { .. });
    event.when.iter().flatten().any(|condition| is_own(&condition.kind))
}

fn same_moment(a: &Event, b: &Event) -> bool {
    a.when.len() == b.when.len()
        && a.when.iter().zip(&b.when).all(|(a, b)| {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.kind == b.kind && a.delay_s == b.delay_s)
        })
}

fn points_text(points: &[Vec2]) -> String {
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
fn speed(source: &mut Source, story: &Story, entity: &Entity, depth: usize) -> Option<f64> {
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
    Some(mps)
}
