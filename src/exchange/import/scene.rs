//! Everything with its place and speed: what the scenario of the language says.

use avastra_base::geometry::Vec2;
use avastra_campaign::emit::lane_point;
use avastra_lang::model::{SPAWN_DISTANCE_M, SPAWN_SPEED_MPS};
use avastra_road::RoadMap;

use super::Files;
use super::action::{Headway, Speed, Target};
use super::body::Shape;
use super::condition::{Waiting, is_always};
use super::ground::{Beside, Ground};
use super::position::{Heading, Position};
use super::source::{Mark, Source};
use super::story::{Change, Entity, Story};
use super::trigger::{Condition, When};

/// Vehicles keep to the middle of their lanes: a file's may be this far beside it, m.
const OFFSET_M_MAX: f64 = 0.3;

/// A pedestrian walks straight: vertices of its way may lie this far beside that, m.
const STRAIGHT_M: f64 = 0.5;

/// A pedestrian sets out at most 10 s after it appeared, so one that is farther away appears this long before the ego
/// vehicle arrives, s.
const SETS_OUT_S: f64 = 9.0;

pub struct Scene {
    /// As the language writes places.
    pub start: String,
    pub goal: String,
    pub ego_mps: f64,
    pub others: Vec<Other>,
    /// When the one vehicle that changes lanes may begin.
    pub change: Option<String>,
    /// The condition at which all appear, if not at the beginning.
    pub once: Option<String>,
}

/// A road user as a spawn of the language.
pub struct Other {
    pub name: String,
    pub shape: Shape,
    pub does: &'static str,
    pub is_behind: bool,
    pub gap_m: f64,
    pub lane: Option<&'static str>,
    pub side: Option<&'static str>,
    pub speed_mps: f64,
    pub changes: bool,
}

impl Other {
    fn new(entity: &Entity, does: &'static str) -> Other {
        Other {
            name: entity.name.clone(),
            shape: entity.body.clone(),
            does,
            is_behind: false,
            gap_m: 0.0,
            lane: None,
            side: None,
            speed_mps: 0.0,
            changes: false,
        }
    }
}

impl Scene {
    /// Finds every place. `None` if something is refused.
    pub fn of(source: &mut Source, story: &Story, files: &dyn Files) -> Option<Scene> {
        let (mark, path) = &story.map;
        let read = |text: String| RoadMap::from_opendrive("map", &text).map_err(|error| error.to_string());
        let map = match files.map(path).and_then(read) {
            Ok(map) => map,
            Err(reason) => return source.refuse(mark, format!("`{path}`: {reason}")),
        };
        let ground = Ground::of(source, story, map)?;
        let (start, goal) = (lane_point(&ground.map, ground.start), lane_point(&ground.map, ground.goal));
        let ego_mps = speed(source, story, &story.ego, 0)?;
        if source.is_torn(&story.ego.name) {
            return None;
        }
        let mut scene = Scene { start, goal, ego_mps, others: Vec::new(), change: None, once: None };
        let beside = Beside { station_m: 0.0, lanes_left: 0, is_along: true, offset_m: 0.0 };
        let placed = vec![Placed { entity: &story.ego, beside, mps: ego_mps }];
        let mut setting = Setting { story, ground, placed };
        // A place may be relative to one that stands later in the file.
        let mut left: Vec<&Entity> = story.others.iter().collect();
        while !left.is_empty() {
            let is_known = |entity: &&Entity| match &entity.position {
                Some((_, Position::RelativeLane { entity: of, .. })) => setting.find(of).is_some(),
                _ => true,
            };
            let Some(at) = left.iter().position(is_known) else {
                let is_torn = |entity: &&Entity| match &entity.position {
                    Some((_, Position::RelativeLane { entity: of, .. })) => source.is_torn(of),
                    _ => false,
                };
                let waiting = if left.iter().any(is_torn) { Vec::new() } else { left };
                for entity in waiting {
                    let mark = entity.position.as_ref().map_or(&entity.mark, |(mark, _)| mark);
                    source.refuse::<()>(mark, "it is placed relative to something that has no place");
                }
                break;
            };
            let entity = left.remove(at);
            // The first walk of a pedestrian is what it does.
            let is_walker = entity.body.like == "Pedestrian";
            for walk in entity.walks.iter().skip(usize::from(is_walker)) {
                let reason =
                    if is_walker { "a pedestrian walks one way" } else { "a vehicle follows its lane" };
                source.refuse::<()>(&walk.mark, reason);
            }
            if is_walker {
                if !source.is_torn(&entity.name) {
                    scene.on_foot(source, &setting, entity);
                }
                continue;
            }
            let found = source.about(&entity.name, |source| setting.place(source, entity));
            setting.placed.extend(found);
        }
        for other in &setting.placed[1..] {
            if !source.is_torn(other.name()) {
                scene.vehicle(source, &setting, other);
            }
        }
        (!source.is_refused()).then_some(scene)
    }

