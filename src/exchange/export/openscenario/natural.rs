//! Other road users as a person would write them: where they begin, how fast, when they change speed and lane, which way
//! they take at junctions.
//!
//! Road users that follow a trajectory from the start are written as they are told ([`as_told`]). Others are approximated
//! (`pace` and `lanes` say how near), for players whose ego vehicle drives otherwise than the recorded one.
//! A pedestrian that set out as the ego vehicle came near does so when it comes as near. A road user that the ego vehicle
//! hit stops when it is hit.

use avastra_base::geometry::{Pose, Vec2};
use avastra_campaign::episode::Actor;
use avastra_lang::model::vocabulary::Verb;
use avastra_road::{LaneIndex, LanePlace, RoadMap};
use avastra_world::sim::{DT_S, VehicleParameters};

use super::super::recording::Recording;
use super::super::xml::Element;
use super::actions::{
    action, after_event, beneath, change_lane, event, event_at, from_time, lane_position, leaves, of_entity,
    position, route, speed, speed_within, teleport, touched, walk, within,
};
use super::entity::ahead_of_centre_m;
use super::lanes::{Driven, STRIDE, driven};
use super::pace::{Change, Pace, SPEED_MPS, WAY_M};
use super::story::{Cast, Newcomer};
use super::style::{BENEATH_M, Version};

/// A road user that moved less than this stands, m.
const STANDS_M: f64 = 0.1;
/// A way on foot keeps this near to its vertices, m.
const LINE_M: f64 = 0.05;
/// A way on foot that a contact cut short goes on straight for so long, m: in the player it may come a little later.
const ONWARD_M: f64 = 10.0;
/// A change of speed within this many ticks is written as instantaneous.
const ONCE_TICKS: usize = 10;
/// If the speed falls more than this many times faster than full braking allows, a contact caused it. The margin is
/// there because a fitted piece may be a little steeper than the recording.
const IMPACT_TIMES: f64 = 1.5;
/// The ego vehicle's distance decides when a pedestrian sets out if it came nearer by this much, m, within
/// [`COMES_TICKS`].
const COMES_M: f64 = 0.25;
const COMES_TICKS: usize = 25;
/// A route ends this far before the end of its last lane, m.
const END_M: f64 = 0.1;

/// A road user in actions.
pub struct Natural<'a> {
    version: Version,
    recording: &'a Recording,
    actor: &'a Actor,
    poses: Vec<Pose>,
    /// Where it is at first.
    place: Element,
    /// Its actions from the start on.
    from_the_first: Vec<Element>,
    events: Vec<Element>,
}

/// The others that follow their recorded ways in a natural version, too: they turn back onto the road that they come from. A
/// player that knows its place on a route by the road (esmini does) takes another way at such a junction.
pub fn exact(recording: &Recording) -> Vec<&Actor> {
    let exact = |actor: &&Actor| {
        let way = driven(&recording.map, &poses(recording, actor)).filter(|_| actor.is_vehicle());
        way.is_some_and(|way| turns_back(&recording.map, &way))
    };
    recording.seen.others.iter().filter(exact).collect()
}

/// Whether a way takes a turn that leads back to the road before it, and is not the only one there.
fn turns_back(map: &RoadMap, way: &Driven) -> bool {
    let road = |lane: &LaneIndex| map.lane(*lane).key.road.as_str();
    way.places.windows(2).filter(|pair| pair[0].lane != pair[1].lane).any(|pair| {
        let turn = map.lane(pair[1].lane);
        let leads_back = |before: &LaneIndex| {
            road(before) != turn.key.road
                && map.lane(*before).successors.len() > 1
                && turn.successors.iter().any(|after| road(after) == road(before))
        };
        turn.predecessors.iter().any(leads_back)
    })
}

/// The file's remark on its accuracy; `exact` are the road users that follow their recorded ways.
pub fn caveat(exact: &[&Actor]) -> (String, String) {
    let mut text = format!(
        "an approximation that does not carry the proof of the claims: others drive by actions, with speeds \
         within {SPEED_MPS} m/s and ways within {WAY_M} m of the recording as far as their actions alone decide, \
         contacts aside"
    );
    if !exact.is_empty() {
        text += &format!("; as recorded: {}", names(exact));
    }
    ("natural".to_owned(), text)
}

pub fn names(actors: &[&Actor]) -> String {
    actors.iter().map(|actor| actor.name()).collect::<Vec<_>>().join(", ")
}