    /// A vehicle before, behind or against the ego vehicle.
    fn vehicle(&mut self, source: &mut Source, setting: &Setting, other: &Placed) -> Option<()> {
        let Placed { entity, beside, mps } = other;
        let mark = entity.position.as_ref().map_or(&entity.mark, |(mark, _)| mark);
        let ego = setting.ego();
        let (front_m, back_m) = ego.ends_m();
        let (own_front_m, own_back_m) = other.ends_m();
        let ahead_m = match &entity.headway {
            Some((_, Headway::Way(way_m))) => *way_m,
            Some((_, Headway::Time(time_s))) => time_s * ego.mps,
            None => own_back_m - front_m,
        };
        let behind_m = back_m - own_front_m;
        if let Some((mark, _)) = entity.headway.as_ref().filter(|_| behind_m >= 0.0) {
            return source.refuse(mark, "a distance to the ego vehicle is read of a vehicle ahead of it");
        }
        let mut spawn = Other { gap_m: ahead_m, speed_mps: *mps, ..Other::new(entity, "DriveAhead") };
        if !beside.is_along {
            source.refuse_if(ahead_m < 0.0, mark, "an oncoming vehicle is ahead of the ego vehicle")?;
            spawn.does = "DriveOpposite";
            if let Some(change) = entity.changes.first() {
                return source.refuse(&change.mark, "an oncoming vehicle keeps its lane");
            }
            return self.appears(source, mark, spawn);
        }
        spawn.lane = Some(match beside.lanes_left {
            0 => "Current",
            1 => "Left",
            -1 => "Right",
            _ => return source.refuse(mark, "only the ego vehicle's lane and those beside it are read"),
        });
        if ahead_m < 0.0 && behind_m >= 0.0 {
            (spawn.does, spawn.is_behind, spawn.gap_m) = ("Overtake", true, behind_m);
            let reason = "a vehicle that follows the ego vehicle in its lane is not read";
            source.refuse_if(beside.lanes_left == 0, mark, reason)?;
            let reason = "a vehicle that comes from behind is faster than the ego vehicle";
            source.refuse_if(*mps <= ego.mps, mark, reason)?;
        } else if ahead_m < 0.0 {
            return source
                .refuse(mark, "it begins beside the ego vehicle; vehicles appear before or behind it");
        }
        if let Some(extra) = entity.changes.get(1) {
            return source.refuse(&extra.mark, "a vehicle changes lanes once");
        }
        if let Some(change) = entity.changes.first() {
            spawn.changes = self.lane_change(source, setting, change, other)?;
        }
        self.appears(source, mark, spawn)
    }

    /// Adds a road user that appears at the place of a mark.
    fn appears(&mut self, source: &mut Source, mark: &Mark, spawn: Other) -> Option<()> {
        if !SPAWN_DISTANCE_M.contains(&spawn.gap_m) {
            let far_m = SPAWN_DISTANCE_M.end();
            let reason = format!("it begins {:.0} m away: nothing appears beyond {far_m} m", spawn.gap_m);
            return source.refuse(mark, reason);
        }
        self.others.push(spawn);
        Some(())
    }

    /// Whether a vehicle changes lanes; when it does is noted.
    fn lane_change(
        &mut self,
        source: &mut Source,
        setting: &Setting,
        change: &Change,
        other: &Placed,
    ) -> Option<bool> {
        let Setting { story, ground, .. } = setting;
        let mark = &change.mark;
        let own = other.beside.lanes_left;
        let to = match &change.to {
            Target::Beside(name, lanes) => match setting.find(name) {
                Some(of) => of.beside.lanes_left + lanes,
                None if source.is_torn(name) => return None,
                None => return source.refuse(mark, format!("`{name}` is no vehicle with a place")),
            },
            Target::Lane(lane) => {
                let here = ground.route.lane_at(other.beside.station_m.max(0.0)).lane;
                let key = &ground.map.lane(here).key;
                let s_m = ground.map.lane(here).road_station_m(ground.map.lane(here).centre.length_m() / 2.0);
                let position = Position::Lane {
                    road: key.road.clone(),
                    lane: *lane,
                    s_m,
                    offset_m: 0.0,
                    heading: Heading::Relative(0.0),
                };
                ground.beside(source, mark, &position)?.lanes_left
            }
        };
        let side = to - own;
        if side == 0 {
            return Some(false);
        }
        let starts_s = |group: &Vec<Condition>| {
            let times =
                group.iter().map(|condition| if let When::After(s) = condition.kind { s } else { 0.0 });
            times.fold(0.0, f64::max)
        };
        let soonest_s = change.when.iter().map(starts_s).reduce(f64::min).unwrap_or(0.0);
        if soonest_s >= story.duration_s {
            let (name, end_s) = (other.name(), story.duration_s);
            let kept = format!("`{name}` keeps its lane: it would leave it after {soonest_s:.0} s");
            source.note(format!("{kept}, and {end_s:.0} s are played"));
            return Some(false);
        }
        source.refuse_if(side.abs() > 1, mark, "a vehicle changes to the next lane, not over two")?;
        if own == 0 {
            // The engine draws the side of a vehicle that leaves the ego vehicle's lane.
            let lane = ground.map.lane(ground.route.lane_at(other.beside.station_m.max(0.0)).lane);
            let away = if side > 0 { lane.right } else { lane.left };
            if away.is_some_and(|away| away.same_direction) {
                let reason = "a vehicle in the ego vehicle's lane that has lanes on both sides draws the one it changes to";
                return source.refuse(mark, reason);
            }
        } else if to != 0 {
            return source.refuse(mark, "a vehicle beside the ego vehicle's lane changes into it alone");
        }
        source.refuse_if(self.change.is_some(), mark, "one vehicle of a scenario changes lanes")?;
        let when = Waiting { actor: other, setting }.text(source, &change.when)?;
        source.note(
            "a lane change takes as long as the engine's drivers need, and waits until the lane is free",
        );
        self.change = Some(when);
        Some(true)
    }