/// How a road user begins and what it does, as the scenario tells it, and not as it was seen. This is for road users that
/// appear at the start, follow a trajectory, whatever comes, and get no orders later. `None` for others, and for orders
/// that no other tool knows.
pub fn as_told(recording: &Recording, actor: &Actor) -> Option<(Element, Vec<Element>)> {
    let own = recording.told.iter().position(|told| told.id == actor.id)?;
    if recording.told[own].request.verb != Verb::Follow {
        return None;
    }
    let of = |id: u32| recording.seen.others.iter().find(|other| other.id == id);
    let newcomers = recording.told.iter().map(|told| {
        let actor = of(told.id)?;
        let (request, course) = (&told.request, told.course.as_ref());
        Some(Newcomer { name: actor.name(), actor, request, course, facts: told.facts })
    });
    let cast = Cast {
        road: &recording.road,
        ego_front_m: VehicleParameters::MKZ.rear_axle_to_front_m,
        newcomers: newcomers.collect::<Option<_>>()?,
        duration_s: recording.duration_s(),
    };
    let (begins, mut events) = cast.story(own).ok()?;
    // It does nothing that it was to do after a contact.
    if let Some(touch) = touch(recording, actor) {
        let touched = actor.samples[touch].tick;
        let begun = actor.phases.iter().filter(|phase| phase.tick <= touched).count();
        events.truncate(begun);
    }
    events.extend(stop_where_hit(recording, actor));
    events.extend(leaves(recording.seen.end_tick, actor, Version::V1_2));
    Some((begins, events))
}