    /// A pedestrian that stands in the ego vehicle's lane, or crosses its way.
    fn on_foot(&mut self, source: &mut Source, setting: &Setting, entity: &Entity) -> Option<()> {
        let Setting { story, ground, .. } = setting;
        let Some((mark, position)) = &entity.position else {
            return source.refuse(&entity.mark, "the file does not say where it begins");
        };
        if let Some(change) = entity.changes.first() {
            return source.refuse(&change.mark, "a pedestrian does not change lanes");
        }
        let half_m = entity.body.length_m / 2.0;
        let front_m = story.ego.body.middle_m + story.ego.body.length_m / 2.0;
        let mut spawn = Other::new(entity, "Stand");
        let mps = speed(source, story, entity, 0)?;
        let Some(walk) = entity.walks.first() else {
            source.refuse_if(mps != 0.0, mark, "a pedestrian stands, or crosses the road on a trajectory")?;
            let beside = ground.beside(source, mark, position)?;
            let reason = "a pedestrian that stands does so in the middle of the ego vehicle's lane";
            source.refuse_if(beside.lanes_left != 0 || beside.offset_m.abs() > OFFSET_M_MAX, mark, reason)?;
            spawn.gap_m = beside.station_m - half_m - front_m;
            source.refuse_if(spawn.gap_m < 0.0, mark, "it is not ahead of the ego vehicle")?;
            return self.appears(source, mark, spawn);
        };
        let mut way = Vec::new();
        for (mark, position) in &walk.way {
            let (station_m, left_m) = ground.on_foot(source, mark, position)?;
            way.push(Vec2::new(station_m, left_m));
        }
        let (from, to) = (way[0], way[way.len() - 1]);
        let straight = to - from;
        for (place, (mark, _)) in way.iter().zip(&walk.way) {
            let along = (place - from).dot(&straight) / straight.norm_squared().max(f64::MIN_POSITIVE);
            let aside_m = (place - from - straight * along.clamp(0.0, 1.0)).norm();
            let reason = format!("a pedestrian walks straight: it lies {aside_m:.1} m beside its way");
            source.refuse_if(aside_m > STRAIGHT_M, mark, reason)?;
        }
        let (from_m, from_left_m) = (from.x, from.y);
        let (to_m, to_left_m) = (to.x, to.y);
        let reason = "a pedestrian walks across the ego vehicle's way";
        source.refuse_if(from_left_m * to_left_m >= 0.0, &walk.mark, reason)?;
        let way_m = (to_left_m - from_left_m).abs();
        spawn.speed_mps = walk.duration_s.map_or(mps, |duration_s| way_m / duration_s);
        source.refuse_if(spawn.speed_mps > *SPAWN_SPEED_MPS.end(), &walk.mark, too_fast(spawn.speed_mps))?;
        let reason = "neither times nor a speed say how fast it walks";
        source.refuse_if(spawn.speed_mps <= 0.0, &walk.mark, reason)?;
        let station_m = (from_m + to_m) / 2.0;
        spawn.does = "Walk";
        spawn.side = Some(if from_left_m > 0.0 { "Left" } else { "Right" });
        spawn.gap_m = station_m - half_m - front_m;
        source.refuse_if(spawn.gap_m < 0.0, &walk.mark, "it is not ahead of the ego vehicle")?;
        source.note("a pedestrian crosses from kerb to kerb, and sets out so as to meet the ego vehicle");
        let near_m = SETS_OUT_S * speed(source, story, &story.ego, 0)?;
        if spawn.gap_m > near_m {
            let reason = "a pedestrian that crosses far ahead is read where it is the only other road user";
            source.refuse_if(story.others.len() > 1, &walk.mark, reason)?;
            let left_m = ground.route.goal_m - (spawn.gap_m - near_m);
            self.once = Some(format!("ego.route_left <= {left_m:.2} m"));
            spawn.gap_m = near_m;
        }
        self.appears(source, mark, spawn)
    }
}

/// A vehicle with its place and speed at the beginning.
pub struct Placed<'a> {
    pub entity: &'a Entity,
    pub beside: Beside,
    pub mps: f64,
}

impl Placed<'_> {
    pub fn name(&self) -> &str {
        &self.entity.name
    }

    /// Stations of its front and its back, m.
    pub fn ends_m(&self) -> (f64, f64) {
        let sign = if self.beside.is_along { 1.0 } else { -1.0 };
        let Shape { length_m, middle_m, .. } = self.entity.body;
        let middle_m = self.beside.station_m + sign * middle_m;
        (middle_m + length_m / 2.0, middle_m - length_m / 2.0)
    }

    /// Its speed along the way, negative against it, m/s.
    pub fn along_mps(&self) -> f64 {
        if self.beside.is_along { self.mps } else { -self.mps }
    }
}