impl<'a> Natural<'a> {
    pub fn of(recording: &'a Recording, actor: &'a Actor, version: Version) -> Natural<'a> {
        let poses = poses(recording, actor);
        let place = position(&poses[0]);
        let (from_the_first, events) = (Vec::new(), Vec::new());
        let mut natural = Natural { version, recording, actor, poses, place, from_the_first, events };
        if !is_standing(&natural.poses) {
            match driven(&recording.map, &natural.poses).filter(|_| actor.is_vehicle()) {
                Some(way) => natural.drive_in_lanes(&way),
                None => natural.go_along_a_line(),
            }
        }
        natural.events.extend(stop_where_hit(recording, actor));
        natural.events.extend(leaves(recording.seen.end_tick, actor, version));
        natural
    }

    /// Its entry in `Init`, if it is there from the beginning, and what it does later.
    pub fn written(self) -> (Option<Element>, Vec<Element>) {
        let name = self.actor.name();
        let private = Element::new("Private").with("entityRef", &name);
        if self.actor.first_tick() == 0 {
            let begins = private.holding(teleport(self.place)).holding_all(self.from_the_first);
            return (Some(begins), self.events);
        }
        // CARLA's ScenarioRunner makes everyone as the scenario begins.
        let waits = || private.holding(teleport(beneath(&self.poses[0], BENEATH_M)));
        let waits = (self.version == Version::Carla).then(waits);
        let added = match self.version {
            Version::Carla => teleport(self.place),
            Version::V1_2 => of_entity(&name, Element::new("AddEntityAction").holding(self.place)),
        };
        let numbered = self.from_the_first.into_iter().enumerate();
        let actions = core::iter::once(action(&format!("{name}_added"), added))
            .chain(numbered.map(|(number, what)| action(&format!("{name}_begins_{}", number + 1), what)));
        let event = format!("{name}_appears");
        let appears = event_at(self.version, &event, actions.collect(), seconds(self.actor, 0));
        (waits, core::iter::once(appears).chain(self.events).collect())
    }

    /// A vehicle that drives in lanes.
    fn drive_in_lanes(&mut self, way: &Driven) {
        let name = self.actor.name();
        let pace = Pace::of(&places(&self.poses));
        self.place = lane_position(&self.recording.map, way.places[0]);
        self.from_the_first.push(speed(pace.first_mps));
        for (number, (from_s, route)) in routes(self.recording, self.actor, way).into_iter().enumerate() {
            if number == 0 {
                self.from_the_first.push(route);
                continue;
            }
            let event = format!("{name}_route_{}", number + 1);
            let turns = vec![action(&format!("{event}_taken"), route)];
            self.events.push(event_at(self.version, &format!("{event}_event"), turns, from_s));
        }
        self.events.extend(change_speeds(self.version, self.actor, pace.first_mps, &pace.changes));
        for (number, change) in way.changes.iter().enumerate() {
            let event = format!("{name}_lane_change_{}", number + 1);
            let metres = way_m(&self.poses, change.begin, change.length);
            let over = action(&event, change_lane(self.version, &name, change.lanes_left, metres));
            let from_s = seconds(self.actor, change.begin);
            self.events.push(event_at(self.version, &format!("{event}_event"), vec![over], from_s));
        }
    }

    /// A pedestrian, or what drives beside the lanes.
    fn go_along_a_line(&mut self) {
        let (name, poses) = (self.actor.name(), &self.poses);
        let is_cut = touch(self.recording, self.actor).is_some();
        let sets_out = (1..poses.len()).find(|at| !is_standing(&poses[..=*at]));
        // The last tick in which it stands.
        let begin = sets_out.map_or(0, |at| moving_before(poses, at));
        let moving = &poses[begin..];
        let pace = Pace::of(&places(moving));
        let mut changes = pace.changes.as_slice();
        let mut first_mps = pace.first_mps;
        if let [first, ..] = changes
            && first.to <= ONCE_TICKS
        {
            first_mps = first.target_mps;
            changes = &changes[1..];
        }
        let event_name = format!("{name}_sets_out");
        let actions = vec![
            action(&format!("{name}_speed_1"), speed(first_mps)),
            action(&format!("{name}_goes"), walk(self.version, &name, &line(moving, is_cut))),
        ];
        // A single speed needs no times after the first: the way ends where it stops.
        let stop = match changes {
            [] => true,
            [last] => last.target_mps == 0.0 && last.to - last.from <= ONCE_TICKS,
            _ => false,
        };
        let conditions = self.when(begin, stop);
        self.events.push(event(&event_name, actions, conditions));
        if !stop {
            let later = changes.iter().map(|change| Change {
                from: change.from + begin,
                to: change.to + begin,
                ..*change
            });
            let later: Vec<_> = later.collect();
            self.events.extend(change_speeds(self.version, self.actor, first_mps, &later));
        } else if !changes.is_empty() || is_cut {
            let stands = action(&format!("{name}_stands"), speed(0.0));
            let over = vec![after_event(&format!("{name}_is_there"), &event_name)];
            self.events.push(event(&format!("{name}_arrives"), vec![stands], over));
        }
    }

    /// When it sets out: as the ego vehicle comes near, if it came nearer than ever just then; else at the time.
    fn when(&self, begin: usize, by_distance: bool) -> Vec<Element> {
        let Natural { recording, actor, poses, .. } = self;
        let name = actor.name();
        let ego_ahead_m = ahead_of_centre_m(&recording.seen.ego);
        let away_m = |sample: usize| {
            let tick = usize::try_from(actor.first_tick()).unwrap_or(usize::MAX).saturating_add(sample);
            let ego = recording.seen.ego.samples.get(tick)?.pose.offset(ego_ahead_m, 0.0);
            Some((ego.position - poses[sample].position).norm())
        };
        let time = |at: usize| from_time(self.version, &format!("{name}_time"), seconds(actor, at));
        let nearer = by_distance.then(|| {
            let here_m = away_m(begin)?;
            let before = begin.checked_sub(COMES_TICKS)?;
            let comes = away_m(before)? - here_m >= COMES_M;
            let nearest_m = (0..begin).filter_map(away_m).fold(f64::INFINITY, f64::min);
            (comes && here_m < nearest_m).then_some(here_m)
        });
        match nearer.flatten() {
            // Until it has appeared, its distance means nothing.
            Some(here_m) => {
                let near = within(
                    self.version,
                    &format!("{name}_ego_is_near"),
                    (&recording.seen.ego.name(), &name),
                    here_m,
                );
                vec![time(0), near]
            }
            None => vec![time(begin)],
        }
    }
}

/// The events of its changes of speed, from the first on.
fn change_speeds(version: Version, actor: &Actor, first_mps: f64, changes: &[Change]) -> Vec<Element> {
    let mut before_mps = first_mps;
    let changed = |(number, change): (usize, &Change)| {
        let name = format!("{}_speed_{}", actor.name(), number + 2);
        let time_s = (change.to - change.from) as f64 * DT_S;
        let lost_mps = before_mps - change.target_mps;
        before_mps = change.target_mps;
        // In the middle of the piece, a jump costs no way.
        let (from_s, time_s) = match is_impact(actor, lost_mps, time_s) {
            true => (seconds(actor, change.from + (change.to - change.from) / 2), 0.0),
            false => (seconds(actor, change.from), time_s),
        };
        let action = action(&name, speed_within(change.target_mps, time_s));
        event_at(version, &format!("{name}_event"), vec![action], from_s)
    };
    changes.iter().enumerate().map(changed).collect()
}

/// Where it was, up to the tick in which the ego vehicle touches it: what follows is that contact's doing.
fn poses(recording: &Recording, actor: &Actor) -> Vec<Pose> {
    let until = touch(recording, actor).map_or(actor.samples.len(), |touch| touch + 1);
    let ahead_m = ahead_of_centre_m(actor);
    actor.samples[..until].iter().map(|sample| sample.pose.offset(ahead_m, 0.0)).collect()
}

/// The sample in which the ego vehicle first touches it.
fn touch(recording: &Recording, actor: &Actor) -> Option<usize> {
    let mut touches = recording.seen.touches.iter().filter(|touch| touch.id == actor.id);
    let touch = touches.next()?.tick.checked_sub(actor.first_tick())?;
    usize::try_from(touch).ok().filter(|touch| *touch < actor.samples.len())
}

fn places(poses: &[Pose]) -> Vec<Vec2> {
    poses.iter().map(|pose| pose.position).collect()
}

fn is_standing(poses: &[Pose]) -> bool {
    poses.iter().all(|pose| (pose.position - poses[0].position).norm() < STANDS_M)
}

/// The last sample before another one since which it has not stood still.
fn moving_before(poses: &[Pose], at: usize) -> usize {
    let moved = |sample: &usize| poses[*sample].position != poses[*sample - 1].position;
    (1..=at).rev().take_while(moved).last().map_or(at, |first| first - 1)
}

fn seconds(actor: &Actor, sample: usize) -> f64 {
    (actor.first_tick() as f64 + sample as f64) * DT_S
}

/// How far it comes within `length` samples from `begin`, m, at least 1 m. Beyond the last pose it goes on as fast as
/// before.
fn way_m(poses: &[Pose], begin: usize, length: usize) -> f64 {
    let seen = &poses[begin.min(poses.len() - 1)..(begin + length + 1).min(poses.len())];
    let seen_m: f64 = seen.windows(2).map(|pair| (pair[1].position - pair[0].position).norm()).sum();
    (seen_m * length as f64 / (seen.len() - 1).max(1) as f64).max(1.0)
}

/// Whether a contact caused a loss of speed within a time. The export writes such a loss as instantaneous, because a
/// player otherwise brakes only as hard as the vehicle's brakes allow.
fn is_impact(actor: &Actor, lost_mps: f64, time_s: f64) -> bool {
    lost_mps > IMPACT_TIMES * actor.shape.deceleration_mps2_max * time_s
}

/// A road user that the ego vehicle hits stops as it did then.
fn stop_where_hit(recording: &Recording, actor: &Actor) -> Option<Element> {
    let name = actor.name();
    let touch = touch(recording, actor)?;
    let (before, after) = (&actor.samples[..=touch], &actor.samples[touch..]);
    before.iter().any(|sample| sample.velocity_mps.norm() > SPEED_MPS).then_some(())?;
    let last_mps = after.last()?.velocity_mps.norm();
    let at_rest = after.iter().position(|sample| sample.velocity_mps.norm() <= last_mps).unwrap_or(0);
    let target_mps = if last_mps < SPEED_MPS { 0.0 } else { last_mps };
    let lost_mps = before[before.len() - 1].velocity_mps.norm() - target_mps;
    let time_s = at_rest as f64 * DT_S;
    let time_s = if is_impact(actor, lost_mps, time_s) { 0.0 } else { time_s };
    let slows = speed_within(target_mps, time_s);
    let hit = vec![touched(&format!("{name}_is_hit"), &name, &recording.seen.ego.name())];
    Some(event(&format!("{name}_after_contact"), vec![action(&format!("{name}_slows"), slows)], hit))
}