/// The story on its map, with the vehicles that have a place: the ego vehicle is the first.
pub struct Setting<'a> {
    pub story: &'a Story,
    pub ground: Ground,
    pub placed: Vec<Placed<'a>>,
}

impl<'a> Setting<'a> {
    pub fn ego(&self) -> &Placed<'a> {
        &self.placed[0]
    }

    /// The vehicle of a name, if it has a place.
    pub fn find(&self, name: &str) -> Option<&Placed<'a>> {
        self.placed.iter().find(|other| other.name() == name)
    }

    /// A place for one more.
    fn place(&self, source: &mut Source, entity: &'a Entity) -> Option<Placed<'a>> {
        let Some((mark, position)) = &entity.position else {
            if source.is_torn(&entity.name) {
                return None;
            }
            return source.refuse(&entity.mark, "the file does not say where it begins");
        };
        let beside = match position {
            Position::RelativeLane { entity: of, lanes, ahead_m, offset_m, heading } => {
                let of = self.find(of)?;
                let reason = "a place relative to an oncoming vehicle is not read";
                source.refuse_if(!of.beside.is_along, mark, reason)?;
                let lanes_left = of.beside.lanes_left + lanes;
                let station_m = of.beside.station_m + ahead_m;
                let reason = "it lies beyond the end of the ego vehicle's way";
                source.refuse_if(station_m >= self.ground.route.path.length_m(), mark, reason)?;
                self.ground.faces_on(source, mark, station_m, *heading)?;
                Beside { station_m, lanes_left, is_along: true, offset_m: *offset_m }
            }
            _ => self.ground.vehicle(source, mark, position)?,
        };
        if beside.offset_m.abs() > OFFSET_M_MAX {
            let reason = format!(
                "{:.2} m beside the middle of its lane: vehicles keep to the middle",
                beside.offset_m
            );
            return source.refuse(mark, reason);
        }
        let mps = speed(source, self.story, entity, 0)?;
        Some(Placed { entity, beside, mps })
    }
}

/// The speed with which an entity begins, m/s; it must keep it, unless it is the ego vehicle.
fn speed(source: &mut Source, story: &Story, entity: &Entity, depth: usize) -> Option<f64> {
    source.refuse_if(depth > story.others.len(), &entity.mark, "its speed is relative to itself")?;
    let is_ego = entity.name == story.ego.name;
    let mut mps = 0.0;
    for paced in &entity.speeds {
        let wanted = match &paced.speed {
            Speed::Absolute(mps) => *mps,
            Speed::More(name, more_mps) => speed_of(source, story, &paced.mark, name, depth)? + more_mps,
            Speed::Times(name, factor) => speed_of(source, story, &paced.mark, name, depth)? * factor,
        };
        source.refuse_if(wanted > *SPAWN_SPEED_MPS.end(), &paced.mark, too_fast(wanted))?;
        source.refuse_if(wanted < 0.0, &paced.mark, "no vehicle drives backwards")?;
        let at_begin = paced.when.is_empty() || paced.when.iter().any(|all| is_always(all));
        if at_begin && paced.at_once {
            mps = wanted;
        } else if (wanted - mps).abs() > 1e-9 && !is_ego {
            let reason = "a vehicle keeps the speed with which it appears, unless something is in its way";
            return source.refuse(&paced.mark, reason);
        }
    }
    Some(mps)
}

fn too_fast(mps: f64) -> String {
    format!("{mps:.1} m/s: nothing is faster than {} m/s", SPAWN_SPEED_MPS.end())
}

fn speed_of(source: &mut Source, story: &Story, mark: &Mark, name: &str, depth: usize) -> Option<f64> {
    let mut everyone = core::iter::once(&story.ego).chain(&story.others);
    match everyone.find(|entity| entity.name == name) {
        Some(entity) => speed(source, story, entity, depth + 1),
        None if source.is_torn(name) => None,
        None => source.refuse(mark, format!("no entity is called `{name}`")),
    }
}