/// Routes over the lanes that were driven, each with the time at which it is taken; none where lanes leave no choice. No
/// route comes to a road twice, as a player knows its place on a route by the road: the next one begins before that.
fn routes(recording: &Recording, actor: &Actor, way: &Driven) -> Vec<(f64, Element)> {
    let map = &recording.map;
    let road = |places: &[LanePlace]| map.lane(places[0].lane).key.road.as_str();
    let stretches: Vec<&[LanePlace]> = way.places.chunk_by(|a, b| a.lane == b.lane).collect();
    let last = stretches.len() - 1;
    if stretches[..last].iter().all(|stretch| map.lane(stretch[0].lane).successors.len() < 2) {
        return Vec::new();
    }
    let mut begins = vec![0];
    for index in 1..=last {
        let begin = begins[begins.len() - 1];
        let is_new = road(stretches[index]) != road(stretches[index - 1]);
        if is_new && stretches[begin..index].iter().any(|stretch| road(stretch) == road(stretches[index])) {
            begins.push(index - 1);
        }
    }
    let ends = begins[1..].iter().copied().chain([last]);
    let routes = begins.iter().zip(ends).enumerate().map(|(number, (begin, end))| {
        let before: usize = stretches[..*begin].iter().map(|stretch| stretch.len()).sum();
        let half = if number == 0 { 0 } else { stretches[*begin].len() / 2 };
        let waypoint = |index: usize| {
            let place = stretches[index][if index == *begin { half } else { 0 }];
            let length_m = map.lane(place.lane).centre.length_m();
            let station_m = match index {
                _ if index == *begin => place.station_m,
                // The way leads on to the end of the last lane, for a player in which it comes farther.
                _ if index == end => (length_m - END_M).max(place.station_m),
                _ => length_m / 2.0,
            };
            lane_position(map, LanePlace { station_m, offset_m: 0.0, ..place })
        };
        let name = format!("{}_route_{}", actor.name(), number + 1);
        (seconds(actor, (before + half) * STRIDE), route(&name, (*begin..=end).map(waypoint)))
    });
    routes.collect()
}

/// A way with as few vertices as it needs, going on straight where it was cut.
fn line(poses: &[Pose], is_cut: bool) -> Vec<Pose> {
    let mut line = vec![poses[0]];
    let mut from = 0;
    while from + 1 < poses.len() {
        let is_straight = |to: &usize| {
            let way = poses[*to].position - poses[from].position;
            poses[from + 1..*to].iter().all(|pose| {
                let there = pose.position - poses[from].position;
                let along = (there.dot(&way) / way.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
                (there - way * along).norm() <= LINE_M
            })
        };
        from = (from + 1..poses.len()).rev().find(is_straight).unwrap_or(from + 1);
        line.push(poses[from]);
    }
    line.dedup_by(|next, before| (next.position - before.position).norm() < LINE_M);
    let last = line[line.len() - 1];
    let before = line.len().checked_sub(2).map(|index| line[index]);
    if let Some(before) = before.filter(|_| is_cut) {
        let way = last.position - before.position;
        let onward = last.position + way * (ONWARD_M / way.norm());
        line.push(Pose { position: onward, ..last });
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;
    use avastra_campaign::episode::Sample;

    #[test]
    fn full_braking_takes_its_time_and_an_impact_none() {
        let mut actor = Actor::ego();
        let sample = Sample { tick: 0, pose: Pose::new(0.0, 0.0, 0.0), velocity_mps: Vec2::zeros() };
        actor.samples.push(sample);
        let brakes_mps2 = actor.shape.deceleration_mps2_max;
        assert!(brakes_mps2 > 0.0);
        let natural = |lost_mps: f64| {
            let change = Change { from: 100, to: 150, target_mps: 0.0 };
            let events = change_speeds(Version::V1_2, &actor, lost_mps, &[change]);
            let [event] = &events[..] else { panic!("one event") };
            event.clone().document()
        };
        let brakes = natural(1.04 * brakes_mps2);
        assert!(is_linear(&brakes, "1") && brakes.contains("value=\"2\""), "{brakes}");
        let hit = natural(2.0 * brakes_mps2);
        assert!(hit.contains("\"step\"") && hit.contains("value=\"2.5\""), "{hit}");
    }

    fn is_linear(text: &str, time_s: &str) -> bool {
        text.contains("\"linear\"") && text.contains(&format!("value=\"{time_s}\""))
    }

    /// The boulevard has a turn back from road 3 to itself over 104, beside one that leads on over 101.
    #[test]
    fn a_turn_back_to_the_same_road_is_seen() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/roads/boulevard.xodr");
        let text = std::fs::read_to_string(path).expect("the map is there");
        let map = RoadMap::from_opendrive("boulevard", &text).expect("it is a map");
        let way = |lanes: &[(&str, i32)]| Driven {
            places: lanes
                .iter()
                .map(|(road, lane)| map.place(road, *lane, 1.0).expect("it is there"))
                .collect(),
            changes: Vec::new(),
        };
        assert!(turns_back(&map, &way(&[("3", -1), ("3", -1), ("104", -1), ("3", 2)])));
        assert!(turns_back(&map, &way(&[("3", -1), ("104", -1)])), "it need not be over");
        assert!(
            !turns_back(&map, &way(&[("104", -1), ("3", 2)])),
            "a vehicle that begins in it has no choice"
        );
        assert!(!turns_back(&map, &way(&[("3", -1), ("101", -1), ("12", -1)])));
    }
}
